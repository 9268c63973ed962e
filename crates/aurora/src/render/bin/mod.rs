//! Binning of light sources by the longitude and distance of their field lines on the chart ([`source_bins`]). Sources are particles for prompt light, and
//! afterglow cells for the green and the red line.

pub(crate) mod source_bins;

use bansho_base::{
    host::{parallel, parallel::prelude::*},
    math::{self, MulAdd, simd::LANES},
    parameters::Auto,
};
use fearless_simd::dispatch;
use source_bins::{FieldLineSource, REACH};

use super::{
    Blur, RenderingParameters, Sampling,
    diffuse::DiffuseAurora,
    project::field_lines::{FieldLines, FootPoint},
};
use crate::{
    physics::{
        emission::{Emission, SpectralEmitter, quenching::RED_ALTITUDES},
        extinction::AttenuationByDistance,
        precipitation::energy_grid::{LOWEST_EV, NODES, node_coordinate, node_energy_ev},
    },
    simulate::{
        AuroraParticles,
        afterglow::{Afterglow, AfterglowCell},
    },
};

/// Sources per task.
const TASK: usize = 4096;
/// Standard deviation of a particle's patch relative to the particle spacing: single particles are not visible.
const SPREAD_PER_SPACING: f64 = 1.2;
/// Afterglow cells without particles are skipped below this fraction of a typical cell's power.
const MIN_RELATIVE_POWER: f32 = 2e-4;
/// The same with single collisions, whose noise masks more; the skipped light is a hundredth of the afterglow.
const MIN_RELATIVE_POWER_WITH_COLLISIONS: f32 = 1e-2;
/// Offset between the random-number counters of a particle at successive instants.
const PER_INSTANT: u32 = 0x9e37_79b9;
/// 1000 W, the power of one mW/m^2 on one km^2.
const PER_UNIT: f32 = 1e-3;

/// Sources at one instant, or averaged over a long exposure.
#[derive(Default)]
pub(crate) struct Sources {
    /// Light with fine detail: particles and the green map.
    pub(crate) sharp: Vec<FieldLineSource>,
    /// The red map, with altitudes in place of emitters.
    pub(crate) soft: Vec<FieldLineSource>,
    /// Standard deviations of both, km.
    pub(crate) spread_km: [f64; 2],
    /// The diffuse aurora, and the standard deviation of its cells, km.
    pub(crate) diffuse: Vec<FieldLineSource>,
    pub(crate) diffuse_spread_km: f64,
}

/// Weights of green, red and prompt light; for the soft chart, of the three red altitudes.
pub(crate) type EmitterWeights = [f32; 3];
const GREEN: [EmitterWeights; 1] = [[1.0, 0.0, 0.0]];
const ALL: [EmitterWeights; 1] = [[1.0, 1.0, 1.0]];
const RED: [EmitterWeights; RED_ALTITUDES] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Converts particles and cells to sources.
pub(crate) struct SourceBuilder<'a> {
    pub(crate) field: &'a FieldLines,
    pub(crate) reach: f32,
    /// Factor of the power: one over the number of instants.
    pub(crate) weight: f32,
    /// Index of the instant: a particle has other random tracks at each.
    pub(crate) instant: u32,
    /// Attenuation by the distance of the field line.
    pub(crate) attenuation: AttenuationByDistance,
}

impl<'a> SourceBuilder<'a> {
    /// Sources of full power at an instant, with that standard deviation, km.
    fn new(inputs: &EmissionInputs, field: &'a FieldLines, instant: u32, spread_km: f64) -> Self {
        Self { field, reach: spread_km as f32 * REACH, weight: 1.0, instant, attenuation: inputs.attenuation }
    }
}

