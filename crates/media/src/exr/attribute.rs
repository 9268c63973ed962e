//! The attributes of an OpenEXR header, as bytes ("OpenEXR File Layout": name, type, size, value; little-endian).

use bansho_base::{
    camera::CameraHeader,
    color::white_balance::chromaticity,
    frame::{FrameHeader, Precision},
};

use super::{
    KEY_COLOR_SPACE, KEY_DIGEST, KEY_EXPOSURE, KEY_FINGERPRINT, KEY_FISHEYE_FOV, KEY_LENS, KEY_VERSION,
    plane::ChannelPlane,
};
use crate::{fingerprint, frame_rate};

/// CIE xy of the ACEScg (AP1) red, green and blue and of its white, D60 (SMPTE ST 2065-4, S-2014-004).
pub(crate) const AP1: [[f32; 2]; 4] = [[0.713, 0.293], [0.165, 0.830], [0.128, 0.044], [0.32168, 0.33767]];

/// The name of ACEScg by the Color Interop Forum, for readers that ignore chromaticities, such as Blender.
const COLOR_SPACE: &str = "lin_ap1_scene";

/// First bytes of every file.
pub(crate) const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];
/// Set in the version field where a name is longer than 31 bytes.
pub(crate) const FLAG_LONG_NAMES: u32 = 0x400;
/// ZIP compression of blocks of 16 lines.
const COMPRESSION_ZIP16: u8 = 3;

/// A rectangle as OpenEXR stores it: both ends are inclusive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Window {
    pub(crate) min: [i32; 2],
    pub(crate) max: [i32; 2],
}

impl Window {
    /// Width and height, pixels; 0 where an upper end is below the lower one.
    pub(crate) fn size(self) -> [u64; 2] {
        let side = |axis: usize| i64::from(self.max[axis]) - i64::from(self.min[axis]) + 1;
        [side(0).max(0) as u64, side(1).max(0) as u64]
    }
}

/// A header being written.
pub(crate) struct HeaderBytes(Vec<u8>);

/// A frame rate for the format, whose numerator is a signed integer.
fn rational(fps: [u32; 2]) -> [u32; 2] {
    const MAX: u32 = i32::MAX.cast_unsigned();
    if fps[0] <= MAX { fps } else { frame_rate::approximate(fps, MAX).unwrap_or(fps) }
}

/// A header in which the 64 digits of the digest are zeros.
pub(crate) struct Header {
    pub(crate) bytes: Vec<u8>,
    /// Offset of the digits of the digest.
    pub(crate) digest_at: usize,
}

