//! The exposure of shots that state none, and the light of a plate on rain.

use std::sync::Arc;

use bansho::KINDS;
use bansho_base::{
    color::{self, AlphaConvention, View},
    frame::{DisplayPixels, Frame},
    host::{
        assets::{Encoding, MemoryAssets, Picture},
        observer::Unobserved,
    },
    image::{Image, Rect},
};
use bansho_render::{
    PlanOptions,
    display::{BitDepth, display},
};
use bansho_scene::Scene;

use crate::support::Planned;

const SIZE: [usize; 2] = [160, 90];

/// A plate of sky over a dark wall, taken with an exposure that it may record.
fn plate(exposure_ev100: Option<f64>) -> Arc<MemoryAssets> {
    let shade =
        |index: usize| if index / SIZE[0] < SIZE[1] / 3 { [0.75, 0.78, 0.82, 1.0] } else { [0.12, 0.11, 0.1, 1.0] };
    let color = Image::from_pixels(SIZE[0], SIZE[1], (0..SIZE[0] * SIZE[1]).map(shade).collect()).unwrap();
    let mut assets = MemoryAssets::default();
    assets.insert_picture("wall.jpg", Picture { exposure_ev100, ..Picture::opaque(color, Encoding::DisplaySrgb) });
    Arc::new(assets)
}

fn planned(text: &str, assets: Arc<MemoryAssets>, options: &PlanOptions) -> Planned {
    let text = format!("bansho = 2\n[picture]\nsize = [160, 90]\nframes = 3\n{text}");
    let scene = Scene::parse("test.toml", &text, KINDS).unwrap_or_else(|error| panic!("{error}"));
    Planned::new(scene, options, assets)
}

fn plan(text: &str, assets: Arc<MemoryAssets>) -> Planned {
    planned(text, assets, &PlanOptions::default())
}

fn frame(plan: Planned) -> Frame {
    let mut shot = plan.open();
    bansho::draw(&mut shot, 1, &Unobserved).unwrap()
}

/// Mean luminance of rows, 1.0 being display white.
fn mean(frame: &Frame, rows: std::ops::Range<usize>) -> f64 {
    let count = (rows.len() * frame.beauty.width()) as f64;
    let light = rows.flat_map(|y| frame.beauty.row(y)).map(|[r, g, b, _]| f64::from(color::luminance([*r, *g, *b])));
    light.sum::<f64>() / count
}

const PLATE: &str = "[plate]\nimage = \"wall.jpg\"\n";
const RAIN: &str = "[[rain]]\nrate_mm_per_h = 60.0\nopacity_gain = 2.0\n";

#[test]
fn a_plates_exposure_is_the_stated_one_then_the_recorded_one_then_an_assumed_one_that_is_told() {
    let ev = |text: &str, recorded: Option<f64>| {
        let plan = plan(text, plate(recorded));
        let told = plan.remarks().into_iter().find_map(|(name, remark)| {
            let rest = remark.message.strip_prefix("with which exposure it was taken is not known; EV ")?;
            Some((name, rest.split(' ').next()?.parse::<f64>().ok()?))
        });
        ((10.0 * plan.exposure_ev100).round() / 10.0, told)
    };
    let assumed = |ev100: f64| Some(("plate".to_owned(), ev100));
    assert_eq!(ev(&format!("{PLATE}exposure_ev100 = 9.5\n{RAIN}"), Some(3.0)), (9.5, None));
    assert_eq!(ev(&format!("{PLATE}{RAIN}"), Some(13.2)), (13.2, None));
    assert_eq!(ev(&format!("{PLATE}{RAIN}"), None), (12.0, assumed(12.0)));
    // The exposure of `[picture]` has priority; a sky is nearly white, a flame neither dark nor white.
    assert_eq!(ev(&format!("exposure_ev100 = 7.0\n{PLATE}{RAIN}"), Some(3.0)), (7.0, None));
    assert_eq!(ev(&format!("{PLATE}[sky]\nluminance = 1536.0\n{RAIN}"), None), (10.6, assumed(10.6)));
    let fire = "[[flame_sheet]]\ncolor = { luminance = 12000.0 }\n";
    assert_eq!(ev(&format!("{PLATE}{fire}"), None), (10.1, assumed(10.1)));
    assert_eq!(ev(&format!("{PLATE}exposure_ev100 = \"auto\"\n{fire}"), Some(8.0)), (8.0, None));
}

#[test]
fn an_exposure_needs_a_plate() {
    let text = "bansho = 2\n[plate]\nexposure_ev100 = 9.0\n";
    let error = Scene::parse("test.toml", text, KINDS).err().unwrap().to_string();
    assert!(error.starts_with("test.toml:3:18: plate.exposure_ev100: an exposure needs an `image`"), "{error}");
}

