//! An aurora: sheets drawn by an artist, electrons that follow them, and the light that these excite in the atmosphere.
//!
//! The artist draws the sheets as curves in the plane at 100 km altitude. An electric field attracts particles to the curves; each particle
//! stands for many precipitating electrons. These ionize and excite O and N2, whose emission lines are integrated along field lines for every
//! pixel.
//!
//! # References
//!
//! - K. Sekiguchi, "A study on artist-controllable aurora simulation": "the thesis". Its sections, equations and figures are cited by number.
//! - X. Fang et al. (2010), Parameterization of monoenergetic electron impact ionization, GRL 37, L22106: altitude profiles of ionization.
//! - J. M. Picone et al. (2002), NRLMSISE-00, J. Geophys. Res. 107, 1468: the atmosphere.
//! - A. Vallance Jones (1974), *Aurora*; M. H. Rees (1989), *Physics and Chemistry of the Upper Atmosphere*: yields and line ratios.
//! - F. Kasten and A. T. Young (1989): air mass for the extinction in the lower atmosphere.
//!
//! # Equations of the thesis
//!
//! | equation | meaning | function |
//! |---|---|---|
//! | (2.1) | control points of a stroke | `shapes::geometry::polyline::resample_by_index` |
//! | (2.2) | charge density | `simulate::field::sheet_field::FieldBuilder::charge_density` |
//! | (2.3) to (2.5) | Poisson's equation | [`PoissonSolver::solve`](simulate::field::PoissonSolver::solve) |
//! | (2.6) | Gauss-Seidel iteration | [`gauss_seidel_sweep`](simulate::field::gauss_seidel_sweep) |
//! | (2.7) to (2.9) | electric field by central differences | [`Grid2::gradient`](simulate::field::Grid2::gradient), `FieldBuilder::sample_table` |
//! | (2.10) | Lorentz force | `simulate::forces::Integrator::integrate` |
//! | (2.11), (2.12), (2.17) | SPH density | `simulate::forces::Repulsion::compute_accelerations`, by [`bansho_sph::compute_densities`] |
//! | (2.13) | pressure | [`bansho_sph::StateEquation::pressure`] |
//! | (2.14) to (2.16), (2.18) | pressure force | [`bansho_sph::PressureForce`] |
//! | (2.19), (2.20) | time integration | `simulate::forces::Integrator::integrate` |
//! | 2.3.4, table 3.3 | births and deaths | `simulate::relocation::Relocation::relocate` |
//! | (2.21), (2.24) | deflection by collisions | `physics::precipitation::electron_track::TrackState::advance`, `lateral_spread` |
//! | (2.22) | collision probability | [`HardSphereAtmosphere`](physics::precipitation::HardSphereAtmosphere) |
//! | (2.25), (2.26) | quenching by collisions, thermal speed | [`hard_sphere_quenching`](physics::emission::collisions::hard_sphere_quenching), [`thermal_speed`](physics::emission::collisions::thermal_speed) |
//! | (2.27) | attenuation; here the extinction of the lower atmosphere | [`Extinction::transmittance`](physics::extinction::Extinction::transmittance) |
//! | (2.28) | Gaussian blur in the picture | `single_collisions::blur::BlurredImage` |
//! | (2.29) | spectral lines to XYZ | [`Emitter::color_per_kilorayleigh`](physics::emission::Emitter::color_per_kilorayleigh) |
//! | (2.30) | XYZ to RGB | [`bansho_base::color`] |
//!
//! Equations (1) to (5) of Fang et al. are [`physics::precipitation::fang2010`].
//!
//! # Data flow
//!
//! 1. [`shapes`] turns strokes, SVG paths and named forms into control points and interpolates them in time: [`shapes::Sequence::at`].
//! 2. [`simulate::AuroraSimulation::step`] refines and folds the sheets, scatters charge on them and solves for the potential,
//! 3. moves the particles by the field and their repulsion, creates and removes particles where the shape changes,
//! 4. distributes the energy flux of the sheets to the particles, with rays and pulsation,
//! 5. and updates the afterglow maps of the green and red lines ([`simulate::afterglow`]).
//! 6. [`physics`] has the tables: ionization by energy and altitude, photons per ion pair, lifetimes, colors.
//! 7. [`render`] projects field lines to a chart about the magnetic zenith (`project`), bins particles and afterglow cells by longitude and
//!    distance (`bin`),
//! 8. integrates the emission along each line of sight (`integrate`), or rasterizes single collisions instead ([`single_collisions`]),
//! 9. applies the extinction and converts to color (`shade`); pixels of any lens sample the chart (`prepared`).

pub(crate) mod model;
mod parameters;
mod phenomenon;
pub mod physics;
pub mod render;
pub mod shapes;
pub mod simulate;
pub mod single_collisions;

pub use model::Aurora;
pub use parameters::{
    AuroraParameters, FieldCharge, FieldParameters, FieldSolver, FoldParameters, ParticleParameters,
    PulsationParameters, RayParameters, RelocationParameters, RepulsionKernel, SpectrumShape,
};
pub use render::{Blur, BlurParameters, DrawingParameters, Sampling, TrackModel};
