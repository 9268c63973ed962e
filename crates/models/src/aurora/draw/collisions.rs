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
    descent::{Descent, Descents, LineOfFall, altitudes_km},
    footprint::{Footprint, Patch, REACH, Source},
    geometry::FieldLines,
    group::{GROUP, Group},
    meridians::{LightStrip, Meridians},
    trace::{BATCH, Lit, Points, Trace},
    wander::wander_km,
};
use crate::{
    aurora::{
        atmosphere::{LEVELS, atmosphere},
        light::{Emission, PerEmitter},
        precipitation::{
            Deposition,
            energy::{NODES, node_energy_ev},
            evened::EvenedFalls,
            fall::{Collision, FallLibrary, Falls, VARIANTS, collision_count},
            hard_sphere::{DEFAULT_RADIUS, HardSphere},
        },
    },
    lanes::{FourLanes, Lanes, Real},
};

const SOURCE: Purpose = Purpose::named("aurora collisions");
/// Random deviations, a multiple of [`BATCH`].
const DEVIATIONS: usize = 4096;
/// What shines after a collision: the mean of a level, or nothing.
const NOTHING: u16 = LEVELS as u16;
/// Lanes from one collision of a full batch to the next below; odd, so that all are filled.
const APART: usize = 5;
/// Sources whose falls are looked up together: what is far away in memory is then waited for once.
const AHEAD: usize = 32;
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
    /// Squared reach by which the collisions of a node's falls wander, km^2.
    wander_squared: Vec<f32>,
    /// Deviations with the density of a source's edge, in reaches.
    deviations: Vec<f32>,
}

/// Falls of a library, their collisions in batches.
#[derive(Clone, Debug)]
struct FallTable {
    /// Where the falls of each node begin, and the end of all, in batches.
    starts: Vec<usize>,
    batches: Vec<FallBatch>,
}

/// [`BATCH`] collisions of a fall, or fewer in the last of them.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct FallBatch {
    /// Places among the altitudes, [`Descents::place`].
    places: [f32; BATCH],
    offsets_km: [f32; BATCH],
    /// Places among the photons.
    lights: [u16; BATCH],
    count: u32,
}

impl FallTable {
    /// Falls of so many nodes of the grid of energies, and where the light of each collision stands among the photons.
    fn new(nodes: usize, fall: impl Fn(usize, u32) -> Vec<(Collision, u16)> + Sync) -> Self {
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

/// The collisions of a fall in so many batches, all but the last of them full.
///
/// What the last one has and what each of the others has are evenly spread over the fall; in full ones, collisions of neighbouring lanes are
/// far apart, since sums in neighbouring rows would wait for each other.
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
        let photons = levels.chain([[0.0; 4]]);
        let (deposition, wobble) = (emission.deposition(), drawing.wobble);
        let mut pairs: Vec<_> = (0..NODES).map(|node| emission.ion_pairs_per_collision(node) as f32).collect();
        let falls = match drawing.fall {
            FallModel::Fang => measured_falls(&Falls::new(deposition, wobble), highest, key),
            FallModel::HardSphere => {
                let falls = hard_sphere_falls(deposition, wobble, highest, key);
                pairs.iter_mut().zip(&falls).for_each(|(pairs, falls)| *pairs *= falls.share);
                FallTable::new(highest + 1, |node, variant| falls[node].fall(variant).iter().map(with_light).collect())
            }
        };
        let wander = |node| REACH * wander_km(drawing.fall, wobble, node_energy_ev(node)) as f32;
        Self {
            key,
            falls,
            deposition: emission.deposition().clone(),
            photons: photons.map(|photons| photons.map(|value| value as f32)).collect(),
            descents: Descents::new(),
            pairs,
            wander_squared: (0..NODES).map(|node| wander(node) * wander(node)).collect(),
            deviations: (0..DEVIATIONS).map(deviation).collect(),
        }
    }

    /// The picture of sources that are sorted by [`GROUP`]s of columns, at a step of the simulation: other steps have other falls.
    pub(super) fn draw(&self, chart: Chart, field: &FieldLines, footprint: &Footprint, step: u32) -> Meridians {
        let level = Level::new();
        let mut picture = Meridians::dark(chart);
        let (chart, groups) = picture.strips(GROUP);
        let pass = CollisionPass { collisions: self, chart, finder: chart.finder(), footprint, step };
        groups.for_each_init(
            || (Group::new(chart), Trace::new(chart.rows)),
            |own, group| dispatch!(level, simd => pass.group(simd, group, field, own)),
        );
        picture
    }

    /// The fall of a source.
    #[inline(always)]
    fn fall(&self, source: Source, step: u32) -> Fall<'_> {
        let [a, b, c, d] = self.key.words(u64::from(source.key), step, SOURCE);
        let below = (source.node as usize).min(NODES - 2);
        let about = below + usize::from(uniform(a) < source.node - below as f32);
        // What is beyond the falls is drawn as the hardest of them: their number of collisions and the light of each belong together.
        let node = self.deposition.draw_node_about(about, uniform_f64(b, d)).min(self.falls.highest());
        let batches = self.falls.fall(node, c);
        Fall {
            source,
            batches,
            pairs: self.pairs[node],
            wander_squared: self.wander_squared[node],
            first: (c >> 8) as usize / BATCH * BATCH,
        }
    }
}

/// Falls after Fang et al. up to those of the highest node.
fn measured_falls(falls: &Falls, highest: usize, key: Key) -> FallTable {
    let library = FallLibrary::new(falls, 0..=highest, key);
    FallTable::new(highest + 1, |node, variant| library.fall(node, variant).iter().map(with_light).collect())
}

