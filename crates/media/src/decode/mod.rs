//! What the decoders of pictures share: a picture as it is stored, before it is rotated and before its colors are converted; [`color`] converts them, and
//! [`exif`] reads the orientation and the exposure.

pub(crate) mod color;
pub(crate) mod exif;

use bansho_base::{
    color::AlphaConvention,
    host::assets::{AssetProblem, Picture, PictureAlpha, PictureRemark},
    image::Image,
};

use self::{
    color::SourceColor,
    exif::{ExifData, Orientation},
};

/// Memory of a decoded pixel, bytes.
pub(crate) const PIXEL_BYTES: u64 = size_of::<[f32; 4]>() as u64;

pub(crate) fn damaged(reason: impl ToString) -> AssetProblem {
    AssetProblem::Damaged(reason.to_string())
}

/// A picture as it is stored, with what its file says about it.
#[derive(Debug)]
pub(crate) struct DecodedPicture {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Codes divided by `max_code`: red, green, blue, straight alpha.
    pub(crate) pixels: Vec<[f32; 4]>,
    pub(crate) max_code: u32,
    pub(crate) color: SourceColor,
    pub(crate) exif: ExifData,
    /// The convention that the file states for its alpha.
    pub(crate) alpha: Option<AlphaConvention>,
    pub(crate) remarks: Vec<PictureRemark>,
}

impl DecodedPicture {
    /// Memory for turning a picture of this size, bytes: a second one, where it is turned.
    pub(crate) fn turning_bytes(exif: &ExifData, pixels: u64) -> u64 {
        if exif.orientation == Orientation::Upright { 0 } else { pixels * PIXEL_BYTES }
    }

    /// The picture as a viewer shows it.
    pub(crate) fn finish(mut self) -> Result<Picture, AssetProblem> {
        let mut remarks = self.remarks;
        let encoding = color::convert(&mut self.pixels, &self.color, self.max_code, &mut remarks);
        let is_opaque = self.pixels.iter().all(|[.., alpha]| *alpha >= 1.0);
        let convention = self.alpha.unwrap_or(AlphaConvention::Encoded);
        let alpha = if is_opaque { PictureAlpha::Opaque } else { PictureAlpha::Straight(convention) };
        let stored = Image::from_pixels(self.width, self.height, self.pixels);
        let stored = stored.ok_or_else(|| damaged("its pixels do not fill it"))?;
        remarks.extend(self.exif.remarks);
        let color = self.exif.orientation.apply(stored).into();
        Ok(Picture { color, alpha, depth: None, encoding, exposure_ev100: self.exif.ev100, remarks })
    }
}
