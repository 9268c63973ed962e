//! From prepared phenomena to a frame: each strip composites its slices from near to far, then adds the background.

use bansho_base::{
    color::DisplayCode,
    frame::{Frame, FrameHeader},
    host::{
        observer::{self, Cancelled},
        parallel::prelude::*,
    },
    image::Rect,
    math::MulAdd,
};
use fearless_simd::{Level, dispatch};

use super::{
    channels::{channel_planes, channels},
    composition::{Composition, STRIP_ROWS, StripScratch},
    frame_memory::{FrameMemory, StripPixels},
};
use crate::pixels::CodeConversion;

/// Draws and composites the whole window.
pub(crate) fn draw_frame(
    composition: &Composition,
    header: FrameHeader,
    recycled: Option<Frame>,
) -> Result<Frame, Cancelled> {
    let window = composition.view.window;
    let level = bansho_base::math::simd::level();
    let mut memory = FrameMemory::new(window, composition.outputs.depth, recycled);
    let scratches = composition.scratches;
    let has_channels = composition.outputs.layers || composition.outputs.aovs;
    let strips = memory.strips(STRIP_ROWS).into_par_iter().enumerate().with_max_len(1).map(|(index, mut pixels)| {
        observer::check(composition.observer)?;
        let _part = composition.begin_part(None);
        pixels.clear();
        let strip = composition.strip_rect(index);
        let rect = composition.nonempty_rect(strip);
        if rect.is_empty() {
            return Ok(Vec::new());
        }
        scratches.with(|scratch| {
            let StripPixels { beauty, depth, .. } = &mut pixels;
            draw_strip(composition, level, rect, scratch, StripLight { rect: strip, beauty, depth });
            Ok(if has_channels { channel_planes(composition, scratch) } else { Vec::new() })
        })
    });
    let planes: Vec<Vec<Vec<f32>>> = if has_channels {
        strips.collect::<Result<_, Cancelled>>()?
    } else {
        strips.try_for_each(|planes| planes.map(|_| ()))?;
        Vec::new()
    };
    Ok(Frame {
        header,
        beauty: memory.beauty,
        depth: memory.depth,
        channels: channels(composition, planes),
        opaque: composition.is_opaque(),
        content: composition.content(),
        metadata: Vec::new(),
    })
}

/// Draws and composites the whole window as display codes: each strip is converted while it is in the cache, and its light is not kept.
///
/// `codes` are zero, and remain so where nothing is drawn, unless the picture is opaque.
pub(crate) fn draw_codes<C: DisplayCode + Send + Sync>(
    composition: &Composition,
    conversion: &CodeConversion,
    codes: &mut [[C; 4]],
) -> Result<(), Cancelled> {
    let window = composition.view.window;
    let level = bansho_base::math::simd::level();
    let strips = codes.par_chunks_mut(STRIP_ROWS * window.width.max(1)).enumerate().with_max_len(1);
    strips.try_for_each(|(index, codes)| {
        observer::check(composition.observer)?;
        let _part = composition.begin_part(None);
        let strip = composition.strip_rect(index);
        let rect = composition.nonempty_rect(strip);
        // An opaque pixel without light has a code too.
        let converted = if conversion.is_opaque() { strip } else { rect };
        if converted.is_empty() {
            return Ok(());
        }
        composition.scratches.with(|scratch| {
            let mut light = std::mem::take(&mut scratch.light);
            light.resize(converted.width * converted.height, [0.0; 4]);
            if converted != rect {
                light.fill([0.0; 4]);
            }
            if !rect.is_empty() {
                let pixels = StripLight { rect: converted, beauty: &mut light, depth: &mut [] };
                draw_strip(composition, level, rect, scratch, pixels);
            }
            for (row, light) in light.chunks_exact(converted.width).enumerate() {
                let y = converted.y + row;
                let first = (y - strip.y) * strip.width + converted.x - strip.x;
                conversion.row(y - window.y, converted.x - window.x, light, &mut codes[first..][..converted.width]);
            }
            scratch.light = light;
        });
        Ok(())
    })
}

/// Where the light of a strip goes.
struct StripLight<'a> {
    /// The pixels, in pixels of the picture.
    rect: Rect,
    /// Color and alpha, row by row.
    beauty: &'a mut [[f32; 4]],
    /// Depth, m; empty if it is not kept.
    depth: &'a mut [f32],
}

/// Draws and composites the pixels `rect` of a strip.
fn draw_strip(composition: &Composition, level: Level, rect: Rect, scratch: &mut StripScratch, pixels: StripLight) {
    composition.accumulate(level, rect, scratch);
    composition.background.trace(rect, &mut scratch.bent);
    finish_strip(composition, level, scratch, pixels);
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
        if let Some(colors) = background.color_row(rect, row, bent, buffer) {
            match accumulator.transmittance() {
                None => dispatch!(level, _simd => composite_background(colors, out)),
                Some(planes) => {
                    let transmittance = planes.each_ref().map(|plane| &plane[accumulated.clone()]);
                    dispatch!(level, _simd => composite_absorbed_background(transmittance, colors, out));
                }
            }
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
