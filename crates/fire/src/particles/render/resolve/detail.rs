//! Detail finer than the particles: intermittency of burning.
//!
//! Sums over particles are as smooth as their kernels; a flame is not. In turbulent gas burning is intermittent, with sharp edges.
//! The smooth optical depth tau is therefore redistributed: a fraction gamma of the area burns with the optical depth tau / gamma,
//! the rest not at all. Fractal noise in Lagrangian coordinates selects the burning area, so that the pattern is advected and stretched with the gas.
//! The mean of the optical depth over area remains tau, and so does the mean light.

use bansho_base::{
    math::{self, approximations, random::Purpose},
    noise::{Coordinate, Fractal, LANES, Noise, VARIANCE},
};

use crate::particles::{parameters::GasRenderingParameters, render::gas::Gas};

/// Standard deviation of the logistic distribution, pi / sqrt(3): its CDF is a sigmoid of slope 1.
const LOGISTIC: f32 = 1.813_799_4;
/// Optical depth, in particles, at which the burning fraction saturates, so that even dense cores have gaps.
const MAX_DEPTH_PARTICLES: f32 = 2.5;
/// Mean number of particles along the line of sight at which half of the area burns.
const MEAN_PARTICLES_HALF_BURNING: f64 = 0.42;
/// Scale of detail along the vertical relative to the horizontal.
const VERTICAL_SCALE: f64 = 0.45;
/// Relative change of temperature with the noise. The luminance is not changed.
const TEMPERATURE_VARIATION: f32 = 0.03;

/// Detail of one flame in one frame.
#[derive(Clone, Debug)]
pub(crate) struct Detail {
    noise: Noise<3>,
    /// [`LOGISTIC`] divided by the standard deviation of the noise.
    steepness: f32,
    /// Noise cells per meter along x, y and z.
    pub(crate) cells_per_meter: [f32; 3],
    /// Noise cells per second by which the noise moves upward.
    rate: f64,
    /// Origin of the noise at the time of the frame.
    base: [Coordinate; 3],
    /// Displacement of the noise while the shutter is open, cells.
    shift: [f32; 3],
    /// Time samples that are averaged over the exposure.
    time_samples: usize,
    /// 1 / optical depth at which half of the area burns.
    inverse_half_depth: f32,
    /// 1 / width of the transition between burning and not burning.
    sharpness: f32,
    /// Exponent that preserves the mean for that width.
    mean_exponent: f32,
    /// Amount of detail from 0 to 1, the parameter `detail`.
    amount: f32,
    /// Size of a noise cell, pixels.
    pub(crate) cell_pixels: f32,
}

/// Factors that detail applies at sixteen pixels.
pub(crate) struct DetailFactors {
    /// Factor of the optical depth.
    pub(crate) depth: [f32; LANES],
    /// Factor of the temperature.
    pub(crate) temperature: [f32; LANES],
}

/// Scales of the gas as seen by a view, which determine its detail.
pub(crate) struct DetailScale {
    /// Mean support radius, m.
    pub(crate) radius: f64,
    /// Mean absorption coefficient, 1/m.
    pub(crate) absorption: f64,
    /// Pixels per meter.
    pub(crate) pixels_per_meter: f64,
    /// Time at the middle of the exposure, s.
    pub(crate) time: f64,
    /// Exposure time, s.
    pub(crate) exposure_s: f64,
    /// Apparent motion of a static point while the shutter is open, m in world axes.
    pub(crate) camera_motion: [f64; 3],
}

impl Detail {
    /// The detail of a flame; `None` if there is none.
    pub(crate) fn new(gas: &Gas, rendering: &GasRenderingParameters, scale: &DetailScale) -> Option<Self> {
        if rendering.detail <= 0.0 || !(scale.radius > 0.0 && scale.absorption > 0.0) {
            return None;
        }
        let size = rendering.detail_size * scale.radius;
        let octaves = (math::log2(size * scale.pixels_per_meter / 2.5).floor() as i64 + 1).clamp(1, 4) as u32;
        let fractal = Fractal { octaves, lacunarity: 2, gain: 0.55 };
        let words = gas.key.words(0, 0, Purpose::named("detail"));
        let noise = Noise::new(words[0], fractal, [0; 3]).ok()?;
        let cells_per_meter = [1.0 / size, VERTICAL_SCALE / size, 1.0 / size];
        let rate = gas.detail_speed / size;
        let scrolled = rate * scale.time;
        let shift: [f64; 3] = std::array::from_fn(|axis| {
            cells_per_meter[axis] * scale.camera_motion[axis] - if axis == 1 { rate * scale.exposure_s } else { 0.0 }
        });
        let length = shift.iter().map(|s| s * s).sum::<f64>().sqrt() * f64::from(1 << (octaves - 1));
        let softness = math::lerp(1.6, 0.16, rendering.sharpness);
        Some(Self {
            steepness: LOGISTIC / deviation(&fractal),
            noise,
            cells_per_meter: cells_per_meter.map(|cells| cells as f32),
            rate,
            base: [0.0, -scrolled, 0.0].map(Coordinate::from_f64),
            shift: shift.map(|s| s as f32),
            time_samples: length.round().clamp(1.0, 6.0) as usize,
            inverse_half_depth: (1.0 / (MEAN_PARTICLES_HALF_BURNING * scale.absorption * scale.radius)) as f32,
            sharpness: (1.0 / softness) as f32,
            mean_exponent: (1.0 / (1.0 + softness * softness).sqrt()) as f32,
            amount: rendering.detail as f32,
            cell_pixels: (size * scale.pixels_per_meter) as f32,
        })
    }

