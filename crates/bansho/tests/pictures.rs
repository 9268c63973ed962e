//! The shipped scenes as pictures: small goldens, and for each scene numbers that a toy would fail.
//!
//! `BANSHO_BLESS=1 cargo test -p bansho --test pictures` rewrites the goldens; the reason goes into CHANGELOG.md under
//! "Changes the picture".
#![cfg(feature = "files")]

mod looks;

use std::ops::Range;

use bansho::PlanOptions;
use looks::{Film, golden, luminance, scene_text};

/// Size of goldens and of most measurements.
const SMALL: [usize; 2] = [256, 144];

#[test]
fn golden_pictures_are_as_they_were() {
    let scenes = [
        "candle",
        "torch",
        "campfire",
        "hearth",
        "ohshima_itahashi",
        "inagaki_still",
        "inagaki_wind_left",
        "inagaki_haze",
        "inagaki_density",
        "street_lamp",
        "street_lamp_near",
        "headlights",
        "headlights_ahead",
        "downpour_day",
        "drizzle",
        "rain_over_plate",
        "campfire_in_rain",
    ];
    let changed: Vec<String> = scenes.into_iter().filter_map(|scene| golden(scene, SMALL, 40)).collect();
    assert!(changed.is_empty(), "{}", changed.join("\n"));
}

/// Shares of the lit pixels that are red, orange and yellow to white, by the ratio of green to red in linear light.
fn hues(film: &Film) -> [f64; 3] {
    let mut counts = [0.0; 3];
    for pixel in film.pixels().filter(|pixel| luminance(**pixel) > 0.01) {
        let ratio = pixel[1] / pixel[0].max(1e-6);
        counts[if ratio < 0.12 {
            0
        } else if ratio < 0.45 {
            1
        } else {
            2
        }] += 1.0;
    }
    let all: f64 = counts.iter().sum();
    counts.map(|count| count / all)
}

#[test]
fn flames_go_from_red_through_orange_to_yellow_white() {
    // The paper paints its cores yellowish white, so it has less orange.
    for (scene, least_orange) in [("campfire", 0.2), ("torch", 0.2), ("ohshima_itahashi", 0.05)] {
        let film = Film::of(scene, SMALL, &[20, 60, 100], &PlanOptions::default());
        let [red, orange, yellow] = hues(&film);
        assert!(
            red > 0.02 && orange > least_orange && yellow > 0.05,
            "{scene}: red {red}, orange {orange}, yellow {yellow}"
        );
        let pink = film.pixels().filter(|p| p[2] > p[1] + 0.02 && p[0] > 0.3).count() as f64 / film.len() as f64;
        assert!(pink < 0.001, "{scene}: {pink} of the picture is pink");
    }
}

#[test]
fn cores_keep_their_modelling() {
    for scene in ["candle", "torch", "campfire"] {
        let film = Film::of(scene, SMALL, &[20, 60, 100], &PlanOptions::default());
        let flat = film.pixels().filter(|p| p.iter().all(|value| *value > 0.99)).count() as f64 / film.len() as f64;
        assert!(flat < 0.001, "{scene}: {flat} of the picture is clipped");
    }
}

#[test]
fn a_campfire_flickers_as_fires_do() {
    let frames: Vec<i64> = (0..120).collect();
    let film = Film::of("campfire", [96, 54], &frames, &PlanOptions::default());
    let light: Vec<f64> = (0..frames.len()).map(|frame| film.mean(frame)).collect();
    let mean = light.iter().sum::<f64>() / light.len() as f64;
    let deviation = (light.iter().map(|l| (l - mean) * (l - mean)).sum::<f64>() / light.len() as f64).sqrt() / mean;
    assert!((0.01..0.4).contains(&deviation), "relative flicker {deviation}");
    // Mean frequency of the flicker, weighted by power, from the spectrum of the 4 s at 30 frames a second.
    let power = |cycles: usize| {
        let wave = |phase: f64| -> f64 {
            let turn = |i: usize| std::f64::consts::TAU * cycles as f64 * i as f64 / light.len() as f64;
            light.iter().enumerate().map(|(i, l)| (l - mean) * bansho::base::math::cos(turn(i) + phase)).sum()
        };
        wave(0.0) * wave(0.0) + wave(-std::f64::consts::FRAC_PI_2) * wave(-std::f64::consts::FRAC_PI_2)
    };
    let spectrum: Vec<f64> = (1..60).map(power).collect();
    let total: f64 = spectrum.iter().sum();
    let hertz = spectrum.iter().enumerate().map(|(i, p)| (i + 1) as f64 / 4.0 * p).sum::<f64>() / total;
    assert!((0.5..6.0).contains(&hertz), "mean flicker frequency {hertz} Hz");
}

