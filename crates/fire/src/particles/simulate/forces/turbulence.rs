//! Turbulence: curl noise in two layers that rise with the gas.
//!
//! The velocity is the curl of three noise potentials (Bridson, Hourihan and Nordenstam 2007), computed once by central differences
//! on a periodic grid. The second layer is half as large; both scroll at different speeds, so that eddies change while they rise.

use std::sync::OnceLock;

use bansho_base::{
    host::once::get_or_compute,
    math::{
        DVec3, Vec3,
        random::{Key, Purpose},
        simd::{Lanes, Real, gather, wrap_split},
    },
    noise::{Coordinate, Fractal, Noise},
};
use fearless_simd::{Simd, prelude::*, u32x16};

use crate::particles::simulate::vectors::lerp4;

/// Grid points along each side of the tile.
const SIDE: usize = 32;
/// Eddies along each side of the tile.
const EDDIES: u32 = 5;
/// Speed of the two layers relative to the gas on the axis.
const LAYER_SPEED: [f64; 2] = [0.55, 0.3];
/// Standard deviation of the two layers; the squares sum to 1.
const LAYER_WEIGHT: [f32; 2] = [0.86, 0.51];

/// A periodic velocity field whose components have a standard deviation of 1.
#[derive(Clone, Debug)]
pub(crate) struct TurbulenceTile {
    key: Key,
    /// Velocities on the grid, padded to four components.
    tile: OnceLock<Vec<[f32; 4]>>,
}

/// The two layers of the turbulence at one time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EddyField<'a> {
    tile: &'a [[f32; 4]],
    layers: [EddyLayer; 2],
}

#[derive(Clone, Copy, Debug)]
struct EddyLayer {
    /// Grid points per meter.
    scale: f32,
    /// Grid position of the flame's position.
    origin: [f32; 3],
}

impl TurbulenceTile {
    pub(crate) fn new(key: Key) -> Self {
        Self { key, tile: OnceLock::new() }
    }

    /// The tile, computed at the first step, since a flame that is only built for checks does not need it.
    fn tile(&self) -> &[[f32; 4]] {
        get_or_compute(&self.tile, || compute_tile(self.key)).as_slice()
    }

    /// Noise of mean 0 and standard deviation 1 with eddies of unit size.
    pub(crate) fn noise(&self, position: DVec3) -> f32 {
        let position = (position * (SIDE as f64 / f64::from(EDDIES))).rem_euclid(DVec3::splat(SIDE as f64));
        sample(self.tile(), position.as_vec3())[0]
    }

    /// The eddies at `t` in gas that rises at `speed` m/s, displaced by `drift` m by the wind since time 0; the largest are `eddy_size` m wide.
    pub(crate) fn at(&self, t: f64, eddy_size: f64, speed: f64, drift: DVec3) -> EddyField<'_> {
        let layers = std::array::from_fn(|index| {
            let scale = SIDE as f64 / (f64::from(EDDIES) * eddy_size) * (index + 1) as f64;
            let moved = DVec3::Y * (speed * LAYER_SPEED[index] * t) + drift;
            // The offset keeps the zeros of the layers from coinciding. Reduced in f64, so that no precision is lost even after hours.
            let origin = (-moved * scale + 11.3 * index as f64).rem_euclid(DVec3::splat(SIDE as f64));
            EddyLayer { scale: scale as f32, origin: origin.as_vec3().to_array() }
        });
        EddyField { tile: self.tile(), layers }
    }
}

/// The normalized velocities of the tile.
fn compute_tile(key: Key) -> Vec<[f32; 4]> {
    let words = key.words(0, 0, Purpose::named("turbulence"));
    let potentials = [0, 1, 2].map(|axis| potential(words[axis]));
    let mut tile: Vec<Vec3> = (0..SIDE * SIDE * SIDE).map(|index| curl(&potentials, index)).collect();
    let squares: f64 = tile.iter().map(|velocity| f64::from(velocity.length_squared())).sum();
    let deviation = bansho_base::math::sqrt(squares / (3 * tile.len()) as f64);
    let scale = if deviation > 0.0 { (1.0 / deviation) as f32 } else { 0.0 };
    tile.iter_mut().for_each(|velocity| *velocity *= scale);
    tile.into_iter().map(|velocity| velocity.extend(0.0).to_array()).collect()
}

