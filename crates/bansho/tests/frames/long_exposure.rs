//! Motion in the open shutter: of everything that is drawn, one long exposure is the mean of twenty short ones, whether the camera moves, the thing, or
//! both.

use std::sync::Arc;

use bansho::{Frame, MemoryAssets, Plan, PlanOptions, Shot, compile_scene};
use bansho_base::host::observer::Unobserved;

/// Short exposures for each long one.
const PARTS: u32 = 20;
/// Largest difference from their mean, root mean square, relative to that of the mean.
const TOLERANCE: f64 = 0.05;

/// Width and height of the pictures.
const SIZE: [usize; 2] = [192, 108];

/// How the camera moves while the shutter is open. Each picture shows a few meters around the origin from 6 m.
#[derive(Clone, Copy, Debug, PartialEq)]
enum CameraMotion {
    Still,
    /// A whip pan of 90 degrees per second.
    Pan,
    /// A pan of 116 degrees per second, however long the exposure is.
    LongPan,
    /// Toward the origin and to the side.
    Dolly,
    Roll,
    Zoom,
}

impl CameraMotion {
    /// The table `[camera]`, moving from 0 to 1/48 s.
    fn table(self) -> &'static str {
        match self {
            Self::Still => "position = [0, 1.5, 6]\ntarget = [0, 1, 0]\n",
            Self::Pan => {
                "position = [0, 1.5, 6]\n\
                 target = { keys = [[-1, [-9.47, 1, 0]], [1.0208333, [9.47, 1, 0]]], interpolation = \"linear\" }\n"
            }
            Self::LongPan => {
                "position = [0, 1.5, 6]\n\
                 target = { keys = [[0, [-2, 1, 0]], [0.32, [2, 1, 0]]], interpolation = \"linear\" }\n"
            }
            Self::Dolly => {
                "position = { keys = [[0, [-0.1, 1.5, 6.1]], [0.0208333, [0.1, 1.5, 5.9]]], interpolation = \"linear\" }\n\
                 target = [0, 1, 0]\n"
            }
            Self::Roll => {
                "position = [0, 1.5, 6]\ntarget = [0, 1, 0]\n\
                 roll_deg = { keys = [[0, -3], [0.0208333, 3]], interpolation = \"linear\" }\n"
            }
            Self::Zoom => {
                "position = [0, 1.5, 6]\ntarget = [0, 1, 0]\n\
                 vertical_fov_deg = { keys = [[0, 34], [0.0208333, 30]], interpolation = \"linear\" }\n"
            }
        }
    }
}

/// A position that moves by 0.3 m to the right and 0.1 m down while the shutter is open.
fn carried([x, y, z]: [f64; 3], shutter_s: f64) -> String {
    let end = |sign: f64| format!("[{}, {}, {z}]", x + 0.15 * sign, y - 0.05 * sign);
    format!("{{ keys = [[0, {}], [{shutter_s}, {}]], interpolation = \"linear\" }}", end(-1.0), end(1.0))
}

/// A fixed position.
fn fixed(position: [f64; 3]) -> String {
    format!("{position:?}")
}

/// Something that is drawn, with the position of what may be carried.
struct Phenomenon {
    name: &'static str,
    /// Exposure time, s.
    shutter_s: f64,
    /// Tables of the scene for a position.
    tables: fn(&str) -> String,
    /// The position that is carried; `None` if nothing can be.
    carried: Option<[f64; 3]>,
    cameras: &'static [CameraMotion],
}

const USUAL_S: f64 = 1.0 / 48.0;
const ALL_CAMERAS: &[CameraMotion] =
    &[CameraMotion::Still, CameraMotion::Pan, CameraMotion::Dolly, CameraMotion::Roll, CameraMotion::Zoom];
const TURNS: &[CameraMotion] = &[CameraMotion::Pan, CameraMotion::Roll, CameraMotion::Zoom];

const DARK: &str = "[sky]\nluminance = 0.0\nvisible = false\n";

