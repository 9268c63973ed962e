//! Rendered gas compared with closed forms: one ball of gas, pairs of them, and clouds.

mod endings;
mod exposures;
mod lenses;
mod paper;
mod seams;

use bansho_base::{
    camera::{CameraParameters, Lens},
    color,
    host::observer::Unobserved,
    image::Rect,
    math::{
        self, DVec2, DVec3,
        random::{Key, Purpose},
    },
    parameters::animated::Animated,
    phenomenon::{
        Prepared,
        strip::{DepthInterval, Shutter, Strip, View},
        surroundings::{Emitter, Light, Publication, Surroundings},
    },
    world::{
        air::Air,
        wind::{Wind, WindParameters},
    },
};

use super::{deflection::refractivity, *};
use crate::particles::{GasParticles, Particle, render::splat::kernel::LINE_PEAK};

const SIZE: [usize; 2] = [160, 120];
const DISTANCE: f64 = 4.0;

/// A camera `DISTANCE` before the origin that looks at it.
fn camera() -> CameraParameters {
    CameraParameters {
        position: Animated::from([0.0, 0.0, DISTANCE]),
        target: Animated::from([0.0, 0.0, 0.0]),
        ..CameraParameters::default()
    }
}

fn view(camera: CameraParameters) -> View {
    View::new(camera, Shutter { open: 1.0, close: 1.0 }, 1.04, SIZE, 0)
}

/// A liter of gas at `position`.
fn ball(id: u64, position: [f32; 3], temperature: f32, soot: f32) -> Particle {
    Particle {
        id,
        position,
        velocity: [0.0; 3],
        mass: 0.0002,
        density: 0.2,
        temperature,
        support_radius: 0.3,
        age: 0.1,
        max_age: 1.0,
        fuel: 0.0,
        soot,
    }
}

fn cloud(balls: impl IntoIterator<Item = Particle>) -> GasParticles {
    let mut particles = GasParticles::new(DVec3::ZERO);
    balls.into_iter().for_each(|ball| particles.push(ball));
    particles
}

/// A cloud of glowing gas around the origin.
fn glowing_cloud(count: u64) -> GasParticles {
    cloud((0..count).map(|id| {
        let [x, y, z, w] = Key::new(3, "cloud").uniforms(id, 0, Purpose::named("place")).map(|u| u - 0.5);
        ball(id, [0.9 * x, 1.2 * y, 0.9 * z], 1700.0 + 300.0 * w, 4e-7)
    }))
}

fn gas<'a>(particles: &'a GasParticles, buffers: &'a BufferPool) -> Gas<'a> {
    Gas {
        particles,
        time: 1.0,
        air_temperature_k: 293.15,
        detail_speed: 0.5,
        base: DVec3::ZERO,
        size: DVec2::ONE,
        key: Key::new(1, "flame"),
        fade_out: FadeOut::NEVER,
        buffers,
    }
}

fn smooth() -> GasRenderingParameters {
    GasRenderingParameters { detail: 0.0, ..GasRenderingParameters::default() }
}

/// Prepares the gas and hands it to `each`.
fn prepared<T>(
    particles: &GasParticles,
    rendering: &GasRenderingParameters,
    view: &View,
    each: impl FnOnce(&PreparedGas) -> T,
) -> T {
    let (wind, air) = (Wind::new(WindParameters::default(), 1, None), Air::default());
    let surroundings = Surroundings { air: &air, ..Surroundings::from_wind(&wind) };
    let buffers = BufferPool::default();
    each(&PreparedGas::new(gas(particles, &buffers), rendering, view, &surroundings, &Unobserved).unwrap())
}

/// The whole picture drawn as one strip, with AOVs where wanted and a plate at `plate` m.
fn drawn(
    particles: &GasParticles,
    rendering: &GasRenderingParameters,
    view: &View,
    aovs: usize,
    plate: Option<f32>,
) -> Strip {
    let depths = plate.map(|depth| vec![depth; SIZE[0]]);
    let mut strip = Strip::default();
    let rect = Rect::from_size(SIZE[0], SIZE[1]);
    match &depths {
        Some(depths) => strip.reset(rect, Some(&|_| depths.as_slice()), aovs),
        None => strip.reset(rect, None, aovs),
    }
    prepared(particles, rendering, view, |prepared| prepared.draw(&DepthInterval::ALL, &mut strip));
    strip
}

fn luminance(strip: &Strip, x: usize, y: usize) -> f64 {
    let index = y * SIZE[0] + x;
    f64::from(color::luminance([0, 1, 2].map(|c| strip.radiance[c][index])))
}

