//! The plate of a frame: its colors as the scene sees them, and the depth to hide behind.

use std::sync::Arc;

use bansho_base::{
    camera::{Camera, Lens},
    color,
    host::{
        assets::{Encoding, Picture},
        observer::{Cancelled, Observer},
    },
    image::Image,
    math::DVec2,
    parameters::BuildError,
    phenomenon::LevelMirror,
};

use super::mirror;
use crate::{context::ShotContext, shot::RenderError};
use bansho_scene::{DepthKind, PlatePictures};
use rayon::prelude::*;

/// A plate, as large as the picture with its overscan.
#[derive(Clone, Debug, Default)]
pub(crate) struct PlateFrame {
    /// Exposed scene-linear ACEScg and coverage: 0 beyond the plate's edges (overscan).
    pub(crate) color: Option<Image<4>>,
    /// Depth as the camera's lens measures it, m.
    pub(crate) depth: Option<Image<1>>,
}

/// Keeps the last plate, since most shots stand before a single picture.
#[derive(Default)]
pub(crate) struct PlateCache {
    last: Option<(PlateKey, Arc<PlateFrame>)>,
    mirrored: Option<(MirrorKey, Arc<PlateFrame>)>,
}

/// What a mirrored plate depends on beside the plan: the plate, the mirror, and the exposure.
type MirrorKey = (PlateKey, LevelMirror, f32);

/// What a plate frame depends on beside what the scene says of the plate: digests of picture and depth, the camera that measures depth, and how
/// the picture is shown.
type PlateKey = ([Option<[u8; 32]>; 2], Camera, color::View);

impl PlateCache {
    pub(crate) fn frame(&mut self, context: &ShotContext, number: i64) -> Result<Arc<PlateFrame>, RenderError> {
        let plate = &context.plan.scene.plate;
        if plate.image.is_none() {
            return Ok(Arc::default());
        }
        let mut digests = [None; 2];
        for (digest, (key, path)) in digests.iter_mut().zip([("image", &plate.image), ("depth", &plate.depth)]) {
            let Some(path) = path else { continue };
            let found = context.compiled.assets().digest(&path.0, number);
            *digest = Some(found.map_err(|error| plate_error(BuildError { key: key.into(), kind: error.into() }))?);
        }
        let key = (digests, context.plan.view(number).camera, context.plan.shown());
        if let Some((known, frame)) = &self.last
            && *known == key
        {
            return Ok(frame.clone());
        }
        let frame = Arc::new(load(context, number, &key.1)?);
        self.last = Some((key, frame.clone()));
        Ok(frame)
    }

    /// The last plate as it is seen in a level mirror.
    ///
    /// # Errors
    /// The observer asked to stop.
    pub(crate) fn mirrored(
        &mut self,
        context: &ShotContext,
        mirror: LevelMirror,
        observer: &dyn Observer,
    ) -> Result<Arc<PlateFrame>, Cancelled> {
        let Some((key, plate)) = &self.last else { return Ok(Arc::default()) };
        let key = (*key, mirror, context.plan.exposure_scale());
        if let Some((known, frame)) = &self.mirrored
            && *known == key
        {
            return Ok(frame.clone());
        }
        let frame = Arc::new(mirror::mirrored(plate, &key.0.1, mirror, key.2, observer)?);
        self.mirrored = Some((key, frame.clone()));
        Ok(frame)
    }
}

fn plate_error(fault: BuildError) -> RenderError {
    RenderError::Plate(Box::new(fault))
}

fn load(context: &ShotContext, number: i64, camera: &Camera) -> Result<PlateFrame, RenderError> {
    let pictures =
        context.plan.scene.plate.read_frame(context.compiled.assets().as_ref(), number).map_err(plate_error)?;
    let Some(PlatePictures { image, depth }) = pictures else { return Ok(PlateFrame::default()) };
    let width = image.color.width();
    let fit = Fit::new(context, [width, image.color.height()]);
    let depths = depth.as_ref().and_then(|picture| picture.depth.as_ref());
    let depth = depths.map(|depths| fit_depth(context, camera, depths, width, &fit));
    Ok(PlateFrame { color: Some(fit_color(context, &image, &fit)), depth })
}

/// How the picture's pixels fall on the plate's: the plate fills the picture, centered, its longer side cut.
pub(crate) struct Fit {
    picture: [usize; 2],
    plate: [usize; 2],
    overscan: usize,
    /// Plate pixels a picture pixel.
    scale: f64,
    offset: [f64; 2],
}

impl Fit {
    pub(crate) fn new(context: &ShotContext, plate: [usize; 2]) -> Self {
        let overscan = context.plan.overscan;
        let [across, down] = [0, 1].map(|axis| plate[axis] as f64 / context.plan.size[axis] as f64);
        let scale = across.min(down);
        let offset = [0, 1].map(|axis| 0.5 * (plate[axis] as f64 - scale * context.plan.size[axis] as f64));
        Self { picture: context.plan.size.map(|side| side + 2 * overscan), plate, overscan, scale, offset }
    }

    /// Place on the plate, in its pixels, of the middle of a picture pixel.
    fn place(&self, axis: usize, pixel: usize) -> f64 {
        (pixel as f64 + 0.5 - self.overscan as f64) * self.scale + self.offset[axis]
    }

