//! The simulation as the rest of the program sees it.

use bansho_base::{
    math::DVec2,
    random::{Key, Purpose},
};

use super::AuroraParticles;
use crate::{
    aurora::{
        AuroraParameters,
        afterglow::Afterglow,
        atmosphere::atmosphere,
        light::Emission,
        shapes::{FRAME_S, Segments, Sequence},
    },
    field::Grid2,
};

const SCATTER: Purpose = Purpose::named("aurora scatter");

/// An aurora's particles, afterglow and field, stepped by frames of 1/30 s.
#[derive(Clone, Debug)]
pub struct AuroraSimulation {
    parameters: AuroraParameters,
    sequence: Sequence,
    emission: Emission,
    particles: AuroraParticles,
    afterglow: Afterglow,
    potential: Grid2,
    counts: Grid2,
    steps: u64,
}

impl AuroraSimulation {
    /// Length of a step, s.
    pub const STEP_S: f64 = FRAME_S;

    /// The aurora `name` at the beginning of its preroll.
    #[must_use]
    pub fn new(parameters: AuroraParameters, sequence: Sequence, name: &str, seed: u64) -> Self {
        let key = Key::new(seed, name);
        let emission = Emission::new(atmosphere(), parameters.spectrum.spectrum());
        let cells = parameters.field.cells as usize;
        let grid = Grid2::new([cells, cells], parameters.cell_km(), [-parameters.extent_km / 2.0; 2]);
        let afterglow = Afterglow::new(parameters.extent_km, parameters.cell_km());
        let mut simulation = Self {
            particles: AuroraParticles::default(),
            potential: grid.clone(),
            counts: grid,
            parameters,
            sequence,
            emission,
            afterglow,
            steps: 0,
        };
        simulation.begin(key);
        simulation
    }

    /// Particles along the first shape.
    fn begin(&mut self, key: Key) {
        let count = self.parameters.particles.count as u64;
        let shape = self.sequence.at(self.time());
        let segments = Segments::new(&shape);
        let half = self.parameters.half_thickness_km();
        let flux = self.parameters.flux_mw_per_m2.at(self.time());
        let energy = self.parameters.energy_ev.at(self.time());
        let power = flux * 1e3 * segments.length() * 2.0 * half / count as f64;
        for id in 0..count {
            let [u, v, ..] = key.uniforms(id, 0, SCATTER).map(f64::from);
            let Some(sample) = segments.sample((id as f64 + u) / count as f64) else { return };
            let normal = DVec2::new(-sample.tangent.y, sample.tangent.x);
            let point = sample.point + normal * half * (2.0 * v - 1.0);
            let particles = &mut self.particles;
            for (component, value) in particles.positions.iter_mut().zip(point.to_array()) {
                component.push(value as f32);
            }
            particles.velocities.iter_mut().for_each(|component| component.push(0.0));
            particles.ids.push(id);
            particles.fades.push(1.0);
            particles.dying.push(false);
            particles.energies_ev.push((energy * sample.energy) as f32);
            particles.powers_w.push((power * sample.flux) as f32);
            particles.sheets.push(sample.segment.sheet as u32);
            particles.shares.push(sample.share as f32);
        }
        self.afterglow.settle(&self.particles);
    }

    /// Time of the state, s.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.steps as f64 * Self::STEP_S - self.parameters.preroll_s
    }

    /// Steps to [`Self::STEP_S`] later.
    pub fn step(&mut self) {
        self.steps += 1;
        let energy = self.parameters.energy_ev.at(self.time());
        self.afterglow.step(&self.particles, &self.emission, energy, Self::STEP_S);
    }

    /// Its parameters.
    #[must_use]
    pub fn parameters(&self) -> &AuroraParameters {
        &self.parameters
    }

    /// Light by energy and altitude for its spectrum.
    #[must_use]
    pub fn emission(&self) -> &Emission {
        &self.emission
    }

    /// Its particles.
    #[must_use]
    pub fn particles(&self) -> &AuroraParticles {
        &self.particles
    }

    /// Where green and red linger.
    #[must_use]
    pub fn afterglow(&self) -> &Afterglow {
        &self.afterglow
    }

    /// Potential of the in-between shape, without noise: of order one, negative, lowest on the shape. Cells of
    /// [`AuroraParameters::cell_km`], x east, z south (thesis, figure 2.12).
    #[must_use]
    pub fn potential(&self) -> &Grid2 {
        &self.potential
    }

    /// How many particles were scattered into each cell about the in-between shape, N(i, j) (thesis, figure 2.10).
    #[must_use]
    pub fn scatter_counts(&self) -> &Grid2 {
        &self.counts
    }
}
