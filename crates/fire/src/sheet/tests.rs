//! The whole sheet: random valid parameters, equality of strips, crops and SIMD widths, loops, light.

use bansho_base::{
    camera::{CameraParameters, Lens},
    host::{
        assets::{Encoding, Picture},
        observer::Unobserved,
    },
    image::{Image, Rect},
    math::{
        self,
        curve::{Curve, Interpolation},
        random::{Key, Purpose, uniform},
        simd::{LANES, Lanes, ramp},
    },
    parameters::{Auto, Parameters, Reader, animated::Animated, sample},
    phenomenon::{
        Run,
        strip::{DepthInterval, Shutter, Strip, View},
        surroundings::{Emitter, Surroundings},
    },
    world::wind::{Wind, WindParameters},
};
use fearless_simd::{Level, Simd, dispatch, prelude::*};

use super::{render::aovs::AOVS, *};
use crate::sheet::{
    animate::warp::{WarpState, WindLean},
    render::{
        draw::{DrawContext, MAX_MINIFICATION, draw_rows},
        shade::{SheetContent, SheetState},
    },
};

pub(crate) const SIZE: [usize; 2] = [96, 80];

pub(crate) fn sheet(parameters: FlameSheetParameters, loop_s: Option<f64>) -> FlameSheet {
    FlameSheet::new(parameters, "test", 5, loop_s).unwrap()
}

pub(crate) fn view(lens: Lens, t: f64) -> View {
    let camera = CameraParameters { lens, position: Animated::from([0.3, 0.9, 3.0]), ..CameraParameters::default() };
    View::new(camera, Shutter { open: t, close: t + 0.02 }, t + 0.04, SIZE, 0)
}

pub(crate) fn with_wind<T>(velocity: [f64; 3], use_it: impl FnOnce(&Surroundings) -> T) -> T {
    let parameters = WindParameters { velocity: Animated::from(velocity), ..WindParameters::default() };
    let wind = Wind::new(parameters, 3, None);
    use_it(&Surroundings::from_wind(&wind))
}

/// All planes of a picture drawn in strips of `height` rows, with AOVs.
pub(crate) fn draw(sheet: &FlameSheet, view: &View, height: usize, plate: Option<f32>) -> Vec<Vec<f32>> {
    with_wind([0.8, 0.0, 0.3], |surroundings| {
        let prepared = sheet.prepare(view, surroundings, &Unobserved).unwrap();
        let plate_row = vec![plate.unwrap_or(0.0); SIZE[0]];
        let row = |_: usize| plate_row.as_slice();
        let mut planes: Vec<Vec<f32>> = vec![Vec::new(); 8 + AOVS.len()];
        for y in (0..SIZE[1]).step_by(height) {
            let mut strip = Strip::default();
            let rect = Rect { x: 0, y, width: SIZE[0], height: height.min(SIZE[1] - y) };
            strip.reset(rect, plate.is_some().then_some(&row as _), AOVS.len());
            prepared.draw(&DepthInterval::ALL, &mut strip);
            for index in 0..strip.len() {
                for c in 0..3 {
                    planes[c].push(strip.radiance[c][index]);
                    planes[3 + c].push(strip.transmittance(index)[c]);
                }
                planes[6].push(strip.depth[index]);
                for (k, aov) in AOVS.iter().enumerate() {
                    planes[8 + k].push(strip.aovs[k].resolve(index, aov.rule));
                }
            }
        }
        planes
    })
}

fn rich() -> FlameSheetParameters {
    FlameSheetParameters {
        sparks: SparkParameters { rate: 60.0, ..SparkParameters::default() },
        smoke: SmokeParameters { optical_depth: 1.0, ..SmokeParameters::default() },
        instances: vec![
            InstanceParameters::default(),
            InstanceParameters {
                position: [0.4, 0.0, -0.6],
                scale: 0.7,
                phase_s: 1.0,
                ..InstanceParameters::default()
            },
        ],
        time_samples: Auto::Set(2),
        ..FlameSheetParameters::default()
    }
}

