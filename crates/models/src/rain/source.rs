//! The radiance of drops throughout the region.

use bansho_base::{math::DVec3, sky::Sky};

use super::{
    lens::DropLens,
    light::{Lighting, distance},
    tiles::{Tiles, mix},
};

/// Steps of distance as a share of the distance from the camera, and of that from the nearest lamp; the least, m.
const STEP: f64 = 0.2;
const STEP_AT_LAMP: f64 = 0.4;
const LEAST_STEP: f64 = 0.3;

/// Radiance of drops at the corners of tiles, at several distances from the camera.
#[derive(Clone, Debug)]
pub(crate) struct SourceField {
    tiles: Tiles,
    /// Ascending, m.
    distances: Vec<f32>,
    /// Corner after corner for each distance, ACEScg, cd/m^2.
    values: Vec<Vec<[f32; 3]>>,
}

/// What the sky shines through drops toward the camera from each corner of the tiles.
pub(crate) fn sky_through_drops(lens: &DropLens, tiles: &Tiles, sky: &Sky) -> Vec<[f32; 3]> {
    if *sky == Sky::DARK {
        return vec![[0.0; 3]; tiles.lines.len()];
    }
    tiles.map(|_, line| lens.gather(line, |direction| sky.radiance(direction)))
}

/// Distances from `near` to at least `far` from which light can be told between them: the closer to a lamp the denser.
fn distances(lighting: &Lighting, eye: DVec3, [near, far]: [f64; 2]) -> Vec<f64> {
    let lamps: Vec<f64> = lighting.lights.iter().map(|light| distance(light, eye)).collect();
    let mut distances = vec![near];
    let mut at = near;
    while at < far {
        let lamp = lamps.iter().map(|lamp| (lamp - at).abs()).fold(f64::INFINITY, f64::min);
        at += (STEP * at).min((STEP_AT_LAMP * lamp).max(LEAST_STEP));
        distances.push(at);
    }
    distances
}

impl SourceField {
    /// The field from `near` to `far` around `eye`, m; `sky` is what the sky shines through drops at each corner.
    pub(crate) fn new(lighting: &Lighting, tiles: &Tiles, sky: &[[f32; 3]], eye: DVec3, [near, far]: [f64; 2]) -> Self {
        let distances = distances(lighting, eye, [near.max(0.05), far]);
        let layer = |distance: &f64| {
            tiles.map(|index, line| {
                let lit = lighting.radiance(eye + line * *distance, line);
                std::array::from_fn(|c| lit[c] + sky[index][c])
            })
        };
        let values = distances.iter().map(layer).collect();
        Self { tiles: tiles.clone(), distances: distances.iter().map(|distance| *distance as f32).collect(), values }
    }

    /// Radiance at the height `y` of the picture, at each of the places `across` it (pixels), at a distance, m.
    pub(crate) fn along_row(&self, y: f32, distance: f32, across: impl Iterator<Item = f32>, out: &mut Vec<[f32; 3]>) {
        let last = self.distances.len() - 1;
        let far = self.distances.partition_point(|known| *known <= distance).clamp(1, last.max(1)).min(last);
        let near = far.saturating_sub(1);
        let gap = (self.distances[far] - self.distances[near]).max(f32::MIN_POSITIVE);
        let share = ((distance - self.distances[near]) / gap).clamp(0.0, 1.0);
        let (row, down) = self.tiles.row_at(y);
        let width = self.tiles.size[0];
        let at = |index: usize| {
            let layer = |layer: usize| mix(self.values[layer][index], self.values[layer][index + width], down);
            mix(layer(near), layer(far), share)
        };
        out.clear();
        for x in across {
            let (column, part) = self.tiles.column_at(x);
            let index = row * width + column;
            out.push(mix(at(index), at(index + 1), part));
        }
    }
}
