//! Checks the coded data of a JPEG, since its decoder draws on through what is corrupt: that each scan has all blocks and nothing else, that its bits are codes of its
//! tables, that restart markers follow each other, and that no coefficient exceeds what a picture can have (ITU-T T.81, annexes B, F and G). Changes of bits within
//! a number stay unnoticed: nothing in a JPEG says what it was.

use super::huffman::{BitFault, Bits, HuffmanTable};

/// What is wrong with coded data, and where: bytes from the beginning of the file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum JpegFault {
    #[error("it ends without an end-of-image marker")]
    NoEnd,
    #[error("the data of a scan end early at byte {at}")]
    Short { at: usize },
    #[error("{bytes} bytes of a scan follow its last block at byte {at}")]
    Long { at: usize, bytes: usize },
    #[error("the bits after the last block of a scan are not those that fill a byte, at byte {at}")]
    Padding { at: usize },
    #[error("invalid Huffman code at byte {at}")]
    NoCode { at: usize },
    #[error("a block has more than 64 coefficients at byte {at}")]
    Coefficients { at: usize },
    #[error("coefficient out of range at byte {at}")]
    Range { at: usize },
    #[error("restart marker {found} instead of {expected} at byte {at}")]
    Restart { at: usize, found: u8, expected: u8 },
}

/// Largest magnitude of a coefficient: an orthonormal cosine transform of 64 values of up to 128, and of 32 more, by which some encoders overshoot white.
const LARGEST_COEFFICIENT: i64 = 8 * (128 + 32);
/// Visits of a block: of those that a progressive file may have, more than any encoder makes.
const VISITS: usize = 100;

/// The first fault of the first picture in `file`; `None` also for what is not coded by Huffman's method.
pub(super) fn fault(file: &[u8]) -> Option<JpegFault> {
    let mut walk = Walk { file, ..Walk::default() };
    match walk.picture() {
        Err(Stop::Fault(fault)) => Some(fault),
        Err(Stop::Unknown) | Ok(()) => None,
    }
}

/// Why a check ends.
enum Stop {
    Fault(JpegFault),
    /// Something that is not checked here.
    Unknown,
}

impl From<JpegFault> for Stop {
    fn from(fault: JpegFault) -> Self {
        Self::Fault(fault)
    }
}

/// A component of the frame.
struct FrameComponent {
    id: u8,
    /// Blocks of a unit, horizontally and vertically.
    sampling: [usize; 2],
    quantization: usize,
    /// Blocks that show something, in a row and in a column.
    blocks: [usize; 2],
    /// Blocks in a row of whole units.
    row: usize,
    /// Which coefficients of each block are not 0, in a progressive file.
    nonzero: Vec<u64>,
    /// The last DC coefficient.
    prediction: i64,
}

#[derive(Default)]
struct Walk<'a> {
    file: &'a [u8],
    quantizations: [Option<[u16; 64]>; 4],
    /// Of DC and AC coefficients.
    tables: [[Option<HuffmanTable>; 4]; 2],
    restart_interval: usize,
    components: Vec<FrameComponent>,
    is_progressive: bool,
    /// Units of all components, in a row and in a column.
    units: [usize; 2],
    visits_left: usize,
}

/// A scan's header.
struct Scan {
    /// Index of each component, and of its tables of DC and AC coefficients.
    members: Vec<(usize, [usize; 2])>,
    first: usize,
    last: usize,
    /// Whether bits refine earlier ones.
    refines: bool,
    /// Place of the lowest bit.
    low: u32,
}

impl<'a> Walk<'a> {
    fn picture(&mut self) -> Result<(), Stop> {
        let mut at = 2;
        loop {
            let (marker, after) = self.next_marker(at).ok_or(JpegFault::NoEnd)?;
            match marker {
                0xd9 => return Ok(()),
                0x01 | 0xd0..=0xd8 => {
                    at = after;
                    continue;
                }
                _ => {}
            }
            let length =
                self.file.get(after..after + 2).map(|pair| usize::from(u16::from_be_bytes([pair[0], pair[1]])));
            let end = length.map(|length| after + length.max(2)).ok_or(JpegFault::NoEnd)?;
            let body = self.file.get(after + 2..end).ok_or(JpegFault::NoEnd)?;
            at = end;
            match marker {
                0xc0..=0xc2 => self.frame(body, marker == 0xc2)?,
                0xc4 => self.huffman_tables(body)?,
                0xdb => self.quantization_tables(body)?,
                0xdd => self.restart_interval = byte_at(body, 0)? << 8 | byte_at(body, 1)?,
                0xda => at = self.scan(body, end)?,
                // Other methods, and a height that follows the scan.
                0xc3 | 0xc5..=0xcf | 0xdc => return Err(Stop::Unknown),
                _ => {}
            }
        }
    }