const PHENOMENA: &[Phenomenon] = &[
    Phenomenon {
        name: "flame sheet",
        shutter_s: USUAL_S,
        tables: |position| format!("[[flame_sheet]]\nposition = {position}\nwidth = 0.5\nheight = 0.9\n"),
        carried: Some([0.0, 0.6, 0.0]),
        cameras: ALL_CAMERAS,
    },
    Phenomenon {
        name: "flame sheet in a long exposure",
        shutter_s: 0.32,
        tables: |position| format!("[[flame_sheet]]\nposition = {position}\nwidth = 0.5\nheight = 0.9\n"),
        carried: Some([0.0, 0.6, 0.0]),
        cameras: &[CameraMotion::Still],
    },
    Phenomenon {
        name: "smoke",
        shutter_s: USUAL_S,
        tables: |position| {
            format!(
                "[sky]\nluminance = 5\n[[flame_sheet]]\nposition = {position}\nwidth = 0.5\nheight = 0.6\n\
                 smoke.optical_depth = 2\n"
            )
        },
        carried: Some([0.0, 0.3, 0.0]),
        cameras: ALL_CAMERAS,
    },
    Phenomenon {
        name: "soot field",
        shutter_s: USUAL_S,
        tables: |position| {
            format!("[[flame_sheet]]\nmethod = \"soot_field\"\nposition = {position}\nwidth = 0.5\nheight = 0.9\n")
        },
        carried: Some([0.0, 0.6, 0.0]),
        cameras: ALL_CAMERAS,
    },
    Phenomenon {
        name: "sparks",
        shutter_s: USUAL_S,
        tables: |position| {
            format!(
                "[[flame_sheet]]\nposition = {position}\nwidth = 0.8\nheight = 0.9\ncolor.luminance = 0\n\
                 sparks.rate = 200\n"
            )
        },
        carried: None,
        cameras: &[CameraMotion::Still, CameraMotion::Pan],
    },
    Phenomenon {
        name: "lamp",
        shutter_s: USUAL_S,
        tables: |position| format!("[[light]]\nposition = {position}\nvisible = true\nradius = 0.04\nintensity = 50\n"),
        carried: Some([0.5, 1.2, 0.0]),
        cameras: ALL_CAMERAS,
    },
    Phenomenon {
        name: "large lamp before the sky",
        shutter_s: USUAL_S,
        tables: |position| {
            format!(
                "[sky]\nluminance = 50\ntrees_deg = 5\n\
                 [[light]]\nposition = {position}\nvisible = true\nradius = 0.4\nintensity = 50\n"
            )
        },
        carried: Some([0.5, 1.2, 0.0]),
        cameras: ALL_CAMERAS,
    },
    Phenomenon {
        name: "ground",
        shutter_s: USUAL_S,
        tables: |position| format!("[ground]\n[[light]]\nposition = {position}\nintensity = 90\n"),
        carried: Some([0.5, 0.3, 2.0]),
        cameras: ALL_CAMERAS,
    },
    Phenomenon {
        name: "ground in a spot that turns",
        shutter_s: USUAL_S,
        tables: |_| {
            "[ground]\n[[light]]\nkind = \"spot\"\nposition = [0, 3, 0]\nintensity = 900\nouter_cone_deg = 12\n\
             direction = { keys = [[0, [-0.3, -1, 0]], [0.0208333, [0.3, -1, 0.1]]], interpolation = \"linear\" }\n"
                .to_owned()
        },
        carried: None,
        cameras: &[CameraMotion::Still],
    },
    Phenomenon {
        name: "wet ground",
        shutter_s: USUAL_S,
        tables: |position| {
            format!(
                "[ground]\nwetness = 0.9\n[[light]]\nposition = {position}\nvisible = true\nradius = 0.1\nintensity = 90\n"
            )
        },
        carried: Some([0.5, 1.2, 0.0]),
        cameras: &[CameraMotion::Still, CameraMotion::Pan, CameraMotion::Dolly, CameraMotion::Zoom],
    },
    Phenomenon {
        name: "lake",
        shutter_s: USUAL_S,
        tables: |position| {
            format!(
                "[ground]\nkind = \"water\"\n[sky]\nluminance = 1\n\
                 [[flame_sheet]]\nposition = {position}\nwidth = 0.8\nheight = 0.9\n"
            )
        },
        carried: Some([0.0, 0.5, 0.0]),
        cameras: ALL_CAMERAS,
    },
    Phenomenon {
        name: "lake in a long exposure",
        shutter_s: 0.32,
        tables: |position| {
            format!(
                "[ground]\nkind = \"water\"\n[sky]\nluminance = 1\n\
                 [[flame_sheet]]\nposition = {position}\nwidth = 0.8\nheight = 0.9\n"
            )
        },
        carried: Some([0.0, 0.5, 0.0]),
        cameras: &[CameraMotion::Still],
    },
    Phenomenon {
        name: "obstacle and its shadow",
        shutter_s: USUAL_S,
        tables: |position| {
            format!(
                "[ground]\n[[light]]\nposition = [1.5, 3, 2]\nintensity = 900\n\
                 [[obstacle]]\nvisible = true\nposition = {position}\nradius = 0.4\n"
            )
        },
        carried: Some([0.0, 0.6, 0.0]),
        cameras: &[CameraMotion::Still, CameraMotion::Pan, CameraMotion::Dolly],
    },
    Phenomenon {
        name: "obstacle in the light of a lamp",
        shutter_s: USUAL_S,
        tables: |position| {
            format!(
                "[[light]]\nposition = {position}\nintensity = 90\n\
                 [[obstacle]]\nvisible = true\nposition = [0, 0.8, 0]\nradius = 0.6\n"
            )
        },
        carried: Some([0.5, 1.2, 0.6]),
        cameras: &[CameraMotion::Still, CameraMotion::Pan],
    },
    Phenomenon {
        name: "flame before an obstacle on lit ground",
        shutter_s: USUAL_S,
        tables: |position| {
            format!(
                "[sky]\nluminance = 5\ntrees_deg = 5\n[ground]\n\
                 [[obstacle]]\nvisible = true\nposition = [0.2, 0.5, -0.8]\nradius = 0.5\n\
                 [[flame_sheet]]\nposition = {position}\nwidth = 0.4\nheight = 0.8\n"
            )
        },
        carried: Some([0.0, 0.5, 0.0]),
        cameras: ALL_CAMERAS,
    },
    Phenomenon {
        name: "rain in the light of the sky",
        shutter_s: USUAL_S,
        tables: |_| "[sky]\nluminance = 50\nvisible = false\n[[rain]]\nrate_mm_per_h = 50\n".to_owned(),
        carried: None,
        cameras: &[CameraMotion::Still, CameraMotion::Pan, CameraMotion::Roll],
    },
    Phenomenon {
        name: "rain near a lamp, drop by drop",
        shutter_s: USUAL_S,
        tables: |_| {
            "[[light]]\nposition = [1.5, 3, 2]\nintensity = 900\n\
             [[rain]]\nrate_mm_per_h = 50\nmethod = \"drops\"\n"
                .to_owned()
        },
        carried: None,
        cameras: &[CameraMotion::Still, CameraMotion::Roll],
    },
    Phenomenon {
        name: "sky with trees",
        shutter_s: USUAL_S,
        tables: |_| "[sky]\nluminance = 50\ntrees_deg = 8\n".to_owned(),
        carried: None,
        cameras: TURNS,
    },
    Phenomenon {
        name: "stars",
        shutter_s: USUAL_S,
        tables: |_| "[sky]\nkind = \"night\"\n".to_owned(),
        carried: None,
        cameras: TURNS,
    },
    Phenomenon {
        name: "aurora",
        shutter_s: USUAL_S,
        tables: |_| {
            "shift = [0.0, 1.2]\n[[aurora]]\npreroll_s = 1\nparticles = { count = 5000 }\n[sky]\nkind = \"night\"\nnight = { stars = 0 }\n".to_owned()
        },
        carried: None,
        cameras: TURNS,
    },
];

