//! Volume flame: burning gas on a grid, with thin layers of soot that neck, roll up and puff, and are seen from any side.
//!
//! # Model
//! [`bansho_fluid`] moves air and the gas from the burners. A cell holds the mixture fraction Z, which is the share of its mass that came from a burner, and
//! the heat that it has lost. Fuel and air burn infinitely fast where they meet, so that temperature and density follow from these two. The reaction zone, at the
//! stoichiometric Zs, is hottest. Soot on its rich side radiates and cools the gas; the soot that is left in lean gas is smoke. No parameter states a height, a
//! frequency or a shape: they follow from the flow. SI units throughout; temperatures in K, luminance in cd/m^2.
//!
//! # References
//! - S. Burke and T. Schumann, "Diffusion flames" (1928): an infinitely thin reaction zone between fuel and air.
//! - D. Nguyen, R. Fedkiw and H. Jensen, "Physically based modeling and animation of fire" (2002); J. Hong, T. Shinar and R. Fedkiw, "Wrinkled flames and cellular
//!   patterns" (2007); C. Horvath and W. Geiger, "Directable, high-resolution simulation of fire on the GPU" (2009); R. Fedkiw, J. Stam and H. Jensen, "Visual
//!   simulation of smoke" (2001): fire and smoke on grids in computer graphics.
//! - K. McGrattan et al., "Fire Dynamics Simulator, technical reference guide", NIST SP 1018: mixture fraction, radiant fraction, open sides.
//! - M. Modest, "Radiative heat transfer" (2013): Planck mean of soot.
//! - K. Engel, M. Kraus and T. Ertl, "High-quality pre-integrated volume rendering using hardware-accelerated pixel shading" (2001): `render::sheet`.
//! - R. Keys, "Cubic convolution interpolation for digital image processing" (1981): `render::nodes`.
//! - G. Mulholland and C. Croarkin, "Specific extinction coefficient of flame generated smoke" (2000).
//!
//! # Equations
//! | equation | what it says | function |
//! |---|---|---|
//! | `T = T_air + (T_fuel - T_air) Z + dT min(Z/Zs, (1 - Z)/(1 - Zs))` | temperature without losses | [`Mixture::adiabatic_k`] |
//! | `T -> max(T - H, T_air)` | with the heat lost, H in K | [`Mixture::temperature_k`] |
//! | `rho = rho_air T_air / T` | density | [`Mixture::density`] |
//! | `div u = (rho / rho(T) - 1) / t` | expansion to that density in a step | `simulate::ReactionConstants::react` |
//! | `DH/Dt = f 4 sigma k_P (T^4 - T_air^4) / (rho c_p)` | radiation; f so that the fire radiates its fuel's fraction | `simulate::Simulation::follow_radiant_fraction` |
//! | `m = Q / H_c` | mass flux of a burner | `simulate::Simulation::sources` |
//! | `D* = (Q / (rho c_p T sqrt(g)))^(2/5)` | characteristic diameter | `simulate::domain::FireSize::new` |
//! | `k = 4.9 f_v / lambda` | absorption of soot | `render::optics::GasOptics::crossing` |
//!
//! # Data flow
//! 1. `parameters` holds the scene's values, `fuel` the properties of fuels, `error` errors of their combinations; `model` builds a flame.
//! 2. `simulate::domain` determines the grid, `simulate::burners` the cells into which gas flows; `simulate` steps the gas; `simulate::snapshot` serializes it.
//!    The beginning is computed on a grid of twice the spacing.
//! 3. `run` steps and draws one shot; `phenomenon` is what all shots share, as the rest of Bansho sees it.
//! 4. To draw a frame, `render::field` holds the gas of a state, and `render::blocks` the blocks of cells in which gas is seen. `render::nodes` looks it up along
//!    rays at most 0.65 cells apart, `render::march` steps along all rays between these, sixteen at a time, with what gas emits and absorbs from `render::optics` and
//!    `render::sheet` and the light on smoke from `render::smoke`. `render::reference` is the naive way, one ray at a time, for tests and benchmarks.
//! 5. `render::lights` gives point lights for other objects, `render::haze` the deflection of light from behind; `render::prepared` draws strips and AOVs.

mod error;
mod fuel;
mod model;
mod parameters;
mod phenomenon;
pub(crate) mod render;
mod run;
pub(crate) mod simulate;
#[cfg(test)]
mod tests;

pub use error::{VolumeError, VolumeErrorKind};
pub use fuel::{Fuel, FuelProperties, Mixture, soot_profile};
pub use model::FlameVolume;
pub use parameters::{
    FlameVolumeParameters, GasParameters, GridQuality, VolumeBurnerParameters, VolumeLightParameters,
    VolumeRenderingParameters,
};
pub use run::FlameVolumeRun;
