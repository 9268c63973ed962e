//! Heat haze: hot gas has a lower index of refraction, and light bends toward the denser air.

use bansho_base::{
    image::{Image, Rect},
    phenomenon::strip::{Strip, View},
};

use super::{aovs::DEFLECTION, gas::Gas, gas_statistics::shows};
use crate::particles::{
    look_parameters::LookParameters,
    render::{
        project::sprite::{Kind, Seen, seen},
        resolve::{
            resolve_gas::{PATH, PLANES},
            spline,
        },
        splat::{
            accumulate::{COARSE, Sheet, Sprite, splat},
            grid::{Grid, weigh},
            kernel::Profile,
        },
    },
};
use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

/// n - 1 of air at [`REFERENCE_K`] and atmospheric pressure; it falls with 1/T (Gladstone & Dale).
const REFRACTIVITY: f64 = 2.72e-4;
const REFERENCE_K: f64 = 293.15;

/// Refractivity n - 1 of air and of the gases of a flame at a temperature.
#[inline(always)]
pub(crate) fn refractivity(temperature_k: f64) -> f64 {
    REFRACTIVITY * REFERENCE_K / temperature_k.max(1.0)
}

/// The angles by which the gas bends what lies behind it.
pub(crate) struct Haze {
    pub(crate) rect: Rect,
    pub(crate) angle: Image<2>,
}

/// By how much the gas of a particle is optically shorter than air along a ray through its middle, in the picture's pixels there: the
/// gradient of summed paths is an angle.
#[inline(always)]
pub(crate) fn path(gas: &Gas, look: &LookParameters, seen: &Seen) -> f32 {
    let excess = excess(gas, seen.index);
    let length = look.haze_gain * excess * gas.volume(seen.index) * f64::from(seen.ellipse.peak);
    (length * f64::from(seen.scale)) as f32
}

/// Refractivity of a particle's gas beside that of the air around.
#[inline(always)]
fn excess(gas: &Gas, index: usize) -> f64 {
    refractivity(f64::from(gas.particles.temperature[index])) - refractivity(gas.air_temperature_k)
}

/// The gas that only bends, or all of it, as sprites of its paths.
struct Rest<'a> {
    gas: &'a Gas<'a>,
    look: &'a LookParameters,
    all: bool,
}

impl Kind for Rest<'_> {
    type Record = Sprite<1>;

    #[inline(always)]
    fn wants(&self, index: usize) -> bool {
        (self.all || !shows(self.gas, self.look, index)) && excess(self.gas, index) != 0.0
    }

    #[inline(always)]
    fn record(&self, seen: &Seen) -> Sprite<1> {
        Sprite { ellipse: seen.ellipse, layer: 0, split: 0.0, values: [path(self.gas, self.look, seen)] }
    }
}

impl Haze {
    /// `None` where nothing bends.
    ///
    /// `summed` holds the paths of the gas that shows, as far as the window sees it; only those of the rest are summed here, and `all` where
    /// the whole picture shows none.
    pub(crate) fn new(
        gas: &Gas,
        look: &LookParameters,
        view: &View,
        summed: Option<&Grid<'_>>,
        all: bool,
    ) -> Option<Self> {
        if look.haze_gain <= 0.0 {
            return None;
        }
        let sheet =
            Sheet { profile: Profile::LINE, least_radius: COARSE, layers: 1, picture: view.size, window: view.window };
        let rest = splat(&sheet, &seen(gas, view, &Rest { gas, look, all }), gas.memory).sums();
        let paths: Vec<Paths> = [(summed, PATH, PLANES), (rest.as_ref(), 0, 1)]
            .into_iter()
            .filter_map(|(grid, plane, planes)| Some(Paths::new(grid?, plane, planes)))
            .collect();
        Self::from_paths(&paths, view.window)
    }

    /// The gradient of the summed paths at every pixel: to the right and upward.
    fn from_paths(paths: &[Paths], window: Rect) -> Option<Self> {
        let covered = paths.iter().map(|paths| paths.sums.covered().intersection(&window));
        let rect = covered.reduce(|all, own| all.union(&own))?;
        let mut angle = Image::filled(rect.width, rect.height, [0.0; 2]);
        let level = Level::new();
        // Beyond its own cells a grid holds nothing.
        let parts = paths.iter().map(|paths| {
            let own = paths.sums.covered().intersection(&rect);
            (paths, own, paths.sums.columns(own.x, own.width))
        });
        let parts: Vec<_> = parts.collect();
        angle.pixels_mut().par_chunks_mut(rect.width.max(1)).enumerate().for_each(|(row, out)| {
            let y = rect.y + row;
            for (paths, own, columns) in parts.iter().filter(|(_, own, _)| (own.y..own.bottom()).contains(&y)) {
                let out = &mut out[own.x - rect.x..][..own.width];
                dispatch!(level, _simd => paths.add_gradient(columns, y, out));
            }
        });
        Some(Self { rect, angle })
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

/// Summed paths, whose slopes are angles.
struct Paths<'a> {
    sums: Grid<'a>,
    weights: Vec<[f32; 4]>,
    slopes: Vec<[f32; 4]>,
}

impl<'a> Paths<'a> {
    fn new(grid: &Grid<'a>, plane: usize, planes: usize) -> Self {
        Self {
            sums: grid.one_plane(plane, planes),
            weights: spline::weights(&grid.cells),
            slopes: spline::slopes(&grid.cells),
        }
    }

    /// Adds the gradient at row `y` of pixels that lie among `columns`.
    #[inline(always)]
    fn add_gradient(&self, columns: &[(usize, usize)], y: usize, out: &mut [[f32; 2]]) {
        let cells = &self.sums.cells;
        let (cell, phase) = cells.before(1, y);
        let rows = [-1, 0, 1, 2].map(|k| self.sums.row(cell + k));
        let (mut level, mut steep) = (vec![0.0; cells.columns], vec![0.0; cells.columns]);
        weigh(&mut level, rows, &self.weights[phase]);
        weigh(&mut steep, rows, &self.slopes[phase]);
        for (angle, &(first, phase)) in out.iter_mut().zip(columns) {
            let (along, across) = (&self.slopes[phase], &self.weights[phase]);
            let (mut right, mut down) = (0.0_f32, 0.0_f32);
            for k in 0..4 {
                right = along[k].mul_add(level[first + k], right);
                down = across[k].mul_add(steep[first + k], down);
            }
            // Rows count downward, angles upward.
            *angle = [angle[0] + right, angle[1] - down];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Refractive index of air at many temperatures (Ciddor 1996).
    const REFERENCE: &str = include_str!("../data/air_index.csv");

    #[test]
    fn refractivity_is_that_of_air_at_every_temperature() {
        let rows: Vec<Vec<f64>> = REFERENCE
            .lines()
            .skip(1)
            .map(|line| line.split(',').map(|value| value.parse().unwrap()).collect())
            .collect();
        assert_eq!(rows.len(), 16);
        for row in rows {
            // The sodium line, and green light, of which eyes see most.
            for (column, allowed) in [(2, 2e-3), (6, 5e-3)] {
                let off = refractivity(row[0]) / row[column] - 1.0;
                assert!(off.abs() < allowed, "{off} off at {} K", row[0]);
            }
        }
    }
}
