//! Parses TOML to values with spans.

use bansho_base::parameters::{Entry, Node, Problem, ProblemKind, Span, Table, Value};
use toml_edit::{Document, Item, TableLike};

/// The values of a TOML text.
///
/// # Errors
/// The text is not TOML, or has too many values.
pub(crate) fn parse(text: &str) -> Result<Table, Problem> {
    check_value_count(text)?;
    let document = Document::parse(text).map_err(|error| Problem {
        span: error.span().or_else(|| too_deep_key(text)),
        path: String::new(),
        kind: ProblemKind::Syntax(error.message().replace('\n', "; ")),
    })?;
    Ok(table(document.as_table()))
}

/// Maximum number of values and tables of a text, counted by the characters `,[{=.` (dots make tables of dotted keys). Each takes up to
/// 1500 bytes of memory: 1.8 GB for this number.
pub(crate) const MAX_VALUES: usize = 1_200_000;

/// Checks, before a text is parsed, that it has no more than [`MAX_VALUES`] values.
///
/// # Errors
/// It has more; the span is that of the first one too many.
pub(crate) fn check_value_count(text: &str) -> Result<(), Problem> {
    let characters = text.bytes().enumerate().filter(|(_, byte)| matches!(byte, b',' | b'[' | b'{' | b'=' | b'.'));
    match characters.map(|(at, _)| at).nth(MAX_VALUES) {
        None => Ok(()),
        Some(at) => {
            let kind = ProblemKind::TooManyValues { limit: MAX_VALUES };
            Err(Problem { span: Some(at..at + 1), path: String::new(), kind })
        }
    }
}

/// The first line with a dotted key that is too deep for the parser, whose own error has no span.
fn too_deep_key(text: &str) -> Option<Span> {
    /// Segments of a dotted key at which the parser fails.
    const MAX_SEGMENTS: usize = 80;
    let mut start = 0;
    for line in text.split_inclusive('\n') {
        if line.bytes().filter(|byte| *byte == b'.').count() >= MAX_SEGMENTS {
            return Some(start..start + line.trim_end().len());
        }
        start += line.len();
    }
    None
}

fn table(source: &dyn TableLike) -> Table {
    let mut entries = Vec::new();
    for (key, item) in source.iter() {
        let key_span = source.key(key).and_then(toml_edit::Key::span).unwrap_or(0..0);
        if let Some(node) = node(item, &key_span) {
            entries.push(Entry { key: key.to_owned(), key_span, node });
        }
    }
    Table { entries }
}

/// A list of tables has no useful span of its own, and gets that of its key.
fn node(item: &Item, key_span: &Span) -> Option<Node> {
    match item {
        Item::None => None,
        Item::Value(source) => Some(value(source, key_span)),
        Item::Table(source) => {
            Some(Node { value: Value::Table(table(source)), span: source.span().unwrap_or(key_span.clone()) })
        }
        Item::ArrayOfTables(tables) => {
            let items = tables.iter().map(|source| Node {
                value: Value::Table(table(source)),
                span: source.span().unwrap_or(key_span.clone()),
            });
            Some(Node { value: Value::List(items.collect()), span: key_span.clone() })
        }
    }
}

fn value(source: &toml_edit::Value, key_span: &Span) -> Node {
    let span = source.span().unwrap_or(key_span.clone());
    let value = match source {
        toml_edit::Value::String(text) => Value::Text(text.value().clone()),
        toml_edit::Value::Integer(integer) => Value::Integer(*integer.value()),
        toml_edit::Value::Float(number) => Value::Number(*number.value()),
        toml_edit::Value::Boolean(boolean) => Value::Bool(*boolean.value()),
        toml_edit::Value::Datetime(date) => Value::Text(date.value().to_string()),
        toml_edit::Value::Array(items) => Value::List(items.iter().map(|item| self::value(item, &span)).collect()),
        toml_edit::Value::InlineTable(inline) => Value::Table(table(inline)),
    };
    Node { value, span }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_have_spans() {
        let text = "a = 1\n[b]\nc = [2.5, \"x\"]\n[[d]]\ne = true\n[[d]]\n";
        let root = parse(text).unwrap();
        assert_eq!(root.get("a").unwrap().value, Value::Integer(1));
        let Value::Table(b) = &root.get("b").unwrap().value else { panic!("b is a table") };
        let Value::List(items) = &b.get("c").unwrap().value else { panic!("c is a list") };
        assert_eq!(&text[items[1].span.clone()], "\"x\"");
        assert_eq!(&text[b.entries[0].key_span.clone()], "c");
        let Value::List(tables) = &root.get("d").unwrap().value else { panic!("d is a list") };
        assert_eq!(tables.len(), 2);
    }

    #[test]
    fn too_many_values_are_refused_before_parsing() {
        let text = |count: usize| format!("# no TOML at all\n{}", ",".repeat(count));
        assert_eq!(check_value_count(&text(MAX_VALUES)), Ok(()));
        let problem = parse(&text(MAX_VALUES + 1)).unwrap_err();
        let last = text(MAX_VALUES).len();
        assert_eq!(
            (problem.kind, problem.span),
            (ProblemKind::TooManyValues { limit: MAX_VALUES }, Some(last..last + 1))
        );
    }

    #[test]
    fn any_depth_gives_a_located_problem() {
        let deep = |open: &str, close: &str| format!("x = 1\na = {}1{}\n", open.repeat(100_000), close.repeat(100_000));
        let dotted = ["a"; 100_000].join(".");
        let texts =
            [deep("[", "]"), deep("{a=", "}"), format!("x = 1\n{dotted} = 1\n"), format!("x = 1\n[{dotted}]\n")];
        for text in texts {
            let problem = parse(&text).unwrap_err();
            assert!(problem.span.is_some_and(|span| span.start >= 6), "{:?}", problem.kind);
        }
    }

    #[test]
    fn broken_text_is_one_located_problem() {
        let problem = parse("a = 1\nb = = 2\n").unwrap_err();
        assert!(matches!(problem.kind, ProblemKind::Syntax(_)));
        assert!(problem.span.unwrap().start >= 6);
    }
}
