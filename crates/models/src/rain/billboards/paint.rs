//! Billboards painted into a band of rows, sixteen pixels at a time.

use bansho_base::{
    canvas::{AovPlane, DepthInterval, GrayPlanes},
    image::Rect,
};

use crate::rain::{bands::BAND, source::SourceField, tiles::TILE};

use super::{
    Billboards,
    card::Card,
    sheet::{COLUMNS, Sheet, SheetRow},
};

/// Pixels of a block, as many as lie between corners of tiles.
const LANES: usize = TILE;
/// Narrowest stretch of texture that a pixel is given, texels.
const NARROWEST: f32 = 0.25;

/// What billboards are painted with.
#[derive(Clone, Copy)]
pub(crate) struct Brush<'a> {
    pub(crate) billboards: &'a Billboards,
    pub(crate) source: &'a SourceField,
    /// Those in this slice are painted.
    pub(crate) slice: &'a DepthInterval,
    /// Radiance below which no streak's light is painted, cd/m^2.
    pub(crate) least_light: f32,
}

/// Scratch of one band.
#[derive(Default)]
struct Scratch {
    /// Place across and up the billboard at each corner of a row's blocks; not a number where its plane is not seen.
    across: Vec<f32>,
    up: Vec<f32>,
    light: Vec<[f32; 3]>,
}

/// Paints the billboards of a band behind what the planes of `strip` hold, within `rows`.
#[inline(always)]
pub(crate) fn paint(
    brush: &Brush,
    band: usize,
    rows: Rect,
    strip: Rect,
    planes: &mut GrayPlanes,
    aovs: &mut [AovPlane],
) {
    let mut scratch = Scratch::default();
    for &index in brush.billboards.bands.members(band) {
        let card = &brush.billboards.cards[index as usize];
        let rect = card.rect.intersection(&rows);
        if rect.is_empty() || !brush.slice.contains(f64::from(card.depth)) {
            continue;
        }
        let sheet = brush.billboards.sheets.sheet(card.class, card.variant);
        let blocks = rect.x / LANES..rect.right().div_ceil(LANES);
        let middle = (band * BAND) as f32 + 0.5 * BAND as f32;
        brush.source.along_row(middle, card.distance, blocks.start..blocks.end + 1, &mut scratch.light);
        let brightest = scratch.light.iter().flatten().fold(0.0, |most: f32, light| most.max(*light));
        // Streaks without light still hide what lies behind them.
        let lit = brightest * card.strength * sheet.peak() >= brush.least_light;
        for y in rect.y..rect.bottom() {
            corners(card, y, &blocks, &mut scratch);
            paint_row(card, sheet, lit, &Row { y, blocks: blocks.clone(), rect, strip }, &scratch, planes, aovs);
        }
    }
}

/// Finds where the corners of a row's blocks lie on a billboard.
#[inline(always)]
fn corners(card: &Card, y: usize, blocks: &std::ops::Range<usize>, scratch: &mut Scratch) {
    let count = blocks.len() + 1;
    scratch.across.resize(count, 0.0);
    scratch.up.resize(count, 0.0);
    let (first, height) = ((blocks.start * LANES) as f64, y as f64 + 0.5);
    let Some(forms) = card.mapping.along_row(first, height) else {
        for number in 0..count {
            let place = card.mapping.at(first + (number * LANES) as f64, height).unwrap_or([f64::NAN; 3]);
            (scratch.across[number], scratch.up[number]) = (place[0] as f32, place[1] as f32);
        }
        return;
    };
    let [x, y, inverse] = forms.map(|[start, step]| [start as f32, (step * LANES as f64) as f32]);
    let corners = scratch.across[..count].iter_mut().zip(&mut scratch.up[..count]);
    for (number, (across, up)) in corners.enumerate() {
        let number = number as f32;
        let depth = 1.0 / inverse[1].mul_add(number, inverse[0]);
        // Behind the camera no depth is above 0.
        let depth = if depth > 0.0 { depth } else { f32::NAN };
        *across = x[1].mul_add(number, x[0]) * depth;
        *up = y[1].mul_add(number, y[0]) * depth;
    }
}

/// The part of a row that a billboard covers.
struct Row {
    y: usize,
    blocks: std::ops::Range<usize>,
    rect: Rect,
    strip: Rect,
}

#[inline(always)]
fn paint_row(
    card: &Card,
    sheet: &Sheet,
    lit: bool,
    row: &Row,
    scratch: &Scratch,
    planes: &mut GrayPlanes,
    aovs: &mut [AovPlane],
) {
    for (number, block) in row.blocks.clone().enumerate() {
        let left = [scratch.across[number], scratch.up[number]];
        let right = [scratch.across[number + 1], scratch.up[number + 1]];
        let Some(opacity) = opacities(sheet, card, left, right) else { continue };
        let light = lit.then(|| [scratch.light[number], scratch.light[number + 1]]);
        let pixels = Pixels { x: block * LANES, y: row.y, rect: row.rect, strip: row.strip };
        put(&pixels, card, &opacity, light, planes, aovs);
    }
}

/// Opacities of the sixteen pixels between two places on a billboard; `None` where all are 0.
#[inline(always)]
fn opacities(sheet: &Sheet, card: &Card, left: [f32; 2], right: [f32; 2]) -> Option<[f32; LANES]> {
    let up = 0.5 * (left[1] + right[1]);
    let seen = up >= card.floor && up < 1.0 && left[0].max(right[0]) > 0.0 && left[0].min(right[0]) < 1.0;
    if !seen {
        return None;
    }
    let row = sheet.row(card.offset[1] + card.repeats * up);
    let texel = |x: f32, y: f32| card.side.mul_add(x - card.lean * (y - 0.5), card.offset[0]) * COLUMNS as f32;
    let [from, to] = [left, right].map(|[x, y]| texel(x, y));
    let [edge, other] = [texel(0.0, up), texel(1.0, up)];
    let edges = [edge.min(other), edge.max(other)];
    let reach = 0.5 * card.blur;
    let [low, high] = [(from.min(to) - reach).max(edges[0]), (from.max(to) + reach).min(edges[1])];
    if low >= high || row.is_empty_between(low, high) {
        return None;
    }
    Some(means(&row, from, (to - from) * (1.0 / LANES as f32), edges, card))
}

