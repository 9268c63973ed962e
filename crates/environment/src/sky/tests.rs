//! The sky: radiance, stars, trails, hills, crops.

use std::sync::PoisonError;

use bansho_base::{
    camera::CameraParameters,
    host::observer::Unobserved,
    image::Rect,
    math::{self, DVec2, curve::Interpolation},
    parameters::animated::Animated,
    phenomenon::{
        Run,
        strip::{DepthInterval, Shutter, Strip, View},
        surroundings::Surroundings,
    },
    world::{
        sky::SkyKind,
        wind::{Wind, WindParameters},
    },
};

use super::{render::FAR, *};

/// Light of a night sky through a camera that turns by an angle in degrees during the exposure: green, row by row.
fn night_seen(turn_deg: f64, hills_deg: f64) -> Vec<f32> {
    let parameters = SkyParameters { kind: SkyKind::Night, hills_deg, ..SkyParameters::default() };
    let backdrop = SkyBackdrop::new(parameters.clone(), 3);
    let [x, z] = [math::sin(turn_deg.to_radians()) * 60.0, math::cos(turn_deg.to_radians()) * -60.0];
    let keys = vec![(0.0, [0.0, 30.0, -60.0]), (1.0, [x, 30.0, z])];
    let camera = CameraParameters {
        position: [0.0; 3].into(),
        target: Animated::keyed(keys, Interpolation::Linear).unwrap(),
        vertical_fov_deg: 60.0.into(),
        ..CameraParameters::default()
    };
    let view = View::new(camera, Shutter { open: 0.0, close: 1.0 }, 0.0, [240, 160], 0);
    let wind = Wind::new(WindParameters::default(), 1, None);
    let surroundings = Surroundings { sky: parameters.at(0.5), ..Surroundings::from_wind(&wind) };
    let prepared = backdrop.prepare(&view, &surroundings, &Unobserved).unwrap();
    let mut strip = Strip::default();
    strip.reset(Rect::from_size(240, 160), None, 0);
    prepared.draw(&DepthInterval::ALL, &mut strip);
    assert!((0..strip.len()).all(|pixel| strip.transmittance(pixel)[1] < 1e-5), "the sky is opaque");
    strip.radiance[1].clone()
}

#[test]
fn stars_draw_trails_where_the_camera_turns() {
    let [still, turning] = [0.0, 6.0].map(|turn| night_seen(turn, 0.0));
    let brightest = |light: &[f32]| light.iter().fold(0.0_f32, |most, value| most.max(*value));
    let sum = |light: &[f32]| light.iter().map(|value| f64::from(*value)).sum::<f64>();
    // 6 degrees are some 15 pixels; a star's light is spread over them, and none is lost.
    assert!(brightest(&turning) < 0.3 * brightest(&still), "{} {}", brightest(&turning), brightest(&still));
    assert!((sum(&turning) / sum(&still) - 1.0).abs() < 0.15, "{}", sum(&turning) / sum(&still));
}

#[test]
fn hills_are_soft_where_the_camera_turns() {
    // Neighbors along a row differ most at the edges of the hills.
    let steepest = |light: Vec<f32>| {
        let rows = light.chunks(240).skip(120);
        let steps = rows.flat_map(|row| row.windows(2).map(|pair| (pair[0] - pair[1]).abs()).collect::<Vec<_>>());
        steps.fold(0.0_f32, f32::max)
    };
    let [still, turning] = [0.0, 6.0].map(|turn| steepest(night_seen(turn, 12.0)));
    assert!(turning < 0.5 * still, "{turning} {still}");
}

/// Light of a night sky in a crop of a picture in which the plate hides every third pixel.
fn night_in(backdrop: &SkyBackdrop, rect: Rect, has_plate: bool) -> [Vec<f32>; 3] {
    let camera = CameraParameters {
        position: [0.0; 3].into(),
        target: [0.0, 30.0, -60.0].into(),
        vertical_fov_deg: 60.0.into(),
        ..CameraParameters::default()
    };
    let view = View::new(camera, Shutter { open: 0.0, close: 0.0 }, 0.0, [150, 90], 0);
    let wind = Wind::new(WindParameters::default(), 1, None);
    let surroundings = Surroundings { sky: backdrop.parameters.at(0.0), ..Surroundings::from_wind(&wind) };
    let prepared = backdrop.prepare(&view, &surroundings, &Unobserved).expect("nobody asks to stop");
    let depths: Vec<f32> = (0..150 * 90).map(|pixel| if pixel % 3 == 0 { 5.0 } else { f32::INFINITY }).collect();
    let mut strip = Strip::default();
    let rows = |y: usize| &depths[150 * y..150 * (y + 1)];
    strip.reset(rect, has_plate.then_some(&rows), 0);
    prepared.draw(&DepthInterval::ALL, &mut strip);
    strip.radiance
}

