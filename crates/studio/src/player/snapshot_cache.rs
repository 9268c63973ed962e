//! States of stepped phenomena along the way, so that going back in time does not begin at its beginning.

use std::{collections::BTreeMap, sync::Arc};

use bansho::{Plan, Shot, render::fingerprint};

/// Bytes of states that are kept.
const MAX_BYTES: usize = 256 << 20;
/// Frames between two states.
const FRAMES_APART: i64 = 10;

/// States of one plan, by frame.
#[derive(Default)]
pub(super) struct SnapshotCache {
    of: Option<(Arc<Plan>, [u8; 32])>,
    by_frame: BTreeMap<i64, Vec<u8>>,
    bytes: usize,
    /// The frame that the shot stands at.
    last: Option<i64>,
}

impl SnapshotCache {
    /// Brings `shot` nearer to frame `number` where that lies behind it and a state does not.
    pub(super) fn seek(&mut self, plan: &Arc<Plan>, shot: &mut dyn Shot, number: i64) {
        self.set_plan(plan);
        if self.last.is_none_or(|last| last <= number) {
            return;
        }
        if let Some((_, state)) = self.by_frame.range(..=number).next_back() {
            // A state that is refused leaves the shot as it was, which then begins anew.
            let _ = shot.restore(state);
        }
    }

    /// Keeps the state at frame `number` where it is worth it: only states that the plan leads to are.
    pub(super) fn store(&mut self, plan: &Arc<Plan>, shot: &dyn Shot, number: i64) {
        self.set_plan(plan);
        self.last = Some(number);
        let near = self.by_frame.range(number - FRAMES_APART + 1..=number).next().is_some();
        if near || !shot.is_exact() || self.bytes >= MAX_BYTES {
            return;
        }
        let state = shot.snapshot();
        self.bytes += state.len();
        self.by_frame.insert(number, state);
    }

    /// States of another plan are of no use.
    fn set_plan(&mut self, plan: &Arc<Plan>) {
        if self.of.as_ref().is_some_and(|(own, _)| Arc::ptr_eq(own, plan)) {
            return;
        }
        let of = fingerprint::of_state(plan);
        if self.of.as_ref().is_none_or(|(_, own)| *own != of) {
            self.bytes = 0;
            self.by_frame.clear();
        }
        self.of = Some((plan.clone(), of));
    }
}
