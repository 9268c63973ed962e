//! The text of a scene: checked, changed and read by path. The class `bansho.Scene` keeps the text; everything here is a function of it.

use bansho::{
    KINDS, Scene,
    base::parameters::{Entry, Node, Table, Value},
    job::SceneFile,
    parse_scene,
    scene::{
        FORMAT, ValuePath,
        edit::{self, EditError},
        operation::{self, Operation},
        parse_values,
    },
};
use pyo3::{prelude::*, types::PyDict};
use std::path::PathBuf;

use crate::{error, value};

/// Parses and checks a text.
pub(crate) fn parse(text: &str, name: &str) -> PyResult<Scene> {
    parse_scene(name, text).map_err(|problems| error::scene(&problems))
}

/// Reads the scene file at `path`: its text, its name in messages and its folder.
#[pyfunction]
pub(crate) fn read_scene(path: PathBuf) -> PyResult<(String, String, PathBuf)> {
    let file = SceneFile::read(&path).map_err(|failed| error::job(&failed))?;
    Ok((file.text, file.name, file.folder))
}

/// Checks a text.
#[pyfunction]
pub(crate) fn check_scene(text: &str, name: &str) -> PyResult<()> {
    parse(text, name).map(drop)
}

/// Paths of all files that a scene names.
#[pyfunction]
pub(crate) fn asset_paths(text: &str, name: &str) -> PyResult<Vec<String>> {
    Ok(parse(text, name)?.asset_paths())
}

/// The values that a text states, as dictionaries and lists.
#[pyfunction]
pub(crate) fn stated_values<'py>(py: Python<'py>, text: &str, name: &str) -> PyResult<Bound<'py, PyDict>> {
    parse(text, name)?;
    value::table_to_python(py, &parse_values(text).unwrap_or_default())
}

/// The value in effect at a dotted path; `None` for an optional one that is not stated. Names and numbers select a table of a list, which may be left out
/// where there is only one.
#[pyfunction]
pub(crate) fn value_at<'py>(
    py: Python<'py>,
    text: &str,
    name: &str,
    path: &str,
) -> PyResult<Option<Bound<'py, PyAny>>> {
    let root = value::values_in_effect(&parse(text, name)?);
    let segments: Vec<&str> = path.split('.').map(str::trim).collect();
    let root = Value::Table(root);
    match find(&root, &segments) {
        Ok(found) => value::to_python(py, found).map(Some),
        // An optional value that is not stated is not in the table, but could be set.
        Err(missing) if !missing.is_ambiguous && is_settable(text, path) => Ok(None),
        Err(missing) => Err(error::edit(&missing.refused(path))),
    }
}

/// Whether the scene may have a value at a path that has none: it is then refused for its type, not for its key.
fn is_settable(text: &str, path: &str) -> bool {
    let probes = ["{ a-key-that-no-table-has = 1 }", "true", "1", "\"\""];
    probes.iter().any(|probe| {
        let Ok(changed) = edit::set(text, &format!("{path}={probe}"), KINDS) else { return false };
        let Err(problems) = parse_scene("", &changed) else { return true };
        !problems.to_string().contains("unknown key")
    })
}

/// Where a path leads nowhere.
struct Missing<'p> {
    segment: &'p str,
    available: String,
    /// Whether there are several tables, of which none is selected.
    is_ambiguous: bool,
}

impl<'p> Missing<'p> {
    fn new(segment: &'p str, available: String) -> Self {
        Self { segment, available, is_ambiguous: false }
    }

    /// No item of a list.
    fn item(segment: &'p str, items: &[Node]) -> Self {
        let names = items.iter().filter_map(|item| name_of(&item.value));
        let names: String = names.map(|name| format!(" or {name}")).collect();
        let numbers = if items.is_empty() { "nothing".to_owned() } else { format!("0 to {}", items.len() - 1) };
        Self { segment, available: numbers + &names, is_ambiguous: items.len() > 1 }
    }

    fn refused(self, path: &str) -> EditError {
        let (path, segment) = (path.to_owned(), self.segment.to_owned());
        EditError::NoSuchPath { path, segment, available: self.available, suggestions: Vec::new() }
    }
}

/// The value at the remaining `segments` of a path.
fn find<'v, 'p>(value: &'v Value, segments: &[&'p str]) -> Result<&'v Value, Missing<'p>> {
    let Some((first, rest)) = segments.split_first() else { return Ok(value) };
    match value {
        Value::Table(table) => match table.get(first) {
            Some(node) => find(&node.value, rest),
            None => Err(Missing::new(first, keys_of(table))),
        },
        Value::List(items) => {
            let by_name = items.iter().find(|item| name_of(&item.value) == Some(first));
            let by_number = first.parse::<usize>().ok().and_then(|index| items.get(index));
            match (by_name.or(by_number), items.as_slice()) {
                (Some(item), _) => find(&item.value, rest),
                (None, [only]) => find(&only.value, segments),
                _ => Err(Missing::item(first, items)),
            }
        }
        _ => Err(Missing::new(first, "a value, which has no keys".to_owned())),
    }
}

