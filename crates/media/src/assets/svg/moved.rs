//! Drawings far from 0 are moved near it, since `usvg` resolves coordinates in single precision: maps in meters of a national grid, above all.

use std::{fmt::Write, ops::Range};

use bansho_base::math::DVec2;
use roxmltree::{Document, Node};
use svgtypes::{NumberListParser, PathParser, PathSegment};

/// Distance from 0, in multiples of the extent, from which a drawing is moved.
const FAR: f64 = 100.0;

/// What the text has to be changed to.
pub(super) struct Move {
    /// Replacements of parts of the text, in their order.
    pub(super) edits: Vec<(Range<usize>, String)>,
    /// By how much the coordinates became smaller.
    pub(super) offset: DVec2,
}

/// The coordinates of an element.
enum Coordinates {
    Path(Vec<PathSegment>),
    Points(Vec<DVec2>),
    /// Of a line: where each number is in the text.
    Line([(Range<usize>, f64); 4]),
}

/// How to move a drawing; `None` if it is near, or has transforms, uses or units, in which its coordinates have other meanings.
pub(super) fn of(document: &Document) -> Option<Move> {
    if document.descendants().any(|node| has_own_coordinates(document, node)) {
        return None;
    }
    let elements = document.descendants().filter_map(|node| Some((node, kind(node)?)));
    let elements: Vec<(Node, Coordinates)> =
        elements.map(|(node, kind)| Some((node, read(node, kind)?))).collect::<Option<_>>()?;
    let points = || elements.iter().flat_map(|(_, coordinates)| positions(coordinates));
    let min = points().fold(DVec2::INFINITY, DVec2::min);
    let max = points().fold(DVec2::NEG_INFINITY, DVec2::max);
    let distance = min.abs().max(max.abs()).max_element();
    if !distance.is_finite() || distance <= FAR * (max - min).max_element() {
        return None;
    }
    let offset = min.floor();
    let edits = elements.iter().flat_map(|(node, coordinates)| edits(*node, coordinates, offset)).collect();
    Some(Move { edits, offset })
}

/// Whether an element gives the coordinates in it another meaning.
fn has_own_coordinates(document: &Document, node: Node) -> bool {
    let is_nested = matches!(node.tag_name().name(), "use" | "symbol")
        || node.tag_name().name() == "svg" && node != document.root_element();
    let transforms = |text: &str| text.contains("transform");
    let is_transformed = node
        .attributes()
        .any(|attribute| transforms(attribute.name()) || attribute.name() == "style" && transforms(attribute.value()));
    let is_styled = node.tag_name().name() == "style" && node.text().is_some_and(transforms);
    is_nested || is_transformed || is_styled
}

#[derive(Clone, Copy)]
enum StrokeKind {
    Path,
    Points,
    Line,
}

fn kind(node: Node) -> Option<StrokeKind> {
    match node.tag_name().name() {
        "path" if node.has_attribute("d") => Some(StrokeKind::Path),
        "polyline" | "polygon" if node.has_attribute("points") => Some(StrokeKind::Points),
        "line" => Some(StrokeKind::Line),
        _ => None,
    }
}

/// The coordinates of an element; `None` if they have units or are missing.
fn read(node: Node, kind: StrokeKind) -> Option<Coordinates> {
    Some(match kind {
        StrokeKind::Path => Coordinates::Path(PathParser::from(node.attribute("d")?).collect::<Result<_, _>>().ok()?),
        StrokeKind::Points => {
            let numbers: Vec<f64> = NumberListParser::from(node.attribute("points")?).collect::<Result<_, _>>().ok()?;
            Coordinates::Points(numbers.as_chunks::<2>().0.iter().map(|pair| DVec2::from(*pair)).collect())
        }
        StrokeKind::Line => {
            let number = |name: &str| {
                let attribute = node.attribute_node(name)?;
                Some((attribute.range_value(), attribute.value().trim().parse().ok()?))
            };
            Coordinates::Line([number("x1")?, number("y1")?, number("x2")?, number("y2")?])
        }
    })
}

/// Where an element goes, without the control points of its curves.
fn positions(coordinates: &Coordinates) -> Vec<DVec2> {
    match coordinates {
        Coordinates::Points(points) => points.clone(),
        Coordinates::Line([(_, x1), (_, y1), (_, x2), (_, y2)]) => vec![DVec2::new(*x1, *y1), DVec2::new(*x2, *y2)],
        Coordinates::Path(segments) => {
            let mut pen = DVec2::ZERO;
            let step = |segment: &PathSegment| {
                pen = end(segment, pen);
                pen
            };
            segments.iter().map(step).collect()
        }
    }
}

