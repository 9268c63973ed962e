//! Tests of the traits by two phenomena whose pictures are known in closed form.

use std::sync::{
    Arc,
    atomic::{AtomicUsize, Ordering},
};

use bansho_base::{
    color::{AlphaConvention, View},
    frame::{DisplayPixels, Frame},
    host::observer::{Observer, Unobserved},
    image::Rect,
    math,
};
use bansho_render::{
    PlanOptions, RenderError,
    display::{BitDepth, display},
};

use crate::support::{self, *};

const MIDDLE: (usize, usize) = (60, 45);

fn at_middle(frame: &Frame) -> f64 {
    luminance(frame, MIDDLE.0, MIDDLE.1)
}

fn fogged(depth: f64) -> String {
    format!(
        "{CAMERA}[[absorber]]\nname = \"mist\"\nnear = 1\nfar = 3\nextinction = [0.7, 0.7, 0.7]\n\
         [[emitter]]\nname = \"lamp\"\nposition = [0, 0, -{depth}]\nradius = 0.5\n"
    )
}

#[test]
fn fog_dims_a_lamp_by_beers_law_wherever_it_stands() {
    for (depth, in_fog) in [(0.8_f64, 0.0), (1.5, 0.5), (2.75, 1.75), (5.0, 2.0)] {
        let frame = render(&fogged(depth), &PlanOptions::default(), 0);
        let expected = 100.0 * math::exp(-0.7 * in_fog);
        let seen = at_middle(&frame);
        assert!((seen / expected - 1.0).abs() < 1e-5, "lamp at {depth} m: {seen}, expected {expected}");
        let alpha = f64::from(frame.beauty.at(0, 0)[3]);
        assert!((alpha - (1.0 - math::exp(-1.4))).abs() < 1e-6, "alpha of the fog alone: {alpha}");
        let nearest = frame.depth.as_ref().unwrap()[MIDDLE.1 * 120 + MIDDLE.0];
        assert!((f64::from(nearest) - depth.min(1.0)).abs() < 1e-6);
    }
}

#[test]
fn frames_carry_metadata_if_requested() {
    let options = PlanOptions { metadata: true, ..PlanOptions::default() };
    let frame = render(&fogged(2.5), &options, 0);
    // The fog has none.
    let [lamp] = &frame.metadata[..] else { panic!("{:?}", frame.metadata) };
    assert_eq!((lamp.phenomenon.as_str(), lamp.entries.len()), ("lamp", 1));
    assert_eq!((lamp.entries[0].name, lamp.entries[0].unit, lamp.entries[0].value), ("depth", "m", 2.5));
    assert!(render(&fogged(2.5), &PlanOptions::default(), 0).metadata.is_empty());
}

#[test]
fn layers_and_aovs_come_to_the_beauty() {
    let options = PlanOptions { layers: true, aovs: true, ..PlanOptions::default() };
    let frame = render(&fogged(2.0), &options, 0);
    for (c, suffix) in ["R", "G", "B", "A"].iter().enumerate() {
        let (fog, lamp) = (channel(&frame, &format!("mist.{suffix}")), channel(&frame, &format!("lamp.{suffix}")));
        for (index, pixel) in frame.beauty.pixels().iter().enumerate() {
            assert!((fog[index] + lamp[index] - pixel[c]).abs() < 1e-6 * (1.0 + pixel[c].abs()));
        }
    }
    assert!(channel(&frame, "mist.optical_depth").iter().all(|depth| (depth - 1.4).abs() < 1e-6));
}

#[test]
fn a_lamp_twice_as_bright_lights_the_fog_twice() {
    let glow = |luminance: f64| {
        let text = format!(
            "{CAMERA}[[absorber]]\nscatter = 0.1\n[[emitter]]\nposition = [1, 0, -2]\nluminance = {luminance}\n"
        );
        let frame = render(&text, &PlanOptions::default(), 0);
        support::luminance(&frame, 10, 45)
    };
    assert!(glow(100.0) > 0.0);
    assert!((glow(200.0) / glow(100.0) - 2.0).abs() < 1e-5);
}

