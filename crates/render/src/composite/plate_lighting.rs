//! The light of fires and lamps on what a plate shows: Lambert's law for each pixel, with the shadows of the plate's own depth.
//!
//! The pixel gets the radiance `albedo / pi * sum of E`, where E is the illuminance of each light on its surface, besides the light that it has in the
//! picture. E is the light's intensity times a [`LightTransport`], which frames share as long as the light stands still.

use std::sync::Arc;

use bansho_base::{
    color,
    host::{
        observer::{self, Cancelled, Observer},
        parallel::prelude::*,
    },
    image::Image,
    math::simd::{LANES, Lanes, Real, any_positive},
    phenomenon::{
        light_batch::RelativeLight,
        surroundings::{Light, Occluder},
    },
};
use fearless_simd::{dispatch, prelude::*};

use super::{
    plate::PlateFrame,
    plate_surface::PlateSurface,
    plate_transport::{LightTransport, MAX_TRANSPORTS, TransportCache, TransportKey},
    standing_lights::standing_lights,
};
use crate::{compiled::CompiledScene, plan::Plan};

/// Pixels between those in which the strengths of lights are compared.
const SAMPLE_PIXELS: usize = 16;
/// Exposed radiance of a white surface that is left out.
const NEGLIGIBLE: f32 = 1e-6;

/// The lights on a plate, and what casts shadows besides the plate.
#[derive(Default)]
pub(crate) struct PlateLights {
    /// Flames that burn in one place, whose lights rise and sink as they flicker.
    pub(crate) flames: Vec<Light>,
    /// Lights that stand still.
    pub(crate) lamps: Vec<Light>,
    /// Lights that move.
    pub(crate) moving: Vec<Light>,
    pub(crate) casters: Vec<Occluder>,
    /// Factor from absolute radiance to exposed values.
    pub(crate) exposure: f32,
}

/// A light on a plate.
#[derive(Clone, Copy, Debug, PartialEq)]
struct PlateLight {
    light: Light,
    moves: bool,
}

impl PlateLights {
    /// Lights of different emitters that give the plate its light, exposed.
    fn exposed(&self) -> Vec<PlateLight> {
        let still = self.lamps.iter().copied().chain(standing_lights(&self.flames)).map(|light| (light, false));
        let mut lights: Vec<PlateLight> = Vec::new();
        for (light, moves) in still.chain(self.moving.iter().map(|light| (*light, true))) {
            let light = light.scaled(self.exposure);
            if light.intensity.iter().all(|value| *value <= 0.0) {
                continue;
            }
            match lights.iter_mut().find(|earlier| earlier.light.emitter == light.emitter && earlier.moves == moves) {
                Some(earlier) => (0..3).for_each(|c| earlier.light.intensity[c] += light.intensity[c]),
                None => lights.push(PlateLight { light, moves }),
            }
        }
        lights
    }
}

/// Bytes for each pixel of a picture that the light on its plate takes: surfaces, the lit plate, and the transports of the lights of the first frame with as many
/// again for those of flames, which rise and sink. 0 where the plate is not lit.
pub fn lit_plate_bytes(compiled: &CompiledScene, plan: &Plan) -> f64 {
    /// Reflectance, normal and depth of a surface; color and depth of the lit plate.
    const BYTES: usize = 7 * 4 + 5 * 4;
    if !plan.scene().lights_plate() {
        return 0.0;
    }
    let shutter = plan.view(plan.frames().start).shutter;
    let mut flames = Vec::new();
    let mut others = plan.scene().tables.lights(shutter.middle()).count();
    for phenomenon in compiled.phenomena() {
        if phenomenon.info().stepping.is_some() {
            // Before it is simulated, nothing burns: as many as a flame has by default, in two frames.
            let sky_lights = phenomenon.info().sky_lights;
            others += if sky_lights > 0 { sky_lights } else { 4 };
        } else {
            flames.extend(phenomenon.clone().start().publish(shutter).lights);
        }
    }
    let transports = (2 * standing_lights(&flames).len() + others).min(MAX_TRANSPORTS);
    (BYTES + 4 * transports) as f64
}

/// A light with its transport.
struct TransportedLight {
    /// Exposed.
    intensity: [f32; 3],
    transport: Arc<LightTransport>,
}

