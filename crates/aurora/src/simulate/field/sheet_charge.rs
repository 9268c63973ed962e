//! Charge that lies on the sheets as on conductors.

use rayon::prelude::*;

use super::{Grid2, scatter::ScatteredParticle};
use crate::simulate::sheets::{nodes::split, refined_shape::RefinedShape};

/// How much a node changes at a time, and how little and how much charge it has at most beside one of a long, straight, lone sheet.
const CHANGE: [f64; 2] = [0.5, 2.0];
const CHARGE: [f64; 2] = [0.1, 4.0];

/// Most nodes of all sheets together for each particle.
const NODES_PER_PARTICLE: f64 = 0.05;
/// Nodes that a task of the thread pool changes, at least.
const TASK: usize = 256;
/// Most that charge is denser at one side of a sheet than in its middle, as a share of that.
const MOST_TILT: f64 = 0.9;

/// Charge of a scattered particle by its place along the sheets, linear between nodes, 1 on a long, straight, lone sheet.
///
/// With the same charge everywhere the potential would rise by half toward the ends of sheets, and fall where they wind up or lie close
/// together: all particles would gather there. Here it is the same along all sheets. And a sheet that bends, or has another on one side of it,
/// pulls toward that side, so that particles would come to rest beside the drawn line: charge gathers on the other side until both are at one
/// potential.
#[derive(Clone, Debug)]
pub(crate) struct SheetCharge {
    /// One sheet's after those of another; evenly spaced over its length, one at each end.
    nodes: Vec<f64>,
    /// How much denser it is at the one side (left of the way along) than in the middle, as a share of that, at the same places.
    tilts: Vec<f64>,
    /// Where each sheet's begin, and the end of all.
    starts: Vec<usize>,
}

/// Where a particle is among the nodes: the one before it, and the part of the way to the next.
#[derive(Clone, Copy, Debug)]
pub(super) struct SheetCoordinate {
    node: u32,
    fraction: f32,
    side: f32,
}

/// What charge shall come to.
#[derive(Clone, Copy, Debug)]
pub(super) struct ChargeTarget {
    /// Potential along the sheets, negative, km^2/s^2.
    pub(super) potential: f64,
    /// Charge density over eps of a lone sheet, 1/s^2, and half its thickness, km.
    pub(super) density: f64,
    pub(super) half_thickness: f64,
}

impl SheetCharge {
    /// The same charge everywhere, at nodes about `spacing` km apart, or more where so many particles do not show as much.
    pub(crate) fn even(refined: &RefinedShape, spacing: f64, particles: f64) -> Self {
        let lengths = refined.sheet_lengths();
        let spacing = spacing.max(lengths.iter().sum::<f64>() / (NODES_PER_PARTICLE * particles));
        let mut starts = vec![0];
        for length in lengths {
            let count = (length / spacing).ceil().max(1.0) as usize + 1;
            starts.push(starts[starts.len() - 1] + count);
        }
        let count = starts[starts.len() - 1];
        Self { nodes: vec![1.0; count], tilts: vec![0.0; count], starts }
    }

    /// How many nodes there are.
    #[cfg(test)]
    pub(crate) fn count(&self) -> usize {
        self.nodes.len()
    }

    /// Where a particle is.
    pub(super) fn coordinate(&self, particle: &ScatteredParticle) -> SheetCoordinate {
        let sheet = particle.sheet as usize;
        let (first, end) = (self.starts[sheet], self.starts[sheet + 1]);
        let (node, fraction) = split(f64::from(particle.arc_fraction), end - first);
        SheetCoordinate { node: (first + node) as u32, fraction: fraction as f32, side: particle.side }
    }

    /// Charge of a particle that is there.
    #[inline]
    pub(super) fn charge(&self, position: SheetCoordinate) -> f64 {
        let node = position.node as usize;
        let (before, after) = (self.nodes[node], self.nodes[node + 1]);
        let (tilt, next) = (self.tilts[node], self.tilts[node + 1]);
        let (fraction, side) = (f64::from(position.fraction), f64::from(position.side));
        (before + fraction * (after - before)) * (1.0 + (tilt + fraction * (next - tilt)) * side)
    }

    /// Changes it where the potential that it makes is not the one that is wanted, or not the same on both sides.
    pub(super) fn adjust_toward(&mut self, refined: &RefinedShape, potential: &Grid2, wanted: ChargeTarget) {
        let ChargeTarget { density, half_thickness, .. } = wanted;
        let starts = &self.starts;
        let adjust = |(index, (charge, tilt)): (usize, (&mut f64, &mut f64))| {
            let sheet = starts.partition_point(|start| *start <= index) - 1;
            let last = (starts[sheet + 1] - starts[sheet] - 1) as f64;
            let share = (index - starts[sheet]) as f64 / last;
            let position = refined.position(sheet, share);
            let found = potential.sample(position.to_array());
            let change = if found < 0.0 { wanted.potential / found } else { CHANGE[1] };
            *charge = (*charge * change.clamp(CHANGE[0], CHANGE[1])).clamp(CHARGE[0], CHARGE[1]);
            let way = refined.position(sheet, share + 0.5 / last) - refined.position(sheet, share - 0.5 / last);
            let across = way.perp().normalize_or_zero() * half_thickness;
            let rise =
                potential.sample((position + across).to_array()) - potential.sample((position - across).to_array());
            // Charge tilted by a makes the one edge lower than the other by 2/3 a density L^2.
            let change = 1.5 * rise / (density * *charge * half_thickness * half_thickness);
            *tilt = (*tilt + change).clamp(-MOST_TILT, MOST_TILT);
        };
        self.nodes.par_iter_mut().zip(&mut self.tilts).with_min_len(TASK).enumerate().for_each(adjust);
    }
}
