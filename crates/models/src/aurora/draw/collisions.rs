//! The picture of single collisions, as in the thesis (2.4): every source sends random falls down its field line.
//!
//! Heights and places along the line of sight are random; to the side each point has the smooth edge of its source, so that rays are as
//! sharp as those of the mean. That mean is [`Meridians`], but for the noise.

use bansho_base::{
    math::lanes,
    random::{Key, Purpose, uniform, uniform_f64},
};
use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use super::{
    chart::{Chart, Finder, STRIP},
    footprint::{Bins, Footprint, Patch, Source},
    geometry::{EARTH_RADIUS_KM, FieldLines, Meridian},
    meridians::Meridians,
};
use crate::aurora::{
    light::{Emission, PerEmitter},
    precipitation::{
        Deposition,
        energy::{NODES, node_energy_ev},
        fall::{Collision, FallLibrary, Falls},
    },
};

const SOURCE: Purpose = Purpose::named("aurora collisions");
/// Random deviations, a power of two.
const DEVIATIONS: usize = 4096;
/// Nearer to the observer's own field line than so many reaches, points are placed anew for every column.
const NEAR: f32 = 4.0;

/// What falls are drawn from.
#[derive(Clone, Debug)]
pub(super) struct Collisions {
    key: Key,
    library: FallLibrary,
    deposition: Deposition,
    /// Counting photons for each ion pair, by level.
    photons: Vec<PerEmitter<f32>>,
    /// kR of ion pairs that a collision of a node's fall stands for, per mW/m^2.
    pairs: Vec<f32>,
    /// Deviations with the density of a source's edge, in reaches.
    deviations: Vec<f32>,
}

impl Collisions {
    /// Falls of electrons of all energies up to that of a node.
    pub(super) fn new(emission: &Emission, wobble: f64, highest: usize, key: Key) -> Self {
        let falls = Falls::new(emission.deposition(), wobble);
        let deviation = |index: usize| {
            // The sum of three uniforms nearly has that density; its variance is made the same, 1/7.
            let [a, b, c, _] = key.uniforms(index as u64, 1, SOURCE);
            (a + b + c - 1.5) * (4.0_f32 / 7.0).sqrt()
        };
        Self {
            key,
            library: FallLibrary::new(&falls, 0..=highest.min(NODES - 1), key),
            deposition: emission.deposition().clone(),
            photons: emission.photons_per_ion_pair().iter().map(|photons| photons.map(|value| value as f32)).collect(),
            pairs: (0..NODES).map(|node| emission.ion_pairs_per_collision(node) as f32).collect(),
            deviations: (0..DEVIATIONS).map(deviation).collect(),
        }
    }

    /// The sources' picture at a step of the simulation: other steps have other falls.
    pub(super) fn draw(&self, chart: Chart, field: &FieldLines, footprint: &Footprint, step: u32) -> Meridians {
        let level = Level::new();
        let mut light = vec![[0.0; 4]; chart.columns * chart.rows];
        light.par_chunks_mut(STRIP * chart.rows).enumerate().for_each_init(Vec::new, |points, (strip, light)| {
            let drawing = Drawing { collisions: self, chart: &chart, finder: chart.finder(), footprint, step };
            dispatch!(level, _simd => drawing.strip(strip, field, points, light));
        });
        Meridians { chart, light }
    }

    /// The fall of a source, and what its collisions are worth.
    fn fall(&self, index: u32, source: &Source, step: u32) -> (&[Collision], f32, usize) {
        let [a, b, c, d] = self.key.words(u64::from(index), step, SOURCE);
        let node = (source.node as usize).min(NODES - 1);
        let energy_ev = node_energy_ev(node) * f64::from(lanes::exp2((source.node - node as f32) * NODE_OCTAVES));
        let node = self.deposition.draw_node(energy_ev, [f64::from(uniform(a)), uniform_f64(b, d)]);
        (self.library.fall(node, c), self.pairs[node], (c >> 8) as usize)
    }
}

/// Octaves of energy from node to node.
const NODE_OCTAVES: f32 = std::f32::consts::LOG2_10 / 32.0;

