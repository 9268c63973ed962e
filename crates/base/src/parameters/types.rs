//! The types of parameters, and how each is read from a file and written back.

use super::{Kind, Node, ProblemKind, Reader, Table, TableDescriptor, Value, nearest};

/// A type that a parameter can have.
pub trait Parameter: Sized {
    /// Bounds of its values.
    type Limits: Default;

    /// Its kind within `limits`.
    fn kind(limits: &Self::Limits) -> Kind;

    /// Reads it from a file; reports a problem and returns `None` if the value is invalid.
    fn read(node: &Node, limits: &Self::Limits, unit: &'static str, reader: &mut Reader) -> Option<Self>;

    /// The value as in a file; `None` if a file would omit it.
    fn to_value(&self) -> Option<Value>;

    /// Reports what [`read`](Self::read) would report of this value, which a program has set.
    fn check(&self, limits: &Self::Limits, unit: &'static str, reader: &mut Reader);

    /// Makes keyframed values continue those of `before` at time `t` (s): they change from them to the own values within `transition_s`.
    fn continue_from(&mut self, _before: &Self, _t: f64, _transition_s: f64) {}

    /// Makes keyframed values periodic by repeating the interval from 0 to `period` (s, above 0). Returns the path of the first value that differs at
    /// both ends, empty for the value itself.
    fn close_loop(&mut self, _period: f64) -> Option<String> {
        None
    }
}

/// A table of parameters; implemented by [`parameters!`](crate::parameters!).
pub trait Parameters: Sized + Default {
    /// Its descriptors.
    fn table() -> &'static TableDescriptor;

    /// Reads it; parameters missing in the file keep their defaults. Keys in `ignored` belong to other readers.
    fn read_table(table: &Table, reader: &mut Reader, ignored: &[&str]) -> Self;

    /// The table with every parameter.
    fn to_table(&self) -> Table;

    /// Reports every value that is out of range, not finite, or does not make a curve, with its path. A file with such a value would be refused in the
    /// same words.
    fn check_values(&self, reader: &mut Reader);

    /// Reports keys that are neither parameters nor `ignored`.
    fn report_unknown(table: &Table, reader: &mut Reader, ignored: &[&str]) {
        let keys = Self::table().parameters.iter().map(|parameter| parameter.key);
        let known: Vec<&str> = keys.chain(ignored.iter().copied()).collect();
        for entry in &table.entries {
            if !known.contains(&&*entry.key) {
                reader.report_with(Some(entry.key_span.clone()), || ProblemKind::UnknownKey {
                    key: entry.key.clone(),
                    nearest: nearest(&entry.key, known.iter().copied()).map(str::to_owned),
                    allowed: known.iter().map(|key| (*key).to_owned()).collect(),
                });
            }
        }
    }
}

/// Inclusive bounds of a number, or of each component of a vector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Minimum.
    pub min: f64,
    /// Maximum.
    pub max: f64,
}

impl Range {
    /// From `min` to `max`, both allowed.
    pub const fn new(min: f64, max: f64) -> Self {
        Self { min, max }
    }
}

impl Default for Range {
    /// Bounds that are plausible for any length, speed or time in a picture.
    fn default() -> Self {
        Self::new(-1e6, 1e6)
    }
}

/// Reports a number that is out of range or not finite.
pub(super) fn check_number(value: f64, range: &Range, unit: &'static str, reader: &mut Reader) {
    if !(range.min..=range.max).contains(&value) {
        reader.report_value(ProblemKind::OutOfRange { value, min: range.min, max: range.max, unit });
    }
}

pub(super) fn read_number(
    node: &Node,
    range: &Range,
    unit: &'static str,
    expected: &Kind,
    reader: &mut Reader,
) -> Option<f64> {
    let Some(value) = node.value.as_number() else {
        reader.wrong_type(node, expected);
        return None;
    };
    if !(range.min..=range.max).contains(&value) {
        reader.report(node, ProblemKind::OutOfRange { value, min: range.min, max: range.max, unit });
        return None;
    }
    Some(value)
}

impl Parameter for f64 {
    type Limits = Range;

    fn kind(limits: &Range) -> Kind {
        Kind::Number { min: limits.min, max: limits.max }
    }

    fn read(node: &Node, limits: &Range, unit: &'static str, reader: &mut Reader) -> Option<Self> {
        read_number(node, limits, unit, &Self::kind(limits), reader)
    }

    fn check(&self, limits: &Range, unit: &'static str, reader: &mut Reader) {
        check_number(*self, limits, unit, reader);
    }

    fn to_value(&self) -> Option<Value> {
        Some(Value::Number(*self))
    }
}

impl Parameter for i64 {
    type Limits = Range;

    fn kind(limits: &Range) -> Kind {
        Kind::Integer { min: limits.min as Self, max: limits.max as Self }
    }

