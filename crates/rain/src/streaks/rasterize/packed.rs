//! Packed streaks: a frame may have millions of them.

use bansho_base::math::approximations;

use super::{StreakSegment, tile::StreakShading};

/// A [`StreakSegment`] in 32 bytes, half a cache line. Packing is lossless but for the light (0.4 %) and the diameter
/// (half a micrometer), since a segment's slope and width are quantized when it is made.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(crate) struct PackedStreak {
    center: [f32; 2],
    half_length: f32,
    line_coverage: f32,
    depth: f32,
    slope: i16,
    /// bfloat16.
    half_width: u16,
    light: [u16; 3],
    /// Diameter of the drop in micrometers; the highest bit is set for a steep streak.
    diameter_and_steep: u16,
}

const SLOPE_SCALE: f32 = 32_767.0;
const STEEP_BIT: u16 = 1 << 15;
const UM_PER_MM: f32 = 1000.0;

/// Rounds to bfloat16: the upper half of an `f32`.
#[inline(always)]
fn f32_to_bf16(value: f32) -> u16 {
    ((value.to_bits() + (1 << 15)) >> 16) as u16
}

/// Expands a bfloat16.
#[inline(always)]
fn bf16_to_f32(bits: u16) -> f32 {
    f32::from_bits(u32::from(bits) << 16)
}

/// The nearest bfloat16, the format of half widths.
#[inline(always)]
pub(super) fn round_to_bf16(value: f32) -> f32 {
    bf16_to_f32(f32_to_bf16(value))
}

/// The nearest representable slope, for slopes of -1 to 1.
#[inline(always)]
pub(super) fn quantize_slope(value: f32) -> f32 {
    approximations::rounded(value * SLOPE_SCALE) * (1.0 / SLOPE_SCALE)
}

/// The nearest integer, modulo 2^16.
#[inline(always)]
fn round_to_u16(value: f32) -> u16 {
    approximations::round_to_i32(value) as u16
}

impl PackedStreak {
    #[inline(always)]
    pub(crate) fn new(segment: &StreakSegment) -> Self {
        let mut light = [0; 3];
        for c in 0..3 {
            light[c] = f32_to_bf16(segment.shading.light[c]);
        }
        Self {
            center: segment.center,
            half_length: segment.half_length,
            line_coverage: segment.line_coverage,
            depth: segment.shading.depth,
            slope: round_to_u16(segment.slope * SLOPE_SCALE) as i16,
            half_width: f32_to_bf16(segment.half_width),
            light,
            diameter_and_steep: round_to_u16(segment.diameter_mm * UM_PER_MM) & !STEEP_BIT
                | if segment.steep { STEEP_BIT } else { 0 },
        }
    }

    /// Depth, m.
    #[inline(always)]
    pub(crate) fn depth(&self) -> f32 {
        self.depth
    }

    #[inline(always)]
    pub(crate) fn unpack(&self) -> StreakSegment {
        let mut light = [0.0; 3];
        for c in 0..3 {
            light[c] = bf16_to_f32(self.light[c]);
        }
        StreakSegment {
            center: self.center,
            steep: self.diameter_and_steep & STEEP_BIT != 0,
            half_length: self.half_length,
            slope: f32::from(self.slope) * (1.0 / SLOPE_SCALE),
            half_width: bf16_to_f32(self.half_width),
            line_coverage: self.line_coverage,
            diameter_mm: f32::from(self.diameter_and_steep & !STEEP_BIT) / UM_PER_MM,
            shading: StreakShading { light, depth: self.depth },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{super::ScreenPath, *};

    #[test]
    fn a_record_gives_its_streak_back() {
        for (to, radius) in [([20.0, 91.3], 0.17), ([90.7, 33.0], 3.3), ([20.9, 12.8], 0.02), ([-70.0, 2.1], 40.0)] {
            let path = ScreenPath { ends: [[20.3, 20.9], to], radius, blocked_area: 3.0 * radius };
            let mut segment = StreakSegment::new(path, 2.7, 1.2345);
            segment.shading.add_light([0.0, 3.21, 12_345.6]);
            let found = PackedStreak::new(&segment).unpack();
            for c in 0..3 {
                let [light, kept] = [&segment, &found].map(|segment| segment.shading.light[c]);
                assert!((kept - light).abs() <= light / 256.0, "{light} {kept}");
            }
            assert!((found.diameter_mm - segment.diameter_mm).abs() <= 5.1e-4);
            assert_eq!(StreakSegment { shading: segment.shading, diameter_mm: segment.diameter_mm, ..found }, segment);
            assert_eq!(PackedStreak::new(&found).unpack(), found);
        }
        assert_eq!(size_of::<PackedStreak>(), 32);
    }
}
