//! What gas between two points of a ray emits, scatters and absorbs. All functions are written for one ray and for a vector of rays alike, so that both give the
//! same bits.

use bansho_base::math::{
    approximations,
    simd::{LANES, Lanes, Real},
};
use fearless_simd::{Simd, prelude::*};

use super::sheet::{blue_between, mean_soot};
use crate::volume::fuel::Mixture;

/// Mixture fraction, over the stoichiometric, from which on gas may be in a sheet.
pub(crate) const LEAST_SEEN: f32 = 0.8;
/// Luminance of the blue zone where a ray crosses it, cd/m^2.
const BLUE_LUMINANCE: f32 = 12.0;
/// Loss of heat at which the zone is dark, K.
const BLUE_DEFICIT: f32 = 150.0;
/// Coefficients of the natural logarithm of the luminance of a black body (cd/m^2) in powers of 1000 K / T, from the highest: a least-squares fit whose error is below
/// 1e-3 from 800 to 4500 K.
const LN_LUMINANCE: [f32; 5] = [0.132_904, -0.654_664, 2.306_358, -26.680_307, 25.883_918];
/// Temperature of the darkest soot, K: its luminance is 1e-6 cd/m^2.
const LEAST_KELVIN: f32 = 600.0;

/// Most logarithm of the light of different temperatures over that of their mean: soot in a whole sheet has hardly more.
const MOST_GAIN: f32 = 0.7;

/// What all rays of a frame know of the gas.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GasOptics {
    pub(crate) mixture: Mixture,
    /// Absorption coefficient of soot of the largest volume fraction, 1/m.
    pub(crate) soot_absorption: f32,
    /// Extinction coefficient of smoke for its mass over that of the gas and the mixture fraction, m^2/kg.
    pub(crate) smoke_extinction: f32,
    /// Mixture fraction below which no smoke is seen.
    pub(crate) least_smoke: f32,
    /// Factor of the blue light.
    pub(crate) blue: f32,
}

/// Gas at a point of a ray, during a part of the exposure.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GasSample<R> {
    /// Mixture fractions of the gas that is there at the beginning and at the end.
    pub(crate) mixtures: [R; 2],
    /// Mean deficit of heat, K.
    pub(crate) deficit: R,
}

/// A way through gas.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Crossing<R> {
    /// Extinction coefficients of soot and of smoke, 1/m.
    pub(crate) soot: R,
    pub(crate) smoke: R,
    /// Luminance of opaque soot, cd/m^2, and its temperature, K.
    pub(crate) luminance: R,
    pub(crate) kelvin: R,
    /// Luminance of blue light, cd/m^2.
    pub(crate) blue: R,
}

impl<R: Real> GasSample<R> {
    #[inline(always)]
    pub(crate) fn middle(&self) -> R {
        (self.mixtures[0] + self.mixtures[1]) * self.deficit.broadcast(0.5)
    }
}

impl GasOptics {
    /// Gas between two points of a ray where there may be a sheet.
    #[inline(always)]
    pub(crate) fn crossing<R: Exponential>(&self, from: &GasSample<R>, to: &GasSample<R>) -> Crossing<R> {
        let splat = |value: f32| to.deficit.broadcast(value);
        let (zero, one, half) = (splat(0.0), splat(1.0), splat(0.5));
        let per_stoichiometric = splat(1.0 / self.mixture.stoichiometric);
        let (previous, middle) = (from.middle() * per_stoichiometric, to.middle() * per_stoichiometric);
        let change = middle - previous;
        let motion = (to.mixtures[1] - to.mixtures[0]).simd_abs() * per_stoichiometric;
        let mean = mean_soot((previous + middle) * half, (change.simd_abs() + motion) * half);
        // Heat is lost where the soot is, which may be anywhere on the way.
        let tiny = splat(1e-9);
        let is_rising = change.select_lt(zero, zero - one, one);
        let way = ((mean.relative_mixture - previous) * is_rising / (change * is_rising).simd_max(tiny)).simd_clamp01();
        let deficit = (to.deficit - from.deficit).fma(way, from.deficit);
        let kelvin = self.rich_kelvin(mean.relative_mixture, deficit);
        // Slope of the temperature with Z along the way. Where motion widens the interval more than the way does, heat is not known to follow Z.
        let deficit_slope = (to.deficit - from.deficit) * change / change.fma(change, motion.fma(motion, tiny));
        let slope = splat(self.rich_slope_k()) - deficit_slope;
        let (luminance, kelvin) = mean_luminance(kelvin, slope * slope * mean.variance);
        // Radicals shine where the sheet is fresh and hot; what soot has cooled burns without them.
        let freshness = (one - deficit * splat(1.0 / BLUE_DEFICIT)).simd_clamp01();
        let blue = blue_between(previous, middle) * freshness * freshness * splat(self.blue * BLUE_LUMINANCE);
        Crossing {
            soot: mean.soot * splat(self.soot_absorption),
            smoke: self.smoke_between(from, to),
            luminance,
            kelvin,
            blue,
        }
    }

    /// Extinction coefficient of smoke between two points of a ray, 1/m.
    #[inline(always)]
    pub(crate) fn smoke_between<R: Real>(&self, from: &GasSample<R>, to: &GasSample<R>) -> R {
        let half = to.deficit.broadcast(0.5);
        self.smoke((from.middle() + to.middle()) * half, (from.deficit + to.deficit) * half)
    }