fn keys_of(table: &Table) -> String {
    table.entries.iter().map(|entry| entry.key.as_str()).collect::<Vec<_>>().join(", ")
}

fn name_of(value: &Value) -> Option<&str> {
    let Value::Table(table) = value else { return None };
    match table.get("name").map(|node| &node.value) {
        Some(Value::Text(name)) => Some(name),
        _ => None,
    }
}

/// The text with other values at dotted paths, in order, as `bansho render --set` has it; checked, with its comments.
#[pyfunction]
pub(crate) fn with_values(text: &str, name: &str, changes: Vec<(String, Bound<PyAny>)>) -> PyResult<String> {
    let mut changed = text.to_owned();
    for (path, object) in changes {
        let assignment = format!("{path}={}", value::from_python(&object)?);
        changed = edit::set(&changed, &assignment, KINDS).map_err(|refused| error::edit(&refused))?;
    }
    parse(&changed, name)?;
    Ok(changed)
}

/// The text without the value at a dotted path; checked, with its comments.
#[pyfunction]
pub(crate) fn without_value(text: &str, name: &str, path: &str) -> PyResult<String> {
    let root = parse_values(text).unwrap_or_default();
    let root = Value::Table(root);
    let path = located(&root, path).map_err(|missing| error::edit(&missing.refused(path)))?;
    let changed = operation::apply(text, &[Operation::Remove { path }]).map_err(|refused| error::edit(&refused))?;
    parse(&changed, name)?;
    Ok(changed)
}

/// The text with another table of a kind of which a scene may have many; checked, with its comments.
#[pyfunction]
pub(crate) fn with_table(text: &str, name: &str, kind: &str, table: &Bound<PyAny>) -> PyResult<String> {
    let is_list = bansho::base::tables::find(KINDS, kind).is_some_and(bansho::base::tables::TableKind::is_list);
    let (path, value) = (ValuePath::root().key(kind), value::from_python(table)?);
    let change = if is_list { Operation::Append { path, value } } else { Operation::Set { path, value } };
    let changed = operation::apply(text, &[change]).map_err(|refused| error::edit(&refused))?;
    parse(&changed, name)?;
    Ok(changed)
}

/// The path of a value in `root`. The number of a table may be its name, and may be left out where there is only one.
fn located<'p>(root: &Value, path: &'p str) -> Result<ValuePath, Missing<'p>> {
    let (mut value, mut located) = (Some(root), ValuePath::root());
    for segment in path.split('.').map(str::trim) {
        if let Some(Value::List(items)) = value {
            let index = items.iter().position(|item| name_of(&item.value) == Some(segment));
            let index = index.or_else(|| segment.parse().ok());
            if index.is_none() && items.len() > 1 {
                return Err(Missing::item(segment, items));
            }
            let taken = index.unwrap_or(0);
            located = located.index(taken);
            value = items.get(taken).map(|node| &node.value);
            if index.is_some() {
                continue;
            }
        }
        located = located.key(segment);
        value = match value {
            Some(Value::Table(table)) => table.get(segment).map(|node| &node.value),
            _ => None,
        };
    }
    Ok(located)
}

/// The text of a scene of dictionaries; checked.
#[pyfunction]
pub(crate) fn text_of_tables(tables: &Bound<PyAny>, name: &str) -> PyResult<String> {
    let Value::Table(mut root) = value::from_python(tables)? else {
        return Err(error::value("a scene is a dict of tables".to_owned()));
    };
    if root.get("bansho").is_none() {
        root.entries.insert(0, Entry { key: "bansho".into(), key_span: 0..0, node: Value::Integer(FORMAT).into() });
    }
    let mut operations = Vec::new();
    for Entry { key, node, .. } in &root.entries {
        let path = ValuePath::root().key(key);
        let is_list = bansho::base::tables::find(KINDS, key).is_some_and(bansho::base::tables::TableKind::is_list);
        match &node.value {
            Value::Table(table) if is_list => {
                operations.push(Operation::Append { path, value: Value::Table(table.clone()) });
            }
            Value::Table(table) if !table.entries.is_empty() => {
                for Entry { key, node, .. } in &table.entries {
                    operations.push(Operation::Set { path: path.key(key), value: node.value.clone() });
                }
            }
            Value::List(items) if items.iter().all(|item| matches!(item.value, Value::Table(_))) => {
                for item in items {
                    operations.push(Operation::Append { path: path.clone(), value: item.value.clone() });
                }
            }
            other => operations.push(Operation::Set { path, value: other.clone() }),
        }
    }
    let text = operation::apply("", &operations).map_err(|refused| error::edit(&refused))?;
    parse(&text, name)?;
    Ok(text)
}
