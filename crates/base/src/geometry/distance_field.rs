//! Signed distance field of a mesh on a regular grid, negative inside.
//!
//! Near the surface distances are exact. From there the nearest triangle is propagated between grid points by fast sweeping
//! (Zhao 2005, as in Bridson's SDFGen). A point is inside if the rays along at least two of the three axes cross the surface
//! an odd number of times; by this majority a small hole does not invert inside and outside.

use glam::{DVec3, UVec3, Vec3};

use super::mesh::Mesh;
use crate::math;

/// Cells along the longest side of the bounding box of the mesh.
const CELLS_ALONG_LONGEST_SIDE: f64 = 64.0;
/// Cells around the bounding box on every side.
const MARGIN_CELLS: f64 = 3.0;
/// Cells across the thickness of a thin mesh, so that some grid points are inside it,
const MIN_CELLS_ACROSS: f64 = 2.5;
/// and the approximate limit on the total number of cells for that.
const MAX_CELLS: f64 = 7e5;

/// Signed distance to a mesh, m.
#[derive(Clone, Debug, PartialEq)]
pub struct DistanceField {
    origin: DVec3,
    spacing: f64,
    size: [usize; 3],
    /// Distance at each grid point, x fastest.
    distance: Vec<f32>,
}

impl DistanceField {
    /// Computes the distances to `mesh`.
    pub fn new(mesh: &Mesh) -> Self {
        let [min, max] = mesh.bounds();
        let spacing = grid_spacing(mesh, (max - min).max_element());
        let size = ((max - min) / spacing + 2.0 * MARGIN_CELLS).ceil().as_uvec3() + UVec3::ONE;
        let origin = min - MARGIN_CELLS * spacing;
        let mut builder = GridBuilder::new(mesh, origin, spacing, size.to_array().map(|side| side as usize));
        builder.sweep();
        let inside = builder.classify_inside();
        let distances = builder.distance.iter().map(|cells| cells * spacing as f32);
        let distance = distances.zip(inside).map(|(meters, inside)| if inside { -meters } else { meters }).collect();
        Self { origin, spacing, size: builder.size, distance }
    }

    /// Signed distance at `point`, m, trilinear between grid points. Outside the grid: the distance at the nearest point of the grid plus the distance
    /// from there.
    pub fn at(&self, point: DVec3) -> f64 {
        let last = DVec3::from(self.size.map(|side| (side - 1) as f64));
        let grid_position = (point - self.origin) / self.spacing;
        let clamped = grid_position.clamp(DVec3::ZERO, last);
        let cell = clamped.floor().min(last - 1.0);
        let f = clamped - cell;
        let [x, y, z] = cell.to_array().map(|c| c as usize);
        // First along x, then y, then z.
        let [front, back] = [z, z + 1].map(|z| {
            let [low, high] = [y, y + 1].map(|y| {
                let [left, right] = [x, x + 1].map(|x| f64::from(self.distance[self.index([x, y, z])]));
                left * (1.0 - f.x) + right * f.x
            });
            low * (1.0 - f.y) + high * f.y
        });
        front * (1.0 - f.z) + back * f.z + (grid_position - clamped).length() * self.spacing
    }

    /// Minimum and maximum corner of the grid, which contains the mesh.
    pub fn bounds(&self) -> [DVec3; 2] {
        let last = DVec3::from(self.size.map(|side| (side - 1) as f64));
        [self.origin, self.origin + last * self.spacing]
    }

    /// Unit vector away from the mesh at `point`: the normalized gradient of the distance, by central differences.
    pub fn normal(&self, point: DVec3) -> DVec3 {
        let step = 0.5 * self.spacing;
        let differences =
            [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| self.at(point + axis * step) - self.at(point - axis * step));
        DVec3::from(differences).normalize_or(DVec3::Y)
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.size[1] + y) * self.size[0] + x
    }
}

