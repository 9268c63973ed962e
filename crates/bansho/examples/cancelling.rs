//! Cancels a frame that takes too long from another thread, then draws another frame with the same shot.
//!
//! `cargo run --release -p bansho --example cancelling`

use std::{
    error::Error,
    io::{self, Write},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use bansho::{MemoryAssets, Observer, Plan, PlanOptions, RenderError, Shot, compile_scene};

/// A particle flame whose frame 3000 needs 100 s of simulation.
const SCENE: &str =
    "bansho = 2\n[picture]\nsize = [320, 180]\nexposure_ev100 = 10.0\nframes = 4000\n[[flame_particles]]\n";

/// Checked by the renderer at least once for each strip of a picture and each step of a simulation.
#[derive(Default)]
struct StopButton(AtomicBool);

impl Observer for StopButton {
    fn cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let compiled = compile_scene("scene.toml", SCENE, Arc::new(MemoryAssets::default()))?;
    let plan = Plan::new(&compiled, &PlanOptions::default())?;
    let mut shot = Shot::open(compiled, Arc::new(plan));

    let (button, begin) = (StopButton::default(), Instant::now());
    let stopped = thread::scope(|scope| {
        scope.spawn(|| {
            thread::sleep(Duration::from_millis(50));
            button.0.store(true, Ordering::Relaxed);
        });
        bansho::draw(&mut shot, 3000, &button)
    });
    if !matches!(stopped, Err(RenderError::Cancelled(_))) {
        return Err("the frame was not stopped".into());
    }
    let waited = begin.elapsed().as_millis();

    // The shot is still valid: it continues from the last complete step of the simulation, or restarts for an earlier time.
    button.0.store(false, Ordering::Relaxed);
    let frame = bansho::draw(&mut shot, 0, &button)?;
    let (width, height) = (frame.beauty.width(), frame.beauty.height());
    writeln!(io::stdout(), "stopped after {waited} ms; then drew frame {} at {width} x {height}", frame.header.number)?;
    Ok(())
}
