//! Billboards painted into a band of rows, sixteen pixels at a time.

use bansho_base::{
    canvas::{AovPlane, DepthInterval, GrayPlanes},
    image::Rect,
};

use crate::rain::{bands::BAND, source::SourceField, tiles::TILE};

use super::{
    Billboards,
    card::Card,
    sheet::{COLUMNS, Row},
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
    /// Place on the billboard at each corner of a row's blocks.
    corners: Vec<Option<[f32; 2]>>,
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
        let blocks = rect.x / LANES..rect.right().div_ceil(LANES);
        let middle = (band * BAND) as f32 + 0.5 * BAND as f32;
        brush.source.along_row(middle, card.distance, blocks.start..blocks.end + 1, &mut scratch.light);
        let peak = card.strength * brush.billboards.sheets.sheet(card.class, card.variant).peak();
        let brightest = scratch.light.iter().flatten().fold(0.0, |most: f32, light| most.max(*light));
        // Streaks without light still hide what lies behind them.
        let lit = brightest * peak >= brush.least_light;
        for y in rect.y..rect.bottom() {
            let height = y as f64 + 0.5;
            scratch.corners.clear();
            scratch.corners.extend((blocks.start..=blocks.end).map(|block| {
                let [x, y, _] = card.mapping.at((block * LANES) as f64, height)?;
                Some([x as f32, y as f32])
            }));
            for (number, block) in blocks.clone().enumerate() {
                let (Some(left), Some(right)) = (scratch.corners[number], scratch.corners[number + 1]) else {
                    continue;
                };
                if let Some(opacity) = opacities(brush, card, left, right) {
                    let light = lit.then(|| [scratch.light[number], scratch.light[number + 1]]);
                    let pixels = Pixels { x: block * LANES, y, rect, strip };
                    put(&pixels, card, &opacity, light, planes, aovs);
                }
            }
        }
    }
}

/// Opacities of the sixteen pixels between two places on a billboard; `None` where all are 0.
#[inline(always)]
fn opacities(brush: &Brush, card: &Card, left: [f32; 2], right: [f32; 2]) -> Option<[f32; LANES]> {
    let up = 0.5 * (left[1] + right[1]);
    if !(card.floor..1.0).contains(&up) || left[0].max(right[0]) <= 0.0 || left[0].min(right[0]) >= 1.0 {
        return None;
    }
    let sheet = brush.billboards.sheets.sheet(card.class, card.variant);
    let row = sheet.row(card.offset[1] + card.repeats * up);
    let texel = |x: f32, y: f32| (card.side.mul_add(x - card.lean * (y - 0.5), card.offset[0])) * COLUMNS as f32;
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
fn means(row: &Row, from: f32, step: f32, edges: [f32; 2], card: &Card) -> [f32; LANES] {
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
    let count = last - first;
    let opacity = &opacity[first - x..last - x];
    if !aovs.is_empty() {
        measure(card, start, opacity, planes, aovs);
    }
    let hidden_by_plate = |index: usize| planes.plate_depth.get(index).is_some_and(|plate| *plate <= card.depth);
    let mut taken = [0.0; LANES];
    for lane in 0..count {
        let index = start + lane;
        taken[lane] = if hidden_by_plate(index) { 0.0 } else { opacity[lane].clamp(0.0, 1.0) };
    }
    let through = &mut planes.transmittance[start..start + count];
    let mut hidden = [0.0; LANES];
    for lane in 0..count {
        hidden[lane] = through[lane] * taken[lane];
        through[lane] -= hidden[lane];
    }
    if let Some([left, right]) = light {
        for c in 0..3 {
            let radiance = &mut planes.radiance[c][start..start + count];
            for lane in 0..count {
                let share = ((first - x + lane) as f32 + 0.5) * (1.0 / LANES as f32);
                let here = (right[c] - left[c]).mul_add(share, left[c]);
                radiance[lane] = hidden[lane].mul_add(here, radiance[lane]);
            }
        }
    }
    let depth = &mut planes.depth[start..start + count];
    for lane in 0..count {
        depth[lane] = if taken[lane] > 0.0 { depth[lane].min(card.depth) } else { depth[lane] };
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
