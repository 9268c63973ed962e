//! The pictures of Ohshima and Itahashi: scenes of `scenes/papers/ohshima_itahashi` compared with the paper's formulas, evaluated here in double precision,
//! and judged by measurements.
//!
//! The formulas are written down from the paper, and share nothing with the library but the curves that a scene states: V, H, C, R, G, B, A, D and F are free.
#![allow(clippy::disallowed_methods, reason = "an independent evaluation calls the standard library")]

use std::{
    f64::consts::PI,
    path::{Path, PathBuf},
    sync::Arc,
};

use bansho::{
    AlphaConvention, BitDepth, CompiledScene, Plan, PlanOptions, Shot, Unobserved, View,
    base::{
        assert_measured,
        color::{srgb_from_acescg, white_luminance},
        frame::Frame,
        math::curve::{Curve, Interpolation},
    },
    flame_statistics::{FlameStatistics, draw_film},
    media::{
        assets::FileAssets,
        exr,
        png::{self, PngEffort},
    },
};

/// Pixels on each side, as in the paper.
const SIZE: usize = 256;
/// A frame, at 30 per second.
const FRAME: i64 = 47;
/// One step of an 8-bit display.
const STEP: f64 = 1.0 / 255.0;

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../scenes/papers/ohshima_itahashi")
}

fn scene_text(picture: u32) -> String {
    std::fs::read_to_string(folder().join(format!("ohshima_picture_{picture}.toml"))).unwrap()
}

/// A scene with files in a folder.
fn compiled(folder: &Path, text: &str) -> Arc<CompiledScene> {
    let scene = bansho::parse_scene("scene", text).unwrap_or_else(|error| panic!("{error}"));
    let compiled = CompiledScene::build(Arc::new(scene), Arc::new(FileAssets::new(folder)), None);
    Arc::new(compiled.unwrap_or_else(|errors| panic!("{errors}")))
}

/// Frames of a scene, scene-linear.
fn render(text: &str, size: [usize; 2], frames: &[i64]) -> Vec<Frame> {
    render_in(&folder(), text, size, frames)
}

/// The same with files in another folder.
fn render_in(folder: &Path, text: &str, size: [usize; 2], frames: &[i64]) -> Vec<Frame> {
    let compiled = compiled(folder, text);
    let plan = Plan::new(&compiled, &PlanOptions { size: Some(size), ..PlanOptions::default() }).unwrap();
    let mut shot = Shot::open(compiled, Arc::new(plan));
    frames.iter().map(|number| bansho::draw(&mut shot, *number, &Unobserved).unwrap()).collect()
}

/// Linear sRGB of a frame's pixels.
fn linear(frame: &Frame) -> Vec<[f64; 3]> {
    let pixels = frame.beauty.pixels().iter();
    pixels.map(|[red, green, blue, _]| srgb_from_acescg([*red, *green, *blue]).map(f64::from)).collect()
}

fn decode(encoded: f64) -> f64 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

fn encode(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// The numbers and functions that the paper leaves free, as a scene states them.
struct Choices {
    text: String,
    octaves: u32,
    contrast: f64,
    /// Distance that the texture has scrolled at the middle of the exposure.
    scroll: f64,
}

impl Choices {
    fn of(text: &str) -> Self {
        let mut choices = Self { text: text.to_owned(), octaves: 0, contrast: 1.0, scroll: 0.0 };
        choices.octaves = choices.number("octaves").unwrap() as u32;
        choices.contrast = choices.number("contrast").unwrap_or(1.0);
        // The shutter is open for the first half of a frame.
        choices.scroll = choices.number("speed").unwrap() * (FRAME as f64 + 0.25) / 30.0;
        choices
    }

    /// What the scene assigns to a key.
    fn value(&self, key: &str) -> Option<&str> {
        let assigned = self.text.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(" = "))?;
        Some(assigned.split('#').next().unwrap_or(assigned).trim())
    }

    fn number(&self, key: &str) -> Option<f64> {
        self.value(key)?.parse().ok()
    }

    fn curve(&self, key: &str) -> Curve {
        let text = self.value(key).unwrap_or_else(|| panic!("no {key}"));
        let numbers: Vec<f64> = text.split(['[', ']', ',', ' ']).filter_map(|word| word.parse().ok()).collect();
        Curve::new(numbers.chunks_exact(2).map(|point| [point[0], point[1]]).collect(), Interpolation::Monotone)
            .unwrap()
    }

    /// Color over T2, eq. (7), as the encoded values that the paper's display is given.
    fn color(&self) -> impl Fn(f64) -> [f64; 3] + use<> {
        let curves = ["red", "green", "blue"].map(|key| self.curve(key));
        move |t2| [0, 1, 2].map(|k| curves[k].eval(t2))
    }
}

