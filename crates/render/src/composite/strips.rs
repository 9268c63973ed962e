//! From prepared phenomena to pixels: each strip composites its slices from near to far, then adds the background.

use std::ops::Range;

use bansho_base::{
    frame::Channel,
    host::{
        observer::{self, Cancelled},
        parallel::prelude::*,
    },
    image::Rect,
    math::MulAdd,
};
use fearless_simd::{Level, dispatch};

use super::{
    accumulate::Accumulator,
    background::Background,
    channels::{channel_planes, channels},
    composition::{Composition, StripScratch},
};

/// The pixels of a strip, in the format that the picture is kept in.
pub(crate) trait StripPixels: Send {
    /// Memory for the light of `strip`, of which the rectangle `drawn` will be overwritten. The other pixels of the memory are empty. A format that does not
    /// keep light returns `buffer`.
    fn light<'a>(&'a mut self, strip: Rect, drawn: Rect, buffer: &'a mut Vec<[f32; 4]>) -> StripLight<'a>;

    /// Converts the light, which is now in the memory that [`light`](Self::light) returned for the same rectangles.
    fn convert(&mut self, strip: Rect, drawn: Rect, buffer: &[[f32; 4]]);
}

/// The light of a strip.
pub(crate) struct StripLight<'a> {
    /// The pixels, in pixels of the picture.
    pub(crate) rect: Rect,
    /// Color and alpha, row by row.
    pub(crate) beauty: &'a mut [[f32; 4]],
    /// Depth, m; empty if it is not kept.
    pub(crate) depth: &'a mut [f32],
    /// Color without that of the plate; empty if it is not kept apart.
    pub(crate) drawn: &'a mut [[f32; 4]],
}

/// Draws and composites the whole window into its strips of [`STRIP_ROWS`](super::composition::STRIP_ROWS) rows from the top. Each is converted while its light is in the cache. Returns the
/// channels of layers and AOVs.
pub(crate) fn draw_strips<P: StripPixels>(
    composition: &Composition,
    strips: Vec<P>,
) -> Result<Vec<Channel>, Cancelled> {
    let level = bansho_base::math::simd::level();
    // A strip a task: what takes long to draw is often in few of them.
    let strips = strips.into_par_iter().enumerate().with_max_len(1);
    let strips = strips.map(|(index, pixels)| draw_strip(composition, level, index, pixels));
    if !composition.outputs.has_channels() {
        // Collecting would allocate memory for each strip.
        strips.try_for_each(|planes| planes.map(|_| ()))?;
        return Ok(Vec::new());
    }
    Ok(channels(composition, strips.collect::<Result<_, Cancelled>>()?))
}

/// Draws and composites the strip with this index, and converts it. Returns the planes of its channels, if there are any.
fn draw_strip<P: StripPixels>(
    composition: &Composition,
    level: Level,
    index: usize,
    mut pixels: P,
) -> Result<Vec<Vec<f32>>, Cancelled> {
    observer::check(composition.observer)?;
    let _part = composition.begin_part(None);
    let strip = composition.strip_rect(index);
    let drawn = composition.nonempty_rect(strip);
    composition.scratches.with(|scratch| {
        let mut buffer = std::mem::take(&mut scratch.light);
        let light = pixels.light(strip, drawn, &mut buffer);
        let mut planes = Vec::new();
        if !drawn.is_empty() {
            composition.accumulate(level, drawn, scratch);
            composition.background.trace(drawn, &mut scratch.bent);
            finish_strip(composition, level, scratch, light);
            if composition.outputs.has_channels() {
                planes = channel_planes(composition, scratch);
            }
        }
        pixels.convert(strip, drawn, &buffer);
        scratch.light = buffer;
        Ok(planes)
    })
}

/// Exposes a strip, computes its alpha, and composites the background behind it.
fn finish_strip(composition: &Composition, level: Level, scratch: &mut StripScratch, pixels: StripLight) {
    let (exposure, background) = (composition.outputs.exposure, &composition.background);
    let strip = pixels.rect;
    let StripScratch { accumulator, bent, row: buffer, .. } = scratch;
    let rect = accumulator.rect;
    for row in 0..rect.height {
        let accumulated = row * rect.width..(row + 1) * rect.width;
        let first = (rect.y - strip.y + row) * strip.width + rect.x - strip.x;
        let out = &mut pixels.beauty[first..][..rect.width];
        let color = accumulator.color.each_ref().map(|plane| &plane[accumulated.clone()]);
        match accumulator.transmittance() {
            None => dispatch!(level, _simd => expose_row(exposure, color, out)),
            Some(planes) => {
                let transmittance = planes.each_ref().map(|plane| &plane[accumulated.clone()]);
                dispatch!(level, _simd => expose_absorbed_row(exposure, color, transmittance, out));
            }
        }
        if let Some(drawn) = pixels.drawn.get_mut(first..first + rect.width) {
            drawn.copy_from_slice(out);
            if let Some(image) = background.drawn {
                let colors = Background::row(image, rect, row, bent, buffer);
                add_background(accumulator, accumulated.clone(), level, colors, drawn);
            }
        }
        if let Some(image) = background.color {
            let colors = Background::row(image, rect, row, bent, buffer);
            add_background(accumulator, accumulated.clone(), level, colors, out);
        }
        if let Some(hidden) = accumulator.hidden_alpha(accumulated.clone()) {
            out.iter_mut().zip(hidden).for_each(|(out, alpha)| out[3] += alpha);
        }
        if let Some(depth) = pixels.depth.get_mut(first..first + rect.width) {
            depth.copy_from_slice(&accumulator.depth[accumulated]);
            if let Some(depths) = background.depth_row(rect, row, composition.view.size[0]) {
                depth.iter_mut().zip(depths).for_each(|(depth, farther)| *depth = depth.min(*farther));
            }
        }
    }
}

