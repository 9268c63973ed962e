//! Heat haze: the angle by which hot gas deflects light from behind, the gradient of its optical path.

use bansho_base::{
    host::parallel::prelude::*,
    image::{Image, Rect},
    math::{self, DVec2, DVec3},
    phenomenon::strip::View,
};
use fearless_simd::{Simd, dispatch};

use super::{blocks::BlockContents, field::GasField, rays::Ray};
use crate::{particles::render::refractivity, volume::fuel::Mixture};

/// Side of a cell of the picture in which one path is computed, pixels.
const CELL: usize = 4;

/// Deflection angles of the light from behind the gas.
pub(crate) struct HeatHaze {
    pub(crate) rect: Rect,
    pub(crate) angle: Image<2>,
    /// Depth of the far side of the gas, m.
    pub(crate) depth: f64,
}

/// Gas, and how strongly it refracts.
pub(crate) struct Refraction<'a> {
    pub(crate) field: &'a GasField,
    pub(crate) mixture: Mixture,
    pub(crate) gain: f64,
    /// Interval of depth of the gas, m.
    pub(crate) depths: [f64; 2],
}

impl HeatHaze {
    /// The deflection in `rect` of a picture; `None` if there is none.
    pub(crate) fn new(refraction: &Refraction, view: &View, rect: Rect) -> Option<Self> {
        // Cells are those of the whole picture, so that a crop has the same.
        let (first_column, first_row) = (rect.x / CELL, rect.y / CELL);
        let columns = rect.right().div_ceil(CELL) - first_column + 3;
        let rows = rect.bottom().div_ceil(CELL) - first_row + 3;
        if refraction.gain <= 0.0 || rect.is_empty() {
            return None;
        }
        let paths: Vec<f32> = (0..columns * rows)
            .into_par_iter()
            .map(|index| {
                let place = |cell: usize, first: usize| ((first + cell) as f64 - 1.0) * CELL as f64;
                let pixel = DVec2::new(place(index % columns, first_column), place(index / columns, first_row));
                dispatch!(math::simd::level(), simd => refraction.path_pixels(simd, view, pixel))
            })
            .collect();
        if paths.iter().all(|path| *path == 0.0) {
            return None;
        }
        let mut angle = Image::filled(rect.width, rect.height, [0.0; 2]);
        angle.pixels_mut().par_chunks_mut(rect.width).enumerate().for_each(|(y, angles)| {
            for (x, angle) in angles.iter_mut().enumerate() {
                let (column, across) = cell_of(rect.x + x - first_column * CELL);
                let (row, down) = cell_of(rect.y + y - first_row * CELL);
                // Values and slopes of the quadratic B-spline of three cells.
                let [values_x, values_y] = [across, down].map(spline);
                let [slopes_x, slopes_y] = [across, down].map(spline_slope);
                let mut gradient = [0.0; 2];
                for j in 0..3 {
                    for i in 0..3 {
                        let path = paths[(row + j) * columns + column + i];
                        gradient[0] += path * slopes_x[i] * values_y[j];
                        gradient[1] -= path * values_x[i] * slopes_y[j];
                    }
                }
                *angle = gradient.map(|slope| slope / CELL as f32);
            }
        });
        Some(Self { rect, angle, depth: refraction.depths[1] })
    }
}

/// The first of the three cells whose spline a pixel is in, and its place in the middle one, -0.5 to 0.5.
fn cell_of(pixel: usize) -> (usize, f32) {
    let place = (pixel as f32 + 0.5) / CELL as f32 + 1.0;
    let nearest = (place + 0.5) as usize;
    (nearest - 1, place - nearest as f32)
}

fn spline(t: f32) -> [f32; 3] {
    [0.5 * (0.5 - t) * (0.5 - t), 0.75 - t * t, 0.5 * (0.5 + t) * (0.5 + t)]
}

fn spline_slope(t: f32) -> [f32; 3] {
    [t - 0.5, -2.0 * t, t + 0.5]
}

impl Refraction<'_> {
    /// Difference of the optical path to that through air, in pixels at the depth of the gas.
    #[inline(always)]
    fn path_pixels<S: Simd>(&self, simd: S, view: &View, pixel: DVec2) -> f32 {
        let Some(direction) = view.camera.direction(pixel) else { return 0.0 };
        let Some([low, high]) = self.field.seen_corners() else { return 0.0 };
        let ray = Ray::new(self.field, view.camera.position, direction);
        let corner = |point: DVec3| self.field.point_in_grid(point);
        let Some([near, far]) = ray.clipped(corner(low), corner(high), self.depths) else { return 0.0 };
        let step = 2.0 * self.field.grid.spacing / direction.length();
        let air = refractivity(f64::from(self.mixture.air_temperature_k));
        let (mut sum, mut number) = (0.0, (near / step).ceil());
        while number * step < far {
            let place = ray.at(number * step);
            number += 1.0;
            if self.field.blocks.at(place) == BlockContents::Nothing {
                continue;
            }
            let [mixture, deficit] = self.field.gas(simd, place);
            if mixture > 1e-3 {
                let kelvin = self.mixture.temperature_k(mixture, deficit);
                sum += refractivity(f64::from(kelvin)) - air;
            }
        }
        let middle = 0.5 * (near + far);
        let pixels_per_meter = view.camera.focal_pixels / middle.max(view.camera.near);
        (self.gain * sum * step * direction.length() * pixels_per_meter) as f32
    }
}
