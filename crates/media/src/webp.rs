//! WebP plates.

use std::io::Cursor;

use bansho_base::host::assets::{AssetProblem, Picture, PictureRemark};
use image_webp::WebPDecoder;

use crate::{
    decode::{DecodedPicture, PIXEL_BYTES, color::SourceColor, damaged, exif},
    limits::{self, MemoryLimit},
};

/// Decodes a WebP, lossy or lossless, with its alpha, profile and orientation; of an animation the first picture.
pub(crate) fn decode(file: &[u8], limit: MemoryLimit) -> Result<Picture, AssetProblem> {
    let mut decoder = WebPDecoder::new(Cursor::new(file)).map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    let [width, height] = limits::check_size([width.into(), height.into()])?;
    // A lossless file of one color holds any number of pixels in a few bytes, within its 16384 x 16384.
    // Profile and Exif are read under a limit of their own, before the size of the pixels is checked.
    decoder.set_memory_limit(limit.available().min(64 << 20) as usize);
    let exif = decoder.exif_metadata().map_err(damaged)?.map(|block| exif::read(&block)).unwrap_or_default();
    let turning_bytes = DecodedPicture::turning_bytes(&exif, width * height);
    // Four bytes of color, and those of the planes or of the argb values that it decodes.
    let decoding_bytes = 12 * (width + 64) * (height + 64);
    limit.check(file.len() as u64 + decoding_bytes.max(turning_bytes) + width * height * PIXEL_BYTES)?;
    let mut remarks = Vec::new();
    let color = match decoder.icc_profile() {
        Ok(profile) => profile.map_or(SourceColor::Srgb, SourceColor::Profile),
        Err(error) => {
            remarks.push(PictureRemark::Profile(error.to_string()));
            SourceColor::Srgb
        }
    };
    remarks.extend(decoder.is_animated().then_some(PictureRemark::SeveralPictures));
    let bytes = decoder.output_buffer_size().ok_or_else(|| damaged("its pixels do not fit in memory"))?;
    let mut codes = vec![0; bytes];
    decoder.set_memory_limit(limit.available() as usize);
    decoder.read_image(&mut codes).map_err(damaged)?;
    let pixels = if decoder.has_alpha() {
        codes.as_chunks::<4>().0.iter().map(|codes| codes.map(|code| f32::from(code) / 255.0)).collect()
    } else {
        codes.as_chunks::<3>().0.iter().map(|&[r, g, b]| [r, g, b, 255].map(|code| f32::from(code) / 255.0)).collect()
    };
    let [width, height] = [width as usize, height as usize];
    DecodedPicture { width, height, pixels, max_code: 255, color, exif, alpha: None, remarks }.finish()
}
