//! Descriptors of parameters: sufficient to parse, document and edit a parameter and to generate random valid values.

use super::{Table, Value};
use crate::host::plural::count_range;

/// One parameter.
#[derive(Clone, Debug)]
pub struct Descriptor {
    /// Key in the scene file.
    pub key: &'static str,
    /// Description in one or two sentences, with the paper's symbol and equation if it has one.
    pub doc: String,
    /// Unit, empty for dimensionless numbers; units that are not SI are also part of the key.
    pub unit: &'static str,
    /// Type and bounds.
    pub kind: Kind,
    /// Default value; `None` for an optional parameter without one.
    pub default: Option<Value>,
    /// Whether it is there only so that a paper can be followed to the letter: whoever makes pictures leaves it alone, and what lists parameters lists it
    /// last, under [`PAPER_HEADING`].
    pub is_for_paper: bool,
}

/// Heading of the parameters that are there only for a paper, wherever parameters are listed.
pub const PAPER_HEADING: &str = "To follow the paper to the letter";

impl Descriptor {
    /// Whether it may be keyframed over time.
    pub fn animatable(&self) -> bool {
        match &self.kind {
            Kind::Animated(_) => true,
            Kind::Optional(inner) => matches!(**inner, Kind::Animated(_)),
            _ => false,
        }
    }
}

/// All parameters of one table.
#[derive(Clone, Debug)]
pub struct TableDescriptor {
    /// Description of the table.
    pub doc: String,
    /// Its parameters, in the order in which they are documented.
    pub parameters: Vec<Descriptor>,
}

impl TableDescriptor {
    /// The parameters in the order in which they are shown, those for a paper last, as two lists: each keeps the order of the declaration.
    pub fn by_purpose(&self) -> [Vec<&Descriptor>; 2] {
        let (for_paper, for_pictures) = self.parameters.iter().partition(|parameter| parameter.is_for_paper);
        [for_pictures, for_paper]
    }

    /// Paths of all assets that `table`, which this describes, refers to at any depth, in the order of the descriptors.
    pub fn asset_paths(&self, table: &Table) -> Vec<String> {
        let mut paths = Vec::new();
        for parameter in &self.parameters {
            if let Some(node) = table.get(parameter.key) {
                collect_asset_paths(&node.value, &parameter.kind, &mut paths);
            }
        }
        paths
    }
}

fn collect_asset_paths(value: &Value, kind: &Kind, paths: &mut Vec<String>) {
    match (kind, value) {
        (Kind::Asset, Value::Text(path)) => paths.push(path.clone()),
        (Kind::Optional(inner) | Kind::Auto(inner), value) => collect_asset_paths(value, inner, paths),
        (Kind::List { item, .. }, Value::List(items)) => {
            items.iter().for_each(|node| collect_asset_paths(&node.value, item, paths));
        }
        (Kind::Table(descriptor), Value::Table(table)) => paths.extend(descriptor().asset_paths(table)),
        _ => {}
    }
}

/// One of the allowed names of a choice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Choice {
    /// The name in the file.
    pub name: &'static str,
    /// Description of the choice.
    pub doc: &'static str,
}

