//! The refined in-between shape: a smooth curve through the control points, wound by swirls, with folds that travel along it.

use bansho_base::{
    math::{DVec2, lerp, random::Key},
    noise::{Coordinate, Fractal, Noise},
};

use super::{
    arc_length::{ArcLengthMap, ArcPosition},
    swirls::Swirls,
};
use crate::{
    AuroraParameters, FoldParameters,
    shapes::{Bridge, NearestSegmentGrid, Shape, Sheet, SheetEnd, SheetSampler, cumulative_lengths, line_length},
};

/// Segments per fold, unless there would be too many.
const PIECES_PER_FOLD: f64 = 12.0;
/// Minimum segment length is L_thr divided by this.
const PIECES_PER_THICKNESS: f64 = 4.0;
/// Points closer than this many segments may be swapped.
const NEAR_PIECES: f64 = 2.0;
/// Maximum segments of all sheets, per particle and in total, and the minimum of that limit; never fewer than one per
/// control segment.
const MAX_SEGMENTS: f64 = 20_000.0;
const PIECES_PER_PARTICLE: f64 = 0.05;
const MIN_MAX_SEGMENTS: f64 = 2_000.0;
/// Normalization: gradient noise rarely exceeds half of its range.
const SWING: f64 = 2.0;

/// Parameters of refinement and folds.
#[derive(Clone, Debug)]
pub(crate) struct FoldModel {
    parameters: FoldParameters,
    noise: Noise<2>,
    swirls: Option<Swirls>,
    piece_km: f64,
    max_pieces: f64,
    half_km: f64,
}

impl FoldModel {
    pub(crate) fn new(aurora: &AuroraParameters, key: Key) -> Self {
        let parameters = aurora.folds.clone();
        let [seed, ..] = key.words(0, 0, bansho_base::math::random::Purpose::named("aurora folds"));
        let fractal = Fractal { octaves: 2, ..Fractal::default() };
        let noise = Noise::new(seed, fractal, [0; 2]).expect("two octaves without a period are noise");
        let fold =
            if parameters.amplitude_km > 0.0 { parameters.wavelength_km / PIECES_PER_FOLD } else { f64::INFINITY };
        // Detail finer than a fraction of the thickness is not visible.
        let piece_km = fold.min(aurora.cell_km()).max(aurora.half_thickness_km() / PIECES_PER_THICKNESS);
        let max_pieces = (PIECES_PER_PARTICLE * aurora.particles.count as f64).clamp(MIN_MAX_SEGMENTS, MAX_SEGMENTS);
        let swirls = Swirls::new(aurora, key);
        Self { noise, swirls, piece_km, max_pieces, half_km: aurora.extent_km / 2.0, parameters }
    }

    /// Lateral displacement of the sheet at a coordinate and a time, km.
    fn swing(&self, along: f64, time: f64) -> f64 {
        let FoldParameters { amplitude_km, wavelength_km, speed_km_per_s, lifetime_s, .. } = self.parameters;
        let coordinates = [(along - speed_km_per_s * time) / wavelength_km, time / lifetime_s];
        SWING * amplitude_km * f64::from(self.noise.at(coordinates.map(Coordinate::from_f64)))
    }
}

/// The refined, folded shape with nearest-point queries.
#[derive(Clone, Debug)]
pub(crate) struct RefinedShape {
    pub(crate) shape: Shape,
    /// Arc-length coordinate of each point, km.
    arc_coordinates: Vec<Vec<f64>>,
    /// Fraction of the sheet's length at each point.
    fractions: Vec<Vec<f64>>,
    /// Sheet and index of the start of each segment, over all sheets.
    starts: Vec<[u32; 2]>,
    /// Attributes of each segment, in the same order.
    attributes: Vec<SegmentAttributes>,
    near: NearestSegmentGrid,
}

/// Attributes at the start of a segment, and their change to its end.
#[derive(Clone, Copy, Debug)]
struct SegmentAttributes {
    fraction: [f64; 2],
    flux: [f64; 2],
    energy: [f64; 2],
    /// One over its length, 1/km, negative where the sheet is listed against its coordinate; 0 for a degenerate
    /// segment.
    per_length: f64,
    sheet: u32,
}

