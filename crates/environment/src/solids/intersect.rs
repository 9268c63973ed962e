//! Rays, and where they meet solids: simple ones around the origin, and triangle meshes in a bounding volume hierarchy.

use std::collections::BTreeMap;

use bansho_base::{geometry::mesh::Mesh, math, math::DVec3};

/// A ray; its direction need not be a unit vector, and distances are in its lengths.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray {
    /// m.
    pub(super) origin: DVec3,
    pub(super) direction: DVec3,
}

/// Where a ray meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hit {
    /// Distance, in lengths of the ray's direction.
    pub(super) t: f64,
    /// Outward unit normal.
    pub(super) normal: DVec3,
}

impl Ray {
    pub(super) fn at(&self, t: f64) -> DVec3 {
        self.origin + self.direction * t
    }
}

/// The interval of a ray within a convex solid, with the normals at both ends, to its first end within limits.
fn first_end([(enter, enter_normal), (leave, leave_normal)]: [(f64, DVec3); 2], [from, to]: [f64; 2]) -> Option<Hit> {
    if enter > leave {
        return None;
    }
    let hits = [Hit { t: enter, normal: enter_normal }, Hit { t: leave, normal: leave_normal }];
    hits.into_iter().find(|hit| hit.t > from && hit.t < to)
}

/// A sphere of `radius`.
pub(super) fn sphere(ray: &Ray, radius: f64, limits: [f64; 2]) -> Option<Hit> {
    let (a, b) = (ray.direction.length_squared(), ray.origin.dot(ray.direction));
    let discriminant = b * b - a * (ray.origin.length_squared() - radius * radius);
    if discriminant < 0.0 {
        return None;
    }
    let root = math::sqrt(discriminant);
    let ends = [(-b - root) / a, (-b + root) / a].map(|t| (t, ray.at(t) / radius));
    first_end(ends, limits)
}

/// The part of a vector across the axis of an upright cylinder.
fn horizontal(vector: DVec3) -> DVec3 {
    DVec3::new(vector.x, 0.0, vector.z)
}

/// A box with these half sides.
pub(super) fn cuboid(ray: &Ray, half: DVec3, limits: [f64; 2]) -> Option<Hit> {
    let mut ends = [(f64::NEG_INFINITY, DVec3::Y), (f64::INFINITY, DVec3::Y)];
    for axis in 0..3 {
        ends = within_slab(ray, DVec3::AXES[axis], half[axis], ends)?;
    }
    first_end(ends, limits)
}

/// An upright cylinder.
pub(super) fn cylinder(ray: &Ray, radius: f64, half_height: f64, limits: [f64; 2]) -> Option<Hit> {
    let (origin, direction) = (horizontal(ray.origin), horizontal(ray.direction));
    let (a, b, c) = (direction.length_squared(), origin.dot(direction), origin.length_squared() - radius * radius);
    let discriminant = b * b - a * c;
    let ends = if a < 1e-300 {
        // Along the axis.
        if c > 0.0 {
            return None;
        }
        [(f64::NEG_INFINITY, DVec3::Y), (f64::INFINITY, DVec3::Y)]
    } else if discriminant < 0.0 {
        return None;
    } else {
        let root = math::sqrt(discriminant);
        [(-b - root) / a, (-b + root) / a].map(|t| (t, horizontal(ray.at(t)) / radius))
    };
    first_end(within_slab(ray, DVec3::Y, half_height, ends)?, limits)
}

/// The interval of a ray between two planes at `-half` and `half` along `axis`, cut out of an interval.
fn within_slab(
    ray: &Ray,
    axis: DVec3,
    half: f64,
    [mut enter, mut leave]: [(f64, DVec3); 2],
) -> Option<[(f64, DVec3); 2]> {
    let (start, speed) = (ray.origin.dot(axis), ray.direction.dot(axis));
    if speed == 0.0 {
        return (start.abs() <= half).then_some([enter, leave]);
    }
    let toward = axis * speed.signum();
    let [near, far] = [(-half * speed.signum() - start) / speed, (half * speed.signum() - start) / speed];
    if near > enter.0 {
        enter = (near, -toward);
    }
    if far < leave.0 {
        leave = (far, toward);
    }
    Some([enter, leave])
}

