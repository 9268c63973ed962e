//! The mapping from sheet coordinates to flame coordinates, eqs. (9) to (18), and the threshold, eq. (4), with tables of the user's curves.

use bansho_base::{
    math::{
        self,
        curve::Curve,
        simd::{LANES, Lanes, Real, any_positive},
    },
    parameters::{ParameterError, ParameterErrorKind},
};
use fearless_simd::{Simd, prelude::*};

use super::curve_pair::{CurvePair, SEGMENTS, lookup_index};
use crate::sheet::{
    equations,
    parameters::{ColorParameters, Coloring, SheetShapeParameters, TextureParameters},
};

/// Number of bins of height for which the horizontal extent of the flame is tabulated.
const EXTENT_BINS: usize = 128;

/// Curves of eqs. (4) to (12) as tables: everything in the mapping that does not change with time.
#[derive(Clone, Debug)]
pub(crate) struct ShapeTables {
    initial_speed: f32,
    edge_speed: f32,
    contrast: f32,
    thinning: f32,
    convergence: f32,
    /// 1 over the largest width A + D, at which parallel columns of the texture are as wide as those that follow the outline.
    inverse_width: f32,
    /// B over x; `None` if it is 0.
    fuel_outline: Option<CurvePair>,
    /// Core width A and fringe width D over w.
    widths: CurvePair,
    /// F over the position in the fringe.
    falloff: CurvePair,
    /// H over u'.
    threshold_across: CurvePair,
    /// V and the parameter `glow` over w.
    threshold_and_glow: CurvePair,
    /// Factor of red light by cooling, and that of green relative to red, over w.
    cooling: CurvePair,
    /// A and D over w, as sampled for `widths`.
    width_samples: Vec<[f32; 2]>,
    /// Largest x' at which there may be flame, over y.
    max_distance: Box<[f32; EXTENT_BINS]>,
}

/// The curve with the point (0, 0), which the paper requires, prepended unless it has one.
pub(crate) fn from_origin(curve: &Curve, key: &'static str) -> Result<Curve, ParameterError> {
    let mut points = curve.points().to_vec();
    match points.first() {
        Some([x, y]) if *x <= 0.0 && *y != 0.0 => {
            return Err(ParameterError { key, kind: ParameterErrorKind::NotZeroAtOrigin { value: *y } });
        }
        Some([x, _]) if *x > 0.0 => points.insert(0, [0.0, 0.0]),
        _ => {}
    }
    Ok(Curve::new(points, curve.interpolation()).unwrap_or_else(|_| curve.clone()))
}

fn check_widths(samples: &[[f32; 2]]) -> Result<(), ParameterError> {
    const TOLERANCE: f32 = 1e-6;
    let widest = samples.iter().enumerate().max_by(|a, b| (a.1[0] + a.1[1]).total_cmp(&(b.1[0] + b.1[1])));
    match widest {
        Some((i, [core, fringe])) if core + fringe > 1.0 + TOLERANCE => Err(ParameterError {
            key: "shape.fringe_width",
            kind: ParameterErrorKind::WiderThanSheet {
                at: i as f64 / (samples.len() - 1) as f64,
                sum: f64::from(core + fringe),
            },
        }),
        _ => Ok(()),
    }
}

/// Values of both curves at the arguments of a [`CurvePair`].
fn samples(first: &Curve, second: &Curve) -> Vec<[f32; 2]> {
    let count = SEGMENTS + 1;
    let rows = [first, second].map(|curve| curve.sample_table(count, 0.0, 1.0));
    rows[0].iter().zip(&rows[1]).map(|(a, b)| [*a, *b]).collect()
}

/// Flame coordinates of sixteen points.
#[derive(Clone, Copy)]
pub(crate) struct FlameCoordinates<S: Simd> {
    /// Texture coordinate u.
    pub(crate) u: Lanes<S>,
    /// Height w of the slowed rise, eq. (12).
    pub(crate) w: Lanes<S>,
    /// Threshold L, eq. (4).
    pub(crate) threshold: Lanes<S>,
    /// Relative brightness and soot at that height.
    pub(crate) glow: Lanes<S>,
    /// Factor of red light by cooling, and that of green relative to red.
    pub(crate) cooling: [Lanes<S>; 2],
    /// Distance inside the fluttering edge, pixels; negative outside.
    edge_distance_pixels: Lanes<S>,
    /// Height above the base, pixels.
    base_distance_pixels: Lanes<S>,
}

