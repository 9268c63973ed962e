//! Finished frames with their layers and metadata, and pictures of display pixels.

use crate::{
    camera::CameraHeader,
    color::AlphaConvention,
    image::{Image, Rect},
};

/// How a float channel is stored in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// 16-bit float, for color.
    Half,
    /// 32-bit float, for measured quantities and depth.
    Single,
}

/// A named plane of floats besides the beauty pass, of the size of the frame's data window.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Name including that of its layer, such as `torch.temperature_k` or `plate.R`. In an EXR file `.V` is appended to names that do not end in a
    /// component.
    pub name: String,
    /// How it is stored.
    pub precision: Precision,
    /// Values, row after row from the top.
    pub values: Vec<f32>,
}

/// Metadata of a frame. Nothing here depends on the machine or the time of day.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameHeader {
    /// Frame number.
    pub number: i64,
    /// Exposure value at ISO 100 that the pixels are scaled by.
    pub exposure_ev100: f32,
    /// White balance: temperature of the black body whose light is shown as white, K; `None` is D65. The pixels are not changed by it.
    pub white_balance_k: Option<f32>,
    /// Frames per second as a fraction.
    pub fps: [u32; 2],
    /// Exposure time, seconds.
    pub exposure_time_s: f32,
    /// Camera at the middle of the exposure.
    pub camera: CameraHeader,
    /// Fingerprint of everything the pixels depend on.
    pub fingerprint: [u8; 32],
    /// Size of the whole picture (display window), of which the pixels may be a region.
    pub display_size: [usize; 2],
    /// Position of the pixels (data window) in the whole picture; negative with overscan.
    pub data_origin: [i64; 2],
}

/// A finished picture, scene-linear ACEScg, exposed so that 1.0 is display white.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Metadata.
    pub header: FrameHeader,
    /// Premultiplied red, green, blue and alpha.
    pub beauty: Image<4>,
    /// Depth of the nearest object drawn, m; infinite where there is none.
    pub depth: Option<Vec<f32>>,
    /// Layers and AOVs, in the requested order.
    pub channels: Vec<Channel>,
    /// Whether a plate fills the picture, so that it is opaque.
    pub opaque: bool,
    /// Metadata of the phenomena that have any, if requested.
    pub metadata: Vec<PhenomenonMetadata>,
    /// Bounding rectangle of the pixels that are not empty. Empty means no light, no alpha, infinite depth.
    pub content: Rect,
}

/// A named number that characterizes a frame, such as a rain rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MetadataEntry {
    /// Its name, words joined by `_`.
    pub name: &'static str,
    /// Its unit; empty for a dimensionless number.
    pub unit: &'static str,
    /// Its value; not finite if there is none.
    pub value: f64,
}

/// The metadata of one phenomenon.
#[derive(Clone, Debug, PartialEq)]
pub struct PhenomenonMetadata {
    /// Name of the phenomenon in the scene.
    pub phenomenon: String,
    /// Its entries.
    pub entries: Vec<MetadataEntry>,
}

/// What the codes of a picture stand for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DisplayEncoding {
    /// Colors for display, sRGB-encoded.
    #[default]
    Srgb,
    /// Scene-linear light in ACEScg (AP1, D60), clamped to 0 to 1: the view `raw`.
    LinearAcescg,
    /// No colors, such as motion or coverage: nothing that reads it may convert it.
    Data,
}

/// Display pixels with straight alpha; what the codes stand for is said by [`DisplayEncoding`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DisplayPixels {
    /// 8 bits per channel.
    Eight(Vec<[u8; 4]>),
    /// 16 bits per channel.
    Sixteen(Vec<[u16; 4]>),
}

/// A picture ready for a screen or a display format.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DisplayImage {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Whether every pixel is opaque, so that alpha may be left out.
    pub opaque: bool,
    /// Convention of its straight alpha, if it is not opaque.
    pub alpha: AlphaConvention,
    /// What its codes stand for.
    pub encoding: DisplayEncoding,
    /// Pixels, row after row from the top.
    pub pixels: DisplayPixels,
}
