//! The in-between shape as the particles see it: smooth through its control points, with folds that travel along it.

use bansho_base::{
    math::{self, DVec2, lerp, random::Key},
    noise::{Coordinate, Fractal, Noise},
};

use super::arc_length::{Along, Mark};
use crate::{
    AuroraParameters, FoldParameters,
    shapes::{Bridge, Neighbourhood, Segments, Shape, Sheet, lengths},
};

/// Pieces that a fold is made of, unless all sheets together would have too many.
const PIECES_PER_FOLD: f64 = 12.0;
/// Pieces are not shorter than L_thr over this.
const PIECES_PER_THICKNESS: f64 = 4.0;
/// Points nearer than so many pieces may have changed places.
const NEAR_PIECES: f64 = 2.0;
/// Most pieces of all sheets together, and for each particle, but not fewer than so many, nor than there are segments between control points.
const MOST_PIECES: f64 = 20_000.0;
const PIECES_PER_PARTICLE: f64 = 0.05;
const FEW_PIECES: f64 = 2_000.0;
/// Gradient noise seldom leaves half of its bounds: this makes its swings those that are asked for.
const SWING: f64 = 2.0;

/// How the shape is made finer and folded.
#[derive(Clone, Debug)]
pub(crate) struct Folding {
    parameters: FoldParameters,
    noise: Noise<2>,
    piece_km: f64,
    most_pieces: f64,
    half_km: f64,
}

impl Folding {
    pub(crate) fn new(aurora: &AuroraParameters, key: Key) -> Self {
        let parameters = aurora.folds.clone();
        let [seed, ..] = key.words(0, 0, bansho_base::math::random::Purpose::named("aurora folds"));
        let fractal = Fractal { octaves: 2, ..Fractal::default() };
        let noise = Noise::new(seed, fractal, [0; 2]).expect("two octaves without a period are noise");
        let fold = if parameters.amplitude_km > 0.0 { parameters.scale_km / PIECES_PER_FOLD } else { f64::INFINITY };
        // Nothing finer than a part of its thickness can be seen of a sheet.
        let piece_km = fold.min(aurora.cell_km()).max(aurora.half_thickness_km() / PIECES_PER_THICKNESS);
        let most_pieces = (PIECES_PER_PARTICLE * aurora.particles.count as f64).clamp(FEW_PIECES, MOST_PIECES);
        Self { noise, piece_km, most_pieces, half_km: aurora.extent_km / 2.0, parameters }
    }

    /// How far the sheet swings at a coordinate along it and a time, km.
    fn swing(&self, along: f64, time: f64) -> f64 {
        let FoldParameters { amplitude_km, scale_km, speed_km_per_s, life_s, .. } = self.parameters;
        let place = [(along - speed_km_per_s * time) / scale_km, time / life_s];
        SWING * amplitude_km * f64::from(self.noise.at(place.map(Coordinate::from_f64)))
    }
}

/// The finer, folded shape, where everything on it is found by nearness.
#[derive(Clone, Debug)]
pub(crate) struct Course {
    pub(crate) shape: Shape,
    /// The coordinate along the sheets at each point of the finer shape, km.
    alongs: Vec<Vec<f64>>,
    /// Share of the sheet's length before each point.
    shares: Vec<Vec<f64>>,
    /// The sheet and point at which each segment begins, over all sheets in turn.
    starts: Vec<[u32; 2]>,
    /// What there is along each segment, in the same order.
    parts: Vec<Part>,
    near: Neighbourhood,
}

/// What there is at the start of a segment, and by how much it is more at its end.
#[derive(Clone, Copy, Debug)]
struct Part {
    share: [f64; 2],
    flux: [f64; 2],
    energy: [f64; 2],
    /// One over its length, 1/km, negative where the sheet is listed against the way of its coordinate; 0 where it has no length.
    per_length: f64,
    sheet: u32,
}

/// The place of a sheet that is nearest to a particle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Projection {
    pub(crate) sheet: u32,
    pub(crate) share: f64,
    pub(crate) flux: f64,
    pub(crate) energy: f64,
    /// Distance, km, negative on the left of the way along which the sheet's coordinate has grown.
    pub(crate) side: f64,
}

