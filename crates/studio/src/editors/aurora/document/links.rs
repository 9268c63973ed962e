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

/// A position on a sheet: its index, and the fraction of its length.
pub type SheetPosition = (usize, f64);

/// Links whose starts are closer than this fraction of the sheet's length are the same.
const SAME: f64 = 0.02;

impl AuroraDrawing {
    /// Makes what lies at `from` on the shape before `shape` become sheet `to`. No other transition changes.
    pub fn link_sheet(&self, shape: usize, from: SheetPosition, to: usize) -> Vec<Operation> {
        if !self.shows_changes() {
            // Without transitions, the order of the list decides what becomes what.
            return self.exchange_sheets(shape, from.0, to);
        }
        let splits = self.parameters.shapes.get(shape).is_some_and(|shape| !shape.split.is_empty());
        let link = LinkParameters { from_length_fraction: splits.then(|| rounded(from.1)), ..between(from.0, to) };
        let kept = self.links(shape).iter().filter(|own| own.from != link.from && own.to != link.to);
        self.set_links(shape, kept.cloned().chain([link.clone()]).collect())
    }

    /// Makes the point at `from` on the shape before `shape` arrive at `to`.
    pub fn link_point(&self, shape: usize, from: SheetPosition, to: SheetPosition) -> Vec<Operation> {
        let link = LinkParameters {
            from_length_fraction: Some(rounded(from.1)),
            to_length_fraction: Some(rounded(to.1)),
            ..between(from.0, to.0)
        };
        let same_place = |own: &LinkParameters| {
            own.from_length_fraction.zip(link.from_length_fraction).is_some_and(|(a, b)| (a - b).abs() < SAME)
        };
        let stays = |own: &&LinkParameters| (own.from == link.from) == (own.to == link.to) && !same_place(own);
        let kept = self.links(shape).iter().filter(stays);
        self.set_links(shape, kept.cloned().chain([link.clone()]).collect())
    }

    /// Without the link to shape `shape` whose point arrives nearest to `near`, if one does within `reach`, km.
    pub fn unlink(&self, shape: usize, near: DVec2, reach: f64) -> Vec<Operation> {
        let off = |(_, [_, to]): &(usize, [DVec2; 2])| to.distance(near);
        let linked = self.linked(shape).into_iter().min_by(|a, b| off(a).total_cmp(&off(b)));
        let Some((taken, _)) = linked.filter(|linked| off(linked) < reach) else { return Vec::new() };
        let kept = self.links(shape).iter().enumerate().filter(|(number, _)| *number != taken);
        self.set_links(shape, kept.map(|(_, link)| link.clone()).collect())
    }

    /// Points that are linked on the way to shape `shape`: the link's number, where each leaves and where it arrives, km.
    pub fn linked(&self, shape: usize) -> Vec<(usize, [DVec2; 2])> {
        let Some(before) = shape.checked_sub(1) else { return Vec::new() };
        let [leaving, arriving] = [before, shape].map(|shape| self.lines(shape));
        let at = |all: &[Vec<DVec2>], sheet: i64, fraction: f64| {
            polyline::at(all.get(usize::try_from(sheet - 1).ok()?)?, fraction)
        };
        let ends = |(number, link): (usize, &LinkParameters)| {
            let [leaves, arrives] = [link.from_length_fraction?, link.to_length_fraction?];
            Some((number, [at(&leaving, link.from, leaves)?, at(&arriving, link.to, arrives)?]))
        };
        self.links(shape).iter().enumerate().filter_map(ends).collect()
    }

    pub(super) fn links(&self, shape: usize) -> &[LinkParameters] {
        self.parameters.shapes.get(shape).map_or(&[], |shape| &shape.link)
    }

    pub(super) fn set_links(&self, shape: usize, links: Vec<LinkParameters>) -> Vec<Operation> {
        vec![self.set_list(shape, "link", links.iter().map(table).collect())]
    }
}

/// Sheets in the scene count from 1.
fn between(from: usize, to: usize) -> LinkParameters {
    LinkParameters { from: from as i64 + 1, to: to as i64 + 1, ..LinkParameters::default() }
}

pub(super) fn rounded(fraction: f64) -> f64 {
    (fraction * 1000.0).round() / 1000.0
}

/// Both sheets are always stated: a link is read as a pair.
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
