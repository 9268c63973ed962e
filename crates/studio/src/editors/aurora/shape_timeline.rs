//! The timeline of shapes: select, add, move in time, remove.

use bansho::{
    base::parameters::Value,
    scene::{ValuePath, operation::Operation},
};

use super::{AuroraEditor, document::AuroraDrawing, pointer::DragState};
use crate::session::Session;
use eframe::egui::{self, Align2, Color32, CornerRadius, FontId, Pos2, Rect, Sense, Stroke, Ui, pos2, vec2};

/// A dragged shape: the end of the timeline and the offset from the pointer stay constant during the drag.
#[derive(Clone, Copy)]
pub(super) struct ShapeDrag {
    end_s: f64,
    offset: f32,
}

/// Shows the timeline and its buttons.
pub(super) fn shape_timeline_ui(
    editor: &mut AuroraEditor,
    ui: &mut Ui,
    session: &mut Session,
    drawing: &AuroraDrawing,
) {
    /// A narrower timeline gets a row of its own, points.
    const MIN_WIDTH_BESIDE: f32 = 220.0;
    let beside = ui.horizontal(|ui| {
        buttons_ui(editor, ui, session, drawing);
        let beside = ui.available_width() >= MIN_WIDTH_BESIDE;
        if beside {
            timeline_ui(editor, ui, session, drawing);
        }
        beside
    });
    if !beside.inner {
        timeline_ui(editor, ui, session, drawing);
    }
}

/// Buttons for the shape on the right map.
fn buttons_ui(editor: &mut AuroraEditor, ui: &mut Ui, session: &mut Session, drawing: &AuroraDrawing) {
    if ui.button("Add shape").on_hover_text("Appends a copy of the last shape, to be drawn over").clicked() {
        add(editor, ui, session, drawing);
        return;
    }
    let several = drawing.arrivals().len() > 1;
    let remove = ui.add_enabled(several, egui::Button::new("Remove shape"));
    if remove.on_hover_text("Removes the shape that is shown on the right").clicked() {
        let removal = drawing.remove_shape(editor.target);
        editor.change(session, "remove shape", &removal, ui.cursor().min);
        return;
    }
    if editor.target > 0 {
        let label = ui.label("reached after").id;
        let mut transition_s = drawing.transition_s(editor.target);
        let drag = egui::DragValue::new(&mut transition_s).range(0.1..=1e5).speed(0.05).max_decimals(2).suffix(" s");
        let drag = drag.clamp_existing_to_range(false);
        if ui.add(drag).labelled_by(label).changed() {
            let change = drawing.retime(editor.target, transition_s);
            editor.change(session, "time of shape", &change, ui.cursor().min);
        }
    }
}

fn add(editor: &mut AuroraEditor, ui: &Ui, session: &mut Session, drawing: &AuroraDrawing) {
    let operations = drawing.add_shape();
    if !editor.change(session, "add shape", &operations, ui.cursor().min) {
        return;
    }
    let Ok(drawing) = editor.drawing(session) else { return };
    let last = drawing.arrivals().len() - 1;
    lengthen_shot(session, drawing.arrivals()[last]);
    select_shape(editor, session, &drawing, last);
    editor.next_sheet = Some(0);
}

/// Extends the shot to the time when the last shape is reached.
fn lengthen_shot(session: &mut Session, until_s: f64) {
    let needed = (until_s / session.transport.frame_s()).ceil() as i64 + 1;
    let frames = session.transport.frames();
    if frames.end() - frames.start() + 1 < needed {
        let path = ValuePath::root().key("picture").key("frames");
        session.edit("add shape", &[Operation::Set { path, value: Value::Integer(needed) }]);
    }
}

/// Selects shape `shape`, and seeks to the time when it is reached.
pub(super) fn select_shape(editor: &mut AuroraEditor, session: &mut Session, drawing: &AuroraDrawing, shape: usize) {
    (editor.target, editor.next_sheet) = (shape, None);
    (editor.drag, editor.shape_error) = (DragState::None, None);
    let arrival = drawing.arrivals().get(shape).copied().unwrap_or_default();
    session.transport.set_playing(false);
    session.go_to_time(arrival);
}

