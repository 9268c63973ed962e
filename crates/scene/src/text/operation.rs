//! What editors do to a scene: operations on places of its text. Everything else in it stays, comments too.

use bansho_base::parameters::{Node, Table as Values, Value};
use toml_edit::{Array, ArrayOfTables, DocumentMut, InlineTable, Item, Table, TableLike, Value as Written};

use super::{
    edit::{self, EditError},
    path::{Segment, ValuePath},
};

/// One change of a scene.
#[derive(Clone, Debug, PartialEq)]
pub enum Operation {
    /// States `value` at `place`, in stead of any that stands there. Tables on the way are made, and lists with one table in them.
    Set {
        /// Where.
        place: ValuePath,
        /// What.
        value: Value,
    },
    /// Takes out what stands at `place`, so that a parameter has its default and an item of a list is gone.
    Remove {
        /// Where.
        place: ValuePath,
    },
    /// Adds an item at the end of the list at `place`, which is made where there is none.
    Append {
        /// The list.
        place: ValuePath,
        /// The item.
        value: Value,
    },
    /// Keys the value at `place`: at `time` it is `value`. A constant becomes keyed, by this one key.
    SetKeyframe {
        /// What is keyed.
        place: ValuePath,
        /// When, s.
        time: f64,
        /// What it then is.
        value: Value,
    },
    /// Takes out the key at `time`. The last key leaves a constant of its value.
    RemoveKeyframe {
        /// What is keyed.
        place: ValuePath,
        /// When, s.
        time: f64,
    },
}

impl Operation {
    /// The place that it changes.
    pub fn place(&self) -> &ValuePath {
        match self {
            Self::Set { place, .. }
            | Self::Remove { place }
            | Self::Append { place, .. }
            | Self::SetKeyframe { place, .. }
            | Self::RemoveKeyframe { place, .. } => place,
        }
    }
}

/// Two keys nearer than this are one, s: far less than a frame, and more than rounding.
const SAME_TIME_S: f64 = 1e-6;

/// The text after all `operations`, one after the other.
///
/// # Errors
/// The text is no TOML, an operation's place is not there, or its value cannot stand in a scene. No operation is then made.
pub fn apply(text: &str, operations: &[Operation]) -> Result<String, EditError> {
    let mut document = edit::document(text)?;
    for operation in operations {
        document.carry_out(operation)?;
    }
    let edited = document.to_string();
    drop(document);
    edit::check(&edited).map(|()| edited)
}

trait CarryOut {
    fn carry_out(&mut self, operation: &Operation) -> Result<(), EditError>;
}

impl CarryOut for DocumentMut {
    fn carry_out(&mut self, operation: &Operation) -> Result<(), EditError> {
        let root = self.as_table_mut();
        match operation {
            Operation::Set { place, value } => set(root, place, written(value)?),
            Operation::Remove { place } => remove(root, place),
            Operation::Append { place, value } => append(root, place, value),
            Operation::SetKeyframe { place, time, value } => set_keyframe(root, place, *time, &written(value)?),
            Operation::RemoveKeyframe { place, time } => remove_keyframe(root, place, *time),
        }
    }
}

/// `value` as TOML holds it.
fn written(value: &Value) -> Result<Written, EditError> {
    value.to_string().parse().map_err(|_| EditError::NoValue(value.to_string()))
}

