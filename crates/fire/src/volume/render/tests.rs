//! Drawing of a small fire: vectors of rays against rays one at a time, and the picture in parts.

use bansho_base::{
    camera::CameraParameters,
    color,
    image::Rect,
    math::{self, DVec2, DVec3, Vec3},
    parameters::{Auto, animated::Animated},
    phenomenon::{
        Prepared,
        strip::{DepthInterval, Shutter, Strip, View},
        surroundings::{Emitter, Light, Surroundings},
    },
};
use fearless_simd::{Level, dispatch};

use super::{
    field::GasField,
    march::TilePart,
    nodes::TILE,
    prepared::{PreparedVolume, RenderedGas},
    rays::{GasRays, Gathered},
    smoke::SmokeLight,
};
use crate::volume::{
    fuel::Fuel,
    parameters::{FlameVolumeParameters, VolumeRenderingParameters},
    simulate::Simulation,
    tests::{fire, simulation, still_air},
};

const SIZE: [usize; 2] = [200, 150];
const STEPS: u32 = 30;
const EVERYTHING: [f64; 2] = [0.0, 100.0];

/// A fire of heptane, whose smoke is thick, and what it is drawn with.
struct Subject {
    simulation: Simulation,
    rendering: VolumeRenderingParameters,
    view: View,
}

impl Subject {
    fn new(exposure: f64) -> Self {
        Self::of(
            FlameVolumeParameters {
                domain_min: Auto::Set([-0.6, 0.0, -0.6]),
                domain_max: Auto::Set([0.6, 1.0, 0.6]),
                ..fire(Fuel::Heptane, 0.3, 60.0, 8.0)
            },
            exposure,
        )
    }

    fn of(parameters: FlameVolumeParameters, exposure: f64) -> Self {
        let wind = still_air();
        let mut simulation = simulation(parameters, 1);
        for number in 0..STEPS {
            simulation.step(f64::from(number) / 60.0, &Surroundings::from_wind(&wind));
        }
        let camera = CameraParameters {
            position: Animated::from([0.3, 0.5, 2.4]),
            target: Animated::from([0.0, 0.5, 0.0]),
            vertical_fov_deg: Animated::from(30.0),
            ..CameraParameters::default()
        };
        let time = f64::from(STEPS) / 60.0;
        let view = View::new(camera, Shutter { open: time, close: time + exposure }, time + 1.0 / 24.0, SIZE, 0);
        Self { simulation, rendering: VolumeRenderingParameters::default(), view }
    }

    fn gas(&self) -> RenderedGas<'_> {
        RenderedGas {
            mixture: self.simulation.mixture,
            rendering: &self.rendering,
            soot: 1.6e-6,
            smoke_yield: 0.037,
            time: f64::from(STEPS) / 60.0,
            speed: f64::from(self.simulation.flow.largest_speed()),
        }
    }

    fn prepared(&self, step: f64) -> PreparedVolume<'_> {
        let Self { simulation: Simulation { flow, active, .. }, view, .. } = self;
        let (gas, wind) = (self.gas(), still_air());
        let seconds = gas.time_samples(view, &flow.grid).longest();
        let field = GasField::new(flow, active, DVec3::ZERO, seconds, gas.seen());
        let surroundings = Surroundings::from_wind(&wind);
        let emitter = Emitter::Point { position: DVec3::ZERO, radius: 0.1 };
        let lights = [Light { emitter, intensity: [300.0, 150.0, 30.0] }];
        let smoke = SmokeLight::new(&field, flow, active, &gas.optics(), &lights, &surroundings, 0.3);
        PreparedVolume::new(gas, field, smoke, step, Vec::new(), view)
    }
}

/// Everything that rays gather, tile by tile.
fn gathered(rays: &GasRays, level: Level, rect: Rect) -> Vec<Vec<Gathered>> {
    let plate_depth = |_: usize, _: usize| f32::INFINITY;
    (rect.x / TILE..rect.right().div_ceil(TILE))
        .map(|tile| {
            let tile = Rect { x: tile * TILE, y: rect.y, width: TILE, height: rect.height }.intersection(&rect);
            let part = TilePart { rect: tile, depths: EVERYTHING, plate_depth: &plate_depth, has_motion: true };
            let gathered = dispatch!(level, simd => rays.gather_tile(simd, &part));
            gathered.unwrap_or_else(|| vec![Gathered::default(); tile.width * tile.height])
        })
        .collect()
}