/// Everything that can be seen and stands still, in a pan: whatever is behind something else is hidden by it at some moments and not at others.
fn pan_scene(_: &str) -> String {
    "[sky]\nluminance = 5\ntrees_deg = 5\n[ground]\n\
     [[light]]\nposition = [1, 3, 0]\nintensity = 900\nvisible = true\n\
     [[obstacle]]\nvisible = true\nposition = [-1, 0.5, 0]\n\
     [[flame_sheet]]\nwidth = 0.4\nheight = 0.8\nspeed = 0\nshape = { flutter = 0, flicker = 0, sway = 0 }\n"
        .to_owned()
}

const LONG_PAN: &[CameraMotion] = &[CameraMotion::LongPan];

/// Things that move over the same pixels.
const CROSSINGS: &[Phenomenon] = &[
    Phenomenon { name: "all in a pan", shutter_s: 0.02, tables: pan_scene, carried: None, cameras: LONG_PAN },
    Phenomenon { name: "all in a longer pan", shutter_s: 0.08, tables: pan_scene, carried: None, cameras: LONG_PAN },
    Phenomenon { name: "all in a long pan", shutter_s: 0.32, tables: pan_scene, carried: None, cameras: LONG_PAN },
    Phenomenon {
        name: "lamp before ground",
        shutter_s: 0.08,
        tables: |position| {
            format!("[ground]\n[[light]]\nposition = {position}\nintensity = 90\nvisible = true\nradius = 0.2\n")
        },
        carried: Some([0.5, 0.3, 2.0]),
        cameras: &[CameraMotion::Still, CameraMotion::LongPan],
    },
    Phenomenon {
        name: "flame before an obstacle and ground",
        shutter_s: 0.08,
        tables: |position| {
            format!(
                "[sky]\nluminance = 5\n[ground]\n[[obstacle]]\nvisible = true\nposition = [0.2, 0.5, -0.8]\n\
                 [[flame_sheet]]\nposition = {position}\nwidth = 0.4\nheight = 0.8\nsmoke.optical_depth = 2\n\
                 speed = 0\nshape = {{ flutter = 0, flicker = 0, sway = 0 }}\n"
            )
        },
        carried: Some([0.0, 0.5, 0.0]),
        cameras: LONG_PAN,
    },
    Phenomenon {
        name: "obstacle before trees and a lamp",
        shutter_s: 0.08,
        tables: |position| {
            format!(
                "[sky]\nluminance = 50\ntrees_deg = 12\n\
                 [[light]]\nposition = [0, 1.6, -2]\nintensity = 90\nvisible = true\nradius = 0.2\n\
                 [[obstacle]]\nvisible = true\nposition = {position}\nradius = 0.4\n"
            )
        },
        carried: Some([0.0, 1.5, 0.0]),
        cameras: &[CameraMotion::Still, CameraMotion::LongPan],
    },
    Phenomenon {
        name: "flame and obstacle over a lake",
        shutter_s: 0.08,
        tables: |position| {
            format!(
                "[sky]\nluminance = 1\n[ground]\nkind = \"water\"\n\
                 [[obstacle]]\nvisible = true\nposition = [-0.3, 0.5, -0.8]\n\
                 [[flame_sheet]]\nposition = {position}\nwidth = 0.8\nheight = 0.9\n\
                 speed = 0\nshape = {{ flutter = 0, flicker = 0, sway = 0 }}\n"
            )
        },
        carried: Some([0.0, 0.5, 0.0]),
        cameras: LONG_PAN,
    },
];

