//! Plates in pictures: what Bansho wrote comes back, alpha stays the picture's, depth of another size hides what it covers.

#[allow(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::{path::Path, sync::Arc};

use bansho::{
    BitDepth, Plan, PlanOptions,
    media::{
        assets::{decode_picture, limits::MemoryLimit},
        exr,
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
use support::{AbsorberParameters, EmitterParameters, draw, plan_with};

use bansho_base::phenomenon::kind::Describe;

const EMPTY: &str = "bansho = 2\n[picture]\nsize = [24, 16]\nframes = 1\n";

fn standard() -> PlanOptions {
    PlanOptions { display: View::STANDARD, ..PlanOptions::default() }
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
    let bits = |picture: &Picture| {
        picture.color.pixels().as_flattened().iter().map(|value| value.to_bits()).collect::<Vec<_>>()
    };
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
    let veil = |value: f32| Picture {
        alpha: PictureAlpha::Straight(AlphaConvention::Encoded),
        ..Picture::opaque(Image::filled(24, 16, [value, value, value, 0.5]), Encoding::DisplaySrgb)
    };
    // Over black: encoded 0.5 is linear 0.214. A black veil of half in encoded values is one of 0.762 in light.
    for (plate, value, light, coverage) in [
        ("", 1.0, 0.214, 0.0),
        ("", 0.0, 0.0, 0.762),
        ("alpha = \"encoded\"\n", 0.0, 0.0, 0.762),
        ("alpha = \"linear\"\n", 1.0, 0.5, 0.5),
    ] {
        let [r, g, b, alpha] = over(veil(value), plate).beauty.at(12, 8);
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
    let kinds = [AbsorberParameters::KIND, EmitterParameters::KIND];
    let compiled =
        Arc::new(support::compiled("a.toml", &text, &kinds, assets).unwrap_or_else(|error| panic!("{error}")));
    assert!(!compiled.has_opaque_plate());
    let plan = Plan::new(&compiled, &PlanOptions::default()).unwrap();
    let told: Vec<String> = remarks::remarks(&compiled, &plan).into_iter().map(|(_, remark)| remark.message).collect();
    let told = told.join("\n");
    for words in
        ["straight, blended in linear light", "12 x 8 pixels, the image 24 x 16", "`depth_scale = ", "deviate by"]
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
