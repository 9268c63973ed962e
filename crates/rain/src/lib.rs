//! Rain: streaks whose opacity, number and light follow from the physics of drops.
//!
//! Near drops are streaks, drawn one by one or on billboards with streak textures; all other drops are a participating medium with extinction and
//! single scattering (airlight, halos around lamps). Everything is a closed form of time: there is no simulation state.
//!
//! # References
//! - Y. Yoshida, Y. Dobashi and T. Yamamoto, "A fast rendering method of raindrop streaks for rainy scenes" (in Japanese): "the paper".
//! - J. S. Marshall and W. M. Palmer, "The distribution of raindrops with size", J. Meteor. 5 (1948).
//! - R. Gunn and G. D. Kinzer, "The terminal velocity of fall for water droplets in stagnant air", J. Meteor. 6 (1949); density correction of
//!   G. B. Foote and P. S. du Toit, J. Appl. Meteor. 8 (1969).
//! - S. Starik and M. Werman, "Simulation of rain in videos" (2002); K. Garg and S. K. Nayar, "Vision and rain" (2007): opacity of streaks.
//! - K. Garg and S. K. Nayar, "Photorealistic rendering of rain streaks" (2006): speckle of oscillating drops; frequencies of Lord Rayleigh (1879).
//! - C. Kulla and M. Fajardo, "Importance sampling techniques for path tracing in participating media" (2012): equiangular sampling.
//! - R. L. Cook, J. Halstead, M. Planck and D. Ryu, "Stochastic simplification of aggregate detail" (2007): far billboards.
//! - L. Williams, "Casting curved shadows on curved surfaces" (1978); W. Reeves, D. Salesin and R. Cook, "Rendering antialiased shadows with depth maps" (1987); J. Hart,
//!   "Sphere tracing" (1996): shadow maps.
//! - H. Koschmieder (1924): visibility, and the radiance of infinitely deep rain.
//!
//! # Equations
//!
//! | equation | what it says | function |
//! |---|---|---|
//! | (1) | `n = 8000 exp(-4.1 R^-0.21 D)`: drop size distribution | [`DropSizeDistribution::marshall_palmer`](drops::size_distribution::DropSizeDistribution::marshall_palmer) |
//! | (2) | `v = sqrt(4 g D (rho_p - rho_f) / (3 rho_f C))`: terminal velocity | [`fixed_point_velocity`](drops::terminal_velocity::fixed_point_velocity) |
//! | (3) | `C = 24 / Re`, or `(0.55 + 4.8 / sqrt(Re))^2` from `Re = 1`: drag coefficient of a sphere | [`drag_coefficient`](drops::terminal_velocity::drag_coefficient) |
//! | (4) | `Re = v rho_f D / mu`: Reynolds number | [`reynolds_number`](drops::terminal_velocity::reynolds_number) |
//! | section 4, opacity | `2 D / v`: opacity of a streak | [`paper_opacity`](streaks::coverage::paper_opacity()); by default replaced by `2 sqrt(r^2 - b^2) / (v T)`: [`Streak::profile`](streaks::coverage::Streak::profile), [`Streak::opacity`](streaks::coverage::Streak::opacity) |
//! | section 4, textures | streak texture T(R, D) | [`StreakCube::draw`](billboards::texture::StreakCube::draw) |
//! | section 4, all textures | textures of all rates and diameters, in 8 bits | [`TextureSet::new`](textured_billboards::TextureSet::new) |
//! | section 5.1 | a billboard turns about the vertical to face the camera | `billboards::Billboards::billboard`, with `method = "textures"` `textured_billboards::quads::Quad::new` |
//! | section 5.2 | light of a lamp falls with the square of its distance; radiance of a drop `E p / (4 pi)` | `lighting::drop_lighting::DropLighting::add`, with `method = "textures"` `textured_billboards::quads::Quad::new` |
//! | oscillation | `f = sqrt(n (n - 1) (n + 2) sigma / (rho r^3)) / (2 pi)`: frequency of mode n of a drop | [`mode_frequency`](streaks::oscillation::mode_frequency) |
//! | drops of a bin | integral of `n dD` over the bin; the fractional part is a probability | [`SizeBin::count`](drops::size_distribution::SizeBin::count), [`stratified_count`](drops::size_distribution::stratified_count) |
//! | measured velocity | Gunn and Kinzer (1949) | [`measured_velocity`](drops::terminal_velocity::measured_velocity) |
//! | blocked area | `pi D^2 / 4`: integral of the opacity of a streak over its area | [`Streak::blocked_area`](streaks::coverage::Streak::blocked_area) |
//! | extinction | `beta = Q (pi/4) integral of n D^2 dD` | [`extinction`](lighting::extinction::extinction()) |
//! | visibility | `3.912 / beta` | [`visibility`](lighting::extinction::visibility) |
//! | phase function | p: light that a drop scatters by angle | [`DropPhaseFunction::phase`](lighting::drop_phase_function::DropPhaseFunction::phase) |
//! | sky light through a drop | integral of `p L` over the sky | [`DropPhaseFunction::mean_radiance`](lighting::drop_phase_function::DropPhaseFunction::mean_radiance) |
//! | single scattering | `integral of beta E p / (4 pi) e^-tau ds` along the line of sight | `lighting::equiangular::SightLineIntegrator::add_lamp` |
//! | shadow map | `(x, y) / (1 + z)`: stereographic projection of the direction (x, y, z) from a lamp | `lighting::shadow_map::ShadowMap::visibility` |
//! | gust displacement | `integral of g(s) (1 - s / memory) ds`: displacement of drops by gusts | `drops::gust::GustHistory::add_weights` |
//!
//! # Data flow
//! 1. [`Rain::new`] divides [`RainParameters`]' diameters into bins. Terminal velocities follow each frame from the scene's air.
//! 2. For a frame, `shutter_cameras` holds the cameras when the shutter opens, at its middle and when it closes, and `drops::shutter_state` the state of
//!    the rain: a `lattice` of cells for each diameter, displaced by the wind, with `gust`s on top.
//! 3. `lighting` prepares lamps, their shadow maps, the sky through drops at the corners of a tile grid, and single scattering along lines of sight.
//! 4. `streaks::project` visits the visible cells, nearest first, and turns batches of sixteen drops (`streaks::project_lanes`, of a fisheye or a panorama
//!    `streaks::project_curvilinear`) into lit streaks; a long exposure is drawn in parts (`streaks::exposure_parts`). On
//!    [`billboards`], drops come from the positions of a streak texture; on the ground `streaks::splashes` adds droplets. With `method = "textures"`,
//!    [`textured_billboards`] draws the paper's textures instead. [`Rain::drops`] lists the drops as data.
//! 5. `streaks::bin` sorts packed streaks into tiles of 128 x 8 pixels, in chunks.
//! 6. `render` draws a strip tile by tile: `streaks::rasterize` computes the exact coverage of each pixel and composites front to back;
//!    then `lighting::single_scattering` adds the medium under it.

pub(crate) mod aovs;
pub mod billboards;
pub mod drops;
pub(crate) mod lanes;
pub mod lighting;
mod model;
mod paper_settings;
mod parameters;
mod phenomenon;
mod raindrop;
pub(crate) mod render;
mod run;
pub(crate) mod shutter_cameras;
pub mod streaks;
pub mod textured_billboards;

pub use model::Rain;
pub use parameters::{DropCountLaw, Method, OpacityLaw, RainParameters, SplashParameters, VelocityLaw};
pub use raindrop::Raindrop;
pub use run::RainRun;

#[cfg(test)]
mod tests;
