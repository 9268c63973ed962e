//! Faults in what a file says, each with its place, what is wrong and what is allowed.

use super::{ModelError, Span};
use crate::host::{
    assets::AssetError,
    plural::{count_range, counted},
};

/// One fault.
#[derive(Clone, Debug, PartialEq)]
pub struct Problem {
    /// Where in the source; `None` where the fault is not in the text.
    pub span: Option<Span>,
    /// The parameter as an edit of a scene calls it, such as `flame_sheet.0.speed`; items of lists count from 0.
    pub path: String,
    /// What is wrong.
    pub kind: ProblemKind,
}

impl std::fmt::Display for Problem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if !self.path.is_empty() {
            write!(f, "{}{}: ", self.path, items(&self.path))?;
        }
        self.kind.fmt(f)
    }
}

/// What can be wrong.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ProblemKind {
    /// The text is not TOML.
    #[error("{0}")]
    Syntax(String),
    /// The text says more than is read: what it comes to in memory is a hundred times its own length.
    #[error(
        "the text holds more than {limit} values and tables (by its commas, dots, brackets, braces and equals signs); allowed: up to {limit}"
    )]
    TooManyValues {
        /// Most that are read.
        limit: usize,
    },
    /// The key means nothing here.
    #[error("unknown key `{}`{}; allowed: {}", excerpt(.key), did_you_mean(.nearest), .allowed.join(", "))]
    UnknownKey {
        /// The key.
        key: String,
        /// The allowed key most like it, if one is.
        nearest: Option<String>,
        /// All allowed keys.
        allowed: Vec<String>,
    },
    /// A value of another type.
    #[error("expected {expected}, found {found}")]
    WrongType {
        /// What is allowed.
        expected: String,
        /// What stands there.
        found: &'static str,
    },
    /// A number beyond its bounds, or not finite.
    #[error("{} is out of range; allowed: {min} to {max}{}", short(*.value), unit_suffix(.unit))]
    OutOfRange {
        /// The number.
        value: f64,
        /// Least allowed.
        min: f64,
        /// Greatest allowed.
        max: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// A name that is none of those allowed.
    #[error("`{}` is not known{}; allowed: {}", excerpt(.value), did_you_mean(.nearest), .allowed.join(", "))]
    NotOneOf {
        /// The name.
        value: String,
        /// The allowed name most like it, if one is.
        nearest: Option<String>,
        /// All allowed names.
        allowed: Vec<String>,
    },
    /// A keyed value that does not end a seamless loop as it begins it.
    #[error(
        "the loop of {seconds} s jumps: its first and its last moment differ; allowed: the same value at 0 s and at {seconds} s"
    )]
    LoopJumps {
        /// Length of the loop, s.
        seconds: f64,
    },
    /// A list too short or too long.
    #[error("has {}; allowed: {}", counted(*.found, "item"), count_range(*.min, *.max, "item"))]
    ListLength {
        /// How many it has.
        found: usize,
        /// Fewest allowed.
        min: usize,
        /// Most allowed.
        max: usize,
    },
    /// Control points or keys that make no curve.
    #[error("{0}")]
    Curve(#[from] crate::math::curve::CurveError),
    /// A curve that falls where it must rise.
    #[error("falls between x = {from} and x = {to}; it must rise or stay level from point to point")]
    NotRising {
        /// Where the fall begins.
        from: f64,
        /// Where it ends.
        to: f64,
    },
    /// Two things of one name.
    #[error("the name \"{name}\" is taken by another phenomenon; each needs its own")]
    DuplicateName {
        /// The name.
        name: String,
    },
    /// Two parameters that do not go together.
    #[error("{0}")]
    Conflict(String),
    /// What a model says of parameters that are each within their own bounds.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The file is of a newer format.
    #[error("format {found} is newer than this program knows; known: up to {known}")]
    NewerFormat {
        /// The file's format.
        found: i64,
        /// The newest known one.
        known: i64,
    },
    /// The file is of an older format.
    #[error("format {found} is old; `bansho upgrade` rewrites the file for format {known}")]
    OlderFormat {
        /// The file's format.
        found: i64,
        /// The newest known one.
        known: i64,
    },
    /// Something the scene refers to cannot be had.
    #[error("{0}")]
    Asset(#[from] AssetError),
}

/// The items of lists on a path as people count them, from 1 on: ` (shape 2, sheet 1)`. The first table of its kind needs no number.
fn items(path: &str) -> String {
    let segments: Vec<&str> = path.split('.').collect();
    let item = |(at, pair): (usize, &[&str])| {
        let index: usize = pair[1].parse().ok().filter(|index| at > 0 || *index > 0)?;
        Some(format!("{} {}", pair[0].strip_suffix('s').unwrap_or(pair[0]), index + 1))
    };
    let items: Vec<String> = segments.windows(2).enumerate().filter_map(item).collect();
    if items.is_empty() { String::new() } else { format!(" ({})", items.join(", ")) }
}

fn did_you_mean(nearest: &Option<String>) -> String {
    nearest.as_ref().map(|name| format!(", did you mean `{name}`?")).unwrap_or_default()
}

/// A number as people write it: powers of ten where plain digits would fill lines.
fn short(value: f64) -> String {
    let plain = value == 0.0 || !value.is_finite() || (1e-6..1e15).contains(&value.abs());
    if plain { value.to_string() } else { format!("{value:e}") }
}

/// Text that a file states as a message repeats it: its beginning, where it is long.
fn excerpt(text: &str) -> std::borrow::Cow<'_, str> {
    /// Characters; no name that a scene may state is as long.
    const LONGEST: usize = 80;
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}...", &text[..end]).into(),
        None => text.into(),
    }
}

