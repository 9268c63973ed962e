//! Animated values: constants or keyframed curves over time.

use crate::math::curve::{Curve, CurveError, Interpolation};

/// A value that can be keyframed: its components are interpolated independently.
pub trait Animate: Copy + PartialEq {
    /// Number of components.
    const COMPONENTS: usize;

    /// The component at `index`, below [`COMPONENTS`](Self::COMPONENTS).
    fn component(&self, index: usize) -> f64;

    /// The value with the components `component(index)`.
    fn from_components(component: impl FnMut(usize) -> f64) -> Self;
}

impl Animate for f64 {
    const COMPONENTS: usize = 1;

    fn component(&self, _index: usize) -> f64 {
        *self
    }

    fn from_components(mut component: impl FnMut(usize) -> Self) -> Self {
        component(0)
    }
}

impl<const N: usize> Animate for [f64; N] {
    const COMPONENTS: usize = N;

    fn component(&self, index: usize) -> f64 {
        self[index]
    }

    fn from_components(component: impl FnMut(usize) -> f64) -> Self {
        std::array::from_fn(component)
    }
}

/// Duration of the past for which keys of values that a program changes are kept, s.
pub const KEY_MEMORY_S: f64 = 30.0;
/// Duration in which a value passes from one key to another that is meant to be at the same time, s.
const FOLD_S: f64 = 1e-6;
/// Time by which a step may come early, s: far below any exposure, and above the rounding of the middle of an exposure at any time of a shot. Without it
/// the shutter that is open around a frame's time would show either side of a step at that time, as its middle is rounded.
const STEP_TOLERANCE_S: f64 = 1e-9;

/// The longest change that is no motion but a cut, s: a millisecond or a tenth of a frame of `frame_s` seconds, whichever is less. Keys this near to the
/// beginning of a frame are meant to be there.
#[must_use]
pub fn longest_cut_s(frame_s: f64) -> f64 {
    (0.1 * frame_s).min(1e-3)
}

/// A constant, or a value keyframed over time. Before the first and after the last key it is constant, unless it repeats. Times are in
/// seconds.
#[derive(Clone, Debug, PartialEq)]
pub struct Animated<T> {
    motion: Motion<T>,
    period: Option<f64>,
}

#[derive(Clone, Debug, PartialEq)]
enum Motion<T> {
    Constant(T),
    /// One curve per component, all with the same times.
    Keyed(Vec<Curve>),
}

impl<T: Animate> From<T> for Animated<T> {
    fn from(value: T) -> Self {
        Self { motion: Motion::Constant(value), period: None }
    }
}

impl<T: Animate> Animated<T> {
    /// A value interpolated between `keys` (time, value), times ascending.
    ///
    /// # Errors
    /// There are no keys, the times are not ascending, a number is not finite, or the curve is too steep; see [`Curve::new`].
    pub fn keyed(keys: Vec<(f64, T)>, interpolation: Interpolation) -> Result<Self, CurveError> {
        let mut curves = Vec::with_capacity(T::COMPONENTS);
        for component in 0..T::COMPONENTS {
            let points = keys.iter().map(|(time, value)| [*time, value.component(component)]).collect();
            curves.push(Curve::new(points, interpolation)?);
        }
        Ok(Self { motion: Motion::Keyed(curves), period: None })
    }

    /// Makes it periodic by repeating the interval from 0 to `period` (s, above 0). Returns whether the values at both ends are equal.
    pub fn make_periodic(&mut self, period: f64) -> bool {
        self.period = None;
        let closes = self.at(0.0) == self.at(period);
        self.period = Some(period);
        closes
    }

    /// Value at time `t`. Steps come up to a nanosecond early, so that rounding of `t` never shows the value before one.
    pub fn at(&self, t: f64) -> T {
        let (_, t) = self.split_period(t);
        let early = if self.interpolation() == Interpolation::Step { STEP_TOLERANCE_S } else { 0.0 };
        self.map_components(|value| value, |curve| curve.eval(t + early))
    }

