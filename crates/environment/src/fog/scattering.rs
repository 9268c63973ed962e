//! The equations of a uniform medium: extinction, and light that is scattered once.

use std::f64::consts::PI;

use bansho_base::math::simd::Real;

/// Asymmetry g of the phase function of fog: that of water droplets with an effective radius of 5 um in visible light. Narasimhan and Nayar (2003) state 0.85 to 0.9 for
/// fog, and 0.8 to 0.85 for mist. By Mie theory (refractive index 1.333, 550 nm, gamma distributions with an effective variance of 0.1) it is 0.81 for 2 um, 0.85 for
/// 5 um, 0.86 for 10 um and 0.87 for 20 um; from 450 to 650 nm it changes by 0.01, for 2 um by 0.03.
pub(super) const ASYMMETRY: f64 = 0.85;

/// Extinction coefficient, 1/m, of a medium with a meteorological visibility in m: the distance at which the contrast of a black object is 2 %
/// (Koschmieder 1924), `beta = 3.912 / V`.
pub(super) fn extinction(visibility_m: f64) -> f64 {
    /// -ln 0.02.
    const CONTRAST: f64 = 3.912_023_005_428_146;
    CONTRAST / visibility_m
}

/// The phase function of Henyey and Greenstein (1941) at a scattering angle, 1/sr. Light that goes straight on has the cosine 1.
#[inline(always)]
pub(super) fn phase_function(cosine: f32) -> f32 {
    const G: f32 = ASYMMETRY as f32;
    const SCALE: f32 = ((1.0 - ASYMMETRY * ASYMMETRY) / (4.0 * PI)) as f32;
    let rsqrt = (1.0 + G * G - 2.0 * G * cosine).simd_max(1e-6).simd_rsqrt();
    SCALE * (rsqrt * rsqrt * rsqrt)
}

/// Half of the angle at a light up to which few nodes do, radians: not much more than the width of the peak of the phase function, 1 - g.
pub(super) const SMALL_ANGLE: f32 = 0.25;

/// Nodes on [-1, 1] and weights of the Gauss-Legendre quadrature of 4 points, for segments that are seen from the light within a small angle: the positive half.
pub(super) const FEW_NODES: [[f64; 2]; 2] =
    [[0.339_981_043_584_856_26, 0.652_145_154_862_546_1], [0.861_136_311_594_052_6, 0.347_854_845_137_453_86]];

/// The same for 12 points.
pub(super) const MANY_NODES: [[f64; 2]; 6] = [
    [0.125_233_408_511_468_9, 0.249_147_045_813_402_77],
    [0.367_831_498_998_180_2, 0.233_492_536_538_354_8],
    [0.587_317_954_286_617_5, 0.203_167_426_723_065_92],
    [0.769_902_674_194_304_7, 0.160_078_328_543_346_22],
    [0.904_117_256_370_474_9, 0.106_939_325_995_318_43],
    [0.981_560_634_246_719_3, 0.047_175_336_386_511_83],
];

/// The same light for one line of sight, in double precision: what the code for sixteen is compared with.
#[cfg(test)]
pub(super) mod reference {
    use std::f64::consts::{FRAC_PI_2, PI};

    use bansho_base::{
        math::{self, DVec3},
        phenomenon::surroundings::{Emitter, Light},
    };

    use super::{ASYMMETRY, FEW_NODES, MANY_NODES, SMALL_ANGLE};

    /// Transmittance over an optical depth; 0 over an infinite one.
    pub(in crate::fog) fn transmittance(optical_depth: f64) -> f64 {
        if optical_depth.is_finite() { math::exp(-optical_depth) } else { 0.0 }
    }

    /// The phase function of Henyey and Greenstein (1941) at a scattering angle, 1/sr. Light that goes straight on has the cosine 1.
    pub(in crate::fog) fn phase_function(cosine: f64) -> f64 {
        const G: f64 = ASYMMETRY;
        let base = (1.0 + G * G - 2.0 * G * cosine).max(1e-9);
        (1.0 - G * G) / (4.0 * PI * base * math::sqrt(base))
    }

