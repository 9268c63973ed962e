//! How far eddies have carried the gas: two periodic tables, of the way across and of the way up, computed once.
//!
//! The gas follows a steady, divergence-free velocity field in the frame of the eddies: a row of vortices along each edge of the flame, which turn as the
//! shear between the rising gas and the air makes them turn (up on the inside, down on the outside), and weaker eddies of curl noise everywhere. Tracing
//! it back over a time gives for each point the point that its gas has come from: outlines and tongues sampled there are rolled up.
//!
//! - R. Bridson, J. Hourihan and M. Nordenstam, "Curl-noise for procedural fluid flow" (2007).
//! - B. M. Cetegen and T. A. Ahmed, "Experiments on the periodic instability of buoyant plumes and pool fires" (1993): the vortices of puffing flames.

use std::sync::LazyLock;

use bansho_base::math::{
    self,
    random::{Key, Purpose},
};

use crate::sheet::texture::{COLUMNS, ROWS, TextureTable, fractal_noise};

/// Vortices along each edge in a table.
pub(super) const VORTICES: usize = 6;
/// Distance of vortices along an edge for which the table is computed, sheet widths.
pub(super) const SPACING: f64 = 0.5;
/// Size of a table across and up, sheet widths. The flame is in the middle half.
pub(super) const SIZE: [f64; 2] = [2.0, VORTICES as f64 * SPACING];
/// Distance of texels across and up, sheet widths.
const TEXEL: [f64; 2] = [SIZE[0] / COLUMNS as f64, SIZE[1] / ROWS as f64];

/// Displacement across and up, in sheet widths: from a point to that from which its gas has come.
#[derive(Debug)]
pub(crate) struct EddyTables {
    pub(super) components: [TextureTable; 2],
    /// Largest displacement of either sign, across and up.
    pub(super) largest: [f32; 2],
}

/// The tables, common to all flames, which differ by their offsets.
pub(super) static EDDIES: LazyLock<EddyTables> = LazyLock::new(|| {
    let velocity = velocity().map(|texels| TextureTable::new(&texels));
    let [across, up] = traced_back(&velocity);
    let largest = [&across, &up].map(|texels| texels.iter().fold(0.0, |most: f32, value| most.max(value.abs())));
    EddyTables { components: [TextureTable::new(&across), TextureTable::new(&up)], largest }
});

/// A vortex with a Gaussian distribution of angular velocity, which turns by about a radian in the time over which the gas is traced back.
struct Vortex {
    center: [f64; 2],
    /// Distance at which its angular velocity is `1 / sqrt(e)` of that in the center, sheet widths.
    radius: f64,
    /// Angle by which its center turns, radians; positive is counterclockwise.
    turn: f64,
}

impl Vortex {
    /// Distance in radii beyond which the velocity is nothing in single precision: exp(-18) is 1.5e-8.
    const REACH: f64 = 6.0;

    /// Displacement of the gas at a point per time of tracing: `turn exp(-r^2 / (2 radius^2))` times the offset, turned by a right angle.
    fn velocity(&self, point: [f64; 2]) -> [f64; 2] {
        let x = point[0] - self.center[0];
        // The nearest of the copies of the vortex in the periodic table.
        let y = point[1] - self.center[1];
        let y = y - SIZE[1] * (y / SIZE[1]).round();
        let squared = (x * x + y * y) / (self.radius * self.radius);
        // Most vortices are out of reach of a point, and exponentials are most of the work.
        if squared > Self::REACH * Self::REACH {
            return [0.0; 2];
        }
        let rate = self.turn * math::exp(-0.5 * squared);
        [-rate * y, rate * x]
    }
}

/// The vortices along both edges: one edge is half a spacing behind the other, and no two are alike.
fn vortices() -> Vec<Vortex> {
    /// Distance of the rows from the axis, sheet widths.
    const EDGE: f64 = 0.26;
    let (key, purpose) = (Key::new(1993, "flame sheet eddies"), Purpose::named("vortex"));
    let mut vortices = Vec::with_capacity(2 * VORTICES);
    for index in 0..2 * VORTICES {
        let side = if index % 2 == 0 { -1.0 } else { 1.0 };
        let [a, b, c, d] = key.uniforms(index as u64, 0, purpose).map(f64::from);
        let x = side * (EDGE + 0.12 * (a - 0.5));
        let y = SPACING * (0.5 * index as f64 + 0.5 * (b - 0.5));
        let size = 0.75 + 0.5 * c;
        vortices.push(Vortex { center: [x, y], radius: 0.28 * SPACING * size, turn: -side * (1.3 + 1.2 * d) });
    }
    vortices
}

/// Velocity across and up at each texel, as a displacement in sheet widths per time of tracing.
fn velocity() -> [Vec<f32>; 2] {
    /// Scale of the curl noise.
    const NOISE: f32 = 0.02;
    let stream = fractal_noise(2, 0.4, Key::new(2007, "flame sheet eddies"), Purpose::named("curl noise"));
    let at = |row: usize, column: usize| stream[row % ROWS * COLUMNS + column % COLUMNS];
    let vortices = vortices();
    let mut velocity = [Vec::with_capacity(ROWS * COLUMNS), Vec::with_capacity(ROWS * COLUMNS)];
    for row in 0..ROWS {
        for column in 0..COLUMNS {
            let point = [TEXEL[0] * column as f64 - 0.5 * SIZE[0], TEXEL[1] * row as f64];
            let mut sum = [0.0; 2];
            for vortex in &vortices {
                let [x, y] = vortex.velocity(point);
                sum = [sum[0] + x, sum[1] + y];
            }
            let along = (at(row + 1, column) - at(row + ROWS - 1, column)) / (2.0 * TEXEL[1] as f32);
            let across = (at(row, column + 1) - at(row, column + COLUMNS - 1)) / (2.0 * TEXEL[0] as f32);
            velocity[0].push(sum[0] as f32 + NOISE * along);
            velocity[1].push(sum[1] as f32 - NOISE * across);
        }
    }
    velocity
}

