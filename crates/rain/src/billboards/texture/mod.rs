//! Streak textures T(R, D): all drops of one size in a cube of air, drawn once.
//!
//! The cube is seen level and in parallel perspective; each drop leaves the streak of one exposure, as opacity. The texture
//! repeats in both directions: a streak that leaves at an edge enters at the opposite one.

mod draw;

use bansho_base::{
    image::Image,
    math::random::{self, Key, Purpose},
};

use crate::{
    drops::{
        size_distribution::{DropSizeDistribution, SizeBin, stratified_count},
        terminal_velocity::TerminalVelocity,
    },
    streaks::coverage::Streak,
};

pub(super) use draw::draw_streak;

/// How streak textures are made; the default is the paper's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StreakCube {
    /// Edge of the cube, m.
    pub edge: f64,
    /// Pixels on a side of the texture.
    pub size: usize,
    /// How long the shutter is open, s.
    pub exposure: f64,
    /// How fast drops fall.
    pub terminal_velocity: TerminalVelocity,
    /// Whether each drop has a diameter of its own within its bin, by the distribution, instead of the bin's.
    pub spread: bool,
}

impl Default for StreakCube {
    fn default() -> Self {
        Self {
            edge: 1.0,
            size: 512,
            exposure: 1.0 / 30.0,
            terminal_velocity: TerminalVelocity::default(),
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
    /// Its middle when the shutter opens, m from the cube's lower left far corner: right, up, toward the viewer.
    pub position: [f64; 3],
}

const COUNT: Purpose = Purpose::named("drop count");
const POSITION: Purpose = Purpose::named("drop place");

impl StreakCube {
    /// Edge of a pixel, m.
    pub fn pixel(&self) -> f64 {
        self.edge / self.size as f64
    }

    /// How many drops of a bin the cube holds on average.
    pub fn mean_count(&self, sizes: &DropSizeDistribution, bin: &SizeBin) -> f64 {
        bin.count(sizes) * self.edge * self.edge * self.edge
    }

    /// The drops of one bin. Variants are other drops of the same rain; all variants together keep the mean count.
    ///
    /// A stronger rain holds the drops of a weaker one and more, so textures of rising rates never lose a streak.
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

    /// Opacity of the cube, 0 to 1 a pixel: what share of the pixel the drops hide, averaged over the exposure. Where
    /// streaks overlap, what the one lets through meets the other.
    pub fn draw(&self, drops: &[FallingDrop]) -> Image<1> {
        let mut image = Image::filled(self.size, self.size, [0.0]);
        self.draw_over(drops, &mut image);
        image
    }

    /// Draws more drops over those that a texture of this cube holds.
    pub fn draw_over(&self, drops: &[FallingDrop], image: &mut Image<1>) {
        for drop in drops {
            // Downward from the upper edge, as rows run; the drop falls along it.
            let [x, y, _] = drop.position;
            draw_streak(&self.streak(drop), [x, self.edge - y], [self.pixel(); 2], 1.0, image);
        }
    }
}

#[cfg(test)]
mod tests;
