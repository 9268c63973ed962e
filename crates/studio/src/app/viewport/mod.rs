//! The viewport: the picture, and dragging in it to move the camera, the wind, lamps and burners.

mod curve_overlay;
mod handles;
mod pointer;
pub(in crate::app) mod wind_drag;

use bansho::{
    base::{camera::Camera, math::DVec2, parameters::Value},
    scene::ValuePath,
};

use crate::{
    app::widgets::picture_texture::PictureTexture,
    document::editor_hints::WindScale,
    session::{Session, selection::Selection},
};
use eframe::egui::{self, Color32, PointerButton, Pos2, Rect, Response, Sense, Shape, Stroke, Ui, Vec2, pos2, vec2};
use handles::{Handle, handles};
use pointer::{CameraPose, rounded};
use wind_drag::{WindDrag, wind_hint, wind_scale};

/// The margin around the picture: dark, but not black, so that the border of the picture is visible.
const SURROUND: Color32 = Color32::from_gray(18);

/// What a drag with the primary button does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum ViewportTool {
    /// Orbits the camera around its target.
    #[default]
    Camera,
    /// Sets the wind to the drag vector.
    Wind,
    /// Moves the handles of lamps and phenomena.
    MoveHandles,
}

/// The viewport.
#[derive(Default)]
pub(super) struct Viewport {
    texture: PictureTexture,
    pixels: [usize; 2],
    tool: ViewportTool,
    wind_drag: Option<WindDrag>,
    /// The handle that is dragged.
    dragged: Option<ValuePath>,
    /// Whether curve editors are shown on the picture.
    curves: bool,
}

impl Viewport {
    /// Size of the viewport, physical pixels.
    pub(super) fn pixels(&self) -> [usize; 2] {
        self.pixels
    }

    /// Shows the picture and handles dragging in it.
    pub(super) fn ui(&mut self, ui: &mut Ui, session: &mut Session, selection: &Selection) {
        let background = ui.painter().add(Shape::Noop);
        let panel = ui.clip_rect();
        self.tools_ui(ui, session, selection);
        let (response, painter) = ui.allocate_painter(ui.available_size(), Sense::click_and_drag());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Viewport"));
        let scale = ui.ctx().pixels_per_point();
        self.pixels = [response.rect.width(), response.rect.height()].map(|side| (side * scale).max(1.0) as usize);
        ui.painter().set(background, fill_around(panel, response.rect, ui.visuals().panel_fill));
        let Some(size) = self.upload_picture(ui, session) else {
            painter.rect_filled(response.rect, 0.0, SURROUND);
            let text = if session.document.error().is_some() { "nothing to show yet" } else { "drawing…" };
            let font = egui::FontId::proportional(16.0);
            painter.text(response.rect.center(), egui::Align2::CENTER_CENTER, text, font, Color32::GRAY);
            return;
        };
        let drawn = session.picture().map_or(size, |(picture, _)| picture.size);
        let frame = snap_to_pixels(fit_within(size, response.rect), drawn, scale);
        painter.add(fill_around(response.rect, frame, SURROUND));
        if let Some(texture) = self.texture.id() {
            let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
            painter.image(texture, frame, whole, Color32::WHITE);
        }
        self.handle_pointer(ui, session, &response, frame);
        self.paint_handles(session, &painter, frame);
        if self.curves && curve_overlay::has_any(selection) {
            curve_overlay::curve_overlay_ui(ui, session, selection, response.rect);
        }
    }

    fn tools_ui(&mut self, ui: &mut Ui, session: &mut Session, selection: &Selection) {
        ui.horizontal_wrapped(|ui| {
            ui.selectable_value(&mut self.tool, ViewportTool::Camera, "Camera")
                .on_hover_text("Drag to orbit, with Shift or the middle button to pan, scroll to dolly");
            ui.selectable_value(&mut self.tool, ViewportTool::Wind, "Blow")
                .on_hover_text(wind_hint(wind_scale(session)));
            ui.selectable_value(&mut self.tool, ViewportTool::MoveHandles, "Place")
                .on_hover_text("Drag lamps, flames and burners");
            ui.toggle_value(&mut session.recording, "Record")
                .on_hover_text("Dragging sets keyframes; playback runs during drags of wind and handles");
            ui.toggle_value(&mut session.draft, "Draft")
                .on_hover_text("Simulates with fewer particles, for faster feedback; rendering always uses all");
            if curve_overlay::has_any(selection) {
                ui.toggle_value(&mut self.curves, "Curves")
                    .on_hover_text("The curves of the selection, on the picture");
            }
            ui.separator();
            exposure_ui(ui, session);
        });
    }

    /// Uploads a new picture to the texture. Returns the size of the scene's picture.
    pub(super) fn upload_picture(&mut self, ui: &Ui, session: &Session) -> Option<[usize; 2]> {
        let (picture, serial) = session.picture()?;
        self.texture.upload(ui.ctx(), "picture", picture, serial);
        Some(picture.scene_size)
    }