fn timeline_ui(editor: &mut AuroraEditor, ui: &mut Ui, session: &mut Session, drawing: &AuroraDrawing) {
    /// Width of a shape's handle, points.
    const HANDLE: f32 = 22.0;
    let (response, painter) = ui.allocate_painter(vec2(ui.available_width().max(120.0), 22.0), Sense::hover());
    let rect = response.rect.shrink2(vec2(0.5 * HANDLE + 2.0, 2.0));
    let visuals = ui.visuals().clone();
    painter.hline(rect.x_range(), rect.center().y, Stroke::new(2.0, visuals.widgets.inactive.bg_fill));
    let arrivals = drawing.arrivals();
    let end = editor.shape_drag.map_or_else(|| timeline_end_s(session, arrivals), |shape_drag| shape_drag.end_s);
    let x_of = |time: f64| rect.left() + (time / end).min(1.0) as f32 * rect.width();
    painter.vline(
        x_of(session.transport.time_s()),
        response.rect.y_range(),
        Stroke::new(1.0, visuals.weak_text_color()),
    );
    for (shape, &arrival) in arrivals.iter().enumerate() {
        let handle = Rect::from_center_size(pos2(x_of(arrival), rect.center().y), vec2(HANDLE, 18.0));
        let response = ui.interact(handle, ui.scope_id().with(("shape", shape)), Sense::click_and_drag());
        let name = format!("Shape {}", shape + 1);
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &name));
        let selected = shape == editor.target;
        let fill = if selected { visuals.selection.bg_fill } else { visuals.widgets.inactive.bg_fill };
        painter.rect_filled(handle, CornerRadius::same(3), fill);
        let color = if selected { Color32::WHITE } else { visuals.text_color() };
        painter.text(handle.center(), Align2::CENTER_CENTER, shape + 1, FontId::proportional(12.0), color);
        let response = response.on_hover_text(format!("{name}, reached at {arrival:.2} s; drag to move it in time"));
        if response.clicked() || response.drag_started() {
            select_shape(editor, session, drawing, shape);
        }
        if response.drag_started() {
            let from = ui.input(|input| input.pointer.press_origin()).unwrap_or(handle.center());
            editor.shape_drag = Some(ShapeDrag { end_s: end, offset: from.x - handle.center().x });
        }
        if let (Some(shape_drag), Some(at), true) =
            (editor.shape_drag, response.interact_pointer_pos(), response.dragged())
        {
            let wanted = f64::from((at.x - shape_drag.offset - rect.left()) / rect.width()) * end;
            let retime = Retime { shape, later_s: wanted - arrival };
            move_in_time(editor, session, drawing, retime, handle.center());
        }
        if response.drag_stopped() {
            editor.shape_drag = None;
        }
    }
}

/// The end of the timeline, s: the later of the end of the shot and the last shape.
fn timeline_end_s(session: &Session, arrivals: &[f64]) -> f64 {
    let frames = session.transport.frames();
    let shot_s = (frames.end() - frames.start()).max(1) as f64 * session.transport.frame_s();
    arrivals.iter().copied().fold(shot_s, f64::max)
}

/// A change of the time at which a shape is reached.
#[derive(Clone, Copy)]
struct Retime {
    shape: usize,
    /// Change of time, s.
    later_s: f64,
}

/// Moves a shape in time. The first one stays at the start of the shot.
fn move_in_time(
    editor: &mut AuroraEditor,
    session: &mut Session,
    drawing: &AuroraDrawing,
    Retime { shape, later_s }: Retime,
    at: Pos2,
) {
    let change = drawing.retime(shape, drawing.transition_s(shape) + later_s);
    // Smaller changes vanish in the rounding of the text.
    if shape > 0 && later_s.abs() >= 0.005 {
        editor.change(session, "time of shape", &change, at);
    }
}
