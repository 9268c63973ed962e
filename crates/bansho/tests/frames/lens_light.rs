//! Light does not depend on the lens or on the direction of the camera: the sum over the pixels of luminance times solid angle is the illuminance at the
//! camera. And a panorama has no seam: a camera that turns by half a circle sees the picture rolled by half.

use std::sync::Arc;

use bansho::{
    base::{
        camera::{Camera, Lens},
        color::white_luminance,
        frame::Frame,
        host::{assets::MemoryAssets, observer::Unobserved},
        math::DVec2,
    },
    compile_scene, draw,
    render::{Plan, PlanOptions, Shot},
};

/// EV100 of all pictures.
const EXPOSURE: f64 = 4.0;

/// Something that shines, before a camera at the origin that may look elsewhere.
struct Shining {
    name: &'static str,
    /// Tables of the scene.
    tables: &'static str,
    /// Largest deviation of its light from that on the axis of a perspective lens, as a fraction.
    tolerance: f64,
}

/// All are around the horizontal direction -z, at a distance of 10 m or less.
const SHINING: &[Shining] = &[
    Shining {
        name: "a small lamp",
        tables: "[[light]]\nposition = [0, 0, -10]\nradius = 0.02\nintensity = 100\nvisible = true\n",
        tolerance: 0.003,
    },
    Shining {
        name: "a large lamp",
        tables: "[[light]]\nposition = [0, 0, -10]\nradius = 0.6\nintensity = 100\nvisible = true\n",
        tolerance: 0.005,
    },
    Shining {
        name: "sparks of a flame sheet",
        tables: "[[flame_sheet]]\nposition = [0, -0.5, -8]\nwidth = 8\nheight = 0.4\ncolor.luminance = 0\nlight.scale = 0\n\
                 sparks = { rate = 300, diameter = 0.01, speed = 0.5, swirl = 0.2 }\n",
        tolerance: 0.02,
    },
    Shining {
        name: "large sparks near the camera",
        tables: "[[flame_sheet]]\nposition = [0, -0.2, -2]\nwidth = 2\nheight = 0.1\ncolor.luminance = 0\nlight.scale = 0\n\
                 sparks = { rate = 100, diameter = 0.05, speed = 0.1, swirl = 0.02 }\n",
        tolerance: 0.02,
    },
    Shining {
        // Before and behind soot that hides most of what is behind it: the camera's pitch must not move a spark from one side to the other.
        name: "sparks around a dark sheet of soot",
        tables: "[[flame_sheet]]\nposition = [0, -1.5, -4]\nwidth = 3\nheight = 3\ncolor = { luminance = 0, soot_optical_depth = 4 }\nlight.scale = 0\n\
                 sparks = { rate = 400, diameter = 0.02, speed = 1.0, swirl = 0.4 }\n",
        tolerance: 0.03,
    },
    Shining {
        name: "a flame sheet",
        tables: "[[flame_sheet]]\nposition = [0, -0.5, -4]\nwidth = 0.7\nheight = 1.2\nlight.scale = 0\n",
        tolerance: 0.05,
    },
    Shining {
        name: "a soot field",
        tables: "[[flame_sheet]]\nposition = [0, -0.5, -4]\nmethod = \"soot_field\"\nwidth = 0.7\nheight = 1.2\nlight.scale = 0\n",
        tolerance: 0.05,
    },
    Shining {
        name: "gas",
        tables: "[[flame_particles]]\nposition = [0, -0.5, -6]\nparticles = 1500\npreroll_s = 0.5\n",
        // Far off the axis of a perspective lens its detail is finer than where pixels show more of it: 0.944 at 60 degrees.
        tolerance: 0.06,
    },
    Shining {
        name: "an obstacle in the light of the sky",
        tables: "[sky]\nkind = \"uniform\"\nluminance = 100\nvisible = false\n\
                 [[obstacle]]\nshape = \"sphere\"\nposition = [0, 0, -6]\nradius = 0.5\nvisible = true\n",
        tolerance: 0.01,
    },
];

/// A lens, the angle in degrees between its axis and what shines, and its picture.
type Aim = (Lens, f64, [usize; 2], f64);