    fn handle_pointer(&mut self, ui: &Ui, session: &mut Session, response: &Response, frame: Rect) {
        let Some(plan) = session.plan().cloned() else { return };
        let time = session.transport.time_s();
        let camera = plan.scene().camera.at(time, plan.size());
        let pose = CameraPose::at_time(&plan, session.document.values(), time);
        let drag = in_heights(response.drag_delta(), frame);
        let shift = ui.input(|input| input.modifiers.shift);
        let is_pan = response.dragged_by(PointerButton::Middle)
            || (shift && self.tool == ViewportTool::Camera && response.dragged_by(PointerButton::Primary));
        if is_pan {
            set_camera(session, pose.panned(drag, &camera));
        } else if response.dragged_by(PointerButton::Primary)
            && self.tool == ViewportTool::Camera
            && drag != DVec2::ZERO
        {
            set_camera(session, pose.rotated(drag, &camera));
        }
        self.dolly(ui, session, response, pose);
        self.drag_wind(session, response, &camera, in_heights(response.total_drag_delta().unwrap_or_default(), frame));
        self.drag_handle(ui, session, response, &camera, frame);
    }

    fn dolly(&self, ui: &Ui, session: &mut Session, response: &Response, pose: CameraPose) {
        /// Scroll points per dolly step.
        const STEP: f32 = 50.0;
        let scrolled = ui.input(|input| input.smooth_scroll_delta().y);
        if response.hovered() && scrolled != 0.0 {
            set_camera(session, pose.dollied(f64::from(scrolled / STEP)));
        }
    }

    fn drag_wind(&mut self, session: &mut Session, response: &Response, camera: &Camera, drag: DVec2) {
        if self.tool != ViewportTool::Wind {
            return;
        }
        if response.drag_started_by(PointerButton::Primary) {
            self.wind_drag = Some(WindDrag::begin(session));
        }
        match &self.wind_drag {
            Some(wind_drag) if response.dragged_by(PointerButton::Primary) => {
                let WindScale { strong, .. } = wind_scale(session);
                wind_drag.update(session, pointer::wind_of_drag(drag, strong, camera));
            }
            _ => {}
        }
        if response.drag_stopped_by(PointerButton::Primary)
            && let Some(wind_drag) = self.wind_drag.take()
        {
            wind_drag.end(session);
        }
    }

    /// Ends a wind drag, for example before saving. Wind that is not recorded is reset.
    pub(super) fn end_wind_drag(&mut self, session: &mut Session) {
        if let Some(wind_drag) = self.wind_drag.take() {
            wind_drag.end(session);
        }
    }

    fn drag_handle(&mut self, ui: &Ui, session: &mut Session, response: &Response, camera: &Camera, frame: Rect) {
        if self.tool != ViewportTool::MoveHandles {
            return;
        }
        let handles = handles(session);
        if response.drag_started_by(PointerButton::Primary) {
            let pressed_at = ui.input(|input| input.pointer.press_origin());
            self.dragged =
                pressed_at.and_then(|at| handle_near(&handles, at, camera, frame)).map(|handle| handle.path.clone());
            if session.recording && self.dragged.is_some() {
                session.transport.play_to_the_end();
            }
        }
        if !response.dragged_by(PointerButton::Primary) && self.dragged.take().is_some() && session.recording {
            session.transport.set_playing(false);
        }
        // Recording stops at the end of the shot.
        let ended = session.recording && !session.transport.is_playing();
        let dragged = handles.iter().find(|handle| Some(&handle.path) == self.dragged.as_ref()).filter(|_| !ended);
        if let (Some(handle), Some(at)) = (dragged, response.interact_pointer_pos())
            && let Some(moved) = pointer::move_at_depth(handle.point, to_picture(at, camera, frame), camera)
        {
            session.set("place", &handle.path, Value::numbers(rounded(moved - handle.origin)));
        }
    }

    fn paint_handles(&self, session: &Session, painter: &egui::Painter, frame: Rect) {
        let Some(plan) = session.plan().filter(|_| self.tool == ViewportTool::MoveHandles) else { return };
        let camera = plan.scene().camera.at(session.transport.time_s(), plan.size());
        for handle in handles(session) {
            let Some(projected) = camera.project(handle.point) else { continue };
            let at = to_screen(projected.pixel, &camera, frame);
            let width = if Some(&handle.path) == self.dragged.as_ref() { 3.0 } else { 1.5 };
            painter.circle_stroke(at, 8.0, Stroke::new(width, Color32::from_rgb(255, 210, 90)));
            let font = egui::FontId::proportional(12.0);
            painter.text(at + vec2(11.0, 0.0), egui::Align2::LEFT_CENTER, handle.name, font, Color32::from_gray(220));
        }
    }
}

/// A drag in points as heights of the picture, which fills `frame`.
fn in_heights(drag: Vec2, frame: Rect) -> DVec2 {
    DVec2::new(f64::from(drag.x), f64::from(drag.y)) / f64::from(frame.height())
}

