//! The list of the phenomena of a scene, and the operations on it: add, duplicate, hide, solo.

use bansho::{
    base::parameters::{Table, Value},
    scene::{Segment, ValuePath, operation::Operation},
};

use super::{Document, descriptors, editor_hints::editor_hints};

/// A phenomenon of a scene: its kind, and its index among the phenomena of that kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PhenomenonId {
    /// Its kind, such as `rain`.
    pub kind: &'static str,
    /// Its index in the list of its kind.
    pub index: usize,
}

impl PhenomenonId {
    /// Phenomenon `index` of the kind called `kind` in scene files, if there is such a kind.
    pub fn find(kind: &str, index: usize) -> Option<Self> {
        descriptors::phenomenon_kind(kind).map(|kind| Self { kind: kind.key, index })
    }

    /// The path of its table.
    pub fn path(self) -> ValuePath {
        ValuePath::root().key(self.kind).index(self.index)
    }
}

/// Whether a list without items at `path` is equivalent to a list with one item that has default values.
pub(crate) fn implies_one_item(path: &ValuePath) -> bool {
    let [Segment::Key(kind), Segment::Index(_), Segment::Key(list)] = path.segments() else { return false };
    editor_hints(kind).position_handles.is_some_and(|handles| handles.items == list)
}

/// A phenomenon as the text lists it. Its parameters may be invalid.
#[derive(Clone, Debug, PartialEq)]
pub struct PhenomenonEntry {
    /// Its kind and index.
    pub id: PhenomenonId,
    /// Its name.
    pub name: String,
    /// Whether it is shown.
    pub enabled: bool,
}

impl Document {
    /// All phenomena, kind by kind in the order of the file.
    pub fn phenomena(&self) -> Vec<PhenomenonEntry> {
        let mut entries = Vec::new();
        for entry in &self.values().entries {
            let Some(kind) = descriptors::phenomenon_kind(&entry.key) else { continue };
            let Value::List(items) = &entry.node.value else { continue };
            let tables = items.iter().enumerate().filter_map(|(index, item)| match &item.value {
                Value::Table(table) => Some((index, table)),
                _ => None,
            });
            entries.extend(tables.map(|(index, table)| describe(PhenomenonId { kind: kind.key, index }, table)));
        }
        entries
    }
}

fn describe(id: PhenomenonId, table: &Table) -> PhenomenonEntry {
    let PhenomenonId { kind, index } = id;
    let name = match table.get("name").map(|node| &node.value) {
        Some(Value::Text(name)) => name.clone(),
        _ if index == 0 => kind.to_owned(),
        _ => format!("{kind} {}", index + 1),
    };
    let enabled = table.get("enabled").is_none_or(|node| node.value != Value::Bool(false));
    PhenomenonEntry { id, name, enabled }
}

/// A name that none of `entries` has: `wanted`, or `wanted` with a number.
fn free_name(wanted: &str, entries: &[PhenomenonEntry]) -> String {
    // More candidates than there are phenomena, so that one is free.
    let numbered = (2..entries.len() + 3).map(|number| format!("{wanted} {number}"));
    let mut candidates = [wanted.to_owned()].into_iter().chain(numbered);
    candidates.find(|name| entries.iter().all(|other| other.name != *name)).unwrap_or_default()
}

/// The operations of the scene panel.
pub mod operations {
    use super::*;

    /// Adds a phenomenon of `kind` with its defaults.
    pub fn add(document: &Document, kind: &str) -> Vec<Operation> {
        let mut table = Table::default();
        table.push("name", Value::Text(free_name(kind, &document.phenomena())));
        vec![Operation::Append { path: ValuePath::root().key(kind), value: Value::Table(table) }]
    }

    /// Adds a copy of `original` with a unique name.
    pub fn duplicate(document: &Document, original: &PhenomenonEntry) -> Vec<Operation> {
        let Some(Value::Table(table)) = original.id.path().find(document.values()).map(|node| &node.value) else {
            return Vec::new();
        };
        let mut copy = Table::default();
        copy.push("name", Value::Text(free_name(&original.name, &document.phenomena())));
        let others = table.entries.iter().filter(|entry| entry.key != "name");
        others.for_each(|entry| copy.push(entry.key.clone(), entry.node.value.clone()));
        vec![Operation::Append { path: ValuePath::root().key(original.id.kind), value: Value::Table(copy) }]
    }

    /// Shows or hides a phenomenon.
    pub fn set_enabled(entry: &PhenomenonEntry, enabled: bool) -> Operation {
        let path = entry.id.path().key("enabled");
        match (enabled, entry.enabled) {
            // Shown is the default.
            (true, false) => Operation::Remove { path },
            _ => Operation::Set { path, value: Value::Bool(enabled) },
        }
    }

    /// Shows only `chosen`, or all phenomena if it is the only one shown.
    pub fn solo(document: &Document, chosen: &PhenomenonEntry) -> Vec<Operation> {
        let all = document.phenomena();
        let alone = all.iter().all(|each| each.enabled == (each == chosen));
        let mut operations = Vec::new();
        for entry in &all {
            let enabled = alone || entry == chosen;
            if entry.enabled != enabled {
                operations.push(set_enabled(entry, enabled));
            }
        }
        operations
    }
}