impl<S: Simd> FlameCoordinates<S> {
    /// Coordinates of points far outside the flame.
    #[inline(always)]
    pub(crate) fn outside(y: Lanes<S>) -> Self {
        let (zero, one) = (y.broadcast(0.0), y.broadcast(1.0));
        let far = y.broadcast(-1e3);
        Self {
            u: zero,
            w: one,
            threshold: one,
            glow: zero,
            cooling: [one; 2],
            edge_distance_pixels: far,
            base_distance_pixels: zero,
        }
    }

    /// Pixel coverage of the flame's outline, for antialiasing; 0 outside.
    #[inline(always)]
    pub(crate) fn coverage(&self, pixel: [f32; 2]) -> Lanes<S> {
        let (half, one) = (self.w.broadcast(0.5), self.w.broadcast(1.0));
        let top = (one - self.w).fma(one.broadcast(1.0 / pixel[1]), half).simd_clamp01();
        (self.edge_distance_pixels + half).simd_clamp01() * (self.base_distance_pixels + half).simd_clamp01() * top
    }

    /// Maximum number of texels between neighboring pixels of the row where there may be flame; `texels` are the texels per unit of u and of w.
    #[inline(always)]
    pub(crate) fn max_texel_step(&self, texels: [f32; 2]) -> f32 {
        let (one, zero) = (self.w.broadcast(1.0), self.w.broadcast(0.0));
        let inside = (self.edge_distance_pixels + one)
            .simd_min(self.base_distance_pixels + one)
            .simd_min(one - self.w)
            .simd_min(one - self.threshold);
        let across = step_to_next(self.u) * self.u.broadcast(texels[0]);
        let both = step_to_next(self.w).fma(self.u.broadcast(texels[1]), across);
        let mut texel_steps = [0.0; LANES];
        zero.select_lt(inside, both, zero).store_slice(&mut texel_steps);
        let mut max_step = 0.0_f32;
        for step in texel_steps {
            max_step = max_step.max(step);
        }
        max_step
    }

    /// `self + fraction * delta`.
    #[inline(always)]
    pub(crate) fn add_scaled(&self, fraction: f32, delta: &Self) -> Self {
        self.zip_with(delta, |value, delta| delta.fma(value.broadcast(fraction), value))
    }

    /// `self - other`.
    #[inline(always)]
    pub(crate) fn difference(&self, other: &Self) -> Self {
        self.zip_with(other, |value, other| value - other)
    }

    #[inline(always)]
    fn zip_with(&self, other: &Self, combine: impl Fn(Lanes<S>, Lanes<S>) -> Lanes<S>) -> Self {
        Self {
            u: combine(self.u, other.u),
            w: combine(self.w, other.w),
            threshold: combine(self.threshold, other.threshold),
            glow: combine(self.glow, other.glow),
            cooling: [combine(self.cooling[0], other.cooling[0]), combine(self.cooling[1], other.cooling[1])],
            edge_distance_pixels: combine(self.edge_distance_pixels, other.edge_distance_pixels),
            base_distance_pixels: combine(self.base_distance_pixels, other.base_distance_pixels),
        }
    }
}

/// Distance of each value from the next of its row; 0 for the last.
#[inline(always)]
fn step_to_next<S: Simd>(values: Lanes<S>) -> Lanes<S> {
    let mut row = [values[LANES - 1]; LANES + 1];
    values.store_slice(&mut row[..LANES]);
    (Lanes::from_slice(values.simd, &row[1..]) - values).simd_abs()
}

impl ShapeTables {
    /// Checks the curves.
    ///
    /// # Errors
    /// A curve that must begin at the origin does not, or core and fringe together are wider than the sheet.
    pub(crate) fn check(shape: &SheetShapeParameters) -> Result<(), ParameterError> {
        let fringe = from_origin(&shape.fringe_width, "shape.fringe_width")?;
        check_widths(&samples(&shape.core_width, &fringe))
    }

