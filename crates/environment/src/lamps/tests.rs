//! Lamps: discs, glare, cones and what hides them.

use bansho_base::{
    camera::{Camera, CameraParameters, Lens, angular_distance::chord},
    host::observer::Unobserved,
    image::Rect,
    math::{self, DVec2, DVec3},
    phenomenon::{
        Run,
        strip::{DepthInterval, Shutter, Strip, View},
        surroundings::{Emitter, Light, Surroundings},
    },
    world::wind::{Wind, WindParameters},
};

use super::{render::*, *};

/// A picture of one lamp of 50 cd: its camera and its luminance, row by row.
fn picture(camera: CameraParameters, size: [usize; 2], lamp: Lamp) -> (Camera, Vec<f32>) {
    let lamps = Lamps::new(move |_| vec![lamp]);
    let view = View::new(camera, Shutter { open: 0.0, close: 0.0 }, 0.0, size, 0);
    let wind = Wind::new(WindParameters::default(), 1, None);
    let surroundings = Surroundings::from_wind(&wind);
    let mut strip = Strip::default();
    strip.reset(Rect::from_size(size[0], size[1]), None, 0);
    lamps.prepare(&view, &surroundings, &Unobserved).unwrap().draw(&DepthInterval::ALL, &mut strip);
    (view.camera, strip.radiance[1].clone())
}