/// Row by row.
fn picture(rays: &GasRays, level: Level) -> Vec<Gathered> {
    let rows = |y: usize| gathered(rays, level, Rect { x: 0, y, width: SIZE[0], height: 1 }).concat();
    (0..SIZE[1]).flat_map(rows).collect()
}

fn brightness(gathered: &Gathered) -> f32 {
    gathered.luminance + color::luminance(gathered.scattered)
}

/// The largest error, over the largest value, and the mean error, over the mean.
fn errors(values: &[f32], expected: &[f32]) -> [f32; 2] {
    let differences = || values.iter().zip(expected).map(|(value, expected)| (value - expected).abs());
    let largest = expected.iter().copied().fold(0.0, f32::max);
    [differences().fold(0.0, f32::max) / largest, differences().sum::<f32>() / expected.iter().sum::<f32>()]
}

#[test]
fn vectors_of_rays_gather_what_single_rays_do() {
    let subject = Subject::new(1.0 / 48.0);
    let prepared = subject.prepared(0.5);
    let level = math::simd::level();
    let mut rays = prepared.rays();
    assert!(rays.times.count > 1);
    let single = |index: usize| {
        let pixel = DVec2::new((index % SIZE[0]) as f64 + 0.5, (index / SIZE[0]) as f64 + 0.5);
        dispatch!(level, simd => rays.gather_single(simd, pixel, EVERYTHING)).unwrap_or_default()
    };
    let expected: Vec<Gathered> = (0..SIZE[0] * SIZE[1]).map(single).collect();
    // With a ray of nodes in each pixel; a tile may cross smoke step by step that a single ray crosses at once. Between rays of nodes gas is interpolated.
    assert_eq!(rays.node_pixels, 2);
    for (node_pixels, [largest, mean]) in [(1, [0.015, 5e-4]), (2, [0.15, 0.02])] {
        rays.node_pixels = node_pixels;
        let drawn = picture(&rays, level);
        for value in [brightness, |gathered: &Gathered| gathered.opacity] {
            let values = |picture: &[Gathered]| picture.iter().map(value).collect::<Vec<f32>>();
            let found = errors(&values(&drawn), &values(&expected));
            assert!(found[0] < largest && found[1] < mean, "{node_pixels} pixels between nodes: {found:?}");
        }
    }
}

#[test]
fn vectors_of_all_widths_gather_the_same_bits() {
    let subject = Subject::new(1.0 / 48.0);
    let prepared = subject.prepared(0.5);
    let rays = prepared.rays();
    let bits = |level: Level| -> Vec<[u32; 5]> {
        let picture = picture(&rays, level);
        let bits = picture.iter().map(|gathered| {
            let [red, _, blue] = gathered.scattered;
            [gathered.luminance, red, blue, gathered.opacity, gathered.motion[1]].map(f32::to_bits)
        });
        bits.collect()
    };
    assert!(bits(math::simd::level()) == bits(Level::baseline()));
}

/// Radiance and depth of the pixels of a strip.
fn drawn(prepared: &PreparedVolume, rect: Rect, slices: &[DepthInterval], has_plate: bool) -> Vec<[u32; 5]> {
    let mut strip = Strip::default();
    strip.reset(rect, None, 0);
    if has_plate {
        // A plate that hides nothing.
        strip.hide_beyond(|_| &[f32::INFINITY; SIZE[0]][..rect.width]);
    }
    slices.iter().for_each(|slice| prepared.draw(slice, &mut strip));
    (0..strip.len())
        .map(|index| {
            let [red, green, blue] = strip.radiance.each_ref().map(|plane| plane[index]);
            [red, green, blue, strip.depth[index], strip.transmittance(index)[0]].map(f32::to_bits)
        })
        .collect()
}

#[test]
fn parts_of_the_picture_have_the_bits_of_the_whole() {
    let subject = Subject::new(1.0 / 48.0);
    let prepared = subject.prepared(0.5);
    let whole = drawn(&prepared, Rect::from_size(SIZE[0], SIZE[1]), &[DepthInterval::ALL], false);
    assert!(whole.iter().any(|pixel| f32::from_bits(pixel[0]) > 100.0));
    let parts = [(0, 0, 200, 8), (0, 40, 200, 8), (61, 53, 70, 11), (100, 70, 1, 1), (130, 20, 62, 100)];
    for (x, y, width, height) in parts {
        let rect = Rect { x, y, width, height };
        for has_plate in [false, true] {
            let part = drawn(&prepared, rect, &[DepthInterval::ALL], has_plate);
            for (row, part) in part.chunks_exact(width).enumerate() {
                assert!(part == &whole[(y + row) * SIZE[0] + x..][..width], "{rect:?} {has_plate}");
            }
        }
    }
}

