//! The list of drops: drawn again by a rasterizer of its own, it gives the opacity that is measured in pictures.

use std::sync::Arc;

use bansho_base::{
    geometry::point_cloud::Quantity,
    image::Rect,
    math::{self, DQuat, DVec2, DVec3, curve::Interpolation},
    parameters::animated::Animated,
    phenomenon::{
        Run,
        strip::View,
        surroundings::{Occluder, Publication, Surroundings},
    },
    world::wind::Wind,
};

use super::{Method, Rain, RainParameters, RainRun, draw, opacity, rain, reference::near, streaks, view_at, wind};
use crate::Raindrop;

const SIZE: [usize; 2] = [320, 180];
/// Sides of the regions that are compared, pixels.
const BLOCK: [usize; 2] = [40, 30];
/// Points over which the disc of a drop is spread.
const POINTS: u32 = 32;

/// Points of a disc of radius 1, evenly distributed (a spiral of the golden angle).
fn disc_points() -> Vec<DVec2> {
    let point = |index: u32| {
        let (radius, angle) =
            (((f64::from(index) + 0.5) / f64::from(POINTS)).sqrt(), 2.399_963_229_7 * f64::from(index));
        DVec2::new(math::cos(angle), math::sin(angle)) * radius
    };
    (0..POINTS).map(point).collect()
}

/// Where the disc of a drop is in the picture while the shutter is open.
#[derive(Clone, Copy, Debug)]
enum Motion {
    /// Along the straight line between its ends, with the size at their mean distance.
    Line,
    /// Where the camera of each time sees it, with its size there.
    Seen,
}

/// The disc of a drop in the picture, pixels.
#[derive(Clone, Copy)]
struct Disc {
    center: DVec2,
    radius: f64,
    /// Its blocked area, square pixels.
    area: f64,
}

/// The size of the disc of a drop at a depth and a distance (m), where a meter has `scale` pixels.
fn disc_of_size(drop: &Raindrop, depth: f64, distance: f64, scale: f64) -> Disc {
    // A lens focused at 1 m blurs what is nearer, by its pupil of 4 mm.
    let blur = 4e-3 * (1.0 - depth).max(0.0);
    // A sphere of a small solid angle w has the area w f^2 / cos^3 in the picture plane.
    let area = drop.blocked_area() * scale * scale * distance / depth;
    Disc { center: DVec2::ZERO, radius: (0.5e-3 * drop.diameter_mm + blur) * scale, area }
}

/// The disc of a drop after a fraction of its path.
fn disc_at(drop: &Raindrop, view: &View, motion: Motion, fraction: f64) -> Option<Disc> {
    let camera = |fraction: f64| view.camera_at(view.shutter.open + fraction * view.shutter.duration());
    if let Motion::Seen = motion {
        let (camera, point) = (camera(fraction), drop.path[0].lerp(drop.path[1], fraction));
        let seen = camera.project(point)?;
        let distance = (point - camera.position).length();
        return Some(Disc { center: seen.pixel, ..disc_of_size(drop, seen.depth, distance, seen.pixels_per_meter) });
    }
    let [from, to] = [0, 1].map(|end| camera(end as f64).project(drop.path[end]));
    let (from, to) = (from?, to?);
    let [depth, scale] = [from.depth + to.depth, from.pixels_per_meter + to.pixels_per_meter].map(|sum| 0.5 * sum);
    let center = from.pixel.lerp(to.pixel, fraction);
    let distance = (0.5 * (drop.path[0] + drop.path[1]) - view.camera.position).length();
    Some(Disc { center, ..disc_of_size(drop, depth, distance, scale) })
}

