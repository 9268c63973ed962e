//! What hands do in the planes.

use bansho::base::math::DVec2;

use super::{
    AuroraEditor,
    document::{Drawing, End, Factor, OnSheet},
    plane::{Plane, Side},
    tool::Tool,
};
use crate::{editors::aurora::document::lines, session::Session};
use eframe::egui::{Event, PointerButton, Pos2, Response, Ui};

/// What is under way.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) enum Gesture {
    #[default]
    None,
    /// A stroke as far as it is drawn, km.
    Stroke(Vec<DVec2>),
    /// A point that is held: sheet and point.
    Holding(usize, usize),
    /// The first of two ends that shall merge.
    FirstEnd(End),
    /// From a place on the source, to be let go over a sheet of the target: the sheet is linked, or the point alone.
    Linking { from: OnSheet, point_alone: bool, at: Pos2 },
}

impl Tool {
    /// How near the pointer must come, or how wide it brushes, points of the screen.
    pub(super) fn reach(self) -> f32 {
        match self {
            Self::Smooth => 36.0,
            Self::Erase => 12.0,
            Self::Brightness | Self::Energy => 24.0,
            _ => 14.0,
        }
    }
}

impl AuroraEditor {
    /// Takes in what hands do on one of the planes.
    pub(super) fn hands(
        &mut self,
        ui: &Ui,
        session: &mut Session,
        drawing: &Drawing,
        planes: &[Plane; 2],
        side: Side,
        response: &Response,
    ) {
        let Some(at) = response.interact_pointer_pos() else { return };
        if response.is_pointer_button_down_on() && ui.input(|input| input.pointer.any_pressed()) {
            self.refusal = None;
        }
        let from = ui.input(|input| input.pointer.press_origin()).unwrap_or(at);
        let hand = Hand { plane: &planes[side as usize], at, response, from };
        let way = way(ui);
        let lower = ui.input(|input| input.modifiers.shift);
        match (self.tool, side) {
            (Tool::Draw, Side::Target) => self.draw(session, drawing, &hand, &way),
            (Tool::Move, Side::Target) => self.move_point(session, drawing, &hand),
            (Tool::Smooth | Tool::Erase, Side::Target) => self.mend(session, drawing, &hand),
            (Tool::Brightness, Side::Target) => self.brush(session, drawing, &hand, Factor::Flux, lower),
            (Tool::Energy, Side::Target) => self.brush(session, drawing, &hand, Factor::Energy, lower),
            (Tool::Split, _) if response.clicked() => self.split(session, drawing, &hand),
            (Tool::Merge, _) if response.clicked() => self.merge(session, drawing, &hand),
            (Tool::Link, _) => self.link(session, drawing, &hand, side, planes),
            _ => {}
        }
    }

    fn draw(&mut self, session: &mut Session, drawing: &Drawing, hand: &Hand, way: &[Pos2]) {
        /// Points of the screen that a hand moves at least between two points of a stroke.
        const STEP: f32 = 2.0;
        if hand.response.clicked() {
            self.next = hand.sheet_of(&drawing.lines(self.target)).or(self.next).filter(|_| drawing.is_stated());
        }
        if hand.response.drag_started_by(PointerButton::Primary) {
            self.gesture = Gesture::Stroke(vec![hand.plane.to_plane(hand.from)]);
        }
        let Gesture::Stroke(stroke) = &mut self.gesture else { return };
        for point in way.iter().map(|&at| hand.plane.to_plane(at)) {
            if stroke.last().is_none_or(|last| last.distance(point) >= hand.plane.km(STEP)) {
                stroke.push(point);
            }
        }
        if !hand.response.drag_stopped() {
            return;
        }
        let Gesture::Stroke(stroke) = std::mem::take(&mut self.gesture) else { return };
        let drawn = drawing.draw(self.target, self.slot(drawing), &stroke);
        if self.change(session, "stroke", &drawn, hand.at) {
            session.document.seal();
            self.advance(drawing);
        }
    }