    fn read(node: &Node, limits: &Range, unit: &'static str, reader: &mut Reader) -> Option<Self> {
        let Value::Integer(value) = node.value else {
            reader.wrong_type(node, &Self::kind(limits));
            return None;
        };
        read_number(node, limits, unit, &Self::kind(limits), reader).map(|_| value)
    }

    fn check(&self, limits: &Range, unit: &'static str, reader: &mut Reader) {
        check_number(*self as f64, limits, unit, reader);
    }

    fn to_value(&self) -> Option<Value> {
        Some(Value::Integer(*self))
    }
}

impl Parameter for bool {
    type Limits = ();

    fn kind(_: &()) -> Kind {
        Kind::Bool
    }

    fn read(node: &Node, limits: &(), _unit: &'static str, reader: &mut Reader) -> Option<Self> {
        if let Value::Bool(value) = node.value {
            return Some(value);
        }
        reader.wrong_type(node, &Self::kind(limits));
        None
    }

    fn check(&self, _limits: &(), _unit: &'static str, _reader: &mut Reader) {}

    fn to_value(&self) -> Option<Value> {
        Some(Value::Bool(*self))
    }
}

impl Parameter for String {
    type Limits = ();

    fn kind(_: &()) -> Kind {
        Kind::Text
    }

    fn read(node: &Node, limits: &(), _unit: &'static str, reader: &mut Reader) -> Option<Self> {
        if let Value::Text(text) = &node.value {
            return Some(text.clone());
        }
        reader.wrong_type(node, &Self::kind(limits));
        None
    }

    fn check(&self, _limits: &(), _unit: &'static str, _reader: &mut Reader) {}

    fn to_value(&self) -> Option<Value> {
        Some(Value::Text(self.clone()))
    }
}

/// The path of an asset, relative to the scene file.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct AssetPath(pub String);

impl Parameter for AssetPath {
    type Limits = ();

    fn kind(_: &()) -> Kind {
        Kind::Asset
    }

    fn read(node: &Node, limits: &(), _unit: &'static str, reader: &mut Reader) -> Option<Self> {
        match &node.value {
            Value::Text(path) if !path.is_empty() => Some(Self(path.clone())),
            _ => {
                reader.wrong_type(node, &Self::kind(limits));
                None
            }
        }
    }

    fn check(&self, limits: &(), _unit: &'static str, reader: &mut Reader) {
        if self.0.is_empty() {
            reader.wrong_type(&Value::Text(String::new()).into(), &Self::kind(limits));
        }
    }

    fn to_value(&self) -> Option<Value> {
        Some(Value::Text(self.0.clone()))
    }
}

impl<const N: usize> Parameter for [f64; N] {
    type Limits = Range;

    fn kind(limits: &Range) -> Kind {
        Kind::Vector { length: N, min: limits.min, max: limits.max }
    }

    fn read(node: &Node, limits: &Range, unit: &'static str, reader: &mut Reader) -> Option<Self> {
        let expected = Self::kind(limits);
        let Value::List(items) = &node.value else {
            reader.wrong_type(node, &expected);
            return None;
        };
        if items.len() != N {
            reader.report(node, ProblemKind::ListLength { found: items.len(), min: N, max: N });
            return None;
        }
        let mut values = [0.0; N];
        for (value, item) in values.iter_mut().zip(items) {
            *value = read_number(item, limits, unit, &expected, reader)?;
        }
        Some(values)
    }

    fn check(&self, limits: &Range, unit: &'static str, reader: &mut Reader) {
        self.iter().for_each(|value| value.check(limits, unit, reader));
    }

    fn to_value(&self) -> Option<Value> {
        Some(Value::numbers(*self))
    }
}

impl<const N: usize> Parameter for [i64; N] {
    type Limits = Range;

    fn kind(limits: &Range) -> Kind {
        Kind::Vector { length: N, min: limits.min, max: limits.max }
    }

    fn read(node: &Node, limits: &Range, unit: &'static str, reader: &mut Reader) -> Option<Self> {
        let Value::List(items) = &node.value else {
            reader.wrong_type(node, &Self::kind(limits));
            return None;
        };
        if items.len() != N {
            reader.report(node, ProblemKind::ListLength { found: items.len(), min: N, max: N });
            return None;
        }
        let mut values = [0; N];
        for (value, item) in values.iter_mut().zip(items) {
            *value = i64::read(item, limits, unit, reader)?;
        }
        Some(values)
    }

    fn check(&self, limits: &Range, unit: &'static str, reader: &mut Reader) {
        self.iter().for_each(|value| value.check(limits, unit, reader));
    }

    fn to_value(&self) -> Option<Value> {
        Some(Value::List(self.iter().map(|value| Value::Integer(*value).into()).collect()))
    }
}

/// `"auto"` or an explicit value.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Auto<T> {
    /// Chosen by Bansho.
    #[default]
    Auto,
    /// Set by the scene.
    Set(T),
}

impl<T> From<T> for Auto<T> {
    fn from(value: T) -> Self {
        Self::Set(value)
    }
}

impl<T: Parameter> Parameter for Auto<T> {
    type Limits = T::Limits;

