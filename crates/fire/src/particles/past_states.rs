//! States that a particle flame passes through while the shutter is open.
//!
//! The motion of gas is extrapolated from one state only over a short exposure of a camera that hardly moves. Any other is the mean of exposures from the
//! states of its steps: gas is spawned, burns, cools, turns and is removed in them as in a sequence of short exposures.

use std::{collections::VecDeque, sync::Arc};

use bansho_base::phenomenon::{SnapshotError, strip::Shutter};

use super::simulate::{particles::GasParticles, snapshot};

/// Interval between the states of an exposure, s, rounded to whole steps.
const INTERVAL_S: f64 = 1.0 / 120.0;
/// Longest exposure over which the motion of gas is extrapolated from one state, s: half a frame of a film.
const MAX_EXTRAPOLATED_S: f64 = 1.0 / 48.0;
/// States of an exposure, at most; in a very long one they are farther apart.
const MAX_STATES: f64 = 64.0;
/// Tolerance of times, relative to a step.
const TOLERANCE: f64 = 1e-6;

/// A state and its time, s.
#[derive(Clone, Debug)]
pub(super) struct TimedState {
    pub(super) time: f64,
    pub(super) particles: Arc<GasParticles>,
}

/// States before the current one that the next exposure needs, and what determines them.
#[derive(Clone, Debug)]
pub(super) struct PastStates {
    /// Length of a step, s.
    step: f64,
    /// Time of the initial state, s.
    start: f64,
    states: VecDeque<TimedState>,
    /// The exposure for which states are kept.
    shutter: Option<Shutter>,
}

impl PastStates {
    pub(super) fn new(step: f64, start: f64) -> Self {
        Self { step, start, states: VecDeque::new(), shutter: None }
    }

    /// Whether the gas passes through several states during an exposure, which are then kept.
    pub(super) fn has_several(&self, shutter: Shutter) -> bool {
        shutter.duration() > self.stride(shutter) * self.step * (1.0 + TOLERANCE)
    }

    /// Whether an exposure is so short that the motion of the gas, other than that of the camera, may be extrapolated from one state.
    pub(super) fn is_short(&self, shutter: Shutter) -> bool {
        shutter.duration() <= MAX_EXTRAPOLATED_S.max(self.step) * (1.0 + TOLERANCE)
    }

    /// Whether the time of a state is not after `t`.
    pub(super) fn is_reached(&self, time: f64, t: f64) -> bool {
        time <= t + TOLERANCE * self.step
    }

    /// Steps between the states of an exposure.
    fn stride(&self, shutter: Shutter) -> f64 {
        let shortest = (INTERVAL_S / self.step).round().max(1.0);
        (shutter.duration() / (MAX_STATES * self.step)).ceil().max(shortest)
    }

    /// Time of the first state of an exposure: states are at multiples of the stride, whenever the shutter opens.
    fn first_time(&self, shutter: Shutter) -> f64 {
        let interval = self.stride(shutter) * self.step;
        ((shutter.open / interval + TOLERANCE).floor() * interval).max(self.start)
    }

    fn is_state_of(&self, time: f64, shutter: Shutter) -> bool {
        let steps = (time / self.step).round();
        time >= self.first_time(shutter) - TOLERANCE * self.step && steps.rem_euclid(self.stride(shutter)) == 0.0
    }

    /// Keeps the states of an exposure from now on, and of what is kept those that it needs.
    pub(super) fn begin(&mut self, shutter: Shutter) {
        self.shutter = self.has_several(shutter).then_some(shutter);
        let mut states = std::mem::take(&mut self.states);
        states.retain(|state| self.shutter.is_some_and(|shutter| self.is_state_of(state.time, shutter)));
        self.states = states;
    }

    /// Whether the states of an exposure are kept or to come, when the current state is at `now`.
    pub(super) fn keeps(&self, shutter: Shutter, now: f64) -> bool {
        let first = self.states.front().map_or(now, |state| state.time);
        !self.has_several(shutter) || first <= self.first_time(shutter) + TOLERANCE * self.step
    }

    /// Keeps the current state, before it is stepped, if the exposure needs it.
    pub(super) fn keep(&mut self, time: f64, particles: &GasParticles) {
        if self.shutter.is_some_and(|shutter| self.is_state_of(time, shutter)) {
            self.states.push_back(TimedState { time, particles: Arc::new(particles.clone()) });
        }
    }

    /// The states of an exposure that are kept, in order.
    pub(super) fn of_exposure(&self, shutter: Shutter) -> impl Iterator<Item = &TimedState> {
        self.states.iter().filter(move |state| self.is_exposed(state.time, shutter))
    }

    /// The last of the states that are kept that is not after `t`, or else the first of them.
    pub(super) fn state_at(&self, t: f64) -> Option<&TimedState> {
        self.states.iter().rev().find(|state| self.is_reached(state.time, t)).or(self.states.front())
    }

    /// Whether the state at `time` is one of several from which an exposure is drawn.
    pub(super) fn is_exposed(&self, time: f64, shutter: Shutter) -> bool {
        self.has_several(shutter) && self.is_state_of(time, shutter) && time < shutter.close - TOLERANCE * self.step
    }

    /// Serializes the states.
    pub(super) fn write(&self, bytes: &mut Vec<u8>) {
        for state in &self.states {
            bytes.extend(state.time.to_le_bytes());
            bytes.extend(snapshot::write(&state.particles));
        }
    }

    /// Reads what [`write`](Self::write) wrote, of the same flame.
    pub(super) fn read(
        &self,
        mut bytes: &[u8],
        particles: &GasParticles,
        burners: usize,
    ) -> Result<VecDeque<TimedState>, SnapshotError> {
        let mut states = VecDeque::new();
        while let Some((time, rest)) = bytes.split_first_chunk::<8>() {
            let time = f64::from_le_bytes(*time);
            let (state, rest) = snapshot::split_first(rest)?;
            let is_later = states.back().is_none_or(|earlier: &TimedState| earlier.time < time);
            if !(time.is_finite() && is_later) {
                return Err(SnapshotError::Damaged);
            }
            let particles = Arc::new(snapshot::read(particles, state, burners)?);
            states.push_back(TimedState { time, particles });
            bytes = rest;
        }
        if bytes.is_empty() { Ok(states) } else { Err(SnapshotError::Damaged) }
    }

    /// Puts states in the place of those that are kept.
    pub(super) fn restore(&mut self, states: VecDeque<TimedState>) {
        self.states = states;
    }
}
