//! Whether a phenomenon is seen before its plate at all.

use std::{collections::HashSet, sync::Arc};

use bansho_base::phenomenon::{Phenomenon, Remark};

use crate::{
    compiled::CompiledScene,
    loop_start::{picture, small},
    plan::Plan,
    shot::{RenderError, Shot},
};

/// Mean change of the picture beside its mean, of display values, below which nobody sees a phenomenon at once.
const FAINT: f64 = 0.02;
/// Change of display values that is seen also where it is small in extent, and the share of the picture that must change so much.
const SEEN: f64 = 0.1;
const SEEN_SHARE: f64 = 0.001;

/// Most phenomena of which each is looked at: a picture without it is drawn for every one, which holds all others.
const MOST: usize = 16;

/// Remarks on those phenomena that change the plate so little that they are hardly seen; on none of them without a plate.
///
/// Measured in small pictures of one frame, and of two more where it shows none; what is simulated in steps is left out of it. Nothing is
/// measured of more phenomena than are looked at one by one.
pub(crate) fn faint(compiled: &CompiledScene, plan: &Plan) -> Vec<(String, Remark)> {
    if !plan.scene.has_plate() {
        return Vec::new();
    }
    let infos = || compiled.phenomena().map(|phenomenon| phenomenon.info());
    let stepped: Vec<&str> = infos().filter(|info| info.stepping.is_some()).map(|info| info.name).collect();
    let own: HashSet<&str> =
        plan.scene.instances.iter().filter(|own| own.enabled).map(|own| own.name.as_str()).collect();
    let closed = Arc::new(compiled.without(&stepped));
    let remark = |phenomenon: &&Arc<dyn Phenomenon>| {
        let info = phenomenon.info();
        // What cannot be drawn will say so when it is.
        let change = greatest_change(&closed, plan, info.name).ok()?;
        let message = format!(
            "it changes the picture by {:.1} %, which is hardly seen; to show it, {}, or lower `exposure_ev100` in [plate]",
            100.0 * change.mean,
            info.strengthened_by
        );
        change.is_faint().then(|| (info.name.to_owned(), Remark::new(message)))
    };
    let looked_at: Vec<_> = closed.phenomena().filter(|each| own.contains(each.info().name)).collect();
    if looked_at.len() > MOST { Vec::new() } else { looked_at.iter().filter_map(remark).collect() }
}

/// How much a picture differs from the one without a phenomenon.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Change {
    /// Mean, beside the mean of the picture without.
    mean: f64,
    /// What is exceeded in the part that changes most.
    most: f64,
}

impl Change {
    fn is_faint(&self) -> bool {
        self.mean < FAINT && self.most < SEEN
    }

    fn between(with: &[f64], without: &[f64]) -> Self {
        let mut each: Vec<f64> = with.iter().zip(without).map(|(a, b)| (a - b).abs()).collect();
        let (sum, all) = (each.iter().sum::<f64>(), without.iter().sum::<f64>());
        each.sort_by(f64::total_cmp);
        let most = each.get(((1.0 - SEEN_SHARE) * each.len() as f64) as usize).copied().unwrap_or_default();
        Self { mean: sum / all.max(f64::MIN_POSITIVE), most }
    }
}

/// The change in the middle frame, or if that is faint the greatest of the first's and the last's too.
fn greatest_change(compiled: &Arc<CompiledScene>, plan: &Plan, name: &str) -> Result<Change, RenderError> {
    let small = Arc::new(small(plan));
    let without = Arc::new(compiled.without(&[name]));
    let mut shots = [compiled.clone(), without].map(|compiled| Shot::open(compiled, small.clone()));
    let frames = plan.frames();
    let mut greatest = Change { mean: 0.0, most: 0.0 };
    for number in [(frames.start + frames.end) / 2, frames.start, frames.end - 1] {
        let [with, without] = shots.each_mut().map(|shot| picture(shot, number));
        let change = Change::between(&with?, &without?);
        greatest = Change { mean: greatest.mean.max(change.mean), most: greatest.most.max(change.most) };
        if !greatest.is_faint() {
            break;
        }
    }
    Ok(greatest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_flame_is_seen_and_a_breath_of_grey_is_not() {
        let plate = vec![0.25; 1000];
        let changed = |count: usize, by: f64| {
            let mut with = plate.clone();
            with[..count].iter_mut().for_each(|value| *value += by);
            Change::between(&with, &plate)
        };
        assert!((changed(1000, 0.004).mean - 0.016).abs() < 1e-12);
        assert!(changed(1000, 0.004).is_faint() && !changed(1000, 0.006).is_faint());
        assert!(!changed(2, 0.3).is_faint() && changed(0, 0.3).is_faint() && changed(900, 0.001).is_faint());
        assert!(!Change::between(&[0.1; 4], &[0.0; 4]).is_faint());
    }
}
