//! Streak textures T(R, D): all drops of one size in a cube of air.
//!
//! The cube is seen from the side in orthographic projection. Each drop leaves the streak of one exposure, as opacity.
//! The texture tiles in both directions: a streak that leaves at one edge enters at the opposite one.

mod draw;

use bansho_base::{
    image::Image,
    math::random::{self, Key, Purpose},
};
use draw::{draw_line, draw_streak};

use crate::{
    drops::{
        size_distribution::{DropSizeDistribution, SizeBin, stratified_count},
        terminal_velocity::TerminalVelocity,
    },
    opacity_law::OpacityLaw,
    streaks::{
        coverage::{Streak, paper_opacity},
        oscillation::Oscillation,
    },
};

/// Parameters of streak textures; the defaults are the paper's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StreakCube {
    /// Edge of the cube, m.
    pub edge: f64,
    /// Pixels on a side of the texture.
    pub size: usize,
    /// Duration of the exposure, s.
    pub exposure: f64,
    /// Terminal velocity of the drops.
    pub terminal_velocity: TerminalVelocity,
    /// Opacity of streaks.
    pub opacity: OpacityLaw,
    /// Whether each drop has its own random diameter within its bin, instead of the bin's.
    pub spread: bool,
}

impl Default for StreakCube {
    fn default() -> Self {
        Self {
            edge: 1.0,
            size: 512,
            exposure: 1.0 / 30.0,
            terminal_velocity: TerminalVelocity::default(),
            opacity: OpacityLaw::default(),
            spread: false,
        }
    }
}

/// A drop in the cube.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FallingDrop {
    /// Diameter D, mm.
    pub diameter_mm: f64,
    /// Terminal velocity v, m/s downward.
    pub speed: f64,
    /// Its center when the shutter opens, m from the cube's lower left far corner: right, up, toward the viewer.
    pub position: [f64; 3],
}

const COUNT: Purpose = Purpose::named("drop count");
const POSITION: Purpose = Purpose::named("drop place");
const PHASE: Purpose = Purpose::named("drop phase");

impl StreakCube {
    /// Edge of a pixel, m.
    pub fn pixel(&self) -> f64 {
        self.edge / self.size as f64
    }

    /// Expected number of drops of a bin in the cube.
    pub fn mean_count(&self, sizes: &DropSizeDistribution, bin: &SizeBin) -> f64 {
        bin.count(sizes) * self.edge * self.edge * self.edge
    }

    /// The drops of one bin. Variants are other random drops of the same rain; the mean over all variants is the
    /// expected count.
    ///
    /// A heavier rain contains the drops of a lighter one, so textures of rising rates never lose a streak.
    pub fn drops(&self, sizes: &DropSizeDistribution, bin: &SizeBin, seed: u64, variant: u32) -> Vec<FallingDrop> {
        let key = Key::new(seed, &format!("streaks of {} mm", bin.diameter_mm));
        let [high, low, ..] = key.words(0, 0, COUNT);
        let count = stratified_count(self.mean_count(sizes, bin), variant, [high, low]);
        let drop = |index: u64| {
            let [x, y, z, size] = key.words(index, variant, POSITION).map(|word| random::uniform_f64(word, 0));
            let diameter_mm = if self.spread { sizes.quantile(size, bin.range_mm) } else { bin.diameter_mm };
            let speed = self.terminal_velocity.speed(diameter_mm);
            FallingDrop { diameter_mm, speed, position: [x, y, z].map(|fraction| fraction * self.edge) }
        };
        (0..count).map(drop).collect()
    }

    /// The streak that a drop leaves.
    pub fn streak(&self, drop: &FallingDrop) -> Streak {
        Streak::new(drop.diameter_mm, drop.speed, self.exposure)
    }

    /// Opacity of the cube, 0 to 1 for each pixel: the fraction of the pixel that the drops cover, averaged over the
    /// exposure. Overlapping streaks are composited with `over`.
    pub fn draw(&self, drops: &[FallingDrop]) -> Image<1> {
        let mut image = Image::filled(self.size, self.size, [0.0]);
        self.draw_over(drops, &mut image);
        image
    }

    /// Draws more drops over a texture of this cube.
    pub fn draw_over(&self, drops: &[FallingDrop], image: &mut Image<1>) {
        for drop in drops {
            // Image rows run downward, as the drop falls.
            let [x, y, _] = drop.position;
            let start = [x, self.edge - y];
            match self.opacity {
                OpacityLaw::ExposureFraction => {
                    draw_streak(&self.streak(drop), start, [self.pixel(); 2], &|_, _| 1.0, image);
                }
                OpacityLaw::Paper => {
                    let opacity = paper_opacity(drop.diameter_mm, drop.speed);
                    draw_line(start, self.streak(drop).length, opacity, self.pixel(), image);
                }
            }
        }
    }

    /// Draws the brightness of oscillating drops over a texture of this cube: their opacity times their brightness, relative to that of drops that do not
    /// oscillate. `amplitude` is that of [`Oscillation`]; the phases follow from the seed.
    pub fn draw_speckled_over(&self, drops: &[FallingDrop], amplitude: f64, seed: u64, image: &mut Image<1>) {
        let key = Key::new(seed, "oscillation of drops");
        for drop in drops {
            let [x, y, z] = drop.position;
            let phases = key.uniforms(x.to_bits(), (y + z).to_bits() as u32, PHASE);
            let oscillation = Oscillation::new(drop.diameter_mm, amplitude, [phases[0], phases[1]]);
            let brightness = |from: f64, to: f64| oscillation.mean_brightness(from / drop.speed, to / drop.speed);
            draw_streak(&self.streak(drop), [x, self.edge - y], [self.pixel(); 2], &brightness, image);
        }
    }
}

#[cfg(test)]
mod tests;