/// A piece of a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SheetPiece {
    pub(crate) sheet: usize,
    /// Fraction of the sheet's length at its middle.
    pub(crate) fraction: f64,
    /// Factor of the aurora's flux at its middle.
    pub(crate) flux: f64,
    pub(crate) length_km: f64,
}

/// The point of a sheet that is nearest to a particle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SheetProjection {
    pub(crate) sheet: u32,
    pub(crate) fraction: f64,
    pub(crate) flux: f64,
    pub(crate) energy: f64,
    /// Signed distance, km, negative to the left of the coordinate's direction.
    pub(crate) side: f64,
}

impl RefinedShape {
    /// Refines `shape` and the bridges over its gaps at a time, for queries within `reach` km.
    pub(crate) fn new(
        shape: &Shape,
        bridges: &[Bridge],
        arc_map: &ArcLengthMap,
        folds: &FoldModel,
        time: f64,
        reach: f64,
    ) -> Self {
        // Each control segment has a whole number of segments, at most one more than would fit.
        let segments: usize = shape.sheets.iter().map(|sheet| sheet.points.len().saturating_sub(1)).sum();
        let piece = folds.piece_km.max(shape.length() / (folds.max_pieces - segments as f64).max(1.0));
        let (mut fine, mut arc_positions) = (Shape::default(), Vec::new());
        for (index, sheet) in shape.sheets.iter().enumerate() {
            let (mut refined, positions) = refine(sheet, piece, |point, t| arc_map.interpolate(index, point, t));
            if let Some(swirls) = &folds.swirls {
                wind(&mut refined, swirls, folds.half_km, time);
            }
            if folds.parameters.amplitude_km > 0.0 {
                fold(&mut refined, &positions, folds, time);
            }
            fine.sheets.push(refined);
            arc_positions.push(positions);
        }
        for bridge in bridges {
            let (refined, positions) = bridge_sheet(bridge, &fine, &arc_positions, piece);
            fine.sheets.push(refined);
            arc_positions.push(positions);
        }
        let (mut fractions, mut starts) = (Vec::new(), Vec::new());
        for (index, sheet) in fine.sheets.iter().enumerate() {
            starts.extend((1..sheet.points.len()).map(|point| [index as u32, point as u32 - 1]));
            fractions.push(length_fractions(&sheet.points));
        }
        let attributes =
            starts.iter().map(|start| SegmentAttributes::new(&fine, &arc_positions, &fractions, *start)).collect();
        let arc_coordinates = arc_positions
            .iter()
            .map(|arc_positions| arc_positions.iter().map(|arc_position| arc_position.coordinate).collect())
            .collect();
        let near = NearestSegmentGrid::new(&fine, reach);
        Self { shape: fine, arc_coordinates, fractions, starts, attributes, near }
    }

