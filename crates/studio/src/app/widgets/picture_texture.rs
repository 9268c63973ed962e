//! Rendered pictures as egui textures.

use eframe::egui::{Color32, ColorImage, Context, TextureHandle, TextureId, TextureOptions};

use crate::player::Picture;

/// A texture that shows the newest of several pictures.
#[derive(Default)]
pub(crate) struct PictureTexture {
    /// The texture, and the serial number of the picture that it shows.
    uploaded: Option<(TextureHandle, u64)>,
}

impl PictureTexture {
    /// Uploads `picture` unless the texture shows serial number `serial` already.
    pub(crate) fn upload(&mut self, ctx: &Context, name: &str, picture: &Picture, serial: u64) {
        match &mut self.uploaded {
            Some((_, shown)) if *shown == serial => {}
            Some((texture, shown)) => {
                texture.set(color_image(picture), TextureOptions::LINEAR);
                *shown = serial;
            }
            None => {
                self.uploaded = Some((ctx.load_texture(name, color_image(picture), TextureOptions::LINEAR), serial));
            }
        }
    }

    /// The texture, once a picture was uploaded.
    pub(crate) fn id(&self) -> Option<TextureId> {
        self.uploaded.as_ref().map(|(texture, _)| texture.id())
    }
}

/// A picture as an egui image.
pub fn color_image(picture: &Picture) -> ColorImage {
    let colors = picture.pixels.iter().map(|[r, g, b, _]| Color32::from_rgb(*r, *g, *b)).collect();
    ColorImage::new(picture.size, colors)
}
