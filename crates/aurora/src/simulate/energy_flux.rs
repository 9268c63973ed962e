//! Distributes the energy flux of the sheets to the particles.

use bansho_base::{host::parallel::prelude::*, math::random::Key, noise::LANES};

use super::AuroraParticles;
use crate::{
    AuroraParameters, PowerDistribution,
    physics::precipitation::energy_grid::{HIGHEST_EV, LOWEST_EV},
    simulate::sheets::{
        filaments::{FilamentInputs, FilamentPattern},
        nodes::{NodeLayout, NodeValues},
        rays::{PatternInputs, RayPattern, RayTable},
        refined_shape::{RefinedShape, SheetProjection},
    },
};

/// Particles per task, a multiple of the lanes.
const TASK: usize = 4096;
/// Power factor per step of a particle that is far from every sheet.
const STRAY_DECAY: f32 = 0.85;
/// Minimum and maximum number of coarse intervals per sheet, each of which gets its drawn power, and the minimum number
/// of particles per interval.
const COARSE: [f64; 2] = [16.0, 32.0];
const PER_COARSE: f64 = 128.0;
/// The same for the fine intervals, which compensate for the particle density: where a fold forms, particles cluster
/// for seconds.
const FINE: [f64; 2] = [32.0, 256.0];
const PER_FINE: f64 = 64.0;
/// Maximum power of a particle relative to a uniform distribution, where particles are scarce.
const MAX_CONCENTRATION: f64 = 6.0;
/// Relaxation factor per step of a particle's power toward its target.
const POWER_RELAXATION: f32 = 0.2;
/// Limits of the global correction for that delay: a step in the animated flux is still followed gradually.
const BALANCE: [f64; 2] = [0.9, 1.1];
/// Lateral distance at which the power has fallen to 0, relative to half the thickness: a few particles lie beyond the attraction.
const PROFILE_REACH: f32 = 1.15;
/// W for one mW/m^2 on one km^2.
const W_PER_KM2: f64 = 1e3;

/// Flux, energy and ray pattern of an aurora.
#[derive(Clone, Debug)]
pub(super) struct EnergyFlux {
    parameters: AuroraParameters,
    rays: RayPattern,
    filaments: Option<FilamentPattern>,
}

/// The particles of one task.
struct ParticleChunk<'a> {
    positions: [&'a [f32]; 2],
    fades: &'a [f32],
    energies: &'a mut [f32],
    powers: &'a mut [f32],
    full_powers: &'a mut [f32],
    arc_fractions: &'a mut [f32],
    sheets: &'a mut [u32],
}

impl EnergyFlux {
    pub(super) fn new(parameters: &AuroraParameters, key: Key) -> Self {
        let (rays, filaments) = (RayPattern::new(parameters, key), FilamentPattern::new(parameters, key));
        Self { parameters: parameters.clone(), rays, filaments }
    }

    /// Layouts of the coarse and the fine intervals for sheets of these lengths.
    fn layouts(&self, lengths: &[f64]) -> [NodeLayout; 2] {
        let count = self.parameters.particles.count as f64;
        [(PER_COARSE, COARSE), (PER_FINE, FINE)].map(|(per, bounds)| NodeLayout::new(lengths, count / per, bounds))
    }

