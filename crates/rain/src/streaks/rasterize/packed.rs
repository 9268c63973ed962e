//! A streak as it is kept: rain in sight may be millions of them.

use bansho_base::math::approximations;

use super::{Stroke, tile::Layer};

/// A [`Stroke`] in half a line of a core's cache. What it gives back is what it was given, but for the light, which is kept to
/// 0.4 %, and the diameter, to half a micrometre.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(crate) struct Record {
    middle: [f32; 2],
    half: f32,
    density: f32,
    depth: f32,
    lean: i16,
    /// The upper halves of floats.
    across: u16,
    light: [u16; 3],
    /// Diameter of the drop in micrometres; the highest bit is that of an upright streak.
    drop: u16,
}

const LEANS: f32 = 32_767.0;
const UPRIGHT: u16 = 1 << 15;
const PER_MM: f32 = 1000.0;

/// The upper half of a number, rounded.
#[inline(always)]
fn upper(value: f32) -> u16 {
    ((value.to_bits() + (1 << 15)) >> 16) as u16
}

/// The number of an upper half.
#[inline(always)]
fn whole(upper: u16) -> f32 {
    f32::from_bits(u32::from(upper) << 16)
}

/// The nearest number that a record keeps as half a width.
#[inline(always)]
pub(super) fn short(value: f32) -> f32 {
    whole(upper(value))
}

/// The nearest number that a record keeps as a lean of up to 1.
#[inline(always)]
pub(super) fn lean(value: f32) -> f32 {
    approximations::rounded(value * LEANS) * (1.0 / LEANS)
}

/// The nearest whole number as an integer, modulo 2^16.
#[inline(always)]
fn count(value: f32) -> u16 {
    approximations::whole(value) as u16
}

impl Record {
    #[inline(always)]
    pub(crate) fn new(stroke: &Stroke) -> Self {
        let mut light = [0; 3];
        for c in 0..3 {
            light[c] = upper(stroke.layer.light[c]);
        }
        Self {
            middle: stroke.middle,
            half: stroke.half,
            density: stroke.density,
            depth: stroke.layer.depth,
            lean: count(stroke.lean * LEANS) as i16,
            across: upper(stroke.across),
            light,
            drop: count(stroke.diameter_mm * PER_MM) & !UPRIGHT | if stroke.upright { UPRIGHT } else { 0 },
        }
    }

    #[inline(always)]
    pub(crate) fn stroke(&self) -> Stroke {
        let mut light = [0.0; 3];
        for c in 0..3 {
            light[c] = whole(self.light[c]);
        }
        Stroke {
            middle: self.middle,
            upright: self.drop & UPRIGHT != 0,
            half: self.half,
            lean: f32::from(self.lean) * (1.0 / LEANS),
            across: whole(self.across),
            density: self.density,
            diameter_mm: f32::from(self.drop & !UPRIGHT) / PER_MM,
            layer: Layer { light, depth: self.depth },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{super::Way, *};

    #[test]
    fn a_record_gives_its_streak_back() {
        for (to, radius) in [([20.0, 91.3], 0.17), ([90.7, 33.0], 3.3), ([20.9, 12.8], 0.02), ([-70.0, 2.1], 40.0)] {
            let way = Way { ends: [[20.3, 20.9], to], radius, hidden: 3.0 * radius };
            let mut stroke = Stroke::new(way, 2.7, 1.2345);
            stroke.layer.add_light([0.0, 3.21, 12_345.6]);
            let found = Record::new(&stroke).stroke();
            for c in 0..3 {
                let [light, kept] = [&stroke, &found].map(|stroke| stroke.layer.light[c]);
                assert!((kept - light).abs() <= light / 256.0, "{light} {kept}");
            }
            assert!((found.diameter_mm - stroke.diameter_mm).abs() <= 5.1e-4);
            assert_eq!(Stroke { layer: stroke.layer, diameter_mm: stroke.diameter_mm, ..found }, stroke);
            assert_eq!(Record::new(&found).stroke(), found);
        }
        assert_eq!(size_of::<Record>(), 32);
    }
}