/// Opacity of each pixel: the discs of the drops at many times of the exposure, each with its share of the blocked area.
fn drawn_again(drops: &[Raindrop], view: &View, motion: Motion) -> Vec<f64> {
    let [width, height] = view.size;
    let (mut picture, points) = (vec![0.0; width * height], disc_points());
    for drop in drops {
        let ends = [0.0, 1.0].map(|fraction| disc_at(drop, view, motion, fraction).expect("listed drops are seen"));
        let steps = 8 + (3.0 * (ends[1].center - ends[0].center).length()) as u32;
        for step in 0..steps {
            let fraction = (f64::from(step) + 0.5) / f64::from(steps);
            let Some(disc) = disc_at(drop, view, motion, fraction) else { continue };
            for point in &points {
                let DVec2 { x, y } = disc.center + *point * disc.radius;
                if (0.0..width as f64).contains(&x) && (0.0..height as f64).contains(&y) {
                    picture[y as usize * width + x as usize] += disc.area / f64::from(steps * POINTS);
                }
            }
        }
    }
    picture
}

/// Sums over the blocks of a picture.
fn block_sums(picture: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let columns = SIZE[0] / BLOCK[0];
    let mut sums = vec![0.0; columns * SIZE[1] / BLOCK[1]];
    for (index, value) in picture.into_iter().enumerate() {
        sums[index / SIZE[0] / BLOCK[1] * columns + index % SIZE[0] / BLOCK[0]] += value;
    }
    sums
}

/// Differences of the opacity of the list from that of pictures, relative: of the total, and the root mean square and the largest of blocks, relative to the
/// mean block.
fn differences(rain: &Rain, views: impl Iterator<Item = View>, wind: &Wind, motion: Motion) -> [f64; 3] {
    let surroundings = Surroundings::from_wind(wind);
    let (mut measured, mut found) = (vec![0.0; 48], vec![0.0; 48]);
    for view in views {
        let strip = draw(rain, &view, &surroundings);
        let add = |sums: &mut Vec<f64>, picture: Vec<f64>| {
            sums.iter_mut().zip(block_sums(picture)).for_each(|(sum, value)| *sum += value);
        };
        add(&mut measured, opacity(&strip).into_iter().map(f64::from).collect());
        add(&mut found, drawn_again(&rain.drops(&view, &surroundings), &view, motion));
    }
    let [all, again] = [&measured, &found].map(|sums| sums.iter().sum::<f64>());
    let mean = all / measured.len() as f64;
    let errors: Vec<f64> = measured.iter().zip(&found).map(|(a, b)| (b - a) / mean).collect();
    let square = errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64;
    [again / all - 1.0, square.sqrt(), errors.iter().fold(0.0, |most, error| error.abs().max(most))]
}

/// Views of several exposures of a camera that looks toward the ground before it, where drops land.
fn views(velocity: [f64; 3], exposure: f64) -> impl Iterator<Item = View> {
    (0..4).map(move |frame| {
        let mut view = view_at(0.5 + 0.9 * f64::from(frame), exposure, SIZE);
        let moved = |start: [f64; 3]| -> Animated<[f64; 3]> {
            let keys = [0.0, 10.0].map(|t| (t, [0, 1, 2].map(|axis| start[axis] + velocity[axis] * t)));
            Animated::keyed(keys.to_vec(), Interpolation::Linear).expect("the keys ascend")
        };
        view.camera_parameters.position = moved([0.0, 1.6, 0.0]);
        view.camera_parameters.target = moved([0.0, 1.0, -4.0]);
        View::new(view.camera_parameters, view.shutter, view.next_middle, view.size, 0)
    })
}

