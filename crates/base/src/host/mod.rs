//! Interfaces to the host program: assets, memory, progress and cancellation, text for terminals, parallel work, and scratch memory.

pub mod assets;
pub mod constructions;
pub mod memory;
pub mod observer;
pub mod once;
pub mod parallel;
pub mod picture_pixels;
pub mod plural;
pub mod printable;
pub mod scratch_pool;
pub mod stage_times;
