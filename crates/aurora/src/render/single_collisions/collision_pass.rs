//! Renders single collisions as in the thesis (2.4): each source sends random electron tracks down its field line.
//!
//! Altitudes are random; laterally each point has the smooth kernel of its source, so rays are as sharp as in the mean
//! profile. The expected value is [`ColumnBuffer::integrate`].

use std::{
    ops::Range,
    sync::{Mutex, PoisonError},
};

use bansho_base::{
    host::parallel::{self, prelude::*},
    math::{
        random::{Key, Purpose, uniform, uniform_f64},
        simd::{FourLanes, Lanes, Real},
    },
};
use fearless_simd::{Simd, dispatch, prelude::*};

use super::{
    collision_block::{COLLISION_BLOCK_COLUMNS, CollisionBlock},
    drawn_electrons::{DrawnElectrons, DrawnTrack},
    rasterize::{RowRange, SPLAT_LANES, SplatBatch, TrackRasterizer},
    track_table::{CollisionBatch, TrackTable},
};
use crate::{
    parameters::Sampling,
    physics::{
        atmosphere::atmosphere,
        emission::{Emission, PerEmitter},
        extinction::AttenuationByDistance,
        precipitation::{
            Deposition,
            electron_track::{Collision, TrackLibrary, TrackSampler},
            energy_grid::{NODES, node_energy_ev},
            hard_sphere::{HardSphereAtmosphere, QuantileMatchedTracks},
        },
    },
    render::{
        RenderingParameters, TrackModel,
        bin::source_bins::{FieldLineSource, PatchWeights, REACH, SortedSources},
        integrate::column_buffer::{ColumnBlock, ColumnBuffer},
        project::{
            altitude_polynomial::{ProjectedFieldLine, RowPolynomialBasis, RowPolynomials, altitudes_km},
            chart::{BLOCK_COLUMNS, Chart, ChartProjection},
            field_lines::{EarthShadow, FOOT_ALTITUDE_KM, FieldLines},
        },
    },
};

const SOURCE: Purpose = Purpose::named("aurora collisions");
/// Batches of random lateral deviations.
const DEVIATIONS: usize = 256;
/// Sources whose tracks are looked up together, to overlap their cache misses.
const LOOKAHEAD_SOURCES: usize = 32;
/// Batches of a track that are projected before any is accumulated, to hide the latency of the sums.
const PIPELINED_BATCHES: usize = 8;
/// Sources nearer to the observer's field line than this many kernel supports are projected for every column, and
/// nearer than the second number exactly instead of by polynomials.
const PER_COLUMN_REACHES: f32 = 4.0;
const EXACT_REACHES: f32 = 16.0;

/// Precomputed tables for single collisions.
#[derive(Clone, Debug)]
pub(crate) struct CollisionRenderer {
    key: Key,
    /// For `sampling = "single_photons"`: tracks that are drawn for each source instead of taken from the library.
    drawn: Option<DrawnElectrons>,
    /// Empty if tracks are drawn.
    tracks: TrackTable,
    deposition: Deposition,
    /// Counted photons per ion pair, by level.
    photons: Vec<PerEmitter<f32>>,
    basis: RowPolynomialBasis,
    /// Brightness of ion pairs per collision of a node's track, kR per mW/m^2.
    pairs: Vec<f32>,
    /// Squared support due to the deflections of a node's tracks, km^2.
    spread_squared: Vec<f32>,
    /// Deviations with the density of a source's kernel, in units of its support.
    deviations: Vec<[f32; SPLAT_LANES]>,
}