/// A frame of a scene.
fn draw(phenomenon: &Phenomenon, camera: CameraMotion, position: &str, [shutter_s, start_s]: [f64; 2]) -> Frame {
    let tables = (phenomenon.tables)(position);
    let dark = if tables.contains("[sky]") { "" } else { DARK };
    let text = format!(
        "bansho = 2\n[picture]\nsize = {SIZE:?}\nfps = 24\nexposure_ev100 = 3\n\
         [camera]\n{}shutter_s = {shutter_s}\nshutter_offset_s = {start_s}\n{dark}{tables}",
        camera.table()
    );
    let compiled = compile_scene(phenomenon.name, &text, Arc::new(MemoryAssets::default()))
        .unwrap_or_else(|error| panic!("{error}"));
    let plan = Arc::new(Plan::new(&compiled, &PlanOptions::default()).unwrap());
    bansho::draw(&mut Shot::open(compiled, plan), 0, &Unobserved).unwrap()
}

/// Root mean square of a long exposure minus the mean of short ones, relative to that of the mean: of the light or of alpha, whichever is larger.
fn difference(phenomenon: &Phenomenon, camera: CameraMotion, position: &str) -> f64 {
    let shutter_s = phenomenon.shutter_s;
    let long = draw(phenomenon, camera, position, [shutter_s, 0.0]);
    let mut mean = vec![0.0; long.beauty.pixels().len() * 4];
    let parts = if camera == CameraMotion::LongPan { PARTS.max((300.0 * shutter_s) as u32) } else { PARTS };
    for index in 0..parts {
        let part_s = shutter_s / f64::from(parts);
        let short = draw(phenomenon, camera, position, [part_s, f64::from(index) * part_s]);
        let values = short.beauty.pixels().as_flattened();
        mean.iter_mut().zip(values).for_each(|(sum, value)| *sum += f64::from(*value) / f64::from(parts));
    }
    let relative = |channels: std::ops::Range<usize>| {
        let values = long.beauty.pixels().as_flattened().iter().map(|value| f64::from(*value)).zip(&mean).enumerate();
        let (mut error, mut size) = (0.0, 0.0);
        for (_, (long, mean)) in values.filter(|(index, _)| channels.contains(&(index % 4))) {
            error += (long - mean) * (long - mean);
            size += mean * mean;
        }
        (size > 0.0).then(|| (error / size).sqrt())
    };
    let color = relative(0..3).unwrap_or_else(|| panic!("{}: something is seen", phenomenon.name));
    color.max(relative(3..4).unwrap_or(0.0))
}

