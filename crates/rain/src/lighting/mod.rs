//! Lighting: the phase function of a drop, light from lamps and sky on streaks, shadows, extinction, and single scattering of
//! the drops that are not drawn as streaks.

pub(crate) mod drop_lighting;
pub mod drop_phase_function;
pub(crate) mod equiangular;
pub mod extinction;
pub(crate) mod halo_corrections;
mod halo_drawing;
pub(crate) mod in_scattering;
pub(crate) mod lamp_shadows;
pub(crate) mod ray_segments;
pub(crate) mod shadow_map;
pub(crate) mod single_scattering;
pub(crate) mod sky;
mod surface_pixels;
pub(crate) mod tiles;

use in_scattering::LampScatteringCache;
use lamp_shadows::LampShadowCache;
use sky::SkyLightingCache;

/// Light that was computed for earlier frames of a shot. It depends on camera, lights and solids, so that frames use it as long as these stand still.
#[derive(Debug, Default)]
pub(crate) struct LightCaches {
    pub(crate) skies: SkyLightingCache,
    pub(crate) lamp_scattering: LampScatteringCache,
    pub(crate) lamp_shadows: LampShadowCache,
}