/// Random parameters that are valid together.
fn random_parameters(number: u64) -> FlameSheetParameters {
    let key = Key::new(number, "random sheets");
    let mut count = 0;
    let mut next = || {
        count += 1;
        f64::from(uniform(key.words(count, 0, Purpose::named("draw"))[0]))
    };
    let table = sample(FlameSheetParameters::table(), &mut next);
    let mut reader = Reader::new();
    let parameters = FlameSheetParameters::read_table(&table, &mut reader, &[]);
    assert!(reader.is_clean(), "{:?}", reader.into_problems());
    parameters
}

/// T0, T1, threshold and coverage over the whole sheet.
fn field<S: Simd>(simd: S, sheet: &FlameSheet, t: f64) -> Vec<[f32; 4]> {
    let flame = &sheet.flames[0];
    let lean = WindLean { across: 0.4, toward: 0.0 };
    let warp = WarpState::new(&sheet.parameters, sheet.shape(), &flame.waves, &sheet.clock, t, lean);
    let eddies = flame.eddies.as_ref().map(|eddies| eddies.after(warp.scroll));
    let state = SheetState { texture: flame.texture_source.texture(warp.scroll), eddies, warp, pixel: [0.05, 0.05] };
    let mut values = Vec::new();
    for row in 0..24 {
        let (x, y) = (ramp(simd, 0.01, 0.065), Lanes::splat(simd, row as f32 / 23.0));
        let (mut x, mut y) = state.warp.unwarp(x, y);
        if let Some(eddies) = &state.eddies {
            [x, y] = eddies.displace(x, y);
        }
        let coordinates = sheet.shape().coordinates(x, y, &state.warp.edges, state.pixel);
        let coverage = coordinates.coverage(state.pixel);
        let texture = sheet.shape().apply_contrast(state.texture.sample(coordinates.u, coordinates.w));
        let cut = equations::above_threshold(texture, coordinates.threshold);
        for lane in 0..LANES {
            values.push([texture[lane], cut[lane], coordinates.threshold[lane], coverage[lane]]);
        }
    }
    values
}

#[test]
fn every_valid_parameter_set_stays_within_0_and_1_before_color() {
    let mut content = 0;
    for number in 0..1500 {
        let Ok(sheet) = FlameSheet::new(random_parameters(number), "random", number, None) else { continue };
        let level = bansho_base::math::simd::level();
        for value in dispatch!(level, simd => field(simd, &sheet, number as f64 * 0.37)).iter().flatten() {
            assert!((0.0..=1.0).contains(value), "set {number}: {value}");
            content += 1;
        }
    }
    assert!(content > 100_000, "{content}");
}

#[test]
fn random_sheets_draw_without_nan_or_infinity_through_every_lens() {
    for number in 0..60 {
        let mut parameters = random_parameters(number);
        parameters.instances.truncate(2);
        parameters.sparks.rate = parameters.sparks.rate.min(100.0);
        parameters.sparks.lifetime_s = parameters.sparks.lifetime_s.min(2.0);
        let Ok(sheet) = FlameSheet::new(parameters, "random", number, Some(2.0)) else { continue };
        let lens = [Lens::Perspective, Lens::Fisheye, Lens::Panorama][number as usize % 3];
        let planes = draw(&sheet, &view(lens, 0.7), 33, None);
        for (k, plane) in planes.iter().enumerate().filter(|(k, _)| *k != 6) {
            assert!(plane.iter().all(|value| value.is_finite()), "set {number}, plane {k}");
        }
    }
}

#[test]
fn strips_of_any_height_give_the_same_bytes() {
    let sheet = sheet(rich(), None);
    let view = view(Lens::Perspective, 2.0);
    let whole = draw(&sheet, &view, SIZE[1], None);
    assert!(whole[0].iter().sum::<f32>() > 0.0 && whole[3].iter().any(|value| *value < 0.9));
    assert_eq!(whole, draw(&sheet, &view, 7, None));
}

#[test]
fn crops_give_the_same_bytes() {
    let sheet = sheet(rich(), None);
    let view = view(Lens::Perspective, 2.0);
    let whole = draw(&sheet, &view, SIZE[1], None);
    let rect = Rect { x: 29, y: 13, width: 41, height: 50 };
    with_wind([0.8, 0.0, 0.3], |surroundings| {
        let mut strip = Strip::default();
        strip.reset(rect, None, 0);
        sheet.prepare(&view, surroundings, &Unobserved).unwrap().draw(&DepthInterval::ALL, &mut strip);
        for y in 0..rect.height {
            for x in 0..rect.width {
                let (part, all) = (y * rect.width + x, (y + rect.y) * SIZE[0] + x + rect.x);
                assert_eq!(strip.radiance[1][part], whole[1][all], "{x} {y}");
            }
        }
    });
}

