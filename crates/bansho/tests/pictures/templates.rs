//! New scenes, as `bansho new` writes them, as pictures.

use bansho::{KINDS, SceneOptions, phenomena, scene::template};

use crate::{
    SMALL,
    looks::{Film, fingerprint, luminance},
};

const FRAME: i64 = 4;

#[test]
fn a_new_scene_of_any_kind_shows_something_well_exposed() {
    for kind in phenomena() {
        let [commented, short] = [template::commented, template::short].map(|template| template(kind, KINDS));
        let film = Film::of_text(&commented, SMALL, &[FRAME], &SceneOptions::default());
        // Where the fingerprints are the same so are the pixels, which need not be drawn again.
        if fingerprint(&commented, SMALL, FRAME) != fingerprint(&short, SMALL, FRAME) {
            let short = Film::of_text(&short, SMALL, &[FRAME], &SceneOptions::default());
            assert!(film.pixels().eq(short.pixels()), "{}: a short scene shows the same", kind.key);
        }
        let share = |of: &dyn Fn(f64) -> bool| {
            film.pixels().filter(|pixel| of(luminance(**pixel))).count() as f64 / film.len() as f64
        };
        let (visible, bright, clipped) = (share(&|l| l > 0.02), share(&|l| l > 0.25), share(&|l| l > 0.99));
        assert!(visible > 0.02 && bright > 0.0005, "{}: visible {visible}, bright {bright}", kind.key);
        assert!(clipped < 0.02, "{}: {clipped} of the picture is clipped", kind.key);
    }
}
