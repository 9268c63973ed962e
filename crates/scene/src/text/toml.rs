//! TOML to values with their places.

use bansho_base::parameters::{Entry, Node, Problem, ProblemKind, Span, Table, Value};
use toml_edit::{Document, Item, TableLike};

/// The values of a TOML text.
///
/// # Errors
/// The text is not TOML; one problem says where and why.
pub(crate) fn parse(text: &str) -> Result<Table, Problem> {
    check_extent(text)?;
    let document = Document::parse(text).map_err(|error| Problem {
        span: error.span().or_else(|| deepest(text)),
        path: String::new(),
        kind: ProblemKind::Syntax(error.message().replace('\n', "; ")),
    })?;
    Ok(table(document.as_table()))
}

/// Most values and tables of a text: in memory they take up to 1500 bytes for each sign that begins, ends or names one, 1.8 GB for so many.
/// (Dots make tables of dotted keys.)
pub(crate) const MOST_VALUES: usize = 1_200_000;

/// Whether a text says no more than can be read, which is found out before it is parsed.
///
/// # Errors
/// It does; the problem says where it becomes too much.
pub(crate) fn check_extent(text: &str) -> Result<(), Problem> {
    let signs = text.bytes().enumerate().filter(|(_, byte)| matches!(byte, b',' | b'[' | b'{' | b'=' | b'.'));
    match signs.map(|(at, _)| at).nth(MOST_VALUES) {
        None => Ok(()),
        Some(at) => {
            let kind = ProblemKind::TooManyValues { limit: MOST_VALUES };
            Err(Problem { span: Some(at..at + 1), path: String::new(), kind })
        }
    }
}

/// The first line whose keys are nested deeper than the parser goes, which it does not say itself.
fn deepest(text: &str) -> Option<Span> {
    /// Parts of a dotted key that the parser allows.
    const DEEPEST: usize = 80;
    let mut start = 0;
    for line in text.split_inclusive('\n') {
        if line.bytes().filter(|byte| *byte == b'.').count() >= DEEPEST {
            return Some(start..start + line.trim_end().len());
        }
        start += line.len();
    }
    None
}

fn table(source: &dyn TableLike) -> Table {
    let entry = |(key, item): (&str, &Item)| {
        let key_span = source.key(key).and_then(toml_edit::Key::span).unwrap_or(0..0);
        let node = node(item, &key_span)?;
        Some(Entry { key: key.to_owned(), key_span, node })
    };
    Table { entries: source.iter().filter_map(entry).collect() }
}

/// A table or list of tables has no span of its own worth showing: its key stands for it.
fn node(item: &Item, key_span: &Span) -> Option<Node> {
    match item {
        Item::None => None,
        Item::Value(source) => Some(value(source, key_span)),
        Item::Table(source) => {
            Some(Node { value: Value::Table(table(source)), span: source.span().unwrap_or(key_span.clone()) })
        }
        Item::ArrayOfTables(tables) => {
            let item = |source: &toml_edit::Table| Node {
                value: Value::Table(table(source)),
                span: source.span().unwrap_or(key_span.clone()),
            };
            Some(Node { value: Value::List(tables.iter().map(item).collect()), span: key_span.clone() })
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
    fn values_know_where_they_stand() {
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
    fn what_says_too_much_is_refused_before_it_is_parsed() {
        let text = |count: usize| format!("# no TOML at all\n{}", ",".repeat(count));
        assert_eq!(check_extent(&text(MOST_VALUES)), Ok(()));
        let problem = parse(&text(MOST_VALUES + 1)).unwrap_err();
        let last = text(MOST_VALUES).len();
        assert_eq!(
            (problem.kind, problem.span),
            (ProblemKind::TooManyValues { limit: MOST_VALUES }, Some(last..last + 1))
        );
    }

    #[test]
    fn nothing_is_too_deep_for_an_answer() {
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
