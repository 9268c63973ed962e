//! Electrons that are drawn one by one, to the letter of the thesis: each with a random path of its own (2.4.1), and one photon at most from each collision
//! (2.4.2).
//!
//! The thesis moves an electron by steps of 0.0033 s (table 3.2) at a speed v_f that it does not state, and draws a collision in each with the probability
//! (2.22). At the speed of 10 keV a step would be 193 km and the probability above 1. Here the column density to the next collision is drawn from the
//! distribution that such steps approach as they become short.

use bansho_base::math::random::{Key, Purpose};

use super::track_table::{CollisionBatch, NO_EMISSION, fill_batches};
use crate::{
    parameters::RenderingParameters,
    physics::{
        atmosphere::{LEVELS, atmosphere},
        emission::{EMITTERS, PHOTONS_PER_KILORAYLEIGH, PerEmitter, SpectralEmitter, excitation::DrawnEmission},
        extinction::AttenuationByDistance,
        precipitation::{
            electron_track::Collision,
            energy_grid::{NODES, node_energy_ev},
            hard_sphere::{HardSphereAtmosphere, ion_pairs_of_collision},
        },
    },
};

const EMISSION: Purpose = Purpose::named("aurora drawn emission");

/// What electrons are drawn from.
#[derive(Clone, Debug)]
pub(super) struct DrawnElectrons {
    spheres: HardSphereAtmosphere,
    /// By level of the atmosphere.
    rules: Vec<DrawnEmission>,
    key: Key,
}

/// Buffer for a track, reused.
#[derive(Debug, Default)]
pub(super) struct DrawnTrack {
    collisions: Vec<(Collision, u16)>,
    pub(super) batches: Vec<CollisionBatch>,
}

impl DrawnElectrons {
    /// The electrons of a scene's hard spheres.
    pub(super) fn new(rendering: &RenderingParameters, key: Key) -> Self {
        let (spheres, air) = (&rendering.hard_spheres, atmosphere());
        let quenching_radius = spheres.quenching_radius();
        Self {
            spheres: HardSphereAtmosphere::new(air, spheres.collision_radius(), rendering.collision_deflection),
            rules: air.levels().iter().map(|air| DrawnEmission::new(air, quenching_radius)).collect(),
            key,
        }
    }

    /// The rows of the photon table for drawn emissions, which follow that of [`NO_EMISSION`]: for each emitter its photons at each level, dimmed on their way.
    pub(super) fn photon_rows(attenuation: &AttenuationByDistance) -> impl Iterator<Item = PerEmitter<f32>> {
        EMITTERS.into_iter().flat_map(move |emitter| {
            (0..LEVELS).map(move |level| {
                let mut row = [0.0; EMITTERS.len()];
                row[emitter.index()] = (DrawnEmission::photons(emitter) * attenuation.of_level(level)) as f32;
                row
            })
        })
    }

    /// Brightness of ion pairs per collision for electrons of each node, kR per mW/m^2.
    pub(super) fn pairs() -> Vec<f32> {
        let pairs = |node| ion_pairs_of_collision(node_energy_ev(node)) / PHOTONS_PER_KILORAYLEIGH;
        (0..NODES).map(|node| pairs(node) as f32).collect()
    }

    /// Draws an electron with the energy of `node`, and its photons. Electrons with other numbers are independent.
    pub(super) fn draw(&self, node: usize, number: u64, track: &mut DrawnTrack) {
        track.collisions.clear();
        let collisions = self.spheres.track(node_energy_ev(node), self.key, number);
        track.collisions.extend(collisions.zip(0..).map(|(collision, index)| {
            let [species, line, quenching, _] = self.key.uniforms(number, index, EMISSION);
            let level = (collision.level as usize).min(LEVELS - 1);
            let emitter = self.rules[level].draw([species, line, quenching]);
            (collision, emitter.map_or(NO_EMISSION, |emitter| photon_row(emitter, level)))
        }));
        fill_batches(&track.collisions, &mut track.batches);
    }
}

/// The row of an emitter at a level in the photon table.
fn photon_row(emitter: SpectralEmitter, level: usize) -> u16 {
    NO_EMISSION + 1 + (emitter.index() * LEVELS + level) as u16
}
