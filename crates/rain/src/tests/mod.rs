//! Rain as a whole: measurements of its pictures.

mod agreement;
mod drops;
mod exposure;
mod lens;
mod light;
mod motion;
pub(crate) mod reference;
mod shadows;

use bansho_base::{
    camera::CameraParameters,
    image::Rect,
    math,
    parameters::{Range, animated::Animated},
    phenomenon::{
        Prepared,
        strip::{AovRule, DepthInterval, Shutter, Strip, View},
        surroundings::{Emitter, Light, Publication, Surroundings},
    },
    world::{
        sky::{Sky, SkyKind},
        wind::{Wind, WindParameters},
    },
};

use super::{Method, Rain, RainParameters, RainRun, aovs::AOVS, lighting::LightCaches, render::PreparedRain};

pub(super) const METHODS: [Method; 2] = [Method::Billboards, Method::Drops];

/// A camera 1.6 m above the ground that looks along -z, a little up.
pub(super) fn view_at(t: f64, exposure: f64, size: [usize; 2]) -> View {
    let camera = CameraParameters {
        position: Animated::from([0.0, 1.6, 0.0]),
        target: Animated::from([0.0, 1.9, -4.0]),
        vertical_fov_deg: Animated::from(32.0),
        ..CameraParameters::default()
    };
    View::new(camera, Shutter { open: t, close: t + exposure }, t + 0.05, size, 0)
}

pub(super) fn wind(velocity: [f64; 3], gust: f64) -> Wind {
    let velocity = Animated::from(velocity);
    Wind::new(WindParameters { velocity, gust, ..WindParameters::default() }, 5, None)
}

/// Streaks alone, at a rate.
pub(super) fn streaks(method: Method, rate_mm_per_h: f64) -> RainParameters {
    let mut parameters = RainParameters {
        rate_mm_per_h: rate_mm_per_h.into(),
        method,
        airlight_distance: 0.0,
        ..RainParameters::default()
    };
    parameters.splashes.fraction = 0.0;
    parameters
}

pub(super) fn rain(parameters: RainParameters, seed: u64) -> Rain {
    Rain::new(parameters, "rain", seed, None).expect("the parameters go together")
}

pub(super) fn lamp(position: [f64; 3], intensity: f32) -> Light {
    Light { emitter: Emitter::Point { position: position.into(), radius: 0.05 }, intensity: [intensity; 3] }
}

/// A whole picture in one strip.
pub(super) fn draw(rain: &Rain, view: &View, surroundings: &Surroundings) -> Strip {
    draw_part(rain, view, surroundings, Rect::from_size(view.size[0], view.size[1]), &DepthInterval::ALL)
}

pub(super) fn draw_part(
    rain: &Rain,
    view: &View,
    surroundings: &Surroundings,
    rect: Rect,
    slice: &DepthInterval,
) -> Strip {
    draw_with(rain, &LightCaches::default(), view, surroundings, rect, slice)
}

fn draw_with(
    rain: &Rain,
    light_caches: &LightCaches,
    view: &View,
    surroundings: &Surroundings,
    rect: Rect,
    slice: &DepthInterval,
) -> Strip {
    let prepared = PreparedRain::new(rain, light_caches, view, surroundings);
    let mut strip = Strip::default();
    strip.reset(rect, None, AOVS.len());
    prepared.draw(slice, &mut strip);
    strip
}

/// Opacity of the streaks of each pixel.
pub(super) fn opacity(strip: &Strip) -> Vec<f32> {
    (0..strip.len()).map(|index| strip.aovs[0].resolve(index, AovRule::Sum)).collect()
}

pub(super) fn lit(wind: &Wind) -> Surroundings<'_> {
    let lights = vec![lamp([0.8, 3.0, -3.0], 500.0)];
    let sky = Sky::new(SkyKind::Overcast, 20.0, 7000.0);
    Surroundings { sky, others: Publication { lights, ..Publication::default() }, ..Surroundings::from_wind(wind) }
}

#[test]
fn no_rain_is_exactly_nothing() {
    let wind = wind([3.0, 0.0, 0.0], 0.3);
    for method in METHODS {
        let rain = rain(RainParameters { rate_mm_per_h: 0.0.into(), method, ..RainParameters::default() }, 1);
        let strip = draw(&rain, &view_at(1.0, 0.02, [64, 36]), &lit(&wind));
        assert!(strip.radiance.iter().flatten().all(|value| *value == 0.0));
        assert!((0..strip.len()).all(|index| strip.transmittance(index) == [1.0; 3]));
    }
}