/// The displacement from each texel to where its gas was before the time of tracing, by the midpoint method.
fn traced_back(velocity: &[TextureTable; 2]) -> [Vec<f32>; 2] {
    const STEPS: usize = 12;
    let step = -1.0 / STEPS as f32;
    let scale = TEXEL.map(|size| 1.0 / size as f32);
    let mut ways = [Vec::with_capacity(ROWS * COLUMNS), Vec::with_capacity(ROWS * COLUMNS)];
    for row in 0..ROWS {
        for column in 0..COLUMNS {
            let start = [column as f32, row as f32];
            let mut way = [0.0_f32; 2];
            for _ in 0..STEPS {
                let here = velocity_at(velocity, start, way, scale);
                let middle = [way[0] + 0.5 * step * here[0], way[1] + 0.5 * step * here[1]];
                let there = velocity_at(velocity, start, middle, scale);
                way = [way[0] + step * there[0], way[1] + step * there[1]];
            }
            ways[0].push(way[0]);
            ways[1].push(way[1]);
        }
    }
    ways
}

/// Velocity at a displacement in sheet widths from a texel.
fn velocity_at(velocity: &[TextureTable; 2], texel: [f32; 2], way: [f32; 2], scale: [f32; 2]) -> [f32; 2] {
    let (column, row) = (texel[0] + way[0] * scale[0], texel[1] + way[1] * scale[1]);
    [velocity[0].bilinear(column, row), velocity[1].bilinear(column, row)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest difference of two displacements, sheet widths.
    fn apart(a: [f32; 2], b: [f64; 2]) -> f64 {
        (f64::from(a[0]) - b[0]).abs().max((f64::from(a[1]) - b[1]).abs())
    }

    #[test]
    fn the_gas_of_a_single_vortex_was_turned_about_its_center() {
        // The speed is constant along a circle: traced back, a point at distance r has turned by -turn exp(-r^2 / (2 radius^2)).
        let vortex = Vortex { center: [0.02, 0.4 * SIZE[1]], radius: 0.14, turn: -1.7 };
        let mut velocity = [Vec::new(), Vec::new()];
        for texel in 0..ROWS * COLUMNS {
            let point = [TEXEL[0] * (texel % COLUMNS) as f64 - 0.5 * SIZE[0], TEXEL[1] * (texel / COLUMNS) as f64];
            let [x, y] = vortex.velocity(point);
            velocity[0].push(x as f32);
            velocity[1].push(y as f32);
        }
        let [across, up] = traced_back(&velocity.map(|texels| TextureTable::new(&texels)));
        for texel in 0..ROWS * COLUMNS {
            let x = TEXEL[0] * (texel % COLUMNS) as f64 - 0.5 * SIZE[0] - vortex.center[0];
            let y = TEXEL[1] * (texel / COLUMNS) as f64 - vortex.center[1];
            let angle = 1.7 * math::exp(-0.5 * (x * x + y * y) / (0.14 * 0.14));
            let (sin, cos) = math::sin_cos(angle);
            let expected = [x * cos - y * sin - x, x * sin + y * cos - y];
            assert!(apart([across[texel], up[texel]], expected) < 1e-3, "{x} {y}: {expected:?}");
        }
    }

    #[test]
    fn gas_is_carried_but_not_compressed() {
        // The determinant of the Jacobian of an incompressible motion is 1.
        let at = |component: usize, row: usize, column: usize| {
            f64::from(EDDIES.components[component].bilinear(column as f32, row as f32))
        };
        let (mut sum, mut wrong) = (0.0, 0.0);
        for row in (0..ROWS).step_by(3) {
            for column in (1..COLUMNS - 1).step_by(3) {
                let slope = |component: usize| {
                    let x = (at(component, row, column + 1) - at(component, row, column - 1)) / (2.0 * TEXEL[0]);
                    let y = (at(component, row + 1, column) - at(component, row + ROWS - 1, column)) / (2.0 * TEXEL[1]);
                    [x, y]
                };
                let [[xx, xy], [yx, yy]] = [slope(0), slope(1)];
                let determinant = (1.0 + xx) * (1.0 + yy) - xy * yx;
                (sum, wrong) = (sum + 1.0, wrong + (determinant - 1.0).abs());
            }
        }
        assert!(wrong / sum < 0.05, "{}", wrong / sum);
    }

    #[test]
    fn vortices_turn_up_on_the_inside_and_no_two_are_alike() {
        let vortices = vortices();
        for (index, vortex) in vortices.iter().enumerate() {
            let inside = [0.9 * vortex.center[0], vortex.center[1]];
            assert!(vortex.velocity(inside)[1] > 0.0, "{index}");
            for other in &vortices[..index] {
                assert!((other.turn - vortex.turn).abs() > 1e-3 && other.center != vortex.center, "{index}");
            }
        }
    }
}
