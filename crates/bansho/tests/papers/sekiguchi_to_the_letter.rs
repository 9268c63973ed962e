//! The literal scenes of the thesis (`scenes/papers/sekiguchi`): their shapes, gaps, maps and errors.

use std::{fs, path::Path, sync::Arc};

use bansho::KINDS;
use bansho_aurora::{
    AuroraParameters, RelocationParameters,
    shapes::{FRAME_S, Sequence, Sheet},
};
use bansho_base::{
    assert_measured,
    color::srgb_from_acescg,
    frame::Frame,
    host::{assets::MemoryAssets, observer::Unobserved},
    math::DVec2,
    parameters::{Parameters, Reader},
};
use bansho_render::{PlanOptions, Shot};
use bansho_scene::Scene;

use crate::planned::Planned;

/// The text of a literal scene.
fn text(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/papers/sekiguchi").join(name);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn sequence(text: &str) -> Sequence {
    let scene = Scene::parse("test.toml", text, KINDS).unwrap_or_else(|error| panic!("{error}"));
    let aurora = AuroraParameters::read_table(&scene.instances[0].parameters.canonical(), &mut Reader::new(), &[]);
    Sequence::new(&aurora.shapes, &aurora.morphing, aurora.extent_km, &MemoryAssets::default(), None).unwrap()
}

fn scene(number: usize) -> Sequence {
    sequence(&text(&format!("sekiguchi_paper_{number}.toml")))
}

#[test]
fn the_literal_scenes_have_the_sheets_and_frames_of_the_thesis_and_do_not_cross() {
    let sheets = |number: usize| {
        let sequence = scene(number);
        assert_eq!(sequence.crossing(), None, "scene {number}");
        let frames = (sequence.duration() / FRAME_S).round() as usize;
        let sheets = sequence.arrivals().iter().map(|&time| sequence.at(time).sheets.len()).collect::<Vec<_>>();
        (frames, sheets)
    };
    let last = |number: usize| sheets(number).1.last().copied().unwrap_or_default() as f64;
    assert_measured!("figure 3.4: sheets at last", last(1), 1.0, 0.0);
    assert_measured!("figure 3.5: sheets at last", last(2), 2.0, 0.0);
    assert_measured!("figure 3.6: sheets at first", sheets(3).1[0] as f64, 3.0, 0.0);
    assert_measured!("figure 3.6: sheets at last", last(3), 2.0, 0.0);
    assert_measured!("figure 1.3 & figure 3.7: sheets after two splits", sheets(4).1[3] as f64, 3.0, 0.0);
    assert_measured!("figure 1.3 & figure 3.7: sheets at last", last(4), 2.0, 0.0);
    assert_measured!("figure 3.8: sheets at last", last(5), 6.0, 0.0);
    assert_eq!(sheets(1), (280, vec![1, 1, 1]));
    assert_eq!(sheets(2), (280, vec![1, 1, 2]));
    assert_eq!(sheets(3), (280, vec![3, 3, 2]));
    assert_eq!(sheets(4), (560, vec![1, 1, 1, 3, 2]));
    assert_eq!(sheets(5), (420, vec![6, 6, 6, 6]));
}

/// Distance between the end of one sheet and the start of another, km, and the smallest flux factor of both.
fn gap([first, second]: [&Sheet; 2]) -> [f64; 2] {
    let ends = [first.points[first.points.len() - 1], second.points[0]];
    let flux = first.flux.iter().chain(&second.flux).copied().fold(f64::INFINITY, f64::min);
    [ends[0].distance(ends[1]), flux]
}

