//! What phenomena draw into: strips of a picture that no two threads share.

use std::sync::Arc;

use fearless_simd::{Simd, f32x16, prelude::*};
use glam::DVec2;

use crate::{
    camera::{Camera, CameraParameters},
    image::Rect,
    math::{self, MulAdd},
};

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
    /// Half way between.
    pub fn middle(&self) -> f64 {
        0.5 * (self.open + self.close)
    }

    /// How long it is open.
    pub fn duration(&self) -> f64 {
        self.close - self.open
    }

    /// The middle of part `index` of `count` equal parts.
    pub fn instant(&self, index: usize, count: usize) -> f64 {
        self.open + self.duration() * (index as f64 + 0.5) / count as f64
    }
}

/// A stretch of depth, m; a thing at depth z lies in it when `near <= z < far`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthInterval {
    /// Nearest depth.
    pub near: f64,
    /// First depth beyond it.
    pub far: f64,
}

impl DepthInterval {
    /// Everything before the camera.
    pub const ALL: Self = Self { near: 0.0, far: f64::INFINITY };

    /// Whether a thing at `depth` lies in it.
    pub fn contains(&self, depth: f64) -> bool {
        self.near <= depth && depth < self.far
    }

    /// Whether the two share any depth.
    pub fn overlaps(&self, other: &Self) -> bool {
        self.near < other.far && other.near < self.far
    }
}

/// Motion of the picture while the shutter is open that one instant stands for, pixels, and the most instants.
const PIXELS_PER_INSTANT: f64 = 1.0;
const MAX_INSTANTS: f64 = 16.0;

/// One exposure seen by one camera.
#[derive(Clone, Debug)]
pub struct View {
    /// Camera at the middle of the exposure.
    pub camera: Camera,
    /// Camera over time.
    pub path: CameraParameters,
    /// When the shutter is open.
    pub shutter: Shutter,
    /// When the next frame's exposure has its middle, for motion vectors; s.
    pub next_middle: f64,
    /// Size of the whole picture with its overscan, pixels.
    pub size: [usize; 2],
    /// Overscan on every side, pixels.
    pub overscan: usize,
    /// The part of the picture that is drawn.
    pub window: Rect,
    /// Height of the level mirror that the picture is seen in, m.
    pub mirror: Option<f64>,
    /// Luminance that a display will show as white, cd/m^2, where it is known: what is far below needs no drawing.
    pub white_luminance: Option<f64>,
    /// Whether AOVs are asked for; strips then have planes for them.
    pub aovs_requested: bool,
    /// In a loop: the same at the time of the turn before or after, whichever is nearer, for runs that pass from one turn to the next.
    pub adjacent_loop_view: Option<Arc<Self>>,
}

impl View {
    /// The view over `shutter` of a picture of `size` pixels with `overscan` pixels more on every side.
    pub fn new(path: CameraParameters, shutter: Shutter, next_middle: f64, size: [usize; 2], overscan: usize) -> Self {
        let camera = path.at(shutter.middle(), size).with_overscan(overscan);
        let size = size.map(|side| side + 2 * overscan);
        Self {
            camera,
            path,
            shutter,
            next_middle,
            size,
            overscan,
            window: Rect::of_size(size[0], size[1]),
            mirror: None,
            white_luminance: None,
            aovs_requested: false,
            adjacent_loop_view: None,
        }
    }

    /// The view of another part of the picture.
    pub fn with_window(self, window: Rect) -> Self {
        self.with_adjacent_loop_view(|view| view.window = window)
    }

    /// The view within a loop of `turn` seconds.
    pub fn in_loop(self, turn: f64) -> Self {
        let by = if self.shutter.middle() < 0.5 * turn { turn } else { -turn };
        let shutter = Shutter { open: self.shutter.open + by, close: self.shutter.close + by };
        let other = Self { shutter, next_middle: self.next_middle + by, ..self.clone() };
        Self { adjacent_loop_view: Some(Arc::new(other)), ..self }
    }

    /// The view after `change`, made at the other time too.
    fn with_adjacent_loop_view(mut self, change: impl Fn(&mut Self)) -> Self {
        change(&mut self);
        if let Some(other) = &mut self.adjacent_loop_view {
            change(Arc::make_mut(other));
        }
        self
    }

    /// The whole picture as it is seen in a level mirror at `height`, m.
    pub fn mirrored(&self, height: f64) -> Self {
        let mirrored = self.clone().with_adjacent_loop_view(|view| {
            view.camera = view.camera.mirrored(height);
            view.mirror = Some(height);
            view.aovs_requested = false;
        });
        mirrored.with_window(Rect::of_size(self.size[0], self.size[1]))
    }

