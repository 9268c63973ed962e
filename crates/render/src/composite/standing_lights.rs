//! Flickering fires as lights that stand still, so that frames can share what depends on the positions of lights.
//!
//! A flame that burns in one place publishes point lights that rise and sink as it flickers. Here each of them is divided between two of the heights of a
//! fixed grid, so that only intensities change. Flames of one fire share a column of such lights.

use std::collections::BTreeMap;

use bansho_base::{
    math::DVec3,
    phenomenon::surroundings::{Emitter, Light},
};

/// Least distance of the lights of a column in radii of the light that it stands for. A light of a flame has a radius of 0.15 widths of the flame.
const SPACING_PER_RADIUS: f64 = 1.8;
/// Spacings are powers of two in this range, m, so that they hardly depend on the radius.
const SPACINGS: [f64; 2] = [1.0 / 64.0, 4.0];
/// Largest distance of lights that stand still from the origin, m: beyond it they are kept as they are.
const MAX_DISTANCE: f64 = 1e6;

/// A vertical line of lights for one fire.
struct Column {
    x: f64,
    z: f64,
    /// Distance of its lights, m.
    spacing: f64,
    /// Radius of its lights, m.
    radius: f64,
    /// The intensities at the heights `(index + 0.5) * spacing`.
    intensities: BTreeMap<i64, [f32; 3]>,
}

impl Column {
    /// A column for a light at `position`.
    fn new(position: DVec3, radius: f64) -> Self {
        let mut spacing = SPACINGS[0];
        while spacing < SPACING_PER_RADIUS * radius && spacing < SPACINGS[1] {
            spacing *= 2.0;
        }
        // Spheres that touch each other, so that a surface beside the flame shows no spots.
        let radius = radius.max(0.5 * spacing);
        Self { x: position.x, z: position.z, spacing, radius, intensities: BTreeMap::new() }
    }

    fn is_near(&self, position: DVec3) -> bool {
        let (x, z) = (position.x - self.x, position.z - self.z);
        x * x + z * z <= self.spacing * self.spacing
    }

    /// Divides a light between the two nearest heights, which keeps its sum and its center.
    fn add(&mut self, height: f64, intensity: [f32; 3]) {
        let place = height / self.spacing - 0.5;
        let upper = place - place.floor();
        for (index, weight) in [(place.floor(), 1.0 - upper), (place.floor() + 1.0, upper)] {
            if weight > 0.0 {
                let sum = self.intensities.entry(index as i64).or_default();
                (0..3).for_each(|c| sum[c] += weight as f32 * intensity[c]);
            }
        }
    }

    fn lights(&self) -> impl Iterator<Item = Light> {
        self.intensities.iter().map(|(index, intensity)| {
            let position = DVec3::new(self.x, (*index as f64 + 0.5) * self.spacing, self.z);
            Light { emitter: Emitter::Point { position, radius: self.radius }, intensity: *intensity }
        })
    }
}

/// Lights that stand still in place of those of flames that burn in one place. They depend on this frame alone, and their positions on no flicker.
pub(super) fn standing_lights(flames: &[Light]) -> Vec<Light> {
    let mut points = Vec::new();
    let mut lights = Vec::new();
    for light in flames {
        match light.emitter {
            Emitter::Point { position, radius } if position.abs().max_element() < MAX_DISTANCE => {
                points.push((position, radius, light.intensity));
            }
            _ => lights.push(*light),
        }
    }
    // The largest flame of a fire determines the column of all.
    points.sort_by(|(_, a, _), (_, b, _)| b.total_cmp(a));
    let mut columns: Vec<Column> = Vec::new();
    for (position, radius, intensity) in points {
        let index = columns.iter().position(|column| column.is_near(position)).unwrap_or(columns.len());
        if index == columns.len() {
            columns.push(Column::new(position, radius));
        }
        columns[index].add(position.y, intensity);
    }
    lights.extend(columns.iter().flat_map(Column::lights));
    lights
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flame(position: [f64; 3], radius: f64, intensity: f32) -> Light {
        Light { emitter: Emitter::Point { position: position.into(), radius }, intensity: [intensity; 3] }
    }

    #[test]
    fn a_column_has_the_light_and_the_center_of_its_flames() {
        let flames = [flame([1.0, 0.41, 2.0], 0.1, 30.0), flame([1.1, 0.93, 2.1], 0.05, 10.0)];
        let lights = standing_lights(&flames);
        let sum: f32 = lights.iter().map(|light| light.intensity[1]).sum();
        let heights = lights.iter().map(|light| {
            let position = light.emitter.position().unwrap();
            assert_eq!([position.x, position.z], [1.0, 2.0]);
            f64::from(light.intensity[1]) * position.y
        });
        assert!((sum - 40.0).abs() < 1e-4);
        assert!((heights.sum::<f64>() / 40.0 - (0.75 * 0.41 + 0.25 * 0.93)).abs() < 1e-6);
    }

    #[test]
    fn flicker_changes_no_position() {
        let places = |height: f64| -> Vec<Emitter> {
            standing_lights(&[flame([1.0, height, 2.0], 0.1, 30.0)]).iter().map(|light| light.emitter).collect()
        };
        // A radius of 0.1 m has a spacing of 0.25 m.
        assert_eq!(places(0.40), places(0.60));
        assert_eq!(places(0.40).len(), 2);
        assert_ne!(places(0.40), places(0.65));
    }

    #[test]
    fn fires_apart_have_columns_of_their_own_and_other_lights_stay() {
        let sun = Light { emitter: Emitter::Directional { toward: DVec3::Y }, intensity: [1.0; 3] };
        let lights = standing_lights(&[sun, flame([0.0; 3], 0.1, 1.0), flame([0.3, 0.0, 0.0], 0.1, 1.0)]);
        assert_eq!((lights.len(), lights[0]), (5, sun));
    }
}
