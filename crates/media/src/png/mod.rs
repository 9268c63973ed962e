//! PNG: display pixels with straight alpha in sRGB, linear ACEScg or as data, and measured quantities, linear.

pub(crate) mod chunk;
pub(crate) mod decode;
mod encode;
mod measured;

pub use encode::{PngEffort, SIDE_LIMIT, encode, encode_document, encode_linear_document};
pub(crate) use encode::{encode_frame, encoding_of_name};
pub use measured::{MeasuredImage, Samples, encode_measured};

/// Key of the text chunk that holds the fingerprint in hexadecimal digits.
pub const KEY_FINGERPRINT: &str = "bansho:fingerprint";
/// Key of the text chunk that holds Bansho's version.
pub const KEY_VERSION: &str = "bansho:version";
/// Key of the text chunk that names the convention of straight alpha: `encoded` or `linear`.
pub const KEY_ALPHA: &str = "bansho:alpha";
/// Key of the text chunk that names what the codes stand for where they are not sRGB: `lin_ap1_scene` or `data` (names of the Color Interop Forum).
pub const KEY_ENCODING: &str = "bansho:encoding";
/// Key of the text chunk with the value of the largest code of a measured image.
pub const KEY_SCALE: &str = "bansho:scale";
