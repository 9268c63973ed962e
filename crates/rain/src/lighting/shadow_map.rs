//! Shadow maps: how far the light of a lamp travels in each direction before it meets a solid.
//!
//! Directions are mapped to a disc by stereographic projection about an axis, which keeps small circles circles, so that a cell is as wide as it is high. A spot whose
//! cone is at most a hemisphere has one disc that covers its cone, any other lamp has two, one for each hemisphere. A lookup takes a division and a square root. Solids
//! are found by sphere tracing of their signed distances: first for blocks of cells, whose cone of rays is followed up to where it may meet the solid, then for ever
//! smaller blocks. Blocks that miss it take a few steps.
//!
//! References: L. Williams, "Casting curved shadows on curved surfaces" (1978): shadow maps. W. Reeves, D. Salesin and R. Cook, "Rendering antialiased shadows with
//! depth maps" (1987): percentage-closer filtering. J. Hart, "Sphere tracing" (1996).

use bansho_base::{
    host::parallel::prelude::*,
    math::{self, DVec3},
    phenomenon::surroundings::{Emitter, Occluder},
};

/// Cells along a side of the square around a disc.
const SIDE: usize = 256;
/// Cells along a side of a block.
const BLOCK: usize = 16;
const BLOCKS: usize = SIDE / BLOCK;
/// Cells of a block.
const BLOCK_CELLS: usize = BLOCK * BLOCK;
/// Cells between the edge of a disc and the sides of its square: a lookup at the edge reads the cells beyond it.
const MARGIN: f64 = 2.0;
/// Least distance from the center of a lamp at which a solid is met, m: lamps have housings. Solids within the radius of a larger light do not shadow it either.
const SOURCE_RADIUS: f64 = 0.08;
/// Distance from a surface at which it is met, m.
const CLOSE: f64 = 1e-3;
/// Steps after which a ray that grazes a solid counts as shadowed, and a block of rays is divided.
const MAX_STEPS: usize = 48;
/// Steps of a block, as a fraction of the radius of its cone, below which it is divided.
const SHORT_STEP: f64 = 0.25;
/// Distance to which solids without end are traced, m.
const FAR: f64 = 1e3;

/// The solids around a lamp, as the lamp sees them.
#[derive(Debug)]
pub(crate) struct ShadowMap {
    /// Unit vectors to the right, upward, and along the axis.
    axes: [[f32; 3]; 3],
    /// Cells per unit of the stereographic coordinates, in which directions at a right angle to the axis have the length 1.
    scale: f32,
    /// Whether there is a disc for directions behind the lamp, too.
    is_whole: bool,
    /// Block by block, in each row by row: distance to the nearest solid in the direction of the middle of each cell, m; infinite where there is none.
    cells: Vec<f32>,
    /// The least distance in each block and in the cells around it, m.
    nearest: Vec<f32>,
}

/// A square of cells of one disc.
#[derive(Clone, Copy)]
struct CellSquare {
    /// The first column and row.
    first: [usize; 2],
    side: usize,
    is_behind: bool,
}

impl ShadowMap {
    /// The shadows that solids cast in the light of a lamp; `None` if no light meets a solid, and for a light at infinity.
    pub(super) fn new(emitter: &Emitter, casters: &[Occluder]) -> Option<Self> {
        let position = emitter.position()?;
        let (axis, cosine, radius) = match *emitter {
            Emitter::Spot { axis, cos_outer, .. } if cos_outer >= 0.0 => (axis, Some(cos_outer), 0.0),
            Emitter::Point { radius, .. } => (DVec3::Y, None, radius),
            _ => (DVec3::Y, None, 0.0),
        };
        // The tangent of half the angle from the axis to the edge.
        let edge = cosine.map_or(1.0, |cosine| math::sqrt((1.0 - cosine) / (1.0 + cosine)).max(1e-3));
        let (right, up) = axis.any_orthonormal_pair();
        let discs = if cosine.is_none() { 2 } else { 1 };
        let mut map = Self {
            axes: [right, up, axis].map(|axis| axis.as_vec3().to_array()),
            scale: ((0.5 * SIDE as f64 - MARGIN) / edge) as f32,
            is_whole: discs == 2,
            cells: vec![f32::INFINITY; discs * SIDE * SIDE],
            nearest: Vec::new(),
        };
        let tracer = Tracer {
            position,
            axes: [right, up, axis],
            per_cell: edge / (0.5 * SIDE as f64 - MARGIN),
            start: radius.max(SOURCE_RADIUS),
        };
        let blocks = map.cells.par_chunks_mut(BLOCK_CELLS).enumerate();
        blocks.for_each(|(index, cells)| {
            let square = CellSquare::of_block(index);
            if tracer.is_within(square, edge) {
                for caster in casters {
                    tracer.trace(caster, square, tracer.start, cells);
                }
            }
        });
        map.cells.iter().any(|distance| distance.is_finite()).then(|| map.with_nearest())
    }

