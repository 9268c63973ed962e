//! The wind over the gas: the scene's wind on a coarse grid, since gusts are larger than flames.

use bansho_base::{
    math::{DVec3, Vec3},
    wind::Wind,
};

/// Grid points along each side of the box around the gas.
const POINTS: usize = 4;

/// The wind at one moment within a box.
#[derive(Clone, Debug)]
pub(crate) struct Breeze {
    low: Vec3,
    /// Cells a metre.
    scale: Vec3,
    velocity: Vec<Vec3>,
}

impl Breeze {
    /// The wind at time `t` between the corners `low` and `high`, which count from `origin`, m.
    pub(crate) fn new(wind: &Wind, origin: DVec3, [low, high]: [Vec3; 2], t: f64) -> Self {
        let size = (high - low).max(Vec3::splat(1e-3));
        let last = (POINTS - 1) as f32;
        let at = |index: usize| {
            let place = [index % POINTS, index / POINTS % POINTS, index / (POINTS * POINTS)];
            let place = low + size * Vec3::from(place.map(|step| step as f32)) / last;
            wind.at(origin + place.as_dvec3(), t).as_vec3()
        };
        Self { low, scale: last / size, velocity: (0..POINTS * POINTS * POINTS).map(at).collect() }
    }

    /// Velocity at `place`, m/s.
    #[inline(always)]
    pub(crate) fn at(&self, place: Vec3) -> Vec3 {
        let last = (POINTS - 1) as f32;
        let place = ((place - self.low) * self.scale).clamp(Vec3::ZERO, Vec3::splat(last));
        let cell = place.floor().min(Vec3::splat(last - 1.0));
        let f = place - cell;
        let [x, y, z] = cell.to_array().map(|step| step as usize);
        let row = |j: usize, k: usize| {
            let start = ((z + k) * POINTS + y + j) * POINTS + x;
            self.velocity[start].lerp(self.velocity[start + 1], f.x)
        };
        row(0, 0).lerp(row(1, 0), f.y).lerp(row(0, 1).lerp(row(1, 1), f.y), f.z)
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::{animation::Animated, wind::WindParameters};

    use super::*;

    #[test]
    fn it_is_the_wind_itself_within_a_few_percent() {
        let parameters = WindParameters { velocity: Animated::from([3.0, 0.0, 1.0]), ..WindParameters::default() };
        let wind = Wind::new(parameters, 5, None);
        let origin = DVec3::new(10.0, 0.0, -4.0);
        let breeze = Breeze::new(&wind, origin, [Vec3::ZERO, Vec3::new(1.0, 2.0, 1.0)], 2.0);
        for place in [Vec3::splat(0.1), Vec3::new(0.9, 1.3, 0.4), Vec3::new(0.5, 2.0, 1.0)] {
            let exact = wind.at(origin + place.as_dvec3(), 2.0).as_vec3();
            assert!((breeze.at(place) - exact).length() < 0.1, "{} {exact}", breeze.at(place));
        }
    }
}