/// Distance between grid points for a mesh whose bounding box has the longest side `longest`: fine enough for the thickness of the mesh, as far as
/// [`MAX_CELLS`] allows.
fn grid_spacing(mesh: &Mesh, longest: f64) -> f64 {
    let [min, max] = mesh.bounds();
    let (middle, mut volume, mut area) = (0.5 * (min + max), 0.0, 0.0);
    for [a, b, c] in mesh.triangles().map(|corners| corners.map(|corner| corner - middle)) {
        volume += a.dot(b.cross(c)) / 6.0;
        area += 0.5 * (b - a).cross(c - a).length();
    }
    // Twice the volume over the area is the thickness of a plate, and less than the thickness of any more compact body.
    let thickness = 2.0 * volume.abs() / area.max(f64::MIN_POSITIVE);
    let finest = math::cbrt((max - min + thickness).element_product() / MAX_CELLS);
    // A sheet without thickness has no inside, so a finer grid would not help.
    let across = if thickness > finest { (thickness / MIN_CELLS_ACROSS).max(finest) } else { f64::INFINITY };
    across.min(longest / CELLS_ALONG_LONGEST_SIDE).max(1e-9)
}

/// The grid under construction; lengths in cells.
struct GridBuilder {
    size: [usize; 3],
    triangles: Vec<[Vec3; 3]>,
    distance: Vec<f32>,
    nearest: Vec<u32>,
}

const NONE: u32 = u32::MAX;

impl GridBuilder {
    fn new(mesh: &Mesh, origin: DVec3, spacing: f64, size: [usize; 3]) -> Self {
        let count = size.iter().product();
        // In cells, so that one unit of distance is one cell.
        let triangles =
            mesh.triangles().map(|corners| corners.map(|corner| ((corner - origin) / spacing).as_vec3())).collect();
        let mut builder = Self { size, triangles, distance: vec![f32::INFINITY; count], nearest: vec![NONE; count] };
        (0..builder.triangles.len()).for_each(|triangle| builder.compute_exact_distances(triangle));
        builder
    }

    /// Computes exact distances at the grid points within one cell of the bounding box of a triangle.
    fn compute_exact_distances(&mut self, triangle: usize) {
        let [a, b, c] = self.triangles[triangle];
        let low = (a.min(b).min(c).floor() - 1.0).max(Vec3::ZERO).as_uvec3();
        let high = (a.max(b).max(c).ceil() + 1.0).max(Vec3::ZERO).as_uvec3();
        let size = self.size;
        let [end_x, end_y, end_z] = [0, 1, 2].map(|axis| (high[axis] as usize + 1).min(size[axis]));
        for z in low.z as usize..end_z {
            for y in low.y as usize..end_y {
                for x in low.x as usize..end_x {
                    self.update_distance([x, y, z], triangle as u32);
                }
            }
        }
    }

    /// Compares a triangle with the nearest one so far of a grid point; whether it is nearer.
    fn update_distance(&mut self, grid_point: [usize; 3], triangle: u32) -> bool {
        let index = (grid_point[2] * self.size[1] + grid_point[1]) * self.size[0] + grid_point[0];
        let position = Vec3::from(grid_point.map(|coordinate| coordinate as f32));
        let distance = distance_to_triangle(position, self.triangles[triangle as usize]);
        let is_nearer = distance < self.distance[index];
        if is_nearer {
            self.distance[index] = distance;
            self.nearest[index] = triangle;
        }
        is_nearer
    }

    /// Propagates nearest triangles in sweeps along all eight diagonals, twice, unless one round of them changes nothing.
    fn sweep(&mut self) {
        for _ in 0..2 {
            let mut changed = false;
            for diagonal in 0..8 {
                changed |= self.sweep_along(diagonal);
            }
            if !changed {
                return;
            }
        }
    }

    /// A sweep along a diagonal; whether it changes anything.
    fn sweep_along(&mut self, diagonal: usize) -> bool {
        let [width, height, depth] = self.size;
        // Each bit says whether the sweep goes backward along an axis.
        let is_backward = [0, 1, 2].map(|bit| diagonal >> bit & 1 == 1);
        let mut changed = false;
        for k in 0..depth {
            for j in 0..height {
                for i in 0..width {
                    let x = if is_backward[0] { width - 1 - i } else { i };
                    let y = if is_backward[1] { height - 1 - j } else { j };
                    let z = if is_backward[2] { depth - 1 - k } else { k };
                    changed |= self.propagate_from_neighbors([x, y, z], is_backward);
                }
            }
        }
        changed
    }

