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
    editors::aurora::document::ShapeEditError,
    player::{StartError, ThreadPlayer},
    scenes::examples::Bundle,
};
use web_time::Instant;

pub use window::{WindowBench, WindowSpeed};

/// Size of the preview, pixels.
const PICTURE: [usize; 2] = [960, 540];

/// Number of frames played.
const PLAYED: i64 = 60;

/// Number of edits; the second slowest latency is the 95th percentile.
const CHANGES: usize = 20;

/// A benchmark scene, and the parameter that is edited.
struct BenchScene {
    name: &'static str,
    text: &'static str,
    /// The place of a number, which is moved from its first value to its second; without one a stroke is.
    number: Option<(&'static [&'static str], [f64; 2])>,
}

const BENCH_SCENES: [BenchScene; 4] = [
    BenchScene {
        name: "flame sheet",
        text: "[[flame_sheet]]\n",
        number: Some((&["flame_sheet", "height"], [0.8, 1.0])),
    },
    BenchScene {
        name: "particle flame of 3,000",
        text: "[[flame_particles]]\nparticles = 3000\n",
        number: Some((&["flame_particles", "forces", "buoyancy"], [1.0, 1.4])),
    },
    BenchScene {
        name: "rain at 20 mm/h",
        text: "[sky]\nkind = \"overcast\"\n[[rain]]\nrate_mm_per_h = 20.0\n",
        number: Some((&["rain", "rate_mm_per_h"], [20.0, 24.0])),
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
    /// Pictures a second while it plays.
    pub frames_per_s: f64,
    /// What of each the simulation takes, s.
    pub advance_s: f64,
    /// What of each drawing takes, s. The rest is the studio's own.
    pub draw_s: f64,
    /// From a change to its picture at full size, s: 19 of 20 come sooner.
    pub answer_s: f64,
}

/// Measures those whose name contains `wanted`, each when it is asked for.
///
/// # Errors
/// The system gives no threads, or a scene cannot be drawn.
pub fn measure(wanted: &str) -> impl Iterator<Item = Result<Speed, BenchError>> {
    BENCH_SCENES.iter().filter(move |bench_scene| bench_scene.name.contains(wanted)).map(speed)
}

/// Why nothing can be measured.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// No player.
    #[error(transparent)]
    Start(#[from] StartError),
    /// A stroke that cannot be drawn.
    #[error(transparent)]
    Stroke(#[from] ShapeEditError),
    /// A picture that did not come.
    #[error("{scene}: {reason}")]
    Picture {
        /// Which scene.
        scene: &'static str,
        /// What the studio said.
        reason: String,
    },
}

fn nothing(_: &Path) -> Arc<dyn Assets> {
    Arc::new(Bundle::default())
}

fn speed(bench_scene: &BenchScene) -> Result<Speed, BenchError> {
    let player = ThreadPlayer::start(|| {})?;
    let mut session =
        Session::new(Document::new(bench_scene.name, bench_scene.scene()), None, Box::new(player), nothing);
    // Drafts would have fewer particles than is promised.
    session.draft = false;
    // The first picture makes what is made once.
    shown(&mut session, bench_scene.name)?;
    let began = Instant::now();
    let (mut advance_s, mut draw_s) = (0.0, 0.0);
    for _ in 1..=PLAYED {
        session.transport.step(1);
        let took = shown(&mut session, bench_scene.name)?;
        advance_s += took[0] / PLAYED as f64;
        draw_s += took[1] / PLAYED as f64;
    }
    let frames_per_s = PLAYED as f64 / began.elapsed().as_secs_f64();
    let mut answers = Vec::with_capacity(CHANGES);
    for step in 0..CHANGES {
        let began = Instant::now();
        change(&mut session, bench_scene, step as f64 / CHANGES as f64)?;
        shown(&mut session, bench_scene.name)?;
        answers.push(began.elapsed().as_secs_f64());
    }
    Ok(Speed { name: bench_scene.name, frames_per_s, advance_s, draw_s, answer_s: percentile_95(answers) })
}

/// The second largest latency.
fn percentile_95(mut answers: Vec<f64>) -> f64 {
    answers.sort_by(f64::total_cmp);
    answers.into_iter().rev().nth(1).unwrap_or_default()
}

/// What a hand does that has come so far on its way.
fn change(session: &mut Session, bench_scene: &BenchScene, way: f64) -> Result<(), BenchError> {
    let Some((keys, [from, to])) = bench_scene.number else {
        let points =
            [[-240.0, -180.0], [0.0, -150.0 - 60.0 * way], [240.0, -180.0]].map(|point| Value::numbers(point).into());
        let sheets = ValuePath::root().key("aurora").index(0).key("shapes").index(0).key("sheets");
        let place = sheets.index(0).key("points");
        session.edit_shapes("move point", &[Operation::Set { path: place, value: Value::List(points.into()) }], 0)?;
        return Ok(());
    };
    let (kind, keys) = keys.split_first().unwrap_or((&"", &[]));
    let place = keys.iter().fold(ValuePath::root().key(kind).index(0), |place, key| place.key(key));
    session.set("slider", &place, Value::Number(from + (to - from) * way));
    Ok(())
}

/// Works as the window does until the present frame of the present state is there at full size; how long simulating and drawing
/// took, s.
fn shown(session: &mut Session, scene: &'static str) -> Result<[f64; 2], BenchError> {
    loop {
        session.update(0.0, PICTURE, false);
        let (revision, number) = (session.document.revision(), session.transport.number());
        if let Some((picture, _)) = session.picture()
            && (picture.revision, picture.number, picture.size) == (revision, number, PICTURE)
        {
            let took = [picture.advance_s, picture.draw_s];
            std::hint::black_box(color_image(picture));
            return Ok(took);
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
    fn every_change_of_the_bench_is_one_of_a_good_scene() {
        for bench_scene in &BENCH_SCENES {
            let text = format!("bansho = 2\n{}", bench_scene.text.replace("30000", "300").replace("3000", "50"));
            let player = Box::<crate::player::PolledPlayer>::default();
            let mut session = Session::new(Document::new(bench_scene.name, text), None, player, nothing);
            let before = session.document.text().clone();
            change(&mut session, bench_scene, 0.5).unwrap();
            let assets = session.assets().clone();
            session.document.check_now(&assets);
            assert!(session.document.error().is_none() && session.notice().is_none(), "{}", bench_scene.name);
            assert_ne!(*session.document.text(), before);
        }
    }
}
