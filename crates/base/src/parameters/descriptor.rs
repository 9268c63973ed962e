//! What a parameter is: enough to parse it, to explain it, to edit it and to draw a valid one at random.

use super::Value;
use crate::host::plural::count_range;

/// One parameter.
#[derive(Clone, Debug)]
pub struct Descriptor {
    /// Its key in the scene file.
    pub key: &'static str,
    /// What it is, in a sentence or two, with the paper's symbol and equation where it has one.
    pub doc: String,
    /// Its unit, empty for pure numbers; also written in the key where it is not SI.
    pub unit: &'static str,
    /// What it may be.
    pub kind: Kind,
    /// What it is when the scene does not say; `None` for what may be left out altogether.
    pub default: Option<Value>,
}

impl Descriptor {
    /// Whether it may be keyed over time.
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
    /// What the table is for.
    pub doc: String,
    /// Its parameters, in the order in which a person would want to meet them.
    pub parameters: Vec<Descriptor>,
}

/// One name that a choice allows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Choice {
    /// The name in the file.
    pub name: &'static str,
    /// What it chooses.
    pub doc: &'static str,
}

/// What a parameter may be. Bounds are inclusive.
#[derive(Clone, Debug)]
pub enum Kind {
    /// `true` or `false`.
    Bool,
    /// A whole number.
    Integer {
        /// Least value.
        min: i64,
        /// Greatest value.
        max: i64,
    },
    /// A finite number.
    Number {
        /// Least value.
        min: f64,
        /// Greatest value.
        max: f64,
    },
    /// A positive number, or a fraction of whole numbers as a string.
    Rational {
        /// Least value.
        min: f64,
        /// Greatest value.
        max: f64,
    },
    /// A list of so many finite numbers.
    Vector {
        /// How many.
        length: usize,
        /// Least value of each.
        min: f64,
        /// Greatest value of each.
        max: f64,
    },
    /// Any text.
    Text,
    /// The path of an asset.
    Asset,
    /// One of some names.
    Choice(&'static [Choice]),
    /// Control points of a curve.
    Curve {
        /// Least and greatest x.
        x: [f64; 2],
        /// Least and greatest y.
        y: [f64; 2],
        /// Whether it must not fall.
        rising: bool,
    },
    /// The inner kind, or keys of it over time.
    Animated(Box<Kind>),
    /// The inner kind, or absent.
    Optional(Box<Kind>),
    /// The inner kind, or `"auto"`.
    Auto(Box<Kind>),
    /// A list.
    List {
        /// What each item is.
        item: Box<Kind>,
        /// Fewest items.
        min: usize,
        /// Most items.
        max: usize,
    },
    /// A table.
    Table(fn() -> &'static TableDescriptor),
}

impl Kind {
    /// What is expected, as an error message says it.
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
