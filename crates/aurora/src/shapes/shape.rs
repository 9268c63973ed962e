//! A shape, which is all sheets at one time, and uniform sampling of its sheets by arc length: the cost depends on the number of samples, not on the covered
//! area.

use bansho_base::math::{DVec2, lerp};

/// One sheet: control points joined by segments.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sheet {
    /// Control points, km: x east, y south. At least two; neighbors may coincide while a split opens or a merge closes.
    pub points: Vec<DVec2>,
    /// Factor of the aurora's flux at each control point.
    pub flux: Vec<f64>,
    /// Factor of the aurora's energy at each control point.
    pub energy: Vec<f64>,
}

impl Sheet {
    /// Length along its control points, km.
    fn length(&self) -> f64 {
        self.points.windows(2).map(|pair| pair[0].distance(pair[1])).sum()
    }
}

impl AsRef<[DVec2]> for Sheet {
    fn as_ref(&self) -> &[DVec2] {
        &self.points
    }
}

/// All sheets of an aurora at one moment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shape {
    /// Its sheets; their order changes only at key shapes.
    pub sheets: Vec<Sheet>,
}

impl Shape {
    /// Length of all sheets together, km.
    pub fn length(&self) -> f64 {
        self.sheets.iter().map(Sheet::length).sum()
    }
}

/// A segment of a sheet, indices from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SegmentId {
    /// The sheet.
    pub sheet: usize,
    /// The segment, from point `segment` to the next.
    pub segment: usize,
}

/// A sampled position on a sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SheetSample {
    /// Position, km.
    pub point: DVec2,
    /// Unit vector along the sheet.
    pub tangent: DVec2,
    /// The segment.
    pub segment: SegmentId,
    /// Fraction of the sheet's length.
    pub fraction: f64,
    /// Factor of the aurora's flux there.
    pub flux: f64,
    /// Factor of the aurora's energy there.
    pub energy: f64,
}

/// Segments with non-zero length and their cumulative length.
#[derive(Clone, Debug)]
pub struct SheetSampler<'a> {
    shape: &'a Shape,
    ids: Vec<SegmentId>,
    /// Length of all sheets up to the end of each segment, km.
    ends: Vec<f64>,
    /// Range of each sheet in the cumulative length, km.
    sheets: Vec<[f64; 2]>,
}

impl<'a> SheetSampler<'a> {
    /// The segments of `shape`.
    pub fn new(shape: &'a Shape) -> Self {
        let (mut ids, mut ends, mut sheets) = (Vec::new(), Vec::new(), Vec::new());
        let mut sum = 0.0;
        for (sheet, points) in shape.sheets.iter().map(|sheet| &sheet.points).enumerate() {
            let start = sum;
            for (segment, pair) in points.windows(2).enumerate().filter(|(_, pair)| pair[0] != pair[1]) {
                sum += pair[0].distance(pair[1]);
                ids.push(SegmentId { sheet, segment });
                ends.push(sum);
            }
            sheets.push([start, sum]);
        }
        Self { shape, ids, ends, sheets }
    }

    /// Length of all sheets together, km.
    pub fn length(&self) -> f64 {
        self.ends.last().copied().unwrap_or(0.0)
    }

    /// The position at the fraction `u` of the length of all sheets; uniform `u` give uniform density. O(log n) for n
    /// segments. `None` for a shape without length.
    pub fn sample(&self, u: f64) -> Option<SheetSample> {
        let distance = u.clamp(0.0, 1.0) * self.length();
        let index = self.ends.partition_point(|&end| end <= distance).min(self.ends.len().checked_sub(1)?);
        let id = self.ids[index];
        let start = if index > 0 { self.ends[index - 1] } else { 0.0 };
        let along = ((distance - start) / (self.ends[index] - start)).clamp(0.0, 1.0);
        let sheet = &self.shape.sheets[id.sheet];
        let [from, to] = [sheet.points[id.segment], sheet.points[id.segment + 1]];
        let [first, last] = self.sheets[id.sheet];
        Some(SheetSample {
            point: from.lerp(to, along),
            tangent: (to - from).normalize_or(DVec2::X),
            segment: id,
            fraction: (distance - first) / (last - first),
            flux: lerp(sheet.flux[id.segment], sheet.flux[id.segment + 1], along),
            energy: lerp(sheet.energy[id.segment], sheet.energy[id.segment + 1], along),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::Sheet;

    /// 3 km east and 1 km south, then a sheet of 4 km with a doubled point.
    fn shape() -> Shape {
        let sheet = |points: &[[f64; 2]]| Sheet {
            points: points.iter().map(|&point| point.into()).collect(),
            flux: (0..points.len()).map(|index| index as f64).collect(),
            energy: vec![2.0; points.len()],
        };
        Shape {
            sheets: vec![
                sheet(&[[0.0, 0.0], [3.0, 0.0], [3.0, 1.0]]),
                sheet(&[[0.0, 9.0], [2.0, 9.0], [2.0, 9.0], [4.0, 9.0]]),
            ],
        }
    }

    #[test]
    fn samples_lie_evenly_along_all_sheets() {
        let shape = shape();
        let segments = SheetSampler::new(&shape);
        assert_eq!((segments.length(), shape.length()), (8.0, 8.0));
        let sample = segments.sample(0.4375).unwrap();
        assert_eq!((sample.point, sample.tangent), (DVec2::new(3.0, 0.5), DVec2::Y));
        assert_eq!((sample.segment, sample.fraction), (SegmentId { sheet: 0, segment: 1 }, 0.875));
        assert_eq!((sample.flux, sample.energy), (1.5, 2.0));
        let beyond_the_double_point = segments.sample(0.875).unwrap();
        assert_eq!(beyond_the_double_point.segment, SegmentId { sheet: 1, segment: 2 });
        assert_eq!((beyond_the_double_point.fraction, beyond_the_double_point.flux), (0.75, 2.5));
        assert_eq!(segments.sample(0.0).unwrap().point, DVec2::ZERO);
        assert_eq!(segments.sample(1.0).unwrap().point, DVec2::new(4.0, 9.0));
    }

    #[test]
    fn each_sheet_gets_its_share() {
        let shape = shape();
        let segments = SheetSampler::new(&shape);
        let first =
            (0..1000).filter(|i| segments.sample((*i as f64 + 0.5) / 1000.0).unwrap().segment.sheet == 0).count();
        assert_eq!(first, 500);
    }

    #[test]
    fn a_shape_without_length_has_no_samples() {
        assert_eq!(SheetSampler::new(&Shape::default()).sample(0.5), None);
        let spot = Sheet { points: vec![DVec2::ONE; 2], flux: vec![1.0; 2], energy: vec![1.0; 2] };
        assert_eq!(SheetSampler::new(&Shape { sheets: vec![spot] }).sample(0.5), None);
    }
}