    /// The map with the least distances in and around each block.
    fn with_nearest(mut self) -> Self {
        self.nearest = vec![f32::INFINITY; self.cells.len() / BLOCK_CELLS];
        for block in 0..self.nearest.len() {
            let CellSquare { first: [x, y], is_behind, .. } = CellSquare::of_block(block);
            for row in y.saturating_sub(1)..(y + BLOCK + 1).min(SIDE) {
                for column in x.saturating_sub(1)..(x + BLOCK + 1).min(SIDE) {
                    self.nearest[block] = self.nearest[block].min(self.cells[cell_index(column, row, is_behind)]);
                }
            }
        }
        self
    }

    /// Angle that a cell subtends at the lamp in the middle of a disc, where it is largest, radians.
    pub(super) fn cell_angle(&self) -> f32 {
        2.0 / self.scale
    }

    /// Fraction of the light that reaches a point at `offset` from the lamp, m: of four cells around its direction, bilinearly weighted, those whose nearest solid
    /// is not between. The edge of a shadow is as soft as a cell is wide.
    #[inline(always)]
    pub(super) fn visibility(&self, offset: [f32; 3]) -> f32 {
        let square = offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2];
        let distance = square.sqrt();
        let [x, y, z] = self.axes.map(|axis| axis[0] * offset[0] + axis[1] * offset[1] + axis[2] * offset[2]);
        let is_behind = self.is_whole && z < 0.0;
        let along = distance + if is_behind { -z } else { z };
        if along <= 1e-6 * distance {
            return 1.0;
        }
        let per_length = self.scale / along;
        let limit = SIDE as f32 - 1.001;
        let [x, y] = [x, y].map(|across| (across * per_length + (0.5 * SIDE as f32 - 0.5)).clamp(0.0, limit));
        let [column, row] = [x as usize, y as usize];
        if distance <= self.nearest[block_index(column, row, is_behind)] {
            return 1.0;
        }
        let [right, down] = [x - column as f32, y - row as f32];
        let mut lit = [0.0; 4];
        for (index, lit) in lit.iter_mut().enumerate() {
            let cell = cell_index(column + index % 2, row + index / 2, is_behind);
            *lit = if distance <= self.cells[cell] { 1.0 } else { 0.0 };
        }
        let [upper, lower] = [lit[0] + (lit[1] - lit[0]) * right, lit[2] + (lit[3] - lit[2]) * right];
        upper + (lower - upper) * down
    }
}

/// Index of the block of a cell.
#[inline(always)]
fn block_index(column: usize, row: usize, is_behind: bool) -> usize {
    (usize::from(is_behind) * BLOCKS + row / BLOCK) * BLOCKS + column / BLOCK
}

/// Index of a cell.
#[inline(always)]
fn cell_index(column: usize, row: usize, is_behind: bool) -> usize {
    block_index(column, row, is_behind) * BLOCK_CELLS + row % BLOCK * BLOCK + column % BLOCK
}

impl CellSquare {
    fn of_block(index: usize) -> Self {
        let first = [index % BLOCKS * BLOCK, index / BLOCKS % BLOCKS * BLOCK];
        Self { first, side: BLOCK, is_behind: index / (BLOCKS * BLOCKS) == 1 }
    }

    /// Its four quarters.
    fn quarters(self) -> [Self; 4] {
        let side = self.side / 2;
        let [x, y] = self.first;
        [[x, y], [x + side, y], [x, y + side], [x + side, y + side]].map(|first| Self { first, side, ..self })
    }

    /// Index of its first cell within its block.
    fn index_in_block(&self) -> usize {
        self.first[1] % BLOCK * BLOCK + self.first[0] % BLOCK
    }
}

