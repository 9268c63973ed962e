//! Things that move over the same pixels while the shutter is open, composited at each moment of the exposure.
//!
//! Compositing is linear in each of its members in each slice: where only one of them moves, and within its slice, the mean of its parts, composited with all
//! others, is the mean of the composites. Where two move, it is not: things that pass through the same pixel one after the other would hide each other. Nor is it
//! where one moves from slice to slice, since it would hide itself. There the exposure is cut into moments, each of which shows one part of every member, and the composites of the moments are averaged.
//!
//! Slices are drawn from near to far, and each part of a member is composited at once into all moments that it belongs to. So each part is drawn once for
//! each slice, and members without parts once for all moments.

use std::{ops::Range, sync::Arc};

use bansho_base::{
    image::Rect,
    phenomenon::{
        Prepared,
        strip::{Strip, View},
    },
};
use fearless_simd::Level;

use super::{
    accumulate::Accumulator,
    composition::{Composition, Pass, STRIP_ROWS},
    hiding::HidingDepth,
    moving_members::{Cell, MomentScratch, MovingMember, TILE_COLUMNS},
};

/// Memory of the moments of an exposure for each thread, bytes, if the camera moves, so that many things do. With `layers` layers.
pub fn moment_bytes_per_thread(view: &View, layers: usize) -> f64 {
    /// Bytes of a pixel of two composites and of the traced obstacles; and of a layer in both composites.
    const MOMENT_BYTES: f64 = 2.0 * 28.0 + 32.0;
    const LAYER_BYTES: f64 = 2.0 * 16.0;
    if view.path_cameras().is_still() {
        return 0.0;
    }
    let pixels = (view.shutter.max_parts() * TILE_COLUMNS * STRIP_ROWS) as f64;
    pixels * (MOMENT_BYTES + LAYER_BYTES * layers as f64)
}

/// What the members of a composition show in a cell.
struct CellMembers<'a> {
    /// Number of moments.
    count: usize,
    /// The parts of each member; a single one if it does not move.
    parts: Vec<Vec<&'a dyn Prepared>>,
}

/// The moments, of `count`, in one of `pieces` equal pieces.
fn moments_of(piece: usize, pieces: usize, count: usize) -> Range<usize> {
    piece * count / pieces..(piece + 1) * count / pieces
}

