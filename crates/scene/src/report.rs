//! Problems as a person reads them: file, line, the line itself, what is wrong, what is allowed.

use std::fmt;

use bansho_base::{
    host::{
        plural::counted,
        printable::{printable, printable_excerpt, with_control_pictures},
    },
    parameters::{Problem, ProblemKind},
};

use super::{
    check,
    text::{
        lines::{Excerpt, Lines},
        toml,
    },
};

/// A scene that cannot be used, with every reason why.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub struct SceneError {
    /// Name of the file, as the caller calls it.
    pub file: String,
    /// Its text.
    pub text: String,
    /// What is wrong, in the order of the file; never empty.
    pub problems: Vec<Problem>,
    /// How many problems there are beyond those: the first [`MAX_PROBLEMS`](bansho_base::parameters::MAX_PROBLEMS) are kept.
    pub omitted: usize,
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, message) in self.faults().chain(self.more()).enumerate() {
            write!(f, "{}{message}", if index > 0 { "\n\n" } else { "" })?;
        }
        Ok(())
    }
}

impl SceneError {
    /// One fault of what stands at the dotted `path` of a text, or of the nearest part of it that the text states.
    pub fn at(file: &str, text: &str, path: &str, kind: ProblemKind) -> Self {
        let span = toml::parse(text).ok().and_then(|root| check::place(&root, path));
        let problem = Problem { span, path: path.to_owned(), kind };
        Self { file: file.to_owned(), text: text.to_owned(), problems: vec![problem], omitted: 0 }
    }

    /// Each fault that is listed, as a person reads it.
    pub fn faults(&self) -> impl Iterator<Item = String> + '_ {
        let mut lines = Lines::new(&self.text);
        self.problems.iter().map(move |problem| self.message(problem, &mut lines))
    }

    /// How many more faults there are than those that are listed, if there are more.
    pub fn more(&self) -> Option<String> {
        (self.omitted > 0).then(|| format!("{}: and {}", printable(&self.file), counted(self.omitted, "more fault")))
    }

    /// One-based line and column (in characters) of a byte of the text.
    pub fn position(&self, byte: usize) -> (usize, usize) {
        Lines::new(&self.text).position(byte)
    }

    fn message(&self, problem: &Problem, lines: &mut Lines) -> String {
        let (file, message) = (printable(&self.file), problem.to_string());
        let message = printable_excerpt(&message);
        let Some(span) = &problem.span else {
            return format!("{file}: {message}");
        };
        let (line, column) = lines.position(span.start);
        let Excerpt { shown, before, marked } = lines.excerpt(span.clone());
        let gutter = " ".repeat(line.to_string().len());
        let (before, marked) = (" ".repeat(before), "^".repeat(marked));
        let shown = with_control_pictures(&shown);
        format!("{file}:{line}:{column}: {message}\n{gutter} |\n{line} | {shown}\n{gutter} | {before}{marked}")
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
    fn nothing_in_a_scene_steers_a_terminal_or_looks_like_another_error() {
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
    fn what_is_not_listed_is_counted() {
        let problem = Problem { span: None, path: "a".into(), kind: ProblemKind::Syntax("oops".into()) };
        let error = SceneError { file: "x".into(), text: String::new(), problems: vec![problem], omitted: 3 };
        assert_eq!(error.to_string(), "x: a: oops\n\nx: and 3 more faults");
        assert_eq!((error.faults().count(), error.more().as_deref()), (1, Some("x: and 3 more faults")));
    }
}
