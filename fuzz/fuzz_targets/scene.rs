//! Scene files: any text is refused with located errors or draws a finite picture.
#![no_main]

use bansho_base::host::assets::MemoryAssets;
use bansho::KINDS;
use bansho_scene::{Scene, edit, parse_values};
use bansho_fuzz::{draw_small, one_thread};

libfuzzer_sys::fuzz_target!(|text: &str| {
    one_thread();
    edit(text);
    match Scene::parse("fuzz.toml", text, KINDS) {
        Ok(scene) => {
            draw_small(scene, MemoryAssets::default());
        }
        Err(error) => {
            assert!(!error.problems.is_empty());
            assert!(!error.to_string().is_empty());
        }
    }
});

/// The first line is an assignment to what follows it; what an edit gives is TOML again.
fn edit(text: &str) {
    if let Some((assignment, scene)) = text.split_once('\n')
        && let Ok(edited) = edit::set(scene, assignment, KINDS)
    {
        assert!(parse_values(&edited).is_ok(), "an edit broke the scene's syntax");
    }
}