fn black(temperature: f32) -> f64 {
    f64::from(color::luminance(color::black_body().radiance(temperature)))
}

#[test]
fn a_ball_of_gas_shines_as_kirchhoffs_law_and_its_line_integral_say() {
    let view = view(camera());
    let pixels_per_meter = view.camera.focal_pixels / DISTANCE;
    for soot in [1e-8, 2e-6, 3e-5] {
        let strip = drawn(&cloud([ball(0, [0.0; 3], 1800.0, soot)]), &smooth(), &view, 0, None);
        let absorption = soot_absorption(f64::from(soot), &smooth());
        for x in [80, 84, 88, 92, 96] {
            let b = math::hypot(f64::from(x as u32) + 0.5 - 80.0, 0.5) / pixels_per_meter;
            let depth = line_integral(b, 0.3) * 0.001 * absorption;
            let expected = black(1800.0) * -math::exp_m1(-depth);
            let got = luminance(&strip, x, 60);
            // The grid is exact to a few hundredths of the depth in the middle; this is what that makes of the light.
            let off = 0.035 * LINE_PEAK / 0.09 * 0.001 * absorption * math::exp(-depth) * black(1800.0);
            assert!((got - expected).abs() < off + 1e-3 * expected, "soot {soot}, column {x}: {got} for {expected}");
        }
        let alpha = 1.0 - f64::from(strip.transmittance(60 * SIZE[0] + 80)[0]);
        assert!((alpha * black(1800.0) / luminance(&strip, 80, 60) - 1.0).abs() < 1e-4, "emission follows absorption");
    }
}

#[test]
fn all_the_light_of_a_thin_ball_arrives() {
    let view = view(camera());
    let scale = view.camera.focal_pixels / DISTANCE;
    let strip = drawn(&cloud([ball(0, [0.11, 0.07, 0.0], 1800.0, 1e-8)]), &smooth(), &view, 0, None);
    let sum: f64 =
        (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))).map(|(x, y)| luminance(&strip, x, y)).sum();
    let intensity = black(1800.0) * 0.001 * soot_absorption(1e-8, &smooth());
    assert!((sum / (scale * scale) / intensity - 1.0).abs() < 5e-3, "{}", sum / (scale * scale) / intensity);
}

#[test]
fn a_hotter_flame_is_brighter_by_the_ratio_of_physics_and_has_its_color() {
    let view = view(camera());
    let pixel = |temperature: f32| {
        let strip = drawn(&cloud([ball(0, [0.0; 3], temperature, 1e-8)]), &smooth(), &view, 0, None);
        [0, 1, 2].map(|c| strip.radiance[c][60 * SIZE[0] + 80])
    };
    let (cool, hot) = (pixel(1800.0), pixel(2300.0));
    // Luminances of black bodies at 2300 K and 1800 K, cd/m^2, from the reference table.
    let reference = 2.352_55e6 / 117_471.0;
    let ratio = f64::from(color::luminance(hot) / color::luminance(cool));
    assert!((ratio / reference - 1.0).abs() < 1e-3, "{ratio} for {reference}");
    let chromaticity = |rgb: [f32; 3]| {
        let [x, y, z] = color::xyz_from_acescg(rgb);
        [x / (x + y + z), y / (x + y + z)]
    };
    for (rgb, expected) in [(cool, 1800.0), (hot, 2300.0)] {
        let (got, expected) = (chromaticity(rgb), chromaticity(color::black_body().radiance(expected)));
        assert!((0..2).all(|axis| (got[axis] - expected[axis]).abs() < 1e-3), "{got:?} for {expected:?}");
    }
}

#[test]
fn detail_keeps_the_mean_light() {
    let view = view(camera());
    let particles = glowing_cloud(400);
    let mean = |rendering: &GasRenderingParameters| {
        let strip = drawn(&particles, rendering, &view, 0, None);
        strip.radiance[1].iter().map(|value| f64::from(*value)).sum::<f64>()
    };
    let (plain, fine) = (
        mean(&smooth()),
        mean(&GasRenderingParameters { detail: 1.0, detail_size: 0.25, ..GasRenderingParameters::default() }),
    );
    assert!((fine / plain - 1.0).abs() < 0.1, "{}", fine / plain);
}

