//! The files that a scene names, with the paths of the parameters that name them.

use bansho::{
    KINDS,
    base::parameters::{Kind, Node, Table, TableDescriptor, Value},
    scene::{SHARED_TABLES, ValuePath},
};

/// Each parameter of the scene `root` that names a file, and the name.
pub fn named_files(root: &Table) -> Vec<(ValuePath, String)> {
    let shared = SHARED_TABLES.iter().map(|table| (table.key, (table.table)()));
    let kinds = KINDS.iter().map(|kind| (kind.key, (kind.table)()));
    let mut found = Vec::new();
    for (key, descriptor) in shared.chain(kinds) {
        let place = ValuePath::root().key(key);
        match root.get(key).map(|node| &node.value) {
            Some(Value::Table(table)) => in_table(&place, table, descriptor, &mut found),
            Some(Value::List(items)) => {
                for (index, item) in items.iter().enumerate() {
                    if let Value::Table(table) = &item.value {
                        in_table(&place.index(index), table, descriptor, &mut found);
                    }
                }
            }
            _ => {}
        }
    }
    found
}

fn in_table(place: &ValuePath, table: &Table, descriptor: &TableDescriptor, found: &mut Vec<(ValuePath, String)>) {
    for parameter in &descriptor.parameters {
        if let Some(node) = table.get(parameter.key) {
            in_value(&place.key(parameter.key), node, &parameter.kind, found);
        }
    }
}

fn in_value(place: &ValuePath, node: &Node, kind: &Kind, found: &mut Vec<(ValuePath, String)>) {
    match (kind, &node.value) {
        (Kind::Asset, Value::Text(name)) => found.push((place.clone(), name.clone())),
        (Kind::Optional(inner) | Kind::Auto(inner), _) => in_value(place, node, inner, found),
        (Kind::List { item, .. }, Value::List(items)) => {
            for (index, node) in items.iter().enumerate() {
                in_value(&place.index(index), node, item, found);
            }
        }
        (Kind::Table(descriptor), Value::Table(table)) => in_table(place, table, descriptor(), found),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use bansho::scene::parse_values;

    use super::*;

    #[test]
    fn plates_meshes_and_drawings_are_found_where_they_stand() {
        let text = "bansho = 2\n[plate]\nimage = \"a.png\"\n[[obstacle]]\nfile = \"b.glb\"\n[[aurora]]\n[[aurora]]\n\
            [[aurora.shapes]]\nsheets = [{ form = \"arc\" }, { svg_file = \"c.svg\" }]\n";
        let found: Vec<(String, String)> = named_files(&parse_values(text).unwrap())
            .into_iter()
            .map(|(place, name)| (place.to_string(), name))
            .collect();
        let wanted =
            [("plate.image", "a.png"), ("obstacle.0.file", "b.glb"), ("aurora.1.shapes.0.sheets.1.svg_file", "c.svg")];
        assert_eq!(found, wanted.map(|(place, name)| (place.to_owned(), name.to_owned())));
    }
}