/// Figures 2.4 to 2.7: both ends of the split segment leave its middle; the gap is as wide as they are apart, and no light bridges it.
#[test]
fn a_split_opens_from_nothing_frame_by_frame() {
    let sequence = scene(2);
    let widths: Vec<f64> = (141..=279)
        .map(|frame| {
            let time = f64::from(frame) * FRAME_S;
            assert!(sequence.bridges(time).is_empty(), "frame {frame}");
            let shape = sequence.at(time);
            let [width, flux] = gap([&shape.sheets[0], &shape.sheets[1]]);
            assert_eq!((shape.sheets.len(), flux), (2, 1.0), "frame {frame}");
            width
        })
        .collect();
    assert!(widths.windows(2).all(|pair| pair[1] > pair[0]), "{widths:?}");
    // Frames 141, 175, 210, 245 and 279, km: the ends are 112 km apart at last.
    assert_measured!("figure 2.6: gap at frame 141, km", widths[0], 0.0, 0.5);
    assert_measured!("figure 2.6: gap at frame 175, km", widths[34], 18.0, 0.5);
    assert_measured!("figure 2.6: gap at frame 210, km", widths[69], 56.0, 0.5);
    assert_measured!("figure 2.6: gap at frame 245, km", widths[104], 95.0, 0.5);
    assert_measured!("figure 2.6: gap at frame 279, km", widths[138], 112.0, 0.5);
    // Bansho's own scene bridges the same gap at first.
    let own = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/sekiguchi_2.toml")).unwrap();
    assert!(!self::sequence(&own).bridges(150.0 * FRAME_S).is_empty());
}

#[test]
fn a_merge_closes_at_its_last_frame_and_not_before() {
    let sequence = scene(3);
    let widths = [141, 210, 270, 279].map(|frame| {
        let time = f64::from(frame) * FRAME_S;
        assert!(sequence.bridges(time).is_empty());
        let shape = sequence.at(time);
        gap([&shape.sheets[1], &shape.sheets[2]])[0]
    });
    assert!(widths.windows(2).all(|pair| pair[1] < pair[0]) && widths[2] > 1.0, "{widths:?}");
    assert_measured!("figure 2.7: frame at which the gap closes", sequence.duration() / FRAME_S, 280.0, 1e-6);
    let merged = sequence.at(sequence.duration());
    assert_measured!("figure 2.7: sheets at last", merged.sheets.len() as f64, 2.0, 0.0);
}

/// A scene with few particles, drawn at a size: linear sRGB of each pixel, 1 is the white of the maps.
fn drawn(text: &str, size: usize, frame: i64) -> Vec<[f32; 3]> {
    let [frame] = drawn_frames(text, size, [frame]);
    frame
}

/// As [`drawn`], several frames.
fn drawn_frames<const N: usize>(text: &str, size: usize, frames: [i64; N]) -> [Vec<[f32; 3]>; N] {
    let mut shot = shot_with_few_particles(text, size);
    frames.map(|frame| drawn_frame(&mut shot, frame))
}

fn shot_with_few_particles(text: &str, size: usize) -> Shot {
    let text = text.replace("count = 120_000", "count = 20_000");
    let scene = Scene::parse("test.toml", &text, KINDS).unwrap_or_else(|error| panic!("{error}"));
    let options = PlanOptions { size: Some([size; 2]), ..PlanOptions::default() };
    Planned::new(scene, &options, Arc::new(MemoryAssets::default())).open()
}

fn drawn_frame(shot: &mut Shot, frame: i64) -> Vec<[f32; 3]> {
    let frame = bansho::draw(shot, frame, &Unobserved).unwrap();
    frame.beauty.pixels().iter().map(|[red, green, blue, _]| srgb_from_acescg([*red, *green, *blue])).collect()
}

/// A scene whose particles [`drawn`] leaves as they are.
fn with_all_particles(text: &str) -> String {
    text.replace("count = 120_000", "count = 120000")
}

fn is_red(pixel: &[f32; 3]) -> bool {
    pixel[0] > 0.4 && pixel[1] < 0.1 && pixel[2] < 0.1
}

fn is_blue(pixel: &[f32; 3]) -> bool {
    pixel[2] > 0.4 && pixel[0] < 0.1 && pixel[1] < 0.1
}