/// The angle is a latitude for panoramas. The last number is the field of view.
const AIMS: &[Aim] = &[
    (Lens::Perspective, 30.0, [500, 500], 90.0),
    (Lens::Perspective, 60.0, [600, 600], 140.0),
    (Lens::Panorama, 0.0, [1024, 512], 0.0),
    (Lens::Panorama, 60.0, [1024, 512], 0.0),
    (Lens::Panorama, 88.0, [1024, 512], 0.0),
    (Lens::Fisheye, 0.0, [512, 512], 180.0),
    (Lens::Fisheye, 60.0, [512, 512], 180.0),
    (Lens::Fisheye, 90.0, [800, 800], 240.0),
    (Lens::Fisheye, 150.0, [1000, 1000], 360.0),
];
const ON_AXIS: Aim = (Lens::Perspective, 0.0, [320, 320], 50.0);

/// Frame 0 of a scene, with its layers and AOVs, and its camera.
fn frame(text: &str) -> (Frame, Camera) {
    let compiled = compile_scene("test.toml", text, Arc::new(MemoryAssets::default()));
    let compiled = compiled.unwrap_or_else(|error| panic!("{error}\n{text}"));
    let options = PlanOptions { layers: true, aovs: true, ..PlanOptions::default() };
    let plan = Arc::new(Plan::new(&compiled, &options).unwrap());
    let camera = plan.camera.at(0.0, plan.size());
    (draw(&mut Shot::open(compiled, plan), 0, &Unobserved).unwrap(), camera)
}

/// A scene whose camera looks down by an angle, so that the direction -z is above the middle of the picture.
fn scene(tables: &str, (lens, angle, [width, height], fov): Aim) -> String {
    let (sin, cos) = bansho::base::math::sin_cos(-angle.to_radians());
    let lens = match lens {
        Lens::Perspective => format!("vertical_fov_deg = {fov}"),
        Lens::Fisheye => format!("lens = \"fisheye\"\nfisheye_fov_deg = {fov}"),
        Lens::Panorama => "lens = \"panorama\"".into(),
    };
    let sky = if tables.contains("[sky]") { "" } else { "[sky]\nluminance = 0\n" };
    format!(
        "bansho = 2\n[picture]\nsize = [{width}, {height}]\nframes = 1\nexposure_ev100 = {EXPOSURE}\n[camera]\n{lens}\n\
         position = [0, 0, 0]\ntarget = [0, {}, {}]\nshutter_s = 0.002\n{sky}{tables}",
        10.0 * sin,
        -10.0 * cos
    )
}

/// Sum of luminance times solid angle over the pixels, lux.
fn illuminance((frame, camera): &(Frame, Camera)) -> f64 {
    let (width, height) = (frame.beauty.width(), frame.beauty.height());
    let mut sum = 0.0;
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let [red, green, blue, _] = frame.beauty.at(x, y).map(f64::from);
        let luminance = 0.272_228_7 * red + 0.674_081_8 * green + 0.053_689_5 * blue;
        sum += luminance * camera.pixel_solid_angle(DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
    }
    sum * white_luminance(EXPOSURE)
}

