//! Frame rates as fractions, `[frames, seconds]`, and the times of frames in the units of formats that limit their numbers.

fn greatest_common_divisor(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}

/// `fps` in lowest terms; `None` for a rate of zero or a denominator of zero.
fn reduce([frames, seconds]: [u32; 2]) -> Option<[u32; 2]> {
    let divisor = greatest_common_divisor(frames, seconds);
    (frames > 0 && seconds > 0).then(|| [frames / divisor, seconds / divisor])
}

/// The rate nearest to `fps` among those convergents of its continued fraction whose numerator and denominator are at most `limit`. That is
/// `fps` itself in lowest terms where it fits; otherwise the relative error is less than 1 / `limit`. `None` for a rate of zero, a denominator
/// of zero, and rates above `limit` or below 1 / `limit`.
pub(crate) fn approximate(fps: [u32; 2], limit: u32) -> Option<[u32; 2]> {
    let [mut dividend, mut divisor] = reduce(fps)?.map(u64::from);
    // Euclid's algorithm gives the terms of the continued fraction, and each term the next convergent from the last two. They alternate around the rate, and each
    // is nearer than the one before.
    let (mut previous, mut convergent) = ([0_u64, 1], [1_u64, 0]);
    while divisor > 0 {
        let whole = dividend / divisor;
        let next = [0, 1].map(|term| whole * convergent[term] + previous[term]);
        if next.iter().any(|term| *term > u64::from(limit)) {
            break;
        }
        (previous, convergent) = (convergent, next);
        (dividend, divisor) = (divisor, dividend % divisor);
    }
    let [frames, seconds] = convergent.map(|term| u32::try_from(term).unwrap_or(limit));
    (frames > 0 && seconds > 0).then_some([frames, seconds])
}

/// Duration of a frame for APNG, `[numerator, denominator]` of seconds in 16 bits. Other rates are approximated with a relative error below
/// 1 / 65,535.
pub(crate) fn apng_delay(fps: [u32; 2]) -> Option<[u16; 2]> {
    let [frames, seconds] = approximate(fps, u32::from(u16::MAX))?;
    Some([u16::try_from(seconds).ok()?, u16::try_from(frames).ok()?])
}

/// Shortest GIF delay that viewers respect, hundredths of a second; they slow shorter ones down.
const MIN_DELAY_CS: u64 = 2;

/// Frames of a GIF: which are kept, and their delays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GifTiming {
    fps: [u64; 2],
}

impl GifTiming {
    /// `None` for a rate of zero, or one so slow that the delay of a frame does not fit into 16 bits.
    pub(crate) fn new(fps: [u32; 2]) -> Option<Self> {
        let fps = reduce(fps)?.map(u64::from);
        (fps[1] * 100 / fps[0] < u64::from(u16::MAX)).then_some(Self { fps })
    }

    fn is_too_fast(&self) -> bool {
        self.fps[0] * MIN_DELAY_CS > self.fps[1] * 100
    }

    /// The fiftieth of a second in which frame `index` begins, from 0.
    fn fiftieth(&self, index: usize) -> u64 {
        index as u64 * self.fps[1] * (100 / MIN_DELAY_CS) / self.fps[0]
    }

    /// Whether frame `index` is kept: all frames up to 50 frames per second; of faster films the first one in each fiftieth of a second.
    pub(crate) fn is_kept(&self, index: usize) -> bool {
        index == 0 || !self.is_too_fast() || self.fiftieth(index) != self.fiftieth(index - 1)
    }

    /// Start of frame `index`, hundredths of a second, rounded from the exact time so that errors do not accumulate.
    pub(crate) fn start_cs(&self, index: usize) -> u64 {
        if self.is_too_fast() {
            return self.fiftieth(index) * MIN_DELAY_CS;
        }
        // The nearest hundredth: half of the divisor is added.
        (index as u64 * self.fps[1] * 200 + self.fps[0]) / (2 * self.fps[0])
    }

