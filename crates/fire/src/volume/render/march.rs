//! Rays through the gas.

use bansho_base::{
    color::BlackBody,
    math::{DVec3, Vec3, approximations},
};

use super::{
    field::{BLOCK, BlockContents, GasField},
    sheet::SheetTable,
    smoke::SmokeLight,
};
use crate::volume::fuel::Mixture;

/// Steps that are taken at once through smoke.
const SMOKE_STRIDE: f64 = 6.0;
/// Steps along which the light on smoke is that in their middle.
const LIGHT_STRIDE: f64 = 16.0;
/// Transmittance below which nothing behind is seen.
const OPAQUE: f32 = 1e-3;
/// Luminance of the blue zone where a ray crosses it, cd/m^2.
const BLUE_LUMINANCE: f32 = 12.0;
/// Loss of heat at which the zone is dark, K.
const BLUE_DEFICIT: f32 = 150.0;

/// What all rays of a frame share.
pub(crate) struct RayMarcher<'a> {
    pub(crate) field: &'a GasField<'a>,
    /// Length of a step, cells.
    pub(crate) step: f64,
    pub(crate) sheet: &'a SheetTable,
    pub(crate) mixture: Mixture,
    pub(crate) black_body: &'static BlackBody,
    /// Absorption coefficient of soot of the largest volume fraction, 1/m.
    pub(crate) soot_absorption: f32,
    /// Extinction coefficient of smoke for its mass over that of the gas and the mixture fraction, m^2/kg.
    pub(crate) smoke_extinction: f32,
    /// Mixture fraction below which no smoke is seen.
    pub(crate) least_smoke: f32,
    pub(crate) smoke_light: Option<&'a SmokeLight>,
    /// Factor of the blue light.
    pub(crate) blue: f32,
    /// Time from the state to the middle of the exposure, s.
    pub(crate) offset_s: f32,
    /// Duration of the exposure, s.
    pub(crate) exposure_s: f32,
    /// Number of equal parts of the exposure over which rays are averaged.
    pub(crate) time_samples: usize,
}

/// What a ray has gathered.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Gathered {
    /// Luminance of soot, cd/m^2, and that times its temperature.
    pub(crate) luminance: f32,
    pub(crate) luminance_kelvin: f32,
    /// Luminance of blue light, cd/m^2.
    pub(crate) blue: f32,
    /// Radiance that smoke scatters, ACEScg.
    pub(crate) scattered: [f32; 3],
    /// Fraction of the light from behind that is absorbed.
    pub(crate) opacity: f32,
    /// Depth of the first gas that is seen, m.
    pub(crate) depth: f32,
    /// Optical depth of soot and smoke.
    pub(crate) optical_depth: f32,
    /// Sum of luminance times velocity, and of luminance times depth.
    pub(crate) motion: [f32; 4],
}

/// A ray in cells: `origin + depth * direction`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    origin: DVec3,
    direction: DVec3,
    /// Meters along the ray for each meter of depth.
    stretch: f64,
}

impl Ray {
    pub(crate) fn new(field: &GasField, origin: DVec3, direction: DVec3) -> Self {
        Self {
            origin: field.point_in_grid(origin),
            direction: direction / field.grid.spacing,
            stretch: direction.length(),
        }
    }

    /// The point at a depth, m.
    pub(crate) fn at(&self, depth: f64) -> Vec3 {
        (self.origin + self.direction * depth).as_vec3()
    }

    /// Depths at which it enters and leaves a box, within those of `range`; `None` if it misses it.
    pub(crate) fn clipped(&self, low: DVec3, high: DVec3, [near, far]: [f64; 2]) -> Option<[f64; 2]> {
        let inverse = DVec3::ONE / self.direction;
        let (first, second) = ((low - self.origin) * inverse, (high - self.origin) * inverse);
        let enter = first.min(second);
        let leave = first.max(second);
        let near = near.max(if enter.is_nan() { near } else { enter.max_element() });
        let far = far.min(if leave.is_nan() { far } else { leave.min_element() });
        (near < far).then_some([near, far])
    }
}

