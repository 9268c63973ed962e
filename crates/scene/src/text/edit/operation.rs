//! Operations of editors on a scene's text. Everything that an operation does not change is kept, including comments.

use bansho_base::parameters::{Table as Values, Value};
use toml_edit::{Array, ArrayOfTables, InlineTable, Item, Table, TableLike, Value as TomlValue};

use super::{EditError, check_edited, parse_document, replace_value};
use crate::text::path::{Segment, ValuePath};

/// One change of a scene.
#[derive(Clone, Debug, PartialEq)]
pub enum Operation {
    /// Sets the value at `path`, or replaces it. Missing tables on the path are created, also as the first item of a list.
    Set {
        /// Path of the value.
        path: ValuePath,
        /// The value.
        value: Value,
    },
    /// Removes a parameter, which then has its default, or an item of a list.
    Remove {
        /// Path of the value.
        path: ValuePath,
    },
    /// Adds an item at the end of a list, which is created if it does not exist.
    Append {
        /// Path of the list.
        path: ValuePath,
        /// The item.
        value: Value,
    },
    /// Adds a keyframe, or replaces the one at this time. A constant becomes animated by this single keyframe.
    SetKeyframe {
        /// Path of the animated value.
        path: ValuePath,
        /// Time of the keyframe, s.
        time: f64,
        /// The value at this time.
        value: Value,
    },
    /// Removes a keyframe. If it is the last one, its value becomes a constant.
    RemoveKeyframe {
        /// Path of the animated value.
        path: ValuePath,
        /// Time of the keyframe, s.
        time: f64,
    },
}

impl Operation {
    /// The path that it changes.
    pub fn path(&self) -> &ValuePath {
        match self {
            Self::Set { path, .. }
            | Self::Remove { path }
            | Self::Append { path, .. }
            | Self::SetKeyframe { path, .. }
            | Self::RemoveKeyframe { path, .. } => path,
        }
    }
}

/// Two keyframes that are closer than this are the same, s: much less than a frame, more than rounding errors.
const SAME_TIME_S: f64 = 1e-6;

/// Applies all `operations` to the text, in order.
///
/// # Errors
/// The text is not TOML, the path of an operation does not exist, or its value cannot be a value of a scene. Then no operation is applied.
pub fn apply(text: &str, operations: &[Operation]) -> Result<String, EditError> {
    let mut document = parse_document(text)?;
    for operation in operations {
        apply_operation(document.as_table_mut(), operation)?;
    }
    let edited = document.to_string();
    drop(document);
    check_edited(&edited).map(|()| edited)
}

fn apply_operation(root: &mut Table, operation: &Operation) -> Result<(), EditError> {
    match operation {
        Operation::Set { path, value } => match (path.segments(), value) {
            ([Segment::Key(key)], Value::Table(values)) => set_root_table(root, key, values),
            _ => set(root, path, to_toml(value)?),
        },
        Operation::Remove { path } => remove(root, path),
        Operation::Append { path, value } => append(root, path, value),
        Operation::SetKeyframe { path, time, value } => set_keyframe(root, path, *time, &to_toml(value)?),
        Operation::RemoveKeyframe { path, time } => remove_keyframe(root, path, *time),
    }
}

fn to_toml(value: &Value) -> Result<TomlValue, EditError> {
    value.to_string().parse().map_err(|_| EditError::InvalidValue(value.to_string()))
}