impl SourceBuilder<'_> {
    #[inline(always)]
    fn build(&self, foot: FootPoint, powers_w: [f32; 3], node: f32, key: u32) -> FieldLineSource {
        let attenuation = self.attenuation.of_field_line(foot.across);
        let scale = self.weight * PER_UNIT * foot.vertical_cosine * attenuation;
        let [green, red, prompt] = powers_w;
        let power = [green * scale, red * scale, prompt * scale];
        FieldLineSource { across: foot.across, reach: self.reach, energy_node: node, power, random_key: key }
    }

    /// Random-number counter for the tracks of a particle or cell.
    #[inline(always)]
    fn random_key(&self, number: u32) -> u32 {
        number.wrapping_add(self.instant.wrapping_mul(PER_INSTANT))
    }

    /// One source per cell, with these weights of the light of each altitude.
    pub(crate) fn cells<const ALTITUDES: usize>(
        &self,
        cells: &[AfterglowCell<ALTITUDES>],
        weights: [EmitterWeights; ALTITUDES],
    ) -> Vec<FieldLineSource> {
        let level = bansho_base::math::simd::level();
        let mut sources = vec![FieldLineSource::default(); cells.len()];
        sources.par_chunks_mut(TASK).zip(cells.par_chunks(TASK)).for_each(|(sources, cells)| {
            dispatch!(level, _simd => self.fill_from_cells(sources, cells, weights));
        });
        sources
    }

    #[inline(always)]
    fn fill_from_cells<const ALTITUDES: usize>(
        &self,
        sources: &mut [FieldLineSource],
        cells: &[AfterglowCell<ALTITUDES>],
        weights: [EmitterWeights; ALTITUDES],
    ) {
        for (source, cell) in sources.iter_mut().zip(cells) {
            let [east, south] = cell.position_km;
            let mut powers = [0.0; 3];
            for (weights, power) in weights.iter().zip(cell.powers_w) {
                for (sum, weight) in powers.iter_mut().zip(weights) {
                    *sum += weight * power;
                }
            }
            *source = self.build(
                self.field.foot_point(east, south),
                powers,
                node_coordinate(cell.energy_ev),
                // The complement: cells and particles both count from 0, and would have the same tracks.
                self.random_key(!cell.cell_index),
            );
        }
    }

    /// Particles extrapolated by `offset_s` seconds, with the green and the red light of each.
    fn particles(&self, particles: &AuroraParticles, lasting: LastingLight, offset_s: f32) -> Vec<FieldLineSource> {
        let level = bansho_base::math::simd::level();
        let mut sources = vec![FieldLineSource::default(); particles.len()];
        sources.par_chunks_mut(TASK).enumerate().for_each(|(task, sources)| {
            dispatch!(level, _simd => self.fill_from_particles(sources, particles, lasting, task * TASK, offset_s));
        });
        sources
    }

    #[inline(always)]
    fn fill_from_particles(
        &self,
        sources: &mut [FieldLineSource],
        particles: &AuroraParticles,
        lasting: LastingLight,
        first: usize,
        offset_s: f32,
    ) {
        let ([xs, zs], [us, ws]) = (&particles.positions, &particles.velocities);
        for (number, sources) in sources.chunks_mut(LANES).enumerate() {
            let (first, count) = (first + number * LANES, sources.len());
            let mut positions = [[0.0; LANES]; 2];
            let mut energies = [LOWEST_EV as f32; LANES];
            for i in 0..count {
                positions[0][i] = us[first + i].fma(offset_s, xs[first + i]);
                positions[1][i] = ws[first + i].fma(offset_s, zs[first + i]);
                energies[i] = particles.energies_ev[first + i];
            }
            // Whole batches, so that this loop is vectorized; lanes from `count` on are not used.
            let mut feet = [[0.0; LANES]; 3];
            let mut nodes = [0.0; LANES];
            for i in 0..LANES {
                let FootPoint { across: [x, y], vertical_cosine } =
                    self.field.foot_point(positions[0][i], positions[1][i]);
                (feet[0][i], feet[1][i], feet[2][i]) = (x, y, vertical_cosine);
                nodes[i] = node_coordinate(energies[i]);
            }
            for (i, source) in sources.iter_mut().enumerate() {
                let foot = FootPoint { across: [feet[0][i], feet[1][i]], vertical_cosine: feet[2][i] };
                let power = particles.powers_w[first + i];
                let powers = [lasting.green_w[first + i], lasting.red_fraction * power, power];
                let key = self.random_key(particles.ids[first + i] as u32);
                *source = self.build(foot, powers, nodes[i], key);
            }
        }
    }
}