fn is_yellow(pixel: &[f32; 3]) -> bool {
    pixel[0] > 0.3 && pixel[1] > 0.3 && pixel[2] < 0.1
}

/// Fraction of the pixels.
fn fraction(pixels: &[[f32; 3]], is_counted: impl Fn(&[f32; 3]) -> bool) -> f64 {
    pixels.iter().filter(|pixel| is_counted(pixel)).count() as f64 / pixels.len() as f64
}

/// Figure 2.10: as many cells have particles as the band of L_thr about the shape covers.
#[test]
fn scattered_particles_cover_the_band_about_the_shape() {
    let pixels = drawn(&with_all_particles(&text("sekiguchi_figure_2_10.toml")), 256, 0);
    let covered = 1.0 - fraction(&pixels, is_blue);
    let sequence = sequence(&text("sekiguchi_figure_2_10.toml"));
    // The band is two cells wide; it touches three cells and more across, of which those with few particles look blue.
    let length = sequence.at(0.0).length() / (600.0 / 256.0);
    let across = covered * 256.0 * 256.0 / length;
    assert!((2.0..3.3).contains(&across), "{across}");
    assert_measured!("figure 2.10: width of the band, cells", across, 2.2, 0.05);
}

/// Figures 2.9 and 2.15: as many black points as control points, on segments of the length of the shape.
#[test]
fn the_shape_is_drawn_with_its_control_points() {
    let is_black = |pixel: &[f32; 3]| pixel.iter().all(|value| *value < 0.05);
    let pixels = drawn(&text("sekiguchi_figure_2_9.toml"), 512, 0);
    assert!(pixels[0].iter().all(|value| (*value - 1.0).abs() < 0.01), "white: {:?}", pixels[0]);
    let black = fraction(&pixels, is_black) * 512.0 * 512.0;
    // Without their soft edge of a pixel.
    let radius = 0.5 * 2.6 * 512.0 / 300.0 - 0.5;
    let expected = 32.0 * std::f64::consts::PI * radius * radius;
    assert!((black / expected - 1.0).abs() < 0.25, "{black} for {expected}");
    assert_measured!("figure 2.3 & figure 2.9: control points", pieces(&pixels, 512, is_black), 32.0, 0.0);
    let shapes = text("sekiguchi_figure_2_15.toml").replace("transition_frames = 140", "transition_frames = 5");
    for pixels in drawn_frames(&shapes, 512, [0, 5]) {
        assert_measured!("figure 2.15: control points", pieces(&pixels, 512, is_black), 32.0, 0.0);
    }
}

/// Number of connected pieces of a picture whose pixels count.
fn pieces(pixels: &[[f32; 3]], width: usize, is_counted: impl Fn(&[f32; 3]) -> bool) -> f64 {
    let mut unvisited: Vec<bool> = pixels.iter().map(is_counted).collect();
    let mut pieces = 0.0;
    while let Some(start) = unvisited.iter().position(|is_counted| *is_counted) {
        pieces += 1.0;
        let mut next = vec![start];
        while let Some(index) = next.pop() {
            if std::mem::take(&mut unvisited[index]) {
                next.extend([index + 1, index + width].into_iter().filter(|index| *index < pixels.len()));
                next.extend([1, width].iter().filter_map(|step| index.checked_sub(*step)));
            }
        }
    }
    pieces
}

/// Figure 2.12: the potential is lowest, blue, on the shape and highest, red, far from it. Figure 2.11: noise has all colors.
#[test]
fn the_potential_is_low_on_the_shape_and_the_noise_is_everywhere() {
    let potential = drawn(&with_all_particles(&text("sekiguchi_figure_2_12.toml")), 256, 0);
    let low = fraction(&potential, is_blue);
    assert!((0.005..0.1).contains(&low) && fraction(&potential, is_red) > 0.5, "{low}");
    assert_measured!("figure 2.12: in the lowest color, %", 100.0 * low, 1.3, 0.05);
    assert_measured!("figure 2.12: in the highest color, %", 100.0 * fraction(&potential, is_red), 89.0, 0.5);
    let noise = drawn(&text("sekiguchi_figure_2_11.toml"), 256, 0);
    let [low, high] = [fraction(&noise, is_blue), fraction(&noise, is_red)];
    assert!((0.005..0.2).contains(&low) && (0.005..0.2).contains(&high), "{low} {high}");
    assert_measured!("figure 2.11: in the lowest color, %", 100.0 * low, 1.9, 0.05);
    assert_measured!("figure 2.11: in the highest color, %", 100.0 * high, 1.8, 0.05);
}