#[test]
fn flames_narrow_upward_and_never_touch_the_edges_of_their_sheet() {
    let frames: Vec<i64> = (0..12).map(|i| 10 * i).collect();
    let text = "bansho = 1\n[picture]\nsize = [144, 144]\n[camera]\nposition = [0, 0.85, 4]\ntarget = [0, 0.85, 0]\n\
                [[flame_sheet]]\nwind_response = 0\n";
    let film = Film::of_text(text, [144, 144], &frames, &PlanOptions::default());
    let lit_at = |share: f64| -> f64 {
        // The sheet, 1.7 m high, fills 84 of 144 rows around the middle of the picture.
        let row = 72 + (84.0 * (0.5 - share)) as usize;
        let lit = |frame: usize| film.row(frame, row).iter().filter(|pixel| luminance(**pixel) > 0.02).count();
        (0..frames.len()).map(lit).sum::<usize>() as f64 / frames.len() as f64
    };
    let (low, high) = (lit_at(0.15), lit_at(0.75));
    assert!(low > 8.0 && high < 0.6 * low, "lit pixels: {low} low, {high} high");
    for frame in 0..frames.len() {
        for row in 0..144 {
            let pixels = film.row(frame, row);
            // Sheet 1.1 m wide: columns 45 to 99.
            let edge = luminance(pixels[45]).max(luminance(pixels[98]));
            assert!(edge < 0.05, "frame {frame}, row {row}: a hard edge of luminance {edge}");
        }
    }
}

#[test]
fn wind_bends_the_flame_and_more_wind_bends_it_more() {
    let lean = |speed: f64| {
        let text = format!(
            "bansho = 1\n[picture]\nsize = [160, 120]\n[wind]\nvelocity = [{speed}, 0, 0]\ngust = 0\n[[flame_sheet]]\n"
        );
        let film = Film::of_text(&text, [160, 120], &[0, 15, 30, 45, 60], &PlanOptions::default());
        film.centroid_of_upper_half()[0] - 80.0
    };
    let [left, still, right, strong] = [-1.0, 0.0, 1.0, 2.5].map(lean);
    assert!(still.abs() < 4.0, "still: {still}");
    assert!(left < still - 1.0 && right > still + 1.0 && strong > right + 1.0, "{left} {still} {right} {strong}");
}

#[test]
fn a_loop_closes_as_smoothly_as_it_runs() {
    for scene in ["campfire", "candle"] {
        let options = PlanOptions { loop_s: Some(2.0), ..PlanOptions::default() };
        let frames: Vec<i64> = (0..60).collect();
        let film = Film::of(scene, [128, 72], &frames, &options);
        let mut steps: Vec<f64> = (0..59).map(|frame| film.difference(frame, frame + 1)).collect();
        let last = film.difference(59, 0);
        steps.sort_by(f64::total_cmp);
        // Everything repeats exactly, so the seam is a pair like any other: half of them lie above the median.
        let (median, largest) = (steps[29], steps[58]);
        assert!(last <= largest.min(1.3 * median), "{scene}: last to first {last}, median {median}, largest {largest}");
    }
}

#[test]
fn gradients_show_no_bands() {
    let text = scene_text("campfire");
    let bands = looks::wide_bands(&text, [1280, 720], 60);
    assert!(bands < 0.01, "{bands} of the gradient's length lies in bands wider than 8 pixels");
}