/// Triangles in a leaf.
const LEAF_SIZE: usize = 4;
/// Cosine of the angle between triangles from which on their common edge is a crease.
const CREASE_COS: f64 = 0.8;
/// Depth of the hierarchy: its triangles are halved at each level.
const MAX_DEPTH: usize = 48;

/// A triangle with a normal at each corner.
#[derive(Clone, Copy, Debug)]
struct Triangle {
    corner: DVec3,
    edges: [DVec3; 2],
    normals: [DVec3; 3],
}

/// A node: a leaf with `count` triangles from `first`, or with a count of 0 an inner node, whose children are the next node and node `first`.
#[derive(Clone, Copy, Debug)]
struct Node {
    low: DVec3,
    high: DVec3,
    first: usize,
    count: usize,
    /// Axis along which the children are apart, the next node before the other one.
    axis: usize,
}

/// The hierarchy of a mesh.
#[derive(Clone, Debug)]
pub(super) struct TriangleBvh {
    triangles: Vec<Triangle>,
    nodes: Vec<Node>,
}

impl Triangle {
    /// Where a ray meets it between two distances (Moller & Trumbore 1997).
    #[inline(always)]
    fn intersect(&self, ray: &Ray, [from, to]: [f64; 2]) -> Option<Hit> {
        let [u_edge, v_edge] = self.edges;
        let across = ray.direction.cross(v_edge);
        let determinant = u_edge.dot(across);
        // Only a ray within the plane of the triangle: a tolerance would open cracks where a surface is seen edge on.
        if determinant.abs() < 1e-300 {
            return None;
        }
        let offset = ray.origin - self.corner;
        let u = offset.dot(across) / determinant;
        let above = offset.cross(u_edge);
        let v = ray.direction.dot(above) / determinant;
        let t = v_edge.dot(above) / determinant;
        let is_hit = u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > from && t < to;
        let [a, b, c] = self.normals;
        is_hit.then(|| Hit { t, normal: (a * (1.0 - u - v) + b * u + c * v).normalize_or(DVec3::Y) })
    }

    fn middle(&self) -> DVec3 {
        self.corner + (self.edges[0] + self.edges[1]) / 3.0
    }

    fn bounds(&self) -> [DVec3; 2] {
        let corners = [self.corner, self.corner + self.edges[0], self.corner + self.edges[1]];
        [
            corners.into_iter().fold(DVec3::INFINITY, DVec3::min),
            corners.into_iter().fold(DVec3::NEG_INFINITY, DVec3::max),
        ]
    }
}

/// The triangles of a mesh. A corner's normal is the mean of the triangles around it, by area, that make no crease with its own.
fn triangles(mesh: &Mesh) -> Vec<Triangle> {
    let corners: Vec<[DVec3; 3]> = mesh.triangles().collect();
    let area_normals: Vec<DVec3> = corners.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a)).collect();
    // The triangles around each corner.
    let mut around: BTreeMap<[u64; 3], Vec<usize>> = BTreeMap::new();
    for (index, corners) in corners.iter().enumerate() {
        corners.iter().for_each(|corner| around.entry(position_bits(*corner)).or_default().push(index));
    }
    let mut triangles = Vec::with_capacity(corners.len());
    for (corners, area_normal) in corners.iter().zip(&area_normals) {
        let own_normal = area_normal.normalize_or(DVec3::Y);
        let normals = corners.map(|corner| {
            let others = around.get(&position_bits(corner)).into_iter().flatten().map(|other| area_normals[*other]);
            let smooth = others.filter(|other| other.normalize_or(DVec3::ZERO).dot(own_normal) > CREASE_COS);
            smooth.sum::<DVec3>().normalize_or(own_normal)
        });
        let [a, b, c] = *corners;
        triangles.push(Triangle { corner: a, edges: [b - a, c - a], normals });
    }
    triangles
}

/// The bits of a position, by which equal corners are found.
fn position_bits(position: DVec3) -> [u64; 3] {
    position.to_array().map(f64::to_bits)
}