    /// Delay of frame `index` of `count` until the next frame that is kept, hundredths of a second.
    pub(crate) fn delay_cs(&self, index: usize, count: usize) -> u16 {
        let next = (index + 1..count).find(|&next| self.is_kept(next)).unwrap_or(count);
        let length = self.start_cs(next).saturating_sub(self.start_cs(index)).max(MIN_DELAY_CS);
        u16::try_from(length).unwrap_or(u16::MAX)
    }
}

#[cfg(test)]
mod tests {
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

    #[test]
    fn gif_time_does_not_drift() {
        for fps in [[24, 1], [30, 1], [24000, 1001], [12, 1], [50, 1], [1, 3]] {
            let timing = GifTiming::new(fps).unwrap();
            let exact = 24_000.0 * f64::from(fps[1]) / f64::from(fps[0]);
            let total: u64 = (0..240).map(|index| u64::from(timing.delay_cs(index, 240))).sum();
            assert!((total as f64 - exact).abs() <= 0.5, "{fps:?}: {total} for {exact}");
            assert!((0..240).all(|index| timing.is_kept(index)));
        }
        // 30 frames a second: 3, 4 and 3 hundredths, again and again.
        let timing = GifTiming::new([30, 1]).unwrap();
        assert_eq!([0, 1, 2, 3].map(|index| timing.delay_cs(index, 30)), [3, 4, 3, 3]);
    }

    #[test]
    fn gifs_faster_than_fifty_drop_frames_evenly() {
        for (fps, kept) in [([60, 1], 50), ([100, 1], 50), ([120, 1], 50), ([240, 1], 50)] {
            let timing = GifTiming::new(fps).unwrap();
            let frames = fps[0] as usize;
            let shown: Vec<usize> = (0..frames).filter(|&index| timing.is_kept(index)).collect();
            assert_eq!(shown.len(), kept, "{fps:?}");
            assert!(shown.iter().all(|&index| timing.delay_cs(index, frames) == 2));
            let gaps: Vec<usize> = shown.windows(2).map(|pair| pair[1] - pair[0]).collect();
            assert!(gaps.iter().max().unwrap() - gaps.iter().min().unwrap() <= 1, "{gaps:?}");
        }
    }

    #[test]
    fn apng_lengths_are_exact_fractions() {
        assert_eq!(apng_delay([30, 1]), Some([1, 30]));
        assert_eq!(apng_delay([24000, 1001]), Some([1001, 24000]));
        assert_eq!(apng_delay([60000, 2000]), Some([1, 30]));
        let [seconds, frames] = apng_delay([2_997_003, 100_000]).unwrap().map(f64::from);
        assert!((frames / seconds / 29.97003 - 1.0).abs() < 1.0 / 65_535.0);
        assert_eq!(apng_delay([0, 1]), None);
        assert_eq!(apng_delay([1, 0]), None);
        assert_eq!(apng_delay([1, 100_000]), None);
    }

    #[test]
    fn rates_whose_fraction_does_not_fit_become_the_nearest_that_does() {
        let rates = [[999_999, 1000], [700_001, 1000], [333_333, 1000], [100_001, 1_000_000], [u32::MAX, 4_294_968]];
        for fps in rates.into_iter().chain(irregular_rates()) {
            let [seconds, frames] = apng_delay(fps).unwrap().map(f64::from);
            let error = (frames / seconds * f64::from(fps[1]) / f64::from(fps[0]) - 1.0).abs();
            assert!(error < 1.0 / 65_535.0, "{fps:?}: {frames}/{seconds}, relative error {error}");
        }
    }

    #[test]
    fn impossible_rates_are_refused() {
        assert!(GifTiming::new([0, 1]).is_none());
        assert!(GifTiming::new([1, 0]).is_none());
        assert!(GifTiming::new([1, 700]).is_none());
    }
}
