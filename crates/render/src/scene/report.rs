//! Problems as a person reads them: file, line, the line itself, what is wrong, what is allowed.

use std::fmt;

use bansho_base::parameters::{Problem, ProblemKind};

use super::{check, toml};

/// A scene that cannot be used, with every reason why.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub struct SceneError {
    /// Name of the file, as the caller calls it.
    pub file: String,
    /// Its text.
    pub text: String,
    /// What is wrong, in the order of the file; never empty.
    pub problems: Vec<Problem>,
}

/// Most problems that are spelled out at once.
const SHOWN: usize = 12;

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, problem) in self.problems.iter().take(SHOWN).enumerate() {
            if index > 0 {
                f.write_str("\n\n")?;
            }
            self.show(f, problem)?;
        }
        if self.problems.len() > SHOWN {
            write!(f, "\n\nand {} more", self.problems.len() - SHOWN)?;
        }
        Ok(())
    }
}

impl SceneError {
    /// One fault of what stands at the dotted `path` of a text, or of the nearest part of it that the text states.
    pub fn at(file: &str, text: &str, path: &str, kind: ProblemKind) -> Self {
        let span = toml::parse(text).ok().and_then(|root| check::place(&root, path));
        let problem = Problem { span, path: path.to_owned(), kind };
        Self { file: file.to_owned(), text: text.to_owned(), problems: vec![problem] }
    }

    /// One-based line and column (in characters) of a byte of the text.
    pub fn position(&self, byte: usize) -> (usize, usize) {
        position(&self.text, byte)
    }

    fn show(&self, f: &mut fmt::Formatter<'_>, problem: &Problem) -> fmt::Result {
        let Some(span) = &problem.span else {
            return write!(f, "{}: {problem}", self.file);
        };
        let (line, column) = self.position(span.start);
        let source = self.text.lines().nth(line - 1).unwrap_or_default();
        let end = span.end.min(span.start + source.len().saturating_sub(column - 1));
        let carets = self.text.get(span.start..end).map_or(1, |marked| marked.chars().count().max(1));
        let gutter = " ".repeat(line.to_string().len());
        write!(
            f,
            "{}:{line}:{column}: {problem}\n{gutter} |\n{line} | {source}\n{gutter} | {}{}",
            self.file,
            " ".repeat(column - 1),
            "^".repeat(carets)
        )
    }
}

/// One-based line and column (in characters) of a byte of a text.
pub(super) fn position(text: &str, byte: usize) -> (usize, usize) {
    let before = &text[..floor_char_boundary(text, byte)];
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
}

fn floor_char_boundary(text: &str, byte: usize) -> usize {
    let mut byte = byte.min(text.len());
    while !text.is_char_boundary(byte) {
        byte -= 1;
    }
    byte
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
        let error = SceneError { file: "x".into(), text: "é".into(), problems: vec![problem] };
        assert!(error.to_string().contains("oops"));
    }
}
