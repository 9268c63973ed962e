//! Reads the values of a scene file: tracks the current path and collects problems.

use std::borrow::Cow;

use super::{Choice, Kind, Node, Problem, ProblemKind, Span, nearest};

/// Maximum number of problems of a file that are kept: the first ones. Nobody reads more of them, and a file can contain a million.
pub const MAX_PROBLEMS: usize = 100;

/// The problems of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Problems {
    /// The first problems in the order of the file, at most [`MAX_PROBLEMS`]; those without a location come last.
    pub listed: Vec<Problem>,
    /// Number of further problems.
    pub omitted: usize,
}

/// Collects problems while values are read, with the path of the current value.
#[derive(Debug, Default)]
pub struct Reader {
    path: Vec<Cow<'static, str>>,
    problems: Vec<Problem>,
    omitted: usize,
    /// Location of the last problem that is still listed, once there are more problems than are kept.
    last_listed: Option<usize>,
    /// Frames, and the seconds that they take, to which step keys are snapped.
    frame_rate: Option<[u32; 2]>,
}

impl Reader {
    /// A reader at the root of a file.
    pub fn new() -> Self {
        Self::default()
    }

    /// From now on step keys near the beginning of a frame are moved to it: see [`Animated::snap_steps`](super::animated::Animated::snap_steps).
    pub fn set_frame_rate(&mut self, frames: u32, seconds: u32) {
        self.frame_rate = Some([frames, seconds]);
    }

    /// Frames, and the seconds that they take, if they are known.
    pub fn frame_rate(&self) -> Option<[u32; 2]> {
        self.frame_rate
    }

    /// Runs `read` with `segment` appended to the path.
    pub fn within<T>(&mut self, segment: impl Into<Cow<'static, str>>, read: impl FnOnce(&mut Self) -> T) -> T {
        self.path.push(segment.into());
        let result = read(self);
        self.path.pop();
        result
    }

    /// Reports a problem at `node`.
    pub fn report(&mut self, node: &Node, kind: ProblemKind) {
        self.report_at(Some(node.span.clone()), kind);
    }

    /// Reports a problem at `span`.
    pub fn report_at(&mut self, span: Option<Span>, kind: ProblemKind) {
        self.report_with(span, || kind);
    }

    /// Reports a problem of a value that is not from a text.
    pub fn report_value(&mut self, kind: ProblemKind) {
        self.report_at(None, kind);
    }

    /// Reports a problem at `span`; `kind` is called only if the problem will be listed.
    pub fn report_with(&mut self, span: Option<Span>, kind: impl FnOnce() -> ProblemKind) {
        if self.last_listed.is_some_and(|last| start(span.as_ref()) >= last) {
            self.omitted += 1;
            return;
        }
        self.problems.push(Problem { span, path: self.path.join("."), kind: kind() });
        // Sorting only at twice the limit keeps the amortized cost per problem constant.
        if self.problems.len() >= 2 * MAX_PROBLEMS {
            self.keep_first();
        }
    }

    /// Sorts the problems and drops those beyond [`MAX_PROBLEMS`].
    fn keep_first(&mut self) {
        self.problems.sort_by_key(|problem| start(problem.span.as_ref()));
        if self.problems.len() > MAX_PROBLEMS {
            self.omitted += self.problems.len() - MAX_PROBLEMS;
            self.problems.truncate(MAX_PROBLEMS);
            self.last_listed = self.problems.last().map(|last| start(last.span.as_ref()));
        }
    }

    /// Reports that `node` is not of the expected kind.
    pub fn wrong_type(&mut self, node: &Node, expected: &Kind) {
        let kind = ProblemKind::WrongType { expected: expected.expectation(), found: node.value.type_name() };
        self.report(node, kind);
    }

    /// Reports that `name` is none of `choices`.
    pub fn not_one_of(&mut self, node: &Node, name: &str, choices: &[Choice]) {
        let kind = ProblemKind::NotOneOf {
            value: name.to_owned(),
            nearest: nearest(name, choices.iter().map(|choice| choice.name)).map(str::to_owned),
            allowed: choices.iter().map(|choice| choice.name.to_owned()).collect(),
        };
        self.report(node, kind);
    }

    /// Whether no problem has been reported so far.
    pub fn is_clean(&self) -> bool {
        self.problems.is_empty()
    }

    /// Returns the problems in the order of the file.
    pub fn into_problems(mut self) -> Problems {
        self.keep_first();
        Problems { listed: self.problems, omitted: self.omitted }
    }
}

/// Sort key of a problem: its position in the file.
fn start(span: Option<&Span>) -> usize {
    span.map_or(usize::MAX, |span| span.start)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn problem(at: usize) -> ProblemKind {
        ProblemKind::Syntax(at.to_string())
    }

    #[test]
    fn the_first_problems_are_listed_and_the_others_counted_in_whatever_order_they_are_met() {
        const COUNT: usize = 1000;
        let forward: Vec<usize> = (0..COUNT).collect();
        let backward: Vec<usize> = (0..COUNT).rev().collect();
        let mixed: Vec<usize> = (0..COUNT).map(|index| index * 7 % COUNT).collect();
        for order in [forward, backward, mixed] {
            let mut reader = Reader::new();
            order.iter().for_each(|&at| reader.report_at(Some(at..at + 1), problem(at)));
            let problems = reader.into_problems();
            let found: Vec<usize> = problems.listed.iter().map(|problem| start(problem.span.as_ref())).collect();
            assert_eq!((found, problems.omitted), ((0..MAX_PROBLEMS).collect(), COUNT - MAX_PROBLEMS));
        }
    }

    #[test]
    fn as_many_as_are_kept_are_all_listed() {
        let mut reader = Reader::new();
        reader.report_at(None, problem(0));
        (1..MAX_PROBLEMS).for_each(|at| reader.report_at(Some(at..at), problem(at)));
        let problems = reader.into_problems();
        assert_eq!((problems.listed.len(), problems.omitted), (MAX_PROBLEMS, 0));
        assert_eq!(problems.listed[MAX_PROBLEMS - 1].span, None, "what has no place comes last");
    }

    #[test]
    fn what_is_not_listed_is_not_made() {
        let (mut reader, mut made) = (Reader::new(), 0);
        for at in 0..10_000 {
            reader.report_with(Some(at..at), || {
                made += 1;
                problem(at)
            });
        }
        assert_eq!(made, 2 * MAX_PROBLEMS);
    }
}
