//! Patterns of brightness and energy along the sheets: rays, black rays, pulsation.

use bansho_base::{
    math::{
        approximations,
        random::{Key, Purpose},
    },
    noise::{Coordinate, Fractal, LANES, MAX_OCTAVES, Noise},
};
use fearless_simd::{Level, dispatch};

use super::nodes::split;
use crate::{AuroraParameters, PulsationParameters, RayParameters};

/// Octaves of a group of four rays: the group, pairs and rays.
const GROUP_OCTAVES: u32 = 3;
/// Table nodes per cell of the finest octave: linear interpolation is then accurate to a hundredth.
const NODES_PER_CELL: f64 = 12.0;
/// Maximum table nodes per particle: finer rays are not resolved by particles.
const NODES_PER_PARTICLE: f64 = 0.5;
/// Stretching of the coordinate relative to arc length at which rays start to fade and have vanished: they would be
/// compressed or discontinuous.
const FADE_START_STRETCH: f64 = 1.5;
const FADE_END_STRETCH: f64 = 3.0;
/// Width of a black ray relative to their distance.
const BLACK_WIDTH: f32 = 0.12;

/// The pattern generator.
#[derive(Clone, Debug)]
pub(crate) struct RayPattern {
    rays: RayParameters,
    pulsation: PulsationParameters,
    noise: [Noise<2>; 2],
    black: Noise<2>,
    patches: Noise<2>,
    /// Standard deviation of the noise, for normalization.
    deviation: f32,
    /// Length of a cell of the coarsest octave.
    coarsest_km: f64,
    /// Lifetime of its values.
    coarsest_lifetime_s: f64,
    max_nodes: f64,
}

/// Noise of the rays on both sides, of black rays and of patches.
type Noises = [f32; 4];

/// Tabulated noise along the sheets at one time: the cost depends on the detail of the sheets, not on the number of
/// particles.
pub(crate) struct RayTable {
    /// By sheet, uniformly spaced.
    sheets: Vec<Vec<Noises>>,
    /// By sheet, at the same places.
    places: Vec<Vec<SheetPlace>>,
}

/// Where patterns are on a sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SheetPlace {
    /// Coordinate along the sheet, km.
    pub(crate) along_km: f32,
    /// Strength of patterns: 0 where that coordinate is stretched or jumps.
    pub(crate) strength: f32,
}

/// Inputs for a batch of positions.
pub(crate) struct PatternInputs {
    /// The noises there.
    pub(crate) noises: [Noises; LANES],
    /// Lateral position, -1 to 1 within the thickness.
    pub(crate) side: [f32; LANES],
}

/// Pattern factors for a batch of positions.
pub(crate) struct PatternSample {
    /// Power factor before normalization.
    pub(crate) brightness: [f32; LANES],
    /// Power factor after normalization, which darkens the whole aurora.
    pub(crate) dimming: [f32; LANES],
    /// Factor of the energy.
    pub(crate) hardness: [f32; LANES],
}

impl RayPattern {
    pub(crate) fn new(parameters: &AuroraParameters, key: Key) -> Self {
        let [a, b, c, d] = key.words(0, 0, Purpose::named("aurora rays"));
        let fractal = ray_octaves(&parameters.rays);
        // The finest octave has a cell for each ray; times scale as lengths do.
        let coarsest_cells = f64::from(1_u32 << (fractal.octaves - 1));
        let groups = coarsest_cells / f64::from(1_u32 << (GROUP_OCTAVES - 1));
        Self {
            rays: parameters.rays.clone(),
            pulsation: parameters.pulsation.clone(),
            noise: [pattern_noise(a, fractal), pattern_noise(b, fractal)],
            black: pattern_noise(c, Fractal::SINGLE),
            patches: pattern_noise(d, Fractal::SINGLE),
            deviation: fractal.standard_deviation(2) as f32,
            coarsest_km: coarsest_cells * parameters.rays.spacing_km,
            coarsest_lifetime_s: groups * parameters.rays.lifetime_s,
            max_nodes: NODES_PER_PARTICLE * parameters.particles.count as f64,
        }
    }