#[test]
fn the_scenes_own_lights_reach_phenomena_too() {
    let text = format!("{CAMERA}[[light]]\nposition = [0, 1, -2]\n[[absorber]]\nscatter = 0.1\n");
    assert!(at_middle(&render(&text, &PlanOptions::default(), 0)) > 0.0);
}

#[test]
fn a_plate_through_an_empty_scene_is_unchanged_to_the_byte() {
    let assets = checkerboard(120, 90, None);
    let codes: Vec<[u8; 4]> = {
        use bansho_base::host::assets::Assets;
        let picture = assets.picture("plate.png", 0).unwrap();
        picture.color.iter().map(|p| p.map(|value| (value * 255.0).round() as u8)).collect()
    };
    let text = format!("{CAMERA}[plate]\nimage = \"plate.png\"\n");
    let plan = plan_with(&text, &PlanOptions::default(), Arc::new(assets));
    let frame = draw(&mut plan.open(), 0);
    assert!(frame.opaque);
    let DisplayPixels::Eight(shown) = display(&frame, &View::DISPLAY, BitDepth::Eight, AlphaConvention::Encoded).pixels
    else {
        panic!()
    };
    assert!(shown == codes, "a plate's codes changed");
}

#[test]
fn the_plates_depth_hides_what_stands_behind_it() {
    let shown = |depth: f64| {
        let text = format!("{CAMERA}[plate]\nimage = \"plate.png\"\n[[emitter]]\nposition = [0, 0, -{depth}]\n");
        let plan = plan_with(&text, &PlanOptions::default(), Arc::new(checkerboard(120, 90, Some(3.0))));
        draw(&mut plan.open(), 0)
    };
    let (before, behind) = (shown(2.9), shown(3.1));
    let empty = shown(9.0);
    assert_eq!(behind.beauty, empty.beauty);
    assert!(at_middle(&before) > at_middle(&empty) + 99.0);
}

#[test]
fn a_moving_lamp_leaves_a_streak_of_the_same_light_around_the_middle_of_the_exposure() {
    let text = |speed: f64| {
        format!("{CAMERA}[[emitter]]\nposition = [-0.5, 0, -1]\nvelocity = [{speed}, 0, 0]\nradius = 0.05\n")
    };
    let moments = |frame: &Frame| {
        let (mut light, mut first) = (0.0, 0.0);
        for y in 0..90 {
            for x in 0..120 {
                light += luminance(frame, x, y);
                first += luminance(frame, x, y) * (x as f64 + 0.5);
            }
        }
        (light, first / light)
    };
    let (still_light, _) = moments(&render(&text(0.0), &PlanOptions::default(), 6));
    let (light, center) = moments(&render(&text(2.0), &PlanOptions::default(), 6));
    // Half a frame open from t = 0.25 s: the middle is at 0.25 + 1/96 s, 45 pixels a meter.
    let expected = 60.0 + 45.0 * (-0.5 + 2.0 * (0.25 + 1.0 / 96.0));
    assert!((light / still_light - 1.0).abs() < 0.05, "{light} {still_light}");
    assert!((center - expected).abs() < 0.5, "{center} {expected}");
}

const SHAKEN: &str = "[[emitter]]\nname = \"lamp\"\nshake = 3\nacceleration = [0, -1, 0]\npreroll_s = 0.5\n";

#[test]
fn the_state_does_not_depend_on_the_frame_rate_and_any_frame_can_be_drawn_alone() {
    let at_two_seconds = |fps: i64| {
        let text = format!("{CAMERA}{SHAKEN}").replace("fps = 24", &format!("fps = {fps}"));
        let text = text.replace("[camera]", "[camera]\nshutter_s = 0.01\nshutter_offset_s = -0.005");
        let plan = plan(&text, &PlanOptions::default());
        let mut shot = plan.open();
        let alone = draw(&mut shot, 2 * fps);
        let forward: Vec<Frame> = (0..=2 * fps).map(|number| draw(&mut shot, number)).collect();
        assert_eq!(forward.last(), Some(&alone), "drawn alone or after the others");
        alone.beauty
    };
    assert_eq!(at_two_seconds(24), at_two_seconds(60));
}

