//! A coordinate along the sheets that stays with them while they move, split and merge: rays and folds hang on it.

use bansho_base::math::DVec2;

use crate::aurora::shapes::{Shape, Sheet, lengths};

/// Distance in the coordinate from one sheet of the first shape to the next, km: no two show the same rays.
const SHEET_KM: f64 = 40_000.0;
/// Time in which the coordinate comes back to the length along the sheet where this has stretched, s.
const RELAXATION_S: f64 = 2.0;
/// Where the coordinate changes this many times faster than the length, or slower, two sheets have grown together.
const BREAK: f64 = 6.0;
/// Segments shorter than this join whatever is beside them, km.
const SHORT_KM: f64 = 0.5;

/// The coordinate of each control point of a shape, km.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Along {
    pub(super) sheets: Vec<Vec<f64>>,
    /// Where the control points were.
    pub(super) points: Vec<Vec<DVec2>>,
}

impl Along {
    /// The length along each sheet.
    pub(super) fn begin(shape: &Shape) -> Self {
        let sheet = |(index, sheet): (usize, &Sheet)| {
            lengths(&sheet.points).into_iter().map(|length| length + SHEET_KM * index as f64).collect()
        };
        Self { sheets: shape.sheets.iter().enumerate().map(sheet).collect(), points: points(shape) }
    }

    /// The coordinate on `shape`, which this has become: point by point where it has the same points, by nearness where sheets have split
    /// or merged.
    pub(super) fn follow(&self, shape: &Shape) -> Self {
        let counts = |points: &[Vec<DVec2>]| points.iter().map(Vec::len).collect::<Vec<_>>();
        let points = points(shape);
        if counts(&points) == counts(&self.points) {
            return Self { sheets: self.sheets.clone(), points };
        }
        let sheet = |points: &Vec<DVec2>| points.iter().map(|point| self.nearest(*point)).collect();
        Self { sheets: points.iter().map(sheet).collect(), points }
    }

    /// Lets `seconds` pass in which stretches are taken back.
    pub(super) fn relax(&mut self, seconds: f64) {
        let share = (seconds / RELAXATION_S).min(1.0);
        for (coordinates, points) in self.sheets.iter_mut().zip(&self.points) {
            let lengths = lengths(points);
            let mut start = 0;
            while start < points.len() {
                let end = run_end(coordinates, &lengths, start);
                relax_run(&mut coordinates[start..end], &lengths[start..end], share);
                start = end;
            }
        }
    }

    /// The coordinate at the share `part` of the way from control point `index` of a sheet to the next.
    pub(super) fn between(&self, sheet: usize, index: usize, part: f64) -> f64 {
        let (coordinates, points) = (&self.sheets[sheet], &self.points[sheet]);
        let length = points[index].distance(points[index + 1]);
        let step = coordinates[index + 1] - coordinates[index];
        coordinates[index] + part * if joined(step, length) { step } else { length }
    }

    /// The coordinate at the place of the sheets that is nearest to `point`.
    fn nearest(&self, point: DVec2) -> f64 {
        let (mut least, mut nearest) = (f64::INFINITY, 0.0);
        for (sheet, points) in self.points.iter().enumerate() {
            for (index, pair) in points.windows(2).enumerate() {
                let way = pair[1] - pair[0];
                let part = ((point - pair[0]).dot(way) / way.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
                let square = point.distance_squared(pair[0] + way * part);
                if square < least {
                    (least, nearest) = (square, self.between(sheet, index, part));
                }
            }
        }
        nearest
    }
}

fn points(shape: &Shape) -> Vec<Vec<DVec2>> {
    shape.sheets.iter().map(|sheet| sheet.points.clone()).collect()
}

/// Whether a step of the coordinate over a segment of that length may be one sheet's.
fn joined(step: f64, length: f64) -> bool {
    let long = length.max(SHORT_KM);
    step.abs() <= BREAK * long && step.abs() >= length / BREAK - SHORT_KM
}

/// Where the run that begins at point `start` ends: the points that have kept together, with the coordinate in one direction.
fn run_end(coordinates: &[f64], lengths: &[f64], start: usize) -> usize {
    let mut sign = 0.0;
    for index in start + 1..coordinates.len() {
        let (step, length) = (coordinates[index] - coordinates[index - 1], lengths[index] - lengths[index - 1]);
        if !joined(step, length) || step * sign < 0.0 {
            return index;
        }
        if step != 0.0 {
            sign = step;
        }
    }
    coordinates.len()
}

/// Moves a run toward the length along it, its middle fixed.
fn relax_run(coordinates: &mut [f64], lengths: &[f64], share: f64) {
    let count = coordinates.len() as f64;
    let mean = |values: &[f64]| values.iter().sum::<f64>() / count;
    let (middle, middle_length) = (mean(coordinates), mean(lengths));
    let forward = coordinates.first() <= coordinates.last();
    for (coordinate, length) in coordinates.iter_mut().zip(lengths) {
        let way = length - middle_length;
        let wanted = middle + if forward { way } else { -way };
        *coordinate += share * (wanted - *coordinate);
    }
}
