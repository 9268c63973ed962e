//! What each particle brings into the air: energy and power, by its position on the sheets.

use bansho_base::{math::random::Key, noise::LANES};

use super::AuroraParticles;
use crate::{
    AuroraParameters,
    physics::precipitation::energy_grid::{HIGHEST_EV, LOWEST_EV},
    simulate::sheets::{
        nodes::{NodeLayout, NodeValues},
        rays::{PatternInputs, RayPattern, RayTable},
        refined_shape::{RefinedShape, SheetProjection},
    },
};
use fearless_simd::Level;
use rayon::prelude::*;

/// Particles that a task of the thread pool takes, a multiple of the lanes.
const TASK: usize = 4096;
/// What a particle far from every sheet keeps of its power in a step.
const STRAY_DECAY: f32 = 0.85;
/// Stretches of a sheet that have their drawn power each, at least and at most, and how many particles each has at least where there may be
/// more.
const COARSE: [f64; 2] = [16.0, 32.0];
const PER_COARSE: f64 = 128.0;
/// The same of those along which the particles' own density is evened out: where a fold is born they lie in a heap for seconds.
const FINE: [f64; 2] = [32.0, 256.0];
const PER_FINE: f64 = 64.0;
/// Where particles are scarce, one gets at most this many times what it would have if all were evenly spread.
const MAX_CONCENTRATION: f64 = 6.0;
/// The power of a particle comes this fraction nearer in a step to what it shall be.
const POWER_RELAXATION: f32 = 0.2;
/// Least and most that all powers are changed by to make up for that delay: a flux that is keyed to jump is followed in some steps still.
const BALANCE: [f64; 2] = [0.9, 1.1];
/// W for one mW/m^2 on one km^2.
const W_PER_KM2: f64 = 1e3;

/// The flux and energy of an aurora and the pattern along its sheets.
#[derive(Clone, Debug)]
pub(super) struct EnergyFlux {
    parameters: AuroraParameters,
    rays: RayPattern,
}