/// Figure 3.14 and section 3.3: within the fold the potential is low enough to be near, but no particles were scattered there.
#[test]
fn the_potential_alone_takes_the_inside_of_the_fold_for_the_sheet() {
    let scene = text("sekiguchi_figure_3_14.toml").replace("stage = \"potential\"", "stage = \"near_cells\"");
    let scene = scene.replace("transition_frames = 140", "transition_frames = 5");
    let pixels = drawn(&scene, 256, 20);
    // (95, -213) km, in the black circle: 800 km are 256 pixels.
    let at = |east: f64, south: f64| {
        let pixel = |km: f64| ((km / 800.0 + 0.5) * 256.0) as usize;
        pixels[pixel(south) * 256 + pixel(east)]
    };
    assert!(is_yellow(&at(95.0, -213.0)), "{:?}", at(95.0, -213.0));
    assert!(is_red(&at(105.0, -156.0)), "{:?}", at(105.0, -156.0));
    assert!(is_blue(&at(0.0, 200.0)), "{:?}", at(0.0, 200.0));
    let near = fraction(&pixels, is_red);
    assert!((0.01..0.05).contains(&near) && fraction(&pixels, is_yellow) > 3.0 * near, "{near}");
    assert_measured!(
        "figure 3.14: cells that are near by the potential alone, %",
        100.0 * fraction(&pixels, is_yellow),
        21.0,
        0.5
    );
    assert_measured!("figure 3.14: cells that are near by both, %", 100.0 * near, 1.2, 0.05);
}

/// Figure 2.14: without relocation the particles stay behind at the beginning of the shape and leave its other half empty.
#[test]
fn relocation_keeps_the_particles_on_the_shape() {
    let shape = sequence(&text("sekiguchi_figure_2_15.toml")).at(140.0 * FRAME_S);
    // Control points of the second half of the shape around which no cell has particles: 600 km are 256 pixels.
    let empty = |pixels: &Vec<[f32; 3]>| {
        let is_empty = |point: &DVec2| {
            let [x, z] = [point.x, point.y].map(|km| ((km / 600.0 + 0.5) * 256.0) as usize);
            (z - 4..=z + 4).all(|row| (x - 4..=x + 4).all(|column| is_blue(&pixels[row * 256 + column])))
        };
        shape.sheets[0].points[16..].iter().filter(|point| is_empty(point)).count()
    };
    let mut shots = ["sekiguchi_figure_2_14_left.toml", "sekiguchi_figure_2_14_right.toml"]
        .map(|name| shot_with_few_particles(&text(name), 256));
    let count = |shot: &mut Shot, frame: i64| {
        shot.advance(frame, &Unobserved).unwrap();
        shot.particles().positions.len() as f64
    };
    let at_first = shots.each_mut().map(|shot| count(shot, 0));
    let frames = shots.each_mut().map(|shot| [140, 180].map(|frame| drawn_frame(shot, frame)));
    let at_last = shots.each_mut().map(|shot| count(shot, 180));
    let [remaining, relocated] = [0, 1].map(|scene| 100.0 * at_last[scene] / at_first[scene]);
    assert_measured!("figure 2.14: particles of frame 0 that remain without relocation, %", remaining, 100.0, 0.0);
    assert!(relocated > 110.0, "{relocated}");
    let [without, with] = frames.each_ref().map(|[first, _]| empty(first));
    assert!(without >= 8 && with <= 1, "{without} and {with} of 16 are empty");
    // With a sixth of the particles.
    let with_particles = |pixels: &Vec<[f32; 3]>| 100.0 * (1.0 - fraction(pixels, is_blue));
    let [without, with] = frames.each_ref().map(|[_, later]| with_particles(later));
    assert_measured!("figure 2.14: cells with particles without relocation, %", without, 0.34, 0.005);
    assert_measured!("figure 2.14: cells with particles with relocation, %", with, 0.63, 0.005);
}

