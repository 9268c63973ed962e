//! OpenEXR: scene-linear frames with layers, AOVs, camera and exposure.

pub(crate) mod decode;
mod encode;
pub(crate) mod header;

pub use encode::{encode, encode_data, encode_observed};

/// Header attribute (string): the name of the color space ("Color Space Encodings", Color Interop Forum, 2024).
pub const KEY_COLOR_SPACE: &str = "colorInteropID";
/// Header attribute (string): fingerprint in hexadecimal digits.
pub const KEY_FINGERPRINT: &str = "bansho:fingerprint";
/// Header attribute (string): Bansho's version.
pub const KEY_VERSION: &str = "bansho:version";
/// Header attribute (string): BLAKE3 of the whole file, taken while its 64 digits were zeros.
pub const KEY_DIGEST: &str = "bansho:digest";
/// Header attribute (string): `perspective`, `fisheye` or `panorama`.
pub const KEY_LENS: &str = "bansho:lens";
/// Header attribute (m44d): `worldToCamera` in double precision.
pub const KEY_WORLD_TO_CAMERA: &str = "bansho:worldToCamera";
/// Header attribute (m44d): `worldToNDC` in double precision.
pub const KEY_WORLD_TO_NDC: &str = "bansho:worldToNDC";
/// Header attribute (float): whole angle of a fisheye's circle, degrees.
pub const KEY_FISHEYE_FOV: &str = "bansho:fisheyeFovDeg";
/// Header attribute (float): exposure value at ISO 100 that the pixels are scaled by.
pub const KEY_EXPOSURE: &str = "exposure_ev100";
