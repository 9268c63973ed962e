//! Parameters made of points: curves and keyframed values.

use super::{
    Kind, Node, Parameter, ProblemKind, Range, Reader, Table, Value,
    animated::{Animate, Animated},
    nearest,
    types::{check_number, read_number},
};
use crate::math::curve::{Curve, CurveError, Interpolation};

crate::choice! {
    /// How values between points are found.
    pub enum InterpolationName {
        /// A smooth curve that never overshoots its points.
        Monotone = "monotone",
        /// Straight lines.
        Linear = "linear",
        /// Each value holds until the next.
        Step = "step",
    }
}

impl From<InterpolationName> for Interpolation {
    fn from(name: InterpolationName) -> Self {
        match name {
            InterpolationName::Monotone => Self::Monotone,
            InterpolationName::Linear => Self::Linear,
            InterpolationName::Step => Self::Step,
        }
    }
}

fn interpolation_name(interpolation: Interpolation) -> InterpolationName {
    match interpolation {
        Interpolation::Monotone => InterpolationName::Monotone,
        Interpolation::Linear => InterpolationName::Linear,
        Interpolation::Step => InterpolationName::Step,
    }
}

/// Maximum number of control points of a curve or keys of a value: enough for half an hour with a key at every frame. Every copy of a curve contains
/// all of them.
pub const MAX_POINTS: usize = 100_000;

/// Whether the number of control points or keys is allowed; reports a problem if not.
fn check_point_count(items: &[Node], node: &Node, reader: &mut Reader) -> bool {
    let is_allowed = items.len() <= MAX_POINTS;
    if !is_allowed {
        reader.report(node, ProblemKind::ListLength { found: items.len(), min: 1, max: MAX_POINTS });
    }
    is_allowed
}

/// Splits `{ <list_key> = [...], interpolation = "..." }` into its list and its interpolation.
fn keyed_table<'a>(
    table: &'a Table,
    list_key: &str,
    node: &Node,
    expected: &Kind,
    reader: &mut Reader,
) -> Option<(&'a [Node], Interpolation)> {
    let allowed = [list_key, "interpolation"];
    for entry in &table.entries {
        if !allowed.contains(&entry.key.as_str()) {
            let kind = ProblemKind::UnknownKey {
                key: entry.key.clone(),
                nearest: nearest(&entry.key, allowed).map(str::to_owned),
                allowed: allowed.map(str::to_owned).to_vec(),
            };
            reader.report_at(Some(entry.key_span.clone()), kind);
            return None;
        }
    }
    let interpolation = match table.get("interpolation") {
        Some(node) => InterpolationName::read(node, &(), "", reader)?,
        None => InterpolationName::default(),
    };
    match table.get(list_key).map(|list| &list.value) {
        Some(Value::List(items)) => Some((items, interpolation.into())),
        _ => {
            reader.wrong_type(node, expected);
            None
        }
    }
}

/// Bounds of a curve's control points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveLimits {
    /// Bounds of x.
    pub x: Range,
    /// Bounds of y.
    pub y: Range,
    /// Whether y must not decrease.
    pub rising: bool,
}

impl CurveLimits {
    /// A curve from the unit interval to values from `min` to `max`.
    pub const fn unit_to(min: f64, max: f64) -> Self {
        Self { x: Range::new(0.0, 1.0), y: Range::new(min, max), rising: false }
    }

    /// The same for a curve that must not decrease.
    pub const fn rising(self) -> Self {
        Self { rising: true, ..self }
    }
}

impl Default for CurveLimits {
    fn default() -> Self {
        Self::unit_to(0.0, 1.0)
    }
}

fn read_points(items: &[Node], limits: &CurveLimits, expected: &Kind, reader: &mut Reader) -> Option<Vec<[f64; 2]>> {
    let points = items.iter().enumerate().map(|(index, item)| {
        reader.within(index.to_string(), |reader| {
            let [x, y] = read_pair(item, expected, reader)?;
            Some([read_number(x, &limits.x, "", expected, reader)?, read_number(y, &limits.y, "", expected, reader)?])
        })
    });
    points.collect()
}

/// The two nodes of a list of two; anything else is reported.
fn read_pair<'a>(item: &'a Node, expected: &Kind, reader: &mut Reader) -> Option<[&'a Node; 2]> {
    match &item.value {
        Value::List(pair) if pair.len() == 2 => Some([&pair[0], &pair[1]]),
        _ => {
            reader.wrong_type(item, expected);
            None
        }
    }
}

impl Parameter for Curve {
    type Limits = CurveLimits;

    fn kind(limits: &CurveLimits) -> Kind {
        Kind::Curve { x: [limits.x.min, limits.x.max], y: [limits.y.min, limits.y.max], rising: limits.rising }
    }

    fn read(node: &Node, limits: &CurveLimits, _unit: &'static str, reader: &mut Reader) -> Option<Self> {
        let expected = Self::kind(limits);
        let (items, interpolation) = match &node.value {
            Value::List(items) => (items.as_slice(), Interpolation::Monotone),
            Value::Table(table) => keyed_table(table, "points", node, &expected, reader)?,
            _ => {
                reader.wrong_type(node, &expected);
                return None;
            }
        };
        if !check_point_count(items, node, reader) {
            return None;
        }
        let points = match &node.value {
            Value::Table(_) => reader.within("points", |reader| read_points(items, limits, &expected, reader)),
            _ => read_points(items, limits, &expected, reader),
        }?;
        if limits.rising
            && let Some(pair) = points.windows(2).find(|pair| pair[1][1] < pair[0][1])
        {
            reader.report(node, ProblemKind::NotRising { from: pair[0][0], to: pair[1][0] });
            return None;
        }
        match Self::new(points, interpolation) {
            Ok(curve) => Some(curve),
            Err(error) => {
                reader.report(node, error.into());
                None
            }
        }
    }