/// The lights on all rows of a plate.
struct LitRows<'a> {
    surface: &'a PlateSurface,
    lights: Vec<TransportedLight>,
    /// Lights beyond those that are kept, without shadows.
    unshadowed: Vec<RelativeLight>,
}

impl LitRows<'_> {
    /// Row `y` of a plate with these `colors`, in this light.
    #[inline(always)]
    fn add_light<S: Simd>(&self, simd: S, y: usize, colors: &[[f32; 4]], lit: &mut [[f32; 4]]) {
        // Far from a fire most rows have hardly any light.
        let mut shining: Vec<([f32; 3], &[f32])> = Vec::with_capacity(self.lights.len());
        let row = y * self.surface.stride..(y + 1) * self.surface.stride;
        for TransportedLight { intensity, transport } in &self.lights {
            let brightest = intensity[0].max(intensity[1]).max(intensity[2]);
            if transport.row_maxima[y] * brightest > NEGLIGIBLE {
                shining.push((*intensity, &transport.illuminance[row.clone()]));
            }
        }
        if shining.is_empty() && self.unshadowed.is_empty() {
            lit.copy_from_slice(colors);
            return;
        }
        let reflectance = self.surface.reflectance.each_ref().map(|plane| &plane[row.clone()]);
        let zero = Lanes::splat(simd, 0.0);
        let mut x = 0;
        while x < colors.len() {
            let end = (x + LANES).min(colors.len());
            let reflected = [
                Lanes::from_slice(simd, &reflectance[0][x..x + LANES]),
                Lanes::from_slice(simd, &reflectance[1][x..x + LANES]),
                Lanes::from_slice(simd, &reflectance[2][x..x + LANES]),
            ];
            if !any_positive(reflected[0] + reflected[1] + reflected[2]) {
                lit[x..end].copy_from_slice(&colors[x..end]);
                x = end;
                continue;
            }
            let mut illuminance = [zero; 3];
            for (intensity, transport) in &shining {
                let factor = Lanes::from_slice(simd, &transport[x..x + LANES]);
                for c in 0..3 {
                    illuminance[c] = factor.fma(Lanes::splat(simd, intensity[c]), illuminance[c]);
                }
            }
            if !self.unshadowed.is_empty() {
                let batch = self.surface.batch(simd, x, y);
                for light in &self.unshadowed {
                    let factor = batch.unshadowed(simd, light);
                    for c in 0..3 {
                        illuminance[c] = factor.fma(Lanes::splat(simd, light.intensity[c]), illuminance[c]);
                    }
                }
            }
            let mut radiance = [[0.0; LANES]; 3];
            for c in 0..3 {
                (reflected[c] * illuminance[c]).store_slice(&mut radiance[c]);
            }
            for (i, (lit, color)) in lit[x..end].iter_mut().zip(&colors[x..end]).enumerate() {
                *lit = [color[0] + radiance[0][i], color[1] + radiance[1][i], color[2] + radiance[2][i], color[3]];
            }
            x = end;
        }
    }
}

/// The indices of at most [`MAX_TRANSPORTS`] lights, and those of all others, which are weaker.
fn strongest(surface: &PlateSurface, lights: &[PlateLight]) -> (Vec<usize>, Vec<usize>) {
    let mut order: Vec<usize> = (0..lights.len()).collect();
    if lights.len() <= MAX_TRANSPORTS {
        return (order, Vec::new());
    }
    let strengths = strengths(surface, lights);
    order.sort_by(|&a, &b| strengths[b].total_cmp(&strengths[a]));
    let weaker = order.split_off(MAX_TRANSPORTS);
    (order, weaker)
}

/// For each light the sum of its light on samples of the plate, none of which counts for more than white: a lamp in a wall outshines one spot only.
fn strengths(surface: &PlateSurface, lights: &[PlateLight]) -> Vec<f64> {
    let mut strengths = vec![0.0; lights.len()];
    for y in (SAMPLE_PIXELS / 2..surface.size[1]).step_by(SAMPLE_PIXELS) {
        for x in (SAMPLE_PIXELS / 2..surface.size[0]).step_by(SAMPLE_PIXELS) {
            let Some(position) = surface.position(x, y) else { continue };
            for (strength, light) in strengths.iter_mut().zip(lights) {
                let (illuminance, _) = light.light.illuminance(surface.camera.position + position);
                *strength += f64::from(color::luminance(illuminance)).clamp(0.0, 1.0);
            }
        }
    }
    // In a picture that is smaller than the samples, any order will do.
    if strengths.iter().all(|strength| *strength == 0.0) {
        return lights.iter().map(|light| f64::from(color::luminance(light.light.intensity)).max(0.0)).collect();
    }
    strengths
}

