//! The sheets of a shape as the scene states them.

use bansho::{
    aurora::shapes::SheetParameters,
    base::{
        math::{DVec2, curve::Curve, lerp},
        parameters::{Auto, Parameters, Table},
    },
};

use super::{AuroraDrawing, links::rounded, polyline};

/// What can be painted along a sheet: a factor of the aurora's own value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Factor {
    /// Energy flux: how bright it is.
    Flux,
    /// Energy of the electrons: lower altitude and other colors.
    Energy,
}

impl Factor {
    /// Its curve in `sheet`.
    pub(super) fn of(self, sheet: &mut SheetParameters) -> &mut Curve {
        match self {
            Self::Flux => &mut sheet.flux_factor,
            Self::Energy => &mut sheet.energy_factor,
        }
    }

    /// The range of the brush; a scene may state values outside of it.
    pub(super) fn bounds(self) -> [f64; 2] {
        match self {
            Self::Flux => [0.0, 8.0],
            Self::Energy => [0.1, 8.0],
        }
    }
}

impl AuroraDrawing {
    /// Tolerance of simplified lines, as a fraction of the map's side.
    const TOLERANCE: f64 = 0.002;

    /// The points of `line`, simplified and rounded, as they are written to the scene.
    pub(super) fn simplified_points(&self, line: &[DVec2]) -> Vec<[f64; 2]> {
        let points = polyline::simplified(line, Self::TOLERANCE * self.extent_km());
        points.into_iter().map(|point| self.rounded(point)).collect()
    }

    /// Rounded to a thousandth of the map's side or finer, clamped to the map.
    pub(super) fn rounded(&self, point: DVec2) -> [f64; 2] {
        let half = self.extent_km() / 2.0;
        let scale = if self.extent_km() >= 100.0 { 10.0 } else { 1000.0 };
        point.clamp(DVec2::splat(-half), DVec2::splat(half)).to_array().map(|km| (km * scale).round() / scale)
    }

    /// The control points of sheet `sheet` of shape `shape`: those of the file where it lists them.
    pub fn points(&self, shape: usize, sheet: usize) -> Vec<DVec2> {
        let entry = self.sheets(shape).into_iter().nth(sheet);
        match entry.filter(is_plain).and_then(|entry| entry.points) {
            Some(points) => points.into_iter().map(DVec2::from).collect(),
            None => {
                let line = self.lines(shape).into_iter().nth(sheet).unwrap_or_default();
                polyline::simplified(&line, Self::TOLERANCE * self.extent_km())
            }
        }
    }

    /// One entry per sheet: the file's own where it has one per sheet, else entries made from the evaluated lines and factors.
    pub(super) fn sheets(&self, shape: usize) -> Vec<SheetParameters> {
        let stated = self.parameters.shapes.get(shape).map(|shape| shape.sheets.clone()).unwrap_or_default();
        let lines = self.lines(shape);
        if stated.len() == lines.len() {
            return stated;
        }
        let mut sheets = Vec::with_capacity(lines.len());
        for (sheet, line) in lines.iter().enumerate() {
            let [flux_factor, energy_factor] =
                [Factor::Flux, Factor::Energy].map(|factor| along(line, &self.factors(shape, sheet, factor)));
            // The evaluated factors include the taper of the ends.
            let plain = with_points(&SheetParameters::default(), self.simplified_points(line));
            sheets.push(SheetParameters { flux_factor, energy_factor, end_taper: 0.0, ..plain });
        }
        sheets
    }
}

/// The curve of a factor along `line` with `values` at its points.
fn along(line: &[DVec2], values: &[f64]) -> Curve {
    /// Tolerance of a factor.
    const TOLERANCE: f64 = 0.01;
    let default = SheetParameters::default().flux_factor;
    let total = polyline::length(line).max(f64::MIN_POSITIVE);
    let mut distance = 0.0;
    let mut points = Vec::new();
    for (index, value) in values.iter().enumerate().take(line.len()) {
        distance += index.checked_sub(1).map_or(0.0, |before| line[before].distance(line[index]));
        points.push(DVec2::new(distance / total, *value));
    }
    let first = values.first().copied().unwrap_or(1.0);
    if values.iter().all(|value| (value - first).abs() < TOLERANCE) {
        let constant = vec![[0.0, rounded(first)]];
        return if (first - 1.0).abs() < TOLERANCE {
            default
        } else {
            Curve::new(constant, default.interpolation()).unwrap_or(default)
        };
    }
    // The interpolated curve may overshoot between few points; finer tolerances follow then, and the last curve is taken in any case.
    let mut curve = None;
    for tolerance in [TOLERANCE, 0.3 * TOLERANCE, 0.1 * TOLERANCE, 0.0] {
        let kept = polyline::simplified(&points, tolerance).into_iter().map(|point| point.to_array().map(rounded));
        let Ok(finer) = Curve::new(kept.collect(), default.interpolation()) else { continue };
        let is_near = points.iter().all(|point| (finer.eval(point.x) - point.y).abs() < 2.0 * TOLERANCE);
        curve = Some(finer);
        if is_near {
            break;
        }
    }
    curve.unwrap_or(default)
}

