//! Changing a scene's text while its comments survive: `--set`, and `upgrade`.

use toml_edit::{ArrayOfTables, DocumentMut, Item, Table, TableLike, Value};

use super::{FORMAT, SHARED_TABLES};

/// Why an edit cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EditError {
    /// The text is not TOML.
    #[error("the scene is not TOML: {0}")]
    Syntax(String),
    /// The assignment has no `=`, or no path of names before it.
    #[error(
        "`{0}` is no assignment; allowed: key.path=value, such as picture.size=[640,360] or flame_sheet.0.height=2"
    )]
    NoAssignment(String),
    /// The path leads nowhere.
    #[error("`{path}`: {segment} is not in the scene; there is: {there}")]
    NoSuchPlace {
        /// The whole path.
        path: String,
        /// The part that is not there.
        segment: String,
        /// What is there instead.
        there: String,
    },
    /// The value is nothing that TOML can say.
    #[error("`{0}` cannot stand in a scene")]
    NoValue(String),
    /// Nothing is keyed at that time.
    #[error("`{path}` has no key at {time} s")]
    NoKeyframe {
        /// What should be keyed.
        path: String,
        /// When, s.
        time: f64,
    },
    /// The scene's format is not one that this version can upgrade.
    #[error("format {found} is newer than this program knows; known: up to {FORMAT}")]
    NewerFormat {
        /// The scene's format.
        found: i64,
    },
}

/// The text with `assignment` carried out: `key.path=value`.
///
/// The value is TOML; a bare word is a string. Of several phenomena of a kind, a number or a name picks one
/// (`rain.0.rate_mm_per_h`, `flame_sheet.left log.height`); without it all are meant.
///
/// # Errors
/// The text is no TOML, the assignment is malformed, or the path leads nowhere.
pub fn set(text: &str, assignment: &str) -> Result<String, EditError> {
    let mut document: DocumentMut = text.parse().map_err(syntax)?;
    let (path, value) = split(assignment)?;
    let value = parse_value(value);
    let segments: Vec<&str> = path.split('.').map(str::trim).collect();
    let root = document.as_table_mut();
    ensure_shared_table(root, &segments);
    let there = keys(root);
    match root.get_mut(segments[0]) {
        Some(Item::ArrayOfTables(tables)) if segments.len() > 1 => {
            for (index, rest) in chosen(tables, &segments[1..], path)? {
                if let Some(table) = tables.get_mut(index) {
                    set_in(table, rest, &value, path)?;
                }
            }
        }
        None if segments.len() > 1 => return Err(nowhere(path, segments[0], &there)),
        _ => set_in(root, &segments, &value, path)?,
    }
    let edited = document.to_string();
    // A value nested nearly as deep as readers go may lie too deep in the scene.
    match edited.parse::<DocumentMut>() {
        Ok(_) => Ok(edited),
        Err(_) => Err(EditError::NoAssignment(assignment.to_owned())),
    }
}

pub(super) fn syntax(error: toml_edit::TomlError) -> EditError {
    EditError::Syntax(error.message().to_owned())
}

fn split(assignment: &str) -> Result<(&str, &str), EditError> {
    assignment
        .split_once('=')
        .map(|(path, value)| (path.trim(), value.trim()))
        .filter(|(path, value)| is_path(path) && !value.is_empty())
        .ok_or_else(|| EditError::NoAssignment(assignment.to_owned()))
}

/// Whether every part of a dotted path names something, and it is no deeper than TOML readers go.
fn is_path(path: &str) -> bool {
    /// Parts; scenes need five at most.
    const DEEPEST: usize = 16;
    path.split('.').all(|part| !part.trim().is_empty()) && path.split('.').count() <= DEEPEST
}

fn parse_value(text: &str) -> Value {
    text.parse().unwrap_or_else(|_| Value::from(text))
}

fn ensure_shared_table(root: &mut Table, segments: &[&str]) {
    let shared = SHARED_TABLES.iter().any(|table| !table.many && table.key == segments[0]);
    if shared && segments.len() > 1 && !root.contains_key(segments[0]) {
        root.insert(segments[0], Item::Table(Table::new()));
    }
}

/// The tables of a list that the path means, each with what is left of the path.
fn chosen<'a>(
    tables: &ArrayOfTables,
    segments: &'a [&'a str],
    path: &str,
) -> Result<Vec<(usize, &'a [&'a str])>, EditError> {
    if segments.len() < 2 {
        return Ok((0..tables.len()).map(|index| (index, segments)).collect());
    }
    let name = |table: &Table| table.get("name").and_then(Item::as_str).map(str::to_owned);
    let by_name = tables.iter().position(|table| name(table).as_deref() == Some(segments[0]));
    let by_number = segments[0].parse::<usize>().ok();
    match by_name.or(by_number) {
        Some(index) if index < tables.len() => Ok(vec![(index, &segments[1..])]),
        None if tables.iter().any(|table| table.contains_key(segments[0])) => {
            Ok((0..tables.len()).map(|index| (index, segments)).collect())
        }
        None if name_like(segments[0]) => Ok((0..tables.len()).map(|index| (index, segments)).collect()),
        _ => {
            let names: Vec<String> = tables.iter().filter_map(name).collect();
            Err(nowhere(path, segments[0], &format!("0 to {} or {}", tables.len() - 1, names.join(", "))))
        }
    }
}

