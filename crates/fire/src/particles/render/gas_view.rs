//! What the camera sees in one sample of an exposure.
//!
//! A frame may be the mean of several time samples, each with its own state of the gas and its own part of the exposure, and of a picture with
//! finer pixels, where the gas is small.

use bansho_base::{
    camera::Camera,
    image::Rect,
    math::DVec2,
    phenomenon::strip::{Shutter, View},
};

/// Cameras, picture and window of one sample.
#[derive(Clone, Debug)]
pub(crate) struct GasView {
    /// The camera at the middle of the sample.
    pub(crate) camera: Camera,
    /// The cameras at its beginning and end. `None` if the camera stands still until the next frame: the motion until then is then scaled.
    pub(crate) ends: Option<[Camera; 2]>,
    /// The camera at the middle of the next frame, for motion vectors.
    pub(crate) next: Camera,
    pub(crate) next_middle: f64,
    /// The part of the exposure that the sample stands for.
    pub(crate) shutter: Shutter,
    /// Size of the whole picture, pixels.
    pub(crate) size: [usize; 2],
    /// The window of it that is drawn.
    pub(crate) window: Rect,
    /// Pixels along the side of one of the view's pixels.
    pub(crate) finer: usize,
}

impl GasView {
    /// The whole exposure of a view as one sample.
    pub(crate) fn new(view: &View) -> Self {
        let [open, close, next] = [view.shutter.open, view.shutter.close, view.next_middle].map(|t| view.camera_at(t));
        let stands_still = open == close && open == next && view.next_middle > view.shutter.middle();
        Self {
            camera: view.camera,
            ends: (!stands_still).then_some([open, close]),
            next,
            next_middle: view.next_middle,
            shutter: view.shutter,
            size: view.size,
            window: view.window,
            finer: 1,
        }
    }

    /// A part of the exposure of a view, in pixels of which `finer` times `finer` make one of the view's.
    pub(crate) fn sample(view: &View, shutter: Shutter, finer: usize) -> Self {
        let [open, camera, close, next] = [shutter.open, shutter.middle(), shutter.close, view.next_middle]
            .map(|t| with_finer_pixels(view.camera_at(t), finer));
        let Rect { x, y, width, height } = view.window;
        Self {
            camera,
            ends: Some([open, close]),
            next,
            next_middle: view.next_middle,
            shutter,
            size: view.size.map(|side| side * finer),
            window: Rect { x: x * finer, y: y * finer, width: width * finer, height: height * finer },
            finer,
        }
    }

    /// The pixels of the view that a rectangle touches.
    pub(crate) fn in_pixels_of_view(&self, rect: Rect) -> Rect {
        let [x, y] = [rect.x, rect.y].map(|edge| edge / self.finer);
        let [right, bottom] = [rect.right(), rect.bottom()].map(|edge| edge.div_ceil(self.finer));
        Rect { x, y, width: right - x, height: bottom - y }
    }

    /// Sprites with coordinates beyond this are discarded, pixels.
    pub(crate) fn max_pixel_coordinate(&self) -> f64 {
        1e6 * self.finer as f64
    }

    /// Exposure time as a fraction of the time until the next frame.
    pub(crate) fn shutter_fraction(&self) -> f64 {
        self.shutter.duration() / (self.next_middle - self.shutter.middle()).max(1e-9)
    }
}

/// The camera of a picture of which each pixel is divided into `finer` times `finer`.
fn with_finer_pixels(mut camera: Camera, finer: usize) -> Camera {
    let scale = finer as f64;
    camera.principal_point *= DVec2::splat(scale);
    camera.focal_pixels *= scale;
    camera.size = camera.size.map(|side| side * scale);
    camera
}
