//! A flow without divergence that winds the footprints of sheets: quiet stretches, folds and swirls. Lawlor and Genetti (2011) wind footprints by a
//! simulated flow; here it is the curl of noise (Bridson et al. 2007).
//!
//! Points of a sheet are carried by the flow for a fixed path. Its path lines never meet, so that sheets that do not cross before do not cross after,
//! and sheets that are near each other are wound alike, but not equally. The flow itself drifts and changes slowly.

use bansho_base::{
    host::parallel::prelude::*,
    math::{
        DVec2,
        random::{Key, Purpose},
    },
    noise::{Coordinate, Fractal, LANES, Noise},
};
use fearless_simd::dispatch;

use crate::{AuroraParameters, SwirlParameters};

/// Octaves of the stream function. With this gain each octave has half the speed of the one before: few folds are small.
const FRACTAL: Fractal = Fractal { octaves: 3, lacunarity: 2, gain: 0.25 };
/// Standard deviation of each component of the gradient of that noise, per cell of its first octave.
const GRADIENT_DEVIATION: f64 = 0.51;
/// Batches of points that are worth a task, which take some ten microseconds each.
const MIN_BATCHES_PER_TASK: usize = 4;
/// Midpoint steps along a path line.
const STEPS: usize = 8;
/// Step of the differences by which the gradient is found, cells of the first octave.
const DIFFERENCE: f64 = 1.0 / 64.0;

/// The flow.
#[derive(Clone, Debug)]
pub(super) struct Swirls {
    parameters: SwirlParameters,
    stream_function: Noise<3>,
}

impl Swirls {
    /// `None` if nothing is displaced.
    pub(super) fn new(aurora: &AuroraParameters, key: Key) -> Option<Self> {
        let parameters = aurora.swirls.clone();
        let [seed, ..] = key.words(0, 0, Purpose::named("aurora swirls"));
        let stream_function = Noise::new(seed, FRACTAL, [0; 3]).expect("three octaves without a period are noise");
        (parameters.displacement_km > 0.0).then_some(Self { parameters, stream_function })
    }

    /// Carries points, km, by the flow at a time.
    pub(super) fn carry_all(&self, points: &mut [DVec2], time: f64) {
        let level = bansho_base::math::simd::level();
        points.par_chunks_mut(LANES).with_min_len(MIN_BATCHES_PER_TASK).for_each(|points| {
            let mut batch = [DVec2::ZERO; LANES];
            batch[..points.len()].copy_from_slice(points);
            dispatch!(level, _simd => self.carry(&mut batch, time));
            points.copy_from_slice(&batch[..points.len()]);
        });
    }

    /// Carries sixteen points, km, by the flow at a time.
    #[inline(always)]
    fn carry(&self, points: &mut [DVec2; LANES], time: f64) {
        let SwirlParameters { size_km, drift_km_per_s, lifetime_s, displacement_km } = self.parameters;
        let drift = DVec2::new(drift_km_per_s * time, 0.0);
        let age = Coordinate::from_f64(time / lifetime_s);
        // In cells of the first octave, from here on.
        let step = displacement_km / size_km / STEPS as f64;
        for point in &mut *points {
            *point = (*point - drift) / size_km;
        }
        for _ in 0..STEPS {
            let mut middles = *points;
            let velocities = self.velocities(points, age);
            for i in 0..LANES {
                middles[i] += 0.5 * step * velocities[i];
            }
            let velocities = self.velocities(&middles, age);
            for i in 0..LANES {
                points[i] += step * velocities[i];
            }
        }
        for point in points {
            *point = *point * size_km + drift;
        }
    }

    /// Velocities of mean square 1 at points in cells: the stream function's gradient, turned by a right angle.
    #[inline(always)]
    fn velocities(&self, points: &[DVec2; LANES], age: Coordinate) -> [DVec2; LANES] {
        let east = self.stream_function_beside(points, DVec2::new(DIFFERENCE, 0.0), age);
        let west = self.stream_function_beside(points, DVec2::new(-DIFFERENCE, 0.0), age);
        let south = self.stream_function_beside(points, DVec2::new(0.0, DIFFERENCE), age);
        let north = self.stream_function_beside(points, DVec2::new(0.0, -DIFFERENCE), age);
        let scale = 0.5 / DIFFERENCE / (GRADIENT_DEVIATION * std::f64::consts::SQRT_2);
        let mut velocities = [DVec2::ZERO; LANES];
        for i in 0..LANES {
            velocities[i] = DVec2::new(f64::from(south[i] - north[i]), f64::from(west[i] - east[i])) * scale;
        }
        velocities
    }

