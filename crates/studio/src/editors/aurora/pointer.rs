//! Pointer input on the two maps.

use bansho::base::math::DVec2;

use super::{
    AuroraEditor,
    document::{AuroraDrawing, Factor, SheetPosition, StrokeEnd},
    plane::{Plane, Side},
    tool::DrawTool,
};
use crate::{editors::aurora::document::polyline, session::Session};

use eframe::egui::{Event, PointerButton, Pos2, Response, Ui};

/// The state of a drag.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) enum DragState {
    #[default]
    None,
    /// The stroke drawn so far, km.
    Stroke(Vec<DVec2>),
    /// A dragged control point: the indices of its sheet and of the point on it.
    MovePoint { sheet: usize, point: usize },
    /// The first of two ends to merge.
    MergeFrom(StrokeEnd),
    /// A link from a position on the source to a sheet of the target: the whole sheet is linked, or only the point.
    Linking { from: SheetPosition, point_alone: bool, at: Pos2 },
}

impl DrawTool {
    /// The hit radius or the radius of the brush, points of the screen.
    pub(super) fn hit_radius(self) -> f32 {
        match self {
            Self::Smooth => 36.0,
            Self::Erase => 12.0,
            Self::Brightness | Self::Energy => 24.0,
            _ => 14.0,
        }
    }
}

impl AuroraEditor {
    /// Handles the pointer on one of the maps.
    pub(super) fn handle_pointer(
        &mut self,
        ui: &Ui,
        session: &mut Session,
        drawing: &AuroraDrawing,
        planes: &[Plane; 2],
        side: Side,
        response: &Response,
    ) {
        let Some(at) = response.interact_pointer_pos() else { return };
        if response.is_pointer_button_down_on() && ui.input(|input| input.pointer.any_pressed()) {
            self.shape_error = None;
        }
        let from = ui.input(|input| input.pointer.press_origin()).unwrap_or(at);
        let pointer = PointerInput { plane: &planes[side as usize], at, response, from };
        let pointer_path = pointer_path(ui);
        let lower = ui.input(|input| input.modifiers.shift);
        match (self.tool, side) {
            (DrawTool::Draw, Side::Target) => self.draw(session, drawing, &pointer, &pointer_path),
            (DrawTool::Move, Side::Target) => self.move_point(session, drawing, &pointer),
            (DrawTool::Smooth | DrawTool::Erase, Side::Target) => self.smooth_or_erase(session, drawing, &pointer),
            (DrawTool::Brightness, Side::Target) => self.brush(session, drawing, &pointer, Factor::Flux, lower),
            (DrawTool::Energy, Side::Target) => self.brush(session, drawing, &pointer, Factor::Energy, lower),
            (DrawTool::Split, _) if response.clicked() => self.split(session, drawing, &pointer),
            (DrawTool::Merge, _) if response.clicked() => self.merge(session, drawing, &pointer),
            (DrawTool::Link, _) => self.link(session, drawing, &pointer, side, planes),
            _ => {}
        }
    }

    fn draw(&mut self, session: &mut Session, drawing: &AuroraDrawing, pointer: &PointerInput, pointer_path: &[Pos2]) {
        /// Smallest distance between two points of a stroke, points of the screen.
        const STEP: f32 = 2.0;
        if pointer.response.clicked() {
            self.next_sheet =
                pointer.sheet_at(&drawing.lines(self.target)).or(self.next_sheet).filter(|_| drawing.is_stated());
        }
        if pointer.response.drag_started_by(PointerButton::Primary) {
            self.drag = DragState::Stroke(vec![pointer.plane.to_plane(pointer.from)]);
        }
        let DragState::Stroke(stroke) = &mut self.drag else { return };
        for point in pointer_path.iter().map(|&at| pointer.plane.to_plane(at)) {
            if stroke.last().is_none_or(|last| last.distance(point) >= pointer.plane.km(STEP)) {
                stroke.push(point);
            }
        }
        if !pointer.response.drag_stopped() {
            return;
        }
        let DragState::Stroke(stroke) = std::mem::take(&mut self.drag) else { return };
        let drawn = drawing.draw(self.target, self.target_sheet(drawing), &stroke);
        if self.change(session, "stroke", &drawn, pointer.at) {
            session.document.end_step();
            self.select_next_sheet(drawing);
        }
    }

