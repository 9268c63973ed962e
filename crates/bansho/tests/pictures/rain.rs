//! Rain.

use std::ops::Range;

use bansho::SceneOptions;

use crate::{
    SMALL,
    looks::{Film, luminance, scene_text},
};

/// A street lamp in the rain, seen from a distance, before nothing but sky and ground.
const LAMP_IN_THE_DARK: &str = r#"
bansho = 2

[picture]
size = [1280, 720]
frames = 240
fps = 30
exposure_ev100 = 1.6

[camera]
position = [1.2, 1.5, 9.8]
target = [0.3, 2.35, 0.0]
vertical_fov_deg = 38.0

[wind]
velocity = [0.9, 0.0, 0.3]
gust = 0.4

[sky]
luminance = 0.06
hills_deg = 1.5
trees_deg = 4.5
hills_distance = 80.0
temperature_k = 9000.0

[ground]
color = [0.045, 0.046, 0.05]
texture = 0.4
texture_size = 0.6
wetness = 1.0
puddles = 0.15
roughness = 0.09

[[light]]
kind = "spot"
visible = true
position = [0.0, 5.2, 0.0]
direction = [0.0, -1.0, 0.0]
color = [1.0, 0.82, 0.55]
intensity = 2500.0
radius = 0.04
inner_cone_deg = 40.0
outer_cone_deg = 78.0

[[rain]]
rate_mm_per_h = 20.0
distance = 14.0
"#;

/// Mean luminance of a part of a film's first frame.
fn mean(film: &Film, rows: Range<usize>, columns: Range<usize>) -> f64 {
    film.mean_over(rows, columns, luminance)
}

#[test]
fn rain_streaks_are_upright_and_brightest_near_the_lamp() {
    let size = [480, 270];
    let film = Film::of_text(LAMP_IN_THE_DARK, size, &[30], &SceneOptions::default());
    let (mut across, mut down) = (0.0, 0.0);
    for row in 0..190 {
        let (here, below) = (film.row(0, row), film.row(0, row + 1));
        for x in 0..size[0] - 1 {
            across += (luminance(here[x]) - luminance(here[x + 1])).abs();
            down += (luminance(here[x]) - luminance(below[x])).abs();
        }
    }
    assert!(across > 1.3 * down, "across {across}, down {down}");
    // The lamp is in row 25, column 228; the dark region far to its right is not lit by it.
    let (near, far) = (mean(&film, 35..75, 200..260), mean(&film, 35..75, 420..480));
    assert!(near > 2.0 * far, "the lamp's light falls off: {near} {far}");
}

#[test]
fn headlights_light_a_cone_of_rain() {
    let text = scene_text("headlights");
    let dark = text.replace("intensity = 12000.0", "intensity = 0.0");
    assert_ne!(text, dark);
    let [lit, dark] = [text, dark].map(|text| Film::of_text(&text, [480, 270], &[30], &SceneOptions::default()));
    let light = |rows: Range<usize>, columns: Range<usize>| {
        mean(&lit, rows.clone(), columns.clone()) - mean(&dark, rows, columns)
    };
    // The headlights are in row 150, columns 103 and 147, and emit to the right.
    let (beam, above, behind) = (light(130..165, 165..225), light(20..60, 180..240), light(130..165, 0..40));
    assert!(beam > 0.05 && beam > 10.0 * above && beam > 10.0 * behind, "{beam} {above} {behind}");
}

#[test]
fn culling_changes_no_pixel_of_a_scene_by_a_255th() {
    for (scene, text) in [("lamp", LAMP_IN_THE_DARK.to_owned()), ("headlights", scene_text("headlights"))] {
        let text = text.replace("[[rain]]\n", "[[rain]]\nsimplification_codes = 0.0\n");
        let all = text.replace("[[rain]]\n", "[[rain]]\nculling = false\n");
        assert_ne!(text, all);
        let [culled, all] = [text, all].map(|text| Film::of_text(&text, SMALL, &[30], &SceneOptions::default()));
        let pairs = culled.pixels().flatten().zip(all.pixels().flatten());
        let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst <= 1.0 / 255.0, "{scene}: {worst}");
    }
}

#[test]
fn a_downpour_dims_the_far_more_than_the_near_and_leaves_the_sky() {
    let text = scene_text("downpour_day");
    let dry = text.replace("rate_mm_per_h = 60.0", "rate_mm_per_h = 0.0");
    assert_ne!(text, dry);
    let [wet, dry] = [text, dry].map(|text| Film::of_text(&text, [240, 135], &[30], &SceneOptions::default()));
    let change = |rows: Range<usize>, columns: Range<usize>| {
        mean(&wet, rows.clone(), columns.clone()) / mean(&dry, rows, columns) - 1.0
    };
    // Dark trees 17 to 32 m away, the path 5 to 7 m away, and the sky at its end.
    let (trees, path, sky) = (change(40..60, 90..110), change(105..131, 94..131), change(60..68, 116..124));
    assert!(trees > 0.05 && trees > 2.0 * path.abs() && sky.abs() < 0.25, "{trees} {path} {sky}");
}
