//! Fires and lamps on what a plate shows: Lambert's law, normals from the depth and from a file, shadows of the depth, and what must not change.

use std::{f64::consts::PI, sync::Arc};

use bansho::PlanOptions;
use bansho_base::{
    color,
    frame::Frame,
    host::assets::{Encoding, MemoryAssets, Picture},
    image::{Image, Rect},
    math::DVec3,
};

use crate::support::{self, CAMERA, Planned, channel, draw, luminance, plan_with};

const SIZE: [usize; 2] = [120, 90];
/// Focal length of [`CAMERA`], pixels.
const FOCAL: f64 = 45.0;
const ALBEDO: f32 = 0.5;

/// The line of sight of a pixel, 1 along the axis.
fn direction(x: usize, y: usize) -> DVec3 {
    DVec3::new((x as f64 + 0.5 - 60.0) / FOCAL, (45.0 - y as f64 - 0.5) / FOCAL, -1.0)
}

fn picture(size: [usize; 2], at: impl Fn(usize, usize) -> [f32; 3]) -> Picture {
    let pixels = (0..size[0] * size[1]).map(|index| {
        let [r, g, b] = at(index % size[0], index / size[0]);
        [r, g, b, 1.0]
    });
    Picture::opaque(Image::from_pixels(size[0], size[1], pixels.collect()).unwrap(), Encoding::LinearAcescg)
}

/// A black plate with this depth along the axis, and a gray albedo.
fn plate(depth: impl Fn(usize, usize) -> f64) -> MemoryAssets {
    let values = (0..SIZE[0] * SIZE[1]).map(|index| depth(index % SIZE[0], index / SIZE[0]) as f32).collect();
    let mut assets = MemoryAssets::default();
    assets.insert_picture("plate", Picture { depth: Some(values), ..picture(SIZE, |_, _| [0.0; 3]) });
    assets.insert_picture("albedo", picture(SIZE, |_, _| [ALBEDO; 3]));
    assets
}

const LIT: &str = "[plate]\nimage = \"plate\"\nexposure_ev100 = 0\nalbedo = \"albedo\"\n";

fn lit(assets: &MemoryAssets, tables: &str, options: &PlanOptions) -> Frame {
    draw(&mut plan_with(&format!("{CAMERA}{LIT}{tables}"), options, Arc::new(assets.clone())).open(), 0)
}

/// The same without the glare of the camera.
fn lit_plainly(assets: &MemoryAssets, tables: &str) -> Frame {
    lit(assets, tables, &PlanOptions::default())
}

fn point(position: [f64; 3], candela: f64) -> String {
    format!("[[light]]\nposition = {position:?}\ncolor = [1, 1, 1]\nintensity = {candela}\nradius = 0.01\n")
}

fn assert_close(found: f64, expected: f64, relative: f64, what: &str) {
    assert!((found - expected).abs() <= relative * expected.abs() + 1e-6, "{what}: {found}, expected {expected}");
}

#[test]
fn a_plane_before_a_point_light_has_the_radiance_of_lamberts_law() {
    let frame = lit_plainly(&plate(|_, _| 3.0), &point([0.4, -0.2, -1.0], 100.0));
    for (x, y) in [(60, 45), (59, 44), (0, 0), (119, 89), (85, 12), (3, 60)] {
        let toward = DVec3::new(0.4, -0.2, -1.0) - direction(x, y) * 3.0;
        let distance = toward.length();
        let expected = f64::from(ALBEDO) / PI * 100.0 * (toward.z / distance) / (distance * distance);
        assert_close(luminance(&frame, x, y), expected, 0.01, &format!("{x}, {y}"));
    }
    // Behind the wall, and a spot that looks away from it.
    let behind = lit_plainly(&plate(|_, _| 3.0), &point([0.0, 0.0, -3.5], 100.0));
    assert!(behind.beauty.pixels().iter().all(|pixel| *pixel == [0.0, 0.0, 0.0, 1.0]));
    let spot = |z: f64| format!("{}kind = \"spot\"\ndirection = [0, 0, {z}]\n", point([0.0, 0.0, -1.0], 100.0));
    let [toward, away] = [-1.0, 1.0].map(|z| luminance(&lit_plainly(&plate(|_, _| 3.0), &spot(z)), 60, 45));
    assert_close(toward, f64::from(ALBEDO) / PI * 100.0 / 4.0, 0.01, "within the cone");
    assert_eq!(away, 0.0);
}

