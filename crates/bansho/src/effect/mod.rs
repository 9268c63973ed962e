//! Fire, rain and aurora inside another program: a game, a visualizer, another renderer.
//!
//! An [`Effect`] describes what is drawn and how; [`Effect::open`] builds it, runs its simulations up to time 0 and returns a [`LiveEffect`], which follows
//! the program's own time and takes its changes: wind, parameters, camera. A [`Picture`] of it is written into the program's own buffers.
//!
//! Data flow: parameters -> [`SceneBuilder`](crate::SceneBuilder) -> `Scene` -> `CompiledScene`, `Plan` -> `Shot`, as for a scene file. Without changes, the
//! picture at a time is that of `bansho render`, to the bit.

mod changes;
mod description;
mod error;
mod live;
mod picture;
mod pool;

pub use self::{
    description::Effect,
    error::EffectError,
    live::{LiveEffect, MAX_ADVANCE_S},
    picture::Picture,
};
