//! Small buttons with painted icons, which look the same with every font.

use eframe::egui::{self, Pos2, Rect, Response, Sense, Shape, Stroke, StrokeKind, Ui, Vec2, pos2, vec2};

/// The icon of a button.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Icon {
    /// Go to the first frame.
    First,
    /// Go one frame back.
    StepBack,
    /// Play.
    Play,
    /// Pause.
    Pause,
    /// Go one frame forward.
    StepForward,
    /// A keyframe can be set; the value has none.
    Constant,
    /// The value has keyframes, but none at the current time.
    Keyframed,
    /// The value has a keyframe at the current time.
    KeyframeHere,
    /// Reset to the default.
    Reset,
    /// Remove, dismiss or stop.
    Cross,
}

/// Shows a button with `icon`. `name` says what it does.
pub(crate) fn button_ui(ui: &mut Ui, icon: Icon, name: &str) -> Response {
    let (rect, response) = ui.allocate_exact_size(Vec2::splat(ui.spacing().interact_size.y), Sense::click());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, ui.is_enabled(), name));
    if ui.is_rect_visible(rect) {
        let visuals = ui.style().interact(&response);
        ui.painter().rect(rect, visuals.corner_radius, visuals.weak_bg_fill, visuals.bg_stroke, StrokeKind::Inside);
        ui.painter().extend(icon.shapes(rect.shrink(0.3 * rect.height()), visuals.fg_stroke));
    }
    response.on_hover_text(name)
}

impl Icon {
    fn shapes(self, rect: Rect, stroke: Stroke) -> Vec<Shape> {
        let filled = |points: Vec<Pos2>| Shape::convex_polygon(points, stroke.color, Stroke::NONE);
        let line = |points: Vec<Pos2>| Shape::line(points, Stroke::new(1.5, stroke.color));
        let at = |x: f32, y: f32| pos2(rect.left() + x * rect.width(), rect.top() + y * rect.height());
        let bar = |x: f32| Shape::rect_filled(Rect::from_min_max(at(x, 0.0), at(x + 0.28, 1.0)), 0.0, stroke.color);
        let diamond = || vec![at(0.5, -0.1), at(1.1, 0.5), at(0.5, 1.1), at(-0.1, 0.5), at(0.5, -0.1)];
        match self {
            Self::First => vec![bar(-0.1), filled(vec![at(1.1, 0.0), at(1.1, 1.0), at(0.3, 0.5)])],
            Self::StepBack => vec![filled(vec![at(0.75, 0.1), at(0.75, 0.9), at(0.15, 0.5)])],
            Self::Play => vec![filled(vec![at(0.1, -0.1), at(1.1, 0.5), at(0.1, 1.1)])],
            Self::Pause => vec![bar(0.08), bar(0.64)],
            Self::StepForward => vec![filled(vec![at(0.25, 0.1), at(0.85, 0.5), at(0.25, 0.9)])],
            Self::Constant => vec![line(diamond())],
            Self::Keyframed => vec![line(diamond()), Shape::circle_filled(rect.center(), 1.8, stroke.color)],
            Self::KeyframeHere => vec![filled(diamond())],
            Self::Reset => reset_shapes(rect, stroke),
            Self::Cross => vec![line(vec![at(0.1, 0.1), at(0.9, 0.9)]), line(vec![at(0.9, 0.1), at(0.1, 0.9)])],
        }
    }
}

/// An arc with an arrowhead.
fn reset_shapes(rect: Rect, stroke: Stroke) -> Vec<Shape> {
    let radius = 0.5 * rect.width();
    let on = |turns: f32| rect.center() + radius * Vec2::angled(std::f32::consts::TAU * turns);
    let arc = (0..=18).map(|step| on(-0.12 + 0.75 * step as f32 / 18.0)).collect();
    let head = |by: Vec2| Shape::line_segment([on(-0.12), on(-0.12) + by], Stroke::new(1.5, stroke.color));
    vec![Shape::line(arc, Stroke::new(1.5, stroke.color)), head(vec2(-4.0, -0.5)), head(vec2(0.5, -4.0))]
}