    /// The next marker from `at` on, and the position after it.
    fn next_marker(&self, at: usize) -> Option<(u8, usize)> {
        let mut at = at;
        loop {
            at += self.file.get(at..)?.iter().position(|byte| *byte == 0xff)?;
            match *self.file.get(at + 1)? {
                0 => at += 2,
                0xff => at += 1,
                marker => return Some((marker, at + 2)),
            }
        }
    }

    fn quantization_tables(&mut self, mut body: &[u8]) -> Result<(), Stop> {
        while let Some((kind, rest)) = body.split_first() {
            let wide = usize::from(kind >> 4 != 0);
            let bytes = rest.get(..64 << wide).ok_or(Stop::Unknown)?;
            let slot = self.quantizations.get_mut(usize::from(kind & 15)).ok_or(Stop::Unknown)?;
            // Steps in one byte or in two.
            *slot = Some(std::array::from_fn(|index| match wide {
                0 => u16::from(bytes[index]),
                _ => u16::from_be_bytes([bytes[2 * index], bytes[2 * index + 1]]),
            }));
            body = &rest[64 << wide..];
        }
        Ok(())
    }

    fn huffman_tables(&mut self, mut body: &[u8]) -> Result<(), Stop> {
        while let Some((kind, rest)) = body.split_first() {
            let (counts, rest) = rest.split_first_chunk::<16>().ok_or(Stop::Unknown)?;
            let total: usize = counts.iter().map(|count| usize::from(*count)).sum();
            let values = rest.get(..total).ok_or(Stop::Unknown)?;
            let class = self.tables.get_mut(usize::from(kind >> 4)).ok_or(Stop::Unknown)?;
            let slot = class.get_mut(usize::from(kind & 15)).ok_or(Stop::Unknown)?;
            *slot = Some(HuffmanTable::new(counts, values).ok_or(Stop::Unknown)?);
            body = &rest[total..];
        }
        Ok(())
    }

    /// Reads the header of the frame (T.81, B.2.2).
    fn frame(&mut self, body: &[u8], is_progressive: bool) -> Result<(), Stop> {
        let bits = byte_at(body, 0)?;
        let height = byte_at(body, 1)? << 8 | byte_at(body, 2)?;
        let width = byte_at(body, 3)? << 8 | byte_at(body, 4)?;
        // Not checked: 12 bits; a height of 0, which stands for one that follows the first scan; a second frame, as hierarchical files have.
        if bits != 8 || height == 0 || width == 0 || !self.components.is_empty() {
            return Err(Stop::Unknown);
        }
        let mut components = Vec::new();
        for index in 0..byte_at(body, 5)?.min(4) {
            let (id, sampling) = (byte_at(body, 6 + 3 * index)? as u8, byte_at(body, 7 + 3 * index)?);
            let sampling = [sampling >> 4, sampling & 15];
            let quantization = byte_at(body, 8 + 3 * index)?;
            if !sampling.iter().all(|side| (1..=4).contains(side)) {
                return Err(Stop::Unknown);
            }
            let (blocks, nonzero) = ([0; 2], Vec::new());
            components.push(FrameComponent { id, sampling, quantization, blocks, row: 0, nonzero, prediction: 0 });
        }
        self.components = components;
        // A unit has `sampling` blocks of each component, so its size in pixels is 8 times the largest sampling (T.81, A.2.3).
        let largest =
            [0, 1].map(|axis| self.components.iter().map(|component| component.sampling[axis]).max().unwrap_or(1));
        self.units = [width.div_ceil(8 * largest[0]), height.div_ceil(8 * largest[1])];
        self.is_progressive = is_progressive;
        for component in &mut self.components {
            let [units, sampling] = [self.units, component.sampling];
            component.blocks =
                [0, 1].map(|axis| ([width, height][axis] * sampling[axis]).div_ceil(largest[axis]).div_ceil(8));
            component.row = units[0] * sampling[0];
            let blocks = component.row * units[1] * sampling[1];
            self.visits_left = self.visits_left.saturating_add(VISITS.saturating_mul(blocks));
            component.nonzero = if is_progressive { vec![0; blocks] } else { Vec::new() };
        }
        Ok(())
    }

