//! Drawing targets of phenomena: strips of a picture, each owned by one thread.

use std::{ops::Range, sync::Arc};

use fearless_simd::{Simd, f32x16, prelude::*};
use glam::{DVec2, DVec3};

use crate::{
    camera::{Camera, CameraParameters},
    geometry::point_cloud::local_origin,
    image::Rect,
    math::{self, MulAdd},
};

use super::aov::{blend, reset};

pub use super::aov::{AovDescriptor, AovPlane, AovRule};

/// When the shutter is open, seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shutter {
    /// When it opens.
    pub open: f64,
    /// When it closes; not before `open`.
    pub close: f64,
}

impl Shutter {
    /// Middle of the exposure.
    pub fn middle(&self) -> f64 {
        0.5 * (self.open + self.close)
    }

    /// Exposure time.
    pub fn duration(&self) -> f64 {
        self.close - self.open
    }

    /// Midpoint of interval `index` of `count` equal intervals.
    pub fn instant(&self, index: usize, count: usize) -> f64 {
        self.open + self.duration() * (index as f64 + 0.5) / count as f64
    }

    /// Interval `index` of `count` equal intervals.
    #[must_use]
    pub fn part(&self, index: usize, count: usize) -> Self {
        let [open, close] = [index, index + 1].map(|index| self.open + self.duration() * index as f64 / count as f64);
        // The last interval ends exactly where the whole one does.
        Self { open, close: if index + 1 == count { self.close } else { close } }
    }

    /// Number of equal parts of the exposure, a power of two, in each of which a flame hardly flickers, and its light of a radius (m) hardly moves that moves
    /// along a path of a length (m).
    #[must_use]
    pub fn light_parts(&self, path: f64, radius: f64) -> usize {
        /// Motion that makes no difference to what is lit, m; and most time samples.
        const MIN_STEP: f64 = 0.05;
        const MAX_SAMPLES: usize = 16;
        /// Flames hardly flicker in a shorter time, s.
        const MIN_DURATION: f64 = 1.0 / 24.0;
        let by_path = parts_of_motion(path, MIN_STEP.max(0.5 * radius), MAX_SAMPLES);
        by_path.max(parts_of_motion(self.duration() * (1.0 - 1e-9), MIN_DURATION, MAX_SAMPLES)).next_power_of_two()
    }

    /// Most parts in which things that move during the exposure are drawn: 32 in the usual exposures of films, in which nothing moves far, and 128 in longer
    /// ones, whose smears would show single images otherwise.
    #[must_use]
    pub fn max_parts(&self) -> usize {
        /// The longest usual exposure, s.
        const USUAL_S: f64 = 1.0 / 24.0;
        if self.duration() <= USUAL_S * (1.0 + 1e-9) { 32 } else { 128 }
    }

    /// Five times from its opening to its closing, evenly spaced: enough to measure the path of what moves.
    #[must_use]
    pub fn path_times(&self) -> [f64; 5] {
        std::array::from_fn(|index| self.open + self.duration() * 0.25 * index as f64)
    }
}

/// A half-open interval of depth, m: it contains depth z if `near <= z < far`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthInterval {
    /// Nearest depth.
    pub near: f64,
    /// Depth at which it ends.
    pub far: f64,
}

impl DepthInterval {
    /// Everything in front of the camera.
    pub const ALL: Self = Self { near: 0.0, far: f64::INFINITY };

    /// Whether it contains `depth`.
    pub fn contains(&self, depth: f64) -> bool {
        self.near <= depth && depth < self.far
    }

    /// Whether the two intervals overlap.
    pub fn overlaps(&self, other: &Self) -> bool {
        self.near < other.far && other.near < self.far
    }
}

/// Motion blur: motion per time sample, pixels, and the maximum number of time samples.
const PIXELS_PER_INSTANT: f64 = 1.0;
const MAX_INSTANTS: f64 = 16.0;

