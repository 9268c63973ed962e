//! The pixels of a frame: what each shows of the obstacles, antialiased, with motion blur.

use std::sync::Arc;

use bansho_base::{
    host::{
        observer::{Cancelled, Observer, check},
        parallel::prelude::*,
    },
    image::{Image, Rect},
    math::{DVec2, DVec3},
    phenomenon::{
        OpaqueSurfaces, Prepared,
        strip::{DepthInterval, Strip, View},
        surroundings::Surroundings,
    },
};

use super::{
    Solids,
    pose::{Pose, SurfacePoint, poses},
    shade::Shading,
};

/// Rays of a pixel that shows an edge, and of one that shows motion.
const EDGE_SAMPLES: usize = 16;
const MOTION_SAMPLES: usize = 32;
/// Cosine of the angle between the normals at the corners of a pixel up to which it shows one smooth surface.
const SMOOTH_COS: f64 = 0.97;

/// A pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Pixel {
    /// Mean of the part that is covered, ACEScg, cd/m^2.
    radiance: [f32; 3],
    /// 0 to 1.
    coverage: f32,
    /// Of the nearest surface, m; infinite if there is none.
    depth: f32,
    /// Depth of the farthest surface, beyond which nothing is seen in that part, m.
    opaque_depth: f32,
}

impl Pixel {
    const EMPTY: Self = Self { radiance: [0.0; 3], coverage: 0.0, depth: f32::INFINITY, opaque_depth: f32::INFINITY };
}

/// What the pixels of a view show of the obstacles.
#[derive(Debug)]
pub(super) struct TracedPixels {
    /// The pixels that may show one.
    rect: Rect,
    /// Those that may show one that moves in the picture.
    moving_rect: Rect,
    pixels: Vec<Pixel>,
    surfaces: OpaqueSurfaces,
}

/// A frame of the obstacles.
pub(super) struct PreparedSolids(Arc<TracedPixels>);

/// Position of ray `index` of `count`, a power of two, within its pixel (Hammersley).
fn sample_offset(index: usize, count: usize) -> DVec2 {
    let reversed = (index as u8).reverse_bits() >> (8 - count.ilog2());
    DVec2::new(index as f64 + 0.5, f64::from(reversed) + 0.5) / count as f64
}

/// Depths that the obstacles fill during an exposure, overlapping ones merged.
pub(super) fn depth_intervals(solids: &Solids, view: &View) -> Vec<DepthInterval> {
    let (poses, _) = poses(solids, view);
    let mut depths: Vec<[f64; 2]> = poses.iter().flat_map(|pose| pose.depths().collect::<Vec<_>>()).collect();
    depths.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut intervals: Vec<DepthInterval> = Vec::new();
    for [near, far] in depths {
        let far = far.next_up();
        match intervals.last_mut() {
            Some(last) if near <= last.far => last.far = last.far.max(far),
            _ => intervals.push(DepthInterval { near, far }),
        }
    }
    intervals
}

/// The rectangle of the picture that each obstacle may cover in any of the poses.
fn bounds(poses: &[Pose], view: &View) -> Vec<Rect> {
    let mut all = poses[0].bounds();
    for pose in &poses[1..] {
        all.iter_mut().zip(pose.bounds()).for_each(|(all, one)| *all = [all[0].min(one[0]), all[1].max(one[1])]);
    }
    let picture = DVec2::from(view.size.map(|side| side as f64));
    let mut rects = Vec::with_capacity(all.len());
    for [low, high] in all {
        let [x, y] = low.floor().clamp(DVec2::ZERO, picture).to_array().map(|edge| edge as usize);
        let [right, bottom] = high.ceil().clamp(DVec2::ZERO, picture).to_array().map(|edge| edge as usize);
        let rect = Rect { x, y, width: right.saturating_sub(x), height: bottom.saturating_sub(y) };
        rects.push(rect.intersection(&view.window));
    }
    rects
}

/// Whether a pixel is in one of some rectangles.
fn is_in_any(rects: &[Rect], x: usize, y: usize) -> bool {
    rects.iter().any(|rect| (rect.x..rect.right()).contains(&x) && (rect.y..rect.bottom()).contains(&y))
}

