//! Phase function of a water drop, by ray tracing.
//!
//! A sphere of clear water in geometric optics. Fresnel's equations divide the light at each surface. Path 0 is
//! reflected outside, path 1 is transmitted directly, path 2 is reflected once inside (the primary rainbow), and so on.
//! There is no absorption: all light leaves again. Diffraction and polarization are not included.

use std::f64::consts::{FRAC_PI_2, PI};

use bansho_base::{
    math::{self, DVec3},
    world::sky::Sky,
};

/// Refractive index of water at 20 degrees Celsius and 630, 540 and 460 nm, about the wavelengths of ACEScg's red,
/// green and blue.
const REFRACTIVE_INDICES: [f64; 3] = [1.3317, 1.3346, 1.3380];
/// Steps of the table from 0 to 180 degrees.
const ANGLE_STEPS: usize = 180;
/// Number of paths that are traced; all others together carry 0.02 % of the light.
const PATHS: usize = 10;
/// Number of angles of incidence that are traced.
const RAYS: usize = 1024;
/// Number of directions of the quadrature over a drop's surroundings.
const DIRECTIONS: usize = 48;

/// The tabulated phase function of a water drop.
#[derive(Clone, Debug)]
pub struct DropPhaseFunction {
    /// Phase function by scattering angle, for red, green and blue; linear interpolation.
    phase: [[f32; 3]; ANGLE_STEPS + 1],
    /// Directions of equal probability by the phase function, relative to a line of sight along z.
    directions: [DVec3; DIRECTIONS],
}

impl Default for DropPhaseFunction {
    fn default() -> Self {
        Self::new()
    }
}

impl DropPhaseFunction {
    /// Traces the rays; takes a few milliseconds.
    pub fn new() -> Self {
        let channels = REFRACTIVE_INDICES.map(|index| phase_table(&trace_rays(index)));
        let phase = std::array::from_fn(|i| [0, 1, 2].map(|c| channels[c][i] as f32));
        Self { phase, directions: stratified_directions(&channels[1]) }
    }

    /// Phase function for red, green and blue at the cosine of the scattering angle; 1 is forward. Its mean over the
    /// sphere is 1, so a drop in illuminance E has the mean radiance `E p / (4 pi)`, and under a uniform sky it has the
    /// radiance of the sky.
    pub fn phase(&self, cos_deviation: f32) -> [f32; 3] {
        let steps = math::f32::acos(cos_deviation.clamp(-1.0, 1.0)) * (ANGLE_STEPS as f32 / std::f32::consts::PI);
        let lower = (steps as usize).min(ANGLE_STEPS - 1);
        let fraction = steps - lower as f32;
        [0, 1, 2].map(|c| self.phase[lower][c] * (1.0 - fraction) + self.phase[lower + 1][c] * fraction)
    }

    /// Mean radiance of a drop that is seen along `line` (unit vector from the eye to the drop): the integral of
    /// `radiance` by direction times the phase function, by quasi-Monte Carlo importance sampling.
    pub fn mean_radiance(&self, line: DVec3, radiance: impl Fn(DVec3) -> [f32; 3]) -> [f32; 3] {
        let (side, up) = line.any_orthonormal_pair();
        let sum = self.directions.iter().fold([0.0; 3], |sum: [f32; 3], direction| {
            let incident = radiance(side * direction.x + up * direction.y + line * direction.z);
            [0, 1, 2].map(|c| sum[c] + incident[c])
        });
        sum.map(|sum| sum * (1.0 / DIRECTIONS as f32))
    }

    /// [`mean_radiance`](Self::mean_radiance) under a sky, with the same bits. Where the sky was measured, all directions are looked up at once.
    #[inline(always)]
    pub(super) fn mean_sky_radiance(&self, line: DVec3, sky: &Sky) -> [f32; 3] {
        let (side, up) = line.any_orthonormal_pair();
        let mut sines = [0.0; DIRECTIONS];
        for i in 0..DIRECTIONS {
            let direction = &self.directions[i];
            sines[i] = side.y * direction.x + up.y * direction.y + line.y * direction.z;
        }
        let Some(planes) = sky.measured_radiances(&sines) else {
            return self.mean_radiance(line, |direction| sky.radiance(direction));
        };
        let mut mean = [0.0; 3];
        for c in 0..3 {
            for i in 0..DIRECTIONS {
                mean[c] += planes[c][i];
            }
            mean[c] *= 1.0 / DIRECTIONS as f32;
        }
        mean
    }
}

