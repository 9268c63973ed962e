//! Positions and velocities of the drops of one lattice cell at the middle of an exposure.

use bansho_base::math::{
    DVec2,
    simd::{LANES, Real},
};

use crate::lanes::{LaneArray, Vec3Lanes, ZERO_LANES};

/// Position and motion of a cell's drops: uniform motion plus the gusts.
pub(crate) struct CellState {
    /// Its first corner relative to the camera, m.
    pub(super) base: [f32; 3],
    /// Its edge vectors, m.
    pub(super) axes: [[f32; 3]; 3],
    /// Velocity of all its drops in the mean wind, m/s.
    pub(super) velocity: [f32; 3],
    /// `None` for drops in a steady wind.
    pub(super) deviations: Option<Deviations>,
}

/// What deviates from uniform motion in the mean wind at one point of a cell: horizontal, x and z.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Deviation {
    /// Displacement, m.
    pub(crate) displacement: DVec2,
    /// m/s.
    pub(crate) velocity: DVec2,
    /// Offsets of the drop, when the shutter opens and when it closes, from where its velocity at the middle would take it, m.
    pub(crate) bends: [DVec2; 2],
}

/// The same in single precision: x and z of the displacement, of the velocity, and of the bends when the shutter opens and when it closes.
pub(super) type DeviationLanes = [f32; 8];

/// Bends up to this length are neglected, m: those of usual gusts in exposures of less than a fiftieth of a second.
pub(super) const MAX_UNSEEN_BEND: f32 = 5e-4;

/// Trilinear interpolation of deviations from the corners of a cell. Of each quantity the coefficients of 1, x, y, xy, z, xz, yz and xyz.
pub(super) struct Deviations {
    coefficients: [[f32; 8]; 8],
    /// Whether any bend is large enough to be seen.
    has_bends: bool,
}

/// Sixteen drops of a cell.
pub(crate) struct DropStates {
    /// Positions relative to the camera, m.
    pub(crate) positions: Vec3Lanes,
    /// m/s.
    pub(crate) velocities: Vec3Lanes,
    /// [Bends](Deviation::bends) of their paths, x and z, when the shutter opens and when it closes, m.
    pub(crate) bends: Option<[[LaneArray; 2]; 2]>,
}

impl Deviation {
    pub(super) fn lanes(&self) -> DeviationLanes {
        let Self { displacement, velocity, bends: [open, close] } = *self;
        let [displacement, velocity, open, close] = [displacement, velocity, open, close].map(DVec2::as_vec2);
        [displacement.x, displacement.y, velocity.x, velocity.y, open.x, open.y, close.x, close.y]
    }
}

impl Deviations {
    /// From those at the corners: x fastest, then y.
    #[inline(always)]
    pub(super) fn new(mut corners: [DeviationLanes; 8]) -> Self {
        let mut longest = 0.0;
        for corner in &corners {
            for bend in &corner[4..] {
                longest = bend.abs().simd_max(longest);
            }
        }
        // Differences along each axis in turn turn corner values into polynomial coefficients.
        for axis in [1, 2, 4] {
            for corner in 0..8 {
                if corner & axis != 0 {
                    for lane in 0..8 {
                        corners[corner][lane] -= corners[corner - axis][lane];
                    }
                }
            }
        }
        let mut coefficients = [[0.0; 8]; 8];
        for lane in 0..8 {
            for corner in 0..8 {
                coefficients[lane][corner] = corners[corner][lane];
            }
        }
        Self { coefficients, has_bends: longest > MAX_UNSEEN_BEND }
    }

    /// One quantity at sixteen positions within the cell.
    #[inline(always)]
    fn evaluate(coefficients: &[f32; 8], [xs, ys, zs]: &Vec3Lanes) -> LaneArray {
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
    /// Drops at positions that are fractions of the cell's edges.
    #[inline(always)]
    pub(crate) fn drop_states(&self, fractions: &Vec3Lanes) -> DropStates {
        let (mut positions, mut velocities) = ([ZERO_LANES; 3], [ZERO_LANES; 3]);
        let [right, up, back] = &self.axes;
        for axis in 0..3 {
            for i in 0..LANES {
                let across = right[axis].fma(fractions[0][i], self.base[axis]);
                positions[axis][i] = back[axis].fma(fractions[2][i], up[axis].fma(fractions[1][i], across));
                velocities[axis][i] = self.velocity[axis];
            }
        }
        let Some(deviations) = &self.deviations else { return DropStates { positions, velocities, bends: None } };
        let coefficients = &deviations.coefficients;
        for (side, axis) in [(0, 0), (1, 2)] {
            let displacement = Deviations::evaluate(&coefficients[side], fractions);
            let velocity = Deviations::evaluate(&coefficients[2 + side], fractions);
            for i in 0..LANES {
                positions[axis][i] += displacement[i];
                velocities[axis][i] += velocity[i];
            }
        }
        if !deviations.has_bends {
            return DropStates { positions, velocities, bends: None };
        }
        let mut bends = [[ZERO_LANES; 2]; 2];
        for side in 0..2 {
            bends[0][side] = Deviations::evaluate(&coefficients[4 + side], fractions);
            bends[1][side] = Deviations::evaluate(&coefficients[6 + side], fractions);
        }
        DropStates { positions, velocities, bends: Some(bends) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_corners_deviations_go_straight() {
        let corners: [Deviation; 8] = std::array::from_fn(|corner| {
            let [x, y, z] = [corner & 1, corner >> 1 & 1, corner >> 2].map(|step| step as f64);
            Deviation {
                displacement: DVec2::new(1.0 + 2.0 * x - y * z, 3.0 * z * x),
                velocity: DVec2::new(y, x * y * z),
                bends: [DVec2::new(x, 0.1), DVec2::new(0.2, z)],
            }
        });
        let cell = CellState {
            base: [10.0, 20.0, 30.0],
            axes: [[1.0, 0.0, 0.0], [0.5, 2.0, 0.0], [0.0, 0.0, 1.0]],
            velocity: [0.0, -5.0, 0.0],
            deviations: Some(Deviations::new(corners.map(|corner| corner.lanes()))),
        };
        let (x, y, z) = (0.25, 0.5, 0.75);
        let DropStates { positions, velocities, bends } = cell.drop_states(&[[x; LANES], [y; LANES], [z; LANES]]);
        let position = positions.map(|row| row[3]);
        let expected = [10.0 + x + 0.5 * y + 1.0 + 2.0 * x - y * z, 20.0 + 2.0 * y, 30.0 + z + 3.0 * z * x];
        assert!(position.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-5), "{position:?}");
        assert_eq!(velocities.map(|row| row[7]), [y, -5.0, x * y * z]);
        assert_eq!(bends.map(|ends| ends.map(|end| end.map(|row| row[9]))), Some([[x, 0.1], [0.2, z]]));
    }
}