    fn move_point(&mut self, session: &mut Session, drawing: &Drawing, hand: &Hand) {
        if hand.response.drag_started_by(PointerButton::Primary) {
            let from = hand.plane.to_plane(hand.from);
            let sheets = 0..drawing.lines(self.target).len();
            let all = sheets.flat_map(|sheet| {
                let points = drawing.points(self.target, sheet);
                points.into_iter().enumerate().map(move |(point, at)| (at.distance(from), sheet, point))
            });
            let nearest = all.min_by(|a, b| a.0.total_cmp(&b.0)).filter(|near| near.0 < hand.reach(self.tool));
            self.gesture = nearest.map_or(Gesture::None, |(_, sheet, point)| Gesture::Holding(sheet, point));
        }
        let Gesture::Holding(sheet, point) = self.gesture else { return };
        let mut points = drawing.points(self.target, sheet);
        if let Some(held) = points.get_mut(point) {
            *held = hand.point();
        }
        let moved = drawing.set_points(self.target, sheet, &points);
        if !moved.is_empty() {
            self.change(session, "move point", &moved, hand.at);
        }
        if hand.response.drag_stopped() {
            self.gesture = Gesture::None;
        }
    }

    /// Smooths or erases what is under the brush.
    fn mend(&mut self, session: &mut Session, drawing: &Drawing, hand: &Hand) {
        if !hand.response.dragged_by(PointerButton::Primary) && !hand.response.clicked() {
            return;
        }
        let (around, radius) = (hand.point(), hand.reach(self.tool));
        let under = |line: &[DVec2]| lines::nearest(line, around).is_some_and(|on| on.distance < radius);
        let Some(sheet) = drawing.lines(self.target).iter().position(|line| under(line)) else { return };
        let mut points = drawing.points(self.target, sheet);
        let change = if self.tool == Tool::Smooth {
            drawing.set_points(self.target, sheet, &lines::smoothed(&points, around, radius))
        } else {
            points.retain(|point| point.distance(around) >= radius);
            if points.len() < 2 {
                drawing.remove_sheet(self.target, sheet)
            } else {
                drawing.set_points(self.target, sheet, &points)
            }
        };
        let label = if self.tool == Tool::Smooth { "smooth" } else { "erase" };
        if !change.is_empty() {
            self.change(session, label, &change, hand.at);
        }
    }

    /// More of `factor` under the brush, or less.
    fn brush(&mut self, session: &mut Session, drawing: &Drawing, hand: &Hand, factor: Factor, lower: bool) {
        /// What a point of the screen that the brush moves adds.
        const STRENGTH: f64 = 0.008;
        if !hand.response.dragged_by(PointerButton::Primary) {
            return;
        }
        let all = drawing.lines(self.target);
        let Some(sheet) = hand.near(&all, self.tool) else { return };
        let Some(on) = lines::nearest(&all[sheet], hand.point()) else { return };
        let moved = f64::from(hand.response.drag_delta().length());
        let by = if lower { -STRENGTH * moved } else { STRENGTH * moved };
        let painted = drawing.paint(self.target, sheet, factor, lines::share_of(&all[sheet], on), by);
        if !painted.is_empty() {
            self.change(session, "paint", &painted, hand.at);
        }
    }

    fn split(&mut self, session: &mut Session, drawing: &Drawing, hand: &Hand) {
        let Some(all) = self.source(drawing, hand) else { return };
        let Some(sheet) = hand.near(&all, self.tool) else { return };
        let Some(on) = lines::nearest(&all[sheet], hand.point()) else { return };
        let split = drawing.split(self.target, sheet, lines::share_of(&all[sheet], on));
        if self.change(session, "split", &split, hand.at) {
            (self.next, self.tool) = (Some(0), Tool::Draw);
        }
    }

