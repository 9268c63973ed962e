//! In what a scene departs from the papers of its phenomena.

use bansho_base::{
    parameters::{Node, Parameters, Table, Value},
    tables::{PaperSetting, PaperValues},
};

use crate::{Scene, parse_values};

/// A value that is not that of the paper.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{paper}, {source_in_paper}: {path} = {allowed}, here {value}")]
pub struct PaperDeparture {
    /// Path of the key in the scene.
    pub path: String,
    /// Its value, in the syntax of scene files; "none" where it has none. Long lists and tables are described instead.
    pub value: String,
    /// Authors of the paper.
    pub paper: &'static str,
    /// The values that follow it.
    pub allowed: String,
    /// Where the paper says so.
    pub source_in_paper: &'static str,
}

impl Scene {
    /// The values of its phenomena that do not follow their papers to the letter, and those of the scene itself; in the order of the phenomena. Phenomena
    /// without a paper, and what a paper leaves open, are not listed.
    #[must_use]
    pub fn paper_departures(&self) -> Vec<PaperDeparture> {
        let mut departures: Vec<PaperDeparture> = Vec::new();
        let whole = self.single_tables();
        let mut index_of_kind = std::collections::BTreeMap::new();
        for instance in &self.instances {
            let index = index_of_kind.entry(instance.kind.key).or_insert(0_usize);
            let path = instance.kind.path(*index);
            *index += 1;
            let Some(paper) = instance.kind.paper.filter(|_| instance.enabled) else { continue };
            let table = instance.parameters.canonical();
            let of_table = paper.settings.iter().flat_map(|setting| departing(&table, setting, &format!("{path}.")));
            let of_scene = paper.scene_settings.iter().flat_map(|setting| departing(&whole, setting, ""));
            for (path, value, setting) in of_table.chain(of_scene) {
                // Several phenomena may have the same paper.
                if departures.iter().all(|departure| departure.path != path) {
                    departures.push(PaperDeparture {
                        path,
                        value,
                        paper: paper.paper,
                        allowed: setting.allowed.to_string(),
                        source_in_paper: setting.source,
                    });
                }
            }
        }
        departures
    }

    /// The tables that are fields of the scene, and those that phenomena share and of which there is one, by their keys.
    fn single_tables(&self) -> Table {
        let mut tables = Table::default();
        tables.push("picture", Value::Table(self.picture.to_table()));
        tables.push("camera", Value::Table(self.camera.to_table()));
        for table in self.tables.iter().filter(|table| !table.kind.is_list()) {
            tables.push(table.kind.key, Value::Table(table.parameters.canonical()));
        }
        tables
    }
}

/// Paths and values of a setting's key where its value in `table` is not allowed.
fn departing<'a>(table: &Table, setting: &'a PaperSetting, prefix: &str) -> Vec<(String, String, &'a PaperSetting)> {
    let mut values = Vec::new();
    collect_values(table, setting.key, prefix.to_owned(), &mut values);
    let departing = values.into_iter().filter(|(_, value)| !is_allowed(*value, &setting.allowed));
    departing.map(|(path, value)| (path, value.map_or("none".to_owned(), short_text), setting)).collect()
}

/// The value of `key` with its path, which begins with `prefix`; of a key with `*`, those of all items of that list.
fn collect_values<'a>(table: &'a Table, key: &str, prefix: String, values: &mut Vec<(String, Option<&'a Value>)>) {
    let Some((list, of_item)) = key.split_once(".*.") else {
        values.push((format!("{prefix}{key}"), table.at_path(key)));
        return;
    };
    let Some(Value::List(items)) = table.at_path(list) else { return };
    for (index, item) in items.iter().enumerate() {
        if let Value::Table(item) = &item.value {
            collect_values(item, of_item, format!("{prefix}{list}.{index}."), values);
        }
    }
}

fn is_allowed(value: Option<&Value>, allowed: &PaperValues) -> bool {
    match allowed {
        PaperValues::OneOf(texts) => texts.iter().any(|text| match (value, parse(text)) {
            (Some(value), Some(allowed)) => is_same(value, &allowed),
            (value, allowed) => value.is_none() && allowed.is_none(),
        }),
        PaperValues::AboveZero => value.and_then(Value::as_number).is_some_and(|number| number > 0.0),
    }
}

/// A value in the syntax of scene files; `None` for an empty one.
fn parse(text: &str) -> Option<Value> {
    if text.is_empty() {
        return None;
    }
    let table = parse_values(&format!("value = {text}")).ok()?;
    table.get("value").map(|node| node.value.clone())
}

/// Lists and tables with longer texts are described.
const MAX_CHARACTERS: usize = 48;

/// A value in the syntax of scene files. Of a long one that has parts, what it is: "a curve of 5 points".
fn short_text(value: &Value) -> String {
    let text = value.to_string();
    let is_list = |node: &Node| matches!(node.value, Value::List(_));
    match value {
        _ if text.chars().count() <= MAX_CHARACTERS => text,
        Value::List(items) if items.iter().all(is_list) => format!("a curve of {} points", items.len()),
        Value::List(items) => format!("a list of {}", items.len()),
        Value::Table(table) => format!("a table of {} keys", table.entries.len()),
        _ => text,
    }
}

/// Papers print four digits of a number at most, such as 0.0333 s for 1/30 s.
const ROUNDING: f64 = 2e-3;

/// Whether two values are the same, wherever they were written.
fn is_same(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::List(a), Value::List(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| is_same(&a.value, &b.value))
        }
        (a, b) => match (a.as_number(), b.as_number()) {
            (Some(a), Some(b)) => (a - b).abs() <= ROUNDING * b.abs(),
            _ => a == b,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(value: &str) -> String {
        short_text(&parse(value).unwrap())
    }

    #[test]
    fn long_values_are_described() {
        assert_eq!(text("[[0.0, 0.0], [1.0, 0.5]]"), "[[0.0, 0.0], [1.0, 0.5]]");
        assert_eq!(text("[[0.0, 0.0], [0.25, 0.5], [0.5, 1.0], [0.75, 1.5], [1.0, 0.0]]"), "a curve of 5 points");
        assert_eq!(text(&format!("[{}]", ["1.25"; 20].join(", "))), "a list of 20");
        assert_eq!(text("{ first = [1.0, 2.0, 3.0, 4.0], second = [1.0, 2.0, 3.0, 4.0] }"), "a table of 2 keys");
        // A text has no parts.
        let path = format!("\"{}\"", "a".repeat(100));
        assert_eq!(text(&path), path);
    }
}