/// Figure 2.1: the stages of the method follow from each other. Particles are scattered about the shape, their potential is low there, cells are near by both,
/// particles move to near cells, and their light is drawn.
#[test]
fn each_stage_of_the_method_follows_from_the_one_before() {
    const FRAME: i64 = 10;
    const CELLS: usize = 256;
    let scene = text("sekiguchi_paper_1.toml");
    let map = |stage: &str, is_counted: fn(&[f32; 3]) -> bool| -> Vec<bool> {
        let text = scene.replacen("preroll_s = 0.0", &format!("preroll_s = 0.0\nstage = \"{stage}\""), 1);
        drawn(&text, CELLS, FRAME).iter().map(is_counted).collect()
    };
    let scattered = map("scatter_count", |pixel| !is_blue(pixel));
    let near = map("near_cells", is_red);
    let low = map("near_cells", |pixel| is_red(pixel) || is_yellow(pixel));
    let occupied = map("particle_count", |pixel| !is_blue(pixel));
    let mut control_points = vec![false; CELLS * CELLS];
    for point in &sequence(&scene).at(FRAME as f64 * FRAME_S).sheets[0].points {
        let [x, z] = [point.x, point.y].map(|km| ((km / 800.0 + 0.5) * CELLS as f64) as usize);
        control_points[z * CELLS + x] = true;
    }
    // Part of the cells of `inner` that are cells of `outer`, or next to one, %.
    let within = |inner: &[bool], outer: &[bool]| {
        let around = |at: usize| at.saturating_sub(1)..=(at + 1).min(CELLS - 1);
        let has = |index: &usize| {
            let [x, y] = [index % CELLS, index / CELLS];
            around(y).any(|row| around(x).any(|column| outer[row * CELLS + column]))
        };
        let inner: Vec<usize> = (0..inner.len()).filter(|index| inner[*index]).collect();
        assert!(inner.len() > 25, "{}", inner.len());
        100.0 * inner.iter().filter(|index| has(index)).count() as f64 / inner.len() as f64
    };
    assert_measured!(
        "figure 2.1: control points among scattered particles, %",
        within(&control_points, &scattered),
        100.0,
        0.0
    );
    assert_measured!("figure 2.1: near cells among scattered particles, %", within(&near, &scattered), 100.0, 0.0);
    assert_measured!("figure 2.1: near cells of low potential, %", within(&near, &low), 100.0, 0.0);
    assert_measured!("figure 2.1: cells of particles at near cells, %", within(&occupied, &near), 99.0, 1.0);
    let light = drawn(&scene, 64, FRAME);
    assert!(light.iter().any(|[_, green, _]| *green > 0.01));
}

