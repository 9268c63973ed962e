//! The picture of single collisions, as in the thesis (2.4): every source sends random falls down its field line.
//!
//! Heights and places along the line of sight are random; to the side each point has the smooth edge of its source, so that rays are as
//! sharp as those of the mean. That mean is [`Meridians`], but for the noise.

use std::ops::Range;

use bansho_base::{
    math::lanes,
    random::{Key, Purpose, uniform, uniform_f64},
};
use fearless_simd::{Level, Simd, dispatch, prelude::*};
use rayon::prelude::*;

use super::{
    chart::{Chart, Finder, STRIP},
    footprint::{Footprint, Patch, Source},
    geometry::{EARTH_RADIUS_KM, FieldLines, Meridian},
    meridians::{LightStrip, Meridians},
};
use crate::{
    aurora::{
        atmosphere::LEVELS,
        light::{Emission, PerEmitter},
        precipitation::{
            Deposition,
            energy::NODES,
            fall::{Collision, FallLibrary, Falls, VARIANTS},
        },
    },
    lanes::{FourLanes, Lanes, Real},
};

const SOURCE: Purpose = Purpose::named("aurora collisions");
/// Random deviations, a multiple of [`BATCH`].
const DEVIATIONS: usize = 4096;
/// Collisions that are worked on at once.
const BATCH: usize = 16;
/// Level of a collision that a batch lacks.
const NOTHING: u16 = LEVELS as u16;
/// Nearer to the observer's own field line than so many reaches, points are placed anew for every column.
const NEAR: f32 = 4.0;

/// What falls are drawn from.
#[derive(Clone, Debug)]
pub(super) struct Collisions {
    key: Key,
    falls: FallTable,
    deposition: Deposition,
    /// Counting photons for each ion pair, by level, and none for [`NOTHING`].
    photons: Vec<PerEmitter<f32>>,
    /// kR of ion pairs that a collision of a node's fall stands for, per mW/m^2.
    pairs: Vec<f32>,
    /// Deviations with the density of a source's edge, in reaches.
    deviations: Vec<f32>,
}

/// Falls of a library, their collisions in batches.
///
/// Neighbours in a batch lie far apart in altitude: sums in neighbouring rows would wait for each other.
#[derive(Clone, Debug)]
struct FallTable {
    /// Where the falls of each node begin, and the end of all, in batches.
    starts: Vec<usize>,
    batches: Vec<FallBatch>,
}

/// [`BATCH`] collisions of a fall.
#[derive(Clone, Debug)]
struct FallBatch {
    altitudes_km: [f32; BATCH],
    offsets_km: [f32; BATCH],
    levels: [u16; BATCH],
}

impl FallTable {
    fn new(library: &FallLibrary, nodes: usize) -> Self {
        let (mut starts, mut batches) = (vec![0], Vec::new());
        for node in 0..nodes {
            for variant in 0..VARIANTS {
                let fall = library.fall(node, variant);
                let count = fall.len().div_ceil(BATCH);
                batches.extend((0..count).map(|first| FallBatch::new(fall, first, count)));
            }
            starts.push(batches.len());
        }
        Self { starts, batches }
    }

    /// One of the falls of a node, any number; the nearest node that there is.
    fn fall(&self, node: usize, variant: u32) -> &[FallBatch] {
        let node = node.min(self.starts.len() - 2);
        let (start, end) = (self.starts[node], self.starts[node + 1]);
        let count = (end - start) / VARIANTS as usize;
        &self.batches[start + (variant % VARIANTS) as usize * count..][..count]
    }
}

impl FallBatch {
    /// Every `stride`th collision of a fall from `first` on.
    fn new(fall: &[Collision], first: usize, stride: usize) -> Self {
        let mut batch = Self { altitudes_km: [100.0; BATCH], offsets_km: [0.0; BATCH], levels: [NOTHING; BATCH] };
        for (lane, collision) in fall.iter().skip(first).step_by(stride).enumerate() {
            batch.altitudes_km[lane] = collision.altitude_km;
            batch.offsets_km[lane] = collision.offset_km[0];
            batch.levels[lane] = collision.level as u16;
        }
        batch
    }
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
        let highest = highest.min(NODES - 1);
        let photons = emission.photons_per_ion_pair().iter().map(|photons| photons.map(|value| value as f32));
        Self {
            key,
            falls: FallTable::new(&FallLibrary::new(&falls, 0..=highest, key), highest + 1),
            deposition: emission.deposition().clone(),
            photons: photons.chain([[0.0; 4]]).collect(),
            pairs: (0..NODES).map(|node| emission.ion_pairs_per_collision(node) as f32).collect(),
            deviations: (0..DEVIATIONS).map(deviation).collect(),
        }
    }

    /// The sources' picture at a step of the simulation: other steps have other falls.
    pub(super) fn draw(&self, chart: Chart, field: &FieldLines, footprint: &Footprint, step: u32) -> Meridians {
        let level = Level::new();
        let mut picture = Meridians::dark(chart);
        let (chart, strips) = picture.strips();
        let drawing = Drawing { collisions: self, chart, finder: chart.finder(), footprint, step };
        strips.for_each_init(
            || Trace::new(chart.rows),
            |trace, strip| dispatch!(level, simd => drawing.strip(simd, strip, field, trace)),
        );
        picture
    }

    /// The fall of a source.
    fn fall(&self, index: u32, source: &Source, step: u32) -> Fall<'_> {
        let [a, b, c, d] = self.key.words(u64::from(index), step, SOURCE);
        let below = (source.node as usize).min(NODES - 2);
        let about = below + usize::from(uniform(a) < source.node - below as f32);
        let node = self.deposition.draw_node_about(about, uniform_f64(b, d));
        Fall { batches: self.falls.fall(node, c), pairs: self.pairs[node], first: (c >> 8) as usize / BATCH * BATCH }
    }
}

