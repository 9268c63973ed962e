//! Assignments to parameters in a scene's text: `--set`.

use toml_edit::{Array, InlineTable, Item, Table, TableLike, Value};

use super::{EditError, check_edited, parse_document, replace_value, suggest_path::suggest_paths};
use bansho_base::tables::{self, TableKind};

/// Applies `assignment`, in the form `key.path=value`, to a scene's text.
///
/// The value is TOML; a bare word is a string. A number or a name selects a table of a list (`rain.0.rate_mm_per_h`,
/// `flame_sheet.left log.height`, `flame_particles.0.burners.2.speed`); without it, the assignment applies to all of them. `kinds` are the
/// tables that a scene may contain.
///
/// # Errors
/// The text is not TOML, the assignment is malformed, or the path does not exist.
pub fn set(text: &str, assignment: &str, kinds: &[TableKind]) -> Result<String, EditError> {
    let mut document = parse_document(text)?;
    let (path, value) = split(assignment)?;
    let value = parse_value(value);
    let segments: Vec<&str> = path.split('.').map(str::trim).collect();
    let root = document.as_table_mut();
    ensure_shared_table(root, &segments, kinds);
    let is_known = if segments.len() > 1 { root.contains_key(segments[0]) } else { is_root_key(segments[0], kinds) };
    if !is_known {
        let (path, segment, available) = (path.to_owned(), segments[0].to_owned(), keys(root));
        let suggestions = suggest_paths(text, &segments, kinds);
        return Err(EditError::NoSuchPath { path, segment, available, suggestions });
    }
    set_in_table(root, &segments, &value, path)?;
    let edited = document.to_string();
    drop(document);
    // A value that is nested nearly as deep as the parser allows may be nested too deep within the scene.
    check_edited(&edited).map_err(|_| EditError::InvalidAssignment(assignment.to_owned()))?;
    Ok(edited)
}

fn split(assignment: &str) -> Result<(&str, &str), EditError> {
    assignment
        .split_once('=')
        .map(|(path, value)| (path.trim(), value.trim()))
        .filter(|(path, value)| is_path(path) && !value.is_empty())
        .ok_or_else(|| EditError::InvalidAssignment(assignment.to_owned()))
}

/// Whether no segment of a dotted path is empty, and it is not too deep for the parser.
fn is_path(path: &str) -> bool {
    /// Maximum number of segments; scenes need at most five.
    const MAX_SEGMENTS: usize = 16;
    path.split('.').all(|segment| !segment.trim().is_empty()) && path.split('.').count() <= MAX_SEGMENTS
}

fn parse_value(text: &str) -> Value {
    text.parse().unwrap_or_else(|_| Value::from(text))
}

/// Whether a scene may have this key at its root.
fn is_root_key(key: &str, kinds: &[TableKind]) -> bool {
    key == "bansho" || tables::find(kinds, key).is_some()
}

fn ensure_shared_table(root: &mut Table, segments: &[&str], kinds: &[TableKind]) {
    let shared = tables::find(kinds, segments[0]).is_some_and(|kind| !kind.is_list());
    if shared && segments.len() > 1 && !root.contains_key(segments[0]) {
        root.insert(segments[0], Item::Table(Table::new()));
    }
}

/// Sets the value at the remaining `segments` of a path within a table. Missing tables are created, missing items of lists are not.
fn set_in_table(table: &mut dyn TableLike, segments: &[&str], value: &Value, path: &str) -> Result<(), EditError> {
    match segments {
        [] => Err(EditError::InvalidAssignment(path.to_owned())),
        [key] => {
            match table.get_mut(key) {
                Some(Item::Value(old)) => replace_value(old, value.clone()),
                _ => {
                    table.insert(key, Item::Value(value.clone()));
                }
            }
            Ok(())
        }
        [key, rest @ ..] => {
            if !table.contains_key(key) {
                if number(rest[0]).is_some() {
                    return Err(no_such_path(path, key, keys(table)));
                }
                table.insert(key, Item::Value(InlineTable::new().into()));
            }
            match table.get_mut(key) {
                Some(Item::ArrayOfTables(tables)) => {
                    let tables = tables.iter_mut().map(|table| table as &mut dyn TableLike).collect();
                    set_in_tables(tables, rest, value, path)
                }
                Some(Item::Value(Value::Array(items))) => set_in_array(items, rest, value, path),
                Some(item) => match item.as_table_like_mut() {
                    Some(inner) => set_in_table(inner, rest, value, path),
                    None => Err(no_such_path(path, rest[0], format!("`{key}`, which is not a table"))),
                },
                None => Err(no_such_path(path, key, String::new())),
            }
        }
    }
}

/// The same within an inline list: of tables, or of plain values, one of which is selected by its number.
fn set_in_array(items: &mut Array, segments: &[&str], value: &Value, path: &str) -> Result<(), EditError> {
    if !items.is_empty() && items.iter().all(Value::is_inline_table) {
        let tables = items.iter_mut().filter_map(Value::as_inline_table_mut);
        return set_in_tables(tables.map(|table| table as &mut dyn TableLike).collect(), segments, value, path);
    }
    let available = numbered(items.len(), "value");
    match (number(segments[0]).and_then(|index| items.get_mut(index)), segments.len()) {
        (Some(item), 1) => {
            replace_value(item, value.clone());
            Ok(())
        }
        _ => Err(no_such_path(path, segments[0], available)),
    }
}

/// The same within one table of a list, or within all of them if the path selects none.
fn set_in_tables(
    tables: Vec<&mut dyn TableLike>,
    segments: &[&str],
    value: &Value,
    path: &str,
) -> Result<(), EditError> {
    let names: Vec<Option<String>> = tables.iter().map(|table| name(&**table)).collect();
    let first = segments[0];
    let by_name = names.iter().position(|name| segments.len() > 1 && name.as_deref() == Some(first));
    let (picked, rest) = match by_name.or_else(|| number(first)) {
        Some(index) if index < tables.len() => (Some(index), &segments[1..]),
        None if is_key_like(first) || tables.iter().any(|table| table.contains_key(first)) => (None, segments),
        _ => {
            let names = names.into_iter().flatten().map(|name| format!(" or {name}"));
            return Err(no_such_path(path, first, numbered(tables.len(), "table") + &names.collect::<String>()));
        }
    };
    let mut selected = tables.into_iter().enumerate().filter(|(index, _)| picked.is_none_or(|picked| picked == *index));
    selected.try_for_each(|(_, table)| set_in_table(table, rest, value, path))
}

fn name(table: &dyn TableLike) -> Option<String> {
    table.get("name").and_then(Item::as_str).map(str::to_owned)
}

fn number(segment: &str) -> Option<usize> {
    segment.parse().ok()
}

/// Whether a segment looks like a key rather than like a phenomenon's name or number.
fn is_key_like(segment: &str) -> bool {
    number(segment).is_none() && segment.bytes().all(|byte| matches!(byte, b'a'..=b'z' | b'0'..=b'9' | b'_'))
}

/// The numbers of the items of a list, for messages.
fn numbered(count: usize, what: &str) -> String {
    match count {
        0 => format!("no {what}"),
        1 => format!("{what} 0"),
        _ => format!("{what}s 0 to {}", count - 1),
    }
}

fn keys(table: &dyn TableLike) -> String {
    table.iter().map(|(key, _)| key).collect::<Vec<_>>().join(", ")
}

fn no_such_path(path: &str, segment: &str, available: String) -> EditError {
    EditError::NoSuchPath { path: path.to_owned(), segment: segment.to_owned(), available, suggestions: Vec::new() }
}