/// The header of a frame. No attribute depends on time, host or path, and their order is fixed.
pub(crate) fn header(frame: &FrameHeader, planes: &[ChannelPlane<'_>], data: Window, display: Window) -> Header {
    let mut bytes = HeaderBytes::begin(planes.iter().any(|plane| plane.name.len() > 31));
    bytes.attribute("channels", "chlist", &channel_list(planes));
    bytes.attribute("compression", "compression", &[COMPRESSION_ZIP16]);
    bytes.window("dataWindow", data);
    bytes.window("displayWindow", display);
    bytes.attribute("lineOrder", "lineOrder", &[0]);
    bytes.floats("pixelAspectRatio", "float", &[1.0]);
    bytes.floats("screenWindowCenter", "v2f", &[0.0; 2]);
    bytes.floats("screenWindowWidth", "float", &[1.0]);
    bytes.floats("chromaticities", "chromaticities", AP1.as_flattened());
    bytes.attribute(KEY_COLOR_SPACE, "string", COLOR_SPACE.as_bytes());
    let white = frame.white_balance_k.map(|kelvin| chromaticity(f64::from(kelvin)).map(|value| value as f32));
    bytes.floats("adoptedNeutral", "v2f", &white.unwrap_or(AP1[3]));
    let rational = rational(frame.fps).map(u32::to_le_bytes);
    bytes.attribute("framesPerSecond", "rational", rational.as_flattened());
    let number = frame.number.clamp(i32::MIN.into(), i32::MAX.into()) as i32;
    bytes.attribute("imageCounter", "int", &number.to_le_bytes());
    bytes.floats("expTime", "float", &[frame.exposure_time_s]);
    bytes.floats(KEY_EXPOSURE, "float", &[frame.exposure_ev100]);
    bytes.floats("worldToCamera", "m44f", frame.camera.world_to_camera.as_flattened());
    lens(&frame.camera, &mut bytes);
    bytes.attribute("software", "string", format!("Bansho {}", fingerprint::VERSION).as_bytes());
    bytes.attribute(KEY_VERSION, "string", fingerprint::VERSION.as_bytes());
    bytes.attribute(KEY_FINGERPRINT, "string", fingerprint::to_hex(&frame.fingerprint).as_bytes());
    bytes.attribute(KEY_DIGEST, "string", &[b'0'; 64]);
    let HeaderBytes(mut bytes) = bytes;
    let digest_at = bytes.len() - 64;
    bytes.push(0);
    Header { bytes, digest_at }
}

/// The lens. A projection matrix and a field of view are written only for perspective cameras, since they cannot describe a dome or a panorama.
fn lens(camera: &CameraHeader, bytes: &mut HeaderBytes) {
    if let Some(matrix) = &camera.world_to_ndc {
        bytes.floats("worldToNDC", "m44f", matrix.as_flattened());
    }
    if let Some(angle) = camera.vertical_fov_deg {
        bytes.floats("verticalFovDeg", "float", &[angle]);
    }
    if let Some(lens) = camera.lens {
        bytes.attribute(KEY_LENS, "string", lens.name().as_bytes());
    }
    if let Some(angle) = camera.fisheye_fov_deg {
        bytes.floats(KEY_FISHEYE_FOV, "float", &[angle]);
    }
}

impl HeaderBytes {
    fn begin(long_names: bool) -> Self {
        let version = 2 | if long_names { FLAG_LONG_NAMES } else { 0 };
        Self([MAGIC, version.to_le_bytes()].concat())
    }

    fn attribute(&mut self, name: &str, kind: &str, value: &[u8]) {
        for text in [name, kind] {
            self.0.extend(text.as_bytes());
            self.0.push(0);
        }
        self.0.extend((value.len() as u32).to_le_bytes());
        self.0.extend(value);
    }

    fn floats(&mut self, name: &str, kind: &str, values: &[f32]) {
        let bytes: Vec<[u8; 4]> = values.iter().map(|value| value.to_le_bytes()).collect();
        self.attribute(name, kind, bytes.as_flattened());
    }

    fn window(&mut self, name: &str, window: Window) {
        let [x0, y0] = window.min;
        let [x1, y1] = window.max;
        self.attribute(name, "box2i", [x0, y0, x1, y1].map(i32::to_le_bytes).as_flattened());
    }
}

fn channel_list(planes: &[ChannelPlane<'_>]) -> Vec<u8> {
    let mut list = Vec::new();
    for plane in planes {
        list.extend(plane.name.as_bytes());
        list.push(0);
        let kind: u32 = match plane.precision {
            Precision::Half => 1,
            Precision::Single => 2,
        };
        list.extend(kind.to_le_bytes());
        list.extend([0; 4]); // not perceptually linear, and three reserved bytes
        list.extend([1_u32.to_le_bytes(); 2].as_flattened()); // a sample for every pixel
    }
    list.push(0);
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_beyond_a_signed_number_keep_their_value() {
        for fps in [[30, 1], [29_970, 1000], [i32::MAX.cast_unsigned(), 7]] {
            assert_eq!(rational(fps), fps);
        }
        for fps in [[u32::MAX, 4_294_968], [4_000_000_000, 3_999_999_999], [3_000_000_001, 100_000_000]] {
            let rate = |[frames, seconds]: [u32; 2]| f64::from(frames) / f64::from(seconds);
            let kept = rational(fps);
            assert!(i32::try_from(kept[0]).is_ok() && (rate(kept) / rate(fps) - 1.0).abs() < 1e-9, "{fps:?}: {kept:?}");
        }
    }
}
