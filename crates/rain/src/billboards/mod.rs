//! Billboards: upright quads that turn about the vertical toward the camera, each with the streaks of all drops of one
//! diameter in a cell.
//!
//! The texture T(R, D) of a billboard is stored as a list of drop positions, not as pixels: a drop is narrower than a
//! pixel, so nearly all pixels would be empty, and streaks drawn from positions are sharp at any size.
//!
//! Far billboards are stochastically simplified: a random subset of the drops is drawn, each with a higher opacity, such that all together block the same
//! area. In R. L. Cook, J. Halstead, M. Planck and D. Ryu, "Stochastic simplification of aggregate detail" (2007), the number of elements follows from the
//! size of an object in the picture; here from what a single drop contributes to a pixel, so that large and bright drops, which are visible one by one, are
//! all drawn, and no single streak that represents several drops is visible.

pub mod texture;

use std::f64::consts::PI;

use bansho_base::{
    camera::upright_quad::{UprightQuad, right_facing},
    math::{
        DVec2, DVec3,
        random::{Key, Purpose},
        simd::{LANES, Real},
    },
};
use fearless_simd::dispatch;

use crate::{
    drops::{
        cell_drops::{DropBatch, FADE_IN},
        classes::DropClassState,
        lattice::{CELL_SIZE, LatticeCell},
        shutter_state::{DropState, ShutterState, Sphere, VisibleCell},
    },
    lanes::{LaneArray, ZERO_LANES},
    streaks::{
        bin::{StreakChunk, StreakChunkBuilder},
        project::StreakProjection,
    },
};

const TEXTURE: Purpose = Purpose::named("rain texture");
const OFFSET: Purpose = Purpose::named("rain billboard offset");
const POSITION: Purpose = Purpose::named("rain billboard place");
/// Maximum distance of a point of a billboard from its center, m.
const BILLBOARD_RADIUS: f64 = 0.75;
/// Texture variants of each diameter, against visible repetition.
const VARIANTS: usize = 2;

/// Positions of a texture's drops, across and up, 0 to 1, sixteen at a time.
type DropTexture = Vec<[LaneArray; 2]>;

/// The textures of all diameters at one rain rate.
struct DropTextures(Vec<[DropTexture; VARIANTS]>);

impl DropTextures {
    fn new(key: Key, classes: &[DropClassState]) -> Self {
        Self(classes.iter().map(|class| std::array::from_fn(|variant| drop_texture(key, class, variant))).collect())
    }
}

/// The positions of the drops of a class in one of its textures. Drops are keyed by their index, so that a texture with more drops contains those with fewer.
fn drop_texture(key: Key, class: &DropClassState, variant: usize) -> DropTexture {
    let drops = class.count().ceil() as u64;
    let mut texture = vec![[ZERO_LANES; 2]; (drops as usize).div_ceil(LANES)];
    for index in 0..drops {
        let [x, y, ..] = key.uniforms((variant as u64) << 32 | index, 0, class.purpose(TEXTURE));
        let (batch, i) = (&mut texture[index as usize / LANES], index as usize % LANES);
        (batch[0][i], batch[1][i]) = (x, y);
    }
    texture
}

/// A billboard: a quad, and a window into a texture.
struct Billboard<'a> {
    quad: UprightQuad,
    /// m/s.
    velocity: DVec3,
    /// Bends of the paths of its drops; `None` for uniform motion.
    bends: Option<[DVec2; 2]>,
    texture: &'a DropTexture,
    /// Texture coordinates of its corner.
    offset: [f32; 2],
    /// 1, or -1 if mirrored.
    mirror: f32,
    /// Threshold for the last, fractional drop of its texture.
    threshold: f32,
}

/// Visibility of a drop of a texture, from the drop count less its index. It is 1 for all but the last, fractional
/// drop, which that fraction of all billboards shows completely and the others do not, with a short fade.
#[inline(always)]
fn drop_visibility(remaining_count: f32, threshold: f32) -> f32 {
    ((remaining_count - threshold * (1.0 - FADE_IN) as f32) * (1.0 / FADE_IN) as f32).simd_clamp01()
}

/// Wraps a texture coordinate into 0..1.
#[inline(always)]
fn wrapped(coordinate: f32) -> f32 {
    coordinate - coordinate.floor()
}

/// Generates the streaks of billboards.
pub(super) struct Billboards<'a> {
    projection: StreakProjection<'a>,
    textures: DropTextures,
    /// Radiance below which the light of a streak is left out, cd/m^2.
    culling_radiance: f32,
    /// Leaves out a part of the drops; `None` to draw them all.
    simplification: Option<StochasticSimplification>,
}

