//! Falls of electrons by their energy, ready to be placed in batches.

use rayon::prelude::*;

use super::splat::BATCH;
use crate::{
    physics::{
        atmosphere::LEVELS,
        precipitation::electron_track::{Collision, VARIANTS, collision_count},
    },
    render::project::altitude_polynomial::Descents,
};

/// What shines after a collision: the mean of a level, or nothing.
const NOTHING: u16 = LEVELS as u16;
/// Lanes from one collision of a full batch to the next below; odd, so that all are filled.
const APART: usize = 5;

/// Falls of a library, their collisions in batches.
#[derive(Clone, Debug)]
pub(super) struct FallTable {
    /// Where the falls of each node begin, and the end of all, in batches.
    starts: Vec<usize>,
    batches: Vec<FallBatch>,
}

/// [`BATCH`] collisions of a fall, or fewer in the last of them.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct FallBatch {
    /// Places among the altitudes, [`Descents::place`].
    pub(super) places: [f32; BATCH],
    pub(super) offsets_km: [f32; BATCH],
    /// Places among the photons.
    pub(super) lights: [u16; BATCH],
    pub(super) count: u32,
}

impl FallTable {
    /// Falls of so many nodes of the grid of energies, and where the light of each collision stands among the photons.
    pub(super) fn new(nodes: usize, fall: impl Fn(usize, u32) -> Vec<(Collision, u16)> + Sync) -> Self {
        let of_node = |node: usize| -> Vec<FallBatch> {
            let count = (collision_count(node) as usize).div_ceil(BATCH);
            (0..VARIANTS).flat_map(|variant| batches(&fall(node, variant), count)).collect()
        };
        let by_node: Vec<_> = (0..nodes).into_par_iter().map(of_node).collect();
        let mut starts = vec![0];
        starts.extend(by_node.iter().scan(0, |end, batches| {
            *end += batches.len();
            Some(*end)
        }));
        Self { starts, batches: by_node.concat() }
    }

    /// The highest node that has falls.
    pub(super) fn highest(&self) -> usize {
        self.starts.len() - 2
    }

    /// One of the falls of a node up to the highest, any number.
    #[inline(always)]
    pub(super) fn fall(&self, node: usize, variant: u32) -> &[FallBatch] {
        let (start, end) = (self.starts[node], self.starts[node + 1]);
        let count = (end - start) / VARIANTS as usize;
        &self.batches[start + (variant % VARIANTS) as usize * count..][..count]
    }
}

/// The collisions of a fall in so many batches, all but the last of them full.
///
/// What the last one has and what each of the others has are evenly spread over the fall; in full ones, collisions of neighbouring lanes are
/// far apart, since sums in one pair of rows would wait for each other.
fn batches(fall: &[(Collision, u16)], count: usize) -> Vec<FallBatch> {
    let full = count.saturating_sub(1);
    let last = fall.len().min(BATCH * count).saturating_sub(BATCH * full);
    let mut batches = vec![FallBatch::EMPTY; count];
    let mut others = 0_usize;
    for (number, collision) in fall.iter().take(BATCH * count).enumerate() {
        let is_last = (number + 1) * last / fall.len() > number * last / fall.len();
        if is_last || full == 0 {
            let lane = batches[full].count as usize;
            batches[full].put(lane, collision);
        } else {
            batches[others % full].put(others / full * APART % BATCH, collision);
            others += 1;
        }
    }
    // A fall that ends early goes on in the dark where it ended.
    for (collision, _) in fall.last().into_iter().cycle().take((BATCH * full).saturating_sub(others)) {
        batches[others % full].put(others / full * APART % BATCH, &(*collision, NOTHING));
        others += 1;
    }
    // Lanes that have none lie where the first does, so that no row is lit for them.
    for batch in &mut batches[full..] {
        for lane in batch.count as usize..BATCH {
            (batch.places[lane], batch.offsets_km[lane]) = (batch.places[0], batch.offsets_km[0]);
        }
    }
    batches
}

impl FallBatch {
    const EMPTY: Self = Self { places: [0.0; BATCH], offsets_km: [0.0; BATCH], lights: [NOTHING; BATCH], count: 0 };

    fn put(&mut self, lane: usize, (collision, light): &(Collision, u16)) {
        self.places[lane] = Descents::place(collision.altitude_km);
        self.offsets_km[lane] = collision.offset_km[0];
        self.lights[lane] = *light;
        self.count += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_collision_of_a_fall_is_in_a_batch() {
        for (collisions, count) in [(1, 1), (16, 1), (17, 2), (50, 4), (100, 7), (20, 4)] {
            let collision = |number: usize| {
                let altitude_km = 300.0 - 2.0 * number as f32;
                (Collision { level: 0, altitude_km, offset_km: [number as f32, 0.0] }, number as u16)
            };
            let fall: Vec<_> = (0..collisions).map(collision).collect();
            let batches = batches(&fall, count);
            assert!(batches.iter().rev().skip(1).all(|batch| batch.count as usize == BATCH));
            let lanes = batches.iter().flat_map(|batch| (0..batch.count as usize).map(move |lane| (batch, lane)));
            let mut found: Vec<u16> = lanes
                .filter(|(batch, lane)| batch.lights[*lane] != NOTHING)
                .inspect(|(batch, lane)| {
                    let number = f32::from(batch.lights[*lane]);
                    assert_eq!(
                        (batch.offsets_km[*lane], batch.places[*lane]),
                        (number, Descents::place(300.0 - 2.0 * number))
                    );
                })
                .map(|(batch, lane)| batch.lights[lane])
                .collect();
            found.sort_unstable();
            assert!(found.into_iter().eq(0..collisions as u16), "{collisions} in {count}");
        }
    }
}
