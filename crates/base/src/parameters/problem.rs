//! Problems in a scene file, each with its location, what is wrong and what is allowed.

use super::{ModelError, Span};
use crate::host::{
    assets::AssetError,
    plural::{count_range, counted},
};

/// A problem in a scene file.
#[derive(Clone, Debug, PartialEq)]
pub struct Problem {
    /// Location in the source; `None` if the problem is not in the text.
    pub span: Option<Span>,
    /// Path of the parameter in the syntax of scene edits, such as `flame_sheet.0.speed`; items of lists count from 0.
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

/// Kinds of problems.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ProblemKind {
    /// The text is not valid TOML.
    #[error("{0}")]
    Syntax(String),
    /// The text contains too many values: in memory they take a hundred times its length.
    #[error(
        "the text contains more than {limit} values and tables (by its commas, dots, brackets, braces and equals signs); allowed: up to {limit}"
    )]
    TooManyValues {
        /// Maximum number that is read.
        limit: usize,
    },
    /// The key is unknown here.
    #[error("unknown key `{}`{}; allowed: {}", excerpt(.key), did_you_mean(.nearest), .allowed.join(", "))]
    UnknownKey {
        /// The key.
        key: String,
        /// The most similar allowed key, if any.
        nearest: Option<String>,
        /// All allowed keys.
        allowed: Vec<String>,
    },
    /// A kind of phenomenon that this program was built without.
    #[error("`{key}` is not supported by this build; enable the feature `{feature}` of the crate `bansho`")]
    FeatureDisabled {
        /// Key of the kind.
        key: &'static str,
        /// The feature that enables it.
        feature: &'static str,
    },
    /// A value has the wrong type.
    #[error("expected {expected}, found {found}")]
    WrongType {
        /// The expected type.
        expected: String,
        /// The type found.
        found: &'static str,
    },
    /// A number is out of bounds or not finite.
    #[error("{} is out of range; allowed: {min} to {max}{}", short(*.value), unit_suffix(.unit))]
    OutOfRange {
        /// The number.
        value: f64,
        /// Minimum allowed.
        min: f64,
        /// Maximum allowed.
        max: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// A name is not one of those allowed.
    #[error("unknown value `{}`{}; allowed: {}", excerpt(.value), did_you_mean(.nearest), .allowed.join(", "))]
    NotOneOf {
        /// The name.
        value: String,
        /// The most similar allowed name, if any.
        nearest: Option<String>,
        /// All allowed names.
        allowed: Vec<String>,
    },
    /// A keyframed value differs at the start and the end of a seamless loop.
    #[error(
        "the loop of {seconds} s is not seamless: the value differs between its beginning and its end; allowed: the same value at 0 s and at {seconds} s"
    )]
    LoopJumps {
        /// Length of the loop, s.
        seconds: f64,
    },
    /// A list is too short or too long.
    #[error("has {}; allowed: {}", counted(*.found, "item"), count_range(*.min, *.max, "item"))]
    ListLength {
        /// Number of items.
        found: usize,
        /// Minimum allowed.
        min: usize,
        /// Maximum allowed.
        max: usize,
    },
    /// Control points or keys do not define a curve.
    #[error("{0}")]
    Curve(#[from] crate::math::curve::CurveError),
    /// A curve decreases although it must not.
    #[error("decreases between x = {from} and x = {to}; allowed: values that never decrease")]
    NotRising {
        /// x where the decrease starts.
        from: f64,
        /// x where it ends.
        to: f64,
    },
    /// Two phenomena have the same name.
    #[error("another phenomenon is already called \"{name}\"; allowed: a unique name")]
    DuplicateName {
        /// The name.
        name: String,
    },
    /// Two parameters contradict each other.
    #[error("{0}")]
    Conflict(String),
    /// An error of a model in parameters that are each within their bounds.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The file has another format than this version reads.
    #[error("format {found} cannot be read by this version; allowed: {allowed}")]
    UnsupportedFormat {
        /// The file's format.
        found: i64,
        /// The format that this version reads.
        allowed: i64,
    },
    /// An asset that the scene refers to could not be loaded.
    #[error("{0}")]
    Asset(#[from] AssetError),
}

/// An error that is only detected when a phenomenon, an obstacle or a plate is built from its parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct BuildError {
    /// Key of the invalid parameter, with sub-tables separated by dots.
    pub key: String,
    /// What is wrong.
    pub kind: ProblemKind,
}