impl<'a> Billboards<'a> {
    /// Streaks whose radiance is below `culling_radiance` (cd/m^2) everywhere are drawn without the light of lamps and
    /// fires.
    pub(super) fn new(
        projection: StreakProjection<'a>,
        culling_radiance: f32,
        simplification: Option<StochasticSimplification>,
    ) -> Self {
        let shutter_state = projection.shutter_state;
        let textures = DropTextures::new(shutter_state.key, &shutter_state.classes);
        Self { projection, textures, culling_radiance, simplification }
    }

    /// The streaks of all cells that may be visible within a sphere.
    pub(super) fn chunks(&self, within: Sphere) -> Vec<StreakChunk> {
        self.projection.cell_chunks(
            &[within],
            CELL_SIZE,
            |class, cell, builder| dispatch!(self.projection.level, _simd => self.add_billboard(class, cell, builder)),
        )
    }

    /// Adds the streaks of a cell's billboard.
    #[inline(always)]
    fn add_billboard(&self, class: &DropClassState, visible: &VisibleCell, builder: &mut StreakChunkBuilder) {
        let fraction = self.fraction(class, visible);
        let count = (class.count() * fraction) as f32;
        let contents = class.lattice.contents(visible.cell);
        let placement = self.projection.shutter_state.key.uniforms(contents, 0, class.purpose(POSITION));
        if drop_visibility(count, placement[2]) <= 0.0 {
            return;
        }
        builder.set_drops_per_streak(1.0 / fraction);
        let billboard = self.billboard(class, visible.cell, contents, placement);
        let [base, right, up] = self.quad_edges(&billboard.quad);
        // The bound costs more than it saves without culling.
        let min_peak = if self.culling_radiance > 0.0 {
            self.culling_radiance
                / self.projection.lighting.max_radiance(billboard.quad.point(0.5, 0.5), BILLBOARD_RADIUS)
        } else {
            0.0
        };
        let velocity = billboard.velocity.as_vec3().to_array();
        let bends = billboard.bends.map(|ends| ends.map(|bend| [[bend.x as f32; LANES], [bend.y as f32; LANES]]));
        let diameter_mm = class.diameter_mm as f32;
        let opacity_factor = self.projection.shutter_state.opacity_factor(class.diameter_mm, class.speed);
        let opacity_factor = (opacity_factor / fraction) as f32;
        for (batch, texture) in billboard.texture.iter().enumerate() {
            if (batch * LANES) as f32 >= count + 1.0 {
                break;
            }
            let mut drops = DropBatch {
                positions: [ZERO_LANES; 3],
                velocities: velocity.map(|v| [v; LANES]),
                bends,
                diameter_mm,
                opacity_factor,
                presence: ZERO_LANES,
            };
            for i in 0..LANES {
                drops.presence[i] = drop_visibility(count - (batch * LANES + i) as i32 as f32, billboard.threshold);
                let (x, y) = (
                    wrapped(billboard.mirror * (texture[0][i] - billboard.offset[0])),
                    wrapped(texture[1][i] - billboard.offset[1]),
                );
                for axis in 0..3 {
                    drops.positions[axis][i] = up[axis].fma(y, right[axis].fma(x, base[axis]));
                }
            }
            self.projection.add_drops(&drops, min_peak, builder);
        }
    }

    /// Corner of a quad relative to the camera, and its edge vectors, m.
    fn quad_edges(&self, quad: &UprightQuad) -> [[f32; 3]; 3] {
        let eye = self.projection.shutter_state.cameras.middle().position;
        let [corner, right, up] = [quad.point(0.0, 0.0), quad.point(1.0, 0.0), quad.point(0.0, 1.0)];
        [corner - eye, right - corner, up - corner].map(|vector| vector.as_vec3().to_array())
    }

    /// Fraction of the drops of a billboard that is drawn.
    fn fraction(&self, class: &DropClassState, visible: &VisibleCell) -> f64 {
        let StreakProjection { shutter_state, lighting, .. } = self.projection;
        self.simplification.map_or(1.0, |simplification| {
            let toward = (visible.center - shutter_state.cameras.middle().position).normalize_or_zero();
            let radiance = lighting.max_radiance_along(visible.center, BILLBOARD_RADIUS, toward);
            simplification.fraction(shutter_state, class, visible.distance, radiance.into())
        })
    }

