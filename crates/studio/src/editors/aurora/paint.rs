//! Painting of the two maps.

use bansho::base::math::DVec2;

use super::{
    AuroraEditor,
    document::{AuroraDrawing, Factor, LinkedPoint, SheetPosition, StrokeEnd},
    plane::{Plane, Side},
    pointer::DragState,
    tool::DrawTool,
};
use crate::editors::aurora::document::polyline;

use eframe::egui::{Align2, Color32, FontId, Painter, Pos2, Response, Shape, Stroke, StrokeKind, pos2};

const BACKGROUND: Color32 = Color32::from_rgb(12, 15, 20);
const GRID: Color32 = Color32::from_rgb(30, 36, 44);
const TEXT: Color32 = Color32::from_rgb(110, 120, 132);
const FAINT: Color32 = Color32::from_rgb(72, 84, 96);
const PATH: Color32 = Color32::from_rgba_premultiplied(30, 48, 60, 90);
const SHEET: Color32 = Color32::from_rgb(120, 225, 170);
const SELECTED: Color32 = Color32::from_rgb(255, 208, 64);
const MARK: Color32 = Color32::from_rgb(255, 120, 90);
/// Only every sixth of the paths of control points is shown.
const PATH_STRIDE: usize = 6;

impl AuroraEditor {
    pub(super) fn paint(
        &self,
        painter: &Painter,
        drawing: &AuroraDrawing,
        plane: &Plane,
        side: Side,
        response: &Response,
    ) {
        paint_grid(painter, plane);
        match side {
            Side::Source => self.paint_source(painter, drawing, plane),
            Side::Target => self.paint_target(painter, drawing, plane),
        }
        if let Some(at) = response.hover_pos() {
            self.paint_pointer(painter, drawing, plane, side, at);
        }
    }

    fn paint_source(&self, painter: &Painter, drawing: &AuroraDrawing, plane: &Plane) {
        let Some(source) = self.target.checked_sub(1) else {
            let text = "the first shape comes from nothing:\ndraw it on the right";
            painter.text(plane.rect.center(), Align2::CENTER_CENTER, text, FontId::proportional(13.0), TEXT);
            return;
        };
        paint_title(painter, plane, &format!("shape {}", source + 1));
        let origins = self.target_sheet(drawing).map(|sheet| drawing.origins(self.target, sheet)).unwrap_or_default();
        for (number, sheet) in drawing.lines(source).iter().enumerate() {
            painter.line(plane.line(sheet), Stroke::new(2.0, SHEET));
            paint_number(painter, plane, sheet, number, SHEET);
        }
        for strand in origins {
            painter.line(plane.line(&strand), Stroke::new(2.5, SELECTED));
        }
        if self.tool == DrawTool::Merge {
            self.paint_ends(painter, drawing, plane, source);
        }
    }

    /// From the farthest layer to the nearest.
    fn paint_target(&self, painter: &Painter, drawing: &AuroraDrawing, plane: &Plane) {
        paint_title(painter, plane, &format!("shape {}", self.target + 1));
        self.paint_point_paths(painter, drawing, plane);
        self.paint_sheets(painter, drawing, plane);
        self.paint_drag(painter, drawing, plane);
    }

    /// The source shape, and the paths of its points.
    fn paint_point_paths(&self, painter: &Painter, drawing: &AuroraDrawing, plane: &Plane) {
        if let Some(source) = self.target.checked_sub(1) {
            for sheet in drawing.lines(source) {
                painter.line(plane.line(&sheet), Stroke::new(3.0, FAINT));
            }
            for point_path in drawing.point_paths(source).iter().flatten().step_by(PATH_STRIDE) {
                painter.line_segment(point_path.map(|end| plane.to_screen(end)), Stroke::new(1.0, PATH));
            }
        }
        for LinkedPoint { from, to, .. } in drawing.linked_points(self.target) {
            let [from, to] = [from, to].map(|end| plane.to_screen(end));
            painter.line_segment([from, to], Stroke::new(1.5, MARK));
            painter.circle_filled(to, 3.5, MARK);
        }
    }

    fn paint_sheets(&self, painter: &Painter, drawing: &AuroraDrawing, plane: &Plane) {
        let next = self.target_sheet(drawing);
        let shows_points =
            drawing.is_stated() && matches!(self.tool, DrawTool::Move | DrawTool::Smooth | DrawTool::Erase);
        for (number, sheet) in drawing.lines(self.target).iter().enumerate() {
            let color = match next {
                _ if !drawing.is_stated() => FAINT,
                Some(next) if next == number => SELECTED,
                _ => SHEET,
            };
            self.paint_sheet(painter, drawing, plane, number, sheet, color);
            paint_number(painter, plane, sheet, number, color);
            if shows_points {
                for point in drawing.points(self.target, number) {
                    painter.circle(plane.to_screen(point), 3.0, BACKGROUND, Stroke::new(1.2, color));
                }
            }
        }
    }