impl PreparedSolids {
    /// The pixels of the view's window: traced, or known from an earlier frame.
    ///
    /// # Errors
    /// The observer asked to stop.
    pub(super) fn new(
        solids: &Solids,
        view: &View,
        surroundings: &Surroundings,
        observer: &dyn Observer,
    ) -> Result<Self, Cancelled> {
        let (poses, moves) = poses(solids, view);
        let trace = || TracedPixels::new(&poses, &moves, view, surroundings, observer);
        let pixels = match poses.as_slice() {
            [pose] => solids.cache.pixels(pose, view, surroundings, trace)?,
            _ => Arc::new(trace()?),
        };
        Ok(Self(pixels))
    }
}

/// The rectangle of the picture that the obstacles may cover while the shutter is open.
pub(super) fn picture_bounds(solids: &Solids, view: &View) -> Rect {
    let (poses, _) = poses(solids, view);
    Rect::hull(&bounds(&poses, view))
}

impl TracedPixels {
    /// Traces the pixels of the view's window.
    fn new(
        poses: &[Pose],
        moves: &[bool],
        view: &View,
        surroundings: &Surroundings,
        observer: &dyn Observer,
    ) -> Result<Self, Cancelled> {
        let rects = bounds(poses, view);
        let rect = Rect::hull(&rects);
        let moving: Vec<Rect> = rects.iter().zip(moves).filter(|(_, moves)| **moves).map(|(rect, _)| *rect).collect();
        let shading = Shading::new(surroundings);
        let tracer = Tracer { poses, shading: &shading, rects: &rects, moving: &moving };
        let corners = tracer.corners(rect, observer)?;
        let mut pixels = vec![Pixel::EMPTY; rect.width * rect.height];
        pixels.par_chunks_mut(rect.width.max(1)).enumerate().try_for_each(|(y, row)| {
            check(observer)?;
            for (x, pixel) in row.iter_mut().enumerate() {
                let first = y * (rect.width + 1) + x;
                let around = [first, first + 1, first + rect.width + 1, first + rect.width + 2];
                *pixel = tracer.pixel([rect.x + x, rect.y + y], around.map(|index| corners[index]));
            }
            Ok(())
        })?;
        Ok(Self { rect, moving_rect: Rect::hull(&moving), surfaces: opaque_surfaces(rect, &pixels), pixels })
    }
}

/// The opaque surfaces of the pixels of a rectangle.
fn opaque_surfaces(rect: Rect, pixels: &[Pixel]) -> OpaqueSurfaces {
    let depth = Image::filled(rect.width, rect.height, [f32::INFINITY]);
    let coverage = Image::filled(rect.width, rect.height, [0.0]);
    let mut surfaces = OpaqueSurfaces { rect, depth, coverage };
    let images = surfaces.depth.pixels_mut().iter_mut().zip(surfaces.coverage.pixels_mut());
    for ((depth, coverage), pixel) in images.zip(pixels).filter(|(_, pixel)| pixel.coverage > 0.0) {
        *depth = [pixel.opaque_depth];
        *coverage = [pixel.coverage];
    }
    surfaces
}

/// The obstacles at a moment of an exposure, traced when they are drawn: the pixels of all moments would take gigabytes.
pub(super) struct UntracedSolids<'a> {
    pose: Pose<'a>,
    shading: Shading<'a>,
    /// The rectangle of the picture that each obstacle may cover.
    rects: Vec<Rect>,
    rect: Rect,
}

impl<'a> UntracedSolids<'a> {
    /// The obstacles in the middle of the exposure of a view.
    pub(super) fn new(solids: &'a Solids, view: &View, surroundings: &'a Surroundings<'a>) -> Self {
        let pose = Pose::new(solids, view, view.shutter.middle());
        let rects = bounds(std::slice::from_ref(&pose), view);
        let rect = Rect::hull(&rects);
        Self { pose, shading: Shading::new(surroundings), rects, rect }
    }

