//! An editor of curves by control points: drag to move, double-click to add, right-click to remove.

use bansho::base::{
    math::curve::{Curve, Interpolation},
    parameters::{InterpolationName, Table, Value},
};
use eframe::egui::{
    self, Color32, CornerRadius, Id, PointerButton, Pos2, Rect, Response, Sense, Stroke, StrokeKind, Ui, pos2, vec2,
};

/// Hit radius of a control point, points of the screen.
const HIT_RADIUS: f32 = 9.0;
/// Smallest distance of two control points, as a fraction of the curve's width.
const MIN_DISTANCE: f64 = 0.002;

/// The bounds of a curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CurveBounds {
    /// Minimum and maximum x.
    pub(crate) x: [f64; 2],
    /// Minimum and maximum y.
    pub(crate) y: [f64; 2],
    /// Whether it must be monotonically increasing.
    pub(crate) rising: bool,
}

/// Maps the coordinates of a curve to the screen.
struct Chart {
    /// Its area on the screen, points.
    rect: Rect,
    x: [f64; 2],
    y: [f64; 2],
    /// Whether the curve must be monotonically increasing.
    rising: bool,
}

impl Chart {
    fn to_screen(&self, [x, y]: [f64; 2]) -> Pos2 {
        pos2(
            self.rect.left() + fraction(x, self.x) * self.rect.width(),
            self.rect.bottom() - fraction(y, self.y) * self.rect.height(),
        )
    }

    fn to_curve(&self, at: Pos2) -> [f64; 2] {
        let rect = self.rect;
        [
            rounded_value((at.x - rect.left()) / rect.width(), self.x),
            rounded_value((rect.bottom() - at.y) / rect.height(), self.y),
        ]
    }

    /// `y` of a point between neighbors at `before` and `after`, clamped between them if the curve must increase.
    fn clamp_rising(&self, y: f64, before: Option<f64>, after: Option<f64>) -> f64 {
        if !self.rising {
            return y;
        }
        y.min(after.unwrap_or(f64::INFINITY)).max(before.unwrap_or(f64::NEG_INFINITY))
    }

    fn nearest(&self, points: &[[f64; 2]], at: Pos2) -> Option<usize> {
        let distances = points.iter().map(|point| self.to_screen(*point).distance(at)).enumerate();
        let nearest = distances.min_by(|a, b| a.1.total_cmp(&b.1));
        nearest.filter(|(_, distance)| *distance < HIT_RADIUS).map(|(index, _)| index)
    }
}

/// Where a value is between two bounds, as a fraction.
fn fraction(value: f64, [low, high]: [f64; 2]) -> f32 {
    ((value - low) / (high - low)) as f32
}

/// The inverse of [`fraction`], rounded to three decimals, as a value is that somebody would type.
fn rounded_value(fraction: f32, [low, high]: [f64; 2]) -> f64 {
    let exact = low + f64::from(fraction.clamp(0.0, 1.0)) * (high - low);
    ((exact * 1000.0).round() / 1000.0).clamp(low, high)
}

/// Shows the curve `value` within `bounds`. Returns the curve if it was edited.
pub(crate) fn curve_editor_ui(ui: &mut Ui, label: Id, value: &Value, bounds: CurveBounds) -> Option<Value> {
    let CurveBounds { x, y, rising } = bounds;
    let (points, interpolation) = parse_curve(value)?;
    let curve = Curve::new(points.clone(), interpolation.into()).ok()?;
    let width = ui.available_width().clamp(120.0, 260.0);
    let (_, rect) = ui.allocate_space(vec2(width, 90.0));
    // The id derives from the label, so that it stays the same if the layout changes during a drag.
    let response = ui.interact(rect, label.with("curve"), Sense::click_and_drag());
    let painter = ui.painter_at(rect);
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Canvas, true, "curve"));
    let response = response.labelled_by(label);
    let top = y[1].min(highest(&points).max(y[0] + 1e-3) * 1.25).max(y[0] + 1e-3);
    let chart =
        Chart { rect: response.rect.shrink(4.0), x, y: [y[0], constant_while_dragging(ui, &response, top)], rising };
    paint(&painter, ui, &chart, &curve);
    let edited = edit_points(ui, &response, &chart, points)?;
    Some(curve_value(edited, interpolation))
}

/// The largest y of the chart, which stays constant while dragging: otherwise the scale would grow with the dragged point.
fn constant_while_dragging(ui: &Ui, response: &Response, top: f64) -> f64 {
    let id = response.id.with("top");
    ui.data_mut(|data| {
        if response.is_pointer_button_down_on() || response.dragged() {
            *data.get_temp_mut_or(id, top)
        } else {
            data.remove::<f64>(id);
            top
        }
    })
}