#[test]
fn rain_shows_before_what_is_dark_in_a_plate_and_hardly_before_its_sky() {
    let [wet, dry] = [RAIN, ""].map(|rain| frame(plan(&format!("{PLATE}{rain}"), plate(None))));
    let change = |rows: std::ops::Range<usize>| mean(&wet, rows.clone()) / mean(&dry, rows) - 1.0;
    let (sky, wall) = (change(0..25), change(40..90));
    assert!(wall > 0.3 && sky.abs() < 0.15, "wall {wall}, sky {sky}");
    // The light of the plate is as bright as the plate looks, for any exposure.
    let bright = frame(plan(&format!("exposure_ev100 = 4.0\n{PLATE}{RAIN}"), plate(None)));
    let apart = (mean(&bright, 0..90) / mean(&wet, 0..90) - 1.0).abs();
    assert!(apart < 1e-3, "{apart}");
}

#[test]
fn a_crop_is_lit_by_the_whole_plate() {
    let crop = Rect { x: 32, y: 50, width: 64, height: 24 };
    let whole = frame(plan(&format!("{PLATE}{RAIN}"), plate(None)));
    let options = PlanOptions { crop: Some(crop), ..PlanOptions::default() };
    let part = frame(planned(&format!("{PLATE}{RAIN}"), plate(None), &options));
    assert_eq!(part.beauty, whole.beauty.crop(crop).unwrap());
}

#[test]
fn what_hardly_changes_a_plate_is_told_and_what_shows_is_not() {
    let faint = |text: &str| {
        let remarks = plan(&format!("{PLATE}exposure_ev100 = 12\n{text}"), plate(None)).remarks();
        let each = remarks.into_iter().filter(|(_, remark)| remark.message.contains("which is hardly visible"));
        each.map(|(name, _)| name).collect::<Vec<_>>()
    };
    assert_eq!(faint("[[rain]]\nrate_mm_per_h = 0.2\n"), ["rain"]);
    assert_eq!(faint(RAIN), Vec::<String>::new());
    assert_eq!(faint("[[flame_sheet]]\n"), Vec::<String>::new());
    // A candle in sunshine.
    assert_eq!(
        faint("[[flame_sheet]]\nwidth = 0.02\nheight = 0.04\n[[rain]]\nrate_mm_per_h = 60.0\nopacity_gain = 2.0\n"),
        ["flame_sheet"]
    );
    let dark = plan("exposure_ev100 = 20.0\n[[rain]]\nrate_mm_per_h = 0.1\n[sky]\n", Arc::default()).remarks();
    assert!(dark.is_empty(), "without a plate nothing is compared");
}

#[test]
fn ground_under_a_bright_lamp_is_neither_burnt_out_nor_black() {
    let scene = |intensity: f64| {
        format!(
            "[sky]\nluminance = 1.0\n[ground]\nwetness = 0.7\n[[light]]\nposition = [0, 4, -2]\nvisible = true\n\
             intensity = {intensity:.1}\n[[rain]]\n"
        )
    };
    let night = plan(&scene(3000.0), Arc::default());
    assert!((3.0..5.0).contains(&night.exposure_ev100), "EV {}", night.exposure_ev100);
    // Four times the light, two stops; a lamp too weak to matter leaves the sky's exposure.
    let ev100 = |intensity: f64| plan(&scene(intensity), Arc::default()).exposure_ev100;
    assert!((ev100(12_000.0) - night.exposure_ev100 - 2.0).abs() < 0.1);
    assert!((ev100(0.01) - -1.03).abs() < 0.02, "{}", ev100(0.01));
    let picture = display(&frame(night), &View::DISPLAY, BitDepth::Eight, AlphaConvention::Linear);
    let DisplayPixels::Eight(pixels) = picture.pixels else { panic!("8 bits were asked for") };
    let clipped = pixels.iter().filter(|pixel| pixel[..3].iter().all(|code| *code >= 254)).count();
    let mean = pixels.iter().map(|[r, g, b, _]| f64::from(*r) + f64::from(*g) + f64::from(*b)).sum::<f64>()
        / (3 * pixels.len()) as f64;
    assert!(clipped * 1000 < pixels.len(), "{clipped} of {} pixels are white", pixels.len());
    assert!((40.0..130.0).contains(&mean), "mean code {mean}");
}

#[test]
fn lamps_alone_set_the_exposure_for_the_rain_they_light() {
    let text = "[[light]]\nposition = [0, 3, 0]\nintensity = 2000.0\n[[rain]]\n";
    let ev100 = plan(text, Arc::default()).exposure_ev100;
    assert!((1.0..8.0).contains(&ev100), "EV {ev100}");
    // Where nothing shines at all: a sunlit day.
    let dark = "[sky]\nluminance = 0.0\n[[rain]]\n";
    assert_eq!(plan(dark, Arc::default()).exposure_ev100, 15.0);
}
