//! Projection of altitudes on a field line to chart rows: exact for single points, by Chebyshev interpolation for many.

use std::f64::consts::PI;

use bansho_base::math::{
    self, approximations,
    simd::{HalfLanes, LANES, Lanes, Real},
};
use fearless_simd::{Simd, prelude::*};

use super::{chart::ChartProjection, field_lines::EARTH_RADIUS_KM};
use crate::physics::atmosphere::{HIGHEST_KM, LOWEST_KM};

/// Chebyshev nodes at which a line is projected exactly, and terms of the row polynomial.
const NODES: usize = 8;
/// Terms of the polynomials of slope and brightness, which are smoother.
const TERMS: usize = 5;
/// Maximum distance of collisions from their level.
const MARGIN_KM: f64 = 1.0;
/// The polynomials are in `1 / (altitude + PIVOT_KM)`, which approximates the perspective foreshortening of rays.
const PIVOT_KM: f64 = 100.0;
/// Range of that quantity, per km.
const ENDS: [f64; 2] = [1.0 / (HIGHEST_KM + MARGIN_KM + PIVOT_KM), 1.0 / (LOWEST_KM - MARGIN_KM + PIVOT_KM)];
const MIDDLE: f64 = 0.5 * (ENDS[0] + ENDS[1]);
const HALF: f64 = 0.5 * (ENDS[1] - ENDS[0]);

/// A field line and its projection.
pub(crate) struct ProjectedFieldLine<'a> {
    /// Distance from the observer's own field line, km.
    pub(super) distance: f32,
    /// Coefficients of its meridian, [`Meridian::coefficients_f32`](super::field_lines::Meridian::coefficients_f32).
    meridian: &'a [f32; 3],
    projection: &'a ChartProjection,
}

impl<'a> ProjectedFieldLine<'a> {
    #[inline(always)]
    pub(crate) fn new(meridian: &'a [f32; 3], distance: f32, projection: &'a ChartProjection) -> Self {
        Self { distance, meridian, projection }
    }

    /// Rows of points at altitudes and offsets from the line in km, and their brightness factors.
    #[inline(always)]
    pub(crate) fn points<S: Simd>(&self, altitudes_km: &[f32; LANES], offsets: Lanes<S>) -> [Lanes<S>; 2] {
        let mut distances: [f32; LANES] = offsets.into();
        for distance in &mut distances {
            *distance += self.distance;
        }
        let ProjectedPoints { rows, brightness, .. } = self.project_points(altitudes_km, &distances);
        [Lanes::from_slice(offsets.simd, &rows), Lanes::from_slice(offsets.simd, &brightness)]
    }

    /// Exact projection of points of the meridian at altitudes and distances, km. One operation per loop, so that each
    /// is vectorized.
    #[inline(always)]
    fn project_points<const COUNT: usize>(
        &self,
        altitudes: &[f32; COUNT],
        distances: &[f32; COUNT],
    ) -> ProjectedPoints<COUNT> {
        const RADIUS: f32 = EARTH_RADIUS_KM as f32;
        const DIAMETER: f32 = 2.0 * RADIUS;
        let ([constant, outward, along], projection) = (*self.meridian, *self.projection);
        let (mut per_upward, mut coordinates, mut far_squared) = ([0.0; COUNT], [0.0; COUNT], [0.0; COUNT]);
        for i in 0..COUNT {
            let (altitude, distance) = (altitudes[i], distances[i]);
            let squared = altitude.fma(DIAMETER + altitude, -distance.fma(2.0 * outward + distance, constant));
            // The discriminant of the quadratic that gives the coordinate along the field at this altitude.
            let squared = along.fma(along, squared);
            let squared = if squared > 1.0 { squared } else { 1.0 };
            per_upward[i] = squared.simd_rsqrt();
            coordinates[i] = squared * per_upward[i] - along;
            far_squared[i] = distance.fma(distance, coordinates[i] * coordinates[i]);
        }
        let mut projected = ProjectedPoints { rows: [0.0; COUNT], slopes: [0.0; COUNT], brightness: [0.0; COUNT] };
        for i in 0..COUNT {
            projected.rows[i] = projection.row(approximations::atan2(distances[i], coordinates[i])) - 0.5;
        }
        for i in 0..COUNT {
            let distance = distances[i];
            let far_squared = if far_squared[i] > 1e-12 { far_squared[i] } else { 1e-12 };
            let per_far = far_squared.simd_rsqrt();
            let slope = distance.fma((outward + distance) * per_upward[i], coordinates[i]) * (per_far * per_far);
            projected.slopes[i] = projection.rows(slope);
            // A source's power is per area perpendicular to the field; a collision represents all of it, so the cosine
            // to the vertical cancels.
            let slant = (RADIUS + altitudes[i]) * per_upward[i] * per_far;
            projected.brightness[i] = if distance > 0.0 && far_squared > 1.0 { slant } else { 0.0 };
        }
        projected
    }
}

