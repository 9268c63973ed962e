//! What each particle brings into the air: energy and power, by its place on the sheets.

use bansho_base::{noise::LANES, random::Key};
use fearless_simd::Level;
use rayon::prelude::*;

use super::{
    AuroraParticles,
    course::{Course, Foot},
    rays::{Places, Rays},
};
use crate::aurora::{
    AuroraParameters,
    precipitation::energy::{HIGHEST_EV, LOWEST_EV},
};

/// Particles that a task of the thread pool takes, a multiple of the lanes.
const TASK: usize = 4096;
/// What a particle far from every sheet keeps of its power in a step.
const STRAY: f32 = 0.85;
/// W for one mW/m^2 on one km^2.
const W_PER_KM2: f64 = 1e3;

/// The flux and energy of an aurora and the pattern along its sheets.
#[derive(Clone, Debug)]
pub(super) struct Precipitation {
    parameters: AuroraParameters,
    rays: Rays,
}

/// A stretch of the arrays that one task works on.
struct Stretch<'a> {
    positions: [&'a [f32]; 2],
    fades: &'a [f32],
    energies: &'a mut [f32],
    powers: &'a mut [f32],
    shares: &'a mut [f32],
    sheets: &'a mut [u32],
}

impl Precipitation {
    pub(super) fn new(parameters: &AuroraParameters, key: Key) -> Self {
        Self { parameters: parameters.clone(), rays: Rays::new(parameters, key) }
    }

    /// Power of the electrons on all sheets without pulsation and black rays, W: flux times length times thickness.
    pub(super) fn power_w(&self, course: &Course, time: f64) -> f64 {
        let area = course.flux_length() * 2.0 * self.parameters.half_thickness_km();
        self.parameters.flux_mw_per_m2.at(time) * W_PER_KM2 * area
    }

    /// Gives every particle its share of the power. All together have the power of the sheets whatever their number, so that no
    /// birth, death, split or merge can make the whole flicker.
    pub(super) fn share_out(&self, particles: &mut AuroraParticles, course: &Course, time: f64) {
        let sums: Vec<f64> = stretches(particles).into_par_iter().map(|part| self.weigh(part, course, time)).collect();
        let sum: f64 = sums.iter().sum();
        let factor = if sum > 0.0 { (self.power_w(course, time) / sum) as f32 } else { 0.0 };
        // What is still negative waits for the factor; strays have their power already.
        particles.powers_w.iter_mut().filter(|power| **power < 0.0).for_each(|power| *power *= -factor);
    }

    /// Weighs a stretch of particles, as negative powers, and gives the sum of weights before black rays and pulsation.
    fn weigh(&self, part: Stretch, course: &Course, time: f64) -> f64 {
        let (level, energy) = (Level::new(), self.parameters.energy_ev.at(time));
        let side_scale = 1.0 / self.parameters.half_thickness_km();
        let mut sum = 0.0;
        for first in (0..part.fades.len()).step_by(LANES) {
            let count = LANES.min(part.fades.len() - first);
            let foot = |lane: usize| if lane < count { part.foot(course, first + lane) } else { None };
            let feet: [Option<Foot>; LANES] = std::array::from_fn(foot);
            let places = Places {
                along: feet.map(|foot| foot.map_or(0.0, |foot| foot.along)),
                side: feet.map(|foot| foot.map_or(0.0, |foot| (foot.side * side_scale) as f32)),
            };
            let pattern = self.rays.at(level, &places, time);
            for (lane, foot) in feet.into_iter().enumerate().take(count) {
                let index = first + lane;
                let Some(foot) = foot else {
                    part.powers[index] *= STRAY;
                    continue;
                };
                let weight = part.fades[index] * foot.flux as f32 * pattern.brightness[lane];
                sum += f64::from(weight);
                part.powers[index] = -weight * pattern.dimming[lane];
                let own = energy * foot.energy * f64::from(pattern.hardness[lane]);
                part.energies[index] = own.clamp(LOWEST_EV, HIGHEST_EV) as f32;
                part.shares[index] = foot.share as f32;
                part.sheets[index] = foot.sheet;
            }
        }
        sum
    }
}

impl Stretch<'_> {
    fn foot(&self, course: &Course, index: usize) -> Option<Foot> {
        course.foot([f64::from(self.positions[0][index]), f64::from(self.positions[1][index])].into())
    }
}

fn stretches(particles: &mut AuroraParticles) -> Vec<Stretch<'_>> {
    let [xs, zs] = &particles.positions;
    let reads = xs.chunks(TASK).zip(zs.chunks(TASK)).zip(particles.fades.chunks(TASK));
    let light = particles.energies_ev.chunks_mut(TASK).zip(particles.powers_w.chunks_mut(TASK));
    let places = particles.shares.chunks_mut(TASK).zip(particles.sheets.chunks_mut(TASK));
    let stretch = |(((xs, zs), fades), ((energies, powers), (shares, sheets)))| Stretch {
        positions: [xs, zs],
        fades,
        energies,
        powers,
        shares,
        sheets,
    };
    reads.zip(light.zip(places)).map(stretch).collect()
}