/// Mean opacity of the texture under each pixel: from `from` on, each `step` texels further, all within `edges`.
#[inline(always)]
fn means(row: &SheetRow, from: f32, step: f32, edges: [f32; 2], card: &Card) -> [f32; LANES] {
    let width = step.abs().max(card.blur).max(NARROWEST);
    let scale = card.strength / width;
    let mut result = [0.0; LANES];
    if width > step.abs() {
        // Each pixel reads a stretch of its own, wider than the step.
        for lane in 0..LANES {
            let middle = (lane as f32 + 0.5).mul_add(step, from);
            let [low, high] = [middle - 0.5 * width, middle + 0.5 * width].map(|place| place.clamp(edges[0], edges[1]));
            result[lane] = (row.sum_until(high) - row.sum_until(low)) * scale;
        }
        return result;
    }
    // Stretches of neighbours meet: one look-up for each edge between pixels.
    let scale = if step < 0.0 { -scale } else { scale };
    let mut sums = [0.0; LANES + 1];
    for lane in 0..=LANES {
        sums[lane] = row.sum_until((lane as f32).mul_add(step, from).clamp(edges[0], edges[1]));
    }
    for lane in 0..LANES {
        result[lane] = (sums[lane + 1] - sums[lane]) * scale;
    }
    result
}

/// Which pixels a block has.
struct Pixels {
    x: usize,
    y: usize,
    rect: Rect,
    strip: Rect,
}

/// Puts a block behind what the planes hold.
#[inline(always)]
fn put(
    pixels: &Pixels,
    card: &Card,
    opacity: &[f32; LANES],
    light: Option<[[f32; 3]; 2]>,
    planes: &mut GrayPlanes,
    aovs: &mut [AovPlane],
) {
    let Pixels { x, y, rect, strip } = *pixels;
    let (first, last) = (x.max(rect.x), (x + LANES).min(rect.right()));
    let start = (y - strip.y) * strip.width + first - strip.x;
    let skipped = first - x;
    if !aovs.is_empty() {
        measure(card, start, &opacity[skipped..last - x], planes, aovs);
    }
    let mut taken = opacity.map(|opacity| opacity.clamp(0.0, 1.0));
    if !planes.plate_depth.is_empty() {
        for (taken, plate) in taken[skipped..last - x].iter_mut().zip(&planes.plate_depth[start..]) {
            *taken = if *plate <= card.depth { 0.0 } else { *taken };
        }
    }
    let light = light.map(|[left, right]| {
        [0, 1, 2].map(|c| {
            let step = (right[c] - left[c]) * (1.0 / LANES as f32);
            std::array::from_fn(|lane| (lane as f32 + 0.5).mul_add(step, left[c]))
        })
    });
    let end = start + last - first;
    let [through, depth] = [&mut *planes.transmittance, &mut *planes.depth].map(|plane| &mut plane[start..end]);
    let radiance = planes.radiance.each_mut().map(|plane| &mut plane[start..end]);
    // Of a whole block all lengths are known, so that it becomes vectors.
    if skipped == 0 && last == x + LANES {
        lay(LANES, &taken, &light, through, depth, radiance, card.depth);
    } else {
        taken.copy_within(skipped.., 0);
        let light = light.map(|mut light: [[f32; LANES]; 3]| {
            light.iter_mut().for_each(|plane| plane.copy_within(skipped.., 0));
            light
        });
        lay(last - first, &taken, &light, through, depth, radiance, card.depth);
    }
}

/// Puts the first `count` pixels of a block behind what as many pixels of the planes hold.
#[inline(always)]
fn lay(
    count: usize,
    taken: &[f32; LANES],
    light: &Option<[[f32; LANES]; 3]>,
    through: &mut [f32],
    depth: &mut [f32],
    radiance: [&mut [f32]; 3],
    card_depth: f32,
) {
    let mut hidden = [0.0; LANES];
    for ((hidden, taken), through) in hidden[..count].iter_mut().zip(&taken[..count]).zip(&mut through[..count]) {
        *hidden = *through * taken;
        *through -= *hidden;
    }
    if let Some(light) = light {
        for (plane, light) in radiance.into_iter().zip(light) {
            for ((value, hidden), light) in plane[..count].iter_mut().zip(&hidden[..count]).zip(&light[..count]) {
                *value = hidden.mul_add(*light, *value);
            }
        }
    }
    for (depth, taken) in depth[..count].iter_mut().zip(&taken[..count]) {
        let nearer = if card_depth < *depth { card_depth } else { *depth };
        *depth = if *taken > 0.0 { nearer } else { *depth };
    }
}

fn measure(card: &Card, start: usize, opacity: &[f32], planes: &GrayPlanes, aovs: &mut [AovPlane]) {
    let values = [1.0, card.depth, card.diameter_mm];
    for (lane, opacity) in opacity.iter().enumerate().filter(|(_, opacity)| **opacity > 0.0) {
        let index = start + lane;
        if planes.plate_depth.get(index).is_none_or(|plate| *plate > card.depth) {
            aovs.iter_mut().zip(values).for_each(|(plane, value)| plane.add(index, value, opacity.min(1.0)));
        }
    }
}
