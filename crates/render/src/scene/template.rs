//! New scenes: every parameter with its default, its unit and what it is for, ready to be uncommented.

use bansho_base::parameters::{Descriptor, Kind, TableDescriptor, Value};

use super::{FORMAT, PhenomenonKind, SHARED_TABLES};

/// A scene with one phenomenon of `kind`, all defaults, each parameter explained in a comment.
pub fn commented(kind: &PhenomenonKind) -> String {
    let mut text = format!("bansho = {FORMAT}   # format version\n");
    let optional = ["plate", "sky", "ground"];
    for shared in SHARED_TABLES.iter().filter(|shared| !shared.many && !optional.contains(&shared.key)) {
        table(&mut text, &format!("[{}]", shared.key), (shared.table)());
    }
    table(&mut text, &format!("[[{}]]", kind.key), (kind.table)());
    text
}

fn table(text: &mut String, header: &str, descriptor: &TableDescriptor) {
    text.push('\n');
    comment(text, "", &descriptor.doc);
    text.push_str(header);
    text.push('\n');
    parameters(text, "", descriptor);
}

fn parameters(text: &mut String, prefix: &str, descriptor: &TableDescriptor) {
    for parameter in &descriptor.parameters {
        text.push('\n');
        comment(text, "", &explanation(parameter));
        match (&parameter.kind, &parameter.default) {
            (Kind::Table(inner), _) => parameters(text, &format!("{prefix}{}.", parameter.key), inner()),
            (_, Some(default)) => line(text, prefix, parameter.key, default),
            (_, None) => text.push_str(&format!("# {prefix}{} =\n", parameter.key)),
        }
    }
}

fn line(text: &mut String, prefix: &str, key: &str, default: &Value) {
    text.push_str(&format!("# {prefix}{key} = {default}\n"));
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
fn comment(text: &mut String, indent: &str, words: &str) {
    const WIDTH: usize = 110;
    let mut length = WIDTH;
    for word in words.split_whitespace() {
        if length + 1 + word.len() > WIDTH {
            if !text.ends_with('\n') {
                text.push('\n');
            }
            text.push_str(&format!("{indent}#"));
            length = 1;
        }
        text.push(' ');
        text.push_str(word);
        length += 1 + word.len();
    }
    text.push('\n');
}