/// Falls through hard spheres for each node up to the highest.
fn hard_sphere_falls(deposition: &Deposition, wobble: f64, highest: usize, key: Key) -> Vec<EvenedFalls> {
    let spheres = HardSphere::new(atmosphere(), DEFAULT_RADIUS, wobble);
    let heights = Falls::new(deposition, 0.0);
    (0..=highest).into_par_iter().map(|node| EvenedFalls::new(&spheres, &heights, node, key)).collect()
}

/// A collision and the mean light of its level.
fn with_light(collision: &Collision) -> (Collision, u16) {
    (*collision, collision.level as u16)
}

/// The random fall of a source.
struct Fall<'a> {
    source: Source,
    batches: &'a [FallBatch],
    /// kR of ion pairs that a collision stands for, per mW/m^2.
    pairs: f32,
    /// Squared reach by which its collisions wander, km^2.
    wander_squared: f32,
    /// Where its deviations begin.
    first: usize,
}

/// A field line as it is seen.
enum SeenLine<'a> {
    ByPolynomials(&'a Descent),
    Exactly(LineOfFall<'a>),
}

impl SeenLine<'_> {
    /// Rows of collisions so far from the line in km, and how bright they are seen.
    #[inline(always)]
    fn points<S: Simd>(&self, batch: &FallBatch, offsets: Lanes<S>) -> [Lanes<S>; 2] {
        match self {
            Self::ByPolynomials(descent) => descent.points(Lanes::from_slice(offsets.simd, &batch.places), offsets),
            Self::Exactly(line) => line.points(&altitudes_km(&batch.places), offsets),
        }
    }
}

/// What the points of a strip have in common.
struct CollisionPass<'a> {
    collisions: &'a Collisions,
    chart: &'a Chart,
    finder: Finder,
    footprint: &'a Footprint<'a>,
    step: u32,
}

impl CollisionPass<'_> {
    /// Draws columns beside each other, every source once for all of them.
    #[inline(always)]
    fn group<S: Simd>(&self, simd: S, strip: LightStrip, field: &FieldLines, (group, trace): &mut (Group, Trace)) {
        let entries = group.begin(strip.number, self.chart, self.footprint, field);
        let mut falls = Vec::with_capacity(AHEAD);
        for entries in entries.chunks(AHEAD) {
            falls.clear();
            for entry in entries {
                falls.push(self.collisions.fall(*self.footprint.source(entry.source), self.step));
            }
            for (entry, fall) in entries.iter().zip(&falls) {
                self.source(simd, entry.columns(), fall, group, trace);
            }
        }
        group.write(strip, self.chart.rows);
        group.end(entries);
    }

    #[inline(always)]
    fn source<S: Simd>(&self, simd: S, columns: Range<usize>, fall: &Fall, group: &mut Group, trace: &mut Trace) {
        let source = &fall.source;
        let [green, red, prompt] = source.power;
        let powers = FourLanes::simd_from(simd, [green, red, prompt, prompt]);
        let weights = powers * (fall.pairs / self.chart.row_step as f32);
        // Seen from afar its meridian is that of all columns.
        let shared = source.distance() >= NEAR * source.reach;
        if shared {
            self.place(simd, fall, (columns.start + columns.end) / 2, group, trace);
        }
        for from in columns.clone().step_by(STRIP) {
            let patch = Patch::new(source, self.chart, &group.units(from));
            for column in from..columns.end.min(from + STRIP) {
                let share = patch.side[column - from];
                if share <= 0.0 {
                    continue;
                }
                if !shared {
                    self.place(simd, fall, column, group, trace);
                }
                group.add(column, trace, weights * share);
            }
        }
    }

    /// Places the collisions of a fall down a line, as a column sees it.
    #[inline(always)]
    fn place<S: Simd>(&self, simd: S, fall: &Fall, column: usize, group: &mut Group, trace: &mut Trace) {
        trace.clear();
        let (meridian, distance) = group.seen_by(column, &fall.source);
        let line = LineOfFall::new(meridian, distance, &self.finder);
        let reach = fall.source.reach.max(self.footprint.bins().least_reach(distance));
        if distance < SINGLE * reach {
            self.add(simd, fall, (reach, 0.0), &SeenLine::Exactly(line), trace);
            return;
        }
        let seen = group.descent(simd, column, distance, (&self.collisions.descents, &self.finder));
        let (descent, beyond) = (&seen.descent, distance - seen.distance);
        if descent.shows(reach + beyond.abs(), self.chart.rows) {
            self.add(simd, fall, (reach, beyond), &SeenLine::ByPolynomials(descent), trace);
        }
    }

    /// Adds the collisions of a fall that reaches so far to both sides of its field line, which lies so far beyond the line that is
    /// given, km.
    #[inline(always)]
    fn add<S: Simd>(&self, simd: S, fall: &Fall, (reach, beyond): (f32, f32), line: &SeenLine, trace: &mut Trace) {
        let last = (self.chart.rows - 1) as f32;
        // A source reaches as far as its collisions wander too, and those do so by themselves.
        let own_reach = reach.fused(reach, -fall.wander_squared).max(0.0).sqrt();
        let mut lit = Lit::new(simd);
        for (number, batch) in fall.batches.iter().enumerate() {
            let from = (fall.first + number * BATCH) % DEVIATIONS;
            let Some(deviations) = self.collisions.deviations.get(from..from + BATCH) else { continue };
            let offsets = Lanes::from_slice(simd, &batch.offsets_km) + Lanes::splat(simd, beyond);
            let offsets = Lanes::from_slice(simd, deviations).fused(Lanes::splat(simd, own_reach), offsets);
            let [rows, shown] = line.points(batch, offsets);
            let points = Points::new(rows, shown, last, &mut lit);
            trace.add(simd, &points, (&batch.lights, batch.count as usize), &self.collisions.photons);
        }
        trace.finish(&lit);
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