impl EddyField<'_> {
    /// Velocity at `position`, m from the flame's position; each component has a standard deviation of 1.
    #[inline(always)]
    pub(crate) fn velocity<S: Simd>(&self, simd: S, position: &[Lanes<S>; 3]) -> [Lanes<S>; 3] {
        let mut sum = [Lanes::splat(simd, 0.0); 3];
        let Ok(tile) = <&[[f32; 4]; SIDE * SIDE * SIDE]>::try_from(self.tile) else { return sum };
        for (layer, weight) in LAYER_WEIGHT.into_iter().enumerate() {
            let EddyLayer { scale, origin } = &self.layers[layer];
            let mut grid_position = *position;
            for c in 0..3 {
                grid_position[c] = position[c].fma(position[c].broadcast(*scale), position[c].broadcast(origin[c]));
            }
            let velocity = sample_lanes(simd, tile, &grid_position);
            for c in 0..3 {
                sum[c] = velocity[c].fma(velocity[c].broadcast(weight), sum[c]);
            }
        }
        sum
    }
}

/// Trilinear interpolation of the tile at positions in grid points.
#[inline(always)]
fn sample_lanes<S: Simd>(simd: S, tile: &[[f32; 4]; SIDE * SIDE * SIDE], position: &[Lanes<S>; 3]) -> [Lanes<S>; 3] {
    const MASK: u32 = SIDE as u32 - 1;
    let ((x, across), (y, up), (z, along)) =
        (wrap_split(position[0], MASK), wrap_split(position[1], MASK), wrap_split(position[2], MASK));
    let (next_x, next_y, next_z) = ((x + 1) & MASK, (y + 1) & MASK, (z + 1) & MASK);
    let row = Row { tile, x: [x, next_x], across };
    let near = lerp4(&row.at(simd, y, z), &row.at(simd, next_y, z), up);
    let far = lerp4(&row.at(simd, y, next_z), &row.at(simd, next_y, next_z), up);
    let [x, y, z, _] = lerp4(&near, &far, along);
    [x, y, z]
}

/// Two adjacent grid columns.
struct Row<'a, S: Simd> {
    tile: &'a [[f32; 4]; SIDE * SIDE * SIDE],
    x: [u32x16<S>; 2],
    /// Interpolation weight along x.
    across: Lanes<S>,
}

impl<S: Simd> Row<'_, S> {
    /// Velocity interpolated along x in the row at `y` and `z`.
    #[inline(always)]
    fn at(&self, simd: S, y: u32x16<S>, z: u32x16<S>) -> [Lanes<S>; 4] {
        let start = ((z << SIDE.ilog2()) + y) << SIDE.ilog2();
        lerp4(&gather(simd, self.tile, start + self.x[0]), &gather(simd, self.tile, start + self.x[1]), self.across)
    }
}

/// Trilinear interpolation of the tile at one position in grid points.
fn sample(tile: &[[f32; 4]], position: Vec3) -> [f32; 4] {
    let floor = position.floor();
    let f = position - floor;
    // The grid planes before and after the position along each axis. The tile is periodic, and its side a power of two.
    let [x, y, z] = floor
        .as_ivec3()
        .to_array()
        .map(|cell| [cell, cell.wrapping_add(1)].map(|coordinate| (coordinate & (SIDE as i32 - 1)) as usize));
    let mut rows = [[0.0; 4]; 4];
    for (index, row) in rows.iter_mut().enumerate() {
        let start = (z[index / 2] * SIDE + y[index % 2]) * SIDE;
        *row = lerp4(&tile[start + x[0]], &tile[start + x[1]], f.x);
    }
    lerp4(&lerp4(&rows[0], &rows[1], f.y), &lerp4(&rows[2], &rows[3], f.y), f.z)
}

/// One noise potential on the grid.
fn potential(seed: u32) -> Vec<f32> {
    // The fractal and the period are constants within their bounds.
    let Ok(noise) = Noise::<3>::new(seed, Fractal::SINGLE, [EDDIES; 3]) else { return vec![0.0; SIDE * SIDE * SIDE] };
    let coordinates: [Coordinate; SIDE] =
        std::array::from_fn(|step| Coordinate::from_f64((step * EDDIES as usize) as f64 / SIDE as f64));
    let values = (0..SIDE * SIDE * SIDE).map(|index| {
        noise.at([index % SIDE, index / SIDE % SIDE, index / (SIDE * SIDE)].map(|step| coordinates[step]))
    });
    values.collect()
}

