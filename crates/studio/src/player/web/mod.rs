//! The player of a web page: a worker that runs the same program, and the messages between both.

#[cfg(target_arch = "wasm32")]
pub(crate) mod message;
#[cfg(any(test, target_arch = "wasm32"))]
pub(crate) mod pending;
#[cfg(target_arch = "wasm32")]
pub(crate) mod worker;