#[test]
fn strips_crops_and_threads_change_no_pixel() {
    let wind = wind([2.0, 0.0, 1.0], 0.3);
    let surroundings = lit(&wind);
    let view = view_at(1.0, 0.02, [96, 54]);
    for method in METHODS {
        let rain = rain(RainParameters { method, ..RainParameters::default() }, 1);
        let whole = draw(&rain, &view, &surroundings);
        let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        assert_eq!(whole.radiance, one_thread.install(|| draw(&rain, &view, &surroundings)).radiance);
        let rect = Rect { x: 21, y: 13, width: 50, height: 11 };
        let part = draw_part(&rain, &view, &surroundings, rect, &DepthInterval::ALL);
        for y in 0..rect.height {
            for x in 0..rect.width {
                let (there, here) = ((y + rect.y) * 96 + x + rect.x, y * rect.width + x);
                assert_eq!(whole.radiance[1][there], part.radiance[1][here], "{x} {y}");
                assert_eq!(whole.transmittance(there), part.transmittance(here));
            }
        }
    }
}

#[test]
fn a_window_shows_near_drops_that_only_their_blur_brings_into_it() {
    let calm = wind([0.0; 3], 0.0);
    let surroundings = lit(&calm);
    let diameters_mm = vec![3.0, 4.0, 5.0];
    let rain = rain(RainParameters { distance: 1.0, diameters_mm, ..streaks(Method::Drops, 300.0) }, 1);
    let rect = Rect { x: 56, y: 32, width: 80, height: 40 };
    for frame in 0..200 {
        let view = view_at(1.0 + 0.1 * f64::from(frame), 1e-4, [192, 108]);
        let whole = draw_part(&rain, &view, &surroundings, rect, &DepthInterval::ALL);
        let part = draw_part(&rain, &View { window: rect, ..view }, &surroundings, rect, &DepthInterval::ALL);
        for index in 0..whole.len() {
            assert_eq!(whole.transmittance(index), part.transmittance(index), "frame {frame}, {index}");
        }
    }
}

#[test]
fn slices_of_depth_come_to_the_whole() {
    let wind = wind([0.0; 3], 0.0);
    let surroundings = lit(&wind);
    let view = view_at(1.0, 0.02, [96, 54]);
    let rect = Rect::from_size(96, 54);
    for method in METHODS {
        let rain = rain(RainParameters { method, ..RainParameters::default() }, 1);
        let whole = draw(&rain, &view, &surroundings);
        let edges = [0.0, 1.5, 3.0, 4.2, f64::INFINITY];
        let slices: Vec<Strip> = edges
            .windows(2)
            .map(|pair| draw_part(&rain, &view, &surroundings, rect, &DepthInterval { near: pair[0], far: pair[1] }))
            .collect();
        let mut sums = [0.0; 2];
        for index in 0..whole.len() {
            let (mut light, mut through) = (0.0, 1.0);
            for slice in &slices {
                light += through * slice.radiance[1][index];
                through *= slice.transmittance(index)[1];
            }
            sums[0] += f64::from(light);
            sums[1] += f64::from(whole.radiance[1][index]);
            // Of the slices, the light around the lamp is in the first one, otherwise behind all streaks of the pixel.
            assert!(
                (light - whole.radiance[1][index]).abs() < 1.5e-2 * light.max(0.1),
                "{light} {}",
                whole.radiance[1][index]
            );
            assert!((through - whole.transmittance(index)[1]).abs() < 1e-4);
        }
        assert!((sums[0] / sums[1] - 1.0).abs() < 1e-3, "{sums:?}");
    }
}

#[test]
fn depth_and_diameter_are_those_of_the_nearest_streak() {
    let wind = wind([0.0; 3], 0.0);
    let view = view_at(1.0, 0.02, [96, 54]);
    for method in METHODS {
        let rain = rain(streaks(method, 20.0), 1);
        let strip = draw(&rain, &view, &lit(&wind));
        let mut covered = 0;
        for (index, opacity) in opacity(&strip).into_iter().enumerate() {
            let [depth, diameter] = [1, 2].map(|plane: usize| strip.aovs[plane].resolve(index, AovRule::Nearest));
            if opacity > 0.0 {
                assert_eq!(depth, strip.depth[index]);
                assert!(rain.parameters().diameters_mm.iter().any(|known| *known as f32 == diameter), "{diameter}");
                covered += 1;
            } else {
                assert_eq!([depth, diameter], [0.0; 2]);
            }
        }
        assert!(covered > strip.len() / 4, "{method:?}: {covered}");
    }
}

