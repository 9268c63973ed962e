//! Benchmarks of the studio: the frame rate of each phenomenon while playing, and the latency from an edit to its picture. They
//! include document, checks, player and the conversion to an egui image; [`WindowBench`] includes the window too.

mod window;

use std::{path::Path, sync::Arc, thread, time::Duration};

use bansho::{
    Assets,
    base::parameters::Value,
    scene::{ValuePath, operation::Operation},
};

use crate::{
    app::{Session, color_image},
    document::Document,
    editors::aurora::{self, document::ShapeEditError},
    player::{FrameTiming, StartError, ThreadPlayer},
    scenes::examples::BundledAssets,
};
use web_time::Instant;

pub use window::{WindowBench, WindowSpeed};

/// Size of the preview, pixels.
const PICTURE: [usize; 2] = [960, 540];

/// Number of frames played.
const PLAYED: i64 = 60;

/// Number of edits; the second slowest latency is the 95th percentile.
const EDITS: usize = 20;

/// A benchmark scene, and the parameter that is edited.
struct BenchScene {
    name: &'static str,
    text: &'static str,
    /// The number that is edited; without one, a stroke of an aurora is edited.
    number: Option<EditedNumber>,
}

/// A parameter of the first phenomenon of a kind, edited in steps.
struct EditedNumber {
    kind: &'static str,
    keys: &'static [&'static str],
    /// The value at the first step, and that after the last.
    range: [f64; 2],
}

const BENCH_SCENES: [BenchScene; 4] = [
    BenchScene {
        name: "flame sheet",
        text: "[[flame_sheet]]\n",
        number: Some(EditedNumber { kind: "flame_sheet", keys: &["height"], range: [0.8, 1.0] }),
    },
    BenchScene {
        name: "particle flame of 3,000",
        text: "[[flame_particles]]\nparticles = 3000\n",
        number: Some(EditedNumber { kind: "flame_particles", keys: &["forces", "buoyancy"], range: [1.0, 1.4] }),
    },
    BenchScene {
        name: "rain at 20 mm/h",
        text: "[sky]\nkind = \"overcast\"\n[[rain]]\nrate_mm_per_h = 20.0\n",
        number: Some(EditedNumber { kind: "rain", keys: &["rate_mm_per_h"], range: [20.0, 24.0] }),
    },
    BenchScene {
        name: "aurora of 30,000",
        text: "[camera]\nposition = [0.0, 1.7, 0.0]\ntarget = [0.0, 30.0, -60.0]\nvertical_fov_deg = 62.0\n\
               [[aurora]]\nparticles = { count = 30000 }\n\
               [[aurora.shapes]]\nsheets = [{ points = [[-240.0, -180.0], [0.0, -150.0], [240.0, -180.0]] }]\n",
        number: None,
    },
];

impl BenchScene {
    fn scene(&self) -> String {
        let [width, height] = PICTURE;
        format!("bansho = 2\n[picture]\nsize = [{width}, {height}]\nframes = 240\n{}", self.text)
    }
}

/// The result of one scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Speed {
    /// The phenomenon.
    pub name: &'static str,
    /// Pictures per second while it plays.
    pub frames_per_s: f64,
    /// Time to simulate a frame, s.
    pub advance_s: f64,
    /// Time to draw a frame, s. The rest is that of the studio itself.
    pub draw_s: f64,
    /// Time from an edit to its picture at full size, 95th percentile, s.
    pub latency_s: f64,
}

/// Measures the scenes whose name contains `wanted`, lazily.
///
/// # Errors
/// The system cannot start threads, or a scene cannot be drawn.
pub fn measure(wanted: &str) -> impl Iterator<Item = Result<Speed, BenchError>> {
    BENCH_SCENES.iter().filter(move |bench_scene| bench_scene.name.contains(wanted)).map(speed)
}

