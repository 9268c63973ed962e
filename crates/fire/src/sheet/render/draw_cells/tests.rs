//! Light of small sheets: that of a large picture, through every lens, wherever they lie between pixels.

use bansho_base::{
    camera::{CameraParameters, Lens},
    color,
    host::observer::Unobserved,
    image::Rect,
    math::{self, DVec2},
    parameters::{Auto, animated::Animated},
    phenomenon::{
        Run,
        strip::{DepthInterval, Shutter, Strip, View},
        surroundings::Surroundings,
    },
    world::wind::{Wind, WindParameters},
};

use crate::sheet::{
    ColorParameters, FlameSheet, FlameSheetParameters, InstanceParameters, SheetMethod, SheetShapeParameters,
    SmokeParameters, TextureKind, TextureParameters,
    render::aovs::{AOVS, MOTION, OPTICAL_DEPTH, TEMPERATURE},
};

/// Distance of the camera, m, which looks straight at the flame of 0.75 m.
const DISTANCE: f64 = 20.0;
const HEIGHT: f64 = 0.75;

fn flame() -> FlameSheetParameters {
    FlameSheetParameters { width: 0.4, height: HEIGHT, ..FlameSheetParameters::default() }
}

fn sheet(parameters: FlameSheetParameters) -> FlameSheet {
    FlameSheet::new(parameters, "small", 5, None).unwrap()
}

/// A view in which the flame is `height` pixels high, with its middle `offset` pixels from that of the picture.
fn view(height: f64, offset: [f64; 2], t: f64) -> View {
    let side = (2.0 * height).ceil() + 8.0;
    let fov = 2.0 * math::atan(0.5 * side * HEIGHT / height / DISTANCE);
    let camera = CameraParameters {
        position: Animated::from([0.0, 0.5 * HEIGHT, DISTANCE]),
        target: Animated::from([0.0, 0.5 * HEIGHT, 0.0]),
        vertical_fov_deg: Animated::from(fov.to_degrees()),
        shift: offset.map(|pixels| pixels / side),
        ..CameraParameters::default()
    };
    View::new(camera, Shutter { open: t, close: t }, t + 0.04, [side as usize; 2], 0)
}

fn draw_rect(sheet: &FlameSheet, view: &View, rect: Rect, plate: Option<f32>) -> Strip {
    let wind = Wind::new(WindParameters::default(), 3, None);
    let surroundings = Surroundings::from_wind(&wind);
    let prepared = sheet.prepare(view, &surroundings, &Unobserved).unwrap();
    let mut strip = Strip::default();
    let row = vec![plate.unwrap_or_default(); view.size[0]];
    strip.reset(rect, plate.is_some().then_some(&|_| row.as_slice()), AOVS.len());
    prepared.draw(&DepthInterval::ALL, &mut strip);
    strip
}

fn draw(sheet: &FlameSheet, view: &View) -> Strip {
    draw_rect(sheet, view, Rect::from_size(view.size[0], view.size[1]), None)
}

/// Sums over the picture, times the solid angle of each pixel: of luminance, and of opacity.
fn light_and_opacity(sheet: &FlameSheet, view: &View) -> [f64; 2] {
    let strip = draw(sheet, view);
    let mut sums = [0.0; 2];
    for index in 0..strip.len() {
        let pixel = DVec2::new((index % view.size[0]) as f64 + 0.5, (index / view.size[0]) as f64 + 0.5);
        let solid_angle = view.camera.pixel_solid_angle(pixel);
        let luminance = color::luminance([0, 1, 2].map(|c| strip.radiance[c][index]));
        sums[0] += f64::from(luminance) * solid_angle;
        sums[1] += f64::from(1.0 - strip.transmittance(index)[0]) * solid_angle;
    }
    sums
}

/// Flames of several kinds, with names for messages.
fn kinds() -> Vec<(&'static str, FlameSheetParameters)> {
    let texture = |kind| TextureParameters { kind, ..TextureParameters::default() };
    vec![
        ("default", flame()),
        ("another", FlameSheetParameters { variation: 7, ..flame() }),
        ("soot field", FlameSheetParameters { method: SheetMethod::SootField, ..flame() }),
        (
            "opaque",
            FlameSheetParameters {
                color: ColorParameters { soot_optical_depth: 3.0, ..ColorParameters::default() },
                ..flame()
            },
        ),
        ("paper", FlameSheetParameters { texture: texture(TextureKind::OhshimaItahashi), ..flame() }),
        (
            "fine tongues",
            FlameSheetParameters {
                texture: TextureParameters { tongue_width: 0.5, tongue_length: 0.5, ..TextureParameters::default() },
                ..flame()
            },
        ),
        ("wide", FlameSheetParameters { width: 2.0, ..flame() }),
        ("narrow", FlameSheetParameters { width: 0.06, ..flame() }),
        ("low", FlameSheetParameters { flow: Animated::from(0.1), ..flame() }),
        (
            "smoke alone",
            FlameSheetParameters {
                color: ColorParameters { luminance: Animated::from(1.0), ..ColorParameters::default() },
                smoke: SmokeParameters { optical_depth: 2.0, height: 0.8, width: 1.0, ..SmokeParameters::default() },
                ..flame()
            },
        ),
    ]
}

