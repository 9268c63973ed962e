//! Where an axis has ticks, and what stands beside them.

use bansho::base::math;

use super::figure::{Axis, Scale};

/// The ticks of an axis.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Ticks {
    /// Numbers with a label.
    pub(super) major: Vec<(f64, String)>,
    /// Numbers without one.
    pub(super) minor: Vec<f64>,
    /// The power of ten that the labels are multiples of; empty if that is 1.
    pub(super) factor: String,
}

/// Ticks for an axis that has room for about `count` labels.
pub(super) fn ticks(axis: &Axis, count: usize) -> Ticks {
    match axis.scale {
        Scale::Linear => linear(axis.range, count),
        Scale::Log => log(axis.range, count),
    }
}

/// The number 1, 2 or 5 times a power of ten that divides `span` into at most `count` steps.
fn step(span: f64, count: usize) -> f64 {
    let least = span / count.max(1) as f64;
    let power = math::pow(10.0, math::log10(least).floor());
    [1.0, 2.0, 5.0, 10.0].map(|factor| factor * power).into_iter().find(|step| *step >= least * 0.999).unwrap_or(least)
}

/// A range extended to half the distance of its about `count` ticks. What is negative by a hundredth of it counts as 0.
pub(super) fn rounded([low, high]: [f64; 2], count: usize) -> [f64; 2] {
    let [low, high] = if high > low { [low, high] } else { padded([low, low]) };
    let span = high - low;
    let low = if (-0.01 * span..0.0).contains(&low) { 0.0 } else { low };
    let step = step(span, 2 * count);
    // An end that is a multiple but for rounding stays where it is.
    let [low, top] = [(low / step + 1e-9).floor() * step, (high / step - 1e-9).ceil() * step];
    [low, if top > low { top } else { low + step }]
}

/// A range with a margin, so that no curve lies on the frame.
pub(super) fn padded([low, high]: [f64; 2]) -> [f64; 2] {
    let margin = match high - low {
        span if span > 0.0 => 0.06 * span,
        _ if low == 0.0 => 0.5,
        _ => 0.5 * low.abs(),
    };
    [low - margin, high + margin]
}

fn linear([low, high]: [f64; 2], count: usize) -> Ticks {
    let step = step(high - low, count);
    let power = exponent(low.abs().max(high.abs()));
    let scaled = !(-3..6).contains(&power);
    let unit = if scaled { math::pow(10.0, f64::from(power)) } else { 1.0 };
    let decimals = (-exponent(step / unit)).max(0) as usize;
    let mut major = Vec::new();
    for value in multiples(step, [low, high]) {
        let label = match value / unit {
            zero if zero.abs() < 1e-9 * step / unit => "0".to_owned(),
            value => signed(&format!("{value:.decimals$}")),
        };
        major.push((value, label));
    }
    // Between ticks at every 5 there are four smaller ones, so that these are at whole numbers; between others three.
    let is_five = (step / math::pow(10.0, f64::from(exponent(step))) - 5.0).abs() < 0.5;
    Ticks {
        factor: if scaled { power_of_ten(power) } else { String::new() },
        major,
        minor: multiples(step / if is_five { 5.0 } else { 4.0 }, [low, high]).collect(),
    }
}

/// The multiples of `step` from `low` to `high`, both included but for rounding.
fn multiples(step: f64, [low, high]: [f64; 2]) -> impl Iterator<Item = f64> {
    let (first, last) = ((low / step - 1e-9).ceil() as i64, (high / step + 1e-9).floor() as i64);
    (first..=last).map(move |index| index as f64 * step)
}

/// The power of ten of a number.
fn exponent(value: f64) -> i32 {
    if value > 0.0 { (math::log10(value) + 1e-9).floor() as i32 } else { 0 }
}

fn log([low, high]: [f64; 2], count: usize) -> Ticks {
    let (first, last) = ((math::log10(low) - 1e-9).ceil() as i32, (math::log10(high) + 1e-9).floor() as i32);
    let every = (1..).find(|every| (last - first) / every < count.max(1) as i32).unwrap_or(1);
    let minor = (first - 1..=last).flat_map(|decade| {
        let factors = if every == 1 { 2..10 } else { 1..2 };
        factors.map(move |factor| f64::from(factor) * math::pow(10.0, f64::from(decade)))
    });
    let labeled = (first..=last).filter(|decade| (decade - first) % every == 0);
    Ticks {
        major: labeled.map(|decade| (math::pow(10.0, f64::from(decade)), power_of_ten(decade))).collect(),
        factor: String::new(),
        minor: minor.filter(|value| (low..=high).contains(value)).collect(),
    }
}

fn power_of_ten(decade: i32) -> String {
    match decade {
        0 => "1".to_owned(),
        1 => "10".to_owned(),
        _ => format!("10{}", superscript(decade)),
    }
}

/// A number with a minus sign in place of its hyphen.
fn signed(number: &str) -> String {
    number.replace('-', "−")
}

/// A number in raised digits.
fn superscript(number: i32) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let letters = number.to_string();
    letters.chars().map(|letter| letter.to_digit(10).map_or('⁻', |digit| DIGITS[digit as usize])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis, count: usize) -> Vec<String> {
        ticks(axis, count).major.into_iter().map(|(_, label)| label).collect()
    }

    #[test]
    fn labels_are_round_numbers() {
        let linear = |range| labels(&Axis::linear("", "", range), 6);
        assert_eq!(linear([0.0, 10_000.0]), ["0", "2000", "4000", "6000", "8000", "10000"]);
        assert_eq!(linear([-0.5, 1.0]), ["−0.5", "0", "0.5", "1.0"]);
        assert_eq!(linear([0.0, 3e7]), ["0", "0.5", "1.0", "1.5", "2.0", "2.5", "3.0"]);
        let axis = Axis::linear("q", "1/m", [0.0, 3e7]);
        assert_eq!(axis.caption(&ticks(&axis, 6).factor), "q (10⁷ 1/m)");
        let log = |range| labels(&Axis::log("", "", range), 6);
        assert_eq!(log([0.1, 1e4]), ["10⁻¹", "1", "10", "10²", "10³", "10⁴"]);
        assert_eq!(log([1e-6, 1e10]).len(), 6);
    }

    #[test]
    fn ranges_are_extended_to_ticks() {
        assert_eq!(rounded([0.02, 9.17], 6), [0.0, 10.0]);
        assert_eq!(rounded([0.0, 1.0], 6), [0.0, 1.0]);
        assert_eq!(rounded([-0.001, 0.9], 5), [0.0, 0.9]);
        assert_eq!((rounded([3.0, 3.0], 4), rounded([0.0, 0.0], 8)), ([1.5, 4.5], [-0.5, 0.5]));
    }
}
