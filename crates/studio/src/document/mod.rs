//! The scene as text: edits that keep comments, undo, problems with their lines, and the last valid plan.

mod check;
pub(crate) mod descriptors;
pub(crate) mod editor_hints;
pub mod files;
mod history;
pub(crate) mod keyframes;
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
    scene::{
        edit::EditError,
        operation::{self, Operation},
        parse_values,
    },
};

pub use check::{CheckReport, Checker, PlannedScene, ReportedProblem, check, plan_from_report};
pub use descriptors::{FileReference, named_files};
pub use phenomena::{PhenomenonEntry, PhenomenonId, operations};

use history::History;

/// A revision of a document, unique among all documents of this process.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Revision(pub(crate) u64);

impl Revision {
    /// A new revision.
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
    /// Whether its file was deleted.
    file_missing: bool,
    first_revision: Revision,
    revision: Revision,
    history: History,
    values: Table,
    syntax_problem: Option<Problem>,
    check_state: CheckState,
}

/// The result of the last check.
#[derive(Default)]
struct CheckState {
    /// The checked revision.
    revision: Option<Revision>,
    /// The last valid plan.
    plan: Option<Arc<Plan>>,
    error: Option<Arc<SceneError>>,
}

impl Document {
    /// A document with this text, unchanged so far; `name` is what errors call it.
    pub fn new(name: impl Into<String>, text: impl Into<Arc<str>>) -> Self {
        let text = text.into();
        let first_revision = Revision::next();
        let mut document = Self {
            name: name.into(),
            saved: text.clone(),
            file_missing: false,
            text,
            first_revision,
            revision: first_revision,
            history: History::default(),
            values: Table::default(),
            syntax_problem: None,
            check_state: CheckState::default(),
        };
        document.parse();
        document
    }

    /// The name in error messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Renames it, as after Save As.
    pub fn rename(&mut self, name: impl Into<String>) {
        self.name = name.into();
    }

    /// The scene file, as it would be saved.
    pub fn text(&self) -> &Arc<str> {
        &self.text
    }

    /// The current revision.
    pub fn revision(&self) -> Revision {
        self.revision
    }

    /// Whether `revision` is or was a revision of this document.
    pub fn includes_revision(&self, revision: Revision) -> bool {
        (self.first_revision..=self.revision).contains(&revision)
    }

    /// The values of the text, or of the last text that was valid TOML.
    pub fn values(&self) -> &Table {
        &self.values
    }

    /// Whether it differs from its file.
    pub fn is_dirty(&self) -> bool {
        self.file_missing || self.is_modified()
    }

    /// Whether it was edited since it was saved or opened.
    pub fn is_modified(&self) -> bool {
        self.text != self.saved
    }

    /// Records that its file has `text` now.
    pub fn mark_saved(&mut self, text: Arc<str>) {
        (self.saved, self.file_missing) = (text, false);
    }

    /// Records whether its file was deleted.
    pub fn set_file_missing(&mut self, missing: bool) {
        self.file_missing = missing;
    }

    /// The last valid plan.
    pub fn plan(&self) -> Option<&Arc<Plan>> {
        self.check_state.plan.as_ref()
    }

    /// The problems found by the last check, if there are any.
    pub fn error(&self) -> Option<&Arc<SceneError>> {
        self.check_state.error.as_ref()
    }

    /// Whether the current revision has been checked.
    pub fn is_checked(&self) -> bool {
        self.check_state.revision == Some(self.revision)
    }

    /// Sets the result of [`check()`] for `revision`; results of older revisions are ignored.
    pub fn set_check_result(&mut self, revision: Revision, outcome: Result<Arc<Plan>, SceneError>) {
        if revision != self.revision {
            return;
        }
        self.check_state.revision = Some(revision);
        match outcome {
            Ok(plan) => {
                self.check_state.plan = Some(plan);
                self.check_state.error = None;
            }
            Err(error) => self.check_state.error = Some(Arc::new(error)),
        }
    }

    /// Checks the current revision synchronously.
    pub fn check_now(&mut self, assets: &Arc<dyn Assets>) {
        let outcome = check(&self.name, &self.text, assets).map(|scene| scene.plan);
        self.set_check_result(self.revision, outcome);
    }

    /// Applies `operations` as an undo step. Successive edits with the same label, such as those of a dragged slider, are one step until [`end_step`](Self::end_step).
    ///
    /// # Errors
    /// The text is not TOML, or an operation's path does not exist; nothing is changed then.
    pub fn edit(&mut self, label: &str, operations: &[Operation]) -> Result<(), EditError> {
        let text = operation::apply(&self.text, operations)?;
        self.history.record(label, &self.text, &text);
        self.set_text(text.into());
        Ok(())
    }

    /// Sets `text` with its parsed `values`, as [`edit`](Self::edit) does.
    pub(crate) fn apply_text(&mut self, label: &str, text: String, values: Table) {
        self.history.record(label, &self.text, &text);
        if *text != *self.text {
            (self.text, self.revision) = (text.into(), Revision::next());
            (self.values, self.syntax_problem) = (values, None);
        }
    }

    /// Replaces the whole text, as typing does; edits with the same label are one step until [`end_step`](Self::end_step).
    pub fn replace(&mut self, label: &str, text: &str) {
        self.history.record(label, &self.text, text);
        self.set_text(text.into());
    }

    /// Ends the undo step: the next edit starts another.
    pub fn end_step(&mut self) {
        self.history.end_step();
    }

    /// Reverts and discards the open undo step `label`.
    pub fn discard_step(&mut self, label: &str) {
        if let Some(text) = self.history.discard_step(label) {
            self.set_text(text);
        }
    }

    /// The label of the step that undo would revert.
    pub fn undo_label(&self) -> Option<&str> {
        self.history.undo_label()
    }

    /// The labels of all steps that can be undone, newest first.
    pub fn undo_labels(&self) -> impl Iterator<Item = &str> {
        self.history.undo_labels()
    }

    /// The label of the step that redo would apply.
    pub fn redo_label(&self) -> Option<&str> {
        self.history.redo_label()
    }

    /// Undoes the last step. Returns whether there was one.
    pub fn undo(&mut self) -> bool {
        let text = self.history.undo();
        text.map(|text| self.set_text(text)).is_some()
    }

    /// Redoes the step that was undone last. Returns whether there was one.
    pub fn redo(&mut self) -> bool {
        let text = self.history.redo();
        text.map(|text| self.set_text(text)).is_some()
    }

    fn set_text(&mut self, text: Arc<str>) {
        if text == self.text {
            return;
        }
        self.text = text;
        self.revision = Revision::next();
        self.parse();
    }

    fn parse(&mut self) {
        match parse_values(&self.text) {
            Ok(values) => {
                self.values = values;
                self.syntax_problem = None;
            }
            Err(problem) => self.syntax_problem = Some(problem),
        }
    }

    /// The TOML syntax error, if there is one; operations cannot be applied then.
    pub fn syntax_problem(&self) -> Option<&Problem> {
        self.syntax_problem.as_ref()
    }
}