#[test]
fn a_flame_of_any_size_has_the_light_of_a_large_one_wherever_it_lies_between_pixels() {
    for (name, parameters) in kinds() {
        let sheet = sheet(parameters);
        let large = light_and_opacity(&sheet, &view(1000.0, [0.0; 2], 1.3));
        for height in [1.0, 2.0, 3.0, 5.7, 11.0, 23.0, 64.0, 120.0, 200.0, 400.0] {
            let positions = if height < 100.0 { 8 } else { 2 };
            for position in 0..positions {
                let offset = [(position * 3 % 8) as f64 / 8.0, position as f64 / 8.0];
                let small = light_and_opacity(&sheet, &view(height, offset, 1.3));
                for (what, small, large) in [("light", small[0], large[0]), ("opacity", small[1], large[1])] {
                    let ratio = if large > 0.0 { small / large } else { 1.0 };
                    assert!((0.95..=1.05).contains(&ratio), "{what} of {name}, {height} pixels, {offset:?}: {ratio}");
                }
            }
        }
    }
}

#[test]
fn a_small_flame_that_moves_by_fractions_of_a_pixel_does_not_flicker() {
    for (name, parameters) in kinds() {
        let sheet = sheet(parameters);
        for height in [1.5, 4.0, 9.0, 30.0] {
            let lights = (0..16).map(|step| {
                let offset = [f64::from(step) / 16.0, f64::from(step * 5 % 16) / 16.0];
                light_and_opacity(&sheet, &view(height, offset, 2.1))[0]
            });
            let (low, high) = lights.fold((f64::INFINITY, 0.0), |(low, high), light| (low.min(light), light.max(high)));
            assert!(high / low < 1.002, "{name}, {height} pixels: from {low} to {high}");
        }
    }
}

#[test]
fn light_changes_little_where_cells_begin_and_as_they_change() {
    for (name, parameters) in kinds() {
        let sheet = sheet(parameters);
        let mut before: Option<f64> = None;
        let mut height = 40.0;
        while height < 420.0 {
            let light = light_and_opacity(&sheet, &view(height, [0.3, 0.6], 0.7))[0];
            if let Some(before) = before {
                assert!((light / before - 1.0).abs() < 0.015, "{name} at {height} pixels: {before} to {light}");
            }
            before = Some(light);
            height *= 1.04;
        }
    }
}

#[test]
fn a_small_flame_has_the_same_light_through_every_lens_in_every_direction() {
    let sheet = sheet(flame());
    let expected = light_and_opacity(&sheet, &view(1000.0, [0.0; 2], 1.3))[0];
    // The line of sight is level, so that the flame faces the camera; what is turned is the picture.
    for (lens, size) in [(Lens::Perspective, [240, 160]), (Lens::Fisheye, [200, 200]), (Lens::Panorama, [256, 128])] {
        for [yaw, pitch] in [[0.0, 0.0], [0.5, 0.1], [0.3, -0.45], [0.0, 0.5]] {
            let (sin, cos) = math::sin_cos(yaw);
            let target = [sin * 10.0, 0.5 * HEIGHT + 10.0 * math::sin(pitch) / math::cos(pitch), DISTANCE - cos * 10.0];
            let camera = CameraParameters {
                lens,
                position: Animated::from([0.0, 0.5 * HEIGHT, DISTANCE]),
                target: Animated::from(target),
                roll_deg: Animated::from(30.0),
                vertical_fov_deg: Animated::from(70.0),
                ..CameraParameters::default()
            };
            let view = View::new(camera, Shutter { open: 1.3, close: 1.3 }, 1.34, size, 0);
            let ratio = light_and_opacity(&sheet, &view)[0] / expected;
            assert!((0.95..1.05).contains(&ratio), "{lens:?}, {yaw} {pitch}: {ratio}");
        }
    }
}

