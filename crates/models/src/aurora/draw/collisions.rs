//! The picture of single collisions, as in the thesis (2.4): every source sends random falls down its field line.
//!
//! Heights and places along the line of sight are random; to the side each point has the smooth edge of its source, so
//! that rays are as sharp as those of the mean. That mean is [`Meridians`], but for the noise.

use std::ops::Range;

use bansho_base::random::{Key, Purpose, uniform, uniform_f64};
use fearless_simd::{Level, Simd, dispatch, prelude::*};
use rayon::prelude::*;

use super::{
    DrawingParameters, FallModel,
    chart::{Chart, Finder, STRIP},
    descent::{Descents, LineOfFall},
    footprint::{Entry, Footprint, Patch, Source},
    geometry::FieldLines,
    meridians::{LightStrip, Meridians},
};
use crate::{
    aurora::{
        atmosphere::{LEVELS, atmosphere},
        light::{
            EMITTERS, Emission, Emitter, PerEmitter,
            collisions::{draw_hard_sphere_emitter, hard_sphere_photons},
        },
        precipitation::{
            Deposition,
            energy::{NODES, node_energy_ev},
            fall::{Collision, FallLibrary, Falls, VARIANTS, collision_count},
            hard_sphere::{DEFAULT_RADIUS, HardSphere},
        },
    },
    lanes::{FourLanes, HalfLanes, LANES, Lanes, Real, nearest_whole, ramp},
};

const SOURCE: Purpose = Purpose::named("aurora collisions");
const EMITTER_DRAW: Purpose = Purpose::named("aurora collision emitter");
/// Random deviations, a multiple of [`BATCH`].
const DEVIATIONS: usize = 4096;
/// Collisions that are worked on at once.
const BATCH: usize = LANES;
/// What shines after a collision: the mean of a level, or nothing, or a single emitter.
const NOTHING: u16 = LEVELS as u16;
const EMITTER: u16 = NOTHING + 1;
/// Strips that a thread draws at once: the wider they are together, the fewer sources are placed twice.
const GROUP: usize = 4;
/// Nearer to the observer's own field line than so many reaches, points are placed anew for every column; and nearer
/// than so many, each by its own root and divisions.
const NEAR: f32 = 4.0;
const SINGLE: f32 = 16.0;

/// What falls are drawn from.
#[derive(Clone, Debug)]
pub(super) struct Collisions {
    key: Key,
    falls: FallTable,
    deposition: Deposition,
    /// Counting photons for each ion pair by source.
    photons: Vec<PerEmitter<f32>>,
    descents: Descents,
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
    /// Places among the altitudes, [`Descents::place`].
    places: [f32; BATCH],
    altitudes_km: [f32; BATCH],
    offsets_km: [f32; BATCH],
    /// Places among the photons.
    lights: [u16; BATCH],
}

