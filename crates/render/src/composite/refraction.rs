//! Frames with hot air that refracts the light from behind it.
//!
//! The refracting layers divide the slices into groups. From far to near, each group is composited over what has been drawn, as seen through
//! the layer between. AOVs are not refracted.

use bansho_base::{
    frame::{Frame, FrameHeader},
    host::observer::Cancelled,
    phenomenon::Deflection,
};

use super::{
    background::{Background, LightFrame},
    composition::Composition,
    light_frame,
};

/// Draws and composites the whole window, with refraction.
pub(crate) fn draw_frame(
    composition: &Composition,
    header: FrameHeader,
    mut recycled: Option<Frame>,
) -> Result<LightFrame, Cancelled> {
    let mut layers: Vec<Deflection> =
        composition.prepared.iter().filter_map(|prepared| prepared.deflection()).collect();
    layers.sort_by(|a, b| b.depth.total_cmp(&a.depth));
    let farthest = layers.first().map_or(f64::INFINITY, |layer| layer.depth);
    let (mut slices, far) = composition.slices.split_at(slices_before(composition, farthest));
    let mut drawn = match far {
        [] => None,
        far => Some(light_frame::draw_frame(&Composition { slices: far, ..*composition }, header.clone(), None)?),
    };
    for (index, layer) in layers.iter().enumerate() {
        let next = layers.get(index + 1).map_or(f64::NEG_INFINITY, |next| next.depth);
        let (rest, group) = slices.split_at(slices_before(composition, next));
        slices = rest;
        let background = drawn.as_ref().map_or(composition.background, Background::drawn);
        let background = background.through(*layer, composition.view);
        let group = Composition { slices: group, background, ..*composition };
        let memory = if rest.is_empty() { recycled.take() } else { None };
        drawn = Some(light_frame::draw_frame(&group, header.clone(), memory)?);
    }
    match drawn {
        Some(frame) => Ok(frame),
        None => light_frame::draw_frame(composition, header, recycled),
    }
}

/// Number of slices that begin at or before a depth.
fn slices_before(composition: &Composition, depth: f64) -> usize {
    composition.slices.partition_point(|slice| slice.interval.near <= depth)
}
