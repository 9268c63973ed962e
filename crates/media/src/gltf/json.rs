//! The JSON of a glTF: objects that know their paths, for error messages.

use std::fmt::Display;

use bansho_base::host::assets::AssetProblem;

use super::damaged;
use serde_json::{Map, Value};

/// Largest number of values.
const MAX_VALUES: usize = 2_000_000;

/// Largest memory of a value, bytes: that of an object with one field.
const VALUE_BYTES: u64 = 400;

/// Number of values, estimated from above: each but the first follows one of these characters.
fn count_values(json: &[u8]) -> usize {
    json.iter().filter(|byte| matches!(byte, b'[' | b'{' | b',')).count()
}

/// Memory of the parsed values of `json`; its strings are stored once more.
pub(super) fn memory_bytes(json: &[u8]) -> u64 {
    json.len() as u64 + VALUE_BYTES * count_values(json).min(MAX_VALUES) as u64
}

/// The JSON, parsed.
pub(super) fn parse(json: &[u8]) -> Result<Value, AssetProblem> {
    let values = count_values(json);
    if values > MAX_VALUES {
        return Err(damaged(format!("its JSON has about {values} values; allowed: up to {MAX_VALUES}")));
    }
    serde_json::from_slice(json).map_err(|error| damaged(format!("its JSON cannot be read: {error}")))
}

/// An object of the JSON.
pub(super) struct Object<'a> {
    /// Its path, such as `nodes[3]`; empty for the root.
    path: String,
    fields: &'a Map<String, Value>,
}

impl<'a> Object<'a> {
    /// The outermost object.
    pub(super) fn root(value: &'a Value) -> Result<Self, AssetProblem> {
        let fields = value.as_object().ok_or_else(|| damaged("its JSON is not an object"))?;
        Ok(Self { path: String::new(), fields })
    }

    fn path_of(&self, key: &str) -> String {
        if self.path.is_empty() { key.to_owned() } else { format!("{}.{key}", self.path) }
    }

    /// An error about the value of `key`.
    pub(super) fn error_at(&self, key: &str, message: impl Display) -> AssetProblem {
        damaged(format!("{} {message}", self.path_of(key)))
    }

    /// The value of `key`; `null` counts as missing.
    fn get(&self, key: &str) -> Option<&'a Value> {
        self.fields.get(key).filter(|value| !value.is_null())
    }

    /// The value of `key`, converted by `read`; `expected` describes it in errors. `None` if it is missing.
    fn read<T>(
        &self,
        key: &str,
        expected: &str,
        read: impl FnOnce(&'a Value) -> Option<T>,
    ) -> Result<Option<T>, AssetProblem> {
        let Some(value) = self.get(key) else { return Ok(None) };
        match read(value) {
            Some(converted) => Ok(Some(converted)),
            None => Err(self.error_at(key, format!("is invalid; allowed: {expected}"))),
        }
    }

    /// A whole number.
    pub(super) fn unsigned(&self, key: &str) -> Result<Option<usize>, AssetProblem> {
        self.read(key, "a whole number from 0 on", |value| usize::try_from(value.as_u64()?).ok())
    }

    /// A required whole number.
    pub(super) fn required_unsigned(&self, key: &str) -> Result<usize, AssetProblem> {
        self.unsigned(key)?.ok_or_else(|| self.error_at(key, "is missing; allowed: a whole number from 0 on"))
    }

    /// A text.
    pub(super) fn text(&self, key: &str) -> Result<Option<&'a str>, AssetProblem> {
        self.read(key, "a text", Value::as_str)
    }

    /// `N` numbers.
    pub(super) fn numbers<const N: usize>(&self, key: &str) -> Result<Option<[f32; N]>, AssetProblem> {
        self.read(key, &format!("{N} numbers"), |value| {
            let numbers: Option<Vec<f32>> =
                value.as_array()?.iter().map(|number| Some(number.as_f64()? as f32)).collect();
            numbers?.try_into().ok()
        })
    }

    /// Any number of numbers.
    pub(super) fn number_list(&self, key: &str) -> Result<Option<Vec<f64>>, AssetProblem> {
        self.read(key, "numbers", |value| value.as_array()?.iter().map(Value::as_f64).collect())
    }

    /// An object.
    pub(super) fn object(&self, key: &str) -> Result<Option<Self>, AssetProblem> {
        self.read(key, "an object", |value| Some(Self { path: self.path_of(key), fields: value.as_object()? }))
    }

    /// A list; empty if it is missing.
    pub(super) fn list(&self, key: &str) -> Result<&'a [Value], AssetProblem> {
        Ok(self.read(key, "a list", |value| value.as_array().map(Vec::as_slice))?.unwrap_or_default())
    }

    /// The object at `index` of a list.
    pub(super) fn item(&self, key: &str, index: usize) -> Result<Self, AssetProblem> {
        let list = self.list(key)?;
        let value = list
            .get(index)
            .ok_or_else(|| self.error_at(key, format!("has no element {index}; {}", allowed_indices(list.len()))))?;
        let path = format!("{}[{index}]", self.path_of(key));
        match value.as_object() {
            Some(fields) => Ok(Self { path, fields }),
            None => Err(damaged(format!("{path} is invalid; allowed: an object"))),
        }
    }

    /// All objects of a list.
    pub(super) fn items(&self, key: &str) -> Result<impl Iterator<Item = Result<Self, AssetProblem>>, AssetProblem> {
        Ok((0..self.list(key)?.len()).map(move |index| self.item(key, index)))
    }

    /// An index into another list, of `length` elements.
    pub(super) fn index(&self, key: &str, length: usize) -> Result<Option<usize>, AssetProblem> {
        match self.unsigned(key)? {
            Some(index) if index >= length => {
                Err(self.error_at(key, format!("is {index}; {}", allowed_indices(length))))
            }
            index => Ok(index),
        }
    }

    /// Indices into another list, of `length` elements.
    pub(super) fn indices(&self, key: &str, length: usize) -> Result<Vec<usize>, AssetProblem> {
        let mut indices = Vec::new();
        for value in self.list(key)? {
            match value.as_u64().and_then(|index| usize::try_from(index).ok()) {
                Some(index) if index < length => indices.push(index),
                _ => return Err(self.error_at(key, format!("contains {value}; {}", allowed_indices(length)))),
            }
        }
        Ok(indices)
    }
}

fn allowed_indices(length: usize) -> String {
    match length.checked_sub(1) {
        Some(last) => format!("allowed: 0 to {last}"),
        None => "allowed: none, since the list is empty".to_owned(),
    }
}
