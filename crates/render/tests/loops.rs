//! Seamless loops, of closed forms and of what is stepped.

#[allow(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::sync::Arc;

use bansho_base::{assets::MemoryAssets, image::Frame, observer::Unobserved};
use bansho_render::{Plan, PlanOptions};
use support::*;

/// A shaken lamp that travels while a turn of one second, 24 frames, passes; all of it is dissolve.
const TRAVELLER: &str =
    "[[emitter]]\nposition = [-1.6, 0, -2]\nvelocity = [1.6, 0, 0]\nshake = 3\nradius = 0.4\npreroll_s = 0.1\n";

fn turn() -> PlanOptions {
    PlanOptions { loop_s: Some(1.0), ..PlanOptions::default() }
}

fn looped(text: &str) -> Arc<Plan> {
    plan(&format!("{CAMERA}{text}"), &turn())
}

fn frames(plan: &Arc<Plan>, numbers: impl Iterator<Item = i64>) -> Vec<Frame> {
    let mut shot = open(plan);
    numbers.map(|number| draw(shot.as_mut(), number)).collect()
}

fn light(frame: &Frame) -> f64 {
    frame.beauty.pixels().iter().map(|pixel| f64::from(pixel[1])).sum()
}

fn difference(a: &Frame, b: &Frame) -> f64 {
    a.beauty.pixels().iter().zip(b.beauty.pixels()).map(|(a, b)| f64::from((a[1] - b[1]).abs())).sum()
}

#[test]
fn a_loop_comes_back_and_refuses_what_jumps() {
    let looped = looped(TRAVELLER);
    assert_eq!(looped.frames(), 0..24);
    assert_eq!(looped.time(24), looped.time(0));
    let keyed = |last: u32| {
        let text = format!(
            "{CAMERA}[wind]\nvelocity = {{ keys = [[0, [0, 0, 0]], [0.5, [9, 0, 0]], [1, [{last}, 0, 0]]] }}\n"
        );
        Plan::new(parse(&text, &MemoryAssets::default()).unwrap(), &turn(), Arc::new(MemoryAssets::default()))
    };
    let error = keyed(3).err().unwrap();
    assert!(error.to_string().contains("wind.velocity"), "{error}");
    let wind = keyed(0).unwrap().wind;
    assert_eq!(wind.mean(0.25), wind.mean(-1.75), "what is keyed repeats");
}

#[test]
fn what_is_stepped_dissolves_into_its_next_run_without_a_jump() {
    let film = frames(&looped(TRAVELLER), 0..24);
    for (number, frame) in film.iter().enumerate() {
        assert!((light(frame) / light(&film[12]) - 1.0).abs() < 0.03, "the light of frame {number} is kept");
    }
    let mut steps: Vec<f64> = film.windows(2).map(|pair| difference(&pair[0], &pair[1])).collect();
    let seam = difference(&film[23], &film[0]);
    steps.sort_by(f64::total_cmp);
    assert!(seam <= 1.1 * steps[11], "the seam {seam} beside {steps:?}");
    // The first frame shows the lamp where it begins and, as bright, where it ends: 36 pixels apart.
    let columns = |from: usize| -> f64 {
        let column = |x: usize| (0..90).map(|y| luminance(&film[0], x, y)).sum::<f64>();
        (from..from + 60).map(column).sum()
    };
    assert!((columns(0) / columns(60) - 1.0).abs() < 0.15, "{} {}", columns(0), columns(60));
}

#[test]
fn frames_of_a_loop_alone_from_snapshots_or_of_a_later_turn_are_those_of_the_whole() {
    let looped = looped(TRAVELLER);
    let film = frames(&looped, 0..24);
    for number in [0, 2, 11, 13, 22] {
        assert_eq!(frames(&looped, [number].into_iter())[0], film[number as usize], "frame {number} alone");
        let mut shot = open(&looped);
        shot.advance(number, &Unobserved).unwrap();
        let snapshot = shot.snapshot();
        let mut fresh = open(&looped);
        fresh.restore(&snapshot).unwrap();
        assert_eq!(draw(fresh.as_mut(), 23), film[23], "from the state at frame {number}");
    }
    let mut shot = open(&looped);
    assert_eq!(draw(shot.as_mut(), 23), film[23]);
    assert_eq!(draw(shot.as_mut(), 24 + 3).beauty, film[3].beauty, "the turn begins again");
}
