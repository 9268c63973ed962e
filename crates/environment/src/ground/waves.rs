//! Waves of open water: a sum of deep-water waves that run with the wind, in closed form.

use std::f64::consts::{PI, TAU};

use bansho_base::{
    math::{
        self, DVec2,
        random::{Key, Purpose, uniform_f64},
    },
    world::gravity::STANDARD_GRAVITY,
};

/// Waves in the sum: enough that their pattern never shows a beat, few enough to be added at every pixel.
const COUNT: usize = 14;
/// Longest over shortest wave.
const RANGE: f64 = 40.0;
/// How far waves turn from the wind's direction at most.
const SPREAD: f64 = 0.42 * PI;

/// One wave: slope = amplitude * cos(k . x - omega t + phase) along k.
#[derive(Clone, Copy, Debug)]
struct Wave {
    vector: DVec2,
    length: f64,
    phase: f64,
    slope: DVec2,
}

/// Waves at one time.
#[derive(Clone, Debug)]
pub(super) struct Waves {
    waves: Vec<Wave>,
}

/// The slope of the water somewhere.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Slope {
    /// Rise a metre along x and z.
    pub(super) resolved: DVec2,
    /// Share of the slope's variance in waves too short to be seen.
    pub(super) unresolved: f64,
}

impl Waves {
    /// Waves with an r.m.s. `slope`, the longest `longest` m, before a wind toward `heading` at time `t`. In a loop every wave
    /// repeats after `loop_s` seconds.
    pub(super) fn new(key: Key, slope: f64, longest: f64, heading: DVec2, t: f64, loop_s: Option<f64>) -> Self {
        let wave = |index: usize| {
            let words = key.words(index as u64, 0, Purpose::named("wave"));
            let [turn, phase] = [uniform_f64(words[0], words[1]), uniform_f64(words[2], words[3])];
            let share = index as f64 / (COUNT - 1) as f64;
            let length = longest * math::pow(RANGE, -share);
            let along = heading.rotate(unit((2.0 * turn - 1.0) * SPREAD));
            let number = TAU / length;
            // Deep water: omega^2 = g k.
            let turns = whole_turns(math::sqrt(STANDARD_GRAVITY * number) / TAU, loop_s) * t;
            let each = slope * math::sqrt(2.0 / COUNT as f64);
            Wave { vector: along * number, length, phase: TAU * (phase - turns.rem_euclid(1.0)), slope: along * each }
        };
        Self { waves: (0..COUNT).map(wave).collect() }
    }

    /// The slope at a `place` (x, z), of which a pixel covers `footprint` m.
    pub(super) fn slope(&self, place: DVec2, footprint: f64) -> Slope {
        let mut slope = Slope::default();
        for wave in &self.waves {
            // A wave shorter than two pixels is not seen as a wave; one of six pixels wholly.
            let seen = math::smoothstep(2.0, 6.0, wave.length / footprint.max(1e-9));
            if seen > 0.0 {
                slope.resolved += wave.slope * (seen * math::cos(wave.vector.dot(place) + wave.phase));
            }
            slope.unresolved += (1.0 - seen * seen) / COUNT as f64;
        }
        slope
    }
}

/// Turns a second, changed so little that a whole number of them fills the loop.
fn whole_turns(turns: f64, loop_s: Option<f64>) -> f64 {
    loop_s.map_or(turns, |seconds| (turns * seconds).round().max(1.0) / seconds)
}

/// The unit vector at an angle.
fn unit(angle: f64) -> DVec2 {
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
        let places = 20_000;
        let square = |index: i32| {
            let place = DVec2::new(f64::from(index) * 1.37, f64::from(index % 611) * 3.11);
            waves.slope(place, 0.0).resolved.length_squared()
        };
        let mean = (0..places).map(square).sum::<f64>() / f64::from(places);
        assert!((math::sqrt(mean) / 0.05 - 1.0).abs() < 0.1, "{}", math::sqrt(mean));
    }

    #[test]
    fn far_water_has_no_waves_to_be_seen() {
        let slope = waves(0.0, None).slope(DVec2::new(3.0, 4.0), 10.0);
        assert_eq!(slope, Slope { resolved: DVec2::ZERO, unresolved: slope.unresolved });
        assert!((slope.unresolved - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_loop_ends_where_it_began() {
        let at = |t| waves(t, Some(3.0)).slope(DVec2::new(1.0, 2.0), 0.0).resolved;
        assert!((at(0.0) - at(3.0)).length() < 1e-9);
        assert!((at(0.0) - at(1.5)).length() > 1e-4);
    }
}