/// Whether a segment looks like a key of a sub-table rather than like a phenomenon's name or number.
fn name_like(segment: &str) -> bool {
    segment.bytes().all(|byte| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'_')
        && !segment.bytes().all(|byte| byte.is_ascii_digit())
}

fn set_in(table: &mut dyn TableLike, segments: &[&str], value: &Value, path: &str) -> Result<(), EditError> {
    match segments {
        [] => Err(EditError::NoAssignment(path.to_owned())),
        [key] => {
            match table.get_mut(key) {
                // Keeps the comment behind the old value.
                Some(Item::Value(old)) => {
                    let decor = old.decor().clone();
                    *old = value.clone();
                    *old.decor_mut() = decor;
                }
                _ => {
                    table.insert(key, Item::Value(value.clone()));
                }
            }
            Ok(())
        }
        [key, rest @ ..] => {
            if !table.contains_key(key) {
                table.insert(key, Item::Value(toml_edit::InlineTable::new().into()));
            }
            match table.get_mut(key).and_then(Item::as_table_like_mut) {
                Some(inner) => set_in(inner, rest, value, path),
                None => Err(nowhere(path, rest[0], &format!("`{key}`, which is no table"))),
            }
        }
    }
}

fn keys(table: &Table) -> String {
    table.iter().map(|(key, _)| key).collect::<Vec<_>>().join(", ")
}

fn nowhere(path: &str, segment: &str, there: &str) -> EditError {
    EditError::NoSuchPlace { path: path.to_owned(), segment: segment.to_owned(), there: there.to_owned() }
}

/// The text in the newest format; `None` where it is that already.
///
/// A scene that does not state its format gets one; there is no older format yet to migrate from.
///
/// # Errors
/// The text is no TOML, or of a newer format.
pub fn upgrade(text: &str) -> Result<Option<String>, EditError> {
    let document: DocumentMut = text.parse().map_err(syntax)?;
    match document.get("bansho").and_then(Item::as_integer) {
        Some(FORMAT) => Ok(None),
        Some(found) if found > FORMAT => Err(EditError::NewerFormat { found }),
        _ => {
            let mut document = document;
            document.remove("bansho");
            Ok(Some(format!("bansho = {FORMAT}\n{document}")))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str =
        "bansho = 1\n[picture]\nsize = [64, 36] # small\n[[flame_sheet]]\nname = \"left log\"\n[[flame_sheet]]\n";

    #[test]
    fn values_are_replaced_and_comments_survive() {
        let text = set(SCENE, "picture.size=[8, 9]").unwrap();
        assert!(text.contains("size = [8, 9] # small"), "{text}");
    }

    #[test]
    fn one_phenomenon_is_picked_by_name_or_number_and_all_without() {
        let text = set(SCENE, "flame_sheet.left log.height = 2").unwrap();
        assert_eq!(text.matches("height = 2").count(), 1);
        let text = set(SCENE, "flame_sheet.1.height=2").unwrap();
        assert!(text.trim_end().ends_with("height = 2"), "{text}");
        let text = set(SCENE, "flame_sheet.height=2").unwrap();
        assert_eq!(text.matches("height = 2").count(), 2);
    }

    #[test]
    fn absent_tables_are_made_and_bare_words_are_strings() {
        let text = set(SCENE, "wind.gust=0.5").unwrap();
        assert!(text.contains("[wind]") && text.contains("gust = 0.5"), "{text}");
        assert!(set(SCENE, "camera.lens=fisheye").unwrap().contains("lens = \"fisheye\""));
    }

    #[test]
    fn places_that_are_not_there_are_named() {
        assert!(matches!(set(SCENE, "flame_sheet.7.height=2"), Err(EditError::NoSuchPlace { .. })));
        assert!(matches!(set(SCENE, "picture.size"), Err(EditError::NoAssignment(_))));
        assert!(matches!(set(SCENE, "=3"), Err(EditError::NoAssignment(_))));
        assert!(matches!(set(SCENE, "picture..size=3"), Err(EditError::NoAssignment(_))));
        // Found by fuzzing: a path so deep that its result could not be read again.
        let deep = format!("picture{}=3", ".a".repeat(100));
        assert!(matches!(set(SCENE, &deep), Err(EditError::NoAssignment(_))));
        let nested = format!("picture.a.b.c.d={}{}", "[".repeat(78), "]".repeat(78));
        assert!(matches!(set(SCENE, &nested), Err(EditError::NoAssignment(_))));
    }

    #[test]
    fn upgrade_states_the_format_once() {
        assert_eq!(upgrade(SCENE).unwrap(), None);
        let upgraded = upgrade("# mine\n[picture]\nframes = 3\n").unwrap().unwrap();
        assert!(upgraded.starts_with("bansho = 1\n# mine"), "{upgraded}");
        assert_eq!(upgrade(&upgraded).unwrap(), None);
        assert_eq!(upgrade("bansho = 99").unwrap_err(), EditError::NewerFormat { found: 99 });
    }
}