    /// Traces the pixels of a rectangle.
    fn trace(&self, rect: Rect) -> PreparedSolids {
        let rect = rect.intersection(&self.rect);
        let poses = std::slice::from_ref(&self.pose);
        let tracer = Tracer { poses, shading: &self.shading, rects: &self.rects, moving: &[] };
        let mut pixels = Vec::with_capacity(rect.width * rect.height);
        // Two rows of corners at a time: those of a whole picture would be another 40 bytes for each pixel.
        let mut rows = [vec![None; rect.width + 1], vec![None; rect.width + 1]];
        if !rect.is_empty() {
            tracer.corner_row([rect.x, rect.y], &mut rows[1]);
        }
        for y in rect.y..rect.bottom() {
            rows.swap(0, 1);
            let [upper, lower] = &mut rows;
            tracer.corner_row([rect.x, y + 1], lower);
            for x in 0..rect.width {
                pixels.push(tracer.pixel([rect.x + x, y], [upper[x], upper[x + 1], lower[x], lower[x + 1]]));
            }
        }
        let surfaces = opaque_surfaces(rect, &pixels);
        PreparedSolids(Arc::new(TracedPixels { rect, moving_rect: rect, pixels, surfaces }))
    }
}

impl Prepared for UntracedSolids<'_> {
    fn bounds(&self, _slice: &DepthInterval) -> Rect {
        self.rect
    }

    fn within(&self, rect: Rect) -> Option<Box<dyn Prepared + '_>> {
        Some(Box::new(self.trace(rect)))
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        self.trace(strip.rect).draw(slice, strip);
    }
}

/// The surface at a corner of a pixel: index of the solid and normal.
type Corner = Option<(usize, DVec3)>;

struct Tracer<'a> {
    poses: &'a [Pose<'a>],
    shading: &'a Shading<'a>,
    /// The pixels of each obstacle.
    rects: &'a [Rect],
    /// Those of each obstacle that moves in the picture.
    moving: &'a [Rect],
}

/// Whether two corners show one smooth surface, or both nothing.
fn is_smooth(a: Corner, b: Corner) -> bool {
    match (a, b) {
        (None, None) => true,
        (Some((solid, normal)), Some((other, other_normal))) => solid == other && normal.dot(other_normal) > SMOOTH_COS,
        _ => false,
    }
}