/// A node of the document that a path leads to.
enum Slot<'a> {
    /// A table under a header.
    HeaderTable(&'a mut Table),
    /// A table within a line, in braces.
    InlineTable(&'a mut InlineTable),
    /// Tables under headers in double brackets.
    Tables(&'a mut ArrayOfTables),
    Value(&'a mut TomlValue),
}

impl<'a> Slot<'a> {
    fn of_item(item: &'a mut Item) -> Option<Self> {
        match item {
            Item::None => None,
            Item::Value(value) => Some(Self::of_value(value)),
            Item::Table(table) => Some(Self::HeaderTable(table)),
            Item::ArrayOfTables(tables) => Some(Self::Tables(tables)),
        }
    }

    fn of_value(value: &'a mut TomlValue) -> Self {
        match value {
            TomlValue::InlineTable(table) => Self::InlineTable(table),
            other => Self::Value(other),
        }
    }

    /// The table, if it is one.
    fn table(self) -> Option<&'a mut dyn TableLike> {
        match self {
            Self::HeaderTable(table) => Some(table),
            Self::InlineTable(table) => Some(table),
            Self::Tables(_) | Self::Value(_) => None,
        }
    }

    fn into(self, segment: &Segment) -> Option<Self> {
        match (self, segment) {
            (Self::HeaderTable(table), Segment::Key(key)) => Self::of_item(table.get_mut(key)?),
            (Self::InlineTable(table), Segment::Key(key)) => Some(Self::of_value(table.get_mut(key)?)),
            (Self::Tables(tables), Segment::Index(index)) => Some(Self::HeaderTable(tables.get_mut(*index)?)),
            (Self::Value(TomlValue::Array(items)), Segment::Index(index)) => {
                Some(Self::of_value(items.get_mut(*index)?))
            }
            _ => None,
        }
    }
}

fn no_such_path(path: &ValuePath, segment: &Segment) -> EditError {
    let segment = match segment {
        Segment::Key(key) => key.clone(),
        Segment::Index(index) => index.to_string(),
    };
    let available = "nothing with this name or number".to_owned();
    EditError::NoSuchPath { path: path.to_string(), segment, available, suggestions: Vec::new() }
}

/// The parent of the value at `path`, and the last segment of the path. Missing tables, also as first items of lists, are created if `create`
/// is set.
fn parent<'a, 'p>(
    root: &'a mut Table,
    path: &'p ValuePath,
    create: bool,
) -> Result<(Slot<'a>, &'p Segment), EditError> {
    let Some((last, parents)) = path.segments().split_last() else {
        return Err(EditError::InvalidAssignment(String::new()));
    };
    let mut slot = Slot::HeaderTable(root);
    for (depth, segment) in parents.iter().enumerate() {
        if let (true, Segment::Key(key)) = (create, segment) {
            let inline = match path.segments().get(depth + 1) {
                Some(Segment::Index(0)) => Array::from_iter([InlineTable::new()]).into(),
                _ => TomlValue::from(InlineTable::new()),
            };
            match &mut slot {
                // A table at the root gets a header; a nested one is inline.
                Slot::HeaderTable(table) if !table.contains_key(key) => {
                    table.insert(key, if depth == 0 { Item::Table(Table::new()) } else { inline.into() });
                }
                Slot::InlineTable(table) if !table.contains_key(key) => {
                    table.insert(key, inline);
                }
                _ => {}
            }
        }
        slot = slot.into(segment).ok_or_else(|| no_such_path(path, segment))?;
    }
    Ok((slot, last))
}

fn set(root: &mut Table, path: &ValuePath, value: TomlValue) -> Result<(), EditError> {
    let (slot, last) = parent(root, path, true)?;
    match (slot, last) {
        (Slot::Value(TomlValue::Array(items)), Segment::Index(index)) if *index < items.len() => {
            if let Some(old) = items.get_mut(*index) {
                replace_value(old, value);
            }
        }
        (slot, last) => {
            let (Some(table), Segment::Key(key)) = (slot.table(), last) else { return Err(no_such_path(path, last)) };
            match table.get_mut(key) {
                Some(Item::Value(old)) => replace_value(old, value),
                _ => {
                    table.insert(key, Item::Value(value));
                }
            }
        }
    }
    Ok(())
}

/// Sets a table of the scene itself, which has a header, in its place and below its comments if there is one already.
fn set_root_table(root: &mut Table, key: &str, values: &Values) -> Result<(), EditError> {
    let mut table = header_table(values)?;
    if let Some(Item::Table(old)) = root.get(key) {
        table.set_position(old.position());
        *table.decor_mut() = old.decor().clone();
    }
    root.insert(key, Item::Table(table));
    Ok(())
}

fn remove(root: &mut Table, path: &ValuePath) -> Result<(), EditError> {
    let (slot, last) = parent(root, path, false)?;
    let removed = match (slot, last) {
        (Slot::HeaderTable(table), Segment::Key(key)) => table.remove(key).is_some(),
        (Slot::InlineTable(table), Segment::Key(key)) => table.remove(key).is_some(),
        (Slot::Tables(tables), Segment::Index(index)) if *index < tables.len() => {
            tables.remove(*index);
            true
        }
        (Slot::Value(TomlValue::Array(items)), Segment::Index(index)) if *index < items.len() => {
            remove_item(items, *index);
            true
        }
        _ => false,
    };
    if removed { Ok(()) } else { Err(no_such_path(path, last)) }
}

fn append(root: &mut Table, path: &ValuePath, value: &Value) -> Result<(), EditError> {
    let (slot, last) = parent(root, path, true)?;
    let has_header = matches!(slot, Slot::HeaderTable(_));
    let (Some(table), Segment::Key(key)) = (slot.table(), last) else { return Err(no_such_path(path, last)) };
    if !table.contains_key(key) {
        // Tables get headers at the root; nested ones only if they contain tables themselves, which would make a long line.
        let at_root = path.segments().len() == 1;
        let use_headers = has_header && matches!(value, Value::Table(values) if at_root || contains_tables(values));
        let list = if use_headers { Item::ArrayOfTables(ArrayOfTables::new()) } else { Array::new().into() };
        table.insert(key, list);
    }
    match (table.get_mut(key), value) {
        (Some(Item::ArrayOfTables(tables)), Value::Table(values)) => tables.push(header_table(values)?),
        (Some(Item::Value(TomlValue::Array(items))), value) => push_item(items, to_toml(value)?),
        _ => return Err(no_such_path(path, last)),
    }
    Ok(())
}

/// Whitespace and comments before an item, or before the end of a list.
struct Leading {
    /// Up to the end of the previous line. A comment in it belongs to the previous item.
    rest_of_line: String,
    /// The following lines. Comments in them belong to this item.
    lines: String,
}

fn leading(items: &Array, index: usize) -> Leading {
    let all = match items.get(index) {
        Some(item) => item.decor().prefix().and_then(|prefix| prefix.as_str()),
        None => items.trailing().as_str(),
    };
    let all = all.unwrap_or_default();
    let (rest_of_line, lines) = all.split_at(all.find('\n').unwrap_or(0));
    Leading { rest_of_line: rest_of_line.to_owned(), lines: lines.to_owned() }
}

/// Removes an item of a list together with the comment after it on its line.
fn remove_item(items: &mut Array, index: usize) {
    let Leading { rest_of_line, .. } = leading(items, index);
    let Leading { lines, .. } = leading(items, index + 1);
    items.remove(index);
    if lines.is_empty() {
        return;
    }
    let all = rest_of_line + &lines;
    match items.get_mut(index) {
        Some(next) => next.decor_mut().set_prefix(all),
        None => items.set_trailing(all),
    }
}

/// Adds an item at the end of a list. In a list with one item a line it gets its own line, after the comment of the previous item.
fn push_item(items: &mut Array, value: TomlValue) {
    let end = items.len();
    let Leading { rest_of_line, lines } = leading(items, end);
    let Leading { lines: lines_before_last, .. } = leading(items, end.saturating_sub(1));
    items.push(value);
    if lines.is_empty() || !items.trailing_comma() {
        return;
    }
    if let Some(item) = items.get_mut(end) {
        // The same indentation as the last item, without the comments above that.
        let indentation = lines_before_last.rfind('\n').map_or(lines.as_str(), |at| &lines_before_last[at..]);
        item.decor_mut().set_prefix(format!("{rest_of_line}{indentation}"));
    }
    items.set_trailing(lines);
}

/// Whether a table contains lists of tables.
fn contains_tables(values: &Values) -> bool {
    values.entries.iter().any(|entry| match &entry.node.value {
        Value::List(items) => items.iter().any(|item| matches!(item.value, Value::Table(_))),
        _ => false,
    })
}

/// A table under a header, with an empty line before it.
fn header_table(values: &Values) -> Result<Table, EditError> {
    let mut table = Table::new();
    for entry in &values.entries {
        table.insert(&entry.key, Item::Value(to_toml(&entry.node.value)?));
    }
    table.decor_mut().set_prefix("\n");
    Ok(table)
}

/// The keyframes of the value at `path`, if it is animated.
fn keyframes<'a>(root: &'a mut Table, path: &ValuePath) -> Option<&'a mut Array> {
    let (slot, last) = parent(root, path, false).ok()?;
    slot.into(last)?.table()?.get_mut("keys")?.as_array_mut()
}