    /// Tries the nearest triangles of the three neighbors of `point` that this sweep has already visited; whether one is nearer.
    fn propagate_from_neighbors(&mut self, point: [usize; 3], is_backward: [bool; 3]) -> bool {
        let strides = [1, self.size[0], self.size[0] * self.size[1]];
        let index = (0..3).map(|axis| point[axis] * strides[axis]).sum::<usize>();
        let mut changed = false;
        for axis in 0..3 {
            let is_first = if is_backward[axis] { point[axis] + 1 == self.size[axis] } else { point[axis] == 0 };
            if is_first {
                continue;
            }
            let neighbor = if is_backward[axis] { index + strides[axis] } else { index - strides[axis] };
            let triangle = self.nearest[neighbor];
            // Most neighbors share their nearest triangle.
            if triangle != NONE && triangle != self.nearest[index] {
                changed |= self.update_distance(point, triangle);
            }
        }
        changed
    }

    /// Whether each grid point is inside, by majority vote of the rays along the three axes.
    fn classify_inside(&self) -> Vec<bool> {
        let mut votes = vec![0_u8; self.distance.len()];
        for axis in 0..3 {
            self.add_inside_votes(axis, &mut votes);
        }
        votes.into_iter().map(|votes| votes >= 2).collect()
    }

    /// Adds a vote to every grid point at which the ray along `axis` has crossed the surface an odd number of times.
    fn add_inside_votes(&self, axis: usize, votes: &mut [u8]) {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let strides = [1, self.size[0], self.size[0] * self.size[1]];
        let mut crossings = vec![Vec::new(); self.size[u] * self.size[v]];
        for corners in &self.triangles {
            find_crossings(corners, [axis, u, v], [self.size[u], self.size[v]], &mut crossings);
        }
        for (line, crossings) in crossings.iter_mut().enumerate() {
            crossings.sort_unstable_by(f32::total_cmp);
            let start = line % self.size[u] * strides[u] + line / self.size[u] * strides[v];
            let mut passed = 0;
            for i in 0..self.size[axis] {
                while crossings.get(passed).is_some_and(|at| *at < i as f32) {
                    passed += 1;
                }
                votes[start + i * strides[axis]] += u8::from(passed % 2 == 1);
            }
        }
    }
}

/// Records where the grid lines along the first of the axes cross a triangle.
fn find_crossings(corners: &[Vec3; 3], [axis, u, v]: [usize; 3], size: [usize; 2], crossings: &mut [Vec<f32>]) {
    // The lines are shifted slightly, so that they do not pass through vertices and edges of meshes with round coordinates.
    let shift = [1.371e-4, 2.137e-4];
    let projected = corners.map(|corner| [corner[u] - shift[0], corner[v] - shift[1]]);
    let area = twice_area(projected[0], projected[1], projected[2]);
    let [columns, rows] = [0, 1].map(|k| grid_lines_within(projected.map(|corner| corner[k]), size[k]));
    for j in rows {
        for i in columns.clone() {
            let point = [i as f32, j as f32];
            // Barycentric coordinates.
            let weights = [(1, 2), (2, 0), (0, 1)].map(|(a, b)| twice_area(projected[a], projected[b], point) / area);
            if area != 0.0 && weights.iter().all(|weight| *weight >= 0.0) {
                let at: f64 = (0..3).map(|k| weights[k] * f64::from(corners[k][axis])).sum();
                crossings[j * size[0] + i].push(at as f32);
            }
        }
    }
}

/// Twice the area of a triangle; positive where its corners go counterclockwise.
fn twice_area([ax, ay]: [f32; 2], [bx, by]: [f32; 2], [px, py]: [f32; 2]) -> f64 {
    f64::from(bx - ax) * f64::from(py - ay) - f64::from(by - ay) * f64::from(px - ax)
}

