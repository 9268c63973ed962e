//! Rain.

use std::ops::Range;

use bansho::SceneOptions;

use crate::{
    SMALL,
    looks::{Film, luminance, scene_text},
};

/// Mean luminance of a part of a film's first frame.
fn mean(film: &Film, rows: Range<usize>, columns: Range<usize>) -> f64 {
    film.mean_over(rows, columns, luminance)
}

#[test]
fn rain_streaks_are_upright_and_brightest_near_the_lamp() {
    let size = [480, 270];
    let film = Film::of("street_lamp", size, &[30], &SceneOptions::default());
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
    let film = Film::of("headlights", [480, 270], &[30], &SceneOptions::default());
    // The lamps are in row 148, columns 69 and 120, and emit to the right.
    let (beam, above, behind) =
        (mean(&film, 130..165, 130..190), mean(&film, 20..60, 80..140), mean(&film, 130..165, 0..50));
    assert!(beam > 10.0 * above && beam > 10.0 * behind, "{beam} {above} {behind}");
}

#[test]
fn culling_changes_no_pixel_of_a_scene_by_a_255th() {
    for scene in ["street_lamp", "headlights"] {
        let text = scene_text(scene).replace("[[rain]]\n", "[[rain]]\nsimplification_codes = 0.0\n");
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