/// Projected points.
struct ProjectedPoints<const COUNT: usize> {
    rows: [f32; COUNT],
    /// Rows per km of distance.
    slopes: [f32; COUNT],
    brightness: [f32; COUNT],
}

/// Altitudes of [`RowPolynomialBasis::altitude_coordinate`]s, km.
#[inline(always)]
pub(crate) fn altitudes_km(coordinates: &[f32; LANES]) -> [f32; LANES] {
    let mut altitudes = [0.0; LANES];
    for (altitude, position) in altitudes.iter_mut().zip(coordinates) {
        *altitude = 1.0 / position.fma(HALF as f32, MIDDLE as f32) - PIVOT_KM as f32;
    }
    altitudes
}

/// Matrices that convert values at the Chebyshev nodes to polynomial coefficients.
#[derive(Clone, Debug)]
pub(crate) struct RowPolynomialBasis {
    altitudes_km: [f32; NODES],
    /// Contribution of each node's value to each coefficient: for all terms, and for the first [`TERMS`].
    full: [[f32; NODES]; NODES],
    short: [[f32; NODES]; NODES],
}

/// Polynomials of row, slope and brightness in the altitude coordinate.
#[derive(Clone, Copy, Default)]
pub(crate) struct RowPolynomials {
    rows: [f32; NODES],
    slopes: [f32; NODES],
    brightness: [f32; NODES],
    /// Rows of the highest and the lowest node, and the maximum slope.
    ends: [f32; 2],
    steepest: f32,
}

impl RowPolynomialBasis {
    pub(crate) fn new() -> Self {
        let mut altitudes_km = [0.0; NODES];
        for (node, altitude_km) in altitudes_km.iter_mut().enumerate() {
            // The inverse of the altitude coordinate.
            *altitude_km = (1.0 / HALF.mul_add(chebyshev_node(node), MIDDLE) - PIVOT_KM) as f32;
        }
        Self {
            altitudes_km,
            full: std::array::from_fn(|node| coefficients(node, NODES)),
            short: std::array::from_fn(|node| coefficients(node, TERMS)),
        }
    }

    /// Altitude coordinate: 1 at the lowest altitude, -1 at the highest.
    pub(crate) fn altitude_coordinate(altitude_km: f32) -> f32 {
        ((1.0 / (f64::from(altitude_km) + PIVOT_KM) - MIDDLE) / HALF) as f32
    }

    /// Fits the polynomials of a line.
    #[inline(always)]
    pub(crate) fn fit<S: Simd>(&self, simd: S, line: &ProjectedFieldLine) -> RowPolynomials {
        let ProjectedPoints { rows, slopes, brightness } =
            line.project_points(&self.altitudes_km, &[line.distance; NODES]);
        let mut steepest = 0.0_f32;
        for slope in slopes {
            steepest = if slope.abs() > steepest { slope.abs() } else { steepest };
        }
        RowPolynomials {
            ends: [rows[NODES - 1], rows[0]],
            steepest,
            rows: coefficients_from_values(simd, &self.full, &rows),
            slopes: coefficients_from_values(simd, &self.short, &slopes),
            brightness: coefficients_from_values(simd, &self.short, &brightness),
        }
    }
}

impl RowPolynomials {
    /// Conservative test whether points within `reach` km of the line can be on a chart of `rows` rows.
    #[inline(always)]
    pub(crate) fn may_be_visible(&self, reach: f32, rows: usize) -> bool {
        // One row of margin beyond the outermost nodes.
        let beyond = self.steepest.fma(2.0 * reach, 0.1 * (self.ends[1] - self.ends[0]).abs() + 1.0);
        self.ends[1] + beyond > 0.0 && self.ends[0] - beyond < rows as f32
    }

    /// Rows of points at altitude coordinates and offsets from the line in km, and their brightness factors.
    #[inline(always)]
    pub(crate) fn points<S: Simd>(&self, coordinates: Lanes<S>, offsets: Lanes<S>) -> [Lanes<S>; 2] {
        let slopes = polynomial(coordinates, &self.slopes[..TERMS]);
        // A source is narrow: across it the row is linear in the distance.
        let rows = slopes.fma(offsets, polynomial(coordinates, &self.rows));
        [rows, polynomial(coordinates, &self.brightness[..TERMS])]
    }
}

