//! Draws a figure: where its panels, axes, curves and legends are.

use bansho::{DisplayImage, base::math};

use super::{
    canvas::{FigureCanvas, LineStyle, TextAnchor, TextStyle},
    figure::{Axis, ColorStrip, Figure, Panel, Plot, Rgb, Scale, Series, Style},
    font,
    raster::RasterCanvas,
    svg::SvgCanvas,
    ticks::{self, Ticks},
};

/// Width of a figure, CSS pixels.
const WIDTH: f64 = 640.0;
/// Space left and right of the panels.
const LEFT: f64 = 84.0;
const RIGHT: f64 = 22.0;
/// Space above the first panel, for the title.
const TOP: f64 = 36.0;
/// Space below a panel for the labels of its x axis.
const BOTTOM: f64 = 48.0;
/// Space between panels that share their x axis.
const GAP: f64 = 18.0;
/// Height of a strip of colors.
const STRIP: f64 = 34.0;

const TITLE_SIZE: f64 = 14.0;
const LABEL_SIZE: f64 = 13.0;
const NUMBER_SIZE: f64 = 12.0;
/// How much wider the fonts may be that show an SVG: Arial, and its bold letters.
const WIDER: f64 = 1.08;
/// Height of capital letters and digits, em.
const CAP_HEIGHT: f64 = 0.69;

const BLACK: Rgb = [0; 3];
const GRID: Rgb = [226; 3];
const AXIS: LineStyle = LineStyle { color: BLACK, width: 1.0, dash: None };
const GRID_LINE: LineStyle = LineStyle { color: GRID, width: 0.7, dash: None };
const CURVE_WIDTH: f64 = 1.8;
const DASHES: [f64; 2] = [6.0, 3.5];
const MARKER_RADIUS: f64 = 3.2;
const MAJOR_TICK: f64 = 6.0;
const MINOR_TICK: f64 = 3.5;
/// Points of a curve that are drawn; of more, every so many.
const CURVE_POINTS: usize = 2000;

/// The figure as SVG.
pub(crate) fn svg(figure: &Figure) -> String {
    let mut canvas = SvgCanvas::new(&figure.title, size(figure));
    draw(figure, &mut canvas);
    canvas.finish()
}

/// The figure as pixels; `None` if it has too many panels for a picture.
pub(crate) fn picture(figure: &Figure) -> Option<DisplayImage> {
    let mut canvas = RasterCanvas::new(size(figure))?;
    draw(figure, &mut canvas);
    Some(canvas.finish())
}

/// Height of a panel, without its labels.
fn panel_height(figure: &Figure, panel: &Panel) -> f64 {
    let plots = figure.panels.iter().filter(|panel| matches!(panel, Panel::Plot(_))).count();
    match panel {
        Panel::Colors(_) => STRIP,
        Panel::Plot(_) if plots == 1 => 360.0,
        Panel::Plot(_) if plots == 2 => 230.0,
        Panel::Plot(_) => 170.0,
    }
}

/// Whether a panel labels its x axis: the next one has another.
fn labels_x(figure: &Figure, index: usize) -> bool {
    figure.panels.get(index + 1).is_none_or(|next| next.x() != figure.panels[index].x())
}

/// Space below a panel, for the labels of its axis or to the next panel.
fn space_below(figure: &Figure, index: usize) -> f64 {
    if labels_x(figure, index) { BOTTOM } else { GAP }
}

fn size(figure: &Figure) -> [f64; 2] {
    let panels = figure.panels.iter().enumerate();
    [WIDTH, TOP + panels.map(|(index, panel)| panel_height(figure, panel) + space_below(figure, index)).sum::<f64>()]
}

fn draw(figure: &Figure, canvas: &mut dyn FigureCanvas) {
    let title = TextStyle {
        at: [0.5 * (LEFT + WIDTH - RIGHT), 23.0],
        anchor: TextAnchor::Middle,
        size: TITLE_SIZE.min(TITLE_SIZE * (WIDTH - 16.0) / (WIDER * font::width(&figure.title, TITLE_SIZE)).max(1.0)),
        bold: true,
        vertical: false,
    };
    canvas.text(&figure.title, &title);
    let mut top = TOP;
    for (index, panel) in figure.panels.iter().enumerate() {
        let height = panel_height(figure, panel);
        let area = Area { left: LEFT, right: WIDTH - RIGHT, top, bottom: top + height };
        let labels_x = labels_x(figure, index);
        match panel {
            Panel::Plot(plot) => draw_plot(plot, &area, labels_x, canvas),
            Panel::Colors(strip) => draw_strip(strip, &area, labels_x, canvas),
        }
        top += height + space_below(figure, index);
    }
}

/// A rectangle of the page.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Area {
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
}