#[test]
fn wide_vectors_give_the_bits_of_narrow_ones() {
    let sheet = sheet(FlameSheetParameters::default(), None);
    let (wide, narrow) = (bansho_base::math::simd::level(), Level::baseline());
    let (a, b) =
        (dispatch!(wide, simd => field(simd, &sheet, 3.3)), dispatch!(narrow, simd => field(simd, &sheet, 3.3)));
    assert!(a.len() > 100);
    assert_eq!(a, b);
}

/// Red light of a sheet in still air.
fn red_in_still_air(sheet: &FlameSheet, t: f64) -> Vec<f32> {
    let wind = Wind::new(WindParameters::default(), 1, None);
    let calm = Surroundings::from_wind(&wind);
    let view = view(Lens::Perspective, t);
    let mut strip = Strip::default();
    strip.reset(Rect::from_size(SIZE[0], SIZE[1]), None, 0);
    sheet.prepare(&view, &calm, &Unobserved).unwrap().draw(&DepthInterval::ALL, &mut strip);
    strip.radiance[0].clone()
}

#[test]
fn a_seamless_loop_ends_where_it_began() {
    let sheet = sheet(rich(), Some(3.0));
    let [first, next] = [0.4, 3.4].map(|t| red_in_still_air(&sheet, t));
    let most = first.iter().copied().fold(0.0, f32::max);
    assert!(most > 0.0);
    first.iter().zip(&next).for_each(|(a, b)| assert!((a - b).abs() < 0.01 * most, "{a} {b}"));
}

#[test]
fn a_plate_before_the_flame_hides_it_and_one_behind_does_not() {
    let sheet = sheet(FlameSheetParameters::default(), None);
    let view = view(Lens::Perspective, 2.0);
    let free = draw(&sheet, &view, 20, None);
    assert_eq!(free[0], draw(&sheet, &view, 20, Some(50.0))[0]);
    assert!(draw(&sheet, &view, 20, Some(1.0))[0].iter().all(|value| *value == 0.0));
}

#[test]
fn published_light_flickers_about_the_light_that_is_drawn() {
    let sheet = sheet(FlameSheetParameters::default(), None);
    let red: Vec<f32> = (0..40)
        .map(|i| {
            let t = 0.11 * f64::from(i);
            let lights = sheet.publish(Shutter { open: t, close: t }).lights;
            assert_eq!(lights.len(), 2);
            assert!(lights.iter().all(|light| matches!(light.emitter, Emitter::Point { .. })));
            lights.iter().map(|light| light.intensity[0]).sum()
        })
        .collect();
    let mean = red.iter().sum::<f32>() / 40.0;
    // A fire about a meter tall: hundreds to thousands of candela, and it flickers.
    assert!((100.0..10_000.0).contains(&mean), "{mean}");
    assert!(red.iter().any(|value| (value / mean - 1.0).abs() > 0.05));
}

#[test]
fn the_wind_bends_the_flame_the_way_it_blows() {
    let sheet = sheet(FlameSheetParameters::default(), None);
    let centroid = |velocity| {
        with_wind(velocity, |surroundings| {
            let mut strip = Strip::default();
            strip.reset(Rect::from_size(SIZE[0], SIZE[1]), None, 0);
            let view = view(Lens::Perspective, 2.0);
            sheet.prepare(&view, surroundings, &Unobserved).unwrap().draw(&DepthInterval::ALL, &mut strip);
            let weight: f32 = strip.radiance[0].iter().sum();
            strip.radiance[0].iter().enumerate().map(|(i, v)| (i % SIZE[0]) as f32 * v).sum::<f32>() / weight
        })
    };
    let (left, still, right) = (centroid([-1.5, 0.0, 0.0]), centroid([0.0; 3]), centroid([1.5, 0.0, 0.0]));
    assert!(left + 0.5 < still && still + 0.5 < right, "{left} {still} {right}");
}

