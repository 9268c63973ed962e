//! Light of the ground that does not come from the picture in its mirror, for sixteen pixels at a time.

use std::{f32::consts::PI, sync::OnceLock};

use bansho_base::{
    camera::directions::Directions,
    color::{acescg_from_srgb, luminance},
    host::once::get_or_compute,
    math::{
        DVec2,
        simd::{LANES, Lanes, Real, any_positive},
    },
    phenomenon::{
        light_batch::RelativeLight,
        strip::View,
        surroundings::{Backdrop, Surroundings},
    },
    world::sky::SkyObserver,
};
use fearless_simd::prelude::*;

use super::{
    LakeFrame,
    hits::{Hits, RowDepths},
    lighting::{Shadows, array},
    parameters::{GroundKind, GroundParameters},
    row_cache::{CachedRows, GroundLightBatch},
    sample::SampledImage,
    surface::{GroundPositions, Surface, SurfaceSamples},
    wet_reflection::{FilmDirection, Microfacets, fresnel},
};
use crate::sky::night::NightSky;

/// Fraction of its albedo that soaked ground loses, by total internal reflection in the water (Lekner & Dorf 1988).
const WET_DARKENING: f64 = 0.55;
/// Fraction that puddles lose beyond that: they are deeper, and often turbid.
const PUDDLE_DARKENING: f64 = 0.4;
/// Albedo of deep water.
const WATER_ALBEDO: f32 = 0.02;

/// Albedo of wet ground relative to dry ground.
pub(super) fn wet_albedo_factor(wetness: f64) -> f64 {
    1.0 - WET_DARKENING * wetness
}

impl GroundParameters {
    /// Luminance of the diffuse albedo at time `t`, with the darkening by wetness.
    #[must_use]
    pub fn reflectance(&self, t: f64) -> f64 {
        match self.kind {
            GroundKind::Water => f64::from(WATER_ALBEDO),
            GroundKind::Land | GroundKind::Plate => {
                let dry = luminance(acescg_from_srgb(self.color.map(|value| value as f32)));
                f64::from(dry) * wet_albedo_factor(self.wetness.at(t))
            }
        }
    }
}

/// One frame of the ground.
pub(super) struct PreparedGround<'a> {
    pub(super) parameters: &'a GroundParameters,
    pub(super) surface: &'a Surface,
    pub(super) view: &'a View,
    pub(super) surroundings: &'a Surroundings<'a>,
    pub(super) wetness: f64,
    /// Height of the camera above the ground, m.
    pub(super) camera_height: f64,
    pub(super) row_depths: RowDepths,
    /// Those of the surroundings.
    pub(super) lights: Vec<RelativeLight>,
    /// The sky, if it is a night: tabulated by the first thread that needs it.
    pub(super) night_sky: OnceLock<Option<NightSky>>,
    /// Whether there is a film of water between puddles.
    pub(super) has_film: bool,
    pub(super) lake: Option<LakeFrame<'a>>,
    /// The plate and its sky, blurred as a rough film of water reflects them.
    pub(super) backdrop: Option<Backdrop>,
    pub(super) cached_rows: CachedRows,
}

/// What sixteen pixels see of a film of water.
struct Film<S: Simd> {
    microfacets: Microfacets<Lanes<S>>,
    viewer: FilmDirection<Lanes<S>>,
}

/// Light at sixteen points: on level ground, lux, and reflected by the film, cd/m^2.
struct SurfaceLight<S: Simd> {
    illuminance: [Lanes<S>; 3],
    specular: [Lanes<S>; 3],
}

