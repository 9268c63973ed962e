//! What hides phenomena: the plate, and the opaque surfaces of other phenomena.

use bansho_base::{
    image::{Image, Rect},
    phenomenon::{OpaqueSurfaces, PlateRole, Prepared},
};

use super::plate::PlateFrame;

/// Pixels between two edges from which on they are drawn apart.
const EDGE_GAP: usize = 24;

/// Depth beyond which phenomena are hidden.
#[derive(Default)]
pub(crate) struct HidingDepth {
    /// The nearest of plate and opaque surfaces; `None` if there are no such surfaces.
    nearest: Option<OpaqueSurfaces>,
    /// The members with opaque surfaces, which are hidden by the plate and sort themselves.
    opaque: Vec<usize>,
}

impl HidingDepth {
    /// That of the prepared phenomena through the transparency of a plate; `None` where nothing can be seen through it.
    pub(crate) fn through(prepared: &[Box<dyn Prepared + '_>], plate: &PlateFrame) -> Option<Self> {
        let is_behind = |each: &dyn Prepared| plate.depth.is_some() || each.plate_role() == PlateRole::Behind;
        let is_seen = plate.is_transparent && prepared.iter().any(|each| is_behind(each.as_ref()));
        is_seen.then(|| Self::new(prepared, &PlateFrame::default()))
    }

    /// That of the prepared phenomena in front of a plate.
    pub(crate) fn new(prepared: &[Box<dyn Prepared + '_>], plate: &PlateFrame) -> Self {
        let mut hiding = Self::default();
        for (member, each) in prepared.iter().enumerate() {
            let Some(surfaces) = each.opaque_surfaces() else { continue };
            hiding.opaque.push(member);
            match &mut hiding.nearest {
                None => hiding.nearest = Some(surfaces.clone()),
                Some(nearest) => {
                    combine(&mut nearest.depth, &surfaces.depth, f32::min);
                    combine(&mut nearest.coverage, &surfaces.coverage, f32::max);
                }
            }
        }
        if let (Some(nearest), Some(depth)) = (&mut hiding.nearest, &plate.depth) {
            combine(&mut nearest.depth, depth, f32::min);
        }
        hiding
    }

    /// What hides a phenomenon, with the opaque surfaces of others or without them, before a plate of this depth; `None` if nothing does.
    pub(crate) fn depth_for<'a>(
        &'a self,
        member: usize,
        with_opaque: bool,
        plate_depth: Option<&'a Image<1>>,
    ) -> Option<&'a Image<1>> {
        let surfaces = self.nearest.as_ref().filter(|_| with_opaque && !self.is_opaque(member));
        surfaces.map(|surfaces| &surfaces.depth).or(plate_depth)
    }

    /// Whether a phenomenon has opaque surfaces.
    pub(crate) fn is_opaque(&self, member: usize) -> bool {
        self.opaque.contains(&member)
    }

    /// Fraction of a pixel that opaque surfaces cover.
    pub(crate) fn coverage(&self, x: usize, y: usize) -> f32 {
        self.nearest.as_ref().map_or(0.0, |surfaces| surfaces.coverage.at(x, y)[0])
    }

    /// Rectangles within the strip `rect` that contain all pixels that opaque surfaces cover partly.
    pub(crate) fn edges(&self, rect: Rect) -> Vec<Rect> {
        let mut edges: Vec<Rect> = Vec::new();
        if self.nearest.is_none() {
            return edges;
        }
        let is_partly = |x: usize, y: usize| (0.001..0.999).contains(&self.coverage(x, y));
        for x in (rect.x..rect.right()).filter(|x| (rect.y..rect.bottom()).any(|y| is_partly(*x, y))) {
            match edges.last_mut() {
                Some(edge) if x < edge.right() + EDGE_GAP => edge.width = x + 1 - edge.x,
                _ => edges.push(Rect { x, width: 1, ..rect }),
            }
        }
        edges
    }
}

/// Combines the pixels of an image with those of another one of the same size.
fn combine(image: &mut Image<1>, other: &Image<1>, operation: fn(f32, f32) -> f32) {
    let pixels = image.pixels_mut().iter_mut().zip(other.pixels());
    pixels.for_each(|(pixel, other)| pixel[0] = operation(pixel[0], other[0]));
}
