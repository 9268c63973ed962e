//! Curves and values keyed over time, as scenes write them: any value is refused, or has finite values within its limits at any time.
//!
//! The first line are numbers, at which the value on the lines after it is looked at.
#![no_main]

use bansho_base::{parameters::{animated::Animated, CurveLimits, Node, Parameter, Range, Reader}, math::curve::Curve};
use bansho_scene::parse_values;

const LOW: f64 = -3.0;
const HIGH: f64 = 1e6;

libfuzzer_sys::fuzz_target!(|text: &str| {
    let Some((times, value)) = text.split_once('\n') else { return };
    let Ok(table) = parse_values(&format!("value = {value}")) else { return };
    let Some(node) = table.get("value") else { return };
    let times: Vec<f64> = times.split(' ').filter_map(|time| time.parse().ok()).take(8).collect();
    for limits in [CurveLimits { y: Range::new(LOW, HIGH), ..CurveLimits::default() }, CurveLimits::default().rising()]
    {
        if let Some(curve) = read::<Curve>(node, &limits) {
            check_curve(&curve, &limits, &times);
        }
    }
    if let Some(animated) = read::<Animated<f64>>(node, &Range::new(LOW, HIGH)) {
        check_animated(animated, &times);
    }
});

/// The value as a scene has it. What it is written as is read, and written as the same again: keys that all agree become one number.
fn read<T: Parameter>(node: &Node, limits: &T::Limits) -> Option<T> {
    let mut reader = Reader::new();
    let found = T::read(node, limits, "", &mut reader);
    assert_eq!(found.is_none(), !reader.is_clean(), "refused without a reason, or read in spite of one");
    if let Some(written) = found.as_ref().and_then(T::to_value) {
        let again = T::read(&written.clone().into(), limits, "", &mut Reader::new());
        assert!(again.and_then(|again| again.to_value()) == Some(written), "what is written is not what was read");
    }
    found
}

fn check_curve(curve: &Curve, limits: &CurveLimits, times: &[f64]) {
    let [low, high] = curve.range();
    assert!(low >= limits.y.min && high <= limits.y.max);
    for &x in times {
        let value = curve.eval(x);
        assert!(value >= low && value <= high, "{value} at {x}");
        assert!(curve.derivative(x).is_finite(), "the slope at {x}");
        if x.abs() < 1e9 {
            assert!(curve.integral(0.0, x).is_finite(), "the integral up to {x}");
        }
    }
    assert!(curve.sample_table(17, 0.0, 1.0).iter().all(|value| value.is_finite()));
}

fn check_animated(mut animated: Animated<f64>, times: &[f64]) {
    let [low, high] = animated.bounds();
    assert!(low >= LOW && high <= HIGH);
    for pass in 0..2 {
        for &t in times.iter().filter(|t| pass == 0 || t.is_finite()) {
            let value = animated.at(t);
            assert!(value >= low && value <= high, "{value} at {t}");
            assert!(animated.derivative(t).is_finite(), "the derivative at {t}");
        }
        animated.make_periodic(4.0);
    }
}
