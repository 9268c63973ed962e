//! All phenomena with the vector instructions of older processors: the same bytes.

use bansho::base::math::simd::VectorLevel;

use super::threads::SCENES;
use crate::support::{FLAME, Folder};

#[test]
fn pictures_are_the_same_at_every_vector_level() {
    let available = VectorLevel::available();
    for (what, tables) in SCENES {
        let folder = Folder::with_scene(&format!(
            "bansho = 2\n[picture]\nsize = [96, 64]\nframes = 2\n[ground]\nwetness = 1.0\n{tables}"
        ));
        for level in &available {
            let out = format!("{level}/f.####.exr");
            let exr = ["render", "scene.toml", "--aovs", "--vector-level", level.name(), "--out", &out];
            folder.succeed(&exr);
            let png = format!("{level}/f.####.png");
            folder.succeed(&["render", "scene.toml", "--vector-level", level.name(), "--out", &png]);
        }
        let widest = folder.files(available[available.len() - 1].name());
        assert_eq!(widest.len(), 4, "{what}: {:?}", widest.keys());
        for level in &available {
            let differs = |(name, bytes): &(String, Vec<u8>)| widest[name] != *bytes;
            let names: Vec<_> = folder.files(level.name()).into_iter().filter(differs).map(|(name, _)| name).collect();
            assert!(names.is_empty(), "{what} at {level}: {names:?}");
        }
    }
}

#[test]
fn a_vector_level_that_the_machine_lacks_is_refused_with_those_that_it_has() {
    let folder = Folder::with_scene(FLAME);
    let available = VectorLevel::available();
    let lacking = VectorLevel::ALL.into_iter().filter(|level| !available.contains(level)).map(VectorLevel::name);
    for name in lacking.chain(["mmx", ""]) {
        let run = folder.run(&["render", "scene.toml", "--vector-level", name]);
        assert_eq!((run.code, run.errors()), (Some(2), 1), "{name}: {}", run.stderr);
        let list: Vec<_> = available.iter().map(|level| level.name()).collect();
        assert!(run.stderr.contains(&format!("allowed: {}", list.join(", "))), "{name}: {}", run.stderr);
    }
    assert_eq!(folder.names(), ["scene.toml"]);
}
