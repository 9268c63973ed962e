//! Electron tracks by energy, arranged in SIMD batches.

use bansho_base::host::parallel::prelude::*;

use super::rasterize::SPLAT_LANES;
use crate::{
    physics::{
        atmosphere::LEVELS,
        precipitation::electron_track::{Collision, TRACKS_PER_ENERGY, collision_count},
    },
    render::project::altitude_polynomial::RowPolynomialBasis,
};

/// Photon row for padding lanes and collisions without light. The values below are levels of the atmosphere.
pub(super) const NO_EMISSION: u16 = LEVELS as u16;
/// Lane stride between successive collisions of a full batch; odd, so that all lanes are filled.
const LANE_STRIDE: usize = 5;

/// Tracks of a library in batches.
#[derive(Clone, Debug, Default)]
pub(super) struct TrackTable {
    /// Start of each node's tracks, and the total, in batches.
    starts: Vec<usize>,
    batches: Vec<CollisionBatch>,
}

/// [`SPLAT_LANES`] collisions of a track, or fewer in the last batch.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct CollisionBatch {
    /// Altitude coordinates, [`RowPolynomialBasis::altitude_coordinate`].
    pub(super) altitude_coordinates: [f32; SPLAT_LANES],
    pub(super) offsets_km: [f32; SPLAT_LANES],
    /// Rows of the photon table.
    pub(super) photon_rows: [u16; SPLAT_LANES],
    pub(super) count: u32,
}

impl TrackTable {
    /// Tracks for a number of energy nodes, with the photon row of each collision.
    pub(super) fn new(nodes: usize, track: impl Fn(usize, u32) -> Vec<(Collision, u16)> + Sync) -> Self {
        let by_node: Vec<Vec<CollisionBatch>> = (0..nodes)
            .into_par_iter()
            .map(|node| {
                let count = (collision_count(node) as usize).div_ceil(SPLAT_LANES);
                (0..TRACKS_PER_ENERGY).flat_map(|variant| batches(&track(node, variant), count)).collect()
            })
            .collect();
        let mut starts = vec![0];
        starts.extend(by_node.iter().scan(0, |end, batches| {
            *end += batches.len();
            Some(*end)
        }));
        Self { starts, batches: by_node.concat() }
    }

    /// The highest node with tracks.
    pub(super) fn highest_node(&self) -> usize {
        self.starts.len() - 2
    }

    /// One of the tracks of a node up to the highest (any `variant`).
    #[inline(always)]
    pub(super) fn track(&self, node: usize, variant: u32) -> &[CollisionBatch] {
        let (start, end) = (self.starts[node], self.starts[node + 1]);
        let count = (end - start) / TRACKS_PER_ENERGY as usize;
        &self.batches[start + (variant % TRACKS_PER_ENERGY) as usize * count..][..count]
    }
}

/// Distributes the collisions of a track to batches, all but the last of them full.
///
/// Both the last batch and the full ones sample the whole track evenly. In full batches neighboring lanes are far apart
/// in altitude, to avoid dependent sums in one row pair.
fn batches(track: &[(Collision, u16)], count: usize) -> Vec<CollisionBatch> {
    let full = count.saturating_sub(1);
    let last = track.len().min(SPLAT_LANES * count).saturating_sub(SPLAT_LANES * full);
    let mut batches = vec![CollisionBatch::EMPTY; count];
    let mut others = 0_usize;
    for (number, collision) in track.iter().take(SPLAT_LANES * count).enumerate() {
        let is_last = (number + 1) * last / track.len() > number * last / track.len();
        if is_last || full == 0 {
            let lane = batches[full].count as usize;
            batches[full].set_lane(lane, collision);
        } else {
            batches[others % full].set_lane(others / full * LANE_STRIDE % SPLAT_LANES, collision);
            others += 1;
        }
    }
    // Tracks that end early are padded with collisions that do not emit, at the last position.
    for (collision, _) in track.last().into_iter().cycle().take((SPLAT_LANES * full).saturating_sub(others)) {
        batches[others % full].set_lane(others / full * LANE_STRIDE % SPLAT_LANES, &(*collision, NO_EMISSION));
        others += 1;
    }
    batches[full..].iter_mut().for_each(CollisionBatch::fill_unused_lanes);
    batches
}

impl CollisionBatch {
    const EMPTY: Self = Self {
        altitude_coordinates: [0.0; SPLAT_LANES],
        offsets_km: [0.0; SPLAT_LANES],
        photon_rows: [NO_EMISSION; SPLAT_LANES],
        count: 0,
    };

    fn set_lane(&mut self, lane: usize, (collision, light): &(Collision, u16)) {
        self.altitude_coordinates[lane] = RowPolynomialBasis::altitude_coordinate(collision.altitude_km);
        self.offsets_km[lane] = collision.transverse_km[0];
        self.photon_rows[lane] = *light;
        self.count += 1;
    }

    /// Places unused lanes at the first lane, so that no extra row is touched.
    fn fill_unused_lanes(&mut self) {
        for lane in self.count as usize..SPLAT_LANES {
            (self.altitude_coordinates[lane], self.offsets_km[lane]) =
                (self.altitude_coordinates[0], self.offsets_km[0]);
        }
    }
}

/// Replaces `batches` by those of a single track, in any number of collisions.
pub(super) fn fill_batches(track: &[(Collision, u16)], batches: &mut Vec<CollisionBatch>) {
    batches.clear();
    batches.extend(track.chunks(SPLAT_LANES).map(|collisions| {
        let mut batch = CollisionBatch::EMPTY;
        collisions.iter().enumerate().for_each(|(lane, collision)| batch.set_lane(lane, collision));
        batch.fill_unused_lanes();
        batch
    }));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_collision_of_a_track_is_in_a_batch() {
        for (collisions, count) in [(1, 1), (16, 1), (17, 2), (50, 4), (100, 7), (20, 4)] {
            let collision = |number: usize| {
                let altitude_km = 300.0 - 2.0 * number as f32;
                (Collision { level: 0, altitude_km, transverse_km: [number as f32, 0.0] }, number as u16)
            };
            let track: Vec<_> = (0..collisions).map(collision).collect();
            let batches = batches(&track, count);
            assert!(batches.iter().rev().skip(1).all(|batch| batch.count as usize == SPLAT_LANES));
            let lanes = batches.iter().flat_map(|batch| (0..batch.count as usize).map(move |lane| (batch, lane)));
            let mut found: Vec<u16> = lanes
                .filter(|(batch, lane)| batch.photon_rows[*lane] != NO_EMISSION)
                .inspect(|(batch, lane)| {
                    let number = f32::from(batch.photon_rows[*lane]);
                    assert_eq!(
                        (batch.offsets_km[*lane], batch.altitude_coordinates[*lane]),
                        (number, RowPolynomialBasis::altitude_coordinate(300.0 - 2.0 * number))
                    );
                })
                .map(|(batch, lane)| batch.photon_rows[lane])
                .collect();
            found.sort_unstable();
            assert!(found.into_iter().eq(0..collisions as u16), "{collisions} in {count}");
        }
    }
}
