//! Sixteen drops at a time on their way through the world, and the streaks that they leave in the picture.
//!
//! Places are counted from where the camera is half way through the exposure, so that single precision holds them.

use bansho_base::{camera::Lens, math::simd::LANES};

use super::{
    bin::Extent,
    rasterize::{Stroke, Way, at_least, at_most},
    shutter_cameras::Sight,
};
use crate::streaks::rasterize::tile::Layer;

/// A number for each of sixteen drops.
pub(crate) type Row = [f32; LANES];
/// A vector for each of them: all x, all y and all z.
pub(crate) type Vectors = [Row; 3];

/// Nothing, for each drop.
pub(crate) const NOTHING: Row = [0.0; LANES];

/// Radius of the pupil, m: that of a 24 mm lens at f/3.
const PUPIL: f32 = 4e-3;
/// Furthest that a drop is seen from its middle, m: the radius of the largest, and what the lens spreads.
pub(crate) const LARGEST: f64 = 4e-3 + PUPIL as f64;

/// Ways of drops while the shutter is open.
pub(crate) struct Flights {
    /// Where they are when the shutter opens, m.
    pub(crate) from: Vectors,
    /// Where they are when it closes, m.
    pub(crate) to: Vectors,
    /// mm.
    pub(crate) diameter_mm: Row,
    /// Opacity beside what optics gives; a drop without any leaves no streak.
    pub(crate) gain: Row,
}

impl Flights {
    /// Leaves the parts of the ways above the ground: drops are on them for a share of the exposure.
    #[inline(always)]
    pub(crate) fn cut(&mut self, ground: f32) {
        for i in 0..LANES {
            let (fall, over) = (self.from[1][i] - self.to[1][i], self.from[1][i] - ground);
            let falling = at_most(1.0, over / fall);
            let share = at_least(0.0, if fall > 0.0 { falling } else { over.signum() });
            for axis in 0..3 {
                self.to[axis][i] = (self.to[axis][i] - self.from[axis][i]) * share + self.from[axis][i];
            }
            self.gain[i] *= share;
        }
    }

    /// What the picture shows of them, still without light.
    #[inline(always)]
    pub(crate) fn streaks(&self, sight: &Sight) -> Streaks {
        let [open, middle, close] = &sight.eyes;
        // The shutter's end comes early for a drop that ends on the way; cameras hardly move in between.
        let (from, to) = (open.project(&self.from), close.project(&self.to));
        let flat = middle.lens() == Lens::Perspective;
        let mut streaks = Streaks::NONE;
        for i in 0..LANES {
            let depth = 0.5 * (from.depth[i] + to.depth[i]);
            let scale = 0.5 * (from.scale[i] + to.scale[i]);
            let radius = 0.5e-3 * self.diameter_mm[i] * scale;
            let way = [0, 1, 2].map(|axis| self.from[axis][i] + self.to[axis][i]);
            let away = 0.5 * (way[0] * way[0] + way[1] * way[1] + way[2] * way[2]).sqrt();
            // A flat picture stretches toward its corners, so that a ball covers more of it.
            let stretch = if flat { at_most(10.0, at_least(1.0, away / depth)) } else { 1.0 };
            let ends = [[from.x[i], from.y[i]], [to.x[i], to.y[i]]];
            let hidden = std::f32::consts::PI * radius * radius * stretch * self.gain[i];
            let stroke = Stroke::new(Way { ends, radius: radius + blur(depth) * scale, hidden }, depth, 0.0);
            streaks.set(i, &stroke, self.gain[i], sight.window);
        }
        streaks
    }
}

/// By how much a lens that is focused on a metre or beyond spreads what is nearer, m at its place: the drop hides as much of the
/// picture, but more thinly.
#[inline(always)]
fn blur(depth: f32) -> f32 {
    /// m.
    const FOCUS: f32 = 1.0;
    PUPIL * at_least(0.0, 1.0 - depth * (1.0 / FOCUS))
}

/// Streaks of sixteen drops, part by part.
pub(crate) struct Streaks {
    middle: [Row; 2],
    upright: [u32; LANES],
    half: Row,
    lean: Row,
    across: Row,
    density: Row,
    depth: Row,
    /// Their extents: left, right, top and bottom.
    sides: [Row; 4],
    /// Greatest opacity of any pixel.
    pub(crate) peak: Row,
    /// 1 for those that the picture shows, 0 for others.
    pub(crate) seen: [u32; LANES],
}

impl Streaks {
    const NONE: Self = Self {
        middle: [NOTHING; 2],
        upright: [0; LANES],
        half: NOTHING,
        lean: NOTHING,
        across: NOTHING,
        density: NOTHING,
        depth: NOTHING,
        sides: [NOTHING; 4],
        peak: NOTHING,
        seen: [0; LANES],
    };

    #[inline(always)]
    fn set(&mut self, i: usize, stroke: &Stroke, gain: f32, window: Extent) {
        let Stroke { middle, upright, half, lean, across, density, layer, .. } = *stroke;
        (self.middle[0][i], self.middle[1][i]) = (middle[0], middle[1]);
        (self.upright[i], self.half[i], self.lean[i]) = (u32::from(upright), half, lean);
        (self.across[i], self.density[i], self.depth[i]) = (across, density, layer.depth);
        self.peak[i] = stroke.peak();
        let [[left, right], [top, bottom]] = stroke.extent();
        (self.sides[0][i], self.sides[1][i], self.sides[2][i], self.sides[3][i]) = (left, right, top, bottom);
        let [columns, rows] = window;
        // No place in the picture is not a number, and meets nothing.
        let meets = (right > columns[0]) & (left < columns[1]) & (bottom > rows[0]) & (top < rows[1]);
        self.seen[i] = u32::from(meets & (gain > 0.0));
    }

    /// Whether any is seen.
    #[inline(always)]
    pub(crate) fn any(&self) -> bool {
        let mut any = 0;
        for i in 0..LANES {
            any |= self.seen[i];
        }
        any != 0
    }

    /// Half way along one, pixels.
    #[inline(always)]
    pub(crate) fn middle(&self, i: usize) -> [f32; 2] {
        [self.middle[0][i], self.middle[1][i]]
    }

    /// Where one may touch the picture.
    #[inline(always)]
    pub(crate) fn extent(&self, i: usize) -> Extent {
        [[self.sides[0][i], self.sides[1][i]], [self.sides[2][i], self.sides[3][i]]]
    }

    /// One of them.
    #[inline(always)]
    pub(crate) fn stroke(&self, i: usize, diameter_mm: f32, light: [f32; 3]) -> Stroke {
        Stroke {
            middle: self.middle(i),
            upright: self.upright[i] != 0,
            half: self.half[i],
            lean: self.lean[i],
            across: self.across[i],
            density: self.density[i],
            diameter_mm,
            layer: Layer { light, depth: self.depth[i] },
        }
    }
}
