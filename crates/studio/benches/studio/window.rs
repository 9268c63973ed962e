//! The benchmarks with the window: frames that it shows while a scene plays, and the latency from an edit to the painted window, by the
//! renderer of this machine.

use std::{
    sync::mpsc,
    time::{Duration, Instant},
};

use bansho_egui_software::App;
use bansho_studio::{
    app::{Session, Studio},
    document::{Document, Revision},
};
use eframe::egui;

use crate::{
    Error,
    scenes::{BenchScene, EDITS, percentile_95},
};

/// Time for which a scene plays before it is measured, while the preview size adapts.
const WARM_UP: Duration = Duration::from_secs(2);
/// Time for which playing is measured.
const PLAYED: Duration = Duration::from_secs(6);

/// The result of one scene.
#[derive(Clone)]
pub(crate) struct WindowSpeed {
    /// The phenomenon.
    pub(crate) name: &'static str,
    /// Pictures per second that the window showed; the scene has 30.
    pub(crate) pictures_per_s: f64,
    /// The size of the last one, pixels.
    pub(crate) played_size: [usize; 2],
    /// Time from an edit to the painted window with the picture at full size, 95th percentile, s.
    pub(crate) latency_s: f64,
    /// The size of that picture, pixels.
    pub(crate) size: [usize; 2],
}

/// A studio that plays and edits the benchmark scenes, sends the results, and closes.
pub(crate) struct WindowBench {
    studio: Studio,
    bench_scenes: std::vec::IntoIter<&'static BenchScene>,
    bench_scene: Option<&'static BenchScene>,
    step: Step,
    speed: WindowSpeed,
    results: mpsc::Sender<Result<WindowSpeed, Error>>,
}

/// The current step of the measurement.
enum Step {
    /// Waits for the size of the window and for the first picture.
    Open,
    /// Counts the pictures that were shown since a time; `last` is the last one.
    Play { since: Instant, pictures: usize, last: Option<(Revision, i64)> },
    /// Edits the scene: the latencies so far, s, the time of the last edit, and whether its picture is being painted.
    Edit { latencies: Vec<f64>, edited: Option<Instant>, painting: bool },
}

impl WindowBench {
    /// Measures `bench_scenes` in a window that shows `session`, and sends the results to `results`.
    pub(crate) fn new(
        session: Session,
        bench_scenes: Vec<&'static BenchScene>,
        results: mpsc::Sender<Result<WindowSpeed, Error>>,
    ) -> Self {
        let speed = WindowSpeed { name: "", pictures_per_s: 0.0, played_size: [0; 2], latency_s: 0.0, size: [0; 2] };
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
            session.open(Document::new(bench_scene.name, bench_scene.text()), None);
            // Drafts would have fewer particles than the name of the scene says.
            session.draft = false;
            self.speed.name = bench_scene.name;
        }
    }

    /// One frame of the window.
    fn frame(&mut self, ui: &mut egui::Ui) -> Result<(), Error> {
        let Some(bench_scene) = self.bench_scene else {
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::Close);
            return Ok(());
        };
        self.before_frame(bench_scene)?;
        self.studio.ui(ui);
        self.after_frame();
        bench_scene.check(self.studio.session())
    }

    /// Before a frame: records the latency of the edit that the last frame painted, and makes the next edit.
    fn before_frame(&mut self, bench_scene: &'static BenchScene) -> Result<(), Error> {
        let Step::Edit { latencies, edited, painting } = &mut self.step else { return Ok(()) };
        if std::mem::take(painting) {
            latencies.extend(edited.map(|edited| edited.elapsed().as_secs_f64()));
            if latencies.len() == EDITS {
                self.speed.latency_s = percentile_95(std::mem::take(latencies));
                // The receiver is dropped when the window was closed.
                let _ = self.results.send(Ok(self.speed.clone()));
                self.open_next();
                return Ok(());
            }
            *edited = Some(Instant::now());
            bench_scene.edit(self.studio.session(), latencies.len())?;
        }
        Ok(())
    }

    /// After a frame: evaluates the picture that it showed.
    fn after_frame(&mut self) {
        let session = self.studio.session();
        let current = session.document.revision();
        let shown = session.picture().map(|(picture, _)| (picture.revision, picture.number, picture.size));
        let Some((revision, number, size)) = shown.filter(|(revision, ..)| *revision == current) else { return };
        match &mut self.step {
            Step::Open => {
                session.transport.set_playing(true);
                self.step = Step::Play { since: Instant::now() + WARM_UP, pictures: 0, last: None };
            }
            Step::Play { since, pictures, last } => {
                let played = Instant::now().saturating_duration_since(*since);
                *pictures += usize::from(played > Duration::ZERO && last.replace((revision, number)) != *last);
                if played >= PLAYED {
                    self.speed.pictures_per_s = *pictures as f64 / played.as_secs_f64();
                    self.speed.played_size = size;
                    session.transport.step(0);
                    // Wait for the picture at full size first.
                    self.step = Step::Edit { latencies: Vec::new(), edited: None, painting: false };
                }
            }
            Step::Edit { painting, edited, .. } => {
                self.speed.size = size;
                *painting = number == session.transport.number() && (edited.is_some() || !session.is_busy());
            }
        }
    }
}

/// The size of a window that shows the picture of `bench_scene` at full size beside all panels, points.
fn window_size(bench_scene: &BenchScene) -> egui::Vec2 {
    let editor = if bench_scene.has_editor() { 420.0 } else { 0.0 };
    egui::vec2(1560.0, 780.0 + editor)
}

fn frame_size(ctx: &egui::Context) -> egui::Vec2 {
    ctx.input(|input| input.content_rect().size())
}

impl App for WindowBench {
    fn ui(&mut self, ui: &mut egui::Ui, wait_until_presented: &mut dyn FnMut()) {
        if let (Step::Open, Some(bench_scene)) = (&self.step, self.bench_scene)
            && frame_size(ui.ctx()) != window_size(bench_scene)
        {
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::InnerSize(window_size(bench_scene)));
        }
        if let Step::Edit { painting: true, .. } = self.step {
            // The latency includes the presentation of the last frame.
            wait_until_presented();
        }
        if let Err(error) = self.frame(ui) {
            let _ = self.results.send(Err(error));
            (self.bench_scene, self.step) = (None, Step::Open);
        }
        // While waiting for a picture, the player requests the repaint.
        if self.bench_scene.is_none()
            || matches!(self.step, Step::Open | Step::Edit { painting: true, .. } | Step::Edit { edited: None, .. })
        {
            ui.ctx().request_repaint();
        }
    }

    fn on_exit(&mut self) {}
}
