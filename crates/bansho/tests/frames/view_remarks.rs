//! Remarks on what the camera hardly shows.

use std::sync::Arc;

use bansho::KINDS;
use bansho_base::{host::assets::MemoryAssets, phenomenon::Remark};
use bansho_render::PlanOptions;
use bansho_scene::Scene;

use crate::support::Planned;

fn remarks(camera: &str, table: &str) -> Vec<(String, Remark)> {
    let text =
        format!("bansho = 2\n[picture]\nframes = 48\nfps = 24\nexposure_ev100 = 9\n[camera]\n{camera}\n{table}\n");
    let scene = Scene::parse("scene.toml", &text, KINDS).unwrap_or_else(|error| panic!("{error}"));
    Planned::new(scene, &PlanOptions::default(), Arc::new(MemoryAssets::default())).remarks()
}

#[test]
fn a_flame_sheet_that_is_seen_edge_on_is_told_with_what_to_use_instead() {
    let from_above = "position = [0, 5, 0.01]\ntarget = [0, 0, 0]";
    let [(name, remark)] = &remarks(from_above, "[[flame_sheet]]\nname = \"torch\"")[..] else { panic!("no remark") };
    assert_eq!((name.as_str(), &remark.key), ("torch", &None));
    for part in
        ["in frame 0 the camera looks at it from 90 degrees above", "only 0 % of its height", "[[flame_particles]]"]
    {
        assert!(remark.message.contains(part), "{remark}");
    }
    let beside = "position = [3, 0.8, 0]\ntarget = [0, 0.8, 0]";
    let fixed = "[[flame_sheet]]\nfacing = \"fixed\"\ninstances = [{ yaw_deg = 90 }, {}]";
    let [(_, remark)] = &remarks(beside, fixed)[..] else { panic!("no remark") };
    assert_eq!(remark.key.as_deref(), Some("instances.1"));
    assert!(
        remark.message.contains("only 0 % of its width") && remark.message.contains("`facing = \"camera\"`"),
        "{remark}"
    );
}

#[test]
fn a_flight_over_a_flame_is_told_of_the_frame_and_ordinary_views_are_not() {
    let over = "position = { keys = [[0, [0, 6, 9]], [2, [0, 6, -9]]] }\ntarget = [0, 0.8, 0]";
    // The picture turns too, which is another remark.
    let told = remarks(over, "[[flame_sheet]]");
    let (_, remark) = told.iter().find(|(name, _)| name == "flame_sheet").expect("a remark about the sheet");
    assert!(remark.message.starts_with("in frame ") && !remark.message.starts_with("in frame 0 "), "{remark}");
    for camera in ["position = [0, 1, 4]\ntarget = [0, 0.9, 0]", "position = [0, 4, 4]\ntarget = [0, 0.9, 0]"] {
        assert_eq!(remarks(camera, "[[flame_sheet]]"), []);
    }
    let elsewhere = "position = [0, 5, 0.01]\ntarget = [0, 10, 0]";
    assert_eq!(remarks(elsewhere, "[[flame_sheet]]"), [], "it is not in the picture");
    let from_above = "position = [0, 5, 0.01]\ntarget = [0, 0, 0]";
    assert_eq!(remarks(from_above, "[[flame_sheet]]\nflow = 0"), [], "it is out");
}
