//! Obstacles in a picture: coverage, depth, light and shadow, motion.

use bansho_base::{
    camera::CameraParameters,
    host::{assets::MemoryAssets, observer::Unobserved},
    image::Rect,
    math::{DVec2, DVec3, curve::Interpolation},
    parameters::animated::Animated,
    phenomenon::{
        Run,
        strip::{DepthInterval, Shutter, Strip, View},
        surroundings::{Emitter, Light, Surroundings},
    },
    world::{
        occluder::Occluder,
        sky::{Sky, SkyKind},
        wind::{Wind, WindParameters},
    },
};

use super::{Obstacle, ObstacleParameters, ObstacleShape, Solids};

const SIZE: [usize; 2] = [64, 48];

fn solids(all: &[ObstacleParameters]) -> Solids {
    Solids::new(all.iter().map(|one| Obstacle::new(one, &MemoryAssets::default()).unwrap()).collect())
}

fn ball(position: [f64; 3], radius: f64) -> ObstacleParameters {
    ObstacleParameters { position: position.into(), radius, visible: true, reflectance: 0.0, ..Default::default() }
}

/// A camera 10 m in front of the origin.
fn view(exposure: f64) -> View {
    let camera = CameraParameters { position: [0.0, 0.0, 10.0].into(), target: [0.0; 3].into(), ..Default::default() };
    View::new(camera, Shutter { open: 1.0, close: 1.0 + exposure }, 0.0, SIZE, 0)
}

/// The strip of a whole picture, and the coverage of its pixels.
fn drawn(solids: &Solids, view: &View, lights: &[Light]) -> (Strip, Vec<f32>) {
    let wind = Wind::new(WindParameters::default(), 1, None);
    let mut surroundings = Surroundings::from_wind(&wind);
    surroundings.others.lights = lights.to_vec();
    let prepared = solids.prepare(view, &surroundings, &Unobserved).unwrap();
    let mut strip = Strip::default();
    strip.reset(Rect::from_size(SIZE[0], SIZE[1]), None, 0);
    for slice in solids.depth_intervals(view, &surroundings) {
        prepared.draw(&slice, &mut strip);
    }
    assert!(prepared.bounds(&DepthInterval::ALL).width <= SIZE[0]);
    let surfaces = prepared.opaque_surfaces().unwrap();
    let inside = surfaces.rect;
    for (at, (depth, coverage)) in surfaces.depth.pixels().iter().zip(surfaces.coverage.pixels()).enumerate() {
        let index = (inside.y + at / inside.width) * SIZE[0] + inside.x + at % inside.width;
        assert_eq!(depth[0].is_finite(), coverage[0] > 0.0, "it hides what is behind it where it is");
        assert!(
            strip.depth[index] <= depth[0]
                && strip.transmittance(index)[0] == if coverage[0] > 0.0 { 0.0 } else { 1.0 }
        );
    }
    let mut coverage = vec![0.0; SIZE[0] * SIZE[1]];
    for (y, row) in surfaces.coverage.pixels().chunks(inside.width.max(1)).enumerate() {
        coverage[(inside.y + y) * SIZE[0] + inside.x..][..inside.width].copy_from_slice(row.as_flattened());
    }
    (strip, coverage)
}

#[test]
fn a_ball_covers_its_disc_to_a_fraction_of_a_pixel() {
    let view = view(0.0);
    let (strip, coverage) = drawn(&solids(&[ball([0.0; 3], 1.0)]), &view, &[]);
    // The disc of a sphere in the picture has the radius f r / sqrt(d^2 - r^2).
    let radius = view.camera.focal_pixels / 99.0_f64.sqrt();
    let covered: f32 = coverage.iter().sum();
    let expected = std::f64::consts::PI * radius * radius;
    assert!((f64::from(covered) / expected - 1.0).abs() < 0.01, "{covered} {expected}");
    let partial = coverage.iter().filter(|value| (0.01..0.99).contains(*value)).count();
    assert!(partial > 12, "its edge is antialiased: {partial}");
    let middle = SIZE[1] / 2 * SIZE[0] + SIZE[0] / 2;
    assert!((strip.depth[middle] - 9.0).abs() < 0.01);
}

#[test]
fn a_surface_is_as_bright_as_lambert_says_and_dark_in_a_shadow() {
    let wall = ObstacleParameters {
        shape: ObstacleShape::Box,
        size: [20.0, 20.0, 1.0],
        color: [0.5; 3],
        ..ball([0.0, 0.0, -0.5], 1.0)
    };
    let light =
        Light { emitter: Emitter::Point { position: DVec3::new(0.0, 3.0, 4.0), radius: 0.1 }, intensity: [100.0; 3] };
    let middle = SIZE[1] / 2 * SIZE[0] + SIZE[0] / 2;
    let view_of_wall = view(0.0);
    let (strip, _) = drawn(&solids(std::slice::from_ref(&wall)), &view_of_wall, &[light]);
    // Nearly in the middle: 100 cd at 5 m, at an angle whose cosine is 4/5. The surface is rough and reflects only at grazing angles beyond that.
    let pixel = DVec2::new(SIZE[0] as f64, SIZE[1] as f64) * 0.5 + 0.5;
    let point = DVec3::Z * 10.0 + view_of_wall.camera.direction(pixel).unwrap() * 10.0;
    let offset = DVec3::new(0.0, 3.0, 4.0) - point;
    let lambert = (100.0 * offset.z / (offset.length_squared() * offset.length()) * 0.5 / std::f64::consts::PI) as f32;
    assert!((lambert / 0.5093 - 1.0).abs() < 0.05);
    assert!((strip.radiance[1][middle] / lambert - 1.0).abs() < 0.005, "{} {lambert}", strip.radiance[1][middle]);
    // A ball between them, which does not hide the wall from the camera.
    let (strip, _) = drawn(&solids(&[wall, ball([0.0, 1.5, 2.0], 0.4)]), &view(0.0), &[light]);
    assert_eq!(strip.radiance[1][middle], 0.0);
}