/// Eq. (20), halved so that its values are those of (2).
fn texture_20(x: f64, y: f64, octaves: u32) -> f64 {
    let (mut sum, mut weights) = (0.0, 0.0);
    for i in 0..octaves as i32 {
        let (fx, fy, c) = (16.0 * 2.0_f64.powi(i), 26.0 * 2.0_f64.powi(i), 0.707_f64.powi(i));
        let px = PI / 2.0 * (fy * y / 2.0).sin();
        let py = PI / 2.0 * (fx * x / 2.0).sin();
        sum += c * c * ((fx * x + px).cos() * (fy * y + py).cos() + 1.0);
        weights += c * c;
    }
    sum / weights / 2.0
}

/// The stages T0, T1 and T2 at (u, w): eqs. (1) to (6).
fn stages(choices: &Choices) -> impl Fn(f64, f64) -> [f64; 3] + '_ {
    let [v, h, c] = ["threshold", "threshold_across", "sharpen"].map(|key| choices.curve(key));
    move |u, w| {
        let (p, q) = (u, w - choices.scroll);
        let t0 = 1.0 - choices.contrast * (1.0 - texture_20(p, q, choices.octaves));
        let l = 1.0 - (1.0 - v.eval(w)) * (1.0 - h.eval((2.0 * u - 1.0).abs()));
        let t1 = if t0 > l { t0 - l } else { 0.0 };
        [t0, t1, c.eval(t1)]
    }
}

/// The mapping from (x, y) to (u, w), eqs. (9) to (18), where P is 1 everywhere; `None` outside the flame.
fn mapping(choices: &Choices) -> impl Fn(f64, f64) -> Option<[f64; 2]> + use<> {
    let [a, d, slowing] = ["core_width", "fringe_width", "slowing"].map(|key| choices.curve(key));
    let [k, h] = ["initial_speed", "edge_speed"].map(|key| choices.number(key).unwrap());
    move |x, y| {
        let w_p = (1.0 - k) * y.sqrt() + k * y;
        let distance = 2.0 * (x - 0.5).abs();
        let (core, fringe) = (a.eval(w_p), d.eval(w_p));
        let speed = if distance <= core {
            1.0
        } else if distance <= core + fringe {
            h + (1.0 - h) * (1.0 - slowing.eval((distance - core) / fringe))
        } else {
            h
        };
        let w = w_p / speed;
        let (right, offset) = (x >= 0.5, if x >= 0.5 { 2.0 * x - 1.0 } else { 1.0 - 2.0 * x });
        let edge = a.eval(w) + d.eval(w);
        (w <= 1.0 && offset < edge).then(|| {
            let across = offset / edge;
            [if right { (1.0 + across) / 2.0 } else { (1.0 - across) / 2.0 }, w]
        })
    }
}

/// (x, y) of the unit square at the center of a pixel, for a camera 5 m before the middle of a sheet 1 m high.
fn unit_square(choices: &Choices, pixel: usize) -> [f64; 2] {
    let half = 5.0 * (choices.number("vertical_fov_deg").unwrap().to_radians() / 2.0).tan();
    let at = |index: usize| half * (2.0 * (index as f64 + 0.5) / SIZE as f64 - 1.0);
    let [right, down] = [pixel % SIZE, pixel / SIZE].map(at);
    [right / choices.number("width").unwrap() + 0.5, 0.5 - down]
}

/// Factor of the brightest color's luminance, 1000 cd/m^2, to display white.
fn exposure(choices: &Choices) -> f64 {
    choices.number("luminance").unwrap() / white_luminance(choices.number("exposure_ev100").unwrap_or(9.7))
}