    fn check(&self, limits: &CurveLimits, _unit: &'static str, reader: &mut Reader) {
        let points = self.points();
        if points.len() > MAX_POINTS {
            reader.report_value(ProblemKind::ListLength { found: points.len(), min: 1, max: MAX_POINTS });
        }
        for [x, y] in points {
            check_number(*x, &limits.x, "", reader);
            check_number(*y, &limits.y, "", reader);
        }
        if let Some(pair) = points.windows(2).find(|pair| limits.rising && pair[1][1] < pair[0][1]) {
            reader.report_value(ProblemKind::NotRising { from: pair[0][0], to: pair[1][0] });
        }
    }

    fn to_value(&self) -> Option<Value> {
        let points = Value::List(self.points().iter().map(|point| Value::numbers(*point).into()).collect());
        Some(match self.interpolation() {
            Interpolation::Monotone => points,
            other => {
                let mut table = Table::default();
                table.push("points", points);
                table.push("interpolation", Value::Text(interpolation_name(other).name().into()));
                Value::Table(table)
            }
        })
    }
}

impl<T: Parameter + Animate> Parameter for Animated<T> {
    type Limits = T::Limits;

    fn kind(limits: &T::Limits) -> Kind {
        Kind::Animated(Box::new(T::kind(limits)))
    }

    fn read(node: &Node, limits: &T::Limits, unit: &'static str, reader: &mut Reader) -> Option<Self> {
        let Value::Table(table) = &node.value else {
            return T::read(node, limits, unit, reader).map(Self::from);
        };
        let expected = Self::kind(limits);
        let (items, interpolation) = keyed_table(table, "keys", node, &expected, reader)?;
        if !check_point_count(items, node, reader) {
            return None;
        }
        let keys = items.iter().enumerate().map(|(index, item)| {
            reader.within(format!("keys.{index}"), |reader| {
                let [time, value] = read_pair(item, &expected, reader)?;
                let time = read_number(time, &Range::default(), "s", &expected, reader)?;
                Some((time, T::read(value, limits, unit, reader)?))
            })
        });
        let keys: Vec<(f64, T)> = keys.collect::<Option<_>>()?;
        match Self::keyed(keys, interpolation) {
            Ok(mut animated) => {
                if let Some(frame_rate) = reader.frame_rate() {
                    animated.snap_steps(frame_rate);
                }
                Some(animated)
            }
            Err(error) => {
                reader.report(node, CurveError::into(error));
                None
            }
        }
    }

    fn check(&self, limits: &T::Limits, unit: &'static str, reader: &mut Reader) {
        if let Some(constant) = self.constant() {
            return constant.check(limits, unit, reader);
        }
        for (time, value) in self.keys() {
            check_number(time, &Range::default(), "s", reader);
            value.check(limits, unit, reader);
        }
    }

    fn continue_from(&mut self, before: &Self, t: f64, transition_s: f64) {
        self.continue_after(before, t, transition_s);
    }

    fn to_value(&self) -> Option<Value> {
        if let Some(constant) = self.constant() {
            return constant.to_value();
        }
        let keys = self.keys().into_iter().filter_map(|(time, value)| {
            Some(Value::List(vec![Value::Number(time).into(), value.to_value()?.into()]).into())
        });
        let mut table = Table::default();
        table.push("keys", Value::List(keys.collect()));
        table.push("interpolation", Value::Text(interpolation_name(self.interpolation()).name().into()));
        Some(Value::Table(table))
    }

    fn close_loop(&mut self, period: f64) -> Option<String> {
        (!self.make_periodic(period)).then(String::new)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(count: usize) -> Value {
        Value::List((0..count).map(|index| Value::numbers([index as f64, 0.5]).into()).collect())
    }

    fn read_problem<P: Parameter<Limits = L>, L>(value: Value, limits: &L) -> Option<ProblemKind> {
        let mut reader = Reader::new();
        let read = P::read(&Node { value, span: 3..4 }, limits, "", &mut reader);
        let problem = reader.into_problems().listed.pop();
        assert_eq!(read.is_none(), problem.is_some());
        problem.map(|problem| problem.kind)
    }

    #[test]
    fn too_many_keys_and_control_points_are_refused() {
        let keyed = |count| {
            let mut table = Table::default();
            table.push("keys", points(count));
            Value::Table(table)
        };
        let expected = ProblemKind::ListLength { found: MAX_POINTS + 1, min: 1, max: MAX_POINTS };
        assert_eq!(read_problem::<Animated<f64>, _>(keyed(MAX_POINTS), &Range::default()), None);
        assert_eq!(read_problem::<Animated<f64>, _>(keyed(MAX_POINTS + 1), &Range::default()), Some(expected.clone()));
        let limits = CurveLimits { x: Range::default(), ..CurveLimits::default() };
        assert_eq!(read_problem::<Curve, _>(points(MAX_POINTS), &limits), None);
        assert_eq!(read_problem::<Curve, _>(points(MAX_POINTS + 1), &limits), Some(expected));
    }
}