    /// The current drag.
    fn paint_drag(&self, painter: &Painter, drawing: &AuroraDrawing, plane: &Plane) {
        match &self.drag {
            DragState::Stroke(stroke) => {
                painter.line(plane.line(stroke), Stroke::new(2.5, SELECTED));
            }
            DragState::Linking { from, at, .. } => {
                let start = self.target.checked_sub(1).and_then(|source| point_on(&drawing.lines(source), *from));
                if let Some(start) = start {
                    painter.line_segment([plane.to_screen(start), *at], Stroke::new(2.0, MARK));
                }
            }
            _ => {}
        }
    }

    /// A sheet; its width shows the painted factor.
    fn paint_sheet(
        &self,
        painter: &Painter,
        drawing: &AuroraDrawing,
        plane: &Plane,
        number: usize,
        sheet: &[DVec2],
        color: Color32,
    ) {
        let factor = match self.tool {
            DrawTool::Energy => Factor::Energy,
            _ => Factor::Flux,
        };
        let factors = drawing.factors(self.target, number, factor);
        for (ends, factor) in sheet.windows(2).zip(factors) {
            let width = (2.2 * factor.clamp(0.15, 4.0)) as f32;
            painter.line_segment([plane.to_screen(ends[0]), plane.to_screen(ends[1])], Stroke::new(width, color));
        }
    }

    fn paint_ends(&self, painter: &Painter, drawing: &AuroraDrawing, plane: &Plane, source: usize) {
        for (number, sheet) in drawing.lines(source).iter().enumerate() {
            for (last, point) in [(false, sheet.first()), (true, sheet.last())] {
                let Some(&point) = point else { continue };
                let chosen = self.drag == DragState::MergeFrom(StrokeEnd { sheet: number, last });
                let color = if chosen { SELECTED } else { SHEET };
                painter.circle(plane.to_screen(point), 6.0, BACKGROUND, Stroke::new(2.0, color));
            }
        }
    }

    /// Previews what a click would do.
    fn paint_pointer(&self, painter: &Painter, drawing: &AuroraDrawing, plane: &Plane, side: Side, at: Pos2) {
        match (self.tool, side) {
            (DrawTool::Smooth | DrawTool::Erase | DrawTool::Brightness | DrawTool::Energy, Side::Target) => {
                painter.circle_stroke(at, self.tool.hit_radius(), Stroke::new(1.0, TEXT));
            }
            (DrawTool::Split, _) => {
                let Some(source) = self.target.checked_sub(1) else { return };
                let all = drawing.lines(source);
                let nearest = polyline::nearest_among(&all, plane.to_plane(at)).map(|(_, on)| on);
                if let Some(on) = nearest.filter(|on| on.distance < plane.km(self.tool.hit_radius())) {
                    let center = plane.to_screen(on.point);
                    painter.circle_stroke(center, 7.0, Stroke::new(2.0, MARK));
                    painter.vline(center.x, center.y - 12.0..=center.y + 12.0, Stroke::new(1.0, MARK));
                }
            }
            _ => {}
        }
    }
}

/// The point at a position on a sheet.
fn point_on(all: &[Vec<DVec2>], position: SheetPosition) -> Option<DVec2> {
    polyline::at(all.get(position.sheet)?, position.fraction)
}

fn paint_grid(painter: &Painter, plane: &Plane) {
    let rect = plane.rect;
    painter.rect(rect, 3.0, BACKGROUND, Stroke::new(1.0, GRID), StrokeKind::Inside);
    let step = plane.rect.width() / 8.0;
    for line in 1..8 {
        let offset = line as f32 * step;
        painter.vline(rect.left() + offset, rect.y_range(), Stroke::new(1.0, GRID));
        painter.hline(rect.x_range(), rect.top() + offset, Stroke::new(1.0, GRID));
    }
    painter.circle_stroke(rect.center(), 3.0, Stroke::new(1.0, TEXT));
    let font = FontId::proportional(11.0);
    painter.text(pos2(rect.center().x, rect.top() + 3.0), Align2::CENTER_TOP, "N", font.clone(), TEXT);
    let scale = format!("{} km a square", plane.extent_km / 8.0);
    painter.text(rect.right_bottom() + eframe::egui::vec2(-6.0, -4.0), Align2::RIGHT_BOTTOM, scale, font, TEXT);
}

fn paint_title(painter: &Painter, plane: &Plane, text: &str) {
    let at = plane.rect.left_top() + eframe::egui::vec2(7.0, 5.0);
    painter.text(at, Align2::LEFT_TOP, text, FontId::proportional(12.0), TEXT);
}

/// Paints the number of a sheet at its first point.
fn paint_number(painter: &Painter, plane: &Plane, sheet: &[DVec2], number: usize, color: Color32) {
    let Some(&start) = sheet.first() else { return };
    let at = plane.to_screen(start);
    painter.add(Shape::circle_filled(at, 3.0, color));
    painter.text(
        at + eframe::egui::vec2(-6.0, -3.0),
        Align2::RIGHT_BOTTOM,
        number + 1,
        FontId::proportional(12.0),
        color,
    );
}
