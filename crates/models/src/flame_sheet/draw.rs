//! One flame of one frame, drawn row by row, sixteen pixels at a time.

use bansho_base::{canvas::Strip, image::Rect};

use fearless_simd::{Simd, prelude::*};

use super::{
    chain,
    lanes::{LANES, Lanes, Real, any_positive, probe},
    moment::Moment,
    placement::{Batch, Mapping, Stand},
    ramp::Ramp,
    shape::{Place, Shape},
    smoke::{SmokeState, shade_smoke},
    texture::Texture,
};

/// What a sheet shows at one moment.
pub(crate) struct State {
    /// Edges, centre line, scroll.
    pub(crate) moment: Moment,
    /// T0.
    pub(crate) texture: Texture,
    /// Size of a pixel in x' and in y.
    pub(crate) pixel: [f32; 2],
}

/// A sheet at one moment of the exposure, as one camera sees it.
pub(crate) struct Sample {
    /// From pixels to the sheet.
    pub(crate) mapping: Mapping,
    /// Where the sheet stands.
    pub(crate) stand: Stand,
    /// What it shows.
    pub(crate) state: State,
    /// Where it is smoke, what that is made of.
    pub(crate) smoke: Option<SmokeState>,
    /// Luminance of the brightest colour, divided by the number of samples; cd/m^2.
    pub(crate) luminance: f32,
}

/// What sixteen pixels see of the flame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shade<S: Simd> {
    /// T1, eq. (5).
    pub(crate) t1: Lanes<S>,
    /// Red, green, blue of luminance up to 1, and opacity.
    pub(crate) light: [Lanes<S>; 4],
}

#[inline(always)]
fn shade_inline<S: Simd>(shape: &Shape, ramp: &Ramp, state: &State, batch: &Batch<S>) -> Option<Shade<S>> {
    let (x, y) = state.moment.straighten(batch.x, batch.y);
    if shape.out_of_reach(probe(x), probe(y)) {
        return None;
    }
    let place = shape.place(x, y, &state.moment.edges, state.pixel)?;
    let t1 = chain::above_threshold(shape.gas(state.texture.sample(place.u, place.w)), place.threshold);
    let zero = t1.like(0.0);
    let strength = zero.choose(t1, place.coverage * place.glow, zero);
    let blue = ramp.base_blue[2] > 0.0 && any_positive(place.w.like(BLUE_TOP) - place.w);
    if !blue && !any_positive(strength) {
        return None;
    }
    let mut light = ramp.light(t1);
    for plane in &mut light {
        *plane = *plane * strength;
    }
    let [red, green_beside_red] = place.cooling;
    let green = red * green_beside_red;
    let blue_left = green * green_beside_red * green_beside_red.root();
    for (plane, left) in light.iter_mut().zip([red, green, blue_left]) {
        *plane = *plane * left;
    }
    if blue {
        add_base_blue(&mut light, ramp, &place);
    }
    Some(Shade { t1, light })
}

/// Height w up to which the base burns blue.
const BLUE_TOP: f32 = 0.45;

/// The blue zone hugs the flame's lower edge, where fuel meets air before soot forms.
#[inline(always)]
fn add_base_blue<S: Simd>(light: &mut [Lanes<S>; 4], ramp: &Ramp, place: &Place<S>) {
    let one = place.w.like(1.0);
    let up = (one - place.w * one.like(1.0 / BLUE_TOP)).held();
    let rim = (place.across * place.across).fused(one.like(0.75), one.like(0.25)) * (one - place.across) * one.like(3.0);
    let amount = up * up * rim * place.coverage;
    for (plane, blue) in light.iter_mut().zip(ramp.base_blue) {
        *plane = amount.fused(one.like(blue), *plane);
    }
}

/// The flat texture square of the paper's pictures 1 to 4.
#[inline(always)]
fn shade_flat<S: Simd>(shape: &Shape, ramp: &Ramp, state: &State, batch: &Batch<S>, cut: bool) -> Option<Shade<S>> {
    let (zero, one) = (batch.x.like(0.0), batch.x.like(1.0));
    let outside = |x: Lanes<S>| (zero - x).greatest(x - one).greatest(zero);
    let strength = zero.choose(outside(batch.x) + outside(batch.y), zero, one);
    if !any_positive(strength) {
        return None;
    }
    let texture = shape.gas(state.texture.sample(batch.x, batch.y));
    let t1 = if cut { chain::above_threshold(texture, shape.flat_threshold(batch.x, batch.y)) } else { texture };
    let mut light = ramp.light(t1);
    for plane in &mut light {
        *plane = *plane * strength;
    }
    Some(Shade { t1, light })
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
    /// Smoke.
    Smoke,
}

/// What is drawn of one sheet.
#[derive(Clone, Copy)]
pub(crate) struct Paint<'a> {
    pub(crate) shape: &'a Shape,
    pub(crate) ramp: &'a Ramp,
    pub(crate) samples: &'a [Sample],
    pub(crate) drawn: Drawn,
    /// Whether it hides anything.
    pub(crate) absorbs: bool,
}

