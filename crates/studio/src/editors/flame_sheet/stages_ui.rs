//! Live thumbnails of a flame sheet's stages: texture, thresholded, sharpened, colored.

use eframe::egui::{
    self, CollapsingHeader, Color32, ColorImage, Rect, Sense, TextureHandle, TextureOptions, Ui, pos2, vec2,
};

use crate::{document::stages, player::Picture, session::Session};

/// The textures of the thumbnails, each with the serial number of its picture.
#[derive(Default)]
pub(crate) struct StagesView {
    textures: Vec<(TextureHandle, u64)>,
}

impl StagesView {
    /// Shows the stages of flame sheet `index`, and asks for them while they are seen.
    pub(crate) fn ui(&mut self, ui: &mut Ui, session: &mut Session, index: usize) {
        let header = CollapsingHeader::new("Stages").default_open(true).show(ui, |ui| {
            ui.horizontal(|ui| {
                let gaps = 3.0 * ui.spacing().item_spacing.x;
                let width = ((ui.available_width() - gaps) / 4.0).clamp(30.0, 160.0);
                for (stage, name) in stages::names().enumerate() {
                    self.stage_ui(ui, session, stage, name, width);
                }
            });
        });
        header.header_response.on_hover_text(
            "How the flame comes to be, live: the texture, what the threshold leaves, sharpened, colored",
        );
        session.stages = header.body_returned.is_some().then_some(index);
    }

    fn stage_ui(&mut self, ui: &mut Ui, session: &Session, stage: usize, name: &str, width: f32) {
        ui.vertical(|ui| {
            let (rect, response) = ui.allocate_exact_size(vec2(width, width), Sense::hover());
            let label = format!("Stage {name}");
            response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, &label));
            ui.painter().rect_filled(rect, 2.0, Color32::BLACK);
            if let Some((picture, drawn)) = session.stage(stage) {
                let texture = self.texture(ui, stage, picture, drawn);
                let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
                ui.painter().image(texture, rect, whole, Color32::WHITE);
            }
            ui.add(egui::Label::new(egui::RichText::new(name).small()).truncate());
        });
    }

    fn texture(&mut self, ui: &Ui, stage: usize, picture: &Picture, drawn: u64) -> egui::TextureId {
        let image = || color_image(picture);
        while self.textures.len() <= stage {
            let name = format!("stage {}", self.textures.len());
            self.textures.push((ui.ctx().load_texture(name, image(), TextureOptions::LINEAR), 0));
        }
        let (texture, shown) = &mut self.textures[stage];
        if *shown != drawn {
            texture.set(image(), TextureOptions::LINEAR);
            *shown = drawn;
        }
        texture.id()
    }
}

/// A picture as an egui image.
pub fn color_image(picture: &Picture) -> ColorImage {
    let colors = picture.pixels.iter().map(|[r, g, b, _]| Color32::from_rgb(*r, *g, *b)).collect();
    ColorImage::new(picture.size, colors)
}