/// Composites a row of the background behind `out`, the pixels `accumulated` of the accumulator.
fn add_background(
    accumulator: &Accumulator,
    accumulated: Range<usize>,
    level: Level,
    background: &[[f32; 4]],
    out: &mut [[f32; 4]],
) {
    match accumulator.transmittance() {
        None => dispatch!(level, _simd => composite_background(background, out)),
        Some(planes) => {
            let transmittance = planes.each_ref().map(|plane| &plane[accumulated.clone()]);
            dispatch!(level, _simd => composite_absorbed_background(transmittance, background, out));
        }
    }
}

#[inline(always)]
fn expose_row(exposure: f32, [red, green, blue]: [&[f32]; 3], out: &mut [[f32; 4]]) {
    for (((out, red), green), blue) in out.iter_mut().zip(red).zip(green).zip(blue) {
        *out = [exposure * red, exposure * green, exposure * blue, 0.0];
    }
}

#[inline(always)]
fn expose_absorbed_row(exposure: f32, color: [&[f32]; 3], transmittance: [&[f32]; 3], out: &mut [[f32; 4]]) {
    expose_row(exposure, color, out);
    let [red, green, blue] = transmittance;
    for (((out, red), green), blue) in out.iter_mut().zip(red).zip(green).zip(blue) {
        out[3] = 1.0 - (red + green + blue) * (1.0 / 3.0);
    }
}

/// Composites the background behind a row in which nothing absorbs.
#[inline(always)]
fn composite_background(background: &[[f32; 4]], out: &mut [[f32; 4]]) {
    for (out, background) in out.iter_mut().zip(background) {
        let weight = [1.0, 1.0, 1.0, 1.0 - out[3]];
        for c in 0..4 {
            out[c] = weight[c].fma(background[c], out[c]);
        }
    }
}

/// As [`composite_background`], where something absorbs.
#[inline(always)]
fn composite_absorbed_background([red, green, blue]: [&[f32]; 3], background: &[[f32; 4]], out: &mut [[f32; 4]]) {
    for ((((out, background), red), green), blue) in out.iter_mut().zip(background).zip(red).zip(green).zip(blue) {
        let weight = [*red, *green, *blue, 1.0 - out[3]];
        for c in 0..4 {
            out[c] = weight[c].fma(background[c], out[c]);
        }
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::math::{random::Key, random::Purpose, simd::VectorLevel};

    use super::*;

    /// A plane of random numbers in [0, 1).
    fn plane(id: u64) -> Vec<f32> {
        let key = Key::new(3, "composite");
        (0..17).flat_map(|step| key.uniforms(id, step, Purpose(0))).collect()
    }

    #[test]
    fn rows_are_composited_to_the_same_bits_at_every_vector_level() {
        let planes: [Vec<f32>; 6] = std::array::from_fn(|id| plane(id as u64));
        let [red, green, blue, through_red, through_green, through_blue] = planes.each_ref().map(Vec::as_slice);
        let (color, transmittance) = ([red, green, blue], [through_red, through_green, through_blue]);
        let background: Vec<[f32; 4]> = (0..red.len()).map(|i| [blue[i], red[i], through_red[i], green[i]]).collect();
        let composited = |level: Level| {
            let mut rows = [vec![[0.0; 4]; red.len()], vec![[0.0; 4]; red.len()]];
            let [clear, absorbed] = &mut rows;
            dispatch!(level, _simd => expose_row(0.37, color, clear));
            dispatch!(level, _simd => composite_background(&background, clear));
            dispatch!(level, _simd => expose_absorbed_row(0.37, color, transmittance, absorbed));
            dispatch!(level, _simd => composite_absorbed_background(transmittance, &background, absorbed));
            rows.map(|row| row.into_flattened().into_iter().map(f32::to_bits).collect::<Vec<_>>())
        };
        let levels: Vec<Level> = VectorLevel::available().into_iter().filter_map(VectorLevel::level).collect();
        let narrowest = composited(levels[0]);
        assert!(levels.iter().all(|level| composited(*level) == narrowest));
    }
}
