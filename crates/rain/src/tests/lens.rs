//! What a drop hides does not depend on the lens: opacity times solid angle is that of its disc, wherever it is, and a panorama has no seam.

use bansho_base::{
    camera::{CameraParameters, Lens},
    math::{DVec2, DVec3},
    parameters::animated::Animated,
    phenomenon::{
        strip::{AovRule, Shutter, Strip, View},
        surroundings::Surroundings,
    },
};

use super::{draw, lit, opacity, rain, streaks, wind};
use crate::{Method, RainParameters};

const ALL_METHODS: [Method; 3] = [Method::Drops, Method::Billboards, Method::Textures];
/// A height above the ground at which there is rain all around.
const HEIGHT: f64 = 20.0;
/// Bands of elevation, from straight down to straight up.
const BANDS: usize = 9;

fn view(lens: Lens, fov_deg: f64, target: [f64; 3], exposure: f64, size: [usize; 2]) -> View {
    let camera = CameraParameters {
        position: Animated::from([0.0, HEIGHT, 0.0]),
        target: Animated::from([target[0], HEIGHT + target[1], target[2]]),
        lens,
        fisheye_fov_deg: fov_deg,
        vertical_fov_deg: Animated::from(if lens == Lens::Perspective { fov_deg } else { 40.0 }),
        ..CameraParameters::default()
    };
    View::new(camera, Shutter { open: 1.0, close: 1.0 + exposure }, 1.2, size, 0)
}

/// The band of a direction; `None` outside of the directions of the test.
fn band(direction: DVec3, seen: fn(DVec3) -> bool) -> Option<usize> {
    let direction = direction.normalize();
    let elevation = bansho_base::math::asin(direction.y.clamp(-1.0, 1.0)) / std::f64::consts::PI + 0.5;
    seen(direction).then_some(((elevation * BANDS as f64) as usize).min(BANDS - 1))
}

/// Opacity times solid angle by elevation, steradian.
fn hidden(strip: &Strip, view: &View, seen: fn(DVec3) -> bool) -> [f64; BANDS] {
    let mut sums = [0.0; BANDS];
    for (index, opacity) in opacity(strip).into_iter().enumerate() {
        let pixel = DVec2::new((index % view.size[0]) as f64 + 0.5, (index / view.size[0]) as f64 + 0.5);
        let direction = view.camera.direction(pixel);
        if let Some(band) = direction.and_then(|direction| band(direction, seen)) {
            sums[band] += f64::from(opacity) * view.camera.pixel_solid_angle(pixel);
        }
    }
    sums
}

fn everywhere(_: DVec3) -> bool {
    true
}

fn upper_half(direction: DVec3) -> bool {
    direction.y > 0.0
}

fn lower_half(direction: DVec3) -> bool {
    direction.y < 0.0
}

/// Within 75 degrees of the axis of a camera that looks along -z.
fn ahead(direction: DVec3) -> bool {
    direction.z < -0.26
}

