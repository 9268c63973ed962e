//! The text of an SVG file: unpacked, and decoded.

use std::io::Read;

use bansho_base::host::assets::AssetProblem;
use flate2::read::GzDecoder;

use super::damaged;
use crate::limits::TEXT_BYTES;

/// The text of `file`, which may be packed by gzip, in UTF-8 or UTF-16, or in the Latin-1 that its declaration states.
pub(super) fn unpacked(file: &[u8]) -> Result<String, AssetProblem> {
    if !file.starts_with(&[0x1f, 0x8b]) {
        return decoded(file);
    }
    let mut bytes = Vec::new();
    GzDecoder::new(file).take(TEXT_BYTES + 1).read_to_end(&mut bytes).map_err(damaged)?;
    if bytes.len() as u64 > TEXT_BYTES {
        return Err(damaged(format!("it has more than {TEXT_BYTES} bytes once it is unpacked")));
    }
    decoded(&bytes)
}

fn decoded(bytes: &[u8]) -> Result<String, AssetProblem> {
    // Files of UTF-16 and some of UTF-8 begin with a byte order mark.
    let text = match bytes {
        [0xff, 0xfe, rest @ ..] => utf16(rest, u16::from_le_bytes),
        [0xfe, 0xff, rest @ ..] => utf16(rest, u16::from_be_bytes),
        [0xef, 0xbb, 0xbf, rest @ ..] => utf8(rest),
        _ if is_latin1(bytes) => Ok(bytes.iter().copied().map(char::from).collect()),
        _ => utf8(bytes),
    }?;
    Ok(without_encoding(text))
}

fn utf16(bytes: &[u8], read_unit: fn([u8; 2]) -> u16) -> Result<String, AssetProblem> {
    let units: Vec<u16> = bytes.as_chunks::<2>().0.iter().map(|pair| read_unit(*pair)).collect();
    String::from_utf16(&units).map_err(|_| damaged("it is not UTF-16"))
}

fn utf8(bytes: &[u8]) -> Result<String, AssetProblem> {
    std::str::from_utf8(bytes).map(str::to_owned).map_err(|_| damaged("it is not UTF-8"))
}

/// The XML declaration, if there is one.
fn declaration(bytes: &[u8]) -> &[u8] {
    let start = &bytes[..bytes.len().min(200)];
    let end = start.windows(2).position(|pair| pair == b"?>").unwrap_or(0);
    if start.starts_with(b"<?xml") { &start[..end] } else { &[] }
}

fn is_latin1(bytes: &[u8]) -> bool {
    let declared = declaration(bytes).to_ascii_lowercase();
    [&b"iso-8859-1"[..], b"windows-1252", b"latin1"]
        .iter()
        .any(|encoding| declared.windows(encoding.len()).any(|window| window == *encoding))
}

/// The text without its declaration, whose encoding is no longer true.
fn without_encoding(text: String) -> String {
    let length = declaration(text.as_bytes()).len();
    if length == 0 {
        return text;
    }
    // As many characters as before, so that positions stay true.
    " ".repeat(length + 2) + &text[length + 2..]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_of_every_encoding_are_read() {
        assert_eq!(unpacked(b"\xef\xbb\xbf<svg/>").unwrap(), "<svg/>");
        let wide: Vec<u8> = "<svg id='\u{706b}'/>".encode_utf16().flat_map(u16::to_le_bytes).collect();
        assert_eq!(unpacked(&[&[0xff, 0xfe], &wide[..]].concat()).unwrap(), "<svg id='\u{706b}'/>");
        let latin = unpacked(b"<?xml version='1.0' encoding='ISO-8859-1'?><svg id='\xe9'/>").unwrap();
        assert_eq!(latin.trim_start(), "<svg id='\u{e9}'/>");
        assert!(unpacked(b"<svg>\xff</svg>").is_err());
    }

    #[test]
    fn what_is_packed_is_unpacked_up_to_a_limit() {
        use std::io::Write;
        let pack = |bytes: &[u8], times: usize| {
            let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
            (0..times).for_each(|_| encoder.write_all(bytes).unwrap());
            encoder.finish().unwrap()
        };
        assert_eq!(unpacked(&pack(b"<svg/>", 1)).unwrap(), "<svg/>");
        let bomb = unpacked(&pack(&[b' '; 1 << 20], 65)).unwrap_err().to_string();
        assert!(bomb.contains("more than 67108864 bytes once it is unpacked"), "{bomb}");
        assert!(unpacked(&pack(b"<svg/>", 1)[..12]).is_err());
    }
}