/// Something that a place may lead into.
enum Slot<'a> {
    /// Under a header of its own.
    Headed(&'a mut Table),
    /// In a line.
    Inline(&'a mut InlineTable),
    Tables(&'a mut ArrayOfTables),
    Value(&'a mut Written),
}

impl<'a> Slot<'a> {
    fn of_item(item: &'a mut Item) -> Option<Self> {
        match item {
            Item::None => None,
            Item::Value(value) => Some(Self::of_value(value)),
            Item::Table(table) => Some(Self::Headed(table)),
            Item::ArrayOfTables(tables) => Some(Self::Tables(tables)),
        }
    }

    fn of_value(value: &'a mut Written) -> Self {
        match value {
            Written::InlineTable(table) => Self::Inline(table),
            other => Self::Value(other),
        }
    }

    /// Its keys, where it is a table.
    fn table(self) -> Option<&'a mut dyn TableLike> {
        match self {
            Self::Headed(table) => Some(table),
            Self::Inline(table) => Some(table),
            Self::Tables(_) | Self::Value(_) => None,
        }
    }

    fn into(self, segment: &Segment) -> Option<Self> {
        match (self, segment) {
            (Self::Headed(table), Segment::Key(key)) => Self::of_item(table.get_mut(key)?),
            (Self::Inline(table), Segment::Key(key)) => Some(Self::of_value(table.get_mut(key)?)),
            (Self::Tables(tables), Segment::Index(index)) => Some(Self::Headed(tables.get_mut(*index)?)),
            (Self::Value(Written::Array(items)), Segment::Index(index)) => Some(Self::of_value(items.get_mut(*index)?)),
            _ => None,
        }
    }
}

fn nowhere(place: &ValuePath, segment: &Segment) -> EditError {
    let segment = match segment {
        Segment::Key(key) => key.clone(),
        Segment::Index(index) => index.to_string(),
    };
    let there = "nothing of that name or number".to_owned();
    EditError::NoSuchPlace { path: place.to_string(), segment, there, meant: Vec::new() }
}

/// What holds the value at `place`, and the last step to that; tables on the way, and first items of lists, are made where `make` says so.
fn holder<'a, 'p>(root: &'a mut Table, place: &'p ValuePath, make: bool) -> Result<(Slot<'a>, &'p Segment), EditError> {
    let Some((last, way)) = place.segments().split_last() else {
        return Err(EditError::NoAssignment(String::new()));
    };
    let mut slot = Slot::Headed(root);
    for (depth, segment) in way.iter().enumerate() {
        if let (true, Segment::Key(key)) = (make, segment) {
            let missing = |table: &dyn TableLike| !table.contains_key(key);
            let in_a_line = || match place.segments().get(depth + 1) {
                Some(Segment::Index(0)) => Array::from_iter([InlineTable::new()]).into(),
                _ => Written::from(InlineTable::new()),
            };
            match &mut slot {
                // A table at the root gets a header of its own; one within stands in a line.
                Slot::Headed(table) if missing(*table) => {
                    table.insert(key, if depth == 0 { Item::Table(Table::new()) } else { in_a_line().into() });
                }
                Slot::Inline(table) if missing(*table) => {
                    table.insert(key, in_a_line());
                }
                _ => {}
            }
        }
        slot = slot.into(segment).ok_or_else(|| nowhere(place, segment))?;
    }
    Ok((slot, last))
}

fn set(root: &mut Table, place: &ValuePath, value: Written) -> Result<(), EditError> {
    let (slot, last) = holder(root, place, true)?;
    match (slot, last) {
        (Slot::Value(Written::Array(items)), Segment::Index(index)) if *index < items.len() => {
            if let Some(old) = items.get_mut(*index) {
                replace(old, value);
            }
        }
        (slot, last) => {
            let (Some(table), Segment::Key(key)) = (slot.table(), last) else { return Err(nowhere(place, last)) };
            match table.get_mut(key) {
                Some(Item::Value(old)) => replace(old, value),
                _ => {
                    table.insert(key, Item::Value(value));
                }
            }
        }
    }
    Ok(())
}

/// Keeps the space and the comment around the old value.
fn replace(old: &mut Written, value: Written) {
    let decor = old.decor().clone();
    *old = value;
    *old.decor_mut() = decor;
}

fn remove(root: &mut Table, place: &ValuePath) -> Result<(), EditError> {
    let (slot, last) = holder(root, place, false)?;
    let removed = match (slot, last) {
        (Slot::Headed(table), Segment::Key(key)) => table.remove(key).is_some(),
        (Slot::Inline(table), Segment::Key(key)) => table.remove(key).is_some(),
        (Slot::Tables(tables), Segment::Index(index)) if *index < tables.len() => {
            tables.remove(*index);
            true
        }
        (Slot::Value(Written::Array(items)), Segment::Index(index)) if *index < items.len() => {
            take_out(items, *index);
            true
        }
        _ => false,
    };
    if removed { Ok(()) } else { Err(nowhere(place, last)) }
}

fn append(root: &mut Table, place: &ValuePath, value: &Value) -> Result<(), EditError> {
    let (slot, last) = holder(root, place, true)?;
    let headed_holder = matches!(slot, Slot::Headed(_));
    let (Some(table), Segment::Key(key)) = (slot.table(), last) else { return Err(nowhere(place, last)) };
    if !table.contains_key(key) {
        // Tables stand under headers of their own at the root, and within where a line would be too long for them.
        let at_root = place.segments().len() == 1;
        let own_headers = headed_holder && matches!(value, Value::Table(values) if at_root || holds_tables(values));
        let list = if own_headers { Item::ArrayOfTables(ArrayOfTables::new()) } else { Array::new().into() };
        table.insert(key, list);
    }
    match (table.get_mut(key), value) {
        (Some(Item::ArrayOfTables(tables)), Value::Table(values)) => tables.push(headed(values)?),
        (Some(Item::Value(Written::Array(items))), value) => put_last(items, written(value)?),
        _ => return Err(nowhere(place, last)),
    }
    Ok(())
}

/// What stands before an item or the end of a list: the rest of the line before it, whose comment is about the item before, and the lines
/// of its own.
fn before(items: &Array, index: usize) -> [String; 2] {
    let all = match items.get(index) {
        Some(item) => item.decor().prefix().and_then(|prefix| prefix.as_str()),
        None => items.trailing().as_str(),
    };
    let all = all.unwrap_or_default();
    let (rest, own) = all.split_at(all.find('\n').unwrap_or(0));
    [rest.to_owned(), own.to_owned()]
}

/// Takes an item out of a list with the comment that stands after it on its line.
fn take_out(items: &mut Array, index: usize) {
    let [rest, _] = before(items, index);
    let [_, own] = before(items, index + 1);
    items.remove(index);
    if own.is_empty() {
        return;
    }
    let all = rest + &own;
    match items.get_mut(index) {
        Some(next) => next.decor_mut().set_prefix(all),
        None => items.set_trailing(all),
    }
}

/// Adds an item at the end of a list; in a list of lines it has a line of its own, after the comment of the one before.
fn put_last(items: &mut Array, value: Written) {
    let end = items.len();
    let [rest, own] = before(items, end);
    let [_, line] = before(items, end.saturating_sub(1));
    items.push(value);
    if own.is_empty() || !items.trailing_comma() {
        return;
    }
    if let Some(item) = items.get_mut(end) {
        // Without the comments that stand above the last one.
        let line = line.rfind('\n').map_or(own.as_str(), |at| &line[at..]);
        item.decor_mut().set_prefix(format!("{rest}{line}"));
    }
    items.set_trailing(own);
}

/// Whether a table has lists of tables in it.
fn holds_tables(values: &Values) -> bool {
    let is_table = |item: &Node| matches!(item.value, Value::Table(_));
    values.entries.iter().any(|entry| matches!(&entry.node.value, Value::List(items) if items.iter().any(is_table)))
}

/// A table to stand under a header, with an empty line before.
fn headed(values: &Values) -> Result<Table, EditError> {
    let mut table = Table::new();
    for entry in &values.entries {
        table.insert(&entry.key, Item::Value(written(&entry.node.value)?));
    }
    table.decor_mut().set_prefix("\n");
    Ok(table)
}

/// The keys of the value at `place`, where it is keyed.
fn keys<'a>(root: &'a mut Table, place: &ValuePath) -> Option<&'a mut Array> {
    let (slot, last) = holder(root, place, false).ok()?;
    slot.into(last)?.table()?.get_mut("keys")?.as_array_mut()
}