/// Tables 3.2 and 3.3, as all five scenes and the figures have them.
#[test]
fn the_literal_scenes_have_the_parameters_of_tables_3_2_and_3_3() {
    for number in 1..=5 {
        let text = text(&format!("sekiguchi_paper_{number}.toml"));
        let scene = Scene::parse("test.toml", &text, KINDS).unwrap_or_else(|error| panic!("{error}"));
        let aurora = AuroraParameters::read_table(&scene.instances[0].parameters.canonical(), &mut Reader::new(), &[]);
        assert_eq!(scene.picture.size.map(|side| side as usize), [1280, 720]);
        assert_measured!("table 3.2: cells along a side", aurora.field.cells as f64, 256.0, 0.0);
        assert_measured!("table 3.2: particles", aurora.particles.count as f64, 120_000.0, 0.0);
        // 100 collisions of 100 eV, 140 frames from shape to shape, and an in-between shape every 5 to 10 frames.
        assert_eq!(aurora.energy_ev.bounds(), [10_000.0; 2]);
        assert!(aurora.shapes[1..].iter().all(|shape| shape.transition_frames == Some(140.0)));
        assert!((5.0..=10.0).contains(&aurora.morphing.update_interval_frames));
        let RelocationParameters {
            potential_threshold,
            scatter_count_threshold,
            births_below,
            max_births,
            deaths_above,
            max_deaths,
            scale_counts,
            enabled,
        } = aurora.particles.relocation;
        let table = [potential_threshold, scatter_count_threshold, births_below, max_births, deaths_above, max_deaths];
        assert_eq!(table, [0.25, 0.10, 50.0, 10.0, 500.0, 100.0]);
        assert!(enabled && !scale_counts);
        assert_eq!((aurora.particles.lorentz_weight, aurora.particles.repulsion_weight), (0.6, 0.4));
    }
    assert_measured!("table 3.2: time step, s", FRAME_S, 0.0333, 5e-5);
    let fall = FALL_STEP_S * electron_speed_km_per_s(1e4);
    assert_measured!("table 3.2: way of an electron of 10 keV in a step of the fall, km", fall, 193.0, 0.5);
    assert_measured!("speed of an electron of 10 keV, km/s", electron_speed_km_per_s(1e4), 58_460.0, 5.0);
}

/// The small time step of table 3.2, s. The library takes the limit of short steps.
const FALL_STEP_S: f64 = 0.0033;

/// Speed of an electron with a kinetic energy in eV, by special relativity.
fn electron_speed_km_per_s(energy_ev: f64) -> f64 {
    const REST_ENERGY_EV: f64 = 510_998.95;
    const LIGHT_KM_PER_S: f64 = 299_792.458;
    let gamma = 1.0 + energy_ev / REST_ENERGY_EV;
    LIGHT_KM_PER_S * (1.0 - 1.0 / (gamma * gamma)).sqrt()
}

/// Number of particles of a scene at frames, in thousands.
fn thousands<const N: usize>(text: &str, frames: [i64; N]) -> [f64; N] {
    let mut shot = shot_with_few_particles(&with_all_particles(text), 64);
    frames.map(|frame| {
        shot.advance(frame, &Unobserved).unwrap();
        shot.particles().positions.len() as f64 / 1000.0
    })
}

#[test]
#[ignore = "steps 120,000 to 340,000 particles 2100 times, about a quarter of an hour"]
fn the_scenes_have_the_numbers_of_particles_that_the_page_states() {
    let text = |number: usize| text(&format!("sekiguchi_paper_{number}.toml"));
    let check = |scene: &str, found: &[f64], stated: &[f64]| {
        for (found, stated) in found.iter().zip(stated) {
            assert_measured!(format!("particles of {scene}, thousands"), *found, *stated, 0.5);
        }
    };
    check("scene 1", &thousands(&text(1), [0, 140, 280]), &[120.0, 74.0, 81.0]);
    check("scene 2", &thousands(&text(2), [0, 140, 280]), &[120.0, 141.0, 161.0]);
    check("scene 3", &thousands(&text(3), [0, 140, 280]), &[120.0, 103.0, 112.0]);
    check("scene 4", &thousands(&text(4), [0, 140, 280, 420, 560]), &[120.0, 103.0, 144.0, 153.0, 152.0]);
    check("scene 5", &thousands(&text(5), [0, 140, 280, 420]), &[120.0, 325.0, 339.0, 333.0]);
    let slow = text(5).replace("update_interval_frames = 5.0", "update_interval_frames = 10.0");
    check("scene 5 with shapes every 10 frames", &thousands(&slow, [140, 280]), &[268.0, 324.0]);
}

