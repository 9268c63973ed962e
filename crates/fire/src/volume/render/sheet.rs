//! Soot of the thin sheet in which gas burns, between two values of the mixture fraction.
//!
//! A sheet may be thinner than a step of a ray. Soot is a function of the mixture fraction Z alone, and Z is nearly linear along a step, so that the mean of the
//! soot over the step is the mean of that function over the interval of Z that the step crosses: the difference of its integral at both ends over that of Z
//! (pre-integrated transfer functions, Engel, Kraus and Ertl 2001). Motion while the shutter is open widens the interval. The profile of soot is made of two cubics
//! ([`soot_profile`](crate::volume::fuel::soot_profile)), so that its integrals are polynomials, and nothing is looked up in tables.

use bansho_base::math::simd::Real;

use crate::volume::fuel::{FIRST_SOOT, LAST_SOOT, MOST_SOOT};

/// Half of the width of the zone that shines blue, in Zs.
const BLUE_WIDTH: f32 = 0.12;
/// Half width of an interval in Zs below which the profile in its middle is its mean.
const THIN: f32 = 0.02;
/// Mean of soot over the width of an interval in Zs below which it is rounding.
const LEAST_INTEGRAL: f32 = 1e-5;
/// Widths in Zs of the sides of the profile on which soot rises and falls.
const RISE: f32 = MOST_SOOT - FIRST_SOOT;
const FALL: f32 = LAST_SOOT - MOST_SOOT;

/// Soot in an interval of Z.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SootMean<R> {
    /// Mean of the profile, 0 to 1.
    pub(crate) soot: R,
    /// Mean Z over Zs of the soot; the middle of the interval without soot.
    pub(crate) relative_mixture: R,
    /// Variance of Z over Zs of the soot; 0 without soot.
    pub(crate) variance: R,
}

/// Mean of the profile of soot over an interval of Z with that middle and half width, both in Zs.
#[inline(always)]
pub(crate) fn mean_soot<R: Real>(middle: R, half_width: R) -> SootMean<R> {
    let zero = middle.broadcast(0.0);
    let (first, last) = (integrals(middle - half_width), integrals(middle + half_width));
    let soot = last.soot - first.soot;
    let is_dark = soot.broadcast(LEAST_INTEGRAL);
    let divisor = soot.simd_max(is_dark);
    let wide = soot.select_lt(is_dark, zero, soot / (half_width + half_width).simd_max(zero.broadcast(THIN)));
    let place = soot.select_lt(is_dark, middle, (last.moment - first.moment) / divisor);
    let thin = zero.broadcast(THIN);
    let variance = (last.second_moment - first.second_moment) / divisor - place * place;
    // Rounding may give less than nothing, or more than an interval allows.
    let variance = variance.simd_max(zero).simd_min(half_width * half_width);
    let variance = soot.select_lt(is_dark, zero, variance);
    SootMean {
        soot: half_width.select_lt(thin, profile(middle), wide),
        relative_mixture: half_width.select_lt(thin, middle, place),
        variance: half_width.select_lt(thin, zero, variance),
    }
}

/// The profile of soot at a value of Z over Zs.
#[inline(always)]
fn profile<R: Real>(relative: R) -> R {
    let [rise, fall] = sides(relative);
    rise.simd_smoothstep() * fall.simd_smoothstep()
}

/// How far Z is up the side on which soot rises, and up that on which it falls, 0 to 1.
#[inline(always)]
fn sides<R: Real>(relative: R) -> [R; 2] {
    let rise = (relative - relative.broadcast(FIRST_SOOT)) * relative.broadcast(1.0 / RISE);
    let fall = (relative.broadcast(LAST_SOOT) - relative) * relative.broadcast(1.0 / FALL);
    [rise.simd_clamp01(), fall.simd_clamp01()]
}

/// Integrals over Z from 0, in Zs.
struct Integrals<R> {
    /// Of the profile.
    soot: R,
    /// Of the profile times Z, and times its square.
    moment: R,
    second_moment: R,
}

