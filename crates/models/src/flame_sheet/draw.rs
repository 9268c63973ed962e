//! One flame of one frame, drawn row by row, sixteen pixels at a time.

use bansho_base::{canvas::Strip, image::Rect};

use super::{
    chain,
    lanes::{LANES, Lanes, greatest, least},
    moment::Moment,
    placement::{Batch, Mapping},
    ramp::Ramp,
    shape::{Place, Shape},
    texture::Texture,
};

/// One flame at one moment of the exposure, as one camera sees it.
pub(crate) struct Sample {
    /// From pixels to the sheet.
    pub(crate) mapping: Mapping,
    /// Edges, centre line, scroll.
    pub(crate) moment: Moment,
    /// T0.
    pub(crate) texture: Texture,
    /// Size of a pixel in x' and in y.
    pub(crate) pixel: [f32; 2],
    /// Luminance of the brightest colour, divided by the number of samples; cd/m^2.
    pub(crate) luminance: f32,
}

/// What sixteen pixels see of the flame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shade {
    /// T1, eq. (5).
    pub(crate) t1: Lanes,
    /// Height w.
    pub(crate) w: Lanes,
    /// Coverage times glow.
    pub(crate) strength: Lanes,
    /// Red, green, blue of luminance up to 1, and opacity.
    pub(crate) light: [Lanes; 4],
}

/// Whether any flame reaches a batch, and what of it.
#[inline(always)]
pub(crate) fn shade(shape: &Shape, ramp: &Ramp, sample: &Sample, batch: &Batch) -> Option<Shade> {
    let (x, y) = sample.moment.straighten(&batch.x, &batch.y);
    let place = shape.place(&x, &y, &sample.moment.heights, sample.pixel)?;
    if all_dark(&place.coverage) {
        return None;
    }
    let texture = sample.texture.sample(&place.u, &place.w);
    let (mut t1, mut strength) = ([0.0; LANES], [0.0; LANES]);
    for i in 0..LANES {
        t1[i] = chain::above_threshold(texture[i], place.threshold[i]);
        strength[i] = if t1[i] > 0.0 { place.coverage[i] * place.glow[i] } else { 0.0 };
    }
    let blue = ramp.base_blue[2] > 0.0 && lowest(&place.w) < BLUE_TOP;
    if !blue && all_dark(&strength) {
        return None;
    }
    let mut light = ramp.light.sample(&t1);
    for plane in &mut light {
        for i in 0..LANES {
            plane[i] *= strength[i];
        }
    }
    if blue {
        add_base_blue(&mut light, ramp, &place);
    }
    Some(Shade { t1, w: place.w, strength, light })
}

#[inline(always)]
fn all_dark(values: &Lanes) -> bool {
    let mut most = values[0];
    for value in &values[1..] {
        most = greatest(*value, most);
    }
    most <= 0.0
}

#[inline(always)]
fn lowest(values: &Lanes) -> f32 {
    let mut low = values[0];
    for value in &values[1..] {
        low = least(*value, low);
    }
    low
}

/// Height w up to which the base burns blue.
const BLUE_TOP: f32 = 0.45;

/// The blue zone hugs the flame's lower edge, where fuel meets air before soot forms.
#[inline(always)]
fn add_base_blue(light: &mut [Lanes; 4], ramp: &Ramp, place: &Place) {
    for i in 0..LANES {
        let up = greatest(1.0 - place.w[i] * (1.0 / BLUE_TOP), 0.0);
        let rim = 0.75f32.mul_add(place.across[i] * place.across[i], 0.25) * greatest(1.0 - place.across[i], 0.0) * 3.0;
        let amount = up * up * rim * place.coverage[i];
        for (plane, blue) in light.iter_mut().zip(ramp.base_blue) {
            plane[i] = blue.mul_add(amount, plane[i]);
        }
    }
}

/// The flat texture square of the paper's pictures 1 to 4.
#[inline(always)]
pub(crate) fn shade_flat(shape: &Shape, ramp: &Ramp, sample: &Sample, batch: &Batch, threshold: bool) -> Option<Shade> {
    let inside = |i: usize| (0.0..=1.0).contains(&batch.x[i]) && (0.0..=1.0).contains(&batch.y[i]);
    if !(0..LANES).any(inside) {
        return None;
    }
    let texture = sample.texture.sample(&batch.x, &batch.y);
    let limit = shape.flat_threshold(&batch.x, &batch.y, &sample.moment.heights);
    let (mut t1, mut strength) = ([0.0; LANES], [0.0; LANES]);
    for i in 0..LANES {
        t1[i] = if threshold { chain::above_threshold(texture[i], limit[i]) } else { texture[i] };
        strength[i] = if inside(i) { 1.0 } else { 0.0 };
    }
    let mut light = ramp.light.sample(&t1);
    for plane in &mut light {
        for i in 0..LANES {
            plane[i] *= strength[i];
        }
    }
    Some(Shade { t1, w: batch.y, strength, light })
}