    /// Reads the header of a scan (T.81, B.2.3).
    fn scan_header(&self, body: &[u8]) -> Result<Scan, Stop> {
        let count = byte_at(body, 0)?;
        let mut members = Vec::with_capacity(count);
        for index in 0..count {
            let (id, tables) = (byte_at(body, 1 + 2 * index)?, byte_at(body, 2 + 2 * index)?);
            let component = self.components.iter().position(|component| usize::from(component.id) == id);
            members.push((component.ok_or(Stop::Unknown)?, [tables >> 4 & 3, tables & 3]));
        }
        let at = 1 + 2 * count;
        let (first, last, bits) = (byte_at(body, at)?, byte_at(body, at + 1)?, byte_at(body, at + 2)?);
        // Decoders take no notice of the band that a sequential file states: it is always whole.
        let [first, last] = if self.is_progressive { [first, last] } else { [0, 63] };
        let is_valid = !members.is_empty() && first <= last && last < 64;
        // A progressive scan is of DC coefficients, or of a band of AC coefficients of a single component (T.81, G.1.1.1.1).
        let fits = !self.is_progressive || if first == 0 { last == 0 } else { members.len() == 1 };
        if !(is_valid && fits) {
            return Err(Stop::Unknown);
        }
        Ok(Scan { members, first, last, refines: self.is_progressive && bits >> 4 != 0, low: bits as u32 & 15 })
    }

    /// Checks a scan whose data begin at `at`; returns where they end.
    fn scan(&mut self, header: &[u8], mut at: usize) -> Result<usize, Stop> {
        let scan = self.scan_header(header)?;
        let units = match &scan.members[..] {
            [(only, _)] => self.components[*only].blocks,
            _ => self.units,
        };
        let count = units[0] * units[1];
        let interval = if self.restart_interval == 0 { count } else { self.restart_interval };
        let (mut unit, mut restart) = (0, 0_u8);
        loop {
            // Where the file ends without a marker, as if one stood at its end.
            let (marker, after) = self.next_marker(at).unwrap_or((0xd9, self.file.len() + 2));
            let end = unit_end(self.file, after - 2);
            let until = (unit + interval).min(count);
            self.interval(&scan, units[0], unit..until, at..end.max(at))?;
            unit = until;
            if unit >= count {
                return Ok(after - 2);
            }
            if !(0xd0..=0xd7).contains(&marker) {
                return Err(JpegFault::Short { at: after - 2 }.into());
            }
            if marker - 0xd0 != restart {
                return Err(JpegFault::Restart { at: after - 2, found: marker - 0xd0, expected: restart }.into());
            }
            (restart, at) = ((restart + 1) % 8, after);
        }
    }

    /// Checks the units of a restart interval, whose data are at `bytes` of the file.
    fn interval(
        &mut self,
        scan: &Scan,
        row: usize,
        units: std::ops::Range<usize>,
        bytes: std::ops::Range<usize>,
    ) -> Result<(), Stop> {
        let file: &'a [u8] = self.file;
        let mut bits = Bits::new(&file[bytes.clone()]);
        self.components.iter_mut().for_each(|component| component.prediction = 0);
        let (mut unit, mut end_of_band) = (units.start, 0_usize);
        while unit < units.end {
            if end_of_band > 0 && !scan.refines {
                // Blocks without coefficients in this band: one code may stand for 2^15 of them, which are passed at once.
                let skipped = end_of_band.min(units.end - unit);
                (unit, end_of_band) = (unit + skipped, end_of_band - skipped);
                continue;
            }
            if let Err(fault) = self.unit(scan, [unit % row, unit / row], &mut bits, &mut end_of_band) {
                return Err(fault.located(bytes.start + bits.position(), bytes.end));
            }
            unit += 1;
        }
        if bits.has_rest() {
            let at = bytes.start + bits.position();
            return Err(JpegFault::Long { at, bytes: bytes.end - at.min(bytes.end) }.into());
        }
        if !bits.is_padding() {
            return Err(JpegFault::Padding { at: bytes.end.saturating_sub(1) }.into());
        }
        Ok(())
    }

