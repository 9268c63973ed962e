//! Depth in portable float maps: `Pf`, width and height, a scale whose sign is the byte order, then rows from the bottom.

use bansho_base::{
    host::assets::{AssetProblem, DepthMap},
    image::Image,
};

use crate::{
    decode::damaged,
    limits::{self, MemoryLimit},
};

/// Decodes a PFM: gray, or the first of three components. The scale's absolute value is not used, as by other readers of depth.
pub(crate) fn depth(file: &[u8], limit: MemoryLimit) -> Result<DepthMap, AssetProblem> {
    let mut rest = file;
    let components = match take_word(&mut rest) {
        Some("Pf") => 1,
        Some("PF") => 3,
        _ => return Err(damaged("it does not begin with `Pf` or `PF`")),
    };
    let [width, height] = [take_word(&mut rest), take_word(&mut rest)].map(|text| text?.parse::<u64>().ok());
    let size = width.zip(height).ok_or_else(|| damaged("its width and height cannot be read"))?;
    let scale = take_word(&mut rest).and_then(|text| text.parse::<f32>().ok());
    let scale = scale.filter(|scale| *scale != 0.0 && scale.is_finite());
    let scale = scale.ok_or_else(|| damaged("its scale cannot be read (allowed: a number other than 0)"))?;
    let [width, height] = limits::check_size([size.0, size.1])?;
    // Compared before anything is allocated: the header of a hostile file may claim any size.
    let claimed_bytes = width * height * components * 4;
    if claimed_bytes > rest.len() as u64 {
        return Err(damaged(format!("its values take {claimed_bytes} bytes, and the file has {} of them", rest.len())));
    }
    limit.check(file.len() as u64 + width * height * size_of::<f32>() as u64)?;
    let read_float = if scale < 0.0 { f32::from_le_bytes } else { f32::from_be_bytes };
    let [width, height, components] = [width, height, components].map(|count| count as usize);
    let row_bytes = 4 * width * components;
    // The first row is the lowest of the picture.
    let rows = (0..height).rev().map(|row| &rest[row * row_bytes..][..row_bytes]);
    let values =
        rows.flat_map(|row| row.as_chunks::<4>().0.iter().step_by(components).map(|bytes| [read_float(*bytes)]));
    let values =
        Image::from_pixels(width, height, values.collect()).ok_or_else(|| damaged("its values do not fill it"))?;
    Ok(DepthMap { values, remarks: Vec::new() })
}

/// Longest word of a header.
const WORD_BYTES: usize = 64;

/// The next word, and the single character of white space after it.
fn take_word<'a>(rest: &mut &'a [u8]) -> Option<&'a str> {
    let start = rest.iter().take(WORD_BYTES).position(|byte| !byte.is_ascii_whitespace())?;
    let text = &rest[start..];
    let length = text.iter().take(WORD_BYTES).position(u8::is_ascii_whitespace)?;
    *rest = &text[length + 1..];
    std::str::from_utf8(&text[..length]).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(file: &[u8]) -> Result<Vec<f32>, String> {
        let map = depth(file, MemoryLimit::default()).map_err(|error| error.to_string())?;
        Ok(map.values.pixels().as_flattened().to_vec())
    }

    #[test]
    fn rows_come_from_the_bottom_in_both_byte_orders() {
        let values = [1.0_f32, 2.0, 3.0, 4.0, 5.0, 6.0];
        let little: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        let big: Vec<u8> = values.iter().flat_map(|value| value.to_be_bytes()).collect();
        let shown = [4.0, 5.0, 6.0, 1.0, 2.0, 3.0];
        assert_eq!(read(&[b"Pf\n3 2\n-1.0\n".as_slice(), &little].concat()).unwrap(), shown);
        assert_eq!(read(&[b"Pf 3 2 1\n".as_slice(), &big].concat()).unwrap(), shown);
        assert_eq!(read(&[b"PF\n1 2\n-1\n".as_slice(), &little].concat()).unwrap(), [4.0, 1.0]);
    }

    #[test]
    fn damage_is_told() {
        for (file, words) in [
            (&b"P5\n1 1\n"[..], "`Pf` or `PF`"),
            (b"Pf\n1 x\n-1\n", "width and height"),
            (b"Pf\n1 1\n0\n0000", "scale"),
            (b"Pf\n1 1\n-1\n000", "take 4 bytes, and the file has 3"),
            (b"Pf\n99999 1\n-1\n", "99999"),
            (b"Pf", "`Pf` or `PF`"),
        ] {
            let told = read(file).unwrap_err();
            assert!(told.contains(words), "{told}");
        }
    }
}
