//! Frame specifications: any text is refused or names frames in ascending order, each once.
#![no_main]

use bansho::job::frames::{MAX_FRAMES, parse};

libfuzzer_sys::fuzz_target!(|spec: &str| {
    // Millions of frames are allowed, but under a sanitizer they take so long that nothing else is tried.
    if spec.split(|c: char| !c.is_ascii_digit()).any(|digits| (7..12).contains(&digits.len())) {
        return;
    }
    if let Ok(frames) = parse(spec) {
        assert!(!frames.is_empty() && frames.len() as i64 <= MAX_FRAMES);
        assert!(frames.is_sorted_by(|a, b| a < b));
    }
});
