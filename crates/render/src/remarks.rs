//! Remarks: what users should know about how a scene will look, and that is no error.

use std::sync::{Arc, OnceLock};

use bansho_base::{
    camera::turns::{SuddenTurn, sudden_turns},
    color,
    host::{once::get_or_compute, parallel::prelude::*},
    phenomenon::{
        Remark,
        strip::{Shutter, View},
        surroundings::{OtherPhenomena, Publication, PublishedByAll},
    },
    world::sky::Sky,
};

use crate::{
    compiled::{ActiveRun, CompiledScene},
    composite::plate_light_remark,
    context::ShotContext,
    faint::faint_phenomenon_remarks,
    plan::Plan,
    planning::exposure::assumed_of_plate,
    shot::stepping::scene_publication,
};
use bansho_scene::PLATE_LAYER;

/// A scene during one exposure.
struct ExposedScene<'a> {
    shutter: Shutter,
    runs: &'a [ActiveRun],
    scene: Publication,
    /// What all phenomena publish, computed on first use.
    published: OnceLock<PublishedByAll>,
    sky: Sky,
}

impl<'a> ExposedScene<'a> {
    fn new(context: &ShotContext, runs: &'a [ActiveRun], shutter: Shutter) -> Self {
        Self {
            shutter,
            runs,
            scene: scene_publication(context, shutter),
            published: OnceLock::new(),
            sky: context.sky(shutter.middle()),
        }
    }

    fn published(&self) -> &PublishedByAll {
        get_or_compute(&self.published, || {
            PublishedByAll::new(self.runs.par_iter().map(|run| run.run.publish(self.shutter)).collect())
        })
    }

    fn remark(&self, index: usize) -> Option<Remark> {
        self.runs[index].built.phenomenon.remark(&OtherPhenomena {
            scene: &self.scene,
            published: &|| self.published(),
            own_index: index,
            sky: &self.sky,
        })
    }
}

/// What users should know about how the files of the plate were read, in the first frame.
fn of_plate_files(compiled: &CompiledScene) -> Vec<(String, Remark)> {
    let scene = compiled.scene();
    let frame = scene.picture.first_frame;
    let read = scene.plate.read_frame(compiled.assets().as_ref(), frame, &scene.plate_view(frame));
    let Ok(Some(pictures)) = read else { return Vec::new() };
    pictures.remarks().iter().map(|remark| (PLATE_LAYER.to_owned(), Remark::new(remark.to_string()))).collect()
}

/// Extensions of drawings.
const DRAWINGS: [&str; 2] = [".svg", ".svgz"];

/// What users should know about how the drawings of phenomena were read.
fn of_drawings(compiled: &CompiledScene) -> Vec<(String, Remark)> {
    let mut remarks = Vec::new();
    for instance in compiled.scene().instances.iter().filter(|instance| instance.enabled) {
        let mut paths = instance.parameters.asset_paths();
        paths.sort();
        paths.dedup();
        for path in paths.iter().filter(|path| DRAWINGS.iter().any(|drawing| path.ends_with(drawing))) {
            let Ok(drawing) = compiled.assets().drawing(path) else { continue };
            for remark in &drawing.remarks {
                remarks.push((instance.name.clone(), Remark::new(format!("{path}: {remark}"))));
            }
        }
    }
    remarks
}

/// A remark on the times at which the camera looks along its `up`, so that the picture turns suddenly.
fn turns_of_picture(plan: &Plan) -> Option<Remark> {
    let frames = plan.frames();
    let frame_s = plan.fps().frame_s();
    let count = (frames.end - frames.start) as usize;
    // From where the first shutter opens: a dome often begins at the zenith.
    let first = plan.shutter_at(0.0).open;
    let turns = sudden_turns(&plan.camera, first, frame_s, count);
    let SuddenTurn { time, after_frame, degrees, better_up } = *turns.first()?;
    let number = plan.number_at(after_frame as f64 * frame_s);
    let others = match turns.len() {
        1 => String::new(),
        count => format!(", and {} more times until {:.3} s", count - 1, turns[count - 1].time),
    };
    let remedy = match better_up {
        Some([x, y, z]) => format!("with `up = [{x}, {y}, {z}]` it does not turn"),
        None => "animate `up` with directions that the line of sight never meets".to_owned(),
    };
    let message = format!(
        "the picture turns by {degrees:.0} degrees at {time:.3} s, between frames {number} and {}{others}, because the camera then looks along `up`; \
         {remedy}",
        number + 1
    );
    Some(Remark::at("up", message))
}

/// Number of frames of a shot in which the view of each phenomenon is examined.
const VIEWED_FRAMES: i64 = 9;

/// What users should know about how the camera sees each phenomenon: in the first frame for which there is a remark, of some that are evenly distributed.
fn of_views(compiled: &CompiledScene, plan: &Plan) -> Vec<(String, Remark)> {
    let frames = plan.frames();
    let last = frames.end - frames.start - 1;
    let mut numbers: Vec<i64> =
        (0..VIEWED_FRAMES).map(|index| frames.start + last * index / (VIEWED_FRAMES - 1)).collect();
    numbers.dedup();
    let views: Vec<View> = numbers.iter().map(|number| plan.view(*number)).collect();
    let mut remarks = Vec::new();
    for phenomenon in compiled.phenomena() {
        for (number, view) in numbers.iter().zip(&views) {
            let Some(remark) = phenomenon.view_remark(view) else { continue };
            let message = format!("in frame {number} {}", remark.message);
            remarks.push((phenomenon.info().name.to_owned(), Remark { message, ..remark }));
            break;
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
    let mut of_phenomena = Vec::new();
    for (index, run) in runs.iter().enumerate() {
        let [first, middle, last] = exposures.each_ref().map(|exposure| exposure.remark(index));
        let Some(remark) = first.filter(|first| Some(first) == middle.as_ref() && middle == last) else { continue };
        if !(may_shine_later && remark.unless_lit_later) {
            of_phenomena.push((run.info().name.to_owned(), remark));
        }
    }
    let plate = assumed_of_plate(compiled, plan).map(|ev100| {
        let message = format!(
            "with which exposure it was taken is not known; EV {ev100:.1} (at ISO 100) is assumed, so that its white is {:.0} cd/m^2; \
             `exposure_ev100` in [plate] states it",
            color::white_luminance(ev100)
        );
        (PLATE_LAYER.to_owned(), Remark::new(message))
    });
    let of_camera = turns_of_picture(plan).map(|remark| ("camera".to_owned(), remark));
    plate
        .into_iter()
        .chain(of_plate_files(compiled))
        .chain(plate_light_remark(compiled, plan).map(|message| (PLATE_LAYER.to_owned(), Remark::new(message))))
        .chain(of_drawings(compiled))
        .chain(of_camera)
        .chain(of_phenomena)
        .chain(of_views(compiled, plan))
        .chain(faint_phenomenon_remarks(compiled, plan))
        .collect()
}