impl PreparedGround<'_> {
    /// The pattern of the ground at some hits. Open water has none.
    #[inline(always)]
    pub(super) fn samples<S: Simd>(&self, hits: &Hits<S>) -> SurfaceSamples {
        if self.lake.is_some() {
            return SurfaceSamples::NONE;
        }
        let camera = self.view.camera.position;
        let [xs, zs] = [array(hits.offset[0]), array(hits.offset[2])];
        let footprint = array(hits.footprint);
        let positions =
            GroundPositions { origin: DVec2::new(camera.x, camera.z), offset: [&xs, &zs], footprint: &footprint };
        self.surface.samples(positions, self.has_film)
    }

    /// The light of the pixels from column `x` on in row `y`, and the weight of the picture in the mirror.
    #[inline(always)]
    pub(super) fn light<S: Simd>(
        &self,
        simd: S,
        hits: &Hits<S>,
        samples: &SurfaceSamples,
        [x, y]: [usize; 2],
    ) -> GroundLightBatch {
        let film = self.film(simd, hits, samples);
        let shadows = self.shadows(hits);
        let mut light = self.sky_light(simd, hits, film.as_ref(), shadows.as_ref(), [x, y]);
        self.add_lights(simd, hits, film.as_ref(), shadows.as_ref(), &mut light);
        let puddle = Lanes::from_slice(simd, &samples.puddle);
        let one = Lanes::splat(simd, 1.0);
        // A puddle mirrors the picture instead, so that the film and the puddle share the ground.
        let glossy = (one - puddle) * Lanes::splat(simd, self.wetness as f32);
        let albedo = self.albedo(simd, samples);
        // What the plate shows is lit with the plate.
        let is_lit = self.parameters.kind == GroundKind::Plate && self.surroundings.plate_is_lit;
        let per_illuminance = if is_lit { 0.0 } else { 1.0 / PI };
        let mut batch = [[0.0; LANES]; 4];
        for c in 0..3 {
            let diffuse = light.illuminance[c] * albedo[c] * Lanes::splat(simd, per_illuminance);
            let sum = if film.is_some() { glossy.fma(light.specular[c], diffuse) } else { diffuse };
            (hits.coverage * sum).store_slice(&mut batch[c]);
        }
        let mirrored = if self.lake.is_some() { one } else { puddle * Lanes::splat(simd, self.wetness as f32) };
        (hits.coverage * mirrored * fresnel(hits.cos)).store_slice(&mut batch[3]);
        batch
    }

    /// Albedo as the water leaves it.
    #[inline(always)]
    fn albedo<S: Simd>(&self, simd: S, samples: &SurfaceSamples) -> [Lanes<S>; 3] {
        let mut albedo = [Lanes::splat(simd, WATER_ALBEDO); 3];
        if self.parameters.kind == GroundKind::Water {
            return albedo;
        }
        let one = Lanes::splat(simd, 1.0);
        let wet = Lanes::splat(simd, wet_albedo_factor(self.wetness) as f32);
        let darkening = if self.parameters.kind == GroundKind::Plate { 0.0 } else { PUDDLE_DARKENING * self.wetness };
        let puddle = Lanes::from_slice(simd, &samples.puddle);
        let factor = wet * puddle.fma(Lanes::splat(simd, -darkening as f32), one);
        let shade = Lanes::from_slice(simd, &samples.shade);
        for c in 0..3 {
            albedo[c] = (Lanes::splat(simd, self.surface.albedo[c]) * shade).simd_min(one) * factor;
        }
        albedo
    }

    /// The film of water; `None` if there is none, or puddles cover it in all pixels.
    #[inline(always)]
    fn film<S: Simd>(&self, simd: S, hits: &Hits<S>, samples: &SurfaceSamples) -> Option<Film<S>> {
        let open = Lanes::splat(simd, 1.0) - Lanes::from_slice(simd, &samples.puddle);
        if !self.has_film || !any_positive(open) {
            return None;
        }
        let film_slope = Lanes::from_slice(simd, &samples.film_slope);
        let grain_slope = Lanes::splat(simd, self.surface.grain_slope() as f32);
        let microfacets = Microfacets {
            tilt: [Lanes::from_slice(simd, &samples.tilt[0]), Lanes::from_slice(simd, &samples.tilt[1])],
            slopes: [film_slope, grain_slope],
            film: Lanes::from_slice(simd, &samples.film),
        };
        Some(Film { microfacets, viewer: FilmDirection::new(hits.viewer) })
    }

    /// What casts shadows, if anything does.
    #[inline(always)]
    fn shadows<S: Simd>(&self, hits: &Hits<S>) -> Option<Shadows<'_>> {
        let casters = &self.surroundings.others.shadow_casters;
        if casters.is_empty() {
            return None;
        }
        let points = [array(hits.offset[0]), array(hits.offset[1]), array(hits.offset[2])];
        let focal_pixels = self.view.camera.focal_pixels;
        Some(Shadows { casters, camera: self.view.camera.position, points, focal_pixels })
    }

    /// Light of the sky. What a plate shows already contains the light of its own sky.
    #[inline(always)]
    fn sky_light<S: Simd>(
        &self,
        simd: S,
        hits: &Hits<S>,
        film: Option<&Film<S>>,
        shadows: Option<&Shadows>,
        pixel: [usize; 2],
    ) -> SurfaceLight<S> {
        let zero = Lanes::splat(simd, 0.0);
        let mut light = SurfaceLight { illuminance: [zero; 3], specular: [zero; 3] };
        if self.parameters.kind != GroundKind::Plate {
            let horizontal = self.surroundings.sky.horizontal_illuminance();
            for c in 0..3 {
                light.illuminance[c] = Lanes::splat(simd, horizontal[c]);
            }
        }
        if let Some(shadows) = shadows {
            let open = Lanes::from_slice(simd, &shadows.sky_visibility());
            for c in 0..3 {
                light.illuminance[c] *= open;
            }
        }
        if let Some(film) = film {
            light.specular = self.film_sky(simd, hits, film, shadows, pixel);
        }
        light
    }

    /// The backdrop, or else the sky, as the film reflects it.
    #[inline(always)]
    fn film_sky<S: Simd>(
        &self,
        simd: S,
        hits: &Hits<S>,
        film: &Film<S>,
        shadows: Option<&Shadows>,
        pixel: [usize; 2],
    ) -> [Lanes<S>; 3] {
        // At grazing angles the visible facets are those tilted toward the viewer: they reflect less, and from higher
        // directions.
        let ([x, y, z], slope) = (hits.viewer, film.microfacets.mean_slope());
        let rise = y.fma(y, slope * slope).simd_sqrt();
        let level = x.fma(x, z * z);
        let down = (rise.fma(rise, level)).simd_sqrt();
        let scale = Lanes::splat(simd, 1.0) / down.simd_max(Lanes::splat(simd, 1e-20));
        let toward = [(Lanes::splat(simd, 0.0) - x) * scale, rise * scale, (Lanes::splat(simd, 0.0) - z) * scale];
        let radiance = match &self.backdrop {
            Some(Backdrop { image, pixel_size }) => {
                let (xs, ys) = pixel_centers(pixel);
                SampledImage { image, pixel_size: *pixel_size, first_row: 0 }.at(simd, &xs, &ys)
            }
            None => self.sky_radiance(simd, [array(toward[0]), array(toward[1]), array(toward[2])]),
        };
        let mut weight = fresnel(rise);
        if let Some(shadows) = shadows {
            weight *= Lanes::from_slice(simd, &shadows.far_visibility(&toward, slope));
        }
        let mut reflected = [weight; 3];
        for c in 0..3 {
            reflected[c] = weight * Lanes::from_slice(simd, &radiance[c]);
        }
        reflected
    }

    /// Radiance of the sky from directions, unit vectors.
    #[inline(always)]
    fn sky_radiance<S: Simd>(&self, simd: S, toward: [[f32; LANES]; 3]) -> [[f32; LANES]; 3] {
        let sky = &self.surroundings.sky;
        if let Some(planes) = sky.radiance_at_elevations(&toward[1]) {
            return planes;
        }
        let mut planes = [[0.0; LANES]; 3];
        // Not by `get_or_init`: the glow of a town is computed in parallel.
        let night_sky = get_or_compute(&self.night_sky, || {
            let night = sky.night()?;
            Some(NightSky::new(sky, night, 0.0, SkyObserver::ON_THE_GROUND))
        });
        if let Some(night_sky) = night_sky {
            let colors = night_sky.radiance(simd, &Directions { components: toward, visible: [true; LANES] });
            for i in 0..LANES {
                for c in 0..3 {
                    planes[c][i] = colors[i][c];
                }
            }
        }
        planes
    }

    /// Adds the light of lamps and fires.
    #[inline(always)]
    fn add_lights<S: Simd>(
        &self,
        simd: S,
        hits: &Hits<S>,
        film: Option<&Film<S>>,
        shadows: Option<&Shadows>,
        sums: &mut SurfaceLight<S>,
    ) {
        let whole = if shadows.is_some() { self.total_luminance(simd, hits) } else { [0.0; LANES] };
        for light in &self.lights {
            let arriving = light.arriving(simd, &hits.offset);
            let mut factor = arriving.factor;
            // Spots leave most of the ground dark, and shadows are the dearest part of a light.
            if !any_positive(factor) {
                continue;
            }
            if let Some(shadows) = shadows {
                factor *= Lanes::from_slice(simd, &shadows.visibility(light, &arriving, &whole));
            }
            let facing = factor * arriving.toward[1].simd_max(Lanes::splat(simd, 0.0));
            for c in 0..3 {
                sums.illuminance[c] = facing.fma(Lanes::splat(simd, light.intensity[c]), sums.illuminance[c]);
            }
            if let Some(Film { microfacets, viewer }) = film {
                let toward = FilmDirection::new(arriving.toward);
                let lobe = factor * microfacets.specular_lobe(&toward, viewer, arriving.angular_radius);
                for c in 0..3 {
                    sums.specular[c] = lobe.fma(Lanes::splat(simd, light.intensity[c]), sums.specular[c]);
                }
            }
        }
    }

    /// Sum of the luminances of all lights on planes that face them, without shadows, lux.
    #[inline(always)]
    fn total_luminance<S: Simd>(&self, simd: S, hits: &Hits<S>) -> [f32; LANES] {
        let mut sum = Lanes::splat(simd, 0.0);
        for light in &self.lights {
            let strength = Lanes::splat(simd, luminance(light.intensity));
            sum = light.arriving(simd, &hits.offset).factor.fma(strength, sum);
        }
        array(sum)
    }
}

/// Centers of the pixels from column `x` on in row `y`.
#[inline(always)]
pub(super) fn pixel_centers([x, y]: [usize; 2]) -> ([f32; LANES], [f32; LANES]) {
    let mut xs = [x as f32; LANES];
    for i in 0..LANES {
        xs[i] += i as f32 + 0.5;
    }
    (xs, [y as f32 + 0.5; LANES])
}
