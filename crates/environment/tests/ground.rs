//! The ground sixteen pixels at a time is that of one pixel at a time, whatever the strips, the crop, and what is known from earlier frames.

use bansho_base::{
    host::observer::Unobserved,
    image::Rect,
    phenomenon::{
        Run,
        strip::{DepthInterval, Strip, View},
        surroundings::Surroundings,
    },
    world::wind::{Wind, WindParameters},
};
use bansho_environment::ground::{Ground, GroundParameters};

#[path = "../benches/support/pixel_by_pixel.rs"]
mod pixel_by_pixel;
#[path = "../benches/support/scene.rs"]
mod scene;

use pixel_by_pixel::PixelByPixel;

const SIZE: [usize; 2] = [205, 120];
const SEED: u64 = 1;

fn strip(rect: Rect) -> Strip {
    let mut strip = Strip::default();
    strip.reset(rect, None, 0);
    strip
}

fn drawn(ground: &Ground, view: &View, surroundings: &Surroundings, rect: Rect) -> Strip {
    let mut strip = strip(rect);
    ground.prepare(view, surroundings, &Unobserved).unwrap().draw(&DepthInterval::ALL, &mut strip);
    strip
}

fn wind() -> Wind {
    Wind::new(WindParameters::default(), 1, None)
}

fn bits(strip: &Strip) -> Vec<u32> {
    strip.radiance.iter().flatten().chain(&strip.depth).map(|value| value.to_bits()).collect()
}

/// A ground whose drawing is compared.
fn grounds() -> [GroundParameters; 4] {
    let street = scene::street();
    [
        GroundParameters { wetness: 0.0.into(), ..street.clone() },
        GroundParameters { puddles: 0.0, ..street.clone() },
        street,
        scene::lake(),
    ]
}

#[test]
fn sixteen_pixels_are_as_bright_as_each() {
    let (view, wind) = (scene::view(SIZE), wind());
    let reflection = scene::reflection(SIZE, 1);
    let surroundings = scene::surroundings(&wind, Some(&reflection));
    for parameters in grounds() {
        let rect = Rect::from_size(SIZE[0], SIZE[1]);
        let fast = drawn(&Ground::new(parameters.clone(), SEED, None), &view, &surroundings, rect);
        let mut exact = strip(rect);
        PixelByPixel::new(&parameters, SEED, &view, &surroundings).draw(&mut exact);
        let (mut sum, mut worst, mut count) = (0.0_f64, 0.0_f64, 0);
        for index in 0..fast.len() {
            let [found, expected] = [&fast, &exact].map(|strip| f64::from(strip.radiance[1][index]));
            let error = (found - expected).abs() / expected.max(1e-3);
            (sum, worst, count) = (sum + error, worst.max(error), count + usize::from(expected > 0.0));
            let [near, far] = [&fast, &exact].map(|strip| f64::from(strip.depth[index]));
            assert!(near == far || (near / far - 1.0).abs() < 2e-3, "{index}: {near} {far}");
        }
        assert!(count > fast.len() / 3, "{count}");
        // Largest where a film or a bump is cut by the edge of its octave.
        assert!(
            sum / (count as f64) < 1e-3 && worst < 0.1,
            "{parameters:?}: mean {}, largest {worst}",
            sum / count as f64
        );
    }
}

#[test]
fn strips_and_crops_and_what_is_known_change_no_bit() {
    let (view, wind) = (scene::view(SIZE), wind());
    let reflection = scene::reflection(SIZE, 2);
    let surroundings = scene::surroundings(&wind, Some(&reflection));
    let mut brighter = surroundings.clone();
    brighter.others.lights[2].intensity = [1e4; 3];
    let rect = Rect::from_size(SIZE[0], SIZE[1]);
    for parameters in grounds() {
        let fresh = || Ground::new(parameters.clone(), SEED, None);
        let expected = bits(&drawn(&fresh(), &view, &surroundings, rect));
        let other = bits(&drawn(&fresh(), &view, &brighter, rect));
        assert_ne!(expected, other);
        let ground = fresh();
        for (frame, lights) in [0, 0, 0, 1, 1, 0, 1, 1, 0, 0, 0].into_iter().enumerate() {
            let (surroundings, expected) = [(&surroundings, &expected), (&brighter, &other)][lights];
            assert!(bits(&drawn(&ground, &view, surroundings, rect)) == *expected, "frame {frame}");
        }
        let part = Rect { x: 37, y: 61, width: 81, height: 33 };
        let whole = drawn(&fresh(), &view, &surroundings, rect);
        for _ in 0..3 {
            let crop = drawn(&ground, &view.clone().with_window(part), &surroundings, part);
            for index in 0..crop.len() {
                let [x, y] = [part.x + index % part.width, part.y + index / part.width];
                let [found, expected] = [crop.radiance[1][index], whole.radiance[1][y * SIZE[0] + x]];
                assert!(found.to_bits() == expected.to_bits(), "{x} {y}: {found} {expected}");
            }
        }
    }
}

#[test]
fn slices_together_are_the_whole_ground() {
    let (view, wind) = (scene::view(SIZE), wind());
    let surroundings = scene::surroundings(&wind, None);
    let ground = Ground::new(scene::street(), SEED, None);
    let rect = Rect::from_size(SIZE[0], SIZE[1]);
    let whole = drawn(&ground, &view, &surroundings, rect);
    let prepared = ground.prepare(&view, &surroundings, &Unobserved).unwrap();
    let mut sum = vec![0.0; whole.len()];
    for [near, far] in [[0.0, 3.0], [3.0, 7.7], [7.7, 90.0], [90.0, f64::INFINITY]] {
        let slice = DepthInterval { near, far };
        let bounds = prepared.bounds(&slice);
        let mut part = strip(bounds);
        prepared.draw(&slice, &mut part);
        for (index, light) in part.radiance[1].iter().enumerate() {
            sum[(bounds.y + index / bounds.width) * SIZE[0] + bounds.x + index % bounds.width] += light;
        }
    }
    assert_eq!(sum, whole.radiance[1]);
}