    /// The stream function at points in cells, each moved by an offset.
    #[inline(always)]
    fn stream_function_beside(&self, points: &[DVec2; LANES], offset: DVec2, age: Coordinate) -> [f32; LANES] {
        let (mut cells, mut fractions) = ([[age.cell; LANES]; 3], [[age.fraction; LANES]; 3]);
        for i in 0..LANES {
            let point = points[i] + offset;
            let [x, y] = [Coordinate::from_f64(point.x), Coordinate::from_f64(point.y)];
            (cells[0][i], cells[1][i]) = (x.cell, y.cell);
            (fractions[0][i], fractions[1][i]) = (x.fraction, y.fraction);
        }
        self.stream_function.lanes(&cells, &fractions)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn swirls(displacement_km: f64) -> Swirls {
        let parameters = SwirlParameters { displacement_km, ..SwirlParameters::default() };
        let aurora = AuroraParameters { swirls: parameters, ..AuroraParameters::default() };
        Swirls::new(&aurora, Key::new(4, "swirls")).expect("it displaces")
    }

    fn carried(swirls: &Swirls, point: DVec2, time: f64) -> DVec2 {
        let mut points = [point];
        swirls.carry_all(&mut points, time);
        points[0]
    }

    /// Points of a square grid with a spacing in km.
    fn grid(count: usize, spacing: f64) -> impl Iterator<Item = DVec2> {
        (0..count * count).map(move |index| DVec2::new((index % count) as f64, (index / count) as f64) * spacing)
    }

    #[test]
    fn velocity_has_the_mean_square_that_the_displacement_is_scaled_by() {
        let swirls = swirls(30.0);
        let age = Coordinate::from_f64(0.3);
        let squares: Vec<f64> =
            grid(100, 0.37).map(|point| swirls.velocities(&[point; LANES], age)[0].length_squared()).collect();
        let mean = squares.iter().sum::<f64>() / squares.len() as f64;
        assert!((mean - 1.0).abs() < 0.05, "{mean}");
    }

    /// The Jacobian determinant of the displacement is 1 everywhere, to the order of the steps: nothing folds over, so sheets cannot cross.
    #[test]
    fn areas_are_kept_so_that_sheets_do_not_cross() {
        let swirls = swirls(30.0);
        let step = 0.5;
        for point in grid(40, 23.0) {
            let [right, left, down, up] = [[step, 0.0], [-step, 0.0], [0.0, step], [0.0, -step]]
                .map(|offset| carried(&swirls, point + DVec2::from(offset), 5.0));
            let area = (right - left).perp_dot(down - up) / (4.0 * step * step);
            assert!((area - 1.0).abs() < 0.1, "{area} at {point}");
        }
    }

    #[test]
    fn points_are_carried_alike_in_any_company() {
        let swirls = swirls(30.0);
        let mut all: Vec<DVec2> = grid(9, 17.0).collect();
        swirls.carry_all(&mut all, 3.0);
        for (point, together) in grid(9, 17.0).zip(all) {
            assert_eq!(carried(&swirls, point, 3.0), together);
        }
    }

    #[test]
    fn the_flow_drifts_as_fast_as_told() {
        let parameters = SwirlParameters { drift_km_per_s: 2.0, lifetime_s: 1e5, ..SwirlParameters::default() };
        let aurora = AuroraParameters { swirls: parameters, ..AuroraParameters::default() };
        let swirls = Swirls::new(&aurora, Key::new(4, "swirls")).expect("it displaces by default");
        for point in grid(10, 31.0) {
            let drifted = carried(&swirls, point + DVec2::X * 8.0, 4.0) - carried(&swirls, point, 0.0);
            assert!((drifted - DVec2::X * 8.0).length() < 0.05, "{drifted}");
        }
    }
}