    /// Tabulates the noise for sheets of these lengths in km; `arc_coordinates` returns the coordinate at equally
    /// spaced nodes of a sheet.
    pub(crate) fn table(
        &self,
        lengths: &[f64],
        arc_coordinates: impl Fn(usize, usize) -> Vec<f64>,
        time: f64,
    ) -> RayTable {
        let level = bansho_base::math::simd::level();
        let node = self.node_km().max(lengths.iter().sum::<f64>() / self.max_nodes);
        let (mut sheets, mut places) = (Vec::with_capacity(lengths.len()), Vec::with_capacity(lengths.len()));
        for (sheet, length) in lengths.iter().enumerate() {
            let last = (length / node).max(1.0).ceil();
            let coordinates = arc_coordinates(sheet, last as usize);
            let mut nodes = Vec::with_capacity(coordinates.len().next_multiple_of(LANES));
            for coordinates in coordinates.chunks(LANES) {
                let batch = std::array::from_fn(|lane| coordinates[lane.min(coordinates.len() - 1)]);
                let noises = self.noises(level, &batch, time);
                nodes.extend((0..coordinates.len()).map(|lane| noises.map(|values| values[lane])));
            }
            let strengths = pattern_strengths(&coordinates, length / last, self.rays.spacing_km);
            for ([left, right, ..], strength) in nodes.iter_mut().zip(&strengths) {
                *left *= strength;
                *right *= strength;
            }
            let along = coordinates.into_iter().zip(strengths);
            places.push(along.map(|(along, strength)| SheetPlace { along_km: along as f32, strength }).collect());
            sheets.push(nodes);
        }
        RayTable { sheets, places }
    }

    /// Node spacing for the finest requested pattern.
    fn node_km(&self) -> f64 {
        let patterns = [
            (self.rays.contrast.max(self.rays.energy_variation), self.rays.spacing_km),
            (self.rays.black_ray_depth, self.rays.black_ray_spacing_km),
            (self.pulsation.modulation_depth, self.pulsation.patch_length_km),
        ];
        let mut finest_km = f64::INFINITY;
        for (_, scale_km) in patterns.into_iter().filter(|(strength, _)| *strength > 0.0) {
            finest_km = finest_km.min(scale_km);
        }
        finest_km / NODES_PER_CELL
    }

    /// The pattern at sixteen positions.
    pub(crate) fn at(&self, level: Level, coordinates: &PatternInputs, time: f64) -> PatternSample {
        dispatch!(level, _simd => self.combined(coordinates, time))
    }

    #[inline(always)]
    fn combined(&self, coordinates: &PatternInputs, time: f64) -> PatternSample {
        let mut sample = PatternSample { brightness: [1.0; LANES], dimming: [1.0; LANES], hardness: [1.0; LANES] };
        for i in 0..LANES {
            let [left, right, black, patch] = coordinates.noises[i];
            let mixed = self.mixed([left, right], coordinates.side[i]);
            sample.brightness[i] = approximations::exp(self.rays.contrast as f32 * mixed);
            sample.hardness[i] = approximations::exp(self.rays.energy_variation as f32 * mixed);
            sample.dimming[i] = self.darkness(black) * self.pulse(patch, time);
        }
        sample
    }

    /// The noise at a lateral position, -1 to 1, with a standard deviation of 1.
    #[inline(always)]
    fn mixed(&self, [left, right]: [f32; 2], side: f32) -> f32 {
        let fraction = (0.5 + 0.5 * side).clamp(0.0, 1.0);
        // A blend of two independent patterns has less variance than one; normalized.
        let variance = fraction * fraction + (1.0 - fraction) * (1.0 - fraction);
        (left + fraction * (right - left)) / (self.deviation * variance.sqrt())
    }

    /// Mean power factor of the rays across a sheet, over a part of its length.
    pub(crate) fn mean_brightness(&self, table: &RayTable, sheet: usize, [from, to]: [f64; 2]) -> f64 {
        if self.rays.contrast <= 0.0 {
            return 1.0;
        }
        let nodes = &table.sheets[sheet];
        let last = (nodes.len() - 1) as f64;
        let [first, end] = [(from * last).round(), (to * last).round()].map(|node| node.clamp(0.0, last) as usize);
        let mut sum = 0.0;
        for [left, right, ..] in &nodes[first..=end.max(first)] {
            for (side, weight) in [(-1.0, 0.25), (0.0, 0.5), (1.0, 0.25)] {
                sum += weight * approximations::exp(self.rays.contrast as f32 * self.mixed([*left, *right], side));
            }
        }
        f64::from(sum) / (end.max(first) - first + 1) as f64
    }

