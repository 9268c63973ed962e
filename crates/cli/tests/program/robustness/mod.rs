//! Interruptions, full disks, too little memory, and any number of threads.

mod completeness;
mod disk;
mod interruptions;
#[cfg(target_os = "linux")]
mod memory;
mod threads;
