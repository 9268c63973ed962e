//! The wind of a scene: it bends flames, slants rain and advects particles.

mod live;

use live::{LiveState, LiveWind};

use glam::DVec3;

use crate::{
    math::random::{Key, Purpose},
    noise::{Coordinate, Fractal, Noise, VARIANCE},
    parameters::{Range, animated::Animated},
};

crate::parameters! {
    /// The wind, the same for everything in the scene.
    pub struct WindParameters {
        /// Mean velocity: x to the right, y up, z toward the viewer for a camera that is not rotated.
        velocity: Animated<[f64; 3]> = Animated::from([0.0, 0.0, 0.0]), limits(Range::new(-100.0, 100.0)), unit("m/s");
        /// Turbulence intensity: standard deviation of the speed divided by the mean speed.
        gust: f64 = 0.3, limits(Range::new(0.0, 2.0));
        /// Size of gusts. They drift with the mean wind; in a seamless loop they do not drift and only change over time.
        gust_length: f64 = 6.0, limits(Range::new(0.1, 1000.0)), unit("m");
        /// Duration of a gust at a fixed point in the mean wind.
        gust_period_s: f64 = 2.0, limits(Range::new(0.05, 600.0)), unit("s");
    }
}

/// Two octaves, the second with half the amplitude.
const FRACTAL: Fractal = Fractal { octaves: 2, lacunarity: 2, gain: 0.5 };
/// Sum of the squared amplitudes of the octaves: (2/3)^2 + (1/3)^2.
const FRACTAL_VARIANCE: f64 = 5.0 / 9.0;
/// Relative strength of gusts along each axis: weaker vertically, since the ground is near.
const GUST_SHAPE: DVec3 = DVec3::new(1.0, 0.35, 1.0);

/// The wind of a shot.
#[derive(Clone, Debug)]
pub struct Wind {
    parameters: WindParameters,
    /// Noise over (x, y, z, t) for each component.
    gusts: Option<[Noise<4>; 3]>,
    /// Offset in the noise domain, so that seeds differ even at the origin.
    origin: DVec3,
    loop_s: Option<f64>,
    /// The wind since it was changed during the shot.
    live: Option<LiveWind>,
}

/// Why the wind cannot be changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WindChangeError {
    /// The wind of a seamless loop is fixed.
    #[error("the wind of a seamless loop cannot be changed while it runs")]
    Loop,
    /// A time, a component of the velocity or the turbulence intensity is infinite or not a number.
    #[error("the wind has an infinite or NaN value; allowed: finite numbers")]
    NotFinite,
}

impl Wind {
    /// The wind with these parameters; in a loop it is periodic with `loop_s` seconds.
    pub fn new(mut parameters: WindParameters, seed: u64, loop_s: Option<f64>) -> Self {
        let key = Key::new(seed, "wind");
        let words = key.words(0, 0, Purpose::named("gusts"));
        let period = loop_s.map_or(0, |seconds| loop_cells(seconds, parameters.gust_period_s));
        let gusts = match [0, 1, 2].map(|component| Noise::new(words[component], FRACTAL, [0, 0, 0, period]).ok()) {
            [Some(x), Some(y), Some(z)] => Some([x, y, z]),
            _ => None,
        };
        let origin = DVec3::from(
            key.uniforms(1, 0, Purpose::named("gusts")).first_chunk().map_or([0.0; 3], |u: &[f32; 3]| u.map(f64::from)),
        );
        if let Some(seconds) = loop_s {
            parameters.velocity.make_periodic(seconds);
        }
        Self { parameters, gusts, origin: origin * 64.0, loop_s, live: None }
    }

    /// Changes the wind from time `t` on, as a program does while a shot runs: mean velocity (m/s) and turbulence intensity change linearly to these values
    /// within `transition_s`. What has blown before stays, so gusts do not jump.
    ///
    /// # Errors
    /// The wind is that of a seamless loop, or a number is not finite.
    pub fn change(&mut self, t: f64, velocity: DVec3, gust: f64, transition_s: f64) -> Result<(), WindChangeError> {
        if self.loop_s.is_some() {
            return Err(WindChangeError::Loop);
        }
        if !(velocity.is_finite() && [t, gust, transition_s].iter().all(|number| number.is_finite())) {
            return Err(WindChangeError::NotFinite);
        }
        let is_planned =
            self.parameters.velocity.constant() == Some(velocity.to_array()) && self.parameters.gust == gust;
        if self.live.is_none() && is_planned {
            return Ok(());
        }
        let planned = LiveState {
            velocity: self.planned_mean(t),
            gust: self.parameters.gust,
            travel: self.planned_travel(0.0, t),
        };
        // A program may have gone back to before the first change.
        if self.live_at(t).is_none() {
            self.live = Some(LiveWind::new(t, planned));
        }
        if let Some(live) = &mut self.live {
            live.change(t, velocity, gust, transition_s.max(0.0));
        }
        Ok(())
    }

