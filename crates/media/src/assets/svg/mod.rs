//! Strokes from SVG files: paths, polylines, polygons and lines, with the transforms of their groups.

mod numbers;
mod path;
mod transform;
mod xml;

use bansho_base::{
    geometry::strokes::{Drawing, Stroke},
    host::assets::AssetProblem,
    math::DVec2,
};

use self::{
    numbers::NumberReader,
    path::PathError,
    transform::Transform,
    xml::{Event, Events, Tag},
};

/// Largest number of points in all strokes.
const MAX_POINTS: usize = 1_000_000;

/// Elements whose contents are not drawn.
const HIDDEN_ELEMENTS: [&str; 8] = ["defs", "symbol", "clipPath", "mask", "marker", "pattern", "metadata", "style"];

/// Elements that are drawn but are not strokes.
const UNSUPPORTED_ELEMENTS: [&str; 7] = ["use", "text", "rect", "circle", "ellipse", "image", "foreignObject"];

fn damaged(reason: impl std::fmt::Display) -> AssetProblem {
    AssetProblem::Damaged(reason.to_string())
}

/// Decodes the strokes of an SVG file in drawing order. Each curve becomes 16 segments. Fills, widths, style sheets, `use` and nested
/// coordinate systems are ignored.
///
/// # Errors
/// A text that is not an SVG, an invalid path, no strokes, or more than a million points. Never panics.
pub fn decode_drawing(text: &str) -> Result<Drawing, AssetProblem> {
    let mut reader = SvgReader::default();
    let mut events = Events::new(text);
    let mut is_svg = false;
    while let Some(event) = events.next().map_err(damaged)? {
        match event {
            Event::Start(tag) => {
                is_svg |= tag.name == "svg";
                reader.start(&tag)?;
            }
            Event::End => drop(reader.levels.pop()),
        }
    }
    if !is_svg {
        return Err(damaged("it is not an SVG"));
    }
    reader.finish()
}

/// Inherited state of an element.
#[derive(Clone, Copy)]
struct GroupState {
    transform: Transform,
    is_drawn: bool,
}

#[derive(Default)]
struct SvgReader {
    levels: Vec<GroupState>,
    strokes: Vec<Stroke>,
    points: usize,
    /// Names of unsupported elements that were drawn.
    unsupported: Vec<&'static str>,
    /// The drawing area, from the root element.
    drawing_area: Option<[DVec2; 2]>,
}

impl SvgReader {
    fn start(&mut self, tag: &Tag) -> Result<(), AssetProblem> {
        let outer =
            self.levels.last().copied().unwrap_or(GroupState { transform: Transform::IDENTITY, is_drawn: true });
        let own = Transform::parse(tag.get("transform").unwrap_or_default());
        let own = own.ok_or_else(|| damaged(format!("{}: its transform cannot be read", self.name(tag))))?;
        let is_hidden = HIDDEN_ELEMENTS.contains(&tag.name) || tag.get("display") == Some("none") || is_hidden(tag);
        let level = GroupState { transform: outer.transform.after(&own), is_drawn: outer.is_drawn && !is_hidden };
        if tag.name == "svg" && self.levels.is_empty() {
            self.drawing_area = drawing_area(tag)?;
        }
        self.levels.push(level);
        if !level.is_drawn {
            return Ok(());
        }
        let unsupported = UNSUPPORTED_ELEMENTS.into_iter().find(|name| *name == tag.name);
        self.unsupported.extend(unsupported.filter(|name| !self.unsupported.contains(name)));
        for line in polylines(tag).map_err(|reason| damaged(format!("{}: {reason}", self.name(tag))))? {
            self.points += line.len();
            if self.points > MAX_POINTS {
                return Err(damaged(format!("it has more than {MAX_POINTS} points")));
            }
            let points: Vec<DVec2> = line.into_iter().map(|point| level.transform.apply(point)).collect();
            if !points.iter().all(|point| point.is_finite()) {
                return Err(damaged(format!("{}: a point is infinitely far away", self.name(tag))));
            }
            self.strokes.push(Stroke { id: tag.get("id").map(str::to_owned), points });
        }
        Ok(())
    }

    /// Name of an element in error messages: its id; without one, the number of strokes before it.
    fn name(&self, tag: &Tag) -> String {
        match tag.get("id") {
            Some(id) => format!("{} `{id}`", tag.name),
            None => format!("{} after {} strokes", tag.name, self.strokes.len()),
        }
    }

    fn finish(self) -> Result<Drawing, AssetProblem> {
        if self.strokes.is_empty() {
            return Err(AssetProblem::NoStrokes { instead: self.unsupported });
        }
        let points = || self.strokes.iter().flat_map(|stroke| stroke.points.iter().copied());
        let bounds = || [points().fold(DVec2::INFINITY, DVec2::min), points().fold(DVec2::NEG_INFINITY, DVec2::max)];
        let [min, max] = self.drawing_area.unwrap_or_else(bounds);
        Ok(Drawing { strokes: self.strokes, min, max })
    }
}

fn is_hidden(tag: &Tag) -> bool {
    let style = tag.get("style").unwrap_or_default();
    style
        .split(';')
        .filter_map(|rule| rule.split_once(':'))
        .any(|(key, value)| (key.trim(), value.trim()) == ("display", "none"))
}