    /// The billboard of a cell with some `contents`, at a random position within it.
    fn billboard(
        &self,
        class: &DropClassState,
        cell: LatticeCell,
        contents: u64,
        [x, z, threshold, _]: [f32; 4],
    ) -> Billboard<'_> {
        let shutter_state = self.projection.shutter_state;
        let [across, up, choice, mirrored] = shutter_state.key.uniforms(contents, 0, class.purpose(OFFSET));
        // At a random position within the cell, so that billboards do not line up.
        let DropState { position: middle, velocity, bends } =
            shutter_state.drop_state(class, cell, DVec3::new(x.into(), 0.5, z.into()));
        let height = class.lattice.height();
        let base = middle - DVec3::Y * (0.5 * height);
        let right = right_facing(shutter_state.cameras.middle(), base);
        Billboard {
            quad: UprightQuad::new(base, right, DVec2::new(CELL_SIZE, height), 0.0),
            velocity,
            bends,
            texture: &self.textures.0[class.index][(choice * VARIANTS as f32) as usize],
            offset: [across, up],
            mirror: if mirrored < 0.5 { 1.0 } else { -1.0 },
            threshold,
        }
    }
}

/// How much of the drops of a billboard is drawn.
#[derive(Clone, Copy)]
pub(crate) struct StochasticSimplification {
    /// Radiance of display white, cd/m^2.
    pub(crate) white: f64,
    /// Contribution of a streak to a pixel, relative to display white, up to which it stands for several drops.
    pub(crate) max_contribution: f64,
}

impl StochasticSimplification {
    /// Fraction of the drops of a class at `distance` from the camera (m) that is drawn, above 0, at most 1; their opacity is divided by it. `radiance` is
    /// that of a drop there, cd/m^2.
    ///
    /// It is continuous in all that moves, so drops come and go one by one.
    pub(super) fn fraction(&self, state: &ShutterState, class: &DropClassState, distance: f64, radiance: f64) -> f64 {
        // A drop that is as bright as what is behind it still hides that: at most white.
        let contrast = 1.0 + radiance / self.white;
        (peak_opacity(state, class, distance) * contrast / self.max_contribution).clamp(f64::MIN_POSITIVE, 1.0)
    }
}

/// Largest opacity of a pixel behind a drop of a class at `distance` from the camera, m.
fn peak_opacity(state: &ShutterState, class: &DropClassState, distance: f64) -> f64 {
    let pixels_per_meter = state.cameras.middle().focal_pixels / distance.max(f64::MIN_POSITIVE);
    let diameter = 1e-3 * class.diameter_mm * pixels_per_meter;
    let length = class.speed * state.cameras.exposure_time * pixels_per_meter;
    let factor = state.opacity_factor(class.diameter_mm, class.speed);
    factor * 0.25 * PI * diameter * diameter / (length.max(1.0) * diameter.max(1.0))
}

#[cfg(test)]
mod tests {
    use bansho_base::phenomenon::surroundings::Surroundings;

    use super::*;
    use crate::{
        Method,
        tests::{rain, streaks, view_at, wind},
    };

    #[test]
    fn the_fraction_is_what_a_drop_shows_over_what_a_streak_may_show() {
        let calm = wind([0.0; 3], 0.0);
        let view = view_at(1.0, 1.0 / 60.0, [320, 180]);
        let rain = rain(streaks(Method::Billboards, 50.0), 1);
        let state = rain.shutter_state(&view, &Surroundings::from_wind(&calm));
        let class = state.classes.last().unwrap();
        let simplification = StochasticSimplification { white: 10.0, max_contribution: 0.01 };
        let fraction = |distance: f64, radiance: f64| simplification.fraction(&state, class, distance, radiance);
        // 90 pixels in tan 16 degrees are 313.9 pixels for a meter at a meter. A drop of 2 mm falls 10.8 cm at 6.49 m/s.
        assert!((class.diameter_mm - 2.0).abs() < 1e-9 && (class.speed - 6.49).abs() < 0.02, "{class:?}");
        let at_10_m = 0.25 * PI * 0.06278 * 0.06278 / (class.speed / 60.0 * 31.39);
        assert!((fraction(10.0, 0.0) / (at_10_m / 0.01) - 1.0).abs() < 1e-3, "{}", fraction(10.0, 0.0));
        // As bright as white, it counts for twice as much.
        assert!((fraction(10.0, 10.0) / fraction(10.0, 0.0) - 2.0).abs() < 1e-9);
        // A streak of many pixels weakens with the distance; one within a pixel with its square.
        assert!((fraction(20.0, 0.0) / fraction(10.0, 0.0) - 0.5).abs() < 1e-9);
        assert!((fraction(80.0, 0.0) / fraction(40.0, 0.0) - 0.25).abs() < 1e-9);
        assert_eq!(fraction(0.5, 1000.0), 1.0);
    }
}
