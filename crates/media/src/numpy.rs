//! Depth in NumPy's `.npy` files (NumPy Enhancement Proposal 1): a header in the syntax of Python, then the values of an array.

use bansho_base::{
    host::assets::{AssetProblem, DepthMap},
    image::Image,
};

use crate::{
    decode::damaged,
    limits::{self, MemoryLimit},
};

/// Types of values that are read.
const ALLOWED: &str = "float16, float32, float64, or integers of 8 to 64 bits";

/// The header of an array.
#[derive(Debug, PartialEq)]
struct NpyHeader {
    /// Such as `<f4`: byte order, kind and bytes.
    descr: String,
    fortran_order: bool,
    shape: Vec<u64>,
}

/// Decodes an array of shape (height, width), or with further sides of 1, as depth.
pub(crate) fn depth(file: &[u8], limit: MemoryLimit) -> Result<DepthMap, AssetProblem> {
    let (header, data) = split(file)?;
    let header = parse(header)?;
    let sides: Vec<u64> = header.shape.iter().copied().filter(|side| *side != 1).collect();
    let [height, width] = match (&header.shape[..], &sides[..]) {
        (&[height, width], _) => [height, width],
        (_, &[height, width]) => [height, width],
        (shape, _) => {
            return Err(damaged(format!("it has the shape {shape:?}; allowed: (height, width), further sides of 1")));
        }
    };
    let [width, height] = limits::check_size([width, height])?;
    let reader = ValueReader::of(&header.descr)?;
    let claimed_bytes = width * height * reader.bytes as u64;
    if claimed_bytes > data.len() as u64 {
        let reason = format!("its values take {claimed_bytes} bytes, and the file has {} of them", data.len());
        return Err(damaged(reason));
    }
    limit.check(file.len() as u64 + width * height * size_of::<f32>() as u64)?;
    let [width, height] = [width as usize, height as usize];
    let mut values = Vec::with_capacity(width * height);
    for row in 0..height {
        for column in 0..width {
            // In the order of Fortran the first index, the row, varies fastest.
            let position = if header.fortran_order { column * height + row } else { row * width + column };
            values.push([reader.value(&data[position * reader.bytes..][..reader.bytes])]);
        }
    }
    let values = Image::from_pixels(width, height, values).ok_or_else(|| damaged("its values do not fill it"))?;
    Ok(DepthMap { values, remarks: Vec::new() })
}

/// The header and the values.
fn split(file: &[u8]) -> Result<(&[u8], &[u8]), AssetProblem> {
    let rest = file.strip_prefix(b"\x93NUMPY").ok_or_else(|| damaged("it does not begin as a .npy file"))?;
    let (&[major, _], rest) = rest.split_first_chunk::<2>().ok_or_else(truncated)?;
    // Version 1.0 has two bytes for the length of the header; later ones have four, for arrays of many named fields.
    let (length, rest) = match major {
        1 => rest.split_first_chunk::<2>().map(|(length, rest)| (u16::from_le_bytes(*length) as usize, rest)),
        2 | 3 => rest.split_first_chunk::<4>().map(|(length, rest)| (u32::from_le_bytes(*length) as usize, rest)),
        _ => return Err(damaged(format!("it has version {major} of the format; allowed: 1 to 3"))),
    }
    .ok_or_else(truncated)?;
    rest.split_at_checked(length).ok_or_else(truncated)
}

fn truncated() -> AssetProblem {
    damaged("its header is truncated")
}

/// The text after a key of the header.
fn after_key<'t>(header: &'t str, key: &str) -> Result<&'t str, AssetProblem> {
    let value = header.split_once(&format!("'{key}'")).and_then(|(_, rest)| rest.split_once(':'));
    value.map(|(_, value)| value.trim_start()).ok_or_else(|| damaged(format!("its header has no `{key}`")))
}

/// Reads `{'descr': '<f4', 'fortran_order': False, 'shape': (3, 4), }`.
fn parse(header: &[u8]) -> Result<NpyHeader, AssetProblem> {
    let text = std::str::from_utf8(header).map_err(|_| damaged("its header is not text"))?;
    let descr = after_key(text, "descr")?;
    // A list of tuples is the description of an array of records.
    let quoted = descr.strip_prefix('\'').and_then(|rest| rest.split_once('\''));
    let descr = quoted.map(|(value, _)| value.to_owned());
    let descr = descr.ok_or_else(|| damaged(format!("it has values of several kinds; allowed: {ALLOWED}")))?;
    let shape = after_key(text, "shape")?.strip_prefix('(').and_then(|rest| rest.split_once(')'));
    let sides = shape.map(|(list, _)| list.split(',').map(str::trim).filter(|side| !side.is_empty()));
    let shape = sides.and_then(|sides| sides.map(|side| side.parse().ok()).collect());
    let shape = shape.ok_or_else(|| damaged("its shape cannot be read"))?;
    Ok(NpyHeader { descr, fortran_order: after_key(text, "fortran_order")?.starts_with("True"), shape })
}

/// How a value is read.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ValueReader {
    kind: ValueKind,
    bytes: usize,
    big_endian: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum ValueKind {
    Float,
    Signed,
    Unsigned,
}

