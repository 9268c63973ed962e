//! AOVs of rain: opacity, depth and diameter of the streaks in a pixel, and the optical depth of the medium.

use bansho_base::{
    math::approximations,
    phenomenon::strip::{AovDescriptor, AovPlane, AovRule},
};

/// The AOVs of rain, in the order of a strip's planes.
pub(crate) const AOVS: &[AovDescriptor] = &[
    AovDescriptor {
        name: "streak_opacity",
        unit: "",
        doc: "Opacity of the streaks in a pixel, summed; 0 where there are none. The airlight of far rain is not included.",
        rule: AovRule::Sum,
    },
    AovDescriptor {
        name: "streak_depth",
        unit: "m",
        doc: "Depth of the nearest streak in a pixel; 0 where there is none.",
        rule: AovRule::Nearest,
    },
    AovDescriptor {
        name: "diameter_mm",
        unit: "mm",
        doc: "Diameter of the drop of the nearest streak in a pixel; 0 where there is none.",
        rule: AovRule::Nearest,
    },
    AovDescriptor {
        name: "airlight_optical_depth",
        unit: "",
        doc: "Optical depth of the drops that are not streaks, up to what is behind them: e to the power of minus it is the fraction of the light that they transmit.",
        rule: AovRule::Sum,
    },
];

/// Index of the optical depth of the medium among [`AOVS`].
const OPTICAL_DEPTH: usize = 3;

/// Writes the AOVs of one pixel of a streak; `depth` in m.
pub(crate) fn write_aovs(aovs: &mut [AovPlane], index: usize, opacity: f32, depth: f32, diameter_mm: f32) {
    debug_assert!(aovs.is_empty() || aovs.len() == AOVS.len(), "a plane for each AOV, or none");
    let [opacities, depths, diameters, _] = aovs else { return };
    if opacity > 0.0 {
        opacities.add(index, 1.0, opacity);
        depths.keep_nearest(index, depth, depth);
        diameters.keep_nearest(index, diameter_mm, depth);
    }
}

/// Adds the optical depths of a part of the medium of these opacities to consecutive pixels, the first at `first`.
pub(crate) fn add_optical_depths(aovs: &mut [AovPlane], first: usize, opacities: &[f32]) {
    let Some(plane) = aovs.get_mut(OPTICAL_DEPTH) else { return };
    for (index, opacity) in (first..).zip(opacities) {
        // Rain whose opacity is 1 in single precision has an optical depth of more than 16.
        plane.add(index, 1.0, -approximations::ln((1.0 - opacity).max(f32::EPSILON)));
    }
}
