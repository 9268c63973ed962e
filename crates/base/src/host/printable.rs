//! Escapes untrusted text for display on a terminal.

use std::{borrow::Cow, fmt::Write};

/// `text` with every control character and every character that changes the reading direction replaced by its escape, such as `\u{1b}`. The result is
/// one line. File names and values of scenes may contain any character.
///
/// ```
/// use bansho_base::host::printable::printable;
/// assert_eq!(printable("a\x1b[2J.png"), "a\\u{1b}[2J.png");
/// assert_eq!(printable("火.png"), "火.png");
/// ```
pub fn printable(text: &str) -> Cow<'_, str> {
    if !text.chars().any(is_control_or_bidi) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len());
    for character in text.chars() {
        // Writing to a string does not fail.
        let _ = if is_control_or_bidi(character) {
            write!(shown, "{}", character.escape_default())
        } else {
            shown.write_char(character)
        };
    }
    Cow::Owned(shown)
}

/// Like [`printable`], but replaces one character by one, so that a marker on the line below stays aligned: a tab by a space, a control character by
/// its picture (Control Pictures, from U+2400 on), and a character that changes the reading direction by the replacement character.
///
/// ```
/// assert_eq!(bansho_base::host::printable::with_control_pictures("a\t=\x1b[2J\u{202e}"), "a =\u{241b}[2J\u{fffd}");
/// ```
pub fn with_control_pictures(text: &str) -> String {
    let shown = text.chars().map(|character| match character {
        '\t' => ' ',
        // The block Control Pictures of Unicode is in the order of the control characters.
        '\0'..='\x1f' => char::from_u32(0x2400 + u32::from(character)).unwrap_or(char::REPLACEMENT_CHARACTER),
        '\x7f' => '\u{2421}',
        other if is_control_or_bidi(other) => char::REPLACEMENT_CHARACTER,
        other => other,
    });
    shown.collect()
}

/// Number of characters shown of the start and of the end of a text that is shortened.
const EXCERPT_LENGTHS: [usize; 2] = [2000, 1000];

/// Like [`printable`], without the middle of a text of more than 3,000 characters. An error message begins with what is wrong and ends with what is
/// allowed; the value between them may have any length.
///
/// ```
/// use bansho_base::host::printable::printable_excerpt;
/// let shown = printable_excerpt(&format!("unknown value `{}`; allowed: fire", "a".repeat(1_000_000))).into_owned();
/// assert!(shown.starts_with("unknown value `aaa") && shown.contains("aaa [...] aaa") && shown.ends_with("allowed: fire") && shown.len() < 3100);
/// ```
pub fn printable_excerpt(text: &str) -> Cow<'_, str> {
    let [first, last] = EXCERPT_LENGTHS;
    // Where the beginning ends, and where the end begins: without a middle between them the whole text is shown.
    match (text.char_indices().nth(first), text.char_indices().rev().nth(last - 1)) {
        (Some((end, _)), Some((start, _))) if end < start => {
            Cow::Owned(format!("{} [...] {}", printable(&text[..end]), printable(&text[start..])))
        }
        _ => printable(text),
    }
}

/// Whether it is a control character, a line or paragraph separator, or a formatting character of the Unicode bidirectional algorithm (UAX #9), which
/// can make text look like other text.
fn is_control_or_bidi(character: char) -> bool {
    character.is_control()
        || matches!(character, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_steers_a_terminal_is_shown_as_its_escape() {
        for (text, shown) in [
            ("a\nerror: b", "a\\nerror: b"),
            ("\u{9b}2J\u{7f}\0", "\\u{9b}2J\\u{7f}\\u{0}"),
            ("ab\u{202e}gnp.exe", "ab\\u{202e}gnp.exe"),
            ("tab\there", "tab\\there"),
        ] {
            assert_eq!(printable(text), shown);
        }
        assert!(matches!(printable("Größe 3×4 火"), Cow::Borrowed(_)));
    }
}
