//! Plates in pictures: what Bansho wrote comes back, alpha stays the picture's, depth of another size hides what it covers.

use std::{path::Path, sync::Arc};

use bansho::{
    BitDepth, Plan, PlanOptions,
    media::{
        assets::decode_picture,
        exr,
        limits::MemoryLimit,
        png::{self, PngEffort},
    },
};
use bansho_base::{
    color::{AlphaConvention, View},
    frame::{DisplayPixels, Frame},
    host::assets::{Encoding, MemoryAssets, Picture, PictureAlpha, PictureLayers},
    image::Image,
};
use bansho_render::{display::display, remarks};

use crate::support::{self, draw, plan_with};

const EMPTY: &str = "bansho = 2\n[picture]\nsize = [24, 16]\nframes = 1\n";

fn standard() -> PlanOptions {
    PlanOptions { display: Some(View::STANDARD), ..PlanOptions::default() }
}

/// An empty scene over the plate `picture`.
fn over(picture: Picture, plate: &str) -> Frame {
    let mut assets = MemoryAssets::default();
    assets.insert_picture("plate", picture);
    let text = format!("{EMPTY}[plate]\nimage = \"plate\"\n{plate}");
    draw(&mut plan_with(&text, &standard(), Arc::new(assets)).open(), 0)
}

fn read(bytes: &[u8], extension: &str) -> Picture {
    decode_picture(bytes, extension, &PictureLayers::default(), MemoryLimit::default()).unwrap()
}

/// Premultiplied light of every alpha, some of it without covering anything, as of a flame.
fn light() -> Frame {
    let mut frame = over(Picture::opaque(Image::filled(24, 16, [0.0; 4]), Encoding::LinearAcescg), "");
    frame.opaque = false;
    for (index, pixel) in frame.beauty.pixels_mut().iter_mut().enumerate() {
        let (x, y) = (index % 24, index / 24);
        let alpha = x as f32 / 23.0;
        let value = |shift: usize| alpha.max(0.1) * ((y + shift) % 16) as f32 / 16.0;
        *pixel = [value(0), value(5), value(9), alpha];
    }
    frame
}

#[test]
fn an_exr_that_bansho_wrote_comes_back_bit_for_bit() {
    let bytes = |frame: &Frame| read(&exr::encode(frame, Path::new("a.exr")).unwrap(), "exr");
    let first = bytes(&light());
    assert_eq!(first.alpha, PictureAlpha::Associated);
    let again = over(first.clone(), "");
    assert!(!again.opaque);
    let second = bytes(&again);
    let bits = |picture: &Picture| picture.color.iter().flat_map(|pixel| pixel.map(f32::to_bits)).collect::<Vec<_>>();
    assert_eq!(bits(&first), bits(&second));
}

#[test]
fn a_png_that_bansho_wrote_comes_back_to_a_code_in_both_conventions() {
    for convention in [AlphaConvention::Linear, AlphaConvention::Encoded] {
        let codes = |frame: &Frame| display(frame, &View::STANDARD, BitDepth::Eight, convention);
        let first = codes(&light());
        let file = png::encode(&first, &[0; 32], PngEffort::Fast, Path::new("a.png")).unwrap();
        let picture = read(&file, "png");
        assert_eq!(picture.alpha, PictureAlpha::Straight(convention));
        let second = codes(&over(picture, ""));
        let (DisplayPixels::Eight(first), DisplayPixels::Eight(second)) = (first.pixels, second.pixels) else {
            panic!()
        };
        // What is seen over black, and alpha: the straight color of a nearly transparent pixel has no meaning of its own.
        let seen = |[r, g, b, a]: [u8; 4]| {
            let alpha = f64::from(a) / 255.0;
            let over_black = |code: u8| match convention {
                AlphaConvention::Encoded => f64::from(code) * alpha,
                AlphaConvention::Linear => {
                    let light = f64::from(bansho_base::color::decode_srgb8(code)) * alpha;
                    255.0 * f64::from(bansho_base::color::encode_srgb(light as f32))
                }
            };
            [over_black(r), over_black(g), over_black(b), f64::from(a)]
        };
        for (index, (first, second)) in first.iter().zip(&second).enumerate() {
            let off = seen(*first).iter().zip(seen(*second)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off <= 1.5, "{convention:?}: pixel {index}: {first:?} became {second:?}");
        }
    }
}