#[test]
fn gas_moves_up_in_the_motion_aov_and_is_hot() {
    let sheet = sheet(FlameSheetParameters::default(), None);
    let planes = draw(&sheet, &view(Lens::Perspective, 2.0), 40, None);
    let bright = (0..planes[0].len()).max_by(|a, b| planes[0][*a].total_cmp(&planes[0][*b])).unwrap();
    assert!((1100.0..=1950.0).contains(&planes[8][bright]), "{}", planes[8][bright]);
    assert!(planes[9][bright] > 0.0 && planes[11][bright] < -0.1, "{} {}", planes[9][bright], planes[11][bright]);
    let dark = (0..planes[0].len()).find(|i| planes[0][*i] == 0.0).unwrap();
    assert_eq!((planes[8][dark], planes[11][dark]), (0.0, 0.0));
}

#[test]
fn a_picture_of_the_texture_gives_the_flame_of_the_texture() {
    use std::f64::consts::PI;
    const PICTURE: [usize; 2] = [1024, 2048];
    let period = [PI / 4.0, 2.0 * PI / 13.0];
    // Rows count from the top.
    let p: Vec<f64> = (0..PICTURE[0]).map(|x| (x as f64 + 0.5) / PICTURE[0] as f64 * period[0]).collect();
    let q: Vec<f64> = (0..PICTURE[1]).map(|y| (1.0 - (y as f64 + 0.5) / PICTURE[1] as f64) * period[1]).collect();
    let texture = PaperTexture::new(&p, &q, 5);
    let mut pixels = Vec::new();
    let mut row = vec![0.0; PICTURE[0]];
    for y in 0..PICTURE[1] {
        texture.fill_row(y, &mut row);
        pixels.extend(row.iter().map(|level| [*level, *level, *level, 1.0]));
    }
    let picture = Picture::opaque(Image::from_pixels(PICTURE[0], PICTURE[1], pixels).unwrap(), Encoding::LinearAcescg);
    let mut parameters = FlameSheetParameters { time_samples: Auto::Set(1), ..FlameSheetParameters::default() };
    parameters.texture.kind = TextureKind::OhshimaItahashi;
    let of_formula = sheet(parameters.clone(), Some(2.0));
    parameters.texture.kind = TextureKind::Picture;
    parameters.texture.picture_size = period;
    let of_picture = FlameSheet::with_picture(parameters.clone(), "test", 5, Some(2.0), Some(&picture)).unwrap();
    for t in [0.3, 1.2] {
        let [formula, drawn] =
            [&of_formula, &of_picture].map(|sheet| draw(sheet, &view(Lens::Perspective, t), 80, None));
        let brightest = formula[1].iter().copied().fold(0.0, f32::max);
        let difference = formula[1].iter().zip(&drawn[1]).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(brightest > 100.0, "{brightest}");
        let percent = 100.0 * f64::from(difference / brightest);
        bansho_base::assert_measured!("section 3.1: a table as texture: difference, %", percent, 0.0, 1.0);
    }
    // The loop closes, and without a picture there is no flame.
    let [start, end] = [0.4, 2.4].map(|t| red_in_still_air(&of_picture, t));
    let brightest = start.iter().copied().fold(0.0, f32::max);
    let difference = start.iter().zip(&end).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(brightest > 100.0 && difference < 0.01 * brightest, "{difference} of {brightest}");
    let fault = FlameSheet::new(parameters, "test", 5, None).unwrap_err();
    assert_eq!(fault.to_string(), "texture.file: must name a file where `texture.kind` is \"picture\"");
}

#[test]
fn curves_that_do_not_go_together_name_the_parameter() {
    let curve = |points: &[[f64; 2]]| Curve::new(points.to_vec(), Interpolation::Linear).unwrap();
    let mut parameters = FlameSheetParameters::default();
    parameters.shape.core_width = curve(&[[0.0, 0.8], [1.0, 0.8]]);
    let fault = FlameSheet::new(parameters, "test", 1, None).unwrap_err();
    assert_eq!(fault.key, "shape.fringe_width");
    assert!(fault.to_string().contains("1.2"), "{fault}");
    let mut parameters = FlameSheetParameters::default();
    parameters.texture.sharpen = curve(&[[0.0, 0.5], [1.0, 1.0]]);
    let fault = FlameSheet::new(parameters, "test", 1, None).unwrap_err();
    assert_eq!(
        (fault.key, fault.to_string().as_str()),
        ("texture.sharpen", "texture.sharpen: must be 0 at x = 0, but is 0.5")
    );
    assert!(FlameSheet::new(FlameSheetParameters::default(), "test", 1, Some(0.0)).is_err());
}

