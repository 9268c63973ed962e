//! The picture of single collisions, as in the thesis (2.4): every source sends random falls down its field line.
//!
//! Heights and places along the line of sight are random; to the side each point has the smooth edge of its source, so
//! that rays are as sharp as those of the mean. That mean is [`Meridians`], but for the noise.

use std::{
    ops::Range,
    sync::{Mutex, PoisonError},
};

use bansho_base::math::{
    random::{Key, Purpose, uniform, uniform_f64},
    simd::{FourLanes, Lanes, Real},
};

use super::{
    quantile_matched::EvenedFalls,
    rasterize::Trace,
    splat::{BATCH, LitRows, Points},
    track_table::{FallBatch, FallTable},
};
use crate::{
    physics::{
        atmosphere::atmosphere,
        emission::{Emission, PerEmitter},
        precipitation::{
            Deposition,
            electron_track::{Collision, FallLibrary, Falls},
            energy_grid::{NODES, node_energy_ev},
            hard_sphere::{DEFAULT_RADIUS, HardSphere},
            lateral_spread::wander_km,
        },
    },
    render::{
        DrawingParameters, FallModel,
        bin::source_bins::{Footprint, Patch, REACH, Source},
        integrate::{
            column_block::{GROUP, Group},
            columns::{LightStrip, Meridians},
        },
        project::{
            altitude_polynomial::{Descent, Descents, LineOfFall, altitudes_km},
            chart::{Chart, Finder, STRIP},
            field_lines::FieldLines,
        },
    },
};
use fearless_simd::{Level, Simd, dispatch, prelude::*};
use rayon::prelude::*;

const SOURCE: Purpose = Purpose::named("aurora collisions");
/// Batches of random deviations.
const DEVIATIONS: usize = 256;
/// Sources whose falls are looked up together: what is far away in memory is then waited for once.
const AHEAD: usize = 32;
/// Batches of a fall that are placed before any of them is added, for the processor finds no other work while sums wait.
const AT_ONCE: usize = 8;
/// Nearer to the observer's own field line than so many reaches, points are placed anew for every column; and nearer
/// than so many, each by its own root and divisions.
const NEAR: f32 = 4.0;
const SINGLE: f32 = 16.0;

/// What falls are drawn from.
#[derive(Clone, Debug)]
pub(crate) struct Collisions {
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
    deviations: Vec<[f32; BATCH]>,
}

impl Collisions {
    /// Falls of electrons of all energies up to that of a node.
    pub(crate) fn new(emission: &Emission, drawing: &DrawingParameters, highest: usize, key: Key) -> Self {
        let deviation = |index: usize| {
            // The sum of three uniforms nearly has that density; its variance is made the same, 1/7.
            let [a, b, c, _] = key.uniforms(index as u64, 1, SOURCE);
            (a + b + c - 1.5) * (4.0_f32 / 7.0).sqrt()
        };
        let deviations = |batch: usize| std::array::from_fn(|lane| deviation(batch * BATCH + lane));
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
            deviations: (0..DEVIATIONS).map(deviations).collect(),
        }
    }

    /// The picture of sources that are sorted by [`GROUP`]s of columns, at a step of the simulation: other steps have other falls.
    pub(crate) fn draw(&self, chart: Chart, field: &FieldLines, footprint: &Footprint, step: u32) -> Meridians {
        let level = Level::new();
        let mut picture = Meridians::dark(chart);
        let (chart, groups) = picture.strips(GROUP);
        let pass = CollisionPass { collisions: self, chart, finder: chart.finder(), footprint, step };
        // The fullest first, whichever thread is free: the last ones, for which others wait, are soon drawn.
        let mut groups: Vec<_> = groups.map(|group| (footprint.count(group.number), group)).collect();
        groups.sort_by_key(|(count, _)| *count);
        let groups = Mutex::new(groups);
        let next = || groups.lock().unwrap_or_else(PoisonError::into_inner).pop();
        (0..rayon::current_num_threads()).into_par_iter().with_max_len(1).for_each(|_| {
            let mut own = None;
            while let Some((_, group)) = next() {
                let own = own.get_or_insert_with(|| Workspace::new(chart));
                dispatch!(level, simd => pass.group(simd, group, field, own));
            }
        });
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
            first: (c >> 8) as usize / BATCH,
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
    /// Number of its first batch of deviations, any.
    first: usize,
}

/// What a thread keeps from source to source.
struct Workspace {
    group: Group,
    trace: Trace,
    points: [Points; AT_ONCE],
}

