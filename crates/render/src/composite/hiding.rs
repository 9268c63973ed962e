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
    pub(crate) fn through(prepared: &[Box<dyn Prepared + '_>], plate: &PlateFrame, size: [usize; 2]) -> Option<Self> {
        // With depths, any phenomenon may be behind the plate.
        let mut behind = prepared.iter().filter(|each| plate.depth.is_some() || each.plate_role() == PlateRole::Behind);
        let is_seen = plate.is_transparent && behind.next().is_some();
        is_seen.then(|| Self::new(prepared, &PlateFrame::default(), size))
    }

    /// That of the prepared phenomena in front of a plate, in a picture of `size` pixels.
    pub(crate) fn new(prepared: &[Box<dyn Prepared + '_>], plate: &PlateFrame, size: [usize; 2]) -> Self {
        let surfaces = prepared.iter().map(|each| each.opaque_surfaces());
        Self::of_surfaces(surfaces, plate.depth.as_ref(), Rect::from_size(size[0], size[1]))
    }

    /// That of the opaque surfaces of all members, in front of a plate of this depth, in the pixels of `rect`.
    pub(super) fn of_surfaces<'a>(
        surfaces: impl Iterator<Item = Option<&'a OpaqueSurfaces>>,
        plate_depth: Option<&Image<1>>,
        rect: Rect,
    ) -> Self {
        let mut hiding = Self::default();
        for (member, surfaces) in surfaces.enumerate() {
            let Some(surfaces) = surfaces else { continue };
            hiding.opaque.push(member);
            let nearest = hiding.nearest.get_or_insert_with(|| OpaqueSurfaces {
                rect,
                depth: Image::filled(rect.width, rect.height, [f32::INFINITY]),
                coverage: Image::filled(rect.width, rect.height, [0.0]),
            });
            let from = surfaces.rect;
            combine(&mut nearest.depth, rect, &surfaces.depth, from, f32::min);
            combine(&mut nearest.coverage, rect, &surfaces.coverage, from, f32::max);
        }
        if let (Some(nearest), Some(depth)) = (&mut hiding.nearest, plate_depth) {
            combine(&mut nearest.depth, rect, depth, Rect::from_size(depth.width(), depth.height()), f32::min);
        }
        hiding
    }

    /// What hides a phenomenon, with the opaque surfaces of others or without them, before a plate of this depth; `None` if nothing does.
    pub(crate) fn depth_for<'a>(
        &'a self,
        member: usize,
        with_opaque: bool,
        plate_depth: Option<&'a Image<1>>,
    ) -> Option<HidingRows<'a>> {
        let surfaces = self.nearest.as_ref().filter(|_| with_opaque && !self.is_opaque(member));
        let surfaces = surfaces.map(|surfaces| HidingRows { depth: &surfaces.depth, origin: surfaces.rect });
        surfaces.or(plate_depth.map(|depth| HidingRows { depth, origin: Rect::default() }))
    }

    /// Whether a phenomenon has opaque surfaces.
    pub(crate) fn is_opaque(&self, member: usize) -> bool {
        self.opaque.contains(&member)
    }

    /// Fraction of a pixel that opaque surfaces cover.
    pub(crate) fn coverage(&self, x: usize, y: usize) -> f32 {
        self.nearest
            .as_ref()
            .map_or(0.0, |OpaqueSurfaces { rect, coverage, .. }| coverage.at(x - rect.x, y - rect.y)[0])
    }

    /// Rectangles within the strip `rect` that contain all pixels that opaque surfaces cover partly.
    pub(crate) fn edges(&self, rect: Rect) -> Vec<Rect> {
        let mut edges: Vec<Rect> = Vec::new();
        if self.nearest.is_none() {
            return edges;
        }
        for x in rect.x..rect.right() {
            if !(rect.y..rect.bottom()).any(|y| is_partly_covered(self.coverage(x, y))) {
                continue;
            }
            match edges.last_mut() {
                Some(edge) if x < edge.right() + EDGE_GAP => edge.width = x + 1 - edge.x,
                _ => edges.push(Rect { x, width: 1, ..rect }),
            }
        }
        edges
    }
}

/// Whether a pixel with this coverage by opaque surfaces shows both them and what is beside them.
pub(crate) fn is_partly_covered(coverage: f32) -> bool {
    coverage > 0.0 && coverage < 1.0
}

/// Depths beyond which a phenomenon is hidden.
#[derive(Clone, Copy)]
pub(crate) struct HidingRows<'a> {
    depth: &'a Image<1>,
    /// Where the image begins in the picture.
    origin: Rect,
}

impl<'a> HidingRows<'a> {
    /// Depths of the columns of `rect` in row `y` of the picture, m.
    pub(super) fn row(&self, rect: Rect, y: usize) -> &'a [f32] {
        &self.depth.row(y - self.origin.y).as_flattened()[rect.x - self.origin.x..][..rect.width]
    }
}

/// Combines the pixels of an image with those of another one that are in both of their rectangles of the picture.
fn combine(image: &mut Image<1>, rect: Rect, other: &Image<1>, other_rect: Rect, operation: fn(f32, f32) -> f32) {
    let both = rect.intersection(&other_rect);
    for y in both.y..both.bottom() {
        let pixels = &mut image.row_mut(y - rect.y)[both.x - rect.x..][..both.width];
        let others = &other.row(y - other_rect.y)[both.x - other_rect.x..][..both.width];
        pixels.iter_mut().zip(others).for_each(|(pixel, other)| pixel[0] = operation(pixel[0], other[0]));
    }
}
