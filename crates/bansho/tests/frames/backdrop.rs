//! Sky, ground and lamps.

use bansho_base::image::Rect;
use bansho_render::PlanOptions;

use crate::support::*;

/// A camera 1 m above the ground that looks level at a lamp 4 m away, 1 m above the ground too.
const LAKE: &str = "bansho = 2\n[picture]\nsize = [120, 90]\nexposure_ev100 = 0\n[camera]\nposition = [0, 1, 0]\ntarget = [0, 1, -1]\n\
                    vertical_fov_deg = 60\n[[emitter]]\nposition = [0, 2, -4]\nradius = 0.4\n";

fn lit(frame: &bansho_base::frame::Frame, rows: std::ops::Range<usize>) -> f64 {
    rows.flat_map(|y| (0..120).map(move |x| (x, y))).map(|(x, y)| luminance(frame, x, y)).sum()
}

#[test]
fn still_water_shows_a_lamp_as_far_below_the_horizon_as_it_stands_above() {
    let frame = render(&format!("{LAKE}[ground]\nkind = \"water\"\nwaves = 0\n"), &PlanOptions::default(), 0);
    let center = |rows: std::ops::Range<usize>| {
        let total = lit(&frame, rows.clone());
        rows.map(|y| y as f64 * lit(&frame, y..y + 1)).sum::<f64>() / total
    };
    // The lamp is 1 m above the camera, its image 3 m below it, both 4 m away; a meter there is 77.9 / 4 pixels.
    let meter = 45.0 / bansho_base::math::tan(std::f64::consts::PI / 6.0) / 4.0;
    assert!((44.5 - center(0..45) - meter).abs() < 0.3, "{}", center(0..45));
    assert!(lit(&frame, 0..45) > 0.0);
    let low = render(
        &format!("{LAKE}[ground]\nkind = \"water\"\nwaves = 0\n").replace("[0, 2, -4]", "[0, 1.2, -8]"),
        &PlanOptions::default(),
        0,
    );
    let below = (50..90).max_by(|&a, &b| luminance(&low, 60, a).total_cmp(&luminance(&low, 60, b))).unwrap();
    // 2.2 m below the camera at 8 m.
    assert!((below as f64 - (44.5 + 2.2 * meter / 2.0)).abs() < 4.5, "{below}");
}

#[test]
fn dry_land_needs_no_second_picture_and_hides_what_is_below_it() {
    let sunk = LAKE.replace("[0, 2, -4]", "[0, -0.5, -4]");
    let frame = render(&format!("{sunk}[ground]\n"), &PlanOptions::default(), 0);
    let bare = render(&sunk, &PlanOptions::default(), 0);
    assert!(lit(&bare, 45..90) > 0.0);
    assert!(lit(&frame, 45..90) < 1e-3 * lit(&bare, 45..90));
}

#[test]
fn a_crop_of_a_lake_is_that_part_of_the_whole_to_the_byte() {
    let text = format!("{LAKE}[sky]\nluminance = 3\n[ground]\nkind = \"water\"\n");
    let whole = render(&text, &PlanOptions::default(), 3);
    let crop = Rect { x: 31, y: 40, width: 50, height: 37 };
    let part = render(&text, &PlanOptions { crop: Some(crop), ..PlanOptions::default() }, 3);
    assert_eq!(Some(part.beauty), whole.beauty.crop(crop));
}

#[test]
fn a_sky_stands_behind_everything_and_before_nothing() {
    let text = format!("{LAKE}[sky]\nluminance = 3\n");
    let frame = render(&text, &PlanOptions::default(), 0);
    assert!(frame.beauty.pixels().iter().all(|pixel| pixel[3] == 1.0));
    let lamp = render(LAKE, &PlanOptions::default(), 0);
    assert!(luminance(&frame, 60, 25) > luminance(&lamp, 60, 25));
    let unseen = render(&format!("{text}visible = false\n"), &PlanOptions::default(), 0);
    assert_eq!(unseen.beauty, lamp.beauty);
}

#[test]
fn lamps_are_seen_where_they_say_so() {
    let lamp = "[[light]]\nposition = [0, 1, -4]\nradius = 0.2\n";
    let hidden = render(&format!("{LAKE}{lamp}"), &PlanOptions::default(), 0);
    let seen = render(&format!("{LAKE}{lamp}visible = true\n"), &PlanOptions::default(), 0);
    assert_eq!(luminance(&hidden, 60, 45), 0.0);
    // 100 cd from a ball of 0.2 m: 100 / (pi 0.04) cd/m^2.
    let expected = 100.0 / (std::f64::consts::PI * 0.04);
    assert!((luminance(&seen, 60, 45) / expected - 1.0).abs() < 0.02, "{}", luminance(&seen, 60, 45));
}
