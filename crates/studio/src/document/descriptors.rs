//! Descriptors of the values of a scene, looked up by path.

use bansho::{
    KINDS,
    base::{
        parameters::{Descriptor, Kind, TableDescriptor},
        phenomenon::kind::PhenomenonKind,
    },
    scene::{SHARED_TABLES, Segment, ValuePath},
};

/// The kind of phenomenon called `key` in scene files.
pub(crate) fn phenomenon_kind(key: &str) -> Option<&'static PhenomenonKind> {
    KINDS.iter().find(|kind| kind.key == key)
}

/// The parameters of the table `key` of a scene: a shared one, or a phenomenon's.
pub(crate) fn table_descriptor(key: &str) -> Option<&'static TableDescriptor> {
    let shared = SHARED_TABLES.iter().find(|table| table.key == key).map(|table| (table.table)());
    shared.or_else(|| phenomenon_kind(key).map(|kind| (kind.table)()))
}

/// The descriptor of the parameter at `path`. All items of a list have the same descriptors.
pub(crate) fn descriptor(path: &ValuePath) -> Option<&'static Descriptor> {
    let keys: Vec<&str> = path.segments().iter().filter_map(key).collect();
    let [root, inner @ .., last] = keys.as_slice() else { return None };
    let within = |table: &'static TableDescriptor, key: &&str| inner_table(&parameter(table, key)?.kind);
    let table = inner.iter().try_fold(table_descriptor(root)?, within)?;
    parameter(table, last)
}

fn key(segment: &Segment) -> Option<&str> {
    match segment {
        Segment::Key(key) => Some(key),
        Segment::Index(_) => None,
    }
}

fn parameter(table: &'static TableDescriptor, key: &str) -> Option<&'static Descriptor> {
    table.parameters.iter().find(|parameter| parameter.key == key)
}

/// The table that `kind` is, or that the items of a list of this kind are.
fn inner_table(kind: &Kind) -> Option<&'static TableDescriptor> {
    match kind {
        Kind::Table(table) => Some(table()),
        Kind::List { item, .. } => inner_table(item),
        _ => None,
    }
}

/// The path of a key whose sub-tables are separated by dots (`particles.count`), within the table at `path`.
pub(crate) fn within(path: &ValuePath, dotted_key: &str) -> ValuePath {
    dotted_key.split('.').fold(path.clone(), |path, key| path.key(key))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn editor_hints_name_parameters() {
        for kind in KINDS {
            let hints = kind.editor_hints;
            let find = |key: &str| descriptor(&within(&ValuePath::root().key(kind.key), key));
            for limit in hints.draft_limits {
                assert!(find(limit.key).is_some_and(|own| matches!(own.kind, Kind::Integer { .. })), "{}", limit.key);
            }
            if let Some(handles) = hints.position_handles {
                assert!(find(handles.key).is_some(), "{}", handles.key);
                if let Some(items) = handles.items {
                    assert!(find(&format!("{items}.{}", handles.key)).is_some(), "{items}");
                }
            }
            if let Some(import) = hints.mesh_import {
                let shape = find(&format!("{}.{}", import.list, import.shape_key)).map(|own| &own.kind);
                let is_choice = |choices: &[bansho::base::parameters::Choice]| {
                    choices.iter().any(|choice| choice.name == import.shape)
                };
                assert!(matches!(shape, Some(Kind::Choice(choices)) if is_choice(choices)), "{}", import.shape);
                assert!(find(&format!("{}.{}", import.list, import.file_key)).is_some(), "{}", import.file_key);
            }
            if let Some(key) = hints.stage_key {
                assert!(find(key).is_some_and(|own| matches!(own.kind, Kind::Choice(_))), "{key}");
            }
        }
    }
}
