//! The mesh of a sky: a sphere seen from inside, whose texture is a panorama.

use std::f32::consts::{PI, TAU};

use bevy::{
    asset::RenderAssetUsages,
    math::ops,
    mesh::{Indices, PrimitiveTopology},
    prelude::*,
};

/// Cells from west over north to east.
const COLUMNS: u32 = 128;
/// Cells from the zenith down.
const ROWS: u32 = 64;

/// Direction that a panorama shows at a position in it, from 0 to 1 from the left and from the top. Its middle is at -z.
fn direction(across: f32, down: f32) -> Vec3 {
    let (longitude, latitude) = (TAU * (across - 0.5), PI * (0.5 - down));
    let ((sin, cos), (up, level)) = (ops::sin_cos(longitude), ops::sin_cos(latitude));
    Vec3::new(sin * level, up, -cos * level)
}

/// A sphere of radius 1 around the origin, whose triangles face inward.
pub(crate) fn sphere() -> Mesh {
    let corners = (0..=ROWS).flat_map(|row| (0..=COLUMNS).map(move |column| (column, row)));
    let uvs: Vec<[f32; 2]> =
        corners.map(|(column, row)| [column as f32 / COLUMNS as f32, row as f32 / ROWS as f32]).collect();
    let positions: Vec<Vec3> = uvs.iter().map(|[across, down]| direction(*across, *down)).collect();
    let normals: Vec<Vec3> = positions.iter().map(|position| -position).collect();
    let cells = (0..ROWS).flat_map(|row| (0..COLUMNS).map(move |column| row * (COLUMNS + 1) + column));
    let below = COLUMNS + 1;
    let indices = cells.flat_map(|i| [i, i + below, i + 1, i + 1, i + below, i + below + 1]).collect();
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::RENDER_WORLD)
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
        .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, normals)
        .with_inserted_attribute(Mesh::ATTRIBUTE_UV_0, uvs)
        .with_inserted_indices(Indices::U32(indices))
}

#[cfg(test)]
mod tests {
    use bansho::base::math::DVec2;

    use super::*;
    use crate::view::View;

    #[test]
    fn directions_are_those_of_the_panorama_of_an_effect() {
        let size = [200, 100];
        let camera = View::sky().camera.applied_to(&bansho::CameraParameters::default()).at(0.0, size);
        for [across, down] in [[0.5, 0.5], [0.5, 0.1], [0.75, 0.5], [0.1, 0.8], [0.99, 0.3]] {
            let expected = camera.direction(DVec2::new(200.0 * f64::from(across), 100.0 * f64::from(down))).unwrap();
            let found = direction(across, down).as_dvec3().to_array();
            assert!((0..3).all(|c| (found[c] - expected[c]).abs() < 1e-5), "{found:?} {expected}");
        }
    }
}