/// The light of particles in the lines that outlast their excitation.
#[derive(Clone, Copy)]
struct LastingLight<'a> {
    /// Power of the green light of each particle, W.
    green_w: &'a [f32],
    /// Fraction of a particle's power with which it emits red light: 0 if cells do.
    red_fraction: f32,
}

impl Sources {
    /// Sources while the shutter is open.
    pub(crate) fn new(inputs: &EmissionInputs, field: &FieldLines, times: &SampleTimes) -> Self {
        let mut sources = match inputs.afterglow {
            Some(afterglow) => Self::with_afterglow(inputs, afterglow, field, times),
            None => Self::without_afterglow(inputs, field, times),
        };
        // It hardly moves during an exposure, and its light is as steady as its electrons.
        let spread_km = inputs.diffuse.cell_spread_km();
        let builder = SourceBuilder::new(inputs, field, times.first_index, spread_km);
        sources.diffuse = builder.cells(&inputs.diffuse.cells(inputs.particles, inputs.time), ALL);
        sources.diffuse_spread_km = spread_km;
        sources
    }

    /// All light is emitted where and when electrons strike, as in the thesis.
    fn without_afterglow(inputs: &EmissionInputs, field: &FieldLines, times: &SampleTimes) -> Self {
        let spread = math::hypot(inputs.spread_km(), times.smear_km);
        let (reach, weight) = (spread as f32 * REACH, 1.0 / times.offsets_s.len().max(1) as f32);
        let lasting = LastingLight { green_w: &inputs.particles.powers_w, red_fraction: 1.0 };
        let mut sharp = Vec::new();
        for (offset_s, instant) in times.offsets_s.iter().zip(times.first_index..) {
            let builder = SourceBuilder { field, reach, weight, instant, attenuation: inputs.attenuation };
            sharp.extend(builder.particles(inputs.particles, lasting, *offset_s as f32));
        }
        Self { sharp, spread_km: [spread; 2], ..Self::default() }
    }

    fn with_afterglow(inputs: &EmissionInputs, afterglow: &Afterglow, field: &FieldLines, times: &SampleTimes) -> Self {
        let by_collisions = inputs.parameters.sampling != Sampling::MeanProfile;
        let min_power = if by_collisions { MIN_RELATIVE_POWER_WITH_COLLISIONS } else { MIN_RELATIVE_POWER };
        let column = inputs.emission.column(inputs.energy_ev);
        let spread = math::hypot(inputs.spread_km(), times.smear_km);
        let [green_diffusion, red_diffusion] =
            [SpectralEmitter::OxygenGreen, SpectralEmitter::OxygenRed].map(|emitter| column.spread_km[emitter.index()]);
        let cell_spreads = [
            cell_spread_km(spread, green_diffusion, afterglow.green.cell_km()),
            cell_spread_km(spread, red_diffusion, afterglow.red.cell_km()),
        ];
        let blocks = [afterglow.green.block(cell_spreads[0]), afterglow.red.block(cell_spreads[1])];
        let ((green_w, green), red) = parallel::join(
            || afterglow.green.distribute_to_particles(inputs.particles, min_power, blocks[0]),
            || afterglow.red.bright_blocks(MIN_RELATIVE_POWER, blocks[1]),
        );
        let green_spread = block_spread_km(cell_spreads[0], afterglow.green.cell_km(), blocks[0]);
        let red_spread = block_spread_km(cell_spreads[1], afterglow.red.cell_km(), blocks[1]);
        let builder = SourceBuilder::new(inputs, field, times.first_index, spread);
        let lasting = LastingLight { green_w: &green_w, red_fraction: 0.0 };
        let mut sharp = SourceBuilder { reach: green_spread as f32 * REACH, ..builder }.cells(&green, GREEN);
        let weight = 1.0 / times.offsets_s.len().max(1) as f32;
        for (offset_s, instant) in times.offsets_s.iter().zip(times.first_index..) {
            let builder = SourceBuilder { weight, instant, ..builder };
            sharp.extend(builder.particles(inputs.particles, lasting, *offset_s as f32));
        }
        // Red light is spread over kilometers, so that a coarser chart holds all of it.
        let soft = SourceBuilder { reach: red_spread as f32 * REACH, ..builder }.cells(&red, RED);
        Self { sharp, soft, spread_km: [spread, red_spread], ..Self::default() }
    }
}