impl RayMarcher<'_> {
    /// What a ray gathers between two depths, m: the mean over the exposure.
    #[inline(always)]
    pub(crate) fn gather(&self, ray: &Ray, range: [f64; 2]) -> Option<Gathered> {
        let [low, high] = self.field.seen_bounds?;
        let corner = |corner: [usize; 3]| DVec3::from(corner.map(|c| c as f64 - 0.5));
        let range = ray.clipped(corner(low), corner(high), range)?;
        if self.time_samples == 1 {
            let gathered = self.march(ray, range, self.offset_s, self.exposure_s);
            return (gathered.opacity > 0.0 || gathered.blue > 0.0).then_some(gathered);
        }
        let part = self.exposure_s / self.time_samples as f32;
        let weight = 1.0 / self.time_samples as f32;
        let mut mean = Gathered { depth: f32::INFINITY, ..Gathered::default() };
        for sample in 0..self.time_samples {
            let offset = self.offset_s + part * (sample as f32 + 0.5) - 0.5 * self.exposure_s;
            let one = self.march(ray, range, offset, part);
            mean.luminance += weight * one.luminance;
            mean.luminance_kelvin += weight * one.luminance_kelvin;
            mean.blue += weight * one.blue;
            (0..3).for_each(|c| mean.scattered[c] += weight * one.scattered[c]);
            mean.opacity += weight * one.opacity;
            mean.optical_depth += weight * one.optical_depth;
            (0..4).for_each(|c| mean.motion[c] += weight * one.motion[c]);
            mean.depth = mean.depth.min(one.depth);
        }
        (mean.opacity > 0.0 || mean.blue > 0.0).then_some(mean)
    }

    /// Steps along a ray through the gas as it is `offset` seconds after its state, which moves for `exposure` seconds.
    #[inline(always)]
    fn march(&self, ray: &Ray, [near, far]: [f64; 2], offset: f32, exposure: f32) -> Gathered {
        let mut gathered = Gathered { depth: f32::INFINITY, ..Gathered::default() };
        let speed = ray.direction.length();
        let step = self.step / speed;
        let meters = (step * ray.stretch) as f32;
        let cells_per_meter = (1.0 / self.field.grid.spacing) as f32;
        let (displacement, half_streak) = (offset * cells_per_meter, 0.5 * exposure * cells_per_meter);
        let mut transmittance = 1.0_f32;
        // Steps are multiples of a step from the camera, so that slices do not change them.
        let mut number = (near / step).ceil();
        let mut before: Option<f32> = None;
        let step_in_cells = (ray.direction * step).as_vec3();
        let mut lit = LitSmoke { light: self.smoke_light, stride: f64::NAN, radiance: [0.0; 3] };
        while number * step < far {
            let depth = number * step;
            let place = (ray.origin + ray.direction * depth).as_vec3();
            let (contents, block) = self.field.block(place);
            match contents {
                BlockContents::Nothing => {
                    let exit = exit_depth(ray, block, far);
                    number = (exit / step).ceil().max(number + 1.0);
                    before = None;
                    continue;
                }
                BlockContents::Smoke => {
                    // Strides are multiples of a stride from the camera, too.
                    let rest = (far / step).ceil() - number;
                    let stride = (SMOKE_STRIDE - number % SMOKE_STRIDE).min(rest);
                    number += stride;
                    before = None;
                    let radiance = lit.radiance(ray, step, number);
                    self.cross_smoke(place, depth, meters * stride as f32, radiance, &mut transmittance, &mut gathered);
                    if transmittance < OPAQUE {
                        break;
                    }
                    continue;
                }
                BlockContents::Sheet => {}
            }
            number += 1.0;
            let velocity = self.field.velocity(place);
            let point = place - velocity * displacement;
            let streak = velocity * half_streak;
            let (first, last) = (self.field.mixture(point - streak), self.field.mixture(point + streak));
            let middle = 0.5 * (first + last);
            let previous = before.unwrap_or(middle);
            before = Some(middle);
            let change = middle - previous;
            let center = middle - 0.5 * change;
            let half_width = 0.5 * (change.abs() + (last - first).abs());
            let [soot, soot_mixture] = self.sheet.mean_soot(center, half_width);
            let blue = self.sheet.blue_between(previous, middle);
            if soot <= 0.0 && blue <= 0.0 && center <= self.least_smoke {
                continue;
            }
            // Heat is lost where the soot is, which may be anywhere in the step.
            let way = if change == 0.0 { 1.0 } else { ((soot_mixture - previous) / change).clamp(0.0, 1.0) };
            let deficit = self.field.deficit(point - step_in_cells * (1.0 - way));
            let smoke = self.smoke(center, deficit);
            if soot <= 0.0 && blue <= 0.0 && smoke <= 0.0 {
                continue;
            }
            let absorption = self.soot_absorption * soot;
            let tau = (absorption + smoke) * meters;
            let opacity = 1.0 - approximations::exp(-tau);
            let seen = transmittance * opacity;
            if absorption > 0.0 {
                let kelvin = self.mixture.temperature_k(soot_mixture, deficit);
                let share = absorption / (absorption + smoke);
                let luminance = seen * share * approximations::exp(self.black_body.ln_luminance(kelvin));
                gathered.luminance += luminance;
                gathered.luminance_kelvin += luminance * kelvin;
                (0..3).for_each(|c| gathered.motion[c] += luminance * velocity[c]);
                gathered.motion[3] += luminance * depth as f32;
            }
            if smoke > 0.0 {
                let radiance = lit.radiance(ray, step, number);
                let share = seen * smoke / (absorption + smoke);
                (0..3).for_each(|c| gathered.scattered[c] += share * radiance[c]);
            }
            if blue > 0.0 {
                // Radicals shine where the sheet is fresh and hot; what soot has cooled burns without them.
                let freshness = (1.0 - deficit * (1.0 / BLUE_DEFICIT)).clamp(0.0, 1.0);
                gathered.blue += transmittance * blue * freshness * freshness * self.blue * BLUE_LUMINANCE;
            }
            gathered.optical_depth += tau;
            if gathered.depth.is_infinite() {
                gathered.depth = depth as f32;
            }
            transmittance -= seen;
            if transmittance < OPAQUE {
                break;
            }
        }
        gathered.opacity = 1.0 - transmittance;
        gathered
    }

    /// Adds smoke over a way of that many meters.
    #[inline(always)]
    fn cross_smoke(
        &self,
        place: Vec3,
        depth: f64,
        meters: f32,
        radiance: [f32; 3],
        transmittance: &mut f32,
        gathered: &mut Gathered,
    ) {
        let smoke = self.smoke(self.field.mixture(place), self.field.deficit(place));
        let tau = smoke * meters;
        if tau <= 0.0 {
            return;
        }
        let seen = *transmittance * (1.0 - approximations::exp(-tau));
        (0..3).for_each(|c| gathered.scattered[c] += seen * radiance[c]);
        gathered.optical_depth += tau;
        gathered.depth = gathered.depth.min(depth as f32);
        *transmittance -= seen;
    }

    /// Extinction coefficient of smoke, 1/m: what burnt soot there is in lean gas.
    #[inline(always)]
    fn smoke(&self, mixture: f32, deficit: f32) -> f32 {
        if self.smoke_extinction <= 0.0 {
            return 0.0;
        }
        let stoichiometric = self.mixture.stoichiometric;
        // Soot that still glows is drawn as such.
        let lean = (2.0 - 2.0 * mixture / stoichiometric).clamp(0.0, 1.0);
        let density = self.mixture.density(self.mixture.temperature_k(mixture, deficit));
        let seen = (mixture - self.least_smoke).max(0.0);
        self.smoke_extinction * density * seen * if stoichiometric >= 1.0 { 1.0 } else { lean }
    }
}