/// Compares the phenomena whose names begin with one of some words, and fails with a table of all of them.
fn check(words: &[&str]) {
    let is_named = |each: &&Phenomenon| words.iter().any(|word| each.name.starts_with(word));
    let table = compare(PHENOMENA.iter().filter(is_named));
    assert!(!table.is_empty(), "{words:?} are in the list");
}

/// Compares long and short exposures, and fails with a table of all of them.
fn compare<'a>(phenomena: impl Iterator<Item = &'a Phenomenon>) -> String {
    let mut table = String::new();
    let mut is_blurred = true;
    for phenomenon in phenomena {
        let still = fixed(phenomenon.carried.unwrap_or_default());
        let moving = phenomenon.carried.map(|at| (carried(at, phenomenon.shutter_s), "carried"));
        for (position, thing) in std::iter::once((still, "still")).chain(moving) {
            for &camera in phenomenon.cameras {
                let found = difference(phenomenon, camera, &position);
                is_blurred &= found < TOLERANCE;
                let mark = if found < TOLERANCE { "" } else { " <-" };
                table += &format!("{:45} {thing:8} camera {camera:7?} {found:.4}{mark}\n", phenomenon.name);
            }
        }
    }
    assert!(is_blurred, "root mean square difference, relative:\n{table}");
    table
}

#[test]
fn long_exposures_of_flames_are_the_mean_of_short_ones() {
    check(&["flame sheet", "smoke", "soot field", "sparks"]);
}

#[test]
fn long_exposures_of_lamps_are_the_mean_of_short_ones() {
    check(&["lamp", "large lamp"]);
}

#[test]
fn long_exposures_of_ground_are_the_mean_of_short_ones() {
    check(&["ground", "wet ground"]);
}

#[test]
fn long_exposures_of_lakes_are_the_mean_of_short_ones() {
    check(&["lake"]);
}

#[test]
fn long_exposures_of_obstacles_are_the_mean_of_short_ones() {
    check(&["obstacle", "flame before an obstacle"]);
}

#[test]
fn long_exposures_of_rain_are_the_mean_of_short_ones() {
    check(&["rain"]);
}

#[test]
fn long_exposures_of_the_sky_are_the_mean_of_short_ones() {
    check(&["sky", "stars", "aurora"]);
}

#[test]
fn long_exposures_of_things_that_cross_are_the_mean_of_short_ones() {
    compare(CROSSINGS.iter());
}

/// Something else cuts the ground into slices of depth, and its rows move from one slice to another while the camera pans. They must stay opaque.
#[test]
fn ground_that_moves_from_slice_to_slice_stays_opaque() {
    for shutter_s in [0.08, 0.32] {
        let text = format!(
            "bansho = 2\n[picture]\nsize = {SIZE:?}\nfps = 24\nexposure_ev100 = 3\n\
             [camera]\n{}shutter_s = {shutter_s}\n\
             [sky]\nluminance = 5\n[ground]\n[[light]]\nposition = [1, 3, 0]\nintensity = 900\n\
             [[obstacle]]\nvisible = true\nposition = [-1, 0.5, 0]\n",
            CameraMotion::LongPan.table()
        );
        let compiled = compile_scene("pan", &text, Arc::new(MemoryAssets::default())).unwrap();
        let plan = Plan::new(&compiled, &PlanOptions { layers: true, ..PlanOptions::default() }).unwrap();
        let frame = bansho::draw(&mut Shot::open(compiled, Arc::new(plan)), 0, &Unobserved).unwrap();
        let alpha = |layer: &str| {
            let name = format!("{layer}.A");
            &frame.channels.iter().find(|channel| channel.name == name).unwrap().values
        };
        // The lower third of the picture is below the horizon.
        for (pixel, (ground, obstacle)) in
            alpha("ground").iter().zip(alpha("obstacles")).enumerate().skip(SIZE[0] * 2 * SIZE[1] / 3)
        {
            assert!(ground + obstacle > 0.999, "{shutter_s} s, row {}: {ground} and {obstacle}", pixel / SIZE[0]);
        }
    }
}
