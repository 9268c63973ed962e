//! Checks that memory is available before it is needed: a process that runs out of memory later is killed without an error message.

/// Smaller amounts are not checked in advance, bytes.
const UNCHECKED_BYTES: f64 = (1 << 30) as f64;
/// Lower bound of what a process needs besides the checked amount, bytes.
const OVERHEAD_BYTES: f64 = (256 << 20) as f64;

/// Whether that many bytes can be allocated. They are reserved and released without being touched. Under a fuzzer, which counts
/// reserved memory as used, nothing is reserved and amounts from 1 GiB on are refused.
pub fn can_allocate(bytes: f64) -> bool {
    if bytes < UNCHECKED_BYTES {
        return true;
    }
    // NaN would be cast to 0 bytes.
    if cfg!(fuzzing) || bytes.is_nan() {
        return false;
    }
    Vec::<u8>::new().try_reserve_exact((bytes + OVERHEAD_BYTES) as usize).is_ok()
}

/// A number of bytes for messages: in GiB, MiB or KiB with one decimal, or in bytes.
pub fn format_bytes(bytes: u64) -> String {
    let units = [(1_u64 << 30, "GiB"), (1 << 20, "MiB"), (1 << 10, "KiB")];
    match units.into_iter().find(|&(unit, _)| bytes >= unit) {
        Some((unit, name)) => format!("{:.1} {name}", bytes as f64 / unit as f64),
        None => format!("{bytes} bytes"),
    }
}

/// The largest multiple of a twentieth of `count` for which `fits` holds; 0 if there is none.
pub fn largest_fitting_count(count: i64, fits: impl Fn(i64) -> bool) -> i64 {
    // Avoids overflow, and keeps the remainder of the division for small counts.
    let mut fractions = (1..=20).rev().map(|twentieths| count / 20 * twentieths + count % 20 * twentieths / 20);
    fractions.find(|&candidate| fits(candidate)).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_granted_and_more_than_there_can_be_is_not() {
        assert!(can_allocate(0.0) && can_allocate(1e6));
        assert!(!can_allocate(1e30) && !can_allocate(f64::INFINITY) && !can_allocate(f64::NAN));
    }

    #[test]
    fn bytes_are_shown_in_the_unit_that_suits() {
        assert_eq!([0, 1023, 1024, 5 << 20].map(format_bytes), ["0 bytes", "1023 bytes", "1.0 KiB", "5.0 MiB"]);
        assert_eq!([3 << 29, u64::MAX].map(format_bytes), ["1.5 GiB", "17179869184.0 GiB"]);
    }

    #[test]
    fn the_most_is_a_twentieth_that_fits() {
        assert_eq!(largest_fitting_count(1000, |count| count <= 640), 600);
        assert_eq!(largest_fitting_count(1000, |_| true), 1000);
        assert_eq!(largest_fitting_count(1000, |_| false), 0);
        assert_eq!(
            [
                largest_fitting_count(19, |_| true),
                largest_fitting_count(19, |count| count <= 10),
                largest_fitting_count(3, |count| count <= 2)
            ],
            [19, 10, 2]
        );
        assert_eq!(largest_fitting_count(i64::MAX, |_| true), i64::MAX);
    }
}
