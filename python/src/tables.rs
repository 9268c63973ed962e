//! The descriptors of all tables of a scene, from which the keyword builders and their stub are made.

use bansho::{
    KINDS,
    base::parameters::{Descriptor, Kind, TableDescriptor},
};
use pyo3::{
    prelude::*,
    types::{PyDict, PyList},
};

use crate::value;

/// Every kind of table, with its parameters.
#[pyfunction]
pub(crate) fn table_descriptors(py: Python<'_>) -> PyResult<Bound<'_, PyList>> {
    let listed = PyList::empty(py);
    for kind in KINDS {
        let dictionary = described(py, (kind.table)())?;
        dictionary.set_item("key", kind.key)?;
        dictionary.set_item("is_list", kind.is_list())?;
        dictionary.set_item("is_phenomenon", kind.is_phenomenon())?;
        listed.append(dictionary)?;
    }
    Ok(listed)
}

fn described<'py>(py: Python<'py>, table: &TableDescriptor) -> PyResult<Bound<'py, PyDict>> {
    let dictionary = PyDict::new(py);
    dictionary.set_item("doc", &table.doc)?;
    let parameters = PyList::empty(py);
    for descriptor in table.by_purpose().concat() {
        parameters.append(parameter(py, descriptor)?)?;
    }
    dictionary.set_item("parameters", parameters)?;
    Ok(dictionary)
}

fn parameter<'py>(py: Python<'py>, descriptor: &Descriptor) -> PyResult<Bound<'py, PyDict>> {
    let dictionary = PyDict::new(py);
    dictionary.set_item("key", descriptor.key)?;
    dictionary.set_item("doc", &descriptor.doc)?;
    dictionary.set_item("unit", descriptor.unit)?;
    dictionary.set_item("is_for_paper", descriptor.is_for_paper)?;
    dictionary.set_item("allowed", descriptor.kind.expectation())?;
    dictionary.set_item("type", annotation(&descriptor.kind))?;
    let default = descriptor.default.as_ref().map(|default| value::to_python(py, default)).transpose()?;
    dictionary.set_item("default", default)?;
    dictionary.set_item("choices", choices(&descriptor.kind))?;
    let inner = inner_table(&descriptor.kind).map(|table| described(py, table)).transpose()?;
    dictionary.set_item("table", inner)?;
    dictionary.set_item("is_list", matches!(descriptor.kind, Kind::List { .. }))?;
    Ok(dictionary)
}

/// The table that a parameter is, or a list of which.
fn inner_table(kind: &Kind) -> Option<&'static TableDescriptor> {
    match kind {
        Kind::Table(descriptor) => Some(descriptor()),
        Kind::Animated(inner) | Kind::Optional(inner) | Kind::Auto(inner) => inner_table(inner),
        Kind::List { item, .. } => inner_table(item),
        _ => None,
    }
}

/// The names of a choice, each with its description.
fn choices(kind: &Kind) -> Vec<(&'static str, &'static str)> {
    match kind {
        Kind::Choice(choices) => choices.iter().map(|choice| (choice.name, choice.doc)).collect(),
        Kind::Animated(inner) | Kind::Optional(inner) | Kind::Auto(inner) => choices(inner),
        _ => Vec::new(),
    }
}

/// The type of a parameter as Python's annotations write it.
fn annotation(kind: &Kind) -> String {
    match kind {
        Kind::Bool => "bool".into(),
        Kind::Integer { .. } => "int".into(),
        Kind::Number { .. } => "float".into(),
        Kind::Rational { .. } => "float | str".into(),
        Kind::Vector { length, .. } => format!("Vector{length}"),
        Kind::Text | Kind::Asset => "str".into(),
        Kind::Choice(choices) => {
            let names: Vec<String> = choices.iter().map(|choice| format!("\"{}\"", choice.name)).collect();
            format!("Literal[{}]", names.join(", "))
        }
        Kind::Curve { .. } => "Curve".into(),
        Kind::Animated(inner) => format!("{} | Keys", annotation(inner)),
        Kind::Optional(inner) => format!("{} | None", annotation(inner)),
        Kind::Auto(inner) => format!("{} | Literal[\"auto\"]", annotation(inner)),
        Kind::List { item, .. } => format!("Sequence[{}]", annotation(item)),
        Kind::Table(_) => "Mapping[str, Any]".into(),
    }
}