/// Encoded color of a rendered pixel as the paper's display is given it: the library scales colors so that the brightest has luminance 1.
fn encoded(choices: &Choices) -> impl Fn([f64; 3]) -> [f64; 3] + use<> {
    let color = choices.color();
    let luminance = |[r, g, b]: [f64; 3]| 0.212_639 * r + 0.715_169 * g + 0.072_192 * b;
    let brightest = (0..=256).map(|i| luminance(color(f64::from(i) / 256.0).map(decode))).fold(0.0, f64::max);
    let scale = exposure(choices) / brightest;
    move |pixel| pixel.map(|value| encode((value / scale).max(0.0)))
}

/// Largest difference of a picture from the formulas of its stage, steps of 255.
fn steps_from_formulas(picture: u32, stage: usize) -> f64 {
    let choices = Choices::of(&scene_text(picture));
    let (formulas, scale) = (stages(&choices), exposure(&choices));
    let frame = &render(&choices.text, [SIZE; 2], &[FRAME])[0];
    let (mut worst, mut lit) = (0.0_f64, 0);
    for (index, pixel) in linear(frame).into_iter().enumerate() {
        let [u, w] = unit_square(&choices, index);
        let wanted = formulas(u, w)[stage];
        worst = pixel.iter().fold(worst, |worst, value| worst.max((value / scale - wanted).abs()));
        lit += usize::from(wanted > 0.1);
    }
    assert!(worst < STEP && lit > SIZE * SIZE / 4, "picture {picture}: {:.3} steps apart, {lit} lit", worst / STEP);
    worst / STEP
}

#[test]
fn the_stages_are_the_papers_formulas_within_one_step_of_255() {
    let [first, second, third] = [(1, 0), (2, 1), (3, 2)].map(|(picture, stage)| steps_from_formulas(picture, stage));
    assert_measured!("equation (2) & equation (3) & equation (20) & picture 1: steps of 255", first, 0.03, 0.005);
    assert_measured!("equation (5) & picture 2: steps of 255", second, 0.03, 0.005);
    assert_measured!("equation (6) & picture 3: steps of 255", third, 0.15, 0.005);
    let speed = Choices::of(&scene_text(1)).number("speed").unwrap();
    assert_measured!("figure 1: heights a second", speed, 0.5, 0.0);
}

#[test]
fn the_colored_stage_is_equation_7_within_one_step_of_255() {
    let choices = Choices::of(&scene_text(4));
    let (formulas, color, encoded) = (stages(&choices), choices.color(), encoded(&choices));
    let frame = &render(&choices.text, [SIZE; 2], &[FRAME])[0];
    let mut worst = 0.0_f64;
    for (index, pixel) in linear(frame).into_iter().enumerate() {
        let [u, w] = unit_square(&choices, index);
        let wanted = color(formulas(u, w)[2]);
        worst =
            encoded(pixel).iter().zip(wanted).fold(worst, |worst, (value, wanted)| worst.max((value - wanted).abs()));
    }
    assert!(worst < STEP, "{:.3} steps", worst / STEP);
    assert_measured!("equation (7) & picture 4: steps of 255", worst / STEP, 0.71, 0.005);
}

#[test]
fn the_finished_flame_is_mapped_by_equations_9_to_18() {
    // P is random; without its flutter it is 1, and the edge (15) is A + D.
    for (picture, stated_steps) in [(5, 0.88), (6, 0.7), (7, 1.8), (8, 0.4)] {
        let choices = Choices::of(&scene_text(picture));
        let flutter = format!("flutter = {}", choices.value("flutter").unwrap());
        let text = choices
            .text
            .replace(&flutter, "flutter = 0.0")
            .replace("height = 1.0\n", "height = 1.0\ntime_samples = 1\n");
        let (formulas, color, encoded) = (stages(&choices), choices.color(), encoded(&choices));
        let map = mapping(&choices);
        let frame = &render(&text, [SIZE; 2], &[FRAME])[0];
        let (mut apart, mut outside) = (Vec::new(), 0);
        for (index, pixel) in linear(frame).into_iter().enumerate() {
            let [x, y] = unit_square(&choices, index);
            // A pixel that the outline crosses is antialiased, which the paper leaves open.
            let margin = 1.5 / SIZE as f64;
            let around = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]]
                .map(|[dx, dy]| (y + dy * margin > 0.0).then(|| map(x + 1.3 * dx * margin, y + dy * margin)).flatten());
            if around.iter().all(Option::is_none) {
                outside += usize::from((y < 0.0 || map(x, y).is_none()) && pixel != [0.0; 3]);
            } else if let (Some([u, w]), true) = (map(x, y.max(0.0)), around.iter().all(Option::is_some)) {
                let wanted = color(formulas(u, w)[2]);
                let difference = encoded(pixel).iter().zip(wanted).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                apart.push(difference / STEP);
            }
        }
        apart.sort_by(f64::total_cmp);
        let (within, count) = (apart.iter().filter(|steps| **steps < 1.0).count(), apart.len());
        let share = within as f64 / count as f64;
        assert!(count > 5000 && share > 0.99 && outside == 0, "picture {picture}: {share}, worst {}", apart[count - 1]);
        assert_measured!(format!("picture {picture}, steps of 255"), apart[count - 1], stated_steps, 0.05);
        if picture == 5 {
            assert_measured!("equation (16): steps of 255", apart[count - 1], 0.88, 0.05);
        }
    }
}

