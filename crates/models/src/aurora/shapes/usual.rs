//! The aurora of a scene that says nothing: a band whose waves deepen and come back.

use bansho_base::parameters::Auto;

use super::{Form, ShapeParameters, SheetParameters};

/// A band in slow motion, and behind it a quiet arc, on a square of that side.
pub(super) fn shapes(extent_km: f64) -> Vec<ShapeParameters> {
    let band = |bend: f64, waves: i64, south: f64| SheetParameters {
        form: Some(Form::Band),
        bend_deg: Auto::Set(bend),
        count: Auto::Set(waves),
        position_km: [0.0, south * extent_km],
        ..SheetParameters::default()
    };
    let arc = |south: f64| SheetParameters { position_km: [0.0, south * extent_km], ..SheetParameters::default() };
    let shape =
        |sheets: Vec<SheetParameters>| ShapeParameters { after_s: Some(20.0), sheets, ..ShapeParameters::default() };
    let first = shape(vec![band(38.0, 3, 20.0 / 600.0), arc(-140.0 / 600.0)]);
    let second = shape(vec![band(62.0, 3, 0.0), arc(-165.0 / 600.0)]);
    vec![ShapeParameters { after_s: None, ..first.clone() }, second, first]
}
