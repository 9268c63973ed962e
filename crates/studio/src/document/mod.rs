//! The scene as text: edits that keep its comments, undo, faults at their lines, and the last plan that was good.

mod check;
pub mod files;
mod history;
pub(crate) mod keyframes;
mod named_files;
pub(crate) mod phenomena;
pub mod stages;
#[cfg(test)]
mod tests;

use std::sync::{
    Arc,
    atomic::{AtomicU64, Ordering},
};

use bansho::{
    Assets, Plan, SceneError,
    base::parameters::{Problem, Table},
    render::scene::{
        edit::EditError,
        operation::{self, Operation},
        values,
    },
};

pub use check::{Checker, ReportedProblem, check, recheck};
pub use named_files::named_files;
pub use phenomena::{PhenomenonEntry, operations};

use history::History;

/// Counts the states of all documents of this run, so that work on one can be told from work on any other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Revision(pub(crate) u64);

impl Revision {
    /// One that no state has had.
    fn next() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        Self(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}

/// A scene that is being edited.
pub struct Document {
    name: String,
    text: Arc<str>,
    saved: Arc<str>,
    /// Whether its file was taken away.
    gone: bool,
    /// Its first state.
    first: Revision,
    revision: Revision,
    history: History,
    values: Table,
    syntax: Option<Problem>,
    check_state: CheckState,
}

/// What checking found out so far.
#[derive(Default)]
struct CheckState {
    of: Option<Revision>,
    plan: Option<Arc<Plan>>,
    error: Option<Arc<SceneError>>,
}

impl Document {
    /// A document with this text, unchanged so far; `name` is what errors call it.
    pub fn new(name: impl Into<String>, text: impl Into<Arc<str>>) -> Self {
        let text = text.into();
        let first = Revision::next();
        let mut document = Self {
            name: name.into(),
            saved: text.clone(),
            gone: false,
            text,
            first,
            revision: first,
            history: History::default(),
            values: Table::default(),
            syntax: None,
            check_state: CheckState::default(),
        };
        document.read();
        document
    }

    /// What errors call it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Calls it otherwise, as after saving it elsewhere.
    pub fn rename(&mut self, name: impl Into<String>) {
        self.name = name.into();
    }

    /// The scene file, as it would be saved.
    pub fn text(&self) -> &Arc<str> {
        &self.text
    }

    /// Which state this is.
    pub fn revision(&self) -> Revision {
        self.revision
    }

    /// Whether `revision` is, or was, a state of this document rather than of another.
    pub fn includes_revision(&self, revision: Revision) -> bool {
        (self.first..=self.revision).contains(&revision)
    }

    /// What the text says, or said when it was TOML last.
    pub fn values(&self) -> &Table {
        &self.values
    }

    /// Whether it differs from what lies in its file.
    pub fn is_dirty(&self) -> bool {
        self.gone || self.is_modified()
    }

    /// Whether something was done here since it was saved or opened.
    pub fn is_modified(&self) -> bool {
        self.text != self.saved
    }

    /// Notes that `text` is what lies in its file now.
    pub fn mark_saved(&mut self, text: Arc<str>) {
        (self.saved, self.gone) = (text, false);
    }

    /// Notes whether its file was taken away.
    pub fn set_file_missing(&mut self, gone: bool) {
        self.gone = gone;
    }

    /// The last plan that was good, if there ever was one.
    pub fn plan(&self) -> Option<&Arc<Plan>> {
        self.check_state.plan.as_ref()
    }

    /// What is wrong with the text, as far as is known.
    pub fn error(&self) -> Option<&Arc<SceneError>> {
        self.check_state.error.as_ref()
    }

    /// Whether this state has been checked.
    pub fn is_checked(&self) -> bool {
        self.check_state.of == Some(self.revision)
    }

    /// Takes what [`check`] found out about state `revision`; stale news is no news.
    pub fn set_check_result(&mut self, revision: Revision, outcome: Result<Arc<Plan>, SceneError>) {
        if revision != self.revision {
            return;
        }
        self.check_state.of = Some(revision);
        match outcome {
            Ok(plan) => {
                self.check_state.plan = Some(plan);
                self.check_state.error = None;
            }
            Err(error) => self.check_state.error = Some(Arc::new(error)),
        }
    }

    /// Checks this state here and now.
    pub fn check_now(&mut self, assets: &Arc<dyn Assets>) {
        let outcome = check(&self.name, &self.text, assets);
        self.set_check_result(self.revision, outcome);
    }

    /// Carries out `operations` as a step of the history. Steps of one label that follow one another, as those of a slider that is
    /// dragged, are one until [`end_step`](Self::end_step).
    ///
    /// # Errors
    /// The text is no TOML, or an operation leads nowhere; nothing is changed then.
    pub fn edit(&mut self, label: &str, operations: &[Operation]) -> Result<(), EditError> {
        let text = operation::apply(&self.text, operations)?;
        self.history.note(label, &self.text, &text);
        self.show(text.into());
        Ok(())
    }

    /// Goes on to `text`, which says `values`, as [`edit`](Self::edit) does.
    pub(crate) fn apply_text(&mut self, label: &str, text: String, values: Table) {
        self.history.note(label, &self.text, &text);
        if *text != *self.text {
            (self.text, self.revision) = (text.into(), Revision::next());
            (self.values, self.syntax) = (values, None);
        }
    }

    /// Replaces the whole text, as typing does; typing is one step until [`end_step`](Self::end_step).
    pub fn replace(&mut self, label: &str, text: &str) {
        self.history.note(label, &self.text, text);
        self.show(text.into());
    }

    /// Ends a step: what comes next is a step of its own.
    pub fn end_step(&mut self) {
        self.history.end_step();
    }

    /// Takes back the step `label` while it is still open, as if it had never been.
    pub fn discard_step(&mut self, label: &str) {
        if let Some(text) = self.history.discard_step(label) {
            self.show(text);
        }
    }

    /// What undoing would take back.
    pub fn undo_label(&self) -> Option<&str> {
        self.history.undo_label()
    }

    /// All that undoing would take back, the last step first.
    pub fn undo_labels(&self) -> impl Iterator<Item = &str> {
        self.history.undo_labels()
    }

    /// What redoing would do again.
    pub fn redo_label(&self) -> Option<&str> {
        self.history.redo_label()
    }

    /// Takes back the last step; whether there was one.
    pub fn undo(&mut self) -> bool {
        let text = self.history.undo();
        text.map(|text| self.show(text)).is_some()
    }

    /// Does the step again that was taken back last; whether there was one.
    pub fn redo(&mut self) -> bool {
        let text = self.history.redo();
        text.map(|text| self.show(text)).is_some()
    }

    fn show(&mut self, text: Arc<str>) {
        if text == self.text {
            return;
        }
        self.text = text;
        self.revision = Revision::next();
        self.read();
    }

    fn read(&mut self) {
        match values(&self.text) {
            Ok(values) => {
                self.values = values;
                self.syntax = None;
            }
            Err(problem) => self.syntax = Some(problem),
        }
    }

    /// Where the text stops being TOML; operations cannot be carried out then.
    pub fn syntax_problem(&self) -> Option<&Problem> {
        self.syntax.as_ref()
    }
}