/// Statistics of a flame as `bansho plot flame-statistics` draws it, without its options: 24 frames, 128 pixels high.
fn judged(text: &str) -> FlameStatistics {
    let compiled = compiled(&folder(), text);
    let plan = Plan::new(&compiled, &PlanOptions::default()).unwrap();
    FlameStatistics::of_film(&draw_film(compiled, &plan, 24, 128, &Unobserved).unwrap()).unwrap()
}

/// Asserts that the statistics are those that the page states: height, body, pieces, redness of edges, width of the base, pale part, lit area.
fn assert_statistics(flame: &str, found: &FlameStatistics, stated: [f64; 7]) {
    let names = ["height", "body", "pieces", "edge redness", "base width", "pale", "area"];
    let found = [found.height, found.body, found.pieces, found.edge_redness, found.base_width, found.pale, found.area];
    for ((name, found), stated) in names.into_iter().zip(found).zip(stated) {
        // As many digits as are stated.
        let tolerance = if name == "pieces" { 0.05 } else { 0.005 };
        assert_measured!(format!("{flame}, {name}"), found, stated, tolerance + 1e-9);
    }
}

#[test]
fn the_four_flames_are_judged_to_be_flames_and_to_differ() {
    let judgments = [5, 6, 7, 8].map(|picture| judged(&scene_text(picture)));
    for (picture, flame) in (5..).zip(&judgments) {
        assert!(flame.body > 0.9, "picture {picture}: the body is closed at the base: {flame:?}");
        assert!(flame.edge_redness < 0.7, "picture {picture}: red edges, yellow core: {flame:?}");
        assert!(flame.base_width < 0.75, "picture {picture}: the base is not cut off: {flame:?}");
        assert!(flame.pale < 0.35, "picture {picture}: orange rather than cream: {flame:?}");
        assert!((0.5..0.95).contains(&flame.height), "picture {picture}: {flame:?}");
    }
    // Height, body, pieces, redness of edges, width of the base, pale part, lit area.
    let stated = [
        [0.79, 0.97, 5.2, 0.34, 0.15, 0.12, 0.21],
        [0.81, 0.97, 3.6, 0.41, 0.33, 0.14, 0.14],
        [0.73, 0.93, 7.6, 0.40, 0.32, 0.08, 0.19],
        [0.84, 1.00, 1.6, 0.28, 0.16, 0.26, 0.15],
    ];
    for ((picture, flame), stated) in (5..).zip(&judgments).zip(stated) {
        assert_statistics(&format!("picture {picture}"), flame, stated);
    }
    // What the rows of the pictures state of these.
    assert_measured!("picture 5: pieces", judgments[0].pieces, 5.2, 0.0501);
    assert_measured!("picture 5: lit area", judgments[0].area, 0.21, 0.0051);
    assert_measured!("picture 5: body", judgments[0].body, 0.97, 0.0051);
    assert_measured!("picture 6: pieces", judgments[1].pieces, 3.6, 0.0501);
    assert_measured!("picture 6: lit area", judgments[1].area, 0.14, 0.0051);
    assert_measured!("picture 6: body", judgments[1].body, 0.97, 0.0051);
    assert_measured!("picture 7: pieces", judgments[2].pieces, 7.6, 0.0501);
    assert_measured!("picture 7: lit area", judgments[2].area, 0.19, 0.0051);
    assert_measured!("picture 7: body", judgments[2].body, 0.93, 0.0051);
    assert_measured!("picture 8: pieces", judgments[3].pieces, 1.6, 0.0501);
    assert_measured!("picture 8: lit area", judgments[3].area, 0.15, 0.0051);
    assert_measured!("picture 8: body", judgments[3].body, 1.0, 0.0051);
    let palest = judgments.iter().map(|flame| flame.pale).fold(0.0, f64::max);
    assert_measured!("future work: a way to judge: pale part of the paper's flames", palest, 0.26, 0.0051);
    let [broad, tall, ragged, calm] = judgments;
    assert!([broad, tall, ragged].iter().all(|flame| flame.pieces > 1.5), "tongues break off");
    assert!(ragged.pieces > 1.3 * broad.pieces && calm.pieces < 0.7 * tall.pieces);
    assert!(broad.area > 1.4 * tall.area && ragged.height < 0.95 * broad.height.max(tall.height));
}

