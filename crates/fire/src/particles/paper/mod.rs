//! The way of the paper itself, where a scene selects it: sprites instead of gas (figure 7).

pub(crate) mod squares;
