//! Paths of values in a scene.

use std::fmt;

use bansho_base::parameters::{Node, Span, Table, Value};

/// One segment of a [`ValuePath`].
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Segment {
    /// The value of a key.
    Key(String),
    /// An item of a list.
    Index(usize),
}

/// The path of a value from the root of a scene, such as `flame_particles.0.burners.1.diameter`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ValuePath(Vec<Segment>);

impl ValuePath {
    /// The path of the scene itself.
    pub fn root() -> Self {
        Self::default()
    }

    /// The path of the value of `key` within this value.
    #[must_use]
    pub fn key(&self, key: &str) -> Self {
        self.then(Segment::Key(key.to_owned()))
    }

    /// The path of item `index` of this list.
    #[must_use]
    pub fn index(&self, index: usize) -> Self {
        self.then(Segment::Index(index))
    }

    fn then(&self, segment: Segment) -> Self {
        Self(self.0.iter().cloned().chain([segment]).collect())
    }

    /// Its segments, from the root.
    pub fn segments(&self) -> &[Segment] {
        &self.0
    }

    /// The value at this path in `root`, if there is one.
    pub fn find<'a>(&self, root: &'a Table) -> Option<&'a Node> {
        let (first, rest) = self.0.split_first()?;
        let Segment::Key(key) = first else { return None };
        rest.iter().try_fold(root.get(key)?, |node, segment| match (&node.value, segment) {
            (Value::Table(table), Segment::Key(key)) => table.get(key),
            (Value::List(items), Segment::Index(index)) => items.get(*index),
            _ => None,
        })
    }
}

impl fmt::Display for ValuePath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (step, segment) in self.0.iter().enumerate() {
            let dot = if step > 0 { "." } else { "" };
            match segment {
                Segment::Key(key) => write!(f, "{dot}{key}")?,
                Segment::Index(index) => write!(f, "{dot}{index}")?,
            }
        }
        Ok(())
    }
}

/// The span of the value at a dotted path, or of the nearest table above it that exists.
pub(crate) fn nearest_span(root: &Table, path: &str) -> Option<Span> {
    let mut value = None;
    let mut span = None;
    for segment in path.split('.') {
        let node = match value.unwrap_or(&Value::Bool(false)) {
            _ if value.is_none() => root.get(segment),
            Value::Table(table) => table.get(segment),
            Value::List(items) => segment.parse::<usize>().ok().and_then(|index| items.get(index)),
            _ => None,
        };
        let Some(node) = node else { break };
        span = Some(node.span.clone());
        value = Some(&node.value);
    }
    span
}

/// Whether the scene `root` states the value at a dotted path.
pub(crate) fn is_stated(root: &Table, path: &str) -> bool {
    let mut value_path = ValuePath::root();
    for segment in path.split('.') {
        value_path = match segment.parse() {
            Ok(index) => value_path.index(index),
            Err(_) => value_path.key(segment),
        };
    }
    value_path.find(root).is_some()
}
