//! New scenes (`bansho new`): short ones with the parameters that users change first, and complete ones with every parameter, its purpose and
//! its unit. In complete ones, parameters with other values than their defaults are stated; the others are comments with the default. Both
//! draw the same picture.

use bansho_base::{
    parameters::{Descriptor, Kind, PAPER_HEADING, Table, TableDescriptor, Value},
    tables::{self, TableCount, TableKind},
};

use super::{FORMAT, text::toml};

/// A short scene with one phenomenon of `kind` and its scene defaults: the parameters that users change first, each with a brief comment. Of the
/// shared tables of the registry `kinds` it has those that the scene defaults or [`TableKind::first_keys`] name.
pub fn short(kind: &TableKind, kinds: &[TableKind]) -> String {
    // A test checks that all settings can be parsed.
    let setting = toml::parse(kind.scene_defaults).unwrap_or_default();
    let mut text = format!("bansho = {FORMAT}   # format version\n");
    let (several, others): (Vec<&TableKind>, Vec<&TableKind>) =
        tables::shared(kinds).partition(|shared| stated_tables(&setting, shared.key).len() > 1);
    // A list of inline tables belongs to the root, before the first table.
    several.iter().for_each(|shared| brief_list(&mut text, shared, &stated_tables(&setting, shared.key)));
    for shared in others {
        let first = shared.first_keys;
        let stated = stated_tables(&setting, shared.key);
        let empty = Table::default();
        // A table with keys to change first is written even if the scene defaults do not have it.
        let unstated = (stated.is_empty() && !first.is_empty()).then_some(&empty);
        for stated in stated.into_iter().chain(unstated) {
            brief_table(&mut text, &shared.header(), (shared.table)(), stated, first);
        }
    }
    let stated = stated_tables(&setting, kind.key).first().copied().cloned().unwrap_or_default();
    brief_table(&mut text, &kind.header(), (kind.table)(), &stated, kind.first_keys);
    text
}

/// A list of tables, one on each line.
fn brief_list(text: &mut String, shared: &TableKind, tables: &[&Table]) {
    text.push('\n');
    comment(text, &format!("{} More can be added here.", (shared.table)().doc));
    text.push_str(&format!("{} = [\n", shared.key));
    tables.iter().for_each(|table| text.push_str(&format!("    {},\n", Value::Table((*table).clone()))));
    text.push_str("]\n");
}

/// A line of a short scene.
struct Line {
    /// `key = value`
    assignment: String,
    comment: String,
}

/// A table with its `stated` values and its `first` keys, then its lists that have `first` keys, with one item each.
fn brief_table(text: &mut String, header: &str, descriptor: &TableDescriptor, stated: &Table, first: &[&str]) {
    /// Longest assignment whose comment is aligned with the others.
    const MAX_ALIGNED: usize = 44;
    let lines = lines("", descriptor, stated, first);
    let width =
        lines.iter().map(|line| line.assignment.len()).filter(|&length| length <= MAX_ALIGNED).max().unwrap_or(0);
    text.push_str(&format!("\n{header}\n"));
    lines.iter().for_each(|line| text.push_str(&format!("{:width$}   # {}\n", line.assignment, line.comment)));
    for parameter in descriptor.parameters.iter().filter(|parameter| stated.get(parameter.key).is_none()) {
        let Kind::List { item, .. } = &parameter.kind else { continue };
        let Kind::Table(inner) = **item else { continue };
        let first: Vec<&str> =
            first.iter().filter_map(|path| path.strip_prefix(parameter.key)?.strip_prefix('.')).collect();
        if !first.is_empty() {
            let header = format!("[[{}.{}]]", header.trim_matches(['[', ']']), parameter.key);
            brief_table(text, &header, inner(), &Table::default(), &first);
        }
    }
}

/// The `stated` values and the `first` keys of a table and of its inner tables.
fn lines(prefix: &str, descriptor: &TableDescriptor, stated: &Table, first: &[&str]) -> Vec<Line> {
    let mut all = Vec::new();
    for parameter in &descriptor.parameters {
        let path = format!("{prefix}{}", parameter.key);
        let value = stated.get(parameter.key).map(|node| &node.value);
        if let Kind::Table(inner) = &parameter.kind {
            let empty = Table::default();
            let stated = if let Some(Value::Table(table)) = value { table } else { &empty };
            all.extend(lines(&format!("{path}."), inner(), stated, first));
        } else if let Some(value) = value.or(parameter.default.as_ref().filter(|_| first.contains(&path.as_str()))) {
            let assignment = format!("{path} = {value}");
            all.push(Line { comment: brief(parameter, assignment.len()), assignment });
        }
    }
    all
}