impl Workspace {
    fn new(chart: &Chart) -> Self {
        Self { group: Group::new(chart), trace: Trace::new(chart.rows), points: [Points::NONE; AT_ONCE] }
    }
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
    fn group<S: Simd>(&self, simd: S, strip: LightStrip, field: &FieldLines, own: &mut Workspace) {
        let entries = own.group.begin(strip.number, self.chart, self.footprint, field);
        let (mut sources, mut falls) = (Vec::with_capacity(AHEAD), Vec::with_capacity(AHEAD));
        for entries in entries.chunks(AHEAD) {
            sources.clear();
            for entry in entries {
                sources.push(*self.footprint.source(entry.source));
            }
            falls.clear();
            for source in &sources {
                falls.push(self.collisions.fall(*source, self.step));
            }
            for (entry, fall) in entries.iter().zip(&falls) {
                self.source(simd, entry.columns(), fall, own);
            }
        }
        own.group.write(strip, self.chart.rows);
        own.group.end(entries);
    }

    #[inline(always)]
    fn source<S: Simd>(&self, simd: S, columns: Range<usize>, fall: &Fall, own: &mut Workspace) {
        let source = &fall.source;
        let [green, red, prompt] = source.power;
        let powers = FourLanes::simd_from(simd, [green, red, prompt, prompt]);
        let weights = powers * (fall.pairs / self.chart.row_step as f32);
        // Seen from afar its meridian is that of all columns.
        let shared = source.distance() >= NEAR * source.reach;
        if shared {
            self.place(simd, fall, (columns.start + columns.end) / 2, own);
        }
        for from in columns.clone().step_by(STRIP) {
            let patch = Patch::new(source, self.chart, &own.group.units(from));
            for column in from..columns.end.min(from + STRIP) {
                let share = patch.side[column - from];
                if share <= 0.0 {
                    continue;
                }
                if !shared {
                    self.place(simd, fall, column, own);
                }
                own.group.add(column, &own.trace, weights * share);
            }
        }
    }

    /// Places the collisions of a fall down a line, as a column sees it.
    #[inline(always)]
    fn place<S: Simd>(&self, simd: S, fall: &Fall, column: usize, own: &mut Workspace) {
        let Workspace { group, trace, points } = own;
        trace.clear();
        let (meridian, distance) = group.seen_by(column, &fall.source);
        let line = LineOfFall::new(meridian, distance, &self.finder);
        let reach = fall.source.reach.max(self.footprint.bins().least_reach(distance));
        if distance < SINGLE * reach {
            self.add(simd, fall, (reach, 0.0), &SeenLine::Exactly(line), (trace, points));
            return;
        }
        let seen = group.descent(simd, column, distance, (&self.collisions.descents, &self.finder));
        let (descent, beyond) = (&seen.descent, distance - seen.distance);
        if descent.shows(reach + beyond.abs(), self.chart.rows) {
            self.add(simd, fall, (reach, beyond), &SeenLine::ByPolynomials(descent), (trace, points));
        }
    }

    /// Adds the collisions of a fall that reaches so far to both sides of its field line, which lies so far beyond the line that is
    /// given, km.
    #[inline(always)]
    fn add<S: Simd>(
        &self,
        simd: S,
        fall: &Fall,
        (reach, beyond): (f32, f32),
        line: &SeenLine,
        (trace, points): (&mut Trace, &mut [Points; AT_ONCE]),
    ) {
        let last = (self.chart.rows - 1) as f32;
        // A source reaches as far as its collisions wander too, and those do so by themselves.
        let own_reach = reach.fma(reach, -fall.wander_squared).max(0.0).sqrt();
        let mut lit = LitRows::new(simd);
        let mut deviations = fall.first;
        for batches in fall.batches.chunks(AT_ONCE) {
            for (batch, points) in batches.iter().zip(&mut *points) {
                let deviation = Lanes::from_slice(simd, &self.collisions.deviations[deviations % DEVIATIONS]);
                deviations += 1;
                let offsets = Lanes::from_slice(simd, &batch.offsets_km) + Lanes::splat(simd, beyond);
                let offsets = deviation.fma(Lanes::splat(simd, own_reach), offsets);
                points.place(line.points(batch, offsets), last, trace.odd_pairs(), &mut lit);
            }
            for (batch, points) in batches.iter().zip(&*points) {
                trace.add(simd, points, (&batch.lights, batch.count as usize), &self.collisions.photons);
            }
        }
        trace.finish(simd, &lit);
    }
}