    fn kind(limits: &T::Limits) -> Kind {
        Kind::Auto(Box::new(T::kind(limits)))
    }

    fn read(node: &Node, limits: &T::Limits, unit: &'static str, reader: &mut Reader) -> Option<Self> {
        if node.value == Value::Text("auto".into()) {
            return Some(Self::Auto);
        }
        if matches!(node.value, Value::Text(_)) {
            reader.wrong_type(node, &Self::kind(limits));
            return None;
        }
        T::read(node, limits, unit, reader).map(Self::Set)
    }

    fn check(&self, limits: &T::Limits, unit: &'static str, reader: &mut Reader) {
        if let Self::Set(value) = self {
            value.check(limits, unit, reader);
        }
    }

    fn continue_from(&mut self, before: &Self, t: f64, transition_s: f64) {
        if let (Self::Set(value), Self::Set(before)) = (self, before) {
            value.continue_from(before, t, transition_s);
        }
    }

    fn to_value(&self) -> Option<Value> {
        match self {
            Self::Auto => Some(Value::Text("auto".into())),
            Self::Set(value) => value.to_value(),
        }
    }

    fn close_loop(&mut self, period: f64) -> Option<String> {
        match self {
            Self::Auto => None,
            Self::Set(value) => value.close_loop(period),
        }
    }
}

impl<T: Parameter> Parameter for Option<T> {
    type Limits = T::Limits;

    fn kind(limits: &T::Limits) -> Kind {
        Kind::Optional(Box::new(T::kind(limits)))
    }

    fn read(node: &Node, limits: &T::Limits, unit: &'static str, reader: &mut Reader) -> Option<Self> {
        T::read(node, limits, unit, reader).map(Some)
    }

    fn check(&self, limits: &T::Limits, unit: &'static str, reader: &mut Reader) {
        if let Some(value) = self {
            value.check(limits, unit, reader);
        }
    }

    fn continue_from(&mut self, before: &Self, t: f64, transition_s: f64) {
        if let (Some(value), Some(before)) = (self, before) {
            value.continue_from(before, t, transition_s);
        }
    }

    fn to_value(&self) -> Option<Value> {
        self.as_ref().and_then(T::to_value)
    }

    fn close_loop(&mut self, period: f64) -> Option<String> {
        self.as_mut().and_then(|value| value.close_loop(period))
    }
}

/// Bounds of the length of a list, and limits of its items.
#[derive(Clone, Debug, PartialEq)]
pub struct Length<L> {
    /// Minimum number of items.
    pub min: usize,
    /// Maximum number of items.
    pub max: usize,
    /// Limits of each item.
    pub item: L,
}

impl<L: Default> Default for Length<L> {
    fn default() -> Self {
        Self { min: 0, max: 10_000, item: L::default() }
    }
}

impl<T: Parameter> Parameter for Vec<T> {
    type Limits = Length<T::Limits>;

    fn kind(limits: &Self::Limits) -> Kind {
        Kind::List { item: Box::new(T::kind(&limits.item)), min: limits.min, max: limits.max }
    }

    fn read(node: &Node, limits: &Self::Limits, unit: &'static str, reader: &mut Reader) -> Option<Self> {
        let Value::List(items) = &node.value else {
            reader.wrong_type(node, &Self::kind(limits));
            return None;
        };
        if !(limits.min..=limits.max).contains(&items.len()) {
            reader.report(node, ProblemKind::ListLength { found: items.len(), min: limits.min, max: limits.max });
            return None;
        }
        let items = items
            .iter()
            .enumerate()
            .map(|(index, item)| reader.within(index.to_string(), |reader| T::read(item, &limits.item, unit, reader)));
        items.collect()
    }

    fn check(&self, limits: &Self::Limits, unit: &'static str, reader: &mut Reader) {
        if !(limits.min..=limits.max).contains(&self.len()) {
            reader.report_value(ProblemKind::ListLength { found: self.len(), min: limits.min, max: limits.max });
        }
        for (index, item) in self.iter().enumerate() {
            reader.within(index.to_string(), |reader| item.check(&limits.item, unit, reader));
        }
    }

    fn continue_from(&mut self, before: &Self, t: f64, transition_s: f64) {
        self.iter_mut().zip(before).for_each(|(value, before)| value.continue_from(before, t, transition_s));
    }

    fn to_value(&self) -> Option<Value> {
        Some(Value::List(self.iter().filter_map(T::to_value).map(Node::from).collect()))
    }

    fn close_loop(&mut self, period: f64) -> Option<String> {
        let mut items = self.iter_mut().enumerate();
        items.find_map(|(index, item)| Some(path(&index.to_string(), &item.close_loop(period)?)))
    }
}

/// The path `rest` below `key`.
#[must_use]
pub fn path(key: &str, rest: &str) -> String {
    if rest.is_empty() { key.to_owned() } else { format!("{key}.{rest}") }
}
