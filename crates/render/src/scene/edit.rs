//! Changing a scene's text while its comments survive: `--set`, and `upgrade`.

use toml_edit::{Array, DocumentMut, Item, Table, TableLike, Value};

use super::{FORMAT, PhenomenonKind, SHARED_TABLES, suggest, toml};

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
    #[error("{} is not in the scene{}; there is: {there}", part(.path, .segment), did_you_mean(.meant))]
    NoSuchPlace {
        /// The whole path.
        path: String,
        /// The part that is not there.
        segment: String,
        /// What is there instead.
        there: String,
        /// Paths that may have been meant.
        meant: Vec<String>,
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
/// The value is TOML; a bare word is a string. Of the tables of a list a number or a name picks one (`rain.0.rate_mm_per_h`,
/// `flame_sheet.left log.height`, `flame_particles.0.burners.2.speed`); without it all are meant. `kinds` are the phenomena that a scene may hold.
///
/// # Errors
/// The text is no TOML, the assignment is malformed, or the path leads nowhere.
pub fn set(text: &str, assignment: &str, kinds: &[PhenomenonKind]) -> Result<String, EditError> {
    let mut document = document(text)?;
    let (path, value) = split(assignment)?;
    let value = parse_value(value);
    let segments: Vec<&str> = path.split('.').map(str::trim).collect();
    let root = document.as_table_mut();
    ensure_shared_table(root, &segments);
    let is_known = if segments.len() > 1 { root.contains_key(segments[0]) } else { is_root_key(segments[0], kinds) };
    if !is_known {
        let (path, segment, there) = (path.to_owned(), segments[0].to_owned(), keys(root));
        return Err(EditError::NoSuchPlace { meant: suggest::paths(text, &segments, kinds), path, segment, there });
    }
    set_in(root, &segments, &value, path)?;
    let edited = document.to_string();
    drop(document);
    // A value nested nearly as deep as readers go may lie too deep in the scene.
    check(&edited).map_err(|_| EditError::NoAssignment(assignment.to_owned()))?;
    Ok(edited)
}

/// A text as it can be edited.
pub(super) fn document(text: &str) -> Result<DocumentMut, EditError> {
    check_extent(text)?;
    text.parse().map_err(syntax)
}

/// Whether an edited text can be read again.
pub(super) fn check(text: &str) -> Result<(), EditError> {
    check_extent(text)?;
    toml_edit::Document::parse(text).map(drop).map_err(syntax)
}

fn check_extent(text: &str) -> Result<(), EditError> {
    toml::check_extent(text).map_err(|problem| EditError::Syntax(problem.kind.to_string()))
}

fn syntax(error: toml_edit::TomlError) -> EditError {
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

/// Whether anything of that name may stand at the root of a scene.
fn is_root_key(key: &str, kinds: &[PhenomenonKind]) -> bool {
    key == "bansho" || SHARED_TABLES.iter().any(|table| table.key == key) || kinds.iter().any(|kind| kind.key == key)
}

fn ensure_shared_table(root: &mut Table, segments: &[&str]) {
    let shared = SHARED_TABLES.iter().any(|table| !table.many && table.key == segments[0]);
    if shared && segments.len() > 1 && !root.contains_key(segments[0]) {
        root.insert(segments[0], Item::Table(Table::new()));
    }
}

/// Sets the value at what is left of a path within a table. Tables on the way are made; items of lists are not.
fn set_in(table: &mut dyn TableLike, segments: &[&str], value: &Value, path: &str) -> Result<(), EditError> {
    match segments {
        [] => Err(EditError::NoAssignment(path.to_owned())),
        [key] => {
            match table.get_mut(key) {
                Some(Item::Value(old)) => replace(old, value),
                _ => {
                    table.insert(key, Item::Value(value.clone()));
                }
            }
            Ok(())
        }
        [key, rest @ ..] => {
            if !table.contains_key(key) {
                if number(rest[0]).is_some() {
                    return Err(nowhere(path, key, keys(table)));
                }
                table.insert(key, Item::Value(toml_edit::InlineTable::new().into()));
            }
            match table.get_mut(key) {
                Some(Item::ArrayOfTables(tables)) => {
                    let tables = tables.iter_mut().map(|table| table as &mut dyn TableLike).collect();
                    set_in_list(tables, rest, value, path)
                }
                Some(Item::Value(Value::Array(items))) => set_in_items(items, rest, value, path),
                Some(item) => match item.as_table_like_mut() {
                    Some(inner) => set_in(inner, rest, value, path),
                    None => Err(nowhere(path, rest[0], format!("`{key}`, which is no table"))),
                },
                None => Err(nowhere(path, key, String::new())),
            }
        }
    }
}

/// The same within a list that stands in a line: of tables, or of plain values, of which a number picks one.
fn set_in_items(items: &mut Array, segments: &[&str], value: &Value, path: &str) -> Result<(), EditError> {
    if !items.is_empty() && items.iter().all(Value::is_inline_table) {
        let tables = items.iter_mut().filter_map(Value::as_inline_table_mut);
        return set_in_list(tables.map(|table| table as &mut dyn TableLike).collect(), segments, value, path);
    }
    let there = numbered(items.len(), "value");
    match (number(segments[0]).and_then(|index| items.get_mut(index)), segments.len()) {
        (Some(item), 1) => {
            replace(item, value);
            Ok(())
        }
        _ => Err(nowhere(path, segments[0], there)),
    }
}

/// The same within one of a list of tables, or within all of them where the path picks none.
fn set_in_list(tables: Vec<&mut dyn TableLike>, segments: &[&str], value: &Value, path: &str) -> Result<(), EditError> {
    let names: Vec<Option<String>> = tables.iter().map(|table| name(&**table)).collect();
    let first = segments[0];
    let by_name = names.iter().position(|name| segments.len() > 1 && name.as_deref() == Some(first));
    let (picked, rest) = match by_name.or_else(|| number(first)) {
        Some(index) if index < tables.len() => (Some(index), &segments[1..]),
        None if name_like(first) || tables.iter().any(|table| table.contains_key(first)) => (None, segments),
        _ => {
            let names = names.into_iter().flatten().map(|name| format!(" or {name}"));
            return Err(nowhere(path, first, numbered(tables.len(), "table") + &names.collect::<String>()));
        }
    };
    let mut meant = tables.into_iter().enumerate().filter(|(index, _)| picked.is_none_or(|picked| picked == *index));
    meant.try_for_each(|(_, table)| set_in(table, rest, value, path))
}

/// Replaces a value; the space and the comment around it stay.
fn replace(old: &mut Value, value: &Value) {
    let decor = old.decor().clone();
    *old = value.clone();
    *old.decor_mut() = decor;
}

fn name(table: &dyn TableLike) -> Option<String> {
    table.get("name").and_then(Item::as_str).map(str::to_owned)
}

fn number(segment: &str) -> Option<usize> {
    segment.parse().ok()
}

/// Whether a segment looks like a key rather than like a phenomenon's name or number.
fn name_like(segment: &str) -> bool {
    let key_like = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'_';
    number(segment).is_none() && segment.bytes().all(key_like)
}

/// The items that a list has.
fn numbered(count: usize, what: &str) -> String {
    match count {
        0 => format!("no {what} in it"),
        1 => format!("{what} 0"),
        _ => format!("{what}s 0 to {}", count - 1),
    }
}

fn keys(table: &dyn TableLike) -> String {
    table.iter().map(|(key, _)| key).collect::<Vec<_>>().join(", ")
}

fn nowhere(path: &str, segment: &str, there: String) -> EditError {
    EditError::NoSuchPlace { path: path.to_owned(), segment: segment.to_owned(), there, meant: Vec::new() }
}

/// The part of a path that leads nowhere.
fn part(path: &str, segment: &str) -> String {
    if path == segment { format!("`{path}`") } else { format!("`{path}`: {segment}") }
}

fn did_you_mean(meant: &[String]) -> String {
    let meant: Vec<String> = meant.iter().map(|path| format!("`{path}`")).collect();
    if meant.is_empty() { String::new() } else { format!(", did you mean {}?", meant.join(" or ")) }
}

/// The text in the newest format; `None` where it is that already.
///
/// A scene that does not state its format gets one; there is no older format yet to migrate from.
///
/// # Errors
/// The text is no TOML, or of a newer format.
pub fn upgrade(text: &str) -> Result<Option<String>, EditError> {
    let document = document(text)?;
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
    use crate::phenomena::KINDS;

    fn set(text: &str, assignment: &str) -> Result<String, EditError> {
        super::set(text, assignment, KINDS)
    }

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
    fn lists_of_tables_within_tables_are_reached_in_both_ways_of_writing_them() {
        let headed = "bansho = 1\n[[flame_particles]]\n[[flame_particles.burners]]\nspeed = 1 # slow\n\
                      [[flame_particles.burners]]\n";
        let in_a_line = "bansho = 1\n[[flame_particles]]\nburners = [{ speed = 1 }, { }]\n";
        for scene in [headed, in_a_line] {
            let text = set(scene, "flame_particles.0.burners.0.speed=2.5").unwrap();
            assert_eq!((text.matches("speed = 2.5").count(), text.matches("speed").count()), (1, 1), "{text}");
            let text = set(scene, "flame_particles.burners.1.diameter=0.2").unwrap();
            assert!(text.contains("speed = 1") && text.matches("diameter = 0.2").count() == 1, "{text}");
            assert_eq!(set(scene, "flame_particles.burners.speed=3").unwrap().matches("speed = 3").count(), 2);
            let beyond = set(scene, "flame_particles.0.burners.2.speed=1").unwrap_err().to_string();
            assert!(beyond.contains("burners.2.speed`: 2 is not in the scene; there is: tables 0 to 1"), "{beyond}");
            let whole = set(scene, "flame_particles.0.burners.0=1");
            assert!(matches!(whole, Err(EditError::NoAssignment(_))), "{whole:?}");
        }
        assert!(set(headed, "flame_particles.0.burners.0.speed=2").unwrap().contains("speed = 2 # slow"));
        let none = set("bansho = 1\n[[flame_particles]]\nsmoke = 1\n", "flame_particles.0.burners.0.speed=1");
        let none = none.unwrap_err().to_string();
        assert!(none.contains("burners is not in the scene; there is: smoke"), "{none}");
    }

    #[test]
    fn single_values_of_lists_are_reached_by_number() {
        assert!(set(SCENE, "picture.size.1=9").unwrap().contains("size = [64, 9] # small"));
        for path in ["picture.size.2", "picture.size.x", "picture.size.0.x"] {
            let error = set(SCENE, &format!("{path}=1")).unwrap_err().to_string();
            assert!(error.contains("there is: values 0 to 1"), "{error}");
        }
    }

    #[test]
    fn a_path_without_its_table_gets_the_tables_that_have_such_a_parameter() {
        let told = |scene: &str, assignment: &str| set(scene, assignment).unwrap_err().to_string();
        let height = told(SCENE, "height=2");
        assert_eq!(
            height,
            "`height` is not in the scene, did you mean `flame_sheet.height`?; there is: bansho, picture, flame_sheet"
        );
        let both = "bansho = 1\n[[rain]]\n[[flame_particles]]\nburners = [{}]\n";
        for (scene, assignment, expected) in [
            (SCENE, "gust=1", "did you mean `wind.gust`?"),
            (SCENE, "flame_sheat.height=2", "did you mean `flame_sheet.height`?"),
            (SCENE, "flame_sheat.1.height=2", "did you mean `flame_sheet.1.height`?"),
            (SCENE, "hieght=2", "did you mean `flame_sheet.height`?"),
            (SCENE, "fire.height=2", "did you mean `flame_sheet.height`?"),
            (both, "rate_mm_per_h=2", "did you mean `rain.rate_mm_per_h`?"),
            (both, "burners.diameter=2", "did you mean `flame_particles.burners.diameter`?"),
        ] {
            let told = told(scene, assignment);
            assert!(told.contains(expected), "{assignment}: {told}");
        }
        assert!(!told(SCENE, "rate_mm_per_h=2").contains("rain"), "there is no rain in that scene");
        assert!(!told(SCENE, "zzzzqqq=2").contains("did you mean"));
        assert!(set(SCENE, "bansho=1").is_ok() && set(SCENE, "wind={ gust = 1 }").is_ok());
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