/// A plate with the light of fires and lamps, in memory that frames reuse.
#[derive(Default)]
pub(crate) struct LitPlate {
    /// The plate without it, and with it.
    last: Option<(Arc<PlateFrame>, Arc<PlateFrame>)>,
    /// The lights of the last plate, exposed.
    lights: Vec<PlateLight>,
    casters: Vec<Occluder>,
    transports: TransportCache,
    /// Number of changes.
    pub(super) version: u64,
}

impl LitPlate {
    /// `plate` in these lights; itself where no light falls on it.
    ///
    /// # Errors
    /// The observer asked to stop.
    pub(crate) fn frame(
        &mut self,
        plate: Arc<PlateFrame>,
        lights: &PlateLights,
        observer: &dyn Observer,
    ) -> Result<Arc<PlateFrame>, Cancelled> {
        let exposed = lights.exposed();
        let Some(surface) = plate.surface.clone().filter(|_| !exposed.is_empty()) else {
            self.last = None;
            return Ok(plate);
        };
        let is_same_light = self.lights == exposed && Occluder::are_same(&self.casters, &lights.casters);
        let last = self.last.take().filter(|(unlit, _)| Arc::ptr_eq(unlit, &plate));
        let mut lit = match last {
            Some((unlit, lit)) if is_same_light => {
                self.last = Some((unlit, lit.clone()));
                return Ok(lit);
            }
            Some((_, lit)) => lit,
            None => plate.clone(),
        };
        // A copy only of the plate itself, and where somebody keeps the last frame.
        if let Some(color) = &mut Arc::make_mut(&mut lit).color {
            self.add_light(&plate, &surface, &exposed, &lights.casters, color, observer)?;
        }
        self.version += 1;
        self.lights = exposed;
        self.casters.clone_from(&lights.casters);
        self.last = Some((plate, lit.clone()));
        Ok(lit)
    }

