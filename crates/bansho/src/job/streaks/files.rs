//! Writes the pictures of streak textures.

use std::path::{Path, PathBuf};

use bansho_base::{
    camera::CameraHeader,
    color::ev100_of_white_luminance,
    frame::{Channel, Frame, FrameHeader, Precision},
    image::{Image, Rect},
    math::DVec3,
};
use bansho_media::{
    exr,
    files::{atomic, overwrite_policy::OverwritePolicy},
    png::{self, MeasuredImage, PngEffort},
};
use bansho_rain::{billboards::texture::lit_radiance, lighting::drop_phase_function::DropPhaseFunction};
use bansho_render::display::BitDepth;

use super::{StreakFormat, Streaks, Texture};
use crate::job::error::{JobError, StreaksError};

/// Version of the program, which is part of the fingerprint.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// A distant light on the drops.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DistantLight {
    /// Unit vector toward it: right, up, toward the viewer.
    pub(crate) toward: DVec3,
    /// Radiance of an opaque drop for unit illuminance, 1/sr: red, green, blue.
    pub(crate) radiance: [f32; 3],
}

impl DistantLight {
    pub(crate) fn new(toward: [f64; 3], phase_function: &DropPhaseFunction) -> Result<Self, StreaksError> {
        let radiance = lit_radiance(toward, phase_function).map_err(|_| StreaksError::LightDirection)?;
        Ok(Self { toward: DVec3::from(toward).normalize(), radiance })
    }
}

/// Writes textures in one format to one folder.
pub(crate) struct TextureWriter {
    pub(crate) folder: PathBuf,
    pub(crate) format: StreakFormat,
    pub(crate) bits: BitDepth,
    pub(crate) light: Option<DistantLight>,
    /// Which existing files may be overwritten.
    pub(crate) overwrite: OverwritePolicy,
    pub(crate) streaks: Streaks,
}

/// The scales of the pictures of one texture.
#[derive(Clone, Debug)]
pub(crate) struct WrittenTexture {
    /// Of a PNG: the opacity of the largest code.
    pub(crate) scale: Option<f32>,
    /// The lit picture beside a PNG.
    pub(crate) lit: Option<LitPicture>,
}

/// A PNG of the radiance of drops that a light shines on.
#[derive(Clone, Debug)]
pub(crate) struct LitPicture {
    pub(crate) file: String,
    /// The radiance of the largest code.
    pub(crate) scale: f32,
}

impl TextureWriter {
    pub(crate) fn index_path(&self) -> PathBuf {
        self.folder.join("streaks.json")
    }

    /// `streak_RATE_DIAMETER.png`, or `streak_RATE_DIAMETER_VARIANT.png` if there are several variants.
    pub(crate) fn name(&self, texture: &Texture) -> String {
        let variant = if self.streaks.variants > 1 { format!("_{}", texture.variant) } else { String::new() };
        let extension = self.format.name();
        format!("streak_{}_{}{variant}.{extension}", texture.rate, texture.bin.diameter_mm)
    }

    /// The name of the lit picture beside the PNG `file`.
    fn lit_name(&self, file: &str) -> Option<String> {
        (self.light.is_some() && self.format == StreakFormat::Png).then(|| file.replace(".png", "_lit.png"))
    }

    /// The files of the texture `file`.
    pub(crate) fn files(&self, file: &str) -> impl Iterator<Item = PathBuf> + use<> {
        let names = [Some(file.to_owned()), self.lit_name(file)];
        let folder = self.folder.clone();
        names.into_iter().flatten().map(move |name| folder.join(name))
    }

    /// Writes a file, atomically.
    pub(crate) fn write_file(&self, path: &Path, bytes: &[u8]) -> Result<(), JobError> {
        Ok(atomic::write_bytes(path, bytes, &self.overwrite)?)
    }

    /// Writes the pictures of a texture. `speckled` is its opacity times the brightness of drops that oscillate.
    pub(crate) fn write(
        &self,
        file: &str,
        opacity: &Image<1>,
        speckled: Option<&Image<1>>,
    ) -> Result<WrittenTexture, JobError> {
        let brightness = speckled.unwrap_or(opacity);
        match self.format {
            StreakFormat::Png => self.write_png(file, opacity, brightness),
            StreakFormat::Exr => self.write_exr(file, opacity, brightness),
        }
    }

