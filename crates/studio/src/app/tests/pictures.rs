//! Snapshots of the window (UPDATE_SNAPSHOTS=1 updates them). Those of a GPU need a Vulkan device, such as Mesa's lavapipe. The software
//! rasterizer must paint the same.

use std::{cell::Cell, rc::Rc};

use eframe::{
    egui::{self, Key, Role, TexturesDelta, Theme, vec2},
    egui_wgpu::WgpuSetup,
};
use egui_kittest::{
    Harness, HarnessBuilder, SnapshotOptions, TestRenderer, image_snapshot_options,
    kittest::Queryable,
    wgpu::{WgpuTestRenderer, default_wgpu_setup},
};
use image::{Rgba, RgbaImage};

use super::{super::Studio, SCENE, drawn, sky, window_by};
use bansho_egui_software::{Painter, PixelRect};

/// Size of the window, points. It is small, since the snapshots are in the repository.
const SIZE: [f32; 2] = [960.0, 620.0];

const SNAPSHOTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/snapshots");

const SHAPES: &str = "\
extent_km = 800.0
[[aurora.shapes]]
sheets = [{ points = [[-300, 0], [0, 60], [300, 0]] }, { points = [[-200, -150], [200, -120]] }]
[[aurora.shapes]]
sheets = [
  { points = [[-320, 60], [-30, 150]] },
  { points = [[20, 150], [280, 40]], flux_factor = [[0.0, 0.4], [1.0, 3.0]] },
  { points = [[-250, -200], [200, -220]] },
]
split = [{ sheet = 1, length_fraction = 0.5 }]
link = [{ from = 2, to = 3, from_length_fraction = 0.3, to_length_fraction = 0.5 }]
";

/// Opens a window with a scene and a renderer.
type OpenWindow = fn(HarnessBuilder<Studio>, &str) -> Harness<'static, Studio>;

/// Compares a window with a snapshot.
type Compare = fn(&mut Harness<'_, Studio>, &str);

fn by_gpu(builder: HarnessBuilder<Studio>, text: &str) -> Harness<'static, Studio> {
    let mut setup = default_wgpu_setup();
    if let WgpuSetup::CreateNew(new) = &mut setup {
        // Without Vulkan the test must fail instead of using another backend.
        new.instance_descriptor.backends = wgpu::Backends::VULKAN;
    }
    window_by(builder.renderer(WgpuTestRenderer::from_setup(setup)), text)
}

fn by_software(builder: HarnessBuilder<Studio>, text: &str) -> Harness<'static, Studio> {
    window_by(builder.renderer(Software::default()), text)
}

fn painted(open: OpenWindow, text: &str) -> Harness<'static, Studio> {
    open(Harness::builder().with_size(vec2(SIZE[0], SIZE[1])), text)
}

/// Paints by the software rasterizer, and compares partial repaints with whole ones.
#[derive(Default)]
struct Software {
    painter: Painter,
    /// The pixels of the window.
    screen: Vec<u32>,
    /// Number of frames that were painted as a whole.
    whole: Rc<Cell<usize>>,
}

impl TestRenderer for Software {
    fn handle_delta(&mut self, delta: &mut TexturesDelta) {
        self.painter.set_textures(delta);
        self.painter.free_textures(delta);
    }

    fn render(&mut self, ctx: &egui::Context, output: &egui::FullOutput) -> Result<RgbaImage, String> {
        let scale = output.pixels_per_point;
        let size = ctx.content_rect().size() * scale;
        let size = [size.x.round() as u32, size.y.round() as u32];
        let primitives = ctx.tessellate(output.shapes.clone(), scale);
        self.screen.resize((size[0] * size[1]) as usize, 0);
        let mut show = |painter: &mut Painter| {
            let changed = painter.paint(&primitives, scale, size);
            for area in &changed {
                painter.copy(*area, &mut self.screen, size[0] as usize);
            }
            (self.screen.clone(), changed)
        };
        let (pixels, changed) = show(&mut self.painter);
        let same = show(&mut self.painter).1;
        self.painter.invalidate();
        let (anew, all) = show(&mut self.painter);
        let whole = PixelRect { left: 0, top: 0, right: size[0] as i32, bottom: size[1] as i32 };
        if !same.is_empty() || all != [whole] || pixels != anew {
            return Err(format!("the partial repaint of {changed:?} differs from a whole one"));
        }
        self.whole.update(|frames| frames + usize::from(changed == [whole]));
        Ok(RgbaImage::from_fn(size[0], size[1], |x, y| {
            let [_, red, green, blue] = pixels[(y * size[0] + x) as usize].to_be_bytes();
            Rgba([red, green, blue, 255])
        }))
    }
}

