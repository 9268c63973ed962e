//! Rain in the light of lamps.

use bansho_base::{
    image::Rect,
    math::{self, DVec3},
    phenomenon::{
        Prepared,
        strip::{DepthInterval, Strip},
        surroundings::{Emitter, Light, Publication, Surroundings},
    },
};

use super::{METHODS, Method, draw, draw_part, draw_with, lamp, lit, rain, streaks, view_at, wind};
use crate::{
    RainParameters,
    lighting::{
        LightCaches,
        drop_lighting::{DropLighting, ScatteringTable},
        drop_phase_function::DropPhaseFunction,
        lamp_shadows::LampShadows,
    },
    render::PreparedRain,
};

const SIZE: [usize; 2] = [160, 90];

fn lit_by(parameters: RainParameters, lights: Vec<Light>, white: Option<f64>) -> Strip {
    let calm = wind([0.0; 3], 0.0);
    let others = Publication { lights, ..Publication::default() };
    let surroundings = Surroundings { others, ..Surroundings::from_wind(&calm) };
    let mut view = view_at(1.0, 1.0 / 60.0, SIZE);
    view.white_luminance = white;
    draw(&rain(parameters, 1), &view, &surroundings)
}

#[test]
fn along_a_beam_light_falls_with_the_square_of_the_distance() {
    let scattering = ScatteringTable::new(&DropPhaseFunction::new());
    let spot = Emitter::Spot { position: DVec3::ZERO, axis: DVec3::X, cos_inner: 0.95, cos_outer: 0.9 };
    let lights = [Light { emitter: spot, intensity: [1000.0; 3] }];
    let shadows = LampShadows::default();
    let lighting = DropLighting { scattering: &scattering, lights: &lights, shadows: &shadows, extinction: 0.0 };
    // Seen from the side, so that every drop turns the light by the same angle.
    let samples: Vec<[f64; 2]> = (1..40)
        .map(|i| {
            let distance = 0.5 * f64::from(i);
            let radiance = lighting.radiance(&lights[0], DVec3::X * distance, -DVec3::Z)[1];
            [math::ln(distance), math::ln(f64::from(radiance))]
        })
        .collect();
    let count = samples.len() as f64;
    let mean = |k: usize| samples.iter().map(|sample| sample[k]).sum::<f64>() / count;
    let (x, y) = (mean(0), mean(1));
    let covariance: f64 = samples.iter().map(|sample| (sample[0] - x) * (sample[1] - y)).sum();
    let exponent = -covariance / samples.iter().map(|sample| (sample[0] - x) * (sample[0] - x)).sum::<f64>();
    bansho_base::assert_measured!("section 5.2: light: exponent", exponent, 2.0, 0.005);
}

#[test]
fn twice_the_fire_is_twice_the_light_of_streaks_and_airlight() {
    for method in METHODS {
        let parameters = || RainParameters { method, ..RainParameters::default() };
        let [once, twice] = [300.0, 600.0].map(|power| lit_by(parameters(), vec![lamp([0.5, 1.0, -3.0], power)], None));
        let sum = |strip: &Strip| strip.radiance[0].iter().map(|value| f64::from(*value)).sum::<f64>();
        assert!(sum(&once) > 0.0 && (sum(&twice) / sum(&once) - 2.0).abs() < 1e-5);
        for (once, twice) in once.radiance[2].iter().zip(&twice.radiance[2]) {
            assert!((twice - 2.0 * once).abs() <= 1e-4 * twice.abs().max(1e-3));
        }
    }
}

#[test]
fn culling_changes_no_pixel_by_a_255th() {
    let lights = || vec![lamp([2.0, 4.0, -3.0], 200.0)];
    let white = 2.0;
    let parameters = |culling| RainParameters {
        culling,
        simplification_codes: 0.0,
        rate_mm_per_h: 100.0.into(),
        ..streaks(Method::Billboards, 100.0)
    };
    let (culled, all) =
        (lit_by(parameters(true), lights(), Some(white)), lit_by(parameters(false), lights(), Some(white)));
    let mut differ = 0;
    for index in 0..all.len() {
        for c in 0..3 {
            let difference = f64::from((culled.radiance[c][index] - all.radiance[c][index]).abs());
            assert!(difference <= white / 255.0, "{difference}");
            differ += usize::from(difference > 0.0);
        }
        assert_eq!(culled.transmittance(index), all.transmittance(index));
    }
    assert!(differ > 0, "nothing was culled");
}

/// Mean radiance and transmittance of each block of 40 x 45 pixels, over some frames.
fn block_means(simplification_codes: f64) -> Vec<[f64; 2]> {
    const COLUMNS: usize = 8;
    const ROWS: usize = 4;
    const FRAMES: usize = 6;
    let calm = wind([1.0, 0.0, 0.0], 0.3);
    let parameters = RainParameters { simplification_codes, distance: 20.0, ..streaks(Method::Billboards, 100.0) };
    let rain = rain(parameters, 1);
    let mut sums = vec![[0.0; 2]; COLUMNS * ROWS];
    for frame in 0..FRAMES {
        let mut view = view_at(1.0 + 0.3 * frame as f64, 1.0 / 60.0, [320, 180]);
        view.white_luminance = Some(40.0);
        let surroundings = lit(&calm);
        let caches = LightCaches::default();
        let prepared = PreparedRain::new(&rain, &caches, &view, &surroundings);
        let mut strip = Strip::default();
        strip.reset(Rect::from_size(320, 180), None, 0);
        prepared.draw(&DepthInterval::ALL, &mut strip);
        for index in 0..strip.len() {
            let (x, y) = (index % 320 * COLUMNS / 320, index / 320 * ROWS / 180);
            let block = &mut sums[y * COLUMNS + x];
            let weight = (COLUMNS * ROWS) as f64 / (FRAMES * strip.len()) as f64;
            block[0] += weight * f64::from(strip.radiance[1][index]);
            block[1] += weight * f64::from(strip.transmittance(index)[1]);
        }
    }
    sums
}