impl ValueReader {
    fn of(descr: &str) -> Result<Self, AssetProblem> {
        Self::parse(descr)
            .ok_or_else(|| damaged(format!("it has values of the type `{}`; allowed: {ALLOWED}", descr.escape_debug())))
    }

    /// Parses a type such as `<f4`; `None` for one that is not read.
    fn parse(descr: &str) -> Option<Self> {
        let mut letters = descr.chars();
        let big_endian = match letters.next()? {
            // `|` is for single bytes, and `=` for the machine that wrote the file: taken for little-endian, as nearly all are.
            '<' | '|' | '=' => false,
            '>' => true,
            _ => return None,
        };
        let kind = match letters.next()? {
            'f' => ValueKind::Float,
            'i' => ValueKind::Signed,
            'u' => ValueKind::Unsigned,
            _ => return None,
        };
        let bytes = letters.as_str().parse().ok()?;
        let is_supported = matches!((kind, bytes), (ValueKind::Float, 2) | (_, 4 | 8))
            || kind != ValueKind::Float && matches!(bytes, 1 | 2);
        is_supported.then_some(Self { kind, bytes, big_endian })
    }

    /// The value in `bytes`, of which there are `self.bytes`.
    fn value(self, bytes: &[u8]) -> f32 {
        let mut word = [0_u8; 8];
        word[..self.bytes].copy_from_slice(bytes);
        if self.big_endian {
            word[..self.bytes].reverse();
        }
        let unsigned = u64::from_le_bytes(word);
        match (self.kind, self.bytes) {
            (ValueKind::Float, 2) => half::f16::from_bits(unsigned as u16).to_f32(),
            (ValueKind::Float, 4) => f32::from_bits(unsigned as u32),
            (ValueKind::Float, _) => f64::from_bits(unsigned) as f32,
            (ValueKind::Unsigned, _) => unsigned as f32,
            (ValueKind::Signed, bytes) => {
                // Up to the highest bit and down again, which repeats the sign.
                let shift = 64 - 8 * bytes as u32;
                ((unsigned << shift).cast_signed() >> shift) as f32
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(dictionary: &str, data: &[u8]) -> Vec<u8> {
        let mut file = b"\x93NUMPY\x01\x00".to_vec();
        file.extend((dictionary.len() as u16).to_le_bytes());
        file.extend(dictionary.as_bytes());
        file.extend(data);
        file
    }

    fn read(descr: &str, order: &str, shape: &str, data: &[u8]) -> Result<Vec<f32>, String> {
        let text = format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': {shape}, }}\n");
        let map = depth(&file(&text, data), MemoryLimit::default()).map_err(|error| error.to_string())?;
        Ok(map.values.pixels().as_flattened().to_vec())
    }

    #[test]
    fn arrays_of_every_kind_are_read_in_both_orders() {
        let ramp = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        let bytes: Vec<u8> = ramp.iter().flat_map(|value: &f32| value.to_le_bytes()).collect();
        assert_eq!(read("<f4", "False", "(2, 3)", &bytes).unwrap(), ramp);
        assert_eq!(read("<f4", "False", "(1, 2, 3, 1)", &bytes).unwrap(), ramp);
        // Columns first: the array [[1, 3, 5], [2, 4, 6]].
        assert_eq!(read("<f4", "True", "(2, 3)", &bytes).unwrap(), [1.0, 3.0, 5.0, 2.0, 4.0, 6.0]);
        assert_eq!(read(">u2", "False", "(1, 2)", &[1, 0, 255, 255]).unwrap(), [256.0, 65535.0]);
        assert_eq!(read("|i1", "False", "(1, 2)", &[255, 3]).unwrap(), [-1.0, 3.0]);
        assert_eq!(read("<f8", "False", "(1, 1)", &2.5_f64.to_le_bytes()).unwrap(), [2.5]);
        assert_eq!(read("<f2", "False", "(1, 1)", &[0, 0x3c]).unwrap(), [1.0]);
    }

    #[test]
    fn other_arrays_are_refused_with_the_reason() {
        for (descr, shape, words) in [
            ("|O", "(2, 3)", "type `|O`; allowed: float16"),
            ("<c8", "(2, 3)", "type `<c8`"),
            ("<f4", "(2, 3, 4)", "the shape [2, 3, 4]; allowed: (height, width)"),
            ("<f4", "(6,)", "the shape [6]"),
            ("<f4", "(2, 3)", "take 24 bytes, and the file has 0"),
            ("<f4", "(0, 3)", "claims 3 x 0 pixels"),
            ("<f4", "(x)", "its shape cannot be read"),
            ("<f4", "(99999, 99999)", "claims 99999 x 99999 pixels"),
        ] {
            let told = read(descr, "False", shape, &[]).unwrap_err();
            assert!(told.contains(words), "{told}");
        }
        let several = "{'descr': [('x', '<f4')], 'fortran_order': False, 'shape': (1, 1), }";
        assert!(depth(&file(several, &[]), MemoryLimit::default()).unwrap_err().to_string().contains("several kinds"));
        let whole = file("{'descr': '<f4', 'fortran_order': False, 'shape': (1, 1), }", &[0; 4]);
        for end in 0..whole.len() {
            assert!(depth(&whole[..end], MemoryLimit::default()).is_err(), "{end}");
        }
    }
}