    /// Checks a unit: a block of the scan's component, or as many of each as its sampling says.
    fn unit(
        &mut self,
        scan: &Scan,
        [x, y]: [usize; 2],
        bits: &mut Bits,
        end_of_band: &mut usize,
    ) -> Result<(), BlockFault> {
        for &(index, tables) in &scan.members {
            let component = &mut self.components[index];
            let [across, down] = if scan.members.len() == 1 { [1, 1] } else { component.sampling };
            let quantization = self.quantizations.get(component.quantization).and_then(Option::as_ref);
            let coder = BlockCoder {
                scan,
                dc: self.tables[0][tables[0]].as_ref(),
                ac: self.tables[1][tables[1]].as_ref(),
                quantization: quantization.ok_or(BlockFault::Unknown)?,
            };
            for position in 0..across * down {
                self.visits_left = self.visits_left.checked_sub(1).ok_or(BlockFault::Unknown)?;
                let block = (y * down + position / across) * component.row + x * across + position % across;
                match component.nonzero.get_mut(block) {
                    None => coder.sequential(bits, &mut component.prediction)?,
                    Some(_) if scan.first == 0 => coder.progressive_dc(bits, &mut component.prediction)?,
                    Some(nonzero) if scan.refines => coder.refined_ac(bits, nonzero, end_of_band)?,
                    Some(nonzero) => coder.first_ac(bits, nonzero, end_of_band)?,
                }
            }
        }
        Ok(())
    }
}

/// A byte of a segment, which is not checked if it is too short.
fn byte_at(body: &[u8], index: usize) -> Result<usize, Stop> {
    body.get(index).copied().map(usize::from).ok_or(Stop::Unknown)
}

/// The end of data before a marker at `at`, without bytes 0xff that may precede it.
fn unit_end(file: &[u8], at: usize) -> usize {
    let before = &file[..at.min(file.len())];
    // 0xff that is data is followed by 0.
    before.iter().rposition(|byte| *byte != 0xff).map_or(0, |last| last + 1)
}

/// What is wrong with a block.
enum BlockFault {
    Bits(BitFault),
    Coefficients,
    Range,
    Unknown,
}

impl BlockFault {
    /// The fault of the file, of a block whose bits are at byte `at` of data that end at byte `end`.
    fn located(self, at: usize, end: usize) -> Stop {
        match self {
            Self::Bits(BitFault::End) => JpegFault::Short { at: end }.into(),
            Self::Bits(BitFault::NoCode) => JpegFault::NoCode { at }.into(),
            Self::Coefficients => JpegFault::Coefficients { at }.into(),
            Self::Range => JpegFault::Range { at }.into(),
            Self::Unknown => Stop::Unknown,
        }
    }
}

impl From<BitFault> for BlockFault {
    fn from(fault: BitFault) -> Self {
        Self::Bits(fault)
    }
}

/// Reads blocks of a component in a scan. Coefficients are in zigzag order, the lowest frequency first.
struct BlockCoder<'t> {
    scan: &'t Scan,
    dc: Option<&'t HuffmanTable>,
    ac: Option<&'t HuffmanTable>,
    quantization: &'t [u16; 64],
}

