//! Undo and redo. Scenes are small, so each step keeps both texts.

use std::sync::Arc;

/// Maximum number of undo steps.
const MAX_STEPS: usize = 1000;

#[derive(Default)]
pub(super) struct History {
    undo_steps: Vec<Step>,
    redo_steps: Vec<Step>,
    /// Whether an edit with the same label extends the last step.
    open: bool,
}

struct Step {
    label: String,
    before: Arc<str>,
    after: Arc<str>,
}

impl History {
    /// Records a step from `before` to `after`. It extends the last step if that is open and has the same label.
    pub(super) fn record(&mut self, label: &str, before: &Arc<str>, after: &str) {
        if **before == *after {
            return;
        }
        self.redo_steps.clear();
        let open = self.open;
        match self.undo_steps.last_mut().filter(|last| open && last.label == label) {
            Some(last) => last.after = after.into(),
            None => {
                self.undo_steps.push(Step { label: label.to_owned(), before: before.clone(), after: after.into() });
                self.undo_steps.drain(..self.undo_steps.len().saturating_sub(MAX_STEPS));
            }
        }
        self.open = true;
    }

    pub(super) fn end_step(&mut self) {
        self.open = false;
    }

    /// Removes the last step if it is open and called `label`. Returns the text before that step.
    pub(super) fn discard_step(&mut self, label: &str) -> Option<Arc<str>> {
        let open = std::mem::take(&mut self.open);
        let step = self.undo_steps.pop_if(|step| open && step.label == label)?;
        Some(step.before)
    }

    pub(super) fn undo_label(&self) -> Option<&str> {
        self.undo_steps.last().map(|step| step.label.as_str())
    }

    pub(super) fn undo_labels(&self) -> impl Iterator<Item = &str> {
        self.undo_steps.iter().rev().map(|step| step.label.as_str())
    }

    pub(super) fn redo_label(&self) -> Option<&str> {
        self.redo_steps.last().map(|step| step.label.as_str())
    }

    pub(super) fn undo(&mut self) -> Option<Arc<str>> {
        self.open = false;
        let step = self.undo_steps.pop()?;
        let text = step.before.clone();
        self.redo_steps.push(step);
        Some(text)
    }

    pub(super) fn redo(&mut self) -> Option<Arc<str>> {
        self.open = false;
        let step = self.redo_steps.pop()?;
        let text = step.after.clone();
        self.undo_steps.push(step);
        Some(text)
    }
}