    /// How far the sky moves in the picture while the shutter is open, at most, pixels.
    pub fn motion_pixels(&self) -> f64 {
        // In the corners and the middle, and where a dome's circle comes near the edges: its corners see nothing.
        const PLACES: [[f64; 2]; 9] = [
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
        let [open, close] = [self.shutter.open, self.shutter.close].map(|t| self.camera_at(t));
        let moved = |[x, y]: [f64; 2]| {
            let place = |camera: &Camera| camera.direction(DVec2::new(x * camera.size[0], y * camera.size[1]));
            let pair = place(&open).zip(place(&close));
            pair.map_or(0.0, |(a, b)| math::acos(a.normalize().dot(b.normalize()).clamp(-1.0, 1.0)) * open.focal_pixels)
        };
        PLACES.map(moved).into_iter().fold(0.0, f64::max)
    }

    /// Cameras at as many instants, each for an equal part of the exposure, as the motion of what is far away needs in the picture: one
    /// where it stands still.
    pub fn cameras(&self) -> Vec<Camera> {
        self.cameras_at_most(MAX_INSTANTS)
    }

    /// The same for what is small and sharp, which needs more of them.
    pub fn cameras_at_most(&self, most: f64) -> Vec<Camera> {
        let count = (self.motion_pixels() / PIXELS_PER_INSTANT).ceil().clamp(1.0, most) as usize;
        if count == 1 {
            return vec![self.camera];
        }
        (0..count).map(|instant| self.camera_at(self.shutter.instant(instant, count))).collect()
    }

    /// The camera at time `t`.
    pub fn camera_at(&self, t: f64) -> Camera {
        let display = self.size.map(|side| side - 2 * self.overscan);
        let camera = self.path.at(t, display).with_overscan(self.overscan);
        self.mirror.map_or(camera, |height| camera.mirrored(height))
    }
}

/// A part of the picture that one thread draws: radiance L and transmittance T of one slice of depth.
///
/// Planes hold `rect.width * rect.height` values, row after row. L is premultiplied ACEScg, luminance in cd/m^2.
#[derive(Clone, Debug, Default)]
pub struct Strip {
    /// Which pixels of the whole picture.
    pub rect: Rect,
    /// Red, green and blue of L.
    pub radiance: [Vec<f32>; 3],
    /// Red, green and blue of T; holds nothing until something absorbs.
    transmittance: [Vec<f32>; 3],
    /// Depth of the nearest sample, m; infinite where there is none.
    pub depth: Vec<f32>,
    /// Depth of the plate, m; empty where there is none. Samples at or behind it are hidden.
    plate_depth: Vec<f32>,
    /// The phenomenon's AOVs in the order of its descriptors; empty when nobody asked for them.
    pub aovs: Vec<AovPlane>,
    absorption: Absorption,
}

/// Planes of a strip that takes all colors alike, to put samples behind each other one pixel at a time: `L += T l; T *= t`.
#[derive(Debug)]
pub struct GrayPlanes<'a> {
    /// Red, green and blue of L.
    pub radiance: [&'a mut [f32]; 3],
    /// T.
    pub transmittance: &'a mut [f32],
    /// Depth of the nearest sample, m.
    pub depth: &'a mut [f32],
    /// Depth of the plate, m; empty where there is none.
    pub plate_depth: &'a [f32],
}

/// How many planes of T hold something.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
enum Absorption {
    /// None: T is 1.
    #[default]
    None,
    /// The first, which stands for all three: soot takes all colors alike.
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

/// Of each value `share`, and the rest of the other.
pub(crate) fn blend(values: &mut [f32], others: &[f32], share: f32) {
    values.iter_mut().zip(others).for_each(|(value, other)| *value = share.fma(*value - other, *other));
}

pub(crate) fn reset(plane: &mut Vec<f32>, pixels: usize, value: f32) {
    plane.clear();
    plane.resize(pixels, value);
}

impl Strip {
    /// Makes it an empty strip over `rect`.
    ///
    /// `plate_depth` gives the plate's row `y` over the whole picture's width; `aovs` is how many are wanted.
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

    /// Pixels in the strip.
    pub fn len(&self) -> usize {
        self.rect.width * self.rect.height
    }

    /// Whether the strip holds no pixel.
    pub fn is_empty(&self) -> bool {
        self.rect.is_empty()
    }

    /// Depth at which the plate hides what lies behind, m.
    pub fn plate_depth(&self, index: usize) -> f32 {
        self.plate_depth.get(index).copied().unwrap_or(f32::INFINITY)
    }

    /// Whether a plate's depth may hide samples.
    pub fn has_plate(&self) -> bool {
        !self.plate_depth.is_empty()
    }

    /// Whether a sample at `depth` is before the plate.
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