#[test]
fn the_optical_depth_of_the_medium_is_that_of_what_passes_between_streaks() {
    let wind = wind([0.0; 3], 0.0);
    let view = view_at(1.0, 0.02, [96, 54]);
    for method in METHODS {
        let parameters = RainParameters { airlight_distance: 800.0, opacity_gain: 20.0, ..streaks(method, 2.0) };
        let rain = rain(parameters, 1);
        let whole = draw(&rain, &view, &lit(&wind));
        let depths = |strip: &Strip| -> Vec<f32> {
            (0..strip.len()).map(|index| strip.aovs[3].resolve(index, AovRule::Sum)).collect()
        };
        let optical_depths = depths(&whole);
        let mut free = 0;
        for (index, opacity) in opacity(&whole).into_iter().enumerate() {
            let passed = math::exp(f64::from(-optical_depths[index])) as f32;
            assert!(optical_depths[index] > 0.01 && whole.transmittance(index)[1] < passed + 1e-5);
            if opacity == 0.0 {
                assert!((whole.transmittance(index)[1] - passed).abs() < 1e-5, "{method:?}: {passed}");
                free += 1;
            }
        }
        assert!(free > 20, "{method:?}: {free}");
        // The optical depths of parts in depth add up.
        let rect = Rect::from_size(view.size[0], view.size[1]);
        let part = |near, far| depths(&draw_part(&rain, &view, &lit(&wind), rect, &DepthInterval { near, far }));
        let parts = [part(0.0, 12.0), part(12.0, f64::INFINITY)];
        for (index, whole) in optical_depths.iter().enumerate() {
            let sum: f32 = parts.iter().map(|part| part[index]).sum();
            assert!((sum / whole - 1.0).abs() < 3e-3, "{method:?}: {sum} {whole}");
        }
    }
}

#[test]
fn splashes_stay_near_the_ground_and_grow_with_the_rain() {
    let calm = wind([0.0; 3], 0.0);
    let mut view = view_at(1.0, 0.02, [160, 90]);
    view.camera_parameters.target = Animated::from([0.0, 0.6, -4.0]);
    let view = View::new(view.camera_parameters, view.shutter, 1.1, view.size, 0);
    let picture = |rate: f64, amount: f64| {
        let mut parameters = streaks(Method::Drops, rate);
        parameters.splashes.fraction = amount;
        opacity(&draw(&rain(parameters, 1), &view, &Surroundings::from_wind(&calm)))
    };
    // How much splashes add to the rows above and below the one that shows 0.3 m above the ground at the end of their reach.
    let end = bansho_base::math::DVec3::new(0.0, 0.3, -8.0);
    let line = view.camera.project(end).map_or(0, |place| place.pixel.y as usize);
    let added = |rate: f64| {
        let pairs = picture(rate, 1.0).into_iter().zip(picture(rate, 0.0)).map(|(with, without)| with - without);
        let (above, below): (Vec<_>, Vec<_>) = pairs.enumerate().partition(|(index, _)| index / 160 < line);
        [above, below].map(|part| part.iter().map(|(_, opacity)| opacity.abs()).sum::<f32>())
    };
    let ([none, weak], [nothing, strong]) = (added(5.0), added(50.0));
    assert_eq!([none, nothing], [0.0; 2]);
    assert!(weak > 0.0 && strong > 3.0 * weak, "{weak} {strong}");
    bansho_base::assert_measured!("future work: splashes: at 50 over 5 mm/h", f64::from(strong / weak), 6.9, 0.05);
}

#[test]
fn the_plate_hides_all_rain_behind_it() {
    let wind = wind([0.0; 3], 0.0);
    let surroundings = lit(&wind);
    let view = view_at(1.0, 0.02, [96, 54]);
    for method in METHODS {
        let rain = rain(RainParameters { method, ..RainParameters::default() }, 1);
        let caches = LightCaches::default();
        let prepared = PreparedRain::new(&rain, &caches, &view, &surroundings);
        let draw = |depth: f32| {
            let plate = vec![depth; 96];
            let mut strip = Strip::default();
            strip.reset(Rect::from_size(96, 54), Some(&|_| &plate), 0);
            prepared.draw(&DepthInterval::ALL, &mut strip);
            strip
        };
        let sum = |strip: &Strip| strip.radiance[1].iter().sum::<f32>();
        let (wall, near, far) = (draw(0.01), draw(2.5), draw(1e6));
        // A centimeter of airlight is in front of it.
        assert!(sum(&wall) < 0.02 * sum(&near) && sum(&near) > 0.0 && sum(&far) > 1.3 * sum(&near));
        assert!(near.depth.iter().all(|depth| *depth < 2.5 || depth.is_infinite()));
    }
}