/// A view through a lens, whether it sees a direction, and its name.
type LensView = (View, fn(DVec3) -> bool, &'static str);

/// Every lens, with the directions that it sees.
fn lenses() -> Vec<LensView> {
    let exposure = 1.0 / 250.0;
    let ahead_of = [0.0, 0.0, -4.0];
    vec![
        (view(Lens::Panorama, 0.0, ahead_of, exposure, [512, 256]), everywhere, "panorama"),
        (view(Lens::Fisheye, 180.0, [0.0, 4.0, 0.0], exposure, [350, 350]), upper_half, "dome"),
        (view(Lens::Fisheye, 180.0, [0.0, -4.0, 0.0], exposure, [350, 350]), lower_half, "dome that looks down"),
        (view(Lens::Fisheye, 360.0, ahead_of, exposure, [450, 450]), everywhere, "fisheye of 360 degrees"),
        (view(Lens::Perspective, 160.0, ahead_of, exposure, [800, 800]), ahead, "perspective"),
    ]
}

#[test]
fn a_drop_hides_its_disc_in_every_direction_through_every_lens() {
    let windy = wind([6.0, 0.0, 2.0], 0.3);
    let surroundings = Surroundings::from_wind(&windy);
    let parameters = RainParameters { distance: 4.0, ..streaks(Method::Drops, 50.0) };
    let rain = rain(parameters, 3);
    for (view, seen, name) in lenses() {
        let found = hidden(&draw(&rain, &view, &surroundings), &view, seen);
        let mut expected = [0.0; BANDS];
        for drop in rain.drops(&view, &surroundings) {
            // Where it is while the shutter is open.
            for step in 0..16 {
                let offset = drop.path[0].lerp(drop.path[1], (f64::from(step) + 0.5) / 16.0) - view.camera.position;
                if let Some(band) = band(offset, seen) {
                    expected[band] += drop.blocked_area() / offset.length_squared() / 16.0;
                }
            }
        }
        for band in 0..BANDS {
            let [found, expected] = [found[band], expected[band]];
            assert!(
                expected == 0.0 || (found / expected - 1.0).abs() < 0.08,
                "{name}, band {band}: {found} {expected}"
            );
        }
        assert!(expected.iter().sum::<f64>() > 1e-4, "{name}");
    }
}

#[test]
fn every_method_hides_as_much_through_every_lens() {
    let calm = wind([0.0; 3], 0.0);
    let surroundings = lit(&calm);
    for method in ALL_METHODS {
        let parameters = RainParameters { distance: 2.0, culling: false, ..streaks(method, 50.0) };
        let rain = rain(parameters, 3);
        let around = &lenses()[0].0;
        let strip = draw(&rain, around, &surroundings);
        for (view, seen, name) in &lenses()[1..] {
            let [expected, found] =
                [hidden(&strip, around, *seen), hidden(&draw(&rain, view, &surroundings), view, *seen)];
            // Upright billboards are seen edge on from above and below, where pixels do not resolve them.
            let bands = if method == Method::Textures { 1..BANDS - 1 } else { 0..BANDS };
            for band in bands {
                let [found, expected] = [found[band], expected[band]];
                let error = (found - expected).abs();
                assert!(error < 0.1 * expected + 1e-6, "{method:?}, {name}, band {band}: {found} {expected}");
            }
        }
    }
}

/// All that a strip says of a pixel.
fn values(strip: &Strip, index: usize) -> [f32; 8] {
    let measured = [AovRule::Sum, AovRule::Nearest, AovRule::Nearest];
    let [opacity, depth, diameter] = [0, 1, 2].map(|plane: usize| strip.aovs[plane].resolve(index, measured[plane]));
    let [red, green, blue] = [0, 1, 2].map(|c: usize| strip.radiance[c][index]);
    [red, green, blue, strip.transmittance(index)[1], opacity, depth, diameter, strip.depth[index].min(1e6)]
}

#[test]
fn a_panorama_turned_by_half_is_the_picture_rolled_by_half() {
    let windy = wind([8.0, 0.0, 0.0], 0.3);
    let surroundings = lit(&windy);
    let size = [512, 256];
    for method in ALL_METHODS {
        let mut parameters =
            RainParameters { rate_mm_per_h: 100.0.into(), method, distance: 8.0, ..RainParameters::default() };
        parameters.oscillation = if method == Method::Drops { 0.5 } else { 0.0 };
        let rain = rain(parameters, 3);
        let [mut forward, mut backward] = [-4.0, 4.0].map(|z| view(Lens::Panorama, 0.0, [0.0, 0.0, z], 0.033, size));
        for view in [&mut forward, &mut backward] {
            view.camera_parameters.position = Animated::from([0.0, 1.6, 0.0]);
            let z = view.camera_parameters.target.at(0.0)[2];
            view.camera_parameters.target = Animated::from([0.0, 1.6, z]);
            *view = View::new(view.camera_parameters.clone(), view.shutter, view.next_middle, size, 0);
        }
        let [forward, backward] = [forward, backward].map(|view| draw(&rain, &view, &surroundings));
        let (mut covered, mut elsewhere, mut light, mut difference) = (0, 0, 0.0, 0.0);
        for index in 0..size[0] * size[1] {
            let (row, column) = (index / size[0], index % size[0]);
            let there = row * size[0] + (column + size[0] / 2) % size[0];
            let (here, there) = (values(&forward, index), values(&backward, there));
            assert!((3..5).all(|k| (here[k] - there[k]).abs() < 1e-4), "{method:?} {column} {row}: {here:?} {there:?}");
            // Of streaks that end at the edge of a pixel, rounding may leave it out.
            elsewhere += usize::from((5..8).any(|k| here[k] != there[k]));
            light += (0..3).map(|c| f64::from(here[c])).sum::<f64>();
            difference += (0..3).map(|c| f64::from((here[c] - there[c]).abs())).sum::<f64>();
            covered += usize::from(here[4] > 0.0);
        }
        assert!(difference < 5e-3 * light, "{method:?}: {difference} of {light}");
        assert!(elsewhere < size[0] * size[1] / 100, "{method:?}: other streaks are the nearest in {elsewhere} pixels");
        assert!(covered > size[0] * size[1] / 10, "{method:?}: {covered}");
    }
}

#[test]
fn streaks_cross_the_pole_of_a_panorama_and_the_back_of_a_fisheye_without_a_line_across_the_picture() {
    let windy = wind([9.0, 0.0, 0.0], 0.0);
    let surroundings = Surroundings::from_wind(&windy);
    let rain = rain(RainParameters { distance: 2.0, ..streaks(Method::Drops, 100.0) }, 3);
    for (lens, target, size) in [
        (Lens::Panorama, [0.0, 0.0, -4.0], [512, 256]),
        (Lens::Fisheye, [0.0, -4.0, 0.0], [400, 400]),
        (Lens::Fisheye, [0.0, 4.0, 0.0], [400, 400]),
    ] {
        let view = view(lens, 360.0, target, 1.0 / 30.0, size);
        let strip = draw(&rain, &view, &surroundings);
        // Independent: the solid angle of each drop at many times, in the pixels there.
        let mut expected = vec![0.0; size[0] * size[1]];
        for drop in rain.drops(&view, &surroundings) {
            for step in 0..256 {
                let point = drop.path[0].lerp(drop.path[1], (f64::from(step) + 0.5) / 256.0);
                let Some(seen) = view.camera.project(point) else { continue };
                let [x, y] = seen.pixel.to_array().map(|place| place as usize);
                let solid_angle = drop.blocked_area() / (point - view.camera.position).length_squared();
                expected[y.min(size[1] - 1) * size[0] + x.min(size[0] - 1)] += solid_angle / 256.0;
            }
        }
        // Compared in blocks, since drops near the lens are out of focus.
        let side = 16;
        let (mut errors, mut sum, mut worst) = (0.0, 0.0, 0.0_f64);
        for block in 0..size[0] / side * (size[1] / side) {
            let corner = [block % (size[0] / side) * side, block / (size[0] / side) * side];
            let pixels = (0..side * side).map(|i| (corner[1] + i / side) * size[0] + corner[0] + i % side);
            let weight = |index: usize| {
                let pixel = DVec2::new((index % size[0]) as f64 + 0.5, (index / size[0]) as f64 + 0.5);
                view.camera.pixel_solid_angle(pixel)
            };
            let found: f64 =
                pixels.clone().map(|index| f64::from(strip.aovs[0].resolve(index, AovRule::Sum)) * weight(index)).sum();
            let known: f64 = pixels.map(|index| expected[index]).sum();
            errors += (found - known).abs();
            worst = worst.max((found - known).abs());
            sum += known;
        }
        assert!(errors < 0.15 * sum && sum > 0.0, "{lens:?} {target:?}: {errors} of {sum}, {worst}");
    }
}
