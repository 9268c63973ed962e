//! The skyline of hills, mountains and trees: elevation by azimuth.

use bansho_base::math::{
    self, MulAdd,
    random::{Key, Purpose},
};

use super::{HillForm, SkyParameters};

/// Samples around the horizon, a power of two.
const SAMPLES: usize = 1 << 15;
/// Octaves of rounded hills, and waves around the horizon in the first.
const OCTAVES: u32 = 7;
const FIRST_WAVES: u64 = 5;
/// Trees for each width of a tree: a closed forest.
const TREE_DENSITY: f64 = 3.0;
/// Width of a tree relative to its height.
const TREE_WIDTH_RATIO: f64 = 0.42;

const HILL: Purpose = Purpose::named("skyline hill");
const TREE: Purpose = Purpose::named("skyline tree");

/// Ranges of mountains: distance relative to that of the hills, height relative to `hills_deg`, and waves around the horizon in the first octave.
const RANGES: [(f64, f64, u64); 3] = [(1.0, 0.55, 11), (2.4, 0.8, 9), (5.0, 1.0, 7)];
/// Octaves of a range.
const RANGE_OCTAVES: u32 = 9;

impl HillForm {
    /// Distance of the farthest range relative to that of the hills.
    pub(super) fn farthest_range(self) -> f64 {
        match self {
            Self::Rounded => 1.0,
            Self::Mountains => RANGES[RANGES.len() - 1].0,
        }
    }
}

/// Sine of the hidden elevation by azimuth, from north over east.
#[derive(Clone, Debug)]
pub(super) struct Ridge {
    sines: Vec<f32>,
    /// Maximum and minimum.
    pub(super) highest: f32,
    pub(super) lowest: f32,
}

/// The skyline, and the ranges that it consists of.
#[derive(Clone, Debug)]
pub(super) struct Skyline {
    /// The highest of all ranges.
    pub(super) outline: Ridge,
    /// Ranges with their distance relative to that of the hills, nearest first.
    pub(super) ranges: Vec<(f64, Ridge)>,
}

impl Ridge {
    fn from_elevations_deg(heights: &[f64]) -> Self {
        let sines: Vec<f32> = heights.iter().map(|height| math::sin(height.to_radians()) as f32).collect();
        let highest = sines.iter().copied().fold(0.0, f32::max);
        let lowest = sines.iter().copied().fold(highest, f32::min);
        Self { sines, highest, lowest }
    }

    /// Sine of the hidden elevation at an azimuth in turns from north over east, -1 to 1.
    #[inline(always)]
    pub(super) fn sine(&self, turns: f32) -> f32 {
        const MASK: u32 = SAMPLES as u32 - 1;
        let position = (turns + 1.0).fma(SAMPLES as f32, -0.5);
        let first = position as u32;
        let fraction = position - first as f32;
        let (low, high) = (self.sines[(first & MASK) as usize], self.sines[((first + 1) & MASK) as usize]);
        fraction.fma(high - low, low)
    }
}

impl Skyline {
    /// The skyline; `None` if hills and trees have no height.
    pub(super) fn new(parameters: &SkyParameters, seed: u64) -> Option<Self> {
        if parameters.hills_deg == 0.0 && parameters.trees_deg == 0.0 {
            return None;
        }
        let key = Key::new(seed, "skyline");
        let mut ranges: Vec<(f64, Vec<f64>)> = Vec::new();
        match parameters.hills_form {
            HillForm::Rounded => {
                let heights = (0..SAMPLES).map(|sample| parameters.hills_deg * hill_height(key, sample)).collect();
                ranges.push((1.0, heights));
            }
            HillForm::Mountains => {
                for (number, (distance, height, waves)) in RANGES.into_iter().enumerate() {
                    let scale = height * parameters.hills_deg;
                    let heights = (0..SAMPLES).map(|sample| scale * mountain_height(key, number as u32, waves, sample));
                    ranges.push((distance, heights.collect()));
                }
            }
        }
        if parameters.trees_deg > 0.0 {
            add_trees(&mut ranges[0].1, parameters.trees_deg, key);
        }
        let mut outline = ranges[0].1.clone();
        for (_, heights) in &ranges[1..] {
            outline.iter_mut().zip(heights).for_each(|(highest, height)| *highest = highest.max(*height));
        }
        let ranges = ranges.into_iter().map(|(distance, heights)| (distance, Ridge::from_elevations_deg(&heights)));
        Some(Self { outline: Ridge::from_elevations_deg(&outline), ranges: ranges.collect() })
    }
}

