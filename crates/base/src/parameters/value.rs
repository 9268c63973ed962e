//! Values of a scene file with their locations in the source.

/// Byte range in the source text.
pub type Span = std::ops::Range<usize>;

/// A value and its location in the source.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// The value.
    pub value: Value,
    /// Its location; empty for values that are not from a file.
    pub span: Span,
}

/// A value in a scene file.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// `true` or `false`.
    Bool(bool),
    /// An integer.
    Integer(i64),
    /// A floating-point number.
    Number(f64),
    /// A string.
    Text(String),
    /// An array.
    List(Vec<Node>),
    /// A table, inline or not.
    Table(Table),
}

/// Keys and values in the order of the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Entries in the order of the file.
    pub entries: Vec<Entry>,
}

/// One key of a table with its value.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// The key.
    pub key: String,
    /// Location of the key.
    pub key_span: Span,
    /// Its value.
    pub node: Node,
}

impl Table {
    /// The value of `key`.
    pub fn get(&self, key: &str) -> Option<&Node> {
        self.entries.iter().find(|entry| entry.key == key).map(|entry| &entry.node)
    }

    /// The value at a path: `key`, or one within tables, `table.key`.
    pub fn at_path(&self, path: &str) -> Option<&Value> {
        let Some((first, rest)) = path.split_once('.') else { return self.get(path).map(|node| &node.value) };
        match &self.get(first)?.value {
            Value::Table(inner) => inner.at_path(rest),
            _ => None,
        }
    }

    /// Appends a key without a source location.
    pub fn push(&mut self, key: impl Into<String>, value: Value) {
        self.entries.push(Entry { key: key.into(), key_span: 0..0, node: Node::from(value) });
    }
}

impl From<Value> for Node {
    fn from(value: Value) -> Self {
        Self { value, span: 0..0 }
    }
}

impl Value {
    /// A list of numbers.
    pub fn numbers(numbers: impl IntoIterator<Item = f64>) -> Self {
        Self::List(numbers.into_iter().map(|number| Self::Number(number).into()).collect())
    }

    /// Name of its type, for messages.
    pub fn type_name(&self) -> &'static str {
        match self {
            Self::Bool(_) => "a boolean",
            Self::Integer(_) => "a whole number",
            Self::Number(_) => "a number",
            Self::Text(_) => "a string",
            Self::List(_) => "a list",
            Self::Table(_) => "a table",
        }
    }

    /// Its number, if it is one.
    pub fn as_number(&self) -> Option<f64> {
        match *self {
            Self::Integer(integer) => Some(integer as f64),
            Self::Number(number) => Some(number),
            _ => None,
        }
    }
}

/// A TOML basic string.
fn write_text(f: &mut std::fmt::Formatter<'_>, text: &str) -> std::fmt::Result {
    f.write_str("\"")?;
    for character in text.chars() {
        match character {
            '"' | '\\' => write!(f, "\\{character}")?,
            control if control.is_control() => write!(f, "\\u{:04X}", u32::from(control))?,
            other => write!(f, "{other}")?,
        }
    }
    f.write_str("\"")
}

/// Writes the value in the syntax of a scene file, with tables inline.
impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Bool(value) => write!(f, "{value}"),
            Self::Integer(value) => write!(f, "{value}"),
            Self::Number(value) => write!(f, "{value:?}"),
            Self::Text(value) => write_text(f, value),
            Self::List(items) => {
                f.write_str("[")?;
                for (index, item) in items.iter().enumerate() {
                    write!(f, "{}{}", if index > 0 { ", " } else { "" }, item.value)?;
                }
                f.write_str("]")
            }
            Self::Table(table) => {
                f.write_str("{")?;
                for (index, entry) in table.entries.iter().enumerate() {
                    write!(f, "{} {} = {}", if index > 0 { "," } else { "" }, entry.key, entry.node.value)?;
                }
                f.write_str(" }")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_leads_through_tables_only() {
        let mut inner = Table::default();
        inner.push("key", Value::Integer(3));
        let mut outer = Table::default();
        outer.push("table", Value::Table(inner.clone()));
        outer.push("number", Value::Integer(1));
        assert_eq!(outer.at_path("number"), Some(&Value::Integer(1)));
        assert_eq!(outer.at_path("table"), Some(&Value::Table(inner)));
        assert_eq!(outer.at_path("table.key"), Some(&Value::Integer(3)));
        for path in ["other", "table.other", "number.key", "table.key.key", ""] {
            assert_eq!(outer.at_path(path), None, "{path}");
        }
    }

    #[test]
    fn texts_are_written_as_toml_strings() {
        let written = Value::Text("a\"b\\c\n\u{200b}\u{7f}é".into()).to_string();
        assert_eq!(written, "\"a\\\"b\\\\c\\u000A\u{200b}\\u007Fé\"");
    }
}
