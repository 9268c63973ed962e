//! A shot on many machines: chunks of frames as tasks of a batch system, and what is known of them from files alone.
//!
//! A [`FarmPlan`] beside the frames states how a shot is cut into tasks. Batch systems run the tasks in any order on any machine, since each frame
//! has the same bytes everywhere; nothing here is a queue, a daemon or a lock. Every task checks first that its machine sees the same folder, runs the same
//! program with the same arithmetic and reads the same scene ([`TaskCheck`]), then draws what is missing of its frames, and writes a small journal.
//!
//! | step | module |
//! | --- | --- |
//! | the cost of a frame, measured by drawing a few | [`probe`] |
//! | frames -> chunks, chunks and tiles -> tasks | [`chunks`] |
//! | the plan, and the files of its folder | [`plan`] |
//! | scripts of Slurm, a template of Open Job Description | [`slurm`], [`openjd`] |
//! | whether the disk is large enough | [`space`] |
//! | whether a machine may take part | [`machine`] |
//! | what a task draws, and what comes after all tasks | [`task`], [`finish`], [`products`], [`film`] |
//! | what tasks reported, what the batch system knows, and the state of all frames | [`journal`], [`queue`], [`status`] |

pub mod chunks;
mod error;
pub mod film;
pub mod finish;
pub mod journal;
pub mod machine;
pub mod openjd;
pub mod plan;
pub mod probe;
pub mod products;
pub mod queue;
pub mod slurm;
pub mod space;
pub mod status;
pub mod task;

pub use error::FarmError;
pub use machine::TaskCheck;
pub use plan::{FarmFolder, FarmPlan};