#[test]
fn snapshots_restore_to_the_byte_and_refuse_what_is_damaged_or_foreign() {
    let text = format!("{CAMERA}{SHAKEN}");
    let plan = plan(&text, &PlanOptions::default());
    let mut shot = plan.open();
    shot.advance(10, &Unobserved).unwrap();
    let snapshot = shot.snapshot();
    let whole = draw(&mut shot, 20);

    let mut fresh = plan.open();
    fresh.restore(&snapshot).unwrap();
    assert_eq!(draw(&mut fresh, 20), whole);

    for damage in [0, 8, 9, 30, snapshot.len() / 2, snapshot.len() - 1] {
        let mut damaged = snapshot.clone();
        damaged[damage] ^= 1;
        assert!(fresh.restore(&damaged).is_err(), "byte {damage}");
    }
    assert!(fresh.restore(&snapshot[..snapshot.len() - 1]).is_err());
    assert!(fresh.restore(&[]).is_err());
    assert_eq!(draw(&mut fresh, 20), whole, "a refused snapshot changes nothing");

    let foreign = support::plan(&text.replace("shake = 3", "shake = 4"), &PlanOptions::default());
    assert_eq!(foreign.open().restore(&snapshot), Err(RenderError::ForeignSnapshot));
    let brighter = support::plan(&text.replace("exposure_ev100 = 0", "exposure_ev100 = 3"), &PlanOptions::default());
    assert_eq!(brighter.open().restore(&snapshot), Ok(()), "exposure does not matter to the state");
}

#[test]
fn a_new_plan_goes_on_from_the_state_and_says_whether_it_is_the_plans_own() {
    let text = format!("{CAMERA}{SHAKEN}");
    let changed = |from: &str, to: &str| support::plan(&text.replace(from, to), &PlanOptions::default());
    let (own, brighter, shaken_more) = (
        changed("shake", "shake"),
        changed("exposure_ev100 = 0", "exposure_ev100 = 3"),
        changed("shake = 3", "shake = 4"),
    );
    let mut shot = own.open();
    shot.advance(10, &Unobserved).unwrap();

    shot.replan(brighter.compiled.clone(), brighter.plan.clone());
    assert!(shot.is_exact(), "exposure does not matter to the state");
    assert_eq!(draw(&mut shot, 20), draw(&mut brighter.open(), 20));

    shot.replan(shaken_more.compiled.clone(), shaken_more.plan.clone());
    assert!(!shot.is_exact());
    let carried = draw(&mut shot, 21);
    assert_ne!(carried, draw(&mut shaken_more.open(), 21));
    assert_eq!(draw(&mut shot, 5), draw(&mut shaken_more.open(), 5), "the past is drawn from the beginning");
    assert!(shot.is_exact());
}

#[test]
fn one_thread_and_many_draw_the_same() {
    let draw_with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let options = PlanOptions { layers: true, aovs: true, ..PlanOptions::default() };
        pool.install(|| render(&fogged(2.0), &options, 3))
    };
    assert_eq!(draw_with(1), draw_with(4));
}

#[test]
fn a_crop_is_the_same_part_of_the_whole_with_and_without_bent_light() {
    let crop = Rect { x: 37, y: 21, width: 50, height: 41 };
    for bend in ["", "bend = 0.1\n"] {
        let text = format!("{}{bend}", fogged(2.0)) + "[plate]\nimage = \"plate.png\"\n";
        let drawn = |crop: Option<Rect>| {
            let options = PlanOptions { layers: true, aovs: true, crop, ..PlanOptions::default() };
            let plan = plan_with(&text, &options, Arc::new(checkerboard(120, 90, Some(8.0))));
            draw(&mut plan.open(), 1)
        };
        let (whole, part) = (drawn(None), drawn(Some(crop)));
        assert_eq!(part.beauty, whole.beauty.crop(crop).unwrap(), "{bend}");
        let row =
            |frame: &Frame, y: usize, x: usize| channel(frame, "mist.optical_depth")[y * frame.beauty.width() + x];
        assert_eq!(row(&part, 3, 5), row(&whole, 24, 42));
        let pixels =
            |frame: &Frame| match display(frame, &View::DISPLAY, BitDepth::Eight, AlphaConvention::Encoded).pixels {
                DisplayPixels::Eight(pixels) => pixels,
                DisplayPixels::Sixteen(_) => panic!("8 bits were asked for"),
            };
        assert_eq!(pixels(&part)[0], pixels(&whole)[21 * 120 + 37], "dither goes by the whole picture");
    }
}

