//! The assets that a table names.

use super::{Kind, Table, TableDescriptor, Value};

/// Paths of all assets that `table`, described by `descriptor`, names at any depth; in the order of the descriptors.
pub fn assets(table: &Table, descriptor: &TableDescriptor) -> Vec<String> {
    let mut paths = Vec::new();
    for parameter in &descriptor.parameters {
        if let Some(node) = table.get(parameter.key) {
            collect_paths(&node.value, &parameter.kind, &mut paths);
        }
    }
    paths
}

fn collect_paths(value: &Value, kind: &Kind, paths: &mut Vec<String>) {
    match (kind, value) {
        (Kind::Asset, Value::Text(path)) => paths.push(path.clone()),
        (Kind::Optional(inner) | Kind::Auto(inner), value) => collect_paths(value, inner, paths),
        (Kind::List { item, .. }, Value::List(items)) => {
            items.iter().for_each(|node| collect_paths(&node.value, item, paths));
        }
        (Kind::Table(descriptor), Value::Table(table)) => paths.extend(assets(table, descriptor())),
        _ => {}
    }
}

#[cfg(test)]
#[allow(unreachable_pub, reason = "tables are public")]
mod tests {
    use super::*;
    use crate::parameters::{AssetPath, Parameters};

    crate::parameters! {
        /// A thing with a file.
        pub struct Part {
            /// Its file.
            file: Option<AssetPath> = None;
        }
    }

    crate::parameters! {
        /// Things with files.
        pub struct Whole {
            /// Text that is no asset.
            title: String = "a.png".into();
            /// Parts.
            parts: Vec<Part> = Vec::new();
        }
    }

    #[test]
    fn files_are_found_in_tables_in_lists() {
        let part = |file: Option<&str>| Part { file: file.map(|path| AssetPath(path.into())) };
        let whole = Whole { parts: vec![part(Some("b.glb")), part(None), part(Some("c.glb"))], ..Whole::default() };
        assert_eq!(assets(&whole.to_table(), Whole::table()), ["b.glb", "c.glb"]);
    }
}