#[test]
fn no_sprite_is_a_disc() {
    // A lone particle with detail: along the circle of half its radius the light differs by more than its half.
    let view = view(camera());
    let strip = drawn(&cloud([ball(0, [0.0; 3], 1800.0, 4e-7)]), &GasRenderingParameters::default(), &view, 0, None);
    let radius = 0.5 * 0.3 * view.camera.focal_pixels / DISTANCE;
    let around: Vec<f64> = (0..48)
        .map(|i| {
            let (sin, cos) = math::sin_cos(f64::from(i) / 48.0 * std::f64::consts::TAU);
            luminance(&strip, (80.0 + radius * cos) as usize, (60.0 + radius * sin) as usize)
        })
        .collect();
    let (least, most) = around.iter().fold((f64::MAX, 0.0_f64), |(low, high), v| (low.min(*v), high.max(*v)));
    assert!(least < 0.5 * most, "{least} {most}");
}

#[test]
fn haze_bends_by_the_gradient_of_the_path_and_only_around_the_gas() {
    let view = view(camera());
    let particles = cloud([ball(0, [0.0; 3], 1500.0, 0.0)]);
    let rendering = GasRenderingParameters { heat_haze_gain: 3.0, ..smooth() };
    let scale = view.camera.focal_pixels / DISTANCE;
    prepared(&particles, &rendering, &view, |prepared| {
        let bend = prepared.deflection().unwrap();
        let at = |x: usize, y: usize| bend.angle.at(x - bend.rect.x, y - bend.rect.y);
        let weight = 3.0 * (refractivity(1500.0) - refractivity(293.15)) * 0.001;
        let peak = (weight * line_gradient(0.12, 0.3)).abs();
        let (mut squares, mut count) = (0.0, 0.0);
        for (x, y) in (62..98).flat_map(|x| (42..78).map(move |y| (x, y))) {
            let [right, up] = [f64::from(x) + 0.5 - 80.0, 60.0 - f64::from(y) - 0.5].map(|pixels| pixels / scale);
            let distance = math::hypot(right, up);
            let slope = weight * line_gradient(distance, 0.3) / distance;
            for (got, expected) in at(x as usize, y as usize).into_iter().zip([right, up].map(|along| slope * along)) {
                let off = f64::from(got) - expected;
                assert!(off.abs() < 0.05 * peak, "{x}, {y}: {got} for {expected}, at most {peak}");
                (squares, count) = (squares + off * off, count + 1.0);
            }
        }
        assert!((squares / count).sqrt() < 0.015 * peak, "{} of {peak}", (squares / count).sqrt());
        assert!(f64::from(at(86, 60)[0]) > 0.9 * peak, "light bends outward, to the denser air");
        assert!(f64::from(at(80, 50)[1]) > 0.0 && f64::from(at(80, 70)[1]) < 0.0, "upward above, downward below");
        for (x, y) in [(130, 60), (80, 110), (20, 20)] {
            let inside = x >= bend.rect.x && x < bend.rect.right() && y >= bend.rect.y && y < bend.rect.bottom();
            assert!(!inside || at(x, y) == [0.0; 2], "{x} {y}");
        }
    });
    let straight = GasRenderingParameters { heat_haze_gain: 0.0, ..smooth() };
    assert!(prepared(&particles, &straight, &view, |prepared| prepared.deflection().is_none()));
}

#[test]
fn lights_carry_the_light_of_the_picture() {
    let view = view(camera());
    let thin = cloud((0..30).map(|i| ball(i, [0.02 * i as f32 - 0.3, 0.03 * i as f32 - 0.45, 0.0], 1750.0, 2e-9)));
    let scale = view.camera.focal_pixels / DISTANCE;
    let strip = drawn(&thin, &smooth(), &view, 0, None);
    let seen: f64 = strip.radiance[0].iter().map(|value| f64::from(*value)).sum::<f64>() / (scale * scale);
    let lights = point_lights_of_gas(&gas(&thin, &BufferPool::default()), &GasRenderingParameters::default(), 1.0);
    assert_eq!(lights.len(), 3);
    let sum: f64 = lights.iter().map(|light| f64::from(light.intensity[0])).sum();
    assert!((sum / seen - 1.0).abs() < 0.02, "{sum} {seen}");
    let heights: Vec<f64> = lights
        .iter()
        .map(|light| match light.emitter {
            Emitter::Point { position, .. } => position.y,
            _ => f64::NAN,
        })
        .collect();
    assert!(heights.is_sorted() && heights[0] < -0.2 && heights[2] > 0.2, "{heights:?}");
}