/// The box around boxes, each its minimum and maximum corner.
fn bounding_box(boxes: impl Iterator<Item = [DVec3; 2]>) -> [DVec3; 2] {
    boxes.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |all, one| [all[0].min(one[0]), all[1].max(one[1])])
}

impl TriangleBvh {
    pub(super) fn new(mesh: &Mesh) -> Self {
        let mut bvh = Self { triangles: triangles(mesh), nodes: Vec::new() };
        bvh.split(0, bvh.triangles.len());
        bvh
    }

    /// Adds the node of the triangles from `first` to `end`, and those below it.
    fn split(&mut self, first: usize, end: usize) {
        let inside = &mut self.triangles[first..end];
        let [low, high] = bounding_box(inside.iter().map(Triangle::bounds));
        let node = self.nodes.len();
        self.nodes.push(Node { low, high, first, count: end - first, axis: 0 });
        if end - first <= LEAF_SIZE {
            return;
        }
        // Along the axis on which the middles are farthest apart.
        let [low, high] = bounding_box(inside.iter().map(|triangle| [triangle.middle(); 2]));
        let axis = (0..3).fold(0, |best, axis| if (high - low)[axis] > (high - low)[best] { axis } else { best });
        let half = (end - first) / 2;
        // Split at the median, not by surface area: the depth is then the logarithm of the number of triangles, and the stack of a ray has a fixed
        // size.
        inside.select_nth_unstable_by(half, |a, b| a.middle()[axis].total_cmp(&b.middle()[axis]));
        self.split(first, first + half);
        (self.nodes[node].count, self.nodes[node].axis) = (0, axis);
        // Depth first: the first child is the next node, so that only the place of the second is stored.
        self.nodes[node].first = self.nodes.len();
        self.split(first + half, end);
    }

    /// Minimum and maximum corner of its bounding box.
    pub(super) fn bounds(&self) -> [DVec3; 2] {
        self.nodes.first().map_or([DVec3::ZERO; 2], |node| [node.low, node.high])
    }

    /// Where a ray first meets the mesh between two distances.
    pub(super) fn intersect(&self, ray: &Ray, [from, mut to]: [f64; 2]) -> Option<Hit> {
        // No component of the direction is 0, so that slabs give no NaN.
        let direction = DVec3::select(ray.direction.cmpeq(DVec3::ZERO), DVec3::splat(1e-200), ray.direction);
        let inverse = direction.recip();
        let mut nearest = None;
        let mut stack = [0; MAX_DEPTH];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let index = stack[height];
            let node = &self.nodes[index];
            if !node.meets(ray, inverse, [from, to]) {
                continue;
            }
            if node.count == 0 {
                // The nearer child is visited first.
                let ahead = direction[node.axis] > 0.0;
                stack[height] = if ahead { node.first } else { index + 1 };
                stack[height + 1] = if ahead { index + 1 } else { node.first };
                height += 2;
                continue;
            }
            for triangle in &self.triangles[node.first..node.first + node.count] {
                if let Some(hit) = triangle.intersect(ray, [from, to]) {
                    // The interval shrinks with each hit, so that boxes behind it are skipped.
                    (to, nearest) = (hit.t, Some(hit));
                }
            }
        }
        nearest
    }
}