    /// Noise of the rays on both sides, of black rays and of patches; 0 for disabled patterns.
    fn noises(&self, level: Level, coordinates: &[f64; LANES], time: f64) -> [[f32; LANES]; 4] {
        let rays = &self.rays;
        let (shift, age) = (rays.shear_km_per_s * time, time / self.coarsest_lifetime_s);
        // Black rays drift against the rays of one side.
        let [black, patch] = [rays.black_ray_spacing_km, self.pulsation.patch_length_km];
        let channels = [
            (rays.contrast.max(rays.energy_variation), &self.noise[0], shift, self.coarsest_km, age),
            (rays.contrast.max(rays.energy_variation), &self.noise[1], -shift, self.coarsest_km, age),
            (rays.black_ray_depth, &self.black, -shift, black, time / rays.lifetime_s),
            (self.pulsation.modulation_depth, &self.patches, 0.0, patch, 0.0),
        ];
        channels.map(|(strength, noise, shift, scale, age)| {
            if strength > 0.0 {
                values(level, noise, coordinates.map(|coordinate| (coordinate - shift) / scale), age)
            } else {
                [0.0; LANES]
            }
        })
    }

    /// Black rays are the zero crossings of a noise.
    #[inline(always)]
    fn darkness(&self, noise: f32) -> f32 {
        let depth = (1.0 - (noise / BLACK_WIDTH).abs()).max(0.0);
        1.0 - self.rays.black_ray_depth as f32 * depth.sqrt()
    }

    /// Patches pulsate with independent phases.
    #[inline(always)]
    fn pulse(&self, noise: f32, time: f64) -> f32 {
        let turns = time / self.pulsation.period_s;
        let turns = (turns - turns.floor()) as f32;
        let dark = 0.5 - 0.5 * approximations::cos_turns(turns + 2.0 * noise);
        1.0 - self.pulsation.modulation_depth as f32 * dark
    }
}

/// Octaves from the outer scale down to single rays.
fn ray_octaves(rays: &RayParameters) -> Fractal {
    let mut octaves = 1;
    while octaves < MAX_OCTAVES && f64::from(1_u32 << octaves) * rays.spacing_km < 1.5 * rays.outer_scale_km {
        octaves += 1;
    }
    Fractal { octaves, lacunarity: 2, gain: rays.octave_gain as f32 }
}

/// Noise of a pattern along the sheets and in time.
fn pattern_noise(seed: u32, fractal: Fractal) -> Noise<2> {
    Noise::new(seed, fractal, [0; 2]).expect("few octaves without a period are noise")
}

/// Strengths of patterns at nodes that are `spacing` km apart: they fade where the coordinate is stretched or discontinuous, over `scale` km on both
/// sides.
fn pattern_strengths(coordinates: &[f64], spacing: f64, scale: f64) -> Vec<f32> {
    let mut strengths = vec![1.0_f64; coordinates.len()];
    for (node, pair) in coordinates.windows(2).enumerate() {
        let speed = (pair[1] - pair[0]).abs() / spacing.max(f64::MIN_POSITIVE);
        let strength = ((FADE_END_STRETCH - speed) / (FADE_END_STRETCH - FADE_START_STRETCH)).clamp(0.0, 1.0);
        for end in [node, node + 1] {
            strengths[end] = strengths[end].min(strength);
        }
    }
    let rise = spacing / scale;
    for node in 1..strengths.len() {
        strengths[node] = strengths[node].min(strengths[node - 1] + rise);
    }
    for node in (1..strengths.len()).rev() {
        strengths[node - 1] = strengths[node - 1].min(strengths[node] + rise);
    }
    strengths.into_iter().map(|strength| strength as f32).collect()
}

impl RayTable {
    /// The noises at a fraction of a sheet's length.
    #[inline]
    pub(crate) fn at(&self, sheet: u32, fraction: f64) -> Noises {
        let nodes = &self.sheets[sheet as usize];
        let (node, t) = split(fraction, nodes.len());
        let (low, high, t) = (&nodes[node], &nodes[node + 1], t as f32);
        let mut noises = [0.0; 4];
        for k in 0..4 {
            noises[k] = low[k] + t * (high[k] - low[k]);
        }
        noises
    }