    /// Target power by sheet and node without pulsation and black rays, W: flux times length times thickness, in bright and quiet stretches by the ray
    /// pattern. The total is that without the pattern.
    fn target_power<'a>(
        &self,
        refined: &RefinedShape,
        layout: &'a NodeLayout,
        rays: &RayTable,
        time: f64,
    ) -> NodeValues<'a> {
        let width = 2.0 * self.parameters.half_thickness_km();
        let flux = self.parameters.flux_mw_per_m2.at(time) * W_PER_KM2 * width;
        let lengths = refined.sheet_lengths();
        let [mut even, mut patterned] = [0.0; 2];
        let mut pieces = Vec::new();
        // Pieces of at most half an interval: bridges have fewer segments than nodes.
        for piece in refined.pieces(|sheet| 0.5 / (layout.count(sheet) - 1) as f64) {
            let half = 0.5 * piece.length_km / lengths[piece.sheet].max(f64::MIN_POSITIVE);
            let part = [piece.fraction - half, piece.fraction + half];
            let power = piece.flux * piece.length_km;
            let bright = power * self.rays.mean_brightness(rays, piece.sheet, part);
            even += power;
            patterned += bright;
            pieces.push((piece, bright));
        }
        let scale = if patterned > 0.0 { flux * even / patterned } else { flux };
        let mut target = NodeValues::new(layout);
        for (piece, bright) in pieces {
            target.add(piece.sheet as u32, piece.fraction as f32, scale * bright);
        }
        target
    }

    /// The ray pattern along the sheets at a time.
    pub(super) fn ray_table(&self, refined: &RefinedShape, time: f64) -> RayTable {
        self.rays.table(&refined.sheet_lengths(), |sheet, last| refined.arc_coordinates(sheet, last), time)
    }

    /// Assigns the power of every particle.
    ///
    /// The total is the power of the sheets, and each interval has its drawn power whatever its number of particles, so
    /// births, deaths, splits and merges do not cause flicker. Within an interval the power of a particle is inversely
    /// proportional to the local density, times the ray pattern.
    pub(super) fn distribute_power(
        &self,
        particles: &mut AuroraParticles,
        refined: &RefinedShape,
        rays: &RayTable,
        time: f64,
    ) {
        let count = match self.parameters.particles.power_distribution {
            PowerDistribution::BySheetLength => None,
            PowerDistribution::Equal => Some(self.parameters.particles.count as f64),
            PowerDistribution::EqualShare => Some(particles.fades.iter().map(|fade| f64::from(*fade)).sum()),
        };
        if let Some(count) = count {
            self.distribute_equally(particles, refined, time, count);
            return;
        }
        let lengths = refined.sheet_lengths();
        let [coarse, fine] = self.layouts(&lengths);
        let tasks = chunks(particles).into_par_iter().with_max_len(1);
        let weighted: Vec<WeightedChunk> =
            tasks.map(|chunk| self.weight_chunk(chunk, refined, &fine, rays, time)).collect();
        // Chunks of a fixed size, summed in order: the totals have the same bits with any number of threads.
        let counts = weighted.iter().fold(NodeValues::new(&fine), |sum, chunk| sum.plus(&chunk.counts));
        let lengths = NodeValues::of_lengths(&fine, &lengths).distributed_by(&counts, MAX_CONCENTRATION);
        let tasks = chunks(particles).into_par_iter().with_max_len(1).zip(&weighted);
        let weights: Vec<_> =
            tasks.map(|(chunk, weighted)| chunk.accumulate_weights(&weighted.weights, &lengths, &coarse)).collect();
        let weights = weights.iter().fold(NodeValues::new(&coarse), |sum, chunk| sum.plus(chunk));
        let factors = self.target_power(refined, &coarse, rays, time).distributed_by(&weights, MAX_CONCENTRATION);
        let totals: Vec<[f64; 2]> =
            chunks(particles).into_par_iter().with_max_len(1).map(|chunk| chunk.assign_powers(&factors)).collect();
        balance(particles, &totals);
    }

    /// Assigns every particle the same power and energy, as in the thesis: the total power of the sheets over `count`, whatever number there is.
    fn distribute_equally(&self, particles: &mut AuroraParticles, refined: &RefinedShape, time: f64, count: f64) {
        let width = 2.0 * self.parameters.half_thickness_km();
        let area: f64 = refined.pieces(|_| 1.0).map(|piece| piece.flux * piece.length_km * width).sum();
        let power = self.parameters.flux_mw_per_m2.at(time) * W_PER_KM2 * area / count.max(1.0);
        let energy = self.parameters.energy_ev.at(time);
        chunks(particles).into_par_iter().with_max_len(1).for_each(|chunk| {
            for index in 0..chunk.fades.len() {
                let projection = chunk.project(refined, index);
                let energy_factor = projection.map_or(1.0, |projection| projection.energy);
                chunk.energies[index] = (energy * energy_factor).clamp(LOWEST_EV, HIGHEST_EV) as f32;
                chunk.full_powers[index] = power as f32;
                chunk.powers[index] = chunk.fades[index] * chunk.full_powers[index];
                if let Some(projection) = projection {
                    chunk.arc_fractions[index] = projection.fraction as f32;
                    chunk.sheets[index] = projection.sheet;
                }
            }
        });
    }

    /// Computes weights of a chunk; they are stored as negative powers until normalized.
    fn weight_chunk<'a>(
        &self,
        chunk: ParticleChunk,
        refined: &RefinedShape,
        layout: &'a NodeLayout,
        rays: &RayTable,
        time: f64,
    ) -> WeightedChunk<'a> {
        let mut weighted = WeightedChunk { counts: NodeValues::new(layout), weights: vec![0.0; chunk.fades.len()] };
        let (level, energy) = (bansho_base::math::simd::level(), self.parameters.energy_ev.at(time));
        let side_scale = 1.0 / self.parameters.half_thickness_km();
        for first in (0..chunk.fades.len()).step_by(LANES) {
            let count = LANES.min(chunk.fades.len() - first);
            let mut projections: [Option<SheetProjection>; LANES] = [None; LANES];
            let mut inputs = PatternInputs { noises: [[0.0; 4]; LANES], side: [0.0; LANES] };
            for lane in 0..count {
                let Some(projection) = chunk.project(refined, first + lane) else { continue };
                inputs.noises[lane] = rays.at(projection.sheet, projection.fraction);
                inputs.side[lane] = (projection.side * side_scale) as f32;
                projections[lane] = Some(projection);
            }
            // Projections are scalar, since each particle has its own list of segments; the pattern, which is noise, is computed for sixteen.
            let mut pattern = self.rays.at(level, &inputs, time);
            if let Some(filaments) = &self.filaments {
                let sample = filaments.at(level, &filament_inputs(&projections, rays), time);
                for lane in 0..LANES {
                    pattern.brightness[lane] *= sample.brightness[lane];
                    pattern.hardness[lane] *= sample.hardness[lane];
                }
            }
            for (lane, projection) in projections.into_iter().enumerate().take(count) {
                let index = first + lane;
                let Some(projection) = projection else {
                    chunk.full_powers[index] *= STRAY_DECAY;
                    chunk.powers[index] = chunk.fades[index] * chunk.full_powers[index];
                    continue;
                };
                let weight = projection.flux as f32 * pattern.brightness[lane] * lateral_profile(inputs.side[lane]);
                weighted.counts.add(projection.sheet, projection.fraction as f32, f64::from(chunk.fades[index]));
                weighted.weights[index] = weight;
                chunk.powers[index] = -weight * pattern.dimming[lane];
                let energy_ev = energy * projection.energy * f64::from(pattern.hardness[lane]);
                chunk.energies[index] = energy_ev.clamp(LOWEST_EV, HIGHEST_EV) as f32;
                chunk.arc_fractions[index] = projection.fraction as f32;
                chunk.sheets[index] = projection.sheet;
            }
        }
        weighted
    }
}