/// One exposure seen by one camera.
#[derive(Clone, Debug)]
pub struct View {
    /// Camera at the middle of the exposure.
    pub camera: Camera,
    /// Parameters of the camera over time, on the exposure's side of every cut: no motion, be it in the open shutter or to the next frame, crosses one.
    pub camera_parameters: CameraParameters,
    /// When the shutter is open.
    pub shutter: Shutter,
    /// Middle of the next frame's exposure, for motion vectors, s.
    pub next_middle: f64,
    /// Size of the whole picture including overscan, pixels.
    pub size: [usize; 2],
    /// Overscan on every side, pixels of the picture at full resolution.
    pub overscan: usize,
    /// Size of the whole picture including overscan at full resolution.
    pub full_size: [usize; 2],
    /// Side of a pixel of this view in pixels of the picture at full resolution: 1, but more for some mirrored views.
    pub pixel_size: usize,
    /// The region of the picture that is drawn.
    pub window: Rect,
    /// Height of the horizontal mirror in which the picture is seen, m.
    pub mirror: Option<f64>,
    /// Luminance of display white, cd/m^2, if known: light far below it need not be drawn.
    pub white_luminance: Option<f64>,
    /// Whether the scene has a plate. Strips have depths that hide also where visible solids are.
    pub has_plate: bool,
    /// Whether the glare of the lens is added to the picture as a whole, so that phenomena add none of their own.
    pub glare_is_added: bool,
    /// Whether AOVs are requested; strips then have planes for them.
    pub aovs_requested: bool,
    /// Where the positions of exported particles count from, m: the same for all frames of a shot.
    pub export_origin: [f64; 3],
    /// In a loop: the same view one loop period earlier or later, whichever is nearer, for the crossfade between runs.
    pub adjacent_loop_view: Option<Arc<Self>>,
}

impl View {
    /// The view for `shutter` of a picture of `size` pixels plus `overscan` pixels on every side.
    pub fn new(
        camera_parameters: CameraParameters,
        shutter: Shutter,
        next_middle: f64,
        size: [usize; 2],
        overscan: usize,
    ) -> Self {
        let middle = shutter.middle();
        let export_origin = local_origin(camera_parameters.position.at(0.0));
        let camera_parameters = camera_parameters.of_exposure(middle, next_middle - middle);
        let camera = camera_parameters.at(middle, size).with_overscan(overscan);
        let size = size.map(|side| side + 2 * overscan);
        Self {
            camera,
            camera_parameters,
            shutter,
            next_middle,
            size,
            overscan,
            full_size: size,
            pixel_size: 1,
            window: Rect::from_size(size[0], size[1]),
            mirror: None,
            white_luminance: None,
            has_plate: false,
            glare_is_added: false,
            aovs_requested: false,
            export_origin,
            adjacent_loop_view: None,
        }
    }

    /// The view of another region of the picture.
    pub fn with_window(self, window: Rect) -> Self {
        self.with_adjacent_loop_view(|view| view.window = window)
    }

    /// The view of the whole picture.
    #[must_use]
    pub fn with_whole_window(&self) -> Self {
        self.clone().with_window(Rect::from_size(self.size[0], self.size[1]))
    }

    /// The view within a loop of `period` seconds.
    pub fn in_loop(self, period: f64) -> Self {
        let offset = if self.shutter.middle() < 0.5 * period { period } else { -period };
        let shutter = Shutter { open: self.shutter.open + offset, close: self.shutter.close + offset };
        let adjacent = Self { shutter, next_middle: self.next_middle + offset, ..self.clone() };
        Self { adjacent_loop_view: Some(Arc::new(adjacent)), ..self }
    }

    /// Applies `change` to this view and to the adjacent one.
    fn with_adjacent_loop_view(mut self, change: impl Fn(&mut Self)) -> Self {
        change(&mut self);
        if let Some(other) = &mut self.adjacent_loop_view {
            change(Arc::make_mut(other));
        }
        self
    }

    /// The view of the whole picture as seen in a horizontal mirror at `height`, m.
    pub fn mirrored(&self, height: f64) -> Self {
        let mirrored = self.clone().with_adjacent_loop_view(|view| {
            view.camera = view.camera.mirrored(height);
            view.mirror = Some(height);
            view.aovs_requested = false;
        });
        mirrored.with_window(Rect::from_size(self.size[0], self.size[1]))
    }