#[test]
fn drops_drawn_again_give_the_measured_opacity() {
    let calm = wind([0.0; 3], 0.0);
    let gusty = wind([2.0, 0.0, 1.0], 0.4);
    for (wind, velocity, exposure, rate, motion) in [
        (&calm, [0.0; 3], 1.0 / 60.0, 10.0, Motion::Seen),
        (&gusty, [1.0, 0.0, -2.0], 1.0 / 60.0, 30.0, Motion::Seen),
        (&calm, [0.0; 3], 1.0 / 60.0, 10.0, Motion::Line),
        // A long exposure is drawn in parts, in which drops come nearer step by step.
        (&gusty, [0.0; 3], 1.0 / 15.0, 10.0, Motion::Seen),
        (&gusty, [0.0; 3], 1e-4, 10.0, Motion::Line),
    ] {
        let rain = rain(streaks(Method::Drops, rate), 3);
        let [total, blocks, largest] = differences(&rain, views(velocity, exposure), wind, motion);
        // Measured with straight lines: 0.04 % and 0.5 % at most.
        assert!(
            total.abs() < 0.01 && blocks < if exposure > 1.0 / 24.0 { 0.02 } else { 0.01 } && largest < 0.05,
            "{exposure} s, {motion:?}: {total} {blocks} {largest}"
        );
    }
}

#[test]
fn a_drop_states_the_fraction_of_the_exposure_that_it_covers_a_point() {
    let calm = wind([0.0; 3], 0.0);
    let surroundings = Surroundings::from_wind(&calm);
    let parameters = RainParameters { diameters_mm: vec![1.4], ..streaks(Method::Drops, 20.0) };
    let list =
        |parameters: &RainParameters| rain(parameters.clone(), 3).drops(&view_at(1.0, 1.0 / 60.0, SIZE), &surroundings);
    let drops = list(&parameters);
    assert!(drops.len() > 100);
    for drop in &drops {
        // 1.4 mm at 5.17 m/s in 1/60 s: a path of 86 mm.
        assert!(near(-drop.velocity.y, 5.17, 0.01) && drop.velocity.x == 0.0, "{drop:?}");
        assert!(near((drop.path[1] - drop.path[0]).length(), 0.0862 * drop.exposed_fraction, 0.01), "{drop:?}");
        assert!(near(drop.opacity, 0.01625 * drop.weight, 0.01), "{drop:?}");
        assert!(near(drop.blocked_area(), 1.539e-6 * drop.weight * drop.exposed_fraction, 0.001));
        assert!((drop.position - DVec3::new(0.0, 1.6, 0.0)).length() - drop.distance < 1e-5);
    }
    // Twice as opaque, the same drops.
    let twice = list(&RainParameters { opacity_gain: 2.0, ..parameters });
    assert_eq!(drops.len(), twice.len());
    for (drop, twice) in drops.iter().zip(&twice) {
        assert_eq!((drop.position, drop.weight), (twice.position, twice.weight));
        assert!(near(twice.opacity, 2.0 * drop.opacity, 1e-6) && twice.opacity_factor == 2.0);
    }
}

#[test]
fn weights_fall_at_the_end_of_the_region_and_while_the_rate_rises() {
    let calm = wind([0.0; 3], 0.0);
    let surroundings = Surroundings::from_wind(&calm);
    let view = view_at(1.0, 1.0 / 60.0, SIZE);
    let drops = rain(streaks(Method::Drops, 20.0), 3).drops(&view, &surroundings);
    let [mut full, mut partial] = [0, 0];
    for drop in &drops {
        assert!(drop.distance < 5.5 && drop.weight > 0.0 && drop.weight <= 1.0, "{drop:?}");
        assert!(drop.distance > 4.5 || drop.weight == 1.0, "{drop:?}");
        full += usize::from(drop.weight == 1.0);
        partial += usize::from(drop.weight < 1.0);
    }
    assert!(full > 100 && partial > 100, "{full} {partial}");
    // Half of the most rain that falls in the shot: some drops are about to come.
    let rate = Animated::keyed(vec![(0.0, 0.0), (2.0, 20.0)], Interpolation::Linear).unwrap();
    let rising = RainParameters { rate_mm_per_h: rate, ..streaks(Method::Drops, 20.0) };
    let rising = rain(rising, 3).drops(&view, &surroundings);
    let coming = rising.iter().filter(|drop| drop.distance < 4.5 && drop.weight < 1.0).count();
    assert!(coming > 0 && rising.len() < drops.len(), "{coming} {} {}", rising.len(), drops.len());
}