#[test]
fn straight_alpha_blends_in_the_values_that_the_plate_says() {
    let overlay = |value: f32| Picture {
        alpha: PictureAlpha::Straight(AlphaConvention::Encoded),
        ..Picture::opaque(Image::filled(24, 16, [value, value, value, 0.5]), Encoding::DisplaySrgb)
    };
    // Over black: encoded 0.5 is linear 0.214. A black overlay with alpha 0.5 in encoded values has alpha 0.762 in light.
    for (plate, value, light, coverage) in [
        ("", 1.0, 0.214, 0.0),
        ("", 0.0, 0.0, 0.762),
        ("alpha = \"encoded\"\n", 0.0, 0.0, 0.762),
        ("alpha = \"linear\"\n", 1.0, 0.5, 0.5),
    ] {
        let [r, g, b, alpha] = over(overlay(value), plate).beauty.at(12, 8);
        assert!([r, g, b].iter().all(|value| (value - light).abs() < 1e-3), "{plate}: {r} {g} {b}");
        assert!((alpha - coverage).abs() < 1e-3, "{plate}: {alpha}");
    }
}

#[test]
fn what_was_done_with_a_plate_is_told() {
    let alpha = PictureAlpha::Straight(AlphaConvention::Encoded);
    let half = Picture { alpha, ..Picture::opaque(Image::filled(24, 16, [0.5; 4]), Encoding::DisplaySrgb) };
    let mut assets = MemoryAssets::default();
    assets.insert_picture("plate", half);
    let depth: Vec<f32> = (0..12 * 8).map(|index| (index % 12 + 1) as f32).collect();
    assets.insert_picture(
        "depth",
        Picture { depth: Some(depth), ..Picture::opaque(Image::filled(12, 8, [0.0; 4]), Encoding::LinearSrgb) },
    );
    let text = format!(
        "{EMPTY}exposure_ev100 = 3\n[plate]\nimage = \"plate\"\ndepth = \"depth\"\ndepth_kind = \"inverse\"\nalpha = \"linear\"\n\
         depth_known = [[1, 1, 10.0], [23, 1, 1.0], [11, 1, 2.0]]\n"
    );
    let compiled = Arc::new(
        support::compiled("a.toml", &text, &support::kinds(), assets).unwrap_or_else(|error| panic!("{error}")),
    );
    assert!(!compiled.has_opaque_plate());
    let plan = Plan::new(&compiled, &PlanOptions::default()).unwrap();
    let told: Vec<String> = remarks::remarks(&compiled, &plan).into_iter().map(|(_, remark)| remark.message).collect();
    let told = told.join("\n");
    for words in
        ["straight, blended in linear light", "12 x 8 pixels and the image 24 x 16", "`depth_scale = ", "deviate by"]
    {
        assert!(told.contains(words), "{words}: {told}");
    }
}

#[test]
fn a_depth_of_another_size_hides_what_it_covers_and_no_more() {
    let black = Picture::opaque(Image::filled(24, 16, [0.0, 0.0, 0.0, 1.0]), Encoding::LinearAcescg);
    let depth: Vec<f32> = (0..12 * 8).map(|index| if index % 12 < 6 { 0.0 } else { 2.0 }).collect();
    let drawn = |depth: Picture| {
        let mut assets = MemoryAssets::default();
        assets.insert_picture("plate", black.clone());
        assets.insert_picture("depth", depth);
        let text = format!("{EMPTY}[plate]\nimage = \"plate\"\ndepth = \"depth\"\n");
        let options = PlanOptions { layers: true, ..PlanOptions::default() };
        draw(&mut plan_with(&text, &options, Arc::new(assets)).open(), 0).depth.unwrap_or_default()
    };
    let half = Picture { depth: Some(depth), ..Picture::opaque(Image::filled(12, 8, [0.0; 4]), Encoding::LinearSrgb) };
    let found = drawn(half);
    // 0 is far; between near and far nothing is invented.
    for (index, value) in found.iter().enumerate() {
        assert_eq!(*value, if index % 24 < 12 { f32::INFINITY } else { 2.0 }, "{index}");
    }
}

#[test]
fn a_plate_without_alpha_stays_opaque() {
    let frame = over(Picture::opaque(Image::filled(24, 16, [0.5, 0.4, 0.3, 1.0]), Encoding::DisplaySrgb), "");
    assert!(frame.opaque && frame.beauty.pixels().iter().all(|[.., alpha]| *alpha == 1.0));
}

/// A camera at the origin that looks along -z, with a field of view of 90 degrees.
const VIEW: &str = "bansho = 2\n[picture]\nsize = [24, 16]\nframes = 1\nexposure_ev100 = 0\n[camera]\nposition = [0, 0, 0]\ntarget = [0, 0, -1]\n\
    vertical_fov_deg = 90\n";