#[test]
fn the_papers_stages_follow_from_each_other() {
    let stage = |name: &str| {
        let text = scene_text("ohshima_itahashi").replace("stage = \"flame\"", &format!("stage = \"{name}\""));
        Film::of_text(&text, [256, 256], &[0], &PlanOptions::default())
    };
    let [texture, thresholded, sharpened, coloured] = ["texture", "thresholded", "sharpened", "coloured"].map(stage);
    let lit = |film: &Film| film.pixels().filter(|pixel| luminance(**pixel) > 0.01).count() as f64 / film.len() as f64;
    assert!(lit(&texture) > 0.9, "the texture has no flat parts: {}", lit(&texture));
    assert!(lit(&thresholded) < 0.8 * lit(&texture));
    assert!((lit(&sharpened) / lit(&thresholded) - 1.0).abs() < 0.25, "sharpening moves no edge far");
    assert!(sharpened.mean(0) > thresholded.mean(0), "sharpening raises what is above the threshold");
    let grey = |film: &Film| film.pixels().all(|p| (p[0] - p[1]).abs() < 0.02 && (p[1] - p[2]).abs() < 0.02);
    assert!(grey(&texture) && grey(&thresholded) && grey(&sharpened) && !grey(&coloured));
}

/// The paper's flame in wind of `speed` m/s, twelve frames of it.
fn gas_in_wind(speed: f64) -> Film {
    let text = scene_text("inagaki_still").replace(
        "[[flame_particles]]",
        &format!("[wind]\nvelocity = [{speed:?}, 0, 0]\ngust = 0\n[[flame_particles]]"),
    );
    let frames: Vec<i64> = (1..=12).map(|index| 10 * index).collect();
    Film::of_text(&text, [160, 90], &frames, &PlanOptions::default())
}

#[test]
fn wind_bends_burning_gas_and_more_wind_bends_it_more() {
    let lean = |speed: f64| gas_in_wind(speed).centroid_of_upper_half()[0] - 80.0;
    let [left, still, right, strong] = [-0.8, 0.0, 0.8, 1.6].map(lean);
    assert!(still.abs() < 6.0, "still: {still}");
    assert!(left < still - 2.0 && right > still + 2.0 && strong > right + 2.0, "{left} {still} {right} {strong}");
}

#[test]
fn burning_gas_has_sharp_rims_bright_cores_and_gaps() {
    let text = scene_text("inagaki_still");
    let film = Film::of_text(&text, [640, 360], &[20, 60], &PlanOptions::default());
    let smooth = Film::of_text(
        &format!("{text}[flame_particles.look]\ndetail = 0\n"),
        [640, 360],
        &[20, 60],
        &PlanOptions::default(),
    );
    // How steeply luminance changes from pixel to pixel, beside how much there is: sums of kernels alone are a blur.
    let steepness = |film: &Film| {
        let (mut change, mut light) = (0.0, 0.0);
        for frame in 0..2 {
            for row in 0..360 {
                for pair in film.row(frame, row).windows(2) {
                    change += (luminance(pair[1]) - luminance(pair[0])).abs();
                    light += luminance(pair[0]);
                }
            }
        }
        change / light
    };
    let (fine, blurred) = (steepness(&film), steepness(&smooth));
    assert!(fine > 1.5 * blurred, "steepness {fine}, without detail {blurred}");
    let [_, orange, yellow] = hues(&film);
    assert!(orange > 0.1 && yellow > 0.05, "orange {orange}, yellow {yellow}");
    let flat = film.pixels().filter(|p| p.iter().all(|value| *value > 0.99)).count() as f64 / film.len() as f64;
    assert!(flat < 0.001, "{flat} of the picture is clipped");
}

