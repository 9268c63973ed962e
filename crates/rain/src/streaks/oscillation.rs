//! Oscillation of drops: speckle along their streaks.
//!
//! A falling drop oscillates about its round shape in modes whose frequencies Lord Rayleigh derived (1879). A lamp's light passes through a drop in a narrow
//! beam that the changing shape turns, so a streak is brighter and darker along its length (K. Garg and S. K. Nayar, "Photorealistic rendering of rain
//! streaks", 2006, who find the modes 2 and 3 to prevail). Here the brightness itself oscillates, about an unchanged mean.

use std::f64::consts::{PI, TAU};

use bansho_base::math;

/// Surface tension of water at 20 degrees Celsius, N/m.
const SURFACE_TENSION: f64 = 0.0728;
/// Density of water, kg/m^3.
const WATER_DENSITY: f64 = 998.2;
/// The modes, and their fractions of the amplitude.
const MODES: [(u32, f64); 2] = [(2, 2.0 / 3.0), (3, 1.0 / 3.0)];
/// Pieces into which a streak is cut for each period of mode 2.
const PIECES_PER_PERIOD: f64 = 10.0;
/// Shortest piece, pixels: shorter ones are not resolved.
const MIN_PIECE_PIXELS: f64 = 1.5;
/// Most pieces of a streak.
const MAX_PIECES: f64 = 256.0;

/// Frequency of mode `n` (2 or more) of a drop of diameter D, Hz: `sqrt(n (n - 1) (n + 2) sigma / (rho r^3)) / (2 pi)`.
pub fn mode_frequency(n: u32, diameter_mm: f64) -> f64 {
    let (n, radius) = (f64::from(n), 0.5e-3 * diameter_mm);
    math::sqrt(n * (n - 1.0) * (n + 2.0) * SURFACE_TENSION / (WATER_DENSITY * radius * radius * radius)) / TAU
}

/// The brightness of one drop over time.
#[derive(Clone, Copy, Debug)]
pub struct Oscillation {
    /// Angular frequency (1/s), phase and amplitude of each mode.
    modes: [[f64; 3]; 2],
}

impl Oscillation {
    /// The oscillation of a drop of diameter D with an `amplitude` of 0 to 1, and a phase of each mode, 0 to 1.
    pub fn new(diameter_mm: f64, amplitude: f64, phases: [f32; 2]) -> Self {
        let modes = std::array::from_fn(|index| {
            let (n, fraction) = MODES[index];
            [TAU * mode_frequency(n, diameter_mm), TAU * f64::from(phases[index]), amplitude * fraction]
        });
        Self { modes }
    }

    /// Brightness between two times (s after the shutter opens), relative to its mean over a long time: `1 + sum of a sin(w t + phase)`, averaged.
    pub fn mean_brightness(&self, from: f64, to: f64) -> f64 {
        let means = self.modes.into_iter().map(|[frequency, phase, amplitude]| {
            // The mean of a sine is its value at the middle times sinc.
            let (middle, half) = (0.5 * (from + to) * frequency + phase, 0.5 * (to - from) * frequency);
            let sinc = if half.abs() < 1e-6 { 1.0 } else { math::sin(half) / half };
            amplitude * sinc * math::sin(middle % (2.0 * PI))
        });
        1.0 + means.sum::<f64>()
    }