#[test]
fn the_normals_of_a_slanted_plane_are_those_of_its_depth() {
    let sun = "[[light]]\nkind = \"directional\"\ndirection = [0.6, -0.64, -0.48]\ncolor = [1, 1, 1]\nintensity = 50\n";
    let toward = DVec3::new(-0.6, 0.64, 0.48);
    for normal in [DVec3::new(0.0, 0.8, 0.6), DVec3::new(-0.48, 0.6, 0.64), DVec3::new(0.3, -0.1, 1.0).normalize()] {
        // Where the plane is behind the camera or far away, there is sky.
        let plane = |x: usize, y: usize| match -2.0 / normal.dot(direction(x, y)) {
            depth if (0.0..30.0).contains(&depth) => depth,
            _ => 0.0,
        };
        let frame = lit_plainly(&plate(plane), sun);
        let expected = f64::from(ALBEDO) / PI * 50.0 * normal.dot(toward);
        let mut seen = 0;
        for (x, y) in (0..90).flat_map(|y| (0..120).map(move |x| (x, y))) {
            let depth = plane(x, y);
            if depth > 0.0 && depth < 20.0 {
                assert_close(luminance(&frame, x, y), expected, 0.01, &format!("{normal} at {x}, {y}"));
                seen += 1;
            } else if depth == 0.0 {
                assert_eq!(luminance(&frame, x, y), 0.0);
            }
        }
        assert!(seen > 3000, "{normal}: {seen}");
    }
}

#[test]
fn normals_of_a_file_replace_those_of_the_depth_where_they_are_known() {
    let mut assets = plate(|_, _| 3.0);
    // Half as large as the plate; 0 in its left half.
    let normals = picture([60, 45], |x, _| if x < 30 { [0.0; 3] } else { [0.6, 0.0, 0.8] });
    assets.insert_picture("normal", normals);
    let sun = "[[light]]\nkind = \"directional\"\ndirection = [0, 0, -1]\ncolor = [1, 1, 1]\nintensity = 50\n";
    let text = format!("{CAMERA}{LIT}normal = \"normal\"\n{sun}");
    let frame = draw(&mut plan_with(&text, &PlanOptions::default(), Arc::new(assets)).open(), 0);
    let facing = f64::from(ALBEDO) / PI * 50.0;
    assert_close(luminance(&frame, 20, 30), facing, 1e-3, "of the depth");
    assert_close(luminance(&frame, 100, 30), 0.8 * facing, 1e-3, "of the file");
}

/// A box 2 m before the camera, and a wall 4 m behind.
fn box_before_a_wall(x: usize, y: usize) -> f64 {
    if (50..70).contains(&x) && (30..60).contains(&y) { 2.0 } else { 4.0 }
}

#[test]
fn a_step_in_the_depth_casts_a_shadow() {
    let frame = lit_plainly(&plate(box_before_a_wall), &point([-1.0, 0.0, -1.0], 100.0));
    let unshadowed = lit_plainly(&plate(|_, _| 4.0), &point([-1.0, 0.0, -1.0], 100.0));
    // The light's rays past the sides of the box, |x| <= 0.44 m, meet the wall at x = 0.67 m and 3.3 m, of which the box hides what is left of 0.89 m.
    assert!(luminance(&frame, 82, 45) == 0.0, "in the shadow");
    for x in [30, 110] {
        assert_close(luminance(&frame, x, 45), luminance(&unshadowed, x, 45), 1e-6, "beside the shadow");
    }
    for y in [5, 85] {
        assert_close(luminance(&frame, 82, y), luminance(&unshadowed, 82, y), 1e-6, "above and below the shadow");
    }
    assert!(luminance(&frame, 60, 45) > 0.0, "the box itself");
    // A visible solid casts one too.
    let obstacle = "[[obstacle]]\nvisible = true\nshape = \"sphere\"\nposition = [-1.0, 0.0, -2.0]\nradius = 0.3\n";
    let with_solid = lit_plainly(&plate(|_, _| 4.0), &format!("{}{obstacle}", point([-1.0, 0.0, -1.0], 100.0)));
    // Beside the solid as the camera sees it, within the cone of its shadow.
    let column = (60.0 + FOCAL * -0.6 / 4.0) as usize;
    assert!(luminance(&unshadowed, column, 45) > 1.0);
    assert!(luminance(&with_solid, column, 45) < 0.05 * luminance(&unshadowed, column, 45));
}

#[test]
fn without_a_light_the_plate_is_the_same_to_the_bit() {
    let assets = support::checkerboard(SIZE[0], SIZE[1], Some(3.0));
    let mut with_albedo = assets.clone();
    with_albedo.insert_picture("albedo", picture(SIZE, |_, _| [ALBEDO; 3]));
    let text = format!("{CAMERA}[plate]\nimage = \"plate.png\"\n");
    let plain = draw(&mut plan_with(&text, &PlanOptions::default(), Arc::new(assets)).open(), 0);
    let dark = format!("{text}albedo = \"albedo\"\n");
    let lit = draw(&mut plan_with(&dark, &PlanOptions::default(), Arc::new(with_albedo)).open(), 0);
    assert!(plain.beauty == lit.beauty);
}

