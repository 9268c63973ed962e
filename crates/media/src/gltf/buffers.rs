//! The bytes of a glTF: the container of a binary one (glTF 2.0, "GLB File Format"), and the buffers, which are in it, in data URIs or in other files.

use std::{
    borrow::Cow,
    collections::{BTreeMap, BTreeSet},
};

use bansho_base::host::assets::AssetProblem;
use base64::{
    Engine, alphabet,
    engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig},
};

use super::{ReadResource, damaged, json::Object};
use crate::limits::MemoryLimit;

/// The contents of a binary glTF.
#[derive(Debug, PartialEq)]
pub(super) struct Glb<'a> {
    pub(super) json: &'a [u8],
    /// The buffer in the file.
    pub(super) binary: Option<&'a [u8]>,
}

/// A chunk of a binary glTF.
struct GlbChunk<'a> {
    kind: [u8; 4],
    bytes: &'a [u8],
}

impl<'a> Glb<'a> {
    /// Splits a binary glTF into its chunks.
    pub(super) fn split(file: &'a [u8]) -> Result<Self, AssetProblem> {
        let header = file.strip_prefix(b"glTF").and_then(take_number);
        let header = header.and_then(|(version, rest)| Some((version, take_number(rest)?)));
        let Some((version, (length, rest))) = header else {
            return Err(damaged("it is not a binary glTF: it does not begin with `glTF`, a version and a length"));
        };
        if version != 2 {
            return Err(damaged(format!("it is binary glTF of version {version}; allowed: 2")));
        }
        if length > file.len() {
            return Err(damaged(format!("it is truncated: it has {} of its {length} bytes", file.len())));
        }
        // The length includes the 12 bytes of the header. What follows the stated length is no part of the file.
        let rest = &rest[..length.saturating_sub(12).min(rest.len())];
        let (first, mut rest) = take_chunk(rest)?.ok_or_else(|| damaged("it has no JSON chunk"))?;
        if first.kind != *b"JSON" {
            return Err(damaged("its first chunk is not JSON"));
        }
        while let Some((next, after)) = take_chunk(rest)? {
            if next.kind == *b"BIN\0" {
                return Ok(Self { json: first.bytes, binary: Some(next.bytes) });
            }
            // Chunks of other kinds belong to extensions.
            rest = after;
        }
        Ok(Self { json: first.bytes, binary: None })
    }
}

/// The first chunk and what follows it; `None` at the end.
fn take_chunk(bytes: &[u8]) -> Result<Option<(GlbChunk<'_>, &[u8])>, AssetProblem> {
    let header = take_number(bytes).and_then(|(length, rest)| Some((length, rest.split_first_chunk::<4>()?)));
    let Some((length, (&kind, rest))) = header else { return Ok(None) };
    let (bytes, rest) = rest
        .split_at_checked(length)
        .ok_or_else(|| damaged(format!("a chunk is truncated: it has {} of its {length} bytes", rest.len())))?;
    Ok(Some((GlbChunk { kind, bytes }, rest)))
}

/// The first four bytes as a little-endian number, and what follows them.
fn take_number(bytes: &[u8]) -> Option<(usize, &[u8])> {
    let (number, rest) = bytes.split_first_chunk::<4>()?;
    Some((u32::from_le_bytes(*number) as usize, rest))
}

/// All buffers. A URI that occurs several times is read once.
pub(super) struct Buffers<'a> {
    contents: Vec<Cow<'a, [u8]>>,
    /// Index of each buffer's content.
    content_of: Vec<usize>,
}

impl<'a> Buffers<'a> {
    /// Reads them from `binary`, from data URIs, and by `read_resource`, within `limit` in total.
    pub(super) fn read(
        root: &Object<'a>,
        binary: Option<&'a [u8]>,
        read_resource: ReadResource,
        limit: MemoryLimit,
    ) -> Result<Self, AssetProblem> {
        let mut buffers = Self { contents: Vec::new(), content_of: Vec::new() };
        let mut slot_of_uri = BTreeMap::new();
        for buffer in root.items("buffers")? {
            let buffer = buffer?;
            let uri = buffer.text("uri")?;
            let slot = match slot_of_uri.get(&uri) {
                Some(&slot) => slot,
                None => {
                    let remaining = limit.available().saturating_sub(buffers.memory_bytes());
                    let content = content(&buffer, uri, binary, &|uri| read_resource(uri, remaining))?;
                    slot_of_uri.insert(uri, buffers.contents.len());
                    buffers.contents.push(content);
                    limit.check(buffers.memory_bytes())?;
                    buffers.contents.len() - 1
                }
            };
            let (claimed, available) = (buffer.required_unsigned("byteLength")?, buffers.contents[slot].len());
            if claimed > available {
                return Err(
                    buffer.error_at("byteLength", format!("is {claimed}, but the buffer has {available} bytes"))
                );
            }
            buffers.content_of.push(slot);
        }
        Ok(buffers)
    }

    /// Bytes of the contents that are not in the file itself.
    pub(super) fn memory_bytes(&self) -> u64 {
        let owned = self.contents.iter().filter(|content| matches!(content, Cow::Owned(_)));
        owned.map(|content| content.len() as u64).sum()
    }

    /// Number of buffers.
    pub(super) fn len(&self) -> usize {
        self.content_of.len()
    }

    /// The bytes of a buffer.
    pub(super) fn get(&self, index: usize) -> &[u8] {
        &self.contents[self.content_of[index]]
    }
}

/// URIs of external buffers, each once; of a damaged file, those that can be found.
pub(super) fn external_uris<'a>(root: &Object<'a>) -> BTreeSet<&'a str> {
    let buffers = root.items("buffers").into_iter().flatten().filter_map(Result::ok);
    let names = buffers.filter_map(|buffer| buffer.text("uri").ok().flatten());
    names.filter(|name| !name.starts_with("data:")).collect()
}

/// The bytes of a buffer: those of its `uri`, or without one the `binary` chunk of the file.
fn content<'a>(
    buffer: &Object,
    uri: Option<&'a str>,
    binary: Option<&'a [u8]>,
    read_resource: &dyn Fn(&str) -> Result<Vec<u8>, AssetProblem>,
) -> Result<Cow<'a, [u8]>, AssetProblem> {
    let Some(uri) = uri else {
        let borrowed = binary.map(Cow::Borrowed);
        return borrowed.ok_or_else(|| buffer.error_at("uri", "is missing, and the file has no binary buffer"));
    };
    let Some(data) = uri.strip_prefix("data:") else { return read_resource(uri).map(Cow::Owned) };
    let decoded = data.split_once(";base64,").and_then(|(_, text)| decode_base64(text));
    decoded.map(Cow::Owned).ok_or_else(|| buffer.error_at("uri", "is not base64; allowed: `data:...;base64,...`"))
}

/// Decodes base64 (RFC 4648), with or without padding: some writers of glTF leave it out.
fn decode_base64(text: &str) -> Option<Vec<u8>> {
    const LENIENT: GeneralPurposeConfig = GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true);
    GeneralPurpose::new(&alphabet::STANDARD, LENIENT).decode(text.trim_end_matches('=')).ok()
}

#[cfg(test)]
mod tests {
    use super::decode_base64;

    #[test]
    fn base64_is_read_with_and_without_padding() {
        for (text, bytes) in [("", ""), ("Zg==", "f"), ("Zm8", "fo"), ("Zm9v", "foo"), ("Zm9vYmE=", "fooba")] {
            assert_eq!(decode_base64(text).as_deref(), Some(bytes.as_bytes()));
        }
        assert_eq!([decode_base64("a b"), decode_base64("A")], [None, None]);
    }
}
