//! Glare: light that the lens, dust and air scatter, so that bright things are surrounded by a glow.
//!
//! A fraction of the light of each pixel is distributed over its surroundings, before the view transform. The surroundings gain what the pixel loses.
//! Alpha, depth, layers and AOVs do not change. Only light that Bansho draws is scattered: a plate was taken by a camera whose glare it already contains.
//!
//! | | |
//! | --- | --- |
//! | [`PointSpread`] | how much light goes how far |
//! | [`pyramid`] | distributes the light of a picture accordingly |
//!
//! Light beyond the edges of the picture is not known, and adds none; a whole panorama continues at its other side, and nothing is added outside the circle of a
//! fisheye. A crop is drawn with a margin as wide as the glare, on blocks that are counted from the corner of the picture, so that its pixels equal those of
//! the whole picture to the bit.

mod point_spread;
mod pyramid;

use std::ops::Range;

use bansho_base::{
    camera::Lens,
    frame::{Channel, Precision},
    host::parallel::prelude::*,
    image::{Image, Rect},
    math::DVec2,
    phenomenon::strip::View,
};
use bansho_scene::GLARE_LAYER;
use fearless_simd::{Level, dispatch};

pub(crate) use point_spread::PointSpread;
pub(crate) use pyramid::Pyramid;

use super::background::LightFrame;
use crate::plan::Plan;
use pyramid::Source;

/// Rows that one parallel task computes.
const TASK_ROWS: usize = 16;

/// The view with the part of the picture as its window that must be drawn for the glare in the window of `view`.
pub(crate) fn source_view(spread: &PointSpread, view: &View) -> View {
    let ([width, height], window) = (view.size, view.window);
    if period(view).is_some() {
        return view.with_whole_window();
    }
    let [x, end_x] = grown(window.x..window.right(), width, spread);
    let [y, end_y] = grown(window.y..window.bottom(), height, spread);
    view.clone().with_window(Rect { x, y, width: end_x - x, height: end_y - y })
}

/// The first pixel and the end of a side's pixels within reach of `pixels`, in whole blocks.
fn grown(pixels: Range<usize>, side: usize, spread: &PointSpread) -> [usize; 2] {
    let (reach, block) = (spread.reach(), spread.largest_block());
    [pixels.start.saturating_sub(reach) / block * block, (pixels.end + reach).next_multiple_of(block).min(side)]
}

/// The region of the picture from which light reaches the window of a plan, in pixels of the picture with its overscan: larger than the window where the lens
/// scatters light.
pub fn source_window(plan: &Plan) -> Rect {
    let view = plan.view(plan.frames().start);
    match PointSpread::new(plan.glare, view.camera.focal_pixels) {
        Some(spread) => source_view(&spread, &view).window,
        None => view.window,
    }
}

/// The width after which the picture repeats, pixels: that of a whole panorama.
fn period(view: &View) -> Option<usize> {
    let period = view.camera.horizontal_period()?;
    let width = view.size[0];
    ((period - width as f64).abs() < 0.5).then_some(width)
}

/// Adds the glare to the light of the view's window, and as a layer too if `with_layer`.
pub(crate) fn add(light: &mut LightFrame, spread: &PointSpread, view: &View, with_layer: bool, pyramid: &mut Pyramid) {
    let LightFrame { frame, drawn } = light;
    let (window, period) = (view.window, period(view));
    let source = Source { image: drawn.as_ref().unwrap_or(&frame.beauty), window, content: frame.content, period };
    pyramid.spread(&source, spread);
    let glare = Glare { pyramid, spread, view, level: bansho_base::math::simd::level() };
    if with_layer {
        frame.channels.extend(glare.layer(source.image));
    }
    let content = reached(frame.content, spread.reach(), window, period.is_some());
    frame.beauty.pixels_mut().par_chunks_mut(TASK_ROWS * window.width.max(1)).enumerate().for_each(|(task, rows)| {
        let mut sums = Vec::new();
        for (index, pixels) in rows.chunks_mut(window.width.max(1)).enumerate() {
            let y = task * TASK_ROWS + index;
            if (content.y..content.bottom()).contains(&y) {
                glare.row(y, drawn.as_ref().map_or(pixels, |drawn| drawn.row(y)), &mut sums);
                dispatch!(glare.level, _simd => add_row(pixels, &sums));
            }
        }
    });
    frame.content = content;
}

/// The part of a window that light from `content` reaches, if any is there.
fn reached(content: Rect, reach: usize, window: Rect, is_periodic: bool) -> Rect {
    if content.is_empty() {
        return content;
    }
    let [left, top] = [content.x, content.y].map(|first| first.saturating_sub(reach));
    let [right, bottom] =
        [(content.right(), window.width), (content.bottom(), window.height)].map(|(end, side)| (end + reach).min(side));
    let (x, width) = if is_periodic { (0, window.width) } else { (left, right - left) };
    Rect { x, y: top, width, height: bottom - top }
}

#[inline(always)]
fn add_row(pixels: &mut [[f32; 4]], glare: &[[f32; 4]]) {
    for (value, glare) in pixels.as_flattened_mut().iter_mut().zip(glare.as_flattened()) {
        *value += glare;
    }
}

/// The glare of a frame.
struct Glare<'a> {
    pyramid: &'a Pyramid,
    spread: &'a PointSpread,
    view: &'a View,
    level: Level,
}

impl Glare<'_> {
    /// The glare in row `y` of the window, whose light is `own`.
    fn row(&self, y: usize, own: &[[f32; 4]], glare: &mut Vec<[f32; 4]>) {
        let Rect { x: left, y: top, .. } = self.view.window;
        self.pyramid.glare_row(self.level, self.spread, [left, top + y], own, glare);
        let camera = &self.view.camera;
        if camera.lens == Lens::Fisheye {
            for (index, glare) in glare.iter_mut().enumerate() {
                let pixel = DVec2::new((left + index) as f64 + 0.5, (top + y) as f64 + 0.5);
                if !camera.is_in_circle(pixel) {
                    *glare = [0.0; 4];
                }
            }
        }
    }

    /// The layer of the glare of an image of light: negative where more light is lost than arrives. It has no alpha.
    fn layer(&self, image: &Image<4>) -> Vec<Channel> {
        let mut channels = ["R", "G", "B", "A"].map(|suffix| Channel {
            name: format!("{GLARE_LAYER}.{suffix}"),
            precision: Precision::Half,
            values: Vec::with_capacity(image.pixels().len()),
        });
        let mut row = Vec::new();
        for y in 0..image.height() {
            self.row(y, image.row(y), &mut row);
            for (c, channel) in channels.iter_mut().enumerate() {
                channel.values.extend(row.iter().map(|pixel| pixel[c]));
            }
        }
        channels.into()
    }
}