    /// A part of a line of sight.
    #[derive(Clone, Copy, Debug)]
    pub(in crate::fog) struct Segment {
        /// Where the line of sight begins, m.
        pub(in crate::fog) eye: DVec3,
        /// Its direction, a unit vector.
        pub(in crate::fog) direction: DVec3,
        /// Distance at which the part begins, m.
        pub(in crate::fog) begin: f64,
        /// Distance at which it ends, m; may be infinite.
        pub(in crate::fog) end: f64,
    }

    /// Radiance that the medium within a segment scatters once from a light toward the beginning of the line of sight, ACEScg, cd/m^2.
    pub(in crate::fog) fn scattered(light: &Light, segment: &Segment, extinction: f64) -> [f32; 3] {
        match light.emitter {
            Emitter::Directional { toward } => {
                // It comes from outside of the medium, and is as strong everywhere.
                let cosine = toward.dot(segment.direction);
                let [near, far] = [segment.begin, segment.end].map(|distance| transmittance(extinction * distance));
                let scale = (phase_function(cosine) * (near - far)) as f32;
                light.intensity.map(|value| value * scale)
            }
            Emitter::Point { position, .. } | Emitter::Spot { position, .. } => {
                scattered_from(light, position, segment, extinction)
            }
        }
    }

    /// [`scattered`] for a light at a `position`. The distance along the line of sight is replaced by the angle at the light, `s = s0 + h tan a`: the illuminance times
    /// `ds` is then constant (Sun et al. 2005), and only the smooth exponential and the phase function are left to integrate.
    fn scattered_from(light: &Light, position: DVec3, segment: &Segment, extinction: f64) -> [f32; 3] {
        /// Least distance of a light from a line of sight, m.
        const MIN_DISTANCE: f64 = 1e-4;
        let nearest = (position - segment.eye).dot(segment.direction);
        let height = (segment.eye + segment.direction * nearest - position).length().max(MIN_DISTANCE);
        let [first, last] = [segment.begin, segment.end]
            .map(|distance| if distance.is_finite() { math::atan2(distance - nearest, height) } else { FRAC_PI_2 });
        let (middle, half) = (0.5 * (first + last), 0.5 * (last - first));
        let mut sum = [0.0_f64; 3];
        let nodes = if half < f64::from(SMALL_ANGLE) { FEW_NODES.as_slice() } else { MANY_NODES.as_slice() };
        for [node, weight] in nodes.iter().flat_map(|[node, weight]| [[*node, *weight], [-node, *weight]]) {
            let (sin, cos) = math::sin_cos(middle + half * node);
            let cos = cos.max(1e-9);
            let distance = nearest + height * sin / cos;
            let incident = light.incident_light(segment.eye + segment.direction * distance);
            // From the light to the point, and from there toward the eye.
            let optical_depth = extinction * (distance.max(0.0) + incident.distance);
            let step = weight * half * height / (cos * cos);
            let factor = extinction * phase_function(-sin) * transmittance(optical_depth) * step;
            for c in 0..3 {
                sum[c] += f64::from(incident.illuminance[c]) * factor;
            }
        }
        sum.map(|value| value as f32)
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::{
        math::{self, DVec3},
        phenomenon::surroundings::{Emitter, Light},
    };

    use super::{
        reference::{Segment, phase_function, scattered, transmittance},
        *,
    };

    fn lamp(position: DVec3) -> Light {
        Light { emitter: Emitter::Point { position, radius: 0.01 }, intensity: [100.0, 50.0, 0.0] }
    }

    #[test]
    fn a_black_object_at_the_visibility_has_a_contrast_of_two_percent() {
        for visibility in [20.0, 500.0, 1e5] {
            let contrast = transmittance(extinction(visibility) * visibility);
            assert!((contrast - 0.02).abs() < 1e-12, "{contrast} at {visibility} m");
        }
        assert!((extinction(1000.0) - 3.912e-3).abs() < 1e-6);
        assert_eq!(transmittance(f64::INFINITY), 0.0);
    }

    #[test]
    fn the_phase_function_is_normalized_and_has_its_mean_cosine() {
        let (mut total, mut moment) = (0.0, 0.0);
        let steps = 200_000;
        for step in 0..steps {
            let cosine = -1.0 + 2.0 * (f64::from(step) + 0.5) / f64::from(steps);
            let single = f64::from(super::phase_function(cosine as f32));
            assert!((single / phase_function(cosine) - 1.0).abs() < 1e-4);
            let weight = 2.0 * PI * single * 2.0 / f64::from(steps);
            total += weight;
            moment += weight * cosine;
        }
        assert!((total - 1.0).abs() < 1e-4 && (moment - ASYMMETRY).abs() < 1e-4, "{total}, {moment}");
    }

    /// The integral in small steps of the distance.
    fn in_small_steps(light: &Light, segment: &Segment, extinction: f64) -> f64 {
        let steps = 400_000;
        let step = (segment.end - segment.begin) / f64::from(steps);
        let mut sum = 0.0;
        for index in 0..steps {
            let distance = segment.begin + (f64::from(index) + 0.5) * step;
            let incident = light.incident_light(segment.eye + segment.direction * distance);
            let cosine = incident.toward.dot(segment.direction);
            let depth = extinction * (distance + incident.distance);
            sum += extinction * phase_function(cosine) * f64::from(incident.illuminance[0]) * math::exp(-depth) * step;
        }
        sum
    }

    #[test]
    fn the_light_of_a_lamp_is_the_integral_along_the_line_of_sight() {
        let whole = Segment { eye: DVec3::ZERO, direction: -DVec3::Z, begin: 0.0, end: 120.0 };
        for position in [DVec3::new(2.0, 1.0, -10.0), DVec3::new(0.4, 0.0, -30.0), DVec3::new(-3.0, 4.0, 5.0)] {
            for (begin, end) in [(0.0, 120.0), (0.0, 8.0), (8.0, 25.0), (20.0, 21.0), (40.0, 90.0)] {
                for visibility in [30.0, 400.0] {
                    let (segment, beta) = (Segment { begin, end, ..whole }, extinction(visibility));
                    let [red, green, blue] = scattered(&lamp(position), &segment, beta).map(f64::from);
                    let expected = in_small_steps(&lamp(position), &segment, beta);
                    assert!((red / expected - 1.0).abs() < 0.03, "{red}, {expected}: {position} {begin} {visibility}");
                    assert!((green - 0.5 * red).abs() < 1e-6 * red && blue == 0.0);
                }
            }
        }
    }

    #[test]
    fn parts_of_a_line_of_sight_add_up() {
        let light = lamp(DVec3::new(1.0, 0.5, -6.0));
        let line = Segment { eye: DVec3::ZERO, direction: -DVec3::Z, begin: 0.0, end: f64::INFINITY };
        let beta = extinction(60.0);
        let whole = scattered(&light, &line, beta)[0];
        let parts = [0.0, 3.0, 6.0, 20.0, f64::INFINITY];
        let sum: f32 = parts
            .windows(2)
            .map(|pair| scattered(&light, &Segment { begin: pair[0], end: pair[1], ..line }, beta)[0])
            .sum();
        assert!((sum / whole - 1.0).abs() < 0.02, "{sum} in parts, {whole}");
        let sun = Light { emitter: Emitter::Directional { toward: -DVec3::Z }, intensity: [1e4; 3] };
        // All of the light toward the sun is scattered once: E p(0).
        let expected = 1e4 * phase_function(1.0);
        assert!((f64::from(scattered(&sun, &line, beta)[0]) / expected - 1.0).abs() < 1e-6);
    }
}
