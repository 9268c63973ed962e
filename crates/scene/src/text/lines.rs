//! Places of a text as lines and columns, found one after another in one pass.

use bansho_base::parameters::Span;

/// Finds lines and columns. Places that are asked for in the order of the text take one pass over it, however many there are.
pub(crate) struct Lines<'t> {
    text: &'t str,
    /// The place that was asked for last.
    byte: usize,
    /// Where its line begins.
    start: usize,
    /// Its line and column, from 1 on.
    line: usize,
    column: usize,
}

/// A part of a line with a mark below it.
#[derive(Debug, PartialEq)]
pub(crate) struct Excerpt {
    /// The line, or what lies around the mark of a long one.
    pub(crate) shown: String,
    /// Characters before the mark.
    pub(crate) before: usize,
    /// Characters that are marked, at least one.
    pub(crate) marked: usize,
}

/// Characters of a line that are shown before a mark and from its beginning on. Lines that people write are shown whole.
const SHOWN: [usize; 2] = [120, 160];
/// What stands for what is left out.
const LEFT_OUT: &str = "...";

impl<'t> Lines<'t> {
    pub(crate) fn new(text: &'t str) -> Self {
        Self { text, byte: 0, start: 0, line: 1, column: 1 }
    }

    /// One-based line and column (in characters) of a byte of the text.
    pub(crate) fn position(&mut self, byte: usize) -> (usize, usize) {
        let byte = floor_char_boundary(self.text, byte);
        if byte < self.byte {
            *self = Self::new(self.text);
        }
        let passed = &self.text[self.byte..byte];
        match passed.rfind('\n') {
            Some(last) => {
                self.line += passed.bytes().filter(|byte| *byte == b'\n').count();
                self.start = self.byte + last + 1;
                self.column = self.text[self.start..byte].chars().count() + 1;
            }
            None => self.column += passed.chars().count(),
        }
        self.byte = byte;
        (self.line, self.column)
    }

    /// The line in which `span` begins, with `span` marked as far as that line goes.
    pub(crate) fn excerpt(&mut self, span: Span) -> Excerpt {
        let (_, column) = self.position(span.start);
        let text = self.text;
        let line = text[self.byte..].lines().next().unwrap_or_default();
        let end = line.char_indices().nth(SHOWN[1]).map(|(end, _)| end);
        let after = &line[..end.unwrap_or(line.len())];
        let characters = (column - 1).min(SHOWN[0]);
        let first = match characters {
            0 => self.byte,
            _ => {
                text[self.start..self.byte].char_indices().rev().nth(characters - 1).map_or(0, |(at, _)| at)
                    + self.start
            }
        };
        let cut = if first > self.start { LEFT_OUT } else { "" };
        let shown = format!("{cut}{}{after}{}", &text[first..self.byte], if end.is_some() { LEFT_OUT } else { "" });
        let marked = floor_char_boundary(after, span.end.saturating_sub(self.byte));
        Excerpt { shown, before: cut.len() + characters, marked: after[..marked].chars().count().max(1) }
    }
}

fn floor_char_boundary(text: &str, byte: usize) -> usize {
    let mut byte = byte.min(text.len());
    while !text.is_char_boundary(byte) {
        byte -= 1;
    }
    byte
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_the_same_in_whatever_order_they_are_asked_for() {
        let text = "a\n\u{e9}\u{e9} = 1\n\nlast";
        let alone: Vec<_> = (0..=text.len() + 3).map(|byte| Lines::new(text).position(byte)).collect();
        assert_eq!([alone[0], alone[2], alone[4], alone[6], alone[11]], [(1, 1), (2, 1), (2, 2), (2, 3), (3, 1)]);
        assert_eq!((alone[3], alone[text.len() + 3]), ((2, 1), (4, 5)), "within a character, and beyond the end");
        let mut lines = Lines::new(text);
        for order in [(0..alone.len()).collect::<Vec<_>>(), (0..alone.len()).rev().collect()] {
            order.into_iter().for_each(|byte| assert_eq!(lines.position(byte), alone[byte], "{byte}"));
        }
    }

    #[test]
    fn of_long_lines_what_lies_around_the_mark_is_shown() {
        let text = format!("{} = \"{}\"\nnext", "k".repeat(500), "\u{e9}".repeat(1_000_000));
        let found = Lines::new(&text).excerpt(503..text.len());
        assert_eq!((found.before, found.marked), (3 + 120, 160));
        assert_eq!(found.shown.chars().count(), 3 + 120 + 160 + 3);
        assert!(found.shown.starts_with("...k") && found.shown.ends_with("\u{e9}..."));
        let short = Lines::new("ab = 1\n").excerpt(5..6);
        assert_eq!(short, Excerpt { shown: "ab = 1".into(), before: 5, marked: 1 });
    }

    /// A pass for every place would take hours.
    #[test]
    fn a_million_places_take_one_pass() {
        let text = "x = 1\n".repeat(1_000_000);
        let mut lines = Lines::new(&text);
        let last = (0..1_000_000).map(|index| lines.position(6 * index + 4)).last();
        assert_eq!(last, Some((1_000_000, 5)));
    }
}