#[test]
fn a_flame_that_is_cut_off_pale_and_full_of_holes_is_judged_so() {
    // The widths do not narrow at the base, the threshold is high there, and the sharpening is saturated.
    let replaced = [
        ("core_width", "[[0.0, 0.5], [1.0, 0.5]]"),
        ("fringe_width", "[[0.0, 0.0], [1.0, 0.1]]"),
        ("threshold", "[[0.0, 0.42], [1.0, 0.5]]"),
        ("threshold_across", "[[0.0, 0.0], [1.0, 0.0]]"),
        ("sharpen", "[[0.0, 0.0], [0.02, 1.0], [1.0, 1.0]]"),
    ];
    let mut text = scene_text(5);
    for (key, value) in replaced {
        let line = text.lines().find(|line| line.starts_with(&format!("{key} = "))).unwrap().to_owned();
        text = text.replace(&line, &format!("{key} = {value}"));
    }
    let flame = judged(&text);
    assert!(flame.base_width > 0.75 && flame.body < 0.9 && flame.pale > 0.5, "{flame:?}");
    assert_measured!("future work: a way to judge: pale part of a bad flame", flame.pale, 0.95, 0.0051);
    assert_statistics("a bad flame", &flame, [0.93, 0.70, 5.2, 0.93, 0.89, 0.95, 0.28]);
}

/// Section 3.1: T is a table of values, the gray levels of a file. What is drawn of the texture is what the file has, whatever its format.
#[test]
fn a_png_and_an_exr_file_of_the_texture_are_the_texture() {
    const SIDE: [usize; 2] = [256; 2];
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("texture_files");
    std::fs::create_dir_all(&folder).unwrap();
    // At the first moment the texture has not scrolled.
    let text = scene_text(1).replacen("glare = 0.0", "glare = 0.0\nshutter_s = 0.0", 1);
    let formula = render(&text, SIDE, &[0]).remove(0);
    let codes = bansho::display(&formula, &View::RAW, BitDepth::Eight, AlphaConvention::Encoded);
    let files = [("png", "texture.png"), ("exr", "texture.exr")];
    let bytes = [
        png::encode(&codes, &[0; 32], PngEffort::Small, &folder.join(files[0].1)).unwrap(),
        exr::encode(&formula, &folder.join(files[1].1)).unwrap(),
    ];
    let drawn = [0, 1].map(|index| {
        let (_, name) = files[index];
        std::fs::write(folder.join(name), &bytes[index]).unwrap();
        let kind = "kind = \"ohshima_itahashi_exact\"";
        let of_file = text.replacen(kind, &format!("kind = \"picture\"\nfile = \"{name}\""), 1);
        assert_ne!(of_file, text);
        linear(&render_in(&folder, &of_file, SIDE, &[0]).remove(0))
    });
    let formula = linear(&formula);
    // The file repeats at its borders, where the texture does not.
    let is_inside = |index: &usize| [index % SIDE[0], index / SIDE[0]].iter().all(|at| (3..SIDE[0] - 3).contains(at));
    let largest = |a: &[[f64; 3]], b: &[[f64; 3]]| {
        (0..a.len()).filter(is_inside).map(|at| (a[at][1] - b[at][1]).abs()).fold(0.0, f64::max)
    };
    // Half a code of the PNG file; the table that is looked up interpolates.
    let [of_png, of_exr] = drawn.each_ref().map(|drawn| largest(drawn, &formula));
    assert!(of_png < 0.02 && of_exr < 0.02, "{of_png} {of_exr}");
    let apart = largest(&drawn[0], &drawn[1]);
    assert!(apart < 0.6 * STEP, "{apart}");
    let range = formula.iter().fold([f64::INFINITY, 0.0], |[low, high], [_, g, _]| [g.min(low), g.max(high)]);
    assert!(range[0] < 0.1 && range[1] > 0.8, "{range:?}");
}