/// Where a segment ends that begins at `pen`; a closing stays, since it only returns.
fn end(segment: &PathSegment, pen: DVec2) -> DVec2 {
    let place = |abs: bool, x: f64, y: f64| if abs { DVec2::new(x, y) } else { pen + DVec2::new(x, y) };
    match *segment {
        PathSegment::MoveTo { abs, x, y }
        | PathSegment::LineTo { abs, x, y }
        | PathSegment::CurveTo { abs, x, y, .. }
        | PathSegment::SmoothCurveTo { abs, x, y, .. }
        | PathSegment::Quadratic { abs, x, y, .. }
        | PathSegment::SmoothQuadratic { abs, x, y }
        | PathSegment::EllipticalArc { abs, x, y, .. } => place(abs, x, y),
        PathSegment::HorizontalLineTo { abs, x } => DVec2::new(if abs { x } else { pen.x + x }, pen.y),
        PathSegment::VerticalLineTo { abs, y } => DVec2::new(pen.x, if abs { y } else { pen.y + y }),
        PathSegment::ClosePath { .. } => pen,
    }
}

/// Whether path data lead nowhere: to a single point, by lines.
pub(super) fn is_dot(data: &str) -> bool {
    let mut points = Vec::new();
    for segment in PathParser::from(data) {
        match segment {
            Ok(
                segment @ (PathSegment::MoveTo { .. }
                | PathSegment::LineTo { .. }
                | PathSegment::HorizontalLineTo { .. }
                | PathSegment::VerticalLineTo { .. }
                | PathSegment::ClosePath { .. }),
            ) => points.push(end(&segment, points.last().copied().unwrap_or(DVec2::ZERO))),
            _ => return false,
        }
        if points.last() != points.first() {
            return false;
        }
    }
    !points.is_empty()
}

/// The text of an element's coordinates without `offset`.
fn edits(node: Node, coordinates: &Coordinates, offset: DVec2) -> Vec<(Range<usize>, String)> {
    let range = |name: &str| node.attribute_node(name).map(|attribute| attribute.range_value());
    match coordinates {
        Coordinates::Line(numbers) => {
            let offsets = [offset.x, offset.y, offset.x, offset.y];
            let edit =
                |((range, value), offset): (&(Range<usize>, f64), f64)| (range.clone(), (value - offset).to_string());
            numbers.iter().zip(offsets).map(edit).collect()
        }
        Coordinates::Points(points) => {
            let text: Vec<String> = points.iter().map(|point| pair(*point - offset)).collect();
            range("points").map(|range| (range, text.join(" "))).into_iter().collect()
        }
        Coordinates::Path(segments) => {
            let mut text = String::new();
            for (index, segment) in segments.iter().enumerate() {
                // The first move is absolute, whatever its letter.
                let _ = write!(text, "{} ", moved(segment, offset, index == 0));
            }
            range("d").map(|range| (range, text)).into_iter().collect()
        }
    }
}

fn pair(point: DVec2) -> String {
    format!("{} {}", point.x, point.y)
}

/// The text of a segment without `offset`, if it is absolute.
fn moved(segment: &PathSegment, offset: DVec2, is_first: bool) -> String {
    let command = |abs: bool, letter: char, points: &[[f64; 2]]| {
        let shift = if abs || is_first { offset } else { DVec2::ZERO };
        let letter = if abs || is_first { letter } else { letter.to_ascii_lowercase() };
        let points: Vec<String> = points.iter().map(|point| pair(DVec2::from(*point) - shift)).collect();
        format!("{letter}{}", points.join(" "))
    };
    let single = |abs: bool, letter: char, value: f64, shift: f64| {
        if abs { format!("{letter}{}", value - shift) } else { format!("{}{value}", letter.to_ascii_lowercase()) }
    };
    match *segment {
        PathSegment::MoveTo { abs, x, y } => command(abs, 'M', &[[x, y]]),
        PathSegment::LineTo { abs, x, y } => command(abs, 'L', &[[x, y]]),
        PathSegment::HorizontalLineTo { abs, x } => single(abs, 'H', x, offset.x),
        PathSegment::VerticalLineTo { abs, y } => single(abs, 'V', y, offset.y),
        PathSegment::CurveTo { abs, x1, y1, x2, y2, x, y } => command(abs, 'C', &[[x1, y1], [x2, y2], [x, y]]),
        PathSegment::SmoothCurveTo { abs, x2, y2, x, y } => command(abs, 'S', &[[x2, y2], [x, y]]),
        PathSegment::Quadratic { abs, x1, y1, x, y } => command(abs, 'Q', &[[x1, y1], [x, y]]),
        PathSegment::SmoothQuadratic { abs, x, y } => command(abs, 'T', &[[x, y]]),
        PathSegment::EllipticalArc { abs, rx, ry, x_axis_rotation, large_arc, sweep, x, y } => {
            let [large, sweep] = [large_arc, sweep].map(u8::from);
            let end = command(abs, 'A', &[[x, y]]);
            let (letter, end) = end.split_at(1);
            format!("{letter}{rx} {ry} {x_axis_rotation} {large} {sweep} {end}")
        }
        PathSegment::ClosePath { .. } => "Z".to_owned(),
    }
}