impl Course {
    /// The course of `shape` and the bridges over its gaps at a time; particles within `reach` km find it.
    pub(crate) fn new(
        (shape, bridges): (&Shape, &[Bridge]),
        along: &Along,
        folding: &Folding,
        time: f64,
        reach: f64,
    ) -> Self {
        // Each segment between control points is made of whole pieces, up to one more than fit.
        let segments: usize = shape.sheets.iter().map(|sheet| sheet.points.len().saturating_sub(1)).sum();
        let piece = folding.piece_km.max(shape.length() / (folding.most_pieces - segments as f64).max(1.0));
        let (mut fine, mut marks) = (Shape::default(), Vec::new());
        for (index, sheet) in shape.sheets.iter().enumerate() {
            let (mut refined, own) = refine(sheet, piece, |point, part| along.between(index, point, part));
            if folding.parameters.amplitude_km > 0.0 {
                fold(&mut refined, &own, folding, time);
            }
            fine.sheets.push(refined);
            marks.push(own);
        }
        for bridge in bridges {
            let (refined, own) = span(bridge, &fine, &marks, piece);
            fine.sheets.push(refined);
            marks.push(own);
        }
        let (mut shares, mut starts) = (Vec::new(), Vec::new());
        for (index, sheet) in fine.sheets.iter().enumerate() {
            starts.extend((1..sheet.points.len()).map(|point| [index as u32, point as u32 - 1]));
            shares.push(length_shares(&sheet.points));
        }
        let parts = starts.iter().map(|start| Part::new(&fine, &marks, &shares, *start)).collect();
        let alongs = marks.iter().map(|marks| marks.iter().map(|mark| mark.along).collect()).collect();
        let near = Neighbourhood::new(&fine, reach);
        Self { shape: fine, alongs, shares, starts, parts, near }
    }

    /// Its segments, to be sampled.
    pub(crate) fn segments(&self) -> Segments<'_> {
        Segments::new(&self.shape)
    }

    /// Length of each sheet, km.
    pub(crate) fn sheet_lengths(&self) -> Vec<f64> {
        let length = |points: &[DVec2]| points.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
        self.shape.sheets.iter().map(|sheet| length(&sheet.points)).collect()
    }

    /// The place at a share of a sheet's length, km.
    pub(crate) fn place(&self, sheet: usize, share: f64) -> DVec2 {
        let (point, part) = self.split(sheet, share);
        let points = &self.shape.sheets[sheet].points;
        points[point].lerp(points[point + 1], part)
    }

    /// The coordinate after every `last`th part of a sheet's length, from its beginning to its end, km.
    pub(crate) fn alongs(&self, sheet: usize, last: usize) -> Vec<f64> {
        let (alongs, shares) = (&self.alongs[sheet], &self.shares[sheet]);
        let mut after = 1;
        let at = |node: usize| {
            let share = node as f64 / last as f64;
            while after + 1 < shares.len() && shares[after] <= share {
                after += 1;
            }
            lerp(alongs[after - 1], alongs[after], part_between([shares[after - 1], shares[after]], share))
        };
        (0..=last).map(at).collect()
    }

    /// The point before a share of a sheet's length, and how far it is on the way to the next.
    fn split(&self, sheet: usize, share: f64) -> (usize, f64) {
        let shares = &self.shares[sheet];
        let after = shares.partition_point(|end| *end <= share).clamp(1, shares.len() - 1);
        (after - 1, part_between([shares[after - 1], shares[after]], share))
    }

    /// Each piece of the sheets in turn, in parts of at most the share `most` of its sheet's length: its sheet, the share of the sheet's length
    /// before its middle, the flux factor there, its length in km.
    pub(crate) fn pieces(&self, most: impl Fn(usize) -> f64) -> impl Iterator<Item = (usize, f64, f64, f64)> {
        self.starts.iter().flat_map(move |start| {
            let [number, index] = start.map(|part| part as usize);
            let (sheet, shares) = (&self.shape.sheets[number], &self.shares[number]);
            let length = sheet.points[index].distance(sheet.points[index + 1]);
            let count = ((shares[index + 1] - shares[index]) / most(number)).ceil().max(1.0);
            (0..count as usize).map(move |part| {
                let middle = (part as f64 + 0.5) / count;
                let at = |values: &[f64]| lerp(values[index], values[index + 1], middle);
                (number, at(shares), at(&sheet.flux), length / count)
            })
        })
    }

    /// Distance to the shape, km; none beyond the reach.
    pub(crate) fn distance(&self, point: DVec2) -> Option<f64> {
        self.near.distance(point)
    }

    /// Sheet and number of the segment nearest to `point`; none beyond the reach.
    pub(crate) fn nearest_segment(&self, point: DVec2) -> Option<[usize; 2]> {
        self.near.nearest(point).map(|(segment, _)| self.starts[segment].map(|number| number as usize))
    }

    /// `point`, or if it is farther than `most` km from the shape, the place on the way to it that is not; itself beyond the reach.
    pub(crate) fn held(&self, point: DVec2, most: f64) -> DVec2 {
        let Some(nearest) = self.near.nearest_place(point).filter(|nearest| nearest.square > most * most) else {
            return point;
        };
        let [sheet, index] = self.starts[nearest.segment].map(|number| number as usize);
        let points = &self.shape.sheets[sheet].points;
        let place = points[index].lerp(points[index + 1], nearest.share);
        place + (point - place) * (most / math::sqrt(nearest.square))
    }

    /// The place nearest to `point`; none beyond the reach.
    #[inline]
    pub(crate) fn foot(&self, point: DVec2) -> Option<Projection> {
        let nearest = self.near.nearest_place(point)?;
        let part = &self.parts[nearest.segment];
        let at = |[start, more]: [f64; 2]| start + nearest.share * more;
        Some(Projection {
            sheet: part.sheet,
            share: at(part.share),
            flux: at(part.flux),
            energy: at(part.energy),
            side: nearest.side * part.per_length,
        })
    }
}