    fn write_png(&self, file: &str, opacity: &Image<1>, brightness: &Image<1>) -> Result<WrittenTexture, JobError> {
        let scale = self.write_measured(file, 1, opacity, opacity.pixels().as_flattened())?;
        let lit = self.light.zip(self.lit_name(file)).map(|(light, name)| {
            let radiance: Vec<f32> = self.radiance(&light, brightness).into_flattened();
            let scale = self.write_measured(&name, 3, opacity, &radiance)?;
            Ok::<_, JobError>(LitPicture { file: name, scale })
        });
        Ok(WrittenTexture { scale: Some(scale), lit: lit.transpose()? })
    }

    fn write_measured(&self, file: &str, channels: usize, image: &Image<1>, values: &[f32]) -> Result<f32, JobError> {
        let size = [image.width(), image.height()];
        let picture = MeasuredImage::from_values(size, channels, values, self.bits == BitDepth::Sixteen);
        let path = self.folder.join(file);
        let bytes = png::encode_measured(&picture, &self.fingerprint(file), PngEffort::Fast, &path)?;
        self.write_file(&path, &bytes)?;
        Ok(picture.scale)
    }

    fn write_exr(&self, file: &str, opacity: &Image<1>, brightness: &Image<1>) -> Result<WrittenTexture, JobError> {
        let values = opacity.pixels().as_flattened();
        // Without a light, the radiance is the opacity: white streaks.
        let radiance = match &self.light {
            Some(light) => self.radiance(light, brightness),
            None => values.iter().map(|&opacity| [opacity; 3]).collect(),
        };
        let pixels = radiance.iter().zip(values).map(|(&[r, g, b], &opacity)| [r, g, b, opacity]).collect();
        let (width, height) = (opacity.width(), opacity.height());
        let beauty =
            Image::from_pixels(width, height, pixels).unwrap_or_else(|| Image::filled(width, height, [0.0; 4]));
        let channel =
            |name: &str, values: Vec<f32>| Channel { name: name.to_owned(), precision: Precision::Single, values };
        let channels = vec![channel("opacity", values.to_vec())];
        let (header, content) = (self.header(file, opacity), Rect::from_size(width, height));
        let frame = Frame { header, beauty, depth: None, channels, opaque: false, metadata: Vec::new(), content };
        let path = self.folder.join(file);
        // Without a light nothing in the file is a color.
        let bytes = if self.light.is_some() { exr::encode(&frame, &path)? } else { exr::encode_data(&frame, &path)? };
        self.write_file(&path, &bytes)?;
        Ok(WrittenTexture { scale: None, lit: None })
    }

    fn radiance(&self, light: &DistantLight, brightness: &Image<1>) -> Vec<[f32; 3]> {
        brightness.pixels().iter().map(|[brightness]| light.radiance.map(|radiance| radiance * brightness)).collect()
    }

    fn header(&self, file: &str, image: &Image<1>) -> FrameHeader {
        let identity: [[f64; 4]; 4] = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 }));
        FrameHeader {
            number: 0,
            // So that readers do not scale the values.
            exposure_ev100: ev100_of_white_luminance(1.0) as f32,
            white_balance_k: None,
            fps: [30, 1],
            exposure_time_s: self.streaks.cube.exposure as f32,
            camera: CameraHeader {
                world_to_camera: identity,
                world_to_ndc: None,
                vertical_fov_deg: None,
                lens: None,
                fisheye_fov_deg: None,
            },
            fingerprint: self.fingerprint(file),
            display_size: [image.width(), image.height()],
            data_origin: [0, 0],
        }
    }

    /// The fingerprint of everything that the pixels of a file depend on.
    fn fingerprint(&self, file: &str) -> [u8; 32] {
        let Streaks { cube, law, diameters, seed, light, oscillation, bits, variants, .. } = &self.streaks;
        let mut hasher = blake3::Hasher::new();
        hasher.update(
            format!("bansho {VERSION} {file} {cube:?} {law:?} {diameters:?} {seed} {light:?} {bits:?} {variants}")
                .as_bytes(),
        );
        if *oscillation > 0.0 {
            hasher.update(format!(" oscillation {oscillation}").as_bytes());
        }
        *hasher.finalize().as_bytes()
    }
}
