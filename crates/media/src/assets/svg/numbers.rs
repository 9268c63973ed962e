//! NumberReader in SVG: separated by spaces or commas, or by nothing where a sign or a second decimal point begins the next number.

/// Reads numbers from a text.
#[derive(Clone, Copy, Debug)]
pub(super) struct NumberReader<'a> {
    rest: &'a str,
}

impl<'a> NumberReader<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        Self { rest: text.trim_start() }
    }

    /// The next character that is neither a space nor a comma.
    pub(super) fn peek(&mut self) -> Option<char> {
        self.rest = self.rest.trim_start_matches(|c: char| c.is_whitespace() || c == ',');
        self.rest.chars().next()
    }

    /// Takes that character.
    pub(super) fn take(&mut self) -> Option<char> {
        let next = self.peek()?;
        self.rest = &self.rest[next.len_utf8()..];
        Some(next)
    }

    /// The next number; `None` if there is none or it is not finite.
    pub(super) fn next(&mut self) -> Option<f64> {
        self.peek()?;
        let (number, rest) = self.rest.split_at(length(self.rest.as_bytes()));
        let value: f64 = number.parse().ok().filter(|value: &f64| value.is_finite())?;
        self.rest = rest;
        Some(value)
    }

    /// The next `N` numbers.
    pub(super) fn take_all<const N: usize>(&mut self) -> Option<[f64; N]> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.next()?;
        }
        Some(values)
    }

    /// The next flag of an arc, 0 or 1, which needs no separator after it.
    pub(super) fn flag(&mut self) -> Option<bool> {
        match self.take()? {
            '0' => Some(false),
            '1' => Some(true),
            _ => None,
        }
    }
}

/// Length in bytes of the number at the start of the text.
fn length(text: &[u8]) -> usize {
    let sign = |at: usize| usize::from(matches!(text.get(at), Some(b'+' | b'-')));
    let digits = |from: usize| text[from.min(text.len())..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    let mut end = sign(0);
    end += digits(end);
    if text.get(end) == Some(&b'.') {
        end += 1 + digits(end + 1);
    }
    if matches!(text.get(end), Some(b'e' | b'E')) {
        let exponent = end + 1 + sign(end + 1);
        // Without digits it is the start of a unit, such as em.
        if digits(exponent) > 0 {
            end = exponent + digits(exponent);
        }
    }
    end
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_need_nothing_between_them() {
        let mut numbers = NumberReader::new(" 1,-2.5.5-1e-2+3E1 10em");
        let read: Vec<f64> = std::iter::from_fn(|| numbers.next()).collect();
        assert_eq!(read, [1.0, -2.5, 0.5, -0.01, 30.0, 10.0]);
        assert_eq!(numbers.peek(), Some('e'));
    }

    #[test]
    fn flags_are_single_digits() {
        let mut numbers = NumberReader::new("01 5");
        assert_eq!(
            (numbers.flag(), numbers.flag(), numbers.next(), numbers.flag()),
            (Some(false), Some(true), Some(5.0), None)
        );
        assert_eq!(NumberReader::new("1e999").next(), None);
        assert_eq!(NumberReader::new("2 x").take_all::<2>(), None);
    }
}