/// Sum of luminance times solid angle over a picture, lux.
fn illuminance((camera, luminance): &(Camera, Vec<f32>)) -> f64 {
    let width = camera.size[0] as usize;
    let center = |i: usize| DVec2::new((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
    luminance.iter().enumerate().map(|(i, value)| f64::from(*value) * camera.pixel_solid_angle(center(i))).sum()
}

/// The intensity that a camera sees of a lamp in the middle of its picture, cd.
fn intensity_seen(distance: f64, radius: f64, emitter: Emitter) -> f64 {
    let camera = CameraParameters {
        position: [0.0, 0.0, distance].into(),
        target: [0.0; 3].into(),
        ..CameraParameters::default()
    };
    let lamp = Lamp { light: Light { emitter, intensity: [50.0; 3] }, radius };
    illuminance(&picture(camera, [64, 64], lamp)) * distance * distance
}

/// Cameras of all lenses that look at the horizon, with pictures that cover most directions.
fn cameras() -> Vec<(CameraParameters, [usize; 2])> {
    let camera = |lens, fov: f64| CameraParameters {
        lens,
        position: [0.0; 3].into(),
        target: [0.0, 0.0, -1.0].into(),
        vertical_fov_deg: fov.into(),
        fisheye_fov_deg: fov,
        ..CameraParameters::default()
    };
    vec![
        (camera(Lens::Perspective, 150.0), [600, 600]),
        (camera(Lens::Fisheye, 220.0), [500, 500]),
        (camera(Lens::Fisheye, 360.0), [600, 600]),
        (camera(Lens::Panorama, 180.0), [640, 320]),
    ]
}

/// The lamp in this direction, 10 m away.
fn lamp_toward(direction: DVec3, radius: f64) -> Lamp {
    let emitter = Emitter::Point { position: direction.normalize() * 10.0, radius };
    Lamp { light: Light { emitter, intensity: [50.0; 3] }, radius }
}

#[test]
fn a_lamp_gives_the_same_illuminance_through_every_lens_in_every_direction() {
    let degrees = [0.0_f64, 30.0, 60.0, 75.0, 90.0, 120.0, 150.0, 179.0, 180.0];
    for ((camera, size), angle) in cameras().into_iter().flat_map(|camera| degrees.map(|angle| (camera.clone(), angle)))
    {
        let limit = match camera.lens {
            Lens::Perspective => 60.0,
            Lens::Fisheye => 0.5 * camera.fisheye_fov_deg - 10.0,
            Lens::Panorama => 180.0,
        };
        let is_whole = camera.lens == Lens::Fisheye && camera.fisheye_fov_deg == 360.0;
        if angle > limit && !is_whole {
            continue;
        }
        let (sin, cos) = math::sin_cos(angle.to_radians());
        // To the right, upward and between, for lamps from far below a pixel to dozens of pixels.
        for toward in [DVec3::new(sin, 0.0, -cos), DVec3::new(0.0, sin, -cos), DVec3::new(0.6 * sin, 0.8 * sin, -cos)] {
            for radius in [0.001_f64, 0.1, 0.5, 2.0] {
                let seen = illuminance(&picture(camera.clone(), size, lamp_toward(toward, radius)));
                // What the edge of a near sphere adds, see `project_lamp`.
                let oblique = 2.0 / (1.0 + math::sqrt(1.0 - 0.01 * radius * radius));
                let ratio = seen / 0.5 / oblique;
                assert!((ratio - 1.0).abs() < 0.012, "{:?} {toward} radius {radius}: {ratio}", camera.lens);
            }
        }
    }
}

#[test]
fn the_disc_of_a_lamp_is_the_image_of_a_sphere() {
    for (camera, size) in cameras() {
        for toward in [DVec3::new(0.7, 0.7, -0.3), DVec3::new(0.02, 1.0, -0.1), DVec3::new(0.0, 0.4, 1.0)] {
            let (camera, luminance) = picture(camera.clone(), size, lamp_toward(toward, 3.0));
            let expected = 50.0 / (std::f64::consts::PI * 9.0);
            for (i, value) in luminance.iter().enumerate() {
                let pixel = DVec2::new((i % size[0]) as f64 + 0.5, (i / size[0]) as f64 + 0.5);
                let Some(direction) = camera.direction(pixel) else { continue };
                // Angle of the line of sight from the center.
                let distance = math::acos(direction.normalize().dot(toward.normalize()).clamp(-1.0, 1.0));
                let pixel_angle = 1.0 / camera.focal_pixels;
                let edge = math::asin(0.3);
                // The glare of so large a lamp has 2 % of its luminance.
                let is_right = if distance < edge - pixel_angle {
                    (f64::from(*value) / expected - 1.0).abs() < 0.03
                } else {
                    distance < edge + pixel_angle || f64::from(*value) < 0.03 * expected
                };
                assert!(is_right, "{:?} {toward}: {value} of {expected} at {pixel}", camera.lens);
            }
        }
    }
}

#[test]
fn a_panorama_that_turns_by_half_a_circle_is_rolled_by_half() {
    let (forward, size) = cameras().pop().unwrap();
    let backward = CameraParameters { target: [0.0, 0.0, 1.0].into(), ..forward.clone() };
    for toward in [DVec3::new(0.01, 0.3, 1.0), DVec3::new(0.01, 5.0, 1.0), DVec3::new(1.0, -0.5, 0.2)] {
        for radius in [0.05, 1.5] {
            let lamp = lamp_toward(toward, radius);
            let [(_, a), (_, b)] = [&forward, &backward].map(|camera| picture(camera.clone(), size, lamp));
            for (i, value) in a.iter().enumerate() {
                let rolled = b[i / size[0] * size[0] + (i % size[0] + size[0] / 2) % size[0]];
                assert!((value - rolled).abs() <= 1e-4 * value.max(1e-3), "{toward} {i}: {value} {rolled}");
            }
        }
    }
}

#[test]
fn a_lamp_sends_its_intensity_to_the_camera_however_small_it_looks() {
    let point = Emitter::Point { position: DVec3::ZERO, radius: 0.1 };
    for (distance, radius) in [(5.0, 0.5), (20.0, 0.1), (500.0, 0.1)] {
        let seen = intensity_seen(distance, radius, point);
        assert!((seen / 50.0 - 1.0).abs() < 0.02, "{seen} cd at {distance} m");
    }
}

/// The glare at an angle from a lamp, radians.
fn at(glare: &Glare, angle: f64) -> f64 {
    let chord = chord(angle) as f32;
    f64::from(glare.at_sixteen([chord * chord; 16])[0])
}

#[test]
fn glare_is_its_share_of_the_light_and_falls_with_the_cube_of_the_angle() {
    let (steps, end) = (200_000, GLARE_ANGLES[1]);
    for radius in [0.0, 0.01, 0.05] {
        let glare = Glare::new(radius);
        let ring = |i: u32| {
            let angle = end * (f64::from(i) + 0.5) / f64::from(steps);
            at(&glare, angle) * 2.0 * std::f64::consts::PI * math::sin(angle) * end / f64::from(steps)
        };
        let whole: f64 = (0..steps).map(ring).sum();
        assert!((whole / GLARE_FRACTION - 1.0).abs() < 1e-4, "{radius}: {whole}");
        assert_eq!(at(&glare, 1.001 * end), 0.0);
    }
    let small = Glare::new(0.0);
    let fade = |angle: f64| {
        let left = 1.0 - angle * angle / Glare::END;
        left * left
    };
    let fall = at(&small, 0.02) / fade(0.02) / (at(&small, 0.01) / fade(0.01));
    assert!((fall - 0.125).abs() < 0.01, "{fall}");
}

#[test]
fn a_spot_shines_into_its_cone_and_is_just_seen_from_elsewhere() {
    let spot = |axis| Emitter::Spot { position: DVec3::ZERO, axis, cos_inner: 0.9, cos_outer: 0.8 };
    assert!(intensity_seen(5.0, 0.2, spot(DVec3::Z)) > 40.0);
    assert!((intensity_seen(5.0, 0.2, spot(-DVec3::Z)) - 50.0 * STRAY_LIGHT).abs() < 0.02);
}
