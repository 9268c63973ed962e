//! Cargo resolves build dependencies only for crates that have a build script.

fn main() {}
