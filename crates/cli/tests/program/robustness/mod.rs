//! Interruptions, full disks, too little memory, any number of threads, and any vector instructions.

mod completeness;
mod disk;
mod interruptions;
#[cfg(target_os = "linux")]
mod memory;
mod threads;
mod vector_levels;
