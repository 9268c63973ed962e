//! The first pass over an SVG: what `usvg` would drop, cut or move without a word.

use std::{collections::HashMap, str::FromStr};

use bansho_base::{host::assets::AssetProblem, math::DVec2};
use roxmltree::{Attribute, Document, Node, NodeId, ParsingOptions};
use svgtypes::{NumberListParser, PathParser, PathSegment};

use super::{
    MAX_POINTS, damaged, markup, moved,
    plain::{self, Replacements},
    strokes::CURVE_SEGMENTS,
};

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
/// Most bytes of the attributes of all uses, which are read once for each.
const MAX_BYTES: u64 = 256 << 20;
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
    markup::check(text)?;
    let options = ParsingOptions { allow_dtd: true, nodes_limit: MAX_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options).map_err(|error| match error {
        _ if !text.contains("<svg") && !text.contains(":svg") => damaged("it is not an SVG"),
        error => damaged(error),
    })?;
    let root = document.root_element();
    if root.tag_name().name() != "svg" {
        return Err(damaged("it is not an SVG"));
    }
    let is_hidden = hidden_elements(&document)?;
    let mut check = DataCheck {
        document: &document,
        is_hidden: &is_hidden,
        strokes: 0,
        dots: 0,
        others: Vec::new(),
        points: HashMap::new(),
    };
    check.all(root)?;
    let total = UseCount::new(&document, &check.points).of(root, 0)?;
    if total.points > MAX_POINTS as u64 {
        return Err(damaged(format!("it has more than {MAX_POINTS} points")));
    }
    if total.bytes > MAX_BYTES {
        return Err(damaged(format!("the attributes of all that it uses have more than {MAX_BYTES} bytes")));
    }
    let view_box = view_box(root)?;
    let mut replacements = Replacements::new();
    if view_box.is_some() {
        let sides = ["width", "height", "preserveAspectRatio", "x", "y"];
        replacements.extend(sides.map(|side| ((root.id(), side), None)));
    }
    let moved = moved::of(&document);
    let is_moved = moved.is_some();
    let mut origin = view_box.map_or(DVec2::ZERO, |[min, _]| min);
    if let Some(moved) = moved {
        origin = moved.offset;
        replacements.extend(moved.replacements);
        if let Some([min, max]) = view_box {
            let sides = format!("0 0 {} {}", max.x - min.x, max.y - min.y);
            replacements.insert((root.id(), "viewBox"), Some(sides));
        }
    }
    let text = plain::written(&document, &replacements)?;
    Ok(SvgDocument { text, origin, is_moved, view_box, others: check.others, dots: check.dots })
}

/// For each node whether it is in an element whose contents are not drawn where they stand.
fn hidden_elements(document: &Document) -> Result<Vec<bool>, AssetProblem> {
    let mut nodes: Vec<(usize, bool)> = Vec::new();
    // Parents come before what is in them.
    for node in document.descendants() {
        let (depth, is_hidden) = node.parent().map_or((0, false), |parent| nodes[parent.id().get_usize()]);
        if depth > MAX_DEPTH + 1 {
            return Err(too_deep());
        }
        debug_assert_eq!(node.id().get_usize(), nodes.len());
        nodes.push((depth + 1, is_hidden || HIDDEN_ELEMENTS.contains(&node.tag_name().name())));
    }
    Ok(nodes.into_iter().map(|(_, is_hidden)| is_hidden).collect())
}

fn too_deep() -> AssetProblem {
    damaged(format!("it has elements more than {MAX_DEPTH} deep, or that use themselves"))
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
    /// For each node whether it is not drawn where it stands.
    is_hidden: &'a [bool],
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
            let is_hidden = self.is_hidden[node.id().get_usize()];
            let is_other = OTHER_ELEMENTS.into_iter().find(|other| *other == name).filter(|_| !is_hidden);
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
            self.dots +=
                usize::from(name == "path" && !is_hidden && moved::is_dot(node.attribute("d").unwrap_or_default()));
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
            // Relative segments add up, so that the sum bounds every position.
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
                // `usvg` makes of an arc up to four curves, one for each quarter.
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

/// What an element and all in it cost.
#[derive(Clone, Copy, Default)]
struct UseCost {
    /// Points, and one for each element, so that uses of nothing are bounded too.
    points: u64,
    /// Bytes of attributes.
    bytes: u64,
    /// Elements within one another.
    height: usize,
}

/// Counts what all uses draw.
struct UseCount<'a, 'd> {
    ids: HashMap<&'a str, Node<'a, 'd>>,
    /// Points of each element alone.
    points: &'a HashMap<NodeId, u64>,
    /// The costs that are counted already.
    costs: HashMap<NodeId, UseCost>,
}

impl<'a, 'd> UseCount<'a, 'd> {
    fn new(document: &'a Document<'d>, points: &'a HashMap<NodeId, u64>) -> Self {
        let named = document.descendants().filter_map(|node| Some((node.attribute("id")?, node)));
        let mut ids = HashMap::new();
        named.for_each(|(id, node)| {
            ids.entry(id).or_insert(node);
        });
        Self { ids, points, costs: HashMap::new() }
    }

    /// The cost of an element that is in `depth` others.
    fn of(&mut self, node: Node<'a, 'd>, depth: usize) -> Result<UseCost, AssetProblem> {
        let counted = self.costs.get(&node.id()).copied();
        // This also ends what uses itself.
        if depth + counted.map_or(0, |cost| cost.height) > MAX_DEPTH {
            return Err(too_deep());
        }
        if let Some(cost) = counted {
            return Ok(cost);
        }
        let attributes = node.attributes().map(|attribute| attribute.value().len() as u64).sum();
        let points = 1 + self.points.get(&node.id()).copied().unwrap_or(0);
        let mut total = UseCost { points, bytes: attributes, height: 0 };
        let target = plain::target(node).and_then(|id| self.ids.get(id)).copied();
        for inner in node.children().filter(Node::is_element).chain(target) {
            let cost = self.of(inner, depth + 1)?;
            total.points = total.points.saturating_add(cost.points);
            total.bytes = total.bytes.saturating_add(cost.bytes);
            total.height = total.height.max(cost.height + 1);
        }
        self.costs.insert(node.id(), total);
        Ok(total)
    }
}