/// A ray that leaves a drop, by path and angle of incidence.
#[derive(Clone, Copy, Debug)]
struct ExitingRay {
    /// Scattering angle, 0 to pi.
    deviation: f64,
    /// Fraction of the light that falls on the drop.
    fraction: f64,
}

/// Fresnel reflectances for s and p polarization at angles of incidence and refraction.
fn fresnel_reflectances(incidence: f64, refraction: f64) -> [f64; 2] {
    let (difference, sum) = (incidence - refraction, incidence + refraction);
    let [sines, tangents] = [[difference, sum].map(math::sin), [difference, sum].map(math::tan)];
    [sines, tangents].map(|[difference, sum]| difference * difference / (sum * sum).max(f64::MIN_POSITIVE))
}

/// Rays of all paths through a drop of refractive index `index`, at evenly spaced angles of incidence.
fn trace_rays(index: f64) -> Vec<[ExitingRay; PATHS]> {
    let step = FRAC_PI_2 / RAYS as f64;
    let mut rays = Vec::with_capacity(RAYS);
    for ray in 0..RAYS {
        let incidence = step * (ray as f64 + 0.5);
        let refraction = math::asin(math::sin(incidence) / index);
        let reflected = fresnel_reflectances(incidence, refraction);
        // The fraction of the disc's area at this angle, from d(sin^2 i): they sum to 1 over all angles.
        let fraction = math::sin(2.0 * incidence) * math::sin(step);
        rays.push(std::array::from_fn(|path| ExitingRay {
            deviation: deviation(path, incidence, refraction),
            fraction: fraction * 0.5 * (exit_fraction(reflected[0], path) + exit_fraction(reflected[1], path)),
        }));
    }
    rays
}

/// Fraction of the light of one polarization that leaves by a path.
fn exit_fraction(reflected: f64, path: usize) -> f64 {
    if path == 0 {
        return reflected;
    }
    let inside = (1..path).fold(1.0, |product, _| product * reflected);
    (1.0 - reflected) * (1.0 - reflected) * inside
}

/// Scattering angle of a path, folded to 0..=pi.
fn deviation(path: usize, incidence: f64, refraction: f64) -> f64 {
    let turned = match path {
        0 => PI - 2.0 * incidence,
        _ => 2.0 * (incidence - refraction) + (path - 1) as f64 * (PI - 2.0 * refraction),
    };
    let turned = turned - 2.0 * PI * (turned / (2.0 * PI)).floor();
    turned.min(2.0 * PI - turned)
}

/// The phase function at each step, normalized to a mean of 1 over the sphere with linear interpolation between the
/// steps.
fn phase_table(rays: &[[ExitingRay; PATHS]]) -> [f64; ANGLE_STEPS + 1] {
    let mut energy = [0.0; ANGLE_STEPS + 1];
    for ray in rays.as_flattened() {
        let steps = ray.deviation * ANGLE_STEPS as f64 / PI;
        let lower = (steps as usize).min(ANGLE_STEPS - 1);
        let fraction = steps - lower as f64;
        energy[lower] += ray.fraction * (1.0 - fraction);
        energy[lower + 1] += ray.fraction * fraction;
    }
    let whole: f64 = energy.iter().sum();
    std::array::from_fn(|i| 4.0 * PI * energy[i] / (whole * solid_angle(i)))
}

/// Integral over the sphere of the hat function that is 1 at a step and 0 at its neighbors.
fn solid_angle(step: usize) -> f64 {
    let h = PI / ANGLE_STEPS as f64;
    let theta = h * step as f64;
    let rising = if step > 0 { rising_side_integral(theta, h) } else { 0.0 };
    // By symmetry, the falling side is the rising side that ends at pi - theta.
    let falling = if step < ANGLE_STEPS { rising_side_integral(PI - theta, h) } else { 0.0 };
    2.0 * PI * (rising + falling)
}

