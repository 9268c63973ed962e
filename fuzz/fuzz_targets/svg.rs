//! Drawings as SVG: any text is refused, or is strokes whose every point is finite.
#![no_main]

use bansho_media::svg::decode_drawing;

libfuzzer_sys::fuzz_target!(|text: &[u8]| {
    if let Ok(drawing) = decode_drawing(text) {
        assert!(!drawing.strokes.is_empty());
        assert!(drawing.min.is_finite() && drawing.max.is_finite());
        let points = || drawing.strokes.iter().flat_map(|stroke| &stroke.points);
        assert!(points().all(|point| point.is_finite()) && points().count() <= 1_000_000);
    }
});
