//! Drawings far from 0 are moved near it, since `usvg` resolves coordinates in single precision: maps in meters of a national grid, above all.

use std::fmt::Write;

use bansho_base::math::DVec2;
use roxmltree::{Document, Node};
use svgtypes::{NumberListParser, PathParser, PathSegment};

use super::plain::Replacements;

/// Distance from 0, in multiples of the extent, from which a drawing is moved.
const FAR: f64 = 100.0;

/// What the text has to be changed to.
pub(super) struct Move {
    /// The values of coordinates.
    pub(super) replacements: Replacements,
    /// By how much the coordinates became smaller.
    pub(super) offset: DVec2,
}

/// The coordinates of an element.
enum Coordinates {
    Path(Vec<PathSegment>),
    Points(Vec<DVec2>),
    /// Of a line: x and y of both ends.
    Line([f64; 4]),
}

/// How to move a drawing; `None` if it is near, or has transforms, uses or units, in which its coordinates have other meanings.
pub(super) fn of(document: &Document) -> Option<Move> {
    if document.descendants().any(|node| has_own_coordinates(document, node)) {
        return None;
    }
    let elements = document.descendants().filter_map(|node| Some((node, kind(node)?)));
    let elements: Vec<(Node, Coordinates)> =
        elements.map(|(node, kind)| Some((node, read(node, kind)?))).collect::<Option<_>>()?;
    let [mut min, mut max] = [DVec2::INFINITY, DVec2::NEG_INFINITY];
    for point in elements.iter().flat_map(|(_, coordinates)| positions(coordinates)) {
        (min, max) = (min.min(point), max.max(point));
    }
    let distance = min.abs().max(max.abs()).max_element();
    if !distance.is_finite() || distance <= FAR * (max - min).max_element() {
        return None;
    }
    // A whole number: coordinates of few decimals keep few when it is subtracted.
    let offset = min.floor();
    let mut replacements = Replacements::new();
    for (node, coordinates) in &elements {
        let replaced = replaced(coordinates, offset);
        replacements.extend(replaced.into_iter().map(|(name, value)| ((node.id(), name), Some(value))));
    }
    Some(Move { replacements, offset })
}

/// Whether an element gives the coordinates in it another meaning.
fn has_own_coordinates(document: &Document, node: Node) -> bool {
    let is_nested = matches!(node.tag_name().name(), "use" | "symbol")
        || node.tag_name().name() == "svg" && node != document.root_element();
    // `transform`, `transform-origin`, `gradientTransform`: also those that move no stroke, since that is rare and does no harm.
    let is_transformed = node.attributes().any(|attribute| {
        attribute.name().contains("transform") || attribute.name() == "style" && attribute.value().contains("transform")
    });
    let is_styled = node.tag_name().name() == "style" && node.text().is_some_and(|text| text.contains("transform"));
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
            let [x1, y1, x2, y2] = ["x1", "y1", "x2", "y2"].map(|name| node.attribute(name)?.trim().parse().ok());
            Coordinates::Line([x1?, y1?, x2?, y2?])
        }
    })
}

/// Where an element goes, without the control points of its curves.
fn positions(coordinates: &Coordinates) -> Vec<DVec2> {
    match coordinates {
        Coordinates::Points(points) => points.clone(),
        Coordinates::Line([x1, y1, x2, y2]) => vec![DVec2::new(*x1, *y1), DVec2::new(*x2, *y2)],
        Coordinates::Path(segments) => {
            let (mut points, mut pen) = (Vec::with_capacity(segments.len()), DVec2::ZERO);
            for segment in segments {
                pen = end(segment, pen);
                points.push(pen);
            }
            points
        }
    }
}