    /// Extinction coefficient of smoke, 1/m: what burnt soot there is in lean gas.
    #[inline(always)]
    pub(crate) fn smoke<R: Real>(&self, mixture: R, deficit: R) -> R {
        let splat = |value: f32| mixture.broadcast(value);
        let Mixture { stoichiometric, air_temperature_k, fuel_rise_k, slopes_k: [lean_k, rich_k], air_density } =
            self.mixture;
        let burnt = (mixture * splat(lean_k)).simd_min((splat(1.0) - mixture) * splat(rich_k)).simd_max(splat(0.0));
        let adiabatic = mixture.fma(splat(fuel_rise_k), splat(air_temperature_k)) + burnt;
        let kelvin = (adiabatic - deficit).simd_max(splat(air_temperature_k));
        // Soot that still glows is drawn as such. Nothing burns where the fuel is smoke.
        let lean = if stoichiometric >= 1.0 {
            splat(1.0)
        } else {
            mixture.fma(splat(-2.0 / stoichiometric), splat(2.0)).simd_clamp01()
        };
        let seen = (mixture - splat(self.least_smoke)).simd_max(splat(0.0));
        seen * lean * splat(self.smoke_extinction * air_density * air_temperature_k) / kelvin
    }

    /// Slope of the temperature of gas with more fuel than burns, K for each Zs.
    fn rich_slope_k(&self) -> f32 {
        let Mixture { stoichiometric, fuel_rise_k, slopes_k: [_, rich_k], .. } = self.mixture;
        (fuel_rise_k - rich_k) * stoichiometric
    }

    /// Temperature of gas with more fuel than burns, K: there it is linear in the mixture fraction.
    #[inline(always)]
    fn rich_kelvin<R: Real>(&self, relative_mixture: R, deficit: R) -> R {
        let Mixture { air_temperature_k, slopes_k: [_, rich_k], .. } = self.mixture;
        let slope = relative_mixture.broadcast(self.rich_slope_k());
        relative_mixture.fma(slope, relative_mixture.broadcast(air_temperature_k + rich_k)) - deficit
    }
}

/// Mean luminance of black bodies (cd/m^2) whose temperatures have that mean T (K) and variance V (K^2), and the mean of the temperatures weighted by luminance. With b
/// the derivative of the logarithm of the luminance L, whose own derivative is nearly -2 b / T, the first is `L(T) exp((b^2 / 2 - b / T) V)` and the second
/// `T + b V`, to the second order of the logarithm.
#[inline(always)]
fn mean_luminance<R: Exponential>(kelvin: R, variance: R) -> (R, R) {
    let splat = |value: f32| kelvin.broadcast(value);
    let inverse = splat(1000.0) / kelvin.simd_max(splat(LEAST_KELVIN));
    // Horner's scheme for the polynomial and its derivative.
    let (mut ln_luminance, mut derivative) = (splat(LN_LUMINANCE[0]), splat(0.0));
    for coefficient in &LN_LUMINANCE[1..] {
        derivative = derivative.fma(inverse, ln_luminance);
        ln_luminance = ln_luminance.fma(inverse, splat(*coefficient));
    }
    let per_kelvin = derivative * inverse * inverse * splat(-1e-3);
    let variance = variance.simd_min(splat(2.0 * MOST_GAIN) / (per_kelvin * per_kelvin));
    let gain = per_kelvin * variance * per_kelvin.fma(splat(0.5), inverse * splat(-1e-3));
    let shift = per_kelvin * variance;
    ((ln_luminance + gain).simd_exp(), kelvin + shift)
}

/// The exponential function of scalars and vectors.
pub(crate) trait Exponential: Real {
    /// e to the power `self`; relative error below 1.6e-7.
    #[must_use]
    fn simd_exp(self) -> Self;
}

impl Exponential for f32 {
    #[inline(always)]
    fn simd_exp(self) -> Self {
        approximations::exp(self)
    }
}

impl<S: Simd> Exponential for Lanes<S> {
    #[inline(always)]
    fn simd_exp(self) -> Self {
        let mut values = [0.0; LANES];
        self.store_slice(&mut values);
        for value in &mut values {
            *value = approximations::exp(*value);
        }
        Self::from_slice(self.simd, &values)
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::{color, math};

    use super::*;

    #[test]
    fn luminance_of_different_temperatures_is_that_of_many_black_bodies() {
        let table = color::black_body();
        for kelvin in [1200.0_f32, 1600.0, 2000.0] {
            let expected = math::f32::exp(table.ln_luminance(kelvin));
            let (uniform, same) = mean_luminance(kelvin, 0.0);
            assert!((uniform / expected - 1.0).abs() < 2e-3 && same == kelvin, "{kelvin}");
            // Evenly from 50 K less to 50 K more.
            let bodies = || (0..100).map(|number| kelvin + number as f32 - 49.5);
            let light = |kelvin: f32| math::f32::exp(table.ln_luminance(kelvin));
            let sum = bodies().map(light).sum::<f32>();
            let weighted = bodies().map(|kelvin| kelvin * light(kelvin)).sum::<f32>() / sum;
            let (mean, mean_kelvin) = mean_luminance(kelvin, 2500.0 / 3.0);
            assert!((mean * 100.0 / sum - 1.0).abs() < 0.01, "{kelvin}: {mean}");
            assert!((mean_kelvin - weighted).abs() < 3.0, "{kelvin}: {mean_kelvin} {weighted}");
        }
    }
}
