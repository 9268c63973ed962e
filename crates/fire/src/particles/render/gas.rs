//! The gas as the renderer sees it: position at a time, emission and absorption of each particle.

use bansho_base::{
    color,
    math::{self, DVec2, DVec3, Vec3, random::Key},
};

use crate::particles::{GasParticles, parameters::GasRenderingParameters, render::buffer_pool::BufferPool};

/// Particles per task of the thread pool.
pub(crate) const PARTICLES_PER_TASK: usize = 2048;

/// The gas of one flame at one time, with all other inputs of its rendering.
#[derive(Clone, Copy, Debug)]
pub struct Gas<'a> {
    /// The particles.
    pub particles: &'a GasParticles,
    /// Time of the particles' state, s.
    pub time: f64,
    /// Temperature of the surrounding air, K.
    pub air_temperature_k: f64,
    /// Speed of gas at which its detail is isotropic, m/s.
    pub detail_speed: f64,
    /// Center of the fire's base, m, where sparks start.
    pub base: DVec3,
    /// Width and mean height of the fire, m.
    pub size: DVec2,
    /// Key of the flame's random numbers.
    pub key: Key,
    /// How particles fade out before they are removed.
    pub fade_out: FadeOut,
    /// Scratch memory that is kept from frame to frame.
    pub buffers: &'a BufferPool,
}

/// Fade-out of particles before they are removed, so that none vanishes abruptly.
#[derive(Clone, Copy, Debug)]
pub struct FadeOut {
    /// Duration of the fade, s.
    pub seconds: f32,
    /// Corners of the domain relative to the particles' origin, m.
    pub domain: [Vec3; 2],
}

impl FadeOut {
    /// No fading.
    pub const NEVER: Self = Self { seconds: f32::MIN_POSITIVE, domain: [Vec3::MIN, Vec3::MAX] };

    /// Fraction of a particle that is drawn: it is at `position`, moves at `velocity` and is removed in `seconds`.
    #[inline(always)]
    pub(crate) fn remaining_fraction(&self, position: Vec3, velocity: Vec3, seconds: f32) -> f32 {
        let [low, high] = self.domain;
        let predicted = position + velocity * self.seconds;
        if seconds >= self.seconds && predicted.cmpge(low).all() && predicted.cmple(high).all() {
            return 1.0;
        }
        // Time until it leaves the domain through the first side that it moves toward.
        let distance = Vec3::select(velocity.cmplt(Vec3::ZERO), position - low, high - position).max(Vec3::ZERO);
        let seconds_to_exit = (distance / velocity.abs().max(Vec3::splat(f32::MIN_POSITIVE))).min_element();
        (seconds_to_exit.min(seconds) / self.seconds).clamp(0.0, 1.0)
    }
}

/// Absorption coefficient of soot per volume fraction, 1/m: `4.9 / lambda` (Dalzell and Sarofim 1969) for green light.
pub(crate) const VISIBLE_SOOT_ABSORPTION: f64 = 4.9 / 550e-9;

/// Luminance per meter of freshly burning gas in the light of CH and C2, cd/m^2. The real reaction zone is about 1 mm thick and has some tens of cd/m^2;
/// particles distribute it over centimeters.
const BLUE_LUMINANCE: f64 = 300.0;

/// Fraction of burned fuel at which the blue light is strongest.
const BLUE_PEAK_BURNED: f64 = 0.06;

/// Absorption coefficient of soot for a volume fraction, 1/m.
#[inline(always)]
pub fn soot_absorption(volume_fraction: f64, rendering: &GasRenderingParameters) -> f64 {
    volume_fraction * VISIBLE_SOOT_ABSORPTION * rendering.soot_gain
}

impl Gas<'_> {
    /// Position of particle `index` at `t`, m, extrapolated by its velocity.
    #[inline(always)]
    pub(crate) fn position(&self, index: usize, t: f64) -> DVec3 {
        let GasParticles { origin, position: [x, y, z], velocity: [u, v, w], .. } = self.particles;
        let since = t - self.time;
        let offset = DVec3::new(
            f64::from(x[index]) + since * f64::from(u[index]),
            f64::from(y[index]) + since * f64::from(v[index]),
            f64::from(z[index]) + since * f64::from(w[index]),
        );
        *origin + offset
    }

    /// Volume m / rho that a particle represents, m^3, times the factor of its fade-out.
    #[inline(always)]
    pub(crate) fn volume(&self, index: usize) -> f64 {
        let GasParticles { position, velocity, density, mass, max_age, age, .. } = self.particles;
        let [position, velocity] = [position, velocity].map(|[x, y, z]| Vec3::new(x[index], y[index], z[index]));
        let remaining = self.fade_out.remaining_fraction(position, velocity, max_age[index] - age[index]);
        let density = f64::from(density[index]);
        if density > 0.0 { f64::from(remaining * mass[index]) / density } else { 0.0 }
    }

    /// Absorption coefficient of a particle's soot, 1/m.
    #[inline(always)]
    pub(crate) fn absorption(&self, index: usize, rendering: &GasRenderingParameters) -> f64 {
        soot_absorption(f64::from(self.particles.soot[index]), rendering)
    }

    /// Luminance of a black body at a particle's temperature, cd/m^2.
    #[inline(always)]
    pub(crate) fn luminance(&self, index: usize) -> f64 {
        f64::from(color::luminance(color::black_body().radiance(self.particles.temperature[index])))
    }

    /// Whether a particle emits blue light: it has started to burn and is not burnt out.
    #[inline(always)]
    pub(crate) fn is_blue(&self, index: usize, rendering: &GasRenderingParameters) -> bool {
        /// Fuel fraction below which the blue light is less than 1e-4 of its maximum.
        const BURNT_OUT: f32 = 1.0 - 14.0 * BLUE_PEAK_BURNED as f32;
        let fuel = self.particles.fuel[index];
        rendering.base_blue > 0.0 && fuel < 1.0 && fuel > BURNT_OUT
    }

    /// Luminance per meter of a particle's gas in the blue light of CH and C2, cd/m^2.
    ///
    /// CH and C2 exist where fuel has just started to burn; where soot has formed there are none.
    #[inline(always)]
    pub(crate) fn blue_luminance(&self, index: usize, rendering: &GasRenderingParameters) -> f64 {
        if !self.is_blue(index, rendering) {
            return 0.0;
        }
        /// Volume fraction of soot that quenches the blue light to one half.
        const QUENCHING_SOOT: f64 = 1e-7;
        let burned = (1.0 - f64::from(self.particles.fuel[index])).clamp(0.0, 1.0) / BLUE_PEAK_BURNED;
        let relative_soot = f64::from(self.particles.soot[index]).max(0.0) / QUENCHING_SOOT;
        BLUE_LUMINANCE * rendering.base_blue * burned * math::exp(1.0 - burned) / (1.0 + relative_soot * relative_soot)
    }
}