#[test]
fn crops_threads_and_earlier_frames_change_no_pixel_and_layers_add_up() {
    let moving = "[[light]]\nposition = { keys = [[0, [-1, 0, -1]], [1, [1, 1, -1.5]]] }\n";
    let tables = format!("{moving}{}", point([0.9, 0.4, -2.5], 30.0));
    let assets = plate(box_before_a_wall);
    let options = PlanOptions { layers: true, ..PlanOptions::default() };
    let whole = lit(&assets, &tables, &options);
    for crop in [Rect { x: 37, y: 21, width: 60, height: 31 }, Rect { x: 119, y: 0, width: 1, height: 90 }] {
        let cropped = lit(&assets, &tables, &PlanOptions { crop: Some(crop), ..options.clone() });
        assert!(whole.beauty.crop(crop).unwrap() == cropped.beauty, "{crop:?}");
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    assert!(pool.install(|| lit(&assets, &tables, &options)).beauty == whole.beauty);
    let mut shot = plan_with(&format!("{CAMERA}{LIT}{tables}"), &options, Arc::new(assets)).open();
    let first = draw(&mut shot, 0);
    let later = draw(&mut shot, 12);
    assert!(first.beauty == whole.beauty && later.beauty != whole.beauty && draw(&mut shot, 0).beauty == whole.beauty);
    let sum = |c: usize, index: usize| -> f32 {
        let layers = whole.channels.iter().filter(|channel| channel.name.ends_with([".R", ".G", ".B"][c]));
        layers.map(|channel| channel.values[index]).sum()
    };
    for (index, pixel) in whole.beauty.pixels().iter().enumerate() {
        assert!((0..3).all(|c| (sum(c, index) - pixel[c]).abs() <= 1e-4 * pixel[c]), "{index}");
    }
    assert!(channel(&whole, "plate.R").iter().any(|value| *value > 0.0));
}

#[test]
fn the_ground_of_a_lit_plate_is_lit_once() {
    let ground = DVec3::Y;
    let plane = |x: usize, y: usize| match -1.6 / ground.dot(direction(x, y)) {
        depth if (0.0..50.0).contains(&depth) => depth,
        _ => 0.0,
    };
    let (assets, lamp) = (plate(plane), point([0.5, 0.0, -3.0], 200.0));
    let dry = "[ground]\nkind = \"plate\"\nheight = -1.6\n";
    let [without, with] = ["", dry].map(|ground| lit_plainly(&assets, &format!("{lamp}{ground}")));
    let expected = {
        let toward = DVec3::new(0.5, 0.0, -3.0) - direction(66, 70) * plane(66, 70);
        f64::from(ALBEDO) / PI * 200.0 * toward.y / (toward.length_squared() * toward.length())
    };
    assert_close(luminance(&with, 66, 70), expected, 0.01, "on the ground");
    let differs = without.beauty.pixels().iter().zip(with.beauty.pixels()).find(|(a, b)| a != b);
    assert_eq!(differs, None);
    // Water darkens it as what the plate shows: by 55 %; what it reflects comes on top.
    let wet = lit_plainly(&assets, &format!("{lamp}{dry}wetness = 1.0\npuddles = 0\n"));
    let darkened = luminance(&wet, 66, 70);
    assert!(darkened > 0.449 * expected && darkened < 0.8 * expected, "{darkened} of {expected}");
}

#[test]
fn the_exposure_of_the_picture_is_that_of_the_added_light() {
    let assets = plate(|_, _| 3.0);
    let text = |ev: i32| {
        format!("{CAMERA}{LIT}{}", point([0.0, 0.0, -1.0], 100.0)).replace("ev100 = 0", &format!("ev100 = {ev}"))
    };
    let [plain, brighter] =
        [0, -2].map(|ev| draw(&mut plan_with(&text(ev), &PlanOptions::default(), Arc::new(assets.clone())).open(), 0));
    assert_close(luminance(&brighter, 60, 45), luminance(&plain, 60, 45), 1e-4, "absolute luminance");
    let ratio = color::luminance(brighter.beauty.at(60, 45)[..3].try_into().unwrap())
        / color::luminance(plain.beauty.at(60, 45)[..3].try_into().unwrap());
    assert!((ratio - 4.0).abs() < 1e-3, "{ratio}");
}

/// An arc of that flux, `south_km` to the south of the zenith.
fn arc(south_km: f64, flux: f64) -> String {
    format!(
        "[[aurora]]\nflux_mw_per_m2 = {flux}\npreroll_s = 0\nparticles = {{ count = 2000 }}\n\
         [[aurora.shapes]]\nsheets = [{{ points = [[-200, {south_km}], [200, {south_km}]] }}]\n"
    )
}

#[test]
fn an_aurora_lights_what_faces_its_part_of_the_sky() {
    // A wall to the north, which faces the south.
    let wall = plate(|_, _| 3.0);
    let at_middle = |aurora: &str| {
        let scene = bansho::parse_scene("aurora.toml", &format!("{CAMERA}{LIT}{aurora}")).unwrap();
        let planned = Planned::new(scene, &PlanOptions::default(), Arc::new(wall.clone()));
        luminance(&draw(&mut planned.open(), 0), 60, 45)
    };
    let behind_viewer = at_middle(&arc(150.0, 40.0));
    assert!(behind_viewer > 0.0, "{behind_viewer}");
    assert_close(at_middle(&arc(150.0, 80.0)), 2.0 * behind_viewer, 0.02, "twice the flux");
    // Lights of the sky are up to 44 degrees from what they stand for.
    let behind_wall = at_middle(&arc(-250.0, 40.0));
    assert!(behind_wall < 0.1 * behind_viewer, "{behind_wall} of {behind_viewer}");
}

#[test]
fn the_sky_of_the_scene_is_seen_where_a_plate_has_no_depth() {
    let half = plate(|_, y| if y < 40 { f64::INFINITY } else { 3.0 });
    let sky = "[sky]\nkind = \"overcast\"\nluminance = 2.0\n";
    let draw_plate = |key: &str| {
        let text = format!("{CAMERA}[plate]\nimage = \"plate\"\nexposure_ev100 = 0\n{key}{sky}");
        draw(&mut plan_with(&text, &PlanOptions::default(), Arc::new(half.clone())).open(), 0)
    };
    let (kept, replaced) = (draw_plate(""), draw_plate("sky = \"scene\"\n"));
    let alone = plan_with(&format!("{CAMERA}{sky}"), &PlanOptions::default(), Arc::new(MemoryAssets::default()));
    let alone = draw(&mut alone.open(), 0);
    for x in [3, 60, 117] {
        assert_eq!(replaced.beauty.at(x, 20), alone.beauty.at(x, 20));
        assert!(luminance(&alone, x, 20) > 0.1 && luminance(&kept, x, 20) == 0.0);
        assert_eq!(replaced.beauty.at(x, 60), kept.beauty.at(x, 60));
    }
}

#[test]
fn what_cannot_be_lit_is_refused_where_it_is_stated() {
    let fault = |plate_text: &str, change: &dyn Fn(&mut MemoryAssets)| {
        let mut assets = plate(|_, _| 3.0);
        assets.insert_picture("flat", picture(SIZE, |_, _| [0.5; 3]));
        change(&mut assets);
        let text = format!("bansho = 2\n[plate]\n{plate_text}");
        support::compiled("scene.toml", &text, &support::kinds(), assets).err().expect("an error").to_string()
    };
    let unchanged = |_: &mut MemoryAssets| {};
    let told = fault("image = \"flat\"\nalbedo = \"albedo\"\n", &unchanged);
    assert!(told.contains("scene.toml:4:10: plate.albedo: `albedo` needs a depth"), "{told}");
    let told = fault("image = \"flat\"\nsky = \"scene\"\n", &unchanged);
    assert!(told.contains("scene.toml:4:7: plate.sky: `sky = \"scene\"` needs a depth"), "{told}");
    let told = fault("image = \"flat\"\nnormal = \"flat\"\n", &unchanged);
    assert!(told.contains("scene.toml:4:10: plate.normal: `normal` needs a depth"), "{told}");
    let told = fault("image = \"plate\"\nnormal = \"flat\"\n", &unchanged);
    assert!(told.contains("plate.normal: `normal` needs an `albedo`"), "{told}");
    let told = fault("albedo = \"albedo\"\n", &unchanged);
    assert!(told.contains("scene.toml:3:10: plate.albedo: `albedo` needs an `image`"), "{told}");
    let told = fault("image = \"plate\"\nalbedo = \"gone\"\n", &unchanged);
    assert!(told.contains("scene.toml:4:10: plate.albedo: gone: no such file"), "{told}");
    let bright = |assets: &mut MemoryAssets| {
        assets.insert_picture("albedo", picture(SIZE, |x, y| if [x, y] == [7, 2] { [1.5; 3] } else { [0.5; 3] }));
    };
    let told = fault("image = \"plate\"\nalbedo = \"albedo\"\n", &bright);
    assert!(told.contains("albedo: has the value 1.5 at pixel [7, 2]; allowed: 0 to 1"), "{told}");
    let square = |assets: &mut MemoryAssets| assets.insert_picture("flat", picture([64, 64], |_, _| [0.5; 3]));
    let told = fault("image = \"plate\"\nalbedo = \"albedo\"\nnormal = \"flat\"\n", &square);
    assert!(told.contains("plate.normal: flat: has 64 x 64 pixels; allowed: 120 x 90"), "{told}");
}