/// Red light of a sheet at 320 x 480, with exact rows `rows` apart.
fn red_in_bands(sheet: &FlameSheet, view: &View, rows: usize) -> Vec<f32> {
    with_wind([0.5, 0.0, 0.0], |surroundings| {
        let flame = &sheet.flames[0];
        let (samples, _) = sheet.samples(
            flame,
            &flame.texture_source.filtered(1e4, &sheet.filter_cache),
            view,
            surroundings.wind,
            1,
            None,
        );
        let (shape, ramp) = (sheet.shape(), sheet.ramp());
        let context = DrawContext {
            shape,
            ramp,
            samples: &samples,
            content: SheetContent::Flame,
            absorbs: true,
            row_band: rows,
            max_minification: f32::INFINITY,
        };
        let rect = Rect::from_size(320, 480);
        let mut strip = Strip::default();
        strip.reset(rect, None, 0);
        dispatch!(bansho_base::math::simd::level(), simd => draw_rows(simd, &context, rect, &mut strip));
        strip.radiance[0].clone()
    })
}

/// A sheet that closes at its base, without eddies and with one texture.
fn straight(mut parameters: FlameSheetParameters) -> FlameSheetParameters {
    let curve = |points: &[[f64; 2]]| Curve::new(points.to_vec(), Interpolation::Monotone).unwrap();
    (parameters.width, parameters.height) = (1.1, 1.7);
    let shape = &mut parameters.shape;
    shape.core_width = curve(&[[0.0, 0.26], [0.1, 0.44], [0.22, 0.54], [0.5, 0.38], [1.0, 0.12]]);
    shape.fringe_width = curve(&[[0.0, 0.0], [0.3, 0.22], [0.6, 0.42], [1.0, 0.4]]);
    (shape.flutter, shape.convergence, shape.eddies) = (0.6, 1.0, 0.0);
    let texture = &mut parameters.texture;
    texture.threshold = curve(&[[0.0, 0.0], [0.25, 0.08], [0.6, 0.42], [0.85, 0.75], [1.0, 1.0]]);
    texture.sharpen = curve(&[[0.0, 0.0], [0.06, 0.22], [0.16, 0.48], [0.4, 0.82], [0.7, 1.0], [1.0, 0.86]]);
    (texture.overlap, texture.thinning) = (false, 0.0);
    parameters.color.glow = curve(&[[0.0, 0.0], [0.1, 0.12], [0.3, 1.0], [1.0, 1.0]]);
    parameters
}

#[test]
fn rows_between_exact_rows_are_as_good_as_exact_ones() {
    // Sheets 600 and 1,080 pixels tall have exact rows every 4 and 16 rows, and with eddies every 4; computing every row exactly changes next to nothing.
    let rolled = FlameSheetParameters { time_samples: Auto::Set(1), ..FlameSheetParameters::default() };
    let [rolled, straight] = [rolled.clone(), straight(rolled)].map(|parameters| sheet(parameters, None));
    let kinds = [
        (&straight, 20.0, 4, 0.002),
        (&straight, 11.2, 16, 0.004),
        (&rolled, 20.0, 4, 0.006),
        (&rolled, 11.2, 4, 0.003),
    ];
    for (sheet, vertical_fov_deg, rows, most_apart) in kinds {
        let camera =
            CameraParameters { vertical_fov_deg: Animated::from(vertical_fov_deg), ..CameraParameters::default() };
        let view = View::new(camera, Shutter { open: 2.0, close: 2.0 }, 2.04, [320, 480], 0);
        let (exact, banded) = (red_in_bands(sheet, &view, 1), red_in_bands(sheet, &view, rows));
        let most = exact.iter().copied().fold(0.0, f32::max);
        let apart: Vec<f32> = exact.iter().zip(&banded).map(|(a, b)| (a - b).abs()).collect();
        let mean = apart.iter().sum::<f32>() / exact.iter().sum::<f32>();
        let worst = apart.into_iter().fold(0.0, f32::max) / most;
        assert!(most > 0.0 && mean < most_apart && worst < 0.08, "{rows} rows: {mean} {worst}");
    }
}

