//! The aurora editor (thesis, fig. 3.1): two maps, on the left the source shape of a transition, on the right its target shape, which is
//! drawn, with the source faint beneath it and the sheet that the next stroke replaces in yellow.

pub mod document;
mod paint;
mod plane;
mod pointer;
mod shape_timeline;
mod tool;

use std::sync::Arc;

use bansho::{
    aurora::{AuroraParameters, shapes::Form},
    base::parameters::Value,
    scene::operation::Operation,
};

use self::{
    plane::{Plane, Side},
    tool::DrawTool,
};
use crate::{document::Revision, session::Session};
use document::{AuroraDrawing, ShapeEditError};
use pointer::DragState;

use eframe::egui::{self, Color32, Id, Pos2, Sense, Ui, vec2};

/// The editor of one aurora's shapes.
#[derive(Default)]
pub(crate) struct AuroraEditor {
    /// Which aurora of the scene.
    index: usize,
    tool: DrawTool,
    /// The shape that is edited.
    target: usize,
    /// The sheet that the next stroke replaces; `None` for a new sheet.
    next_sheet: Option<usize>,
    drag: DragState,
    /// The shape that is dragged on the timeline.
    shape_drag: Option<shape_timeline::ShapeDrag>,
    shape_error: Option<(String, Pos2)>,
    /// The shapes of a revision, or why there are none.
    cached: Option<(Revision, Result<Arc<AuroraDrawing>, String>)>,
}

impl AuroraEditor {
    /// The kind of phenomenon that it edits.
    pub(crate) const KIND: &'static str = AuroraParameters::KIND.key;

    /// Shows the editor of aurora `index`.
    pub(crate) fn ui(&mut self, ui: &mut Ui, session: &mut Session, index: usize) {
        if self.index != index {
            *self = Self { index, tool: self.tool, ..Self::default() };
        }
        // Each section may change the shapes that the next one shows.
        for section in [Self::tools_ui, shape_timeline::shape_timeline_ui, Self::planes_ui] {
            match self.drawing(session) {
                Ok(drawing) => {
                    self.target = self.target.min(drawing.arrivals().len() - 1);
                    section(self, ui, session, &drawing);
                }
                Err(reason) => {
                    ui.colored_label(ui.visuals().warn_fg_color, reason);
                    ui.weak("Correct the text or undo (Ctrl+Z) to see the shapes again.");
                    return;
                }
            }
        }
        self.shape_error_ui(ui);
    }

    /// The shapes of the current revision.
    fn drawing(&mut self, session: &Session) -> Result<Arc<AuroraDrawing>, String> {
        let revision = session.document.revision();
        if let Some((_, read)) = self.cached.as_ref().filter(|(cached, _)| *cached == revision) {
            return read.clone();
        }
        let read = AuroraDrawing::read(session.document.values(), self.index, session.assets());
        let read = read.map(Arc::new).map_err(|shape_error| shape_error.to_string());
        self.cached = Some((revision, read.clone()));
        read
    }

    fn tools_ui(&mut self, ui: &mut Ui, session: &mut Session, drawing: &AuroraDrawing) {
        ui.horizontal_wrapped(|ui| {
            for tool in DrawTool::ALL {
                let (name, help) = tool.name_and_help();
                if ui.selectable_label(self.tool == tool, name).on_hover_text(help).clicked() {
                    self.tool = tool;
                    (self.drag, self.shape_error) = (DragState::None, None);
                }
            }
            ui.separator();
            ui.menu_button("Template", |ui| {
                for choice in Form::CHOICES {
                    let form = Form::from_name(choice.name);
                    if let Some(form) = form.filter(|_| ui.button(choice.name).on_hover_text(choice.doc).clicked()) {
                        let put = drawing.put_form(self.target, self.target_sheet(drawing), form);
                        self.change(session, "template", &put, ui.cursor().min)
                            .then(|| self.select_next_sheet(drawing));
                        ui.close();
                    }
                }
            })
            .response
            .on_hover_text("Replaces the yellow sheet by a named form");
            ui.separator();
            self.next_stroke_ui(ui, drawing);
        });
    }

