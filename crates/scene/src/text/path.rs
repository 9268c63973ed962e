//! Paths of values in a scene: which value of which table.

use std::fmt;

use bansho_base::parameters::{Node, Table, Value};

/// One step of a [`ValuePath`].
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Segment {
    /// Into the value of a key.
    Key(String),
    /// Into an item of a list.
    Index(usize),
}

/// A value of a scene, from the root inward, such as `flame_particles.0.burners.1.diameter`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ValuePath(Vec<Segment>);

impl ValuePath {
    /// The scene itself.
    pub fn root() -> Self {
        Self::default()
    }

    /// The value of `key` within this value.
    #[must_use]
    pub fn key(&self, key: &str) -> Self {
        self.then(Segment::Key(key.to_owned()))
    }

    /// Item `index` of the list at this path.
    #[must_use]
    pub fn index(&self, index: usize) -> Self {
        self.then(Segment::Index(index))
    }

    fn then(&self, segment: Segment) -> Self {
        Self(self.0.iter().cloned().chain([segment]).collect())
    }

    /// Its steps from the root inward.
    pub fn segments(&self) -> &[Segment] {
        &self.0
    }

    /// The value that `root` states there; `None` where it states none.
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
