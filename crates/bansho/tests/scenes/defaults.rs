//! Defaults that depend on the other values of a scene.

use bansho::{GroundParameters, KINDS, LightParameters, SkyParameters, phenomena};
use bansho_base::parameters::{Auto, Value};
use bansho_scene::{Scene, SceneOptions};

fn read(text: &str) -> Scene {
    let text = format!("bansho = 2\n{text}");
    Scene::parse("test.toml", &text, KINDS).unwrap_or_else(|error| panic!("{error}"))
}

const NONE: &[&str] = &[];
const NIGHT: &[&str] = &["sky"];
const DUSK: &[&str] = &["sky", "ground", "light"];

#[test]
fn the_scene_defaults_of_every_kind_are_a_scene() {
    for kind in phenomena() {
        let text = format!("bansho = 2\n{}[[{}]]\n", kind.scene_defaults, kind.key);
        let scene = Scene::parse("setting", &text, KINDS).unwrap_or_else(|error| panic!("{}: {error}", kind.key));
        assert_eq!(scene.implied, NONE, "{}: states all of it", kind.key);
        let setting = bansho_scene::parse_values(kind.scene_defaults).unwrap();
        assert!(matches!(setting.get("camera").map(|node| &node.value), Some(Value::Table(_))), "{}", kind.key);
    }
}

#[test]
fn a_scene_of_one_kind_has_its_scene_defaults_unless_something_contradicts_them() {
    for (text, implied, white) in [
        ("[[flame_sheet]]", NONE, None),
        ("[[flame_particles]]", NONE, None),
        ("[[aurora]]", NIGHT, Some(4000.0)),
        ("[[aurora]]\n[[aurora]]", NIGHT, Some(4000.0)),
        ("[ground]\n[[aurora]]", NIGHT, Some(4000.0)),
        ("[picture]\nwhite_balance_k = 6500\n[[aurora]]", NIGHT, Some(6500.0)),
        ("[[light]]\n[[aurora]]", NONE, None),
        ("[sky]\n[[aurora]]", NONE, None),
        ("[sky]\nkind = \"night\"\n[[flame_sheet]]", NONE, Some(4000.0)),
        ("[[rain]]", DUSK, None),
        ("[[rain]]\nenabled = false", DUSK, None),
        ("[ground]\n[[rain]]", NIGHT, None),
        ("[sky]\n[[rain]]", NONE, None),
        ("[[light]]\n[[rain]]", NONE, None),
        ("[[obstacle]]\n[[rain]]", NONE, None),
        ("[plate]\nimage = \"a.png\"\n[[rain]]", NONE, None),
        ("[[rain]]\n[[flame_sheet]]", NONE, None),
        ("", NONE, None),
    ] {
        let scene = read(text);
        assert_eq!((scene.implied.as_slice(), scene.picture.white_balance_k), (implied, white), "{text}");
        for key in ["sky", "ground", "light"] {
            let is_expected = implied.contains(&key) || text.contains(&format!("[{key}]"));
            assert_eq!(scene.tables.iter().any(|table| table.kind.key == key), is_expected, "{key} in {text}");
        }
    }
}

#[test]
fn a_camera_that_is_told_where_to_stand_or_look_is_left_alone() {
    let position = |text: &str| read(text).camera.position.at(0.0);
    let usual = read("").camera;
    assert_ne!(position("[[rain]]"), usual.position.at(0.0));
    for text in ["[camera]\ntarget = [0, 1, 0]\n[[rain]]", "[[rain]]\n[[flame_sheet]]", "[[obstacle]]\n[[flame_sheet]]"]
    {
        assert_eq!(position(text), usual.position.at(0.0), "{text}");
    }
    // What is placed by the scene is framed by the scene.
    assert_eq!(position("[[flame_sheet]]\nposition = [5, 0, 0]"), usual.position.at(0.0));
    let overhead = read("[[aurora]]\nshapes = [{ sheets = [{ form = \"fold\" }] }]").camera;
    assert!(overhead.target.at(0.0)[1] > 50.0 && overhead.vertical_fov_deg.at(0.0) > 80.0);
    let wide = read("[camera]\nvertical_fov_deg = 70\n[[flame_sheet]]").camera;
    assert_eq!(wide.vertical_fov_deg.at(0.0), 70.0);
    assert_eq!(wide.position, read("[[flame_sheet]]").camera.position);
    let dome = read("[camera]\nlens = \"fisheye\"\n[[aurora]]").camera;
    assert!(dome.target.at(0.0)[1] > 50.0, "a dome looks to the zenith");
}

/// What is drawn elsewhere may be fainter or brighter than what the exposure of the scene defaults is for.
#[test]
fn what_the_scene_places_is_exposed_for_itself() {
    let exposure = |text: &str| read(text).picture.exposure_ev100;
    assert_eq!(exposure("[[aurora]]"), Auto::Set(-7.3));
    assert_eq!(exposure("[[aurora]]\nflux_mw_per_m2 = 3"), Auto::Set(-7.3));
    for text in ["[[aurora]]\nshapes = [{ sheets = [{ form = \"fold\" }] }]", "[[aurora]]\n[[aurora]]\nextent_km = 200"]
    {
        assert_eq!((exposure(text), read(text).implied.as_slice()), (Auto::Auto, NIGHT), "{text}");
    }
}

#[test]
fn a_backdrop_that_nobody_wrote_is_seen_only_where_the_plan_shows_it() {
    let shown = |text: &str, implied_backdrop| {
        let scene = read(text).with_options(&SceneOptions { implied_backdrop, ..SceneOptions::default() }).unwrap();
        let tables = &scene.tables;
        let lights: Vec<&LightParameters> = tables.all().collect();
        let sky: &SkyParameters = tables.get().unwrap();
        let has_ground = tables.get::<GroundParameters>().is_some();
        (sky.visible, has_ground, lights.iter().any(|light| light.visible), lights.len())
    };
    assert_eq!(shown("[[rain]]", true), (true, true, true, 3));
    assert_eq!(shown("[[rain]]", false), (false, false, false, 3), "it lights all the same");
    for implied_backdrop in [false, true] {
        assert!(shown("[sky]\n[[rain]]", implied_backdrop).0, "a sky that is stated is seen");
    }
}
