//! User-specified links between sheets and points of successive shapes, which override the automatic matching.

use super::{
    sheet_matching::MatchConstraint,
    split_merge::{Transition, sheet_index},
};
use crate::shapes::{
    LinkParameters, ShapeError, ShapeErrorKind, geometry::polyline::length_fractions,
    interpolation::spline_track::ControlPointTrack,
};

/// Minimum distance of a linked point from the ends of its sheet, as a fraction of the length: ends are matched to
/// ends.
const END_MARGIN: f64 = 1e-3;

/// Constraints from the links to a shape.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct LinkConstraints {
    /// Required match of each chain of strands.
    pub(crate) chain_constraints: Vec<MatchConstraint>,
    /// Control-point tracks and the fraction of the new sheet's length at which they must arrive.
    points: Vec<(usize, f64)>,
}

impl LinkConstraints {
    /// Constraints from `links` to shape `index`, which follows `sheets` by the transition `change`.
    ///
    /// # Errors
    ///
    /// A link to a missing sheet, two links of one sheet, linked points that change their order, or a point without an
    /// arrival.
    pub(crate) fn new(
        links: &[LinkParameters],
        index: usize,
        sheets: &[Vec<usize>],
        change: &Transition,
        tracks: &[ControlPointTrack],
    ) -> Result<Self, ShapeError> {
        let mut constraints =
            Self { chain_constraints: vec![MatchConstraint::default(); change.chains.len()], points: Vec::new() };
        for (number, link) in links.iter().enumerate() {
            let error = |kind| ShapeError { key: format!("shapes.{index}.link.{number}"), kind };
            let from = sheet_index(link.from, sheets.len()).map_err(error)?;
            let count = change.chains.len();
            let no_target = |_| error(ShapeErrorKind::NoSuchTarget { sheet: link.to, count });
            let to = sheet_index(link.to, count).map_err(no_target)?;
            let track = nearest(&sheets[from], link.from_length_fraction.unwrap_or(0.5), tracks, index - 1);
            constraints.constrain_chain(change, track, to).map_err(error)?;
            match (link.from_length_fraction, link.to_length_fraction) {
                (Some(_), Some(fraction)) => {
                    constraints.points.push((track, fraction.clamp(END_MARGIN, 1.0 - END_MARGIN)));
                }
                (Some(_), None) if !splits(&sheets[from], change) => {
                    return Err(error(ShapeErrorKind::PointWithoutArrival));
                }
                (_, None) => {}
                (None, Some(_)) => return Err(error(ShapeErrorKind::ArrivalWithoutPoint)),
            }
            constraints.check_order(change).map_err(error)?;
        }
        Ok(constraints)
    }

    /// Requires that the chain that contains `track` becomes sheet `to`.
    fn constrain_chain(&mut self, change: &Transition, track: usize, to: usize) -> Result<(), ShapeErrorKind> {
        let holds = |chain: &usize| change.tracks_of(*chain).contains(&track);
        // Every track of a sheet is in one of its strands.
        let own = (0..change.chains.len()).find(holds).unwrap_or_default();
        let other = self.chain_constraints.iter().position(|chain_constraint| chain_constraint.target == Some(to));
        if self.chain_constraints[own].target.is_some_and(|target| target != to)
            || other.is_some_and(|other| other != own)
        {
            return Err(ShapeErrorKind::LinkedTwice { sheet: to + 1 });
        }
        self.chain_constraints[own].target = Some(to);
        Ok(())
    }

    /// Linked points must arrive in ascending or descending order, which determines the sheet's direction.
    fn check_order(&mut self, change: &Transition) -> Result<(), ShapeErrorKind> {
        for (chain, chain_constraint) in self.chain_constraints.iter_mut().enumerate() {
            let tracks = change.tracks_of(chain);
            let arrives =
                |track: &usize| self.points.iter().find(|(own, _)| own == track).map(|(_, fraction)| *fraction);
            let arrivals: Vec<f64> = tracks.iter().filter_map(arrives).collect();
            let linked = self.points.iter().filter(|(own, _)| tracks.contains(own)).count();
            let [rising, falling] =
                [1.0, -1.0].map(|sign| arrivals.windows(2).all(|pair| sign * (pair[1] - pair[0]) > 0.0));
            if linked > arrivals.len() || !(rising || falling) {
                return Err(ShapeErrorKind::LinksCross);
            }
            chain_constraint.reversed = (arrivals.len() > 1).then_some(falling);
        }
        Ok(())
    }

    /// Linked points of `strand` as index and arrival, within `range` of the sheet.
    pub(crate) fn linked_points(&self, strand: &[usize], range: [f64; 2]) -> Vec<(usize, f64)> {
        let [low, high] = if range[0] <= range[1] { range } else { [range[1], range[0]] };
        let arrives = |(index, track): (usize, &usize)| {
            let (_, fraction) = self.points.iter().find(|(own, _)| own == track)?;
            Some((index, *fraction))
                .filter(|_| *fraction > low && *fraction < high && index > 0 && index + 1 < strand.len())
        };
        strand.iter().enumerate().filter_map(arrives).collect()
    }
}

/// Whether a sheet splits in the transition.
fn splits(sheet: &[usize], change: &Transition) -> bool {
    let whole =
        |strand: &Vec<usize>| [sheet.first(), sheet.last()].into_iter().flatten().all(|end| strand.contains(end));
    !change.strands.iter().any(whole)
}

/// The control point within `sheet` that is nearest to the fraction `at` of its length.
fn nearest(sheet: &[usize], at: f64, tracks: &[ControlPointTrack], knot: usize) -> usize {
    let positions: Vec<_> = sheet.iter().map(|&track| tracks[track].knot(knot).position).collect();
    let fractions = length_fractions(&positions);
    let inner = 1..(sheet.len() - 1).max(2);
    let nearest = inner.min_by(|&a, &b| (fractions[a] - at).abs().total_cmp(&(fractions[b] - at).abs()));
    sheet[nearest.unwrap_or_default()]
}