    /// A sampler of its segments.
    pub(crate) fn segments(&self) -> SheetSampler<'_> {
        SheetSampler::new(&self.shape)
    }

    /// Length of each sheet, km.
    pub(crate) fn sheet_lengths(&self) -> Vec<f64> {
        self.shape.sheets.iter().map(|sheet| line_length(&sheet.points)).collect()
    }

    /// The position at a fraction of a sheet's length, km.
    pub(crate) fn position(&self, sheet: usize, fraction: f64) -> DVec2 {
        let (point, t) = self.split(sheet, fraction);
        let points = &self.shape.sheets[sheet].points;
        points[point].lerp(points[point + 1], t)
    }

    /// Coordinates at `last + 1` equally spaced fractions of a sheet's length, km.
    pub(crate) fn arc_coordinates(&self, sheet: usize, last: usize) -> Vec<f64> {
        let (arc_coordinates, fractions) = (&self.arc_coordinates[sheet], &self.fractions[sheet]);
        let mut coordinates = Vec::with_capacity(last + 1);
        let mut after = 1;
        for node in 0..=last {
            let fraction = node as f64 / last as f64;
            // Both ascend, so the search goes on from the node before.
            while after + 1 < fractions.len() && fractions[after] <= fraction {
                after += 1;
            }
            let t = fraction_between([fractions[after - 1], fractions[after]], fraction);
            coordinates.push(lerp(arc_coordinates[after - 1], arc_coordinates[after], t));
        }
        coordinates
    }

    /// Point before a fraction of a sheet's length, and the interpolation fraction.
    fn split(&self, sheet: usize, fraction: f64) -> (usize, f64) {
        let fractions = &self.fractions[sheet];
        let after = fractions.partition_point(|end| *end <= fraction).clamp(1, fractions.len() - 1);
        (after - 1, fraction_between([fractions[after - 1], fractions[after]], fraction))
    }

    /// All segments, subdivided into pieces of at most a fraction of their sheet's length, `max_fraction(sheet)`.
    pub(crate) fn pieces(&self, max_fraction: impl Fn(usize) -> f64) -> impl Iterator<Item = SheetPiece> {
        self.starts.iter().flat_map(move |start| {
            let [number, index] = start.map(|index| index as usize);
            let (sheet, fractions) = (&self.shape.sheets[number], &self.fractions[number]);
            let length = sheet.points[index].distance(sheet.points[index + 1]);
            let count = ((fractions[index + 1] - fractions[index]) / max_fraction(number)).ceil().max(1.0);
            (0..count as usize).map(move |t| {
                let middle = (t as f64 + 0.5) / count;
                let [fraction, flux] =
                    [fractions, &sheet.flux].map(|values| lerp(values[index], values[index + 1], middle));
                SheetPiece { sheet: number, fraction, flux, length_km: length / count }
            })
        })
    }

    /// Distance to the shape, km; `None` beyond the reach.
    pub(crate) fn distance(&self, point: DVec2) -> Option<f64> {
        self.near.distance(point)
    }

    /// Indices of sheet and segment nearest to `point`; `None` beyond the reach.
    pub(crate) fn nearest_segment(&self, point: DVec2) -> Option<[usize; 2]> {
        self.near.nearest(point).map(|(segment, _)| self.starts[segment].map(|number| number as usize))
    }

    /// The point of a sheet nearest to `point`; `None` beyond the reach.
    #[inline]
    pub(crate) fn project(&self, point: DVec2) -> Option<SheetProjection> {
        let nearest = self.near.nearest_point(point)?;
        let attributes = &self.attributes[nearest.segment];
        let [fraction, flux, energy] = [attributes.fraction, attributes.flux, attributes.energy]
            .map(|[start, change]| start + nearest.fraction * change);
        Some(SheetProjection {
            sheet: attributes.sheet,
            fraction,
            flux,
            energy,
            side: nearest.cross * attributes.per_length,
        })
    }
}

impl SegmentAttributes {
    fn new(
        shape: &Shape,
        arc_positions: &[Vec<ArcPosition>],
        fractions: &[Vec<f64>],
        [sheet, index]: [u32; 2],
    ) -> Self {
        let (number, index) = (sheet as usize, index as usize);
        let sheet_points = &shape.sheets[number];
        let [fraction, flux, energy] = [&fractions[number], &sheet_points.flux, &sheet_points.energy]
            .map(|values| [values[index], values[index + 1] - values[index]]);
        let length = sheet_points.points[index].distance(sheet_points.points[index + 1]);
        Self {
            fraction,
            flux,
            energy,
            per_length: if length > 0.0 { arc_positions[number][index].direction / length } else { 0.0 },
            sheet,
        }
    }
}

