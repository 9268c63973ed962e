//! Radiance of the night sky by direction, without its stars.

use std::sync::Arc;

use bansho_base::{
    camera::directions::Directions,
    color,
    host::{once::LastValue, parallel::prelude::*},
    math::{
        self, DVec3,
        simd::{FourLanes, LANES, Real},
    },
    world::sky::{Night, Sky, SkyObserver, TownGlow},
};
use fearless_simd::prelude::*;

use super::stars;

/// Steps of elevation from the horizon to the zenith, uniform in the square root of the sine above that of the horizon.
const ELEVATION_STEPS: usize = 512;
/// Steps of the town's glow: of elevation, spaced as those above, and of the sine of half the difference of azimuth to the town.
const TOWN_STEPS: [usize; 2] = [96, 96];
/// Luminance of the Milky Way's center line, cd/m^2, its width in sines, and its color temperature, K.
const MILKY_WAY_LUMINANCE: f64 = 1.6e-4;
const MILKY_WAY_WIDTH: f64 = 0.14;
const MILKY_WAY_K: f32 = 5200.0;

/// The night sky, tabulated by elevation.
pub(crate) struct NightSky {
    almucantars: Vec<Almucantar>,
    /// Radiance below the horizon.
    ground: [f32; 4],
    /// Sine of the elevation of the horizon, and one over the range of sines above it.
    horizon: f32,
    per_range: f32,
    /// Unit vectors toward the sun (below the horizon) and to the galactic pole.
    sunward: [f32; 3],
    pole: [f32; 3],
    town: Option<TownTable>,
}

/// Rows of elevations, from the horizon up.
type TownLuminances = Vec<[f32; TOWN_STEPS[1] + 1]>;

/// Luminance of a town's glow, cd/m^2.
struct TownTable {
    luminances: Arc<TownLuminances>,
    color: [f32; 4],
    /// Horizontal unit vector toward the town.
    toward: [f32; 3],
}

/// The directions of one elevation; colors are red, green, blue and 0.
struct Almucantar {
    /// Radiance that does not depend on the azimuth.
    even: [f32; 4],
    /// Coefficients of the twilight glow: of the fourth power of the alignment with the sun's azimuth, and of the alignment.
    glow: [f32; 4],
    blue: [f32; 4],
    /// The Milky Way's center line.
    milky_way: [f32; 4],
}

fn with_zero([red, green, blue]: [f32; 3]) -> [f32; 4] {
    [red, green, blue, 0.0]
}

impl NightSky {
    /// The sky of an observer, with the night that is [above](Night::above) him.
    pub(crate) fn new(sky: &Sky, night: &Night, milky_way: f64, observer: SkyObserver) -> Self {
        let color = color::black_body().radiance(MILKY_WAY_K);
        let scale = milky_way * MILKY_WAY_LUMINANCE / f64::from(color::luminance(color));
        let horizon = observer.horizon_sine();
        let mut almucantars = Vec::with_capacity(ELEVATION_STEPS + 1);
        for step in 0..=ELEVATION_STEPS {
            let root = step as f64 / ELEVATION_STEPS as f64;
            let elevation = math::asin((1.0 - horizon).mul_add(root * root, horizon));
            let dimmed = (scale * night.transmittance(elevation)) as f32;
            let [even, glow, blue] = night.almucantar_of(elevation, observer).terms().map(with_zero);
            almucantars.push(Almucantar { even, glow, blue, milky_way: with_zero(color.map(|value| value * dimmed)) });
        }
        Self {
            almucantars,
            ground: with_zero(sky.radiance(-DVec3::Y)),
            horizon: horizon as f32,
            per_range: (1.0 / (1.0 - horizon)) as f32,
            sunward: night.sunward().as_vec3().to_array(),
            pole: stars::galactic_pole().as_vec3().to_array(),
            town: TownTable::new(night),
        }
    }

    /// Radiance in the directions of unit vectors.
    #[inline(always)]
    pub(crate) fn radiance<S: Simd>(&self, simd: S, directions: &Directions) -> [[f32; 4]; LANES] {
        let mut colors = self.natural_radiance(simd, directions);
        let Some(town) = &self.town else { return colors };
        let [xs, ys, zs] = &directions.components;
        for i in 0..LANES {
            if ys[i] >= self.horizon {
                let glow = town.luminance([xs[i], ys[i], zs[i]]);
                for c in 0..3 {
                    colors[i][c] = glow.fma(town.color[c], colors[i][c]);
                }
            }
        }
        colors
    }