fn highest(points: &[[f64; 2]]) -> f64 {
    points.iter().fold(f64::NEG_INFINITY, |highest, point| highest.max(point[1]))
}

fn paint(painter: &egui::Painter, ui: &Ui, chart: &Chart, curve: &Curve) {
    let visuals = ui.visuals();
    let frame = visuals.widgets.noninteractive.bg_stroke;
    painter.rect(chart.rect, CornerRadius::same(2), visuals.extreme_bg_color, frame, StrokeKind::Inside);
    let columns = chart.rect.width() as usize;
    let line = (0..=columns).map(|column| {
        let x = chart.x[0] + (chart.x[1] - chart.x[0]) * column as f64 / columns.max(1) as f64;
        chart.to_screen([x, curve.eval(x).min(chart.y[1])])
    });
    painter.line(line.collect(), Stroke::new(1.5, visuals.selection.stroke.color));
    for point in curve.points() {
        painter.circle(chart.to_screen(*point), 4.0, visuals.text_color(), Stroke::new(1.0, Color32::BLACK));
    }
}

/// The points after the pointer's edit; `None` if there was none.
fn edit_points(ui: &Ui, response: &Response, chart: &Chart, mut points: Vec<[f64; 2]>) -> Option<Vec<[f64; 2]>> {
    let at = response.interact_pointer_pos()?;
    let dragged = response.id.with("held");
    if response.double_clicked() {
        let [x, y] = chart.to_curve(at);
        let index = points.partition_point(|point| point[0] < x);
        let [before, after] =
            [index.checked_sub(1).map(|before| points[before][1]), points.get(index).map(|point| point[1])];
        points.insert(index, [x, chart.clamp_rising(y, before, after)]);
        return is_ascending(&points, chart).then_some(points);
    }
    if response.secondary_clicked() {
        let index = chart.nearest(&points, at).filter(|_| points.len() > 1)?;
        points.remove(index);
        return Some(points);
    }
    if response.drag_started_by(PointerButton::Primary) {
        let from = ui.input(|input| input.pointer.press_origin()).unwrap_or(at);
        let index = chart.nearest(&points, from);
        ui.data_mut(|data| data.insert_temp(dragged, index));
    }
    if !response.dragged_by(PointerButton::Primary) {
        return None;
    }
    let index =
        ui.data(|data| data.get_temp::<Option<usize>>(dragged)).flatten().filter(|&index| index < points.len())?;
    let moved = clamp_between_neighbors(&points, index, chart.to_curve(at), chart);
    (points[index] != moved).then(|| {
        points[index] = moved;
        points
    })
}

/// `wanted` for point `index`, clamped so that it does not pass its neighbors.
fn clamp_between_neighbors(points: &[[f64; 2]], index: usize, wanted: [f64; 2], chart: &Chart) -> [f64; 2] {
    let min_distance = MIN_DISTANCE * (chart.x[1] - chart.x[0]);
    let low = index.checked_sub(1).map_or(chart.x[0], |before| points[before][0] + min_distance);
    let high = points.get(index + 1).map_or(chart.x[1], |after| after[0] - min_distance);
    let [before, after] = [index.checked_sub(1), Some(index + 1)].map(|at| points.get(at?).map(|point| point[1]));
    let x = if low <= high { wanted[0].clamp(low, high) } else { points[index][0] };
    [x, chart.clamp_rising(wanted[1], before, after)]
}

fn is_ascending(points: &[[f64; 2]], chart: &Chart) -> bool {
    let min_distance = MIN_DISTANCE * (chart.x[1] - chart.x[0]);
    points.windows(2).all(|pair| pair[1][0] - pair[0][0] >= min_distance)
}

fn parse_curve(value: &Value) -> Option<(Vec<[f64; 2]>, InterpolationName)> {
    let (list, name) = match value {
        Value::List(items) => (items, InterpolationName::default()),
        Value::Table(table) => {
            let Value::List(items) = &table.get("points")?.value else { return None };
            let name = match table.get("interpolation").map(|node| &node.value) {
                Some(Value::Text(name)) => InterpolationName::from_name(name)?,
                _ => InterpolationName::default(),
            };
            (items, name)
        }
        _ => return None,
    };
    let points = list.iter().map(|item| match &item.value {
        Value::List(pair) => Some([pair.first()?.value.as_number()?, pair.get(1)?.value.as_number()?]),
        _ => None,
    });
    Some((points.collect::<Option<_>>()?, name))
}

fn curve_value(points: Vec<[f64; 2]>, name: InterpolationName) -> Value {
    let list = Value::List(points.into_iter().map(|point| Value::numbers(point).into()).collect());
    if Interpolation::from(name) == Interpolation::Monotone {
        return list;
    }
    let mut table = Table::default();
    table.push("points", list);
    table.push("interpolation", Value::Text(name.name().into()));
    Value::Table(table)
}
