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
        let pen = Pen { rect, stroke: Stroke::new(1.5, stroke.color) };
        match self {
            Self::First => vec![pen.bar(-0.1), pen.filled(&[[1.1, 0.0], [1.1, 1.0], [0.3, 0.5]])],
            Self::StepBack => vec![pen.filled(&[[0.75, 0.1], [0.75, 0.9], [0.15, 0.5]])],
            Self::Play => vec![pen.filled(&[[0.1, -0.1], [1.1, 0.5], [0.1, 1.1]])],
            Self::Pause => vec![pen.bar(0.08), pen.bar(0.64)],
            Self::StepForward => vec![pen.filled(&[[0.25, 0.1], [0.85, 0.5], [0.25, 0.9]])],
            Self::Constant => vec![pen.line(&DIAMOND)],
            Self::Keyframed => vec![pen.line(&DIAMOND), Shape::circle_filled(rect.center(), 1.8, stroke.color)],
            Self::KeyframeHere => vec![pen.filled(&DIAMOND)],
            Self::Reset => pen.reset_arrow(),
            Self::Cross => vec![pen.line(&[[0.1, 0.1], [0.9, 0.9]]), pen.line(&[[0.9, 0.1], [0.1, 0.9]])],
        }
    }
}

/// A closed diamond around the whole icon.
const DIAMOND: [[f32; 2]; 5] = [[0.5, -0.1], [1.1, 0.5], [0.5, 1.1], [-0.1, 0.5], [0.5, -0.1]];

/// Draws in fractions of a rectangle, from its upper left corner.
struct Pen {
    rect: Rect,
    stroke: Stroke,
}

impl Pen {
    fn at(&self, [x, y]: [f32; 2]) -> Pos2 {
        pos2(self.rect.left() + x * self.rect.width(), self.rect.top() + y * self.rect.height())
    }

    fn points(&self, points: &[[f32; 2]]) -> Vec<Pos2> {
        points.iter().map(|point| self.at(*point)).collect()
    }

    /// A line through points.
    fn line(&self, points: &[[f32; 2]]) -> Shape {
        Shape::line(self.points(points), self.stroke)
    }

    /// A convex polygon.
    fn filled(&self, points: &[[f32; 2]]) -> Shape {
        Shape::convex_polygon(self.points(points), self.stroke.color, Stroke::NONE)
    }

    /// A vertical bar of the whole height, whose left side is at `x`.
    fn bar(&self, x: f32) -> Shape {
        let corners = Rect::from_min_max(self.at([x, 0.0]), self.at([x + 0.28, 1.0]));
        Shape::rect_filled(corners, 0.0, self.stroke.color)
    }

    /// An arc of three quarters of a circle with an arrowhead at its start.
    fn reset_arrow(&self) -> Vec<Shape> {
        let (center, radius) = (self.rect.center(), 0.5 * self.rect.width());
        let arc = (0..=18).map(|step| -0.12 + 0.75 * step as f32 / 18.0);
        let arc = arc.map(|turns| center + radius * Vec2::angled(std::f32::consts::TAU * turns)).collect::<Vec<_>>();
        let tip = arc[0];
        let heads = [vec2(-4.0, -0.5), vec2(0.5, -4.0)].map(|by| Shape::line_segment([tip, tip + by], self.stroke));
        [Shape::line(arc, self.stroke)].into_iter().chain(heads).collect()
    }
}
