//! A shape: all sheets at one time.

use bansho_base::math::DVec2;

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