/// Where sixteen particles are on their sheets, far from which the pattern has no strength.
fn filament_inputs(projections: &[Option<SheetProjection>; LANES], rays: &RayTable) -> FilamentInputs {
    let mut inputs = FilamentInputs { along_km: [0.0; LANES], across_km: [0.0; LANES], strength: [0.0; LANES] };
    for (lane, projection) in projections.iter().enumerate() {
        let Some(projection) = projection else { continue };
        let place = rays.place(projection.sheet, projection.fraction);
        inputs.along_km[lane] = place.along_km;
        inputs.across_km[lane] = projection.side as f32;
        inputs.strength[lane] = place.strength;
    }
    inputs
}

/// Power by lateral position, -1 to 1 within the thickness, relative to the middle. Particles fill the thickness evenly; sheets as bright at their
/// sides as in their middle would have hard edges where a fold is seen along its tangent, which photographs of curtains do not have.
fn lateral_profile(side: f32) -> f32 {
    let squared = (side * side * (1.0 / (PROFILE_REACH * PROFILE_REACH))).min(1.0);
    (1.0 - squared) * (1.0 - squared)
}

/// Weights of a chunk of particles.
struct WeightedChunk<'a> {
    /// Particle counts along the sheets.
    counts: NodeValues<'a>,
    /// Weight of each particle before black rays and pulsation; 0 far from the sheets.
    weights: Vec<f32>,
}

