//! How the window looks, against pictures that were looked at (UPDATE_SNAPSHOTS=1 takes new ones). They need a Vulkan
//! device; Mesa's lavapipe is one.

use eframe::{
    egui::{Theme, vec2},
    egui_wgpu::WgpuSetup,
};
use egui_kittest::{
    Harness, SnapshotOptions, image_snapshot_options,
    kittest::Queryable,
    wgpu::{WgpuTestRenderer, default_wgpu_setup},
};

use super::{super::Studio, SCENE, drawn, sky, window_by};

/// Small, for they are kept with the code.
const SIZE: [f32; 2] = [960.0, 620.0];

fn painted(text: &str) -> Harness<'static, Studio> {
    let mut setup = default_wgpu_setup();
    if let WgpuSetup::CreateNew(new) = &mut setup {
        // Without one the test must fail rather than go another way.
        new.instance_descriptor.backends = wgpu::Backends::VULKAN;
    }
    let builder = Harness::builder().with_size(vec2(SIZE[0], SIZE[1])).renderer(WgpuTestRenderer::from_setup(setup));
    window_by(builder, text)
}

/// Compares what the window shows, but for the line at the bottom that tells how long drawing took.
fn looks(harness: &mut Harness<'_, Studio>, name: &str) {
    let status = harness.get_by_label_contains("of 64 × 36").rect().top();
    let mut picture = harness.render().unwrap();
    picture.rows_mut().skip(status as usize - 4).flatten().for_each(|pixel| pixel.0 = [0, 0, 0, 255]);
    let options = SnapshotOptions::new().output_path(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/snapshots"));
    image_snapshot_options(&picture, name, &options);
}

#[test]
#[ignore = "needs a Vulkan device"]
fn the_window_looks_as_it_did_dark_and_light() {
    let mut harness = painted(SCENE);
    looks(&mut harness, "window_dark");
    harness.ctx.set_theme(Theme::Light);
    harness.run_steps(3);
    looks(&mut harness, "window_light");
}

#[test]
#[ignore = "needs a Vulkan device"]
fn curves_look_as_they_did() {
    let mut harness = painted(SCENE);
    // The stage above is called so too.
    harness.get_all_by_label("texture").last().expect("the section").click();
    harness.run_steps(12);
    harness.get_by_label("threshold").scroll_to_me();
    harness.run_steps(12);
    looks(&mut harness, "curves");
}

#[test]
#[ignore = "needs a Vulkan device"]
fn the_aurora_editor_looks_as_it_did() {
    let shapes = "\
extent_km = 800.0
[[aurora.shapes]]
sheets = [{ points = [[-300, 0], [0, 60], [300, 0]] }, { points = [[-200, -150], [200, -120]] }]
[[aurora.shapes]]
sheets = [
  { points = [[-320, 60], [-30, 150]] },
  { points = [[20, 150], [280, 40]], flux = [[0.0, 0.4], [1.0, 3.0]] },
  { points = [[-250, -200], [200, -220]] },
]
split = [{ sheet = 1, at = 0.5 }]
link = [{ from = 2, to = 3, at = 0.3, arrives = 0.5 }]
";
    let mut harness = painted(&sky(150, shapes));
    harness.get_by_label("Shape 2").click();
    drawn(&mut harness);
    looks(&mut harness, "aurora_editor");
}