    /// By how much the value changes continuously between two times: a step is no motion.
    pub fn displacement(&self, from: f64, to: f64) -> T {
        let (before, after) = (self.at(from), self.at(to));
        let is_moved = self.interpolation() != Interpolation::Step;
        T::from_components(|index| if is_moved { after.component(index) - before.component(index) } else { 0.0 })
    }

    /// The value as an exposure with its middle at `middle` (s) sees it: on one side of every cut. Step keys hold the value that they have at the middle. Of
    /// others, two keys with different values at most `longest_cut_s` apart, and much closer than their neighbors, are a cut too: that is how a
    /// camera is keyed that moves before and after it. Beyond the cut, the last value before it holds, or the first one after it.
    #[must_use]
    pub fn of_exposure(&self, middle: f64, longest_cut_s: f64) -> Self {
        match &self.motion {
            Motion::Constant(_) => self.clone(),
            Motion::Keyed(_) if self.interpolation() == Interpolation::Step => Self::from(self.at(middle)),
            Motion::Keyed(curves) => match own_side(curves, middle, longest_cut_s) {
                // In a loop the keys of a side would have to be joined across its end.
                Some(side) if self.period.is_none() => {
                    let keys = self.keys()[side].to_vec();
                    Self::keyed(keys, self.interpolation()).unwrap_or_else(|_| self.clone())
                }
                _ => self.clone(),
            },
        }
    }

    /// Moves step keys that lie at most [`longest_cut_s`] from the beginning of a frame to it; frame `i` begins at i `seconds` / `frames`. Keys that would then
    /// not be ascending stay where they are.
    pub fn snap_steps(&mut self, [frames, seconds]: [u32; 2]) {
        let keys = self.keys();
        if keys.len() < 2 || self.interpolation() != Interpolation::Step {
            return;
        }
        let [frames, seconds] = [frames, seconds].map(f64::from);
        let longest = longest_cut_s(seconds / frames);
        let mut snapped: Vec<(f64, T)> = Vec::with_capacity(keys.len());
        for (index, (time, value)) in keys.iter().enumerate() {
            let frame = (time * frames / seconds).round() * seconds / frames;
            let is_after = snapped.last().is_none_or(|(before, _)| *before < frame);
            let is_before = keys.get(index + 1).is_none_or(|(next, _)| frame < *next);
            let is_near = (frame - time).abs() <= longest && is_after && is_before;
            snapped.push((if is_near { frame } else { *time }, *value));
        }
        if let Ok(value) = Self::keyed(snapped, Interpolation::Step) {
            self.motion = value.motion;
        }
    }

    /// Time derivative at time `t`, per second; see [`Curve::derivative`].
    pub fn derivative(&self, t: f64) -> T {
        let (_, t) = self.split_period(t);
        self.map_components(|_| 0.0, |curve| curve.derivative(t))
    }

    /// Integral over time from `from` to `to`, exact up to rounding: the distance covered at a keyframed speed, so that any single frame is correct.
    pub fn integral(&self, from: f64, to: f64) -> T {
        // Whole periods between the two times are the same each; without a period there are none.
        let [(before, start), (after, end)] = [from, to].map(|t| self.split_period(t));
        self.map_components(
            |value| value * (to - from),
            |curve| match self.period {
                None => curve.integral(from, to),
                Some(period) => (after - before).mul_add(curve.integral(0.0, period), curve.integral(start, end)),
            },
        )
    }

    /// Number of complete periods before time `t`, and the time within the current period.
    fn split_period(&self, t: f64) -> (f64, f64) {
        let Some(period) = self.period else { return (0.0, t) };
        let periods = (t / period).floor();
        (periods, t - periods * period)
    }