/// Traces rays from a lamp through the cells of a map.
struct Tracer {
    position: DVec3,
    axes: [DVec3; 3],
    /// Stereographic coordinate per cell.
    per_cell: f64,
    /// Distance from the lamp at which rays begin, m.
    start: f64,
}

impl Tracer {
    /// Stereographic coordinates of the middle of a square, and half the way between its outermost middles of cells.
    fn middle(&self, square: CellSquare) -> ([f64; 2], f64) {
        let half = 0.5 * (square.side - 1) as f64;
        let middle = square.first.map(|first| (first as f64 + half + 0.5 - 0.5 * SIDE as f64) * self.per_cell);
        (middle, half * self.per_cell)
    }

    /// The unit vector at stereographic coordinates.
    fn direction(&self, [x, y]: [f64; 2], is_behind: bool) -> DVec3 {
        let square = x * x + y * y;
        let forward = if is_behind { square - 1.0 } else { 1.0 - square };
        (self.axes[0] * (2.0 * x) + self.axes[1] * (2.0 * y) + self.axes[2] * forward) / (1.0 + square)
    }

    /// Whether a lookup may read a cell of a square, with the edge of the disc at this coordinate.
    fn is_within(&self, square: CellSquare, edge: f64) -> bool {
        let ([x, y], half) = self.middle(square);
        let reach = edge + MARGIN * self.per_cell + std::f64::consts::SQRT_2 * half;
        x * x + y * y <= reach * reach
    }

