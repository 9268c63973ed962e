//! Waves of open water: a sum of deep-water gravity waves in closed form.

use std::f64::consts::{PI, TAU};

use bansho_base::{
    math::{
        self, DVec2,
        random::{Key, Purpose, uniform_f64},
    },
    world::gravity::STANDARD_GRAVITY,
};

/// Number of waves in the sum: enough to show no beat, few enough to evaluate at every pixel.
const WAVE_COUNT: usize = 14;
/// Ratio of the longest to the shortest wavelength.
const LENGTH_RATIO: f64 = 40.0;
/// Largest angle between a wave and the wind, radians.
const MAX_ANGLE: f64 = 0.42 * PI;

/// One wave: slope = amplitude * cos(k . x - omega t + phase) along k.
#[derive(Clone, Copy, Debug)]
struct Wave {
    vector: DVec2,
    length: f64,
    phase: f64,
    slope: DVec2,
}

/// The waves at one time.
#[derive(Clone, Debug)]
pub(super) struct Waves {
    waves: Vec<Wave>,
}

/// The slope of the water at a position.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct WaveSlope {
    /// Slope along x and z, of the waves that a pixel resolves.
    pub(super) resolved: DVec2,
    /// Fraction of the slope variance in waves too short to be resolved.
    pub(super) unresolved: f64,
}

impl Waves {
    /// Waves with an r.m.s. `slope` and a maximum wavelength `longest` (m), in a wind toward `heading`, at time `t`. In
    /// a loop every wave is periodic in `loop_s` seconds.
    pub(super) fn new(key: Key, slope: f64, longest: f64, heading: DVec2, t: f64, loop_s: Option<f64>) -> Self {
        let wave = |index: usize| {
            let words = key.words(index as u64, 0, Purpose::named("wave"));
            let [turn, phase] = [uniform_f64(words[0], words[1]), uniform_f64(words[2], words[3])];
            let fraction = index as f64 / (WAVE_COUNT - 1) as f64;
            let length = longest * math::pow(LENGTH_RATIO, -fraction);
            let along = heading.rotate(unit_vector((2.0 * turn - 1.0) * MAX_ANGLE));
            let number = TAU / length;
            // Dispersion relation of deep water: omega^2 = g k.
            let frequency = quantize_frequency(math::sqrt(STANDARD_GRAVITY * number) / TAU, loop_s) * t;
            let amplitude = slope * math::sqrt(2.0 / WAVE_COUNT as f64);
            Wave {
                vector: along * number,
                length,
                phase: TAU * (phase - frequency.rem_euclid(1.0)),
                slope: along * amplitude,
            }
        };
        Self { waves: (0..WAVE_COUNT).map(wave).collect() }
    }

    /// The slope at a position (x, z), filtered with a pixel's `footprint`, m.
    pub(super) fn slope(&self, position: DVec2, footprint: f64) -> WaveSlope {
        let mut slope = WaveSlope::default();
        for wave in &self.waves {
            // Below two pixels a wave is not resolved, from six pixels on wholly.
            let visibility = math::smoothstep(2.0, 6.0, wave.length / footprint.max(1e-9));
            if visibility > 0.0 {
                slope.resolved += wave.slope * (visibility * math::cos(wave.vector.dot(position) + wave.phase));
            }
            slope.unresolved += (1.0 - visibility * visibility) / WAVE_COUNT as f64;
        }
        slope
    }
}

/// Rounds a frequency (1/s) to a whole number of periods in the loop.
fn quantize_frequency(frequency: f64, loop_s: Option<f64>) -> f64 {
    loop_s.map_or(frequency, |seconds| (frequency * seconds).round().max(1.0) / seconds)
}

/// The unit vector at an angle.
fn unit_vector(angle: f64) -> DVec2 {
    let (sin, cos) = math::sin_cos(angle);
    DVec2::new(cos, sin)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn waves(t: f64, loop_s: Option<f64>) -> Waves {
        Waves::new(Key::new(1, "ground"), 0.05, 4.0, DVec2::X, t, loop_s)
    }

    #[test]
    fn the_slope_has_the_variance_asked_for() {
        let waves = waves(0.0, None);
        let positions = 20_000;
        let square = |index: i32| {
            let position = DVec2::new(f64::from(index) * 1.37, f64::from(index % 611) * 3.11);
            waves.slope(position, 0.0).resolved.length_squared()
        };
        let mean = (0..positions).map(square).sum::<f64>() / f64::from(positions);
        assert!((math::sqrt(mean) / 0.05 - 1.0).abs() < 0.1, "{}", math::sqrt(mean));
    }

    #[test]
    fn far_water_has_no_waves_to_be_seen() {
        let slope = waves(0.0, None).slope(DVec2::new(3.0, 4.0), 10.0);
        assert_eq!(slope, WaveSlope { resolved: DVec2::ZERO, unresolved: slope.unresolved });
        assert!((slope.unresolved - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_loop_ends_where_it_began() {
        let at = |t| waves(t, Some(3.0)).slope(DVec2::new(1.0, 2.0), 0.0).resolved;
        assert!((at(0.0) - at(3.0)).length() < 1e-9);
        assert!((at(0.0) - at(1.5)).length() > 1e-4);
    }
}