    fn merge(&mut self, session: &mut Session, drawing: &Drawing, hand: &Hand) {
        let Some(all) = self.source(drawing, hand) else { return };
        let ends = all.iter().enumerate().flat_map(|(sheet, line)| {
            [(line.first(), false), (line.last(), true)].map(|(point, last)| (point.copied(), (sheet, last)))
        });
        let near = |(point, end): (Option<DVec2>, End)| Some((point?.distance(hand.point()), end));
        let nearest = ends.filter_map(near).min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, end)) = nearest.filter(|near| near.0 < hand.reach(self.tool)) else {
            if hand.near(&all, self.tool).is_some() {
                self.refusal = Some(("only ends merge: sheets never branch".into(), hand.at));
            }
            return;
        };
        let Gesture::FirstEnd(first) = self.gesture else {
            self.gesture = Gesture::FirstEnd(end);
            return;
        };
        self.gesture = Gesture::None;
        let merge = drawing.merge(self.target, [first, end]);
        if self.change(session, "merge", &merge, hand.at) {
            (self.next, self.tool) = (Some(0), Tool::Draw);
        }
    }

    /// On the left a sheet is taken, on the right one of the points that arrive there; a click there lets a linked one go.
    fn link(&mut self, session: &mut Session, drawing: &Drawing, hand: &Hand, side: Side, planes: &[Plane; 2]) {
        if hand.response.drag_started_by(PointerButton::Primary) {
            let Some(all) = self.source(drawing, hand) else { return };
            let pressed = Hand { at: hand.from, ..*hand };
            let from = match side {
                Side::Source => Some(pressed.point()),
                Side::Target => pressed.arrival(drawing, self.target - 1),
            };
            let from = from.and_then(|from| on_sheet(&all, from, hand.reach(self.tool)));
            let linking = |from| Gesture::Linking { from, point_alone: side == Side::Target, at: hand.at };
            self.gesture = from.map_or(Gesture::None, linking);
        }
        if hand.response.clicked() && side == Side::Target {
            let freed = drawing.unlink(self.target, hand.point(), hand.reach(self.tool));
            if !freed.is_empty() {
                self.change(session, "unlink", &freed, hand.at);
            }
        }
        let Gesture::Linking { from, point_alone, at } = &mut self.gesture else { return };
        *at = hand.at;
        let (from, point_alone) = (*from, *point_alone);
        if hand.response.drag_stopped() {
            self.gesture = Gesture::None;
            let over = planes.iter().find(|plane| plane.rect.contains(hand.at)).unwrap_or(hand.plane);
            let let_go = Hand { plane: over, ..*hand };
            let Some(to) = on_sheet(&drawing.lines(self.target), let_go.point(), let_go.reach(self.tool)) else {
                return;
            };
            let change = if point_alone {
                drawing.correspond_at(self.target, from, to)
            } else {
                drawing.correspond(self.target, from, to.0)
            };
            self.change(session, "link", &change, hand.at);
        }
    }

    /// The sheets of the shape before; the first has none.
    fn source(&mut self, drawing: &Drawing, hand: &Hand) -> Option<Vec<Vec<DVec2>>> {
        if self.target == 0 {
            let reason = "the first shape comes from nothing; add a shape, which the change then leads to";
            self.refusal = Some((reason.into(), hand.at));
            return None;
        }
        Some(drawing.lines(self.target - 1))
    }
}

/// The place on one of `all` that is nearest to `point`, within `reach`, km.
fn on_sheet(all: &[Vec<DVec2>], point: DVec2, reach: f64) -> Option<OnSheet> {
    let (sheet, on) = lines::nearest_among(all, point).filter(|(_, on)| on.distance < reach)?;
    Some((sheet, lines::share_of(&all[sheet], on)))
}

/// Where the pointer went with its button down since the last picture: a hand may be faster than the window.
fn way(ui: &Ui) -> Vec<Pos2> {
    let mut way = Vec::new();
    ui.input(|input| {
        for event in &input.events {
            match event {
                Event::PointerButton { pressed: true, .. } => way.clear(),
                Event::PointerButton { pressed: false, .. } => break,
                Event::PointerMoved(at) => way.push(*at),
                _ => {}
            }
        }
    });
    way
}

/// The pointer on a plane.
#[derive(Clone, Copy)]
struct Hand<'a> {
    plane: &'a Plane,
    response: &'a Response,
    /// Where it is.
    at: Pos2,
    /// Where it was pressed.
    from: Pos2,
}

impl Hand<'_> {
    fn point(&self) -> DVec2 {
        self.plane.to_plane(self.at)
    }

    /// The reach of `tool`, km.
    fn reach(&self, tool: Tool) -> f64 {
        self.plane.km(tool.reach())
    }

    /// The sheet nearest to the pointer, within the reach of `tool`.
    fn near(&self, all: &[Vec<DVec2>], tool: Tool) -> Option<usize> {
        on_sheet(all, self.point(), self.reach(tool)).map(|(sheet, _)| sheet)
    }

    /// Where the control point leaves shape `before` that arrives nearest to the pointer.
    fn arrival(&self, drawing: &Drawing, before: usize) -> Option<DVec2> {
        let ways = drawing.ways(before);
        let off = |way: &&[DVec2; 2]| way[1].distance(self.point());
        let nearest = ways.iter().flatten().min_by(|a, b| off(a).total_cmp(&off(b)));
        nearest.filter(|way| off(way) < self.reach(Tool::Link)).map(|way| way[0])
    }

    fn sheet_of(&self, all: &[Vec<DVec2>]) -> Option<usize> {
        self.near(all, Tool::Draw)
    }
}
