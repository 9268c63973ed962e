//! Undo and redo. Scenes are small, so each step keeps both texts.

use std::sync::Arc;

/// Most undo steps.
const MAX_STEPS: usize = 1000;

#[derive(Default)]
pub(super) struct History {
    done: Vec<Step>,
    undone: Vec<Step>,
    /// Whether the last step may still grow.
    open: bool,
}

struct Step {
    label: String,
    before: Arc<str>,
    after: Arc<str>,
}

impl History {
    /// Notes a step from `before` to `after`, which goes on with an open one of the same label.
    pub(super) fn record(&mut self, label: &str, before: &Arc<str>, after: &str) {
        if **before == *after {
            return;
        }
        self.undone.clear();
        let open = self.open;
        match self.done.last_mut().filter(|last| open && last.label == label) {
            Some(last) => last.after = after.into(),
            None => {
                self.done.push(Step { label: label.to_owned(), before: before.clone(), after: after.into() });
                self.done.drain(..self.done.len().saturating_sub(MAX_STEPS));
            }
        }
        self.open = true;
    }

    pub(super) fn end_step(&mut self) {
        self.open = false;
    }

    /// Forgets the last step where it is called `label` and still open; the text before it.
    pub(super) fn discard_step(&mut self, label: &str) -> Option<Arc<str>> {
        let open = std::mem::take(&mut self.open);
        let step = self.done.pop_if(|step| open && step.label == label)?;
        Some(step.before)
    }

    pub(super) fn undo_label(&self) -> Option<&str> {
        self.done.last().map(|step| step.label.as_str())
    }

    pub(super) fn undo_labels(&self) -> impl Iterator<Item = &str> {
        self.done.iter().rev().map(|step| step.label.as_str())
    }

    pub(super) fn redo_label(&self) -> Option<&str> {
        self.undone.last().map(|step| step.label.as_str())
    }

    pub(super) fn undo(&mut self) -> Option<Arc<str>> {
        self.open = false;
        let step = self.done.pop()?;
        let text = step.before.clone();
        self.undone.push(step);
        Some(text)
    }

    pub(super) fn redo(&mut self) -> Option<Arc<str>> {
        self.open = false;
        let step = self.undone.pop()?;
        let text = step.after.clone();
        self.done.push(step);
        Some(text)
    }
}
