//! Particle flame: burning gas as particles that move by smoothed-particle hydrodynamics and radiate as black bodies.
//!
//! # Model
//! Particles carry mass, velocity, temperature, fuel and soot. Pressure, buoyancy, wind, entrainment, vortex rings and turbulence move them;
//! they heat, burn, form soot and cool. Each is drawn as the exact line integral of its kernel, so that sums of sprites are the line
//! integrals of the gas: optical depth, emission, and the optical path that bends light from behind (heat haze). SI units throughout;
//! temperatures in K, luminance in cd/m^2.
//!
//! # References
//! - S. Inagaki, M. Imura, S. Ikeda, Y. Manabe and K. Chihara, "Real-time rendering of flame using particle-based fluid simulation" (in
//!   Japanese). Equation and section numbers are theirs.
//! - G. Heskestad, "Luminous heights of turbulent diffusion flames" (1983): [`heskestad`].
//! - B. McCaffrey, "Purely buoyant diffusion flames" (1979): speed on the plume axis, `simulate::burner`.
//! - B. Cetegen and T. Ahmed, "Experiments on the periodic instability of buoyant plumes and pool fires" (1993): puffing frequency.
//! - R. Bridson, J. Hourihan and M. Nordenstam, "Curl-noise for procedural fluid flow" (2007): `simulate::forces::turbulence`.
//! - W. Dalzell and A. Sarofim, "Optical constants of soot" (1969): [`render::soot_absorption`]; C. Tien, "Thermal radiation properties of
//!   gases" (1968): radiative cooling.
//!
//! # Equations
//! | equation | number | function |
//! |---|---|---|
//! | particles are added at the burner | section 4.3 (1) | `simulate::spawning::Spawner::spawn` |
//! | kernel `W = 315/(64 pi d^9) (d^2 - r^2)^3` | (2) | [`bansho_sph::Poly6`] |
//! | density `rho_i = sum_j m_j W` | (3) | [`bansho_sph::compute_densities`] |
//! | field `A(x) = sum_j m_j A_j / rho_j W`, along a ray | (6) | [`render::line_integral`] |
//! | acceleration `a = f / rho` | (8) | [`bansho_sph::PressureForce`] |
//! | pressure `p = k (rho - rho_0)` | (11) | [`bansho_sph::StateEquation`] |
//! | pressure force | (12) | [`bansho_sph::PressureForce`] |
//! | velocity, then position | section 4.3 (5) | `simulate::integrate::IntegrationStep::advance` |
//! | Planck's law, CIE XYZ, RGB | (13) to (17) | `bansho_base::color::black_body` |
//! | poly6 sprite, opacity by density | section 5.2, figure 2 | [`SpriteStyle::Poly6`](render::SpriteStyle::Poly6) |
//! | squares colored by density | figure 7 | `paper_squares` |
//! | refraction of the background | figures 5 and 6 | `render::deflection` |
//! | flame height `L = 0.235 Q^(2/5) - 1.02 D` | Heskestad | [`heskestad`] |
//! | puffing frequency `1.5 / sqrt(D)` | Cetegen and Ahmed | `simulate::burner::Burner::puffing_hz` |
//!
//! # Data flow
//! 1. `parameters` holds the scene's values; `simulate::derived` derives the constants that the paper leaves open; `fault` are their errors.
//! 2. A step (`simulate::Simulation::step`) runs sub-steps. In each, `simulate::fluid` sorts particles and computes density and pressure
//!    force, `simulate::integrate` advances them (with `simulate::collision`), and `simulate::spawning` adds new ones.
//! 3. Once per step `simulate::combustion` smooths velocity and temperature, burns fuel, forms soot and cools;
//!    `simulate::forces` provides wind, entrainment toward the plume axis, vortex rings and turbulence.
//! 4. `simulate::snapshot` serializes the particles; `phenomenon` is the interface to the rest of Bansho.
//! 5. To draw a frame, `render::depth_layers` gathers statistics and defines depth layers, and `render::project` turns particles into
//!    elliptical sprites.
//! 6. `render::splat` sums sprites on a grid; `render::resolve` interpolates it by splines, adds detail and converts it to light.
//! 7. `render::deflection` takes the gradient of the optical path for heat haze; `render::emitted_light` gives point lights for other
//!    objects; `render::aovs` writes AOVs.
//! 8. `render::prepared` composites layers, squares and [sparks](crate::sparks) into strips.

mod fault;
mod model;
pub(crate) mod paper_squares;
mod parameters;
mod phenomenon;
pub mod render;
pub mod simulate;
#[cfg(test)]
mod tests;

pub use fault::{ParticleFault, ParticleFaultKind};
pub use model::FlameParticles;
pub use parameters::{
    BurnerParameters, BurnerShape, FlameParticlesParameters, FluidParameters, LifeParameters, MotionParameters,
    TemperatureLaw, Tension, WindForce,
};
pub use simulate::{
    burner::heskestad,
    derived::check_particle_count,
    particles::{Particle, Particles},
};