    /// Tables for curves that were [checked](Self::check).
    ///
    /// `reach` gives the largest displacement by eddies across and up, of either sign, at a height.
    pub(crate) fn new(
        shape: &SheetShapeParameters,
        texture: &TextureParameters,
        color: &ColorParameters,
        reach: impl Fn(f32) -> [f32; 2],
    ) -> Self {
        let fringe = from_origin(&shape.fringe_width, "shape.fringe_width");
        let fringe = fringe.unwrap_or_else(|_| shape.fringe_width.clone());
        let width_samples = samples(&shape.core_width, &fringe);
        let mut result = Self {
            initial_speed: shape.initial_speed as f32,
            edge_speed: shape.edge_speed as f32,
            contrast: texture.contrast as f32,
            thinning: texture.thinning as f32,
            convergence: shape.convergence as f32,
            inverse_width: 1.0
                / width_samples.iter().fold(0.01, |widest, [core, fringe]| f32::max(widest, core + fringe)),
            fuel_outline: (shape.fuel_outline.points().iter().any(|[_, height]| *height > 0.0))
                .then(|| CurvePair::new(|x| [shape.fuel_outline.eval(x), 0.0])),
            widths: CurvePair::from_samples(|i| width_samples[i]),
            falloff: CurvePair::new(|position| [1.0 - shape.slowing.eval(position), 0.0]),
            threshold_across: CurvePair::new(|across| [texture.threshold_across.eval(across), 0.0]),
            threshold_and_glow: CurvePair::new(|w| [texture.threshold.eval(w), color.glow.eval(w)]),
            cooling: CurvePair::new(|w| cooling_factors(color, w)),
            width_samples,
            max_distance: Box::new([1.0; EXTENT_BINS]),
        };
        result.max_distance = result.compute_max_distance();
        result.extend_by(reach);
        result
    }

    /// The fluttering edges left and right, over w, eq. (15).
    #[inline(always)]
    pub(crate) fn edges(&self, flutter_left: &[f32], flutter_right: &[f32]) -> CurvePair {
        CurvePair::from_samples(|i| {
            let [core, fringe] = self.width_samples[i];
            [flutter_left[i], flutter_right[i]].map(|flutter| equations::fluttering_edge(core, fringe, flutter))
        })
    }

    /// Slowed rise, eq. (12), from rise (9) and speed profile (11).
    #[inline(always)]
    fn slowed_rise<S: Simd>(&self, distance: Lanes<S>, y: Lanes<S>) -> Lanes<S> {
        let rise = equations::rise(y, self.initial_speed);
        let [core, fringe] = self.widths.lookup(&lookup_index(rise));
        if !any_positive(distance - core) {
            return rise;
        }
        let [falloff, _] = self.falloff.lookup(&lookup_index(equations::fringe_position(distance, core, fringe)));
        equations::slowed_rise(rise, equations::speed_profile(falloff, self.edge_speed))
    }

    /// T0 with the parameter `contrast` applied; within [0, 1].
    #[inline(always)]
    pub(crate) fn apply_contrast<S: Simd>(&self, texture: Lanes<S>) -> Lanes<S> {
        texture.fma(texture.broadcast(self.contrast), texture.broadcast(1.0 - self.contrast))
    }

    /// Factor of T1 by the parameter `thinning` where the threshold is L; 1 without it.
    #[inline(always)]
    pub(crate) fn soot<S: Simd>(&self, threshold: Lanes<S>) -> Lanes<S> {
        threshold.fma(threshold.broadcast(-self.thinning), threshold.broadcast(1.0))
    }

    /// Raises the base to the height of what burns at (x, y) of the sheet.
    #[inline(always)]
    pub(crate) fn hide_below_fuel<S: Simd>(
        &self,
        coordinates: &mut FlameCoordinates<S>,
        x: Lanes<S>,
        y: Lanes<S>,
        pixel: [f32; 2],
    ) {
        if let Some(outline) = &self.fuel_outline {
            let [height, _] = outline.lookup(&lookup_index(x));
            coordinates.base_distance_pixels = (y - height) * y.broadcast(1.0 / pixel[1]);
        }
    }