/// The light on smoke along a ray, which is looked up once for many steps.
struct LitSmoke<'a> {
    light: Option<&'a SmokeLight>,
    /// The steps of which it is the light.
    stride: f64,
    radiance: [f32; 3],
}

impl LitSmoke<'_> {
    /// The radiance of opaque smoke at a step. Strides are multiples of a stride from the camera, so that slices do not change them.
    #[inline(always)]
    fn radiance(&mut self, ray: &Ray, step: f64, number: f64) -> [f32; 3] {
        let Some(light) = self.light else { return [0.0; 3] };
        let stride = (number / LIGHT_STRIDE).floor();
        if stride != self.stride {
            self.stride = stride;
            self.radiance = light.at(ray.at((stride + 0.5) * LIGHT_STRIDE * step));
        }
        self.radiance
    }
}

/// Depth at which a ray leaves a block.
#[inline(always)]
fn exit_depth(ray: &Ray, block: [usize; 3], far: f64) -> f64 {
    let mut exit = far;
    for axis in 0..3 {
        let direction = ray.direction[axis];
        if direction != 0.0 {
            let side = (block[axis] + usize::from(direction > 0.0)) * BLOCK;
            // Cells before the first block are in it, too.
            let depth = (side as f64 - 0.5 - ray.origin[axis]) / direction;
            exit = exit.min(depth);
        }
    }
    exit
}