/// The handle that is shown nearest to `at`, if one is close enough to be dragged.
fn handle_near<'a>(handles: &'a [Handle], at: Pos2, camera: &Camera, frame: Rect) -> Option<&'a Handle> {
    /// Hit radius of a handle, points.
    const HIT_RADIUS: f32 = 14.0;
    let distances = handles.iter().filter_map(|handle| {
        let pixel = camera.project(handle.point)?.pixel;
        Some((to_screen(pixel, camera, frame).distance(at), handle))
    });
    let nearest = distances.min_by(|a, b| a.0.total_cmp(&b.0));
    nearest.filter(|(distance, _)| *distance < HIT_RADIUS).map(|(_, handle)| handle)
}

fn set_camera(session: &mut Session, pose: CameraPose) {
    let camera = ValuePath::root().key("camera");
    let values = [("position", pose.position), ("target", pose.target)];
    session.set_all("camera", values.map(|(key, to)| (camera.key(key), Value::numbers(rounded(to)))));
}

/// The exposure of the scene; a change replaces the automatic one.
fn exposure_ui(ui: &mut Ui, session: &mut Session) {
    let Some(mut ev100) = session.plan().map(|plan| f64::from(plan.exposure_ev100)) else { return };
    let path = ValuePath::root().key("picture").key("exposure_ev100");
    let label = ui.label("Exposure").on_hover_text("Exposure value at ISO 100; less is brighter").id;
    let drag = egui::DragValue::new(&mut ev100)
        .clamp_existing_to_range(false)
        .speed(0.02)
        .range(-40.0..=40.0)
        .max_decimals(2)
        .suffix(" EV");
    if ui.add(drag).labelled_by(label).changed() {
        session.set("exposure", &path, Value::Number((ev100 * 100.0).round() / 100.0));
    }
    if ui.small_button("Auto").on_hover_text("Automatic exposure of the scene").clicked() {
        session.set("exposure", &path, Value::Text("auto".into()));
    }
}

/// The largest rectangle with the picture's aspect ratio, centered in `within`.
fn fit_within([width, height]: [usize; 2], within: Rect) -> Rect {
    let size = vec2(width as f32, height as f32);
    let scale = (within.width() / size.x).min(within.height() / size.y);
    Rect::from_center_size(within.center(), size * scale)
}

/// `frame` aligned to the pixels of the screen, which has `scale` pixels per point. If the picture of `drawn` pixels has the same size up
/// to rounding, the frame gets exactly its size, so that the picture is shown without resampling.
fn snap_to_pixels(frame: Rect, drawn: [usize; 2], scale: f32) -> Rect {
    let (position, size) = (frame.min.to_vec2() * scale, frame.size() * scale);
    let drawn = vec2(drawn[0] as f32, drawn[1] as f32);
    let is_same_size = (size - drawn).abs().max_elem() < 1.5;
    let size = if is_same_size { drawn } else { size.round() };
    Rect::from_min_size((position.round() / scale).to_pos2(), size / scale)
}

/// The area of `whole` outside of `hole`, filled. Painting no pixel twice is faster with the software rasterizer.
fn fill_around(whole: Rect, hole: Rect, fill: Color32) -> Shape {
    let hole = hole.intersect(whole);
    let strips = [
        Rect::from_min_max(whole.min, pos2(whole.max.x, hole.min.y)),
        Rect::from_min_max(pos2(whole.min.x, hole.min.y), pos2(hole.min.x, hole.max.y)),
        Rect::from_min_max(pos2(hole.max.x, hole.min.y), pos2(whole.max.x, hole.max.y)),
        Rect::from_min_max(pos2(whole.min.x, hole.max.y), whole.max),
    ];
    let visible = strips.into_iter().filter(|strip| strip.is_positive());
    Shape::Vec(visible.map(|strip| Shape::rect_filled(strip, 0.0, fill)).collect())
}

/// The position on the screen of a pixel of the camera's picture, which fills `frame`.
fn to_screen(pixel: DVec2, camera: &Camera, frame: Rect) -> Pos2 {
    let fraction = vec2((pixel.x / camera.size[0]) as f32, (pixel.y / camera.size[1]) as f32);
    frame.min + fraction * frame.size()
}

/// The inverse of [`to_screen`].
fn to_picture(at: Pos2, camera: &Camera, frame: Rect) -> DVec2 {
    let fraction = (at - frame.min) / frame.size();
    DVec2::new(f64::from(fraction.x) * camera.size[0], f64::from(fraction.y) * camera.size[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_of_the_viewports_size_is_aligned_to_pixels() {
        let within = Rect::from_min_size(pos2(210.0, 60.4), vec2(853.6, 601.0));
        let frame = fit_within([1280, 720], within);
        assert_eq!(snap_to_pixels(frame, [853, 480], 1.0), Rect::from_min_size(pos2(210.0, 121.0), vec2(853.0, 480.0)));
        // Two pixels per point.
        assert_eq!(
            snap_to_pixels(frame, [1707, 960], 2.0),
            Rect::from_min_size(pos2(210.0, 121.0), vec2(853.5, 480.0))
        );
        // A preview fills the same frame, aligned to pixels.
        assert_eq!(snap_to_pixels(frame, [427, 240], 1.0), Rect::from_min_size(pos2(210.0, 121.0), vec2(854.0, 480.0)));
    }
}