impl BlockCoder<'_> {
    /// Checks that a coefficient is not larger than any picture's.
    fn check(&self, value: i64, index: usize) -> Result<(), BlockFault> {
        // One step more, by which an encoder may round up.
        let step = i64::from(self.quantization[index]);
        if value.abs().saturating_mul(step) > LARGEST_COEFFICIENT + step { Err(BlockFault::Range) } else { Ok(()) }
    }

    /// A DC coefficient, which is coded as the difference from the one before.
    fn dc(&self, bits: &mut Bits, prediction: &mut i64, low: u32) -> Result<(), BlockFault> {
        let category = bits.code(self.dc.ok_or(BlockFault::Unknown)?)?;
        *prediction += i64::from(bits.number(category)?);
        self.check(*prediction << low, 0)
    }

    /// A block of a sequential file (T.81, F.2.2).
    fn sequential(&self, bits: &mut Bits, prediction: &mut i64) -> Result<(), BlockFault> {
        self.dc(bits, prediction, 0)?;
        self.ac(bits, 0, [1, 63], &mut 0).map(|_| ())
    }

    /// New AC coefficients of the band from `first` to `last`, whose lowest bit is at `low`, in sequential files (T.81, F.2.2.2) as in progressive ones. They are
    /// marked in `nonzero`. Returns the number of zeros in the code that ends the band early; `None` if its last coefficient is coded.
    fn ac(
        &self,
        bits: &mut Bits,
        low: u32,
        [first, last]: [usize; 2],
        nonzero: &mut u64,
    ) -> Result<Option<usize>, BlockFault> {
        let table = self.ac.ok_or(BlockFault::Unknown)?;
        let mut index = first;
        while index <= last {
            let code = bits.code(table)?;
            let (zeros, category) = (usize::from(code >> 4), code & 15);
            if category == 0 {
                // A zero after fewer than 15 ends the band; with 15 it is one of 16.
                if zeros < 15 {
                    return Ok(Some(zeros));
                }
                index += 16;
                continue;
            }
            index += zeros;
            if index > last {
                return Err(BlockFault::Coefficients);
            }
            self.check(i64::from(bits.number(category)?) << low, index)?;
            *nonzero |= 1 << index;
            index += 1;
        }
        if index > last + 1 { Err(BlockFault::Coefficients) } else { Ok(None) }
    }

    /// The DC coefficient of a block in a progressive file (T.81, G.1.2.1).
    fn progressive_dc(&self, bits: &mut Bits, prediction: &mut i64) -> Result<(), BlockFault> {
        if self.scan.refines {
            bits.take(1)?;
            return Ok(());
        }
        self.dc(bits, prediction, self.scan.low)
    }

    /// The number of blocks, this one included, that have no more coefficients in the band.
    fn end_of_band(bits: &mut Bits, category: usize) -> Result<usize, BlockFault> {
        Ok((1 << category) + bits.take(category as u32)? as usize)
    }

    /// The first bits of a band of coefficients (T.81, G.1.2.2).
    fn first_ac(&self, bits: &mut Bits, nonzero: &mut u64, end_of_band: &mut usize) -> Result<(), BlockFault> {
        let Scan { first, last, low, .. } = *self.scan;
        if let Some(category) = self.ac(bits, low, [first, last], nonzero)? {
            *end_of_band = Self::end_of_band(bits, category)? - 1;
        }
        Ok(())
    }

    /// Further bits of a band of coefficients (T.81, G.1.2.3).
    fn refined_ac(&self, bits: &mut Bits, nonzero: &mut u64, end_of_band: &mut usize) -> Result<(), BlockFault> {
        let table = self.ac.ok_or(BlockFault::Unknown)?;
        // Coefficients that earlier scans made nonzero get one more bit each, and do not count among the zeros of a run.
        let (earlier_nonzero, last) = (*nonzero, self.scan.last);
        let mut index = self.scan.first;
        while *end_of_band == 0 && index <= last {
            let code = bits.code(table)?;
            let (mut zeros, category) = (usize::from(code >> 4), code & 15);
            match category {
                0 if zeros < 15 => {
                    *end_of_band = Self::end_of_band(bits, zeros)?;
                    break;
                }
                0 => {}
                1 => _ = bits.take(1)?,
                _ => return Err(BlockFault::Coefficients),
            }
            while index <= last {
                if earlier_nonzero >> index & 1 != 0 {
                    bits.take(1)?;
                } else if zeros == 0 {
                    break;
                } else {
                    zeros -= 1;
                }
                index += 1;
            }
            if category == 1 {
                if index > last {
                    return Err(BlockFault::Coefficients);
                }
                *nonzero |= 1 << index;
            }
            index += 1;
        }
        if *end_of_band > 0 {
            // Bits of correction are there also in blocks without new coefficients.
            for _ in (index..=last).filter(|index| earlier_nonzero >> index & 1 != 0) {
                bits.take(1)?;
            }
            *end_of_band -= 1;
        }
        Ok(())
    }
}
