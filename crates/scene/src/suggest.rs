//! Suggestions for a path that does not exist in a scene.

use bansho_base::parameters::{Kind, Table, TableDescriptor, Value, nearest};

use super::{PhenomenonKind, SHARED_TABLES, text::toml};

/// The maximum number of suggested paths.
const MAX_SUGGESTIONS: usize = 3;

/// Tables that every scene has, even where its text does not state them.
const IMPLICIT_TABLES: [&str; 4] = ["picture", "camera", "wind", "air"];

/// Paths of the scene `text` that the `segments` of another may have meant, the likeliest first: parameters of that name in tables that the
/// scene has, else the parameter most like it.
pub(super) fn paths(text: &str, segments: &[&str], kinds: &[PhenomenonKind]) -> Vec<String> {
    let Ok(root) = toml::parse(text) else { return Vec::new() };
    let known = known(&root, kinds);
    let (first, rest) = (segments[0], &segments[1..]);
    let tables = kinds.iter().map(|kind| kind.key).chain(SHARED_TABLES.iter().map(|table| table.key));
    let tables = tables.filter(|key| root.get(key).is_some() || IMPLICIT_TABLES.contains(key));
    if let Some(table) = nearest(first, tables).filter(|_| !rest.is_empty()) {
        return vec![format!("{table}.{}", rest.join("."))];
    }
    let ending = |wanted: &[&str]| -> Vec<String> {
        let named = || known.iter().filter(|path| path.ends_with(wanted));
        // A parameter of a table itself rather than one of a table within it.
        let shortest = named().map(Vec::len).min();
        named().filter(|path| Some(path.len()) == shortest).take(MAX_SUGGESTIONS).map(|path| path.join(".")).collect()
    };
    let last = [segments[segments.len() - 1]];
    let mut meant = ending(segments);
    if meant.is_empty() {
        meant = ending(&last);
    }
    if meant.is_empty() {
        let names = known.iter().filter_map(|path| path.last().copied());
        meant = nearest(last[0], names).map_or_else(Vec::new, |name| ending(&[name]));
    }
    meant
}

/// Paths of all parameters of the tables that a scene has, its phenomena first.
fn known(root: &Table, kinds: &[PhenomenonKind]) -> Vec<Vec<&'static str>> {
    let mut known = Vec::new();
    let kinds = kinds.iter().map(|kind| (kind.key, kind.table));
    for (key, table) in kinds.chain(SHARED_TABLES.iter().map(|shared| (shared.key, shared.table))) {
        let stated: Vec<&Value> = root.get(key).map(|node| &node.value).into_iter().collect();
        if !stated.is_empty() || IMPLICIT_TABLES.contains(&key) {
            parameters(&mut known, &[key], table(), &stated);
        }
    }
    known
}

/// Adds the parameters of a table at `path`, which the scene states as `stated`.
fn parameters(known: &mut Vec<Vec<&'static str>>, path: &[&'static str], table: &TableDescriptor, stated: &[&Value]) {
    for parameter in &table.parameters {
        let path = [path, &[parameter.key]].concat();
        let stated = within(stated, parameter.key);
        match &parameter.kind {
            Kind::Table(inner) => parameters(known, &path, inner(), &stated),
            // Items that a list does not have cannot be set.
            Kind::List { item, .. }
                if !stated.is_empty()
                    && let Kind::Table(inner) = **item =>
            {
                parameters(known, &path, inner(), &stated);
            }
            _ => {}
        }
        known.push(path);
    }
}

/// What tables, or all tables of lists, state under a key.
fn within<'a>(values: &[&'a Value], key: &str) -> Vec<&'a Value> {
    let in_table = |value: &'a Value| if let Value::Table(table) = value { table.get(key) } else { None };
    let found = values.iter().flat_map(|value| match value {
        Value::List(items) => items.iter().filter_map(|item| in_table(&item.value)).collect::<Vec<_>>(),
        value => in_table(value).into_iter().collect(),
    });
    found.map(|node| &node.value).collect()
}