#[test]
fn slices_composite_to_the_whole() {
    let subject = Subject::new(0.0);
    let prepared = subject.prepared(0.5);
    let rect = Rect::from_size(SIZE[0], SIZE[1]);
    let cuts = [0.0, 2.1, 2.31, 2.4, f64::INFINITY];
    let slices: Vec<DepthInterval> =
        cuts.windows(2).map(|pair| DepthInterval { near: pair[0], far: pair[1] }).collect();
    let [whole, sliced] = [&[DepthInterval::ALL][..], &slices].map(|slices| drawn(&prepared, rect, slices, false));
    let red = |pixels: &[[u32; 5]]| pixels.iter().map(|pixel| f32::from_bits(pixel[0])).collect::<Vec<f32>>();
    let found = errors(&red(&sliced), &red(&whole));
    assert!(found[0] < 5e-3 && found[1] < 5e-4, "{found:?}");
}

/// Steps of half a cell, which are taken near, give 2 % more light than those of an eighth, steps of a cell 7 %: gas is not quite linear along them.
#[test]
fn longer_steps_of_rays_change_the_light_by_a_bounded_part() {
    let subject = Subject::of(fire(Fuel::Propane, 0.37, 34.4, 10.0), 0.0);
    let light = |step: f64| {
        let prepared = subject.prepared(step);
        let mut rays = prepared.rays();
        (rays.node_pixels, rays.smoke_light, rays.optics.smoke_extinction) = (1, None, 0.0);
        // Thin soot, whose light adds up.
        rays.optics.soot_absorption = 0.5;
        let picture = picture(&rays, math::simd::level());
        picture.iter().map(|gathered| f64::from(gathered.luminance)).sum::<f64>()
    };
    let [exact, half, whole] = [0.125, 0.5, 1.0].map(light);
    assert!(exact > 1e3, "{exact}");
    assert!((half / exact - 1.0).abs() < 0.04 && (whole / exact - 1.0).abs() < 0.1, "{half} {whole} {exact}");
}

#[test]
fn gas_fades_out_at_open_sides_and_at_the_top() {
    let subject = Subject::new(0.0);
    let prepared = subject.prepared(0.5);
    let field = prepared.rays().field;
    let [width, height, depth] = field.grid.size.map(|cells| cells as f32);
    let middle = Vec3::new(0.5 * width, 0.5 * height, 0.5 * depth);
    assert_eq!(field.fading(middle), 1.0);
    // The bottom is a floor, or air flows in there.
    assert_eq!(field.fading(middle.with_y(-0.5)), 1.0);
    for outside in [middle.with_x(-0.5), middle.with_x(width - 0.5), middle.with_z(-0.5), middle.with_y(height - 0.5)] {
        assert_eq!(field.fading(outside), 0.0);
    }
    assert_eq!(field.fading(middle.with_z(depth - 3.5)), 0.5);
}

/// The light on smoke at a point, relative to that without smoke on the way.
fn share_of_light(prepared: &PreparedVolume, bare: &PreparedVolume, point: Vec3) -> f32 {
    let level = math::simd::level();
    let red = |rays: &GasRays| dispatch!(level, simd => rays.smoke_radiance(simd, point))[0];
    red(&prepared.rays()) / red(&bare.rays())
}

#[test]
fn smoke_is_darker_where_more_smoke_is_before_the_fire() {
    let subject = Subject::new(0.0);
    let mut thin = Subject::new(0.0);
    // Hardly any soot: neither flames nor smoke absorb anything, and the sum of the light stays that of the lights.
    thin.rendering.soot_gain = 1e-6;
    let (prepared, bare) = (subject.prepared(0.5), thin.prepared(0.5));
    let [width, height, depth] = subject.simulation.flow.grid.size.map(|cells| cells as f32);
    let at = |y: f32| share_of_light(&prepared, &bare, Vec3::new(0.5 * width, y * height, 0.5 * depth));
    let (low, high) = (at(0.25), at(0.7));
    assert!(low <= 1.001 && high < 0.9 * low && high > 0.0, "{low} {high}");
}
