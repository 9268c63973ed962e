//! Seamless loops of phenomena in closed form and of stepped phenomena.

use std::sync::Arc;

use bansho::KINDS;
use bansho_base::{
    frame::Frame,
    host::{assets::MemoryAssets, observer::Unobserved},
    parameters::{Kind, TableDescriptor, Value},
};
use bansho_render::PlanOptions;
use bansho_scene::{Scene, SceneOptions};

use crate::support::{self, *};

/// A shaken lamp that travels during a loop of one second, 24 frames, all of which are in the crossfade.
const TRAVELER: &str =
    "[[emitter]]\nposition = [-1.6, 0, -2]\nvelocity = [1.6, 0, 0]\nshake = 3\nradius = 0.4\npreroll_s = 0.1\n";

fn turn() -> SceneOptions {
    SceneOptions { loop_s: Some(1.0), ..SceneOptions::default() }
}

fn looped(text: &str) -> Planned {
    support::looped(&format!("{CAMERA}{text}"), 1.0).unwrap()
}

fn frames(plan: &Planned, numbers: impl Iterator<Item = i64>) -> Vec<Frame> {
    let mut shot = plan.open();
    numbers.map(|number| draw(&mut shot, number)).collect()
}

fn light(frame: &Frame) -> f64 {
    frame.beauty.pixels().iter().map(|pixel| f64::from(pixel[1])).sum()
}

fn difference(a: &Frame, b: &Frame) -> f64 {
    a.beauty.pixels().iter().zip(b.beauty.pixels()).map(|(a, b)| f64::from((a[1] - b[1]).abs())).sum()
}

#[test]
fn a_loop_comes_back_and_refuses_what_jumps() {
    let looped = looped(TRAVELER);
    assert_eq!(looped.frames(), 0..24);
    assert_eq!(looped.time(24), looped.time(0));
    let keyed = |last: u32| {
        let text = format!(
            "{CAMERA}[wind]\nvelocity = {{ keys = [[0, [0, 0, 0]], [0.5, [9, 0, 0]], [1, [{last}, 0, 0]]] }}\n"
        );
        support::looped(&text, 1.0)
    };
    let error = keyed(3).err().unwrap();
    assert!(error.contains("wind.velocity"), "{error}");
    let wind = keyed(0).unwrap().compiled.wind().clone();
    assert_eq!(wind.mean(0.25), wind.mean(-1.75), "what is keyed repeats");
}

/// Every value of a table that can be keyed, as text that keys it from its default to another value and, at 1 s, perhaps back.
fn keyed(table: &TableDescriptor, back: bool) -> Vec<String> {
    table.parameters.iter().flat_map(|own| keyed_value(own.key, &own.kind, own.default.as_ref(), back)).collect()
}

fn keyed_value(key: &str, kind: &Kind, default: Option<&Value>, back: bool) -> Vec<String> {
    match kind {
        Kind::Animated(inner) => {
            let values = two_values(inner, default);
            let last = if back { &values[0] } else { &values[1] };
            vec![format!("{key} = {{ keys = [[0, {}], [0.5, {}], [1, {last}]] }}", values[0], values[1])]
        }
        Kind::Optional(inner) | Kind::Auto(inner) => keyed_value(key, inner, default, back),
        Kind::Table(table) => keyed(table(), back).into_iter().map(|text| format!("{key} = {{ {text} }}")).collect(),
        Kind::List { item, .. } => {
            let Kind::Table(table) = &**item else { return Vec::new() };
            keyed(table(), back).into_iter().map(|text| format!("{key} = [{{ {text} }}]")).collect()
        }
        _ => Vec::new(),
    }
}

/// The default, or the least value, and another.
fn two_values(kind: &Kind, default: Option<&Value>) -> [String; 2] {
    let other =
        |value: f64, min: f64, max: f64| if value + 0.25 <= max { value + 0.25 } else { (value - 0.25).max(min) };
    let number = |value: &Value| if let Value::Number(number) = value { Some(*number) } else { None };
    match kind {
        Kind::Vector { length, min, max } => {
            let own = match default {
                Some(Value::List(items)) => items.iter().filter_map(|item| number(&item.value)).collect(),
                _ => vec![min.max(0.0).min(*max); *length],
            };
            [own.clone(), own.iter().map(|value| other(*value, *min, *max)).collect()]
                .map(|values| format!("{values:?}"))
        }
        Kind::Number { min, max } => {
            let value = default.and_then(number).unwrap_or(min.max(0.0).min(*max));
            [value, other(value, *min, *max)].map(|value| format!("{value:?}"))
        }
        other => panic!("{} is animated; give it two values here", other.expectation()),
    }
}

/// Further keys that are needed for a key to be valid.
fn required_keys(text: &str) -> &'static str {
    // The smallest focal length exceeds the maximum field of view with the default sensor.
    if text.starts_with("focal_length_mm") { "sensor_height_mm = 1.0\n" } else { "" }
}

#[test]
fn whatever_is_keyed_must_end_a_loop_as_it_begins() {
    let plan = |text: &str| -> Result<Planned, String> {
        let scene = Scene::parse("loop", text, KINDS).map_err(|error| error.to_string())?;
        Planned::of(scene, (&turn(), &PlanOptions::default()), Arc::new(MemoryAssets::default()))
    };
    let mut tried = 0;
    for kind in KINDS {
        let (header, table) = (kind.header(), (kind.table)());
        for (open, closed) in keyed(table, false).iter().zip(keyed(table, true)) {
            let [open, closed] = [open.as_str(), closed.as_str()].map(|text| {
                format!("bansho = 2\n[picture]\nsize = [16, 9]\n{header}\n{text}\n{}", required_keys(text))
            });
            if let Err(error) = plan(&closed).map(|_| ()) {
                // A key that needs further keys has an error of its own, which must not be about the loop.
                assert!(!error.contains("is not seamless"), "{closed}{error}");
            }
            let error = plan(&open).map(|_| ()).expect_err(&open);
            assert!(error.contains("the loop of 1 s is not seamless"), "{open}{error}");
            tried += 1;
        }
    }
    assert!(tried >= 14, "{tried} values can be keyed");
}

#[test]
fn what_is_stepped_crossfades_into_its_next_run_without_a_jump() {
    let film = frames(&looped(TRAVELER), 0..24);
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
fn frames_of_a_loop_alone_from_snapshots_or_of_a_later_period_are_those_of_the_whole() {
    let looped = looped(TRAVELER);
    let film = frames(&looped, 0..24);
    for number in [0, 2, 11, 13, 22] {
        assert_eq!(frames(&looped, [number].into_iter())[0], film[number as usize], "frame {number} alone");
        let mut shot = looped.open();
        shot.advance(number, &Unobserved).unwrap();
        let snapshot = shot.snapshot();
        let mut fresh = looped.open();
        fresh.restore(&snapshot).unwrap();
        assert_eq!(draw(&mut fresh, 23), film[23], "from the state at frame {number}");
    }
    let mut shot = looped.open();
    assert_eq!(draw(&mut shot, 23), film[23]);
    assert_eq!(draw(&mut shot, 24 + 3).beauty, film[3].beauty, "the loop begins again");
}
