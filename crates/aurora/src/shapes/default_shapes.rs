//! The aurora of a scene that says nothing: two curtains that wave slowly and come back.

use super::{ShapeParameters, SheetParameters};

/// Side of the square on which the curtains below are drawn, km.
const DRAWN_EXTENT_KM: f64 = 600.0;

/// Strokes from west to east, [east, south] in km: the far curtain, low over the northern horizon, and the near one above it.
const FIRST: [[[f64; 2]; 8]; 2] = [
    [
        [-290., -250.],
        [-180., -215.],
        [-90., -190.],
        [-20., -200.],
        [40., -225.],
        [110., -215.],
        [190., -180.],
        [290., -190.],
    ],
    [
        [-200., -120.],
        [-130., -95.],
        [-60., -88.],
        [-10., -105.],
        [50., -120.],
        [110., -105.],
        [160., -80.],
        [215., -85.],
    ],
];
/// The same curtains, their waves farther on and deeper.
const SECOND: [[[f64; 2]; 8]; 2] = [
    [
        [-290., -225.],
        [-190., -190.],
        [-110., -205.],
        [-40., -240.],
        [30., -225.],
        [100., -185.],
        [190., -200.],
        [290., -220.],
    ],
    [
        [-215., -95.],
        [-140., -85.],
        [-75., -110.],
        [-20., -125.],
        [45., -100.],
        [100., -80.],
        [155., -100.],
        [210., -115.],
    ],
];

/// Two curtains in slow motion on a square of that side.
pub(super) fn shapes(extent_km: f64) -> Vec<ShapeParameters> {
    let scale = extent_km / DRAWN_EXTENT_KM;
    let curtain = |stroke: &[[f64; 2]; 8]| SheetParameters {
        points: Some(stroke.iter().map(|point| point.map(|km| km * scale)).collect()),
        ..SheetParameters::default()
    };
    let shape = |strokes: &[[[f64; 2]; 8]; 2]| ShapeParameters {
        after_s: Some(20.0),
        sheets: strokes.iter().map(curtain).collect(),
        ..ShapeParameters::default()
    };
    vec![ShapeParameters { after_s: None, ..shape(&FIRST) }, shape(&SECOND), shape(&FIRST)]
}
