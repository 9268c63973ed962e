//! The program `bansho`.
fn main() {}