impl CollisionRenderer {
    /// The tables for all energies up to that of the node `highest`.
    pub(crate) fn new(
        emission: &Emission,
        rendering: &RenderingParameters,
        attenuation: &AttenuationByDistance,
        highest: usize,
        key: Key,
    ) -> Self {
        let mut deviations = vec![[0.0; SPLAT_LANES]; DEVIATIONS];
        for (index, deviation) in deviations.as_flattened_mut().iter_mut().enumerate() {
            // The sum of three uniforms approximates that density; scaled to its variance, 1/7.
            let [a, b, c, _] = key.uniforms(index as u64, 1, SOURCE);
            *deviation = (a + b + c - 1.5) * (4.0_f32 / 7.0).sqrt();
        }
        let highest = highest.min(NODES - 1);
        let mut photons = Vec::new();
        for (level, per_pair) in emission.photons_per_ion_pair().iter().enumerate() {
            photons.push(per_pair.map(|photons| (photons * attenuation.of_level(level)) as f32));
        }
        // The row of `NO_EMISSION`.
        photons.push([0.0; 4]);
        let (deposition, deflection) = (emission.deposition(), rendering.collision_deflection);
        let mut pairs: Vec<_> = (0..NODES).map(|node| emission.ion_pairs_per_collision(node) as f32).collect();
        let drawn = (rendering.sampling == Sampling::SinglePhotons).then(|| DrawnElectrons::new(rendering, key));
        if drawn.is_some() {
            photons.extend(DrawnElectrons::photon_rows(attenuation));
            pairs = DrawnElectrons::pairs();
        }
        let tracks = match rendering.energy_deposition {
            _ if drawn.is_some() => TrackTable::default(),
            TrackModel::Fang2010 => fang_tracks(&TrackSampler::new(deposition, deflection), highest, key),
            TrackModel::HardSphereAtmosphere => {
                let radius = rendering.hard_spheres.collision_radius();
                let spheres = HardSphereAtmosphere::new(atmosphere(), radius, deflection);
                let tracks = hard_sphere_tracks(&spheres, deposition, highest, key);
                pairs.iter_mut().zip(&tracks).for_each(|(pairs, tracks)| *pairs *= tracks.energy_weight);
                TrackTable::new(highest + 1, |node, variant| {
                    tracks[node].track(variant).iter().map(with_light).collect()
                })
            }
        };
        let mut spread_squared = vec![0.0; NODES];
        for (node, squared) in spread_squared.iter_mut().enumerate() {
            let support_km = REACH * emission.lateral_spread_km(deflection, node_energy_ev(node)) as f32;
            *squared = support_km * support_km;
        }
        Self {
            key,
            drawn,
            tracks,
            deposition: emission.deposition().clone(),
            photons,
            basis: RowPolynomialBasis::new(),
            pairs,
            spread_squared,
            deviations,
        }
    }

    /// Renders sources that are sorted by [`COLLISION_BLOCK_COLUMNS`] at a step of the simulation into a buffer without light; each step has other tracks.
    pub(crate) fn draw(
        &self,
        mut buffer: ColumnBuffer,
        field: &FieldLines,
        sorted_sources: &SortedSources,
        step: u32,
    ) -> ColumnBuffer {
        let level = bansho_base::math::simd::level();
        let (chart, blocks) = buffer.blocks(COLLISION_BLOCK_COLUMNS);
        let pass = CollisionPass {
            collisions: self,
            chart,
            projection: chart.projection(),
            sorted_sources,
            step,
            is_elevated: field.is_elevated(),
            is_above_light: field.is_above_light(),
        };
        // Largest block first (LPT scheduling), for load balance.
        let mut blocks: Vec<_> = blocks.map(|block| (sorted_sources.count(block.number), block)).collect();
        blocks.sort_by_key(|(count, _)| *count);
        let blocks = Mutex::new(blocks);
        (0..parallel::current_num_threads()).into_par_iter().with_max_len(1).for_each(|_| {
            // Memory of a whole block: only threads that get one allocate it.
            let mut scratch = None;
            loop {
                // A statement of its own, so that the lock is released before the block is drawn.
                let next = blocks.lock().unwrap_or_else(PoisonError::into_inner).pop();
                let Some((_, block)) = next else { break };
                let scratch = scratch.get_or_insert_with(|| CollisionScratch::new(chart));
                dispatch!(level, simd => pass.draw_block(simd, block, field, scratch));
            }
        });
        buffer
    }

    /// The track of a source; `drawn` holds it if tracks are drawn.
    #[inline(always)]
    fn track<'a>(&'a self, source: FieldLineSource, step: u32, drawn: &'a mut DrawnTrack) -> SourceTrack<'a> {
        let [a, b, c, d] = self.key.words(u64::from(source.random_key), step, SOURCE);
        let below = (source.energy_node as usize).min(NODES - 2);
        // One of the two nodes at random, so that the mean over sources is linear between them and the tables need no interpolation.
        let central_node = below + usize::from(uniform(a) < source.energy_node - below as f32);
        let node = self.deposition.sample_node_around(central_node, uniform_f64(b, d));
        let (node, batches) = match &self.drawn {
            Some(electrons) => {
                electrons.draw(node, u64::from(source.random_key) << 32 | u64::from(step), drawn);
                (node, &*drawn.batches)
            }
            None => {
                // Energies above the tables use the highest node: its collision count and weight belong together.
                let node = node.min(self.tracks.highest_node());
                (node, self.tracks.track(node, c))
            }
        };
        SourceTrack {
            source,
            batches,
            pairs: self.pairs[node],
            spread_squared: self.spread_squared[node],
            // The lowest bits of the word have chosen the track.
            first: (c >> 8) as usize / SPLAT_LANES,
        }
    }
}