impl ParticleChunk<'_> {
    fn project(&self, refined: &RefinedShape, index: usize) -> Option<SheetProjection> {
        refined.project([f64::from(self.positions[0][index]), f64::from(self.positions[1][index])].into())
    }

    /// Multiplies the pending weights by the sheet length per particle and sums them by interval.
    fn accumulate_weights<'a>(self, weights: &[f32], lengths: &NodeValues, layout: &'a NodeLayout) -> NodeValues<'a> {
        let mut sums = NodeValues::new(layout);
        for (index, weight) in weights.iter().enumerate().filter(|(_, weight)| **weight > 0.0) {
            let (sheet, arc_fraction) = (self.sheets[index], self.arc_fractions[index]);
            let length = lengths.at(sheet, arc_fraction);
            self.powers[index] *= length as f32;
            sums.add(sheet, arc_fraction, f64::from(self.fades[index] * weight) * length);
        }
        sums
    }

    /// Normalizes pending powers. The power relaxes toward its target, so a particle that moves between two adjacent
    /// intervals of a sheet does not flash. Returns the target and the actual total, W.
    fn assign_powers(self, factors: &NodeValues) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for (index, power) in self.powers.iter_mut().enumerate().filter(|(_, power)| power.is_sign_negative()) {
            let (sheet, arc_fraction) = (self.sheets[index], self.arc_fractions[index]);
            let target = -*power * factors.at(sheet, arc_fraction) as f32;
            let full = &mut self.full_powers[index];
            // New particles start at 0 and gain power as fast as the others lose it.
            let relaxes = *full > 0.0 || self.fades[index] < 1.0;
            *full = if relaxes { *full + POWER_RELAXATION * (target - *full) } else { target };
            *power = self.fades[index] * *full;
            sums[0] += f64::from(self.fades[index] * target);
            sums[1] += f64::from(*power);
        }
        sums
    }
}

/// Corrects the total for the relaxation delay: otherwise the aurora would be too bright while many particles are being
/// created.
fn balance(particles: &mut AuroraParticles, totals: &[[f64; 2]]) {
    let [target, actual] = totals.iter().fold([0.0; 2], |sum, chunk| [sum[0] + chunk[0], sum[1] + chunk[1]]);
    if actual > 0.0 {
        let factor = (target / actual).clamp(BALANCE[0], BALANCE[1]) as f32;
        particles.powers_w.par_chunks_mut(TASK).for_each(|powers| powers.iter_mut().for_each(|power| *power *= factor));
    }
}

/// The particles, divided into tasks.
fn chunks(particles: &mut AuroraParticles) -> Vec<ParticleChunk<'_>> {
    let [xs, zs] = &particles.positions;
    let reads = xs.chunks(TASK).zip(zs.chunks(TASK)).zip(particles.fades.chunks(TASK));
    let powers = particles.powers_w.chunks_mut(TASK).zip(particles.full_powers_w.chunks_mut(TASK));
    let light = particles.energies_ev.chunks_mut(TASK).zip(powers);
    let inputs = particles.arc_fractions.chunks_mut(TASK).zip(particles.sheets.chunks_mut(TASK));
    let mut chunks = Vec::with_capacity(xs.len().div_ceil(TASK));
    for (((xs, zs), fades), ((energies, (powers, full_powers)), (arc_fractions, sheets))) in
        reads.zip(light.zip(inputs))
    {
        let positions = [xs, zs];
        chunks.push(ParticleChunk { positions, fades, energies, powers, full_powers, arc_fractions, sheets });
    }
    chunks
}

#[cfg(test)]
mod tests {
    use bansho_base::math::DVec2;

    use super::*;
    use crate::{
        shapes::{Shape, Sheet},
        simulate::sheets::{arc_length::ArcLengthMap, refined_shape::FoldModel},
    };