#[test]
fn no_lens_and_no_place_of_the_camera_is_too_much() {
    let particles = glowing_cloud(300);
    for lens in [Lens::Perspective, Lens::Fisheye, Lens::Panorama] {
        for position in [[0.0, 0.0, 0.0], [0.05, -0.2, 0.3], [0.0, 0.0, 3.0], [0.0, 5.0, 0.001]] {
            let camera = CameraParameters { lens, position: Animated::from(position), ..camera() };
            for sprite in [SpriteStyle::LineIntegral, SpriteStyle::Poly6, SpriteStyle::Squares] {
                let rendering = GasRenderingParameters { sprite, ..GasRenderingParameters::default() };
                let view = view(camera.clone());
                let strip = drawn(&particles, &rendering, &view, AOVS.len(), None);
                let finite = strip.radiance.iter().flatten().all(|value| value.is_finite());
                let dark = (0..strip.len()).map(|i| luminance(&strip, i % SIZE[0], i / SIZE[0])).fold(0.0, f64::min);
                assert!(finite && dark >= 0.0, "{lens:?} {position:?} {sprite:?}: {dark}");
                assert!(strip.radiance[0].iter().any(|value| *value > 0.0), "{lens:?} {position:?} {sprite:?}");
                prepared(&particles, &rendering, &view, |prepared| {
                    let finite = prepared
                        .deflection()
                        .is_none_or(|bend| bend.angle.pixels().iter().flatten().all(|value| value.is_finite()));
                    assert!(finite, "{lens:?} {position:?}");
                });
            }
        }
    }
}

#[test]
fn strips_crops_and_threads_change_no_bit() {
    // So many, and so small, that there are several tasks of particles and of rows.
    let mut particles = glowing_cloud(10_000);
    particles.support_radius.fill(0.08);
    let rendering = GasRenderingParameters::default();
    let view = view(camera());
    let whole = drawn(&particles, &rendering, &view, 0, None);
    for threads in [1, 2, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            prepared(&particles, &rendering, &view, |prepared| {
                for rect in [Rect { x: 0, y: 40, width: 160, height: 8 }, Rect { x: 67, y: 51, width: 31, height: 23 }]
                {
                    let mut strip = Strip::default();
                    strip.reset(rect, None, 0);
                    prepared.draw(&DepthInterval::ALL, &mut strip);
                    for (row, values) in strip.radiance[0].chunks(rect.width).enumerate() {
                        let same = &whole.radiance[0][(rect.y + row) * SIZE[0] + rect.x..][..rect.width];
                        assert_eq!(values, same, "{threads} threads, {rect:?}, row {row}");
                    }
                }
            });
        });
    }
}

#[test]
fn a_part_of_the_picture_alone_is_the_same_to_the_bit() {
    // Large and small balls, so that there are grids of several finenesses.
    let mut particles = glowing_cloud(500);
    particles.support_radius.iter_mut().step_by(3).for_each(|radius| *radius *= 0.12);
    particles.support_radius.iter_mut().step_by(7).for_each(|radius| *radius *= 3.0);
    let rendering = GasRenderingParameters::default();
    let whole_view = view(camera());
    let part = Rect { x: 67, y: 51, width: 31, height: 23 };
    let part_view = View { window: part, ..view(camera()) };
    let seen = |view: &View| {
        prepared(&particles, &rendering, view, |prepared| {
            let mut strip = Strip::default();
            strip.reset(part, None, 0);
            prepared.draw(&DepthInterval::ALL, &mut strip);
            let bend = prepared.deflection().unwrap();
            let at =
                |i: usize| bend.angle.at(part.x + i % part.width - bend.rect.x, part.y + i / part.width - bend.rect.y);
            ((0..strip.len()).map(at).collect::<Vec<_>>(), strip.radiance)
        })
    };
    let (whole, alone) = (seen(&whole_view), seen(&part_view));
    assert!(whole.0.iter().any(|angle| angle[0] != 0.0) && whole.1[0].iter().any(|value| *value > 0.0));
    assert_eq!(whole, alone);
}

#[test]
fn the_plate_hides_what_is_behind_it() {
    let view = view(camera());
    let particles = cloud([ball(0, [0.0; 3], 1800.0, 1e-6)]);
    let lit = |plate| luminance(&drawn(&particles, &smooth(), &view, 0, plate), 80, 60);
    let free = lit(None);
    assert!(free > 0.0 && (lit(Some(9.0)) / free - 1.0).abs() < 1e-6);
    assert_eq!(lit(Some(2.0)), 0.0);
}