/// Evaluates a polynomial at `coordinates`, coefficients from the constant term on (Horner).
#[inline(always)]
fn polynomial<S: Simd>(coordinates: Lanes<S>, coefficients: &[f32]) -> Lanes<S> {
    let Some((highest, others)) = coefficients.split_last() else { return coordinates.broadcast(0.0) };
    let mut value = coordinates.broadcast(*highest);
    for coefficient in others.iter().rev() {
        value = value.fma(coordinates, coordinates.broadcast(*coefficient));
    }
    value
}

/// Coefficients from the values at the nodes.
#[inline(always)]
fn coefficients_from_values<S: Simd>(simd: S, basis: &[[f32; NODES]; NODES], values: &[f32; NODES]) -> [f32; NODES] {
    let mut sum = HalfLanes::splat(simd, 0.0);
    for node in 0..NODES {
        sum = HalfLanes::splat(simd, values[node]).fma(HalfLanes::from_slice(simd, &basis[node]), sum);
    }
    sum.into()
}

/// Chebyshev node.
fn chebyshev_node(node: usize) -> f64 {
    math::cos(PI * (node as f64 + 0.5) / NODES as f64)
}

/// Contribution of a value of 1 at a node to the coefficients of the first `terms` Chebyshev polynomials, in powers of
/// the coordinate.
fn coefficients(node: usize, terms: usize) -> [f32; NODES] {
    let mut powers = [0.0; NODES];
    let (mut last, mut polynomial) = ([0.0; NODES], [0.0; NODES]);
    polynomial[0] = 1.0;
    for term in 0..terms {
        let angle = PI * term as f64 * (node as f64 + 0.5) / NODES as f64;
        let weight = if term == 0 { 1.0 } else { 2.0 } / NODES as f64 * math::cos(angle);
        for (power, coefficient) in powers.iter_mut().zip(&polynomial) {
            *power += weight * coefficient;
        }
        // T(n + 1) = 2 x T(n) - T(n - 1), and T(1) = x.
        let scale = if term == 0 { 1.0 } else { 2.0 };
        let mut next = [0.0; NODES];
        for (times_x, coefficient) in next[1..].iter_mut().zip(polynomial) {
            *times_x = scale * coefficient;
        }
        for (coefficient, last) in next.iter_mut().zip(last) {
            *coefficient -= last;
        }
        (last, polynomial) = (polynomial, next);
    }
    powers.map(|power| power as f32)
}

#[cfg(test)]
mod tests {
    use bansho_base::math::DVec3;
    use fearless_simd::dispatch;

    use super::*;
    use crate::render::project::field_lines::FieldLines;

    #[test]
    fn polynomials_place_points_where_they_are_seen() {
        // A row is 1.5 mrad high, a pixel of an ordinary picture.
        let projection = ChartProjection::of_rows(1.5e-3);
        let descents = RowPolynomialBasis::new();
        let mut largest = 0.0_f32;
        for dip_deg in [90.0, 77.0, 60.0] {
            let field = FieldLines::new(dip_deg, 0.0, DVec3::ZERO);
            for (longitude, distance) in [(0.3, 15.0), (1.6, 60.0), (-1.5, 150.0), (-1.6, 400.0), (-1.2, 900.0)] {
                let (sin, cos) = math::sin_cos(longitude);
                let meridian = field.meridian([cos, sin]).coefficients_f32();
                let line = ProjectedFieldLine::new(&meridian, distance, &projection);
                for first_km in [82.0, 130.0, 400.0] {
                    let altitudes_km: [f32; LANES] = std::array::from_fn(|i| first_km + 3.0 * i as f32);
                    let offset = |i: usize| distance * 0.01 * (i as f32 / 7.5 - 1.0);
                    let offsets: [f32; LANES] = std::array::from_fn(offset);
                    let [[rows, brightness], [exact_rows, exact_lights]] = dispatch!(bansho_base::math::simd::level(), simd => {
                        let coordinates = altitudes_km.map(RowPolynomialBasis::altitude_coordinate);
                        let offsets = Lanes::from_slice(simd, &offsets);
                        let found = descents.fit(simd, &line).points(Lanes::from_slice(simd, &coordinates), offsets);
                        [found, line.points(&altitudes_km, offsets)].map(|pair| pair.map(<[f32; LANES]>::from))
                    });
                    for i in 0..LANES {
                        let what = || format!("dip {dip_deg}, {distance} km away, {} km high", altitudes_km[i]);
                        largest = largest.max((rows[i] - exact_rows[i]).abs());
                        // Brightness does not follow the offset.
                        let ratio = brightness[i] / exact_lights[i];
                        assert!((ratio - 1.0).abs() < 0.025, "{}: {ratio}", what());
                    }
                }
            }
        }
        bansho_base::assert_measured!("figure 2.16: difference, rows", f64::from(largest), 0.0, 0.3);
    }
}