    /// Offset of particle `index` in the noise relative to its position, cells: its displacement since it was spawned, and its age.
    #[inline(always)]
    pub(crate) fn detail_offset(&self, gas: &Gas, index: usize, seconds_since_state: f64) -> [f32; 3] {
        let particles = gas.particles;
        let mut detail_offset = [0.0; 3];
        for axis in 0..3 {
            let now =
                (seconds_since_state as f32).mul_add(particles.velocity[axis][index], particles.position[axis][index]);
            detail_offset[axis] = (particles.spawn_point[axis][index] - now) * self.cells_per_meter[axis];
        }
        let age = f64::from(particles.age[index]) + seconds_since_state;
        detail_offset[1] += (self.rate * age) as f32;
        detail_offset
    }

    /// Whether the optical depth at sixteen pixels is too small for detail to be visible.
    #[inline(always)]
    pub(crate) fn is_negligible(&self, tau: &[f32; LANES]) -> bool {
        /// Optical depth, relative to that at which half of the area burns, below which even peaks of the noise remain dark.
        const NEGLIGIBLE_DEPTH: f32 = 2e-4;
        let mut max_tau = 0.0_f32;
        for lane in 0..LANES {
            max_tau = max_tau.max(tau[lane]);
        }
        max_tau * self.inverse_half_depth < NEGLIGIBLE_DEPTH
    }

    /// Factors at sixteen positions in the noise, where the smooth optical depth is `tau` and the fraction `visible_fraction` of the detail is visible.
    #[inline(always)]
    pub(crate) fn factors(
        &self,
        positions: &[[f32; LANES]; 3],
        tau: &[f32; LANES],
        visible_fraction: &[f32; LANES],
    ) -> DetailFactors {
        let mut logit = [0.0; LANES];
        let mut normalization = [0.0; LANES];
        for lane in 0..LANES {
            let x = (tau[lane] * self.inverse_half_depth).max(1e-6);
            let x = x / (1.0 + x * (1.0 / MAX_DEPTH_PARTICLES));
            let log = approximations::log2(x);
            logit[lane] = log * std::f32::consts::LN_2;
            normalization[lane] = 1.0 + approximations::exp2(-self.mean_exponent * log);
        }
        let (mut burning_fraction, mut mean) = ([0.0; LANES], [0.0; LANES]);
        for sample in 0..self.time_samples {
            let noise = self.noise_at(positions, (sample as f32 + 0.5) / self.time_samples as f32 - 0.5);
            for lane in 0..LANES {
                let z = noise[lane] * self.steepness;
                mean[lane] += z;
                burning_fraction[lane] += 1.0 / (1.0 + approximations::exp(-(z + logit[lane]) * self.sharpness));
            }
        }
        let sample_weight = 1.0 / self.time_samples as f32;
        let mut factors = DetailFactors { depth: [1.0; LANES], temperature: [1.0; LANES] };
        for lane in 0..LANES {
            let amount = self.amount * visible_fraction[lane];
            factors.depth[lane] =
                (burning_fraction[lane] * sample_weight * normalization[lane] - 1.0).mul_add(amount, 1.0);
            let excess = (mean[lane] * sample_weight * 0.5).clamp(-1.5, 1.5);
            factors.temperature[lane] = (TEMPERATURE_VARIATION * amount).mul_add(excess, 1.0);
        }
        factors
    }

    /// Noise at a time within the exposure, from -1/2 to 1/2.
    #[inline(always)]
    fn noise_at(&self, positions: &[[f32; LANES]; 3], time: f32) -> [f32; LANES] {
        let (mut cells, mut fractions) = ([[0; LANES]; 3], [[0.0; LANES]; 3]);
        for axis in 0..3 {
            for lane in 0..LANES {
                let coordinate = self.base[axis].offset_by(self.shift[axis].mul_add(time, positions[axis][lane]));
                cells[axis][lane] = coordinate.cell;
                fractions[axis][lane] = coordinate.fraction;
            }
        }
        self.noise.lanes(&cells, &fractions)
    }
}

/// Standard deviation of fractal noise.
fn deviation(fractal: &Fractal) -> f32 {
    let amplitudes = (0..fractal.octaves).map(|octave| math::pow(f64::from(fractal.gain), f64::from(octave)));
    let (sum, squares) = amplitudes.fold((0.0, 0.0), |(sum, squares), a| (sum + a, squares + a * a));
    math::sqrt(VARIANCE[1] * squares / (sum * sum)) as f32
}