#[test]
fn light_is_the_same_through_every_lens_in_every_direction() {
    let mut faults = Vec::new();
    for Shining { name, tables, tolerance } in SHINING {
        let expected = illuminance(&frame(&scene(tables, ON_AXIS)));
        assert!(expected > 0.0, "{name} does not shine");
        if name.ends_with("lamp") && (expected - 1.0).abs() > 0.005 {
            faults.push(format!("{name} of 100 cd at 10 m: {expected} lx"));
        }
        for aim in AIMS {
            let ratio = illuminance(&frame(&scene(tables, *aim))) / expected;
            if (ratio - 1.0).abs() > *tolerance {
                faults.push(format!("{name}, {:?} at {} degrees: {ratio:.4}", aim.0, aim.1));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// What is drawn beside the seam of a panorama, 180 degrees from the direction +z in which its camera looks.
const AT_THE_SEAM: &[(&str, &str)] = &[
    (
        "lamps",
        "[[light]]\nposition = [0, 2, 6]\nintensity = 3000\nvisible = true\n[[light]]\nposition = [0.1, 9, 1]\nradius = 1\nintensity = 300\nvisible = true\n",
    ),
    ("flame sheets with sparks", "[[flame_sheet]]\nposition = [0, 0, 5]\nsparks.rate = 300\n"),
    ("a soot field", "[[flame_sheet]]\nposition = [0.2, 0, 4]\nmethod = \"soot_field\"\n"),
    (
        "gas with sparks",
        "[[flame_particles]]\nposition = [0, 0.5, 5]\nparticles = 1500\npreroll_s = 0.5\nrendering.sparks.rate = 200\n",
    ),
    ("an aurora", "[[aurora]]\n"),
    (
        "obstacles",
        "[[light]]\nposition = [0, 5, 2]\nintensity = 3000\n[[obstacle]]\nshape = \"box\"\nposition = [0, 1, 4]\nsize = [1, 1, 1]\nvisible = true\n\
                   [[obstacle]]\nposition = [0, 5, 0.3]\nradius = 1\nvisible = true\n",
    ),
    ("ground and lamp", "[ground]\nwetness = 1\n[[light]]\nposition = [0, 3, 6]\nintensity = 3000\nvisible = true\n"),
    ("stars", "[sky]\nkind = \"night\"\n"),
    (
        "rain around lamps",
        "[[light]]\nposition = [0, 2, 6]\nintensity = 3000\n[[light]]\nposition = [-0.6, 1.2, 4]\nintensity = 300\n[[rain]]\nrate_mm_per_h = 100\n",
    ),
];

/// Every plane of a frame, by its name.
fn planes(frame: &Frame) -> Vec<(String, Vec<f32>)> {
    let beauty = ["R", "G", "B", "A"].into_iter().enumerate();
    let mut planes: Vec<(String, Vec<f32>)> =
        beauty.map(|(c, name)| (name.into(), frame.beauty.pixels().iter().map(|pixel| pixel[c]).collect())).collect();
    planes.extend(frame.depth.clone().map(|depth| ("Z".into(), depth)));
    planes.extend(frame.channels.iter().map(|channel| (channel.name.clone(), channel.values.clone())));
    planes
}

#[test]
fn a_panorama_that_turns_by_half_a_circle_is_rolled_by_half_in_every_layer_and_aov() {
    const SIZE: [usize; 2] = [512, 256];
    let mut faults = Vec::new();
    for (name, tables) in AT_THE_SEAM {
        let [ahead, back] = [-10, 10].map(|z| {
            let sky = if tables.contains("[sky]") || tables.contains("aurora") { "" } else { "[sky]\nluminance = 0.01\n" };
            let text = format!(
                "bansho = 2\n[picture]\nsize = {SIZE:?}\nframes = 1\nexposure_ev100 = 2\n[camera]\nlens = \"panorama\"\n\
                 position = [0, 1.6, 0]\ntarget = [0, 1.6, {z}]\nshutter_s = 0.033\n[wind]\nvelocity = [8, 0, 0]\n{sky}{tables}"
            );
            planes(&frame(&text).0)
        });
        assert_eq!(ahead.len(), back.len());
        for ((plane, a), (_, b)) in ahead.iter().zip(&back) {
            let rolled = |i: usize| b[i / SIZE[0] * SIZE[0] + (i % SIZE[0] + SIZE[0] / 2) % SIZE[0]];
            let differs = |i: &usize| {
                let (a, b) = (a[*i], rolled(*i));
                let is_close = (a - b).abs() <= 2e-3 * a.abs().max(b.abs()).max(0.01);
                a != b && !is_close
            };
            let differing: Vec<usize> = (0..a.len()).filter(differs).collect();
            if let Some(first) = differing.first() {
                let (x, y) = (first % SIZE[0], first / SIZE[0]);
                let place = format!("first {x}, {y}: {} and {}", a[*first], rolled(*first));
                faults.push(format!("{name}, {plane}: {} pixels differ, {place}", differing.len()));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
