//! What the program reads: invalid scenes and options, files, and very large scenes.

mod bad_input;
mod input_files;
mod large_scenes;
