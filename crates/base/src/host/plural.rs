//! Singular and plural of counts in messages.

/// `count` with the noun `one` in singular or plural: `1 item`, `2 items`.
///
/// ```
/// use bansho_base::host::plural::counted;
/// assert_eq!((counted(0, "item"), counted(1, "item"), counted(2, "item")), ("0 items".into(), "1 item".into(), "2 items".into()));
/// ```
#[must_use]
pub fn counted(count: usize, one: &str) -> String {
    if count == 1 { format!("1 {one}") } else { format!("{count} {one}s") }
}

/// An allowed range of counts: `exactly 2 items` or `1 to 8 items`.
#[must_use]
pub(crate) fn count_range(min: usize, max: usize, one: &str) -> String {
    if min == max { format!("exactly {}", counted(min, one)) } else { format!("{min} to {}", counted(max, one)) }
}