    /// The place at a fraction of a sheet's length.
    #[inline]
    pub(crate) fn place(&self, sheet: u32, fraction: f64) -> SheetPlace {
        let nodes = &self.places[sheet as usize];
        let (node, t) = split(fraction, nodes.len());
        let (low, high, t) = (nodes[node], nodes[node + 1], t as f32);
        SheetPlace {
            along_km: low.along_km + t * (high.along_km - low.along_km),
            strength: low.strength + t * (high.strength - low.strength),
        }
    }
}

/// Noise for a batch of coordinates, in cells, and a time, in lifetimes.
fn values(level: Level, noise: &Noise<2>, coordinates: [f64; LANES], age: f64) -> [f32; LANES] {
    let (mut cells, mut fractions) = ([[0; LANES]; 2], [[0.0; LANES]; 2]);
    let age = Coordinate::from_f64(age);
    for i in 0..LANES {
        let coordinate = Coordinate::from_f64(coordinates[i]);
        (cells[0][i], fractions[0][i]) = (coordinate.cell, coordinate.fraction);
        (cells[1][i], fractions[1][i]) = (age.cell, age.fraction);
    }
    dispatch!(level, _simd => noise.lanes(&cells, &fractions))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::AuroraParameters;

    const KEY: Key = Key::new(4, "rays");

    /// Coordinates after every `last`th part of a sheet of that length.
    fn evenly(length: f64, last: usize) -> Vec<f64> {
        (0..=last).map(|node| length * node as f64 / last as f64).collect()
    }

    /// Brightness, dimming and hardness every 50 m along the left side of a sheet.
    fn coordinate(parameters: &AuroraParameters, time: f64) -> [Vec<f64>; 3] {
        let rays = RayPattern::new(parameters, KEY);
        let mut all: [Vec<f64>; 3] = Default::default();
        // A sheet of 800 km whose coordinate is its length.
        let table = rays.table(&[800.0], |_, last| evenly(800.0, last), time);
        for first in 0..1000 {
            let coordinate = |lane: usize| table.at(0, (first * LANES + lane) as f64 / 16_000.0);
            let coordinates = PatternInputs { noises: std::array::from_fn(coordinate), side: [-1.0; LANES] };
            let PatternSample { brightness, dimming, hardness } =
                rays.at(bansho_base::math::simd::level(), &coordinates, time);
            for (all, values) in all.iter_mut().zip([brightness, dimming, hardness]) {
                all.extend(values.map(f64::from));
            }
        }
        all
    }

    fn deviation(values: &[f64]) -> f64 {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        (values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / values.len() as f64).sqrt()
    }

    #[test]
    fn contrast_is_the_deviation_of_the_logarithm_and_hardness_goes_with_it() {
        let mut parameters = AuroraParameters::default();
        parameters.rays.contrast = 0.5;
        parameters.rays.energy_variation = 0.1;
        let [brightness, dimming, hardness] = coordinate(&parameters, 3.0);
        let logarithm = |values: &[f64]| values.iter().map(|value| bansho_base::math::ln(*value)).collect::<Vec<_>>();
        assert!((deviation(&logarithm(&brightness)) / 0.5 - 1.0).abs() < 0.15);
        assert!((deviation(&logarithm(&hardness)) / 0.1 - 1.0).abs() < 0.15);
        assert!(dimming.iter().all(|dimming| *dimming == 1.0));
        parameters.rays.contrast = 0.0;
        assert!(coordinate(&parameters, 3.0)[0].iter().all(|brightness| *brightness == 1.0));
    }

    #[test]
    fn the_table_holds_the_finest_noise() {
        let rays = RayPattern::new(&AuroraParameters::default(), KEY);
        let table = rays.table(&[300.0], |_, last| evenly(300.0, last), 2.0);
        for first in 0..500 {
            let coordinate = std::array::from_fn(|lane| 0.0371 * (first * LANES + lane) as f64);
            let [left, ..] = rays.noises(bansho_base::math::simd::level(), &coordinate, 2.0);
            for lane in 0..LANES {
                assert!((table.at(0, coordinate[lane] / 300.0)[0] - left[lane]).abs() < 0.01 * rays.deviation * 4.0);
            }
        }
    }

    #[test]
    fn there_are_no_more_nodes_than_particles_show() {
        let nodes = |particles: i64| {
            let mut parameters = AuroraParameters::default();
            (parameters.particles.count, parameters.rays.spacing_km) = (particles, 0.05);
            let table = RayPattern::new(&parameters, KEY).table(&[2000.0, 500.0], |_, last| evenly(1.0, last), 1.0);
            table.sheets.iter().map(Vec::len).collect::<Vec<_>>()
        };
        assert_eq!(nodes(500), [201, 51]);
        // A twelfth of 50 m apart.
        assert_eq!(nodes(5_000_000), [480_001, 120_001]);
    }

    #[test]
    fn rays_fade_where_the_coordinate_jumps() {
        let parameters = AuroraParameters::default();
        let rays = RayPattern::new(&parameters, KEY);
        // 50 km beyond the middle of the sheet all else.
        let jump = |_, last| {
            evenly(300.0, last)
                .into_iter()
                .map(|coordinate| coordinate + if coordinate > 150.0 { 50.0 } else { 0.0 })
                .collect()
        };
        let (even, torn) = (rays.table(&[300.0], |_, last| evenly(300.0, last), 2.0), rays.table(&[300.0], jump, 2.0));
        let step =
            |table: &RayTable, fraction: f64| (table.at(0, fraction + 2e-4)[0] - table.at(0, fraction - 2e-4)[0]).abs();
        assert!(step(&torn, 0.5) < 0.1 * f64::from(rays.deviation) as f32, "{}", step(&torn, 0.5));
        // A ray away it is as it was.
        let away = 0.5 - 1.1 * parameters.rays.spacing_km / 300.0;
        assert_eq!(torn.at(0, away), even.at(0, away));
        let ten = (1..60).map(|coordinate| torn.at(0, f64::from(coordinate) / 60.0)[0].abs()).fold(0.0, f32::max);
        assert!(ten > rays.deviation, "elsewhere there are rays");
    }

    #[test]
    fn rays_run_along_the_sheet() {
        let mut parameters = AuroraParameters::default();
        parameters.rays.shear_km_per_s = 3.0;
        parameters.rays.lifetime_s = 1e5;
        let [before, ..] = coordinate(&parameters, 1.0);
        let [after, ..] = coordinate(&parameters, 1.5);
        // 1.5 km are 30 positions; on the left they run onward.
        let moved = |shift: isize| -> f64 {
            (100..15_000).map(|i| (after[(i as isize + shift) as usize] - before[i]).abs()).sum()
        };
        assert!(moved(30) < 0.01 * moved(0) && moved(30) < 0.01 * moved(-30));
    }

    #[test]
    fn black_rays_are_narrow_and_dark() {
        let mut parameters = AuroraParameters::default();
        parameters.rays.black_ray_depth = 1.0;
        let [_, dimming, _] = coordinate(&parameters, 3.0);
        let dark = dimming.iter().filter(|dimming| **dimming < 0.3).count() as f64 / dimming.len() as f64;
        let whole = dimming.iter().filter(|dimming| **dimming == 1.0).count() as f64 / dimming.len() as f64;
        assert!((0.02..0.3).contains(&dark) && whole > 0.5, "{dark} {whole}");
    }

    #[test]
    fn patches_pulsate_with_their_period() {
        let mut parameters = AuroraParameters::default();
        parameters.pulsation.modulation_depth = 0.8;
        parameters.pulsation.period_s = 5.0;
        let at = |time: f64| coordinate(&parameters, time)[1].clone();
        let same = at(1.0).iter().zip(at(6.0)).all(|(a, b)| (a - b).abs() < 1e-5);
        let range =
            (0..20).map(|i| at(0.25 * f64::from(i))[7]).fold((1.0_f64, 0.0_f64), |(a, b), v| (a.min(v), b.max(v)));
        assert!(same && range.0 < 0.22 && range.1 > 0.98, "{range:?}");
        assert!(deviation(&at(1.0)) > 0.1, "patches have phases of their own");
    }
}