impl Node {
    /// Whether a ray meets its box between two distances.
    #[inline(always)]
    fn meets(&self, ray: &Ray, inverse: DVec3, [from, to]: [f64; 2]) -> bool {
        let (a, b) = ((self.low - ray.origin) * inverse, (self.high - ray.origin) * inverse);
        let (enter, leave) = (a.min(b), a.max(b));
        // All slabs at once, without a branch: a ray misses the box if it leaves one slab before it has entered all.
        from.max(enter.x).max(enter.y).max(enter.z) <= to.min(leave.x).min(leave.y).min(leave.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [f64; 2] = [0.0, f64::INFINITY];

    #[test]
    fn hits_worked_by_hand() {
        let ahead = |x: f64, y: f64| Ray { origin: DVec3::new(x, y, 5.0), direction: DVec3::new(0.0, 0.0, -2.0) };
        let hit = sphere(&ahead(0.6, 0.0), 1.0, ALL).unwrap();
        assert!((hit.t - 2.1).abs() < 1e-12 && (hit.normal - DVec3::new(0.6, 0.0, 0.8)).length() < 1e-12);
        assert_eq!(sphere(&ahead(1.1, 0.0), 1.0, ALL), None);
        let half = DVec3::new(1.0, 2.0, 3.0);
        assert_eq!(cuboid(&ahead(0.9, 1.9), half, ALL), Some(Hit { t: 1.0, normal: DVec3::Z }));
        assert_eq!(cuboid(&ahead(0.9, 2.1), half, ALL), None);
        // From inside the far side is met.
        assert_eq!(cuboid(&ahead(0.0, 0.0), half, [1.5, 9.0]), Some(Hit { t: 4.0, normal: -DVec3::Z }));
        let hit = cylinder(&ahead(0.6, 1.0), 1.0, 2.0, ALL).unwrap();
        assert!((hit.t - 2.1).abs() < 1e-12 && (hit.normal - DVec3::new(0.6, 0.0, 0.8)).length() < 1e-12);
        assert_eq!(cylinder(&ahead(0.6, 2.1), 1.0, 2.0, ALL), None);
        let down = |x: f64| Ray { origin: DVec3::new(x, 7.0, 0.0), direction: -DVec3::Y };
        assert_eq!(cylinder(&down(0.5), 1.0, 2.0, ALL), Some(Hit { t: 5.0, normal: DVec3::Y }));
        assert_eq!(cylinder(&down(1.5), 1.0, 2.0, ALL), None);
    }

    /// A bumpy closed surface: a sphere of `steps` rings whose radius varies.
    fn bumpy(steps: usize) -> Mesh {
        let vertex = |i: usize, j: usize| {
            let (polar, around) = (
                std::f64::consts::PI * i as f64 / steps as f64,
                std::f64::consts::TAU * (j % (2 * steps)) as f64 / (2 * steps) as f64,
            );
            let radius = 1.0 + 0.2 * bansho_base::math::sin(3.0 * polar) * bansho_base::math::sin(4.0 * around);
            let (sin, cos) = bansho_base::math::sin_cos(polar);
            [radius * sin * bansho_base::math::cos(around), radius * cos, radius * sin * bansho_base::math::sin(around)]
                .map(|value| value as f32)
        };
        let (mut vertices, mut indices) = (Vec::new(), Vec::new());
        for i in 0..steps {
            for j in 0..2 * steps {
                let first = vertices.len() as u32;
                vertices.extend([vertex(i, j), vertex(i, j + 1), vertex(i + 1, j + 1), vertex(i + 1, j)]);
                indices.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
            }
        }
        Mesh::new(vertices, indices).unwrap()
    }

    #[test]
    fn the_hierarchy_finds_what_a_search_of_all_triangles_finds() {
        let bvh = TriangleBvh::new(&bumpy(24));
        let mut hits = 0;
        for i in 0..2000 {
            let spread = |factor: f64| 3.0 * ((f64::from(i) * factor).fract() - 0.5);
            let origin = DVec3::new(spread(0.754_877_666), spread(0.569_840_29), 3.0);
            let ray = Ray { origin, direction: DVec3::new(0.1 * spread(0.618), 0.1 * spread(0.414), -1.0) };
            let limits = [0.0, f64::INFINITY];
            let all = bvh.triangles.iter().filter_map(|triangle| triangle.intersect(&ray, limits));
            let expected = all.map(|hit| hit.t).min_by(f64::total_cmp);
            let found = bvh.intersect(&ray, limits);
            assert_eq!(found.map(|hit| hit.t), expected);
            if let Some(hit) = found {
                let outward = origin + ray.direction * hit.t;
                assert!((hit.normal.length() - 1.0).abs() < 1e-12 && hit.normal.dot(outward) > 0.0);
                hits += 1;
            }
        }
        assert!(hits > 500, "{hits}");
    }
}
