//! Remarks on phenomena that hardly change their plate.

use std::{collections::HashSet, sync::Arc};

use bansho_base::{
    host::observer::Unobserved,
    phenomenon::{PhenomenonInfo, Remark},
};

use crate::{
    compiled::CompiledScene,
    plan::Plan,
    planning::loop_start::{draw_thumbnail, thumbnail_plan},
    shot::{RenderError, Shot},
};

/// Mean change of display values, relative to their mean, below which a phenomenon is easily overlooked.
const FAINT_MEAN: f64 = 0.02;
/// Change of display values that is seen even if few pixels have it, and the fraction of the values that must change so much.
const VISIBLE_CHANGE: f64 = 0.1;
const VISIBLE_FRACTION: f64 = 0.001;

/// Largest number of phenomena that are measured: for each, a picture of all the others is drawn.
const MAX_MEASURED: usize = 16;

/// Remarks on those phenomena that change the plate so little that they are hardly visible; none without a plate.
///
/// Measured in a thumbnail of the middle frame, and where that shows no change in those of the first and last frame. Phenomena that are
/// simulated in steps are left out. With more than [`MAX_MEASURED`] phenomena nothing is measured.
pub(crate) fn faint_phenomenon_remarks(compiled: &CompiledScene, plan: &Plan) -> Vec<(String, Remark)> {
    if !plan.scene.has_plate() {
        return Vec::new();
    }
    let infos = compiled.phenomena().map(|phenomenon| phenomenon.info());
    let stepped: Vec<&str> = infos.filter(|info| info.stepping.is_some()).map(|info| info.name).collect();
    let enabled: HashSet<&str> = plan
        .scene
        .instances
        .iter()
        .filter(|instance| instance.enabled)
        .map(|instance| instance.name.as_str())
        .collect();
    let closed_forms = Arc::new(compiled.without(&stepped));
    let measured = closed_forms.phenomena().map(|phenomenon| phenomenon.info());
    let measured: Vec<PhenomenonInfo> = measured.filter(|info| enabled.contains(info.name)).collect();
    if measured.len() > MAX_MEASURED {
        return Vec::new();
    }
    let mut remarks = Vec::new();
    for info in measured {
        // What cannot be drawn is reported when it is drawn for output.
        let Ok(change) = greatest_change(&closed_forms, plan, info.name) else { continue };
        if change.is_faint() {
            let message = format!(
                "it changes the picture by {:.1} %, which is hardly visible; to show it, {}, or lower `exposure_ev100` in [plate]",
                100.0 * change.mean,
                info.strengthened_by
            );
            remarks.push((info.name.to_owned(), Remark::new(message)));
        }
    }
    remarks
}

/// How much a picture differs from the one without a phenomenon.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Change {
    /// Mean absolute difference, relative to the mean of the picture without the phenomenon.
    mean: f64,
    /// Absolute difference that [`VISIBLE_FRACTION`] of the values exceed.
    peak: f64,
}

impl Change {
    fn is_faint(&self) -> bool {
        self.mean < FAINT_MEAN && self.peak < VISIBLE_CHANGE
    }

    fn between(with: &[f64], without: &[f64]) -> Self {
        let mut each: Vec<f64> = with.iter().zip(without).map(|(a, b)| (a - b).abs()).collect();
        let (sum, all) = (each.iter().sum::<f64>(), without.iter().sum::<f64>());
        each.sort_by(f64::total_cmp);
        let peak = each.get(((1.0 - VISIBLE_FRACTION) * each.len() as f64) as usize).copied().unwrap_or_default();
        Self { mean: sum / all.max(f64::MIN_POSITIVE), peak }
    }
}

/// The change in the middle frame; if that is faint, the largest of the middle, first and last frame.
fn greatest_change(compiled: &Arc<CompiledScene>, plan: &Plan, name: &str) -> Result<Change, RenderError> {
    let thumbnail = Arc::new(thumbnail_plan(plan));
    let without = Arc::new(compiled.without(&[name]));
    let mut shots = [compiled.clone(), without].map(|compiled| Shot::open(compiled, thumbnail.clone()));
    let frames = plan.frames();
    let mut greatest = Change { mean: 0.0, peak: 0.0 };
    for number in [(frames.start + frames.end) / 2, frames.start, frames.end - 1] {
        let [with, without] = shots.each_mut().map(|shot| draw_thumbnail(shot, number, &Unobserved));
        let change = Change::between(&with?, &without?);
        greatest = Change { mean: greatest.mean.max(change.mean), peak: greatest.peak.max(change.peak) };
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
