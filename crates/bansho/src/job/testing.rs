//! A shot whose state and pictures are known, for tests of what drives it.

use std::sync::{
    Arc, Mutex,
    atomic::{AtomicBool, AtomicUsize, Ordering},
};

use bansho_base::{
    frame::Frame,
    host::{
        assets::MemoryAssets,
        observer::{Observer, Stage, check},
    },
    image::{Image, Rect},
    phenomenon::SnapshotError,
};
use bansho_media::files::provenance;
use bansho_render::{CompiledScene, Plan, PlanOptions, RenderError};

use super::{
    error::JobError,
    observer::{JobObserver, Note},
};
use crate::job::render::draw_frames::{FrameSink, FrameSource};

/// A plan of a picture of one pixel with nothing in it.
pub(crate) fn plan() -> Arc<Plan> {
    let assets = Arc::new(MemoryAssets::default());
    let text = "bansho = 2\n[picture]\nsize = [1, 1]\nfps = 10\nfirst_frame = -4\n";
    let scene = crate::parse_scene("test", text).unwrap_or_else(|error| panic!("{error}"));
    let compiled = Arc::new(CompiledScene::build(Arc::new(scene), assets, None).unwrap());
    Arc::new(Plan::new(&compiled, &PlanOptions::default()).unwrap())
}

/// Takes a step for each frame, and counts them all.
pub(crate) struct Counter {
    pub(crate) steps: Arc<AtomicUsize>,
}

/// State: the frame that was stepped to.
pub(crate) struct CounterShot {
    plan: Arc<Plan>,
    steps: Arc<AtomicUsize>,
    pub(crate) number: i64,
    drawn: bool,
}

impl Counter {
    pub(crate) fn shot(&self) -> CounterShot {
        let plan = plan();
        CounterShot { number: plan.frames().start - 1, plan, steps: self.steps.clone(), drawn: false }
    }
}

impl FrameSource for CounterShot {
    fn advance(&mut self, number: i64, observer: &dyn Observer) -> Result<(), RenderError> {
        check(observer)?;
        if number < self.number {
            self.number = self.plan.frames().start - 1;
        }
        self.steps.fetch_add((number - self.number) as usize, Ordering::Relaxed);
        self.number = number;
        Ok(())
    }

    fn draw(&mut self, observer: &dyn Observer) -> Result<(), RenderError> {
        check(observer)?;
        self.drawn = true;
        Ok(())
    }

    fn read(&mut self) -> Option<Frame> {
        std::mem::take(&mut self.drawn).then(|| blank(&self.plan, self.number))
    }

    fn recycle(&mut self, _spent: Frame) {}

    fn snapshot(&self) -> Vec<u8> {
        state(self.number)
    }

    fn restore(&mut self, snapshot: &[u8]) -> Result<(), RenderError> {
        let bytes = snapshot.strip_prefix(&provenance::SNAPSHOT_MAGIC).and_then(|state| state.try_into().ok());
        let bytes = bytes.ok_or(SnapshotError::Damaged)?;
        self.number = i64::from_le_bytes(bytes);
        Ok(())
    }
}

/// The snapshot at a frame.
pub(crate) fn state(number: i64) -> Vec<u8> {
    [provenance::SNAPSHOT_MAGIC, number.to_le_bytes()].concat()
}

/// A frame of one pixel.
pub(crate) fn frame(number: i64) -> Frame {
    blank(&plan(), number)
}

pub(crate) fn blank(plan: &Plan, number: i64) -> Frame {
    let beauty = Image::filled(1, 1, [number as f32; 4]);
    let header = plan.header(number, [7; 32]);
    let content = Rect::from_size(1, 1);
    Frame { header, beauty, depth: None, channels: Vec::new(), opaque: false, figures: Vec::new(), content }
}

/// Remembers what it is told, and stops the work when asked to.
#[derive(Default)]
pub(crate) struct Witness {
    pub(crate) notes: Mutex<Vec<Note>>,
    pub(crate) stop: AtomicBool,
}

impl Observer for Witness {
    fn begin(&self, _stage: Stage) {}

    fn cancelled(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

impl JobObserver for Witness {
    fn note(&self, note: &Note) {
        self.notes.lock().unwrap().push(note.clone());
    }
}

/// Finishes frames by a function of their index and number, and knows how many were under way at once.
pub(crate) struct Finisher<F> {
    pub(crate) each: F,
    pub(crate) window: usize,
}

impl<F: Fn(usize, i64) -> Result<(), JobError> + Sync> FrameSink for Finisher<F> {
    fn finish(&self, index: usize, frame: &mut Frame, _observer: &dyn Observer) -> Result<(), JobError> {
        (self.each)(index, frame.header.number)
    }

    fn window(&self) -> usize {
        self.window
    }
}
