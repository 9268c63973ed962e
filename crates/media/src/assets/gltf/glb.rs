//! The container of a binary glTF (glTF 2.0, "GLB File Format"): a header and chunks, little-endian.

use bansho_base::host::assets::AssetProblem;

use super::damaged;

/// The contents of a binary glTF.
#[derive(Debug, PartialEq)]
pub(super) struct Glb<'a> {
    pub(super) json: &'a [u8],
    /// The buffer in the file.
    pub(super) binary: Option<&'a [u8]>,
}

/// Splits a binary glTF into its chunks.
pub(super) fn split(file: &[u8]) -> Result<Glb<'_>, AssetProblem> {
    let not_glb = || damaged("it is not a binary glTF: it does not begin with `glTF`, a version and a length");
    let rest = file.strip_prefix(b"glTF").ok_or_else(not_glb)?;
    let (version, rest) = number(rest).ok_or_else(not_glb)?;
    let (length, rest) = number(rest).ok_or_else(not_glb)?;
    if version != 2 {
        return Err(damaged(format!("it is binary glTF of version {version}; allowed: 2")));
    }
    if length > file.len() {
        return Err(damaged(format!("it is truncated: it has {} of its {length} bytes", file.len())));
    }
    let rest = &rest[..length.saturating_sub(12).min(rest.len())];
    let (first, mut rest) = chunk(rest)?.ok_or_else(|| damaged("it has no JSON chunk"))?;
    if first.kind != *b"JSON" {
        return Err(damaged("its first chunk is not JSON"));
    }
    while let Some((next, after)) = chunk(rest)? {
        if next.kind == *b"BIN\0" {
            return Ok(Glb { json: first.bytes, binary: Some(next.bytes) });
        }
        // Chunks of other kinds belong to extensions.
        rest = after;
    }
    Ok(Glb { json: first.bytes, binary: None })
}

struct Chunk<'a> {
    kind: [u8; 4],
    bytes: &'a [u8],
}

/// The first chunk and what follows it; `None` at the end.
fn chunk(bytes: &[u8]) -> Result<Option<(Chunk<'_>, &[u8])>, AssetProblem> {
    let header = number(bytes).and_then(|(length, rest)| Some((length, rest.split_first_chunk::<4>()?)));
    let Some((length, (&kind, rest))) = header else { return Ok(None) };
    let (bytes, rest) = rest
        .split_at_checked(length)
        .ok_or_else(|| damaged(format!("a chunk is truncated: it has {} of its {length} bytes", rest.len())))?;
    Ok(Some((Chunk { kind, bytes }, rest)))
}

fn number(bytes: &[u8]) -> Option<(usize, &[u8])> {
    let (number, rest) = bytes.split_first_chunk::<4>()?;
    Some((u32::from_le_bytes(*number) as usize, rest))
}
