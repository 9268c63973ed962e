//! Random valid values, for tests that render thousands of scenes.

use super::{Descriptor, Kind, Node, Table, TableDescriptor, Value};

/// A random valid table; `uniform` returns numbers in [0, 1). Assets are omitted, since they refer to files.
pub fn sample(table: &TableDescriptor, uniform: &mut dyn FnMut() -> f64) -> Table {
    let mut result = Table::default();
    for parameter in &table.parameters {
        if uniform() < 0.5
            && let Some(value) = sample_parameter(parameter, uniform)
        {
            result.push(parameter.key, value);
        }
    }
    result
}

fn sample_parameter(parameter: &Descriptor, uniform: &mut dyn FnMut() -> f64) -> Option<Value> {
    let around = parameter.default.as_ref().and_then(Value::as_number);
    sample_kind(&parameter.kind, around, uniform)
}

/// Often one of the bounds, where errors are likely; otherwise near the default, or anywhere.
fn sample_number(min: f64, max: f64, around: Option<f64>, uniform: &mut dyn FnMut() -> f64) -> f64 {
    let pick = uniform();
    let spread = uniform();
    match around {
        _ if pick < 0.05 => min,
        _ if pick < 0.10 => max,
        Some(default) if pick < 0.8 => (default * (0.25 + 2.0 * spread)).clamp(min, max),
        None if pick < 0.8 => (4.0 * spread - 2.0).clamp(min, max),
        _ => min + (max - min) * spread,
    }
}

fn list(values: impl IntoIterator<Item = Value>) -> Value {
    Value::List(values.into_iter().map(Node::from).collect())
}

fn sample_kind(kind: &Kind, around: Option<f64>, uniform: &mut dyn FnMut() -> f64) -> Option<Value> {
    Some(match kind {
        Kind::Bool => Value::Bool(uniform() < 0.5),
        Kind::Integer { min, max } => {
            Value::Integer(sample_number(*min as f64, *max as f64, around, uniform).round() as i64)
        }
        Kind::Number { min, max } => Value::Number(sample_number(*min, *max, around, uniform)),
        Kind::Rational { min, max } => Value::Number(sample_number(*min, *max, Some(30.0), uniform).round().max(1.0)),
        Kind::Vector { length, min, max } => {
            Value::numbers((0..*length).map(|_| sample_number(*min, *max, None, uniform)).collect::<Vec<_>>())
        }
        Kind::Text => Value::Text(format!("text {}", (uniform() * 1e6) as u32)),
        Kind::Asset => return None,
        Kind::Choice(choices) => {
            Value::Text(choices[((uniform() * choices.len() as f64) as usize).min(choices.len() - 1)].name.into())
        }
        Kind::Curve { x, y, rising } => sample_curve(*x, *y, *rising, uniform),
        Kind::Animated(inner) if uniform() < 0.3 => sample_keys(inner, around, uniform)?,
        Kind::Auto(_) if uniform() < 0.3 => Value::Text("auto".into()),
        Kind::Animated(inner) | Kind::Optional(inner) | Kind::Auto(inner) => sample_kind(inner, around, uniform)?,
        Kind::List { item, min, max } => {
            let count = min + (uniform() * (max - min).min(3) as f64).round() as usize;
            list((0..count).filter_map(|_| sample_kind(item, None, uniform)).collect::<Vec<_>>())
        }
        Kind::Table(table) => Value::Table(sample(table(), uniform)),
    })
}

fn sample_curve(x: [f64; 2], y: [f64; 2], rising: bool, uniform: &mut dyn FnMut() -> f64) -> Value {
    let count = 1 + (uniform() * 5.0) as usize;
    let mut heights: Vec<f64> = (0..count).map(|_| sample_number(y[0], y[1], None, uniform)).collect();
    if rising {
        heights.sort_by(f64::total_cmp);
    }
    let step = (x[1] - x[0]) / count as f64;
    list(
        heights
            .into_iter()
            .enumerate()
            .map(|(index, height)| Value::numbers([x[0] + step * (index as f64 + 0.9 * uniform()), height]))
            .collect::<Vec<_>>(),
    )
}

fn sample_keys(inner: &Kind, around: Option<f64>, uniform: &mut dyn FnMut() -> f64) -> Option<Value> {
    let mut keys = Vec::new();
    for second in 0..1 + (uniform() * 3.0) as usize {
        let value = sample_kind(inner, around, uniform)?;
        keys.push(list([Value::Number(second as f64 + 0.5 * uniform()), value]));
    }
    let mut table = Table::default();
    table.push("keys", list(keys));
    table.push("interpolation", Value::Text(["monotone", "linear", "step"][(uniform() * 2.99) as usize].into()));
    Some(Value::Table(table))
}