fn time_of(key: &TomlValue) -> Option<f64> {
    let time = key.as_array()?.get(0)?;
    time.as_float().or_else(|| time.as_integer().map(|whole| whole as f64))
}

fn is_at(key: &TomlValue, time: f64) -> bool {
    time_of(key).is_some_and(|key_time| (key_time - time).abs() <= SAME_TIME_S)
}

/// Separates items by one space, without a space before the first. Line breaks and comments are kept.
fn normalize_spaces(items: &mut Array) {
    for (index, item) in items.iter_mut().enumerate() {
        let prefix = item.decor().prefix().and_then(|prefix| prefix.as_str()).unwrap_or_default();
        if prefix.chars().all(|character| character == ' ') {
            item.decor_mut().set_prefix(if index == 0 { "" } else { " " });
        }
    }
}

fn set_keyframe(root: &mut Table, path: &ValuePath, time: f64, value: &TomlValue) -> Result<(), EditError> {
    let key = Array::from_iter([TomlValue::from(time), value.clone()]);
    let Some(keys) = keyframes(root, path) else {
        let mut animated = InlineTable::new();
        animated.insert("keys", Array::from_iter([key]).into());
        return set(root, path, animated.into());
    };
    let existing = keys.iter().position(|key| is_at(key, time));
    match existing {
        Some(index) => {
            if let Some(old) = keys.get_mut(index).and_then(|key| key.as_array_mut()?.get_mut(1)) {
                replace_value(old, value.clone());
            }
        }
        None => {
            let earlier = keys.iter().take_while(|key| time_of(key).is_some_and(|key_time| key_time < time)).count();
            keys.insert(earlier, key);
            normalize_spaces(keys);
        }
    }
    Ok(())
}

fn remove_keyframe(root: &mut Table, path: &ValuePath, time: f64) -> Result<(), EditError> {
    let missing = EditError::NoKeyframe { path: path.to_string(), time };
    let Some(keys) = keyframes(root, path) else { return Err(missing) };
    let Some(index) = keys.iter().position(|key| is_at(key, time)) else { return Err(missing) };
    if keys.len() > 1 {
        keys.remove(index);
        normalize_spaces(keys);
        return Ok(());
    }
    // The last keyframe leaves its value as a constant.
    match keys.get(index).and_then(|key| key.as_array()?.get(1)).cloned() {
        Some(last) => set(root, path, last),
        None => Err(missing),
    }
}

#[cfg(test)]
mod tests;