/// A part of the arrays that one task works on.
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
        Self { parameters: parameters.clone(), rays: RayPattern::new(parameters, key) }
    }

    /// The coarse and the fine intervals of sheets of those lengths.
    fn layouts(&self, lengths: &[f64]) -> [NodeLayout; 2] {
        let count = self.parameters.particles.count as f64;
        [(PER_COARSE, COARSE), (PER_FINE, FINE)].map(|(per, bounds)| NodeLayout::new(lengths, count / per, bounds))
    }

    /// Power of the electrons on all sheets without pulsation and black rays, by sheet and node, W: flux times length times thickness.
    fn target_power<'a>(&self, refined: &RefinedShape, layout: &'a NodeLayout, time: f64) -> NodeValues<'a> {
        let width = 2.0 * self.parameters.half_thickness_km();
        let flux = self.parameters.flux_mw_per_m2.at(time) * W_PER_KM2 * width;
        let mut wanted = NodeValues::new(layout);
        // Parts as long as half of an interval: sheets that bridge a gap have fewer pieces than nodes.
        refined.for_each_strip(|sheet| 0.5 / (layout.count(sheet) - 1) as f64).for_each(
            |(sheet, arc_fraction, factor, length)| {
                wanted.add(sheet as u32, arc_fraction as f32, flux * factor * length)
            },
        );
        wanted
    }

    /// The pattern along the sheets at a time.
    pub(super) fn ray_table(&self, refined: &RefinedShape, time: f64) -> RayTable {
        self.rays.table(&refined.sheet_lengths(), |sheet, last| refined.arc_coordinates(sheet, last), time)
    }

    /// Gives every particle its fraction of the power.
    ///
    /// All together have the power of the sheets, and those along an interval that of the stretch, however many they are: no
    /// birth, death, split or merge can make the aurora flicker, and the flux along it is the one that was drawn. Within an interval each
    /// stands for the more of the sheet's length the fewer of them there are, and has the rays' pattern.
    pub(super) fn distribute_power(
        &self,
        particles: &mut AuroraParticles,
        (refined, rays): (&RefinedShape, &RayTable),
        time: f64,
    ) {
        let lengths = refined.sheet_lengths();
        let [coarse, fine] = self.layouts(&lengths);
        let weight_chunk = |chunk| self.weight_chunk(chunk, (refined, &fine), (rays, time));
        let weighted: Vec<WeightedChunk> =
            chunks(particles).into_par_iter().with_max_len(1).map(weight_chunk).collect();
        let counts = weighted.iter().fold(NodeValues::new(&fine), |sum, chunk| sum.plus(&chunk.counts));
        let lengths = NodeValues::of_lengths(&fine, &lengths).distributed_by(&counts, MAX_CONCENTRATION);
        let accumulate_weights = |(chunk, weighted): (ParticleChunk, &WeightedChunk)| {
            chunk.accumulate_weights(&weighted.weights, &lengths, &coarse)
        };
        let weights: Vec<_> =
            chunks(particles).into_par_iter().with_max_len(1).zip(&weighted).map(accumulate_weights).collect();
        let weights = weights.iter().fold(NodeValues::new(&coarse), |sum, chunk| sum.plus(chunk));
        let factors = self.target_power(refined, &coarse, time).distributed_by(&weights, MAX_CONCENTRATION);
        let given: Vec<[f64; 2]> =
            chunks(particles).into_par_iter().with_max_len(1).map(|chunk| chunk.assign_powers(&factors)).collect();
        balance(particles, &given);
    }

    /// Weighs a chunk of particles, as negative powers while they wait for their factors.
    fn weight_chunk<'a>(
        &self,
        chunk: ParticleChunk,
        (refined, layout): (&RefinedShape, &'a NodeLayout),
        (rays, time): (&RayTable, f64),
    ) -> WeightedChunk<'a> {
        let mut weighted = WeightedChunk { counts: NodeValues::new(layout), weights: vec![0.0; chunk.fades.len()] };
        let (level, energy) = (Level::new(), self.parameters.energy_ev.at(time));
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
            let pattern = self.rays.at(level, &inputs, time);
            for (lane, projection) in projections.into_iter().enumerate().take(count) {
                let index = first + lane;
                let Some(projection) = projection else {
                    chunk.full_powers[index] *= STRAY_DECAY;
                    chunk.powers[index] = chunk.fades[index] * chunk.full_powers[index];
                    continue;
                };
                let weight = projection.flux as f32 * pattern.brightness[lane];
                weighted.counts.add(projection.sheet, projection.fraction as f32, f64::from(chunk.fades[index]));
                weighted.weights[index] = weight;
                chunk.powers[index] = -weight * pattern.dimming[lane];
                let own = energy * projection.energy * f64::from(pattern.hardness[lane]);
                chunk.energies[index] = own.clamp(LOWEST_EV, HIGHEST_EV) as f32;
                chunk.arc_fractions[index] = projection.fraction as f32;
                chunk.sheets[index] = projection.sheet;
            }
        }
        weighted
    }
}

/// A chunk of particles, weighed.
struct WeightedChunk<'a> {
    /// How many there are along the sheets.
    counts: NodeValues<'a>,
    /// The weight of each before black rays and pulsation; 0 for strays.
    weights: Vec<f32>,
}

