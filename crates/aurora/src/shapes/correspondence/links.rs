//! User-specified links between sheets and points of successive shapes, which override the automatic matching.

use super::{
    sheet_matching::MatchConstraint,
    split_merge::{Transition, sheet_index},
    time_warping::Anchor,
};
use crate::shapes::{
    LinkParameters, ShapeError, ShapeErrorKind, geometry::polyline::length_fractions, interpolation::ControlPointTrack,
};

/// Minimum distance of a linked point from the ends of its sheet, as a fraction of the length: ends are matched to
/// ends.
const END_MARGIN: f64 = 1e-3;

/// Constraints from the links to a shape.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct LinkConstraints {
    /// Required match of each chain of strands.
    pub(crate) chain_constraints: Vec<MatchConstraint>,
    points: Vec<LinkedPoint>,
}

/// A control point with a given position in the next shape.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LinkedPoint {
    /// Its track.
    track: usize,
    /// Fraction of the new sheet's length at which it must arrive.
    fraction: f64,
}

impl LinkConstraints {
    /// Constraints from `links` to shape `index`, whose transition from `sheets` is `transition`.
    ///
    /// # Errors
    ///
    /// A link to a missing sheet, two links of one sheet, linked points that exchange their order, or a point without a
    /// position of arrival.
    pub(crate) fn new(
        links: &[LinkParameters],
        index: usize,
        sheets: &[Vec<usize>],
        transition: &Transition,
        tracks: &[ControlPointTrack],
    ) -> Result<Self, ShapeError> {
        let mut constraints =
            Self { chain_constraints: vec![MatchConstraint::default(); transition.chains.len()], points: Vec::new() };
        for (number, link) in links.iter().enumerate() {
            constraints
                .add(link, index - 1, sheets, transition, tracks)
                .map_err(|kind| ShapeError::in_shape(index, &format!("link.{number}"), kind))?;
        }
        Ok(constraints)
    }

    /// Adds the constraints of a link from `sheets` of shape `knot`.
    fn add(
        &mut self,
        link: &LinkParameters,
        knot: usize,
        sheets: &[Vec<usize>],
        transition: &Transition,
        tracks: &[ControlPointTrack],
    ) -> Result<(), ShapeErrorKind> {
        let from = sheet_index(link.from, sheets.len())?;
        let count = transition.chains.len();
        let to = sheet_index(link.to, count).map_err(|_| ShapeErrorKind::NoSuchTarget { sheet: link.to, count })?;
        let track = nearest(&sheets[from], link.from_length_fraction.unwrap_or(0.5), tracks, knot);
        self.constrain_chain(transition, track, to)?;
        match (link.from_length_fraction, link.to_length_fraction) {
            (Some(_), Some(fraction)) => {
                let fraction = fraction.clamp(END_MARGIN, 1.0 - END_MARGIN);
                self.points.push(LinkedPoint { track, fraction });
            }
            (Some(_), None) if !splits(&sheets[from], transition) => return Err(ShapeErrorKind::PointWithoutArrival),
            (_, None) => {}
            (None, Some(_)) => return Err(ShapeErrorKind::ArrivalWithoutPoint),
        }
        self.check_order(transition)
    }

    /// Fraction of the new sheet's length at which a track must arrive, if it is linked.
    fn arrival(&self, track: usize) -> Option<f64> {
        self.points.iter().find(|point| point.track == track).map(|point| point.fraction)
    }

    /// Requires that the chain that contains `track` becomes sheet `to`.
    fn constrain_chain(&mut self, transition: &Transition, track: usize, to: usize) -> Result<(), ShapeErrorKind> {
        // Every track of a sheet is in one of its strands.
        let chain = (0..transition.chains.len()).find(|chain| transition.tracks_of(*chain).contains(&track));
        let chain = chain.unwrap_or_default();
        let other = self.chain_constraints.iter().position(|chain_constraint| chain_constraint.target == Some(to));
        if self.chain_constraints[chain].target.is_some_and(|target| target != to)
            || other.is_some_and(|other| other != chain)
        {
            return Err(ShapeErrorKind::LinkedTwice { sheet: to + 1 });
        }
        self.chain_constraints[chain].target = Some(to);
        Ok(())
    }

    /// Linked points must arrive in ascending or descending order, which determines the sheet's direction.
    fn check_order(&mut self, transition: &Transition) -> Result<(), ShapeErrorKind> {
        for chain in 0..self.chain_constraints.len() {
            let tracks = transition.tracks_of(chain);
            let arrivals: Vec<f64> = tracks.iter().filter_map(|&track| self.arrival(track)).collect();
            let linked = self.points.iter().filter(|point| tracks.contains(&point.track)).count();
            let [rising, falling] =
                [1.0, -1.0].map(|sign| arrivals.windows(2).all(|pair| sign * (pair[1] - pair[0]) > 0.0));
            if linked > arrivals.len() || !(rising || falling) {
                return Err(ShapeErrorKind::LinksCross);
            }
            self.chain_constraints[chain].reversed = (arrivals.len() > 1).then_some(falling);
        }
        Ok(())
    }

    /// Linked points of `strand` that arrive within `range` of the sheet's length.
    pub(crate) fn anchors(&self, strand: &[usize], range: [f64; 2]) -> Vec<Anchor> {
        let [low, high] = if range[0] <= range[1] { range } else { [range[1], range[0]] };
        let mut anchors = Vec::new();
        for (point, &track) in strand.iter().enumerate() {
            let Some(fraction) = self.arrival(track) else { continue };
            if fraction > low && fraction < high && point > 0 && point + 1 < strand.len() {
                anchors.push(Anchor { point, fraction });
            }
        }
        anchors
    }
}

/// Whether a sheet splits in the transition.
fn splits(sheet: &[usize], transition: &Transition) -> bool {
    let ends = sheet.first().into_iter().chain(sheet.last());
    !transition.strands.iter().any(|strand| ends.clone().all(|end| strand.contains(end)))
}

/// The inner control point of `sheet` that is nearest to a fraction of its length.
fn nearest(sheet: &[usize], fraction: f64, tracks: &[ControlPointTrack], knot: usize) -> usize {
    let positions: Vec<_> = sheet.iter().map(|&track| tracks[track].knot(knot).position).collect();
    let fractions = length_fractions(&positions);
    let inner = 1..(sheet.len() - 1).max(2);
    let nearest = inner.min_by(|&a, &b| (fractions[a] - fraction).abs().total_cmp(&(fractions[b] - fraction).abs()));
    sheet[nearest.unwrap_or_default()]
}