fn unit_suffix(unit: &str) -> String {
    if unit.is_empty() { String::new() } else { format!(" {unit}") }
}

/// The candidate most like `word`, if one is alike enough to be a slip of the hand.
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    /// Bytes. Longer words are no slip of the hand, and comparing them takes the square of their length.
    const LONGEST: usize = 100;
    if word.len() > LONGEST {
        return None;
    }
    candidates
        .into_iter()
        .map(|candidate| (strsim::jaro_winkler(word, candidate), candidate))
        .filter(|(likeness, _)| *likeness > 0.8)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_as_short_as_people_write_them() {
        let shown = [0.0, -1.0, 2.5e-6, 1e6, 1e14, 1e300, -3.5e-9, f64::INFINITY].map(short);
        assert_eq!(shown, ["0", "-1", "0.0000025", "1000000", "100000000000000", "1e300", "-3.5e-9", "inf"]);
        let fault = ProblemKind::OutOfRange { value: 1e300, min: 0.0, max: 2.0, unit: "m" };
        assert_eq!(fault.to_string(), "1e300 is out of range; allowed: 0 to 2 m");
    }

    #[test]
    fn lists_say_how_many_items_in_the_right_number() {
        let told = |found, min, max| ProblemKind::ListLength { found, min, max }.to_string();
        assert_eq!(told(1, 2, 2), "has 1 item; allowed: exactly 2 items");
        assert_eq!(told(0, 1, 1), "has 0 items; allowed: exactly 1 item");
        assert_eq!(told(13, 1, 12), "has 13 items; allowed: 1 to 12 items");
    }

    #[test]
    fn of_long_words_the_beginning_is_told() {
        let key = "\u{e9}".repeat(1_000_000);
        let nearest = nearest(&key, ["speed"]).map(str::to_owned);
        let told = ProblemKind::UnknownKey { key, nearest, allowed: vec!["speed".into()] }.to_string();
        assert_eq!(told, format!("unknown key `{}...`; allowed: speed", "\u{e9}".repeat(80)));
        let value = "x".repeat(81);
        let told = ProblemKind::NotOneOf { value, nearest: None, allowed: vec!["a".into()] }.to_string();
        assert!(told.len() < 120, "{told}");
    }

    #[test]
    fn paths_are_what_one_types_and_their_items_count_from_one_beside_them() {
        let told =
            |path: &str| Problem { span: None, path: path.into(), kind: ProblemKind::Syntax("x".into()) }.to_string();
        assert_eq!(told("picture.size"), "picture.size: x");
        assert_eq!(told("rain.0.rate_mm_per_h"), "rain.0.rate_mm_per_h: x");
        assert_eq!(told("rain.1.rate_mm_per_h"), "rain.1.rate_mm_per_h (rain 2): x");
        assert_eq!(told("aurora.0.shapes.1.sheets.0"), "aurora.0.shapes.1.sheets.0 (shape 2, sheet 1): x");
    }
}