/// Noise of scene 1 with a way of sampling: root mean square difference of the green light of two frames that follow each other, over the square root of 2, in
/// the pixels that are at least a quarter as bright as the brightest; % of their mean.
fn noise(sampling: &str) -> f64 {
    let text = text("sekiguchi_paper_1.toml").replace("\"single_photons\"", &format!("\"{sampling}\""));
    let scene = Scene::parse("test.toml", &text, KINDS).unwrap_or_else(|error| panic!("{error}"));
    let options = PlanOptions { size: Some([640, 360]), ..PlanOptions::default() };
    let mut shot = Planned::new(scene, &options, Arc::new(MemoryAssets::default())).open();
    let [first, second] = [0, 1].map(|number| bansho::draw(&mut shot, number, &Unobserved).unwrap());
    let green = |frame: &Frame| frame.beauty.pixels().iter().map(|pixel| f64::from(pixel[1])).collect::<Vec<_>>();
    let pairs: Vec<[f64; 2]> = green(&first).into_iter().zip(green(&second)).map(|(a, b)| [a, b]).collect();
    let brightest = pairs.iter().map(|[a, b]| 0.5 * (a + b)).fold(0.0, f64::max);
    let bright = pairs.iter().filter(|[a, b]| 0.5 * (a + b) > 0.25 * brightest);
    let [mut sum, mut squares, mut count] = [0.0; 3];
    for [a, b] in bright {
        (sum, squares, count) = (sum + 0.5 * (a + b), squares + 0.5 * (a - b) * (a - b), count + 1.0);
    }
    100.0 * f64::sqrt(squares / count) / (sum / count)
}

#[test]
#[ignore = "draws four frames of 120,000 particles, about 20 s"]
fn drawn_photons_are_noisier_than_expected_light() {
    assert_measured!("noise of single photons, %", noise("single_photons"), 9.5, 0.3);
    assert_measured!("noise of single collisions, %", noise("single_collisions"), 2.0, 0.1);
}

#[test]
fn faults_of_the_literal_way_say_what_would_work() {
    let fault = |text: &str| match bansho::compile_scene("test.toml", text, Arc::new(MemoryAssets::default())) {
        Ok(_) => panic!("accepted: {text}"),
        Err(error) => error.to_string(),
    };
    let aurora = |text: &str| fault(&format!("bansho = 2\n[[aurora]]\n{text}"));
    for (text, expected) in [
        (
            "rendering.hard_spheres.collision_radius_pm = 0.0\n",
            "test.toml:3:46: aurora.0.rendering.hard_spheres.collision_radius_pm: 0 is out of range; allowed: 0.3 to 2000 pm",
        ),
        (
            "rendering.hard_spheres.quenching_radius_pm = 1e12\n",
            "aurora.0.rendering.hard_spheres.quenching_radius_pm: 1000000000000 is out of range; allowed: 0.3 to 2000 pm",
        ),
        (
            "rendering.color_matching = \"table_2_1\"\n",
            "table 2.1 has the five lines of the thesis only; allowed: `\"cie_1931\"`",
        ),
        (
            "morphing.correspondence = \"drawing_order\"\n[[aurora.shapes]]\n[[aurora.shapes]]\nsplit = [{}]\nsheets = [{}, { position_km = [0, 90] }]\n",
            "test.toml:7:10: aurora.0.shapes.1.sheets (shape 2): has 2 sheets, but with `correspondence = \"drawing_order\"` each of the 1 sheet",
        ),
        (
            "particles = { count = 1_000_000, smoothing_length_cells = 4.0 }\n",
            "aurora.0.particles.smoothing_length_cells: each of 1000000 particles would have about",
        ),
        (
            "particles = { count = 1_000_000, neighbor_count = 5000 }\n",
            "aurora.0.particles.neighbor_count: each of 1000000 particles would have about 5000 neighbors; allowed: about 1500",
        ),
    ] {
        let shown = aurora(text);
        assert!(shown.contains(expected), "{text}\nexpected: {expected}\nshown: {shown}");
    }
}