    /// Slowed rise, eq. (12), at one point.
    pub(crate) fn slowed_rise_at(&self, distance: f32, y: f32) -> f32 {
        let rise = equations::rise(y, self.initial_speed);
        let [core, fringe] = self.widths.at(rise);
        let [falloff, _] = self.falloff.at(equations::fringe_position(distance, core, fringe));
        equations::slowed_rise(rise, equations::speed_profile(falloff, self.edge_speed))
    }

    /// The whole mapping, eqs. (9) to (18), and the threshold, eq. (4), for points of the unit square.
    ///
    /// `pixel` is the size of a pixel in x' and in y, over which edges are antialiased.
    #[inline(always)]
    pub(crate) fn coordinates<S: Simd>(
        &self,
        x: Lanes<S>,
        y: Lanes<S>,
        edges: &CurvePair,
        pixel: [f32; 2],
    ) -> FlameCoordinates<S> {
        let distance = equations::axis_distance(x);
        let w = self.slowed_rise(distance, y.simd_clamp01());
        let at = lookup_index(w);
        let ([left, right], [vertical, glow], cooling) =
            (edges.lookup(&at), self.threshold_and_glow.lookup(&at), self.cooling.lookup(&at));
        let (half, one) = (x.broadcast(0.5), x.broadcast(1.0));
        let edge = x.select_lt(half, left, right);
        let edge_distance_pixels = (edge - distance) * x.broadcast(1.0 / pixel[0]);
        let across = equations::across(distance, edge).simd_min(one);
        let column = if self.convergence < 1.0 {
            let parallel = distance * x.broadcast(self.inverse_width);
            (across - parallel).fma(x.broadcast(self.convergence), parallel)
        } else {
            across
        };
        let [horizontal, _] = self.threshold_across.lookup(&lookup_index(across));
        let threshold = equations::threshold(vertical, horizontal);
        FlameCoordinates {
            u: equations::texture_u(column, x),
            w,
            threshold,
            glow,
            cooling,
            edge_distance_pixels,
            base_distance_pixels: y * x.broadcast(1.0 / pixel[1]),
        }
    }

    /// The threshold, eq. (4), over the flat texture square.
    #[inline(always)]
    pub(crate) fn flat_threshold<S: Simd>(&self, u: Lanes<S>, w: Lanes<S>) -> Lanes<S> {
        let [vertical, _] = self.threshold_and_glow.sample(w);
        let [horizontal, _] = self.threshold_across.sample(equations::axis_distance(u));
        equations::threshold(vertical, horizontal)
    }

    /// Whether a region contains no point of the flame, determined from six points on its border; x is relative to the center line.
    #[inline(always)]
    pub(crate) fn misses_flame(&self, x: &[f32; 6], y: &[f32; 6]) -> bool {
        let ([left, right], [low, high]) = (min_max(x), min_max(y));
        if !(high > -0.1 && low < 1.1) {
            return true;
        }
        let nearest = if left < 0.5 && right > 0.5 {
            0.0
        } else {
            equations::axis_distance(left).simd_min(equations::axis_distance(right))
        };
        for max_distance in &self.max_distance[extent_bin(low)..extent_bin(high) + 1] {
            if nearest <= *max_distance {
                return false;
            }
        }
        true
    }

    /// For each bin of height the largest x' with w <= 1 inside the fringe, with a margin for antialiasing.
    fn compute_max_distance(&self) -> Box<[f32; EXTENT_BINS]> {
        const STEPS: usize = 256;
        const MARGIN: f32 = 0.03;
        let max_width_above = self.max_width_above();
        let mut extent = Box::new([0.0_f32; EXTENT_BINS]);
        for edge in 0..=EXTENT_BINS {
            let y = (edge as f32 / (EXTENT_BINS - 1) as f32).min(1.0);
            let mut max_distance = 0.0_f32;
            for step in 1..=STEPS {
                let distance = step as f32 / STEPS as f32;
                let w = self.slowed_rise_at(distance, y);
                let row = ((w * (max_width_above.len() - 1) as f32) as usize).min(max_width_above.len() - 1);
                if w <= 1.05 && distance <= max_width_above[row] + MARGIN {
                    max_distance = max_distance.max(distance + MARGIN);
                }
            }
            for bin in edge.saturating_sub(1)..=edge.min(EXTENT_BINS - 1) {
                extent[bin] = extent[bin].max(max_distance);
            }
        }
        extent
    }