#[test]
fn simplified_billboards_shine_and_block_as_much_as_all_their_drops() {
    let [all, simplified] = [0.0, 1.5].map(block_means);
    assert_ne!(all, simplified);
    for ([light, transmittance], [simplified_light, simplified_transmittance]) in all.iter().zip(&simplified) {
        let opacity_ratio = (1.0 - simplified_transmittance) / (1.0 - transmittance);
        assert!((simplified_light / light - 1.0).abs() < 0.04, "{light} {simplified_light}");
        assert!((opacity_ratio - 1.0).abs() < 0.04, "{transmittance} {simplified_transmittance}");
    }
    let total = |blocks: &[[f64; 2]]| blocks.iter().map(|block| block[0]).sum::<f64>();
    assert!((total(&simplified) / total(&all) - 1.0).abs() < 0.01, "{} {}", total(&simplified), total(&all));
}

#[test]
fn the_densest_airlight_around_lamps_stays_finite() {
    let light = lamp([0.2, 1.0, -3.0], 1e6);
    let thick = RainParameters {
        rate_mm_per_h: 300.0.into(),
        airlight_distance: 5000.0,
        opacity_gain: 20.0,
        ..streaks(Method::Drops, 300.0)
    };
    let (view, calm) = (view_at(1.0, 1.0 / 60.0, [48, 27]), wind([0.0; 3], 0.0));
    let others = Publication { lights: vec![light], ..Publication::default() };
    let surroundings = Surroundings { others, ..Surroundings::from_wind(&calm) };
    for slice in [[0.0, 1e5], [800.0, 1600.0], [4000.0, 1e5]] {
        let slice = DepthInterval { near: slice[0], far: slice[1] };
        let strip = draw_part(&rain(thick.clone(), 1), &view, &surroundings, Rect::from_size(48, 27), &slice);
        assert!(strip.radiance.iter().flatten().all(|value| value.is_finite()), "{slice:?}");
    }
}

#[test]
fn the_airlight_is_single_scattering_along_each_line_of_sight() {
    // All drops belong to the medium: none is drawn as a streak.
    let parameters =
        RainParameters { diameters_mm: vec![8.0], airlight_distance: 30.0, ..streaks(Method::Drops, 20.0) };
    let light = lamp([1.0, 3.0, -9.0], 5000.0);
    let strip = lit_by(parameters.clone(), vec![light], None);
    let view = view_at(1.0, 1.0 / 60.0, SIZE);
    let rain = rain(parameters, 1);
    let beta = rain.extinction(1.0).all;
    let (scattering, shadows) = (&rain.optics.scattering, LampShadows::default());
    let lighting = DropLighting { scattering, lights: &[light], shadows: &shadows, extinction: beta };
    let mut largest = 0.0_f64;
    for (x, y) in [(80, 20), (40, 32), (100, 40), (128, 16), (92, 33)] {
        let line = view.camera.direction(math::DVec2::new(x as f64 + 0.5, y as f64 + 0.5)).unwrap().normalize();
        let end = rain.near_reach();
        let steps = 20_000;
        let step = end / f64::from(steps);
        let expected: f64 = (0..steps)
            .map(|i| {
                let at = (f64::from(i) + 0.5) * step;
                let radiance = f64::from(lighting.radiance(&light, view.camera.position + line * at, line)[1]);
                radiance * beta * math::exp(-beta * at) * step
            })
            .sum();
        let found = f64::from(strip.radiance[1][y * SIZE[0] + x]);
        largest = largest.max((found / expected - 1.0).abs());
        let through = f64::from(strip.transmittance(y * SIZE[0] + x)[1]);
        assert!((through - math::exp(-beta * end)).abs() < 2e-3, "{through}");
    }
    bansho_base::assert_measured!(
        "future work: scattering: difference from the sum along a line of sight",
        largest,
        0.0,
        0.02
    );
}

#[test]
fn light_of_lamps_is_scattered_once_while_nothing_changes_and_anew_when_anything_does() {
    let calm = wind([0.0; 3], 0.0);
    let surroundings = |intensity: f32| {
        let others = Publication { lights: vec![lamp([0.5, 2.5, -6.0], intensity)], ..Publication::default() };
        Surroundings { others, ..Surroundings::from_wind(&calm) }
    };
    let rain = rain(RainParameters::default(), 1);
    let radiance = |caches: &LightCaches, t: f64, shift: f64, intensity: f32| {
        let mut view = view_at(t, 1.0 / 60.0, SIZE);
        view.camera.position.x += shift;
        let whole = Rect::from_size(view.size[0], view.size[1]);
        draw_with(&rain, caches, &view, &surroundings(intensity), whole, &DepthInterval::ALL).radiance
    };
    let used = LightCaches::default();
    for (t, shift, intensity) in
        [(1.0, 0.0, 300.0), (2.0, 0.0, 300.0), (2.0, 0.0, 500.0), (2.0, 0.3, 300.0), (1.0, 0.0, 300.0)]
    {
        assert_eq!(
            radiance(&used, t, shift, intensity),
            radiance(&LightCaches::default(), t, shift, intensity),
            "{t} {shift} {intensity}"
        );
    }
    assert_ne!(radiance(&used, 1.0, 0.0, 300.0), radiance(&used, 1.0, 0.0, 500.0));
    assert_eq!(used.lamp_scattering.len(), 2, "of a picture and of its mirror");
}