impl Tracer<'_> {
    /// The pose in the middle of the exposure.
    fn middle(&self) -> &Pose<'_> {
        &self.poses[self.poses.len() / 2]
    }

    /// The surfaces at all corners of the pixels of a rectangle in the middle of the exposure, row by row.
    fn corners(&self, rect: Rect, observer: &dyn Observer) -> Result<Vec<Corner>, Cancelled> {
        let width = rect.width + 1;
        let mut corners = vec![None; width * (rect.height + 1)];
        corners.par_chunks_mut(width).enumerate().try_for_each(|(y, row)| {
            check(observer)?;
            self.corner_row([rect.x, rect.y + y], row);
            Ok(())
        })?;
        Ok(corners)
    }

    /// The surfaces at corners from column `first` on in row `y`.
    fn corner_row(&self, [first, y]: [usize; 2], row: &mut [Corner]) {
        for (x, corner) in row.iter_mut().enumerate() {
            let x = first + x;
            // A corner belongs to four pixels.
            let is_near = [
                [x, y],
                [x.saturating_sub(1), y.saturating_sub(1)],
                [x, y.saturating_sub(1)],
                [x.saturating_sub(1), y],
            ]
            .into_iter()
            .any(|[x, y]| is_in_any(self.rects, x, y));
            *corner = None;
            if is_near {
                let surface = self.middle().seen(DVec2::new(x as f64, y as f64));
                *corner = surface.map(|surface| (surface.index, surface.normal));
            }
        }
    }

    /// A pixel, with the surfaces at its corners.
    fn pixel(&self, [x, y]: [usize; 2], corners: [Corner; 4]) -> Pixel {
        if !is_in_any(self.rects, x, y) {
            return Pixel::EMPTY;
        }
        let position = DVec2::new(x as f64, y as f64);
        if is_in_any(self.moving, x, y) {
            // Evenly spaced in time: ray i is at the time 7 i modulo 32.
            return self.supersampled::<MOTION_SAMPLES>(position, &[2, 6, 10, 14, 18, 22, 26, 30]);
        }
        // Corners are shared by four pixels, so that a pixel within a surface takes two rays.
        if corners.iter().any(|corner| !is_smooth(corners[0], *corner)) {
            return self.supersampled::<EDGE_SAMPLES>(position, &[0]);
        }
        // What is smaller than a pixel may lie between corners that show the same: the ray through the middle finds some of it, and is needed for
        // shading anyway.
        let center = self.middle().seen(position + 0.5);
        if !is_smooth(corners[0], center.map(|surface| (surface.index, surface.normal))) {
            return self.supersampled::<EDGE_SAMPLES>(position, &[0]);
        }
        center.map_or(Pixel::EMPTY, |surface| self.covered(&surface, self.middle()))
    }

    /// A pixel that shows one surface.
    fn covered(&self, surface: &SurfacePoint, pose: &Pose) -> Pixel {
        let depth = surface.t as f32;
        Pixel { radiance: self.shading.radiance(surface, pose), coverage: 1.0, depth, opaque_depth: depth }
    }

    /// A pixel by many rays, each at its own time. Where they all meet one smooth surface, it is shaded where the rays `shaded` meet it.
    fn supersampled<const N: usize>(&self, position: DVec2, shaded: &[usize]) -> Pixel {
        let mut samples: [Option<(SurfacePoint, &Pose)>; N] = [None; N];
        for (index, sample) in samples.iter_mut().enumerate() {
            // The times are in another order than the columns, so that motion does not shear an edge.
            let pose = &self.poses[(index * 7 % N) * self.poses.len() / N];
            *sample = pose.seen(position + sample_offset(index, N)).map(|surface| (surface, pose));
        }
        let corners = samples.map(|sample| sample.map(|(surface, _)| (surface.index, surface.normal)));
        // Rays are cheap, but shading casts shadows of all lights: one smooth surface is shaded at few of its rays, unless lights move during the
        // exposure.
        let is_one = corners.iter().all(|corner| is_smooth(corners[0], *corner))
            && !(self.shading.lights_move() && self.poses.len() > 1);
        let hits = samples.iter().flatten().count();
        if hits == 0 {
            return Pixel::EMPTY;
        }
        let mut pixel = Pixel { coverage: hits as f32 / N as f32, opaque_depth: 0.0, ..Pixel::EMPTY };
        for (index, (surface, pose)) in samples.iter().flatten().enumerate() {
            let shades = if is_one { shaded.contains(&index) } else { true };
            if shades {
                // The mean of what hits: coverage is applied when the scene without obstacles is mixed in.
                let weight = if is_one { 1.0 / shaded.len() as f32 } else { 1.0 / hits as f32 };
                let radiance = self.shading.radiance(surface, pose);
                (0..3).for_each(|c| pixel.radiance[c] += radiance[c] * weight);
            }
            pixel.depth = pixel.depth.min(surface.t as f32);
            pixel.opaque_depth = pixel.opaque_depth.max(surface.t as f32);
        }
        pixel
    }
}

impl Prepared for PreparedSolids {
    fn bounds(&self, _slice: &DepthInterval) -> Rect {
        self.0.rect
    }

    fn moving_bounds(&self) -> Rect {
        self.0.moving_rect
    }

    fn opaque_surfaces(&self) -> Option<&OpaqueSurfaces> {
        Some(&self.0.surfaces)
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        let TracedPixels { rect, pixels, .. } = &*self.0;
        let touched = rect.intersection(&strip.rect);
        for y in touched.y..touched.bottom() {
            for x in touched.x..touched.right() {
                let pixel = &pixels[(y - rect.y) * rect.width + x - rect.x];
                let index = (y - strip.rect.y) * strip.rect.width + x - strip.rect.x;
                let is_drawn = pixel.coverage > 0.0 && slice.contains(f64::from(pixel.depth));
                if is_drawn && strip.visible(index, pixel.depth) {
                    strip.add_behind(index, pixel.radiance, [0.0; 3], pixel.depth);
                }
            }
        }
    }
}
