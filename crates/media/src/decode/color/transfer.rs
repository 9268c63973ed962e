//! Transfer functions: from encoded values, 0 to 1, to light, where 1 is display white.

use bansho_base::{color, host::assets::PictureRemark, math};

use super::primaries::{self, Chromaticities};

/// How values encode light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Transfer {
    /// IEC 61966-2-1.
    Srgb,
    /// Light is a power of the value.
    Gamma(f64),
    /// Values are light.
    Linear,
    /// The inverse of the camera curve of ITU-R BT.709, BT.601 and BT.2020.
    Bt709,
    /// Perceptual quantizer (SMPTE ST 2084): absolute light up to 10,000 cd/m^2.
    Pq,
    /// Hybrid log-gamma (ARIB STD-B67), as a display of 1000 cd/m^2 shows it.
    Hlg,
}

/// Luminance of display white in pictures of high dynamic range (ITU-R BT.2408), cd/m^2.
const DISPLAY_WHITE: f64 = 203.0;
/// Peak of the display for HLG (ITU-R BT.2100), cd/m^2, and the gamma of its system.
const HLG_PEAK: f64 = 1000.0;
const HLG_GAMMA: f64 = 1.2;

impl Transfer {
    /// Light of an encoded value.
    pub(crate) fn to_light(self, value: f64) -> f32 {
        let value = value.clamp(0.0, 1.0);
        match self {
            Self::Srgb => color::decode_srgb(value as f32),
            Self::Gamma(gamma) => math::pow(value, gamma) as f32,
            Self::Linear => value as f32,
            // Linear below 0.018, with a slope of 4.5.
            Self::Bt709 => {
                (if value < 0.081 { value / 4.5 } else { math::pow((value + 0.099) / 1.099, 1.0 / 0.45) }) as f32
            }
            Self::Pq => (10_000.0 / DISPLAY_WHITE * pq(value)) as f32,
            // Without the gamma of the system, which acts on luminance.
            Self::Hlg => hlg(value) as f32,
        }
    }

    /// Whether values are light, of a scene or a display.
    pub(crate) fn is_linear(self) -> bool {
        self == Self::Linear || matches!(self, Self::Gamma(gamma) if (gamma - 1.0).abs() < 1e-5)
    }

    /// Whether values exceed display white.
    pub(crate) fn is_high_dynamic_range(self) -> bool {
        matches!(self, Self::Pq | Self::Hlg)
    }

    /// What is to be known of values that exceed display white.
    pub(super) fn high_dynamic_range_remark(self) -> Option<PictureRemark> {
        let transfer = match self {
            Self::Pq => "PQ (SMPTE ST 2084)",
            Self::Hlg => "HLG, shown as by a display of 1000 cd/m^2",
            _ => return None,
        };
        Some(PictureRemark::HighDynamicRange { transfer, white: DISPLAY_WHITE as f32 })
    }

    /// Applies the gamma of the HLG system, which acts on luminance (ITU-R BT.2100, table 5); other light is unchanged.
    pub(super) fn with_system_gamma(self, light: [f32; 3], chromaticities: Chromaticities) -> [f32; 3] {
        if self != Self::Hlg {
            return light;
        }
        // Those of Rec. 2020 where the chromaticities describe no colors.
        let weights = primaries::luminance_weights(chromaticities).unwrap_or([0.2627, 0.6780, 0.0593]);
        let luminance: f32 = light.iter().zip(weights).map(|(value, weight)| value * weight).sum();
        let gain = HLG_PEAK / DISPLAY_WHITE * math::pow(f64::from(luminance.max(1e-9)), HLG_GAMMA - 1.0);
        light.map(|value| value * gain as f32)
    }
}

/// Light of a PQ value relative to 10,000 cd/m^2.
fn pq(value: f64) -> f64 {
    const M1: f64 = 2610.0 / 16384.0;
    const M2: f64 = 2523.0 / 4096.0 * 128.0;
    const C1: f64 = 3424.0 / 4096.0;
    const C2: f64 = 2413.0 / 4096.0 * 32.0;
    const C3: f64 = 2392.0 / 4096.0 * 32.0;
    let power = math::pow(value, 1.0 / M2);
    math::pow((power - C1).max(0.0) / (C2 - C3 * power), 1.0 / M1)
}

/// Scene light of an HLG value, 0 to 1.
fn hlg(value: f64) -> f64 {
    const A: f64 = 0.178_832_77;
    const B: f64 = 1.0 - 4.0 * A;
    const C: f64 = 0.559_910_729_529_562;
    if value <= 0.5 { value * value / 3.0 } else { (math::exp((value - C) / A) + B) / 12.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_pass_through_published_points() {
        // ST 2084: 100 cd/m^2 at 0.508078, 1000 at 0.751827.
        for (value, nits) in [(0.508_078, 100.0), (0.751_827, 1000.0), (1.0, 10_000.0)] {
            assert!((pq(value) * 10_000.0 / nits - 1.0).abs() < 1e-4, "{value}");
        }
        assert!((hlg(0.5) - 1.0 / 12.0).abs() < 1e-12 && (hlg(1.0) - 1.0).abs() < 1e-6);
        assert!((Transfer::Bt709.to_light(0.5) - 0.259_59).abs() < 1e-4);
        assert!((Transfer::Gamma(2.2).to_light(0.5) - 0.217_638).abs() < 1e-6);
        assert_eq!(Transfer::Srgb.to_light(0.0), 0.0);
    }
}
