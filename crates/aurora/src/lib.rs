//! An aurora: sheets drawn by an artist, electrons that follow them, and the light that these excite in the atmosphere.
//!
//! The artist draws the sheets as curves in the plane at 100 km altitude. An electric field attracts particles to the curves; each particle
//! represents many precipitating electrons. These ionize and excite O and N2, whose emission lines are integrated along field lines for every
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
//! # Equations
//!
//! | equation | what it says | function |
//! |---|---|---|
//! | (2.1) | control points of a stroke | `shapes::geometry::polyline::resample_by_index` |
//! | (2.2) | charge density | `simulate::field::sheet_field::FieldBuilder::charge_density` |
//! | (2.3) | Poisson's equation | [`PoissonSolver::solve`](simulate::field::PoissonSolver::solve) |
//! | (2.4), (2.5) | second derivatives by central differences | [`PoissonSolver::solve`](simulate::field::PoissonSolver::solve) |
//! | (2.6) | Gauss-Seidel iteration | [`gauss_seidel_sweep`](simulate::field::gauss_seidel_sweep) |
//! | (2.7) | electric field, the negative gradient of the potential | `simulate::field::sheet_field::FieldBuilder::sample_table` |
//! | (2.8), (2.9) | its components by central differences | [`Grid2::gradient`](simulate::field::Grid2::gradient) |
//! | (2.10) | Lorentz force | `simulate::forces::Integrator::integrate` |
//! | (2.11) | density of particles | [`bansho_sph::compute_densities`] |
//! | (2.12) | poly6 kernel | [`bansho_sph::Poly6`] |
//! | (2.13) | pressure | [`bansho_sph::StateEquation::pressure`] |
//! | (2.14) | repulsion: pressure force | [`bansho_sph::PressureForce::compute_accelerations`] |
//! | (2.15), (2.16) | spiky kernel and its gradient | [`bansho_sph::Spiky`] |
//! | (2.17), (2.18) | cubic spline kernel and its gradient | [`bansho_sph::CubicSpline`] |
//! | (2.19), (2.20) | position and velocity after a step | `simulate::forces::Integrator::integrate` |
//! | (2.21) | step of an electron along B and a deflection, replaced by steps from collision to collision | `physics::precipitation::electron_track::TrackState::advance`, `physics::emission::Emission::lateral_spread_km` |
//! | (2.22) | probability of a collision | [`HardSphereAtmosphere::track`](physics::precipitation::HardSphereAtmosphere::track) |
//! | (2.23) | step in the picture, replaced by the projection of every collision | `render::project::altitude_polynomial::RowPolynomials::points` |
//! | (2.24) | next position, deflected by a collision | `physics::precipitation::electron_track::TrackState::advance` |
//! | (2.25) | probability of quenching | [`hard_sphere_quenching`](physics::emission::excitation::hard_sphere_quenching), [`radiated_fraction`](physics::emission::quenching::radiated_fraction) |
//! | (2.26) | mean thermal speed | [`thermal_speed`](physics::emission::excitation::thermal_speed) |
//! | (2.27) | attenuation by distance, by default replaced by the extinction of the lower atmosphere | `physics::extinction::AttenuationByDistance`, [`Extinction::transmittance`](physics::extinction::Extinction::transmittance) |
//! | (2.28) | Gaussian blur in the picture | `render::single_collisions::blur::BlurKernel::new`, `render::single_collisions::blur::BlurredImage::new` |
//! | (2.29) | XYZ of spectral lines | `physics::emission::emitter::absolute_xyz`, `physics::emission::emitter::table_2_1_srgb` |
//! | (2.30) | XYZ to RGB, by default ACEScg | `physics::emission::emitter::table_2_1_srgb`, [`ACESCG_FROM_XYZ`](bansho_base::color::space::ACESCG_FROM_XYZ) |
//! | section 2.2.2 | in-between shapes by cubic splines | [`Sequence::at`](shapes::Sequence::at) |
//! | section 2.3.3 | limit of the speed by conservation of energy | `simulate::forces::Integrator::energy_limit_factor` |
//! | section 2.3.4, table 3.3 | births and deaths of particles | `simulate::relocation::Relocation::relocate` |
//! | section 2.4.2 | species by number density, line by production rate | [`mean_hard_sphere_photons`](physics::emission::excitation::mean_hard_sphere_photons) |
//! | Fang et al. (1) to (5) | ionization by altitude and energy | [`MonoenergeticBeam::ionization`](physics::precipitation::fang2010::MonoenergeticBeam::ionization) |
//! | Broadfoot (1967) | photons of 391.4 nm of an ion in sunlight | `physics::emission::resonant_scattering::scattered_photons_per_ion_pair` |
//! | Bridson et al. (2007) | flow of the swirls: curl of noise | `simulate::sheets::swirls::Swirls::velocities` |
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
//! 8. integrates the emission along each line of sight (`integrate`), or rasterizes single collisions instead (`single_collisions`),
//! 9. applies the extinction and converts to color (`shade`); pixels of any lens sample the chart (`prepared`).

pub(crate) mod model;
mod paper_settings;
mod parameters;
mod phenomenon;
pub mod physics;
pub mod render;
mod run;
pub mod shapes;
pub mod simulate;

pub use model::Aurora;
pub use parameters::{
    AuroraParameters, AuroraStage, DiffuseParameters, FieldCharge, FieldParameters, FieldSolver, FoldParameters,
    NeighborSearch, ParticleParameters, PowerDistribution, PulsationParameters, RayParameters, RelocationParameters,
    RepulsionForce, RepulsionKernel, SpectrumShape, SwirlParameters,
};
pub use render::{Blur, BlurParameters, RenderingParameters, Sampling, TrackModel};
pub use run::AuroraRun;
