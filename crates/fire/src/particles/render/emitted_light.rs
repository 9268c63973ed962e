//! Light that the gas casts on other objects: point lights along the flame.

use std::ops::Range;

use bansho_base::{
    color,
    host::parallel::prelude::*,
    math::DVec3,
    phenomenon::{
        strip::Shutter,
        surroundings::{Emitter, Light},
    },
};
use fearless_simd::dispatch;

use super::{
    gas::{Gas, PARTICLES_PER_TASK},
    samples::{GasExposure, GasState},
};
use crate::particles::parameters::GasRenderingParameters;

/// Slabs of height over which emission is accumulated.
const SLABS: usize = 48;

/// Emission of one slab.
#[derive(Clone, Copy, Debug, Default)]
struct Slab {
    /// Luminous intensity without self-absorption, cd, ACEScg.
    intensity: [f64; 3],
    /// Intensity times position.
    position_moment: DVec3,
    /// Sum of intensity times the square of the distance from the vertical axis through the origin.
    radial_moment: f64,
    /// Sum of absorption coefficient times volume, m^2: optical depth times area.
    absorption_area: f64,
}

impl Slab {
    /// Sum of the components of the intensity.
    fn power(&self) -> f64 {
        self.intensity.iter().sum::<f64>().max(0.0)
    }

    /// Adds another slab, times a weight.
    #[inline(always)]
    fn add(&mut self, other: &Self, weight: f64) {
        for c in 0..3 {
            self.intensity[c] += weight * other.intensity[c];
        }
        self.position_moment += other.position_moment * weight;
        self.radial_moment += weight * other.radial_moment;
        self.absorption_area += weight * other.absorption_area;
    }
}

/// Point lights that represent the gas at `t`: `rendering.light.count` segments of equal power along its height, each at its center of intensity, which
/// moves as smoothly as the gas.
///
/// Soot of volume V with absorption coefficient k and temperature T emits `V k B(T)` in every direction. Self-absorption of a
/// segment is that of a slab of the same optical depth, `(1 - exp(-tau)) / tau`.
pub fn point_lights_of_gas(gas: &Gas, rendering: &GasRenderingParameters, t: f64) -> Vec<Light> {
    let count = rendering.light.count.max(1) as usize;
    if rendering.light.scale <= 0.0 || gas.particles.is_empty() {
        return Vec::new();
    }
    let slabs = slabs(gas, rendering, t);
    let total: f64 = slabs.iter().map(Slab::power).sum();
    if total.is_nan() || total <= 0.0 {
        return Vec::new();
    }
    (0..count)
        .filter_map(|index| {
            segment_light(&slabs, [index, index + 1].map(|edge| total * edge as f64 / count as f64), rendering)
        })
        .collect()
}

/// Point lights that represent the gas during an exposure: each is the mean of those of the states.
pub fn point_lights_of_exposure(
    exposure: &GasExposure,
    rendering: &GasRenderingParameters,
    shutter: Shutter,
) -> Vec<Light> {
    let GasExposure { middle, states, is_short } = exposure;
    if *is_short || states.len() == 1 {
        return point_lights_of_gas(middle, rendering, shutter.middle());
    }
    let total: f64 = states.iter().map(|state| state.shutter.duration()).sum();
    let mut of_segments: Vec<Vec<Light>> = Vec::new();
    for GasState { gas, shutter } in states {
        let weight = (shutter.duration() / total) as f32;
        let lights = point_lights_of_gas(gas, rendering, shutter.middle());
        of_segments.resize_with(of_segments.len().max(lights.len()), Vec::new);
        for (segment, light) in of_segments.iter_mut().zip(lights) {
            segment.push(Light { intensity: light.intensity.map(|value| weight * value), ..light });
        }
    }
    of_segments.iter().filter_map(Light::merge_points).collect()
}

