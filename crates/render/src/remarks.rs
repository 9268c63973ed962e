//! Remarks: what users should know about how a scene will look, and that is no error.

use std::sync::{Arc, OnceLock};

use bansho_base::{
    color,
    geometry::strokes::DrawingRemark,
    host::once::get_or_compute,
    phenomenon::{
        Remark,
        strip::Shutter,
        surroundings::{OtherPhenomena, Publication},
    },
    world::sky::Sky,
};

use crate::{
    compiled::{ActiveRun, CompiledScene},
    context::ShotContext,
    faint::faint_phenomenon_remarks,
    plan::Plan,
    planning::exposure::assumed_of_plate,
    shot::stepping::scene_publication,
};
use bansho_scene::{PLATE_LAYER, PlateRemark};

/// A scene during one exposure.
struct ExposedScene<'a> {
    shutter: Shutter,
    runs: &'a [ActiveRun],
    scene: Publication,
    /// What each phenomenon publishes, computed on first use.
    published: Vec<OnceLock<Publication>>,
    sky: Sky,
}

impl<'a> ExposedScene<'a> {
    fn new(context: &ShotContext, runs: &'a [ActiveRun], shutter: Shutter) -> Self {
        Self {
            shutter,
            runs,
            scene: scene_publication(context, shutter),
            published: runs.iter().map(|_| OnceLock::new()).collect(),
            sky: context.sky(shutter.middle()),
        }
    }

    fn remark(&self, index: usize) -> Option<Remark> {
        let published =
            |other: usize| get_or_compute(&self.published[other], || self.runs[other].run.publish(self.shutter));
        let count = self.runs.len();
        let neighbors =
            OtherPhenomena { scene: &self.scene, count, published: &published, own_index: index, sky: &self.sky };
        self.runs[index].built.phenomenon.remark(&neighbors)
    }
}

/// What users should know about how the files of the plate were read, in the first frame.
fn of_plate_files(compiled: &CompiledScene) -> Vec<(String, Remark)> {
    let scene = compiled.scene();
    let frame = scene.picture.first_frame;
    let read = scene.plate.read_frame(compiled.assets().as_ref(), frame, &scene.plate_view(frame));
    let Ok(Some(pictures)) = read else { return Vec::new() };
    let remark = |remark: &PlateRemark| (PLATE_LAYER.to_owned(), Remark::new(remark.to_string()));
    pictures.remarks().iter().map(remark).collect()
}

/// Extensions of drawings.
const DRAWINGS: [&str; 2] = [".svg", ".svgz"];

/// What users should know about how the drawings of phenomena were read.
fn of_drawings(compiled: &CompiledScene) -> Vec<(String, Remark)> {
    let mut remarks = Vec::new();
    for instance in compiled.scene().instances.iter().filter(|instance| instance.enabled) {
        let mut paths = instance.parameters.assets();
        paths.sort();
        paths.dedup();
        for path in paths.iter().filter(|path| DRAWINGS.iter().any(|drawing| path.ends_with(drawing))) {
            let Ok(drawing) = compiled.assets().drawing(path) else { continue };
            let remark = |remark: &DrawingRemark| (instance.name.clone(), Remark::new(format!("{path}: {remark}")));
            remarks.extend(drawing.remarks.iter().map(remark));
        }
    }
    remarks
}

/// What users should know about how phenomena will look: the name of each phenomenon, and the remark.
///
/// Only what holds in the first, the middle and the last frame is reported. That nothing lights a phenomenon is reported only where nothing
/// is simulated, since a simulated fire may light it later.
pub fn remarks(compiled: &Arc<CompiledScene>, plan: &Plan) -> Vec<(String, Remark)> {
    let context = ShotContext::new(compiled.clone(), Arc::new(plan.clone()));
    let runs = compiled.start();
    let may_shine_later = compiled.is_stepped();
    let frames = plan.frames();
    let shutters = [frames.start, (frames.start + frames.end) / 2, frames.end - 1].map(|number| plan.shutter(number));
    let exposures = shutters.map(|shutter| ExposedScene::new(&context, &runs, shutter));
    let remark = |index: usize| {
        let [first, middle, last] = exposures.each_ref().map(|exposure| exposure.remark(index));
        let always = first.filter(|remark| Some(remark) == middle.as_ref() && middle == last)?;
        let holds = !(may_shine_later && always.unless_lit_later);
        holds.then(|| (runs[index].info().name.to_owned(), always))
    };
    let plate = assumed_of_plate(compiled, plan).map(|ev100| {
        let message = format!(
            "with which exposure it was taken is not known; EV {ev100:.1} (at ISO 100) is assumed, so that its white is {:.0} cd/m^2; \
             `exposure_ev100` in [plate] states it",
            color::white_luminance(ev100)
        );
        (PLATE_LAYER.to_owned(), Remark::new(message))
    });
    let of_phenomena = (0..runs.len()).filter_map(remark);
    plate
        .into_iter()
        .chain(of_plate_files(compiled))
        .chain(of_drawings(compiled))
        .chain(of_phenomena)
        .chain(faint_phenomenon_remarks(compiled, plan))
        .collect()
}