    fn move_point(&mut self, session: &mut Session, drawing: &AuroraDrawing, pointer: &PointerInput) {
        if pointer.response.drag_started_by(PointerButton::Primary) {
            let from = pointer.plane.to_plane(pointer.from);
            let sheets = 0..drawing.lines(self.target).len();
            let all = sheets.flat_map(|sheet| {
                let points = drawing.points(self.target, sheet);
                points.into_iter().enumerate().map(move |(point, at)| (at.distance(from), sheet, point))
            });
            let nearest = all.min_by(|a, b| a.0.total_cmp(&b.0)).filter(|near| near.0 < pointer.hit_radius(self.tool));
            self.drag = nearest.map_or(DragState::None, |(_, sheet, point)| DragState::MovePoint { sheet, point });
        }
        let DragState::MovePoint { sheet, point } = self.drag else { return };
        let mut points = drawing.points(self.target, sheet);
        if let Some(dragged) = points.get_mut(point) {
            *dragged = pointer.point();
        }
        let moved = drawing.set_points(self.target, sheet, &points);
        if !moved.is_empty() {
            self.change(session, "move point", &moved, pointer.at);
        }
        if pointer.response.drag_stopped() {
            self.drag = DragState::None;
        }
    }

    /// Smooths or erases under the brush.
    fn smooth_or_erase(&mut self, session: &mut Session, drawing: &AuroraDrawing, pointer: &PointerInput) {
        if !pointer.response.dragged_by(PointerButton::Primary) && !pointer.response.clicked() {
            return;
        }
        let (around, radius) = (pointer.point(), pointer.hit_radius(self.tool));
        let lines = drawing.lines(self.target);
        let under_pointer =
            lines.iter().position(|line| polyline::nearest(line, around).is_some_and(|on| on.distance < radius));
        let Some(sheet) = under_pointer else { return };
        let mut points = drawing.points(self.target, sheet);
        let change = if self.tool == DrawTool::Smooth {
            drawing.set_points(self.target, sheet, &polyline::smoothed(&points, around, radius))
        } else {
            points.retain(|point| point.distance(around) >= radius);
            if points.len() < 2 {
                drawing.remove_sheet(self.target, sheet)
            } else {
                drawing.set_points(self.target, sheet, &points)
            }
        };
        let label = if self.tool == DrawTool::Smooth { "smooth" } else { "erase" };
        if !change.is_empty() {
            self.change(session, label, &change, pointer.at);
        }
    }

    /// Raises or lowers `factor` under the brush.
    fn brush(
        &mut self,
        session: &mut Session,
        drawing: &AuroraDrawing,
        pointer: &PointerInput,
        factor: Factor,
        lower: bool,
    ) {
        /// Change of the factor per point of the screen that the brush moves.
        const STRENGTH: f64 = 0.008;
        if !pointer.response.dragged_by(PointerButton::Primary) {
            return;
        }
        let all = drawing.lines(self.target);
        let Some(sheet) = pointer.sheet_near(&all, self.tool) else { return };
        let Some(on) = polyline::nearest(&all[sheet], pointer.point()) else { return };
        let moved = f64::from(pointer.response.drag_delta().length());
        let by = if lower { -STRENGTH * moved } else { STRENGTH * moved };
        let painted = drawing.paint(self.target, sheet, factor, polyline::fraction_of(&all[sheet], on), by);
        if !painted.is_empty() {
            self.change(session, "paint", &painted, pointer.at);
        }
    }

    fn split(&mut self, session: &mut Session, drawing: &AuroraDrawing, pointer: &PointerInput) {
        let Some(all) = self.source(drawing, pointer) else { return };
        let Some(sheet) = pointer.sheet_near(&all, self.tool) else { return };
        let Some(on) = polyline::nearest(&all[sheet], pointer.point()) else { return };
        let split = drawing.split(self.target, sheet, polyline::fraction_of(&all[sheet], on));
        if self.change(session, "split", &split, pointer.at) {
            (self.next_sheet, self.tool) = (Some(0), DrawTool::Draw);
        }
    }