    /// The view of the whole picture, at full resolution before, in pixels `side` times as wide and as high.
    pub fn with_pixel_size(self, side: usize) -> Self {
        let size = self.full_size.map(|pixels| pixels.div_ceil(side));
        let coarse = self.with_adjacent_loop_view(|view| {
            view.camera = view.camera.with_pixel_size(side);
            (view.size, view.pixel_size) = (size, side);
        });
        coarse.with_window(Rect::from_size(size[0], size[1]))
    }

    /// The view during part `index` of `count` equal parts of the exposure, with a camera on the same side of every cut.
    #[must_use]
    pub fn part(&self, index: usize, count: usize) -> Self {
        self.clone().with_adjacent_loop_view(|view| {
            let shutter = view.shutter.part(index, count);
            view.next_middle += shutter.middle() - view.shutter.middle();
            view.camera = view.camera_at(shutter.middle());
            view.shutter = shutter;
        })
    }

    /// The view at the middle of the exposure, without motion.
    #[must_use]
    pub fn at_middle(&self) -> Self {
        self.clone().with_adjacent_loop_view(|view| {
            let middle = view.shutter.middle();
            view.shutter = Shutter { open: middle, close: middle };
        })
    }

    /// The camera at [`Shutter::path_times`], to measure the motion of points in the picture.
    #[must_use]
    pub fn path_cameras(&self) -> PathCameras {
        PathCameras(self.shutter.path_times().map(|t| (t, self.camera_at(t))))
    }

    /// Largest motion of the sky in the picture during the exposure, pixels.
    pub fn motion_pixels(&self) -> f64 {
        // Sampled at the corners, the middle, and near the middles of the edges, since the corners of a dome lie outside its circle.
        const SAMPLE_POSITIONS: [[f64; 2]; 9] = [
            [0.0, 0.0],
            [1.0, 0.0],
            [0.0, 1.0],
            [1.0, 1.0],
            [0.5, 0.5],
            [0.5, 0.02],
            [0.02, 0.5],
            [0.98, 0.5],
            [0.5, 0.98],
        ];
        /// How much longer the path of the sky is than from its first to its last position where it is not nearly straight.
        const DETOUR: f64 = 1.05;
        let cameras = self.path_cameras();
        if cameras.is_still() {
            return 0.0;
        }
        let [(_, open), .., (_, close)] = cameras.0;
        let mut largest: f64 = 0.0;
        for position in SAMPLE_POSITIONS {
            let displacement = angle_between(&open, &close, position) * open.focal_pixels;
            // A camera that shakes may end where it began.
            let pairs = cameras.0.windows(2);
            let path: f64 = pairs.map(|pair| angle_between(&pair[0].1, &pair[1].1, position) * open.focal_pixels).sum();
            largest = largest.max(if path > DETOUR * displacement + 0.1 { path } else { displacement });
        }
        largest
    }

    /// Cameras at the time samples of the exposure, with equal weights. Their number follows from the motion of distant objects in the picture; it is
    /// one for a static camera.
    pub fn cameras(&self) -> Vec<Camera> {
        self.cameras_at_most(MAX_INSTANTS)
    }

    /// Like [`cameras`](Self::cameras) with up to `max_count` time samples, for small sharp objects, which need more of them.
    pub fn cameras_at_most(&self, max_count: f64) -> Vec<Camera> {
        let count = (self.motion_pixels() / PIXELS_PER_INSTANT).ceil().clamp(1.0, max_count) as usize;
        if count == 1 {
            return vec![self.camera];
        }
        (0..count).map(|instant| self.camera_at(self.shutter.instant(instant, count))).collect()
    }

    /// The camera at time `t`.
    pub fn camera_at(&self, t: f64) -> Camera {
        let display = self.full_size.map(|side| side - 2 * self.overscan);
        let camera = self.camera_parameters.at(t, display).with_overscan(self.overscan);
        let camera = if self.pixel_size > 1 { camera.with_pixel_size(self.pixel_size) } else { camera };
        self.mirror.map_or(camera, |height| camera.mirrored(height))
    }
}

/// Cameras from the opening to the closing of the shutter.
#[derive(Clone, Copy, Debug)]
pub struct PathCameras([(f64, Camera); 5]);