    /// Takes over the [changes](Self::change) of another wind, as when its random numbers are replaced.
    pub fn take_changes(&mut self, from: &Self) {
        self.live.clone_from(&from.live);
    }

    /// Whether it was never [changed](Self::change) during the shot.
    pub fn is_planned(&self) -> bool {
        self.live.is_none()
    }

    /// Mean velocity at time `t`, m/s.
    pub fn mean(&self, t: f64) -> DVec3 {
        self.live_at(t).map_or_else(|| self.planned_mean(t), |live| live.velocity)
    }

    /// Displacement by the mean wind from one time to another, m.
    pub fn travel(&self, from: f64, to: f64) -> DVec3 {
        if self.live.is_none() {
            return self.planned_travel(from, to);
        }
        self.travel_since_zero(to) - self.travel_since_zero(from)
    }

    /// Displacement by the mean wind since time 0 of the planned wind, m.
    fn travel_since_zero(&self, t: f64) -> DVec3 {
        self.live_at(t).map_or_else(|| self.planned_travel(0.0, t), |live| live.travel)
    }

    /// Mean velocity at time `t` without [changes](Self::change) during the shot, m/s.
    pub fn planned_mean(&self, t: f64) -> DVec3 {
        DVec3::from(self.parameters.velocity.at(t))
    }

    /// Displacement by the mean wind from one time to another without [changes](Self::change) during the shot, m. Future keys are included.
    pub fn planned_travel(&self, from: f64, to: f64) -> DVec3 {
        DVec3::from(self.parameters.velocity.integral(from, to))
    }

    /// Displacement until time `t` by which the mean wind has deviated from the planned wind, m; `None` if it was never changed.
    pub fn unplanned_travel(&self, t: f64) -> Option<DVec3> {
        self.live.as_ref().map(|live| live.at(t).map_or(DVec3::ZERO, |live| live.travel - self.planned_travel(0.0, t)))
    }

    fn live_at(&self, t: f64) -> Option<LiveState> {
        self.live.as_ref()?.at(t)
    }

    /// Turbulence intensity at time `t`.
    pub fn gust(&self, t: f64) -> f64 {
        self.live_at(t).map_or(self.parameters.gust, |live| live.gust)
    }

    /// Size of the gusts, m; `None` if there are never any.
    pub fn gust_length(&self) -> Option<f64> {
        let [low, high] = self.parameters.velocity.bounds();
        let planned = self.parameters.gust > 0.0 && [low, high].into_iter().flatten().any(|speed| speed != 0.0);
        let gusty = planned || self.live.as_ref().is_some_and(LiveWind::is_gusty);
        gusty.then_some(self.parameters.gust_length)
    }

    /// Standard deviation of each horizontal component of gusts at time `t`, m/s.
    pub fn gust_deviation(&self, t: f64) -> f64 {
        if self.gusts.is_none() { 0.0 } else { self.gust(t) * self.mean(t).length() }
    }

    /// Velocity at a point at time `t`, including gusts, m/s.
    pub fn at(&self, point: DVec3, t: f64) -> DVec3 {
        let mean = self.mean(t);
        let strength = self.gust_deviation(t);
        let Some(gusts) = self.gusts.as_ref().filter(|_| strength > 0.0) else { return mean };
        let WindParameters { gust_length, gust_period_s, .. } = &self.parameters;
        let (drift, noise_time) = match self.loop_s {
            None => (self.travel_since_zero(t), t / gust_period_s),
            Some(seconds) => (DVec3::ZERO, t / seconds * f64::from(loop_cells(seconds, *gust_period_s))),
        };
        let noise_position = (point - drift) / *gust_length + self.origin;
        let coordinates = [noise_position.x, noise_position.y, noise_position.z, noise_time].map(Coordinate::from_f64);
        let noise = DVec3::from([0, 1, 2].map(|axis| f64::from(gusts[axis].at(coordinates))));
        let deviation = crate::math::sqrt(VARIANCE[2] * FRACTAL_VARIANCE);
        mean + GUST_SHAPE * noise * (strength / deviation)
    }
}

