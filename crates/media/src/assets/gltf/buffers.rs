//! The buffers of a glTF.

use std::{
    borrow::Cow,
    collections::{BTreeMap, BTreeSet},
};

use bansho_base::host::assets::AssetProblem;
use base64::{
    Engine, alphabet,
    engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig},
};

use super::{ReadResource, json::Object};
use crate::assets::limits::MemoryLimit;

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
        let mut known = BTreeMap::new();
        for buffer in root.items("buffers")? {
            let buffer = buffer?;
            let uri = buffer.text("uri")?;
            let slot = match known.get(&uri) {
                Some(&slot) => slot,
                None => {
                    let remaining = limit.available().saturating_sub(buffers.memory_bytes());
                    let content = content(&buffer, uri, binary, &|uri| read_resource(uri, remaining))?;
                    known.insert(uri, buffers.contents.len());
                    buffers.contents.push(content);
                    limit.check(buffers.memory_bytes())?;
                    buffers.contents.len() - 1
                }
            };
            let (claimed, found) = (buffer.required_unsigned("byteLength")?, buffers.contents[slot].len());
            if claimed > found {
                return Err(buffer.error_at("byteLength", format!("is {claimed}, but the buffer has {found} bytes")));
            }
            buffers.content_of.push(slot);
        }
        Ok(buffers)
    }

    /// Bytes of the contents that are not in the file itself.
    pub(super) fn memory_bytes(&self) -> u64 {
        let own = self.contents.iter().filter(|content| matches!(content, Cow::Owned(_)));
        own.map(|content| content.len() as u64).sum()
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

fn content<'a>(
    buffer: &Object,
    uri: Option<&'a str>,
    binary: Option<&'a [u8]>,
    read_resource: &dyn Fn(&str) -> Result<Vec<u8>, AssetProblem>,
) -> Result<Cow<'a, [u8]>, AssetProblem> {
    let Some(uri) = uri else {
        let missing = || buffer.error_at("uri", "is missing, and the file has no binary buffer");
        return binary.map(Cow::Borrowed).ok_or_else(missing);
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