impl PathCameras {
    /// Whether the camera stands still.
    #[must_use]
    pub fn is_still(&self) -> bool {
        self.0.iter().all(|(_, camera)| *camera == self.0[0].1)
    }

    /// Length of the path of a point, given at any time, in the picture, pixels. For points beside or behind the camera it is measured as in the middle of the
    /// picture.
    pub fn path_pixels(&self, point: impl Fn(f64) -> DVec3) -> f64 {
        let positions = self.0.map(|(t, camera)| {
            let direction = camera.point_in_camera(point(t)).try_normalize().unwrap_or_default();
            (direction, camera.focal_pixels)
        });
        let motions = positions.windows(2).map(|pair| {
            let [(from, from_focal), (to, to_focal)] = [pair[0], pair[1]];
            // A zoom moves what is beside the optical axis.
            (to - from).length() * to_focal + (to_focal - from_focal).abs() * math::hypot(to.x, to.y)
        });
        motions.sum()
    }
}

/// The angle between the directions of two cameras at a position in the picture, as fractions of its size, rad; 0 where a lens shows nothing there.
fn angle_between(before: &Camera, after: &Camera, [x, y]: [f64; 2]) -> f64 {
    let [from, to] = [before, after].map(|camera| camera.direction(DVec2::new(x * camera.size[0], y * camera.size[1])));
    from.zip(to).map_or(0.0, |(from, to)| math::acos(from.normalize().dot(to.normalize()).clamp(-1.0, 1.0)))
}

/// Number of equal parts of an exposure so that what moves by `pixels` moves by at most `pixels_per_part` in each, at most `max_count`.
#[must_use]
pub fn parts_of_motion(pixels: f64, pixels_per_part: f64, max_count: usize) -> usize {
    (pixels / pixels_per_part).ceil().clamp(1.0, max_count as f64) as usize
}

/// A region of the picture that one thread draws: radiance L and transmittance T of one depth slice.
///
/// Planes contain `rect.width * rect.height` values, row by row. L is premultiplied ACEScg, luminance in cd/m^2.
#[derive(Clone, Debug, Default)]
pub struct Strip {
    /// The pixels in the whole picture.
    pub rect: Rect,
    /// Red, green and blue of L.
    pub radiance: [Vec<f32>; 3],
    /// Red, green and blue of T; unused until something absorbs.
    transmittance: [Vec<f32>; 3],
    /// Depth of the nearest sample, m; infinite without samples.
    pub depth: Vec<f32>,
    /// Depth of the plate, m; empty without a plate. Samples at or behind it are hidden.
    plate_depth: Vec<f32>,
    /// The phenomenon's AOVs in the order of its descriptors; empty if not requested.
    pub aovs: Vec<AovPlane>,
    absorption: Absorption,
}

/// Planes of a strip with gray transmittance, for compositing samples front to back, one pixel at a time: `L += T l; T *= t`.
#[derive(Debug)]
pub struct GrayPlanes<'a> {
    /// Red, green and blue of L.
    pub radiance: [&'a mut [f32]; 3],
    /// T.
    pub transmittance: &'a mut [f32],
    /// Depth of the nearest sample, m.
    pub depth: &'a mut [f32],
    /// Depth of the plate, m; empty without a plate.
    pub plate_depth: &'a [f32],
}

/// The planes of T that are in use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
enum Absorption {
    /// None: T is 1.
    #[default]
    None,
    /// The first, used for all three colors: soot absorbs all colors equally.
    Gray,
    /// All three.
    Colored,
}

impl Absorption {
    fn planes(self) -> usize {
        match self {
            Self::None => 0,
            Self::Gray => 1,
            Self::Colored => 3,
        }
    }
}