/// The random fall of a source.
struct Fall<'a> {
    batches: &'a [FallBatch],
    /// kR of ion pairs that a collision stands for, per mW/m^2.
    pairs: f32,
    /// Where its deviations begin.
    first: usize,
}

/// What the points of a strip have in common.
struct Drawing<'a> {
    collisions: &'a Collisions,
    chart: &'a Chart,
    finder: Finder,
    footprint: &'a Footprint<'a>,
    step: u32,
}

/// Photons of the collisions of one fall by row of the chart.
struct Trace {
    light: Vec<PerEmitter<f32>>,
    /// Rows that may hold some.
    lit: Range<usize>,
}

impl Trace {
    fn new(rows: usize) -> Self {
        Self { light: vec![[0.0; 4]; rows + 1], lit: 0..0 }
    }

    #[inline(always)]
    fn clear(&mut self) {
        self.light[self.lit.clone()].fill([0.0; 4]);
        self.lit = 0..0;
    }

    /// Adds photons to a row and the one below it.
    #[inline(always)]
    fn add<S: Simd>(&mut self, simd: S, row: usize, [upper, lower]: [f32; 2], photons: &PerEmitter<f32>) {
        let photons = FourLanes::simd_from(simd, *photons);
        let [above, below] = &mut self.light[row..row + 2] else { return };
        *above = photons.fused(photons.like(upper), FourLanes::simd_from(simd, *above)).into();
        *below = photons.fused(photons.like(lower), FourLanes::simd_from(simd, *below)).into();
    }

    /// Adds it with weights to a column.
    #[inline(always)]
    fn add_to<S: Simd>(&self, light: &mut [PerEmitter<f32>], weights: FourLanes<S>) {
        let simd = weights.simd;
        let (light, light_rest) = light[self.lit.clone()].as_chunks_mut::<4>();
        let (own, own_rest) = self.light[self.lit.clone()].as_chunks::<4>();
        let two = weights.combine(weights);
        let four = two.combine(two);
        for (light, own) in light.iter_mut().zip(own) {
            let (light, own) = (light.as_flattened_mut(), own.as_flattened());
            Lanes::from_slice(simd, own).fused(four, Lanes::from_slice(simd, light)).store_slice(light);
        }
        for (light, own) in light_rest.iter_mut().zip(own_rest) {
            *light = FourLanes::simd_from(simd, *own).fused(weights, FourLanes::simd_from(simd, *light)).into();
        }
    }
}

/// Rows of a batch of collisions, and the weights there and in the row below; nothing in row 0 where one is outside.
struct Points {
    rows: [u32; BATCH],
    upper: [f32; BATCH],
    lower: [f32; BATCH],
}

/// The least and the greatest row of each lane.
struct Lit {
    least: [f32; BATCH],
    greatest: [f32; BATCH],
}

impl Default for Lit {
    fn default() -> Self {
        Self { least: [f32::INFINITY; BATCH], greatest: [-1.0; BATCH] }
    }
}

impl Lit {
    /// All rows that hold something.
    #[inline(always)]
    fn rows(&self) -> Range<usize> {
        let (mut least, mut greatest) = (f32::INFINITY, -1.0_f32);
        for lane in 0..BATCH {
            least = least.min(self.least[lane]);
            greatest = greatest.max(self.greatest[lane]);
        }
        if greatest < least { 0..0 } else { least as usize..greatest as usize + 2 }
    }
}

