//! PNG: display pixels in sRGB with straight alpha, and measured quantities, linear.

pub(crate) mod chunk;
mod encode;
mod measured;

pub(crate) use encode::encode_frame;
pub use encode::{PngEffort, SIDE_LIMIT, encode, encode_document, encode_linear_document};
pub use measured::{MeasuredImage, Samples, encode_measured};

/// Key of the text chunk that holds the fingerprint in hexadecimal digits.
pub const KEY_FINGERPRINT: &str = "bansho:fingerprint";
/// Key of the text chunk that holds Bansho's version.
pub const KEY_VERSION: &str = "bansho:version";
/// Key of the text chunk that names the convention of straight alpha: `encoded` or `linear`.
pub const KEY_ALPHA: &str = "bansho:alpha";
/// Key of the text chunk with the value of the largest code of a measured image.
pub const KEY_SCALE: &str = "bansho:scale";