#[test]
fn listed_drops_end_at_the_ground_and_are_not_below_a_roof() {
    let calm = wind([0.0; 3], 0.0);
    let open = Surroundings::from_wind(&calm);
    let view = || views([0.0; 3], 1.0 / 15.0).next().unwrap();
    let rain = rain(streaks(Method::Drops, 50.0), 3);
    let drops = rain.drops(&view(), &open);
    assert!(drops.iter().all(|drop| drop.path[1].y > -1e-4 && drop.path[0].y > 0.0));
    let landing = drops.iter().filter(|drop| drop.exposed_fraction < 1.0);
    assert!(landing.clone().count() > 10 && landing.clone().any(|drop| drop.position.y < 0.0));
    assert!(landing.into_iter().all(|drop| drop.path[1].y.abs() < 1e-4));
    let roof = Occluder::Cuboid {
        center: DVec3::new(0.0, 9.0, -2.0),
        half_extents: DVec3::new(1.0, 0.1, 50.0),
        rotation: DQuat::IDENTITY,
    };
    let others = Publication { occluders: vec![roof], ..Publication::default() };
    let below = rain.drops(&view(), &Surroundings { others, ..Surroundings::from_wind(&calm) });
    // Solids count as a little larger than they are.
    let outside = |list: &[Raindrop], half_width: f64| -> Vec<Raindrop> {
        list.iter().copied().filter(|drop| drop.position.x.abs() > half_width).collect()
    };
    let expected = outside(&drops, 1.01);
    assert!(expected.len() < drops.len() && !expected.is_empty());
    assert!(outside(&below, 1.01) == expected && outside(&below, 0.999) == below);
}

#[test]
fn every_method_lists_the_same_drops_with_any_number_of_threads_and_exports_them() {
    let gusty = wind([2.0, 0.0, 1.0], 0.4);
    let surroundings = Surroundings::from_wind(&gusty);
    let view = view_at(1.0, 1.0 / 60.0, SIZE);
    let drops = rain(streaks(Method::Drops, 20.0), 3).drops(&view, &surroundings);
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    for method in [Method::Drops, Method::Billboards, Method::Textures] {
        let rain = rain(streaks(method, 20.0), 3);
        assert_eq!(one_thread.install(|| rain.drops(&view, &surroundings)), drops, "{method:?}");
        let cloud = RainRun::new(Arc::new(rain)).export_particles(&view, &surroundings).unwrap();
        assert_eq!(cloud.len(), drops.len());
        let last = drops.len() - 1;
        assert_eq!(cloud.positions[last], drops[last].position.as_vec3().to_array());
        assert_eq!(cloud.velocities[last], drops[last].velocity.as_vec3().to_array());
        assert_eq!(cloud.quantities[&Quantity::DiameterMm][last], drops[last].diameter_mm as f32);
        assert_eq!(cloud.quantities[&Quantity::Opacity][last], drops[last].opacity as f32);
    }
}

#[test]
fn a_window_lists_the_drops_that_it_shows() {
    let calm = wind([0.0; 3], 0.0);
    let surroundings = Surroundings::from_wind(&calm);
    let view = view_at(1.0, 1.0 / 60.0, SIZE);
    let rain = rain(streaks(Method::Drops, 20.0), 3);
    let all = rain.drops(&view, &surroundings);
    let window = Rect { x: 100, y: 60, width: 40, height: 20 };
    let part = rain.drops(&view.clone().with_window(window), &surroundings);
    assert!(part.len() > 5 && part.len() < all.len() / 4, "{} {}", part.len(), all.len());
    assert!(part.iter().all(|drop| all.contains(drop)));
    let is_in_window = |drop: &&Raindrop| {
        let center = view.camera.project(drop.position).expect("it is seen").pixel;
        (100.0..140.0).contains(&center.x) && (60.0..80.0).contains(&center.y)
    };
    assert!(all.iter().filter(is_in_window).all(|drop| part.contains(drop)));
}
