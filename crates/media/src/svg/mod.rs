//! Strokes from SVG files: visible paths, polylines, polygons and lines, as `usvg` resolves `use`, nested `svg`, `switch`, units and transforms.
//!
//! `text` unpacks the file, and `markup` limits what the parser of XML would repeat. `document` finds what `usvg` would drop or cut without an error: faulty
//! data and elements that are not lines. It also reads the view box and counts the points of all uses. `style` matches style sheets, `moved` moves drawings
//! that are far from 0 near it, and `plain` writes the markup that `usvg` resolves. `strokes` turns the resolved tree into polylines.

mod document;
mod markup;
mod moved;
mod plain;
mod strokes;
mod style;
mod text;

use bansho_base::{
    geometry::strokes::{Drawing, DrawingRemark},
    host::assets::AssetProblem,
    math::DVec2,
};

/// Largest number of points in all strokes.
const MAX_POINTS: usize = 1_000_000;

fn damaged(reason: impl std::fmt::Display) -> AssetProblem {
    AssetProblem::Damaged(reason.to_string())
}

/// Decodes the strokes of an SVG file in drawing order, plain or packed by gzip. Each curve becomes 16 segments. A stroke's name is its own id, else that
/// of the nearest group; the drawing area is the view box, else the bounds of the strokes. Paint does not matter, and what is not displayed or
/// visible is left out.
///
/// # Errors
/// A file that is not an SVG, faulty data (with the line), no strokes, or more than a million points. Never panics.
pub fn decode_drawing(file: &[u8]) -> Result<Drawing, AssetProblem> {
    let text = text::unpacked(file)?;
    let document = document::read(&text)?;
    let options = usvg::Options {
        // Pictures are not drawn, so neither their files nor their data are read.
        image_href_resolver: usvg::ImageHrefResolver {
            resolve_data: Box::new(|_, _, _| None),
            resolve_string: Box::new(|_, _| None),
        },
        ..usvg::Options::default()
    };
    let tree = usvg::Tree::from_str(&document.text, &options).map_err(damaged)?;
    let strokes = strokes::of(tree.root(), document.origin)?;
    if strokes.is_empty() {
        return Err(AssetProblem::NoStrokes { instead: document.others });
    }
    let [mut min, mut max] = [DVec2::INFINITY, DVec2::NEG_INFINITY];
    for point in strokes.iter().flat_map(|stroke| &stroke.points) {
        (min, max) = (min.min(*point), max.max(*point));
    }
    if !document.is_moved {
        check_precision([min, max])?;
    }
    let [min, max] = document.view_box.unwrap_or([min, max]);
    // What a `use` shows is among the strokes, or another element that is named.
    let names: Vec<&'static str> = document.others.into_iter().filter(|name| *name != "use").collect();
    let others = (!names.is_empty()).then_some(DrawingRemark::OtherElements { names });
    let dots = (document.dots > 0).then_some(DrawingRemark::Dots { paths: document.dots });
    Ok(Drawing { strokes, min, max, remarks: others.into_iter().chain(dots).collect() })
}

/// Largest distance from 0 in multiples of the extent at which single precision is exact to 1e-4 of the extent.
const MAX_DISTANCE: f64 = 1600.0;

/// Rejects drawings so far from 0 that single precision, in which they are resolved, would bend them.
fn check_precision([min, max]: [DVec2; 2]) -> Result<(), AssetProblem> {
    let (extent, distance) = ((max - min).max_element(), min.abs().max(max.abs()).max_element());
    if distance <= MAX_DISTANCE * extent {
        return Ok(());
    }
    Err(damaged(format!(
        "its strokes are {distance:.6} from the origin and extend over {extent:.6}; allowed: up to {MAX_DISTANCE} times their extent away. Move \
         them near the origin, or remove the transforms, uses and units that keep them from being moved"
    )))
}

#[cfg(test)]
mod tests;
