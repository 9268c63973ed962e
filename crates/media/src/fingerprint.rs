//! Encoding of the fingerprint that a file carries of everything its pixels depend on.

/// The version that is written into files.
pub(crate) const VERSION: &str = env!("CARGO_PKG_VERSION");

/// `bytes` as lower-case hexadecimal digits.
pub(crate) fn to_hex(bytes: &[u8; 32]) -> String {
    bytes
        .iter()
        .flat_map(|byte| [byte >> 4, byte & 15])
        .filter_map(|digit| char::from_digit(digit.into(), 16))
        .collect()
}

/// Parses 64 hexadecimal digits.
pub(crate) fn from_hex(text: &[u8]) -> Option<[u8; 32]> {
    let pairs: &[[u8; 2]; 32] = text.as_chunks().0.try_into().ok().filter(|_| text.len() == 64)?;
    let mut bytes = [0; 32];
    for (byte, pair) in bytes.iter_mut().zip(pairs) {
        let [high, low] = pair.map(|letter| char::from(letter).to_digit(16));
        *byte = (high? * 16 + low?) as u8;
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hexadecimal_there_and_back() {
        let bytes = std::array::from_fn(|i| (i * 37 + 5) as u8);
        let text = to_hex(&bytes);
        assert!(text.starts_with("052a4f"), "{text}");
        assert_eq!(from_hex(text.as_bytes()), Some(bytes));
        assert_eq!(from_hex(&text.as_bytes()[..63]), None);
        assert_eq!(from_hex(format!("{}0", text).as_bytes()), None);
        assert_eq!(from_hex(text.replace('a', "g").as_bytes()), None);
    }
}