/// Emission by height. Each particle is distributed to the two nearest slabs.
fn slabs(gas: &Gas, rendering: &GasRenderingParameters, t: f64) -> Vec<Slab> {
    let (low, high) = height_range(gas, t);
    let step = ((high - low) / (SLABS - 1) as f64).max(1e-9);
    let level = bansho_base::math::simd::level();
    let slabs_of_tasks = tasks(gas).into_par_iter().map(|range| {
        let mut slabs = vec![Slab::default(); SLABS + 1];
        dispatch!(level, _simd => add_to_slabs(gas, rendering, t, range.clone(), [low, step], &mut slabs));
        slabs
    });
    let slabs_of_tasks: Vec<Vec<Slab>> = slabs_of_tasks.collect();
    // Tasks are summed in order, so that the result does not depend on the number of threads.
    let mut sums = vec![Slab::default(); SLABS + 1];
    for slabs in &slabs_of_tasks {
        for (sum, slab) in sums.iter_mut().zip(slabs) {
            sum.add(slab, 1.0);
        }
    }
    sums
}

/// The particle range of each task.
fn tasks(gas: &Gas) -> Vec<Range<usize>> {
    let count = gas.particles.len();
    (0..count).step_by(PARTICLES_PER_TASK).map(|first| first..(first + PARTICLES_PER_TASK).min(count)).collect()
}

/// Minimum and maximum height of the particles, m.
fn height_range(gas: &Gas, t: f64) -> (f64, f64) {
    let ranges_of_tasks = tasks(gas).into_par_iter().map(|range| {
        let (mut low, mut high) = (f64::MAX, f64::MIN);
        for index in range {
            let y = gas.position(index, t).y;
            (low, high) = (low.min(y), high.max(y));
        }
        (low, high)
    });
    ranges_of_tasks
        .reduce_with(|(low, high), (other_low, other_high)| (low.min(other_low), high.max(other_high)))
        .unwrap_or((f64::MAX, f64::MIN))
}

/// Adds particles to slabs that are `step` apart, from the height `low` on.
#[inline(always)]
fn add_to_slabs(
    gas: &Gas,
    rendering: &GasRenderingParameters,
    t: f64,
    range: Range<usize>,
    [low, step]: [f64; 2],
    slabs: &mut [Slab],
) {
    let table = color::black_body();
    for index in range {
        let absorption_area = gas.absorption(index, rendering) * gas.volume(index);
        if absorption_area <= 0.0 {
            continue;
        }
        let position = gas.position(index, t);
        let radiance = table.radiance(gas.particles.temperature[index]).map(f64::from);
        let slab_position = ((position.y - low) / step).clamp(0.0, (SLABS - 1) as f64);
        let fraction = slab_position - slab_position.floor();
        let intensity = radiance.map(|value| value * absorption_area);
        let power: f64 = intensity.iter().sum();
        let radial_moment = (position.x * position.x + position.z * position.z) * power;
        let contribution = Slab { intensity, position_moment: position * power, radial_moment, absorption_area };
        slabs[slab_position as usize].add(&contribution, 1.0 - fraction);
        slabs[slab_position as usize + 1].add(&contribution, fraction);
    }
}

/// The light of the segment of the flame between two values of cumulative power.
fn segment_light(slabs: &[Slab], [from, to]: [f64; 2], rendering: &GasRenderingParameters) -> Option<Light> {
    let mut sum = Slab::default();
    let mut cumulative = 0.0;
    for slab in slabs {
        let next_cumulative = cumulative + slab.power();
        let overlap = (next_cumulative.min(to) - cumulative.max(from)).max(0.0);
        if overlap > 0.0 {
            sum.add(slab, overlap / slab.power());
        }
        cumulative = next_cumulative;
    }
    let power = sum.power();
    if power <= 0.0 {
        return None;
    }
    let position = sum.position_moment / power;
    let deviation = (sum.radial_moment / power - position.x * position.x - position.z * position.z).max(0.0).sqrt();
    let radius = deviation.max(1e-3);
    // Seen from the side, a segment covers about a disc of twice its standard deviation.
    let tau = sum.absorption_area / (4.0 * std::f64::consts::PI * radius * radius);
    let escape_fraction = if tau > 1e-6 { -bansho_base::math::exp_m1(-tau) / tau } else { 1.0 };
    let scale = rendering.light.scale * escape_fraction;
    Some(Light {
        emitter: Emitter::Point { position, radius },
        intensity: sum.intensity.map(|value| (value * scale) as f32),
    })
}
