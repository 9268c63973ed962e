//! The values of a scene by their descriptors: looked up by path, and all that name files.

use bansho::{
    KINDS,
    base::{
        parameters::{Descriptor, Kind, Node, Table, TableDescriptor, Value},
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

/// A parameter that names a file.
#[derive(Clone, Debug, PartialEq)]
pub struct FileReference {
    /// The path of the parameter.
    pub parameter: ValuePath,
    /// The file, as the scene names it.
    pub file: String,
}

/// All parameters of the scene `root` that name files.
pub fn named_files(root: &Table) -> Vec<FileReference> {
    let mut found = Vec::new();
    for (key, descriptor) in KINDS.iter().map(|kind| (kind.key, (kind.table)())) {
        let path = ValuePath::root().key(key);
        match root.get(key).map(|node| &node.value) {
            Some(Value::Table(table)) => collect_from_table(&path, table, descriptor, &mut found),
            Some(Value::List(items)) => {
                for (index, item) in items.iter().enumerate() {
                    if let Value::Table(table) = &item.value {
                        collect_from_table(&path.index(index), table, descriptor, &mut found);
                    }
                }
            }
            _ => {}
        }
    }
    found
}

fn collect_from_table(path: &ValuePath, table: &Table, descriptor: &TableDescriptor, found: &mut Vec<FileReference>) {
    for parameter in &descriptor.parameters {
        if let Some(node) = table.get(parameter.key) {
            collect_from_value(&path.key(parameter.key), node, &parameter.kind, found);
        }
    }
}

fn collect_from_value(path: &ValuePath, node: &Node, kind: &Kind, found: &mut Vec<FileReference>) {
    match (kind, &node.value) {
        (Kind::Asset, Value::Text(name)) => found.push(FileReference { parameter: path.clone(), file: name.clone() }),
        (Kind::Optional(inner) | Kind::Auto(inner), _) => collect_from_value(path, node, inner, found),
        (Kind::List { item, .. }, Value::List(items)) => {
            for (index, node) in items.iter().enumerate() {
                collect_from_value(&path.index(index), node, item, found);
            }
        }
        (Kind::Table(descriptor), Value::Table(table)) => collect_from_table(path, table, descriptor(), found),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use bansho::scene::parse_values;

    use super::*;

    #[test]
    fn plates_meshes_and_drawings_are_found_with_their_paths() {
        let text = "bansho = 2\n[plate]\nimage = \"a.png\"\n[[obstacle]]\nfile = \"b.glb\"\n[[aurora]]\n[[aurora]]\n\
            [[aurora.shapes]]\nsheets = [{ form = \"arc\" }, { svg_file = \"c.svg\" }]\n";
        let found = named_files(&parse_values(text).unwrap()).into_iter();
        let found: Vec<_> = found.map(|FileReference { parameter, file }| (parameter.to_string(), file)).collect();
        let expected =
            [("plate.image", "a.png"), ("obstacle.0.file", "b.glb"), ("aurora.1.shapes.0.sheets.1.svg_file", "c.svg")];
        assert_eq!(found, expected.map(|(path, name)| (path.to_owned(), name.to_owned())));
    }
}
