//! Particle flame: burning gas as particles that move by smoothed-particle hydrodynamics and radiate as black bodies.
//!
//! # Model
//! Particles carry mass, velocity, temperature, fuel and soot. Pressure, buoyancy, wind, entrainment, vortex rings and turbulence move them.
//! They burn, heat up, form soot and cool. Each is drawn as the exact line integral of its kernel, so that sums of sprites are the line
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
//! | equation | what it says | function |
//! |---|---|---|
//! | (1) | `rho a = -grad p + f`: Euler's equation | `simulate::integrate::IntegrationStep::apply_forces` |
//! | (2) | `W = 315/(64 pi d^9) (d^2 - r^2)^3`: poly6 kernel | [`bansho_sph::Poly6`] |
//! | (3) | `rho_i = sum_j m_j W`: density | [`bansho_sph::compute_densities`] |
//! | (6) | `A(x) = sum_j m_j A_j / rho_j W`: field of a quantity A, at particles and along a ray | [`bansho_sph::Cells::sum`], [`render::line_integral`] |
//! | (7) | `grad A = sum_j m_j A_j / rho_j grad W`: its gradient; for heat haze, of the line integrals | [`bansho_sph::SmoothingKernel::gradient_factor`], `render::deflection::OpticalPathField::add_gradient` |
//! | (8) | `a_i = f_i / rho_i`: acceleration | [`bansho_sph::PressureForce::compute_accelerations`] |
//! | (9), (10) | `f_i = -grad p_i`, by (7): pressure force, replaced by its symmetric form (12) | [`bansho_sph::PressureForce::compute_accelerations`] |
//! | (11) | `p = k (rho - rho_0)`: pressure | [`bansho_sph::StateEquation::pressure`] |
//! | (12) | `f_i = -sum_j m_j (p_i + p_j) / (2 rho_j) grad W`: symmetric pressure force | [`bansho_sph::PressureForce::compute_accelerations`] |
//! | (13) | Planck's law | [`bansho_base::color::planck_radiance_per_nm`] |
//! | (14) to (16) | CIE XYZ of a spectrum | [`bansho_base::color::xyz_of_spectrum`] |
//! | (17) | XYZ to RGB, here ACEScg | [`acescg_from_xyz`](bansho_base::color::space::acescg_from_xyz) |
//! | section 4.2.3 | the wind as the external force | `simulate::euler::EulerStep::wind_force` |
//! | section 4.3, step 1 | particles are added at the burner | `simulate::spawning::Spawner::spawn`, `simulate::euler::EulerStep::add_particles` |
//! | section 4.3, step 2 | pairs nearer than d | [`bansho_sph::Cells::assign`] |
//! | section 4.3, step 5 | velocity, then position | `simulate::integrate::IntegrationStep::advance`, `simulate::euler::EulerStep::integrate` |
//! | section 6.2 | about 3000 particles | `simulate::euler::EulerStep::remove_oldest` |
//! | section 5.1, figure 1 | table of color over temperature, 1 to 10,000 K | [`bansho_base::color::black_body`] |
//! | section 5.2, figure 2 | poly6 as the sprite, opacity by density | `render::prepared::RadianceSprites::density_values` |
//! | section 5.3, figures 3 to 6 | refraction of the background | `render::deflection::optical_path`, `render::deflection::profile`, `render::deflection::HeatHaze` |
//! | figure 7 | squares colored by density | `render::paper_squares::Squares::draw` |
//! | Heskestad 1983 | `L = 0.235 Q^(2/5) - 1.02 D`: flame height | [`heskestad`] |
//! | Cetegen and Ahmed 1993 | `1.5 / sqrt(D)` Hz: puffing frequency | `simulate::burner::Burner::puffing_hz` |
//!
//! (4) and (5) are a property of kernels that integrate to 1.
//!
//! # Data flow
//! 1. `parameters` holds the scene's values; `simulate::derived` derives the constants that the paper does not state; `error` has the errors of
//!    combinations of values.
//! 2. A step (`simulate::Simulation::step`) runs sub-steps. In each, `simulate::fluid` sorts particles and computes density and pressure
//!    force, `simulate::integrate` advances them (with `simulate::collision`), and `simulate::spawning` adds new ones.
//! 3. Once per step `simulate::combustion` smooths velocity and temperature, burns fuel, forms soot and cools;
//!    `simulate::forces` provides wind, entrainment toward the plume axis, vortex rings and turbulence.
//!    `simulate::euler` is a step of the paper's algorithm instead (`gas_model = "euler"`).
//! 4. `simulate::snapshot` serializes the particles; `past_states` keeps the states of a long exposure; `run` steps and draws one shot, and
//!    `phenomenon` is what all shots share, as the rest of Bansho sees it.
//! 5. To draw a frame, `render::depth_layers` gathers statistics and defines depth layers, and `render::project` turns particles into
//!    elliptical sprites.
//! 6. `render::splat` sums sprites on a grid; `render::resolve` interpolates it by splines, adds detail and converts it to light.
//! 7. `render::deflection` takes the gradient of the optical path for heat haze; `render::emitted_light` gives point lights for other
//!    objects; `render::aovs` writes AOVs.
//! 8. `render::prepared` composites layers, squares and [sparks](crate::sparks) into strips.

mod error;
mod model;
mod paper_settings;
mod parameters;
mod past_states;
mod phenomenon;
pub mod render;
mod run;
pub mod simulate;
#[cfg(test)]
mod tests;

pub use error::{ParticleError, ParticleErrorKind};
pub use model::FlameParticles;
pub use parameters::{
    BurnerParameters, BurnerShape, CombustionParameters, FlameParticlesParameters, FluidParameters, ForceParameters,
    GasModel, NegativePressure, TemperatureLaw, WindForce,
};
pub use run::FlameParticlesRun;
pub use simulate::{
    burner::heskestad,
    derived::check_particle_count,
    particles::{GasParticles, Particle},
};