    fn merge(&mut self, session: &mut Session, drawing: &AuroraDrawing, pointer: &PointerInput) {
        let Some(all) = self.source(drawing, pointer) else { return };
        let mut ends = Vec::new();
        for (sheet, line) in all.iter().enumerate() {
            for (point, last) in [(line.first(), false), (line.last(), true)] {
                ends.extend(point.map(|point| (point.distance(pointer.point()), StrokeEnd { sheet, last })));
            }
        }
        let nearest = ends.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, end)) = nearest.filter(|near| near.0 < pointer.hit_radius(self.tool)) else {
            if pointer.sheet_near(&all, self.tool).is_some() {
                self.shape_error = Some(("only ends merge: sheets never branch".into(), pointer.at));
            }
            return;
        };
        let DragState::MergeFrom(first) = self.drag else {
            self.drag = DragState::MergeFrom(end);
            return;
        };
        self.drag = DragState::None;
        let merge = drawing.merge(self.target, [first, end]);
        if self.change(session, "merge", &merge, pointer.at) {
            (self.next_sheet, self.tool) = (Some(0), DrawTool::Draw);
        }
    }

    /// Drags a link: from a sheet on the left map, or from a point that arrives on the right map. A click there removes a link.
    fn link(
        &mut self,
        session: &mut Session,
        drawing: &AuroraDrawing,
        pointer: &PointerInput,
        side: Side,
        planes: &[Plane; 2],
    ) {
        if pointer.response.drag_started_by(PointerButton::Primary) {
            let Some(all) = self.source(drawing, pointer) else { return };
            let pressed = PointerInput { at: pointer.from, ..*pointer };
            let from = match side {
                Side::Source => Some(pressed.point()),
                Side::Target => pressed.origin_of_arrival(drawing, self.target - 1),
            };
            let from = from.and_then(|from| on_sheet(&all, from, pointer.hit_radius(self.tool)));
            self.drag = match from {
                Some(from) => DragState::Linking { from, point_alone: side == Side::Target, at: pointer.at },
                None => DragState::None,
            };
        }
        if pointer.response.clicked() && side == Side::Target {
            let unlinked = drawing.unlink(self.target, pointer.point(), pointer.hit_radius(self.tool));
            if !unlinked.is_empty() {
                self.change(session, "unlink", &unlinked, pointer.at);
            }
        }
        let DragState::Linking { from, point_alone, at } = &mut self.drag else { return };
        *at = pointer.at;
        let (from, point_alone) = (*from, *point_alone);
        if pointer.response.drag_stopped() {
            self.drag = DragState::None;
            let plane = planes.iter().find(|plane| plane.rect.contains(pointer.at)).unwrap_or(pointer.plane);
            let released = PointerInput { plane, ..*pointer };
            let Some(to) = on_sheet(&drawing.lines(self.target), released.point(), released.hit_radius(self.tool))
            else {
                return;
            };
            let change = if point_alone {
                drawing.link_point(self.target, from, to)
            } else {
                drawing.link_sheet(self.target, from, to.sheet)
            };
            self.change(session, "link", &change, pointer.at);
        }
    }

    /// The sheets of the source shape; the first shape has none.
    fn source(&mut self, drawing: &AuroraDrawing, pointer: &PointerInput) -> Option<Vec<Vec<DVec2>>> {
        if self.target == 0 {
            let reason = "the first shape comes from nothing; add a shape, which the change then leads to";
            self.shape_error = Some((reason.into(), pointer.at));
            return None;
        }
        Some(drawing.lines(self.target - 1))
    }
}

/// The position on one of `all` that is nearest to `point`, within `hit_radius`, km.
fn on_sheet(all: &[Vec<DVec2>], point: DVec2, hit_radius: f64) -> Option<SheetPosition> {
    let (sheet, on) = polyline::nearest_among(all, point).filter(|(_, on)| on.distance < hit_radius)?;
    Some(SheetPosition { sheet, fraction: polyline::fraction_of(&all[sheet], on) })
}

/// The path of the pointer while pressed since the last frame, with all its events.
fn pointer_path(ui: &Ui) -> Vec<Pos2> {
    let mut pointer_path = Vec::new();
    ui.input(|input| {
        for event in &input.events {
            match event {
                Event::PointerButton { pressed: true, .. } => pointer_path.clear(),
                Event::PointerButton { pressed: false, .. } => break,
                Event::PointerMoved(at) => pointer_path.push(*at),
                _ => {}
            }
        }
    });
    pointer_path
}

/// The pointer on a plane.
#[derive(Clone, Copy)]
struct PointerInput<'a> {
    plane: &'a Plane,
    response: &'a Response,
    /// The current position.
    at: Pos2,
    /// The position of the press.
    from: Pos2,
}

impl PointerInput<'_> {
    fn point(&self) -> DVec2 {
        self.plane.to_plane(self.at)
    }

    /// The hit radius of `tool`, km.
    fn hit_radius(&self, tool: DrawTool) -> f64 {
        self.plane.km(tool.hit_radius())
    }

    /// The sheet nearest to the pointer, within the hit radius of `tool`.
    fn sheet_near(&self, all: &[Vec<DVec2>], tool: DrawTool) -> Option<usize> {
        on_sheet(all, self.point(), self.hit_radius(tool)).map(|position| position.sheet)
    }

    /// The point on shape `before` of the control point that arrives nearest to the pointer.
    fn origin_of_arrival(&self, drawing: &AuroraDrawing, before: usize) -> Option<DVec2> {
        let point_paths = drawing.point_paths(before);
        let paths = point_paths.iter().flatten().map(|[origin, arrival]| (arrival.distance(self.point()), *origin));
        let nearest = paths.min_by(|a, b| a.0.total_cmp(&b.0));
        nearest.filter(|(distance, _)| *distance < self.hit_radius(DrawTool::Link)).map(|(_, origin)| origin)
    }

    fn sheet_at(&self, all: &[Vec<DVec2>]) -> Option<usize> {
        self.sheet_near(all, DrawTool::Draw)
    }
}