impl Points {
    #[inline(always)]
    fn new(rows: &[f32; BATCH], shown: &[f32; BATCH], last: f32, lit: &mut Lit) -> Self {
        /// Added to a whole number below it, this leaves the number in the lowest bits.
        const SHIFT: f32 = 8_388_608.0;
        let mut points = Self { rows: [0; BATCH], upper: [0.0; BATCH], lower: [0.0; BATCH] };
        for lane in 0..BATCH {
            let row = rows[lane];
            let inside = row >= 0.0 && row < last;
            let held = if inside { row } else { 0.0 };
            let whole = held.floor();
            let weight = if inside { shown[lane] } else { 0.0 };
            points.rows[lane] = (whole + SHIFT).to_bits() & 0x7f_ffff;
            points.lower[lane] = weight * (held - whole);
            points.upper[lane] = weight - points.lower[lane];
            let least = if inside { whole } else { f32::INFINITY };
            let greatest = if inside { whole } else { -1.0 };
            lit.least[lane] = if least < lit.least[lane] { least } else { lit.least[lane] };
            lit.greatest[lane] = if greatest > lit.greatest[lane] { greatest } else { lit.greatest[lane] };
        }
        points
    }
}

impl Drawing<'_> {
    #[inline(always)]
    fn strip<S: Simd>(&self, simd: S, mut strip: LightStrip, field: &FieldLines, trace: &mut Trace) {
        let units = self.chart.single_units(strip.number);
        let meridians: [Meridian; STRIP] =
            std::array::from_fn(|column| field.meridian(self.chart.unit(strip.number * STRIP + column)));
        for entry in self.footprint.entries(strip.number) {
            let source = self.footprint.source(entry);
            let fall = self.collisions.fall(entry.source, source, self.step);
            let patch = Patch::new(source, self.chart, &units);
            let [green, red, prompt] = source.power;
            let scale = fall.pairs / self.chart.row_step as f32;
            let columns = entry.columns();
            // Seen from afar its meridian is that of all columns.
            let shared = source.distance() >= NEAR * source.reach;
            let middle = (columns.start + columns.end) / 2;
            for column in columns.clone() {
                if !shared || column == columns.start {
                    let placed = if shared { middle } else { column };
                    trace.clear();
                    self.place(simd, &fall, source, &meridians[placed], patch.along[placed], trace);
                }
                let side = patch.side[column] * scale;
                if side > 0.0 && !trace.lit.is_empty() {
                    let weights = FourLanes::simd_from(simd, [green, red, prompt, prompt]) * side;
                    let light = strip.light_up(column, &trace.lit, self.chart.rows);
                    trace.add_to(light, weights);
                }
            }
        }
    }

    /// Places the collisions of a fall at a distance along a meridian.
    #[inline(always)]
    fn place<S: Simd>(
        &self,
        simd: S,
        fall: &Fall,
        source: &Source,
        meridian: &Meridian,
        along: f32,
        trace: &mut Trace,
    ) {
        let reach = source.reach.max(self.footprint.bins().least_reach(along));
        let meridian = meridian.single();
        let last = (self.chart.rows - 1) as f32;
        let mut lit = Lit::default();
        for (number, batch) in fall.batches.iter().enumerate() {
            let from = (fall.first + number * BATCH) % DEVIATIONS;
            let Some(deviations) = self.collisions.deviations[from..].first_chunk() else { continue };
            let (rows, shown) = self.project(batch, deviations, reach, along, &meridian);
            let points = Points::new(&rows, &shown, last, &mut lit);
            for lane in 0..BATCH {
                let photons = &self.collisions.photons[batch.levels[lane] as usize];
                trace.add(simd, points.rows[lane] as usize, [points.upper[lane], points.lower[lane]], photons);
            }
        }
        trace.lit = lit.rows();
    }

    /// The rows of collisions, and how bright they are seen.
    #[inline(always)]
    fn project(
        &self,
        batch: &FallBatch,
        deviations: &[f32; BATCH],
        reach: f32,
        along: f32,
        &[constant, outward, own]: &[f32; 3],
    ) -> ([f32; BATCH], [f32; BATCH]) {
        const RADIUS: f32 = EARTH_RADIUS_KM as f32;
        const DIAMETER: f32 = 2.0 * RADIUS;
        let (mut rows, mut shown) = ([0.0; BATCH], [0.0; BATCH]);
        for lane in 0..BATCH {
            let altitude = batch.altitudes_km[lane];
            let distance = deviations[lane].mul_add(reach, along) + batch.offsets_km[lane];
            let squared = altitude.mul_add(DIAMETER + altitude, -distance.mul_add(2.0 * outward + distance, constant));
            let squared = own.mul_add(own, squared);
            let upward = if squared > 1.0 { squared } else { 1.0 }.sqrt();
            let place = upward - own;
            let far = distance.mul_add(distance, place * place).sqrt();
            // A source's power is that across the field; a collision stands for all of it, so the cosine to the vertical is taken out again.
            let slant = (RADIUS + altitude) / (upward * far);
            shown[lane] = if distance > 0.0 && far > 1.0 { slant } else { 0.0 };
            rows[lane] = self.finder.row(lanes::atan2(distance, place)) - 0.5;
        }
        (rows, shown)
    }
}
