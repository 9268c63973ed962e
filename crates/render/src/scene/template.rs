//! New scenes: every parameter with its unit and what it is for, stated where the phenomenon is seen the better for it, and else a comment
//! with its default, ready to be uncommented.

use bansho_base::parameters::{Descriptor, Kind, Table, TableDescriptor, Value};

use super::{FORMAT, PhenomenonKind, SHARED_TABLES, toml};

/// Shared tables that a scene need not have, and has only where the phenomenon's setting does.
const OPTIONAL: [&str; 5] = ["plate", "sky", "ground", "light", "obstacle"];

/// A scene with one phenomenon of `kind` in its setting, each parameter explained in a comment.
pub fn commented(kind: &PhenomenonKind) -> String {
    // A test holds that settings can be read.
    let setting = toml::parse(kind.setting).unwrap_or_default();
    let mut text = format!("bansho = {FORMAT}   # format version\n");
    for shared in SHARED_TABLES {
        let stated = tables(&setting, shared.key);
        if stated.is_empty() && !OPTIONAL.contains(&shared.key) {
            table(&mut text, &format!("[{}]", shared.key), (shared.table)(), &Table::default());
        }
        for stated in stated {
            let header = if shared.many { format!("[[{}]]", shared.key) } else { format!("[{}]", shared.key) };
            table(&mut text, &header, (shared.table)(), stated);
        }
    }
    let stated = tables(&setting, kind.key).first().copied().cloned().unwrap_or_default();
    table(&mut text, &format!("[[{}]]", kind.key), (kind.table)(), &stated);
    text
}

/// The table or tables that are stated under a key.
fn tables<'a>(setting: &'a Table, key: &str) -> Vec<&'a Table> {
    match setting.get(key).map(|node| &node.value) {
        Some(Value::Table(table)) => vec![table],
        Some(Value::List(items)) => {
            let table = |value: &'a Value| if let Value::Table(table) = value { Some(table) } else { None };
            items.iter().filter_map(|item| table(&item.value)).collect()
        }
        _ => Vec::new(),
    }
}

fn table(text: &mut String, header: &str, descriptor: &TableDescriptor, stated: &Table) {
    text.push('\n');
    comment(text, &descriptor.doc);
    text.push_str(header);
    text.push('\n');
    parameters(text, "", descriptor, stated);
}

fn parameters(text: &mut String, prefix: &str, descriptor: &TableDescriptor, stated: &Table) {
    for parameter in &descriptor.parameters {
        text.push('\n');
        comment(text, &explanation(parameter));
        let key = parameter.key;
        let own = stated.get(key).map(|node| &node.value);
        match (&parameter.kind, own, &parameter.default) {
            (Kind::Table(inner), own, _) => {
                let nothing = Table::default();
                let own = if let Some(Value::Table(own)) = own { own } else { &nothing };
                parameters(text, &format!("{prefix}{key}."), inner(), own);
            }
            (_, Some(value), _) => text.push_str(&format!("{prefix}{key} = {value}\n")),
            (_, None, Some(default)) => text.push_str(&format!("# {prefix}{key} = {default}\n")),
            (_, None, None) => text.push_str(&format!("# {prefix}{key} =\n")),
        }
    }
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