/// What the points of a strip have in common.
struct Drawing<'a> {
    collisions: &'a Collisions,
    chart: &'a Chart,
    finder: Finder,
    footprint: &'a Footprint<'a>,
    step: u32,
}

/// A collision on the chart.
#[derive(Clone, Copy)]
pub(super) struct Point {
    row: f32,
    light: PerEmitter<f32>,
}

/// The random fall of a source.
struct Fall<'a> {
    source: &'a Source,
    collisions: &'a [Collision],
    pairs: f32,
    /// Where its deviations begin.
    first: usize,
}

impl Drawing<'_> {
    #[inline(always)]
    fn strip(&self, strip: usize, field: &FieldLines, points: &mut Vec<Point>, light: &mut [PerEmitter<f32>]) {
        let units: [[f64; 2]; STRIP] = std::array::from_fn(|column| self.chart.unit(strip * STRIP + column));
        let single = units.map(|unit| unit.map(|value| value as f32));
        let meridians = units.map(|unit| field.meridian(unit));
        self.footprint.for_each(strip, self.chart, |index, source, columns| {
            let (collisions, pairs, first) = self.collisions.fall(index, source, self.step);
            let fall = Fall { source, collisions, pairs, first };
            let patch = Patch::new(source, self.chart, self.footprint.bins());
            let near = patch.distance() < NEAR * source.reach;
            points.clear();
            for column in columns {
                let weight = patch.side(single[column]);
                if weight <= 0.0 {
                    continue;
                }
                if near || points.is_empty() {
                    points.clear();
                    self.place(&fall, &meridians[column], patch.along(single[column]), points);
                }
                self.add(points, weight, &mut light[column * self.chart.rows..][..self.chart.rows]);
            }
        });
    }

    /// Places the collisions of a fall at a distance along a meridian.
    #[inline(always)]
    fn place(&self, fall: &Fall, meridian: &Meridian, along: f32, points: &mut Vec<Point>) {
        const RADIUS: f32 = EARTH_RADIUS_KM as f32;
        const DIAMETER: f32 = 2.0 * RADIUS;
        let reach = fall.source.reach.max(Bins::least_reach(self.footprint.bins(), along));
        let [constant, outward, own] = meridian.single();
        let [green, red, prompt] = fall.source.power.map(|power| power * fall.pairs / self.chart.row_step as f32);
        for (number, collision) in fall.collisions.iter().enumerate() {
            let deviation = self.collisions.deviations[(fall.first + number) % DEVIATIONS];
            let distance = deviation.mul_add(reach, along) + collision.offset_km[0];
            let altitude = collision.altitude_km;
            let squared = altitude.mul_add(DIAMETER + altitude, -distance.mul_add(2.0 * outward + distance, constant));
            let upward = own.mul_add(own, squared).max(1.0).sqrt();
            let place = upward - own;
            let far = distance.mul_add(distance, place * place).sqrt();
            // A source's power is that across the field; a collision stands for all of it, so the cosine to the vertical is taken out again.
            let slant = (RADIUS + altitude) / upward;
            let shown = if distance > 0.0 && far > 1.0 { slant / far } else { 0.0 };
            let photons = &self.collisions.photons[collision.level as usize];
            let weights = [green, red, prompt, prompt];
            points.push(Point {
                row: self.finder.row(lanes::atan2(distance, place)) - 0.5,
                light: std::array::from_fn(|i| photons[i] * weights[i] * shown),
            });
        }
    }

    /// Adds points to a column, linearly to the two rows about them.
    #[inline(always)]
    fn add(&self, points: &[Point], weight: f32, light: &mut [PerEmitter<f32>]) {
        for point in points {
            let row = point.row.floor();
            let part = point.row - row;
            if row < 0.0 || row >= (light.len() - 1) as f32 {
                continue;
            }
            let row = row as usize;
            let (below, above) = (weight * part, weight * (1.0 - part));
            for i in 0..4 {
                light[row][i] = point.light[i].mul_add(above, light[row][i]);
                light[row + 1][i] = point.light[i].mul_add(below, light[row + 1][i]);
            }
        }
    }
}
