//! Links: explicit correspondences of sheets and points in one transition.

use bansho::{
    aurora::shapes::LinkParameters,
    base::{
        math::DVec2,
        parameters::{Table, Value},
    },
    scene::operation::Operation,
};

use super::{AuroraDrawing, polyline};

/// A position on a sheet of a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SheetPosition {
    /// Index of the sheet.
    pub sheet: usize,
    /// Fraction of the sheet's length.
    pub fraction: f64,
}

/// A linked point on two successive shapes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkedPoint {
    /// Index of the link in the list of the later shape.
    pub link: usize,
    /// The point on the earlier shape, km.
    pub from: DVec2,
    /// The point on the later shape, km.
    pub to: DVec2,
}

/// Links whose starts are closer than this fraction of the sheet's length are the same.
const SAME_POINT: f64 = 0.02;

impl AuroraDrawing {
    /// Links the sheet at `from` on the shape before `shape` to sheet `to`, which it becomes. No other transition changes.
    pub fn link_sheet(&self, shape: usize, from: SheetPosition, to: usize) -> Vec<Operation> {
        if !self.shows_changes() {
            // Sheets correspond by their order in the list.
            return self.exchange_sheets(shape, from.sheet, to);
        }
        let splits = self.parameters.shapes.get(shape).is_some_and(|shape| !shape.split.is_empty());
        let link = LinkParameters {
            from_length_fraction: splits.then(|| rounded(from.fraction)),
            ..link_between(from.sheet, to)
        };
        let kept = self.links(shape).iter().filter(|own| own.from != link.from && own.to != link.to);
        self.set_links(shape, kept.cloned().chain([link.clone()]).collect())
    }

    /// Links the point at `from` on the shape before `shape` to the point at `to`, where it arrives.
    pub fn link_point(&self, shape: usize, from: SheetPosition, to: SheetPosition) -> Vec<Operation> {
        let link = LinkParameters {
            from_length_fraction: Some(rounded(from.fraction)),
            to_length_fraction: Some(rounded(to.fraction)),
            ..link_between(from.sheet, to.sheet)
        };
        let mut links: Vec<LinkParameters> = self.links(shape).to_vec();
        // A sheet is linked with one other, at as many points as there are, of which each is linked once.
        links.retain(|other| (other.from == link.from) == (other.to == link.to) && !begin_at_same_point(other, &link));
        links.push(link);
        self.set_links(shape, links)
    }

    /// Removes the link to shape `shape` whose point arrives nearest to `near`, if one does within `radius`, km.
    pub fn unlink(&self, shape: usize, near: DVec2, radius: f64) -> Vec<Operation> {
        let points = self.linked_points(shape).into_iter().map(|point| (point.to.distance(near), point));
        let nearest = points.min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, removed)) = nearest.filter(|(distance, _)| *distance < radius) else { return Vec::new() };
        let kept = self.links(shape).iter().enumerate().filter(|(number, _)| *number != removed.link);
        self.set_links(shape, kept.map(|(_, link)| link.clone()).collect())
    }

    /// The points that are linked in the transition to shape `shape`.
    pub fn linked_points(&self, shape: usize) -> Vec<LinkedPoint> {
        let Some(before) = shape.checked_sub(1) else { return Vec::new() };
        let [leaving, arriving] = [before, shape].map(|shape| self.lines(shape));
        let points = self.links(shape).iter().enumerate().filter_map(|(index, link)| {
            let from = point_of_sheet(&leaving, link.from, link.from_length_fraction?)?;
            let to = point_of_sheet(&arriving, link.to, link.to_length_fraction?)?;
            Some(LinkedPoint { link: index, from, to })
        });
        points.collect()
    }

    pub(super) fn links(&self, shape: usize) -> &[LinkParameters] {
        self.parameters.shapes.get(shape).map_or(&[], |shape| &shape.link)
    }

    pub(super) fn set_links(&self, shape: usize, links: Vec<LinkParameters>) -> Vec<Operation> {
        vec![self.set_list(shape, "link", links.iter().map(table).collect())]
    }
}

/// A link between two sheets. Sheets in the scene count from 1.
fn link_between(from: usize, to: usize) -> LinkParameters {
    LinkParameters { from: from as i64 + 1, to: to as i64 + 1, ..LinkParameters::default() }
}

/// Rounded to a thousandth, so that files stay readable.
pub(super) fn rounded(fraction: f64) -> f64 {
    (fraction * 1000.0).round() / 1000.0
}

/// A link as a table. Both sheets are always stated: a link is read as a pair.
fn table(link: &LinkParameters) -> Table {
    let mut table = Table::default();
    table.push("from", Value::Integer(link.from));
    table.push("to", Value::Integer(link.to));
    for (key, fraction) in
        [("from_length_fraction", link.from_length_fraction), ("to_length_fraction", link.to_length_fraction)]
    {
        fraction.into_iter().for_each(|fraction| table.push(key, Value::Number(fraction)));
    }
    table
}

/// The point of sheet `sheet`, counted from 1 as in scenes, at a fraction of its length.
fn point_of_sheet(lines: &[Vec<DVec2>], sheet: i64, fraction: f64) -> Option<DVec2> {
    polyline::at(lines.get(usize::try_from(sheet - 1).ok()?)?, fraction)
}

/// Whether two links of points begin at the same one of their sheet.
fn begin_at_same_point(a: &LinkParameters, b: &LinkParameters) -> bool {
    a.from_length_fraction.zip(b.from_length_fraction).is_some_and(|(a, b)| (a - b).abs() < SAME_POINT)
}
