//! How a frame of the gas is sampled: how many parts of the exposure are drawn, from which states of the gas, and at which resolution.

use bansho_base::{
    camera::Camera,
    math::{DVec2, DVec3},
    phenomenon::strip::{Shutter, View},
};

use super::{depth_layers::PictureScale, gas::Gas};

/// A state of the gas, and the part of the exposure for which it is drawn.
#[derive(Clone, Copy, Debug)]
pub struct GasState<'a> {
    /// The gas.
    pub gas: Gas<'a>,
    /// When it is exposed.
    pub shutter: Shutter,
}

/// What an exposure sees of the gas.
#[derive(Clone, Debug)]
pub struct GasExposure<'a> {
    /// The state in the middle of the exposure.
    pub middle: Gas<'a>,
    /// The states that the gas passes through, in order; their parts make up the exposure.
    pub states: Vec<GasState<'a>>,
    /// Whether the exposure is so short that the motion of the gas may be extrapolated from the state in the middle.
    pub is_short: bool,
}

impl<'a> GasExposure<'a> {
    /// The states and parts of the exposure that are drawn as one sample each, for a gas of a scale.
    pub(crate) fn samples(&self, view: &View, scale: Option<PictureScale>) -> Vec<GasState<'a>> {
        let whole = GasState { gas: self.middle, shutter: view.shutter };
        if self.is_short && time_samples(view.shutter, view, scale).count() == 1 {
            return vec![whole];
        }
        let mut samples = Vec::with_capacity(self.states.len());
        for &GasState { gas, shutter } in &self.states {
            samples.extend(time_samples(shutter, view, scale).map(|shutter| GasState { gas, shutter }));
        }
        samples
    }
}

/// Radius of mean particles in the pixels of a sample, at least. Below, the pixel's footprint and the widening of the smallest sprites thin the gas
/// out, so that it would absorb less of its own light.
const MIN_RADIUS_PIXELS: f64 = 3.0;
/// Pixels of a sample along the side of one of the picture's, at most.
const MAX_FINER: usize = 256;
/// Width or height of the whole picture of a sample, pixels, at most: single precision places sprites to a quarter of a pixel.
const MAX_SIDE: usize = 1 << 22;
/// Motion of the gas in a sample relative to the mean radius of its particles, at most. It is drawn by widening sprites, which thins the gas out.
const MAX_MOTION_RADII: f64 = 0.8;
/// Time samples of each state, at most.
const MAX_TIMES_PER_STATE: usize = 32;

/// The number of finer pixels along the side of a pixel at which the gas is sampled, 1 if its particles are large enough.
pub(crate) fn pixel_subdivision(scale: Option<PictureScale>, view: &View) -> usize {
    let Some(scale) = scale else { return 1 };
    let largest = MAX_FINER.min(MAX_SIDE / view.size[0].max(view.size[1]).max(1)).max(1);
    let mut finer = 1;
    while finer * 2 <= largest && scale.radius * (finer as f64) < MIN_RADIUS_PIXELS {
        finer *= 2;
    }
    finer
}

/// The parts of a shutter that are drawn as one sample each, for a gas of a scale at one resolution.
pub(crate) fn time_samples(
    shutter: Shutter,
    view: &View,
    scale: Option<PictureScale>,
) -> impl Iterator<Item = Shutter> {
    let count = scale.map_or(1, |scale| {
        let motion = camera_motion_pixels(scale.center, shutter, view);
        (motion / (MAX_MOTION_RADII * scale.radius.max(1.0))).ceil().clamp(1.0, MAX_TIMES_PER_STATE as f64) as usize
    });
    (0..count).map(move |index| {
        let [open, close] =
            [index, index + 1].map(|edge| shutter.open + shutter.duration() * edge as f64 / count as f64);
        Shutter { open, close }
    })
}

/// Apparent motion of a point while the shutter is open, pixels.
fn camera_motion_pixels(point: DVec3, shutter: Shutter, view: &View) -> f64 {
    let [open, close] = [shutter.open, shutter.close].map(|t| view.camera_at(t));
    let [from, to] = [&open, &close].map(|camera: &Camera| camera.project(point).map(|projection| projection.pixel));
    let motion = from.zip(to).map_or(DVec2::ZERO, |(from, to)| open.nearest_repetition(to, from) - from);
    motion.length()
}
