//! Frames in which hot air bends what lies behind it.
//!
//! The slices fall into groups, each nearer than one bending layer. From far to near, each group is laid before what lies behind it, seen
//! through the layer between. AOVs are not bent.

use bansho_base::{
    frame::{Frame, FrameHeader},
    host::observer::{Cancelled, Observer},
    phenomenon::Deflection,
};

use super::{
    background::Behind,
    strips::{self, Composition},
};

pub(crate) fn frame(
    composition: &Composition,
    header: FrameHeader,
    mut spent: Option<Frame>,
    observer: &dyn Observer,
) -> Result<Frame, Cancelled> {
    let mut bends: Vec<Deflection> = composition.prepared.iter().filter_map(|prepared| prepared.deflection()).collect();
    bends.sort_by(|a, b| b.depth.total_cmp(&a.depth));
    let farthest = bends.first().map_or(f64::INFINITY, |bend| bend.depth);
    let (mut slices, far) = composition.slices.split_at(nearer(composition, farthest));
    let mut drawn = match far {
        [] => None,
        far => Some(strips::frame(&Composition { slices: far, ..*composition }, header.clone(), None, observer)?),
    };
    for (number, bend) in bends.iter().enumerate() {
        let next = bends.get(number + 1).map_or(f64::NEG_INFINITY, |next| next.depth);
        let (rest, group) = slices.split_at(nearer(composition, next));
        slices = rest;
        let behind = drawn.as_ref().map_or(composition.behind, Behind::drawn).through(*bend, composition.view);
        let group = Composition { slices: group, behind, ..*composition };
        let memory = if rest.is_empty() { spent.take() } else { None };
        drawn = Some(strips::frame(&group, header.clone(), memory, observer)?);
    }
    match drawn {
        Some(frame) => Ok(frame),
        None => strips::frame(composition, header, spent, observer),
    }
}

/// How many slices begin before a depth.
fn nearer(composition: &Composition, depth: f64) -> usize {
    composition.slices.partition_point(|slice| slice.interval.near <= depth)
}
