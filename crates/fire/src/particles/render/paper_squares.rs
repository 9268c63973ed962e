//! The paper's figure 7: each particle as a square, colored from blue to red by the density of its gas.

use bansho_base::{
    color,
    image::Rect,
    math,
    phenomenon::strip::{DepthInterval, Strip},
};

use crate::particles::{
    parameters::GasRenderingParameters,
    render::{
        gas::Gas,
        gas_view::GasView,
        project::{ProjectedParticle, SpriteKind, project_particles},
    },
};

/// Luminance of a square, cd/m^2: about that of the flame, so that the same exposure suits both.
const LUMINANCE: f32 = 6000.0;

/// A square in the picture.
struct Square {
    rect: Rect,
    depth: f64,
    color: [f32; 3],
}

/// Conversion of particles to squares.
struct SquareSprites<'a> {
    gas: &'a Gas<'a>,
    /// Side, in support radii.
    side: f32,
    window: Rect,
    densest: f64,
}

impl SpriteKind for SquareSprites<'_> {
    type Record = Option<Square>;

    fn includes(&self, _index: usize) -> bool {
        true
    }

    fn record(&self, projected: &ProjectedParticle) -> Option<Square> {
        let radius = self.gas.particles.support_radius[projected.index];
        let side = (self.side * radius * projected.scale).max(1.0);
        let rect = square_rect(projected.ellipse.center, side, self.window)?;
        let density = f64::from(self.gas.particles.density[projected.index]) / self.densest;
        Some(Square { rect, depth: projected.depth, color: color(density) })
    }
}

/// All squares, nearest first.
pub(crate) struct Squares(Vec<Square>);

impl Squares {
    pub(crate) fn new(gas: &Gas, rendering: &GasRenderingParameters, view: &GasView) -> Self {
        let kind = SquareSprites {
            gas,
            side: rendering.square_size as f32,
            window: view.window,
            densest: density_percentile_95(gas),
        };
        let mut squares: Vec<Square> =
            project_particles(gas, view, &kind).iter_mut().flat_map(|task| task.drain(..)).flatten().collect();
        // A stable sort: at one depth the order of particles is kept.
        squares.sort_by(|a, b| a.depth.total_cmp(&b.depth));
        Self(squares)
    }

    pub(crate) fn bounds(&self, slice: &DepthInterval) -> Rect {
        let in_slice = self.0.iter().filter(|square| slice.contains(square.depth));
        in_slice.fold(Rect::default(), |all, square| all.union(&square.rect))
    }

    pub(crate) fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        for square in self.0.iter().filter(|square| slice.contains(square.depth)) {
            let rect = square.rect.intersection(&strip.rect);
            for y in rect.y..rect.bottom() {
                for x in rect.x..rect.right() {
                    let index = (y - strip.rect.y) * strip.rect.width + x - strip.rect.x;
                    if strip.visible(index, square.depth as f32) {
                        strip.add_behind(index, square.color, [0.0; 3], square.depth as f32);
                    }
                }
            }
        }
    }
}

/// The 95th percentile of the density, which is shown as full red.
fn density_percentile_95(gas: &Gas) -> f64 {
    let mut densities = gas.particles.density.clone();
    densities.sort_by(f32::total_cmp);
    densities.get(densities.len() * 19 / 20).map_or(1.0, |density| f64::from(density.max(1e-12)))
}

/// From blue (thin) through violet to red (dense), ACEScg of [`LUMINANCE`].
fn color(density_ratio: f64) -> [f32; 3] {
    let red = math::smoothstep(0.0, 1.0, density_ratio) as f32;
    let rgb = color::acescg_from_srgb([red, 0.08, 1.0 - red]);
    let scale = LUMINANCE / color::luminance(rgb);
    rgb.map(|value| value * scale * (0.35 + 0.65 * red))
}

/// The pixels of a square within the window, if there are any.
fn square_rect(center: [f32; 2], side: f32, window: Rect) -> Option<Rect> {
    let low = center.map(|value| (value - 0.5 * side).round());
    let high = low.map(|value| value + side.round().max(1.0));
    let [x, right] = [low[0], high[0]].map(|edge| (edge.max(0.0) as usize).clamp(window.x, window.right()));
    let [y, bottom] = [low[1], high[1]].map(|edge| (edge.max(0.0) as usize).clamp(window.y, window.bottom()));
    (right > x && bottom > y).then(|| Rect { x, y, width: right - x, height: bottom - y })
}
