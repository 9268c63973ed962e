//! Suggests existing paths for a path that does not exist in a scene.

use bansho_base::{
    parameters::{Kind, Table, TableDescriptor, Value, nearest},
    tables::{self, TableCount, TableKind},
};

use crate::text::toml;

/// Maximum number of suggestions.
const MAX_SUGGESTIONS: usize = 3;

/// Paths of the scene `text` that are similar to the path `segments`, the most likely first: parameters with the same name in tables that the
/// scene has, else the parameter with the most similar name.
pub(super) fn suggest_paths(text: &str, segments: &[&str], kinds: &[TableKind]) -> Vec<String> {
    let Ok(root) = toml::parse(text) else { return Vec::new() };
    let paths = known_paths(&root, kinds);
    let (first, rest) = (segments[0], &segments[1..]);
    if let Some(table) = nearest(first, tables_of_scene(&root, kinds).map(|kind| kind.key)).filter(|_| !rest.is_empty())
    {
        return vec![format!("{table}.{}", rest.join("."))];
    }
    let last = segments[segments.len() - 1];
    let mut suggestions = paths_ending_with(&paths, segments);
    if suggestions.is_empty() {
        suggestions = paths_ending_with(&paths, &[last]);
    }
    if suggestions.is_empty() {
        let names = paths.iter().filter_map(|path| path.last().copied());
        suggestions = nearest(last, names).map_or_else(Vec::new, |name| paths_ending_with(&paths, &[name]));
    }
    suggestions
}

/// Up to [`MAX_SUGGESTIONS`] of the paths that end with `segments`. The parameter of a table is preferred to that of a table within it.
fn paths_ending_with(paths: &[Vec<&str>], segments: &[&str]) -> Vec<String> {
    let matches: Vec<&Vec<&str>> = paths.iter().filter(|path| path.ends_with(segments)).collect();
    let shortest = matches.iter().map(|path| path.len()).min();
    let preferred = matches.into_iter().filter(|path| Some(path.len()) == shortest);
    preferred.take(MAX_SUGGESTIONS).map(|path| path.join(".")).collect()
}

/// The kinds of the tables that a scene has, its phenomena first. It has some even if its text does not contain them.
fn tables_of_scene<'a>(root: &Table, kinds: &'a [TableKind]) -> impl Iterator<Item = &'a TableKind> {
    let all = tables::phenomena(kinds).chain(tables::shared(kinds));
    all.filter(|kind| root.get(kind.key).is_some() || kind.count == TableCount::One)
}

/// Paths of all parameters of the tables that a scene has.
fn known_paths(root: &Table, kinds: &[TableKind]) -> Vec<Vec<&'static str>> {
    let mut paths = Vec::new();
    for kind in tables_of_scene(root, kinds) {
        let stated: Vec<&Value> = root.get(kind.key).map(|node| &node.value).into_iter().collect();
        add_parameters(&mut paths, &[kind.key], (kind.table)(), &stated);
    }
    paths
}

/// Adds the paths of all parameters of the table at `path`. `stated` are its values in the scene's text: several where it is a list.
fn add_parameters(
    paths: &mut Vec<Vec<&'static str>>,
    path: &[&'static str],
    table: &TableDescriptor,
    stated: &[&Value],
) {
    for parameter in &table.parameters {
        let path = [path, &[parameter.key]].concat();
        let stated = values_of_key(stated, parameter.key);
        match &parameter.kind {
            Kind::Table(inner) => add_parameters(paths, &path, inner(), &stated),
            // Parameters of items can only be set if the list has items.
            Kind::List { item, .. }
                if !stated.is_empty()
                    && let Kind::Table(inner) = **item =>
            {
                add_parameters(paths, &path, inner(), &stated);
            }
            _ => {}
        }
        paths.push(path);
    }
}

/// The values of a key in tables, and in the tables of lists.
fn values_of_key<'a>(values: &[&'a Value], key: &str) -> Vec<&'a Value> {
    let mut tables: Vec<&Value> = Vec::new();
    for value in values {
        match value {
            Value::List(items) => tables.extend(items.iter().map(|item| &item.value)),
            value => tables.push(value),
        }
    }
    let stated = tables.into_iter().filter_map(|value| match value {
        Value::Table(table) => table.get(key),
        _ => None,
    });
    stated.map(|node| &node.value).collect()
}