/// Which part of the chain is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Drawn {
    /// The mapped flame.
    Flame,
    /// The texture square before the threshold.
    FlatTexture,
    /// The texture square after the threshold.
    FlatCut,
}

/// Mean light and opacity of a row's pixels over the exposure.
struct RowSums {
    light: [Vec<f32>; 4],
    depth: Vec<f32>,
}

impl RowSums {
    fn new(width: usize) -> Self {
        Self { light: std::array::from_fn(|_| vec![0.0; width]), depth: vec![f32::INFINITY; width] }
    }
}

/// Draws all samples of one flame into the part `rect` of `strip`, behind what it holds.
#[inline(always)]
pub(crate) fn draw_rows(shape: &Shape, ramp: &Ramp, samples: &[Sample], drawn: Drawn, rect: Rect, strip: &mut Strip) {
    // Batches begin at multiples of sixteen of the whole picture, so that strips and crops change no pixel.
    let start = rect.x / LANES * LANES;
    let width = (rect.right() - start).div_ceil(LANES) * LANES;
    let mut sums = RowSums::new(width);
    for y in rect.y..rect.bottom() {
        let mut touched = false;
        for offset in (0..width).step_by(LANES) {
            touched |= add_batch(shape, ramp, samples, drawn, [start + offset, y], offset, &mut sums);
        }
        if touched {
            compose_row(&mut sums, start, y, rect, ramp.absorbs, strip);
        }
    }
}

/// Adds all samples of the sixteen pixels at `pixel`; whether there was anything to add.
#[inline(always)]
fn add_batch(shape: &Shape, ramp: &Ramp, samples: &[Sample], drawn: Drawn, pixel: [usize; 2], offset: usize, sums: &mut RowSums) -> bool {
    let mut touched = false;
    for sample in samples {
        let batch = sample.mapping.batch(pixel[0], pixel[1]);
        let shade = match drawn {
            Drawn::Flame => shade(shape, ramp, sample, &batch),
            Drawn::FlatTexture => shade_flat(shape, ramp, sample, &batch, false),
            Drawn::FlatCut => shade_flat(shape, ramp, sample, &batch, true),
        };
        let Some(shade) = shade else { continue };
        touched = true;
        let weights = [sample.luminance, sample.luminance, sample.luminance, 1.0 / samples.len() as f32];
        for k in 0..4 {
            let sum = &mut sums.light[k][offset..offset + LANES];
            for i in 0..LANES {
                sum[i] = shade.light[k][i].mul_add(weights[k], sum[i]);
            }
        }
        let depth = &mut sums.depth[offset..offset + LANES];
        for i in 0..LANES {
            let something = shade.light[0][i] + shade.light[2][i] + shade.light[3][i] > 0.0;
            depth[i] = if something { least(batch.depth[i], depth[i]) } else { depth[i] };
        }
    }
    touched
}

/// Moves a row's sums behind what the strip holds, where the plate does not hide them, and clears them.
#[inline(always)]
fn compose_row(sums: &mut RowSums, start: usize, y: usize, rect: Rect, absorbs: bool, strip: &mut Strip) {
    let first = (y - strip.rect.y) * strip.rect.width + rect.x - strip.rect.x;
    let skip = rect.x - start;
    let span = skip..skip + rect.width;
    for i in span.clone() {
        let index = first + i - skip;
        // A share of the pixel's samples may see flame outside the plane's near end; depth is then infinite.
        if sums.depth[i].is_finite() && !strip.visible(index, sums.depth[i]) {
            for plane in &mut sums.light {
                plane[i] = 0.0;
            }
            sums.depth[i] = f32::INFINITY;
        }
    }
    let [red, green, blue, opacity] = &sums.light;
    let cells = [&red[span.clone()], &green[span.clone()], &blue[span.clone()]];
    strip.add_row_behind(first, cells, absorbs.then(|| &opacity[span.clone()]), &sums.depth[span.clone()]);
    sums.light.iter_mut().for_each(|plane| plane.fill(0.0));
    sums.depth.fill(f32::INFINITY);
}