/// Why a scene cannot be measured.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// The player cannot start.
    #[error(transparent)]
    Start(#[from] StartError),
    /// A stroke cannot be edited.
    #[error(transparent)]
    Stroke(#[from] ShapeEditError),
    /// A picture was not drawn.
    #[error("{scene}: {reason}")]
    Picture {
        /// The name of the scene.
        scene: &'static str,
        /// The message in the studio.
        reason: String,
    },
}

fn bundled_assets(_: &Path) -> Arc<dyn Assets> {
    Arc::new(BundledAssets::default())
}

fn speed(bench_scene: &BenchScene) -> Result<Speed, BenchError> {
    let player = ThreadPlayer::start(|| {})?;
    let mut session =
        Session::new(Document::new(bench_scene.name, bench_scene.scene()), None, Box::new(player), bundled_assets);
    // Drafts would have fewer particles than the name of the scene says.
    session.draft = false;
    // The first picture includes one-time work.
    wait_for_picture(&mut session, bench_scene.name)?;
    let began = Instant::now();
    let (mut advance_s, mut draw_s) = (0.0, 0.0);
    for _ in 1..=PLAYED {
        session.transport.step(1);
        let timing = wait_for_picture(&mut session, bench_scene.name)?;
        advance_s += timing.advance_s / PLAYED as f64;
        draw_s += timing.draw_s / PLAYED as f64;
    }
    let frames_per_s = PLAYED as f64 / began.elapsed().as_secs_f64();
    let mut latencies = Vec::with_capacity(EDITS);
    for step in 0..EDITS {
        let began = Instant::now();
        apply_edit(&mut session, bench_scene, step as f64 / EDITS as f64)?;
        wait_for_picture(&mut session, bench_scene.name)?;
        latencies.push(began.elapsed().as_secs_f64());
    }
    Ok(Speed { name: bench_scene.name, frames_per_s, advance_s, draw_s, latency_s: percentile_95(latencies) })
}

/// The second largest latency.
fn percentile_95(mut latencies: Vec<f64>) -> f64 {
    latencies.sort_by(f64::total_cmp);
    latencies.into_iter().rev().nth(1).unwrap_or_default()
}

/// Edits the scene as a drag does that has reached the fraction `progress`.
fn apply_edit(session: &mut Session, bench_scene: &BenchScene, progress: f64) -> Result<(), BenchError> {
    let Some(EditedNumber { kind, keys, range: [from, to] }) = bench_scene.number else {
        let points = [[-240.0, -180.0], [0.0, -150.0 - 60.0 * progress], [240.0, -180.0]]
            .map(|point| Value::numbers(point).into());
        let sheets = ValuePath::root().key("aurora").index(0).key("shapes").index(0).key("sheets");
        let path = sheets.index(0).key("points");
        let stroke = Operation::Set { path, value: Value::List(points.into()) };
        aurora::edit_shapes(session, "move point", &[stroke], 0)?;
        return Ok(());
    };
    let path = keys.iter().fold(ValuePath::root().key(kind).index(0), |path, key| path.key(key));
    session.set("slider", &path, Value::Number(from + (to - from) * progress));
    Ok(())
}

/// Updates the session, as the window does, until the current frame of the current revision is drawn at full size.
fn wait_for_picture(session: &mut Session, scene: &'static str) -> Result<FrameTiming, BenchError> {
    loop {
        session.update(0.0, PICTURE, false);
        let (revision, number) = (session.document.revision(), session.transport.number());
        if let Some((picture, _)) = session.picture()
            && (picture.revision, picture.number, picture.size) == (revision, number, PICTURE)
        {
            let pixels = PICTURE[0] * PICTURE[1];
            let timing = FrameTiming { pixels, draw_s: picture.draw_s, advance_s: picture.advance_s };
            std::hint::black_box(color_image(picture));
            return Ok(timing);
        }
        let faults = session.document.error().map(ToString::to_string);
        if let Some(reason) = faults.or_else(|| session.notice().map(str::to_owned)) {
            return Err(BenchError::Picture { scene, reason });
        }
        thread::sleep(Duration::from_micros(200));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_edit_of_the_bench_is_valid() {
        for bench_scene in &BENCH_SCENES {
            let text = format!("bansho = 2\n{}", bench_scene.text.replace("30000", "300").replace("3000", "50"));
            let player = Box::<crate::player::PolledPlayer>::default();
            let mut session = Session::new(Document::new(bench_scene.name, text), None, player, bundled_assets);
            let before = session.document.text().clone();
            apply_edit(&mut session, bench_scene, 0.5).unwrap();
            let assets = session.assets().clone();
            session.document.check_now(&assets);
            assert!(session.document.error().is_none() && session.notice().is_none(), "{}", bench_scene.name);
            assert_ne!(*session.document.text(), before);
        }
    }
}
