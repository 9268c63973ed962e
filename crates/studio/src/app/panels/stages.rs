//! Live thumbnails of the stages of a phenomenon, where its kind has some.

use eframe::egui::{self, CollapsingHeader, Color32, Rect, Sense, Ui, pos2, vec2};

use crate::{
    app::widgets::picture_texture::PictureTexture,
    document::{PhenomenonId, stages},
    session::Session,
};

/// The section with the thumbnails.
#[derive(Default)]
pub(crate) struct StagesSection {
    textures: Vec<PictureTexture>,
}

impl StagesSection {
    /// Shows the stages of `phenomenon`, and requests their pictures while the section is open.
    pub(crate) fn ui(&mut self, ui: &mut Ui, session: &mut Session, phenomenon: PhenomenonId) {
        let names = stages::names(phenomenon.kind);
        if names.is_empty() {
            return;
        }
        let header = CollapsingHeader::new("Stages").default_open(true).show(ui, |ui| {
            ui.horizontal(|ui| {
                let count = names.len() as f32;
                let gaps = (count - 1.0) * ui.spacing().item_spacing.x;
                let width = ((ui.available_width() - gaps) / count).clamp(30.0, 160.0);
                for (stage, name) in names.iter().enumerate() {
                    self.stage_ui(ui, session, stage, name, width);
                }
            });
        });
        header.header_response.on_hover_text(format!("Intermediate results, live: {}", names.join(", ")));
        session.stages = header.body_returned.is_some().then_some(phenomenon);
    }

    fn stage_ui(&mut self, ui: &mut Ui, session: &Session, stage: usize, name: &str, width: f32) {
        ui.vertical(|ui| {
            let (rect, response) = ui.allocate_exact_size(vec2(width, width), Sense::hover());
            let label = format!("Stage {name}");
            response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, &label));
            ui.painter().rect_filled(rect, 2.0, Color32::BLACK);
            if self.textures.len() <= stage {
                self.textures.resize_with(stage + 1, PictureTexture::default);
            }
            let texture = &mut self.textures[stage];
            if let Some((picture, serial)) = session.stage(stage) {
                texture.upload(ui.ctx(), &format!("stage {stage}"), picture, serial);
                if let Some(texture) = texture.id() {
                    let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
                    ui.painter().image(texture, rect, whole, Color32::WHITE);
                }
            }
            ui.add(egui::Label::new(egui::RichText::new(name).small()).truncate());
        });
    }
}
