//! AOVs of rain: opacity, depth and diameter of the streaks in a pixel.

use bansho_base::phenomenon::strip::{AovDescriptor, AovPlane, AovRule};

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
];

/// Writes the AOVs of one pixel of a streak; `depth` in m.
pub(crate) fn write_aovs(aovs: &mut [AovPlane], index: usize, opacity: f32, depth: f32, diameter_mm: f32) {
    debug_assert!(aovs.is_empty() || aovs.len() == AOVS.len(), "a plane for each AOV, or none");
    let [opacities, depths, diameters] = aovs else { return };
    if opacity > 0.0 {
        opacities.add(index, 1.0, opacity);
        depths.keep_nearest(index, depth, depth);
        diameters.keep_nearest(index, diameter_mm, depth);
    }
}