/// The first sentence of a parameter's documentation and its unit. If the line, which has `after` characters before the comment, becomes too
/// long, the sentence is cut at its first colon or semicolon.
fn brief(parameter: &Descriptor, after: usize) -> String {
    const WIDTH: usize = 110;
    let doc = parameter.doc.split_whitespace().collect::<Vec<_>>().join(" ");
    // A period before a small letter is that of an abbreviation.
    let mut periods = doc.match_indices(". ").map(|(at, _)| at);
    let end = periods.find(|&at| doc[at + 2..].starts_with(char::is_uppercase)).unwrap_or(doc.len());
    let mut sentence = doc[..end].trim_end_matches('.');
    if after + sentence.len() > WIDTH {
        sentence = sentence.split([';', ':']).next().unwrap_or(sentence);
    }
    let unit = if parameter.unit.is_empty() { String::new() } else { format!(" [{}]", parameter.unit) };
    format!("{sentence}{unit}")
}

/// A complete scene with one phenomenon of `kind` and its scene defaults, with a comment for each parameter. Optional tables of the
/// registry `kinds` are in it only if the scene defaults have them.
pub fn commented(kind: &TableKind, kinds: &[TableKind]) -> String {
    // A test checks that all settings can be parsed.
    let setting = toml::parse(kind.scene_defaults).unwrap_or_default();
    let mut text = format!("bansho = {FORMAT}   # format version\n");
    for shared in tables::shared(kinds) {
        let stated = stated_tables(&setting, shared.key);
        if stated.is_empty() && shared.count == TableCount::One {
            table(&mut text, &shared.header(), (shared.table)(), &Table::default());
        }
        for stated in stated {
            table(&mut text, &shared.header(), (shared.table)(), stated);
        }
    }
    let stated = stated_tables(&setting, kind.key).first().copied().cloned().unwrap_or_default();
    table(&mut text, &kind.header(), (kind.table)(), &stated);
    text
}

/// The table or the tables of a key.
fn stated_tables<'a>(setting: &'a Table, key: &str) -> Vec<&'a Table> {
    match setting.get(key).map(|node| &node.value) {
        Some(Value::Table(table)) => vec![table],
        Some(Value::List(items)) => {
            let tables = items.iter().filter_map(|item| match &item.value {
                Value::Table(table) => Some(table),
                _ => None,
            });
            tables.collect()
        }
        _ => Vec::new(),
    }
}

fn table(text: &mut String, header: &str, descriptor: &TableDescriptor, stated: &Table) {
    text.push('\n');
    comment(text, &descriptor.doc);
    text.push_str(header);
    text.push('\n');
    let [for_pictures, for_paper] = parameters("", descriptor, stated);
    text.push_str(&for_pictures);
    if !for_paper.is_empty() {
        text.push_str(&format!("\n# {PAPER_HEADING}:\n{for_paper}"));
    }
}

/// The lines of the parameters of a table and of its inner tables, and of those that are there only for a paper, at any depth. The latter come after all
/// others, since inner tables have no headers, where the part of one would end.
fn parameters(prefix: &str, descriptor: &TableDescriptor, stated: &Table) -> [String; 2] {
    let mut texts = [String::new(), String::new()];
    for parameter in &descriptor.parameters {
        let key = parameter.key;
        let value = stated.get(key).map(|node| &node.value);
        let text = &mut texts[usize::from(parameter.is_for_paper)];
        text.push('\n');
        comment(text, &explanation(parameter));
        match (&parameter.kind, value, &parameter.default) {
            (Kind::Table(inner), value, _) => {
                let empty = Table::default();
                let stated = if let Some(Value::Table(table)) = value { table } else { &empty };
                let [for_pictures, for_paper] = parameters(&format!("{prefix}{key}."), inner(), stated);
                text.push_str(&for_pictures);
                texts[1].push_str(&for_paper);
            }
            (_, Some(value), _) => text.push_str(&format!("{prefix}{key} = {value}\n")),
            (_, None, Some(default)) => text.push_str(&format!("# {prefix}{key} = {default}\n")),
            (_, None, None) => text.push_str(&format!("# {prefix}{key} =\n")),
        }
    }
    texts
}

fn explanation(parameter: &Descriptor) -> String {
    let unit = if parameter.unit.is_empty() { String::new() } else { format!(" [{}]", parameter.unit) };
    let allowed = match &parameter.kind {
        Kind::Table(_) => String::new(),
        kind => format!(" Allowed: {}.", kind.expectation()),
    };
    format!("{}{unit}{allowed}", parameter.doc)
}

/// Comment lines, broken between words.
fn comment(text: &mut String, words: &str) {
    const WIDTH: usize = 110;
    let mut length = WIDTH;
    for word in words.split_whitespace() {
        if length + 1 + word.len() > WIDTH {
            if !text.ends_with('\n') {
                text.push('\n');
            }
            text.push('#');
            length = 1;
        }
        text.push(' ');
        text.push_str(word);
        length += 1 + word.len();
    }
    text.push('\n');
}
