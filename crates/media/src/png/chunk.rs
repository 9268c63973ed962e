//! PNG chunks: length, type, data, CRC (PNG third edition, section 5.3).

/// First bytes of every PNG.
pub(crate) const SIGNATURE: [u8; 8] = *b"\x89PNG\r\n\x1a\n";

/// One chunk of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PngChunk<'a> {
    pub(crate) kind: [u8; 4],
    pub(crate) contents: &'a [u8],
}

/// Iterator over the chunks of a file; ends with `Err` at a truncated chunk or a wrong CRC.
pub(crate) struct Chunks<'a>(&'a [u8]);

/// A chunk that is truncated or damaged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct BrokenChunk;

/// The chunks of `file`; `None` if it does not begin as a PNG.
pub(crate) fn chunks(file: &[u8]) -> Option<Chunks<'_>> {
    file.strip_prefix(&SIGNATURE).map(Chunks)
}

impl<'a> Iterator for Chunks<'a> {
    type Item = Result<PngChunk<'a>, BrokenChunk>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.0.is_empty() {
            return None;
        }
        let chunk = split(self.0);
        // Nothing is read beyond damage: the length of a damaged chunk cannot be trusted.
        self.0 = chunk.map_or(&[], |(_, rest)| rest);
        Some(chunk.map(|(chunk, _)| chunk).ok_or(BrokenChunk))
    }
}

/// The first chunk and what follows it; `None` if it is truncated or damaged.
fn split(bytes: &[u8]) -> Option<(PngChunk<'_>, &[u8])> {
    let (length, bytes) = bytes.split_first_chunk::<4>()?;
    let (kind, bytes) = bytes.split_first_chunk::<4>()?;
    let (contents, bytes) = bytes.split_at_checked(u32::from_be_bytes(*length) as usize)?;
    let (checksum, rest) = bytes.split_first_chunk::<4>()?;
    let chunk = PngChunk { kind: *kind, contents };
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(kind);
    hasher.update(contents);
    (u32::from_be_bytes(*checksum) == hasher.finalize()).then_some((chunk, rest))
}

/// Appends a chunk with the concatenated `slices` as its data, at most 2^31 - 1 bytes.
pub(crate) fn push(file: &mut Vec<u8>, kind: [u8; 4], slices: &[&[u8]]) {
    let length: usize = slices.iter().map(|slice| slice.len()).sum();
    file.extend((length as u32).to_be_bytes());
    let start = file.len();
    file.extend(kind);
    slices.iter().for_each(|slice| file.extend_from_slice(slice));
    let checksum = crc32fast::hash(&file[start..]);
    file.extend(checksum.to_be_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_are_read_as_they_were_written_and_damage_is_seen() {
        let mut file = SIGNATURE.to_vec();
        push(&mut file, *b"tEXt", &[b"a", b"", b"bc"]);
        push(&mut file, *b"IEND", &[]);
        let read: Vec<_> = chunks(&file).unwrap().collect::<Result<_, _>>().unwrap();
        assert_eq!(read[0], PngChunk { kind: *b"tEXt", contents: b"abc" });
        assert_eq!(read[1], PngChunk { kind: *b"IEND", contents: b"" });
        for cut in 9..file.len() {
            if cut != file.len() - 12 {
                assert!(chunks(&file[..cut]).unwrap().any(|chunk| chunk.is_err()), "cut at {cut}");
            }
        }
        for index in 8..file.len() {
            let mut damaged = file.clone();
            damaged[index] ^= 4;
            assert!(chunks(&damaged).unwrap().any(|chunk| chunk.is_err()), "damaged at {index}");
        }
        assert!(chunks(b"GIF89a").is_none());
    }
}