/// Whether `sheet` has no transform.
fn is_plain(sheet: &SheetParameters) -> bool {
    let default = SheetParameters::default();
    (sheet.position_km, sheet.rotation_deg) == (default.position_km, default.rotation_deg)
        && (sheet.scale, sheet.mirror) == (default.scale, default.mirror)
}

/// `sheet` with a stroke through `points`.
pub(super) fn with_points(sheet: &SheetParameters, points: Vec<[f64; 2]>) -> SheetParameters {
    SheetParameters {
        points: Some(points),
        smooth: sheet.smooth,
        flux_factor: sheet.flux_factor.clone(),
        end_taper: sheet.end_taper,
        energy_factor: sheet.energy_factor.clone(),
        ..SheetParameters::default()
    }
}

/// `sheet` with a named form of default size, at the same position.
pub(super) fn with_form(sheet: &SheetParameters, form: bansho::aurora::shapes::Form) -> SheetParameters {
    SheetParameters {
        points: None,
        svg_file: None,
        svg_path_id: None,
        form: Some(form),
        bend_deg: Auto::Auto,
        wave_count: Auto::Auto,
        smooth: true,
        ..sheet.clone()
    }
}

/// The range of a factor's curve between two fractions of the length.
pub(super) fn curve_range(curve: &Curve, [from, to]: [f64; 2]) -> Curve {
    if curve.points().len() < 2 {
        return curve.clone();
    }
    let inner = curve.points().iter().filter(|point| point[0] > from && point[0] < to);
    let mut points = vec![[0.0, curve.eval(from)]];
    points.extend(inner.map(|&[at, value]| [(at - from) / (to - from), value]));
    points.push([1.0, curve.eval(to)]);
    Curve::new(points, curve.interpolation()).unwrap_or_else(|_| curve.clone())
}

/// A factor's curve, and whether its sheet is reversed.
#[derive(Clone, Copy, Debug)]
pub(super) struct DirectedCurve<'a> {
    pub(super) curve: &'a Curve,
    pub(super) reversed: bool,
}

/// Two curves end to end; the second begins at `fraction`.
pub(super) fn curve_chain(parts: [DirectedCurve; 2], fraction: f64) -> Curve {
    /// Width of the seam, as a fraction of the length.
    const SEAM: f64 = 1e-3;
    let [first, second] = parts.map(|part| part.curve);
    if first == second && first.points().len() < 2 {
        return first.clone();
    }
    let ranges = [[0.0, fraction - SEAM], [fraction + SEAM, 1.0]];
    let mut points = Vec::new();
    for (DirectedCurve { curve, reversed }, [from, to]) in parts.into_iter().zip(ranges) {
        let mut range = curve_range(&sampled(curve), [0.0, 1.0]).points().to_vec();
        if reversed {
            range = range.iter().rev().map(|&[at, value]| [1.0 - at, value]).collect();
        }
        points.extend(range.iter().map(|&[at, value]| [lerp(from, to, at), value]));
    }
    Curve::new(points, first.interpolation()).unwrap_or_else(|_| first.clone())
}

/// The curve with control points at both ends.
pub(super) fn sampled(curve: &Curve) -> Curve {
    if curve.points().len() >= 2 {
        return curve.clone();
    }
    let ends = [0.0, 1.0].map(|at| [at, curve.eval(at)]);
    Curve::new(ends.into(), curve.interpolation()).unwrap_or_else(|_| curve.clone())
}

/// The keys of `parameters` that differ from the defaults.
pub(super) fn non_default<P: Parameters>(parameters: &P) -> Table {
    let defaults = P::default().to_table();
    let mut table = Table::default();
    for entry in parameters.to_table().entries {
        if defaults.get(&entry.key) != Some(&entry.node) {
            table.push(entry.key, entry.node.value);
        }
    }
    table
}
