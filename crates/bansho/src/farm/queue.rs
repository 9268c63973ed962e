//! What a batch system knows of the jobs of a plan: which of them wait or run. A task that is killed writes no last line to its journal, and only the batch
//! system knows that it is gone.

use std::collections::BTreeMap;

use serde::Serialize;

/// What a batch system does with a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum QueueState {
    /// It waits for its turn, for the first time or once more.
    Waiting,
    /// It runs.
    Running,
}

/// States in which a job of Slurm has not begun.
const WAITING: [&str; 5] = ["PENDING", "REQUEUED", "REQUEUE_FED", "REQUEUE_HOLD", "SPECIAL_EXIT"];

/// The jobs of a plan that a batch system has not ended.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Queue {
    /// By the name of the job and, of an array, the number of the task.
    states: BTreeMap<(String, Option<usize>), QueueState>,
}

impl Queue {
    /// Format of `squeue --noheader --array` for [`Self::of_slurm`]: the job, the task of an array, and the state.
    pub const SLURM_FORMAT: &str = "%F %K %T";

    /// The jobs that `submit.sh` submitted (a line has its name and its number), as far as they are `listed` by `squeue`.
    pub fn of_slurm(submitted: &str, listed: &str) -> Self {
        let names: BTreeMap<&str, &str> =
            submitted.lines().filter_map(|line| line.split_once(' ')).map(|(name, id)| (id.trim(), name)).collect();
        let of_line = |line: &str| {
            let mut words = line.split_whitespace();
            let (id, task, state) = (words.next()?, words.next()?, words.next()?);
            let state = if WAITING.contains(&state) { QueueState::Waiting } else { QueueState::Running };
            Some((((*names.get(id)?).to_owned(), task.parse().ok()), state))
        };
        Self { states: listed.lines().filter_map(of_line).collect() }
    }

    /// The state of task `task` of the array; `None` if it has ended or was never submitted.
    pub fn task(&self, task: usize) -> Option<QueueState> {
        self.states.get(&("frames".to_owned(), Some(task))).copied()
    }

    /// Whether no job waits or runs.
    pub fn is_empty(&self) -> bool {
        self.states.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jobs_of_the_plan_are_found_among_all_others() {
        let submitted = "check 7\nframes 8\nfinish 9\n";
        let listed =
            "8 0 RUNNING\n8 3 PENDING\n8 4 REQUEUED\n9 N/A PENDING\n80 1 RUNNING\n\nnonsense\n8 2 COMPLETING\n";
        let queue = Queue::of_slurm(submitted, listed);
        let tasks: Vec<_> = (0..5).map(|task| queue.task(task)).collect();
        let (running, waiting) = (Some(QueueState::Running), Some(QueueState::Waiting));
        assert_eq!(tasks, [running, None, running, waiting, waiting]);
        assert!(!queue.is_empty());
        assert!(Queue::of_slurm(submitted, "80 1 RUNNING\n").is_empty());
        assert!(Queue::of_slurm("", listed).is_empty());
    }
}
