//! The first pass over an SVG: what `usvg` would drop, cut or move without a word.

use std::{collections::HashMap, ops::Range, str::FromStr};

use bansho_base::{host::assets::AssetProblem, math::DVec2};
use roxmltree::{Attribute, Document, Node, NodeId, ParsingOptions};
use svgtypes::{NumberListParser, PathParser, PathSegment};

use super::{MAX_POINTS, damaged, moved, strokes::CURVE_SEGMENTS};

/// Elements whose contents are not drawn where they stand.
const HIDDEN_ELEMENTS: [&str; 8] = ["defs", "symbol", "clipPath", "mask", "marker", "pattern", "metadata", "style"];
/// Elements that are drawn but are not strokes, and `use`, which may show one.
const OTHER_ELEMENTS: [&str; 7] = ["use", "text", "rect", "circle", "ellipse", "image", "foreignObject"];
/// Most elements within one another, uses included.
const MAX_DEPTH: usize = 256;
/// Most closings of a path in a row: `usvg` takes each one level deeper.
const MAX_CLOSINGS: usize = 100;
/// Farthest that all segments of a path may lead together, well within single precision.
const MAX_REACH: f64 = 1e30;
/// Most attributes of an element.
const MAX_ATTRIBUTES: usize = 4096;
/// Most nodes of a text.
const MAX_NODES: u32 = 4_000_000;

/// What is known of a drawing before it is resolved.
pub(super) struct SvgDocument {
    /// The text, whose sides do not scale its view box.
    pub(super) text: String,
    /// What is added to resolved coordinates.
    pub(super) origin: DVec2,
    /// Whether the text was moved near 0.
    pub(super) is_moved: bool,
    /// The view box: its corners with the smallest and the largest coordinates.
    pub(super) view_box: Option<[DVec2; 2]>,
    /// Names of elements that are drawn and are no strokes.
    pub(super) others: Vec<&'static str>,
    /// Number of paths that are a single point.
    pub(super) dots: usize,
}

/// Reads the text and checks its data.
pub(super) fn read(text: &str) -> Result<SvgDocument, AssetProblem> {
    check_attributes(text)?;
    let options = ParsingOptions { allow_dtd: true, nodes_limit: MAX_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options).map_err(|error| match error {
        _ if !text.contains("<svg") && !text.contains(":svg") => damaged("it is not an SVG"),
        error => damaged(error),
    })?;
    let root = document.root_element();
    if root.tag_name().name() != "svg" {
        return Err(damaged("it is not an SVG"));
    }
    let mut check = DataCheck { document: &document, strokes: 0, dots: 0, others: Vec::new(), points: HashMap::new() };
    check.all(root)?;
    let total = PointCount::new(&document, &check.points).of(root, 0)?;
    if total > MAX_POINTS as u64 {
        return Err(damaged(format!("it has more than {MAX_POINTS} points")));
    }
    let view_box = view_box(root)?;
    let sides = if view_box.is_some() { &["width", "height", "preserveAspectRatio", "x", "y"][..] } else { &[] };
    let cut = root.attributes().filter(|attribute| sides.contains(&attribute.name()));
    let mut edits: Vec<(Range<usize>, String)> = cut.map(|attribute| (attribute.range(), String::new())).collect();
    let moved = moved::of(&document);
    let is_moved = moved.is_some();
    let mut origin = view_box.map_or(DVec2::ZERO, |[min, _]| min);
    if let Some(moved) = moved {
        origin = moved.offset;
        edits.extend(moved.edits);
        let sides = view_box.zip(root.attribute_node("viewBox"));
        edits.extend(sides.map(|([min, max], attribute)| {
            (attribute.range_value(), format!("0 0 {} {}", max.x - min.x, max.y - min.y))
        }));
    }
    Ok(SvgDocument { text: edited(text, edits), origin, is_moved, view_box, others: check.others, dots: check.dots })
}