/// A northern night sky drawn without stars and Milky Way, and its view of 150 x 90 pixels.
fn northern_night(parameters: SkyParameters) -> (View, Sky, Strip) {
    let night = NightParameters { stars: 0.0, milky_way: 0.0, ..parameters.night };
    let parameters = SkyParameters { kind: SkyKind::Night, night, ..parameters };
    let camera = CameraParameters {
        position: [0.0, 2.0, 0.0].into(),
        target: [0.0, 14.0, -60.0].into(),
        vertical_fov_deg: 60.0.into(),
        ..CameraParameters::default()
    };
    let view = View::new(camera, Shutter { open: 0.0, close: 0.0 }, 0.0, [150, 90], 0);
    let wind = Wind::new(WindParameters::default(), 1, None);
    let (sky, backdrop) = (parameters.at(0.0), SkyBackdrop::new(parameters, 3));
    let surroundings = Surroundings { sky, ..Surroundings::from_wind(&wind) };
    let mut strip = Strip::default();
    strip.reset(Rect::from_size(150, 90), None, 0);
    backdrop.prepare(&view, &surroundings, &Unobserved).unwrap().draw(&DepthInterval::ALL, &mut strip);
    (view, sky, strip)
}

#[test]
fn the_glow_of_a_town_is_drawn_as_it_lights_the_scene() {
    let town =
        TownParameters { population: 30_000.0, azimuth_deg: 10.0, distance_km: 18.0, ..TownParameters::default() };
    let night = NightParameters { town, ..NightParameters::default() };
    let (view, sky, strip) = northern_night(SkyParameters { night, ..SkyParameters::default() });
    let (mut compared, mut brightest) = (0, (0.0_f32, 0.0));
    for pixel in 0..150 * 90 {
        let center = DVec2::new((pixel % 150) as f64 + 0.5, (pixel / 150) as f64 + 0.5);
        let direction = view.camera.direction(center).unwrap().normalize();
        // The lowest half degree is a pixel high, in which the glow is not linear.
        if direction.y > 0.01 {
            let expected = sky.radiance(direction);
            for c in 0..3 {
                let ratio = strip.radiance[c][pixel] / expected[c];
                assert!((ratio - 1.0).abs() < 0.03, "{ratio} at {direction}");
            }
            compared += 1;
            if expected[0] > brightest.0 {
                brightest = (expected[0], math::atan2(direction.x, -direction.z).to_degrees());
            }
        }
    }
    assert!(compared > 8000, "{compared}");
    assert!((brightest.1 - 10.0).abs() < 1.0, "the glow stands at {} degrees", brightest.1);
}

#[test]
fn far_mountains_are_lighter_by_night_and_have_their_own_depth() {
    let parameters = SkyParameters { hills_deg: 14.0, hills_form: HillForm::Mountains, ..SkyParameters::default() };
    let near = parameters.hills_distance as f32;
    let (_, _, strip) = northern_night(parameters);
    let mut means = [[0.0_f64; 2]; 3];
    for (depth, green) in strip.depth.iter().zip(&strip.radiance[1]) {
        let range = [1.0, 2.4, 5.0].iter().position(|distance| (depth / (near * distance) - 1.0).abs() < 1e-3);
        if let Some(range) = range {
            means[range][0] += f64::from(*green);
            means[range][1] += 1.0;
        }
    }
    assert!(means.iter().all(|[_, pixels]| *pixels > 50.0), "{means:?}");
    let [first, second, third] = means.map(|[sum, pixels]| sum / pixels);
    assert!(second > 1.2 * first && third > 1.2 * second, "{first} {second} {third}");
}

#[test]
fn a_sky_that_is_shown_again_is_the_same() {
    let parameters = SkyParameters { kind: SkyKind::Night, ..SkyParameters::default() };
    let shown = SkyBackdrop::new(parameters.clone(), 3);
    let whole = Rect::from_size(150, 90);
    for (rect, has_plate) in [
        (whole, false),
        (whole, false),
        (Rect { x: 37, y: 11, width: 50, height: 30 }, false),
        (whole, true),
        (Rect { y: 40, height: 8, ..whole }, false),
    ] {
        let first = night_in(&SkyBackdrop::new(parameters.clone(), 3), rect, has_plate);
        assert!(night_in(&shown, rect, has_plate) == first, "{rect:?}, plate: {has_plate}");
        assert_eq!(first[1].contains(&0.0), has_plate);
    }
    let cached = shown.cache.lock().unwrap_or_else(PoisonError::into_inner);
    let rows = cached.as_ref().and_then(|cache| cache.rows.clone()).expect("it was shown again");
    assert!(rows.iter().all(|row| row.get().is_some()));
}

#[test]
fn it_fills_the_picture_behind_everything_and_hides_what_is_behind_it() {
    let parameters = SkyParameters { luminance: Animated::from(300.0), ..SkyParameters::default() };
    let backdrop = SkyBackdrop::new(parameters.clone(), 1);
    let shutter = Shutter { open: 0.0, close: 0.0 };
    let view = View::new(CameraParameters::default(), shutter, 0.0, [16, 8], 0);
    let wind = Wind::new(WindParameters::default(), 1, None);
    let surroundings = Surroundings { sky: parameters.at(0.0), ..Surroundings::from_wind(&wind) };
    let prepared = backdrop.prepare(&view, &surroundings, &Unobserved).unwrap();
    let mut strip = Strip::default();
    strip.reset(Rect::from_size(16, 8), None, 0);
    prepared.draw(&FAR, &mut strip);
    assert!(strip.radiance[1].iter().all(|value| *value > 0.0));
    assert_eq!(strip.transmittance(77), [0.0; 3]);
    assert!(prepared.bounds(&DepthInterval { near: 0.0, far: 1e6 }).is_empty());
    assert!(strip.radiance[1][0] > strip.radiance[1][16 * 7], "an overcast sky is brighter above");
}