#[test]
fn bent_light_displaces_the_plate_around_the_lamp_and_nowhere_else() {
    let drawn = |bend: f64| {
        let text = format!(
            "{CAMERA}[plate]\nimage = \"plate.png\"\n[[emitter]]\nradius = 0.2\nluminance = 0\nbend = {bend}\n"
        );
        let plan = plan_with(&text, &PlanOptions::default(), Arc::new(checkerboard(120, 90, None)));
        draw(&mut plan.open(), 0)
    };
    let (straight, bent) = (drawn(0.0), drawn(0.1));
    // 0.1 rad at 45 pixels per radian: the light comes from 4.5 pixels to the right.
    let between = |x: usize| 0.5 * (straight.beauty.at(x, 45)[0] + straight.beauty.at(x + 1, 45)[0]);
    for x in 56..64 {
        assert!((bent.beauty.at(x, 45)[0] - between(x + 4)).abs() < 1e-4, "{x}");
    }
    for (index, (a, b)) in straight.beauty.pixels().iter().zip(bent.beauty.pixels()).enumerate() {
        let (dx, dy) = ((index % 120) as f64 + 0.5 - 60.0, (index / 120) as f64 + 0.5 - 45.0);
        // The field reaches two radii: 2 * 0.2 m * 22.5 pixels a meter.
        assert!(a == b || math::hypot(dx, dy) < 9.5, "pixel {index} moved");
    }
}

#[test]
fn only_what_lies_behind_the_air_is_displaced_and_nothing_nearer_gets_into_it() {
    let drawn = |bend: f64| {
        let text = format!(
            "{CAMERA}[plate]\nimage = \"plate.png\"\n[[emitter]]\nradius = 0.2\nluminance = 0\nbend = {bend}\n"
        );
        // The air is 2 m away: the left half of the plate is in front of it, the right half behind.
        let depth = (0..120 * 90).map(|index| if index % 120 < 60 { 1.0 } else { 8.0 }).collect();
        let plan = plan_with(&text, &PlanOptions::default(), Arc::new(checkerboard_at(120, 90, Some(depth))));
        draw(&mut plan.open(), 0)
    };
    let straight = drawn(0.0);
    let [right, left] = [0.1, -0.1].map(drawn);
    for x in 0..60 {
        assert_eq!(right.beauty.at(x, 45), straight.beauty.at(x, 45), "{x} is nearer");
        assert_eq!(left.beauty.at(x, 45), straight.beauty.at(x, 45), "{x} is nearer");
    }
    // 0.1 rad at 45 pixels a radian, of which six eighths are left: 3.375 pixels.
    let between = |x: usize, share: f32| {
        let [a, b] = [x, x + 1].map(|x| straight.beauty.at(x, 45)[0]);
        a + share * (b - a)
    };
    for x in 60..64 {
        assert!((right.beauty.at(x, 45)[0] - between(x + 3, 0.375)).abs() < 1e-4, "{x}");
    }
    assert!((left.beauty.at(64, 45)[0] - between(60, 0.625)).abs() < 1e-4);
    for x in 60..63 {
        assert_eq!(left.beauty.at(x, 45), straight.beauty.at(x, 45), "{x} would see what is nearer");
    }
}