#[test]
fn what_moves_is_blurred_over_its_way_and_covers_as_much() {
    let path = vec![(1.0, [-0.5, 0.0, 0.0]), (2.0, [0.5, 0.0, 0.0])];
    let moving =
        ObstacleParameters { position: Animated::keyed(path, Interpolation::Linear).unwrap(), ..ball([0.0; 3], 0.3) };
    let still = drawn(&solids(&[ball([0.0; 3], 0.3)]), &view(0.0), &[]).1;
    let blurred = drawn(&solids(&[moving]), &view(1.0), &[]).1;
    let [sum, width] = [
        |values: &[f32]| values.iter().sum::<f32>(),
        |values: &[f32]| {
            (0..SIZE[0]).filter(|x| values.iter().skip(*x).step_by(SIZE[0]).any(|c| *c > 0.0)).count() as f32
        },
    ]
    .map(|measure: fn(&[f32]) -> f32| [measure(&still), measure(&blurred)]);
    assert!((sum[1] / sum[0] - 1.0).abs() < 0.05, "{sum:?}");
    let pixels = view(0.0).camera.focal_pixels as f32 / 10.0;
    assert!((width[1] - width[0] - pixels).abs() < 2.5, "{width:?} {pixels}");
}

#[test]
fn a_mirror_shows_what_is_above_it_only() {
    let post = ObstacleParameters { shape: ObstacleShape::Cylinder, height: 4.0, ..ball([0.0, 0.0, 0.0], 0.3) };
    let direct = view(0.0);
    let mut mirrored = View::new(
        CameraParameters { position: [0.0, 2.0, 10.0].into(), target: [0.0, 0.0, 0.0].into(), ..Default::default() },
        direct.shutter,
        0.0,
        SIZE,
        0,
    );
    let above = drawn(&solids(std::slice::from_ref(&post)), &mirrored, &[]).1;
    mirrored = mirrored.mirrored(0.0);
    let seen = drawn(&solids(&[post]), &mirrored, &[]).1;
    let rows = |values: &[f32]| -> Vec<usize> {
        (0..SIZE[1]).filter(|y| values[y * SIZE[0]..][..SIZE[0]].iter().any(|c| *c > 0.0)).collect()
    };
    // The post reaches 2 m below and above the mirror, so the reflection begins where the post meets it, in the middle row.
    let (first, last) = (rows(&seen)[0], rows(&above)[rows(&above).len() - 1]);
    assert!(first.abs_diff(SIZE[1] / 2) <= 1 && last > SIZE[1] / 2 + 4, "{first} {last}");
}

#[test]
fn pixels_of_earlier_frames_are_used_only_while_nothing_changes() {
    let path = vec![(1.0, [0.0; 3]), (2.0, [0.5, 0.0, 0.0])];
    let all = [
        ObstacleParameters {
            position: Animated::keyed(path, Interpolation::Linear).unwrap(),
            reflectance: 0.04,
            ..ball([0.0; 3], 1.0)
        },
        ball([2.0, 1.0, 1.0], 0.5),
    ];
    let known = solids(&all);
    let wind = Wind::new(WindParameters::default(), 1, None);
    let emitter = Emitter::Point { position: DVec3::new(0.0, 3.0, 4.0), radius: 0.1 };
    let mut before = Surroundings::from_wind(&wind);
    before.others.lights = vec![Light { emitter, intensity: [100.0; 3] }];
    let radiance = |solids: &Solids, view: &View, surroundings: &Surroundings| {
        let prepared = solids.prepare(view, surroundings, &Unobserved).unwrap();
        let mut strip = Strip::default();
        strip.reset(Rect::from_size(SIZE[0], SIZE[1]), None, 0);
        prepared.draw(&DepthInterval::ALL, &mut strip);
        strip.radiance
    };
    let first = radiance(&known, &view(0.0), &before);
    let mut changes = vec![(view(0.0), before.clone())];
    let mut change_surroundings = |change: fn(&mut Surroundings)| {
        let mut after = before.clone();
        change(&mut after);
        changes.push((view(0.0), after));
    };
    change_surroundings(|after| after.others.lights[0].intensity[1] = 90.0);
    change_surroundings(|after| after.others.lights.clear());
    change_surroundings(|after| after.others.extinction = 0.05);
    change_surroundings(|after| {
        after.others.occluders.push(Occluder::HalfSpace { point: -DVec3::Y, normal: DVec3::Y });
    });
    change_surroundings(|after| after.sky = Sky::new(SkyKind::Uniform, 0.5, 6500.0));
    let mut change_view = |change: fn(&mut View)| {
        let mut after = view(0.0);
        change(&mut after);
        changes.push((after, before.clone()));
    };
    change_view(|after| after.shutter = Shutter { open: 2.0, close: 2.0 });
    change_view(|after| *after = after.mirrored(-0.5));
    change_view(|after| after.window = Rect { x: 20, y: 10, width: 30, height: 20 });
    for (index, (view, surroundings)) in changes.iter().enumerate() {
        let [found, traced] = [&known, &solids(&all)].map(|solids| radiance(solids, view, surroundings));
        assert_eq!(found, traced, "change {index}");
        assert_eq!(index == 0, found == first, "change {index} is seen");
    }
}