/// Draws all samples of one sheet into the part `rect` of `strip`, behind what it holds.
#[inline(always)]
pub(crate) fn draw_rows<S: Simd>(simd: S, paint: &Paint, rect: Rect, strip: &mut Strip) {
    // Batches begin at multiples of sixteen of the whole picture, so that strips and crops change no pixel.
    let start = rect.x / LANES * LANES;
    for y in rect.y..rect.bottom() {
        for column in (start..rect.right()).step_by(LANES) {
            if let Some(pixels) = expose(simd, paint, [column, y]) {
                compose(&pixels, column, y, rect, paint.absorbs, strip);
            }
        }
    }
}

/// Mean light and opacity of sixteen pixels over the exposure, and the nearest depth at which they see flame.
struct Exposed {
    light: [[f32; LANES]; 4],
    depth: [f32; LANES],
}

/// Averages all samples of the sixteen pixels at `pixel`; `None` where there is nothing.
#[inline(always)]
fn expose<S: Simd>(simd: S, paint: &Paint, pixel: [usize; 2]) -> Option<Exposed> {
    let Paint { shape, ramp, samples, drawn, .. } = *paint;
    let mut sums = [Lanes::splat(simd, 0.0); 4];
    let mut nearest = Lanes::splat(simd, f32::INFINITY);
    let share = 1.0 / samples.len() as f32;
    let mut touched = false;
    for sample in samples {
        let batch = sample.mapping.batch(simd, pixel[0], pixel[1]);
        let Some(shade) = shade_as(shape, ramp, sample, drawn, &batch) else { continue };
        touched = true;
        for (k, weight) in [sample.luminance, sample.luminance, sample.luminance, share].into_iter().enumerate() {
            sums[k] = shade.light[k].fused(nearest.like(weight), sums[k]);
        }
        let something = shade.light[0] + shade.light[2] + shade.light[3];
        nearest = nearest.like(0.0).choose(something, nearest.least(batch.depth), nearest);
    }
    if !touched {
        return None;
    }
    let mut exposed = Exposed { light: [[0.0; LANES]; 4], depth: [0.0; LANES] };
    for k in 0..4 {
        sums[k].store_slice(&mut exposed.light[k]);
    }
    nearest.store_slice(&mut exposed.depth);
    Some(exposed)
}

/// Whether any flame reaches a batch, and what of it; compiled once for each kind of vector.
pub(crate) fn shade<S: Simd>(shape: &Shape, ramp: &Ramp, state: &State, batch: &Batch<S>) -> Option<Shade<S>> {
    batch.x.simd.vectorize(
        #[inline(always)]
        || shade_inline(shape, ramp, state, batch),
    )
}

/// What a batch sees of a sample.
pub(crate) fn shade_as<S: Simd>(shape: &Shape, ramp: &Ramp, sample: &Sample, drawn: Drawn, batch: &Batch<S>) -> Option<Shade<S>> {
    let state = &sample.state;
    match (&sample.smoke, drawn) {
        (None, Drawn::Flame | Drawn::Smoke) => shade(shape, ramp, state, batch),
        (None, Drawn::FlatTexture | Drawn::FlatCut) => batch.x.simd.vectorize(
            #[inline(always)]
            || shade_flat(shape, ramp, state, batch, drawn == Drawn::FlatCut),
        ),
        (Some(smoke), _) => batch.x.simd.vectorize(
            #[inline(always)]
            || shade_smoke(state, smoke, batch),
        ),
    }
}

/// Moves sixteen pixels behind what the strip holds, where the plate does not hide them.
#[inline(always)]
fn compose(pixels: &Exposed, column: usize, y: usize, rect: Rect, absorbs: bool, strip: &mut Strip) {
    let (first, last) = (column.max(rect.x), (column + LANES).min(rect.right()));
    let lanes = first - column..last - column;
    let index = (y - strip.rect.y) * strip.rect.width + first - strip.rect.x;
    let hidden = |strip: &Strip| lanes.clone().any(|lane| !strip.visible(index + lane - lanes.start, pixels.depth[lane].min(f32::MAX)));
    if strip.has_plate() && hidden(strip) {
        for lane in lanes.clone().filter(|lane| pixels.depth[*lane].is_finite()) {
            let index = index + lane - lanes.start;
            if strip.visible(index, pixels.depth[lane]) {
                let opacity = [pixels.light[3][lane]];
                let light = [0, 1, 2].map(|k| &pixels.light[k][lane..lane + 1]);
                strip.add_row_behind(index, light, absorbs.then_some(&opacity), &pixels.depth[lane..lane + 1]);
            }
        }
        return;
    }
    let light = [&pixels.light[0][lanes.clone()], &pixels.light[1][lanes.clone()], &pixels.light[2][lanes.clone()]];
    strip.add_row_behind(index, light, absorbs.then_some(&pixels.light[3][lanes.clone()]), &pixels.depth[lanes]);
}
