//! Drawn strokes: parameters are converted to sheets and validated.

pub(crate) mod intersection;

use std::sync::Arc;

use bansho_base::{
    geometry::strokes::Drawing,
    host::assets::{AssetError, AssetProblem, Assets},
    math::{self, DVec2, curve::Curve, smoothstep},
    parameters::Auto,
};
use intersection::first_crossing;

use super::{
    SegmentId, ShapeError, ShapeErrorKind, ShapeParameters, SheetParameters, Spacing,
    geometry::polyline::{Polyline, resample_by_index, resample_by_printed_index, smooth_sketch},
};

/// Points closer than this are merged, km.
const SAME_KM: f64 = 1e-6;

/// Default length of a form as a fraction of the drawn square.
const DEFAULT_FORM_LENGTH: f64 = 0.6;

/// Maximum number of sheets of a shape.
const MAX_SHEETS: usize = 256;

/// A sheet in its drawn direction.
#[derive(Clone, Debug)]
pub(crate) struct DrawnSheet {
    pub(crate) line: Polyline,
    /// The given points without repetitions.
    recorded: Vec<DVec2>,
    /// Parameter index of each recorded point.
    origins: Vec<usize>,
    /// Segments of the line per recorded point.
    pieces: usize,
    pub(crate) factors: FluxEnergyFactors,
    /// Its index below `sheets` in the parameters, and whether that entry lists points.
    entry: usize,
    lists_points: bool,
}

impl DrawnSheet {
    /// `count` control points P_i.
    pub(crate) fn control_points(&self, count: usize, spacing: Spacing) -> Vec<DVec2> {
        match spacing {
            Spacing::ArcLength => self.line.resample(count),
            Spacing::Recorded => resample_by_index(&self.recorded, count),
            Spacing::AsPrinted => resample_by_printed_index(&self.recorded, count),
        }
    }

    /// Parameter index of the point at or before a point of the line.
    fn origin(&self, point: usize) -> usize {
        self.origins[(point / self.pieces).min(self.origins.len() - 1)]
    }
}

/// Key prefix of a shape and its bounds.
#[derive(Clone, Copy)]
pub(crate) struct ShapeContext {
    pub(crate) shape: usize,
    pub(crate) extent_km: f64,
}

impl ShapeContext {
    fn error(self, key: &str, kind: ShapeErrorKind) -> ShapeError {
        ShapeError { key: format!("shapes.{}{key}", self.shape), kind }
    }

    /// An error at an entry of `sheets`, or at a key of it, with its point.
    fn error_in_entry(self, entry: usize, key: &str, kind: ShapeErrorKind) -> ShapeError {
        self.error(&format!(".sheets.{entry}{key}"), kind)
    }

    /// An error at a point of a sheet.
    fn error_at(self, sheet: &DrawnSheet, point: usize, kind: ShapeErrorKind) -> ShapeError {
        let point = if sheet.lists_points { format!(".points.{}", sheet.origin(point)) } else { String::new() };
        self.error_in_entry(sheet.entry, &point, kind)
    }
}

/// All sheets of a shape, in order.
///
/// # Errors
///
/// The first sheet that has fewer than two points, leaves the square, or crosses itself or another.
pub(crate) fn drawn_sheets(
    parameters: &ShapeParameters,
    context: ShapeContext,
    assets: &dyn Assets,
) -> Result<Vec<DrawnSheet>, ShapeError> {
    let arc = [SheetParameters::default()];
    let entries = if parameters.sheets.is_empty() { &arc[..] } else { &parameters.sheets[..] };
    let mut sheets = Vec::new();
    for (entry, parameters) in entries.iter().enumerate() {
        draw_entry(parameters, entry, context, assets, &mut sheets)?;
        if sheets.len() > MAX_SHEETS {
            let kind = ShapeErrorKind::TooManySheets { found: sheets.len(), max: MAX_SHEETS };
            return Err(context.error(".sheets", kind));
        }
    }
    check_extent(&sheets, context)?;
    check_crossings(&sheets, context)?;
    Ok(sheets)
}

