//! Point lights that move and flicker, as glTF 2.0 with an embedded buffer: for game engines and Blender.
//!
//! Each light is a node with `KHR_lights_punctual`. The core animation of glTF moves the node; intensity and color are animated by `KHR_animation_pointer`,
//! which is used but not required: importers without it show the light with its mean color and intensity.

use base64::{Engine, engine::general_purpose::STANDARD};
use serde_json::{Value, json};

use crate::files::provenance;

/// `componentType` of 32-bit floats.
const FLOAT: u32 = 5126;

/// A point light over time.
#[derive(Clone, Debug, PartialEq)]
pub struct AnimatedLight {
    /// Name of its node.
    pub name: String,
    /// Its state at each time.
    pub keys: Vec<LightKey>,
}

/// The state of a light at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightKey {
    /// m, right-handed, y up.
    pub position: [f32; 3],
    /// Linear sRGB, 0 to 1.
    pub color: [f32; 3],
    /// Candela, the factor of the color.
    pub intensity: f32,
}

/// The bytes of a file (`.gltf`, JSON): `lights` with a key for each of `times` (s, ascending from 0 or more). Lights without keys, and keys
/// without a time, are left out. The same lights give the same bytes.
///
/// ```
/// use bansho_media::gltf::{AnimatedLight, LightKey, encode};
///
/// let key = |height: f32| LightKey { position: [0.0, height, 0.0], color: [1.0, 0.5, 0.1], intensity: 20.0 };
/// let file = encode(&[AnimatedLight { name: "torch".to_owned(), keys: vec![key(1.0), key(1.1)] }], &[0.0, 0.5]);
/// assert!(file.starts_with(b"{") && file.ends_with(b"}\n"));
/// ```
#[must_use]
pub fn encode(lights: &[AnimatedLight], times: &[f32]) -> Vec<u8> {
    let lights: Vec<(&str, &[LightKey])> = lights
        .iter()
        .map(|light| (light.name.as_str(), &light.keys[..light.keys.len().min(times.len())]))
        .filter(|(_, keys)| !keys.is_empty())
        .collect();
    let mut document = json!({ "asset": { "generator": provenance::PROGRAM, "version": "2.0" } });
    document["scene"] = json!(0);
    document["scenes"] = json!([{ "name": "lights" }]);
    // Arrays of glTF must not be empty.
    if !lights.is_empty() {
        add_lights(&mut document, &lights, times);
    }
    format!("{document:#}\n").into_bytes()
}

fn add_lights(document: &mut Value, lights: &[(&str, &[LightKey])], times: &[f32]) {
    let mut buffer = FloatBuffer::default();
    let (mut samplers, mut channels) = (Vec::new(), Vec::new());
    for (index, (_, keys)) in lights.iter().enumerate() {
        // The times of each light apart: a light may have fewer keys than there are times.
        let input = buffer.add_scalars(&times[..keys.len()]);
        let intensities: Vec<f32> = keys.iter().map(|key| key.intensity).collect();
        let outputs = [
            (buffer.add_vectors(keys.iter().map(|key| key.position)), json!({ "node": index, "path": "translation" })),
            (buffer.add_scalars(&intensities), pointer_target(index, "intensity")),
            (buffer.add_vectors(keys.iter().map(|key| key.color)), pointer_target(index, "color")),
        ];
        for (output, target) in outputs {
            channels.push(json!({ "sampler": samplers.len(), "target": target }));
            samplers.push(json!({ "input": input, "interpolation": "LINEAR", "output": output }));
        }
    }
    let mut nodes = Vec::with_capacity(lights.len());
    for (index, (name, keys)) in lights.iter().enumerate() {
        let light = json!({ "KHR_lights_punctual": { "light": index } });
        nodes.push(json!({ "name": name, "translation": keys[0].position, "extensions": light }));
    }
    document["extensionsUsed"] = json!(["KHR_lights_punctual", "KHR_animation_pointer"]);
    let still: Vec<Value> = lights.iter().map(|(name, keys)| still_light(name, keys)).collect();
    document["extensions"] = json!({ "KHR_lights_punctual": { "lights": still } });
    document["scenes"][0]["nodes"] = (0..nodes.len()).collect();
    document["nodes"] = nodes.into();
    document["animations"] = json!([{ "name": "lights", "samplers": samplers, "channels": channels }]);
    buffer.write(document);
}

