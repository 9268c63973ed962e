//! Values keyed over time, as a scene states them.

use bansho::base::{
    curve::{Curve, Interpolation},
    parameters::{InterpolationName, Node, Value},
};

/// Whether `value` is keyed: `{ keys = [[seconds, value], ...] }`.
pub(super) fn is_keyed(value: &Value) -> bool {
    matches!(value, Value::Table(table) if table.get("keys").is_some())
}

/// The keys of a keyed value, (s, value), as far as they are well formed.
pub(super) fn keys(value: &Value) -> Vec<(f64, &Value)> {
    let Value::Table(table) = value else { return Vec::new() };
    let Some(Value::List(items)) = table.get("keys").map(|node| &node.value) else { return Vec::new() };
    items.iter().filter_map(pair).collect()
}

fn pair(item: &Node) -> Option<(f64, &Value)> {
    let Value::List(pair) = &item.value else { return None };
    let [time, value] = pair.as_slice() else { return None };
    Some((time.value.as_number()?, &value.value))
}

/// What `value` is at `time`: itself, or what its keys come to. `None` where those are faulty.
pub(super) fn at(value: &Value, time: f64) -> Option<Value> {
    if !is_keyed(value) {
        return Some(value.clone());
    }
    let keys = keys(value);
    let interpolation = interpolation(value);
    let number = |component: Option<usize>| {
        let point = |(time, value): &(f64, &Value)| Some([*time, self::component(value, component)?]);
        let points: Vec<[f64; 2]> = keys.iter().map(point).collect::<Option<_>>()?;
        Some(Curve::new(points, interpolation).ok()?.eval(time))
    };
    match keys.first()?.1 {
        Value::List(items) => {
            let components: Vec<f64> = (0..items.len()).map(|index| number(Some(index))).collect::<Option<_>>()?;
            Some(Value::numbers(components))
        }
        _ => number(None).map(Value::Number),
    }
}

fn component(value: &Value, index: Option<usize>) -> Option<f64> {
    match (value, index) {
        (Value::List(items), Some(index)) => items.get(index)?.value.as_number(),
        (value, None) => value.as_number(),
        _ => None,
    }
}

fn interpolation(value: &Value) -> Interpolation {
    let Value::Table(table) = value else { return Interpolation::Monotone };
    let name = match table.get("interpolation").map(|node| &node.value) {
        Some(Value::Text(name)) => InterpolationName::from_name(name),
        _ => None,
    };
    name.unwrap_or_default().into()
}
