//! Error messages: file, line and column, the problem, what is allowed, and the line itself; and the lines and columns of phenomena and their parameters, for
//! what is found only when they are built.

use std::{collections::HashMap, fmt, sync::Arc};

use bansho_base::{
    host::{
        plural::counted,
        printable::{printable, printable_excerpt, with_control_pictures},
    },
    parameters::{Problem, ProblemKind, Table},
    tables,
    tables::TableKind,
};

use crate::{
    Scene,
    tables::kinds::PLATE_LAYER,
    text::{
        lines::{Excerpt, LineColumn, Lines},
        path::nearest_span,
        toml,
    },
};

/// The problems of an invalid scene.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub struct SceneError {
    /// Name of the file in messages.
    pub file: String,
    /// Its text.
    pub text: String,
    /// The problems in the order of the file; never empty.
    pub problems: Vec<Problem>,
    /// Number of further problems: only the first [`MAX_PROBLEMS`](bansho_base::parameters::MAX_PROBLEMS) are listed.
    pub omitted: usize,
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, message) in self.messages().chain(self.omitted_message()).enumerate() {
            write!(f, "{}{message}", if index > 0 { "\n\n" } else { "" })?;
        }
        Ok(())
    }
}

impl SceneError {
    /// One problem at the dotted `path` of a text, or at the nearest table above it that the text contains.
    pub fn at(file: &str, text: &str, path: &str, kind: ProblemKind) -> Self {
        let span = toml::parse(text).ok().and_then(|root| nearest_span(&root, path));
        let problem = Problem { span, path: path.to_owned(), kind };
        Self { file: file.to_owned(), text: text.to_owned(), problems: vec![problem], omitted: 0 }
    }

    /// The message of each listed problem.
    pub fn messages(&self) -> impl Iterator<Item = String> + '_ {
        let mut lines = Lines::new(&self.text);
        self.problems.iter().map(move |problem| self.message(problem, &mut lines))
    }

    /// The message with the number of problems that are not listed, if there are any.
    pub fn omitted_message(&self) -> Option<String> {
        (self.omitted > 0).then(|| format!("{}: and {}", printable(&self.file), counted(self.omitted, "more problem")))
    }

    /// Line and column of a byte of the text.
    pub fn position(&self, byte: usize) -> LineColumn {
        Lines::new(&self.text).position(byte)
    }

    fn message(&self, problem: &Problem, lines: &mut Lines) -> String {
        let (file, message) = (printable(&self.file), problem.to_string());
        let message = printable_excerpt(&message);
        let Some(span) = &problem.span else {
            return format!("{file}: {message}");
        };
        let position = lines.position(span.start);
        let Excerpt { text, before, marked } = lines.excerpt(span.clone());
        let line = position.line;
        let gutter = " ".repeat(line.to_string().len());
        let (before, marked) = (" ".repeat(before), "^".repeat(marked));
        let text = with_control_pictures(&text);
        format!("{file}:{position}: {message}\n{gutter} |\n{line} | {text}\n{gutter} | {before}{marked}")
    }
}

/// Finds the positions of any number of phenomena. The text is parsed once.
pub struct Positions<'t> {
    root: Option<Table>,
    kinds: Arc<[TableKind]>,
    lines: Lines<'t>,
    /// The path of each phenomenon, such as `rain.1`, by its name.
    paths: HashMap<String, String>,
}

impl<'t> Positions<'t> {
    /// For the phenomena of `scene`, whose text is `text`.
    #[must_use]
    pub fn new(scene: &Scene, text: &'t str) -> Self {
        let mut counts: HashMap<&str, usize> = HashMap::new();
        let mut paths = HashMap::new();
        for instance in &scene.instances {
            // The number of instances of this kind so far is the index of the next one.
            let index = counts.entry(instance.kind.key).or_default();
            paths.insert(instance.name.clone(), format!("{}.{index}", instance.kind.key));
            *index += 1;
        }
        Self { root: toml::parse(text).ok(), kinds: scene.kinds.clone(), lines: Lines::new(text), paths }
    }

    /// Line and column of the parameter `key` of the phenomenon `name`, or of the nearest table above it that the text contains. The name of the
    /// plate is [`PLATE_LAYER`], and tables that are no phenomena have their keys. `None` if the text does not contain the phenomenon.
    pub fn find(&mut self, name: &str, key: Option<&str>) -> Option<LineColumn> {
        let root = self.root.as_ref()?;
        let rest = key.map_or_else(String::new, |key| format!(".{key}"));
        let span = match self.paths.get(name) {
            _ if name == PLATE_LAYER => nearest_span(root, name)?,
            Some(path) => nearest_span(root, &format!("{path}{rest}"))?,
            None if tables::shared(&self.kinds).any(|kind| kind.key == name) => {
                nearest_span(root, &format!("{name}{rest}"))?
            }
            None => return None,
        };
        Some(self.lines.position(span.start))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_problem_shows_its_line_and_marks_it() {
        let error = SceneError {
            file: "fire.toml".into(),
            text: "[picture]\nexposre = 3\n".into(),
            problems: vec![Problem {
                span: Some(10..17),
                path: "picture".into(),
                kind: ProblemKind::UnknownKey {
                    key: "exposre".into(),
                    nearest: Some("exposure_ev100".into()),
                    allowed: vec!["size".into()],
                },
            }],
            omitted: 0,
        };
        let shown = error.to_string();
        assert!(
            shown.starts_with("fire.toml:2:1: picture: unknown key `exposre`, did you mean `exposure_ev100`?"),
            "{shown}"
        );
        assert!(shown.ends_with("2 | exposre = 3\n  | ^^^^^^^"), "{shown}");
    }

    #[test]
    fn spans_beyond_the_text_do_not_panic() {
        let problem = Problem { span: Some(90..99), path: String::new(), kind: ProblemKind::Syntax("oops".into()) };
        let error = SceneError { file: "x".into(), text: "é".into(), problems: vec![problem], omitted: 0 };
        assert!(error.to_string().contains("oops"));
    }

    #[test]
    fn control_characters_and_line_breaks_are_escaped() {
        let problem = Problem {
            span: Some(4..9),
            path: String::new(),
            kind: ProblemKind::Syntax("bad \x1b[2J\nerror: x".into()),
        };
        let error =
            SceneError { file: "a\nb".into(), text: "a = \x1b\"\tb\"".into(), problems: vec![problem], omitted: 0 };
        let shown = error.to_string();
        assert_eq!(shown, "a\\nb:1:5: bad \\u{1b}[2J\\nerror: x\n  |\n1 | a = \u{241b}\" b\"\n  |     ^^^^^");
    }

    #[test]
    fn problems_that_are_not_listed_are_counted() {
        let problem = Problem { span: None, path: "a".into(), kind: ProblemKind::Syntax("oops".into()) };
        let error = SceneError { file: "x".into(), text: String::new(), problems: vec![problem], omitted: 3 };
        assert_eq!(error.to_string(), "x: a: oops\n\nx: and 3 more problems");
        assert_eq!((error.messages().count(), error.omitted_message().as_deref()), (1, Some("x: and 3 more problems")));
    }
}