/// Mist before a plate 3 m away, haze and a lamp behind it.
const BEFORE_AND_BEHIND: &str = "[[absorber]]\nname = \"mist\"\nnear = 1\nfar = 2\nextinction = [0.5, 0.5, 0.5]\n[[absorber]]\nname = \"haze\"\nnear = 4\nfar = 5\n\
    extinction = [1, 1, 1]\n[[emitter]]\nname = \"lamp\"\nposition = [0, 0, -6]\nradius = 100\nluminance = 100\n";
const SKY: &str = "[sky]\nkind = \"uniform\"\nluminance = 50\n";
const COVERAGE: f32 = 0.25;

/// The scene `text` with a plate of this color over black and coverage, which is 3 m away if it has a depth.
fn covered(text: &str, color: [f32; 4], depth: Option<f32>, options: &PlanOptions) -> Frame {
    let alpha = if color[3] < 1.0 { PictureAlpha::Associated } else { PictureAlpha::Opaque };
    let depth = depth.map(|meters| vec![meters; 24 * 16]);
    let opaque = Picture::opaque(Image::filled(24, 16, color), Encoding::LinearAcescg);
    let mut assets = MemoryAssets::default();
    assets.insert_picture("plate", Picture { alpha, depth, ..opaque });
    let text = format!("{VIEW}[plate]\nimage = \"plate\"\n{text}");
    draw(&mut plan_with(&text, options, Arc::new(assets)).open(), 0)
}

fn is_close(found: f32, expected: f32) -> bool {
    (found - expected).abs() <= 2e-5 * expected.abs().max(1.0)
}

#[test]
fn what_a_depth_hides_is_seen_through_the_transparency_of_the_plate() {
    let frame = covered(BEFORE_AND_BEHIND, [0.05, 0.1, 0.15, COVERAGE], Some(3.0), &PlanOptions::default());
    let scale = bansho_base::color::exposure_scale(0.0) as f32;
    let [mist, haze] = [-0.5, -1.0].map(|depth| bansho_base::math::exp(depth) as f32);
    // The plate through the mist; the lamp through mist, three quarters of the plate, and haze.
    let behind = (1.0 - COVERAGE) * mist * haze * 100.0 * scale;
    let expected = [0.05, 0.1, 0.15].map(|color| mist * color + behind);
    for pixel in frame.beauty.pixels() {
        assert!((0..3).all(|c| is_close(pixel[c], expected[c])), "{pixel:?} {expected:?}");
        assert!(is_close(pixel[3], 1.0 - mist * haze * (1.0 - COVERAGE)), "{pixel:?}");
    }
    // An opaque plate hides it.
    let opaque = covered(BEFORE_AND_BEHIND, [0.05, 0.1, 0.15, 1.0], Some(3.0), &PlanOptions::default());
    assert!(opaque.beauty.pixels().iter().all(|pixel| is_close(pixel[2], mist * 0.15) && pixel[3] == 1.0));
    // Without a depth, all are before the plate.
    let far = covered(BEFORE_AND_BEHIND, [0.05, 0.1, 0.15, COVERAGE], None, &PlanOptions::default());
    let in_front = mist * haze * 0.05 + mist * haze * 100.0 * scale;
    assert!(far.beauty.pixels().iter().all(|pixel| is_close(pixel[0], in_front)), "{:?}", far.beauty.at(0, 0));
}

#[test]
fn the_sky_is_seen_through_the_transparency_of_the_plate() {
    let text = format!("{BEFORE_AND_BEHIND}{SKY}");
    let options = PlanOptions { layers: true, ..PlanOptions::default() };
    let without_plate =
        draw(&mut plan_with(&format!("{VIEW}{text}"), &options, Arc::new(MemoryAssets::default())).open(), 0);
    for depth in [Some(3.0), None] {
        let frame = covered(&text, [0.05, 0.1, 0.15, COVERAGE], depth, &options);
        let opaque = covered(&text, [0.2, 0.4, 0.6, 1.0], depth, &options);
        for ((found, opaque), clear) in
            frame.beauty.pixels().iter().zip(opaque.beauty.pixels()).zip(without_plate.beauty.pixels())
        {
            let expected = [0, 1, 2, 3].map(|c| COVERAGE * opaque[c] + (1.0 - COVERAGE) * clear[c]);
            assert!((0..4).all(|c| is_close(found[c], expected[c])), "{depth:?}: {found:?} {expected:?}");
            assert!(clear[0] > 0.1 && is_close(found[3], 1.0), "{found:?}");
        }
        // What the layers add is the picture.
        for (c, suffix) in ["R", "G", "B", "A"].iter().enumerate() {
            let layers: Vec<_> =
                frame.channels.iter().filter(|channel| channel.name.ends_with(&format!(".{suffix}"))).collect();
            assert_eq!(layers.len(), 5, "mist, haze, lamp, sky and plate");
            let sum: f32 = layers.iter().map(|layer| layer.values[100]).sum();
            assert!(is_close(sum, frame.beauty.pixels()[100][c]), "{suffix}: {sum}");
        }
    }
}

