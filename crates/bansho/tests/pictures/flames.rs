//! The flame sheet.

use bansho::SceneOptions;

use crate::{
    SMALL,
    looks::{Film, hues, luminance, scene_text, wide_bands},
};

#[test]
fn flames_go_from_red_through_orange_to_yellow_white() {
    // The paper paints its cores yellowish white, so it has less orange.
    for (scene, least_orange) in [("campfire", 0.2), ("torch", 0.2), ("ohshima_itahashi", 0.05)] {
        let film = Film::of(scene, SMALL, &[20, 60, 100], &SceneOptions::default());
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
fn cores_keep_their_modeling() {
    for scene in ["candle", "torch", "campfire"] {
        let film = Film::of(scene, SMALL, &[20, 60, 100], &SceneOptions::default());
        let flat = film.pixels().filter(|p| p.iter().all(|value| *value > 0.99)).count() as f64 / film.len() as f64;
        assert!(flat < 0.001, "{scene}: {flat} of the picture is clipped");
    }
}

#[test]
fn a_campfire_flickers_as_fires_do() {
    let frames: Vec<i64> = (0..120).collect();
    let film = Film::of("campfire", [96, 54], &frames, &SceneOptions::default());
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
    let text = "bansho = 2\n[picture]\nsize = [144, 144]\n[camera]\nposition = [0, 0.85, 4]\ntarget = [0, 0.85, 0]\n\
                [[flame_sheet]]\nwidth = 1.1\nheight = 1.7\nwind_response = 0\nshape = { eddies = 0 }\n";
    let film = Film::of_text(text, [144, 144], &frames, &SceneOptions::default());
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
            "bansho = 2\n[picture]\nsize = [160, 120]\n[wind]\nvelocity = [{speed}, 0, 0]\ngust = 0\n[[flame_sheet]]\n"
        );
        let film = Film::of_text(&text, [160, 120], &[0, 15, 30, 45, 60], &SceneOptions::default());
        film.centroid_of_upper_half()[0] - 80.0
    };
    let [left, still, right, strong] = [-1.0, 0.0, 1.0, 2.5].map(lean);
    assert!(still.abs() < 4.0, "still: {still}");
    assert!(left < still - 1.0 && right > still + 1.0 && strong > right + 1.0, "{left} {still} {right} {strong}");
}

#[test]
fn last_and_first_frame_of_a_loop_differ_no_more_than_the_median_pair() {
    let scenes = ["candle", "campfire", "hearth", "drizzle", "inagaki_still"];
    for (scene, text) in scenes.map(|scene| (scene, scene_text(scene))) {
        seam_is_calm(scene, &text);
    }
    let few = scene_text("quiet_arc").replace("thickness_km", "particles = { count = 8000 }\nthickness_km");
    seam_is_calm("quiet_arc", &few);
}

fn seam_is_calm(scene: &str, text: &str) {
    let text = text.replace("fps = 60", "fps = 30");
    let options = SceneOptions { loop_s: Some(2.0), ..SceneOptions::default() };
    let frames: Vec<i64> = (0..60).collect();
    let film = Film::of_text(&text, [128, 72], &frames, &options);
    let mut steps: Vec<f64> = (0..59).map(|frame| film.difference(frame, frame + 1)).collect();
    let seam = film.difference(59, 0);
    steps.sort_by(f64::total_cmp);
    assert!(seam <= steps[29], "{scene}: last to first {seam}, median {}", steps[29]);
}

#[test]
fn gradients_show_no_bands() {
    let text = scene_text("campfire");
    // Without dither it would be 0.009.
    let bands = wide_bands(&text, [1280, 720], 60);
    assert!(bands < 0.002, "{bands} of the gradient's length lies in bands wider than 8 pixels");
}

#[test]
fn the_papers_stages_follow_from_each_other() {
    let stage = |name: &str| {
        let text = scene_text("ohshima_itahashi").replace("stage = \"flame\"", &format!("stage = \"{name}\""));
        Film::of_text(&text, [256, 256], &[0], &SceneOptions::default())
    };
    let [texture, thresholded, sharpened, colored] = ["texture", "thresholded", "sharpened", "colored"].map(stage);
    let lit = |film: &Film| film.pixels().filter(|pixel| luminance(**pixel) > 0.01).count() as f64 / film.len() as f64;
    assert!(lit(&texture) > 0.9, "the texture has no flat parts: {}", lit(&texture));
    assert!(lit(&thresholded) < 0.8 * lit(&texture));
    assert!((lit(&sharpened) / lit(&thresholded) - 1.0).abs() < 0.25, "sharpening moves no edge far");
    assert!(sharpened.mean(0) > thresholded.mean(0), "sharpening raises what is above the threshold");
    let grey = |film: &Film| film.pixels().all(|p| (p[0] - p[1]).abs() < 0.02 && (p[1] - p[2]).abs() < 0.02);
    assert!(grey(&texture) && grey(&thresholded) && grey(&sharpened) && !grey(&colored));
}