#[test]
fn a_flame_at_the_seam_of_a_panorama_is_that_of_its_middle_rolled() {
    let sheet =
        sheet(FlameSheetParameters { smoke: SmokeParameters { optical_depth: 1.0, ..Default::default() }, ..flame() });
    let (width, height) = (256, 128);
    let draw_toward = |z: f64| {
        let camera = CameraParameters {
            lens: Lens::Panorama,
            position: Animated::from([0.0, 0.4, 3.0]),
            target: Animated::from([0.0, 0.4, 3.0 + z]),
            ..CameraParameters::default()
        };
        draw(&sheet, &View::new(camera, Shutter { open: 1.3, close: 1.3 }, 1.34, [width, height], 0))
    };
    let (middle, seam) = (draw_toward(-1.0), draw_toward(1.0));
    let most = middle.radiance[1].iter().copied().fold(0.0, f32::max);
    assert!(most > 0.0);
    for index in 0..width * height {
        let rolled = index / width * width + (index % width + width / 2) % width;
        let (here, there) = (middle.radiance[1][index], seam.radiance[1][rolled]);
        assert!((here - there).abs() < 1e-4 * most, "pixel {index}: {here} and {there}, most {most}");
        assert!((middle.transmittance(index)[0] - seam.transmittance(rolled)[0]).abs() < 1e-4, "{index}");
    }
}

#[test]
fn strips_and_crops_have_the_bits_of_the_whole_picture_and_a_plate_hides_all() {
    let parameters = FlameSheetParameters {
        instances: vec![
            InstanceParameters::default(),
            InstanceParameters { position: [0.3, 0.1, -8.0], scale: 2.0, ..InstanceParameters::default() },
        ],
        smoke: SmokeParameters { optical_depth: 1.0, ..SmokeParameters::default() },
        time_samples: Auto::Set(3),
        ..flame()
    };
    let sheet = sheet(parameters);
    let view = view(31.0, [0.2, 0.4], 0.9);
    let whole = draw(&sheet, &view);
    let [width, height] = view.size;
    for rect in [[0, 0, width, 7], [0, 7, width, height - 7], [31, 17, 9, 23], [33, 30, 1, 1]] {
        let [x, y, width_of_part, height_of_part] = rect;
        let rect = Rect { x, y, width: width_of_part, height: height_of_part };
        let part = draw_rect(&sheet, &view, rect, None);
        for index in 0..part.len() {
            let there = (y + index / rect.width) * width + x + index % rect.width;
            assert_eq!(part.radiance[0][index].to_bits(), whole.radiance[0][there].to_bits(), "{rect:?} {index}");
            assert_eq!(part.transmittance(index), whole.transmittance(there));
            assert_eq!(part.depth[index].to_bits(), whole.depth[there].to_bits());
        }
    }
    let all = Rect::from_size(width, height);
    let hidden = draw_rect(&sheet, &view, all, Some(5.0));
    assert!(hidden.radiance[0].iter().all(|light| *light == 0.0));
    assert!((0..hidden.len()).all(|index| hidden.transmittance(index) == [1.0; 3]));
    let before = draw_rect(&sheet, &view, all, Some(50.0));
    assert_eq!(before.radiance, whole.radiance);
}

#[test]
fn aovs_of_a_small_flame_are_means_of_those_of_a_large_one() {
    let parameters = FlameSheetParameters {
        shape: SheetShapeParameters { sway: 0.0, ..SheetShapeParameters::default() },
        color: ColorParameters { soot_optical_depth: 1.0, ..ColorParameters::default() },
        ..flame()
    };
    let sheet = sheet(parameters);
    // Means weighted by luminance of temperature in K and of motion in flame heights, and the sum of optical depth in squares of flame heights.
    let means = |height: f64| {
        let strip = draw(&sheet, &view(height, [0.0; 2], 1.3));
        let [mut light, mut kelvin, mut up, mut depth] = [0.0; 4];
        for index in 0..strip.len() {
            let luminance = f64::from(color::luminance([0, 1, 2].map(|c| strip.radiance[c][index])));
            let value = |plane: usize| f64::from(strip.aovs[plane].resolve(index, AOVS[plane].rule));
            light += luminance;
            kelvin += luminance * value(TEMPERATURE);
            up += luminance * value(MOTION[1]);
            depth += value(OPTICAL_DEPTH);
        }
        [kelvin / light, up / light / height, depth / height / height]
    };
    let large = means(600.0);
    assert!(large[0] > 1000.0 && large[1] < -1e-3 && large[2] > 0.0, "{large:?}");
    for height in [3.0, 12.0, 50.0] {
        for (small, large) in means(height).into_iter().zip(large) {
            assert!((small / large - 1.0).abs() < 0.05, "{height}: {small}, not {large}");
        }
    }
}
