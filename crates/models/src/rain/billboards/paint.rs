//! Billboards painted into a band of rows, sixteen pixels at a time.

use bansho_base::{
    canvas::{AovPlane, DepthInterval, GrayPlanes},
    image::Rect,
};

use crate::rain::{aovs::measure, bands::BAND, source::SourceField};

use super::{
    Billboards,
    card::Card,
    sheet::{COLUMNS, Sheet, SheetRow},
};

/// Pixels of a block.
const LANES: usize = 16;
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
    let members = brush.billboards.bands.stretches(band, rows.x, rows.right()).flat_map(|(_, members)| members);
    for &index in members {
        let card = &brush.billboards.cards[index as usize];
        let rect = card.rect.intersection(&rows);
        if rect.is_empty() || !brush.slice.contains(f64::from(card.depth)) {
            continue;
        }
        let sheet = brush.billboards.sheets.sheet(card.class, card.variant);
        let blocks = rect.x / LANES..rect.right().div_ceil(LANES);
        let middle = (band * BAND) as f32 + 0.5 * BAND as f32;
        let places = (blocks.start..=blocks.end).map(|block| (block * LANES) as f32);
        brush.source.along_row(middle, card.distance, places, &mut scratch.light);
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
    // Counted from the billboard's own first block, so that a crop changes no bit.
    let (own, height) = (card.rect.x / LANES, y as f64 + 0.5);
    let first = (own * LANES) as f64;
    let Some(forms) = card.mapping.along_row(first, height) else {
        for number in 0..count {
            let place = card.mapping.at(((blocks.start + number) * LANES) as f64, height).unwrap_or([f64::NAN; 3]);
            (scratch.across[number], scratch.up[number]) = (place[0] as f32, place[1] as f32);
        }
        return;
    };
    let mut start = [0.0_f32; 3];
    let mut step = [0.0_f32; 3];
    for form in 0..3 {
        (start[form], step[form]) = (forms[form][0] as f32, (forms[form][1] * LANES as f64) as f32);
    }
    let (across, up) = (&mut scratch.across[..count], &mut scratch.up[..count]);
    for number in 0..count {
        let place = (blocks.start - own + number) as f32;
        let depth = 1.0 / step[2].mul_add(place, start[2]);
        // Behind the camera no depth is above 0.
        let depth = if depth > 0.0 { depth } else { f32::NAN };
        across[number] = step[0].mul_add(place, start[0]) * depth;
        up[number] = step[1].mul_add(place, start[1]) * depth;
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
    let from = texel(card, left[0], left[1]);
    let to = texel(card, right[0], right[1]);
    let (edge, other) = (texel(card, 0.0, up), texel(card, 1.0, up));
    let edges = [edge.min(other), edge.max(other)];
    let reach = 0.5 * card.blur;
    let (low, high) = ((from.min(to) - reach).max(edges[0]), (from.max(to) + reach).min(edges[1]));
    if low >= high || row.is_empty_between(low, high) {
        return None;
    }
    Some(means(&row, from, (to - from) * (1.0 / LANES as f32), edges, card))
}

/// The texel at a place of a billboard, before it wraps.
#[inline(always)]
fn texel(card: &Card, x: f32, y: f32) -> f32 {
    card.side.mul_add(x - card.lean * (y - 0.5), card.offset[0]) * COLUMNS as f32
}

/// Mean opacity of the texture under each pixel: from `from` on, each `step` texels further, all within `edges`.
#[inline(always)]
fn means(row: &SheetRow, from: f32, step: f32, edges: [f32; 2], card: &Card) -> [f32; LANES] {
    let width = step.abs().max(card.blur).max(NARROWEST);
    let scale = card.strength / width;
    let mut result = [0.0; LANES];
    let (mut low, mut high) = ([0.0; LANES], [0.0; LANES]);
    if width > step.abs() {
        // Each pixel reads a stretch of its own, wider than the step.
        for lane in 0..LANES {
            let middle = (lane as f32 + 0.5).mul_add(step, from);
            low[lane] = (middle - 0.5 * width).max(edges[0]).min(edges[1]);
            high[lane] = (middle + 0.5 * width).max(edges[0]).min(edges[1]);
        }
        let (low, high) = (row.sums_until(&low), row.sums_until(&high));
        for lane in 0..LANES {
            result[lane] = (high[lane] - low[lane]) * scale;
        }
        return result;
    }
    // Stretches of neighbours meet: one look-up for each edge between pixels.
    let scale = if step < 0.0 { -scale } else { scale };
    for lane in 0..LANES {
        low[lane] = (lane as f32).mul_add(step, from).max(edges[0]).min(edges[1]);
    }
    let low = row.sums_until(&low);
    let last = row.sum_until((LANES as f32).mul_add(step, from).max(edges[0]).min(edges[1]));
    high[..LANES - 1].copy_from_slice(&low[1..]);
    high[LANES - 1] = last;
    for lane in 0..LANES {
        result[lane] = (high[lane] - low[lane]) * scale;
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
        measure_block(card, start, &opacity[skipped..last - x], planes, aovs);
    }
    let mut taken = [0.0; LANES];
    for lane in 0..LANES {
        taken[lane] = opacity[lane].clamp(0.0, 1.0);
    }
    if !planes.plate_depth.is_empty() {
        for (taken, plate) in taken[skipped..last - x].iter_mut().zip(&planes.plate_depth[start..]) {
            *taken = if *plate <= card.depth { 0.0 } else { *taken };
        }
    }
    let mut shades = [[0.0; LANES]; 3];
    if let Some([left, right]) = light {
        for c in 0..3 {
            let step = (right[c] - left[c]) * (1.0 / LANES as f32);
            for lane in 0..LANES {
                shades[c][lane] = (lane as f32 + 0.5).mul_add(step, left[c]);
            }
        }
    }
    let shades = light.is_some().then_some(&mut shades);
    // Of a whole block all lengths are known, so that it becomes vectors.
    if last - first == LANES {
        lay(LANES, &taken, shades.as_deref(), planes, start, card.depth);
    } else {
        taken.copy_within(skipped.., 0);
        if let Some(shades) = shades {
            for plane in shades.iter_mut() {
                plane.copy_within(skipped.., 0);
            }
            lay(last - first, &taken, Some(shades), planes, start, card.depth);
        } else {
            lay(last - first, &taken, None, planes, start, card.depth);
        }
    }
}

/// Puts the first `count` pixels of a block behind what as many pixels of the planes hold from `start` on.
#[inline(always)]
fn lay(
    count: usize,
    taken: &[f32; LANES],
    light: Option<&[[f32; LANES]; 3]>,
    planes: &mut GrayPlanes,
    start: usize,
    card_depth: f32,
) {
    let mut hidden = [0.0; LANES];
    let through = &mut planes.transmittance[start..start + count];
    for lane in 0..count {
        hidden[lane] = through[lane] * taken[lane];
        through[lane] -= hidden[lane];
    }
    if let Some(light) = light {
        for c in 0..3 {
            let plane = &mut planes.radiance[c][start..start + count];
            for lane in 0..count {
                plane[lane] = hidden[lane].mul_add(light[c][lane], plane[lane]);
            }
        }
    }
    let depth = &mut planes.depth[start..start + count];
    for lane in 0..count {
        let nearer = if card_depth < depth[lane] { card_depth } else { depth[lane] };
        depth[lane] = if taken[lane] > 0.0 { nearer } else { depth[lane] };
    }
}

fn measure_block(card: &Card, start: usize, opacity: &[f32], planes: &GrayPlanes, aovs: &mut [AovPlane]) {
    for (index, opacity) in (start..).zip(opacity) {
        if planes.plate_depth.get(index).is_none_or(|plate| *plate > card.depth) {
            measure(aovs, index, opacity.min(1.0), card.depth, card.diameter_mm);
        }
    }
}