impl BuildError {
    /// An error of a model at the parameter `key`.
    pub fn new(key: impl Into<String>, error: impl std::error::Error + Send + Sync + 'static) -> Self {
        Self { key: key.into(), kind: ModelError::new(error).into() }
    }
}

/// The list items on a path, counted from 1: ` (shape 2, sheet 1)`. The first table of its kind needs no number.
fn items(path: &str) -> String {
    let segments: Vec<&str> = path.split('.').collect();
    let items = segments.windows(2).enumerate().filter_map(|(depth, pair)| {
        let index: usize = pair[1].parse().ok().filter(|index| depth > 0 || *index > 0)?;
        Some(format!("{} {}", pair[0].strip_suffix('s').unwrap_or(pair[0]), index + 1))
    });
    let items: Vec<String> = items.collect();
    if items.is_empty() { String::new() } else { format!(" ({})", items.join(", ")) }
}

fn did_you_mean(nearest: &Option<String>) -> String {
    nearest.as_ref().map(|name| format!(", did you mean `{name}`?")).unwrap_or_default()
}

/// A number in plain notation, or in scientific notation if it would be long.
fn short(value: f64) -> String {
    let is_plain = value == 0.0 || !value.is_finite() || (1e-6..1e15).contains(&value.abs());
    if is_plain { value.to_string() } else { format!("{value:e}") }
}

/// Text from a file for use in messages; only its beginning if it is long.
fn excerpt(text: &str) -> std::borrow::Cow<'_, str> {
    /// Maximum number of characters; no valid name in a scene is as long.
    const MAX_CHARACTERS: usize = 80;
    match text.char_indices().nth(MAX_CHARACTERS) {
        Some((end, _)) => format!("{}...", &text[..end]).into(),
        None => text.into(),
    }
}

fn unit_suffix(unit: &str) -> String {
    if unit.is_empty() { String::new() } else { format!(" {unit}") }
}

/// The candidate most similar to `word`, if one is similar enough for `word` to be a typo.
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    /// Maximum length in bytes. Longer words are not typos, and the time of the comparison is quadratic in their length.
    const MAX_BYTES: usize = 100;
    if word.len() > MAX_BYTES {
        return None;
    }
    candidates
        .into_iter()
        .map(|candidate| (strsim::jaro_winkler(word, candidate), candidate))
        .filter(|(similarity, _)| *similarity > 0.8)
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
        let problem = ProblemKind::OutOfRange { value: 1e300, min: 0.0, max: 2.0, unit: "m" };
        assert_eq!(problem.to_string(), "1e300 is out of range; allowed: 0 to 2 m");
    }

    #[test]
    fn lists_say_how_many_items_in_the_right_number() {
        let message = |found, min, max| ProblemKind::ListLength { found, min, max }.to_string();
        assert_eq!(message(1, 2, 2), "has 1 item; allowed: exactly 2 items");
        assert_eq!(message(0, 1, 1), "has 0 items; allowed: exactly 1 item");
        assert_eq!(message(13, 1, 12), "has 13 items; allowed: 1 to 12 items");
    }

    #[test]
    fn of_long_words_the_beginning_is_told() {
        let key = "\u{e9}".repeat(1_000_000);
        let nearest = nearest(&key, ["speed"]).map(str::to_owned);
        let message = ProblemKind::UnknownKey { key, nearest, allowed: vec!["speed".into()] }.to_string();
        assert_eq!(message, format!("unknown key `{}...`; allowed: speed", "\u{e9}".repeat(80)));
        let value = "x".repeat(81);
        let message = ProblemKind::NotOneOf { value, nearest: None, allowed: vec!["a".into()] }.to_string();
        assert!(message.len() < 120, "{message}");
    }

    #[test]
    fn paths_are_what_one_types_and_their_items_count_from_one_beside_them() {
        let message =
            |path: &str| Problem { span: None, path: path.into(), kind: ProblemKind::Syntax("x".into()) }.to_string();
        assert_eq!(message("picture.size"), "picture.size: x");
        assert_eq!(message("rain.0.rate_mm_per_h"), "rain.0.rate_mm_per_h: x");
        assert_eq!(message("rain.1.rate_mm_per_h"), "rain.1.rate_mm_per_h (rain 2): x");
        assert_eq!(message("aurora.0.shapes.1.sheets.0"), "aurora.0.shapes.1.sheets.0 (shape 2, sheet 1): x");
    }
}