/// Adds the sheets of one entry: one per stroke and copy.
fn draw_entry(
    parameters: &SheetParameters,
    entry: usize,
    context: ShapeContext,
    assets: &dyn Assets,
    sheets: &mut Vec<DrawnSheet>,
) -> Result<(), ShapeError> {
    if parameters.svg_path_id.is_some() && parameters.svg_file.is_none() {
        return Err(context.error_in_entry(entry, ".svg_path_id", ShapeErrorKind::StrokeWithoutFile));
    }
    let strokes = match (&parameters.points, &parameters.svg_file, parameters.form) {
        (Some(points), None, None) => vec![points.iter().map(|&point| DVec2::from(point)).collect()],
        (None, Some(path), None) => {
            let id = parameters.svg_path_id.as_deref();
            strokes(&path.0, id, context.extent_km, assets).map_err(|error| {
                let is_missing = matches!(error.problem, AssetProblem::NoStroke(_));
                context.error_in_entry(entry, if is_missing { ".svg_path_id" } else { ".svg_file" }, error.into())
            })?
        }
        (None, None, _) => vec![form_line(parameters, context.extent_km)],
        _ => {
            let kind = ShapeErrorKind::SeveralSources { sheet: sheets.len() + 1 };
            return Err(context.error_in_entry(entry, "", kind));
        }
    };
    let factors = FluxEnergyFactors::new(parameters);
    for copy in 0..parameters.copies {
        let offset = (copy as f64 - (parameters.copies - 1) as f64 / 2.0) * parameters.spacing_km;
        for stroke in &strokes {
            let points = stroke.iter().map(|&point| transformed(point, offset, parameters)).collect();
            let sheet = sheet(points, parameters, entry, factors.clone()).map_err(|found| {
                let key = if parameters.points.is_some() { ".points" } else { "" };
                context.error_in_entry(entry, key, ShapeErrorKind::TooFewPoints { sheet: sheets.len() + 1, found })
            })?;
            sheets.push(sheet);
        }
    }
    Ok(())
}

/// A sheet through distinct points.
///
/// # Errors
///
/// The number of distinct points if it is below two.
fn sheet(
    points: Vec<DVec2>,
    parameters: &SheetParameters,
    entry: usize,
    factors: FluxEnergyFactors,
) -> Result<DrawnSheet, usize> {
    let mut recorded: Vec<DVec2> = Vec::with_capacity(points.len());
    let mut origins = Vec::with_capacity(points.len());
    for (origin, point) in points.into_iter().enumerate() {
        if recorded.last().is_none_or(|last| last.distance(point) > SAME_KM) {
            recorded.push(point);
            origins.push(origin);
        }
    }
    let (line, pieces) = if parameters.smooth { smooth_sketch(recorded.clone()) } else { (recorded.clone(), 1) };
    let line = Polyline::new(line).filter(|_| recorded.len() > 1).ok_or(recorded.len())?;
    Ok(DrawnSheet { line, recorded, origins, pieces, factors, entry, lists_points: parameters.points.is_some() })
}

/// The line of a named form, km.
fn form_line(parameters: &SheetParameters, extent_km: f64) -> Vec<DVec2> {
    let length = set_value(parameters.length_km).unwrap_or(DEFAULT_FORM_LENGTH * extent_km);
    let form = parameters.form.unwrap_or_default();
    let line = form.line(set_value(parameters.bend_deg), set_value(parameters.wave_count));
    line.into_iter().map(|point| point * length).collect()
}

/// The value that the scene sets.
fn set_value<T>(auto: Auto<T>) -> Option<T> {
    if let Auto::Set(value) = auto { Some(value) } else { None }
}

/// Applies scale, mirror, rotation and translation, in this order; a copy is offset to the south before the rotation.
fn transformed(point: DVec2, offset: f64, parameters: &SheetParameters) -> DVec2 {
    let mut point = point * parameters.scale;
    if parameters.mirror {
        point.y = -point.y;
    }
    let (sin, cos) = math::sin_cos(parameters.rotation_deg.to_radians());
    DVec2::new(cos, sin).rotate(point + DVec2::new(0.0, offset)) + DVec2::from(parameters.position_km)
}

/// The strokes of a drawing, scaled to the drawn square.
fn strokes(file: &str, id: Option<&str>, extent_km: f64, assets: &dyn Assets) -> Result<Vec<Vec<DVec2>>, AssetError> {
    let drawing = assets.drawing(file)?;
    let selected = drawing.strokes.iter().filter(|stroke| id.is_none() || stroke.id.as_deref() == id);
    let strokes: Vec<Vec<DVec2>> = selected.map(|stroke| fitted(&stroke.points, &drawing, extent_km)).collect();
    if strokes.is_empty() {
        let problem =
            id.map_or(AssetProblem::NoStrokes { instead: Vec::new() }, |id| AssetProblem::NoStroke(id.to_owned()));
        return Err(AssetError { path: file.to_owned(), problem });
    }
    Ok(strokes)
}

fn fitted(points: &[DVec2], drawing: &Drawing, extent_km: f64) -> Vec<DVec2> {
    let middle = drawing.min.midpoint(drawing.max);
    let scale = extent_km / (drawing.max - drawing.min).max_element();
    points.iter().map(|&point| (point - middle) * scale).collect()
}

