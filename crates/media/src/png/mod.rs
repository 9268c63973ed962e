//! PNG: display pixels with straight alpha, sRGB.

pub(crate) mod checksum;
pub(crate) mod chunk;
mod encode;

pub use encode::{PngEffort, SIDE_LIMIT, encode};
pub(crate) use encode::encode_frame;

/// Key of the text chunk that holds the fingerprint in hexadecimal digits.
pub const KEY_FINGERPRINT: &str = "bansho:fingerprint";
/// Key of the text chunk that holds Bansho's version.
pub const KEY_VERSION: &str = "bansho:version";