#[test]
fn aovs_measure_temperature_depth_and_motion() {
    let view = View { aovs_requested: true, ..view(camera()) };
    let moving = Particle { velocity: [2.0, 1.0, 0.0], ..ball(0, [0.0; 3], 1640.0, 1e-7) };
    let strip = drawn(&cloud([moving]), &smooth(), &view, AOVS.len(), None);
    let at = |name: &str| aov(&strip, name, 80, 60);
    assert!((at("temperature_k") - 1640.0).abs() < 0.5);
    let depth = LINE_PEAK / 0.09 * 0.001 * soot_absorption(1e-7, &smooth());
    assert!((at("optical_depth") / depth - 1.0).abs() < 0.05, "{} for {depth}", at("optical_depth"));
    let pixels = 0.04 * view.camera.focal_pixels / DISTANCE;
    assert!((at("motion.X") - 2.0 * pixels).abs() < 1e-3 && (at("motion.Y") + pixels).abs() < 1e-3);
}

/// What an AOV says at a pixel.
fn aov(strip: &Strip, name: &str, x: usize, y: usize) -> f64 {
    let plane = AOVS.iter().position(|aov| aov.name == name).unwrap();
    f64::from(strip.aovs[plane].resolve(y * SIZE[0] + x, AOVS[plane].rule))
}

#[test]
fn temperature_is_weighted_by_light_and_stays_among_those_that_are_there() {
    let view = view(camera());
    let (cold, hot) = (ball(0, [0.0; 3], 1400.0, 1e-8), ball(1, [0.0, 0.0, -0.5], 1800.0, 1e-8));
    let both = drawn(&cloud([cold, hot]), &smooth(), &view, AOVS.len(), None);
    // Both are thin and as large, but the farther one is seen smaller by the ratio of distances.
    let weights = [cold, hot].map(|ball| black(ball.temperature));
    let expected = (1400.0 * weights[0] + 1800.0 * weights[1]) / (weights[0] + weights[1]);
    let seen = aov(&both, "temperature_k", 80, 60);
    assert!((seen - expected).abs() < 3.0, "{seen} for {expected}");
    let crowd = drawn(&glowing_cloud(400), &smooth(), &view, AOVS.len(), None);
    let glowing = (0..SIZE[0] * SIZE[1]).map(|i| aov(&crowd, "temperature_k", i % SIZE[0], i / SIZE[0]));
    let glowing: Vec<f64> = glowing.filter(|temperature| *temperature > 0.0).collect();
    assert!(glowing.len() > 1000, "{}", glowing.len());
    assert!(glowing.iter().all(|temperature| (1550.0..=1850.0).contains(temperature)), "those of the cloud");
}

#[test]
fn deflection_is_written_as_light_is_bent() {
    let view = View { aovs_requested: true, ..view(camera()) };
    let particles = glowing_cloud(200);
    let strip = drawn(&particles, &smooth(), &view, AOVS.len(), None);
    let angles = prepared(&particles, &smooth(), &view, |prepared| {
        let bend = prepared.deflection().unwrap();
        (bend.rect, bend.angle.clone())
    });
    let (rect, angles) = angles;
    assert!(rect.width > 20 && rect.height > 20);
    for y in rect.y..rect.bottom() {
        for x in rect.x..rect.right() {
            let angle = angles.at(x - rect.x, y - rect.y).map(f64::from);
            let written = ["deflection.X", "deflection.Y"].map(|name| aov(&strip, name, x, y));
            assert!((angle[0] - written[0]).abs() < 1e-9 && (angle[1] - written[1]).abs() < 1e-9, "{x} {y}");
        }
    }
}

#[test]
fn motion_smears_the_sprite_along_its_way_and_loses_no_light() {
    let fast = Particle { velocity: [20.0, 0.0, 0.0], ..ball(0, [0.0; 3], 1800.0, 1e-8) };
    let still = drawn(&cloud([fast]), &smooth(), &view(camera()), 0, None);
    let open = View::new(camera(), Shutter { open: 0.99, close: 1.01 }, 1.04, SIZE, 0);
    let smeared = drawn(&cloud([fast]), &smooth(), &open, 0, None);
    let variance = |strip: &Strip| {
        let square = |index: usize| (index % SIZE[0]) as f64 - 79.5;
        let light = || strip.radiance[0].iter().map(|value| f64::from(*value)).enumerate();
        light().map(|(index, value)| value * square(index) * square(index)).sum::<f64>()
            / light().map(|(_, value)| value).sum::<f64>()
    };
    let length = 0.4 * open.camera.focal_pixels / DISTANCE;
    let grown = variance(&smeared) - variance(&still);
    assert!((grown / (length * length / 12.0) - 1.0).abs() < 0.05, "{grown} for a box of {length} pixels");
    let light = |strip: &Strip| strip.radiance[0].iter().map(|value| f64::from(*value)).sum::<f64>();
    assert!((light(&smeared) / light(&still) - 1.0).abs() < 0.01);
}

