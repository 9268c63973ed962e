//! Whether the tables of the air know the energies that a scene asks for.

use super::{
    AuroraParameters,
    shapes::{ShapeError, ShapeErrorKind, SheetParameters},
};
use crate::physics::precipitation::energy_grid::{HIGHEST_EV, LOWEST_EV};

/// Rounding that is forgiven.
const ROUNDING: f64 = 1e-9;

/// Looks at the energy of every point of every sheet's curve.
///
/// # Errors
/// The first point where the factor of a sheet takes the aurora's energy out of the tables.
pub(super) fn check(parameters: &AuroraParameters) -> Result<(), ShapeError> {
    let energy_ev = parameters.energy_ev.bounds();
    for (shape, of) in parameters.shapes.iter().enumerate() {
        for (entry, sheet) in of.sheets.iter().enumerate() {
            if let Some((point, kind)) = outside(sheet, entry + 1, energy_ev) {
                return Err(ShapeError { key: format!("shapes.{shape}.sheets.{entry}.energy.{point}"), kind });
            }
        }
    }
    Ok(())
}

/// The first point of a sheet's curve of energy that is no energy of the tables; the curve stays between its points.
fn outside(sheet: &SheetParameters, number: usize, [low, high]: [f64; 2]) -> Option<(usize, ShapeErrorKind)> {
    let of_point = |(point, [at, factor]): (usize, &[f64; 2])| {
        let (least, greatest) = (low * factor, high * factor);
        let energy_ev = if greatest > HIGHEST_EV * (1.0 + ROUNDING) {
            greatest
        } else if least < LOWEST_EV * (1.0 - ROUNDING) {
            least
        } else {
            return None;
        };
        Some((point, ShapeErrorKind::EnergyOutside { sheet: number, at: *at, energy_ev }))
    };
    sheet.energy.points().iter().enumerate().find_map(of_point)
}
