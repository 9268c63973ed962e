//! The phenomena, rendered by the program.

mod aurora;
mod particles;
mod rain;
mod streaks;