#[test]
fn haze_displaces_the_plate_around_the_flame_and_nowhere_else() {
    let text = scene_text("inagaki_haze");
    let draw = |text: &str| Film::of_text(text, [320, 180], &[40], &PlanOptions::default());
    let (bent, straight) = (draw(&text), draw(&text.replace("haze_gain = 14.0", "haze_gain = 0.0")));
    let moved = |columns: std::ops::Range<usize>| {
        let pixels = || (0..180).flat_map(|row| columns.clone().map(move |x| (row, x)));
        let differs = |(row, x): &(usize, usize)| {
            (luminance(bent.row(0, *row)[*x]) - luminance(straight.row(0, *row)[*x])).abs() > 0.02
        };
        pixels().filter(differs).count() as f64 / pixels().count() as f64
    };
    let (around, left, right) = (moved(130..190), moved(0..80), moved(240..320));
    assert!(around > 0.02, "{around} of the plate around the flame moves");
    assert_eq!((left, right), (0.0, 0.0), "the plate beside the flame stays");
}

/// Mean luminance of a part of a film's first frame.
fn mean(film: &Film, rows: Range<usize>, columns: Range<usize>) -> f64 {
    let pixels = rows.clone().flat_map(|row| film.row(0, row)[columns.clone()].iter());
    pixels.map(|pixel| luminance(*pixel)).sum::<f64>() / (rows.len() * columns.len()) as f64
}

#[test]
fn rain_streaks_are_upright_and_brightest_near_the_lamp() {
    let size = [480, 270];
    let film = Film::of("street_lamp", size, &[30], &PlanOptions::default());
    let (mut across, mut down) = (0.0, 0.0);
    for row in 0..190 {
        let (here, below) = (film.row(0, row), film.row(0, row + 1));
        for x in 0..size[0] - 1 {
            across += (luminance(here[x]) - luminance(here[x + 1])).abs();
            down += (luminance(here[x]) - luminance(below[x])).abs();
        }
    }
    assert!(across > 1.3 * down, "across {across}, down {down}");
    // The lamp stands in row 25, column 228; the dark far to its right is out of its light.
    let (near, far) = (mean(&film, 35..75, 200..260), mean(&film, 35..75, 420..480));
    assert!(near > 2.0 * far, "the lamp's light falls off: {near} {far}");
}

#[test]
fn headlights_light_a_cone_of_rain() {
    let film = Film::of("headlights", [480, 270], &[30], &PlanOptions::default());
    // The lamps stand in row 148, columns 69 and 120, and shine to the right.
    let (beam, above, behind) =
        (mean(&film, 130..165, 130..190), mean(&film, 20..60, 80..140), mean(&film, 130..165, 0..50));
    assert!(beam > 10.0 * above && beam > 10.0 * behind, "{beam} {above} {behind}");
}

#[test]
fn culling_changes_no_pixel_of_a_scene_by_a_255th() {
    for scene in ["street_lamp", "headlights"] {
        let text = scene_text(scene);
        let all = text.replace("[[rain]]\n", "[[rain]]\nculling = false\n");
        assert_ne!(text, all);
        let [culled, all] = [text, all].map(|text| Film::of_text(&text, SMALL, &[30], &PlanOptions::default()));
        let pairs = culled.pixels().flatten().zip(all.pixels().flatten());
        let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst <= 1.0 / 255.0, "{scene}: {worst}");
    }
}

#[test]
fn a_downpour_dims_the_far_more_than_the_near_and_leaves_the_sky() {
    let text = scene_text("downpour_day");
    let dry = text.replace("rate_mm_per_h = 70.0", "rate_mm_per_h = 0.0");
    assert_ne!(text, dry);
    let [wet, dry] = [text, dry].map(|text| Film::of_text(&text, [240, 135], &[30], &PlanOptions::default()));
    let change = |rows: Range<usize>, columns: Range<usize>| {
        mean(&wet, rows.clone(), columns.clone()) / mean(&dry, rows, columns) - 1.0
    };
    // Dark trees 75 m away, grass from 4 m on, and sky.
    let (trees, grass, sky) = (change(60..78, 110..130), change(110..135, 20..100), change(5..25, 110..130));
    assert!(trees > 0.05 && trees > 2.0 * grass.abs() && sky.abs() < 0.25, "{trees} {grass} {sky}");
}
