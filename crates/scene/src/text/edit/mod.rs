//! Edits of a scene's text that keep its comments: `--set`, and operations of editors. What they share is here: the text as a document, and what can be
//! wrong with an edit.

pub mod operation;
mod set;
mod suggest_path;

use toml_edit::{DocumentMut, Value};

use super::toml;

pub use self::set::set;

/// Why an edit is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EditError {
    /// The text is not TOML.
    #[error("the scene is not TOML: {0}")]
    Syntax(String),
    /// The assignment has no `=`, no valid path before it, or no value after it.
    #[error(
        "`{0}` is not an assignment; allowed: key.path=value, such as picture.size=[640,360] or flame_sheet.0.height=2"
    )]
    InvalidAssignment(String),
    /// The path does not exist in the scene.
    #[error("{} is not in the scene{}; available: {available}", at_segment(.path, .segment), did_you_mean(.suggestions))]
    NoSuchPath {
        /// The whole path.
        path: String,
        /// Its first segment that does not exist.
        segment: String,
        /// What exists instead.
        available: String,
        /// Similar paths that exist.
        suggestions: Vec<String>,
    },
    /// The value cannot be written as TOML.
    #[error("`{0}` cannot be a value of a scene")]
    InvalidValue(String),
    /// There is no keyframe at this time.
    #[error("`{path}` has no key at {time} s")]
    NoKeyframe {
        /// Path of the value.
        path: String,
        /// The time, s.
        time: f64,
    },
}

/// Parses a text for editing.
fn parse_document(text: &str) -> Result<DocumentMut, EditError> {
    check_size(text)?;
    text.parse().map_err(syntax_error)
}

/// Checks that an edited text can be parsed again.
fn check_edited(text: &str) -> Result<(), EditError> {
    check_size(text)?;
    toml_edit::Document::parse(text).map(drop).map_err(syntax_error)
}

fn check_size(text: &str) -> Result<(), EditError> {
    toml::check_value_count(text).map_err(|problem| EditError::Syntax(problem.kind.to_string()))
}

fn syntax_error(error: toml_edit::TomlError) -> EditError {
    EditError::Syntax(error.message().to_owned())
}

/// Replaces a value and keeps the whitespace and the comment around it.
fn replace_value(old: &mut Value, value: Value) {
    let decor = old.decor().clone();
    *old = value;
    *old.decor_mut() = decor;
}

/// The path, and its segment that does not exist.
fn at_segment(path: &str, segment: &str) -> String {
    if path == segment { format!("`{path}`") } else { format!("`{path}`: {segment}") }
}

fn did_you_mean(suggestions: &[String]) -> String {
    let suggestions: Vec<String> = suggestions.iter().map(|path| format!("`{path}`")).collect();
    if suggestions.is_empty() { String::new() } else { format!(", did you mean {}?", suggestions.join(" or ")) }
}