#[test]
fn layers_come_to_the_beauty_behind_several_bends() {
    let lamp = |name: &str, depth: f64| {
        format!("[[emitter]]\nname = \"{name}\"\nposition = [0, 0, -{depth}]\nradius = 0.3\nbend = 0.05\n")
    };
    let fog = "[[absorber]]\nname = \"mist\"\nnear = 1\nfar = 6\nextinction = [0.1, 0.2, 0.3]\n";
    let text = format!("{CAMERA}[plate]\nimage = \"plate.png\"\n{fog}{}{}", lamp("near", 2.0), lamp("far", 4.0));
    let options = PlanOptions { layers: true, ..PlanOptions::default() };
    let plan = plan_with(&text, &options, Arc::new(checkerboard(120, 90, Some(8.0))));
    let frame = draw(&mut plan.open(), 1);
    for (c, suffix) in ["R", "G", "B"].into_iter().enumerate() {
        let layers: Vec<&[f32]> =
            ["mist", "near", "far", "plate"].map(|layer| channel(&frame, &format!("{layer}.{suffix}"))).into();
        for (index, pixel) in frame.beauty.pixels().iter().enumerate() {
            let sum: f32 = layers.iter().map(|layer| layer[index]).sum();
            assert!((sum - pixel[c]).abs() < 1e-4 * pixel[c].max(1.0), "{suffix} of {index}: {sum} {}", pixel[c]);
        }
    }
}

#[test]
fn work_stops_when_the_observer_asks() {
    struct After(AtomicUsize);
    impl Observer for After {
        fn cancelled(&self) -> bool {
            self.0.fetch_add(1, Ordering::Relaxed) >= 3
        }
    }
    let plan = plan(&format!("{CAMERA}{SHAKEN}"), &PlanOptions::default());
    let mut shot = plan.open();
    let stopped = shot.advance(1000, &After(AtomicUsize::new(0)));
    assert!(matches!(stopped, Err(RenderError::Cancelled(_))));
    let mut fresh = plan.open();
    assert_eq!(draw(&mut shot, 4), draw(&mut fresh, 4), "a stopped shot goes on");
}

/// Center of the light, pixels.
fn brightest(frame: &Frame) -> [f64; 2] {
    let (mut sum, mut place) = (0.0, [0.0; 2]);
    for y in 0..frame.beauty.height() {
        for x in 0..frame.beauty.width() {
            let light = luminance(frame, x, y);
            sum += light;
            place[0] += light * (x as f64 + 0.5);
            place[1] += light * (y as f64 + 0.5);
        }
    }
    place.map(|coordinate| coordinate / sum)
}

#[test]
fn domes_and_panoramas_show_the_lamp_where_it_stands() {
    let dome = CAMERA.replace("target = [0, 0, -1]", "target = [0, 1, 0]\nlens = \"fisheye\"");
    let text = format!("{dome}[[emitter]]\nposition = [1, 1, 0]\nradius = 0.1\n");
    let frame = render(&text, &PlanOptions::default(), 0);
    // 45 degrees from the zenith on a circle of 45 pixels for 90 degrees; east is left, as on a star chart.
    let lit = brightest(&frame);
    assert!((lit[0] - (60.0 - 22.5)).abs() < 0.6 && (lit[1] - 45.0).abs() < 0.6, "{lit:?}");

    let panorama =
        CAMERA.replace("size = [120, 90]", "size = [180, 90]").replace("[camera]", "[camera]\nlens = \"panorama\"");
    let frame = render(&format!("{panorama}[[emitter]]\nposition = [2, 0, 0]\n"), &PlanOptions::default(), 0);
    // 90 degrees to the right of the middle: 45 of 180 pixels.
    let lit = brightest(&frame);
    assert!((lit[0] - 135.0).abs() < 0.6 && (lit[1] - 45.0).abs() < 0.6, "{lit:?}");
}

#[test]
fn overscan_adds_pixels_around_the_same_picture() {
    let text = fogged(2.0);
    let plain = render(&text, &PlanOptions::default(), 0);
    let wide = render(
        &text.replace("[picture]", "[picture]\noverscan = 10"),
        &PlanOptions { overscan: true, ..PlanOptions::default() },
        0,
    );
    assert_eq!((wide.beauty.width(), wide.beauty.height()), (140, 110));
    assert_eq!(wide.header.data_origin, [-10, -10]);
    let inner = wide.beauty.crop(Rect { x: 10, y: 10, width: 120, height: 90 }).unwrap();
    assert_eq!(inner, plain.beauty);
}
