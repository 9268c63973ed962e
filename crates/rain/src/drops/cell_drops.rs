//! The drops of one cell, drop by drop: their number, positions and motion, sixteen at a time.

use bansho_base::math::{
    random::{self, Key, Purpose},
    simd::{LANES, Real},
};

use super::{
    cell_motion::{CellState, DropStates},
    classes::DropClassState,
    lattice::LatticeCell,
    shutter_state::ShutterState,
};
use crate::lanes::{LaneArray, Vec3Lanes, ZERO_LANES};

const COUNT: Purpose = Purpose::named("rain drops of a cell");
const DROP: Purpose = Purpose::named("rain drop");
/// Range of the drop count over which a drop fades in, as a fraction of all drops, so that a rising rate does not pop.
pub(crate) const FADE_IN: f64 = 0.02;

/// Sixteen drops of one diameter at the middle of the exposure.
pub(crate) struct DropBatch {
    /// Positions relative to the camera, m.
    pub(crate) positions: Vec3Lanes,
    /// m/s.
    pub(crate) velocities: Vec3Lanes,
    /// Offsets, x and z, when the shutter opens and when it closes, from where these velocities would take the drops, m; `None` for uniform motion.
    pub(crate) bends: Option<[[LaneArray; 2]; 2]>,
    /// mm.
    pub(crate) diameter_mm: f32,
    /// Factor of the physical opacity.
    pub(crate) opacity_factor: f32,
    /// Fade-in weight, 0 to 1; 0 in unused lanes.
    pub(crate) presence: LaneArray,
}

/// The drops of one diameter in one cell.
pub(crate) struct CellDrops {
    key: Key,
    /// The random stream of its drops.
    purpose: Purpose,
    /// Random contents of the cell.
    contents: u64,
    count: usize,
    state: CellState,
    /// Fraction of the drops that exist now; below it drops fade in.
    rising: f32,
    diameter_mm: f32,
    opacity_factor: f32,
}

impl CellDrops {
    #[inline(always)]
    pub(crate) fn new(shutter_state: &ShutterState, class: &DropClassState, cell: LatticeCell) -> Self {
        let key = shutter_state.key;
        let contents = class.lattice.contents(cell);
        let words = key.words(contents, 0, class.purpose(COUNT));
        Self {
            key,
            purpose: class.purpose(DROP),
            contents,
            // Of the largest density, not the current one: when the rate changes, drops fade in and out where they are, instead of changing places.
            count: random::poisson(class.max_density * class.lattice.volume(), [words[0], words[1]]) as usize,
            state: shutter_state.cell_state(class, cell),
            rising: ((1.0 + FADE_IN) * class.fraction) as f32,
            diameter_mm: class.diameter_mm as f32,
            opacity_factor: shutter_state.opacity_factor(class.diameter_mm, class.speed) as f32,
        }
    }

    /// Number of drops, those included that do not exist at the current rate.
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// The drops from index `first` on.
    #[inline(always)]
    pub(crate) fn batch(&self, first: usize) -> DropBatch {
        let [x, y, z, threshold] = self.key.uniforms_of_steps(self.contents, first as u32, self.purpose);
        let mut presence = ZERO_LANES;
        for i in 0..LANES {
            // The threshold belongs to the drop for its life, so that a rising rate only adds drops.
            let risen = ((self.rising - threshold[i]) * (1.0 / FADE_IN) as f32).simd_clamp01();
            presence[i] = if first + i < self.count { risen } else { 0.0 };
        }
        let DropStates { positions, velocities, bends } = self.state.drop_states(&[x, y, z]);
        let (diameter_mm, opacity_factor) = (self.diameter_mm, self.opacity_factor);
        DropBatch { positions, velocities, bends, diameter_mm, opacity_factor, presence }
    }
}