/// Where a segment ends that begins at `pen`; a closing stays, since it only returns.
fn end(segment: &PathSegment, pen: DVec2) -> DVec2 {
    match *segment {
        PathSegment::MoveTo { abs, x, y }
        | PathSegment::LineTo { abs, x, y }
        | PathSegment::CurveTo { abs, x, y, .. }
        | PathSegment::SmoothCurveTo { abs, x, y, .. }
        | PathSegment::Quadratic { abs, x, y, .. }
        | PathSegment::SmoothQuadratic { abs, x, y }
        | PathSegment::EllipticalArc { abs, x, y, .. } => {
            let point = DVec2::new(x, y);
            if abs { point } else { pen + point }
        }
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

/// The values of an element's coordinates without `offset`.
fn replaced(coordinates: &Coordinates, offset: DVec2) -> Vec<(&'static str, String)> {
    match coordinates {
        Coordinates::Line(numbers) => {
            let offsets = [offset.x, offset.y, offset.x, offset.y];
            let values = numbers.iter().zip(offsets).map(|(value, offset)| (value - offset).to_string());
            ["x1", "y1", "x2", "y2"].into_iter().zip(values).collect()
        }
        Coordinates::Points(points) => {
            let text: Vec<String> = points.iter().map(|point| pair(*point - offset)).collect();
            vec![("points", text.join(" "))]
        }
        Coordinates::Path(segments) => {
            let mut text = String::new();
            for (index, segment) in segments.iter().enumerate() {
                // The first move is absolute, whatever its letter.
                let _ = write!(text, "{} ", moved(segment, offset, index == 0));
            }
            vec![("d", text)]
        }
    }
}

fn pair(point: DVec2) -> String {
    format!("{} {}", point.x, point.y)
}

/// The text of a segment without `offset`, if it is absolute.
fn moved(segment: &PathSegment, offset: DVec2, is_first: bool) -> String {
    match *segment {
        PathSegment::MoveTo { abs, x, y } => command('M', "", &[[x, y]], abs || is_first, offset),
        PathSegment::LineTo { abs, x, y } => command('L', "", &[[x, y]], abs || is_first, offset),
        PathSegment::HorizontalLineTo { abs: true, x } => format!("H{}", x - offset.x),
        PathSegment::HorizontalLineTo { abs: false, x } => format!("h{x}"),
        PathSegment::VerticalLineTo { abs: true, y } => format!("V{}", y - offset.y),
        PathSegment::VerticalLineTo { abs: false, y } => format!("v{y}"),
        PathSegment::CurveTo { abs, x1, y1, x2, y2, x, y } => {
            command('C', "", &[[x1, y1], [x2, y2], [x, y]], abs || is_first, offset)
        }
        PathSegment::SmoothCurveTo { abs, x2, y2, x, y } => {
            command('S', "", &[[x2, y2], [x, y]], abs || is_first, offset)
        }
        PathSegment::Quadratic { abs, x1, y1, x, y } => command('Q', "", &[[x1, y1], [x, y]], abs || is_first, offset),
        PathSegment::SmoothQuadratic { abs, x, y } => command('T', "", &[[x, y]], abs || is_first, offset),
        PathSegment::EllipticalArc { abs, rx, ry, x_axis_rotation, large_arc, sweep, x, y } => {
            let [large, sweep] = [large_arc, sweep].map(u8::from);
            let ellipse = format!("{rx} {ry} {x_axis_rotation} {large} {sweep} ");
            command('A', &ellipse, &[[x, y]], abs || is_first, offset)
        }
        PathSegment::ClosePath { .. } => "Z".to_owned(),
    }
}

/// The text of a command: its `letter`, in lower case if it is relative, the numbers that are no coordinates, and points. From those of an absolute command
/// `offset` is subtracted; the numbers of a relative one do not change.
fn command(letter: char, numbers: &str, points: &[[f64; 2]], is_absolute: bool, offset: DVec2) -> String {
    let (letter, offset) = if is_absolute { (letter, offset) } else { (letter.to_ascii_lowercase(), DVec2::ZERO) };
    let points: Vec<String> = points.iter().map(|point| pair(DVec2::from(*point) - offset)).collect();
    format!("{letter}{numbers}{}", points.join(" "))
}
