//! The phenomena of a scene as a list: add, duplicate, hide, show alone.

use bansho::{
    KINDS,
    base::parameters::{Table, Value},
    scene::{ValuePath, operation::Operation},
};

use super::Document;

/// A phenomenon as the text lists it; it need not be without faults.
#[derive(Clone, Debug, PartialEq)]
pub struct PhenomenonEntry {
    /// Its kind, such as `rain`.
    pub kind: &'static str,
    /// Which of its kind.
    pub index: usize,
    /// Its name.
    pub name: String,
    /// Whether it is drawn.
    pub enabled: bool,
}

impl PhenomenonEntry {
    /// Where it stands.
    pub fn place(&self) -> ValuePath {
        ValuePath::root().key(self.kind).index(self.index)
    }
}

impl Document {
    /// All phenomena, kind by kind in the order of the file.
    pub fn phenomena(&self) -> Vec<PhenomenonEntry> {
        let mut listed = Vec::new();
        for entry in &self.values().entries {
            let Some(kind) = KINDS.iter().find(|kind| kind.key == entry.key) else { continue };
            let Value::List(items) = &entry.node.value else { continue };
            let tables = items.iter().enumerate().filter_map(|(index, item)| match &item.value {
                Value::Table(table) => Some((index, table)),
                _ => None,
            });
            listed.extend(tables.map(|(index, table)| describe(kind.key, index, table)));
        }
        listed
    }
}

fn describe(kind: &'static str, index: usize, table: &Table) -> PhenomenonEntry {
    let name = match table.get("name").map(|node| &node.value) {
        Some(Value::Text(name)) => name.clone(),
        _ if index == 0 => kind.to_owned(),
        _ => format!("{kind} {}", index + 1),
    };
    let enabled = table.get("enabled").is_none_or(|node| node.value != Value::Bool(false));
    PhenomenonEntry { kind, index, name, enabled }
}

/// A name that none of `listed` has: `wanted`, or `wanted` with a number.
fn free_name(wanted: &str, listed: &[PhenomenonEntry]) -> String {
    let taken = |name: &str| listed.iter().any(|other| other.name == name);
    if !taken(wanted) {
        return wanted.to_owned();
    }
    // Of one more name than there are phenomena, one is free.
    let numbered = (2..listed.len() + 3).map(|number| format!("{wanted} {number}"));
    numbered.into_iter().find(|name| !taken(name)).unwrap_or_default()
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

    /// Adds a phenomenon like `original` under a name of its own.
    pub fn duplicate(document: &Document, original: &PhenomenonEntry) -> Vec<Operation> {
        let Some(Value::Table(table)) = original.place().find(document.values()).map(|node| &node.value) else {
            return Vec::new();
        };
        let mut copy = Table::default();
        copy.push("name", Value::Text(free_name(&original.name, &document.phenomena())));
        let others = table.entries.iter().filter(|entry| entry.key != "name");
        others.for_each(|entry| copy.push(entry.key.clone(), entry.node.value.clone()));
        vec![Operation::Append { path: ValuePath::root().key(original.kind), value: Value::Table(copy) }]
    }

    /// Draws it, or does not.
    pub fn set_enabled(listed: &PhenomenonEntry, enabled: bool) -> Operation {
        let place = listed.place().key("enabled");
        match (enabled, listed.enabled) {
            // Being drawn is the default.
            (true, false) => Operation::Remove { path: place },
            _ => Operation::Set { path: place, value: Value::Bool(enabled) },
        }
    }

    /// Draws only this one; all, where it is the only one already.
    pub fn solo(document: &Document, chosen: &PhenomenonEntry) -> Vec<Operation> {
        let all = document.phenomena();
        let alone = all.iter().all(|each| each.enabled == (each == chosen));
        let wanted = |each: &PhenomenonEntry| alone || each == chosen;
        let change = all.iter().filter(|each| each.enabled != wanted(each));
        change.map(|each| set_enabled(each, wanted(each))).collect()
    }
}
