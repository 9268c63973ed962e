//! A frame source with a known state and known pictures, for tests of what uses it.

use std::sync::{
    Arc, Mutex,
    atomic::{AtomicBool, Ordering},
};

use bansho_base::{
    frame::Frame,
    host::{
        assets::MemoryAssets,
        observer::{Observer, check},
    },
    image::{Image, Rect},
    phenomenon::SnapshotError,
};
use bansho_media::files::provenance;
use bansho_render::{CompiledScene, Plan, PlanOptions, RenderError, SceneLinear, Target};

use super::{
    error::JobError,
    observer::{JobObserver, Warning},
    pipeline::{FrameSource, draw_frames::FrameSink},
};

/// The plan of an empty picture of one pixel.
pub(crate) fn plan() -> Arc<Plan> {
    let assets = Arc::new(MemoryAssets::default());
    let text = "bansho = 2\n[picture]\nsize = [1, 1]\nfps = 10\nfirst_frame = -4\n";
    let scene = crate::parse_scene("test", text).unwrap_or_else(|error| panic!("{error}"));
    let compiled = Arc::new(CompiledScene::build(Arc::new(scene), assets, None).unwrap());
    Arc::new(Plan::new(&compiled, &PlanOptions::default()).unwrap())
}

/// Takes one step for each frame and counts the steps. Its state is the number of the last frame.
pub(crate) struct CountingSource {
    plan: Arc<Plan>,
    pub(crate) steps: usize,
    pub(crate) number: i64,
    /// Whether several frames may be drawn at once.
    pub(crate) is_closed_form: bool,
}

impl CountingSource {
    pub(crate) fn new() -> Self {
        let plan = plan();
        Self { number: plan.frames().start - 1, plan, steps: 0, is_closed_form: false }
    }
}

impl FrameSource for CountingSource {
    fn advance(&mut self, number: i64, observer: &dyn Observer) -> Result<(), RenderError> {
        check(observer)?;
        if number < self.number {
            self.number = self.plan.frames().start - 1;
        }
        self.steps += (number - self.number) as usize;
        self.number = number;
        Ok(())
    }

    fn draw<T: Target>(&mut self, target: &T, observer: &dyn Observer) -> Result<T::Frame, RenderError> {
        check(observer)?;
        Ok(target.of_light(blank(&self.plan, self.number), &mut None))
    }

    fn recycle(&mut self, _recycled: Frame) {}

    fn independent(&self) -> Option<Self> {
        self.is_closed_form.then(|| Self { plan: self.plan.clone(), ..*self })
    }

    fn snapshot(&self) -> Vec<u8> {
        state(self.number)
    }

    fn check_snapshot(&self, bytes: &[u8]) -> Result<(), SnapshotError> {
        if bytes.len() == state(0).len() { Ok(()) } else { Err(SnapshotError::Damaged) }
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
    Frame { header, beauty, depth: None, channels: Vec::new(), opaque: false, metadata: Vec::new(), content }
}

/// Records warnings, and cancels the job once `stop` is set.
#[derive(Default)]
pub(crate) struct RecordingObserver {
    pub(crate) warnings: Mutex<Vec<Warning>>,
    pub(crate) stop: AtomicBool,
}

impl Observer for RecordingObserver {
    fn cancelled(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

impl JobObserver for RecordingObserver {
    fn warning(&self, warning: &Warning) {
        self.warnings.lock().unwrap().push(warning.clone());
    }
}

/// Finishes frames by a function of their index and number.
pub(crate) struct FunctionSink<F> {
    pub(crate) each: F,
    pub(crate) max_in_flight: usize,
    /// Indices of the frames that were committed.
    pub(crate) committed: Mutex<Vec<usize>>,
}

impl<F> FunctionSink<F> {
    pub(crate) fn new(each: F, max_in_flight: usize) -> Self {
        Self { each, max_in_flight, committed: Mutex::default() }
    }
}

impl<F: Fn(usize, i64) -> Result<(), JobError> + Sync> FrameSink for FunctionSink<F> {
    type Target = SceneLinear;
    type Encoded = ();

    fn target(&self) -> &SceneLinear {
        &SceneLinear
    }

    fn encode(&self, index: usize, frame: &mut Frame, _observer: &dyn Observer) -> Result<(), JobError> {
        (self.each)(index, frame.header.number)
    }

    fn commit(&self, index: usize, (): (), _observer: &dyn Observer) -> Result<(), JobError> {
        self.committed.lock().unwrap().push(index);
        Ok(())
    }

    fn max_in_flight(&self) -> usize {
        self.max_in_flight
    }
}