    #[test]
    fn a_sheet_of_a_few_pieces_is_as_bright_everywhere() {
        let (mut parameters, key) = (AuroraParameters::default(), Key::new(2, "precipitation"));
        parameters.rays.contrast = 0.0;
        // As long as a bridge over a gap.
        let points = vec![DVec2::ZERO, DVec2::new(17.0, 0.0)];
        let sheet = Sheet { points, flux: vec![1.0; 2], energy: vec![1.0; 2] };
        let shape = Shape { sheets: vec![sheet] };
        let refined =
            RefinedShape::new(&shape, &[], &ArcLengthMap::alone(&shape), &FoldModel::new(&parameters, key), 0.0, 20.0);
        let energy_flux = EnergyFlux::new(&parameters, key);
        let [layout, _] = energy_flux.layouts(&refined.sheet_lengths());
        let intervals = layout.count(0) - 1;
        let pieces = refined.pieces(|_| 1.0).count();
        assert!(pieces < intervals / 2, "{pieces} pieces");
        let rays = energy_flux.ray_table(&refined, 0.0);
        let wanted = energy_flux.target_power(&refined, &layout, &rays, 0.0);
        let length = refined.sheet_lengths()[0];
        let flux = parameters.flux_mw_per_m2.at(0.0) * W_PER_KM2 * 2.0 * parameters.half_thickness_km();
        assert!((wanted.sum() / (flux * length) - 1.0).abs() < 1e-9);
        let even = flux * length / intervals as f64;
        for node in &wanted.of_sheet(0)[1..intervals] {
            assert!((node / even - 1.0).abs() < 0.05, "{node} W for {even} W");
        }
    }

    /// The mean of `(1 - (s / r)^2)^2` from s = 0 to 1 is 1 - 2 / (3 r^2) + 1 / (5 r^4): 0.610 for r = 1.15.
    #[test]
    fn the_middle_of_a_sheet_is_1_6_times_as_bright_as_the_mean() {
        let steps = 1000;
        let mean =
            (0..steps).map(|step| lateral_profile((step as f32 + 0.5) / steps as f32)).sum::<f32>() / steps as f32;
        assert!((lateral_profile(0.0) / mean - 1.0 / 0.610).abs() < 0.005, "{mean}");
        assert_eq!([-1.2, 1.15, 3.0].map(lateral_profile), [0.0; 3]);
        assert!(lateral_profile(0.5) == lateral_profile(-0.5) && lateral_profile(1.0) < 0.07);
    }

    #[test]
    fn rays_make_bright_and_quiet_stretches_of_the_same_total() {
        let key = Key::new(2, "precipitation");
        let points = vec![DVec2::ZERO, DVec2::new(500.0, 0.0)];
        let shape = Shape { sheets: vec![Sheet { points, flux: vec![1.0; 2], energy: vec![1.0; 2] }] };
        let powers = |contrast: f64, outer_scale_km: f64| {
            let mut parameters = AuroraParameters::default();
            (parameters.rays.contrast, parameters.rays.outer_scale_km) = (contrast, outer_scale_km);
            let (folds, arc_map) = (FoldModel::new(&parameters, key), ArcLengthMap::alone(&shape));
            let refined = RefinedShape::new(&shape, &[], &arc_map, &folds, 0.0, 20.0);
            let energy_flux = EnergyFlux::new(&parameters, key);
            let [layout, _] = energy_flux.layouts(&refined.sheet_lengths());
            let rays = energy_flux.ray_table(&refined, 0.0);
            let target = energy_flux.target_power(&refined, &layout, &rays, 0.0);
            let nodes = target.of_sheet(0)[1..layout.count(0) - 1].to_vec();
            (target.sum(), nodes)
        };
        let (even, _) = powers(0.0, 80.0);
        let spread = |nodes: &[f64]| {
            let mean = nodes.iter().sum::<f64>() / nodes.len() as f64;
            (nodes.iter().map(|node| (node - mean) * (node - mean)).sum::<f64>() / nodes.len() as f64).sqrt() / mean
        };
        let (total, nodes) = powers(0.6, 80.0);
        assert!((total / even - 1.0).abs() < 1e-9, "{total} of {even}");
        assert!(spread(&nodes) > 0.25, "{}", spread(&nodes));
        let (_, nodes) = powers(0.6, 2.5);
        assert!(spread(&nodes) < 0.15, "rays alone are finer than the intervals: {}", spread(&nodes));
    }
}