/// The pixels of the window without the status line, which shows times.
fn seen(harness: &mut Harness<'_, Studio>) -> RgbaImage {
    let status = harness.get_by_label_contains("of 64 × 36").rect().top();
    let mut picture = harness.render().unwrap();
    picture.rows_mut().skip(status as usize - 4).flatten().for_each(|pixel| pixel.0 = [0, 0, 0, 255]);
    picture
}

/// Compares the window with a snapshot.
fn equals_snapshot(harness: &mut Harness<'_, Studio>, name: &str) {
    let options = SnapshotOptions::new().output_path(SNAPSHOTS);
    image_snapshot_options(&seen(harness), name, &options);
}

/// Compares the software rasterizer with the snapshot of a GPU.
fn resembles_snapshot(harness: &mut Harness<'_, Studio>, name: &str) {
    let picture = seen(harness);
    let expected = image::open(format!("{SNAPSHOTS}/{name}.png")).unwrap().into_rgba8();
    assert_eq!(picture.dimensions(), expected.dimensions());
    // Unpainted pixels are transparent in one and black in the other.
    let apart = |(a, b): (&Rgba<u8>, &Rgba<u8>)| (0..3).map(|c| a[c].abs_diff(b[c])).max().unwrap_or(0);
    let differences: Vec<f64> = picture.pixels().zip(expected.pixels()).map(apart).map(f64::from).collect();
    let mean = differences.iter().sum::<f64>() / differences.len() as f64;
    let worst = differences.iter().copied().fold(0.0, f64::max);
    assert!(worst <= 6.0 && mean < 0.02, "{name}: {worst} of 255 at worst, {mean} in the mean");
}

fn dark_and_light(open: OpenWindow, compare: Compare) {
    let mut harness = painted(open, SCENE);
    compare(&mut harness, "window_dark");
    harness.ctx.set_theme(Theme::Light);
    harness.run_steps(3);
    compare(&mut harness, "window_light");
}

fn curves(open: OpenWindow, compare: Compare) {
    let mut harness = painted(open, SCENE);
    // The stage has the same label.
    harness.get_all_by_label("texture").last().expect("the section").click();
    harness.run_steps(12);
    harness.get_by_label("threshold").scroll_to_me();
    harness.run_steps(12);
    compare(&mut harness, "curves");
}

fn aurora_editor(open: OpenWindow, compare: Compare) {
    let mut harness = painted(open, &sky(150, SHAPES));
    harness.get_by_label("Shape 2").click();
    drawn(&mut harness);
    compare(&mut harness, "aurora_editor");
}

#[test]
#[ignore = "needs a Vulkan device"]
fn the_window_looks_as_it_did_dark_and_light() {
    dark_and_light(by_gpu, equals_snapshot);
}

#[test]
#[ignore = "needs a Vulkan device"]
fn curves_look_as_they_did() {
    curves(by_gpu, equals_snapshot);
}

#[test]
#[ignore = "needs a Vulkan device"]
fn the_aurora_editor_looks_as_it_did() {
    aurora_editor(by_gpu, equals_snapshot);
}

#[test]
fn without_a_gpu_the_window_looks_as_with_one() {
    dark_and_light(by_software, resembles_snapshot);
    curves(by_software, resembles_snapshot);
    aurora_editor(by_software, resembles_snapshot);
}

#[test]
fn frames_that_are_painted_in_places_are_those_painted_anew() {
    let software = Software::default();
    let whole = software.whole.clone();
    let mut harness = window_by(Harness::builder().with_size(vec2(SIZE[0], SIZE[1])).renderer(software), SCENE);
    let frames = |harness: &mut Harness<'_, Studio>, count: usize| {
        for _ in 0..count {
            harness.step();
            // This compares partial and whole repaints.
            harness.render().unwrap();
        }
    };
    frames(&mut harness, 2);
    harness.state_mut().session().transport.set_playing(true);
    frames(&mut harness, 6);
    harness.state_mut().session().transport.set_playing(false);
    // Open a menu, focus a text field, unfold a section, and show new glyphs.
    harness.get_by_label("File").click();
    frames(&mut harness, 4);
    harness.key_press(Key::Escape);
    frames(&mut harness, 2);
    harness.get_by_role_and_label(Role::TextInput, "Find").focus();
    frames(&mut harness, 2);
    harness.get_all_by_label("texture").last().expect("the section").click();
    frames(&mut harness, 8);
    harness.state_mut().session().set_notice(Some("Þßøð ¿".into()));
    frames(&mut harness, 2);
    harness.hover_at(egui::pos2(500.0, 300.0));
    frames(&mut harness, 2);
    assert_eq!(whole.get(), 1, "only the first is painted whole");
}
