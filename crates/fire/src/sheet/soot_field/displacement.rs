//! The fractal field that displaces the plume's coordinates: two components, each the sum of two layers of fractal noise that rise at different speeds.
//!
//! As in the default texture, the layers are slanted against each other, so that the field does not repeat and its eddies change as they rise.

use std::sync::Arc;

use bansho_base::math::{
    self,
    random::{Key, Purpose},
    simd::Lanes,
};
use fearless_simd::Simd;

use crate::sheet::{
    animate::clock::Clock,
    parameters::{FlameSheetParameters, SootFieldParameters},
    texture::{FractalLayers, TextureLayer, TextureTable, fractal_noise},
};

/// The components of the field as tables: the displacement across and upward.
#[derive(Clone, Debug)]
pub(crate) struct DisplacementTables {
    components: [Arc<TextureTable>; 2],
}

impl DisplacementTables {
    pub(crate) fn new(field: &SootFieldParameters) -> Self {
        let key = Key::new(1988, "soot field");
        let components = [Purpose::named("stir across"), Purpose::named("stir up")].map(|purpose| {
            let mut texels = fractal_noise(field.octaves as usize, field.gain as f32, key, purpose);
            normalize(&mut texels);
            Arc::new(TextureTable::new(&texels))
        });
        Self { components }
    }

    /// Both components low-pass filtered for a sheet `height_pixels` tall.
    pub(crate) fn filtered(&self, layers: &FractalLayers, height_pixels: f64) -> Self {
        let level = math::log2(layers.texels_up() / height_pixels.max(1.0)) as f32;
        if level <= 0.0 || level.is_nan() {
            return self.clone();
        }
        Self { components: self.components.each_ref().map(|table| Arc::new(table.filtered(level))) }
    }

    /// The field after `scroll` sheet heights.
    pub(crate) fn at(&self, layers: &FractalLayers, scroll: f64) -> Displacement {
        Displacement { components: self.components.clone(), layers: layers.layers(scroll) }
    }
}

/// Subtracts the mean and scales so that the sum of two independent layers has a root mean square of 1.
fn normalize(texels: &mut [f32]) {
    let count = texels.len() as f64;
    let mean = texels.iter().map(|value| f64::from(*value)).sum::<f64>() / count;
    let square =
        texels.iter().map(|value| (f64::from(*value) - mean) * (f64::from(*value) - mean)).sum::<f64>() / count;
    let scale = 1.0 / math::sqrt(2.0 * square.max(f64::MIN_POSITIVE));
    texels.iter_mut().for_each(|value| *value = ((f64::from(*value) - mean) * scale) as f32);
}

/// Layers of the field of one flame, which move with the flame's speed.
pub(crate) fn layers(sheet: &FlameSheetParameters, key: Key, clock: &Clock) -> FractalLayers {
    /// Length of an eddy relative to its width: rising gas stretches it.
    const ELONGATION: f64 = 1.6;
    let [across, up] = FractalLayers::COARSE_CELLS;
    let width = sheet.soot_field.eddy_size * across;
    let length = sheet.soot_field.eddy_size * ELONGATION * sheet.width / sheet.height * up;
    FractalLayers::new([width, length.clamp(0.02, 20.0)], 1.0, key, clock)
}

/// The field at one time.
#[derive(Clone, Debug)]
pub(crate) struct Displacement {
    components: [Arc<TextureTable>; 2],
    layers: [TextureLayer; 2],
}

impl Displacement {
    /// Displacement across and up at sixteen points, with a root mean square of 1.
    #[inline(always)]
    pub(crate) fn sample<S: Simd>(&self, u: Lanes<S>, w: Lanes<S>) -> [Lanes<S>; 2] {
        let [coarse, fine] = &self.layers;
        let [across, up] = &self.components;
        [coarse.sample(across, u, w) + fine.sample(across, u, w), coarse.sample(up, u, w) + fine.sample(up, u, w)]
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::parameters::animated::Animated;
    use fearless_simd::prelude::*;

    use super::*;

    fn field() -> (DisplacementTables, FractalLayers) {
        let sheet = FlameSheetParameters::default();
        let layers = layers(&sheet, Key::new(3, "test"), &Clock::new(Animated::from(1.0), None));
        (DisplacementTables::new(&sheet.soot_field), layers)
    }

    /// Both components at sixteen points of a row.
    fn row((tables, layers): &(DisplacementTables, FractalLayers), scroll: f64, w: f32) -> Vec<f32> {
        let field = tables.at(layers, scroll);
        bansho_base::dispatch_baseline!(simd => {
            let [across, up] = field.sample(Lanes::from_fn(simd, |i| i as f32 / 15.0), Lanes::splat(simd, w));
            [across.as_slice(), up.as_slice()].concat()
        })
    }

    #[test]
    fn the_field_has_a_root_mean_square_of_1_and_no_mean() {
        let field = field();
        let (mut sum, mut square, mut product, mut count) = (0.0, 0.0, 0.0, 0.0);
        for step in 0..400 {
            let values = row(&field, f64::from(step) * 0.731, 0.3);
            for (across, up) in values[..16].iter().zip(&values[16..]) {
                sum += across + up;
                square += across * across + up * up;
                product += across * up;
                count += 2.0;
            }
        }
        assert!(
            (sum / count).abs() < 0.12 && (square / count - 1.0_f32).abs() < 0.15,
            "{} {}",
            sum / count,
            square / count
        );
        assert!((2.0 * product / count).abs() < 0.12, "components are independent: {}", 2.0 * product / count);
    }

    #[test]
    fn the_field_scrolls_upward() {
        // After scrolling by 0.01 heights the field at w = 0.41 is nearly that at 0.40 before; the field at 0.40 itself has changed more.
        let field = field();
        let (before, moved, fixed) = (row(&field, 5.0, 0.40), row(&field, 5.01, 0.41), row(&field, 5.01, 0.40));
        let apart = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f32>();
        assert!(
            apart(&before, &moved) < 0.5 * apart(&before, &fixed),
            "{} {}",
            apart(&before, &moved),
            apart(&before, &fixed)
        );
    }
}