/// Interpolation fraction of a fraction of the length between those of two points, clamped to 0 to 1.
fn fraction_between([before, end]: [f64; 2], fraction: f64) -> f64 {
    ((fraction - before) / (end - before).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
}

/// Fraction of the length at each point; 0 everywhere for a line without length.
fn length_fractions(points: &[DVec2]) -> Vec<f64> {
    let ends = cumulative_lengths(points);
    let length = ends.last().copied().unwrap_or(0.0).max(f64::MIN_POSITIVE);
    ends.iter().map(|end| end / length).collect()
}

/// Refines a sheet to a cubic Hermite curve in segments of about that length, and interpolates the coordinate.
fn refine(sheet: &Sheet, piece_km: f64, arc_position: impl Fn(usize, f64) -> ArcPosition) -> (Sheet, Vec<ArcPosition>) {
    let points = without_swapped_points(&sheet.points, NEAR_PIECES * piece_km);
    let headings = headings(&points);
    let (mut fine, mut arc_positions) = (Sheet::default(), Vec::new());
    for (index, pair) in points.windows(2).enumerate() {
        let displacement = pair[1] - pair[0];
        let length = displacement.length();
        let tangents = [headings[index], headings[index + 1]]
            .map(|heading| without_backward_component(heading, displacement) * length);
        let pieces = (length / piece_km).ceil().max(1.0) as usize;
        for number in 0..pieces {
            let t = number as f64 / pieces as f64;
            fine.points.push(hermite([pair[0], pair[1]], tangents, t));
            push_factors(&mut fine, sheet, index, t);
            arc_positions.push(arc_position(index, t));
        }
    }
    if let Some(last) = points.len().checked_sub(2) {
        fine.points.push(points[last + 1]);
        push_factors(&mut fine, sheet, last, 1.0);
        arc_positions.push(arc_position(last, 1.0));
    }
    (fine, arc_positions)
}

/// Appends flux and energy of `sheet` at the fraction `t` between point `index` and the next to those of `fine`.
fn push_factors(fine: &mut Sheet, sheet: &Sheet, index: usize, t: f64) {
    fine.flux.push(lerp(sheet.flux[index], sheet.flux[index + 1], t));
    fine.energy.push(lerp(sheet.energy[index], sheet.energy[index + 1], t));
}

/// A bridge as a sheet between two ends; the coordinate continues that of the first.
fn bridge_sheet(
    bridge: &Bridge,
    fine: &Shape,
    arc_positions: &[Vec<ArcPosition>],
    piece_km: f64,
) -> (Sheet, Vec<ArcPosition>) {
    let points =
        bridge.ends.map(|SheetEnd { sheet, is_end }| if is_end { fine.sheets[sheet].points.len() - 1 } else { 0 });
    let [from, to] = [0, 1].map(|side| fine.sheets[bridge.ends[side].sheet].points[points[side]]);
    let first_end = bridge.ends[0];
    let start = arc_positions[first_end.sheet][points[0]];
    let direction = if first_end.is_end { start.direction } else { -start.direction };
    let length = from.distance(to);
    let pieces = (length / piece_km).ceil().max(1.0) as usize;
    let (mut sheet, mut arc_positions) = (Sheet::default(), Vec::new());
    for number in 0..=pieces {
        let t = number as f64 / pieces as f64;
        sheet.points.push(from.lerp(to, t));
        sheet.flux.push(bridge.flux);
        sheet.energy.push(bridge.energy);
        arc_positions.push(ArcPosition { coordinate: start.coordinate + direction * t * length, direction });
    }
    (sheet, arc_positions)
}

/// Swaps neighboring points closer than `near_km` that are in the wrong order, as occurs where a fold forms. Otherwise
/// the sheet would pass there three times and be three times as bright.
fn without_swapped_points(points: &[DVec2], near_km: f64) -> Vec<DVec2> {
    let mut points = points.to_vec();
    for index in 1..points.len().saturating_sub(2) {
        let [before, one, other, after] = [0, 1, 2, 3].map(|next| points[index - 1 + next]);
        let displacement = other - one;
        if displacement.length() < near_km
            && displacement.dot(one - before) < 0.0
            && displacement.dot(after - other) < 0.0
        {
            points.swap(index, index + 1);
        }
    }
    points
}

/// Tangent direction at each point: that of the circle through it and its neighbors.
fn headings(points: &[DVec2]) -> Vec<DVec2> {
    let mut headings = Vec::with_capacity(points.len());
    let mut before = DVec2::ZERO;
    for (index, point) in points.iter().enumerate() {
        // The tangent of the circle is the sum of the displacements, each divided by its squared length.
        let after = points.get(index + 1).map_or(DVec2::ZERO, |next| {
            let displacement = *next - *point;
            displacement / displacement.length_squared().max(1e-12)
        });
        headings.push((before + after).normalize_or_zero());
        before = after;
    }
    headings
}

/// Removes the backward component of a tangent, which would make the curve pass there three times.
fn without_backward_component(heading: DVec2, displacement: DVec2) -> DVec2 {
    let back = (heading.dot(displacement) / displacement.length_squared().max(1e-12)).min(0.0);
    heading - displacement * back
}

/// Cubic Hermite interpolation.
fn hermite([a, b]: [DVec2; 2], [at_a, at_b]: [DVec2; 2], t: f64) -> DVec2 {
    let (t_squared, rest) = (t * t, 1.0 - t);
    let rest_squared = rest * rest;
    a * (rest_squared * (1.0 + 2.0 * t)) + b * (t_squared * (3.0 - 2.0 * t)) + at_a * (t * rest_squared)
        - at_b * (t_squared * rest)
}

/// Carries every point by the flow of the swirls.
fn wind(sheet: &mut Sheet, swirls: &Swirls, half_km: f64, time: f64) {
    let half = DVec2::splat(half_km);
    swirls.carry_all(&mut sheet.points, time);
    sheet.points.iter_mut().for_each(|point| *point = point.clamp(-half, half));
}

/// Displaces every point laterally, and along the sheet so that crests lean over, relative to the coordinate's
/// direction.
fn fold(sheet: &mut Sheet, arc_positions: &[ArcPosition], folds: &FoldModel, time: f64) {
    let headings = headings(&sheet.points);
    let half = DVec2::splat(folds.half_km);
    for ((point, heading), arc_position) in sheet.points.iter_mut().zip(headings).zip(arc_positions) {
        let swing = arc_position.direction * folds.swing(arc_position.coordinate, time);
        *point = (*point + swing * (heading.perp() + folds.parameters.curl * heading)).clamp(-half, half);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::cumulative_lengths as ways;

    fn folds(folds: FoldParameters) -> FoldModel {
        FoldModel::new(&AuroraParameters { folds, ..AuroraParameters::default() }, Key::new(3, "folds"))
    }

    #[test]
    fn crests_travel_along_the_sheet_as_fast_as_told() {
        for speed_km_per_s in [-3.0, 0.0, 5.0] {
            let folds = folds(FoldParameters { speed_km_per_s, lifetime_s: 1e4, ..FoldParameters::default() });
            let (mut apart, mut all) = (0.0, 0.0);
            for coordinates in 0..200 {
                let along = f64::from(coordinates);
                let swing = folds.swing(along, 1.0);
                let later = folds.swing(along + 4.0 * speed_km_per_s, 5.0);
                apart += (later - swing) * (later - swing);
                all += swing * swing;
            }
            assert!(apart < 1e-3 * all && all > 100.0, "{speed_km_per_s} km/s: {apart} of {all}");
        }
    }

    /// How far crests lean: the mean of what points are moved along the sheet beside how far they are moved to its side.
    fn leaning(curl: f64) -> f64 {
        let folds = folds(FoldParameters { curl, ..FoldParameters::default() });
        let points: Vec<DVec2> = (0..400).map(|east| DVec2::new(f64::from(east) - 200.0, 0.0)).collect();
        let arc_positions: Vec<ArcPosition> =
            ways(&points).into_iter().map(|coordinate| ArcPosition { coordinate, direction: 1.0 }).collect();
        let mut sheet = Sheet { flux: vec![1.0; 400], energy: vec![1.0; 400], points: points.clone() };
        fold(&mut sheet, &arc_positions, &folds, 2.0);
        let moved = || sheet.points.iter().zip(&points).map(|(now, was)| *now - *was);
        let [product, distance_squared] = [
            moved().map(|displacement| displacement.x * displacement.y).sum::<f64>(),
            moved().map(|displacement| displacement.y * displacement.y).sum::<f64>(),
        ];
        assert!(distance_squared > 100.0);
        product / distance_squared
    }

    #[test]
    fn crests_lean_over_as_far_as_told() {
        for curl in [0.0, 0.3, 1.0] {
            assert!((leaning(curl) - curl).abs() < 1e-9, "{curl}: {}", leaning(curl));
        }
    }
}