    /// Makes it continue `before` at time `t` (s): what `before` was until then stays, and within `transition_s` it changes linearly to the own value. So a
    /// distance that is covered at a speed does not jump when a program changes the speed. Does nothing where the two are equal, where the own
    /// value is keyframed, or where one of them repeats.
    ///
    /// Keys older than [`KEY_MEMORY_S`] are folded into a constant with the same integral from time 0 on, so that a value that always changes has few keys.
    pub fn continue_after(&mut self, before: &Self, t: f64, transition_s: f64) {
        let (Motion::Constant(value), None, None) = (&self.motion, self.period, before.period) else { return };
        if before.motion == self.motion || !t.is_finite() {
            return;
        }
        let (oldest, value) = (t - KEY_MEMORY_S, *value);
        let mut keys: Vec<(f64, T)> = Vec::new();
        let stated = before.keys();
        if stated.last().is_some_and(|(time, last)| *time <= t && *last == value) {
            *self = before.clone();
            return;
        }
        let is_folded = oldest > 0.0 && stated.first().is_some_and(|(time, _)| *time < oldest);
        let since = if is_folded { oldest } else { f64::NEG_INFINITY };
        let earlier = before.linear_keys(oldest, t);
        if is_folded {
            let integral = before.integral(0.0, oldest);
            let mean = T::from_components(|component| integral.component(component) / oldest);
            keys.extend([(oldest - FOLD_S, mean), (oldest, before.at(oldest))]);
        }
        keys.extend(earlier.into_iter().filter(|(time, _)| *time > since && *time < t));
        keys.extend([(t, before.at(t)), (t + transition_s.max(FOLD_S), value)]);
        if let Ok(continued) = Self::keyed(keys, Interpolation::Linear) {
            *self = continued;
        }
    }

    /// Keys between which the value is linear; for other interpolations it is sampled from `from` to `to`.
    fn linear_keys(&self, from: f64, to: f64) -> Vec<(f64, T)> {
        /// Samples per second.
        const RATE: f64 = 20.0;
        let keys = self.keys();
        if keys.len() < 2 || self.interpolation() == Interpolation::Linear {
            return keys;
        }
        let count = ((to - from) * RATE).ceil().max(1.0) as usize;
        let times = (0..=count).map(|index| crate::math::lerp(from, to, index as f64 / count as f64));
        times.map(|time| (time, self.at(time))).collect()
    }

    /// The value if it is constant: it has no keys, or all keys have the same value.
    pub fn constant(&self) -> Option<T> {
        match &self.motion {
            Motion::Constant(value) => Some(*value),
            Motion::Keyed(_) => {
                let [low, high] = self.bounds();
                (low == high).then_some(low)
            }
        }
    }

    /// Minimum and maximum of each component over all time.
    pub fn bounds(&self) -> [T; 2] {
        [0, 1].map(|bound| self.map_components(|value| value, |curve| curve.range()[bound]))
    }

    /// The constant, or the values of all keys.
    pub fn values(&self) -> Vec<T> {
        match &self.motion {
            Motion::Constant(value) => vec![*value],
            Motion::Keyed(_) => self.keys().into_iter().map(|(_, value)| value).collect(),
        }
    }

    /// Keys (time, value), ascending; empty for a constant.
    pub fn keys(&self) -> Vec<(f64, T)> {
        match &self.motion {
            Motion::Keyed(curves) if !curves.is_empty() => {
                // All components have their keys at the same times.
                let keys = curves[0].points().iter().enumerate().map(|(index, [time, _])| {
                    (*time, T::from_components(|component| curves[component].points()[index][1]))
                });
                keys.collect()
            }
            Motion::Keyed(_) | Motion::Constant(_) => Vec::new(),
        }
    }

    /// Interpolation between keys; [`Interpolation::Step`] for a constant.
    pub fn interpolation(&self) -> Interpolation {
        match &self.motion {
            Motion::Keyed(curves) if !curves.is_empty() => curves[0].interpolation(),
            Motion::Keyed(_) | Motion::Constant(_) => Interpolation::Step,
        }
    }

