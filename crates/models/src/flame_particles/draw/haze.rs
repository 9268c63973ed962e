//! Heat haze: hot gas has a lower index of refraction, and light bends toward the denser air.

use bansho_base::{
    canvas::{Strip, View},
    image::{Image, Rect},
};
use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use super::{
    gas::Gas,
    grid::{Grid, weigh},
    kernel::Profile,
    look::LookParameters,
    measure::DEFLECTION,
    prepared::AT_ONCE,
    splat::{FINE, Sheet, Sprite, splat},
    sprite::seen,
};

/// n - 1 of air at [`REFERENCE_K`] and atmospheric pressure; it falls with 1/T (Gladstone & Dale).
const REFRACTIVITY: f64 = 2.72e-4;
const REFERENCE_K: f64 = 293.15;

/// Refractivity n - 1 of air and of the gases of a flame at a temperature.
pub(crate) fn refractivity(temperature_k: f64) -> f64 {
    REFRACTIVITY * REFERENCE_K / temperature_k.max(1.0)
}

/// The angles by which the gas bends what lies behind it.
pub(crate) struct Haze {
    pub(crate) rect: Rect,
    pub(crate) angle: Image<2>,
}

impl Haze {
    /// `None` where nothing bends.
    pub(crate) fn new(gas: &Gas, look: &LookParameters, view: &View) -> Option<Self> {
        if look.haze_gain <= 0.0 {
            return None;
        }
        let air = refractivity(gas.air_temperature_k);
        let excess = |index: usize| refractivity(f64::from(gas.particles.temperature[index])) - air;
        let shown = seen(gas, view, |index| excess(index) != 0.0);
        // Path lengths, in units of the picture's pixels: their gradient is an angle.
        let sprite = |seen: &super::sprite::Seen| {
            let path = look.haze_gain * excess(seen.index) * gas.volume(seen.index) * f64::from(seen.ellipse.peak);
            Sprite { ellipse: seen.ellipse, layer: 0, split: 0.0, values: [(path * f64::from(seen.scale)) as f32] }
        };
        let sprites: Vec<Sprite<1>> = shown.par_iter().with_min_len(AT_ONCE).map(sprite).collect();
        let grid =
            splat(&Sheet { profile: Profile::LINE, least_radius: FINE, layers: 1, window: view.window }, &sprites)?;
        Some(Self::from_paths(&grid, view.window))
    }

    /// The gradient of the summed paths at every pixel: to the right and upward.
    fn from_paths(grid: &Grid, window: Rect) -> Self {
        let rect = grid.covered().intersection(&window);
        let mut angle = Image::filled(rect.width, rect.height, [0.0; 2]);
        let (values, slopes) = (grid.cells.weights(), grid.cells.slope_weights());
        let level = Level::new();
        angle.pixels_mut().par_chunks_mut(rect.width).enumerate().for_each(|(row, out)| {
            let row = Row { grid, values: &values, slopes: &slopes, x: rect.x, y: rect.y + row };
            dispatch!(level, _simd => row.gradient(out));
        });
        Self { rect, angle }
    }

    /// Adds the angles to the AOVs of a strip.
    pub(crate) fn measure(&self, strip: &mut Strip) {
        let rect = self.rect.intersection(&strip.rect);
        for y in rect.y..rect.bottom() {
            for x in rect.x..rect.right() {
                let index = (y - strip.rect.y) * strip.rect.width + x - strip.rect.x;
                let angle = self.angle.at(x - self.rect.x, y - self.rect.y);
                for (plane, value) in DEFLECTION.into_iter().zip(angle) {
                    strip.aovs[plane].add(index, value, 1.0);
                }
            }
        }
    }
}

/// A row of pixels over summed paths.
struct Row<'a> {
    grid: &'a Grid,
    values: &'a [[f32; 4]],
    slopes: &'a [[f32; 4]],
    x: usize,
    y: usize,
}

impl Row<'_> {
    #[inline(always)]
    fn gradient(&self, out: &mut [[f32; 2]]) {
        let cells = &self.grid.cells;
        let (cell, phase) = cells.before(1, self.y);
        let rows = [-1, 0, 1, 2].map(|k| self.grid.row(cell + k));
        let (mut level, mut steep) = (vec![0.0; cells.columns], vec![0.0; cells.columns]);
        weigh(&mut level, rows, &self.values[phase]);
        weigh(&mut steep, rows, &self.slopes[phase]);
        for (index, angle) in out.iter_mut().enumerate() {
            let (cell, phase) = cells.before(0, self.x + index);
            let first = self.grid.first_of_four(cell);
            let (along, across) = (&self.slopes[phase], &self.values[phase]);
            let (mut right, mut down) = (0.0_f32, 0.0_f32);
            for k in 0..4 {
                right = along[k].mul_add(level[first + k], right);
                down = across[k].mul_add(steep[first + k], down);
            }
            // Rows count downward, angles upward.
            *angle = [right, -down];
        }
    }
}
