//! PNG: display pixels with straight alpha, sRGB.

pub(crate) mod checksum;
pub(crate) mod chunk;
mod encode;

pub(crate) use encode::encode_frame;
pub use encode::{PngEffort, SIDE_LIMIT, encode};

/// Key of the text chunk that holds the fingerprint in hexadecimal digits.
pub const KEY_FINGERPRINT: &str = "bansho:fingerprint";
/// Key of the text chunk that holds Bansho's version.
pub const KEY_VERSION: &str = "bansho:version";
