//! The benchmarks with the window: frames that it shows while a scene plays, and the latency from an edit to the painted window, by the
//! renderer of this machine.

use std::{sync::mpsc, time::Duration};

use eframe::egui;
use web_time::Instant;

use super::{BENCH_SCENES, BenchError, BenchScene, CHANGES, change, percentile_95};
use crate::{
    app::{Session, Studio},
    document::{Document, Revision},
};
use bansho_egui_software::App;

/// How long a scene plays before it counts, while previews find their size, and how long it counts.
const WARM_UP: Duration = Duration::from_secs(2);
const PLAYED: Duration = Duration::from_secs(6);

/// How fast the window follows one scene.
#[derive(Clone, Debug, PartialEq)]
pub struct WindowSpeed {
    /// The phenomenon.
    pub name: &'static str,
    /// Pictures that the window showed a second, of the 30 that the scene has.
    pub frames_per_s: f64,
    /// The size of the last one, pixels.
    pub played_size: [usize; 2],
    /// From a change to the painted window with its whole picture, s: 19 of 20 come sooner.
    pub answer_s: f64,
    /// The size of that picture, pixels.
    pub size: [usize; 2],
}

/// A studio that plays and changes scenes by itself, tells how that went, and closes.
pub struct WindowBench {
    studio: Studio,
    bench_scenes: std::vec::IntoIter<&'static BenchScene>,
    bench_scene: Option<&'static BenchScene>,
    step: Step,
    speed: WindowSpeed,
    results: mpsc::Sender<Result<WindowSpeed, BenchError>>,
}

/// What is measured now.
enum Step {
    /// Nothing until the window has its size and the first picture is there.
    Open,
    /// Pictures, since then; the last one that was seen.
    Play { since: Instant, pictures: usize, last: Option<(Revision, i64)> },
    /// What the changes took so far, s; when the one was made that is waited for, if any was, and whether its picture is being painted.
    Change { answers: Vec<f64>, made: Option<Instant>, painting: bool },
}

impl WindowBench {
    /// Measures those whose name contains `wanted` in a window on `session`; results go to `results`.
    pub fn new(session: Session, wanted: &str, results: mpsc::Sender<Result<WindowSpeed, BenchError>>) -> Self {
        let bench_scenes: Vec<&BenchScene> =
            BENCH_SCENES.iter().filter(|bench_scene| bench_scene.name.contains(wanted)).collect();
        let speed = WindowSpeed { name: "", frames_per_s: 0.0, played_size: [0; 2], answer_s: 0.0, size: [0; 2] };
        let studio = Studio::new(session, None);
        let mut bench = Self {
            studio,
            bench_scenes: bench_scenes.into_iter(),
            bench_scene: None,
            step: Step::Open,
            speed,
            results,
        };
        bench.open_next();
        bench
    }

    /// Opens the next scene, if there is one.
    fn open_next(&mut self) {
        self.bench_scene = self.bench_scenes.next();
        self.step = Step::Open;
        if let Some(bench_scene) = self.bench_scene {
            let session = self.studio.session();
            session.open(Document::new(bench_scene.name, bench_scene.scene()), None);
            // Drafts would have fewer particles than is promised.
            session.draft = false;
            self.speed.name = bench_scene.name;
        }
    }

    /// One frame of the window.
    fn frame(&mut self, ui: &mut egui::Ui) -> Result<(), BenchError> {
        let Some(bench_scene) = self.bench_scene else {
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::Close);
            return Ok(());
        };
        self.before(bench_scene)?;
        self.studio.ui(ui);
        self.after();
        let session = self.studio.session();
        let faults = session.document.error().map(ToString::to_string);
        match faults.or_else(|| session.notice().map(str::to_owned)) {
            Some(reason) => Err(BenchError::Picture { scene: bench_scene.name, reason }),
            None => Ok(()),
        }
    }

    /// What hands do before a frame, and what was painted by the last one.
    fn before(&mut self, bench_scene: &'static BenchScene) -> Result<(), BenchError> {
        let Step::Change { answers, made, painting } = &mut self.step else { return Ok(()) };
        if std::mem::take(painting) {
            answers.extend(made.map(|made| made.elapsed().as_secs_f64()));
            if answers.len() == CHANGES {
                self.speed.answer_s = percentile_95(std::mem::take(answers));
                // Nobody listens any more where the window was closed.
                let _ = self.results.send(Ok(self.speed.clone()));
                self.open_next();
                return Ok(());
            }
            *made = Some(Instant::now());
            change(self.studio.session(), bench_scene, answers.len() as f64 / CHANGES as f64)?;
        }
        Ok(())
    }

    /// What a frame showed.
    fn after(&mut self) {
        let session = self.studio.session();
        let present = session.document.revision();
        let shown = session.picture().map(|(picture, _)| (picture.revision, picture.number, picture.size));
        let Some((revision, number, size)) = shown.filter(|(revision, ..)| *revision == present) else { return };
        match &mut self.step {
            Step::Open => {
                session.transport.set_playing(true);
                self.step = Step::Play { since: Instant::now() + WARM_UP, pictures: 0, last: None };
            }
            Step::Play { since, pictures, last } => {
                let played = Instant::now().saturating_duration_since(*since);
                *pictures += usize::from(played > Duration::ZERO && last.replace((revision, number)) != *last);
                if played >= PLAYED {
                    self.speed.frames_per_s = *pictures as f64 / played.as_secs_f64();
                    self.speed.played_size = size;
                    session.transport.step(0);
                    // First the whole picture.
                    self.step = Step::Change { answers: Vec::new(), made: None, painting: false };
                }
            }
            Step::Change { painting, made, .. } => {
                self.speed.size = size;
                *painting = number == session.transport.number() && (made.is_some() || !session.is_busy());
            }
        }
    }
}

/// How large the window is that shows a whole picture of `bench_scene` beside all panels, points of the screen.
fn window_of(bench_scene: &BenchScene) -> egui::Vec2 {
    let editor = if bench_scene.number.is_none() { 420.0 } else { 0.0 };
    egui::vec2(1560.0, 780.0 + editor)
}

fn frame_size(ctx: &egui::Context) -> egui::Vec2 {
    ctx.input(|input| input.content_rect().size())
}

impl App for WindowBench {
    fn ui(&mut self, ui: &mut egui::Ui, wait_until_presented: &mut dyn FnMut()) {
        if let (Step::Open, Some(bench_scene)) = (&self.step, self.bench_scene)
            && frame_size(ui.ctx()) != window_of(bench_scene)
        {
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::InnerSize(window_of(bench_scene)));
        }
        if let Step::Change { painting: true, .. } = self.step {
            // The last frame is on its way to the screen; until it is there nobody has seen the picture.
            wait_until_presented();
        }
        if let Err(error) = self.frame(ui) {
            let _ = self.results.send(Err(error));
            (self.bench_scene, self.step) = (None, Step::Open);
        }
        // A window that waits for its picture is painted when that comes.
        if self.bench_scene.is_none()
            || matches!(self.step, Step::Open | Step::Change { painting: true, .. } | Step::Change { made: None, .. })
        {
            ui.ctx().request_repaint();
        }
    }

    fn on_exit(&mut self) {}
}
