//! The in-between shape as the particles see it: smooth through its control points, with folds that travel along it.

use bansho_base::{
    math::{DVec2, lerp},
    noise::{Coordinate, Fractal, Noise},
    random::Key,
};

use super::along::Along;
use crate::aurora::{
    AuroraParameters, FoldParameters,
    shapes::{Neighbourhood, Segments, Shape, Sheet},
};

/// Pieces that a fold is made of, at least.
const PIECES_PER_FOLD: f64 = 12.0;
/// Pieces are not shorter than L_thr over this.
const PIECES_PER_THICKNESS: f64 = 4.0;
/// About as many pieces as all sheets together have at most.
const MOST_PIECES: f64 = 20_000.0;
/// Gradient noise seldom leaves half of its bounds: this makes its swings those that are asked for.
const SWING: f64 = 2.0;

/// How the shape is made finer and folded.
#[derive(Clone, Debug)]
pub(super) struct Folding {
    parameters: FoldParameters,
    noise: Noise<2>,
    piece_km: f64,
    half_km: f64,
}

impl Folding {
    pub(super) fn new(aurora: &AuroraParameters, key: Key) -> Self {
        let parameters = aurora.folds.clone();
        let [seed, ..] = key.words(0, 0, bansho_base::random::Purpose::named("aurora folds"));
        let fractal = Fractal { octaves: 2, ..Fractal::default() };
        let noise = Noise::new(seed, fractal, [0; 2]).expect("two octaves without a period are noise");
        let fold = if parameters.amplitude_km > 0.0 { parameters.scale_km / PIECES_PER_FOLD } else { f64::INFINITY };
        // Nothing finer than a part of its thickness can be seen of a sheet.
        let piece_km = fold.min(aurora.cell_km()).max(aurora.half_thickness_km() / PIECES_PER_THICKNESS);
        Self { noise, piece_km, half_km: aurora.extent_km / 2.0, parameters }
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
pub(super) struct Course {
    pub(super) shape: Shape,
    /// The coordinate along the sheets at each point of the finer shape, km.
    alongs: Vec<Vec<f64>>,
    /// Share of the sheet's length before each point.
    shares: Vec<Vec<f64>>,
    /// The sheet and point at which each segment begins, over all sheets in turn.
    starts: Vec<[u32; 2]>,
    near: Neighbourhood,
}

/// The place of a sheet that is nearest to a particle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Foot {
    pub(super) sheet: u32,
    pub(super) share: f64,
    pub(super) flux: f64,
    pub(super) energy: f64,
    /// Distance, km, negative on the left of the way along the sheet.
    pub(super) side: f64,
}

impl Course {
    /// The course of `shape` at a time; particles within `reach` km find it.
    pub(super) fn new(shape: &Shape, along: &Along, folding: &Folding, time: f64, reach: f64) -> Self {
        let piece = folding.piece_km.max(shape.length() / MOST_PIECES);
        let (mut fine, mut alongs, mut shares, mut starts) = (Shape::default(), Vec::new(), Vec::new(), Vec::new());
        for (index, sheet) in shape.sheets.iter().enumerate() {
            let (mut refined, coordinates) = refine(sheet, piece, |point, part| along.between(index, point, part));
            if folding.parameters.amplitude_km > 0.0 {
                fold(&mut refined, &coordinates, folding, time);
            }
            starts.extend((1..refined.points.len()).map(|point| [index as u32, point as u32 - 1]));
            shares.push(length_shares(&refined.points));
            fine.sheets.push(refined);
            alongs.push(coordinates);
        }
        let near = Neighbourhood::new(&fine, reach);
        Self { shape: fine, alongs, shares, starts, near }
    }

    /// Its segments, to be sampled.
    pub(super) fn segments(&self) -> Segments<'_> {
        Segments::new(&self.shape)
    }

    /// Length of each sheet, km.
    pub(super) fn sheet_lengths(&self) -> Vec<f64> {
        let length = |points: &[DVec2]| points.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
        self.shape.sheets.iter().map(|sheet| length(&sheet.points)).collect()
    }

    /// The place at a share of a sheet's length, km.
    pub(super) fn place(&self, sheet: usize, share: f64) -> DVec2 {
        let (point, part) = self.split(sheet, share);
        let points = &self.shape.sheets[sheet].points;
        points[point].lerp(points[point + 1], part)
    }

    /// The coordinate at a share of a sheet's length, km.
    pub(super) fn along(&self, sheet: usize, share: f64) -> f64 {
        let (point, part) = self.split(sheet, share);
        let alongs = &self.alongs[sheet];
        lerp(alongs[point], alongs[point + 1], part)
    }

    /// The point before a share of a sheet's length, and how far it is on the way to the next.
    fn split(&self, sheet: usize, share: f64) -> (usize, f64) {
        let shares = &self.shares[sheet];
        let after = shares.partition_point(|end| *end <= share).clamp(1, shares.len() - 1);
        let [before, end] = [shares[after - 1], shares[after]];
        (after - 1, ((share - before) / (end - before).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0))
    }

