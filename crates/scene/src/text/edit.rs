//! Changing a scene's text while its comments survive: `--set`, and `upgrade`.

use toml_edit::{Array, DocumentMut, Item, Table, TableLike, Value};

pub use super::upgrade::upgrade;

use super::toml;
use crate::{FORMAT, PhenomenonKind, SHARED_TABLES, suggest};

/// Why an edit cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EditError {
    /// The text is not TOML.
    #[error("the scene is not TOML: {0}")]
    Syntax(String),
    /// The assignment has no `=`, or no path of names before it.
    #[error(
        "`{0}` is no assignment; allowed: key.path=value, such as picture.size=[640,360] or flame_sheet.0.height=2"
    )]
    NoAssignment(String),
    /// The path leads nowhere.
    #[error("{} is not in the scene{}; there is: {there}", part(.path, .segment), did_you_mean(.meant))]
    NoSuchPlace {
        /// The whole path.
        path: String,
        /// The part that is not there.
        segment: String,
        /// What is there instead.
        there: String,
        /// Paths that may have been meant.
        meant: Vec<String>,
    },
    /// The value is nothing that TOML can say.
    #[error("`{0}` cannot stand in a scene")]
    NoValue(String),
    /// Nothing is keyed at that time.
    #[error("`{path}` has no key at {time} s")]
    NoKeyframe {
        /// What should be keyed.
        path: String,
        /// When, s.
        time: f64,
    },
    /// The scene's format is not one that this version can upgrade.
    #[error("format {found} is newer than this program knows; known: up to {FORMAT}")]
    NewerFormat {
        /// The scene's format.
        found: i64,
    },
}

/// The text with `assignment` carried out: `key.path=value`.
///
/// The value is TOML; a bare word is a string. Of the tables of a list a number or a name picks one (`rain.0.rate_mm_per_h`,
/// `flame_sheet.left log.height`, `flame_particles.0.burners.2.speed`); without it all are meant. `kinds` are the phenomena that a scene may hold.
///
/// # Errors
/// The text is no TOML, the assignment is malformed, or the path leads nowhere.
pub fn set(text: &str, assignment: &str, kinds: &[PhenomenonKind]) -> Result<String, EditError> {
    let mut document = document(text)?;
    let (path, value) = split(assignment)?;
    let value = parse_value(value);
    let segments: Vec<&str> = path.split('.').map(str::trim).collect();
    let root = document.as_table_mut();
    ensure_shared_table(root, &segments);
    let is_known = if segments.len() > 1 { root.contains_key(segments[0]) } else { is_root_key(segments[0], kinds) };
    if !is_known {
        let (path, segment, there) = (path.to_owned(), segments[0].to_owned(), keys(root));
        return Err(EditError::NoSuchPlace { meant: suggest::paths(text, &segments, kinds), path, segment, there });
    }
    set_in(root, &segments, &value, path)?;
    let edited = document.to_string();
    drop(document);
    // A value nested nearly as deep as readers go may lie too deep in the scene.
    check(&edited).map_err(|_| EditError::NoAssignment(assignment.to_owned()))?;
    Ok(edited)
}

/// A text as it can be edited.
pub(super) fn document(text: &str) -> Result<DocumentMut, EditError> {
    check_extent(text)?;
    text.parse().map_err(syntax)
}

/// Whether an edited text can be read again.
pub(super) fn check(text: &str) -> Result<(), EditError> {
    check_extent(text)?;
    toml_edit::Document::parse(text).map(drop).map_err(syntax)
}

fn check_extent(text: &str) -> Result<(), EditError> {
    toml::check_extent(text).map_err(|problem| EditError::Syntax(problem.kind.to_string()))
}

fn syntax(error: toml_edit::TomlError) -> EditError {
    EditError::Syntax(error.message().to_owned())
}

fn split(assignment: &str) -> Result<(&str, &str), EditError> {
    assignment
        .split_once('=')
        .map(|(path, value)| (path.trim(), value.trim()))
        .filter(|(path, value)| is_path(path) && !value.is_empty())
        .ok_or_else(|| EditError::NoAssignment(assignment.to_owned()))
}

/// Whether every part of a dotted path names something, and it is no deeper than TOML readers go.
fn is_path(path: &str) -> bool {
    /// Parts; scenes need five at most.
    const DEEPEST: usize = 16;
    path.split('.').all(|part| !part.trim().is_empty()) && path.split('.').count() <= DEEPEST
}

fn parse_value(text: &str) -> Value {
    text.parse().unwrap_or_else(|_| Value::from(text))
}

/// Whether anything of that name may stand at the root of a scene.
fn is_root_key(key: &str, kinds: &[PhenomenonKind]) -> bool {
    key == "bansho" || SHARED_TABLES.iter().any(|table| table.key == key) || kinds.iter().any(|kind| kind.key == key)
}

fn ensure_shared_table(root: &mut Table, segments: &[&str]) {
    let shared = SHARED_TABLES.iter().any(|table| !table.many && table.key == segments[0]);
    if shared && segments.len() > 1 && !root.contains_key(segments[0]) {
        root.insert(segments[0], Item::Table(Table::new()));
    }
}