/// Red light of the front of the campfire, `finer` times as large as in its scene, with supersampling above `minification`.
fn red_of_campfire(finer: usize, minification: f32) -> Vec<f32> {
    let parameters = FlameSheetParameters {
        width: 0.62,
        height: 0.6,
        speed: Animated::from(1.8),
        variation: 3,
        time_samples: Auto::Set(1),
        ..FlameSheetParameters::default()
    };
    let sheet = sheet(parameters, None);
    let size = [320, 304].map(|side| side * finer);
    let camera = CameraParameters {
        position: Animated::from([0.0, 0.3, 3.4]),
        target: Animated::from([0.0, 0.3, 0.0]),
        vertical_fov_deg: Animated::from(11.6),
        ..CameraParameters::default()
    };
    let view = View::new(camera, Shutter { open: 4.0, close: 4.0 }, 4.04, size, 0);
    with_wind([0.25, 0.0, 0.0], |surroundings| {
        let flame = &sheet.flames[0];
        let (samples, _) = sheet.samples(
            flame,
            &flame.texture_source.filtered(270.0, &sheet.filter_cache),
            &view,
            surroundings.wind,
            1,
            None,
        );
        let (shape, ramp) = (sheet.shape(), sheet.ramp());
        let context = DrawContext {
            shape,
            ramp,
            samples: &samples,
            content: SheetContent::Flame,
            absorbs: true,
            row_band: 2,
            max_minification: minification,
        };
        let rect = Rect::from_size(size[0], size[1]);
        let mut strip = Strip::default();
        strip.reset(rect, None, 0);
        dispatch!(bansho_base::math::simd::level(), simd => draw_rows(simd, &context, rect, &mut strip));
        strip.radiance[0].clone()
    })
}

#[test]
fn a_squeezed_texture_looks_as_if_supersampled() {
    let fine = red_of_campfire(4, f32::INFINITY);
    let mean_of_16 = |index: usize| -> f32 {
        let (x, y) = (index % 320 * 4, index / 320 * 4);
        (0..16).map(|k| fine[(y + k / 4) * 1280 + x + k % 4]).sum::<f32>() / 16.0
    };
    let wanted: Vec<f32> = (0..320 * 304).map(mean_of_16).collect();
    let (plain, filtered) = (red_of_campfire(1, f32::INFINITY), red_of_campfire(1, MAX_MINIFICATION));
    let minification: Vec<usize> = (0..plain.len()).filter(|&index| plain[index] != filtered[index]).collect();
    let wrong = |content: &[f32]| minification.iter().map(|&index| (content[index] - wanted[index]).abs()).sum::<f32>();
    let (before, after) = (wrong(&plain), wrong(&filtered));
    assert!(minification.len() > 100 && after < 0.7 * before, "{} pixels: {before} {after}", minification.len());
}

#[test]
fn the_height_follows_the_gas_flow_to_the_power_of_two_fifths() {
    let of_flow = |flow: f64| sheet(FlameSheetParameters { flow: flow.into(), ..Default::default() }, None);
    let still = Wind::new(WindParameters::default(), 1, None);
    let warp = |sheet: &FlameSheet| sheet.evaluate_at(&sheet.flames[0], math::DVec3::X, &still, 1.0).1;
    let full = of_flow(1.0);
    for flow in [0.5, 0.2, 0.05] {
        let weak = of_flow(flow);
        let fraction = weak.height_fraction(1.0);
        assert!((fraction - math::pow(flow, 0.4)).abs() < 1e-12);
        // What a full flame shows at a height, a weak one shows that much lower.
        let [high, low] = [(&full, 1.0), (&weak, fraction)]
            .map(|(sheet, factor)| warp(sheet).unwarp_at([0.5, 0.4 * factor as f32])[1]);
        assert!((high - low).abs() < 1e-5, "{high} {low}");
    }
    assert!(of_flow(0.0).is_out(1.0) && !full.is_out(1.0));
}