impl Area {
    fn contains(&self, [x, y]: [f64; 2]) -> bool {
        (self.left..=self.right).contains(&x) && (self.top..=self.bottom).contains(&y)
    }

    /// With a margin.
    fn grown(&self, by: f64) -> Self {
        Self { left: self.left - by, right: self.right + by, top: self.top - by, bottom: self.bottom + by }
    }

    fn corners(&self) -> [[f64; 2]; 2] {
        [[self.left, self.top], [self.right, self.bottom]]
    }

    fn outline(&self) -> [[f64; 2]; 5] {
        let Self { left, right, top, bottom } = *self;
        [[left, top], [right, top], [right, bottom], [left, bottom], [left, top]]
    }
}

/// Position of a number along an axis, as a fraction; not finite for what the axis cannot show.
fn fraction(axis: &Axis, value: f64) -> f64 {
    let [low, high] = axis.range;
    match axis.scale {
        Scale::Linear => (value - low) / (high - low),
        Scale::Log if value > 0.0 => math::log10(value / low) / math::log10(high / low),
        // Zero is infinitely far below.
        Scale::Log => f64::NEG_INFINITY,
    }
}

/// Where a number of a horizontal axis is on the page.
fn page_x(axis: &Axis, area: &Area, value: f64) -> f64 {
    math::lerp(area.left, area.right, fraction(axis, value))
}

/// Where a number of a vertical axis is on the page. What is infinitely far below, as 0 on a logarithmic axis, is far below instead, so that the curve that
/// leads there can be drawn.
fn page_y(axis: &Axis, area: &Area, value: f64) -> f64 {
    math::lerp(area.bottom, area.top, fraction(axis, value).max(-10.0))
}

fn draw_plot(plot: &Plot, area: &Area, labels_x: bool, canvas: &mut dyn FigureCanvas) {
    let rows = if area.bottom - area.top > 200.0 { 7 } else { 5 };
    let (x_ticks, y_ticks) = (ticks::ticks(&plot.x, 8), ticks::ticks(&plot.y, rows));
    for (value, _) in &x_ticks.major {
        let x = page_x(&plot.x, area, *value);
        canvas.line(&[[x, area.top], [x, area.bottom]], &GRID_LINE);
    }
    for (value, _) in &y_ticks.major {
        let y = page_y(&plot.y, area, *value);
        canvas.line(&[[area.left, y], [area.right, y]], &GRID_LINE);
    }
    let mut drawn = Vec::new();
    for series in &plot.series {
        let points = series.points.iter().map(|&[x, y]| [page_x(&plot.x, area, x), page_y(&plot.y, area, y)]);
        drawn.extend(draw_series(series, &points.collect::<Vec<_>>(), area, canvas));
    }
    draw_frame(area, canvas);
    for (length, value) in sized(&x_ticks) {
        let x = page_x(&plot.x, area, value);
        canvas.line(&[[x, area.bottom], [x, area.bottom - length]], &AXIS);
        canvas.line(&[[x, area.top], [x, area.top + length]], &AXIS);
    }
    for (length, value) in sized(&y_ticks) {
        let y = page_y(&plot.y, area, value);
        canvas.line(&[[area.left, y], [area.left + length, y]], &AXIS);
        canvas.line(&[[area.right, y], [area.right - length, y]], &AXIS);
    }
    for (value, label) in &y_ticks.major {
        let at = [area.left - 7.0, page_y(&plot.y, area, *value) + 0.5 * CAP_HEIGHT * NUMBER_SIZE];
        canvas.text(label, &number(at, TextAnchor::End));
    }
    if labels_x {
        draw_x_labels(&plot.x, &x_ticks, area, canvas);
    }
    draw_y_caption(&plot.y, &y_ticks, area, canvas);
    draw_legend(plot, area, &drawn, canvas);
}

fn draw_strip(strip: &ColorStrip, area: &Area, labels_x: bool, canvas: &mut dyn FigureCanvas) {
    for (index, &color) in strip.colors.iter().enumerate() {
        let [left, right] =
            [index, index + 1].map(|edge| math::lerp(area.left, area.right, edge as f64 / strip.colors.len() as f64));
        // A little overlap, so that nothing shines through between neighbors.
        canvas.rectangle([[left, area.top], [(right + 0.5).min(area.right), area.bottom]], color, 1.0);
    }
    draw_frame(area, canvas);
    let ticks = ticks::ticks(&strip.x, 8);
    if labels_x {
        for (value, _) in &ticks.major {
            let x = page_x(&strip.x, area, *value);
            canvas.line(&[[x, area.bottom], [x, area.bottom + 4.0]], &AXIS);
        }
        draw_x_labels(&strip.x, &ticks, area, canvas);
    }
}

fn draw_frame(area: &Area, canvas: &mut dyn FigureCanvas) {
    canvas.line(&area.outline(), &AXIS);
}

