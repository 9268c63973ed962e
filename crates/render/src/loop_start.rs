//! Where a loop begins: at a calm moment, since a seam is looked for.

use std::sync::Arc;

use bansho_base::{
    color::{AlphaConvention, View},
    host::observer::{Cancelled, Unobserved},
};

use crate::{
    compiled::CompiledScene,
    display,
    plan::Plan,
    shot::{RenderError, Shot},
};

/// Longer side of the pictures that are compared, pixels.
const SIDE: usize = 96;
/// Moments that are compared, spread over the turn: of so many, the calmest lies well below the median.
const MOMENTS: i64 = 16;

/// Frames from the beginning of the turn to the moment at which two frames differ least, of several.
///
/// 0 for what is simulated: its loops close in the middle of a crossfade, which is calm. Also 0 for what cannot be drawn, which will say so
/// when it is.
pub(crate) fn search(compiled: &Arc<CompiledScene>, plan: &Plan) -> i64 {
    if plan.loop_s().is_none() || compiled.is_stepped() {
        return 0;
    }
    calmest(compiled, plan).unwrap_or_default()
}

fn calmest(compiled: &Arc<CompiledScene>, plan: &Plan) -> Result<i64, RenderError> {
    let frames = plan.frames();
    let count = frames.end - frames.start;
    let moments = MOMENTS.min(count);
    let starts: Vec<i64> = (0..moments).map(|moment| moment * count / moments).collect();
    let mut shot = Shot::open(compiled.clone(), Arc::new(small(plan)));
    let mut change = |start: &i64| {
        let number = frames.start + start;
        Ok(Change::between(&picture(&mut shot, number - 1)?, &picture(&mut shot, number)?))
    };
    let changes = starts.iter().map(&mut change).collect::<Result<Vec<_>, RenderError>>()?;
    let sum = changes
        .iter()
        .fold(Change::default(), |sum, each| Change { codes: sum.codes + each.codes, light: sum.light + each.light });
    let beside_mean = |change: &Change| (change.codes * sum.light).max(change.light * sum.codes);
    let calmest = starts.iter().zip(&changes).min_by(|a, b| beside_mean(a.1).total_cmp(&beside_mean(b.1)));
    Ok(calmest.map_or(0, |(start, _)| *start))
}

/// How much two pictures differ.
#[derive(Default)]
struct Change {
    /// To the eye.
    codes: f64,
    /// In light, where bright parts count most.
    light: f64,
}

impl Change {
    /// Of display codes; their squares are nearly light.
    fn between(before: &[f64], after: &[f64]) -> Self {
        let pairs = || before.iter().zip(after);
        Self {
            codes: pairs().map(|(a, b)| (a - b).abs()).sum(),
            light: pairs().map(|(a, b)| (a * a - b * b).abs()).sum(),
        }
    }
}

/// The same shot in small.
pub(crate) fn small(plan: &Plan) -> Plan {
    let longest = plan.size[0].max(plan.size[1]);
    let size = plan.size.map(|side| (side * SIDE).div_ceil(longest));
    Plan { layers: false, aovs: false, metadata: false, ..plan.at_size(size) }
}

/// Display codes of a frame over black, from 0 to 1.
pub(crate) fn picture(shot: &mut Shot, number: i64) -> Result<Vec<f64>, RenderError> {
    shot.advance(number, &Unobserved)?;
    shot.draw(&Unobserved)?;
    let frame = shot.read().ok_or(Cancelled)?;
    let codes = display::codes::<u16>(&frame, &View::DISPLAY, AlphaConvention::Linear).into_iter();
    Ok(codes
        .flat_map(|[r, g, b, alpha]| [r, g, b].map(|code| f64::from(code) * f64::from(alpha) * CODE * CODE))
        .collect())
}

/// The least code.
const CODE: f64 = 1.0 / u16::MAX as f64;
