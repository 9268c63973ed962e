//! The first frame of a loop in closed form: viewers look for the seam, so it is put where consecutive frames differ least.

use std::sync::Arc;

use bansho_base::{
    color::{AlphaConvention, BitDepth, View},
    frame::DisplayPixels,
    host::observer::Observer,
};

use crate::{
    compiled::CompiledScene,
    display::DisplayOptions,
    plan::Plan,
    shot::{RenderError, Shot},
};

/// Longer side of the thumbnails that are compared, pixels.
const THUMBNAIL_SIDE: usize = 96;
/// Candidates, spread evenly over the loop. Of 16, the best is well below the median.
const CANDIDATES: i64 = 16;

/// Offset in frames, from the beginning of the loop, of the candidate that differs least from the frame before it.
///
/// 0 for what is simulated: its loops close in the middle of a crossfade, where frames differ little. Also 0 where a frame cannot be drawn;
/// the error is reported when it is drawn for output, and where the observer stops the work.
pub(crate) fn search(compiled: &Arc<CompiledScene>, plan: &Plan, observer: &dyn Observer) -> i64 {
    if plan.loop_s().is_none() || compiled.is_stepped() {
        return 0;
    }
    least_change(compiled, plan, observer).unwrap_or_default()
}

fn least_change(compiled: &Arc<CompiledScene>, plan: &Plan, observer: &dyn Observer) -> Result<i64, RenderError> {
    let frames = plan.frames();
    let count = frames.end - frames.start;
    let candidates = CANDIDATES.min(count);
    let offsets: Vec<i64> = (0..candidates).map(|candidate| candidate * count / candidates).collect();
    let mut shot = Shot::open(compiled.clone(), Arc::new(thumbnail_plan(plan)));
    let (mut differences, mut sum) = (Vec::with_capacity(offsets.len()), Difference::default());
    for offset in &offsets {
        let number = frames.start + offset;
        let before = draw_thumbnail(&mut shot, number - 1, observer)?;
        let difference = Difference::between(&before, &draw_thumbnail(&mut shot, number, observer)?);
        sum.codes += difference.codes;
        sum.light += difference.light;
        differences.push(difference);
    }
    let best = offsets.iter().zip(&differences).min_by(|a, b| a.1.relative_to(&sum).total_cmp(&b.1.relative_to(&sum)));
    Ok(best.map_or(0, |(offset, _)| *offset))
}

/// How much two frames differ.
#[derive(Default)]
struct Difference {
    /// Sum over display codes, which are nearly perceptually uniform.
    codes: f64,
    /// Sum over linear light, to which bright regions contribute more.
    light: f64,
}

impl Difference {
    /// Of display codes; their squares are nearly linear light.
    fn between(before: &[f64], after: &[f64]) -> Self {
        Self {
            codes: before.iter().zip(after).map(|(a, b)| (a - b).abs()).sum(),
            light: before.iter().zip(after).map(|(a, b)| (a * a - b * b).abs()).sum(),
        }
    }

    /// The larger of its fractions of the two sums over all candidates, times the product of both sums, so that a sum of 0 is no divisor.
    fn relative_to(&self, sum: &Self) -> f64 {
        (self.codes * sum.light).max(self.light * sum.codes)
    }
}

/// The same shot in thumbnail size, without layers, AOVs and metadata.
pub(crate) fn thumbnail_plan(plan: &Plan) -> Plan {
    let longest = plan.size[0].max(plan.size[1]);
    let size = plan.size.map(|side| (side * THUMBNAIL_SIDE).div_ceil(longest));
    Plan { layers: false, aovs: false, metadata: false, ..plan.at_size(size) }
}

/// Display codes of a frame over black, from 0 to 1.
pub(crate) fn draw_thumbnail(shot: &mut Shot, number: i64, observer: &dyn Observer) -> Result<Vec<f64>, RenderError> {
    shot.advance(number, observer)?;
    let target = DisplayOptions {
        view: View::DISPLAY,
        depth: BitDepth::Sixteen,
        alpha: AlphaConvention::Linear,
        over_black: false,
    };
    let DisplayPixels::Sixteen(codes) = shot.draw(&target, observer)?.image.pixels else { return Ok(Vec::new()) };
    Ok(codes
        .into_iter()
        .flat_map(|[r, g, b, alpha]| [r, g, b].map(|code| f64::from(code) * f64::from(alpha) * CODE_STEP * CODE_STEP))
        .collect())
}

/// Difference between two codes of 16 bits, where the largest code is 1.
const CODE_STEP: f64 = 1.0 / u16::MAX as f64;