/// Those of the parts that are computed when they are drawn, for the pixels of `rect`.
fn parts_within<'a>(parts: &'a [Arc<dyn Prepared + '_>], rect: Rect) -> Vec<Option<Box<dyn Prepared + 'a>>> {
    parts.iter().map(|part| part.within(rect)).collect()
}

impl Composition<'_> {
    /// Draws the slices in a cell into `mean`, as the mean of all moments.
    pub(super) fn accumulate_moments(
        &self,
        level: Level,
        cell: &Cell,
        pass: Pass,
        scratch: &mut MomentScratch,
        mean: &mut Accumulator,
    ) {
        let rect = cell.rect;
        let moving: Vec<&MovingMember> = cell.moving.iter().map(|&index| &self.moments.0[index]).collect();
        let count = moving.iter().map(|moving| moving.parts.len()).max().unwrap_or(1);
        let computed: Vec<_> = moving.iter().map(|moving| parts_within(&moving.parts, rect)).collect();
        let mut parts: Vec<Vec<&dyn Prepared>> = self.prepared.iter().map(|whole| vec![whole.as_ref()]).collect();
        for (moving, computed) in moving.iter().zip(&computed) {
            let each = moving.parts.iter().zip(computed);
            parts[moving.member] =
                each.map(|(part, computed)| computed.as_deref().unwrap_or_else(|| part.as_ref())).collect();
        }
        let opaque = moving.iter().filter(|moving| pass.hiding.is_opaque(moving.member));
        let hiding_parts = opaque.map(|moving| moving.parts.len()).max().unwrap_or(0);
        let mut moving_hiding = Vec::with_capacity(hiding_parts);
        for part in 0..hiding_parts {
            let surfaces = parts.iter().map(|parts| parts[part * parts.len() / hiding_parts].opaque_surfaces());
            moving_hiding.push(HidingDepth::of_surfaces(surfaces, pass.plate_depth, rect));
        }
        let hiding: Vec<&HidingDepth> =
            if hiding_parts == 0 { vec![pass.hiding] } else { moving_hiding.iter().collect() };
        let members = CellMembers { count, parts };
        let MomentScratch { moments, uncovered, strips } = scratch;
        for accumulators in [&mut *moments, &mut *uncovered] {
            accumulators.resize_with(accumulators.len().max(count), Accumulator::default);
        }
        let covered = &mut moments[..count];
        self.draw_moments(level, rect, &members, OpaqueSurfacesAre::Drawn(&hiding), pass, strips, covered);
        let edges: Vec<Vec<Rect>> = hiding.iter().map(|hiding| hiding.edges(rect)).collect();
        let edge_hull = Rect::hull(edges.iter().flatten());
        if !edge_hull.is_empty() {
            let uncovered = &mut uncovered[..count];
            self.draw_moments(level, edge_hull, &members, OpaqueSurfacesAre::LeftOut(&edges), pass, strips, uncovered);
            for (index, (moment, uncovered)) in covered.iter_mut().zip(uncovered).enumerate() {
                let hiding = hiding[index * hiding.len() / count];
                moment.mix(uncovered, |x, y| hiding.coverage(x, y));
            }
        }
        mean.reset(rect, self.layer_count(), &[]);
        for moment in &moments[..count] {
            mean.add_share(level, moment, 1.0 / count as f32);
        }
    }

    /// Draws the slices within `rect` at each moment, into an accumulator for each.
    fn draw_moments(
        &self,
        level: Level,
        rect: Rect,
        members: &CellMembers,
        surfaces: OpaqueSurfacesAre,
        pass: Pass,
        strips: &mut [Strip; 3],
        accumulators: &mut [Accumulator],
    ) {
        let count = members.count;
        let [strip, uncovered, covered] = strips;
        accumulators.iter_mut().for_each(|accumulator| accumulator.reset(rect, self.layer_count(), &[]));
        for slice in self.slices {
            for &member in &slice.members {
                let whole = self.prepared[member].as_ref();
                if pass.leaves_out(whole, member, matches!(surfaces, OpaqueSurfacesAre::Drawn(_))) {
                    continue;
                }
                let parts = &members.parts[member];
                let hiding = surfaces.hiding().filter(|_| !pass.hiding.is_opaque(member));
                let hiding_parts = hiding.map_or(1, |hiding| hiding.len());
                // What has no parts, such as gas and rain, takes long to draw: once behind the smeared surfaces, which are as far away as those of each moment,
                // and once without them.
                let selects = parts.len() == 1 && hiding_parts > 1;
                if selects {
                    let touched = whole.bounds(&slice.interval).intersection(&rect);
                    if touched.is_empty() {
                        continue;
                    }
                    for (with_opaque, strip) in [(false, &mut *uncovered), (true, &mut *covered)] {
                        let depth = pass.hiding.depth_for(member, with_opaque, pass.plate_depth);
                        self.draw_member(member, whole, &slice.interval, touched, depth, 0, strip);
                    }
                }
                // Both numbers are halves, quarters or eighths of the same one.
                let pieces = parts.len().max(hiding_parts);
                for piece in 0..pieces {
                    let hiding = hiding.map(|hiding| hiding[piece * hiding_parts / pieces]);
                    let accumulators = &mut accumulators[moments_of(piece, pieces, count)];
                    if selects {
                        strip.select(uncovered, covered, |x, y| hiding.is_some_and(|it| it.coverage(x, y) > 0.0));
                        accumulators.iter_mut().for_each(|sum| sum.add_behind(level, strip, member, &[]));
                        continue;
                    }
                    let prepared = parts[piece * parts.len() / pieces];
                    let bounds = prepared.bounds(&slice.interval);
                    let depth = hiding.unwrap_or(pass.hiding).depth_for(member, hiding.is_some(), pass.plate_depth);
                    for drawn in surfaces.drawn_rects(rect, piece, pieces) {
                        let touched = bounds.intersection(&drawn);
                        if touched.is_empty() {
                            continue;
                        }
                        self.draw_member(member, prepared, &slice.interval, touched, depth, 0, strip);
                        accumulators.iter_mut().for_each(|sum| sum.add_behind(level, strip, member, &[]));
                    }
                }
            }
        }
    }
}

/// What becomes of opaque surfaces in a pass over all moments of an exposure.
#[derive(Clone, Copy)]
enum OpaqueSurfacesAre<'a> {
    /// They hide what is behind them, in equal parts of the exposure.
    Drawn(&'a [&'a HidingDepth]),
    /// They are left out. Only these pixels are needed in each of the equal parts of the exposure.
    LeftOut(&'a [Vec<Rect>]),
}

impl<'a> OpaqueSurfacesAre<'a> {
    fn hiding(self) -> Option<&'a [&'a HidingDepth]> {
        match self {
            Self::Drawn(hiding) => Some(hiding),
            Self::LeftOut(_) => None,
        }
    }

    /// The pixels of `rect` that are needed in one of `pieces` equal pieces of the exposure, without overlap.
    fn drawn_rects(self, rect: Rect, piece: usize, pieces: usize) -> Vec<Rect> {
        match self {
            Self::Drawn(_) => vec![rect],
            Self::LeftOut(edges) if edges.len() <= pieces => edges[piece * edges.len() / pieces].clone(),
            Self::LeftOut(edges) => vec![Rect::hull(edges[moments_of(piece, pieces, edges.len())].iter().flatten())],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_of_a_piece_are_its_share_of_the_exposure() {
        assert_eq!(moments_of(2, 8, 32), 8..12);
        assert_eq!(moments_of(0, 1, 24), 0..24);
    }
}