/// Given points are checked first, so that the error names one of them; then the smoothed line.
fn check_extent(sheets: &[DrawnSheet], context: ShapeContext) -> Result<(), ShapeError> {
    let half = context.extent_km / 2.0;
    for (index, sheet) in sheets.iter().enumerate() {
        let recorded_outside = first_outside(&sheet.recorded, half).map(|at| at * sheet.pieces);
        let Some(at) = recorded_outside.or_else(|| first_outside(sheet.line.points(), half)) else { continue };
        let point = sheet.line.points()[at];
        let number = sheet.origin(at) + 1;
        let (x, z, sheet_number) = (point.x, point.y, index + 1);
        let kind = if recorded_outside.is_some() {
            ShapeErrorKind::Outside { sheet: sheet_number, point: number, x, z, half }
        } else {
            ShapeErrorKind::BendsOutside { sheet: sheet_number, point: number, x, z, half }
        };
        return Err(context.error_at(sheet, at, kind));
    }
    Ok(())
}

/// Index of the first point outside a square about the origin whose sides are `2 half` long.
fn first_outside(points: &[DVec2], half: f64) -> Option<usize> {
    points.iter().position(|point| point.abs().max_element() > half)
}

fn check_crossings(sheets: &[DrawnSheet], context: ShapeContext) -> Result<(), ShapeError> {
    let lines: Vec<&[DVec2]> = sheets.iter().map(|sheet| sheet.line.points()).collect();
    let Some([earlier, later]) = first_crossing(&lines) else { return Ok(()) };
    // Counted from 1, as in messages.
    let [(sheet, point), (other, other_point)] =
        [later, earlier].map(|at: SegmentId| (at.sheet + 1, sheets[at.sheet].origin(at.segment) + 1));
    let kind = if sheet == other {
        ShapeErrorKind::CrossesItself { sheet, point, earlier: other_point }
    } else {
        ShapeErrorKind::CrossesSheet { sheet, point, other, other_point }
    };
    Err(context.error_at(&sheets[later.sheet], later.segment, kind))
}

/// Flux and energy factors along a sheet, for all sheets of one entry.
#[derive(Clone, Debug)]
pub(crate) struct FluxEnergyFactors {
    curves: Arc<[Curve; 2]>,
    /// Fraction of the length over which the flux rises from 0 at both ends.
    fade: f64,
}

impl FluxEnergyFactors {
    pub(super) fn new(parameters: &SheetParameters) -> Self {
        Self {
            curves: Arc::new([parameters.flux_factor.clone(), parameters.energy_factor.clone()]),
            fade: parameters.end_taper,
        }
    }

    /// Flux and energy at that fraction of the length.
    pub(crate) fn at(&self, fraction: f64) -> [f64; 2] {
        let [flux, energy] = [0, 1].map(|index| self.curves[index].eval(fraction));
        let from_end = fraction.min(1.0 - fraction).max(0.0);
        [flux * smoothstep(0.0, self.fade, from_end), energy]
    }

    /// Whether both are equal at sampled positions.
    pub(crate) fn approximately_equals(&self, other: &Self) -> bool {
        const SAMPLES: usize = 512;
        if self.curves == other.curves && self.fade == other.fade {
            return true;
        }
        for sample in 0..=SAMPLES {
            let fraction = sample as f64 / SAMPLES as f64;
            for (a, b) in self.at(fraction).into_iter().zip(other.at(fraction)) {
                let is_near = (a - b).abs() <= 1e-9 * a.abs().max(b.abs());
                if !is_near {
                    return false;
                }
            }
        }
        true
    }
}

#[cfg(test)]
mod factors_tests {
    use super::*;

    #[test]
    fn flux_rises_from_nothing_at_both_ends_and_energy_stays() {
        let factors =
            |fade: f64| FluxEnergyFactors::new(&SheetParameters { end_taper: fade, ..SheetParameters::default() });
        let soft = factors(0.2);
        assert_eq!([0.0, 1.0].map(|fraction| soft.at(fraction)), [[0.0, 1.0]; 2]);
        assert_eq!([0.1, 0.9].map(|fraction| (soft.at(fraction)[0] - 0.5).abs() < 1e-12), [true; 2]);
        assert_eq!([0.2, 0.5, 0.8].map(|fraction| soft.at(fraction)), [[1.0; 2]; 3]);
        assert_eq!([0.0, 0.5, 1.0].map(|fraction| factors(0.0).at(fraction)), [[1.0; 2]; 3]);
        assert!(soft.approximately_equals(&factors(0.2)) && !soft.approximately_equals(&factors(0.1)));
    }
}