impl Part {
    fn new(shape: &Shape, marks: &[Vec<Mark>], shares: &[Vec<f64>], [sheet, index]: [u32; 2]) -> Self {
        let (number, index) = (sheet as usize, index as usize);
        let on = &shape.sheets[number];
        let along = |values: &[f64]| [values[index], values[index + 1] - values[index]];
        let length = on.points[index].distance(on.points[index + 1]);
        Self {
            share: along(&shares[number]),
            flux: along(&on.flux),
            energy: along(&on.energy),
            per_length: if length > 0.0 { marks[number][index].direction / length } else { 0.0 },
            sheet,
        }
    }
}

/// How far a share of the length is from the one to the other.
fn part_between([before, end]: [f64; 2], share: f64) -> f64 {
    ((share - before) / (end - before).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
}

/// Share of the length before each point; 0 everywhere where there is no length.
fn length_shares(points: &[DVec2]) -> Vec<f64> {
    let ends = lengths(points);
    let length = ends.last().copied().unwrap_or(0.0).max(f64::MIN_POSITIVE);
    ends.iter().map(|end| end / length).collect()
}

/// A smooth line through a sheet's points in pieces of about that length, and the coordinate along it at each of its points.
fn refine(sheet: &Sheet, piece_km: f64, along: impl Fn(usize, f64) -> Mark) -> (Sheet, Vec<Mark>) {
    let points = in_order(&sheet.points, NEAR_PIECES * piece_km);
    let headings = headings(&points);
    let (mut fine, mut marks) = (Sheet::default(), Vec::new());
    let mut push = |point: DVec2, index: usize, part: f64| {
        fine.points.push(point);
        fine.flux.push(lerp(sheet.flux[index], sheet.flux[index + 1], part));
        fine.energy.push(lerp(sheet.energy[index], sheet.energy[index + 1], part));
        marks.push(along(index, part));
    };
    for (index, pair) in points.windows(2).enumerate() {
        let way = pair[1] - pair[0];
        let length = way.length();
        let tangents = [headings[index], headings[index + 1]].map(|heading| not_back(heading, way) * length);
        let pieces = (length / piece_km).ceil().max(1.0) as usize;
        for number in 0..pieces {
            let part = number as f64 / pieces as f64;
            push(hermite([pair[0], pair[1]], tangents, part), index, part);
        }
    }
    if let Some(last) = points.len().checked_sub(2) {
        push(points[last + 1], last, 1.0);
    }
    (fine, marks)
}

/// The light over a gap as a sheet of its own, from the one end of a sheet to that of another, and the coordinate along it, which goes on from
/// the first.
fn span(bridge: &Bridge, fine: &Shape, marks: &[Vec<Mark>], piece_km: f64) -> (Sheet, Vec<Mark>) {
    let point = |(sheet, at_end): (usize, bool)| if at_end { fine.sheets[sheet].points.len() - 1 } else { 0 };
    let [from, to] = bridge.ends.map(|end| fine.sheets[end.0].points[point(end)]);
    let begin = marks[bridge.ends[0].0][point(bridge.ends[0])];
    let direction = if bridge.ends[0].1 { begin.direction } else { -begin.direction };
    let length = from.distance(to);
    let pieces = (length / piece_km).ceil().max(1.0) as usize;
    let (mut sheet, mut own) = (Sheet::default(), Vec::new());
    for number in 0..=pieces {
        let part = number as f64 / pieces as f64;
        sheet.points.push(from.lerp(to, part));
        sheet.flux.push(bridge.flux);
        sheet.energy.push(bridge.energy);
        own.push(Mark { along: begin.along + direction * part * length, direction });
    }
    (sheet, own)
}

/// The points in the order in which the sheet passes them: two nearer than `near_km` that lie the wrong way round between their neighbours, as
/// where a fold is born, change places. Else the sheet would pass there three times, as bright.
fn in_order(points: &[DVec2], near_km: f64) -> Vec<DVec2> {
    let mut points = points.to_vec();
    for index in 1..points.len().saturating_sub(2) {
        let [before, one, other, after] = [0, 1, 2, 3].map(|next| points[index - 1 + next]);
        let way = other - one;
        if way.length() < near_km && way.dot(one - before) < 0.0 && way.dot(after - other) < 0.0 {
            points.swap(index, index + 1);
        }
    }
    points
}

/// The direction of the sheet at each point: that of the circle through it and its neighbours.
fn headings(points: &[DVec2]) -> Vec<DVec2> {
    let weighted = |from: usize| {
        let way = points[from + 1] - points[from];
        way / way.length_squared().max(1e-12)
    };
    let last = points.len() - 1;
    let heading = |index: usize| {
        let before = if index > 0 { weighted(index - 1) } else { DVec2::ZERO };
        let after = if index < last { weighted(index) } else { DVec2::ZERO };
        (before + after).normalize_or_zero()
    };
    (0..points.len()).map(heading).collect()
}

/// A heading without what of it goes against the way: a curve that first went back would pass there three times, as bright.
fn not_back(heading: DVec2, way: DVec2) -> DVec2 {
    let back = (heading.dot(way) / way.length_squared().max(1e-12)).min(0.0);
    heading - way * back
}

/// Cubic from one point to the other with those tangents.
fn hermite([a, b]: [DVec2; 2], [at_a, at_b]: [DVec2; 2], t: f64) -> DVec2 {
    let (square, rest) = (t * t, 1.0 - t);
    let rest_square = rest * rest;
    a * (rest_square * (1.0 + 2.0 * t)) + b * (square * (3.0 - 2.0 * t)) + at_a * (t * rest_square)
        - at_b * (square * rest)
}

/// Swings every point of the sheet to its side, and along it so that crests lean over: by the way of the coordinate.
fn fold(sheet: &mut Sheet, marks: &[Mark], folding: &Folding, time: f64) {
    let headings = headings(&sheet.points);
    let half = DVec2::splat(folding.half_km);
    for ((point, heading), mark) in sheet.points.iter_mut().zip(headings).zip(marks) {
        let swing = mark.direction * folding.swing(mark.along, time);
        *point = (*point + swing * (heading.perp() + folding.parameters.curl * heading)).clamp(-half, half);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::lengths as ways;

    fn folding(folds: FoldParameters) -> Folding {
        Folding::new(&AuroraParameters { folds, ..AuroraParameters::default() }, Key::new(3, "folds"))
    }

    #[test]
    fn crests_travel_along_the_sheet_as_fast_as_told() {
        for speed_km_per_s in [-3.0, 0.0, 5.0] {
            let folding = folding(FoldParameters { speed_km_per_s, life_s: 1e4, ..FoldParameters::default() });
            let (mut apart, mut all) = (0.0, 0.0);
            for place in 0..200 {
                let along = f64::from(place);
                let swing = folding.swing(along, 1.0);
                let later = folding.swing(along + 4.0 * speed_km_per_s, 5.0);
                apart += (later - swing) * (later - swing);
                all += swing * swing;
            }
            assert!(apart < 1e-3 * all && all > 100.0, "{speed_km_per_s} km/s: {apart} of {all}");
        }
    }

    /// How far crests lean: the mean of what points are moved along the sheet beside how far they are moved to its side.
    fn leaning(curl: f64) -> f64 {
        let folding = folding(FoldParameters { curl, ..FoldParameters::default() });
        let points: Vec<DVec2> = (0..400).map(|east| DVec2::new(f64::from(east) - 200.0, 0.0)).collect();
        let marks: Vec<Mark> = ways(&points).into_iter().map(|along| Mark { along, direction: 1.0 }).collect();
        let mut sheet = Sheet { flux: vec![1.0; 400], energy: vec![1.0; 400], points: points.clone() };
        fold(&mut sheet, &marks, &folding, 2.0);
        let moved = || sheet.points.iter().zip(&points).map(|(now, was)| *now - *was);
        let [product, square] =
            [moved().map(|way| way.x * way.y).sum::<f64>(), moved().map(|way| way.y * way.y).sum::<f64>()];
        assert!(square > 100.0);
        product / square
    }

    #[test]
    fn crests_lean_over_as_far_as_told() {
        for curl in [0.0, 0.3, 1.0] {
            assert!((leaning(curl) - curl).abs() < 1e-9, "{curl}: {}", leaning(curl));
        }
    }
}
