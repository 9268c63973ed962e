//! The JSON schema of scene files, with which text editors complete keys and check values.

use bansho_base::{
    parameters::{Descriptor, Kind, PAPER_HEADING, TableDescriptor, Value},
    tables::TableKind,
};
use serde_json::{Value as Json, json};

use super::{
    FORMAT,
    check::{MAX_NAME_BYTES, NAMES_RESERVED_BY_READERS, reserved_names},
};

/// The schema (JSON Schema 2020-12) of scene files with these kinds of tables.
pub fn schema(kinds: &[TableKind]) -> Json {
    let mut properties = serde_json::Map::new();
    properties.insert("bansho".into(), json!({ "description": "Format version.", "const": FORMAT }));
    for kind in kinds {
        let name = kind.is_phenomenon().then(|| name_schema(kinds));
        let table = table((kind.table)(), name);
        properties.insert(kind.key.into(), if kind.is_list() { list_of(table) } else { table });
    }
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Bansho scene",
        "type": "object",
        "required": ["bansho"],
        "additionalProperties": false,
        "properties": properties,
    })
}

fn list_of(item: Json) -> Json {
    json!({ "type": "array", "items": item })
}

/// The schema of a table. Phenomena have a `name` with that schema, and can be disabled.
fn table(descriptor: &TableDescriptor, name: Option<Json>) -> Json {
    let mut properties = serde_json::Map::new();
    if let Some(name) = name {
        properties.insert("name".into(), name);
        properties.insert("enabled".into(), json!({ "type": "boolean", "default": true }));
    }
    // The order in which editors offer keys.
    for parameter in descriptor.by_purpose().concat() {
        properties.insert(parameter.key.into(), property(parameter));
    }
    json!({
        "type": "object",
        "description": descriptor.doc,
        "additionalProperties": false,
        "properties": properties,
    })
}

/// The name of a phenomenon, as the parser takes it.
fn name_schema(kinds: &[TableKind]) -> Json {
    // No dots or control characters, and at least one letter that is no space.
    let pattern = r"^[^.\x00-\x1f\x7f-\x9f]*[^.\s\x00-\x1f\x7f-\x9f][^.\x00-\x1f\x7f-\x9f]*$";
    let reserved = [&reserved_names(kinds)[..], &NAMES_RESERVED_BY_READERS[..]].concat();
    json!({
        "type": "string",
        "description": "Unique name; names its layers.",
        "minLength": 1,
        "maxLength": MAX_NAME_BYTES,
        "pattern": pattern,
        "not": { "enum": reserved },
    })
}

fn property(parameter: &Descriptor) -> Json {
    let mut schema = kind(&parameter.kind);
    if let Some(object) = schema.as_object_mut() {
        let unit = if parameter.unit.is_empty() { String::new() } else { format!(" [{}]", parameter.unit) };
        let purpose = if parameter.is_for_paper { format!(" ({PAPER_HEADING}.)") } else { String::new() };
        object.insert("description".into(), json!(format!("{}{unit}{purpose}", parameter.doc)));
        if let Some(default) = &parameter.default {
            object.insert("default".into(), value(default));
        }
    }
    schema
}

fn kind(kind: &Kind) -> Json {
    match kind {
        Kind::Bool => json!({ "type": "boolean" }),
        Kind::Integer { min, max } => json!({ "type": "integer", "minimum": min, "maximum": max }),
        Kind::Number { min, max } => number(*min, *max),
        Kind::Rational { min, max } => {
            json!({ "anyOf": [number(*min, *max), { "type": "string", "pattern": "^[0-9]+ */ *[0-9]+$" }] })
        }
        Kind::Vector { length, min, max } => {
            json!({ "type": "array", "items": number(*min, *max), "minItems": length, "maxItems": length })
        }
        Kind::Text => json!({ "type": "string" }),
        Kind::Asset => json!({ "type": "string", "minLength": 1 }),
        Kind::Choice(choices) => json!({ "enum": choices.iter().map(|choice| choice.name).collect::<Vec<_>>() }),
        Kind::Curve { x, y, .. } => curve(*x, *y),
        Kind::Animated(inner) => json!({ "anyOf": [self::kind(inner), keys(inner)] }),
        Kind::Optional(inner) => self::kind(inner),
        Kind::Auto(inner) => json!({ "anyOf": [{ "const": "auto" }, self::kind(inner)] }),
        Kind::List { item, min, max } => {
            json!({ "type": "array", "items": self::kind(item), "minItems": min, "maxItems": max })
        }
        Kind::Table(descriptor) => table(descriptor(), None),
    }
}

fn number(min: f64, max: f64) -> Json {
    json!({ "type": "number", "minimum": min, "maximum": max })
}

fn pair(first: Json, second: Json) -> Json {
    json!({ "type": "array", "prefixItems": [first, second], "items": false, "minItems": 2 })
}

fn interpolation() -> Json {
    json!({ "enum": ["monotone", "linear", "step"], "default": "monotone" })
}

fn curve(x: [f64; 2], y: [f64; 2]) -> Json {
    let points = json!({ "type": "array", "items": pair(number(x[0], x[1]), number(y[0], y[1])), "minItems": 1 });
    let table = json!({
        "type": "object",
        "additionalProperties": false,
        "required": ["points"],
        "properties": { "points": points, "interpolation": interpolation() },
    });
    json!({ "anyOf": [points, table] })
}

fn keys(inner: &Kind) -> Json {
    let key = pair(json!({ "type": "number", "description": "Time [s]." }), kind(inner));
    json!({
        "type": "object",
        "additionalProperties": false,
        "required": ["keys"],
        "properties": {
            "keys": { "type": "array", "items": key, "minItems": 1 },
            "interpolation": interpolation(),
        },
    })
}

fn value(value: &Value) -> Json {
    match value {
        Value::Bool(boolean) => json!(boolean),
        Value::Integer(integer) => json!(integer),
        Value::Number(number) => json!(number),
        Value::Text(text) => json!(text),
        Value::List(items) => items.iter().map(|item| self::value(&item.value)).collect(),
        Value::Table(table) => {
            let entries = table.entries.iter().map(|entry| (entry.key.clone(), self::value(&entry.node.value)));
            Json::Object(entries.collect())
        }
    }
}