impl Strip {
    /// Resets it to an empty strip over `rect`.
    ///
    /// `plate_depth` returns row `y` of the plate's depth over the width of the whole picture; `aovs` is the number of AOVs.
    pub fn reset<'a>(&mut self, rect: Rect, plate_depth: Option<&dyn Fn(usize) -> &'a [f32]>, aovs: usize) {
        let pixels = rect.width * rect.height;
        self.rect = rect;
        self.absorption = Absorption::None;
        self.radiance.iter_mut().for_each(|plane| reset(plane, pixels, 0.0));
        reset(&mut self.depth, pixels, f32::INFINITY);
        self.plate_depth.clear();
        if let Some(row) = plate_depth {
            for y in rect.y..rect.bottom() {
                self.plate_depth.extend_from_slice(&row(y)[rect.x..rect.right()]);
            }
        }
        self.aovs.resize_with(aovs, AovPlane::default);
        self.aovs.iter_mut().for_each(|plane| plane.reset(pixels));
    }

    /// Hides samples at and beyond these depths, m, as a plate does: `row` returns those of the strip's columns in row `y` of the picture.
    pub fn hide_beyond<'a>(&mut self, row: impl Fn(usize) -> &'a [f32]) {
        self.plate_depth.clear();
        (self.rect.y..self.rect.bottom()).for_each(|y| self.plate_depth.extend_from_slice(row(y)));
    }

    /// Number of pixels in the strip.
    pub fn len(&self) -> usize {
        self.rect.width * self.rect.height
    }

    /// Whether the strip contains no pixel.
    pub fn is_empty(&self) -> bool {
        self.rect.is_empty()
    }

    /// Depth of the plate, m; infinite without a plate.
    pub fn plate_depth(&self, index: usize) -> f32 {
        self.plate_depth.get(index).copied().unwrap_or(f32::INFINITY)
    }

    /// Depths of the plate in consecutive pixels, m; empty without a plate.
    pub fn plate_depths(&self, pixels: Range<usize>) -> &[f32] {
        self.plate_depth.get(pixels).unwrap_or_default()
    }

    /// Whether a plate's depth may hide samples.
    pub fn has_plate(&self) -> bool {
        !self.plate_depth.is_empty()
    }

    /// Whether a sample at `depth` is in front of the plate.
    pub fn visible(&self, index: usize, depth: f32) -> bool {
        depth < self.plate_depth(index)
    }

    /// T at pixel `index`.
    pub fn transmittance(&self, index: usize) -> [f32; 3] {
        match self.absorption {
            Absorption::None => [1.0; 3],
            Absorption::Gray => [self.transmittance[0][index]; 3],
            Absorption::Colored => [0, 1, 2].map(|c| self.transmittance[c][index]),
        }
    }

    /// Planes of T, `None` if nothing absorbs; three times the same plane if T is gray.
    pub fn transmittance_planes(&self) -> Option<[&[f32]; 3]> {
        let [red, green, blue] = &self.transmittance;
        match self.absorption {
            Absorption::None => None,
            Absorption::Gray => Some([red, red, red]),
            Absorption::Colored => Some([red, green, blue]),
        }
    }

    /// Mutable planes of T, initially 1.
    pub fn transmittance_planes_mut(&mut self) -> &mut [Vec<f32>; 3] {
        self.begin_gray();
        if self.absorption == Absorption::Gray {
            let [red, green, blue] = &mut self.transmittance;
            green.clone_from(red);
            blue.clone_from(red);
            self.absorption = Absorption::Colored;
        }
        &mut self.transmittance
    }

    /// Mutable planes with gray transmittance; `None` once T is colored.
    pub fn gray_planes_mut(&mut self) -> Option<GrayPlanes<'_>> {
        self.begin_gray();
        let [red, green, blue] = &mut self.radiance;
        (self.absorption == Absorption::Gray).then_some(GrayPlanes {
            radiance: [red, green, blue],
            transmittance: &mut self.transmittance[0],
            depth: &mut self.depth,
            plate_depth: &self.plate_depth,
        })
    }

    fn upgrade_absorption(&mut self, absorption: Absorption) {
        match absorption {
            Absorption::None => {}
            Absorption::Gray => self.begin_gray(),
            Absorption::Colored => _ = self.transmittance_planes_mut(),
        }
    }

    fn begin_gray(&mut self) {
        if self.absorption == Absorption::None {
            let pixels = self.len();
            reset(&mut self.transmittance[0], pixels, 1.0);
            self.absorption = Absorption::Gray;
        }
    }

    /// An empty strip over the same pixels with the same plate.
    pub fn empty_like(&self) -> Self {
        let mut empty = Self::default();
        empty.reset(self.rect, None, self.aovs.len());
        empty.plate_depth.clone_from(&self.plate_depth);
        empty
    }

    /// Crossfades with another strip over the same pixels: this strip has the weight `own_weight`, the other one the rest.
    pub fn crossfade(&mut self, mut other: Self, own_weight: f32, aovs: &[AovDescriptor]) {
        for (own, other) in self.radiance.iter_mut().zip(&other.radiance) {
            blend(own, other, own_weight);
        }
        let absorption = self.absorption.max(other.absorption);
        self.upgrade_absorption(absorption);
        other.upgrade_absorption(absorption);
        let planes = self.transmittance.iter_mut().zip(&other.transmittance);
        planes.take(absorption.planes()).for_each(|(own, other)| blend(own, other, own_weight));
        self.depth.iter_mut().zip(&other.depth).for_each(|(own, other)| *own = own.min(*other));
        for ((own, other), aov) in self.aovs.iter_mut().zip(&other.aovs).zip(aovs) {
            own.crossfade(other, own_weight, aov.rule);
        }
    }

    /// Resets it to an empty strip over the pixels `rect` of another one, with the same plate and AOVs.
    pub fn reset_within(&mut self, rect: Rect, other: &Self) {
        self.reset(rect, None, other.aovs.len());
        if other.has_plate() {
            for y in rect.y..rect.bottom() {
                let first = (y - other.rect.y) * other.rect.width + rect.x - other.rect.x;
                self.plate_depth.extend_from_slice(&other.plate_depth[first..][..rect.width]);
            }
        }
    }

    /// Adds a strip over some of the same pixels that shows a fraction `weight` of the exposure, to a strip that contains other parts of it and nothing else:
    /// light, and what is absorbed, are averaged. With AOVs, both must have the same pixels.
    pub fn add_exposure_part(&mut self, part: &Self, weight: f32, aovs: &[AovDescriptor]) {
        self.upgrade_absorption(part.absorption);
        for row in 0..part.rect.height {
            let from = row * part.rect.width;
            let to = (part.rect.y - self.rect.y + row) * self.rect.width + part.rect.x - self.rect.x;
            let (from, to) = (from..from + part.rect.width, to..to + part.rect.width);
            for (sum, light) in self.radiance.iter_mut().zip(&part.radiance) {
                sum[to.clone()].iter_mut().zip(&light[from.clone()]).for_each(|(sum, l)| *sum = weight.fma(*l, *sum));
            }
            for c in 0..self.absorption.planes() {
                let own = match part.absorption {
                    Absorption::None => break,
                    Absorption::Gray => &part.transmittance[0],
                    Absorption::Colored => &part.transmittance[c],
                };
                let sum = &mut self.transmittance[c][to.clone()];
                sum.iter_mut().zip(&own[from.clone()]).for_each(|(sum, t)| *sum = weight.fma(*t - 1.0, *sum));
            }
            let nearest = &mut self.depth[to];
            nearest.iter_mut().zip(&part.depth[from]).for_each(|(nearest, depth)| *nearest = nearest.min(*depth));
        }
        for ((own, part), aov) in self.aovs.iter_mut().zip(&part.aovs).zip(aovs) {
            own.add_weighted(part, weight, aov.rule);
        }
    }

    /// Becomes the strip `first`, but for the pixels (column and row in the picture) that `takes_second` selects: these are those of a strip over the same
    /// pixels. AOVs stay.
    pub fn select(&mut self, first: &Self, second: &Self, takes_second: impl Fn(usize, usize) -> bool) {
        self.reset(first.rect, None, 0);
        self.upgrade_absorption(first.absorption.max(second.absorption));
        let width = self.rect.width.max(1);
        for index in 0..self.len() {
            let chosen = takes_second(self.rect.x + index % width, self.rect.y + index / width);
            let from = if chosen { second } else { first };
            let transmittance = from.transmittance(index);
            for c in 0..3 {
                self.radiance[c][index] = from.radiance[c][index];
            }
            for c in 0..self.absorption.planes() {
                self.transmittance[c][index] = transmittance[c];
            }
            self.depth[index] = from.depth[index];
        }
    }

    /// Adds light behind the current contents: it is attenuated by their transmittance and absorbs nothing.
    pub fn emit(&mut self, index: usize, radiance: [f32; 3], depth: f32) {
        let transmittance = self.transmittance(index);
        for c in 0..3 {
            self.radiance[c][index] = radiance[c].fma(transmittance[c], self.radiance[c][index]);
        }
        self.depth[index] = self.depth[index].min(depth);
    }

    /// Adds a sample behind the current contents: `L += T l; T *= t`.
    pub fn add_behind(&mut self, index: usize, radiance: [f32; 3], transmittance: [f32; 3], depth: f32) {
        self.emit(index, radiance, depth);
        if transmittance != [1.0; 3] {
            let planes = self.transmittance_planes_mut();
            for c in 0..3 {
                planes[c][index] *= transmittance[c];
            }
        }
    }

    /// [`add_row_behind`](Self::add_row_behind) for exactly sixteen pixels in vectors, which must all be in the strip.
    #[inline(always)]
    pub fn add_sixteen_behind<S: Simd>(
        &mut self,
        first: usize,
        radiance: [f32x16<S>; 3],
        opacity: Option<f32x16<S>>,
        depth: f32x16<S>,
    ) {
        let (simd, pixels) = (depth.simd, first..first + 16);
        if opacity.is_some() {
            self.begin_gray();
        }
        for c in 0..3 {
            let sum = &mut self.radiance[c][pixels.clone()];
            let before = f32x16::from_slice(simd, sum);
            let transmittance = match self.absorption {
                Absorption::None => f32x16::splat(simd, 1.0),
                Absorption::Gray => f32x16::from_slice(simd, &self.transmittance[0][pixels.clone()]),
                Absorption::Colored => f32x16::from_slice(simd, &self.transmittance[c][pixels.clone()]),
            };
            (before + radiance[c] * transmittance).store_slice(sum);
        }
        if let Some(opacity) = opacity {
            for plane in &mut self.transmittance[..if self.absorption == Absorption::Gray { 1 } else { 3 }] {
                let plane = &mut plane[pixels.clone()];
                let transmittance = f32x16::from_slice(simd, plane);
                (transmittance - transmittance * opacity).store_slice(plane);
            }
        }
        let nearest = &mut self.depth[pixels];
        f32x16::from_slice(simd, nearest).min(depth).store_slice(nearest);
    }

    /// [`add_behind`](Self::add_behind) for consecutive pixels from `first` on: planes of light, and of gray opacity if
    /// anything absorbs. Samples of infinite depth do not change the depth.
    #[inline(always)]
    pub fn add_row_behind(&mut self, first: usize, radiance: [&[f32]; 3], opacity: Option<&[f32]>, depth: &[f32]) {
        if opacity.is_some() {
            self.begin_gray();
        }
        let count = depth.len();
        for c in 0..3 {
            let (sum, light) = (&mut self.radiance[c][first..first + count], &radiance[c][..count]);
            let transmittance = match self.absorption {
                Absorption::None => None,
                Absorption::Gray => Some(&self.transmittance[0]),
                Absorption::Colored => Some(&self.transmittance[c]),
            };
            match transmittance {
                None => {
                    for (sum, light) in sum.iter_mut().zip(light) {
                        *sum += light;
                    }
                }
                Some(transmittance) => {
                    for ((sum, light), transmittance) in sum.iter_mut().zip(light).zip(&transmittance[first..]) {
                        *sum += light * transmittance;
                    }
                }
            }
        }
        if let Some(opacity) = opacity {
            for plane in &mut self.transmittance[..if self.absorption == Absorption::Gray { 1 } else { 3 }] {
                for (transmittance, opacity) in plane[first..first + count].iter_mut().zip(opacity) {
                    *transmittance -= *transmittance * opacity;
                }
            }
        }
        for (nearest, depth) in self.depth[first..first + count].iter_mut().zip(depth) {
            *nearest = if *depth < *nearest { *depth } else { *nearest };
        }
    }
}

#[cfg(test)]
mod tests;