/// Ticks with their lengths.
fn sized(ticks: &Ticks) -> impl Iterator<Item = (f64, f64)> {
    let minor = ticks.minor.iter().map(|&value| (MINOR_TICK, value));
    ticks.major.iter().map(|&(value, _)| (MAJOR_TICK, value)).chain(minor)
}

fn draw_x_labels(axis: &Axis, ticks: &Ticks, area: &Area, canvas: &mut dyn FigureCanvas) {
    for (value, label) in &ticks.major {
        canvas.text(label, &number([page_x(axis, area, *value), area.bottom + 17.0], TextAnchor::Middle));
    }
    let style = TextStyle {
        at: [0.5 * (area.left + area.right), area.bottom + 37.0],
        anchor: TextAnchor::Middle,
        size: LABEL_SIZE,
        bold: false,
        vertical: false,
    };
    canvas.text(&axis.caption(&ticks.factor), &style);
}

/// Beside the axis: in one line, or a long label above its unit.
fn draw_y_caption(axis: &Axis, ticks: &Ticks, area: &Area, canvas: &mut dyn FigureCanvas) {
    let room = area.bottom - area.top;
    let (whole, unit) =
        (axis.caption(&ticks.factor), Axis { label: String::new(), ..axis.clone() }.caption(&ticks.factor));
    let lines = if WIDER * font::width(&whole, LABEL_SIZE) <= room || unit.is_empty() {
        vec![(whole, 20.0)]
    } else {
        vec![(axis.label.clone(), 14.0), (unit.trim().to_owned(), 30.0)]
    };
    for (line, x) in lines {
        let style = TextStyle {
            at: [x, 0.5 * (area.top + area.bottom)],
            anchor: TextAnchor::Middle,
            size: LABEL_SIZE.min(LABEL_SIZE * room / (WIDER * font::width(&line, LABEL_SIZE)).max(1.0)),
            bold: false,
            vertical: true,
        };
        canvas.text(&line, &style);
    }
}

/// Style of numbers and legends.
fn number(at: [f64; 2], anchor: TextAnchor) -> TextStyle {
    TextStyle { at, anchor, size: NUMBER_SIZE, bold: false, vertical: false }
}

fn stroke(series: &Series) -> LineStyle {
    let (width, dash) = match series.style {
        Style::Line => (CURVE_WIDTH, None),
        Style::Dashed => (CURVE_WIDTH, Some(DASHES)),
        Style::Markers => (1.3, None),
    };
    LineStyle { color: series.color, width, dash }
}

/// Draws a series; returns the page positions that it covers.
fn draw_series(series: &Series, points: &[[f64; 2]], area: &Area, canvas: &mut dyn FigureCanvas) -> Vec<[f64; 2]> {
    let stroke = stroke(series);
    if series.style == Style::Markers {
        let shown: Vec<[f64; 2]> = points.iter().copied().filter(|&point| area.contains(point)).collect();
        shown.iter().for_each(|&point| canvas.marker(point, MARKER_RADIUS, &stroke));
        return shown;
    }
    let pieces = clip(&thinned(points), area);
    pieces.iter().for_each(|piece| canvas.line(piece, &stroke));
    pieces.iter().flat_map(|piece| piece.windows(2)).flat_map(|pair| sampled(pair[0], pair[1])).collect()
}

/// At most about [`CURVE_POINTS`] of the points, the last among them.
fn thinned(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let every = points.len().div_ceil(CURVE_POINTS).max(1);
    let last = points.len().saturating_sub(1);
    let kept = points.iter().enumerate().filter(|(index, _)| index % every == 0 || *index == last);
    kept.map(|(_, &point)| point).collect()
}

/// Points of a straight line a few pixels apart.
fn sampled(from: [f64; 2], to: [f64; 2]) -> impl Iterator<Item = [f64; 2]> {
    let steps = ((to[0] - from[0]).abs().max((to[1] - from[1]).abs()) / 4.0).ceil().max(1.0);
    (0..steps as usize).map(move |step| between(from, to, step as f64 / steps))
}

/// The parts of a curve within an area, by Liang and Barsky (1984). It is interrupted where a point is not finite.
fn clip(points: &[[f64; 2]], area: &Area) -> Vec<Vec<[f64; 2]>> {
    let mut pieces: Vec<Vec<[f64; 2]>> = Vec::new();
    for pair in points.windows(2) {
        let [from, to] = [pair[0], pair[1]];
        let Some([start, end]) = clip_segment(from, to, area) else { continue };
        match pieces.last_mut() {
            Some(piece) if piece.last() == Some(&start) => piece.push(end),
            _ => pieces.push(vec![start, end]),
        }
    }
    pieces
}