fn time_of(key: &Written) -> Option<f64> {
    let time = key.as_array()?.get(0)?;
    time.as_float().or_else(|| time.as_integer().map(|whole| whole as f64))
}

fn is_at(key: &Written, time: f64) -> bool {
    time_of(key).is_some_and(|own| (own - time).abs() <= SAME_TIME_S)
}

/// One space between items, and none before the first; lines and comments that a person made stay.
fn space(items: &mut Array) {
    for (index, item) in items.iter_mut().enumerate() {
        let prefix = item.decor().prefix().and_then(|prefix| prefix.as_str()).unwrap_or_default();
        if prefix.chars().all(|character| character == ' ') {
            item.decor_mut().set_prefix(if index == 0 { "" } else { " " });
        }
    }
}

fn set_keyframe(root: &mut Table, place: &ValuePath, time: f64, value: &Written) -> Result<(), EditError> {
    let key = Array::from_iter([Written::from(time), value.clone()]);
    let Some(keys) = keys(root, place) else {
        let mut keyed = InlineTable::new();
        keyed.insert("keys", Array::from_iter([key]).into());
        return set(root, place, keyed.into());
    };
    let there = keys.iter().position(|key| is_at(key, time));
    match there {
        Some(index) => {
            if let Some(old) = keys.get_mut(index).and_then(|key| key.as_array_mut()?.get_mut(1)) {
                replace(old, value.clone());
            }
        }
        None => {
            let after = keys.iter().take_while(|key| time_of(key).is_some_and(|own| own < time)).count();
            keys.insert(after, key);
            space(keys);
        }
    }
    Ok(())
}

fn remove_keyframe(root: &mut Table, place: &ValuePath, time: f64) -> Result<(), EditError> {
    let missing = || EditError::NoKeyframe { path: place.to_string(), time };
    let keys = keys(root, place).ok_or_else(missing)?;
    let index = keys.iter().position(|key| is_at(key, time)).ok_or_else(missing)?;
    if keys.len() > 1 {
        keys.remove(index);
        space(keys);
        return Ok(());
    }
    let last = keys.get(index).and_then(|key| key.as_array()?.get(1)).cloned().ok_or_else(missing)?;
    set(root, place, last)
}

#[cfg(test)]
mod tests;
