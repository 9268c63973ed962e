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
    /// By sheet; evenly spaced over its length, one at each end.
    nodes: Vec<Vec<f64>>,
}

impl LineCharge {
    /// The same charge everywhere, at nodes about `spacing` km apart.
    pub(super) fn even(course: &Course, spacing: f64) -> Self {
        let node_count = |length: f64| (length / spacing).ceil().max(1.0) as usize + 1;
        Self { nodes: course.sheet_lengths().into_iter().map(|length| vec![1.0; node_count(length)]).collect() }
    }

    /// Charge of a particle.
    pub(super) fn of(&self, particle: &Scattered) -> f64 {
        let nodes = &self.nodes[particle.sheet as usize];
        let (node, part) = split(f64::from(particle.share), nodes.len());
        nodes[node] + part * (nodes[node + 1] - nodes[node])
    }

    /// Changes it where the potential that it makes is not the one that is wanted; negative both.
    pub(super) fn adjust(&mut self, course: &Course, potential: &Grid2, wanted: f64) {
        for (sheet, nodes) in self.nodes.iter_mut().enumerate() {
            let last = (nodes.len() - 1) as f64;
            for (number, charge) in nodes.iter_mut().enumerate() {
                let found = potential.sample(course.place(sheet, number as f64 / last).to_array());
                let change = if found < 0.0 { wanted / found } else { CHANGE[1] };
                *charge = (*charge * change.clamp(CHANGE[0], CHANGE[1])).clamp(CHARGE[0], CHARGE[1]);
            }
        }
    }
}
