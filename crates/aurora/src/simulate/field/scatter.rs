//! Particles scattered evenly about a shape, within L_thr (thesis, 2.2.3): sampled along its segments, so that the cost grows with
//! their number alone.

use bansho_base::math::{
    DVec2,
    random::{Key, Purpose, uniform},
};

use crate::simulate::sheets::refined_shape::RefinedShape;
use rayon::prelude::*;

const SCATTER: Purpose = Purpose::named("aurora scatter");

/// A particle that stands for the charge about a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ScatteredParticle {
    /// Where it is, km.
    pub(crate) position: DVec2,
    /// The sheet that it is nearest to.
    pub(crate) sheet: u32,
    /// Share of that sheet's length before it.
    pub(crate) arc_fraction: f32,
    /// How far it is to the side, from -1 to 1 within L_thr.
    pub(super) side: f32,
}

/// Particles within `half_thickness` km of the shape, evenly over the area that it covers; the `renewal`th set of `count` trials.
///
/// A place counts for the segment that it is nearest to, so that nothing is counted twice where segments overlap.
pub(crate) fn scatter(
    refined: &RefinedShape,
    half_thickness: f64,
    count: usize,
    key: Key,
    renewal: u32,
) -> Vec<ScatteredParticle> {
    let segments = refined.segments();
    let particle = |index: usize| {
        let [u, v, ..] = key.words(index as u64, renewal, SCATTER).map(|word| f64::from(uniform(word)));
        let sample = segments.sample((index as f64 + u) / count as f64)?;
        let side = 2.0 * v - 1.0;
        let position = sample.point + sample.tangent.perp() * (half_thickness * side);
        let own = [sample.segment.sheet, sample.segment.segment];
        let scattered = ScatteredParticle {
            position,
            sheet: own[0] as u32,
            arc_fraction: sample.fraction as f32,
            side: side as f32,
        };
        (refined.nearest_segment(position) == Some(own)).then_some(scattered)
    };
    (0..count).into_par_iter().with_min_len(1024).filter_map(particle).collect()
}
