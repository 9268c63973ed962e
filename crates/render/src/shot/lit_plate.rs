//! The lights of a shot that light its plate.

use std::sync::Arc;

use bansho_base::{
    host::observer::{Cancelled, Observer, PartGuard, Stage, StagePart},
    phenomenon::{
        strip::Shutter,
        surroundings::{Light, Publication, lights_of_parts},
    },
};
use bansho_scene::PLATE_LAYER;

use super::{Shot, stepping};
use crate::composite::{plate::PlateFrame, plate_lighting::PlateLights};

impl Shot {
    /// The last plate in the light of all fires and lamps.
    pub(super) fn lit_plate(
        &mut self,
        shutter: Shutter,
        publications: &[Publication],
        observer: &dyn Observer,
    ) -> Result<Arc<PlateFrame>, Cancelled> {
        let part = StagePart { stage: Stage::Prepare, phenomenon: Some(PLATE_LAYER), is_mirrored: false };
        let _part = PartGuard::begin(observer, part);
        let lights = self.plate_lights(shutter, publications);
        self.plates.lit(&lights, observer)
    }

    /// The lights of all phenomena and of the scene, and the solids that cast shadows.
    fn plate_lights(&self, shutter: Shutter, publications: &[Publication]) -> PlateLights {
        let scene = stepping::scene_publication(&self.context, shutter);
        let parts = self.light_parts(shutter, publications);
        let mut lights = PlateLights { exposure: self.context.plan.exposure_scale(), ..PlateLights::default() };
        let tables = &self.context.plan.scene.tables;
        let mut during_parts = Vec::new();
        if scene.light_parts > 1 {
            during_parts.extend(parts.iter().map(|(part, _)| tables.lights(part.middle()).collect()));
        }
        let ends: [Vec<Light>; 2] = [shutter.open, shutter.close].map(|t| tables.lights(t).collect());
        for light in mean_lights(scene.lights, during_parts) {
            let stands = ends.iter().all(|lights| lights.iter().any(|at_end| at_end.emitter == light.emitter));
            if stands { lights.lamps.push(light) } else { lights.moving.push(light) }
        }
        for (index, publication) in publications.iter().enumerate() {
            lights.casters.extend_from_slice(&publication.shadow_casters);
            if !publication.sky_lights.is_empty() {
                lights.lamps.extend_from_slice(&publication.sky_lights);
                continue;
            }
            let mut during_parts = Vec::new();
            if publication.light_parts > 1 {
                during_parts.extend(parts.iter().map(|(_, during)| during[index].lights.clone()));
            }
            let published = mean_lights(publication.lights.clone(), during_parts);
            // The center of a simulated flame moves in all directions.
            let stands = publication.light_motion == 0.0 && self.runs[index].stepping.is_none();
            if stands { lights.flames.extend(published) } else { lights.moving.extend(published) }
        }
        lights
    }
}

/// Lights where they are in the `middle` of an exposure, with their mean intensities over its parts. One shadow for each is enough: those of several positions
/// along its path hardly differ on a plate.
fn mean_lights(middle: Vec<Light>, during_parts: Vec<Vec<Light>>) -> Vec<Light> {
    if during_parts.is_empty() {
        return middle;
    }
    if during_parts.iter().any(|lights| lights.len() != middle.len()) {
        // Some shine in a part of the exposure only.
        return lights_of_parts(&during_parts);
    }
    let mut lights = middle;
    for (index, light) in lights.iter_mut().enumerate() {
        let mut sum = [0.0; 3];
        for part in &during_parts {
            (0..3).for_each(|c| sum[c] += part[index].intensity[c]);
        }
        light.intensity = sum.map(|value| value / during_parts.len() as f32);
    }
    lights
}

#[cfg(test)]
mod tests {
    use bansho_base::{math::DVec3, phenomenon::surroundings::Emitter};

    use super::*;

    fn lamp(x: f64, intensity: f32) -> Light {
        Light { emitter: Emitter::Point { position: DVec3::X * x, radius: 0.1 }, intensity: [intensity; 3] }
    }

    #[test]
    fn lights_that_move_are_in_the_middle_with_their_mean_intensity() {
        let parts = vec![vec![lamp(0.0, 1.0)], vec![lamp(2.0, 5.0)]];
        assert_eq!(mean_lights(vec![lamp(1.0, 4.0)], parts), [lamp(1.0, 3.0)]);
        assert_eq!(mean_lights(vec![lamp(1.0, 4.0)], Vec::new()), [lamp(1.0, 4.0)]);
        let flash = vec![vec![lamp(0.0, 6.0)], Vec::new(), Vec::new()];
        assert_eq!(mean_lights(Vec::new(), flash), [lamp(0.0, 2.0)]);
    }
}
