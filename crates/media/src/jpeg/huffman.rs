//! Huffman codes and bits of the scans of a JPEG (ITU-T T.81, annexes C and F).

/// A Huffman table.
pub(super) struct HuffmanTable {
    /// For the next eight bits: length and value of the code that they begin with, if it has up to eight bits, else 0.
    short: Vec<[u8; 2]>,
    /// For each length, the first code beyond those of this length, as 16 bits; and what leads from a code of this length to its value.
    beyond: [u32; 17],
    offset: [i32; 17],
    values: Vec<u8>,
}

impl HuffmanTable {
    /// The table with `counts[i]` codes of `i + 1` bits for these values; `None` if there are more codes of a length than there can be.
    pub(super) fn new(counts: &[u8; 16], values: &[u8]) -> Option<Self> {
        let mut table = Self { short: vec![[0; 2]; 256], beyond: [0; 17], offset: [0; 17], values: values.to_vec() };
        let (mut code, mut index) = (0_u32, 0_usize);
        for length in 1..=16_usize {
            table.offset[length] = index as i32 - code as i32;
            for _ in 0..counts[length - 1] {
                let value = *values.get(index)?;
                if code >> length != 0 {
                    return None;
                }
                if length <= 8 {
                    let first = (code << (8 - length)) as usize;
                    table.short[first..first + (1 << (8 - length))].fill([length as u8, value]);
                }
                (code, index) = (code + 1, index + 1);
            }
            // Codes of a length follow those of the shorter ones in numeric order (T.81, annex C).
            table.beyond[length] = code << (16 - length);
            code <<= 1;
        }
        Some(table)
    }

    /// Length and value of the code that these 16 bits begin with.
    fn find(&self, bits: u32) -> Option<[u8; 2]> {
        let short = self.short[(bits >> 8) as usize];
        if short[0] != 0 {
            return Some(short);
        }
        let length = (9..=16).find(|length| bits < self.beyond[*length])?;
        let index = (bits >> (16 - length)) as i32 + self.offset[length];
        let value = self.values.get(usize::try_from(index).ok()?)?;
        Some([length as u8, *value])
    }
}

/// Why bits cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum BitFault {
    /// There are no more.
    End,
    /// They begin no code.
    NoCode,
}

/// The bits between two markers.
pub(super) struct Bits<'a> {
    /// The bytes between the markers; 0 follows each 0xff.
    bytes: &'a [u8],
    position: usize,
    buffer: u64,
    available: u32,
}

impl<'a> Bits<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, position: 0, buffer: 0, available: 0 }
    }

    /// Position of the byte with the next bit, at most one too far.
    pub(super) fn position(&self) -> usize {
        self.position.saturating_sub(self.available as usize / 8)
    }

    /// Whether more is left than bits that fill a byte.
    pub(super) fn has_rest(&self) -> bool {
        self.available >= 8 || self.position < self.bytes.len()
    }

    /// Whether what is left, less than a byte, is what fills it: ones, as T.81 has it (F.1.2.3), or zeros, which some encoders write.
    pub(super) fn is_padding(&self) -> bool {
        let ones = (1_u64 << self.available) - 1;
        [0, ones].contains(&(self.buffer & ones))
    }

    fn fill(&mut self) {
        // Up to 56 bits, since a byte must fit above; a code or a number takes up to 16.
        while self.available <= 48 {
            let Some(byte) = self.bytes.get(self.position) else { return };
            // 0 follows each 0xff that is data, and is no data itself.
            self.position += if *byte == 0xff { 2 } else { 1 };
            self.buffer = self.buffer << 8 | u64::from(*byte);
            self.available += 8;
        }
    }

    /// The value of the next code.
    pub(super) fn code(&mut self, table: &HuffmanTable) -> Result<u8, BitFault> {
        self.fill();
        let bits = match self.available {
            available @ 16.. => self.buffer >> (available - 16),
            // Beyond the end there are ones, with which encoders fill.
            available => self.buffer << (16 - available) | ((1 << (16 - available)) - 1),
        };
        match table.find(bits as u32 & 0xffff) {
            Some([length, value]) if u32::from(length) <= self.available => {
                self.available -= u32::from(length);
                Ok(value)
            }
            _ if self.available < 16 => Err(BitFault::End),
            _ => Err(BitFault::NoCode),
        }
    }

    /// The next `count` bits, up to 16.
    pub(super) fn take(&mut self, count: u32) -> Result<i32, BitFault> {
        self.fill();
        self.available = self.available.checked_sub(count).ok_or(BitFault::End)?;
        Ok((self.buffer >> self.available) as i32 & ((1 << count) - 1))
    }

    /// The next number of a category (T.81, F.2.2.1).
    pub(super) fn number(&mut self, category: u8) -> Result<i32, BitFault> {
        let category = u32::from(category).min(16);
        let bits = self.take(category)?;
        let is_negative = category > 0 && bits >> (category - 1) == 0;
        Ok(if is_negative { bits - (1 << category) + 1 } else { bits })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_of_the_standard_are_read() {
        // T.81, table K.3: differences of luminance DC: 2 bits 00 is category 0, 010 is 1, ..., 111111110 is 11.
        let counts = [0, 1, 5, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0];
        let table = HuffmanTable::new(&counts, &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11]).unwrap();
        // 00, 010 1, 110 010, 111111110, ones.
        let bytes = [0b0001_0111, 0b0010_1111, 0b1111_0111];
        let mut bits = Bits::new(&bytes);
        assert_eq!((bits.code(&table), bits.code(&table), bits.number(1)), (Ok(0), Ok(1), Ok(1)));
        assert_eq!((bits.code(&table), bits.number(3)), (Ok(5), Ok(-5)));
        assert_eq!(bits.code(&table), Ok(11));
        assert!(!bits.has_rest() && bits.is_padding());
        assert_eq!((bits.code(&table), bits.take(4)), (Err(BitFault::End), Err(BitFault::End)));
        let ones = [0xff, 0, 0xff, 0, 0xff, 0];
        assert_eq!(Bits::new(&ones).code(&table), Err(BitFault::NoCode));
        assert!(Bits::new(&ones).has_rest());
        assert_eq!(Bits::new(&ones).take(9), Ok(511));
    }

    #[test]
    fn tables_with_too_many_codes_are_none() {
        let mut counts = [0; 16];
        counts[0] = 3;
        assert!(HuffmanTable::new(&counts, &[0; 3]).is_none());
        counts[0] = 2;
        assert!(HuffmanTable::new(&counts, &[0; 2]).is_some() && HuffmanTable::new(&counts, &[0]).is_none());
    }
}
