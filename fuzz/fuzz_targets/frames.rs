//! Frame specifications: any text is refused or names frames in ascending order, each once.
#![no_main]

use bansho_render::frames::{MOST_FRAMES, parse};

libfuzzer_sys::fuzz_target!(|spec: &str| {
    if let Ok(frames) = parse(spec) {
        assert!(!frames.is_empty() && frames.len() as i64 <= MOST_FRAMES);
        assert!(frames.is_sorted_by(|a, b| a < b));
    }
});
