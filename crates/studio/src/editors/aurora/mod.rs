//! The aurora editor (thesis, fig. 3.1): on the left the shape that is left, on the right the one that is drawn, with
//! the first faint beneath it and the sheet to be drawn next in yellow.

pub mod document;
mod paint;
mod plane;
mod pointer;
mod shape_timeline;
mod tool;

use std::sync::Arc;

use bansho::{aurora::shapes::Form, render::scene::operation::Operation};

use self::{
    plane::{Plane, Side},
    tool::Tool,
};
use crate::{document::Revision, session::Session};
use document::{Drawing, Refusal};
use pointer::Gesture;

use eframe::egui::{self, Color32, Id, Pos2, Sense, Ui, vec2};

/// The editor of one aurora's shapes.
#[derive(Default)]
pub(crate) struct AuroraEditor {
    /// Which aurora of the scene.
    index: usize,
    tool: Tool,
    /// The shape that is drawn.
    target: usize,
    /// Its sheet that is drawn next; a new one where there is none.
    next: Option<usize>,
    gesture: Gesture,
    /// Where a shape is held on the line of time.
    grip: Option<shape_timeline::Grip>,
    refusal: Option<(String, Pos2)>,
    read: Option<(Revision, Result<Arc<Drawing>, String>)>,
}

impl AuroraEditor {
    /// Shows the editor of aurora `index`.
    pub(crate) fn show(&mut self, ui: &mut Ui, session: &mut Session, index: usize) {
        if self.index != index {
            *self = Self { index, tool: self.tool, ..Self::default() };
        }
        // Each part may change the shapes that the next one shows.
        for part in [Self::tools, shape_timeline::show, Self::planes] {
            match self.drawing(session) {
                Ok(drawing) => {
                    self.target = self.target.min(drawing.arrivals().len() - 1);
                    part(self, ui, session, &drawing);
                }
                Err(reason) => {
                    ui.colored_label(ui.visuals().warn_fg_color, reason);
                    ui.weak("Mend the text or undo (Ctrl+Z); the shapes come back then.");
                    return;
                }
            }
        }
        self.tell_refusal(ui);
    }

    /// The shapes as the scene states them now.
    fn drawing(&mut self, session: &Session) -> Result<Arc<Drawing>, String> {
        let revision = session.document.revision();
        if let Some((_, read)) = self.read.as_ref().filter(|(of, _)| *of == revision) {
            return read.clone();
        }
        let read = Drawing::read(session.document.values(), self.index, session.assets());
        let read = read.map(Arc::new).map_err(|refusal| refusal.to_string());
        self.read = Some((revision, read.clone()));
        read
    }

    fn tools(&mut self, ui: &mut Ui, session: &mut Session, drawing: &Drawing) {
        ui.horizontal_wrapped(|ui| {
            for tool in Tool::ALL {
                let (name, help) = tool.words();
                if ui.selectable_label(self.tool == tool, name).on_hover_text(help).clicked() {
                    self.tool = tool;
                    (self.gesture, self.refusal) = (Gesture::None, None);
                }
            }
            ui.separator();
            ui.menu_button("Template", |ui| {
                for choice in Form::CHOICES {
                    let form = Form::from_name(choice.name);
                    if let Some(form) = form.filter(|_| ui.button(choice.name).on_hover_text(choice.doc).clicked()) {
                        let put = drawing.put_form(self.target, self.slot(drawing), form);
                        self.change(session, "template", &put, ui.cursor().min).then(|| self.advance(drawing));
                        ui.close();
                    }
                }
            })
            .response
            .on_hover_text("A named form in stead of the yellow sheet");
            ui.separator();
            self.say_next(ui, drawing);
        });
    }

    /// What the next stroke becomes.
    fn say_next(&mut self, ui: &mut Ui, drawing: &Drawing) {
        let count = if drawing.is_stated() { drawing.lines(self.target).len() } else { 0 };
        let text = match self.slot(drawing) {
            Some(sheet) => format!("next stroke: sheet {} of {count}", sheet + 1),
            None => "next stroke: a new sheet".to_owned(),
        };
        if ui.link(text).on_hover_text("Click for another; or click a sheet of the drawing").clicked() && count > 0 {
            let next = self.slot(drawing).map_or(0, |sheet| sheet + 1);
            let new = self.target == 0 && next >= count;
            self.next = (!new).then_some(next % count);
        }
    }

    /// The sheet that a stroke is drawn for: the first shape takes new ones, the others have as many as come to them.
    fn slot(&self, drawing: &Drawing) -> Option<usize> {
        let count = drawing.lines(self.target).len();
        match self.next {
            _ if !drawing.is_stated() => None,
            Some(next) => Some(next.min(count.saturating_sub(1))),
            None if self.target == 0 => None,
            None => Some(0),
        }
    }

    /// After a sheet was drawn, the one after it is next.
    fn advance(&mut self, drawing: &Drawing) {
        let count = drawing.lines(self.target).len().max(1);
        self.next = self.slot(drawing).filter(|_| self.target > 0).map(|sheet| (sheet + 1) % count);
    }

    fn planes(&mut self, ui: &mut Ui, session: &mut Session, drawing: &Drawing) {
        let gap = ui.spacing().item_spacing.x;
        let side = ui.available_height().min((ui.available_width() - gap) / 2.0).max(80.0);
        ui.horizontal(|ui| {
            let areas = [(Side::Source, "Aurora source"), (Side::Target, "Aurora target")].map(|(which, name)| {
                let (response, painter) = ui.allocate_painter(vec2(side, side), Sense::click_and_drag());
                response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Canvas, true, name));
                (which, response, painter)
            });
            let planes = [0, 1].map(|area: usize| Plane::new(areas[area].1.rect, drawing.extent_km()));
            for (which, response, painter) in areas {
                self.hands(ui, session, drawing, &planes, which, &response);
                self.paint(&painter, drawing, &planes[which as usize], which, &response);
            }
        });
    }

    /// Carries out a change of the shapes, or says at `at` why it cannot be; whether it was.
    fn change(&mut self, session: &mut Session, label: &str, operations: &[Operation], at: Pos2) -> bool {
        match session.reshape(label, operations, self.index) {
            Ok(drawing) => {
                self.refusal = None;
                self.read = Some((session.document.revision(), Ok(Arc::new(drawing))));
                true
            }
            Err(refusal) => {
                self.refuse(&refusal, at);
                false
            }
        }
    }

    fn refuse(&mut self, refusal: &Refusal, at: Pos2) {
        self.refusal = Some((refusal.to_string(), at));
    }

    /// The reason of a refusal, at the pointer, until something else is done.
    fn tell_refusal(&self, ui: &Ui) {
        let Some((reason, at)) = &self.refusal else { return };
        egui::Area::new(Id::unique("refusal")).order(egui::Order::Tooltip).fixed_pos(*at + vec2(14.0, 10.0)).show(
            ui.ctx(),
            |ui| {
                egui::Frame::popup(ui.style()).show(ui, |ui| {
                    ui.set_max_width(280.0);
                    ui.colored_label(Color32::from_rgb(255, 150, 110), reason);
                });
            },
        );
    }
}
