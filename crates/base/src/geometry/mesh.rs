//! Triangle meshes.

use glam::DVec3;

/// Maximum number of triangles of a mesh.
pub const MAX_TRIANGLES: usize = 4_000_000;

/// Maximum number of vertices of a mesh: as many as [`MAX_TRIANGLES`] triangles have without shared vertices.
pub const MAX_VERTICES: usize = 3 * MAX_TRIANGLES;

/// A triangle mesh: right-handed, y up, in meters.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    vertices: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
}

/// Why vertices and triangles do not form a valid mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MeshError {
    /// No triangle has an area.
    #[error("it has no triangles with nonzero area")]
    NoTriangles,
    /// Too many triangles.
    #[error("it has {found} triangles; at most {MAX_TRIANGLES} are read")]
    TooManyTriangles {
        /// How many it has.
        found: usize,
    },
    /// Too many vertices.
    #[error("it has {found} vertices; at most {MAX_VERTICES} are read")]
    TooManyVertices {
        /// How many it has.
        found: usize,
    },
    /// A triangle refers to a vertex that does not exist.
    #[error("triangle {} refers to vertex {}, but the mesh has only {vertex_count}", triangle + 1, u64::from(*vertex) + 1)]
    VertexIndexOutOfRange {
        /// Index of the triangle, from 0.
        triangle: usize,
        /// The vertex index, from 0.
        vertex: u32,
        /// Number of vertices.
        vertex_count: usize,
    },
    /// A coordinate is not finite or beyond 1e6 m.
    #[error("vertex {} is infinite, NaN or more than 1e6 m from the origin", vertex + 1)]
    VertexOutOfBounds {
        /// Index of the vertex, from 0.
        vertex: usize,
    },
}

impl Mesh {
    /// The mesh of `triangles`, which are indices into `vertices`. Triangles without an area are omitted.
    ///
    /// # Errors
    /// No triangle with an area, too many triangles or vertices, or vertices that do not exist or are not finite.
    pub fn new(vertices: Vec<[f32; 3]>, mut triangles: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        if triangles.len() > MAX_TRIANGLES {
            return Err(MeshError::TooManyTriangles { found: triangles.len() });
        }
        if vertices.len() > MAX_VERTICES {
            return Err(MeshError::TooManyVertices { found: vertices.len() });
        }
        // Written so that NaN is out of bounds, too.
        if let Some(vertex) = vertices.iter().position(|vertex| !vertex.iter().all(|value| value.abs() <= 1e6)) {
            return Err(MeshError::VertexOutOfBounds { vertex });
        }
        for (triangle, indices) in triangles.iter().enumerate() {
            if let Some(&vertex) = indices.iter().find(|&&vertex| vertex as usize >= vertices.len()) {
                return Err(MeshError::VertexIndexOutOfRange { triangle, vertex, vertex_count: vertices.len() });
            }
        }
        triangles
            .retain(|indices| area_normal(indices.map(|vertex| to_dvec3(vertices[vertex as usize]))).length() > 0.0);
        if triangles.is_empty() { Err(MeshError::NoTriangles) } else { Ok(Self { vertices, triangles }) }
    }

    /// Number of triangles; at least one.
    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    /// Size in memory, bytes.
    pub fn memory_bytes(&self) -> u64 {
        (size_of_val(&self.vertices[..]) + size_of_val(&self.triangles[..])) as u64
    }

    /// Always false: a mesh has at least one triangle.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// The vertices of every triangle, counterclockwise as seen from outside.
    pub fn triangles(&self) -> impl Iterator<Item = [DVec3; 3]> + '_ {
        self.triangles.iter().map(|indices| indices.map(|vertex| to_dvec3(self.vertices[vertex as usize])))
    }

    /// Minimum and maximum corner of the bounding box.
    pub fn bounds(&self) -> [DVec3; 2] {
        let empty = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        self.triangles().flatten().fold(empty, |[min, max], vertex| [min.min(vertex), max.max(vertex)])
    }

    /// A sampler of points on the surface, uniform by area.
    pub fn sampler(&self) -> SurfaceSampler {
        let mut area = 0.0;
        let triangles = self.triangles().map(|vertices| {
            area += 0.5 * area_normal(vertices).length();
            (area, vertices)
        });
        SurfaceSampler { triangles: triangles.collect() }
    }
}

fn to_dvec3(vertex: [f32; 3]) -> DVec3 {
    DVec3::from(vertex.map(f64::from))
}

/// Normal of a triangle; its length is twice the area.
fn area_normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// Samples points on a mesh, uniformly by area.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceSampler {
    /// Triangles with the cumulative area including each, m^2.
    triangles: Vec<(f64, [DVec3; 3])>,
}

/// A point on a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceSample {
    /// Position, m.
    pub position: DVec3,
    /// Outward unit normal.
    pub normal: DVec3,
}

impl SurfaceSampler {
    /// Total area, m^2.
    pub fn area(&self) -> f64 {
        self.triangles.last().map_or(0.0, |(area, _)| *area)
    }

    /// The sample for three uniform numbers in [0, 1).
    pub fn sample(&self, [triangle, u, v]: [f64; 3]) -> SurfaceSample {
        let target_area = triangle * self.area();
        let index = self.triangles.partition_point(|(area, _)| *area <= target_area).min(self.triangles.len() - 1);
        let vertices = self.triangles[index].1;
        // Folding the unit square over its diagonal keeps the distribution uniform over the triangle.
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        let [a, b, c] = vertices;
        SurfaceSample { position: a + (b - a) * u + (c - a) * v, normal: area_normal(vertices).normalize_or(DVec3::Y) }
    }
}

#[cfg(test)]
pub(crate) fn cube() -> Mesh {
    let corners = (0..8).map(|i| [(i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32]).collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Mesh::new(corners, triangles).unwrap()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_lie_on_the_surface_evenly() {
        let sampler = cube().sampler();
        assert!((sampler.area() - 6.0).abs() < 1e-12);
        let mut on_top = 0;
        for i in 0..6000 {
            let f = f64::from(i);
            let SurfaceSample { position: point, normal } =
                sampler.sample([(f + 0.5) / 6000.0, (f * 0.618_034).fract(), (f * 0.414_214).fract()]);
            let outside = (point - DVec3::splat(0.5)).abs().max_element();
            assert!((outside - 0.5).abs() < 1e-6);
            assert!(normal.dot(point - DVec3::splat(0.5)) > 0.0, "normals point out");
            on_top += usize::from(normal.y > 0.5);
        }
        assert_eq!(on_top, 1000);
    }

    #[test]
    fn what_makes_no_mesh_is_refused() {
        let corners = vec![[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
        assert_eq!(Mesh::new(corners.clone(), vec![[0, 1, 2]]), Err(MeshError::NoTriangles));
        assert_eq!(
            Mesh::new(corners, vec![[0, 1, 9]]),
            Err(MeshError::VertexIndexOutOfRange { triangle: 0, vertex: 9, vertex_count: 3 })
        );
        assert_eq!(Mesh::new(vec![[f32::NAN; 3]], vec![]), Err(MeshError::VertexOutOfBounds { vertex: 0 }));
    }
}
