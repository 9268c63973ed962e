//! The figures of Inagaki et al. by the paper's own gas: `scenes/papers/inagaki`. `docs/src/papers/inagaki.md` states the numbers.

use std::{path::PathBuf, sync::Arc};

use bansho::{
    CompiledScene, Plan, PlanOptions, Shot, Unobserved,
    base::{assert_measured, color, frame::Frame, geometry::point_cloud::Quantity, math},
    media::assets::FileAssets,
};

const SMALL: [usize; 2] = [320, 180];
/// Pixels of the scenes per pixel of [`SMALL`].
const SCALE: f64 = 4.0;

fn scenes() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../scenes")
}

fn text(scene: &str) -> String {
    std::fs::read_to_string(scenes().join(scene)).unwrap_or_else(|error| panic!("{scene}: {error}"))
}

/// A shot of a scene in the folder of scenes.
fn shot(scene: &str, text: &str, size: [usize; 2], aovs: bool) -> Shot {
    let folder = scenes().join(scene).parent().map(PathBuf::from).unwrap_or_default();
    let parsed = Arc::new(bansho::parse_scene(scene, text).unwrap_or_else(|error| panic!("{error}")));
    let compiled = CompiledScene::build(parsed, Arc::new(FileAssets::new(folder)), None);
    let compiled = Arc::new(compiled.unwrap_or_else(|errors| panic!("{errors}")));
    let plan = Plan::new(&compiled, &PlanOptions { size: Some(size), aovs, ..PlanOptions::default() }).unwrap();
    Shot::open(compiled, Arc::new(plan))
}

fn figure(number: &str) -> String {
    format!("papers/inagaki/inagaki_figure_{number}.toml")
}

fn frames(scene: &str, numbers: &[i64], aovs: bool) -> Vec<Frame> {
    let mut shot = shot(scene, &text(scene), SMALL, aovs);
    numbers.iter().map(|number| bansho::draw(&mut shot, *number, &Unobserved).unwrap()).collect()
}

fn light(frame: &Frame) -> Vec<f64> {
    frame.beauty.pixels().iter().map(|[r, g, b, _]| f64::from(color::luminance([*r, *g, *b]))).collect()
}

#[test]
fn three_thousand_particles_are_densest_at_the_burner_in_every_frame() {
    const BINS: usize = 10;
    let scene = figure("7");
    let mut shot = shot(&scene, &text(&scene), SMALL, false);
    let mut smallest_ratio = f64::INFINITY;
    let mut dense_frames = 0;
    for number in 0..240 {
        shot.advance(number, &Unobserved).unwrap();
        let gas = shot.particles();
        assert_eq!(gas.positions.len(), 3000, "frame {number}");
        let densities = &gas.quantities[&Quantity::Density];
        let top = gas.positions.iter().map(|[_, y, _]| f64::from(*y)).fold(0.0, f64::max);
        let (mut sums, mut counts) = ([0.0; BINS], [0.0; BINS]);
        for ([_, y, _], density) in gas.positions.iter().zip(densities) {
            let bin = ((f64::from(*y) / top * BINS as f64).max(0.0) as usize).min(BINS - 1);
            sums[bin] += f64::from(*density);
            counts[bin] += 1.0;
        }
        let means: Vec<f64> = sums.iter().zip(counts).map(|(sum, count)| sum / f64::max(count, 1.0)).collect();
        let others = means[1..].iter().copied().fold(0.0, f64::max);
        smallest_ratio = smallest_ratio.min(means[0] / others);
        assert!(means[0] > others, "frame {number}: {means:?} kg/m^3");
        dense_frames += 1;
        // It spreads all the way up.
        assert!(means[0] > 5.0 * means[BINS - 1], "frame {number}: {means:?} kg/m^3");
        if number == 40 {
            assert_measured!("figure 7: density of the lowest tenth, kg/m^3", means[0], 0.145, 0.005);
            assert_measured!("figure 7: density of the tenth above it, kg/m^3", means[1], 0.106, 0.005);
        }
    }
    assert_measured!("figure 7 & section 6.2: frames", f64::from(dense_frames), 240.0, 0.0);
    let particles = shot.particles().positions.len() as f64;
    assert_measured!("figure 8 & section 6.2: particles", particles, 3000.0, 0.0);
    assert!(smallest_ratio > 1.15, "{smallest_ratio}");
}