    /// Place in the picture, in its pixels without overscan, of the middle of a plate pixel.
    pub(crate) fn in_picture(&self, axis: usize, pixel: usize) -> f64 {
        (pixel as f64 + 0.5 - self.offset[axis]) / self.scale
    }

    fn covers(&self, axis: usize, pixel: usize) -> bool {
        (0.0..=self.plate[axis] as f64).contains(&self.place(axis, pixel))
    }
}

/// Plate pixels and weights under one picture pixel along an axis: a triangle as wide as the larger of both pixels.
fn taps(fit: &Fit, axis: usize, pixel: usize) -> Vec<(usize, f32)> {
    let radius = fit.scale.max(1.0);
    let place = fit.place(axis, pixel) - 0.5;
    let mut taps: Vec<(usize, f32)> = Vec::new();
    for sample in (place - radius).floor() as i64..=(place + radius).ceil() as i64 {
        let weight = 1.0 - (sample as f64 - place).abs() / radius;
        if weight > 1e-9 {
            taps.push((sample.clamp(0, fit.plate[axis] as i64 - 1) as usize, weight as f32));
        }
    }
    let total: f32 = taps.iter().map(|tap| tap.1).sum();
    taps.iter_mut().for_each(|tap| tap.1 /= total);
    taps
}

fn fit_color(context: &ShotContext, picture: &Picture, fit: &Fit) -> Image<4> {
    let columns: Vec<_> = (0..fit.picture[0]).map(|x| taps(fit, 0, x)).collect();
    let view = context.plan.shown();
    let mut image = Image::filled(fit.picture[0], fit.picture[1], [0.0; 4]);
    image.pixels_mut().par_chunks_mut(fit.picture[0]).enumerate().for_each(|(y, row)| {
        let rows = taps(fit, 1, y);
        for (x, pixel) in row.iter_mut().enumerate() {
            if !(fit.covers(0, x) && fit.covers(1, y)) {
                continue;
            }
            let mut sum = [0.0_f32; 3];
            for &(plate_y, weight_y) in &rows {
                for &(plate_x, weight_x) in &columns[x] {
                    let color = picture.color.at(plate_x, plate_y);
                    for c in 0..3 {
                        sum[c] += weight_y * weight_x * color[c];
                    }
                }
            }
            let [red, green, blue] = to_scene(&view, picture.encoding, sum);
            *pixel = [red, green, blue, 1.0];
        }
    });
    image
}

/// A plate's numbers as exposed ACEScg: what the view transform takes back to the very same numbers.
pub(crate) fn to_scene(view: &color::View, encoding: Encoding, color: [f32; 3]) -> [f32; 3] {
    match encoding {
        Encoding::DisplaySrgb => view.to_scene(color.map(color::decode_srgb)),
        Encoding::LinearSrgb => color::acescg_from_srgb(color),
        Encoding::LinearAcescg => color,
    }
}

/// Depth is never mixed between pixels: each takes its nearest neighbor's.
fn fit_depth(context: &ShotContext, camera: &Camera, depth: &[f32], plate_width: usize, fit: &Fit) -> Image<1> {
    let kind = context.plan.scene.plate.depth_kind;
    let scale = context.plan.scene.plate.depth_scale;
    let mut image = Image::filled(fit.picture[0], fit.picture[1], [f32::INFINITY]);
    image.pixels_mut().par_chunks_mut(fit.picture[0]).enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.iter_mut().enumerate() {
            if fit.covers(0, x) && fit.covers(1, y) {
                let nearest = |axis, at| (fit.place(axis, at) as usize).min(fit.plate[axis] - 1);
                let value = f64::from(depth[nearest(1, y) * plate_width + nearest(0, x)]);
                let meters = match kind {
                    DepthKind::Inverse => scale / value,
                    DepthKind::Axis | DepthKind::Distance => scale * value,
                };
                pixel[0] = as_lens_measures(camera, kind, meters, x, y) as f32;
            }
        }
    });
    image
}

/// A perspective camera measures along its axis, the others from the camera; whatever is not a depth hides nothing.
fn as_lens_measures(camera: &Camera, kind: DepthKind, meters: f64, x: usize, y: usize) -> f64 {
    if meters.is_nan() || meters <= 0.0 {
        return f64::INFINITY;
    }
    let stretch = || {
        let direction = camera.direction(DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
        direction.map_or(1.0, |direction| direction.length())
    };
    match (camera.lens, kind) {
        (Lens::Perspective, DepthKind::Distance) => meters / stretch(),
        _ => meters,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plate_of_the_pictures_size_is_taken_pixel_by_pixel() {
        let fit = Fit { picture: [4, 3], plate: [4, 3], overscan: 0, scale: 1.0, offset: [0.0, 0.0] };
        for pixel in 0..4 {
            assert_eq!(taps(&fit, 0, pixel), [(pixel, 1.0)]);
        }
    }

    #[test]
    fn a_smaller_picture_averages_and_never_reaches_outside() {
        let fit = Fit { picture: [2, 2], plate: [8, 8], overscan: 0, scale: 4.0, offset: [0.0, 0.0] };
        let taps = taps(&fit, 0, 0);
        assert!((taps.iter().map(|tap| tap.1).sum::<f32>() - 1.0).abs() < 1e-6);
        assert!(taps.len() > 5 && taps.iter().all(|tap| tap.0 < 8));
    }
}
