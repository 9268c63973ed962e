//! An edit builds only what it changed: constructors count themselves. One test alone in its process, since the counts are the process's.

use std::{collections::BTreeMap, sync::Arc};

use bansho::{Assets, MemoryAssets, Shot, Unobserved, base::host::constructions};
use bansho_studio::document::Checker;

const SCENE: &str = "\
bansho = 2
[picture]
size = [32, 18]
frames = 6
[wind]
[[flame_sheet]]
height = 0.5
[[flame_particles]]
particles = 60
preroll_s = 0.1
[[rain]]
[[obstacle]]
position = [0, 0, -4]
";

#[test]
fn an_edit_builds_only_what_it_changed() {
    let assets: Arc<dyn Assets> = Arc::new(MemoryAssets::default());
    let mut checker = Checker::default();
    let mut counts = |text: &str| {
        constructions::take();
        let scene = checker.check("scene", text, &assets).unwrap();
        let counts = constructions::take();
        let mut shot = Shot::open(scene.compiled.clone(), scene.plan.clone());
        for frame in [0, 3, 1] {
            bansho::draw(&mut shot, frame, &Unobserved).unwrap();
        }
        shot.replan(scene.compiled, Arc::new(scene.plan.at_size([16, 9])));
        assert_eq!(constructions::take(), BTreeMap::new(), "drawing, going back and another size build nothing");
        counts
    };
    let all = [("flame_particles", 1), ("flame_sheet", 1), ("obstacle", 1), ("rain", 1)];
    assert_eq!(counts(SCENE), all.into());
    assert_eq!(counts(SCENE), BTreeMap::new(), "nothing changed");
    assert_eq!(counts(&SCENE.replace("height = 0.5", "height = 0.7")), [("flame_sheet", 1)].into());
    let wind = SCENE.replace("height = 0.5", "height = 0.7").replace("[wind]", "[wind]\nvelocity = [1, 0, 0]");
    assert_eq!(counts(&wind), BTreeMap::new(), "the wind is nobody's own");
    let moved = wind.replace("position = [0, 0, -4]", "position = [0, 0, -5]");
    assert_eq!(counts(&moved), [("obstacle", 1)].into());
    assert_eq!(
        counts(&moved.replace("[picture]", "[picture]\nseed = 9")),
        [("flame_particles", 1), ("flame_sheet", 1), ("rain", 1)].into()
    );
}