#[test]
fn a_solid_bounds_the_rain_in_its_own_pixels_alone() {
    let wind = wind([0.0; 3], 0.0);
    let surroundings = lit(&wind);
    let view = view_at(1.0, 0.02, [96, 54]);
    let rain = rain(RainParameters::default(), 1);
    let caches = LightCaches::default();
    let prepared = PreparedRain::new(&rain, &caches, &view, &surroundings);
    // The post is in front of the lamp's halo, and neither of its edges is at the edge of a tile.
    let post = 37..51;
    let depths: Vec<f32> = (0..96).map(|x| if post.contains(&x) { 2.5 } else { f32::INFINITY }).collect();
    let draw = |rect: Rect, depths: Option<&[f32]>, slices: &[f64]| {
        let mut strip = Strip::default();
        let row = |_: usize| depths.unwrap_or_default();
        strip.reset(rect, depths.is_some().then_some(&row as _), 0);
        for pair in slices.windows(2) {
            prepared.draw(&DepthInterval { near: pair[0], far: pair[1] }, &mut strip);
        }
        strip
    };
    let (all, whole) = ([0.0, f64::INFINITY], Rect::from_size(96, 54));
    let (free, before_post) = (draw(whole, None, &all), draw(whole, Some(&depths), &all));
    let wall = draw(whole, Some(&[2.5; 96]), &all);
    for index in 0..before_post.len() {
        let expected = if post.contains(&(index % 96)) { &wall } else { &free };
        assert_eq!(
            before_post.radiance.each_ref().map(|c| c[index]),
            expected.radiance.each_ref().map(|c| c[index]),
            "{index}"
        );
        assert_eq!(before_post.transmittance(index), expected.transmittance(index), "{index}");
    }
    let sum = |strip: &Strip| strip.radiance[1].iter().sum::<f32>();
    assert!(sum(&wall) < 0.8 * sum(&before_post) && sum(&before_post) < 0.95 * sum(&free), "the post hides rain");
    let rect = Rect { x: 40, y: 13, width: 50, height: 11 };
    let part = draw(rect, Some(&depths), &all);
    for index in 0..part.len() {
        let there = (index / rect.width + rect.y) * 96 + index % rect.width + rect.x;
        assert_eq!(part.radiance[1][index], before_post.radiance[1][there], "{index}");
    }
}

#[test]
fn any_rain_gives_finite_pictures() {
    let lenses = [
        bansho_base::camera::Lens::Perspective,
        bansho_base::camera::Lens::Fisheye,
        bansho_base::camera::Lens::Panorama,
    ];
    let mut drawn = 0;
    for (exposure, speed) in [(0.1, 40.0), (1e-5, 40.0), (0.0, 0.0), (1.0 / 60.0, 0.0)] {
        for lens in lenses {
            for method in METHODS {
                let wind = wind([speed, 0.0, -0.5 * speed], 0.5);
                let parameters =
                    RainParameters { rate_mm_per_h: 300.0.into(), method, distance: 5.0, ..RainParameters::default() };
                let rain = rain(parameters, 2);
                let mut view = view_at(2.0, exposure, [48, 27]);
                view.camera_parameters.lens = lens;
                let view = View::new(view.camera_parameters, view.shutter, 2.1, view.size, 0);
                let strip = draw(&rain, &view, &lit(&wind));
                assert!(strip.radiance.iter().flatten().all(|value| value.is_finite() && *value >= 0.0));
                assert!((0..strip.len()).all(|index| (0.0..=1.0).contains(&strip.transmittance(index)[0])));
                drawn += usize::from(opacity(&strip).iter().sum::<f32>() > 0.0);
            }
        }
    }
    assert_eq!(drawn, 24, "every picture shows rain");
}

#[test]
fn diameters_must_ascend() {
    let parameters = RainParameters { diameters_mm: vec![1.0, 1.0], ..RainParameters::default() };
    assert_eq!(Rain::new(parameters, "rain", 1, None).unwrap_err().key, "diameters_mm");
    let limits = Range::new(0.1, 8.0);
    assert!(limits.min > 0.0, "negative diameters cannot be said");
}

#[test]
fn rain_shows_against_dark_and_vanishes_against_an_even_sky() {
    let wind = wind([0.0; 3], 0.0);
    let sky = Sky::new(SkyKind::Uniform, 100.0, 7000.0);
    let surroundings = Surroundings { sky, ..Surroundings::from_wind(&wind) };
    let mut view = view_at(1.0, 0.02, [96, 54]);
    // Half way up, where hardly any drop shows the ground.
    view.camera_parameters.target = Animated::from([0.0, 5.0, -4.0]);
    let view = View::new(view.camera_parameters, view.shutter, 2.1, view.size, 0);
    for method in METHODS {
        let rain = rain(RainParameters { method, rate_mm_per_h: 50.0.into(), ..RainParameters::default() }, 1);
        let strip = draw(&rain, &view, &surroundings);
        let behind = sky.radiance(bansho_base::math::DVec3::Y)[1];
        for index in 0..strip.len() {
            let against_sky = strip.transmittance(index)[1].mul_add(behind, strip.radiance[1][index]);
            // Drops low in the picture show a little of the ground.
            assert!((against_sky / behind - 1.0).abs() < 0.06, "{against_sky}");
        }
        assert!(strip.radiance[1].iter().sum::<f32>() > 0.005 * behind * strip.len() as f32);
    }
    assert_ne!(sky, Sky::DARK);
}
