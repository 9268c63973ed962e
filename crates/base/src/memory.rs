//! Whether the system would give memory, asked before it is needed: a program that runs out of it on the way is ended, and can tell nobody.

/// Fewer bytes are not asked for in advance.
const FEW_BYTES: f64 = (1 << 30) as f64;
/// What a program takes beside what it asks about, at the least, bytes.
const OTHER_BYTES: f64 = (256 << 20) as f64;

/// Whether the system would give so many bytes. They are asked for and given back untouched. A fuzzer takes asking for using, and is not asked.
pub fn is_granted(bytes: f64) -> bool {
    let granted = || Vec::<u8>::new().try_reserve_exact((bytes + OTHER_BYTES) as usize).is_ok();
    bytes < FEW_BYTES || (!cfg!(fuzzing) && granted())
}

/// The largest of the twentieths of `count` that `fits`; 0 where none does.
pub fn most(count: i64, fits: impl Fn(i64) -> bool) -> i64 {
    (1..=20).rev().map(|parts| count / 20 * parts).find(|&part| fits(part)).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_granted_and_more_than_there_can_be_is_not() {
        assert!(is_granted(0.0) && is_granted(1e6));
        assert!(!is_granted(1e30) && !is_granted(f64::INFINITY));
    }

    #[test]
    fn the_most_is_a_twentieth_that_fits() {
        assert_eq!(most(1000, |count| count <= 640), 600);
        assert_eq!(most(1000, |_| true), 1000);
        assert_eq!(most(1000, |_| false), 0);
    }
}