/// A scene of the paper's future work.
fn future_work(name: &str) -> String {
    std::fs::read_to_string(folder().join(format!("ohshima_{name}.toml"))).unwrap()
}

#[test]
fn sparks_and_smoke_are_shown_together_with_the_flame() {
    let text = future_work("sparks_and_smoke");
    let [all, no_sparks, no_smoke] = ["", "rate = 40.0", "optical_depth = 2.0"].map(|removed| {
        let none = format!("{} = 0.0", removed.split(' ').next().unwrap());
        render(&if removed.is_empty() { text.clone() } else { text.replacen(removed, &none, 1) }, [256, 384], &[75])
            .remove(0)
    });
    // Above the flame, in the upper half of the picture, smoke covers the background and sparks add light.
    let upper = 256 * 192;
    let sparks = (0..upper).filter(|i| all.beauty.pixels()[*i][0] > no_sparks.beauty.pixels()[*i][0] + 0.05).count();
    let cover = |frame: &Frame| frame.beauty.pixels()[..upper].iter().map(|pixel| f64::from(pixel[3])).sum::<f64>();
    let (smoky, clear) = (cover(&all) / upper as f64, cover(&no_smoke) / upper as f64);
    assert!((20..2000).contains(&sparks), "{sparks} pixels of sparks");
    assert!(smoky > 0.15 && clear < 0.02, "{smoky} {clear}");
    assert_measured!("future work: sparks: pixels", sparks as f64, 83.0, 0.0);
    assert_measured!("future work: smoke: cover, %", 100.0 * smoky, 19.0, 0.5);
    assert_measured!("future work: smoke: cover without smoke, %", 100.0 * clear, 0.0, 0.5);
    let lit = |frame: &Frame| frame.beauty.pixels()[upper..].iter().filter(|pixel| pixel[0] > 0.3).count();
    assert!(lit(&all) > 4000, "the flame stays: {}", lit(&all));
}

#[test]
fn flames_stand_in_a_3d_scene() {
    let text = future_work("in_3d");
    let frames = render(&text, [256, 144], &[0, 239]);
    for frame in &frames {
        let depth = frame.depth.as_ref().unwrap();
        let lit = |i: &usize| frame.beauty.pixels()[*i][0] > 0.5 && depth[*i].is_finite();
        let depths: Vec<f32> = (0..depth.len()).filter(lit).map(|i| depth[i]).collect();
        let (near, far) = depths.iter().fold((f32::INFINITY, 0.0_f32), |(a, b), d| (a.min(*d), b.max(*d)));
        assert!((4.6..5.0).contains(&near) && (6.6..7.1).contains(&far), "{near} m to {far} m");
        assert_measured!("future work: flames in 3-D scenes: nearest, m", f64::from(near), 4.8, 0.05);
        assert_measured!("future work: flames in 3-D scenes: farthest, m", f64::from(far), 6.9, 0.05);
    }
    // The ground is lit by the flames: without them the picture is dark.
    let light = |frame: &Frame| frame.beauty.pixels().iter().map(|p| f64::from(p[1])).filter(|g| *g < 0.2).sum::<f64>();
    let dark = render(&text.replacen("luminance = 1000.0", "luminance = 0.0", 1), [256, 144], &[0]);
    assert!(light(&frames[0]) > 50.0 && light(&dark[0]) < 1.0, "{} {}", light(&frames[0]), light(&dark[0]));
}