    /// Radiance without the town's glow.
    #[inline(always)]
    pub(super) fn natural_radiance<S: Simd>(&self, simd: S, directions: &Directions) -> [[f32; 4]; LANES] {
        let [xs, ys, zs] = &directions.components;
        let (mut steps, mut toward, mut milky_way_weights) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for i in 0..LANES {
            let above = (ys[i] - self.horizon) * self.per_range;
            let sine = if above > 0.0 { above } else { 0.0 };
            steps[i] = sine.sqrt().fma(ELEVATION_STEPS as f32, 0.5);
            let level = xs[i].fma(xs[i], zs[i] * zs[i]);
            let turned = xs[i].fma(self.sunward[0], zs[i] * self.sunward[2]) / level.sqrt().max(1e-9);
            toward[i] = turned.fma(0.5, 0.5);
            let height = self.pole[0].fma(xs[i], self.pole[1].fma(ys[i], self.pole[2] * zs[i]));
            let across = height * (1.0 / MILKY_WAY_WIDTH) as f32;
            let squared = across * across;
            // A band with soft edges and long tails.
            milky_way_weights[i] = 1.0 / squared.fma(squared, 1.0);
        }
        let mut colors = [self.ground; LANES];
        for i in 0..LANES {
            if ys[i] >= self.horizon {
                let almucantar = &self.almucantars[(steps[i] as usize).min(ELEVATION_STEPS)];
                colors[i] = almucantar.radiance(simd, toward[i], milky_way_weights[i]);
            }
        }
        colors
    }
}

/// The table of a town's glow. That of the town before is kept: it takes tens of milliseconds, and all views and frames of a scene have the same.
fn town_luminances(glow: &TownGlow) -> Arc<TownLuminances> {
    static LAST: LastValue<TownGlow, TownLuminances> = LastValue::new();
    LAST.get_or_compute(*glow, || {
        let mut luminances = vec![[0.0; TOWN_STEPS[1] + 1]; TOWN_STEPS[0] + 1];
        luminances.par_iter_mut().enumerate().for_each(|(row, luminances)| {
            let root = row as f64 / TOWN_STEPS[0] as f64;
            let elevation = math::asin(root * root);
            for (column, luminance) in luminances.iter_mut().enumerate() {
                let half_sine = column as f64 / TOWN_STEPS[1] as f64;
                *luminance = glow.luminance(elevation, 1.0 - 2.0 * half_sine * half_sine) as f32;
            }
        });
        luminances
    })
}

impl TownTable {
    /// `None` without a town.
    fn new(night: &Night) -> Option<Self> {
        let glow = night.town.as_ref()?;
        let toward = night.townward().as_vec3().to_array();
        Some(Self { luminances: town_luminances(glow), color: with_zero(night.town_color()), toward })
    }

    /// Luminance from the direction of a unit vector, linear between steps.
    #[inline(always)]
    fn luminance(&self, [x, y, z]: [f32; 3]) -> f32 {
        let level = x.fma(x, z * z).sqrt().max(1e-9);
        let azimuth_cosine = x.fma(self.toward[0], z * self.toward[2]) / level;
        let half_sine = azimuth_cosine.fma(-0.5, 0.5).clamp(0.0, 1.0).sqrt();
        let [row, column] = [y.clamp(0.0, 1.0).sqrt() * TOWN_STEPS[0] as f32, half_sine * TOWN_STEPS[1] as f32];
        let [first_row, first_column] =
            [(row as usize).min(TOWN_STEPS[0] - 1), (column as usize).min(TOWN_STEPS[1] - 1)];
        let [down, across] = [row - first_row as f32, column - first_column as f32];
        let mut rows = [0.0; 2];
        for (row, luminance) in rows.iter_mut().enumerate() {
            let luminances = &self.luminances[first_row + row];
            let [before, after] = [luminances[first_column], luminances[first_column + 1]];
            *luminance = across.fma(after - before, before);
        }
        down.fma(rows[1] - rows[0], rows[0])
    }
}

impl Almucantar {
    /// Radiance at an alignment with the sun's azimuth, 0 to 1, and a weight of the Milky Way.
    #[inline(always)]
    fn radiance<S: Simd>(&self, simd: S, toward: f32, milky_way_weight: f32) -> [f32; 4] {
        let squared = toward * toward;
        let mut sum = FourLanes::simd_from(simd, self.even);
        sum = FourLanes::simd_from(simd, self.blue).fma(sum.broadcast(toward), sum);
        sum = FourLanes::simd_from(simd, self.glow).fma(sum.broadcast(squared * squared), sum);
        FourLanes::simd_from(simd, self.milky_way).fma(sum.broadcast(milky_way_weight), sum).into()
    }
}
