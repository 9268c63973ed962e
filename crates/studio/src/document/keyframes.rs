//! Keyframed values, as a scene states them.

use bansho::{
    base::{
        math::{
            DVec3,
            curve::{Curve, Interpolation},
        },
        parameters::{Descriptor, InterpolationName, Node, Table, Value},
    },
    scene::ValuePath,
};

use super::descriptors::descriptor;

/// Whether the value at `path` of a scene may be keyframed over time.
pub(crate) fn animatable(path: &ValuePath) -> bool {
    descriptor(path).is_some_and(Descriptor::animatable)
}

/// Whether `value` is keyframed: `{ keys = [[seconds, value], ...] }`.
pub(crate) fn is_keyed(value: &Value) -> bool {
    matches!(value, Value::Table(table) if table.get("keys").is_some())
}

/// A keyframe.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Keyframe<'a> {
    /// Time, s.
    pub(crate) time_s: f64,
    pub(crate) value: &'a Value,
}

/// The keyframes of `value` that are well formed; empty for a constant.
pub(crate) fn keyframes(value: &Value) -> Vec<Keyframe<'_>> {
    let Value::Table(table) = value else { return Vec::new() };
    let Some(Value::List(items)) = table.get("keys").map(|node| &node.value) else { return Vec::new() };
    items.iter().filter_map(keyframe).collect()
}

fn keyframe(item: &Node) -> Option<Keyframe<'_>> {
    let Value::List(pair) = &item.value else { return None };
    let [time, value] = pair.as_slice() else { return None };
    Some(Keyframe { time_s: time.value.as_number()?, value: &value.value })
}

/// `value` at `time`, s: a constant unchanged, keyframes interpolated. `None` where the keyframes are invalid.
pub(crate) fn evaluate_at(value: &Value, time: f64) -> Option<Value> {
    if !is_keyed(value) {
        return Some(value.clone());
    }
    let keyframes = keyframes(value);
    let interpolation = interpolation(value);
    match keyframes.first()?.value {
        Value::List(items) => {
            let components = (0..items.len()).map(|index| number_at(&keyframes, Some(index), interpolation, time));
            Some(Value::numbers(components.collect::<Option<Vec<f64>>>()?))
        }
        _ => number_at(&keyframes, None, interpolation, time).map(Value::Number),
    }
}

/// The number that `keyframes` have at `time`, s: one component of a vector, or the value itself.
fn number_at(
    keyframes: &[Keyframe<'_>],
    component: Option<usize>,
    interpolation: Interpolation,
    time: f64,
) -> Option<f64> {
    let points = keyframes.iter().map(|key| Some([key.time_s, self::component(key.value, component)?]));
    Some(Curve::new(points.collect::<Option<_>>()?, interpolation).ok()?.eval(time))
}

/// The vector at `path` of the scene `root` at `time`, s; `None` where the scene does not state it.
pub(crate) fn vector(root: &Table, path: &ValuePath, time: f64) -> Option<DVec3> {
    let Value::List(items) = evaluate_at(&path.find(root)?.value, time)? else { return None };
    let numbers: Vec<f64> = items.iter().map(|item| item.value.as_number()).collect::<Option<_>>()?;
    Some(DVec3::from(<[f64; 3]>::try_from(numbers).ok()?))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn some_parameters_are_animatable() {
        let within =
            |root: &str, keys: &[&str]| keys.iter().fold(ValuePath::root().key(root), |path, key| path.key(key));
        assert!(animatable(&within("wind", &["velocity"])) && animatable(&within("camera", &["position"])));
        assert!(animatable(&ValuePath::root().key("light").index(3).key("position")));
        assert!(animatable(&ValuePath::root().key("flame_sheet").index(0).key("color").key("luminance")));
        assert!(!animatable(&ValuePath::root().key("flame_sheet").index(0).key("height")));
        assert!(!animatable(&within("picture", &["size"])) && !animatable(&ValuePath::root()));
        assert!(!animatable(&within("no_such_table", &["at_all"])));
    }
}