/// Number of gust periods in a loop, an integer.
fn loop_cells(seconds: f64, gust_period_s: f64) -> u32 {
    (seconds / gust_period_s).round().clamp(1.0, 1e6) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wind(loop_s: Option<f64>) -> Wind {
        let velocity = Animated::from([4.0, 0.0, 0.0]);
        Wind::new(WindParameters { velocity, gust: 0.25, ..WindParameters::default() }, 7, loop_s)
    }

    #[test]
    fn gusts_have_the_turbulence_intensity_that_was_asked_for() {
        let wind = wind(None);
        let speeds: Vec<f64> = (0..20_000)
            .map(|i| {
                wind.at(DVec3::new(f64::from(i) * 3.7, f64::from(i % 97), f64::from(i % 31) * 5.3), f64::from(i) * 0.11)
                    .x
            })
            .collect();
        let mean = speeds.iter().sum::<f64>() / speeds.len() as f64;
        let variance = speeds.iter().map(|speed| (speed - mean) * (speed - mean)).sum::<f64>() / speeds.len() as f64;
        assert!((mean - 4.0).abs() < 0.05, "{mean}");
        assert!((variance.sqrt() - 1.0).abs() < 0.08, "standard deviation {}", variance.sqrt());
    }

    #[test]
    fn the_mean_wind_travels_as_its_integral_says() {
        let keyed =
            Animated::keyed(vec![(0.0, [0.0; 3]), (2.0, [4.0, 0.0, -2.0])], crate::math::curve::Interpolation::Linear);
        let velocity = keyed.unwrap();
        let wind = Wind::new(WindParameters { velocity, ..WindParameters::default() }, 7, None);
        assert!((wind.travel(0.0, 2.0) - DVec3::new(4.0, 0.0, -2.0)).length() < 1e-12);
        assert_eq!(wind.gust_length(), Some(6.0));
        assert_eq!(Wind::new(WindParameters::default(), 7, None).gust_length(), None);
    }

    #[test]
    fn gusts_drift_with_the_mean_wind() {
        let wind = wind(None);
        let still = Wind::new(WindParameters { gust_period_s: 600.0, ..wind.parameters }, 7, None);
        let here = still.at(DVec3::new(1.0, 2.0, 3.0), 0.0);
        let there = still.at(DVec3::new(5.0, 2.0, 3.0), 1.0);
        assert!((here - there).length() < 0.02, "{here} {there}");
    }

    #[test]
    fn a_loop_blows_the_same_after_one_turn() {
        let wind = wind(Some(4.0));
        let point = DVec3::new(0.3, 1.0, -2.0);
        assert!((wind.at(point, 0.7) - wind.at(point, 4.7)).length() < 1e-4);
        assert!((wind.at(point, 0.7) - wind.at(point, 2.7)).length() > 1e-3);
    }

    #[test]
    fn a_change_before_the_first_one_is_heard() {
        let mut wind = wind(None);
        wind.change(30.0, DVec3::X, 0.25, 0.2).unwrap();
        wind.change(10.0, DVec3::X * 2.0, 0.25, 0.2).unwrap();
        assert_eq!(wind.change(10.0, DVec3::X * f64::NAN, 0.25, 0.2), Err(WindChangeError::NotFinite));
        assert_eq!(
            (wind.mean(9.0), wind.mean(20.0), wind.mean(40.0)),
            (DVec3::X * 4.0, DVec3::X * 2.0, DVec3::X * 2.0)
        );
        assert!((wind.travel(0.0, 10.2) - DVec3::X * (40.0 + 0.6)).length() < 1e-9);
    }

    #[test]
    fn a_wind_that_is_set_to_what_it_is_stays_planned() {
        let mut wind = wind(None);
        wind.change(3.0, DVec3::X * 4.0, 0.25, 0.2).unwrap();
        assert!(wind.is_planned());
        wind.change(3.0, DVec3::X * 4.0, 0.3, 0.2).unwrap();
        assert!(!wind.is_planned() && wind.gust(3.1) > 0.25 && wind.gust(9.0) == 0.3);
    }

    #[test]
    fn still_air_has_no_gusts() {
        let wind = Wind::new(WindParameters::default(), 1, None);
        assert_eq!(wind.at(DVec3::ONE, 3.0), DVec3::ZERO);
    }
}