/// Height of a range of mountains at a sample, 0 to 1: ridged noise, whose octaves are strong on heights and weak in valleys (Musgrave 1994).
fn mountain_height(key: Key, range: u32, first_waves: u64, sample: usize) -> f64 {
    let position = sample as f64 / SAMPLES as f64;
    let (mut sum, mut amplitude, mut strength, mut whole) = (0.0, 1.0, 1.0, 0.0);
    for octave in 0..RANGE_OCTAVES {
        let waves = first_waves << octave;
        let at = position * waves as f64;
        let (cell, fraction) = (at as u64, at - at.floor());
        let values =
            [cell, cell + 1].map(|cell| f64::from(key.uniforms(cell % waves, 100 * (range + 1) + octave, HILL)[0]));
        let blend = fraction * fraction * (3.0 - 2.0 * fraction);
        let ridge = 1.0 - (2.0 * math::lerp(values[0], values[1], blend) - 1.0).abs();
        let signal = ridge * ridge * strength;
        sum += amplitude * signal;
        whole += amplitude;
        strength = (2.0 * signal).min(1.0);
        amplitude *= 0.5;
    }
    0.15 + 1.1 * sum / whole
}

/// Height of rounded hills at a sample, 0 to 1: value noise.
fn hill_height(key: Key, sample: usize) -> f64 {
    let position = sample as f64 / SAMPLES as f64;
    let mut sum = 0.0;
    for octave in 0..OCTAVES {
        let waves = FIRST_WAVES << octave;
        let at = position * waves as f64;
        let (cell, fraction) = (at as u64, at - at.floor());
        // Cells repeat after all of the horizon.
        let [value, next_value] = [cell, cell + 1].map(|cell| f64::from(key.uniforms(cell % waves, octave, HILL)[0]));
        let blend = fraction * fraction * (3.0 - 2.0 * fraction);
        sum += math::lerp(value, next_value, blend) * math::pow(0.45, f64::from(octave));
    }
    sum * 0.55
}

/// Adds trees to the hills.
fn add_trees(heights: &mut [f64], tree_deg: f64, key: Key) {
    let degrees_per_sample = 360.0 / SAMPLES as f64;
    let count = (360.0 / (tree_deg * TREE_WIDTH_RATIO) * TREE_DENSITY) as u64;
    let hills = heights.to_vec();
    for number in 0..count.min(SAMPLES as u64) {
        let [position, size, shape, lean] = key.uniforms(number, 0, TREE).map(f64::from);
        let middle = position * SAMPLES as f64;
        let height = tree_deg * (0.4 + 0.6 * size * size);
        let half = (0.5 * TREE_WIDTH_RATIO * (0.6 + 0.8 * shape) * height / degrees_per_sample).max(1.0);
        let base = hills[middle as usize % SAMPLES];
        for sample in (middle - half).ceil() as i64..=(middle + half).floor() as i64 {
            let distance = (sample as f64 - middle - lean * 0.2 * half).abs() / half;
            // Branches in tiers: the ragged cone of a spruce.
            let tier = (distance * 6.0 + size * 7.0).fract() * 0.09;
            let top = base + height * (1.0 - distance - tier).max(0.0);
            let skyline_height = &mut heights[sample.rem_euclid(SAMPLES as i64) as usize];
            *skyline_height = skyline_height.max(top);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_as_high_as_asked_and_closes_all_around() {
        let parameters = SkyParameters { hills_deg: 3.0, trees_deg: 1.0, ..SkyParameters::default() };
        let skyline = Skyline::new(&parameters, 3).unwrap();
        let outline = &skyline.outline;
        let highest = math::asin(f64::from(outline.highest)).to_degrees();
        assert!((1.5..4.1).contains(&highest), "{highest}");
        for turns in [0.0, 0.3] {
            assert!((outline.sine(turns) - outline.sine(turns - 1.0)).abs() < 1e-4);
        }
        assert!((outline.sine(0.5) - outline.sine(-0.5)).abs() < 1e-6 && outline.lowest < outline.highest);
        assert!(Skyline::new(&SkyParameters::default(), 3).is_none());
    }

    #[test]
    fn far_mountains_look_out_between_near_ones() {
        let hills_form = HillForm::Mountains;
        let parameters = SkyParameters { hills_deg: 8.0, hills_form, ..SkyParameters::default() };
        let skyline = Skyline::new(&parameters, 3).unwrap();
        let highest = math::asin(f64::from(skyline.outline.highest)).to_degrees();
        assert!((5.0..10.1).contains(&highest), "{highest}");
        let mut seen = [0; 3];
        for sample in 0..1000 {
            let turns = sample as f32 / 1000.0;
            let sines: Vec<f32> = skyline.ranges.iter().map(|(_, ridge)| ridge.sine(turns)).collect();
            let top = (0..3).max_by(|a, b| sines[*a].total_cmp(&sines[*b])).unwrap();
            assert!((skyline.outline.sine(turns) - sines[top]).abs() < 1e-3);
            seen[top] += 1;
        }
        assert!(seen[1] > 50 && seen[2] > 200, "{seen:?}");
        assert!((skyline.outline.sine(0.5) - skyline.outline.sine(-0.5)).abs() < 1e-6);
    }
}