/// Center of the light of the upper half of the flame, pixels from the left at full size, mean of some frames.
fn center_of_upper_half(number: &str) -> f64 {
    let numbers = [30, 70, 110, 150];
    let background = light(&frames(&figure("5"), &[0], false)[0]);
    let [mut sum, mut weighted] = [0.0; 2];
    for frame in frames(&figure(number), &numbers, false) {
        for (index, (with, without)) in light(&frame).iter().zip(&background).enumerate() {
            // The flame reaches from row 115 of 180 up to row 10.
            if index / SMALL[0] < 63 {
                let light = (with - without).max(0.0);
                sum += light;
                weighted += light * ((index % SMALL[0]) as f64 + 0.5) * SCALE;
            }
        }
    }
    weighted / sum
}

#[test]
fn wind_to_the_left_and_to_the_right_moves_the_light_to_that_side() {
    let [still, left, right] = ["8", "9", "10"].map(center_of_upper_half);
    let [to_the_left, to_the_right] = [still - left, right - still];
    assert!(
        (to_the_left - 190.0).abs() < 15.0 && (to_the_right - 221.0).abs() < 15.0,
        "{to_the_left} {to_the_right} from {still}"
    );
    assert_measured!("figure 9: light of the upper half to the left, pixels", to_the_left, 190.0, 0.5);
    assert_measured!("figure 10: light of the upper half to the right, pixels", to_the_right, 221.4, 0.5);
}

/// Largest and mean displacement of what is far behind the gas, pixels at full size: mean of the pixels that are displaced at all.
fn displacement(number: &str) -> [f64; 2] {
    let scene = figure(number);
    let mut shot = shot(&scene, &text(&scene), SMALL, true);
    let frame = bansho::draw(&mut shot, 40, &Unobserved).unwrap();
    let channel = |name: &str| &frame.channels.iter().find(|channel| channel.name == name).unwrap().values;
    // 42 degrees are 720 pixels.
    let focal = 360.0 / math::tan(21.0_f64.to_radians());
    let pixels: Vec<f64> = channel("flame.deflection.X")
        .iter()
        .zip(channel("flame.deflection.Y"))
        .map(|(x, y)| math::hypot(f64::from(*x), f64::from(*y)) * focal)
        .filter(|pixels| *pixels > 0.0)
        .collect();
    let largest = pixels.iter().copied().fold(0.0, f64::max);
    [largest, pixels.iter().sum::<f64>() / pixels.len().max(1) as f64]
}

#[test]
fn haze_displaces_tens_of_pixels_when_exaggerated_and_two_by_physics() {
    let [strong, physical, none] = ["6", "6_physical", "5"].map(displacement);
    assert!((strong[0] - 38.2).abs() < 2.0 && (strong[1] - 2.45).abs() < 0.2, "{strong:?}");
    assert!((physical[0] - 1.9).abs() < 0.2 && (physical[1] - 0.34).abs() < 0.04, "{physical:?}");
    assert_measured!("figure 5: displacement, pixels", none[0], 0.0, 0.0);
    assert_measured!("figure 4 & figure 6: largest displacement, pixels", strong[0], 38.5, 0.05);
    assert_measured!("figure 6: mean displacement, pixels", strong[1], 2.5, 0.06);
    assert_measured!("figure 6: largest displacement by physics, pixels", physical[0], 1.9, 0.05);
    assert_measured!("figure 6: mean displacement by physics, pixels", physical[1], 0.3, 0.05);
    // 42 degrees are 720 pixels.
    let focal = 360.0 / math::tan(21.0_f64.to_radians());
    assert_measured!("figure 4: largest deflection, rad", strong[0] / focal, 0.041, 5e-4);
    let [without, with] = ["5", "6"].map(|number| frames(&figure(number), &[40], false).remove(0));
    let changed = light(&with).iter().zip(light(&without)).map(|(a, b)| (a - b).abs() > 0.02).collect::<Vec<_>>();
    let columns = |range: std::ops::Range<usize>| {
        changed.iter().enumerate().filter(|(index, is)| **is && range.contains(&(index % SMALL[0]))).count()
    };
    assert!(columns(100..220) > 300, "{}", columns(100..220));
    assert_eq!((columns(0..60), columns(280..320)), (0, 0));
}