/// Tracks after Fang et al. up to the highest node.
fn fang_tracks(tracks: &TrackSampler, highest: usize, key: Key) -> TrackTable {
    let library = TrackLibrary::new(tracks, 0..=highest, key);
    TrackTable::new(highest + 1, |node, variant| library.track(node, variant).iter().map(with_light).collect())
}

/// Hard-sphere tracks for each node up to the highest.
fn hard_sphere_tracks(
    spheres: &HardSphereAtmosphere,
    deposition: &Deposition,
    highest: usize,
    key: Key,
) -> Vec<QuantileMatchedTracks> {
    let sampler = TrackSampler::new(deposition, 0.0);
    (0..=highest).into_par_iter().map(|node| QuantileMatchedTracks::new(spheres, &sampler, node, key)).collect()
}

/// A collision and its photon row, its level.
fn with_light(collision: &Collision) -> (Collision, u16) {
    (*collision, collision.level as u16)
}

/// The random track of a source.
struct SourceTrack<'a> {
    source: FieldLineSource,
    batches: &'a [CollisionBatch],
    /// Brightness of ion pairs per collision, kR per mW/m^2.
    pairs: f32,
    /// Squared support due to its deflections, km^2.
    spread_squared: f32,
    /// Index of its first batch of deviations (modulo).
    first: usize,
}

/// Buffers that a thread reuses.
struct CollisionScratch {
    block: CollisionBlock,
    rasterizer: TrackRasterizer,
    points: [SplatBatch; PIPELINED_BATCHES],
    drawn: Vec<DrawnTrack>,
}

impl CollisionScratch {
    fn new(chart: &Chart) -> Self {
        Self {
            block: CollisionBlock::new(chart),
            rasterizer: TrackRasterizer::new(chart.rows),
            points: [SplatBatch::NONE; PIPELINED_BATCHES],
            drawn: std::iter::repeat_with(DrawnTrack::default).take(LOOKAHEAD_SOURCES).collect(),
        }
    }
}

/// A field line's projection.
enum LineProjection<'a> {
    Polynomial(&'a RowPolynomials),
    Exact(ProjectedFieldLine<'a>),
}

impl LineProjection<'_> {
    /// Rows of collisions at offsets from the line in km, and their brightness factors.
    #[inline(always)]
    fn points<S: Simd>(&self, batch: &CollisionBatch, offsets: Lanes<S>) -> [Lanes<S>; 2] {
        match self {
            Self::Polynomial(polynomials) => {
                polynomials.points(Lanes::from_slice(offsets.simd, &batch.altitude_coordinates), offsets)
            }
            Self::Exact(line) => line.points(&altitudes_km(&batch.altitude_coordinates), offsets),
        }
    }
}

/// Shared inputs of all blocks.
struct CollisionPass<'a> {
    collisions: &'a CollisionRenderer,
    chart: &'a Chart,
    projection: ChartProjection,
    sorted_sources: &'a SortedSources<'a>,
    step: u32,
    /// Whether the observer is so high that the polynomials, which are made for observers on the ground, do not hold.
    is_elevated: bool,
    /// Whether the Earth may hide light.
    is_above_light: bool,
}

