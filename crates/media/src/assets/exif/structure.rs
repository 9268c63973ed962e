//! Finds what is wrong in the directories of Exif data (TIFF 6.0, section 2), since their reader does not say where.

/// Directories that are followed: an image has at most six.
const MAX_DIRECTORIES: usize = 32;
/// Bytes of an entry of a directory.
const ENTRY: usize = 12;
/// Tags whose value is the position of another directory: Exif, GPS and interoperability.
const DIRECTORY_TAGS: [usize; 3] = [0x8769, 0x8825, 0xa005];

/// Position of the first thing in a block that points outside it or has no meaning; the block begins with its TIFF header. `None` if nothing is found.
pub(super) fn first_fault(block: &[u8]) -> Option<usize> {
    let structure = match block {
        [b'I', b'I', ..] => Structure { block, number: |bytes| bytes.iter().rev().fold(0, join) },
        [b'M', b'M', ..] => Structure { block, number: |bytes| bytes.iter().fold(0, join) },
        _ => return Some(0),
    };
    if structure.number(2, 2) != Some(42) {
        return Some(2);
    }
    structure.first_fault().err()
}

fn join(number: usize, byte: &u8) -> usize {
    number << 8 | usize::from(*byte)
}

struct Structure<'a> {
    block: &'a [u8],
    /// Reads a number in the byte order.
    number: fn(&[u8]) -> usize,
}

impl Structure<'_> {
    fn number(&self, at: usize, bytes: usize) -> Option<usize> {
        self.block.get(at..at.checked_add(bytes)?).map(self.number)
    }

    /// The first fault as an error.
    fn first_fault(&self) -> Result<(), usize> {
        // Positions of directories, and of what names them.
        let mut pending = vec![(self.number(4, 4).ok_or(4_usize)?, 4)];
        for _ in 0..MAX_DIRECTORIES {
            let Some((directory, named_at)) = pending.pop() else { return Ok(()) };
            let count = self.number(directory, 2).ok_or(named_at)?;
            for entry in (0..count).map(|index| directory + 2 + ENTRY * index) {
                pending.extend(self.entry(entry)?.map(|position| (position, entry + 8)));
            }
            let next_at = directory + 2 + ENTRY * count;
            // Some writers leave it out behind the last directory.
            let next = self.number(next_at, 4).unwrap_or(0);
            pending.extend((next != 0).then_some((next, next_at)));
        }
        Ok(())
    }

    /// The directory that an entry names, if it does.
    fn entry(&self, at: usize) -> Result<Option<usize>, usize> {
        let field = |offset, bytes| self.number(at + offset, bytes).ok_or(at);
        let (tag, kind, count, value) = (field(0, 2)?, field(2, 2)?, field(4, 4)?, field(8, 4)?);
        let bytes = match kind {
            1 | 2 | 6 | 7 => 1,
            3 | 8 => 2,
            4 | 9 | 11 | 13 => 4,
            5 | 10 | 12 => 8,
            _ => return Err(at + 2),
        };
        let length = count.saturating_mul(bytes);
        if length > 4 && value.saturating_add(length) > self.block.len() {
            return Err(at + 8);
        }
        Ok(DIRECTORY_TAGS.contains(&tag).then_some(value))
    }
}
