//! What the program writes: pictures, alpha, metadata, flipbooks, and what it does not overwrite.

mod alpha;
mod flipbook;
mod foreign_files;
mod metadata;
mod overwriting;
mod pictures;
