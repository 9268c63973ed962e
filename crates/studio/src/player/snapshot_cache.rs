//! Snapshots of the simulation at earlier frames, so that scrubbing backwards does not restart at the first frame.

use std::{collections::BTreeMap, sync::Arc};

use bansho::{CompiledScene, Shot};

/// Maximum size of all snapshots, bytes.
const MAX_BYTES: usize = 256 << 20;
/// Smallest number of frames between two snapshots.
const MIN_FRAME_DISTANCE: i64 = 10;

/// Snapshots of one scene, by frame.
#[derive(Default)]
pub(super) struct SnapshotCache {
    /// The scene, and its state fingerprint.
    scene: Option<(Arc<CompiledScene>, [u8; 32])>,
    by_frame: BTreeMap<i64, Vec<u8>>,
    bytes: usize,
    /// The current frame of the shot.
    last: Option<i64>,
}

impl SnapshotCache {
    /// Restores the last snapshot up to frame `number` if the shot is beyond that frame.
    pub(super) fn seek(&mut self, compiled: &Arc<CompiledScene>, shot: &mut Shot, number: i64) {
        self.set_scene(compiled);
        if self.last.is_none_or(|last| last <= number) {
            return;
        }
        if let Some((_, state)) = self.by_frame.range(..=number).next_back() {
            // If restoring fails, the shot is unchanged and restarts.
            let _ = shot.restore(state);
        }
    }

    /// Stores a snapshot at frame `number`, if it is exact and none is near.
    pub(super) fn store(&mut self, compiled: &Arc<CompiledScene>, shot: &Shot, number: i64) {
        self.set_scene(compiled);
        self.last = Some(number);
        let near = self.by_frame.range(number - MIN_FRAME_DISTANCE + 1..=number).next().is_some();
        if near || !shot.is_exact() || self.bytes >= MAX_BYTES {
            return;
        }
        let state = shot.snapshot();
        self.bytes += state.len();
        self.by_frame.insert(number, state);
    }

    /// Drops the snapshots if the scene has another state fingerprint.
    fn set_scene(&mut self, compiled: &Arc<CompiledScene>) {
        if self.scene.as_ref().is_some_and(|(own, _)| Arc::ptr_eq(own, compiled)) {
            return;
        }
        let fingerprint = compiled.state_fingerprint();
        if self.scene.as_ref().is_none_or(|(_, own)| *own != fingerprint) {
            self.bytes = 0;
            self.by_frame.clear();
        }
        self.scene = Some((compiled.clone(), fingerprint));
    }
}
