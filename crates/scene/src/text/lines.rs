//! Lines and columns of positions in a text, found in one pass.

use std::fmt;

use bansho_base::parameters::Span;

/// A position in a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LineColumn {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
}

impl fmt::Display for LineColumn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.line, self.column)
    }
}

/// Finds lines and columns. Any number of positions in ascending order take one pass over the text.
pub(crate) struct Lines<'t> {
    text: &'t str,
    /// The last position, as a byte of the text.
    byte: usize,
    /// First byte of its line.
    line_start: usize,
    /// Its line and column.
    position: LineColumn,
}

/// A line of the text with a marked span.
#[derive(Debug, PartialEq)]
pub(crate) struct Excerpt {
    /// The line; of a long one, the part around the span.
    pub(crate) text: String,
    /// Characters before the span.
    pub(crate) before: usize,
    /// Characters of the span, at least one.
    pub(crate) marked: usize,
}

/// Maximum number of characters shown before the beginning of a span, and from it on. Lines of usual length are shown completely.
const MAX_BEFORE: usize = 120;
const MAX_AFTER: usize = 160;
/// Replaces omitted text.
const ELLIPSIS: &str = "...";

impl<'t> Lines<'t> {
    pub(crate) fn new(text: &'t str) -> Self {
        Self { text, byte: 0, line_start: 0, position: LineColumn { line: 1, column: 1 } }
    }

    /// Line and column of a byte of the text.
    pub(crate) fn position(&mut self, byte: usize) -> LineColumn {
        let byte = floor_char_boundary(self.text, byte);
        if byte < self.byte {
            // From the beginning: problems come in the order of the text, so that this is rare.
            *self = Self::new(self.text);
        }
        let passed = &self.text[self.byte..byte];
        match passed.rfind('\n') {
            Some(last) => {
                self.position.line += passed.bytes().filter(|byte| *byte == b'\n').count();
                self.line_start = self.byte + last + 1;
                self.position.column = self.text[self.line_start..byte].chars().count() + 1;
            }
            None => self.position.column += passed.chars().count(),
        }
        self.byte = byte;
        self.position
    }

    /// The line in which `span` begins, with the part of `span` in this line marked.
    pub(crate) fn excerpt(&mut self, span: Span) -> Excerpt {
        let LineColumn { column, .. } = self.position(span.start);
        let text = self.text;
        let line = text[self.byte..].lines().next().unwrap_or_default();
        let end = line.char_indices().nth(MAX_AFTER).map(|(end, _)| end);
        let after = &line[..end.unwrap_or(line.len())];
        let characters = (column - 1).min(MAX_BEFORE);
        let first = match characters {
            0 => self.byte,
            _ => {
                text[self.line_start..self.byte].char_indices().rev().nth(characters - 1).map_or(0, |(at, _)| at)
                    + self.line_start
            }
        };
        let omitted_before = if first > self.line_start { ELLIPSIS } else { "" };
        let omitted_after = if end.is_some() { ELLIPSIS } else { "" };
        let shown = format!("{omitted_before}{}{after}{omitted_after}", &text[first..self.byte]);
        let marked = floor_char_boundary(after, span.end.saturating_sub(self.byte));
        Excerpt {
            text: shown,
            before: omitted_before.len() + characters,
            marked: after[..marked].chars().count().max(1),
        }
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
    fn positions_do_not_depend_on_the_order_of_requests() {
        let text = "a\n\u{e9}\u{e9} = 1\n\nlast";
        let position = |byte| {
            let LineColumn { line, column } = Lines::new(text).position(byte);
            (line, column)
        };
        let alone: Vec<_> = (0..=text.len() + 3).map(position).collect();
        assert_eq!([alone[0], alone[2], alone[4], alone[6], alone[11]], [(1, 1), (2, 1), (2, 2), (2, 3), (3, 1)]);
        assert_eq!((alone[3], alone[text.len() + 3]), ((2, 1), (4, 5)), "within a character, and beyond the end");
        let mut lines = Lines::new(text);
        for order in [(0..alone.len()).collect::<Vec<_>>(), (0..alone.len()).rev().collect()] {
            order.into_iter().for_each(|byte| {
                let (line, column) = alone[byte];
                assert_eq!(lines.position(byte), LineColumn { line, column }, "{byte}");
            });
        }
    }

    #[test]
    fn of_long_lines_the_part_around_the_span_is_shown() {
        let text = format!("{} = \"{}\"\nnext", "k".repeat(500), "\u{e9}".repeat(1_000_000));
        let found = Lines::new(&text).excerpt(503..text.len());
        assert_eq!((found.before, found.marked), (3 + 120, 160));
        assert_eq!(found.text.chars().count(), 3 + 120 + 160 + 3);
        assert!(found.text.starts_with("...k") && found.text.ends_with("\u{e9}..."));
        let short = Lines::new("ab = 1\n").excerpt(5..6);
        assert_eq!(short, Excerpt { text: "ab = 1".into(), before: 5, marked: 1 });
    }

    /// One pass for each position would take hours.
    #[test]
    fn a_million_positions_take_one_pass() {
        let text = "x = 1\n".repeat(1_000_000);
        let mut lines = Lines::new(&text);
        let last = (0..1_000_000).map(|index| lines.position(6 * index + 4)).last();
        assert_eq!(last, Some(LineColumn { line: 1_000_000, column: 5 }));
    }
}
