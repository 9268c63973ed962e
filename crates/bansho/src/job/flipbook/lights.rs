//! The point lights of a flipbook: one for each phenomenon that shines, in each frame.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, PoisonError},
};

use bansho_base::{
    camera::Camera,
    frame::Frame,
    host::observer::Observer,
    image::Rect,
    math::DVec3,
    phenomenon::surroundings::{Emitter, Light, SrgbLight},
};
use bansho_media::gltf::{self, AnimatedLight, LightKey};
use bansho_render::{Plan, RenderError, Shot, Target};
use serde_json::{Value, json};

use crate::job::pipeline::FrameSource;

/// The light of one phenomenon in one frame: all points with which it lights others, as one.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FlameLight {
    /// Name of the phenomenon in the scene.
    pub(crate) phenomenon: String,
    /// Its center, m.
    pub(crate) position: DVec3,
    /// m.
    pub(crate) radius: f64,
    pub(crate) light: Light,
}

/// The lights of the phenomena of a shot that shine as points, at the frame that it was advanced to.
fn flame_lights(shot: &Shot) -> Vec<FlameLight> {
    let mut groups: Vec<(String, Vec<Light>)> = Vec::new();
    for each in shot.lights() {
        match groups.last_mut() {
            Some((name, lights)) if *name == each.phenomenon => lights.push(each.light),
            _ => groups.push((each.phenomenon, vec![each.light])),
        }
    }
    let mut flames = Vec::new();
    for (phenomenon, lights) in groups {
        let Some(light) = Light::merge_points(&lights) else { continue };
        if let Emitter::Point { position, radius } = light.emitter {
            flames.push(FlameLight { phenomenon, position, radius, light });
        }
    }
    flames
}

/// A shot whose lights are recorded as its frames are drawn.
pub(crate) struct LightRecorder {
    shot: Shot,
    /// Number of the frame that the shot was advanced to.
    number: i64,
    /// The lights of each frame that was drawn, by its number. Shots that draw at the same time share them.
    lights: Arc<Mutex<BTreeMap<i64, Vec<FlameLight>>>>,
}

impl LightRecorder {
    pub(crate) fn new(shot: Shot) -> Self {
        Self { shot, number: 0, lights: Arc::default() }
    }

    /// The lights of each frame that was drawn, in order.
    pub(crate) fn into_lights(self) -> Vec<Vec<FlameLight>> {
        std::mem::take(&mut *self.lights.lock().unwrap_or_else(PoisonError::into_inner)).into_values().collect()
    }
}

impl FrameSource for LightRecorder {
    fn advance(&mut self, number: i64, observer: &dyn Observer) -> Result<(), RenderError> {
        self.number = number;
        self.shot.advance(number, observer)
    }

    fn draw<T: Target>(&mut self, target: &T, observer: &dyn Observer) -> Result<T::Frame, RenderError> {
        let frame = self.shot.draw(target, observer)?;
        let lights = flame_lights(&self.shot);
        self.lights.lock().unwrap_or_else(PoisonError::into_inner).insert(self.number, lights);
        Ok(frame)
    }

    fn recycle(&mut self, recycled: Frame) {
        self.shot.recycle(recycled);
    }

    fn independent(&self) -> Option<Self> {
        let lights = self.lights.clone();
        self.shot.independent().map(|shot| Self { shot, number: self.number, lights })
    }

    fn snapshot(&self) -> Vec<u8> {
        self.shot.snapshot()
    }

    fn restore(&mut self, snapshot: &[u8]) -> Result<(), RenderError> {
        self.shot.restore(snapshot)
    }
}

/// How to read the lights of all frames.
pub(crate) fn meaning() -> Value {
    json!({
        "meaning": "one point light for each phenomenon that shines: color times intensity_cd, in all directions; absent in a frame in which it is dark",
        "position_m": "meters in the scene: x to the right, y up, z toward the viewer of the default camera (right-handed)",
        "tile_pixel": "where the tile shows that position, from its upper left corner to the right and down; null behind the camera",
        "color": "linear sRGB, the largest component is 1",
        "intensity_cd": "candela, the factor of the color",
        "luminous_intensity_cd": "candela, the luminance of color times intensity_cd",
        "radius_m": "size of the source: within this radius the illuminance is constant",
    })
}

