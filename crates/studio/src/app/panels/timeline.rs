//! The timeline: play, pause, step, scrub, the loop range, and keyframe marks.

use bansho::base::parameters::Value;
use eframe::egui::{self, Color32, CornerRadius, PointerButton, Rect, Sense, Stroke, Ui, pos2, vec2};

use crate::{
    app::widgets::icon::{self, Icon},
    document::keyframes,
    session::Session,
};

/// Shows the controls and the bar.
pub(crate) fn timeline_ui(ui: &mut Ui, session: &mut Session) {
    ui.horizontal(|ui| {
        transport_ui(ui, session);
        range_ui(ui, session);
    });
    bar_ui(ui, session);
}

fn transport_ui(ui: &mut Ui, session: &mut Session) {
    let transport = &mut session.transport;
    if icon::button_ui(ui, Icon::First, "First frame").clicked() {
        transport.go_to(*transport.range().start());
    }
    if icon::button_ui(ui, Icon::StepBack, "Frame back").clicked() {
        transport.step(-1);
    }
    let (icon, name) = if transport.is_playing() { (Icon::Pause, "Pause") } else { (Icon::Play, "Play") };
    if icon::button_ui(ui, icon, name).clicked() {
        transport.set_playing(!transport.is_playing());
    }
    if icon::button_ui(ui, Icon::StepForward, "Frame on").clicked() {
        transport.step(1);
    }
    let frames = transport.frames();
    let mut number = transport.number();
    let label = ui.label("Frame").id;
    if ui.add(egui::DragValue::new(&mut number).range(frames.clone())).labelled_by(label).changed() {
        transport.go_to(number);
    }
    ui.weak(format!("of {} to {}, {:.2} s", frames.start(), frames.end(), transport.time_s()));
}

fn range_ui(ui: &mut Ui, session: &mut Session) {
    ui.separator();
    let range = session.transport.range();
    let (mut first, mut last) = (*range.start(), *range.end());
    let label = ui.label("Loop").on_hover_text("The frames that are played, over and over").id;
    let frames = session.transport.frames();
    let mut changed = ui.add(egui::DragValue::new(&mut first).range(frames.clone())).labelled_by(label).changed();
    let label = ui.label("to").id;
    changed |= ui.add(egui::DragValue::new(&mut last).range(frames.clone())).labelled_by(label).changed();
    if changed {
        session.transport.set_range(Some(first..=last.max(first)));
    }
    if range != frames && ui.small_button("All").on_hover_text("Play the whole shot").clicked() {
        session.transport.set_range(None);
    }
}

/// Where frames are on the bar, from frame `first` at its left to `last` at its right.
struct Bar {
    rect: Rect,
    first: i64,
    last: i64,
}

impl Bar {
    /// The horizontal position of a frame, which may lie between two.
    fn x(&self, number: f64) -> f32 {
        let fraction = (number - self.first as f64) / (self.last - self.first) as f64;
        self.rect.left() + fraction as f32 * self.rect.width()
    }
}

fn bar_ui(ui: &mut Ui, session: &mut Session) {
    let (response, painter) = ui.allocate_painter(vec2(ui.available_width(), 22.0), Sense::click_and_drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Slider, true, "Timeline"));
    let rect = response.rect.shrink2(vec2(6.0, 3.0));
    let frames = session.transport.frames();
    // A shot of one frame has a bar of two, so that its length is not 0.
    let (first, last) = (*frames.start(), (*frames.end()).max(frames.start() + 1));
    let bar = Bar { rect, first, last };
    if let Some(at) = response.interact_pointer_pos().filter(|_| response.is_pointer_button_down_on()) {
        let fraction = f64::from(((at.x - rect.left()) / rect.width()).clamp(0.0, 1.0));
        session.transport.set_playing(false);
        session.transport.go_to(first + (fraction * (last - first) as f64).round() as i64);
    }
    let visuals = ui.visuals();
    painter.rect_filled(rect, CornerRadius::same(2), visuals.extreme_bg_color);
    let range = session.transport.range();
    let played = Rect::from_x_y_ranges(bar.x(*range.start() as f64)..=bar.x(*range.end() as f64), rect.y_range());
    painter.rect_filled(played, CornerRadius::same(2), visuals.widgets.inactive.bg_fill);
    let frame_s = session.transport.frame_s();
    for time in keyframe_times(session) {
        let at = pos2(bar.x(first as f64 + time / frame_s), rect.center().y);
        painter.circle_filled(at, 3.0, Color32::from_rgb(235, 170, 60));
    }
    let x = bar.x(session.transport.number() as f64);
    painter.vline(x, response.rect.y_range(), Stroke::new(2.0, visuals.selection.bg_fill));
    if response.secondary_clicked() || response.clicked_by(PointerButton::Middle) {
        session.transport.set_range(None);
    }
}

/// Times of all keyframes in the scene, s.
fn keyframe_times(session: &Session) -> Vec<f64> {
    fn collect(value: &Value, times: &mut Vec<f64>) {
        times.extend(keyframes::keyframes(value).into_iter().map(|key| key.time_s));
        match value {
            Value::Table(table) => table.entries.iter().for_each(|entry| collect(&entry.node.value, times)),
            Value::List(items) => items.iter().for_each(|item| collect(&item.value, times)),
            _ => {}
        }
    }
    let mut times = Vec::new();
    session.document.values().entries.iter().for_each(|entry| collect(&entry.node.value, &mut times));
    times
}
