//! Lamps: discs, glare, cones and what hides them.

use bansho_base::{
    camera::CameraParameters,
    host::observer::Unobserved,
    image::Rect,
    math::DVec3,
    phenomenon::{
        Run,
        strip::{DepthInterval, Shutter, Strip, View},
        surroundings::{Emitter, Light, Surroundings},
    },
    world::wind::{Wind, WindParameters},
};

use super::{model::*, render::*};

/// The picture's sum of luminance times solid angle, times distance squared: the intensity that the camera sees.
fn intensity_seen(distance: f64, radius: f64, emitter: Emitter) -> f64 {
    let lamp = Lamp { light: Light { emitter, intensity: [50.0; 3] }, radius };
    let lamps = Lamps::new(move |_| vec![lamp]);
    let camera = CameraParameters {
        position: [0.0, 0.0, distance].into(),
        target: [0.0; 3].into(),
        ..CameraParameters::default()
    };
    let view = View::new(camera, Shutter { open: 0.0, close: 0.0 }, 0.0, [64, 64], 0);
    let wind = Wind::new(WindParameters::default(), 1, None);
    let surroundings = Surroundings::from_wind(&wind);
    let mut strip = Strip::default();
    strip.reset(Rect::from_size(64, 64), None, 0);
    lamps.prepare(&view, &surroundings, &Unobserved).unwrap().draw(&DepthInterval::ALL, &mut strip);
    let pixel = distance / view.camera.focal_pixels;
    strip.radiance[1].iter().map(|value| f64::from(*value)).sum::<f64>() * pixel * pixel
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
    f64::from(glare.at_sixteen([angle as f32, 0.0, 0.0])[0])
}

#[test]
fn glare_is_its_share_of_the_light_and_falls_with_the_cube_of_the_angle() {
    let (steps, end) = (200_000, GLARE_ANGLES[1]);
    for radius in [0.0, 0.01, 0.05] {
        let glare = Glare::new(radius);
        let ring = |i: u32| {
            let angle = end * (f64::from(i) + 0.5) / f64::from(steps);
            at(&glare, angle) * 2.0 * std::f64::consts::PI * angle * end / f64::from(steps)
        };
        let whole: f64 = (0..steps).map(ring).sum();
        assert!((whole / GLARE_FRACTION - 1.0).abs() < 1e-4, "{radius}: {whole}");
        assert!(at(&glare, end) < 1e-9 * at(&glare, 0.0));
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
