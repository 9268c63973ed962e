//! How the air's own motion carries the gas of each burner: the draw toward the axis, vortex rings, eddies; sixteen particles at a time.

use bansho_base::math::Vec3;
use fearless_simd::{Level, Simd, dispatch, prelude::*};
use rayon::prelude::*;

use super::{narrowing::Axis, particles::Particles, puffing::Ring, turbulence::Eddies};
use crate::lanes::{LANES, Lanes, Real};

/// Particles of a task.
const PARTICLES_OF_TASK: usize = 512;

/// What acts on the gas of one burner.
pub(crate) struct Draught<'a> {
    pub(crate) rings: Vec<Ring>,
    pub(crate) axis: Axis,
    pub(crate) eddies: Eddies<'a>,
    pub(crate) turbulence: f32,
    /// Age at which turbulence has grown to half its strength, s.
    pub(crate) turbulent_age: f32,
    /// Entrainment coefficient over the radius of the fire, 1/m.
    pub(crate) entrainment: f32,
    /// Coefficient of the drag of air that blows across, over the radius of the fire, 1/m.
    pub(crate) drag: f32,
    /// Share of its fuel that gas burns in a metre of its way, and in a second.
    pub(crate) burning: [f32; 2],
}

/// The air's motion at the place of a particle, m/s.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Flow {
    /// That of rings and of the draw toward the axis.
    steady: Vec3,
    /// That of eddies of unit strength.
    eddies: Vec3,
}

impl Draught<'_> {
    /// Velocity with which the air carries gas of `speed` and `age`, m/s.
    #[inline(always)]
    pub(crate) fn velocity(&self, flow: &Flow, speed: f32, age: f32) -> Vec3 {
        let grown = age / (age + self.turbulent_age);
        flow.steady + flow.eddies * (self.turbulence * speed * grown)
    }

    /// The motion at sixteen places: first the steady part, then that of eddies.
    #[inline(always)]
    fn flow<S: Simd>(&self, simd: S, place: &[Lanes<S>; 3]) -> [[Lanes<S>; 3]; 2] {
        let mut steady = self.axis.velocity(simd, place);
        for ring in &self.rings {
            ring.add_velocity(place, &mut steady);
        }
        let eddies = if self.turbulence > 0.0 { self.eddies.velocity(simd, place) } else { [place[0].like(0.0); 3] };
        [steady, eddies]
    }
}

/// Finds the air's motion at every particle.
pub(crate) fn flows(draughts: &[Draught], particles: &Particles, flows: &mut Vec<Flow>) {
    flows.resize(particles.len(), Flow::default());
    let level = Level::new();
    flows.par_chunks_mut(PARTICLES_OF_TASK).enumerate().for_each(|(task, flows)| {
        dispatch!(level, simd => flows_of(simd, draughts, particles, task * PARTICLES_OF_TASK, flows));
    });
}

/// The motion at the particles from `first` on, burner by burner.
#[inline(always)]
fn flows_of<S: Simd>(simd: S, draughts: &[Draught], particles: &Particles, first: usize, flows: &mut [Flow]) {
    let burners = &particles.burner[first..first + flows.len()];
    let mut own = Vec::with_capacity(flows.len());
    for (number, draught) in draughts.iter().enumerate() {
        own.clear();
        own.extend((0..flows.len()).filter(|index| burners[*index] as usize == number));
        for batch in own.chunks(LANES) {
            let mut place = [Lanes::splat(simd, 0.0); 3];
            for c in 0..3 {
                let mut values = [0.0; LANES];
                for (value, index) in values.iter_mut().zip(batch) {
                    *value = particles.position[c][first + index];
                }
                place[c] = Lanes::from_slice(simd, &values);
            }
            let motion = draught.flow(simd, &place);
            let mut values = [[[0.0; LANES]; 3]; 2];
            for part in 0..2 {
                for c in 0..3 {
                    motion[part][c].store_slice(&mut values[part][c]);
                }
            }
            for (lane, index) in batch.iter().enumerate() {
                let [steady, eddies] = &values;
                flows[*index] = Flow {
                    steady: Vec3::new(steady[0][lane], steady[1][lane], steady[2][lane]),
                    eddies: Vec3::new(eddies[0][lane], eddies[1][lane], eddies[2][lane]),
                };
            }
        }
    }
}
