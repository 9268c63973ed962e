//! A shot on many machines: chunks of frames as tasks of a batch system, and the state of these tasks, which is read from files alone.
//!
//! A [`FarmPlan`] beside the frames states how a shot is cut into tasks. Batch systems run the tasks in any order on any machine, since each frame
//! has the same bytes everywhere; nothing here is a queue, a daemon or a lock. Every task checks first that its machine sees the same folder, runs the same
//! program with the same arithmetic and reads the same scene ([`TaskCheck`]), then draws those of its frames that are missing, and writes a small journal. Each
//! task is a [`bansho::job::Job`] that resumes.
//!
//! | step | module |
//! | --- | --- |
//! | the cost of a frame, measured by drawing a few, and whether the disk is large enough | [`costs`] |
//! | frames -> chunks, chunks and tiles -> tasks | [`chunks`] |
//! | the plan, and the files of its folder | [`plan`] |
//! | scripts of Slurm and what its queue lists; a template of Open Job Description | [`slurm`], [`openjd`] |
//! | whether a machine may draw frames of the shot | [`machine`] |
//! | the work of a task, and what is done after all tasks | [`task`], [`finish`], [`products`] |
//! | the reports of tasks, and the state of all frames | [`journal`], [`status`] |

pub mod chunks;
pub mod costs;
mod error;
pub mod finish;
pub mod journal;
pub mod machine;
pub mod openjd;
pub mod plan;
pub mod products;
pub mod slurm;
pub mod status;
pub mod task;

pub use error::FarmError;
pub use machine::TaskCheck;
pub use plan::{FarmFolder, FarmPlan};
