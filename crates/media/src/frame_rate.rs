//! Frame rates as fractions, `[frames, seconds]`, for formats that limit their numbers.

fn greatest_common_divisor(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}

/// `fps` in lowest terms; `None` for a rate of zero or a denominator of zero.
pub(crate) fn reduce([frames, seconds]: [u32; 2]) -> Option<[u32; 2]> {
    let divisor = greatest_common_divisor(frames, seconds);
    (frames > 0 && seconds > 0).then(|| [frames / divisor, seconds / divisor])
}

/// The rate nearest to `fps` among those convergents of its continued fraction whose numerator and denominator are at most `limit`. That is
/// `fps` itself in lowest terms where it fits; otherwise the relative error is less than 1 / `limit`. `None` for a rate of zero, a denominator
/// of zero, and rates above `limit` or below 1 / `limit`.
pub(crate) fn approximate(fps: [u32; 2], limit: u32) -> Option<[u32; 2]> {
    let [mut dividend, mut divisor] = reduce(fps)?.map(u64::from);
    let (mut before, mut found) = ([0_u64, 1], [1_u64, 0]);
    while divisor > 0 {
        let whole = dividend / divisor;
        let next = [0, 1].map(|term| whole * found[term] + before[term]);
        if next.iter().any(|term| *term > u64::from(limit)) {
            break;
        }
        (before, found) = (found, next);
        (dividend, divisor) = (divisor, dividend % divisor);
    }
    let [frames, seconds] = found.map(|term| u32::try_from(term).unwrap_or(limit));
    (frames > 0 && seconds > 0).then_some([frames, seconds])
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Rates with large numerators and denominators, 0.003 to 1000 frames per second.
    pub(crate) fn irregular_rates() -> impl Iterator<Item = [u32; 2]> {
        (1..4000_u32).map(|i| [i.wrapping_mul(0x9E37_79B9) % 1_000_000 + 1000, 1000 + i * 77])
    }

    #[test]
    fn approximations_are_as_exact_as_their_limit_allows() {
        let rate = |[frames, seconds]: [u32; 2]| f64::from(frames) / f64::from(seconds);
        for fps in [[999_999, 1000], [u32::MAX, 4_294_968]].into_iter().chain(irregular_rates()) {
            let signed = approximate(fps, i32::MAX as u32).unwrap();
            assert!((rate(signed) / rate(fps) - 1.0).abs() < 1.0 / 2_147_483_647.0, "{fps:?}: {signed:?}");
        }
        assert_eq!(approximate([60_000, 2000], u32::MAX), Some([30, 1]));
        assert_eq!(approximate([u32::MAX, u32::MAX - 1], u32::MAX), Some([u32::MAX, u32::MAX - 1]));
        assert_eq!((approximate([1, 100_000], 65_535), approximate([100_000, 1], 65_535)), (None, None));
    }
}