impl CollisionPass<'_> {
    /// Rasterizes a block: each source once for all its columns.
    #[inline(always)]
    fn draw_block<S: Simd>(&self, simd: S, block: ColumnBlock, field: &FieldLines, scratch: &mut CollisionScratch) {
        let entries = scratch.block.begin(block.number, self.chart, self.sorted_sources, field);
        let mut sources = Vec::with_capacity(LOOKAHEAD_SOURCES);
        let mut drawn = std::mem::take(&mut scratch.drawn);
        for entries in entries.chunks(LOOKAHEAD_SOURCES) {
            sources.clear();
            for entry in entries {
                sources.push(*self.sorted_sources.source(entry.source));
            }
            let mut tracks = Vec::with_capacity(LOOKAHEAD_SOURCES);
            // Loops of their own: the loads of one are independent of each other, so that their cache misses overlap. A single loop would wait for a
            // source, then for its track, before it projects.
            for (source, drawn) in sources.iter().zip(&mut drawn) {
                tracks.push(self.collisions.track(*source, self.step, drawn));
            }
            for (entry, track) in entries.iter().zip(&tracks) {
                self.splat_source(simd, entry.columns(), track, scratch);
            }
        }
        scratch.drawn = drawn;
        scratch.block.write(block, self.chart.rows);
        scratch.block.recycle(entries);
    }

    #[inline(always)]
    fn splat_source<S: Simd>(
        &self,
        simd: S,
        columns: Range<usize>,
        track: &SourceTrack,
        scratch: &mut CollisionScratch,
    ) {
        let source = &track.source;
        let [green, red, prompt] = source.power;
        let powers = FourLanes::simd_from(simd, [green, red, prompt, prompt]);
        // Brightness per radian of colatitude: the weights of the rows that share the light of a collision add up to 1.
        let weights = powers * (track.pairs / self.chart.row_step as f32);
        // A distant source has nearly the same meridian in all columns.
        let shared = source.distance() >= PER_COLUMN_REACHES * source.reach;
        if shared {
            self.rasterize_at_column(simd, track, (columns.start + columns.end) / 2, scratch);
        }
        for from in columns.clone().step_by(BLOCK_COLUMNS) {
            let patch = PatchWeights::new(source, self.chart, &scratch.block.units(from));
            for column in from..columns.end.min(from + BLOCK_COLUMNS) {
                let weight = patch.column_weights[column - from];
                if weight <= 0.0 {
                    continue;
                }
                if !shared {
                    self.rasterize_at_column(simd, track, column, scratch);
                }
                scratch.block.add(column, &scratch.rasterizer, weights * weight);
            }
        }
    }

    /// Projects and rasterizes a track for a column.
    #[inline(always)]
    fn rasterize_at_column<S: Simd>(
        &self,
        simd: S,
        track: &SourceTrack,
        column: usize,
        scratch: &mut CollisionScratch,
    ) {
        let CollisionScratch { block, rasterizer, points, .. } = scratch;
        rasterizer.reset();
        let (meridian, distance) = block.meridian_and_distance(column, &track.source);
        // A line is hidden as a whole, by its lower border: between the first and the last of its light are less than 100 km beyond the limb.
        if self.is_above_light && EarthShadow::from(*meridian).hides_altitude(distance, FOOT_ALTITUDE_KM as f32) {
            return;
        }
        let line = ProjectedFieldLine::new(meridian, distance, &self.projection);
        let reach = track.source.reach.max(self.sorted_sources.bins().min_reach(distance));
        if distance < EXACT_REACHES * reach || self.is_elevated {
            self.add(simd, track, reach, 0.0, &LineProjection::Exact(line), rasterizer, points);
            return;
        }
        let cached = block.cached_projection(simd, column, distance, &self.collisions.basis, &self.projection);
        let (polynomials, distance_offset) = (&cached.polynomials, distance - cached.distance);
        if polynomials.may_be_visible(reach + distance_offset.abs(), self.chart.rows) {
            let line = LineProjection::Polynomial(polynomials);
            self.add(simd, track, reach, distance_offset, &line, rasterizer, points);
        }
    }

    /// Rasterizes a track with half-width `reach` about a field line that is `distance_offset` km from the projected
    /// line.
    #[inline(always)]
    fn add<S: Simd>(
        &self,
        simd: S,
        track: &SourceTrack,
        reach: f32,
        distance_offset: f32,
        line: &LineProjection,
        rasterizer: &mut TrackRasterizer,
        points: &mut [SplatBatch; PIPELINED_BATCHES],
    ) {
        let last = (self.chart.rows - 1) as f32;
        // The kernel's support includes the spread by deflections, which the collisions have already.
        let kernel_reach = reach.fma(reach, -track.spread_squared).max(0.0).sqrt();
        let mut row_range = RowRange::new(simd);
        let mut deviations = track.first;
        for batches in track.batches.chunks(PIPELINED_BATCHES) {
            for (batch, points) in batches.iter().zip(&mut *points) {
                // Deviations from a table of 16 KiB, which stays in the first-level cache, instead of random numbers for every collision. Tracks
                // start at different batches of it.
                let deviation = Lanes::from_slice(simd, &self.collisions.deviations[deviations % DEVIATIONS]);
                deviations += 1;
                let offsets = Lanes::from_slice(simd, &batch.offsets_km) + Lanes::splat(simd, distance_offset);
                let offsets = deviation.fma(Lanes::splat(simd, kernel_reach), offsets);
                // First only projections, whose results are independent, then only sums, whose stores hit the same rows: the former hide the latency
                // of the latter.
                points.project(line.points(batch, offsets), last, rasterizer.odd_pairs(), &mut row_range);
            }
            for (batch, points) in batches.iter().zip(&*points) {
                rasterizer.add(simd, points, &batch.photon_rows, batch.count as usize, &self.collisions.photons);
            }
        }
        rasterizer.finish(simd, &row_range);
    }
}