/// The brightest light that the flame adds to its uppermost tenth; 1 is display white.
fn light_at_the_top(scene: &str) -> f64 {
    let still = text(scene).replace("heat_haze_gain = 60.0", "heat_haze_gain = 0.0");
    let dark = still.replacen("opacity = 0.0007", "opacity = 0.0", 1);
    assert_ne!(dark, still, "{scene}");
    let drawn =
        |text: &str, frame| light(&bansho::draw(&mut shot(scene, text, SMALL, false), frame, &Unobserved).unwrap());
    let (with, without) = (drawn(&still, 40), drawn(&dark, 0));
    let added: Vec<f64> = with.iter().zip(without).map(|(with, without)| with - without).collect();
    let rows: Vec<f64> = added.chunks(SMALL[0]).map(|row| row.iter().copied().fold(0.0, f64::max)).collect();
    let is_lit = |light: &f64| *light > 0.002;
    let top = rows.iter().position(is_lit).unwrap();
    let base = rows.iter().rposition(is_lit).unwrap();
    rows[top..top + (base - top) / 10].iter().copied().fold(0.0, f64::max)
}

/// With the former opacity, 0.002, the light is 2.9 times as bright, and the flame ends in an edge.
#[test]
fn the_flames_fade_before_their_oldest_particles_are_removed() {
    assert_measured!("light at the top of figure 8", light_at_the_top(&figure("8")), 0.041, 0.003);
    assert_measured!("light at the top of figure 9", light_at_the_top(&figure("9")), 0.039, 0.003);
    assert_measured!("light at the top of figure 10", light_at_the_top(&figure("10")), 0.021, 0.003);
    assert_measured!("light at the top of inagaki_paper", light_at_the_top("inagaki_paper.toml"), 0.040, 0.003);
}

#[test]
fn the_papers_flame_has_the_color_of_its_temperature() {
    let frame = frames("inagaki_paper.toml", &[40], false).remove(0);
    let sum = frame
        .beauty
        .pixels()
        .iter()
        .fold([0.0; 3], |sum: [f64; 3], pixel| std::array::from_fn(|c| sum[c] + f64::from(pixel[c])));
    let expected = color::black_body().radiance(1900.0);
    let [x, y] = chromaticity(sum.map(|value| value as f32));
    let [expected_x, expected_y] = chromaticity(expected);
    assert!((x - expected_x).abs() < 1e-3 && (y - expected_y).abs() < 1e-3);
    // Planck at 1900 K with the CIE 1931 observer, computed independently.
    assert!((x - 0.537_777).abs() < 1e-3 && (y - 0.411_202).abs() < 1e-3, "{x} {y}");
    assert_measured!("equation (13) & equation (14): x at 1900 K", x, 0.5378, 0.001);
    assert_measured!("equation (13) & equation (15): y at 1900 K", y, 0.4112, 0.001);
    assert_measured!("equation (16): z at 1900 K", 1.0 - x - y, 0.0510, 0.002);
}

/// CIE x and y of an ACEScg color.
fn chromaticity(acescg: [f32; 3]) -> [f64; 2] {
    let [red, green, blue] = color::srgb_from_acescg(acescg).map(f64::from);
    let x = 0.412_456_4 * red + 0.357_576_1 * green + 0.180_437_5 * blue;
    let y = 0.212_672_9 * red + 0.715_152_2 * green + 0.072_175_0 * blue;
    let z = 0.019_333_9 * red + 0.119_192_0 * green + 0.950_304_1 * blue;
    [x / (x + y + z), y / (x + y + z)]
}