    /// Number of pieces of a streak of an exposure (s) that is `length` pixels long.
    pub(crate) fn piece_count(&self, exposure: f64, length: f64) -> usize {
        let periods = exposure * self.modes[0][0] / TAU;
        let resolved = (length / MIN_PIECE_PIXELS).min(MAX_PIECES);
        (PIECES_PER_PERIOD * periods).min(resolved).ceil().max(1.0) as usize
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::image::Image;

    use super::*;
    use crate::{
        billboards::texture::{FallingDrop, StreakCube},
        tests::reference::near,
    };

    #[test]
    fn frequencies_are_rayleighs() {
        // 8 * 0.0728 / (998.2 * 1e-9) = 583450; its root is 763.84 1/s.
        assert!(near(mode_frequency(2, 2.0), 763.84 / TAU, 1e-4));
        // With D^(-3/2), and mode 3 as sqrt(30/8) of mode 2.
        assert!(near(mode_frequency(2, 1.0) / mode_frequency(2, 2.0), 8.0_f64.sqrt(), 1e-9));
        assert!(near(mode_frequency(3, 1.0) / mode_frequency(2, 1.0), 3.75_f64.sqrt(), 1e-9));
    }

    #[test]
    fn brightness_has_the_mean_one_and_the_amplitude_asked_for() {
        for amplitude in [0.0, 0.4, 1.0] {
            let oscillation = Oscillation::new(1.5, amplitude, [0.3, 0.8]);
            assert!(near(oscillation.mean_brightness(0.0, 100.0), 1.0, 1e-3));
            let values: Vec<f64> =
                (0..4000).map(|i| oscillation.mean_brightness(f64::from(i) * 1e-5, f64::from(i) * 1e-5)).collect();
            let [low, high] = [f64::min, f64::max].map(|pick| values.iter().copied().fold(1.0, pick));
            assert!(
                low >= 0.0 && low <= 1.0 - 0.8 * amplitude && high >= 1.0 + 0.8 * amplitude && high <= 1.0 + amplitude
            );
        }
    }

    /// Amplitude of a frequency (1/m) in samples `step` apart, m.
    fn amplitude_at(frequency: f64, samples: &[f64], step: f64) -> f64 {
        let sum = samples.iter().enumerate().fold([0.0; 2], |[real, imaginary], (index, value)| {
            let (sin, cos) = math::sin_cos(TAU * frequency * step * (index as f64 + 0.5));
            [real + value * cos, imaginary + value * sin]
        });
        2.0 * math::hypot(sum[0], sum[1]) / samples.len() as f64
    }

    #[test]
    fn the_speckle_of_a_texture_has_the_drops_frequency_over_its_velocity() {
        // A streak of 3 m in a texture of 4 m, so that its frequency is well defined.
        let cube = StreakCube { edge: 4.0, size: 4096, exposure: 0.5, ..StreakCube::default() };
        for diameter_mm in [1.0, 1.6, 2.0] {
            let speed = cube.terminal_velocity.speed(diameter_mm);
            let drop = FallingDrop { diameter_mm, speed, position: [1.0, 3.9, 0.5] };
            let mut lit = Image::filled(cube.size, cube.size, [0.0]);
            cube.draw_speckled_over(&[drop], 0.5, 1, &mut lit).unwrap();
            let rows = (0.2 / cube.pixel()) as usize..((0.05 + 0.5 * speed) / cube.pixel()) as usize;
            let column: Vec<f64> = rows.map(|y| lit.row(y).iter().map(|[value]| f64::from(*value)).sum()).collect();
            let mean = column.iter().sum::<f64>() / column.len() as f64;
            let speckle: Vec<f64> = column.iter().map(|value| value / mean - 1.0).collect();
            let expected = mode_frequency(2, diameter_mm) / speed;
            let candidates = (0..4000).map(|i| expected * (0.5 + 0.0003 * f64::from(i)));
            let spectrum = candidates.map(|frequency| (frequency, amplitude_at(frequency, &speckle, cube.pixel())));
            let (found, amplitude) = spectrum.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
            assert!(near(found, expected, 0.01), "{diameter_mm} mm: {found} per m, expected {expected}");
            assert!(near(amplitude, 0.5 * 2.0 / 3.0, 0.06), "{diameter_mm} mm: {amplitude}");
            if diameter_mm == 1.0 {
                bansho_base::assert_measured!("section 2: speckle: at 1 mm, Hz", found * speed, 344.0, 3.4);
            } else if diameter_mm == 2.0 {
                bansho_base::assert_measured!("section 2: speckle: at 2 mm, Hz", found * speed, 122.0, 1.2);
            }
        }
    }
}