/// The numbers of the lines of a grid, of which there are `count`, between the least and the greatest of `corners`.
fn grid_lines_within(corners: [f32; 3], count: usize) -> std::ops::Range<usize> {
    let low = corners.into_iter().fold(f32::INFINITY, f32::min).ceil().max(0.0) as usize;
    let high = corners.into_iter().fold(f32::NEG_INFINITY, f32::max).floor();
    if high < 0.0 { low..low } else { low..(high as usize + 1).min(count) }
}

/// Distance from a point to a triangle (Ericson, "Real-time collision detection", 5.1.5).
fn distance_to_triangle(p: Vec3, [a, b, c]: [Vec3; 3]) -> f32 {
    let (ab, ac, bc) = (b - a, c - a, c - b);
    let normal = ab.cross(ac);
    // The edges in turn, each with the corner where it begins.
    let is_outside = [(ab, a), (bc, b), (-ac, c)].iter().any(|(edge, corner)| edge.cross(p - corner).dot(normal) < 0.0);
    if is_outside {
        distance_to_edge(p, a, ab).min(distance_to_edge(p, b, bc)).min(distance_to_edge(p, a, ac))
    } else {
        ((p - a).dot(normal) / normal.length().max(1e-30)).abs()
    }
}

/// Distance from a point to the straight line from `corner` to `corner + edge`.
fn distance_to_edge(p: Vec3, corner: Vec3, edge: Vec3) -> f32 {
    let along = ((p - corner).dot(edge) / edge.length_squared().max(1e-30)).clamp(0.0, 1.0);
    (p - corner - edge * along).length()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::mesh;

    #[test]
    fn a_cube_is_negative_inside_and_exact_before_its_faces() {
        let field = DistanceField::new(&mesh::cube());
        assert!((field.at(DVec3::splat(0.5)) + 0.5).abs() < 0.01);
        assert!((field.at(DVec3::new(0.5, 1.03, 0.4)) - 0.03).abs() < 1e-4);
        assert!((field.at(DVec3::new(0.9, 0.5, 0.5)) + 0.1).abs() < 1e-4);
        assert!((field.at(DVec3::new(4.0, 0.5, 0.5)) - 3.0).abs() < 0.01, "beyond the grid");
        assert!((field.normal(DVec3::new(0.3, 1.02, 0.6)) - DVec3::Y).length() < 1e-3);
    }

    #[test]
    fn a_thin_plate_that_leans_has_an_inside() {
        let turned = glam::DQuat::from_rotation_z(0.6);
        let plate = |corner: DVec3| (turned * (corner * DVec3::new(1.0, 0.02, 1.0))).as_vec3().to_array();
        let corners: Vec<[f32; 3]> = mesh::cube().triangles().flatten().map(plate).collect();
        let triangles = (0..12).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let field = DistanceField::new(&Mesh::new(corners, triangles).unwrap());
        for step in 1..40 {
            let along = 0.025 * f64::from(step);
            let middle = turned * DVec3::new(along, 0.01, 0.98 * along);
            assert!(field.at(middle) < -1e-3, "{} m at {middle}", field.at(middle));
        }
    }

    #[test]
    fn a_small_hole_does_not_turn_it_inside_out() {
        let cube = mesh::cube();
        let corners: Vec<[f32; 3]> = cube.triangles().flatten().map(|c| c.as_vec3().to_array()).collect();
        let triangles = (1..12).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let field = DistanceField::new(&Mesh::new(corners, triangles).unwrap());
        assert!(field.at(DVec3::new(0.3, 0.4, 0.7)) < -0.2);
        assert!(field.at(DVec3::new(1.1, 0.4, 0.7)) > 0.0 && field.at(DVec3::new(0.4, -0.04, 1.04)) > 0.0);
    }

    #[test]
    fn distance_to_a_triangle_is_to_its_face_edge_or_corner() {
        let triangle = [Vec3::ZERO, Vec3::X, Vec3::Y];
        assert_eq!(distance_to_triangle(Vec3::new(0.2, 0.2, 3.0), triangle), 3.0);
        assert_eq!(distance_to_triangle(Vec3::new(0.5, -2.0, 0.0), triangle), 2.0);
        assert_eq!(distance_to_triangle(Vec3::new(-3.0, -4.0, 0.0), triangle), 5.0);
    }
}