    /// Each piece of the sheets in turn: its sheet, the share of the sheet's length before its middle, the flux factor there, its length in km.
    pub(super) fn pieces(&self) -> impl Iterator<Item = (usize, f64, f64, f64)> + '_ {
        self.starts.iter().map(|start| {
            let [number, index] = start.map(|part| part as usize);
            let (sheet, shares) = (&self.shape.sheets[number], &self.shares[number]);
            let middle = |values: &[f64]| 0.5 * (values[index] + values[index + 1]);
            let length = sheet.points[index].distance(sheet.points[index + 1]);
            (number, middle(shares), middle(&sheet.flux), length)
        })
    }

    /// Distance to the shape, km; none beyond the reach.
    pub(super) fn distance(&self, point: DVec2) -> Option<f64> {
        self.near.distance(point)
    }

    /// Sheet and number of the segment nearest to `point`; none beyond the reach.
    pub(super) fn nearest_segment(&self, point: DVec2) -> Option<[usize; 2]> {
        self.near.nearest(point).map(|(segment, _)| self.starts[segment].map(|number| number as usize))
    }

    /// `point`, or if it is farther than `most` km from the shape, the place on the way to it that is not; itself beyond the reach.
    pub(super) fn held(&self, point: DVec2, most: f64) -> DVec2 {
        let Some((segment, distance)) = self.near.nearest(point).filter(|(_, distance)| *distance > most) else {
            return point;
        };
        let (_, place) = self.on_segment(segment, point);
        place + (point - place) * (most / distance)
    }

    /// The share of a segment before its place nearest to `point`, and that place.
    fn on_segment(&self, segment: usize, point: DVec2) -> (f64, DVec2) {
        let [sheet, index] = self.starts[segment].map(|number| number as usize);
        let points = &self.shape.sheets[sheet].points;
        let way = points[index + 1] - points[index];
        let part = ((point - points[index]).dot(way) / way.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        (part, points[index] + way * part)
    }

    /// The place nearest to `point`; none beyond the reach.
    pub(super) fn foot(&self, point: DVec2) -> Option<Foot> {
        let (segment, _) = self.near.nearest(point)?;
        let (part, place) = self.on_segment(segment, point);
        let [sheet, index] = self.starts[segment].map(|number| number as usize);
        let on = &self.shape.sheets[sheet];
        let way = on.points[index + 1] - on.points[index];
        let between = |values: &[f64]| lerp(values[index], values[index + 1], part);
        Some(Foot {
            sheet: sheet as u32,
            share: between(&self.shares[sheet]),
            flux: between(&on.flux),
            energy: between(&on.energy),
            side: (point - place).perp_dot(way.normalize_or_zero()),
        })
    }
}

/// Share of the length before each point; 0 everywhere where there is no length.
fn length_shares(points: &[DVec2]) -> Vec<f64> {
    let mut ends = vec![0.0];
    for pair in points.windows(2) {
        ends.push(ends[ends.len() - 1] + pair[0].distance(pair[1]));
    }
    let length = ends[ends.len() - 1].max(f64::MIN_POSITIVE);
    ends.iter().map(|end| end / length).collect()
}

/// A smooth line through a sheet's points in pieces of about that length, and the coordinate along it at each of its points.
fn refine(sheet: &Sheet, piece_km: f64, along: impl Fn(usize, f64) -> f64) -> (Sheet, Vec<f64>) {
    let headings = headings(&sheet.points);
    let (mut fine, mut coordinates) = (Sheet::default(), Vec::new());
    let mut push = |point: DVec2, index: usize, part: f64| {
        fine.points.push(point);
        fine.flux.push(lerp(sheet.flux[index], sheet.flux[index + 1], part));
        fine.energy.push(lerp(sheet.energy[index], sheet.energy[index + 1], part));
        coordinates.push(along(index, part));
    };
    for (index, pair) in sheet.points.windows(2).enumerate() {
        let length = pair[0].distance(pair[1]);
        let tangents = [headings[index] * length, headings[index + 1] * length];
        let pieces = (length / piece_km).ceil().max(1.0) as usize;
        for number in 0..pieces {
            let part = number as f64 / pieces as f64;
            push(hermite([pair[0], pair[1]], tangents, part), index, part);
        }
    }
    if let Some(last) = sheet.points.len().checked_sub(2) {
        push(sheet.points[last + 1], last, 1.0);
    }
    (fine, coordinates)
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

/// Cubic from one point to the other with those tangents.
fn hermite([a, b]: [DVec2; 2], [at_a, at_b]: [DVec2; 2], t: f64) -> DVec2 {
    let (square, rest) = (t * t, 1.0 - t);
    let rest_square = rest * rest;
    a * (rest_square * (1.0 + 2.0 * t)) + b * (square * (3.0 - 2.0 * t)) + at_a * (t * rest_square)
        - at_b * (square * rest)
}

/// Swings every point of the sheet to its side, and along it so that crests lean over.
fn fold(sheet: &mut Sheet, alongs: &[f64], folding: &Folding, time: f64) {
    let headings = headings(&sheet.points);
    let half = DVec2::splat(folding.half_km);
    for ((point, heading), along) in sheet.points.iter_mut().zip(headings).zip(alongs) {
        let swing = folding.swing(*along, time);
        *point = (*point + swing * (heading.perp() + folding.parameters.curl * heading)).clamp(-half, half);
    }
}
