//! How often a frame of an effect allocates memory, on one thread.

use std::sync::Arc;

use allocation_counter::measure;
use bansho::{Effect, FlameSheetParameters, LiveEffect, f16};

const SIZE: usize = 256;

fn torch() -> FlameSheetParameters {
    FlameSheetParameters { width: 0.4, height: 0.8, ..Default::default() }
}

/// Counts the allocations of `work`, which runs in a pool of one thread, the thread that counts.
fn count(live: &mut LiveEffect, work: impl FnOnce(&mut LiveEffect) + Send) -> u64 {
    measure(|| work(live)).count_total
}

#[test]
fn a_frame_allocates_little_and_a_change_does_not_print_its_parameters() {
    let pool = Arc::new(rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap());
    // All work is done within `install`, on the one thread of the pool, where it is counted.
    pool.install(|| {
        let mut live = Effect::new(torch()).size(SIZE, SIZE).open().unwrap();
        let mut texture = vec![f16::ZERO; SIZE * SIZE * 4];
        for frame in 0..100 {
            live.set_wind([0.5 + 0.01 * f64::from(frame % 5), 0.0, 0.0], 0.8).unwrap();
            live.advance(1.0 / 60.0).unwrap().write_rgba16f(&mut texture).unwrap();
        }
        let frame = count(&mut live, |live| {
            live.set_wind([0.6, 0.0, 0.0], 0.8).unwrap();
            live.advance(1.0 / 60.0).unwrap().write_rgba16f(&mut texture).unwrap();
        });
        let change = count(&mut live, |live| {
            live.set_parameters("flame_sheet", FlameSheetParameters { width: 0.41, ..torch() }).unwrap();
        });
        assert!(frame <= 50, "{frame} allocations a frame");
        // Printing and parsing the scene took 1,200.
        assert!(change <= 300, "{change} allocations a change");
    });
}