    /// Shows which sheet the next stroke replaces.
    fn next_stroke_ui(&mut self, ui: &mut Ui, drawing: &AuroraDrawing) {
        let count = if drawing.is_stated() { drawing.lines(self.target).len() } else { 0 };
        let text = match self.target_sheet(drawing) {
            Some(sheet) => format!("next stroke: sheet {} of {count}", sheet + 1),
            None => "next stroke: a new sheet".to_owned(),
        };
        if ui.link(text).on_hover_text("Click for another; or click a sheet of the drawing").clicked() && count > 0 {
            let next = self.target_sheet(drawing).map_or(0, |sheet| sheet + 1);
            let new = self.target == 0 && next >= count;
            self.next_sheet = (!new).then_some(next % count);
        }
    }

    /// The sheet that a stroke replaces. The first shape accepts new sheets; the number of the others follows from the transitions.
    fn target_sheet(&self, drawing: &AuroraDrawing) -> Option<usize> {
        let count = drawing.lines(self.target).len();
        match self.next_sheet {
            _ if !drawing.is_stated() => None,
            Some(next) => Some(next.min(count.saturating_sub(1))),
            None if self.target == 0 => None,
            None => Some(0),
        }
    }

    /// Selects the sheet after the one that was drawn.
    fn select_next_sheet(&mut self, drawing: &AuroraDrawing) {
        let count = drawing.lines(self.target).len().max(1);
        self.next_sheet = self.target_sheet(drawing).filter(|_| self.target > 0).map(|sheet| (sheet + 1) % count);
    }

    fn planes_ui(&mut self, ui: &mut Ui, session: &mut Session, drawing: &AuroraDrawing) {
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
                self.handle_pointer(ui, session, drawing, &planes, which, &response);
                self.paint(&painter, drawing, &planes[which as usize], which, &response);
            }
        });
    }

    /// Applies an edit of the shapes, or shows the error at `at`. Returns whether it was applied.
    fn change(&mut self, session: &mut Session, label: &str, operations: &[Operation], at: Pos2) -> bool {
        match edit_shapes(session, label, operations, self.index) {
            Ok(drawing) => {
                self.shape_error = None;
                self.cached = Some((session.document.revision(), Ok(Arc::new(drawing))));
                true
            }
            Err(shape_error) => {
                self.set_shape_error(&shape_error, at);
                false
            }
        }
    }

    fn set_shape_error(&mut self, shape_error: &ShapeEditError, at: Pos2) {
        self.shape_error = Some((shape_error.to_string(), at));
    }

    /// Shows the error at the pointer, until the next action.
    fn shape_error_ui(&self, ui: &Ui) {
        let Some((reason, at)) = &self.shape_error else { return };
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

/// Applies `operations` to the shapes of aurora `index`. Returns its shapes.
///
/// # Errors
/// The resulting shapes are invalid; nothing is changed then.
pub(crate) fn edit_shapes(
    session: &mut Session,
    label: &str,
    operations: &[Operation],
    index: usize,
) -> Result<AuroraDrawing, ShapeEditError> {
    let assets = session.assets().clone();
    let drawing = session.document.edit_shapes(label, operations, index, &assets)?;
    session.set_notice(None);
    Ok(drawing)
}

/// Replaces the sheets of the first shape of aurora `index` by the strokes of the SVG file that the scene calls `name`.
///
/// # Errors
/// There is no such aurora, or the strokes make no valid shape.
pub(crate) fn import_drawing(session: &mut Session, index: usize, name: Value) -> Result<(), ShapeEditError> {
    let drawing = AuroraDrawing::read(session.document.values(), index, session.assets())?;
    edit_shapes(session, "drawing", &drawing.trace(name), index)?;
    Ok(())
}