impl Sources {
    /// Appends other sources with their power scaled by a weight.
    pub(crate) fn add(&mut self, others: &Self, weight: f32) {
        let first = self.sharp.is_empty() && self.soft.is_empty();
        self.diffuse_spread_km = others.diffuse_spread_km;
        let pairs =
            [(&mut self.sharp, &others.sharp), (&mut self.soft, &others.soft), (&mut self.diffuse, &others.diffuse)];
        for (sum, others) in pairs {
            for source in others {
                sum.push(FieldLineSource { power: source.power.map(|power| weight * power), ..*source });
            }
        }
        for (spread, other) in self.spread_km.iter_mut().zip(others.spread_km) {
            *spread = if first { other } else { spread.min(other) };
        }
    }
}

/// Instants at which particles are drawn.
pub(crate) struct SampleTimes {
    /// Offsets from the step's time, s; all have the same weight.
    pub(crate) offsets_s: Vec<f64>,
    /// Index of the first instant.
    pub(crate) first_index: u32,
    /// Motion blur between successive instants (standard deviation), km.
    pub(crate) smear_km: f64,
}

/// Inputs from which sources are created.
pub(crate) struct EmissionInputs<'a> {
    pub(crate) particles: &'a AuroraParticles,
    /// The green and the red map, unless all light is prompt.
    pub(crate) afterglow: Option<&'a Afterglow>,
    /// The diffuse aurora, and the time at which it is drawn, s.
    pub(crate) diffuse: &'a DiffuseAurora,
    pub(crate) time: f64,
    pub(crate) emission: &'a Emission,
    pub(crate) parameters: &'a RenderingParameters,
    /// Mean distance between neighboring particles, km.
    pub(crate) spacing_km: f64,
    /// Mean electron energy without rays and sheet factors, eV.
    pub(crate) energy_ev: f64,
    /// Spread of collisions about their field line, km.
    pub(crate) lateral_spread_km: f64,
    /// Attenuation by distance.
    pub(crate) attenuation: AttenuationByDistance,
}

impl EmissionInputs<'_> {
    /// Standard deviation of a particle's light perpendicular to the field, km.
    pub(crate) fn spread_km(&self) -> f64 {
        let blur_km = match (self.parameters.blur_space, self.parameters.blur_radius_km) {
            (Blur::Screen, _) => 0.0,
            (Blur::World, Auto::Set(spread)) => spread,
            (Blur::World, Auto::Auto) => SPREAD_PER_SPACING * self.spacing_km,
        };
        math::hypot(blur_km, self.lateral_spread_km).max(1e-3)
    }
}

/// Standard deviation of the light of an afterglow cell, km: that of the light of its particles, `spread`, the diffusion
/// of the excited atoms, and its own width, as a triangle of that half-width.
fn cell_spread_km(spread: f64, diffusion: f64, cell_km: f64) -> f64 {
    math::sqrt(spread * spread + diffusion * diffusion + cell_km * cell_km / 6.0)
}

/// The same of a block of `block` by `block` cells, each with `cell_spread`, which is drawn at its center.
fn block_spread_km(cell_spread: f64, cell_km: f64, block: usize) -> f64 {
    // The variance of the positions of n equal cells in a row is (n^2 - 1) / 12 cells^2.
    math::sqrt(cell_spread * cell_spread + ((block * block - 1) as f64) * cell_km * cell_km / 12.0)
}

/// The node of the energy grid that is nearest on a logarithmic scale.
pub(crate) fn nearest_node(energy_ev: f64) -> usize {
    let (mut nearest, mut min_distance) = (0, f64::INFINITY);
    for node in 0..NODES {
        let distance = math::ln(node_energy_ev(node) / energy_ev.max(1.0)).abs();
        if distance < min_distance {
            (nearest, min_distance) = (node, distance);
        }
    }
    nearest
}
