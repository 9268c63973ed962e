//! Surfaces made of triangles.

use glam::DVec3;

/// Most triangles of a mesh.
pub const MOST_TRIANGLES: usize = 4_000_000;

/// Most corners of a mesh: as many as that many triangles have which share none.
pub const MOST_CORNERS: usize = 3 * MOST_TRIANGLES;

/// A surface of triangles, right-handed, y up, m.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    corners: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
}

/// Why corners and triangles make no mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MeshError {
    /// No triangle has an area.
    #[error("it has no triangles with an area")]
    NoTriangles,
    /// More than are read.
    #[error("it has {found} triangles; at most {MOST_TRIANGLES} are read")]
    TooManyTriangles {
        /// How many it has.
        found: usize,
    },
    /// More than are read.
    #[error("it has {found} corners; at most {MOST_CORNERS} are read")]
    TooManyCorners {
        /// How many it has.
        found: usize,
    },
    /// A triangle names a corner that is not there.
    #[error("triangle {} names corner {}, and there are {corners}", triangle + 1, u64::from(*corner) + 1)]
    NoSuchCorner {
        /// Which triangle, from 0.
        triangle: usize,
        /// Which corner it names, from 0.
        corner: u32,
        /// How many there are.
        corners: usize,
    },
    /// A coordinate that is not finite or beyond 1e6 m.
    #[error("corner {} lies beyond 1e6 m or nowhere", corner + 1)]
    FarCorner {
        /// Which corner, from 0.
        corner: usize,
    },
}

impl Mesh {
    /// The mesh of `triangles` between `corners`; triangles without an area are left out.
    ///
    /// # Errors
    /// No triangle with an area, too many, corners that are not there or not finite.
    pub fn new(corners: Vec<[f32; 3]>, mut triangles: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        if triangles.len() > MOST_TRIANGLES {
            return Err(MeshError::TooManyTriangles { found: triangles.len() });
        }
        if corners.len() > MOST_CORNERS {
            return Err(MeshError::TooManyCorners { found: corners.len() });
        }
        let near = |corner: &[f32; 3]| corner.iter().all(|value| value.abs() <= 1e6);
        if let Some(corner) = corners.iter().position(|corner| !near(corner)) {
            return Err(MeshError::FarCorner { corner });
        }
        for (triangle, named) in triangles.iter().enumerate() {
            if let Some(&corner) = named.iter().find(|&&corner| corner as usize >= corners.len()) {
                return Err(MeshError::NoSuchCorner { triangle, corner, corners: corners.len() });
            }
        }
        triangles.retain(|named| normal(named.map(|corner| point(corners[corner as usize]))).length() > 0.0);
        if triangles.is_empty() { Err(MeshError::NoTriangles) } else { Ok(Self { corners, triangles }) }
    }

    /// How many triangles it has; at least one.
    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    /// Bytes that it takes in memory.
    pub fn memory_bytes(&self) -> u64 {
        (size_of_val(&self.corners[..]) + size_of_val(&self.triangles[..])) as u64
    }

    /// Never: a mesh has a triangle.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// The corners of every triangle, counterclockwise as seen from outside.
    pub fn triangles(&self) -> impl Iterator<Item = [DVec3; 3]> + '_ {
        self.triangles.iter().map(|named| named.map(|corner| point(self.corners[corner as usize])))
    }

    /// Least and greatest corner of the box around it.
    pub fn bounds(&self) -> [DVec3; 2] {
        let empty = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        self.triangles().flatten().fold(empty, |[min, max], corner| [min.min(corner), max.max(corner)])
    }

    /// Its points by chance, each part as likely as its area.
    pub fn sampler(&self) -> SurfaceSampler {
        let mut area = 0.0;
        let triangles = self.triangles().map(|corners| {
            area += 0.5 * normal(corners).length();
            (area, corners)
        });
        SurfaceSampler { triangles: triangles.collect() }
    }
}

fn point(corner: [f32; 3]) -> DVec3 {
    DVec3::from(corner.map(f64::from))
}

/// Normal of a triangle, twice its area long.
fn normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// Points on a mesh, each part of it as likely as its area.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceSampler {
    /// Triangles with the area up to their end, m^2.
    triangles: Vec<(f64, [DVec3; 3])>,
}

impl SurfaceSampler {
    /// The whole area, m^2.
    pub fn area(&self) -> f64 {
        self.triangles.last().map_or(0.0, |(area, _)| *area)
    }

    /// The point and unit normal that belong to three numbers in [0, 1).
    pub fn at(&self, [which, u, v]: [f64; 3]) -> (DVec3, DVec3) {
        let wanted = which * self.area();
        let index = self.triangles.partition_point(|(area, _)| *area <= wanted).min(self.triangles.len() - 1);
        let corners = self.triangles[index].1;
        // Folding the unit square over its diagonal keeps points even over the triangle.
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        let [a, b, c] = corners;
        (a + (b - a) * u + (c - a) * v, normal(corners).normalize_or(DVec3::Y))
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
            let (point, normal) = sampler.at([(f + 0.5) / 6000.0, (f * 0.618_034).fract(), (f * 0.414_214).fract()]);
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
            Err(MeshError::NoSuchCorner { triangle: 0, corner: 9, corners: 3 })
        );
        assert_eq!(Mesh::new(vec![[f32::NAN; 3]], vec![]), Err(MeshError::FarCorner { corner: 0 }));
    }
}
