//! Particles scattered evenly about a shape, within L_thr (thesis, 2.2.3): sampled along its segments, so that the cost grows with
//! their number alone.

use bansho_base::{
    math::{self, DVec2},
    random::{Key, Purpose, uniform},
};
use rayon::prelude::*;

use super::course::Course;

const SCATTER: Purpose = Purpose::named("aurora scatter");

/// How far charge reaches beyond the end of a sheet, screening lengths: so its particles find their lowest place up to the end.
const BEYOND: f64 = 0.3;

/// A particle that stands for the charge about a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Charge {
    /// Where it is, km.
    pub(super) place: DVec2,
    /// Its charge beside that of one far from the ends of the sheet.
    pub(super) charge: f64,
    /// Whether it is within L_thr of the shape, not just beyond an end.
    pub(super) counted: bool,
}

/// Particles within `half_thickness` km of the shape, evenly over the area that it covers; the `renewal`th set of `count` trials. Beyond
/// the ends of sheets there are some more that do not count.
///
/// A place counts for the segment that it is nearest to, so that nothing is counted twice where segments overlap. `reach` is the
/// screening length of the field, km.
pub(super) fn scatter(
    course: &Course,
    [half_thickness, reach]: [f64; 2],
    count: usize,
    key: Key,
    renewal: u32,
) -> Vec<Charge> {
    let segments = course.segments();
    let lengths: Vec<f64> = course.sheet_lengths();
    let charges = |index: usize| {
        let [u, v, ..] = key.words(index as u64, renewal, SCATTER).map(|word| f64::from(uniform(word)));
        let sample = segments.sample((index as f64 + u) / count as f64)?;
        let place = sample.point + sample.tangent.perp() * (half_thickness * (2.0 * v - 1.0));
        let own = [sample.segment.sheet, sample.segment.segment];
        let (length, share) = (lengths[sample.segment.sheet] / reach, sample.share);
        // To its mirror image beyond an end, in screening lengths along the sheet.
        let images = [-2.0 * share * length, 2.0 * (1.0 - share) * length];
        let charge = move |shift: f64| {
            let from_start = share * length + shift + BEYOND;
            Charge {
                place: place + sample.tangent * (shift * reach),
                charge: end_charge(from_start) * end_charge(length + 2.0 * BEYOND - from_start),
                counted: shift == 0.0,
            }
        };
        let images = images.into_iter().filter(|shift| (0.0..2.0 * BEYOND).contains(&shift.abs()) && *shift != 0.0);
        (course.nearest_segment(place) == Some(own)).then(|| std::iter::once(0.0).chain(images).map(charge))
    };
    (0..count).into_par_iter().with_min_len(1024).filter_map(charges).flatten_iter().collect()
}

/// Charge at `way` screening lengths from the end of a long sheet that is at one potential all along, as a conductor, 1 far from the end: the
/// solution of `integral of K_0(|s - s'|) charge(s') ds' = constant` over s' > 0, `erf(sqrt s) + exp(-s) / sqrt(pi s)`.
///
/// With an even charge the potential would rise by half toward the end, and draw particles away from there.
fn end_charge(way: f64) -> f64 {
    /// A sheet is not thin: its charge does not grow without end.
    const LEAST: f64 = 0.08;
    if way > 8.0 {
        return 1.0;
    }
    let way = way.max(LEAST);
    let root = math::sqrt(way);
    erf(root) + math::exp(-way) / (math::sqrt(std::f64::consts::PI) * root)
}

/// The error function for x from 0 (Abramowitz & Stegun 7.1.26), within 1.5e-7.
fn erf(x: f64) -> f64 {
    const TERMS: [f64; 5] = [0.254_829_592, -0.284_496_736, 1.421_413_741, -1.453_152_027, 1.061_405_429];
    let t = 1.0 / (1.0 + 0.327_591_1 * x);
    1.0 - TERMS.iter().rev().fold(0.0, |sum, term| (sum + term) * t) * math::exp(-x * x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_function_and_charge_by_table() {
        for (x, value) in [(0.0, 0.0), (0.5, 0.520_499_877_8), (1.0, 0.842_700_792_9), (2.0, 0.995_322_265_0)] {
            assert!((erf(x) - value).abs() < 2e-7, "{x}");
        }
        // erf(1) + exp(-1) / sqrt(pi).
        assert!((end_charge(1.0) - 1.050_254).abs() < 1e-5);
        assert!(end_charge(0.1) > 1.9 && (end_charge(7.9) - 1.0).abs() < 1e-3);
    }
}