/// Rejects tags of so many attributes that comparing each with all others would take seconds.
fn check_attributes(text: &str) -> Result<(), AssetProblem> {
    let crowded = text.split('<').any(|tag| {
        let tag = tag.split('>').next().unwrap_or_default();
        tag.bytes().filter(|byte| *byte == b'=').nth(MAX_ATTRIBUTES).is_some()
    });
    if crowded { Err(damaged(format!("an element has more than {MAX_ATTRIBUTES} attributes"))) } else { Ok(()) }
}

/// The text in which these ranges are replaced; none overlaps another.
fn edited(text: &str, mut edits: Vec<(Range<usize>, String)>) -> String {
    edits.sort_by_key(|(range, _)| range.start);
    let mut result = String::with_capacity(text.len());
    let mut copied = 0;
    for (range, replacement) in edits {
        result.push_str(&text[copied..range.start]);
        result.push_str(&replacement);
        copied = range.end;
    }
    result + &text[copied..]
}

fn view_box(root: Node) -> Result<Option<[DVec2; 2]>, AssetProblem> {
    let Some(text) = root.attribute("viewBox") else { return Ok(None) };
    let numbers: Result<Vec<f64>, _> = NumberListParser::from(text).collect();
    match numbers.as_deref() {
        Ok(&[x, y, width, height]) if width > 0.0 && height > 0.0 => {
            let low = DVec2::new(x, y);
            Ok(Some([low, low + DVec2::new(width, height)]))
        }
        _ => Err(damaged(format!("its viewBox is `{text}` (allowed: x, y, and a width and height above 0)"))),
    }
}

/// Checks the data of all elements.
struct DataCheck<'a, 'd> {
    document: &'a Document<'d>,
    /// Strokes before the element.
    strokes: usize,
    dots: usize,
    others: Vec<&'static str>,
    /// Points of each element.
    points: HashMap<NodeId, u64>,
}

impl<'a> DataCheck<'a, '_> {
    fn all(&mut self, root: Node<'a, '_>) -> Result<(), AssetProblem> {
        for node in root.descendants().filter(Node::is_element) {
            let name = node.tag_name().name();
            let is_other = OTHER_ELEMENTS.into_iter().find(|other| *other == name).filter(|_| !is_hidden(node));
            self.others.extend(is_other.filter(|other| !self.others.contains(other)));
            if let Some(transform) = node.attribute_node("transform")
                && svgtypes::Transform::from_str(transform.value()).is_err()
            {
                return Err(self.fault(node, &transform, "its transform cannot be read"));
            }
            let points = match name {
                "path" => node.attribute_node("d").map_or(Ok(0), |data| self.path(node, &data)),
                "polyline" | "polygon" => node.attribute_node("points").map_or(Ok(0), |data| self.points(node, &data)),
                "line" => Ok(2),
                _ => continue,
            }?;
            self.dots += usize::from(
                name == "path" && !is_hidden(node) && moved::is_dot(node.attribute("d").unwrap_or_default()),
            );
            self.points.insert(node.id(), points);
            self.strokes += 1;
        }
        Ok(())
    }

    fn fault(&self, node: Node, attribute: &Attribute, reason: impl std::fmt::Display) -> AssetProblem {
        let name = node.tag_name().name();
        let name = match node.attribute("id") {
            Some(id) => format!("{name} `{id}`"),
            None => format!("{name} after {} strokes", self.strokes),
        };
        let at = self.document.text_pos_at(attribute.range().start);
        damaged(format!("{name} in line {}: {reason}", at.row))
    }

    /// The points of a path.
    fn path(&self, node: Node, data: &Attribute) -> Result<u64, AssetProblem> {
        let (mut points, mut closings, mut reach) = (0, 0, 0.0_f64);
        for segment in PathParser::from(data.value()) {
            let segment = segment.map_err(|error| self.fault(node, data, format!("its path data: {error}")))?;
            closings = if matches!(segment, PathSegment::ClosePath { .. }) { closings + 1 } else { 0 };
            if closings > MAX_CLOSINGS {
                return Err(self.fault(
                    node,
                    data,
                    format!("its path data close it more than {MAX_CLOSINGS} times in a row"),
                ));
            }
            reach += end_of(&segment);
            if reach.is_nan() || reach > MAX_REACH {
                return Err(self.fault(node, data, "a point is infinitely far away"));
            }
            points += match segment {
                PathSegment::MoveTo { .. }
                | PathSegment::LineTo { .. }
                | PathSegment::HorizontalLineTo { .. }
                | PathSegment::VerticalLineTo { .. }
                | PathSegment::ClosePath { .. } => 1,
                PathSegment::EllipticalArc { .. } => 4 * CURVE_SEGMENTS as u64,
                _ => CURVE_SEGMENTS as u64,
            };
        }
        Ok(points)
    }

    /// The points of a polyline or polygon.
    fn points(&self, node: Node, data: &Attribute) -> Result<u64, AssetProblem> {
        let mut numbers = 0;
        for number in NumberListParser::from(data.value()) {
            number.map_err(|error| self.fault(node, data, format!("its points: {error}")))?;
            numbers += 1;
        }
        if numbers % 2 == 1 {
            return Err(self.fault(node, data, format!("its points have {numbers} numbers; allowed: pairs")));
        }
        Ok(numbers / 2 + 1)
    }
}