/// The target of a channel that animates a property of a light.
fn pointer_target(light: usize, property: &str) -> Value {
    let pointer = format!("/extensions/KHR_lights_punctual/lights/{light}/{property}");
    json!({ "path": "pointer", "extensions": { "KHR_animation_pointer": { "pointer": pointer } } })
}

/// A light with its mean intensity and color, for importers that do not animate them.
fn still_light(name: &str, keys: &[LightKey]) -> Value {
    let count = keys.len() as f32;
    let intensity = keys.iter().map(|key| key.intensity).sum::<f32>() / count;
    let color = [0, 1, 2].map(|c| keys.iter().map(|key| key.color[c] / count).sum::<f32>().min(1.0));
    json!({ "name": name, "type": "point", "color": color, "intensity": intensity })
}

/// Floats of accessors, one after the other.
#[derive(Default)]
struct FloatBuffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl FloatBuffer {
    /// Adds an accessor of numbers, with their least and largest as the input of an animation needs; returns its index.
    fn add_scalars(&mut self, values: &[f32]) -> usize {
        let [min, max] = [f32::min, f32::max].map(|choose| values.iter().copied().reduce(choose));
        let accessor = json!({ "type": "SCALAR", "count": values.len(), "min": [min], "max": [max] });
        self.add(values.iter().copied(), accessor)
    }

    /// Adds an accessor of vectors; returns its index.
    fn add_vectors(&mut self, vectors: impl ExactSizeIterator<Item = [f32; 3]>) -> usize {
        let accessor = json!({ "type": "VEC3", "count": vectors.len() });
        self.add(vectors.flatten(), accessor)
    }