    /// Extends the largest x' to points that eddies displace by up to `reach` into the flame.
    fn extend_by(&mut self, reach: impl Fn(f32) -> [f32; 2]) {
        const LAST: usize = EXTENT_BINS - 1;
        let within = self.max_distance.clone();
        for (bin, extent) in self.max_distance.iter_mut().enumerate() {
            // At both ends of the bin: a reach has no maximum within a bin that is much higher.
            let ends = [bin, bin + 1].map(|end| reach(end as f32 / LAST as f32));
            let [across, up] = [0, 1].map(|k| ends[0][k].max(ends[1][k]));
            if up > 0.0 || across > 0.0 {
                let bins = (up * LAST as f32).ceil() as usize + 1;
                let reached = &within[bin.saturating_sub(bins)..=(bin + bins).min(LAST)];
                *extent = reached.iter().fold(0.0, |most: f32, value| most.max(*value)) + 2.0 * across;
            }
        }
    }

    /// Whether there is no flame at sixteen points of a row, nor up to `margin` above and below them.
    #[inline(always)]
    pub(crate) fn is_outside<S: Simd>(&self, x: Lanes<S>, y: Lanes<S>, margin: f32) -> bool {
        let (first, last) = (y[0], y[LANES - 1]);
        let (low, high) = (first.simd_min(last) - margin, last.simd_max(first) + margin);
        let mut extent = 0.0_f32;
        for bin in extent_bin(low)..=extent_bin(high) {
            extent = extent.simd_max(self.max_distance[bin]);
        }
        high < 0.0 || low > 1.1 || !any_positive(x.broadcast(extent) - equations::axis_distance(x))
    }

    /// Maximum of A + D at each sampled height and above.
    fn max_width_above(&self) -> Vec<f32> {
        let mut widest: Vec<f32> = self.width_samples.iter().map(|[core, fringe]| core + fringe).collect();
        for i in (0..widest.len() - 1).rev() {
            widest[i] = widest[i].max(widest[i + 1]);
        }
        widest
    }
}

/// Minimum and maximum of the coordinates of six points; NaN is ignored unless it is the first.
#[inline(always)]
fn min_max(values: &[f32; 6]) -> [f32; 2] {
    let [mut low, mut high] = [values[0]; 2];
    for value in &values[1..] {
        (low, high) = (value.simd_min(low), value.simd_max(high));
    }
    [low, high]
}

/// The bin of [`ShapeTables::max_distance`] for a height. The mask saves the bounds check.
#[inline(always)]
fn extent_bin(y: f32) -> usize {
    (y.simd_clamp01() * (EXTENT_BINS - 1) as f32) as i32 as usize & (EXTENT_BINS - 1)
}