/// The larger coordinate of where a segment ends.
fn end_of(segment: &PathSegment) -> f64 {
    match *segment {
        PathSegment::MoveTo { x, y, .. }
        | PathSegment::LineTo { x, y, .. }
        | PathSegment::CurveTo { x, y, .. }
        | PathSegment::SmoothCurveTo { x, y, .. }
        | PathSegment::Quadratic { x, y, .. }
        | PathSegment::SmoothQuadratic { x, y, .. }
        | PathSegment::EllipticalArc { x, y, .. } => x.abs().max(y.abs()),
        PathSegment::HorizontalLineTo { x, .. } => x.abs(),
        PathSegment::VerticalLineTo { y, .. } => y.abs(),
        PathSegment::ClosePath { .. } => 0.0,
    }
}

fn is_hidden(node: Node) -> bool {
    node.ancestors().any(|ancestor| HIDDEN_ELEMENTS.contains(&ancestor.tag_name().name()))
}

/// Counts the points that all uses draw.
struct PointCount<'a, 'd> {
    ids: HashMap<&'a str, Node<'a, 'd>>,
    own: &'a HashMap<NodeId, u64>,
    known: HashMap<NodeId, u64>,
}

impl<'a, 'd> PointCount<'a, 'd> {
    fn new(document: &'a Document<'d>, own: &'a HashMap<NodeId, u64>) -> Self {
        let named = document.descendants().filter_map(|node| Some((node.attribute("id")?, node)));
        let mut ids = HashMap::new();
        named.for_each(|(id, node)| {
            ids.entry(id).or_insert(node);
        });
        Self { ids, own, known: HashMap::new() }
    }

    /// The points of an element and of all in it; each element counts as one, so that uses of nothing are bounded too.
    fn of(&mut self, node: Node<'a, 'd>, depth: usize) -> Result<u64, AssetProblem> {
        if depth > MAX_DEPTH {
            return Err(damaged(format!("it has elements more than {MAX_DEPTH} deep, or that use themselves")));
        }
        if let Some(known) = self.known.get(&node.id()) {
            return Ok(*known);
        }
        let mut total = 1 + self.own.get(&node.id()).copied().unwrap_or(0);
        for child in node.children().filter(Node::is_element) {
            total = total.saturating_add(self.of(child, depth + 1)?);
        }
        let href = node.attributes().find(|attribute| attribute.name() == "href");
        let target = href.filter(|_| node.tag_name().name() == "use").and_then(|href| href.value().strip_prefix('#'));
        if let Some(target) = target.and_then(|id| self.ids.get(id)).copied() {
            total = total.saturating_add(self.of(target, depth + 1)?);
        }
        self.known.insert(node.id(), total);
        Ok(total)
    }
}
