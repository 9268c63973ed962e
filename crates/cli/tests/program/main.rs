//! Tests of the program: valid and invalid input, exit codes, interruptions, output files.

mod commands;
mod crate_dependencies;
#[cfg(unix)]
mod farm;
mod input;
mod output;
mod papers;
mod phenomena;
mod plot;
mod robustness;
mod support;