impl ParticleChunk<'_> {
    fn project(&self, refined: &RefinedShape, index: usize) -> Option<SheetProjection> {
        refined.project([f64::from(self.positions[0][index]), f64::from(self.positions[1][index])].into())
    }

    /// Adds up the weights of particles that stand for so much of the sheets' length each, and gives it to their negative powers.
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

    /// Gives particles that wait for them their factors. Their power follows what it shall be with a delay: where two parts of a sheet
    /// lie close together, a particle that passes from the one to the other does not flash. Gives the power that they shall have together, and
    /// the one that they have, W.
    fn assign_powers(self, factors: &NodeValues) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for (index, power) in self.powers.iter_mut().enumerate().filter(|(_, power)| power.is_sign_negative()) {
            let (sheet, arc_fraction) = (self.sheets[index], self.arc_fractions[index]);
            let wanted = -*power * factors.at(sheet, arc_fraction) as f32;
            let full = &mut self.full_powers[index];
            // Those that are just appearing begin with nothing: as fast as they rise, those around them give up their fraction.
            let follows = *full > 0.0 || self.fades[index] < 1.0;
            *full = if follows { *full + POWER_RELAXATION * (wanted - *full) } else { wanted };
            *power = self.fades[index] * *full;
            sums[0] += f64::from(self.fades[index] * wanted);
            sums[1] += f64::from(*power);
        }
        sums
    }
}

/// Makes up for the delay with which powers follow, from the powers that parts of the particles shall have and those that they have: else all
/// would be too bright while many are being born, for those that were there give up their fraction late.
fn balance(particles: &mut AuroraParticles, given: &[[f64; 2]]) {
    let [wanted, found] = given.iter().fold([0.0; 2], |sum, chunk| [sum[0] + chunk[0], sum[1] + chunk[1]]);
    if found > 0.0 {
        let factor = (wanted / found).clamp(BALANCE[0], BALANCE[1]) as f32;
        particles.powers_w.par_chunks_mut(TASK).for_each(|powers| powers.iter_mut().for_each(|power| *power *= factor));
    }
}

fn chunks(particles: &mut AuroraParticles) -> Vec<ParticleChunk<'_>> {
    let [xs, zs] = &particles.positions;
    let reads = xs.chunks(TASK).zip(zs.chunks(TASK)).zip(particles.fades.chunks(TASK));
    let powers = particles.powers_w.chunks_mut(TASK).zip(particles.full_powers_w.chunks_mut(TASK));
    let light = particles.energies_ev.chunks_mut(TASK).zip(powers);
    let inputs = particles.arc_fractions.chunks_mut(TASK).zip(particles.sheets.chunks_mut(TASK));
    let chunk = |(((xs, zs), fades), ((energies, (powers, full_powers)), (arc_fractions, sheets)))| ParticleChunk {
        positions: [xs, zs],
        fades,
        energies,
        powers,
        full_powers,
        arc_fractions,
        sheets,
    };
    reads.zip(light.zip(inputs)).map(chunk).collect()
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
        let (parameters, key) = (AuroraParameters::default(), Key::new(2, "precipitation"));
        // As long as a bridge over a gap.
        let points = vec![DVec2::ZERO, DVec2::new(17.0, 0.0)];
        let sheet = Sheet { points, flux: vec![1.0; 2], energy: vec![1.0; 2] };
        let shape = Shape { sheets: vec![sheet] };
        let refined = RefinedShape::new(
            (&shape, &[]),
            &ArcLengthMap::alone(&shape),
            &FoldModel::new(&parameters, key),
            0.0,
            20.0,
        );
        let energy_flux = EnergyFlux::new(&parameters, key);
        let [layout, _] = energy_flux.layouts(&refined.sheet_lengths());
        let intervals = layout.count(0) - 1;
        let for_each_strip = refined.for_each_strip(|_| 1.0).count();
        assert!(for_each_strip < intervals / 2, "{for_each_strip} pieces");
        let wanted = energy_flux.target_power(&refined, &layout, 0.0);
        let length = refined.sheet_lengths()[0];
        let flux = parameters.flux_mw_per_m2.at(0.0) * W_PER_KM2 * 2.0 * parameters.half_thickness_km();
        assert!((wanted.sum() / (flux * length) - 1.0).abs() < 1e-9);
        let even = flux * length / intervals as f64;
        for node in &wanted.of_sheet(0)[1..intervals] {
            assert!((node / even - 1.0).abs() < 0.05, "{node} W for {even} W");
        }
    }
}