    /// The value with components computed by `constant` from those of a constant, or by `keyed` from the curves.
    fn map_components(&self, constant: impl Fn(f64) -> f64, keyed: impl Fn(&Curve) -> f64) -> T {
        match &self.motion {
            Motion::Constant(value) => T::from_components(|index| constant(value.component(index))),
            Motion::Keyed(curves) => T::from_components(|index| keyed(&curves[index])),
        }
    }
}

/// The keys on the side of `middle` of all cuts, if there are cuts: see [`Animated::of_exposure`].
fn own_side(curves: &[Curve], middle: f64, longest_cut_s: f64) -> Option<std::ops::Range<usize>> {
    /// How many times longer than a cut the intervals before and after it are at least.
    const ISOLATION: f64 = 10.0;
    let times = curves.first()?.points();
    let intervals: Vec<f64> = times.windows(2).map(|pair| pair[1][0] - pair[0][0]).collect();
    // Decimal times are rounded.
    let longest = longest_cut_s * (1.0 + 1e-6) + STEP_TOLERANCE_S;
    let mut side = 0..times.len();
    for (cut, &length) in intervals.iter().enumerate() {
        // Before the first key and after the last one nothing moves.
        let before = cut.checked_sub(1).map_or(f64::INFINITY, |before| intervals[before]);
        let after = intervals.get(cut + 1).copied().unwrap_or(f64::INFINITY);
        let is_cut = length <= longest
            && before.min(after) >= ISOLATION * length
            && curves.iter().any(|curve| curve.points()[cut][1] != curve.points()[cut + 1][1]);
        if !is_cut {
            continue;
        }
        if middle + STEP_TOLERANCE_S >= times[cut + 1][0] {
            side.start = cut + 1;
        } else {
            side.end = cut + 1;
            break;
        }
    }
    (side != (0..times.len())).then_some(side)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_hold_for_all_time() {
        let constant = Animated::from([1.0, 2.0, 3.0]);
        assert_eq!(constant.at(-7.0), [1.0, 2.0, 3.0]);
        assert_eq!(constant.derivative(1.0), [0.0; 3]);
        assert_eq!(constant.integral(1.0, 3.0), [2.0, 4.0, 6.0]);
        assert_eq!(constant.constant(), Some([1.0, 2.0, 3.0]));
        assert_eq!(constant.bounds(), [[1.0, 2.0, 3.0]; 2]);
        assert!(constant.keys().is_empty());
    }

    #[test]
    fn what_repeats_has_the_same_values_and_integrals_in_every_period() {
        let once = Animated::keyed(vec![(0.0, 1.0), (1.0, 3.0), (4.0, 1.0)], Interpolation::Linear).unwrap();
        let mut repeating = once.clone();
        assert!(!repeating.make_periodic(3.0) && repeating.make_periodic(4.0));
        for t in [0.0, 0.5, 1.0, 2.75] {
            assert_eq!([-8.0, -4.0, 0.0, 4.0].map(|turn| repeating.at(t + turn)), [once.at(t); 4]);
            assert_eq!(repeating.derivative(t + 4.0), once.derivative(t));
        }
        // The mean is 2: 3 s from the second half of a period into the next but one.
        assert_eq!(repeating.integral(2.0, 2.0 + 12.0), 24.0);
        assert_eq!(repeating.integral(-1.0, 1.0), once.integral(3.0, 4.0) + once.integral(0.0, 1.0));
    }

    #[test]
    fn vectors_are_keyed_one_component_at_a_time() {
        let keys = vec![(0.0, [0.5, 0.0, 0.0]), (4.0, [2.0, 0.0, -8.0])];
        let wind = Animated::keyed(keys.clone(), Interpolation::Linear).unwrap();
        assert_eq!(wind.at(2.0), [1.25, 0.0, -4.0]);
        assert_eq!(wind.derivative(2.0), [0.375, 0.0, -2.0]);
        assert_eq!(wind.integral(-1.0, 5.0), [0.5 + 5.0 + 2.0, 0.0, -24.0]);
        assert_eq!(wind.bounds(), [[0.5, 0.0, -8.0], [2.0, 0.0, 0.0]]);
        assert_eq!((wind.constant(), wind.keys(), wind.interpolation()), (None, keys, Interpolation::Linear));
    }

    #[test]
    fn the_way_of_a_keyed_speed_is_its_integral_from_any_start() {
        for interpolation in [Interpolation::Linear, Interpolation::Step, Interpolation::Monotone] {
            let speed = Animated::keyed(vec![(1.0, 0.2), (2.5, 1.7), (3.0, 1.0), (7.0, 0.0)], interpolation).unwrap();
            // Against 200,000 midpoints; a step between midpoints costs at most its height times their distance.
            let (n, end) = (200_000, 9.0);
            let sum: f64 = (0..n).map(|i| speed.at((i as f64 + 0.5) * end / n as f64)).sum::<f64>() * end / n as f64;
            assert!((speed.integral(0.0, end) - sum).abs() < 1e-4, "{interpolation:?}");
            let frames: f64 = (0..90).map(|i| speed.integral(i as f64 * 0.1, (i + 1) as f64 * 0.1)).sum();
            assert!((speed.integral(0.0, end) - frames).abs() < 1e-12);
        }
    }

    #[test]
    fn steps_are_moved_to_the_frame_that_they_are_meant_for() {
        let snapped = |time: f64, rate: [u32; 2]| {
            let mut value = Animated::keyed(vec![(-5.0, 1.0), (time, 2.0)], Interpolation::Step).unwrap();
            value.snap_steps(rate);
            value.keys()[1].0
        };
        assert_eq!(snapped(0.6667, [30, 1]), 20.0 / 30.0);
        assert_eq!(snapped(2.0021, [24_000, 1001]), 48.0 * 1001.0 / 24_000.0);
        // A tenth of a frame is less than a millisecond from 100 frames per second on.
        assert_eq!([snapped(1.0004, [240, 1]), snapped(1.0005, [240, 1])], [1.0, 1.0005]);
        assert_eq!(
            [snapped(1.0009, [30, 1]), snapped(1.0011, [30, 1]), snapped(-0.9995, [24, 1])],
            [1.0, 1.0011, -1.0]
        );
        // Two keys cannot be at the same frame.
        let keys = vec![(0.9995, 1.0), (1.0003, 2.0), (1.0005, 3.0)];
        let mut value = Animated::keyed(keys, Interpolation::Step).unwrap();
        value.snap_steps([30, 1]);
        assert_eq!(value.keys(), [(1.0, 1.0), (1.0003, 2.0), (1.0005, 3.0)]);
        let linear = Animated::keyed(vec![(0.0, 1.0), (0.6667, 2.0)], Interpolation::Linear).unwrap();
        let mut kept = linear.clone();
        kept.snap_steps([30, 1]);
        assert_eq!(kept, linear);
    }

    #[test]
    fn an_exposure_is_on_one_side_of_every_cut() {
        let step = Animated::keyed(vec![(0.0, 1.0), (1.0, 2.0), (2.0, 3.0)], Interpolation::Step).unwrap();
        for (middle, value) in [(-1.0, 1.0), (0.99, 1.0), (1.0 - 1e-12, 2.0), (1.5, 2.0), (7.0, 3.0)] {
            assert_eq!(step.of_exposure(middle, 1e-3), Animated::from(value), "{middle}");
        }
        assert_eq!((step.displacement(0.5, 1.5), step.at(1.0 - 1e-12)), (0.0, 2.0));
        // It moves, cuts at 1 s, and moves on.
        let keys = vec![(0.0, 0.0), (0.999, 1.0), (1.0, 10.0), (2.0, 20.0)];
        for interpolation in [Interpolation::Linear, Interpolation::Monotone] {
            let moving = Animated::keyed(keys.clone(), interpolation).unwrap();
            let [before, after] = [0.99, 1.01].map(|middle| moving.of_exposure(middle, 1e-3));
            assert_eq!([before.at(1.5), after.at(0.5)], [1.0, 10.0], "{interpolation:?}");
            assert_eq!([before.at(0.999), after.at(1.0), after.at(2.0)], [1.0, 10.0, 20.0], "{interpolation:?}");
            assert_eq!(moving.of_exposure(0.5, 0.9e-3), moving, "a change that takes longer is motion");
        }
        let linear = Animated::keyed(keys, Interpolation::Linear).unwrap();
        assert_eq!(linear.of_exposure(0.5, 1e-3).at(0.7), linear.at(0.7));
        // Keys a millisecond apart are a fast recording, not cuts.
        let recorded = (0..50).map(|i| (1e-3 * f64::from(i), f64::from(i * i))).collect();
        let recorded = Animated::keyed(recorded, Interpolation::Linear).unwrap();
        assert_eq!(recorded.of_exposure(0.0205, 1e-3), recorded);
    }

    #[test]
    fn keys_that_agree_are_a_constant() {
        let still = Animated::keyed(vec![(0.0, 3.0), (1.0, 3.0)], Interpolation::Monotone).unwrap();
        assert_eq!(still.constant(), Some(3.0));
    }

    #[test]
    fn a_value_that_a_program_changes_continues_and_keeps_its_integral() {
        let mut speed = Animated::from(1.0);
        let mut distance = 0.0;
        let (dt, mut now) = (0.05, 0.0);
        for step in 1..4000_i32 {
            let before = speed.clone();
            speed = Animated::from(f64::from(step % 7));
            speed.continue_after(&before, now, dt);
            assert_eq!(speed.at(now), before.at(now), "{step}");
            distance += speed.integral(now, now + dt);
            now += dt;
            assert!((speed.integral(0.0, now) - distance).abs() < 1e-3 * distance.max(1.0), "{step}");
        }
        assert!(speed.keys().len() < 700, "{}", speed.keys().len());
        let same = speed.clone();
        speed.continue_after(&same, now, dt);
        assert_eq!(speed, same);
    }

    #[test]
    fn a_curve_that_a_program_changes_keeps_its_integral_whatever_its_interpolation() {
        for interpolation in [Interpolation::Linear, Interpolation::Step, Interpolation::Monotone] {
            let before = Animated::keyed(vec![(0.0, 1.0), (10.0, 5.0)], interpolation).unwrap();
            for t in [5.0, 60.0] {
                let mut changed = Animated::from(2.0);
                changed.continue_after(&before, t, 0.25);
                let [kept, expected] = [&changed, &before].map(|value| value.integral(0.0, t));
                assert!((kept - expected).abs() < 0.11, "{interpolation:?} {t}: {kept} {expected}");
                assert_eq!(changed.at(t + 1.0), 2.0);
            }
        }
        // Later keys of the earlier value are dropped.
        let steps = Animated::keyed(vec![(0.0, 5.0), (60.0, 9.0)], Interpolation::Step).unwrap();
        let mut held = Animated::from(5.0);
        held.continue_after(&steps, 50.0, 0.25);
        assert_eq!(held.at(70.0), 5.0);
        // Keys before time 0 stay while they are recent.
        let early = Animated::keyed(vec![(-60.0, 0.0), (60.0, 10.0)], Interpolation::Linear).unwrap();
        let mut changed = Animated::from(1.0);
        changed.continue_after(&early, 5.0, 0.25);
        assert!((changed.at(0.0) - early.at(0.0)).abs() < 1e-9);
    }

    #[test]
    fn faulty_keys_are_named() {
        assert_eq!(Animated::<f64>::keyed(vec![], Interpolation::Step), Err(CurveError::Empty));
        assert_eq!(
            Animated::keyed(vec![(0.0, [0.0; 3]), (0.0, [1.0; 3])], Interpolation::Linear),
            Err(CurveError::NotAscending { index: 1 })
        );
        assert_eq!(
            Animated::keyed(vec![(0.0, [0.0, 0.0, f64::INFINITY])], Interpolation::Linear),
            Err(CurveError::NotFinite { index: 0 })
        );
    }
}
