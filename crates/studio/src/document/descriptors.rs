//! Descriptors of the values of a scene, looked up by path.

use bansho::{
    KINDS,
    base::{
        parameters::{Descriptor, Kind, TableDescriptor},
        tables::{self, TableKind},
    },
    phenomena,
    scene::{Segment, ValuePath},
};

/// The kind of phenomenon called `key` in scene files.
pub(crate) fn phenomenon_kind(key: &str) -> Option<&'static TableKind> {
    phenomena().find(|kind| kind.key == key)
}

/// The parameters of the table `key` of a scene: a shared one, or a phenomenon's.
pub(crate) fn table_descriptor(key: &str) -> Option<&'static TableDescriptor> {
    tables::find(KINDS, key).map(|kind| (kind.table)())
}

/// The descriptor of the parameter at `path`. All items of a list have the same descriptors.
pub(crate) fn descriptor(path: &ValuePath) -> Option<&'static Descriptor> {
    let keys: Vec<&str> = path.segments().iter().filter_map(key).collect();
    let [root, inner @ .., last] = keys.as_slice() else { return None };
    let mut table = table_descriptor(root)?;
    for key in inner {
        table = inner_table(&parameter(table, key)?.kind)?;
    }
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