/// Light and opacity in the middle of a ball of gas among lights of so much illuminance.
fn lit_ball(ball: Particle, rendering: &GasRenderingParameters, illuminance: f32) -> ([f64; 3], f64) {
    let (view, buffers, wind, air) =
        (view(camera()), BufferPool::default(), Wind::new(WindParameters::default(), 1, None), Air::default());
    let sun = Light { emitter: Emitter::Directional { toward: DVec3::Y }, intensity: [illuminance; 3] };
    let others = Publication { lights: vec![sun], ..Publication::default() };
    let surroundings = Surroundings { air: &air, others, ..Surroundings::from_wind(&wind) };
    let particles = cloud([ball]);
    let prepared = PreparedGas::new(gas(&particles, &buffers), rendering, &view, &surroundings, &Unobserved).unwrap();
    let mut strip = Strip::default();
    strip.reset(Rect::from_size(SIZE[0], SIZE[1]), None, 0);
    prepared.draw(&DepthInterval::ALL, &mut strip);
    let middle = 60 * SIZE[0] + 80;
    ([0, 1, 2].map(|c| f64::from(strip.radiance[c][middle])), 1.0 - f64::from(strip.transmittance(middle)[0]))
}

#[test]
fn cold_soot_is_smoke_that_hides_and_shows_the_light_of_others_alone() {
    let smoke = ball(0, [0.0; 3], 320.0, 3e-5);
    let (dark, opacity) = lit_ball(smoke, &smooth(), 0.0);
    assert!(opacity > 0.5 && dark.iter().all(|value| *value < 1e-6), "{dark:?} {opacity}");
    for albedo in [0.15, 0.3] {
        let rendering = GasRenderingParameters { smoke_albedo: albedo, ..smooth() };
        // Alike in all directions: albedo E / 4 pi where it hides everything.
        let expected = albedo * 1000.0 / (4.0 * std::f64::consts::PI) * opacity;
        let (lit, as_opaque) = lit_ball(smoke, &rendering, 1000.0);
        assert!((as_opaque - opacity).abs() < 1e-6);
        assert!(lit.iter().all(|value| (value / expected - 1.0).abs() < 1e-3), "{lit:?} for {expected}");
    }
}

#[test]
fn freshly_burning_gas_shines_blue_and_hides_nothing_until_soot_outshines_it() {
    let begun = |fuel: f32, soot: f32| Particle { fuel, ..ball(0, [0.0; 3], 1900.0, soot) };
    let once = GasRenderingParameters { base_blue: 1.0, ..smooth() };
    let twice = GasRenderingParameters { base_blue: 2.0, ..smooth() };
    let (blue, opacity) = lit_ball(begun(0.94, 0.0), &once, 0.0);
    assert!(blue[2] > 2.0 * blue[0] && blue[2] > 0.0 && opacity == 0.0, "{blue:?} {opacity}");
    let (brighter, _) = lit_ball(begun(0.94, 0.0), &twice, 0.0);
    assert!((0..3).all(|c| (brighter[c] / blue[c] - 2.0).abs() < 1e-3), "{blue:?} {brighter:?}");
    // Nothing burns yet, or not any more.
    for fuel in [1.0, 0.1] {
        assert_eq!(lit_ball(begun(fuel, 0.0), &once, 0.0).0, [0.0; 3]);
    }
    // Yellow flames are not blue: soot quenches CH and C2 and outshines what is left.
    let (sooty, _) = lit_ball(begun(0.94, 1e-6), &once, 0.0);
    assert!(sooty[0] > 2.0 * sooty[2], "{sooty:?}");
    let ratio = gas_blue(begun(0.94, 1e-6)) / gas_blue(begun(0.94, 0.0));
    assert!(ratio < 0.02, "{ratio}");
}

/// Luminance per meter of a particle's gas in blue light.
fn gas_blue(ball: Particle) -> f64 {
    gas(&cloud([ball]), &BufferPool::default()).blue_luminance(0, &smooth())
}