/// Type of a parameter with its bounds, which are inclusive.
#[derive(Clone, Debug)]
pub enum Kind {
    /// `true` or `false`.
    Bool,
    /// An integer.
    Integer {
        /// Minimum.
        min: i64,
        /// Maximum.
        max: i64,
    },
    /// A finite number.
    Number {
        /// Minimum.
        min: f64,
        /// Maximum.
        max: f64,
    },
    /// A positive number, or a fraction of integers as a string.
    Rational {
        /// Minimum.
        min: f64,
        /// Maximum.
        max: f64,
    },
    /// A list of a fixed number of finite numbers.
    Vector {
        /// Number of components.
        length: usize,
        /// Minimum of each.
        min: f64,
        /// Maximum of each.
        max: f64,
    },
    /// Any text.
    Text,
    /// The path of an asset.
    Asset,
    /// One of a set of names.
    Choice(&'static [Choice]),
    /// Control points of a curve.
    Curve {
        /// Minimum and maximum x.
        x: [f64; 2],
        /// Minimum and maximum y.
        y: [f64; 2],
        /// Whether y must not decrease.
        rising: bool,
    },
    /// The inner kind, or keyframes of it.
    Animated(Box<Self>),
    /// The inner kind, or absent.
    Optional(Box<Self>),
    /// The inner kind, or `"auto"`.
    Auto(Box<Self>),
    /// A list.
    List {
        /// Kind of each item.
        item: Box<Self>,
        /// Minimum number of items.
        min: usize,
        /// Maximum number of items.
        max: usize,
    },
    /// A table.
    Table(fn() -> &'static TableDescriptor),
}

impl Kind {
    /// Description of the expected value for error messages.
    pub fn expectation(&self) -> String {
        match self {
            Self::Bool => "true or false".into(),
            Self::Integer { min, max } => format!("a whole number from {min} to {max}"),
            Self::Number { min, max } => format!("a number from {min} to {max}"),
            Self::Rational { min, max } => {
                format!("a number from {min} to {max}, or a fraction such as \"24000/1001\"")
            }
            Self::Vector { length, min, max } => format!("a list of {length} numbers from {min} to {max}"),
            Self::Text => "a string".into(),
            Self::Asset => "a path, as a string".into(),
            Self::Choice(choices) => {
                let names: Vec<String> = choices.iter().map(|choice| format!("\"{}\"", choice.name)).collect();
                format!("one of {}", names.join(", "))
            }
            Self::Curve { x, y, .. } => {
                format!("control points [[x, y], ...] with x from {} to {} and y from {} to {}", x[0], x[1], y[0], y[1])
            }
            Self::Animated(inner) => {
                format!("{}, or {{ keys = [[seconds, value], ...] }}", inner.expectation())
            }
            Self::Optional(inner) => inner.expectation(),
            Self::Auto(inner) => format!("\"auto\" or {}", inner.expectation()),
            Self::List { item, min, max } => {
                format!("a list of {}, each {}", count_range(*min, *max, "item"), item.expectation())
            }
            Self::Table(_) => "a table".into(),
        }
    }
}

#[cfg(test)]
#[allow(unreachable_pub, reason = "tables are public")]
mod tests {
    use crate::parameters::{AssetPath, Parameters};

    crate::parameters! {
        /// A table with a file.
        pub struct Item {
            /// Its file.
            file: Option<AssetPath> = None;
        }
    }

    crate::parameters! {
        /// A table with parameters for a paper between others.
        pub struct Mixed {
            /// For a paper.
            sweeps: i64 = 60;
            /// For pictures.
            brightness: f64 = 1.0;
            /// For a paper, too.
            tolerance: f64 = 0.0;
            /// For pictures, too.
            speed: f64 = 1.0;
        }
        paper: sweeps, tolerance;
    }

    #[test]
    fn parameters_for_a_paper_come_last_in_their_order() {
        let [for_pictures, for_paper] =
            Mixed::table().by_purpose().map(|parameters| parameters.iter().map(|p| p.key).collect::<Vec<_>>());
        assert_eq!(for_pictures, ["brightness", "speed"]);
        assert_eq!(for_paper, ["sweeps", "tolerance"]);
        // Random values of tests and fingerprints of frames follow the declaration.
        let declared: Vec<&str> = Mixed::table().parameters.iter().map(|parameter| parameter.key).collect();
        assert_eq!(declared, ["sweeps", "brightness", "tolerance", "speed"]);
    }

    crate::parameters! {
        /// A table with a list of tables.
        pub struct Outer {
            /// Text that is no asset.
            title: String = "a.png".into();
            /// Items.
            items: Vec<Item> = Vec::new();
        }
    }

    #[test]
    fn files_are_found_in_tables_in_lists() {
        let item = |file: Option<&str>| Item { file: file.map(|path| AssetPath(path.into())) };
        let outer = Outer { items: vec![item(Some("b.glb")), item(None), item(Some("c.glb"))], ..Outer::default() };
        assert_eq!(Outer::table().asset_paths(&outer.to_table()), ["b.glb", "c.glb"]);
    }
}