#[test]
fn an_opaque_plate_hides_the_sky_to_the_bit() {
    let text = format!("{BEFORE_AND_BEHIND}{SKY}");
    let [shown, hidden] = [text.clone(), format!("{text}visible = false\n")].map(|text| {
        let options = PlanOptions { layers: true, ..PlanOptions::default() };
        covered(&text, [0.2, 0.4, 0.6, 1.0], Some(3.0), &options)
    });
    assert!(shown.beauty == hidden.beauty && shown.channels.len() == hidden.channels.len() && shown.opaque);
}

#[test]
fn scale_and_shift_of_an_inverse_depth_are_found_from_the_ground() {
    let above = |row: usize| (row as f64 - 7.5) / 8.0;
    // The camera is 1.6 m above the ground; a wall 4 m away covers a third of the width. The inverse depth is 0.05 + 0.01 value.
    let values: Vec<f32> = (0..24 * 16)
        .map(|index| {
            let ground = above(index / 24).max(0.0) / 1.6;
            let inverse = if index % 24 < 8 { f64::max(ground, 0.25) } else { ground };
            ((inverse - 0.05) / 0.01) as f32
        })
        .collect();
    let black = Picture::opaque(Image::filled(24, 16, [0.0, 0.0, 0.0, 1.0]), Encoding::LinearAcescg);
    let scene = |values: Vec<f32>, more: &str| {
        let mut assets = MemoryAssets::default();
        assets.insert_picture("plate", Picture { depth: Some(values), ..black.clone() });
        let text = format!(
            "{VIEW}[plate]\nimage = \"plate\"\ndepth_kind = \"inverse\"\n{more}[ground]\nheight = -1.6\nkind = \"plate\"\n"
        );
        support::compiled("a.toml", &text, &support::kinds(), assets).map(Arc::new)
    };
    let compiled = scene(values, "").unwrap_or_else(|error| panic!("{error}"));
    let plan = Arc::new(Plan::new(&compiled, &PlanOptions { layers: true, ..PlanOptions::default() }).unwrap());
    let told =
        remarks::remarks(&compiled, &plan).into_iter().map(|(_, remark)| remark.message).collect::<Vec<_>>().join("\n");
    for words in [
        "`depth_scale = 100.000000`",
        "`depth_shift = 0.050000`",
        "of the pixels below the horizon agree",
        "deviate by",
    ] {
        assert!(told.contains(words), "{words}: {told}");
    }
    let depth = draw(&mut bansho_render::Shot::open(compiled, plan), 0).depth.unwrap();
    for row in 9..16 {
        let found = f64::from(depth[row * 24 + 20]);
        assert!((found * above(row) / 1.6 - 1.0).abs() < 0.01, "{row}: {found}");
    }
    assert!((depth[2 * 24 + 3] - 4.0).abs() < 0.04, "the wall: {}", depth[2 * 24 + 3]);
    // A depth that shows no ground is refused, unless scale or shift is stated.
    let flat = || vec![7.0_f32; 24 * 16];
    let error = scene(flat(), "").err().expect("no ground is refused").to_string();
    assert!(
        error.contains("depth_kind") && error.contains("the ground at -1.6 m") && error.contains("`depth_known`"),
        "{error}"
    );
    assert!(scene(flat(), "depth_scale = 2.0\n").is_ok() && scene(flat(), "depth_shift = 0.0\n").is_ok());
}

#[test]
fn hot_air_bends_what_is_seen_through_the_plate_as_well() {
    // What is behind the air looks the same everywhere, so bending it changes nothing; but it is composited in groups of slices.
    let air = |bend: f64| {
        format!(
            "{BEFORE_AND_BEHIND}{SKY}[[emitter]]\nname = \"air\"\nposition = [0, 0, -0.5]\nluminance = 0\nbend = {bend}\n"
        )
    };
    let [straight, bent] =
        [0.0, 0.2].map(|bend| covered(&air(bend), [0.05, 0.1, 0.15, COVERAGE], Some(3.0), &PlanOptions::default()));
    for (straight, bent) in straight.beauty.pixels().iter().zip(bent.beauty.pixels()) {
        assert!((0..4).all(|c| is_close(straight[c], bent[c])), "{straight:?} {bent:?}");
    }
}
