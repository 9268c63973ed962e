//! The four papers: their tables in the book, the equations of all crates, scenes to the letter, and what their figures show.

#[path = "../support/planned.rs"]
mod planned;
#[path = "../support/sources.rs"]
mod sources;

mod equations;
#[cfg(feature = "files")]
mod inagaki_figures;
#[cfg(feature = "files")]
mod ohshima_itahashi;
mod sekiguchi_to_the_letter;
mod tables;
mod to_the_letter;
#[cfg(feature = "files")]
mod yoshida_figures;
