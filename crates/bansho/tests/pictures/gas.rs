//! The particle flame.

use bansho::SceneOptions;

use crate::looks::{Film, hues, luminance, mean_luminances, scene_text};

/// A scene's flame in wind of `speed` m/s, twelve frames of it.
fn gas_in_wind(scene: &str, speed: f64) -> Film {
    let text = scene_text(scene).replace(
        "[[flame_particles]]",
        &format!("[wind]\nvelocity = [{speed:?}, 0, 0]\ngust = 0\n[[flame_particles]]"),
    );
    let frames: Vec<i64> = (1..=12).map(|index| 10 * index).collect();
    Film::of_text(&text, [160, 90], &frames, &SceneOptions::default())
}

#[test]
fn wind_bends_burning_gas_and_more_wind_bends_it_more() {
    let lean = |speed: f64| gas_in_wind("inagaki_still", speed).centroid_of_upper_half()[0] - 80.0;
    let [left, still, right, strong] = [-0.5, 0.0, 0.5, 1.2].map(lean);
    assert!(still.abs() < 6.0, "still: {still}");
    assert!(left < still - 2.0 && right > still + 2.0 && strong > right + 2.0, "{left} {still} {right} {strong}");
}

#[test]
fn the_papers_own_wind_bends_the_papers_own_gas() {
    let lean = |speed: f64| gas_in_wind("inagaki_paper", speed).centroid_of_upper_half()[0] - 80.0;
    let [left, still, right] = [-0.5, 0.0, 0.5].map(lean);
    assert!(still.abs() < 6.0 && left < still - 2.0 && right > still + 2.0, "{left} {still} {right}");
}

#[test]
fn a_scene_begins_with_a_developed_flame() {
    let text = scene_text("inagaki_still");
    let frames: Vec<i64> = (0..8).map(|index| 15 * index).collect();
    let light = mean_luminances(&text, [80, 45], &frames);
    let usual = light[1..].iter().sum::<f64>() / (light.len() - 1) as f64;
    assert!((0.5..1.7).contains(&(light[0] / usual)), "{} in the first frame, {usual} later", light[0]);
    let cold = text.replace("particles = 3000", "particles = 3000\npreroll_s = 0.0");
    let begins = mean_luminances(&cold, [80, 45], &[0])[0];
    assert!(begins < 0.05 * usual, "without a preroll it begins with {begins} of {usual}");
}

#[test]
fn burning_gas_has_sharp_rims_bright_cores_and_gaps() {
    let text = scene_text("inagaki_still");
    let film = Film::of_text(&text, [640, 360], &[20, 60], &SceneOptions::default());
    let smooth = Film::of_text(
        &format!("{text}[flame_particles.rendering]\ndetail = 0\n"),
        [640, 360],
        &[20, 60],
        &SceneOptions::default(),
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
    let draw = |text: &str| Film::of_text(text, [320, 180], &[40], &SceneOptions::default());
    let (bent, straight) = (draw(&text), draw(&text.replace("heat_haze_gain = 14.0", "heat_haze_gain = 0.0")));
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
    // Without haze the flame only adds its light to the plate, which is not displaced.
    let bare = draw(&text.replace("diameter = 0.22", "diameter = 0.22\nflow = 0.0"));
    let darker = |(x, row): (usize, usize)| luminance(bare.row(0, row)[x]) - luminance(straight.row(0, row)[x]) > 0.02;
    let displaced = (0..180).flat_map(|row| (0..320).map(move |x| (x, row))).filter(|place| darker(*place)).count();
    assert_eq!(displaced, 0, "pixels of the plate are darker with the flame and without haze");
}
