//! Reference tables for tests.

/// Rows of a CSV table without its header; text becomes NaN.
pub(crate) fn rows<const N: usize>(table: &str) -> Vec<[f64; N]> {
    table.lines().skip(1).map(|line| fields(line).map(|field| field.parse().unwrap_or(f64::NAN))).collect()
}

/// Fields of one line.
pub(crate) fn fields<const N: usize>(line: &str) -> [&str; N] {
    let mut fields = line.split(',');
    std::array::from_fn(|_| fields.next().expect("a field for every column"))
}

/// Whether the relative error of `value` is at most `share`.
pub(crate) fn near(value: f64, expected: f64, share: f64) -> bool {
    (value - expected).abs() <= share * expected.abs()
}
