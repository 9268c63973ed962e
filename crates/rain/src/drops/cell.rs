//! Positions and velocities of the drops of one lattice cell at the middle of an exposure.

use bansho_base::math::{DVec3, MulAdd, simd::LANES};

use crate::lanes::{Lanes, Vec3Lanes, ZERO_LANES};

/// Position and motion of a cell's drops: uniform motion plus the gusts.
pub(crate) struct CellState {
    /// Its first corner relative to the camera, m.
    pub(super) base: [f32; 3],
    /// Its edge vectors, m.
    pub(super) axes: [[f32; 3]; 3],
    /// Velocity of all its drops in the mean wind, m/s.
    pub(super) velocity: [f32; 3],
    pub(super) gusts: Option<GustInterpolant>,
}

/// Trilinear interpolation of gusts from the corners of a cell. Coefficients of 1, x, y, xy, z, xz, yz and xyz.
pub(super) struct GustInterpolant {
    /// Displacement along x and z, m, and velocity along x and z, m/s.
    horizontal: [[f32; 8]; 4],
}

impl GustInterpolant {
    /// From displacement and velocity at the corners: x fastest, then y.
    pub(super) fn new(corners: [[DVec3; 2]; 8]) -> Self {
        let along = |quantity: fn([DVec3; 2]) -> f64| {
            let mut sums = corners.map(quantity);
            // Differences along each axis in turn turn corner values into polynomial coefficients.
            for axis in [1, 2, 4] {
                for corner in 0..8 {
                    if corner & axis != 0 {
                        sums[corner] -= sums[corner - axis];
                    }
                }
            }
            sums.map(|sum| sum as f32)
        };
        Self { horizontal: [along(|[d, _]| d.x), along(|[d, _]| d.z), along(|[_, v]| v.x), along(|[_, v]| v.z)] }
    }

    /// One quantity at sixteen positions within the cell.
    #[inline(always)]
    fn evaluate(coefficients: &[f32; 8], [xs, ys, zs]: &Vec3Lanes) -> Lanes {
        let mut values = ZERO_LANES;
        let [one, x, y, xy, z, xz, yz, xyz] = *coefficients;
        for i in 0..LANES {
            let low = xy.fma(ys[i], x).fma(xs[i], y.fma(ys[i], one));
            let high = xyz.fma(ys[i], xz).fma(xs[i], yz.fma(ys[i], z));
            values[i] = high.fma(zs[i], low);
        }
        values
    }
}

impl CellState {
    /// Positions relative to the camera (m) and velocities (m/s) of drops, from their positions as fractions of the
    /// cell's edges.
    #[inline(always)]
    pub(crate) fn drop_states(&self, fractions: &Vec3Lanes) -> (Vec3Lanes, Vec3Lanes) {
        let (mut positions, mut velocities) = ([ZERO_LANES; 3], [ZERO_LANES; 3]);
        let [right, up, back] = &self.axes;
        for axis in 0..3 {
            for i in 0..LANES {
                let across = right[axis].fma(fractions[0][i], self.base[axis]);
                positions[axis][i] = back[axis].fma(fractions[2][i], up[axis].fma(fractions[1][i], across));
                velocities[axis][i] = self.velocity[axis];
            }
        }
        if let Some(gusts) = &self.gusts {
            for (quantity, axis) in [(0, 0), (1, 2)] {
                let (displacement, velocity) = (
                    GustInterpolant::evaluate(&gusts.horizontal[quantity], fractions),
                    GustInterpolant::evaluate(&gusts.horizontal[quantity + 2], fractions),
                );
                for i in 0..LANES {
                    positions[axis][i] += displacement[i];
                    velocities[axis][i] += velocity[i];
                }
            }
        }
        (positions, velocities)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_corners_gusts_go_straight() {
        let corners: [[DVec3; 2]; 8] = std::array::from_fn(|corner| {
            let [x, y, z] = [corner & 1, corner >> 1 & 1, corner >> 2].map(|step| step as f64);
            [DVec3::new(1.0 + 2.0 * x - y * z, 0.0, 3.0 * z * x), DVec3::new(y, 0.0, x * y * z)]
        });
        let cell = CellState {
            base: [10.0, 20.0, 30.0],
            axes: [[1.0, 0.0, 0.0], [0.5, 2.0, 0.0], [0.0, 0.0, 1.0]],
            velocity: [0.0, -5.0, 0.0],
            gusts: Some(GustInterpolant::new(corners)),
        };
        let (x, y, z) = (0.25, 0.5, 0.75);
        let (positions, velocities) = cell.drop_states(&[[x; LANES], [y; LANES], [z; LANES]]);
        let position = positions.map(|row| row[3]);
        let expected = [10.0 + x + 0.5 * y + 1.0 + 2.0 * x - y * z, 20.0 + 2.0 * y, 30.0 + z + 3.0 * z * x];
        assert!(position.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-5), "{position:?}");
        assert_eq!(velocities.map(|row| row[7]), [y, -5.0, x * y * z]);
    }
}