/// Curl of the potentials at a grid point, by central differences.
fn curl([x, y, z]: &[Vec<f32>; 3], index: usize) -> Vec3 {
    Vec3::new(
        central_difference(z, index, 1) - central_difference(y, index, 2),
        central_difference(x, index, 2) - central_difference(z, index, 0),
        central_difference(y, index, 0) - central_difference(x, index, 1),
    )
}

/// Difference of the potential at the two neighbors of a point of the periodic grid along an axis.
fn central_difference(potential: &[f32], index: usize, axis: usize) -> f32 {
    let point = [index % SIDE, index / SIDE % SIDE, index / (SIDE * SIDE)];
    let [next, previous] = [1, SIDE - 1].map(|step| {
        let mut neighbor = point;
        neighbor[axis] = (neighbor[axis] + step) % SIDE;
        potential[(neighbor[2] * SIDE + neighbor[1]) * SIDE + neighbor[0]]
    });
    next - previous
}

#[cfg(test)]
mod tests {
    use super::*;

    fn velocity(eddies: &EddyField, position: Vec3) -> Vec3 {
        bansho_base::dispatch_baseline!(simd => {
            let velocity = eddies.velocity(simd, &position.to_array().map(|x| Lanes::splat(simd, x)));
            Vec3::from(velocity.map(|values| values.as_slice()[9]))
        })
    }

    #[test]
    fn the_tile_is_free_of_divergence_and_of_unit_strength() {
        let turbulence = TurbulenceTile::new(Key::new(3, "turbulence"));
        let at = |x: usize, y: usize, z: usize| {
            Vec3::from_slice(&turbulence.tile()[((z % SIDE) * SIDE + y % SIDE) * SIDE + x % SIDE])
        };
        for index in (0..SIDE * SIDE * SIDE).step_by(37) {
            let [x, y, z] = [index % SIDE, index / SIDE % SIDE, index / (SIDE * SIDE)];
            let divergence = at(x + 1, y, z).x - at(x + SIDE - 1, y, z).x + at(x, y + 1, z).y
                - at(x, y + SIDE - 1, z).y
                + at(x, y, z + 1).z
                - at(x, y, z + SIDE - 1).z;
            assert!(divergence.abs() < 1e-4, "{divergence}");
        }
        let eddies = turbulence.at(1.7, 0.3, 3.0, DVec3::ZERO);
        let positions = (0..20_000).map(|i| Vec3::new(0.013, 0.017, 0.023) * i as f32);
        let squares: f32 = positions.map(|position| velocity(&eddies, position).length_squared()).sum();
        let deviation = (squares / 60_000.0).sqrt();
        assert!((0.7..1.1).contains(&deviation), "standard deviation {deviation}");
    }

    #[test]
    fn one_place_and_sixteen_find_the_same_velocity() {
        let turbulence = TurbulenceTile::new(Key::new(3, "turbulence"));
        let tile = <&[[f32; 4]; SIDE * SIDE * SIDE]>::try_from(turbulence.tile()).unwrap();
        for step in 0..200 {
            let position = Vec3::new(0.37, 1.71, 0.83) * step as f32 - 40.0;
            let together = bansho_base::dispatch_baseline!(simd => {
                let lanes = position.to_array().map(|x| Lanes::splat(simd, x));
                sample_lanes(simd, tile, &lanes).map(|values| values.as_slice()[7])
            });
            let alone = sample(turbulence.tile(), position);
            assert!((0..3).all(|c| (together[c] - alone[c]).abs() < 1e-5), "at {position}: {together:?} {alone:?}");
        }
    }

    #[test]
    fn eddies_rise_with_the_gas_and_drift_with_the_wind() {
        let turbulence = TurbulenceTile::new(Key::new(3, "turbulence"));
        let position = Vec3::new(0.1, 0.2, 0.3);
        let initial = velocity(&turbulence.at(0.0, 0.5, 2.0, DVec3::ZERO), position);
        let drifted = velocity(&turbulence.at(0.0, 0.5, 2.0, DVec3::X * 0.7), position + Vec3::X * 0.7);
        assert!((initial - drifted).length() < 1e-3);
        assert!((velocity(&turbulence.at(0.5, 0.5, 2.0, DVec3::ZERO), position) - initial).length() > 0.01);
    }
}
