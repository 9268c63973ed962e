//! Frame specifications as render farms write them: `0-239`, `0-239x10`, `1-9:2`, `17`, `-3-5`, `1-5,9`: read, and written for people.

/// Most frames that one specification may name.
pub const MOST_FRAMES: i64 = 10_000_000;

/// A specification that means nothing.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{part}` {fault}; allowed: 17, 0-239, 0-239x10 or 0-239:10 (every tenth), and lists such as 1-5,9")]
pub struct FrameSpecError {
    /// The part at fault.
    pub part: String,
    /// What is wrong with it.
    pub fault: FrameSpecFault,
}

/// What can be wrong with a part of a specification.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FrameSpecFault {
    /// It is not of the form of a range.
    #[error("is no frame or range of frames")]
    Form,
    /// Its first frame comes after its last.
    #[error("runs backward")]
    Backward,
    /// Its step is zero.
    #[error("has a step of zero")]
    ZeroStep,
    /// It names more frames than any shot has.
    #[error("names more than {MOST_FRAMES} frames")]
    TooMany,
}

/// The frames that `spec` names, ascending, each once.
///
/// # Errors
/// A part is no range, runs backward, has no step, or names too many frames.
pub fn parse(spec: &str) -> Result<Vec<i64>, FrameSpecError> {
    let mut frames = Vec::new();
    for part in spec.split(',') {
        let fail = |fault| FrameSpecError { part: part.trim().to_owned(), fault };
        let [first, last, step] = parse_part(part.trim()).ok_or(fail(FrameSpecFault::Form))?;
        if first > last {
            return Err(fail(FrameSpecFault::Backward));
        }
        if step == 0 {
            return Err(fail(FrameSpecFault::ZeroStep));
        }
        if (last - first) / step + frames.len() as i64 >= MOST_FRAMES {
            return Err(fail(FrameSpecFault::TooMany));
        }
        frames.extend((first..=last).step_by(step as usize));
    }
    frames.sort_unstable();
    frames.dedup();
    Ok(frames)
}

/// First frame, last frame and step.
fn parse_part(part: &str) -> Option<[i64; 3]> {
    let (range, step) = match part.split_once(['x', ':']) {
        Some((range, step)) => (range, number(step)?),
        None => (part, 1),
    };
    // A dash at the very front is a sign; the next one that follows a digit separates.
    let separator = range.char_indices().skip(1).find(|(at, c)| *c == '-' && range.as_bytes()[at - 1].is_ascii_digit());
    let (first, last) = match separator {
        Some((at, _)) => (signed(&range[..at])?, signed(&range[at + 1..])?),
        None if part.contains(['x', ':']) => return None,
        None => (signed(range)?, signed(range)?),
    };
    Some([first, last, step])
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

/// The most ranges that [`ranges`] lists.
const MOST_RANGES: usize = 100;

/// `3-14, 20` for ascending numbers; what comes after a hundred ranges is counted.
pub(crate) fn ranges(numbers: &[i64]) -> String {
    let mut runs = numbers.chunk_by(|a, b| a.checked_add(1) == Some(*b));
    let shown: Vec<String> = runs.by_ref().take(MOST_RANGES).map(range).collect();
    match runs.map(<[i64]>::len).sum() {
        0 => shown.join(", "),
        others => format!("{} and {others} more", shown.join(", ")),
    }
}

fn range(run: &[i64]) -> String {
    match run {
        [first, .., last] => format!("{first}-{last}"),
        run => run.iter().map(i64::to_string).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_of_the_design_is_read() {
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
    fn nonsense_is_refused_with_the_part_at_fault() {
        for (spec, part, fault) in [
            ("9-1", "9-1", FrameSpecFault::Backward),
            ("1-5,x", "x", FrameSpecFault::Form),
            ("", "", FrameSpecFault::Form),
            ("1-", "1-", FrameSpecFault::Form),
            ("1-9x0", "1-9x0", FrameSpecFault::ZeroStep),
            ("3x2", "3x2", FrameSpecFault::Form),
            ("0-99999999999", "0-99999999999", FrameSpecFault::TooMany),
            ("99999999999999999999", "99999999999999999999", FrameSpecFault::Form),
            ("é-ü", "é-ü", FrameSpecFault::Form),
        ] {
            assert_eq!(parse(spec).unwrap_err(), FrameSpecError { part: part.into(), fault }, "{spec}");
        }
    }

    #[test]
    fn runs_are_drawn_together_and_long_lists_end() {
        let many: Vec<i64> = (0..250).map(|number| 2 * number).collect();
        for (numbers, expected) in [
            (&[][..], ""),
            (&[7], "7"),
            (&[-3, -2, -1, 0, 4, 6, 7], "-3-0, 4, 6-7"),
            (&[i64::MAX - 1, i64::MAX], "9223372036854775806-9223372036854775807"),
        ] {
            assert_eq!(ranges(numbers), expected);
        }
        assert!(ranges(&many).ends_with(", 196, 198 and 150 more"));
    }
}
