//! Charge that lies on the sheets as on conductors.

use super::{course::Course, nodes::split, scatter::Scattered};
use crate::field::Grid2;

/// How much a node changes at a time, and how little and how much charge it has at most beside one of a long, straight, lone sheet.
const CHANGE: [f64; 2] = [0.5, 2.0];
const CHARGE: [f64; 2] = [0.1, 4.0];

/// Charge of a scattered particle by its place along the sheets, linear between nodes, 1 on a long, straight, lone sheet.
///
/// With the same charge everywhere the potential would rise by half toward the ends of sheets, and fall where they wind up or lie close
/// together: all particles would gather there. Here it is the same along all sheets.
#[derive(Clone, Debug)]
pub(super) struct LineCharge {
    /// One sheet's after those of another; evenly spaced over its length, one at each end.
    nodes: Vec<f64>,
    /// Where each sheet's begin, and the end of all.
    starts: Vec<usize>,
}

/// Where a particle is among the nodes: the one before it, and the part of the way to the next.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    node: u32,
    part: f32,
}

impl LineCharge {
    /// The same charge everywhere, at nodes about `spacing` km apart.
    pub(super) fn even(course: &Course, spacing: f64) -> Self {
        let mut starts = vec![0];
        for length in course.sheet_lengths() {
            let count = (length / spacing).ceil().max(1.0) as usize + 1;
            starts.push(starts[starts.len() - 1] + count);
        }
        Self { nodes: vec![1.0; starts[starts.len() - 1]], starts }
    }

    /// Where a particle is.
    pub(super) fn place(&self, particle: &Scattered) -> Place {
        let sheet = particle.sheet as usize;
        let (first, end) = (self.starts[sheet], self.starts[sheet + 1]);
        let (node, part) = split(f64::from(particle.share), end - first);
        Place { node: (first + node) as u32, part: part as f32 }
    }

    /// Charge of a particle that is there.
    pub(super) fn at(&self, place: Place) -> f64 {
        let [before, after] = [0, 1].map(|next| self.nodes[place.node as usize + next]);
        before + f64::from(place.part) * (after - before)
    }

    /// Changes it where the potential that it makes is not the one that is wanted; negative both.
    pub(super) fn adjust(&mut self, course: &Course, potential: &Grid2, wanted: f64) {
        for (sheet, ends) in self.starts.windows(2).enumerate() {
            let nodes = &mut self.nodes[ends[0]..ends[1]];
            let last = (nodes.len() - 1) as f64;
            for (number, charge) in nodes.iter_mut().enumerate() {
                let found = potential.sample(course.place(sheet, number as f64 / last).to_array());
                let change = if found < 0.0 { wanted / found } else { CHANGE[1] };
                *charge = (*charge * change.clamp(CHANGE[0], CHANGE[1])).clamp(CHARGE[0], CHARGE[1]);
            }
        }
    }
}