impl FallTable {
    /// Falls of so many nodes of the grid of energies, and where the light of each collision stands among the photons.
    fn new(nodes: usize, fall: impl Fn(usize, u32) -> Vec<(Collision, u16)> + Sync) -> Self {
        let of_node = |node: usize| -> Vec<FallBatch> {
            let count = (collision_count(node) as usize).div_ceil(BATCH);
            let batches = |fall: Vec<_>| (0..count).map(move |first| FallBatch::new(&fall, first, count));
            (0..VARIANTS).flat_map(|variant| batches(fall(node, variant))).collect()
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
    fn highest(&self) -> usize {
        self.starts.len() - 2
    }

    /// One of the falls of a node up to the highest, any number.
    fn fall(&self, node: usize, variant: u32) -> &[FallBatch] {
        let (start, end) = (self.starts[node], self.starts[node + 1]);
        let count = (end - start) / VARIANTS as usize;
        &self.batches[start + (variant % VARIANTS) as usize * count..][..count]
    }
}

impl FallBatch {
    /// Every `stride`th collision of a fall from `first` on.
    fn new(fall: &[(Collision, u16)], first: usize, stride: usize) -> Self {
        let (altitudes_km, lights) = ([100.0; BATCH], [NOTHING; BATCH]);
        let mut batch = Self { places: [0.0; BATCH], altitudes_km, offsets_km: [0.0; BATCH], lights };
        for (lane, (collision, light)) in fall.iter().skip(first).step_by(stride).enumerate() {
            batch.places[lane] = Descents::place(collision.altitude_km);
            batch.altitudes_km[lane] = collision.altitude_km;
            batch.offsets_km[lane] = collision.offset_km[0];
            batch.lights[lane] = *light;
        }
        batch
    }
}

impl Collisions {
    /// Falls of electrons of all energies up to that of a node.
    pub(super) fn new(emission: &Emission, drawing: &DrawingParameters, highest: usize, key: Key) -> Self {
        let deviation = |index: usize| {
            // The sum of three uniforms nearly has that density; its variance is made the same, 1/7.
            let [a, b, c, _] = key.uniforms(index as u64, 1, SOURCE);
            (a + b + c - 1.5) * (4.0_f32 / 7.0).sqrt()
        };
        let highest = highest.min(NODES - 1);
        let levels = emission.photons_per_ion_pair().iter().copied();
        let photons = levels.chain([[0.0; 4]]).chain(EMITTERS.map(single_photons));
        let falls = match drawing.fall {
            FallModel::Fang => measured_falls(&Falls::new(emission.deposition(), drawing.wobble), highest, key),
            FallModel::HardSphere => hard_sphere_falls(drawing.wobble, highest, key),
        };
        Self {
            key,
            falls,
            deposition: emission.deposition().clone(),
            photons: photons.map(|photons| photons.map(|value| value as f32)).collect(),
            descents: Descents::new(),
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
        strips.chunks(GROUP).for_each_init(
            || Trace::new(chart.rows),
            |trace, strips| dispatch!(level, simd => drawing.strips(simd, strips, field, trace)),
        );
        picture
    }

    /// The fall of a source.
    fn fall(&self, index: u32, source: &Source, step: u32) -> Fall<'_> {
        let [a, b, c, d] = self.key.words(u64::from(index), step, SOURCE);
        let below = (source.node as usize).min(NODES - 2);
        let about = below + usize::from(uniform(a) < source.node - below as f32);
        // What is beyond the falls is drawn as the hardest of them: their number of collisions and the light of each belong together.
        let node = self.deposition.draw_node_about(about, uniform_f64(b, d)).min(self.falls.highest());
        Fall { batches: self.falls.fall(node, c), pairs: self.pairs[node], first: (c >> 8) as usize / BATCH * BATCH }
    }
}

/// Falls whose mean is the deposition; each collision gives the mean light of its level.
fn measured_falls(falls: &Falls, highest: usize, key: Key) -> FallTable {
    let library = FallLibrary::new(falls, 0..=highest, key);
    let light = |collision: &Collision| (*collision, collision.level as u16);
    FallTable::new(highest + 1, |node, variant| library.fall(node, variant).iter().map(light).collect())
}

/// Falls through hard spheres; each collision gives the light of one emitter, or none.
fn hard_sphere_falls(wobble: f64, highest: usize, key: Key) -> FallTable {
    let air = atmosphere();
    let spheres = HardSphere::new(air, DEFAULT_RADIUS, wobble);
    FallTable::new(highest + 1, |node, variant| {
        let particle = (node as u64) << 32 | u64::from(variant);
        let light = |(number, collision): (usize, Collision)| {
            let [a, b, c, _] = key.uniforms(particle, number as u32, EMITTER_DRAW).map(f64::from);
            let emitter = draw_hard_sphere_emitter(&air.levels()[collision.level as usize], [a, b, c]);
            (collision, emitter.map_or(NOTHING, |emitter| EMITTER + emitter.index() as u16))
        };
        spheres.fall(node_energy_ev(node), key, particle).enumerate().map(light).collect()
    })
}

/// The light of one emitter alone.
fn single_photons(emitter: Emitter) -> PerEmitter<f64> {
    let mut photons = [0.0; 4];
    photons[emitter.index()] = hard_sphere_photons(emitter);
    photons
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

/// Photons of the collisions of one fall by row of the chart, and beyond them rows for points that are outside.
struct Trace {
    light: Vec<PerEmitter<f32>>,
    /// Rows that may hold some.
    lit: Range<usize>,
}

impl Trace {
    fn new(rows: usize) -> Self {
        Self { light: vec![[0.0; 4]; rows + 2 * BATCH], lit: 0..0 }
    }

    #[inline(always)]
    fn clear(&mut self) {
        self.light[self.lit.clone()].fill([0.0; 4]);
        self.lit = 0..0;
    }

    /// Adds the light of points.
    #[inline(always)]
    fn add<S: Simd>(&mut self, simd: S, points: &Points, lights: &[u16; BATCH], photons: &[PerEmitter<f32>]) {
        let trace = self.light.as_mut_slice();
        for lane in 0..BATCH {
            let (row, light) = (points.rows[lane] as usize, lights[lane] as usize);
            let (Some(both), Some(photons)) = (trace.get_mut(row..row + 2), photons.get(light)) else { continue };
            let (both, photons) = (both.as_flattened_mut(), FourLanes::simd_from(simd, *photons));
            let weights =
                FourLanes::splat(simd, points.upper[lane]).combine(FourLanes::splat(simd, points.lower[lane]));
            photons.combine(photons).fused(weights, HalfLanes::from_slice(simd, both)).store_slice(both);
        }
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

/// Rows of a batch of collisions, and the weights there and in the row below. Those outside have no weight and a row
/// each below the chart, for sums in one row would wait for each other.
struct Points {
    rows: [u32; BATCH],
    upper: [f32; BATCH],
    lower: [f32; BATCH],
}

/// The least and the greatest row of each lane.
struct Lit<S: Simd> {
    least: Lanes<S>,
    greatest: Lanes<S>,
}

impl<S: Simd> Lit<S> {
    #[inline(always)]
    fn new(simd: S) -> Self {
        Self { least: Lanes::splat(simd, f32::INFINITY), greatest: Lanes::splat(simd, -1.0) }
    }

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
    /// Points at rows above `last`, or outside.
    #[inline(always)]
    fn new<S: Simd>(rows: Lanes<S>, shown: Lanes<S>, last: f32, lit: &mut Lit<S>) -> Self {
        let (zero, end, outside) = (rows.like(0.0), rows.like(last), ramp(rows.simd, last + 1.0, 2.0));
        let whole = rows.floor();
        let (least, greatest) = (rows.like(f32::INFINITY), rows.like(-1.0));
        lit.least = lit.least.least(inside(rows, end, [whole, least]));
        lit.greatest = lit.greatest.greatest(inside(rows, end, [whole, greatest]));
        let weights = inside(rows, end, [shown, zero]);
        let lower = weights * (rows - whole);
        let mut points = Self { rows: [0; BATCH], upper: [0.0; BATCH], lower: [0.0; BATCH] };
        nearest_whole(inside(rows, end, [whole, outside])).store_slice(&mut points.rows);
        (weights - lower).store_slice(&mut points.upper);
        lower.store_slice(&mut points.lower);
        points
    }
}

/// The first where rows lie from 0 to `end`, the second elsewhere.
#[inline(always)]
fn inside<S: Simd>(rows: Lanes<S>, end: Lanes<S>, [within, without]: [Lanes<S>; 2]) -> Lanes<S> {
    rows.choose(rows.like(0.0), without, rows.choose(end, within, without))
}

/// A strip that is being drawn.
struct Columns<'a> {
    strip: LightStrip<'a>,
    meridians: [[f32; 3]; STRIP],
    units: [[f32; STRIP]; 2],
    /// What is still to be drawn, from the end on.
    entries: Vec<Entry>,
}

impl<'a> Columns<'a> {
    fn new(strip: LightStrip<'a>, drawing: &Drawing<'a>, field: &FieldLines) -> Self {
        let (chart, first) = (drawing.chart, strip.number * STRIP);
        let mut entries: Vec<Entry> = drawing.footprint.entries(strip.number).flatten().copied().collect();
        entries.reverse();
        Self {
            meridians: std::array::from_fn(|column| field.meridian(chart.unit(first + column)).single()),
            units: chart.single_units(strip.number),
            entries,
            strip,
        }
    }

    /// Number of the next source that shows.
    #[inline(always)]
    fn next_source(&self) -> Option<u32> {
        self.entries.last().map(|entry| entry.source)
    }

    /// The next source as the columns see it, and which of them; it is done then.
    #[inline(always)]
    fn take(&mut self, source: &Source, chart: &Chart) -> (Patch, Range<usize>) {
        let entry = self.entries.pop().unwrap_or_default();
        (Patch::new(source, chart, &self.units), entry.columns())
    }
}

impl Drawing<'_> {
    /// Draws strips beside each other, every source once for all of them.
    #[inline(always)]
    fn strips<S: Simd>(&self, simd: S, strips: Vec<LightStrip>, field: &FieldLines, trace: &mut Trace) {
        let mut strips: Vec<_> = strips.into_iter().map(|strip| Columns::new(strip, self, field)).collect();
        // Entries of every strip are sorted by source.
        while let Some(number) = strips.iter().filter_map(Columns::next_source).min() {
            let source = self.footprint.source(number);
            let fall = self.collisions.fall(number, source, self.step);
            let [green, red, prompt] = source.power;
            let powers = FourLanes::simd_from(simd, [green, red, prompt, prompt]);
            let weights = powers * (fall.pairs / self.chart.row_step as f32);
            // Seen from afar its meridian is that of all columns.
            let shared = source.distance() >= NEAR * source.reach;
            let mut placed = false;
            for strip in strips.iter_mut().filter(|strip| strip.next_source() == Some(number)) {
                let (patch, columns) = strip.take(source, self.chart);
                let middle = (columns.start + columns.end) / 2;
                for column in columns {
                    if !(shared && placed) {
                        let seen_by = if shared { middle } else { column };
                        trace.clear();
                        let line = LineOfFall::new(&strip.meridians[seen_by], patch.along[seen_by], &self.finder);
                        self.place(simd, &fall, source, &line, trace);
                        placed = true;
                    }
                    if patch.side[column] > 0.0 && !trace.lit.is_empty() {
                        let light = strip.strip.light_up(column, &trace.lit, self.chart.rows);
                        trace.add_to(light, weights * patch.side[column]);
                    }
                }
            }
        }
    }

    /// Places the collisions of a fall down a line.
    #[inline(always)]
    fn place<S: Simd>(&self, simd: S, fall: &Fall, source: &Source, line: &LineOfFall, trace: &mut Trace) {
        let reach = source.reach.max(self.footprint.bins().least_reach(line.distance));
        let descent = (line.distance >= SINGLE * reach).then(|| self.collisions.descents.along(simd, line));
        if descent.as_ref().is_some_and(|descent| !descent.shows(reach, self.chart.rows)) {
            return;
        }
        let last = (self.chart.rows - 1) as f32;
        let mut lit = Lit::new(simd);
        for (number, batch) in fall.batches.iter().enumerate() {
            let from = (fall.first + number * BATCH) % DEVIATIONS;
            let Some(deviations) = self.collisions.deviations.get(from..from + BATCH) else { continue };
            let offsets = Lanes::from_slice(simd, deviations)
                .fused(Lanes::splat(simd, reach), Lanes::from_slice(simd, &batch.offsets_km));
            let [rows, shown] = match &descent {
                Some(descent) => descent.points(Lanes::from_slice(simd, &batch.places), offsets),
                None => line.points(&batch.altitudes_km, offsets),
            };
            let points = Points::new(rows, shown, last, &mut lit);
            trace.add(simd, &points, &batch.lights, &self.collisions.photons);
        }
        trace.lit = lit.rows();
    }
}