/// The integrals from 0 to a value of Z, in Zs. On either side soot is `s(t) = 3 t^2 - 2 t^3`, whose integral is `t^3 - t^4 / 2`; that of `t s(t)` is
/// `3 t^4 / 4 - 2 t^5 / 5`, and that of `t^2 s(t)` is `3 t^5 / 5 - t^6 / 3`.
#[inline(always)]
fn integrals<R: Real>(relative: R) -> Integrals<R> {
    let [rise, fall] = sides(relative);
    let (risen, left) = (side_integrals(rise), side_integrals(fall));
    let splat = |value: f32| relative.broadcast(value);
    // On the rising side Z is FIRST_SOOT + RISE t, on the falling one LAST_SOOT - FALL t, of which what is left is not counted.
    let soot = risen[0].fma(splat(RISE), left[0].fma(splat(-FALL), splat(0.5 * FALL)));
    let rising = risen[1].fma(splat(RISE), risen[0] * splat(FIRST_SOOT)) * splat(RISE);
    let falling = left[1].fma(splat(-FALL), left[0] * splat(LAST_SOOT)) * splat(-FALL);
    let whole = FALL * (0.5 * LAST_SOOT - 0.35 * FALL);
    let moment = rising + falling + splat(whole);
    let rising = risen[2].fma(splat(RISE * RISE), risen[1] * splat(2.0 * FIRST_SOOT * RISE));
    let rising = risen[0].fma(splat(FIRST_SOOT * FIRST_SOOT), rising) * splat(RISE);
    let falling = left[2].fma(splat(FALL * FALL), left[1] * splat(-2.0 * LAST_SOOT * FALL));
    let falling = left[0].fma(splat(LAST_SOOT * LAST_SOOT), falling) * splat(-FALL);
    let whole = FALL * (0.5 * LAST_SOOT * LAST_SOOT - 0.7 * LAST_SOOT * FALL + 4.0 / 15.0 * FALL * FALL);
    Integrals { soot, moment, second_moment: rising + falling + splat(whole) }
}

/// Integrals of `s(t)`, `t s(t)` and `t^2 s(t)`.
#[inline(always)]
fn side_integrals<R: Real>(t: R) -> [R; 3] {
    let splat = |value: f32| t.broadcast(value);
    let cube = t * t * t;
    let fourth = cube * t;
    [
        cube * t.fma(splat(-0.5), splat(1.0)),
        fourth * t.fma(splat(-0.4), splat(0.75)),
        fourth * t * t.fma(splat(-1.0 / 3.0), splat(0.6)),
    ]
}

/// Share of the blue zone that is crossed between two values of Z over Zs: 1 in all for a step from air into fuel.
#[inline(always)]
pub(crate) fn blue_between<R: Real>(first: R, last: R) -> R {
    (blue_place(last) - blue_place(first)).simd_abs()
}

#[inline(always)]
fn blue_place<R: Real>(relative: R) -> R {
    let from_middle = (relative - relative.broadcast(1.0)) * relative.broadcast(0.5 / BLUE_WIDTH);
    (from_middle + relative.broadcast(0.5)).simd_clamp01()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::fuel::soot_profile;

    #[test]
    fn means_over_intervals_are_those_of_many_samples() {
        for (middle, half_width) in [(1.5, 0.5), (1.0, 1.0), (3.3, 3.3), (1.7, 0.017), (8.0, 0.2), (2.9, 0.8)] {
            let samples = || (0..2000).map(|i| middle + half_width * ((i as f32 + 0.5) / 1000.0 - 1.0));
            let expected = samples().map(soot_profile).sum::<f32>() / 2000.0;
            let place = samples().map(|z| z * soot_profile(z)).sum::<f32>() / (2000.0 * expected);
            let mean = mean_soot(middle, half_width);
            assert!((mean.soot - expected).abs() < 5e-4, "{middle} {half_width}");
            let error = mean.relative_mixture - place;
            assert!(expected < 1e-3 || error.abs() < 2e-3, "{middle} {half_width}: {error}");
            let square = samples().map(|z| (z - place) * (z - place) * soot_profile(z)).sum::<f32>();
            let error = mean.variance - square / (2000.0 * expected);
            assert!(expected < 1e-3 || error.abs() < 2e-3, "{middle} {half_width}: {error}");
        }
        assert_eq!(blue_between(0.0, 1e3), 1.0);
        assert_eq!(blue_between(0.0, 0.5), 0.0);
        assert!((blue_between(0.0_f32, 1.0) - 0.5).abs() < 1e-3);
    }
}