    /// Lowers the distances of a square of `cells`, which are those of its block, to those at which rays meet a solid. Up to `from` (m) all rays of the square are
    /// free.
    fn trace(&self, caster: &Occluder, square: CellSquare, from: f64, cells: &mut [f32]) {
        let (middle, half) = self.middle(square);
        let direction = self.direction(middle, square.is_behind);
        // A point of any ray of the square is at most so far from the middle ray at the same distance from the lamp, times that distance.
        let mut spread = 0.0_f64;
        if square.side > 1 {
            for [right, up] in [[-half, -half], [half, -half], [-half, half], [half, half]] {
                let corner = self.direction([middle[0] + right, middle[1] + up], square.is_behind);
                spread = spread.max((corner - direction).length());
            }
        }
        let (mut travel, mut end) = (from, FAR);
        if let Some((center, radius)) = caster.bounding_sphere() {
            let offset = center - self.position;
            let (along, distance) = (offset.dot(direction), offset.length());
            let nearest = along.max(0.0);
            let reach = radius + spread * (distance + radius);
            if (offset - direction * nearest).length_squared() > reach * reach {
                return;
            }
            end = distance + radius;
            travel = travel.max(distance - radius);
        }
        for _ in 0..MAX_STEPS {
            if travel > end {
                return;
            }
            let spread_here = spread * travel;
            let free = caster.signed_distance(self.position + direction * travel) - spread_here;
            if free < CLOSE.max(SHORT_STEP * spread_here) {
                break;
            }
            travel += free;
        }
        if travel > end {
            return;
        }
        if square.side > 1 {
            square.quarters().into_iter().for_each(|quarter| self.trace(caster, quarter, travel, cells));
        } else {
            let cell = &mut cells[square.index_in_block()];
            *cell = cell.min(travel as f32);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use bansho_base::{
        geometry::{distance_field::DistanceField, mesh::Mesh, transform::Transform},
        math::{
            DQuat,
            random::{Key, Purpose},
        },
    };

    use super::*;

    const LAMP: DVec3 = DVec3::new(1.0, 2.0, -3.0);

    fn directions() -> impl Iterator<Item = DVec3> {
        (0..20_000).map(|index| {
            let [x, y, z, _] = Key::new(5, "shadow map").uniforms(index, 0, Purpose::named("direction"));
            (DVec3::new(x.into(), y.into(), z.into()) - 0.5).normalize_or(DVec3::X)
        })
    }

    fn emitters() -> [Emitter; 3] {
        let spot = |cos_outer: f64| Emitter::Spot {
            position: LAMP,
            axis: DVec3::new(0.5, 0.4, -1.0).normalize(),
            cos_inner: 0.99,
            cos_outer,
        };
        [Emitter::Point { position: LAMP, radius: 0.05 }, spot(0.8), spot(-0.3)]
    }

    /// Whether the cone of a spot contains a direction.
    fn shines(emitter: &Emitter, direction: DVec3) -> bool {
        match *emitter {
            Emitter::Spot { axis, cos_outer, .. } => direction.dot(axis) > cos_outer,
            _ => true,
        }
    }

    /// The unit cube.
    fn cube() -> Mesh {
        let corners = (0..8).map(|i| [(i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32]).collect();
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        Mesh::new(corners, triangles).unwrap()
    }

    #[test]
    fn a_ball_hides_the_cone_behind_it() {
        let toward = DVec3::new(0.5, 0.3, -1.0).normalize();
        let ball = [Occluder::Sphere { center: LAMP + toward * 4.0, radius: 0.8 }];
        for emitter in emitters() {
            let map = ShadowMap::new(&emitter, &ball).unwrap();
            let (mut dark, mut light) = (0, 0);
            for direction in directions().filter(|direction| shines(&emitter, *direction)) {
                // A ball is seen under the angle whose sine is radius over distance.
                let angle = math::acos(direction.dot(toward));
                let from_edge = angle - math::asin(0.2);
                if from_edge.abs() < 1.5 * f64::from(map.cell_angle()) {
                    continue;
                }
                let seen = |distance: f64| map.visibility((direction * distance).as_vec3().to_array());
                let behind = if from_edge < 0.0 { 0.0 } else { 1.0 };
                assert_eq!((seen(3.1), seen(4.8), seen(50.0)), (1.0, behind, behind), "{emitter:?} {direction}");
                dark += usize::from(behind == 0.0);
                light += usize::from(behind == 1.0);
            }
            assert!(dark > 100 && light > 100, "{dark} {light}");
        }
    }

    #[test]
    fn cells_hold_what_each_ray_meets() {
        let placement = Transform::new([2.0, 1.5, -6.0], [20.0, 30.0, 0.0], 2.0);
        let casters = [
            Occluder::Mesh { distance: Arc::new(DistanceField::new(&cube())), placement },
            Occluder::Cylinder {
                center: LAMP + DVec3::new(-1.0, 0.0, -2.0),
                radius: 0.07,
                half_height: 3.0,
                rotation: DQuat::IDENTITY,
            },
            Occluder::Cuboid {
                center: LAMP + DVec3::new(0.0, 0.2, 0.0),
                half_extents: DVec3::new(0.3, 0.05, 0.3),
                rotation: DQuat::IDENTITY,
            },
        ];
        for emitter in emitters() {
            let map = ShadowMap::new(&emitter, &casters).unwrap();
            let (mut met, mut differ) = (0, 0);
            for direction in directions().filter(|direction| shines(&emitter, *direction)).take(1500) {
                // Brute force: one ray in many small steps.
                const STEP: f64 = 8e-3;
                let mut travel = SOURCE_RADIUS;
                let is_free = |travel: f64| {
                    casters.iter().all(|caster| caster.signed_distance(LAMP + direction * travel) > CLOSE)
                };
                while travel < 9.0 && is_free(travel) {
                    travel += STEP;
                }
                let seen = |distance: f64| map.visibility((direction * distance).as_vec3().to_array());
                let (before, after) = (seen(travel - 0.05), seen(travel + 0.05));
                met += usize::from(travel < 9.0);
                differ += usize::from(travel < 9.0 && (before < 1.0 || after > 0.0) || travel >= 9.0 && before < 1.0);
            }
            // Only near edges, and where a cell sees a surface at a grazing angle.
            assert!(met > 30 && differ * 12 < met, "{emitter:?}: {differ} of {met}");
        }
    }

    #[test]
    fn nothing_in_the_light_has_no_map() {
        let toward = DVec3::new(0.5, 0.4, -1.0).normalize();
        let behind = [Occluder::Sphere { center: LAMP - toward * 4.0, radius: 0.8 }];
        let [point, spot, _] = emitters();
        assert!(ShadowMap::new(&point, &behind).is_some() && ShadowMap::new(&spot, &behind).is_none());
        assert!(ShadowMap::new(&point, &[]).is_none());
        assert!(ShadowMap::new(&Emitter::Directional { toward }, &behind).is_none());
        // The housing of a lamp does not hide it.
        let housing = [Occluder::Sphere { center: LAMP, radius: 0.07 }];
        assert!(ShadowMap::new(&point, &housing).is_none());
    }
}