    /// Adds light to the colors of `plate`, as the colors `lit`.
    fn add_light(
        &mut self,
        plate: &PlateFrame,
        surface: &Arc<PlateSurface>,
        lights: &[PlateLight],
        casters: &[Occluder],
        lit: &mut Image<4>,
        observer: &dyn Observer,
    ) -> Result<(), Cancelled> {
        let (Some(color), Some(depth)) = (&plate.color, &plate.depth) else { return Ok(()) };
        let (kept, weaker) = strongest(surface, lights);
        let mut keys = Vec::with_capacity(kept.len());
        for &index in &kept {
            let PlateLight { light, moves } = lights[index];
            keys.push(TransportKey { emitter: light.emitter, moves });
        }
        let transports = self.transports.transports(surface, depth, &keys, casters, observer)?;
        observer::check(observer)?;
        let with_transports = kept.iter().zip(transports);
        let rows = LitRows {
            surface,
            lights: with_transports
                .map(|(&index, transport)| TransportedLight { intensity: lights[index].light.intensity, transport })
                .collect(),
            unshadowed: weaker
                .iter()
                .map(|&index| RelativeLight::new(&lights[index].light, surface.camera.position))
                .collect(),
        };
        let level = bansho_base::math::simd::level();
        let width = surface.size[0].max(1);
        lit.pixels_mut().par_chunks_mut(width).enumerate().for_each(|(y, lit)| {
            dispatch!(level, simd => rows.add_light(simd, y, color.row(y), lit));
        });
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::{
        camera::{Camera, CameraParameters},
        host::observer::Unobserved,
        math::DVec3,
        phenomenon::{
            strip::{Shutter, View},
            surroundings::Emitter,
        },
    };

    use super::*;

    const SIZE: [usize; 2] = [90, 60];

    /// A wall 4 m before a camera, and a post before it.
    fn plate() -> PlateFrame {
        let parameters = CameraParameters {
            position: [0.0; 3].into(),
            target: [0.0, 0.0, -1.0].into(),
            vertical_fov_deg: 60.0.into(),
            ..CameraParameters::default()
        };
        let camera: Camera = View::new(parameters, Shutter { open: 0.0, close: 0.0 }, 0.0, SIZE, 0).camera;
        let (mut color, mut depth) =
            (Image::filled(SIZE[0], SIZE[1], [0.1, 0.2, 0.3, 1.0]), Image::filled(SIZE[0], SIZE[1], [4.0]));
        for y in 20..60 {
            (40..46).for_each(|x| depth.pixels_mut()[y * SIZE[0] + x] = [2.5]);
        }
        color.pixels_mut()[7][0] = 0.9;
        let stride = SIZE[0].next_multiple_of(LANES);
        let plane = |value: f32| vec![value; stride * SIZE[1]];
        let mut surface = PlateSurface {
            camera,
            size: SIZE,
            stride,
            reflectance: [0.1, 0.08, 0.05].map(plane),
            normal: [0.0, 0.0, 1.0].map(plane),
            depth: plane(1.0),
        };
        for y in 0..SIZE[1] {
            (0..SIZE[0]).for_each(|x| surface.depth[y * stride + x] = depth.at(x, y)[0]);
        }
        PlateFrame { color: Some(color), is_transparent: false, depth: Some(depth), surface: Some(Arc::new(surface)) }
    }

    fn light(position: [f64; 3], intensity: f32) -> Light {
        Light { emitter: Emitter::Point { position: position.into(), radius: 0.1 }, intensity: [intensity; 3] }
    }

    fn lights(flames: Vec<Light>, lamps: Vec<Light>, moving: Vec<Light>) -> PlateLights {
        PlateLights { flames, lamps, moving, casters: Vec::new(), exposure: 1.0 }
    }

    fn lit(cache: &mut LitPlate, plate: &Arc<PlateFrame>, lights: &PlateLights) -> Image<4> {
        let frame = cache.frame(plate.clone(), lights, &Unobserved).unwrap();
        frame.color.clone().unwrap()
    }

    #[test]
    fn a_frame_of_a_flickering_flame_does_not_depend_on_those_before() {
        let plate = Arc::new(plate());
        let mut cache = LitPlate::default();
        let mut seen: Vec<Image<4>> = Vec::new();
        for step in 0..12_u8 {
            let height = -0.5 + 0.31 * f64::from(step * 5 % 7);
            let lamp = light([1.0, 0.2 * f64::from(step % 3), -2.0], 20.0);
            let lights = lights(vec![light([0.3, height, -2.0], 10.0 + f32::from(step))], Vec::new(), vec![lamp]);
            let color = lit(&mut cache, &plate, &lights);
            assert!(color == lit(&mut LitPlate::default(), &plate, &lights), "{step}");
            assert!(!seen.contains(&color), "{step}");
            seen.push(color);
        }
        let unlit = lit(&mut cache, &plate, &lights(vec![light([0.3, 0.0, -2.0], 0.0)], Vec::new(), Vec::new()));
        assert!(Some(&unlit) == plate.color.as_ref());
    }

    #[test]
    fn lights_that_are_not_kept_shine_without_shadows() {
        let plate = Arc::new(plate());
        let mut lamps = Vec::new();
        for index in 0..MAX_TRANSPORTS {
            lamps.push(light([0.0, 0.05 * index as f64, -1.0], 50.0));
        }
        let faint = light([-1.0, 0.0, -2.2], 5.0);
        let mut cache = LitPlate::default();
        let without = lit(&mut cache, &plate, &lights(Vec::new(), lamps.clone(), Vec::new()));
        lamps.insert(3, faint);
        let with = lit(&mut cache, &plate, &lights(Vec::new(), lamps, Vec::new()));
        // At a pixel of the wall that the post hides from the light.
        let (x, y) = (75, 40);
        let position = plate.surface.as_ref().unwrap().position(x, y).unwrap();
        let toward = DVec3::new(-1.0, 0.0, -2.2) - position;
        let expected = 0.1 * 5.0 * toward.z / (toward.length_squared() * toward.length());
        let added = f64::from(with.at(x, y)[0] - without.at(x, y)[0]);
        assert!((added - expected).abs() < 0.02 * expected, "{added}, expected {expected}");
        let alone = lit(&mut cache, &plate, &lights(Vec::new(), vec![faint], Vec::new()));
        assert_eq!(alone.at(x, y)[0], 0.1, "in the shadow of the post");
    }
}
