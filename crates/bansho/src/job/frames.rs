//! Parses lists of frames in the notation of render farms (`0-239`, `0-239x10`, `1-9:2`, `17`, `-3-5`, `1-5,9`), and formats such lists for
//! messages.

/// Maximum number of frames of a list.
pub const MAX_FRAMES: i64 = 10_000_000;

/// A list of frames that is invalid.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{range}` {kind}; allowed: 17, 0-239, 0-239x10 or 0-239:10 (every tenth), and lists such as 1-5,9")]
pub struct FrameListError {
    /// The invalid range.
    pub range: String,
    /// What is wrong with it.
    pub kind: FrameListErrorKind,
}

/// What is wrong with a range of frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FrameListErrorKind {
    /// It does not have the form of a range.
    #[error("is not a frame or a range of frames")]
    Form,
    /// Its first frame comes after its last.
    #[error("ends before it begins")]
    Backward,
    /// Its step is zero.
    #[error("has a step of zero")]
    ZeroStep,
    /// The list has more frames than any shot.
    #[error("selects more than {MAX_FRAMES} frames")]
    TooMany,
}

/// The frames of the list `text`, ascending, each once.
///
/// # Errors
/// A range is malformed, runs backward, or has a step of zero, or there are too many frames.
pub fn parse(text: &str) -> Result<Vec<i64>, FrameListError> {
    let mut frames = Vec::new();
    for range in text.split(',').map(str::trim) {
        append_range(range, &mut frames).map_err(|kind| FrameListError { range: range.to_owned(), kind })?;
    }
    frames.sort_unstable();
    frames.dedup();
    Ok(frames)
}

/// Appends the frames of a range.
fn append_range(range: &str, frames: &mut Vec<i64>) -> Result<(), FrameListErrorKind> {
    let FrameRange { first, last, step } = parse_range(range).ok_or(FrameListErrorKind::Form)?;
    if first > last {
        return Err(FrameListErrorKind::Backward);
    }
    if step == 0 {
        return Err(FrameListErrorKind::ZeroStep);
    }
    if (last - first) / step + frames.len() as i64 >= MAX_FRAMES {
        return Err(FrameListErrorKind::TooMany);
    }
    frames.extend((first..=last).step_by(step as usize));
    Ok(())
}

/// Every `step`-th frame from `first` to `last`.
struct FrameRange {
    first: i64,
    last: i64,
    step: i64,
}

fn parse_range(text: &str) -> Option<FrameRange> {
    let (range, step) = match text.split_once(['x', ':']) {
        Some((range, step)) => (range, number(step)?),
        None => (text, 1),
    };
    // A dash at the beginning is a sign; the first one that follows a digit separates the two numbers.
    let separator = range.char_indices().skip(1).find(|(at, c)| *c == '-' && range.as_bytes()[at - 1].is_ascii_digit());
    let (first, last) = match separator {
        Some((at, _)) => (signed(&range[..at])?, signed(&range[at + 1..])?),
        None if text.contains(['x', ':']) => return None,
        None => (signed(range)?, signed(range)?),
    };
    Some(FrameRange { first, last, step })
}

fn number(text: &str) -> Option<i64> {
    (!text.is_empty() && text.len() <= 12 && text.bytes().all(|byte| byte.is_ascii_digit()))
        .then(|| text.parse().ok())
        .flatten()
}

fn signed(text: &str) -> Option<i64> {
    match text.strip_prefix('-') {
        Some(digits) => number(digits).map(|value| -value),
        None => number(text),
    }
}

/// Maximum number of ranges that [`format_ranges`] lists.
const MAX_LISTED_RANGES: usize = 100;

/// `3-14, 20` for ascending numbers. After a hundred ranges, the remaining frames are counted.
pub fn format_ranges(numbers: &[i64]) -> String {
    let mut runs = numbers.chunk_by(|a, b| a.checked_add(1) == Some(*b));
    let shown: Vec<String> = runs.by_ref().take(MAX_LISTED_RANGES).map(format_range).collect();
    match runs.map(<[i64]>::len).sum() {
        0 => shown.join(", "),
        others => format!("{} and {others} more", shown.join(", ")),
    }
}

/// `3-14,20` for ascending numbers, all of them, as [`parse`] reads it.
pub fn format_list(numbers: &[i64]) -> String {
    let runs: Vec<String> = numbers.chunk_by(|a, b| a.checked_add(1) == Some(*b)).map(format_range).collect();
    runs.join(",")
}

fn format_range(run: &[i64]) -> String {
    match run {
        [first, .., last] => format!("{first}-{last}"),
        run => run.iter().map(i64::to_string).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_is_parsed() {
        assert_eq!(parse("17").unwrap(), [17]);
        assert_eq!(parse("0-3").unwrap(), [0, 1, 2, 3]);
        assert_eq!(parse("0-39x10").unwrap(), [0, 10, 20, 30]);
        assert_eq!(parse("1-9:2").unwrap(), [1, 3, 5, 7, 9]);
        assert_eq!(parse("-3-1").unwrap(), [-3, -2, -1, 0, 1]);
        assert_eq!(parse("-3--1").unwrap(), [-3, -2, -1]);
        assert_eq!(parse("-7").unwrap(), [-7]);
        assert_eq!(parse("1-3,9, 2-4").unwrap(), [1, 2, 3, 4, 9]);
    }

    #[test]
    fn invalid_lists_are_refused_with_the_invalid_range() {
        for (text, range, kind) in [
            ("9-1", "9-1", FrameListErrorKind::Backward),
            ("1-5,x", "x", FrameListErrorKind::Form),
            ("", "", FrameListErrorKind::Form),
            ("1-", "1-", FrameListErrorKind::Form),
            ("1-9x0", "1-9x0", FrameListErrorKind::ZeroStep),
            ("3x2", "3x2", FrameListErrorKind::Form),
            ("0-99999999999", "0-99999999999", FrameListErrorKind::TooMany),
            ("99999999999999999999", "99999999999999999999", FrameListErrorKind::Form),
            ("é-ü", "é-ü", FrameListErrorKind::Form),
        ] {
            assert_eq!(parse(text).unwrap_err(), FrameListError { range: range.into(), kind }, "{text}");
        }
    }

    #[test]
    fn consecutive_frames_become_ranges_and_long_lists_are_cut() {
        let many: Vec<i64> = (0..250).map(|number| 2 * number).collect();
        for (numbers, expected) in [
            (&[][..], ""),
            (&[7], "7"),
            (&[-3, -2, -1, 0, 4, 6, 7], "-3-0, 4, 6-7"),
            (&[i64::MAX - 1, i64::MAX], "9223372036854775806-9223372036854775807"),
        ] {
            assert_eq!(format_ranges(numbers), expected);
        }
        assert!(format_ranges(&many).ends_with(", 196, 198 and 150 more"));
        for numbers in [&many[..], &[-3, -2, 0, 5, 6], &[7]] {
            assert_eq!(parse(&format_list(numbers)).unwrap(), numbers);
        }
    }
}
