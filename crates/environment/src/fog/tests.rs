//! Fog as it is drawn.

use bansho_base::{
    camera::CameraParameters,
    host::observer::Unobserved,
    image::Rect,
    math::{self, DVec3},
    phenomenon::{
        Run,
        strip::{DepthInterval, Shutter, Strip, View},
        surroundings::{Emitter, Light, Occluder, Surroundings},
    },
    world::{
        sky::{Sky, SkyKind},
        wind::{Wind, WindParameters},
    },
};

use super::Fog;

const SIZE: [usize; 2] = [16, 9];

fn view() -> View {
    let camera = CameraParameters {
        position: [0.0, 1.5, 0.0].into(),
        target: [0.0, 1.5, -1.0].into(),
        vertical_fov_deg: 40.0.into(),
        ..CameraParameters::default()
    };
    View::new(camera, Shutter { open: 0.0, close: 0.0 }, 0.04, SIZE, 0)
}

/// Light and transmittance of the pixels of fog in some slices.
fn drawn(visibility_m: f64, surroundings: &Surroundings, slices: &[f64], plate: Option<f32>) -> Vec<[f32; 2]> {
    drawn_by(&Fog::new(visibility_m.into()), surroundings, slices, plate)
}

/// As [`drawn`], by fog that may have been drawn before.
fn drawn_by(fog: &Fog, surroundings: &Surroundings, slices: &[f64], plate: Option<f32>) -> Vec<[f32; 2]> {
    let view = view();
    let prepared = fog.prepare(&view, surroundings, &Unobserved).unwrap();
    let rect = Rect::from_size(SIZE[0], SIZE[1]);
    let row = plate.map(|depth| vec![depth; SIZE[0]]);
    let mut strip = Strip::default();
    match &row {
        Some(row) => strip.reset(rect, Some(&|_| row.as_slice()), 0),
        None => strip.reset(rect, None, 0),
    }
    for pair in slices.windows(2) {
        prepared.draw(&DepthInterval { near: pair[0], far: pair[1] }, &mut strip);
    }
    (0..strip.len()).map(|index| [strip.radiance[1][index], strip.transmittance(index)[1]]).collect()
}

fn wind() -> Wind {
    Wind::new(WindParameters::default(), 1, None)
}

/// The pixel in the middle, which looks along the horizon.
const MIDDLE: usize = SIZE[0] * (SIZE[1] / 2) + SIZE[0] / 2;

#[test]
fn at_the_visibility_two_percent_of_what_is_behind_are_left_and_the_rest_is_sky() {
    let wind = wind();
    let sky = Sky::new(SkyKind::Uniform, 300.0, 7000.0);
    let surroundings = Surroundings { sky, ..Surroundings::from_wind(&wind) };
    let horizon = sky.radiance(-DVec3::Z)[1];
    let [light, left] = drawn(200.0, &surroundings, &[0.0, f64::INFINITY], Some(200.0))[MIDDLE];
    // The pixel is 1.25 degrees beside the axis, so that it is a little farther.
    assert!((left - 0.02).abs() < 1e-4, "{left}");
    assert!((light / horizon - 0.98).abs() < 1e-3, "{light} of {horizon}");
    let [light, left] = drawn(200.0, &surroundings, &[0.0, f64::INFINITY], None)[MIDDLE];
    assert_eq!((left, (light / horizon - 1.0).abs() < 1e-5), (0.0, true), "endless fog hides everything");
}

#[test]
fn slices_show_the_same_fog_as_one() {
    let wind = wind();
    let lamp = Emitter::Point { position: DVec3::new(0.3, 2.0, -7.0), radius: 0.05 };
    let mut surroundings =
        Surroundings { sky: Sky::new(SkyKind::Overcast, 2.0, 7000.0), ..Surroundings::from_wind(&wind) };
    surroundings.others.lights.push(Light { emitter: lamp, intensity: [200.0; 3] });
    surroundings.others.occluders.push(Occluder::HalfSpace { point: DVec3::ZERO, normal: DVec3::Y });
    let whole = drawn(80.0, &surroundings, &[0.0, f64::INFINITY], None);
    let sliced = drawn(80.0, &surroundings, &[0.0, 2.0, 6.9, 7.1, 40.0, 1e12, f64::INFINITY], None);
    for (index, (one, many)) in whole.iter().zip(&sliced).enumerate() {
        assert!((many[0] / one[0] - 1.0).abs() < 0.03, "{index}: {} and {}", one[0], many[0]);
        assert!((many[1] - one[1]).abs() < 1e-5, "{index}: {} and {}", one[1], many[1]);
    }
    // Below the horizon, the fog ends at the ground: 1.5 m below the camera, in the lowest row about 17.8 degrees down.
    let lowest = whole[SIZE[0] * (SIZE[1] - 1) + SIZE[0] / 2];
    let distance = 1.5 / math::sin(17.8_f64.to_radians());
    let expected = math::exp(-super::scattering::extinction(80.0) * distance);
    assert!((f64::from(lowest[1]) - expected).abs() < 0.01, "{} and {expected}", lowest[1]);
}

#[test]
fn a_second_frame_has_the_fog_of_a_first_one_also_where_a_solid_has_moved() {
    let wind = wind();
    let lamp = Emitter::Point { position: DVec3::new(0.3, 2.0, -7.0), radius: 0.05 };
    let mut surroundings =
        Surroundings { sky: Sky::new(SkyKind::Overcast, 2.0, 7000.0), ..Surroundings::from_wind(&wind) };
    surroundings.others.lights.push(Light { emitter: lamp, intensity: [200.0; 3] });
    let (slices, visibility_m) = ([0.0, 6.9, f64::INFINITY], 80.0);
    let fog = Fog::new(visibility_m.into());
    let depths = [Some(9.0), Some(9.0), Some(5.0), None];
    for plate in depths {
        let expected = drawn(visibility_m, &surroundings, &slices, plate);
        assert_eq!(drawn_by(&fog, &surroundings, &slices, plate), expected, "{plate:?}");
    }
    surroundings.others.lights[0].intensity = [20.0; 3];
    for plate in depths {
        let expected = drawn(visibility_m, &surroundings, &slices, plate);
        assert_eq!(drawn_by(&fog, &surroundings, &slices, plate), expected, "another light, {plate:?}");
    }
}
