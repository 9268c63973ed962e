//! What the fuzz targets share: drawing one small frame and looking for numbers that are none.

use std::{
    sync::{Arc, Once},
    time::{Duration, Instant},
};

use bansho_base::{assets::MemoryAssets, image::Frame, observer::Observer};
use bansho_render::{
    Backend, CpuBackend, Plan, PlanOptions, RenderError, Scene,
    display::{BitDepth, display},
};

/// Stops a frame that takes too long: a scene may rightly ask for much work, and that is no fault.
struct Deadline(Instant);

impl Observer for Deadline {
    fn cancelled(&self) -> bool {
        Instant::now() > self.0
    }
}

/// One thread, so that the same input takes the same way through the code each time.
fn one_thread() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread();
        pool.build_global().expect("no pool was built before");
    });
}

/// Draws the second frame of `scene`, at most 32 pixels on a side, with layers and AOVs.
///
/// # Panics
/// The frame holds a number that is not finite, or a plan of a checked scene fails.
pub fn draw_small(mut scene: Scene) {
    one_thread();
    scene.picture.overscan = scene.picture.overscan.min(4);
    let number = scene.picture.first_frame + 1;
    let size = scene.picture.size.map(|side| (side as usize).min(32));
    let options = PlanOptions { size: Some(size), layers: true, aovs: true, ..PlanOptions::default() };
    let plan = Plan::new(scene, &options, Arc::new(MemoryAssets::default())).expect("a checked scene can be planned");
    let mut shot = CpuBackend.open(Arc::new(plan)).expect("a planned shot opens");
    let deadline = Deadline(Instant::now() + Duration::from_secs(2));
    match shot.advance(number, &deadline).and_then(|()| shot.draw(&deadline)) {
        Err(RenderError::Cancelled(_)) => {}
        Err(error) => panic!("a checked scene without a plate cannot be drawn: {error}"),
        Ok(()) => check(&shot.read().expect("what was drawn can be read")),
    }
}

/// # Panics
/// The frame holds a number that is not finite.
fn check(frame: &Frame) {
    let finite = |values: &mut dyn Iterator<Item = f32>, what: &str| {
        assert!(values.all(f32::is_finite), "{what} holds a number that is not finite");
    };
    finite(&mut frame.beauty.pixels().iter().flatten().copied(), "the beauty");
    for channel in &frame.channels {
        finite(&mut channel.values.iter().copied(), &channel.name);
    }
    if let Some(depth) = &frame.depth {
        assert!(depth.iter().all(|depth| *depth >= 0.0), "the depth is NaN or negative");
    }
    display(frame, &Default::default(), BitDepth::Eight);
    display(frame, &Default::default(), BitDepth::Sixteen);
}
