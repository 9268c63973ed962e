//! Lists of frame numbers for people, and for `--frames`.

/// Most ranges that are listed.
const MOST: usize = 100;

/// `3-14, 20` for ascending numbers; what comes after a hundred ranges is counted.
pub(super) fn ranges(numbers: &[i64]) -> String {
    let mut runs = numbers.chunk_by(|a, b| a.checked_add(1) == Some(*b));
    let shown: Vec<String> = runs.by_ref().take(MOST).map(range).collect();
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
