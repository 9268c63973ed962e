//! The real program: good and bad input, exit codes, interruptions, files.

mod alpha;
mod aurora;
mod bad_input;
mod commands;
mod completeness;
mod disk;
mod figures;
mod flipbook;
mod inputs;
mod interruptions;
mod large_scenes;
#[cfg(target_os = "linux")]
mod memory;
mod overwriting;
mod particles;
mod pictures;
mod rain;
mod rooms;
mod streaks;
mod support;
mod threads;