/// Integral of `sin` times a line that rises from 0 at `theta - h` to 1 at `theta`.
fn rising_side_integral(theta: f64, h: f64) -> f64 {
    -math::cos(theta) + (math::sin(theta) - math::sin(theta - h)) / h
}

/// Directions along a golden-angle spiral, stratified by the cumulative distribution of the phase function.
fn stratified_directions(phase: &[f64; ANGLE_STEPS + 1]) -> [DVec3; DIRECTIONS] {
    /// Golden angle, turns.
    const GOLDEN: f64 = 0.381_966_011_250_105;
    let mut cumulative = [0.0; ANGLE_STEPS + 2];
    for i in 0..=ANGLE_STEPS {
        cumulative[i + 1] = cumulative[i] + phase[i] * solid_angle(i) / (4.0 * PI);
    }
    std::array::from_fn(|k| {
        let target = (k as f64 + 0.5) / DIRECTIONS as f64;
        let step = cumulative.partition_point(|&sum| sum <= target).clamp(1, ANGLE_STEPS + 1) - 1;
        let within = (target - cumulative[step]) / (cumulative[step + 1] - cumulative[step]);
        let theta = ((step as f64 - 0.5 + within) * PI / ANGLE_STEPS as f64).clamp(0.0, PI);
        let (sin_phi, cos_phi) = math::sin_cos(2.0 * PI * GOLDEN * k as f64);
        let (sin_theta, cos_theta) = math::sin_cos(theta);
        DVec3::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta)
    })
}

#[cfg(test)]
mod tests {
    use bansho_base::{
        math::simd,
        world::sky::{ElevationProfile, ElevationSample, SkyKind},
    };
    use fearless_simd::dispatch;

    use super::*;
    use crate::tests::reference::{near, rows};

    #[test]
    fn light_divides_among_the_paths_as_in_the_reference() {
        for [index, view, p0, p1, p2, p3, p4, p5, rest, center, ..] in
            rows::<13>(include_str!("../../data/drop_lens.csv"))
        {
            let rays = trace_rays(index);
            let fraction = |path: usize| rays.iter().map(|paths| paths[path].fraction).sum::<f64>();
            for (path, expected) in [p0, p1, p2, p3, p4, p5].into_iter().enumerate() {
                assert!(near(fraction(path), expected, 2e-3), "n = {index}, path {path}: {}", fraction(path));
            }
            let all: f64 = rays.as_flattened().iter().map(|ray| ray.fraction).sum();
            assert!((1.0 - rest..=1.0 + 1e-9).contains(&all), "{all}");
            let widest = rays.iter().map(|paths| paths[1].deviation).fold(0.0, f64::max);
            assert!(near(2.0 * widest.to_degrees(), view, 2e-3), "{}", 2.0 * widest.to_degrees());
            let step = FRAC_PI_2 / RAYS as f64;
            assert!(near(rays[0][1].fraction / (math::sin(step) * math::sin(step)), center, 1e-3));
        }
    }

    #[test]
    fn the_mean_refracted_deviation_is_that_of_the_reference() {
        for [index, .., mean] in rows::<13>(include_str!("../../data/drop_lens.csv")) {
            let refracted = trace_rays(index).into_iter().map(|paths| paths[1]);
            let (cosines, shares) = refracted.fold((0.0, 0.0), |(cosines, shares), ray| {
                (cosines + ray.fraction * math::cos(ray.deviation), shares + ray.fraction)
            });
            assert!(near(cosines / shares, mean, 1e-3), "{}", cosines / shares);
        }
    }

    /// Mean of the phase function over the sphere, by finer steps than its own.
    fn mean_over_sphere(phase_function: &DropPhaseFunction, channel: usize, range_deg: [f64; 2]) -> f64 {
        let steps = 20_000;
        let [from, to] = range_deg.map(f64::to_radians);
        let h = (to - from) / steps as f64;
        let ring = |i: usize| {
            let theta = from + h * (i as f64 + 0.5);
            phase_function.phase(math::cos(theta) as f32)[channel] as f64 * math::sin(theta) * h
        };
        0.5 * (0..steps).map(ring).sum::<f64>()
    }