fn clip_segment(from: [f64; 2], to: [f64; 2], area: &Area) -> Option<[[f64; 2]; 2]> {
    if ![from, to].iter().flatten().all(|value| value.is_finite()) {
        return None;
    }
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    let (low, high) = ([area.left, area.top], [area.right, area.bottom]);
    for c in 0..2 {
        let change = to[c] - from[c];
        let (a, b) = (low[c] - from[c], high[c] - from[c]);
        if change == 0.0 {
            // Parallel to this side: inside of it or not, all along.
            if a > 0.0 || b < 0.0 {
                return None;
            }
        } else {
            let (near, far) = if change > 0.0 { (a / change, b / change) } else { (b / change, a / change) };
            (enter, leave) = (enter.max(near), leave.min(far));
        }
    }
    // Ends that are inside stay bit for bit, so that `clip` recognizes the end of one segment as the start of the next.
    let start = if enter == 0.0 { from } else { between(from, to, enter) };
    let end = if leave == 1.0 { to } else { between(from, to, leave) };
    (enter <= leave).then_some([start, end])
}

/// The point of a straight line at the fraction `t` of its length.
fn between(from: [f64; 2], to: [f64; 2], t: f64) -> [f64; 2] {
    [math::lerp(from[0], to[0], t), math::lerp(from[1], to[1], t)]
}

/// Lines of a legend, and their measures.
const LINE_HEIGHT: f64 = 17.0;
const SAMPLE: f64 = 26.0;
const PADDING: f64 = 7.0;

/// Draws the legend in the corner, or in the middle of a side, where it hides the fewest of the `drawn` positions. One curve needs none.
fn draw_legend(plot: &Plot, area: &Area, drawn: &[[f64; 2]], canvas: &mut dyn FigureCanvas) {
    if plot.series.len() < 2 {
        return;
    }
    let widest = plot.series.iter().map(|series| font::width(&series.label, NUMBER_SIZE)).fold(0.0, f64::max);
    let width = SAMPLE + 3.0 * PADDING + WIDER * widest;
    let height = LINE_HEIGHT * plot.series.len() as f64 + PADDING;
    let inset = 10.0;
    let columns = [area.right - inset - width, area.left + inset, 0.5 * (area.left + area.right - width)];
    let rows = [area.top + inset, area.bottom - inset - height, 0.5 * (area.top + area.bottom - height)];
    let candidates = columns
        .iter()
        .flat_map(|&left| rows.iter().map(move |&top| Area { left, right: left + width, top, bottom: top + height }));
    let best = candidates.min_by_key(|area| drawn.iter().filter(|&&point| area.grown(6.0).contains(point)).count());
    let Some(place) = best else { return };
    canvas.rectangle(place.corners(), [255; 3], 0.85);
    canvas.line(&place.outline(), &LineStyle { color: [190; 3], width: 0.7, dash: None });
    for (index, series) in plot.series.iter().enumerate() {
        let y = place.top + 0.5 * PADDING + LINE_HEIGHT * (index as f64 + 0.5);
        let left = place.left + PADDING;
        match series.style {
            Style::Markers => canvas.marker([left + 0.5 * SAMPLE, y], MARKER_RADIUS, &stroke(series)),
            _ => canvas.line(&[[left, y], [left + SAMPLE, y]], &stroke(series)),
        }
        let at = [left + SAMPLE + PADDING, y + 0.5 * CAP_HEIGHT * NUMBER_SIZE];
        canvas.text(&series.label, &number(at, TextAnchor::Start));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AREA: Area = Area { left: 0.0, right: 10.0, top: 0.0, bottom: 10.0 };

    #[test]
    fn curves_are_cut_at_the_frame_and_interrupted_at_gaps() {
        let points = [[-5.0, 5.0], [5.0, 5.0], [15.0, 5.0], [f64::NAN, 0.0], [2.0, 2.0], [3.0, 20.0]];
        let pieces = clip(&points, &AREA);
        assert_eq!(pieces.len(), 2);
        assert_eq!(pieces[0], [[0.0, 5.0], [5.0, 5.0], [10.0, 5.0]]);
        assert_eq!(pieces[1][0], [2.0, 2.0]);
        assert!((pieces[1][1][1] - 10.0).abs() < 1e-12);
        assert!(clip(&[[11.0, 0.0], [12.0, 10.0]], &AREA).is_empty());
    }

    #[test]
    fn long_curves_are_thinned_and_keep_their_ends() {
        let points: Vec<[f64; 2]> = (0..10_001).map(|i| [f64::from(i), 0.0]).collect();
        let kept = thinned(&points);
        assert!(kept.len() <= CURVE_POINTS + 1, "{}", kept.len());
        assert_eq!((kept[0], kept[kept.len() - 1]), (points[0], points[10_000]));
    }
}