/// Factor of red light at height w, and that of green relative to red, where soot has cooled by the fraction `cooling * w`.
///
/// Wien's law: cooling by a fraction d multiplies the radiance by exp(-c2 d / (lambda T)); here for 610 and 540 nm at 1700 K. The factor of blue, at
/// 460 nm, relative to red is that of green relative to red to the power 2.5.
fn cooling_factors(color: &ColorParameters, w: f64) -> [f64; 2] {
    /// c2 / (lambda T).
    const RED: f64 = 13.87;
    const GREEN: f64 = 15.67;
    if color.kind == Coloring::RgbCurves {
        return [1.0, 1.0];
    }
    let cooled_fraction = color.cooling * w;
    [math::exp(-RED * cooled_fraction), math::exp((RED - GREEN) * cooled_fraction)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tables of the default flame after changes to its shape, and its edges without flutter.
    fn tables(change: impl FnOnce(&mut SheetShapeParameters)) -> (ShapeTables, CurvePair) {
        let mut shape = SheetShapeParameters::default();
        change(&mut shape);
        let tables = ShapeTables::new(&shape, &TextureParameters::default(), &ColorParameters::default(), |_| [0.0; 2]);
        let outer = [1.0; SEGMENTS + 1];
        let edges = tables.edges(&outer, &outer);
        (tables, edges)
    }

    /// u of sixteen points from x = 0.4 to 0.6 at height `y`.
    fn columns((tables, edges): &(ShapeTables, CurvePair), y: f32) -> Vec<f32> {
        bansho_base::dispatch_baseline!(simd => {
            let x = Lanes::from_fn(simd, |i| 0.4 + 0.2 / 15.0 * i as f32);
            tables.coordinates(x, x.broadcast(y), edges, [0.01, 0.01]).u.as_slice().to_vec()
        })
    }

    #[test]
    fn parallel_columns_do_not_meet_where_the_outline_closes() {
        let closing = |convergence: f64| {
            tables(|shape| {
                shape.core_width = curve(&[[0.0, 0.01], [0.5, 0.8], [1.0, 0.01]]);
                shape.fringe_width = curve(&[[0.0, 0.0], [1.0, 0.0]]);
                shape.convergence = convergence;
            })
        };
        // The largest width is 0.8: 0.2 sheet widths are a quarter of the texture's width at every height.
        for y in [0.001, 0.1, 0.4, 0.9] {
            let u = columns(&closing(0.0), y);
            assert!((u[15] - u[0] - 0.25).abs() < 1e-3, "{y}: {u:?}");
        }
        // Columns that follow the outline meet: beyond it, u is clamped to that of the edge.
        let u = columns(&closing(1.0), 0.001);
        assert!(u[0] == 0.0 && u[15] == 1.0, "{u:?}");
    }

    #[test]
    fn the_default_outline_is_open_at_the_base() {
        let (_, edges) = tables(|_| {});
        // A(0) = 0.6, by the default curve.
        assert!((edges.at(0.0)[0] - 0.6).abs() < 1e-6);
    }

    #[test]
    fn the_area_of_the_outline_is_that_of_the_curves() {
        // A falls from 0.6 to 0.2 and D rises from 0 to 0.3, both linearly: the mean of A + D is 0.4 + 0.15.
        let (_, edges) = tables(|shape| {
            shape.core_width = curve(&[[0.0, 0.6], [1.0, 0.2]]);
            shape.fringe_width = curve(&[[0.0, 0.0], [1.0, 0.3]]);
        });
        let mean = (0..1000).map(|i| f64::from(edges.at((i as f32 + 0.5) / 1000.0)[1])).sum::<f64>() / 1000.0;
        assert!((mean - 0.55).abs() < 1e-4, "{mean}");
    }

    #[test]
    fn what_burns_hides_the_flame_below_it_and_nothing_above() {
        // B rises from 0 at the left side to 0.4 at the right one.
        let (tables, edges) = tables(|shape| shape.fuel_outline = curve(&[[0.0, 0.0], [1.0, 0.4]]));
        let pixel = [1e-3, 1e-3];
        let coverage = |x: f32, y: f32| {
            bansho_base::dispatch_baseline!(simd => {
                let (x, y) = (Lanes::splat(simd, x), Lanes::splat(simd, y));
                let mut coordinates = tables.coordinates(x, y, &edges, pixel);
                tables.hide_below_fuel(&mut coordinates, x, y, pixel);
                coordinates.coverage(pixel)[3]
            })
        };
        assert_eq!([0.198, 0.202].map(|y| coverage(0.5, y)), [0.0, 1.0]);
        assert_eq!([0.158, 0.162].map(|y| coverage(0.4, y)), [0.0, 1.0]);
    }

    fn curve(points: &[[f64; 2]]) -> Curve {
        Curve::new(points.to_vec(), bansho_base::math::curve::Interpolation::Linear).unwrap()
    }
}