    /// Planes of T where anything absorbs; all the same one where T is gray.
    pub fn transmittance_planes(&self) -> Option<[&[f32]; 3]> {
        let [red, green, blue] = &self.transmittance;
        match self.absorption {
            Absorption::None => None,
            Absorption::Gray => Some([red, red, red]),
            Absorption::Colored => Some([red, green, blue]),
        }
    }

    /// Planes of T to write to; all ones at first.
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

    /// Planes to write to where nothing colored absorbs; `None` once something does.
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

    /// An empty strip over the same pixels before the same plate.
    pub fn empty_like(&self) -> Self {
        let mut empty = Self::default();
        empty.reset(self.rect, None, self.aovs.len());
        empty.plate_depth.clone_from(&self.plate_depth);
        empty
    }

    /// Makes it the mean of itself, which counts `share`, and another strip over the same pixels: as one take dissolves into the next.
    pub fn crossfade(&mut self, mut other: Self, share: f32, aovs: &[AovDescriptor]) {
        for (own, other) in self.radiance.iter_mut().zip(&other.radiance) {
            blend(own, other, share);
        }
        let absorption = self.absorption.max(other.absorption);
        self.upgrade_absorption(absorption);
        other.upgrade_absorption(absorption);
        let planes = self.transmittance.iter_mut().zip(&other.transmittance);
        planes.take(absorption.planes()).for_each(|(own, other)| blend(own, other, share));
        self.depth.iter_mut().zip(&other.depth).for_each(|(own, other)| *own = own.min(*other));
        for ((own, other), aov) in self.aovs.iter_mut().zip(&other.aovs).zip(aovs) {
            own.crossfade(other, share, aov.rule);
        }
    }

    /// Adds light that neither hides nor is hidden by what this strip holds so far, except by its absorption.
    pub fn emit(&mut self, index: usize, radiance: [f32; 3], depth: f32) {
        let transmittance = self.transmittance(index);
        for c in 0..3 {
            self.radiance[c][index] = radiance[c].fma(transmittance[c], self.radiance[c][index]);
        }
        self.depth[index] = self.depth[index].min(depth);
    }

    /// Adds a sample behind all that was drawn before: `L += T l; T *= t`.
    pub fn add_behind(&mut self, index: usize, radiance: [f32; 3], transmittance: [f32; 3], depth: f32) {
        self.emit(index, radiance, depth);
        if transmittance != [1.0; 3] {
            let planes = self.transmittance_planes_mut();
            for c in 0..3 {
                planes[c][index] *= transmittance[c];
            }
        }
    }

    /// [`add_row_behind`](Self::add_row_behind) for exactly sixteen pixels held in vectors; the strip must hold them.
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
            let left = match self.absorption {
                Absorption::None => f32x16::splat(simd, 1.0),
                Absorption::Gray => f32x16::from_slice(simd, &self.transmittance[0][pixels.clone()]),
                Absorption::Colored => f32x16::from_slice(simd, &self.transmittance[c][pixels.clone()]),
            };
            (before + radiance[c] * left).store_slice(sum);
        }
        if let Some(opacity) = opacity {
            for plane in &mut self.transmittance[..if self.absorption == Absorption::Gray { 1 } else { 3 }] {
                let plane = &mut plane[pixels.clone()];
                let left = f32x16::from_slice(simd, plane);
                (left - left * opacity).store_slice(plane);
            }
        }
        let nearest = &mut self.depth[pixels];
        f32x16::from_slice(simd, nearest).min(depth).store_slice(nearest);
    }

    /// [`add_behind`](Self::add_behind) for pixels that follow each other from `first` on: planes of light, and of gray opacity where
    /// anything absorbs. Samples of infinite depth leave the depth as it is.
    #[inline(always)]
    pub fn add_row_behind(&mut self, first: usize, radiance: [&[f32]; 3], opacity: Option<&[f32]>, depth: &[f32]) {
        if opacity.is_some() {
            self.begin_gray();
        }
        let count = depth.len();
        for c in 0..3 {
            let (sum, light) = (&mut self.radiance[c][first..first + count], &radiance[c][..count]);
            let left = match self.absorption {
                Absorption::None => None,
                Absorption::Gray => Some(&self.transmittance[0]),
                Absorption::Colored => Some(&self.transmittance[c]),
            };
            match left {
                None => {
                    for (sum, light) in sum.iter_mut().zip(light) {
                        *sum += light;
                    }
                }
                Some(left) => {
                    for ((sum, light), left) in sum.iter_mut().zip(light).zip(&left[first..]) {
                        *sum += light * left;
                    }
                }
            }
        }
        if let Some(opacity) = opacity {
            for plane in &mut self.transmittance[..if self.absorption == Absorption::Gray { 1 } else { 3 }] {
                for (left, opacity) in plane[first..first + count].iter_mut().zip(opacity) {
                    *left -= *left * opacity;
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