/// The view box; without it, width and height if both are stated.
fn drawing_area(tag: &Tag) -> Result<Option<[DVec2; 2]>, AssetProblem> {
    let Some(view) = tag.get("viewBox") else {
        let side = |name: &str| NumberReader::new(tag.get(name)?).next().filter(|side| *side > 0.0);
        return Ok(side("width").zip(side("height")).map(|(width, height)| [DVec2::ZERO, DVec2::new(width, height)]));
    };
    let mut numbers = NumberReader::new(view);
    match (numbers.take_all::<4>(), numbers.next()) {
        (Some([x, y, width, height]), None) if width > 0.0 && height > 0.0 => {
            let low = DVec2::new(x, y);
            Ok(Some([low, low + DVec2::new(width, height)]))
        }
        _ => Err(damaged(format!("its viewBox is `{view}` (allowed: x, y, and a width and height above 0)"))),
    }
}

/// The polylines of an element; empty for elements of other kinds.
fn polylines(tag: &Tag) -> Result<Vec<Vec<DVec2>>, PathError> {
    let number = |name: &str| tag.get(name).and_then(|value| NumberReader::new(value).next()).unwrap_or(0.0);
    Ok(match tag.name {
        "path" => path::subpaths(tag.get("d").unwrap_or_default(), MAX_POINTS)?,
        "polyline" | "polygon" => {
            let mut numbers = NumberReader::new(tag.get("points").unwrap_or_default());
            let mut line: Vec<DVec2> =
                std::iter::from_fn(|| numbers.take_all::<2>()).map(DVec2::from).take(MAX_POINTS + 1).collect();
            if tag.name == "polygon" {
                line.extend(line.first().copied());
            }
            if line.len() > 1 { vec![line] } else { Vec::new() }
        }
        "line" => vec![vec![DVec2::new(number("x1"), number("y1")), DVec2::new(number("x2"), number("y2"))]],
        _ => Vec::new(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strokes_stand_where_their_groups_put_them() {
        let text = r#"<?xml version="1.0"?>
            <svg xmlns="http://www.w3.org/2000/svg" viewBox="-10 0 20 40" width="5cm">
              <defs><path d="M0 0L9 9"/></defs>
              <g transform="translate(1 2)">
                <path id="left" transform="scale(2)" d="M0 0L1 1"/>
                <polyline points="0,0 1,0 1,1"/>
                <g style="fill:none; display : none"><line x2="1" y2="1"/></g>
              </g>
              <line id="right" x1="1" y1="2" x2="3" y2="4"/>
              <circle r="3"/>
            </svg>"#;
        let drawing = decode_drawing(text).unwrap();
        let strokes: Vec<(Option<&str>, Vec<[f64; 2]>)> = drawing
            .strokes
            .iter()
            .map(|stroke| (stroke.id.as_deref(), stroke.points.iter().map(|point| point.to_array()).collect()))
            .collect();
        assert_eq!(
            strokes,
            [
                (Some("left"), vec![[1.0, 2.0], [3.0, 4.0]]),
                (None, vec![[1.0, 2.0], [2.0, 2.0], [2.0, 3.0]]),
                (Some("right"), vec![[1.0, 2.0], [3.0, 4.0]]),
            ]
        );
        assert_eq!((drawing.min, drawing.max), (DVec2::new(-10.0, 0.0), DVec2::new(10.0, 40.0)));
    }

    #[test]
    fn without_a_view_box_the_size_or_the_strokes_say_what_was_drawn_on() {
        let drawing = decode_drawing("<svg width='30mm' height='20mm'><line x2='1'/></svg>").unwrap();
        assert_eq!(drawing.max, DVec2::new(30.0, 20.0));
        let drawing = decode_drawing("<svg><path d='M1 2L5 4'/></svg>").unwrap();
        assert_eq!((drawing.min, drawing.max), (DVec2::new(1.0, 2.0), DVec2::new(5.0, 4.0)));
    }

    #[test]
    fn faults_name_their_path() {
        let error = |text: &str| decode_drawing(text).unwrap_err().to_string();
        assert!(error("<svg><path id='arc' d='M0 0L1'/></svg>").contains("path `arc`: "));
        assert!(error("<svg><path d='M0 0L1 1'/><path d='M0 0L1'/></svg>").contains("path after 1 strokes: "));
        assert!(
            error("<svg><g id='all' transform='turn(3)'/></svg>").contains("g `all`: its transform cannot be read")
        );
        for view in ["", "0 0 10", "0 0 10 0", "0 0 -3 4", "0 0 wide 3", "0 0 1 2 3"] {
            let shown = error(&format!("<svg viewBox='{view}'><path d='M0 0L1 1'/></svg>"));
            assert!(shown.contains(&format!("its viewBox is `{view}`")), "{shown}");
        }
    }

    #[test]
    fn what_holds_no_strokes_is_refused() {
        for (text, instead) in [
            ("<svg><path/></svg>", vec![]),
            ("<svg><circle r='1'/></svg>", vec!["circle"]),
            (
                "<svg><defs><path id='a' d='M0 0L1 1'/><rect/></defs><use href='#a'/><text>A</text><use/></svg>",
                vec!["use", "text"],
            ),
        ] {
            assert_eq!(decode_drawing(text), Err(AssetProblem::NoStrokes { instead }), "{text}");
        }
        let shown = decode_drawing("<svg><use/><text>A</text></svg>").unwrap_err().to_string();
        assert!(shown.starts_with("contains no strokes, only use, text (allowed: an SVG file with path"), "{shown}");
        for broken in ["", "<html/>", "<svg", "<svg><path d='M1'/></svg>", "<svg transform='x'/>", "</svg></svg>"] {
            assert!(matches!(decode_drawing(broken), Err(AssetProblem::Damaged(_))), "{broken}");
        }
        let far = "<svg><g transform='scale(1e300)'><path transform='scale(1e300)' d='M1 1L2 2'/></g></svg>";
        assert!(matches!(decode_drawing(far), Err(AssetProblem::Damaged(_))));
    }
}
