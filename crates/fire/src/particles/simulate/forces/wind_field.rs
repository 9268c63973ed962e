//! The scene's wind sampled on a coarse grid around the gas, which suffices since gusts are larger than flames.

use bansho_base::{
    math::{
        DVec3, Vec3,
        simd::{Lanes, Real, gather, wrap_split},
    },
    world::wind::Wind,
};
use fearless_simd::{Simd, prelude::*};

use crate::particles::simulate::vectors::{lerp4, scaled};

/// Grid points along each side of the box around the gas.
const POINTS: usize = 4;

/// Number of grid points of the box.
const ALL_POINTS: usize = POINTS * POINTS * POINTS;

/// The wind at one time within a box.
#[derive(Clone, Debug)]
pub(crate) struct WindField {
    low: [f32; 3],
    /// Cells per meter.
    scale: [f32; 3],
    /// Velocities on the grid, padded to four components.
    velocity: Box<[[f32; 4]; ALL_POINTS]>,
}

impl WindField {
    /// The wind at `t` between the corners `low` and `high`, relative to `origin`, m.
    pub(crate) fn new(wind: &Wind, origin: DVec3, [low, high]: [Vec3; 2], t: f64) -> Self {
        let size = (high - low).max(Vec3::splat(1e-3));
        let last = (POINTS - 1) as f32;
        let mut velocity = Box::new([[0.0; 4]; ALL_POINTS]);
        for (index, velocity) in velocity.iter_mut().enumerate() {
            let position = [index % POINTS, index / POINTS % POINTS, index / (POINTS * POINTS)];
            let position = low + size * Vec3::from(position.map(|step| step as f32)) / last;
            *velocity = wind.at(origin + position.as_dvec3(), t).as_vec3().extend(0.0).to_array();
        }
        Self { low: low.to_array(), scale: (last / size).to_array(), velocity }
    }

    /// Trilinear interpolation at sixteen positions, m/s.
    #[inline(always)]
    pub(crate) fn at<S: Simd>(&self, simd: S, position: &[Lanes<S>; 3]) -> [Lanes<S>; 3] {
        const MASK: u32 = POINTS as u32 - 1;
        let zero = Lanes::splat(simd, 0.0);
        // The last grid point is excluded: it has no successor.
        let last = Lanes::splat(simd, (POINTS - 1) as f32 - 1e-3);
        let mut grid_position = *position;
        for c in 0..3 {
            let offset = position[c] - Lanes::splat(simd, self.low[c]);
            grid_position[c] = scaled(offset, self.scale[c]).simd_max(zero).simd_min(last);
        }
        let ((x, across), (y, up), (z, along)) = (
            wrap_split(grid_position[0], MASK),
            wrap_split(grid_position[1], MASK),
            wrap_split(grid_position[2], MASK),
        );
        let first = (((z << POINTS.ilog2()) + y) << POINTS.ilog2()) + x;
        let [next_y, next_z] = [POINTS as u32, (POINTS * POINTS) as u32];
        let starts = [first, first + next_y, first + next_z, first + (next_y + next_z)];
        let mut rows = [[zero; 4]; 4];
        for k in 0..4 {
            let [here, next] = [gather(simd, &self.velocity, starts[k]), gather(simd, &self.velocity, starts[k] + 1)];
            rows[k] = lerp4(&here, &next, across);
        }
        let (near, far) = (lerp4(&rows[0], &rows[1], up), lerp4(&rows[2], &rows[3], up));
        let [x, y, z, _] = lerp4(&near, &far, along);
        [x, y, z]
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::{parameters::animated::Animated, world::wind::WindParameters};

    use super::*;

    #[test]
    fn it_is_the_wind_itself_within_a_few_percent() {
        let parameters = WindParameters { velocity: Animated::from([3.0, 0.0, 1.0]), ..WindParameters::default() };
        let wind = Wind::new(parameters, 5, None);
        let origin = DVec3::new(10.0, 0.0, -4.0);
        let wind_field = WindField::new(&wind, origin, [Vec3::ZERO, Vec3::new(1.0, 2.0, 1.0)], 2.0);
        for position in [Vec3::splat(0.1), Vec3::new(0.9, 1.3, 0.4), Vec3::new(0.5, 2.0, 1.0)] {
            let exact = wind.at(origin + position.as_dvec3(), 2.0).as_vec3();
            let found = bansho_base::dispatch_baseline!(simd => {
                let velocity = wind_field.at(simd, &position.to_array().map(|x| Lanes::splat(simd, x)));
                Vec3::from(velocity.map(|values| values.as_slice()[11]))
            });
            assert!((found - exact).length() < 0.1, "{found} {exact}");
        }
    }
}