/// Sets the value at what is left of a path within a table. Tables on the way are made; items of lists are not.
fn set_in(table: &mut dyn TableLike, segments: &[&str], value: &Value, path: &str) -> Result<(), EditError> {
    match segments {
        [] => Err(EditError::NoAssignment(path.to_owned())),
        [key] => {
            match table.get_mut(key) {
                Some(Item::Value(old)) => replace(old, value),
                _ => {
                    table.insert(key, Item::Value(value.clone()));
                }
            }
            Ok(())
        }
        [key, rest @ ..] => {
            if !table.contains_key(key) {
                if number(rest[0]).is_some() {
                    return Err(nowhere(path, key, keys(table)));
                }
                table.insert(key, Item::Value(toml_edit::InlineTable::new().into()));
            }
            match table.get_mut(key) {
                Some(Item::ArrayOfTables(tables)) => {
                    let tables = tables.iter_mut().map(|table| table as &mut dyn TableLike).collect();
                    set_in_list(tables, rest, value, path)
                }
                Some(Item::Value(Value::Array(items))) => set_in_items(items, rest, value, path),
                Some(item) => match item.as_table_like_mut() {
                    Some(inner) => set_in(inner, rest, value, path),
                    None => Err(nowhere(path, rest[0], format!("`{key}`, which is no table"))),
                },
                None => Err(nowhere(path, key, String::new())),
            }
        }
    }
}

/// The same within a list that stands in a line: of tables, or of plain values, of which a number picks one.
fn set_in_items(items: &mut Array, segments: &[&str], value: &Value, path: &str) -> Result<(), EditError> {
    if !items.is_empty() && items.iter().all(Value::is_inline_table) {
        let tables = items.iter_mut().filter_map(Value::as_inline_table_mut);
        return set_in_list(tables.map(|table| table as &mut dyn TableLike).collect(), segments, value, path);
    }
    let there = numbered(items.len(), "value");
    match (number(segments[0]).and_then(|index| items.get_mut(index)), segments.len()) {
        (Some(item), 1) => {
            replace(item, value);
            Ok(())
        }
        _ => Err(nowhere(path, segments[0], there)),
    }
}

/// The same within one of a list of tables, or within all of them where the path picks none.
fn set_in_list(tables: Vec<&mut dyn TableLike>, segments: &[&str], value: &Value, path: &str) -> Result<(), EditError> {
    let names: Vec<Option<String>> = tables.iter().map(|table| name(&**table)).collect();
    let first = segments[0];
    let by_name = names.iter().position(|name| segments.len() > 1 && name.as_deref() == Some(first));
    let (picked, rest) = match by_name.or_else(|| number(first)) {
        Some(index) if index < tables.len() => (Some(index), &segments[1..]),
        None if name_like(first) || tables.iter().any(|table| table.contains_key(first)) => (None, segments),
        _ => {
            let names = names.into_iter().flatten().map(|name| format!(" or {name}"));
            return Err(nowhere(path, first, numbered(tables.len(), "table") + &names.collect::<String>()));
        }
    };
    let mut meant = tables.into_iter().enumerate().filter(|(index, _)| picked.is_none_or(|picked| picked == *index));
    meant.try_for_each(|(_, table)| set_in(table, rest, value, path))
}

/// Replaces a value; the space and the comment around it stay.
pub(super) fn replace(old: &mut Value, value: &Value) {
    let decor = old.decor().clone();
    *old = value.clone();
    *old.decor_mut() = decor;
}

fn name(table: &dyn TableLike) -> Option<String> {
    table.get("name").and_then(Item::as_str).map(str::to_owned)
}

fn number(segment: &str) -> Option<usize> {
    segment.parse().ok()
}

/// Whether a segment looks like a key rather than like a phenomenon's name or number.
fn name_like(segment: &str) -> bool {
    let key_like = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'_';
    number(segment).is_none() && segment.bytes().all(key_like)
}

/// The items that a list has.
fn numbered(count: usize, what: &str) -> String {
    match count {
        0 => format!("no {what} in it"),
        1 => format!("{what} 0"),
        _ => format!("{what}s 0 to {}", count - 1),
    }
}

fn keys(table: &dyn TableLike) -> String {
    table.iter().map(|(key, _)| key).collect::<Vec<_>>().join(", ")
}

fn nowhere(path: &str, segment: &str, there: String) -> EditError {
    EditError::NoSuchPlace { path: path.to_owned(), segment: segment.to_owned(), there, meant: Vec::new() }
}

/// The part of a path that leads nowhere.
fn part(path: &str, segment: &str) -> String {
    if path == segment { format!("`{path}`") } else { format!("`{path}`: {segment}") }
}

fn did_you_mean(meant: &[String]) -> String {
    let meant: Vec<String> = meant.iter().map(|path| format!("`{path}`")).collect();
    if meant.is_empty() { String::new() } else { format!(", did you mean {}?", meant.join(" or ")) }
}