    fn add(&mut self, floats: impl Iterator<Item = f32>, mut accessor: Value) -> usize {
        let start = self.bytes.len();
        self.bytes.extend(floats.flat_map(f32::to_le_bytes));
        accessor["bufferView"] = json!(self.views.len());
        accessor["componentType"] = json!(FLOAT);
        self.views.push(json!({ "buffer": 0, "byteOffset": start, "byteLength": self.bytes.len() - start }));
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn write(self, document: &mut Value) {
        let uri = format!("data:application/octet-stream;base64,{}", STANDARD.encode(&self.bytes));
        document["accessors"] = self.accessors.into();
        document["bufferViews"] = self.views.into();
        document["buffers"] = json!([{ "byteLength": self.bytes.len(), "uri": uri }]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(height: f32, intensity: f32) -> LightKey {
        LightKey { position: [0.5, height, -1.0], color: [1.0, 0.25 * height, 0.125], intensity }
    }

    fn light(name: &str, keys: Vec<LightKey>) -> AnimatedLight {
        AnimatedLight { name: name.to_owned(), keys }
    }

    /// The floats of an accessor, checked against its buffer.
    fn floats(document: &Value, accessor: &Value) -> Vec<f32> {
        let number = |value: &Value| value.as_u64().unwrap() as usize;
        let accessor = &document["accessors"][number(accessor)];
        assert_eq!(accessor["componentType"], 5126);
        let components = if accessor["type"] == "VEC3" { 3 } else { 1 };
        let view = &document["bufferViews"][number(&accessor["bufferView"])];
        let buffer = &document["buffers"][number(&view["buffer"])];
        let uri = buffer["uri"].as_str().unwrap();
        let bytes = STANDARD.decode(uri.strip_prefix("data:application/octet-stream;base64,").unwrap()).unwrap();
        assert_eq!(bytes.len(), number(&buffer["byteLength"]));
        let (start, length) = (number(&view["byteOffset"]), number(&view["byteLength"]));
        assert!(
            start % 4 == 0 && length == number(&accessor["count"]) * components * 4 && start + length <= bytes.len()
        );
        bytes[start..start + length].as_chunks().0.iter().map(|four| f32::from_le_bytes(*four)).collect()
    }

    #[test]
    fn accessors_hold_what_the_channels_animate() {
        let lights = [
            light("torch", vec![key(1.0, 20.0), key(1.5, 30.0), key(1.0, 20.0)]),
            light("dark", Vec::new()),
            light("fire", vec![key(2.0, 5.0), key(2.5, 0.0), key(2.0, 5.0)]),
        ];
        let times = [0.0, 0.5, 1.0];
        let bytes = encode(&lights, &times);
        assert_eq!(bytes, encode(&lights, &times));
        let document: Value = serde_json::from_slice(&bytes).unwrap();
        assert_eq!(document["asset"]["version"], "2.0");
        assert_eq!(document["extensionsUsed"], json!(["KHR_lights_punctual", "KHR_animation_pointer"]));
        assert!(document.get("extensionsRequired").is_none());
        assert_eq!(document["scenes"][0]["nodes"], json!([0, 1]));
        let punctual = document["extensions"]["KHR_lights_punctual"]["lights"].as_array().unwrap();
        assert_eq!(punctual.len(), 2);
        assert_eq!((&punctual[0]["type"], &punctual[1]["name"]), (&json!("point"), &json!("fire")));
        assert!((punctual[0]["intensity"].as_f64().unwrap() - 70.0 / 3.0).abs() < 1e-4);
        for (node, expected) in [(0, &lights[0]), (1, &lights[2])] {
            let found = &document["nodes"][node];
            assert_eq!(found["extensions"]["KHR_lights_punctual"]["light"], node);
            assert_eq!(
                (found["name"].as_str().unwrap(), &found["translation"][1]),
                (&*expected.name, &json!(expected.keys[0].position[1]))
            );
        }
        let animation = &document["animations"][0];
        let channels = animation["channels"].as_array().unwrap();
        assert_eq!(channels.len(), 6);
        for (index, channel) in channels.iter().enumerate() {
            let keys = &lights[if index < 3 { 0 } else { 2 }].keys;
            let sampler = &animation["samplers"][channel["sampler"].as_u64().unwrap() as usize];
            assert_eq!(floats(&document, &sampler["input"]), times);
            let input = &document["accessors"][sampler["input"].as_u64().unwrap() as usize];
            assert_eq!((&input["min"], &input["max"]), (&json!([0.0]), &json!([1.0])));
            let property = channel["target"]["extensions"]["KHR_animation_pointer"]["pointer"].as_str();
            let lamp = format!("/extensions/KHR_lights_punctual/lights/{}/", index / 3);
            let expected: Vec<f32> = match property.map(|pointer| pointer.strip_prefix(&lamp).unwrap()) {
                None => {
                    assert_eq!(channel["target"], json!({ "node": index / 3, "path": "translation" }));
                    keys.iter().flat_map(|key| key.position).collect()
                }
                Some("intensity") => keys.iter().map(|key| key.intensity).collect(),
                Some("color") => keys.iter().flat_map(|key| key.color).collect(),
                Some(other) => panic!("{other}"),
            };
            assert_eq!(floats(&document, &sampler["output"]), expected);
            // What a pointer names is there.
            assert!(property.is_none_or(|pointer| document.pointer(pointer).is_some()), "{property:?}");
        }
    }

    #[test]
    fn without_lights_no_array_is_empty() {
        let document: Value = serde_json::from_slice(&encode(&[light("dark", Vec::new())], &[0.0])).unwrap();
        let names: Vec<&String> = document.as_object().unwrap().keys().collect();
        assert_eq!(names, ["asset", "scene", "scenes"]);
        assert!(document["scenes"][0].get("nodes").is_none());
    }
}