/// The lights of frame `number`.
pub(crate) fn describe(plan: &Plan, number: i64, lights: &[FlameLight]) -> Value {
    let camera = plan.view(number).camera;
    lights.iter().map(|light| describe_light(light, &camera, plan.window())).collect()
}

fn describe_light(
    FlameLight { phenomenon, position, radius, light }: &FlameLight,
    camera: &Camera,
    crop: Rect,
) -> Value {
    let srgb = light.srgb();
    let tile_pixel = camera.project(*position).map(|seen| {
        let [x, y] = seen.pixel.to_array();
        [x - crop.x as f64, y - crop.y as f64].map(|value| rounded(value, 100.0))
    });
    json!({
        "phenomenon": phenomenon,
        "position_m": position.to_array().map(|value| rounded(value, 1e5)),
        "tile_pixel": tile_pixel,
        "color": srgb.color.map(|value| rounded(value.into(), 1e5)),
        "intensity_cd": significant(srgb.intensity.into()),
        "luminous_intensity_cd": light.luminous_intensity().map(|value| significant(value.into())),
        "radius_m": rounded(*radius, 1e5),
    })
}

/// The lights of all frames, `frame_s` (s) apart, as glTF: one for each phenomenon that shines in any of them. In a loop the first frame is also the last key.
pub(crate) fn encode_gltf(frames: &[Vec<FlameLight>], frame_s: f64, is_loop: bool) -> Vec<u8> {
    let mut names: Vec<&str> = Vec::new();
    for light in frames.iter().flatten() {
        if !names.contains(&light.phenomenon.as_str()) {
            names.push(&light.phenomenon);
        }
    }
    let frames: Vec<&Vec<FlameLight>> = frames.iter().chain(frames.first().filter(|_| is_loop)).collect();
    let times: Vec<f32> = (0..frames.len()).map(|index| (index as f64 * frame_s) as f32).collect();
    let lights = names.into_iter().map(|name| AnimatedLight { name: name.to_owned(), keys: light_keys(name, &frames) });
    gltf::encode(&lights.collect::<Vec<_>>(), &times)
}

/// The keys of the light of one phenomenon. Where it is dark, the light stays where it was last, and its color.
fn light_keys(name: &str, frames: &[&Vec<FlameLight>]) -> Vec<LightKey> {
    let mut lit_keys: Vec<Option<LightKey>> = Vec::with_capacity(frames.len());
    for frame in frames {
        let light = frame.iter().find(|light| light.phenomenon == name);
        lit_keys.push(light.map(|FlameLight { position, light, .. }| {
            let SrgbLight { color, intensity } = light.srgb();
            LightKey { position: position.as_vec3().to_array(), color, intensity }
        }));
    }
    // Until it first shines, it is dark where it will be then.
    let Some(mut last) = lit_keys.iter().copied().flatten().next() else { return Vec::new() };
    let mut keys = Vec::with_capacity(lit_keys.len());
    for lit_key in lit_keys {
        last = lit_key.unwrap_or(LightKey { intensity: 0.0, ..last });
        keys.push(last);
    }
    keys
}

/// Rounded to a multiple of 1 / `steps`, without a negative zero.
fn rounded(value: f64, steps: f64) -> f64 {
    (value * steps).round() / steps + 0.0
}

/// Rounded to six significant digits.
fn significant(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_light_that_goes_out_stays_dark_where_it_was() {
        let light = |height: f64, strength: f32| {
            let position = DVec3::new(0.0, height, 0.0);
            let light = Light { emitter: Emitter::Point { position, radius: 0.1 }, intensity: [strength; 3] };
            FlameLight { phenomenon: "fire".to_owned(), position, radius: 0.1, light }
        };
        let frames = [vec![], vec![light(1.0, 4.0)], vec![], vec![light(2.0, 8.0)]];
        let keys = light_keys("fire", &frames.iter().collect::<Vec<_>>());
        let found: Vec<(f32, f32)> = keys.iter().map(|key| (key.position[1], key.intensity.round())).collect();
        assert_eq!(found, [(1.0, 0.0), (1.0, 4.0), (1.0, 0.0), (2.0, 8.0)]);
        assert!(light_keys("other", &frames.iter().collect::<Vec<_>>()).is_empty());
    }

    #[test]
    fn numbers_have_six_digits() {
        assert_eq!([12_345.678, 0.001_234_567_8, 0.0].map(significant), [12_345.7, 0.001_234_57, 0.0]);
        assert_eq!(rounded(-1.234_567, 1e3), -1.235);
    }
}
