//! Charge on the sheets: scattered particles (thesis, 2.2.3) and their charge as on conductors.

use bansho_base::{
    host::parallel::prelude::*,
    math::{
        DVec2,
        random::{Key, Purpose, uniform},
    },
};

use super::Grid2;
use crate::simulate::sheets::{nodes::split, refined_shape::RefinedShape};

/// Limits of the change per iteration, and of the charge relative to a long, straight, isolated sheet.
const CHANGE: [f64; 2] = [0.5, 2.0];
const CHARGE: [f64; 2] = [0.1, 4.0];

/// Maximum nodes of all sheets per particle.
const NODES_PER_PARTICLE: f64 = 0.05;
/// Minimum nodes per task.
const TASK: usize = 256;
/// Maximum relative difference of the charge between a sheet's edge and its middle.
const MAX_TILT: f64 = 0.9;

/// Charge per scattered particle as a function of the position along the sheets, linear between nodes; 1 on a long,
/// straight, isolated sheet.
///
/// With uniform charge the potential would be half as deep at the ends of sheets and deeper where they wind up or are
/// close together, and particles would collect there. Here the potential is constant along all sheets, as on
/// conductors. Next to a bend or another sheet the charge is also tilted across the sheet until both edges have the
/// same potential; otherwise particles would rest beside the drawn line.
#[derive(Clone, Debug)]
pub(crate) struct SheetCharge {
    /// Uniformly spaced nodes with one at each end, sheet by sheet.
    nodes: Vec<f64>,
    /// Relative increase of the charge at the left edge over the middle, at the same nodes.
    tilts: Vec<f64>,
    /// Start of each sheet's nodes, and the total.
    starts: Vec<usize>,
}

/// Position of a particle among the nodes: the node before, the interpolation fraction, and the side.
#[derive(Clone, Copy, Debug)]
pub(super) struct SheetCoordinate {
    node: u32,
    fraction: f32,
    side: f32,
}

/// Target of the iteration.
#[derive(Clone, Copy, Debug)]
pub(super) struct ChargeTarget {
    /// Potential on the sheets, negative, km^2/s^2.
    pub(super) potential: f64,
    /// Charge density over eps of an isolated sheet, 1/s^2, and half its thickness, km.
    pub(super) density: f64,
    pub(super) half_thickness: f64,
}

impl SheetCharge {
    /// Uniform charge, with nodes about `spacing` km apart, or more if there are few particles.
    pub(crate) fn uniform(refined: &RefinedShape, spacing: f64, particles: f64) -> Self {
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

    /// Number of nodes.
    #[cfg(test)]
    pub(crate) fn count(&self) -> usize {
        self.nodes.len()
    }

    /// Coordinate of a particle.
    pub(super) fn coordinate(&self, particle: &ScatteredParticle) -> SheetCoordinate {
        let sheet = particle.sheet as usize;
        let (first, end) = (self.starts[sheet], self.starts[sheet + 1]);
        let (node, fraction) = split(f64::from(particle.arc_fraction), end - first);
        SheetCoordinate { node: (first + node) as u32, fraction: fraction as f32, side: particle.side }
    }

    /// Charge of a particle at a coordinate.
    #[inline]
    pub(super) fn charge(&self, position: SheetCoordinate) -> f64 {
        let node = position.node as usize;
        let (before, after) = (self.nodes[node], self.nodes[node + 1]);
        let (tilt, next) = (self.tilts[node], self.tilts[node + 1]);
        let (fraction, side) = (f64::from(position.fraction), f64::from(position.side));
        (before + fraction * (after - before)) * (1.0 + (tilt + fraction * (next - tilt)) * side)
    }

    /// Adjusts charge and tilt toward the target potential and equal potentials at both edges.
    pub(super) fn adjust_toward(&mut self, refined: &RefinedShape, potential: &Grid2, target: ChargeTarget) {
        let starts = &self.starts;
        let nodes = self.nodes.par_iter_mut().zip(&mut self.tilts).with_min_len(TASK).enumerate();
        nodes.for_each(|(index, (charge, tilt))| {
            let sheet = starts.partition_point(|start| *start <= index) - 1;
            let last = starts[sheet + 1] - starts[sheet] - 1;
            target.adjust_node(refined, potential, [sheet, index - starts[sheet], last], [charge, tilt]);
        });
    }
}

impl ChargeTarget {
    /// Adjusts charge and tilt of a node of a sheet: `[sheet, node, last]` are the indices of the sheet, the node and the
    /// sheet's last node.
    fn adjust_node(
        &self,
        refined: &RefinedShape,
        potential: &Grid2,
        [sheet, node, last]: [usize; 3],
        [charge, tilt]: [&mut f64; 2],
    ) {
        let Self { density, half_thickness, .. } = *self;
        let (fraction, half_step) = (node as f64 / last as f64, 0.5 / last as f64);
        let position = refined.position(sheet, fraction);
        let found = potential.sample(position.to_array());
        let change = if found < 0.0 { self.potential / found } else { CHANGE[1] };
        *charge = (*charge * change.clamp(CHANGE[0], CHANGE[1])).clamp(CHARGE[0], CHARGE[1]);
        let chord = refined.position(sheet, fraction + half_step) - refined.position(sheet, fraction - half_step);
        let across = chord.perp().normalize_or_zero() * half_thickness;
        let rise = potential.sample((position + across).to_array()) - potential.sample((position - across).to_array());
        // A tilt a of the charge lowers one edge relative to the other by 2/3 a density L^2.
        let change = 1.5 * rise / (density * *charge * half_thickness * half_thickness);
        *tilt = (*tilt + change).clamp(-MAX_TILT, MAX_TILT);
    }
}

const SCATTER: Purpose = Purpose::named("aurora scatter");

/// A particle that carries charge of a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ScatteredParticle {
    /// Position, km.
    pub(crate) position: DVec2,
    /// Index of the nearest sheet.
    pub(crate) sheet: u32,
    /// Position along that sheet as a fraction of its length.
    pub(crate) arc_fraction: f32,
    /// Lateral position, -1 to 1 within L_thr.
    pub(super) side: f32,
}

/// Scatters particles uniformly within `half_thickness` km of the shape, in `count` trials. Each `update_index` has other
/// random numbers.
///
/// Sampled along the segments, so the cost depends on the number of particles only. A position counts for its nearest
/// segment, so overlaps are not counted twice.
pub(crate) fn scatter(
    refined: &RefinedShape,
    half_thickness: f64,
    count: usize,
    key: Key,
    update_index: u32,
) -> Vec<ScatteredParticle> {
    let segments = refined.segments();
    let trials = (0..count).into_par_iter().with_min_len(1024);
    trials
        .filter_map(|index| {
            let [u, v, ..] = key.words(index as u64, update_index, SCATTER).map(|word| f64::from(uniform(word)));
            let sample = segments.sample((index as f64 + u) / count as f64)?;
            let side = 2.0 * v - 1.0;
            let position = sample.point + sample.tangent.perp() * (half_thickness * side);
            let segment = [sample.segment.sheet, sample.segment.segment];
            let scattered = ScatteredParticle {
                position,
                sheet: segment[0] as u32,
                arc_fraction: sample.fraction as f32,
                side: side as f32,
            };
            (refined.nearest_segment(position) == Some(segment)).then_some(scattered)
        })
        .collect()
}
