//! Values of a scene as Python objects, and the other way.

use bansho::{
    Scene,
    base::parameters::{Node, Parameters, Table, Value},
    scene::FORMAT,
};
use pyo3::{
    prelude::*,
    types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyMapping, PySequence, PyString},
};

use crate::error;

/// Deepest nesting of values that is read.
const MOST_LEVELS: usize = 32;

/// A Python object as a value of a scene: numbers, strings, lists, dictionaries, and what has a method `tolist` (numpy) or `to_dict` (tables).
///
/// # Errors
/// `ValueError` for another type, a whole number beyond 64 bits, a number that is not finite, or an object that contains itself.
pub(crate) fn from_python(object: &Bound<PyAny>) -> PyResult<Value> {
    read(object, 0)
}

fn read(object: &Bound<PyAny>, level: usize) -> PyResult<Value> {
    if level > MOST_LEVELS {
        return Err(error::value(format!("a value is nested more than {MOST_LEVELS} times")));
    }
    if object.is_instance_of::<PyBool>() {
        return Ok(Value::Bool(object.extract()?));
    }
    if object.is_instance_of::<PyInt>() {
        let whole = object.extract().map_err(|_| error::value(format!("{object} is beyond 64 bits")))?;
        return Ok(Value::Integer(whole));
    }
    if object.is_instance_of::<PyFloat>() {
        let number: f64 = object.extract()?;
        return if number.is_finite() {
            Ok(Value::Number(number))
        } else {
            Err(error::value(format!("the number {}; allowed: finite numbers", object.repr()?)))
        };
    }
    if object.is_instance_of::<PyString>() {
        return Ok(Value::Text(object.extract()?));
    }
    for method in ["to_dict", "tolist"] {
        if object.hasattr(method)? {
            return read(&object.call_method0(method)?, level + 1);
        }
    }
    if let Ok(mapping) = object.cast::<PyMapping>() {
        return Ok(Value::Table(read_table(mapping, level)?));
    }
    if let Ok(sequence) = object.cast::<PySequence>() {
        let mut items = Vec::new();
        for item in sequence.try_iter()? {
            items.push(Node::from(read(&item?, level + 1)?));
        }
        return Ok(Value::List(items));
    }
    let found = object.get_type().name()?;
    let allowed = "bool, int, float, str, a list, a dict, a numpy array or a table such as bansho.Rain(...)";
    Err(error::value(format!("a value of type {found}; allowed: {allowed}")))
}

/// A dictionary as a table. Keys whose value is `None` are left out.
fn read_table(mapping: &Bound<PyMapping>, level: usize) -> PyResult<Table> {
    let mut table = Table::default();
    for entry in mapping.items()?.try_iter()? {
        let (key, item): (Bound<PyAny>, Bound<PyAny>) = entry?.extract()?;
        let key: String = key.extract().map_err(|_| error::value(format!("the key {key}; allowed: a str")))?;
        if !item.is_none() {
            table.push(key, read(&item, level + 1)?);
        }
    }
    Ok(table)
}

/// A value of a scene as a Python object.
///
/// # Errors
/// Python is out of memory.
pub(crate) fn to_python<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Value::Bool(truth) => PyBool::new(py, *truth).to_owned().into_any(),
        Value::Integer(whole) => whole.into_pyobject(py)?.into_any(),
        Value::Number(number) => PyFloat::new(py, *number).into_any(),
        Value::Text(text) => PyString::new(py, text).into_any(),
        Value::List(items) => {
            let list = PyList::empty(py);
            for item in items {
                list.append(to_python(py, &item.value)?)?;
            }
            list.into_any()
        }
        Value::Table(table) => table_to_python(py, table)?.into_any(),
    })
}

/// A table as a dictionary.
///
/// # Errors
/// Python is out of memory.
pub(crate) fn table_to_python<'py>(py: Python<'py>, table: &Table) -> PyResult<Bound<'py, PyDict>> {
    let dictionary = PyDict::new(py);
    for entry in &table.entries {
        dictionary.set_item(&entry.key, to_python(py, &entry.node.value)?)?;
    }
    Ok(dictionary)
}

/// Every table of a checked scene with every value in effect: those that its text states, and the defaults of all others.
pub(crate) fn values_in_effect(scene: &Scene) -> Table {
    let mut root = Table::default();
    root.push("bansho", Value::Integer(FORMAT));
    root.push("picture", Value::Table(scene.picture.to_table()));
    root.push("camera", Value::Table(scene.camera.to_table()));
    root.push("plate", Value::Table(scene.plate.to_table()));
    root.push("wind", Value::Table(scene.wind.to_table()));
    root.push("air", Value::Table(scene.air.to_table()));
    for shared in scene.tables.iter() {
        let table = Value::Table(shared.parameters.canonical());
        if shared.kind.is_list() {
            append(&mut root, shared.kind.key, table)
        } else {
            root.push(shared.kind.key, table)
        }
    }
    for instance in &scene.instances {
        let mut table = Table::default();
        table.push("name", Value::Text(instance.name.clone()));
        table.push("enabled", Value::Bool(instance.enabled));
        table.entries.extend(instance.parameters.canonical().entries);
        append(&mut root, instance.kind.key, Value::Table(table));
    }
    root
}

/// Adds an item to the list `key`, which is created if there is none.
fn append(root: &mut Table, key: &str, item: Value) {
    match root.entries.iter_mut().find(|entry| entry.key == key).map(|entry| &mut entry.node.value) {
        Some(Value::List(items)) => items.push(item.into()),
        _ => root.push(key, Value::List(vec![item.into()])),
    }
}