    #[test]
    fn no_light_is_lost_and_most_goes_forward() {
        let phase_function = DropPhaseFunction::new();
        for channel in 0..3 {
            let all = mean_over_sphere(&phase_function, channel, [0.0, 180.0]);
            assert!(near(all, 1.0, 1e-4), "{all}");
            let forward = mean_over_sphere(&phase_function, channel, [0.0, 83.0]);
            assert!((0.9..0.96).contains(&forward), "{forward}");
        }
        assert!(phase_function.phase(1.0)[1] > 20.0 * phase_function.phase(0.0)[1]);
        assert!(phase_function.phase.iter().flatten().all(|p| p.is_finite() && *p > 0.0));
    }

    #[test]
    fn the_rainbow_stands_at_42_degrees_red_outside() {
        let phase_function = DropPhaseFunction::new();
        let peak = |channel: usize| {
            (130..145)
                .max_by(|a, b| phase_function.phase[*a][channel].total_cmp(&phase_function.phase[*b][channel]))
                .expect("angles")
        };
        // 180 - 42.4 degrees for red, 180 - 41.4 for blue.
        assert_eq!((peak(0), peak(2)), (138, 139));
        let at = |degrees: usize| phase_function.phase[degrees][1];
        // Alexander's band is darker than either side.
        assert!(at(134) < 0.3 * at(138) && at(134) < at(127));
    }

    #[test]
    fn a_drop_under_a_uniform_sky_looks_like_it() {
        let phase_function = DropPhaseFunction::new();
        for line in [DVec3::Z, DVec3::X, DVec3::new(0.3, -0.5, 0.2).normalize()] {
            let seen = phase_function.mean_radiance(line, |_| [3.0, 2.0, 1.0]);
            assert!(seen.iter().zip([3.0, 2.0, 1.0]).all(|(seen, sky)| near(*seen as f64, sky, 1e-6)));
        }
    }

    #[test]
    fn a_measured_sky_has_the_bits_of_its_directions() {
        let samples = (0..60).map(|i| ElevationSample {
            sine: f64::from(i) / 30.0 - 1.0,
            weight: 1.0,
            radiance: [i as f32, 7.0, 0.3 * i as f32],
        });
        let phase_function = DropPhaseFunction::new();
        let measured = Sky::measured(ElevationProfile::from_samples(samples).unwrap());
        for sky in [measured, Sky::new(SkyKind::Overcast, 900.0, 6500.0)] {
            for line in [DVec3::Z, -DVec3::Y, DVec3::new(0.3, 0.5, -0.2).normalize()] {
                let expected = phase_function.mean_radiance(line, |direction| sky.radiance(direction));
                let found = dispatch!(simd::level(), _simd => phase_function.mean_sky_radiance(line, &sky));
                assert_eq!(found.map(f32::to_bits), expected.map(f32::to_bits), "{line}");
            }
        }
    }

    #[test]
    fn gathering_agrees_with_the_phase_function() {
        // A sky that brightens upward, seen level and from below: the integral of the phase function over it.
        let phase_function = DropPhaseFunction::new();
        let sky = |direction: DVec3| 1.0 + direction.y;
        for line in [DVec3::Z, DVec3::new(0.0, 0.6, 0.8), -DVec3::Y] {
            let gathered = phase_function.mean_radiance(line, |direction| [sky(direction) as f32; 3])[1] as f64;
            // Of a sky that is linear in direction only the mean cosine counts.
            let steps = 20_000;
            let h = PI / steps as f64;
            let cosine: f64 = (0..steps)
                .map(|i| math::cos(h * (i as f64 + 0.5)))
                .map(|c| 0.5 * h * phase_function.phase(c as f32)[1] as f64 * c * math::sqrt(1.0 - c * c))
                .sum();
            assert!((gathered - (1.0 + cosine * line.y)).abs() < 0.03, "{gathered} {}", 1.0 + cosine * line.y);
        }
    }
}
