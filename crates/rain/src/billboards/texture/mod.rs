//! Streak textures T(R, D): all drops of one size in a cube of air.
//!
//! The cube is seen from the side in orthographic projection. Each drop leaves the streak of one exposure, as opacity.
//! The texture tiles in both directions: a streak that leaves at one edge enters at the opposite one.
//!
//! A texture is an [`Image<1>`](Image) of `size` x `size` opacities from 0 to 1, linear, row by row from the top left; a pixel is
//! `edge / size` meters wide. [`StreakCube::draw_lit`] gives the radiance in the light of a distant lamp as an `Image<3>`. For a single drop in one exposure:
//!
//! ```
//! use bansho_base::image::Image;
//! use bansho_rain::billboards::texture::{FallingDrop, StreakCube, StreakQuantity, StreakTextureError};
//!
//! // 20 cm of air in 256 x 256 pixels, 1/60 s.
//! let cube = StreakCube { edge: 0.2, size: 256, exposure: 1.0 / 60.0, ..StreakCube::default() };
//! // A drop of 2 mm, which falls at 6.5 m/s from near the upper edge.
//! let drop = FallingDrop::new(2.0, [0.1, 0.19, 0.1], &cube.terminal_velocity);
//! let texture: Image<1> = cube.draw(&[drop])?;
//! assert_eq!((texture.width(), texture.height()), (256, 256));
//!
//! // However long the streak is, it blocks the drop's disc, pi D^2 / 4.
//! let blocked: f64 = texture.pixels().iter().map(|[opacity]| f64::from(*opacity) * cube.pixel() * cube.pixel()).sum();
//! assert!((blocked / 3.1416e-6 - 1.0).abs() < 1e-3);
//! // On its axis the opacity is D / (v T): 2 mm of 108 mm.
//! let streak = cube.streak(&drop);
//! assert!((streak.profile(0.0) - 0.0185).abs() < 1e-4);
//!
//! // What makes no sense is refused.
//! let empty = StreakCube { size: 0, ..cube }.draw(&[drop]);
//! assert_eq!(empty, Err(StreakTextureError::OutOfRange { quantity: StreakQuantity::Size, value: 0.0 }));
//! # Ok::<(), StreakTextureError>(())
//! ```

mod draw;
mod error;

use std::f64::consts::PI;

use bansho_base::{
    image::Image,
    math::{
        DVec3,
        random::{self, Key, Purpose},
    },
};
use draw::{draw_line, draw_streak};
pub use error::{StreakQuantity, StreakTextureError};

use crate::{
    drops::{
        size_distribution::{DropSizeDistribution, SizeBin, stratified_count},
        terminal_velocity::TerminalVelocity,
    },
    lighting::drop_phase_function::DropPhaseFunction,
    parameters::OpacityLaw,
    streaks::{
        coverage::{Streak, paper_opacity},
        oscillation::Oscillation,
    },
};

/// Parameters of streak textures; the defaults are the paper's. Values are checked when they are used, against
/// [`StreakQuantity::limits`].
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

impl FallingDrop {
    /// A drop of diameter D (mm) at its terminal velocity. `position` is that of its center when the shutter opens, m from the cube's lower left far
    /// corner: right, up, toward the viewer.
    #[must_use]
    pub fn new(diameter_mm: f64, position: [f64; 3], terminal_velocity: &TerminalVelocity) -> Self {
        Self { diameter_mm, speed: terminal_velocity.speed(diameter_mm), position }
    }

    fn check(&self) -> Result<(), StreakTextureError> {
        StreakQuantity::DiameterMm.check(self.diameter_mm)?;
        StreakQuantity::Speed.check(self.speed)?;
        self.position.iter().try_for_each(|coordinate| StreakQuantity::Position.check(*coordinate))
    }
}

const COUNT: Purpose = Purpose::named("drop count");
const POSITION: Purpose = Purpose::named("drop place");
const PHASE: Purpose = Purpose::named("drop phase");

impl StreakCube {
    /// Checks edge, size and exposure.
    ///
    /// # Errors
    /// The first of them that is out of range.
    pub fn check(&self) -> Result<(), StreakTextureError> {
        StreakQuantity::Edge.check(self.edge)?;
        StreakQuantity::Size.check(self.size as f64)?;
        StreakQuantity::Exposure.check(self.exposure)
    }

    /// Checks the cube, and that a texture that is drawn over has its size.
    fn check_image<const N: usize>(&self, image: &Image<N>) -> Result<(), StreakTextureError> {
        self.check()?;
        let (width, height, size) = (image.width(), image.height(), self.size);
        if [width, height] == [size; 2] { Ok(()) } else { Err(StreakTextureError::ImageSize { width, height, size }) }
    }

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
    ///
    /// # Errors
    /// A cube or a bin that is out of range, or more than a million drops.
    pub fn drops(
        &self,
        sizes: &DropSizeDistribution,
        bin: &SizeBin,
        seed: u64,
        variant: u32,
    ) -> Result<Vec<FallingDrop>, StreakTextureError> {
        self.check()?;
        StreakQuantity::DiameterMm.check(bin.diameter_mm)?;
        let [low, high] = bin.range_mm;
        if !(low >= 0.0 && low <= high && high <= StreakQuantity::DiameterMm.limits()[1]) {
            return Err(StreakTextureError::BinRange { range_mm: bin.range_mm });
        }
        StreakQuantity::MeanDropCount.check(self.mean_count(sizes, bin))?;
        let key = Key::new(seed, &format!("streaks of {} mm", bin.diameter_mm));
        let [high, low, ..] = key.words(0, 0, COUNT);
        let count = stratified_count(self.mean_count(sizes, bin), variant, [high, low]);
        let drops = (0..count).map(|index| {
            let [x, y, z, size] = key.words(index, variant, POSITION).map(|word| random::uniform_f64(word, 0));
            let diameter_mm = if self.spread { sizes.quantile(size, bin.range_mm) } else { bin.diameter_mm };
            FallingDrop::new(diameter_mm, [x, y, z].map(|fraction| fraction * self.edge), &self.terminal_velocity)
        });
        Ok(drops.collect())
    }

    /// The streak that a drop leaves.
    pub fn streak(&self, drop: &FallingDrop) -> Streak {
        Streak::new(drop.diameter_mm, drop.speed, self.exposure)
    }

    /// Opacity of the cube, 0 to 1 for each pixel: the fraction of the pixel that the drops cover, averaged over the
    /// exposure. Overlapping streaks are composited with `over`.
    ///
    /// # Errors
    /// A cube or a drop that is out of range.
    pub fn draw(&self, drops: &[FallingDrop]) -> Result<Image<1>, StreakTextureError> {
        self.check()?;
        let mut image = Image::filled(self.size, self.size, [0.0]);
        self.draw_over(drops, &mut image)?;
        Ok(image)
    }

    /// Radiance of the drops in the light of a distant lamp for unit illuminance, 1/sr, red, green and blue for each pixel: the opacity times that of an opaque
    /// drop, [`lit_radiance`]. `toward` points to the lamp: right, up, toward the viewer; its length does not matter.
    ///
    /// # Errors
    /// A cube or a drop that is out of range, or a vector without length.
    pub fn draw_lit(
        &self,
        drops: &[FallingDrop],
        toward: [f64; 3],
        phase_function: &DropPhaseFunction,
    ) -> Result<Image<3>, StreakTextureError> {
        let radiance = lit_radiance(toward, phase_function)?;
        let opacity = self.draw(drops)?;
        let mut image = Image::filled(self.size, self.size, [0.0; 3]);
        for (pixel, [opacity]) in image.pixels_mut().iter_mut().zip(opacity.pixels()) {
            *pixel = radiance.map(|radiance| radiance * opacity);
        }
        Ok(image)
    }

    /// Draws more drops over a texture of this cube.
    ///
    /// # Errors
    /// A cube or a drop that is out of range, or a texture of another size; the texture is then unchanged.
    pub fn draw_over(&self, drops: &[FallingDrop], image: &mut Image<1>) -> Result<(), StreakTextureError> {
        self.check_image(image)?;
        drops.iter().try_for_each(FallingDrop::check)?;
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
        Ok(())
    }

    /// Draws the brightness of oscillating drops over a texture of this cube: their opacity times their brightness, relative to that of drops that do not
    /// oscillate. `amplitude` is that of [`Oscillation`]; the phases follow from the seed.
    ///
    /// # Errors
    /// A cube, a drop or an amplitude that is out of range, or a texture of another size; the texture is then unchanged.
    pub fn draw_speckled_over(
        &self,
        drops: &[FallingDrop],
        amplitude: f64,
        seed: u64,
        image: &mut Image<1>,
    ) -> Result<(), StreakTextureError> {
        /// Avoids a division by zero for a drop at rest, m/s.
        const MIN_SPEED: f64 = 1e-9;
        self.check_image(image)?;
        StreakQuantity::Oscillation.check(amplitude)?;
        drops.iter().try_for_each(FallingDrop::check)?;
        let key = Key::new(seed, "oscillation of drops");
        for drop in drops {
            let [x, y, z] = drop.position;
            let phases = key.uniforms(x.to_bits(), (y + z).to_bits() as u32, PHASE);
            let oscillation = Oscillation::new(drop.diameter_mm, amplitude, [phases[0], phases[1]]);
            let speed = drop.speed.max(MIN_SPEED);
            let brightness = |from: f64, to: f64| oscillation.mean_brightness(from / speed, to / speed);
            draw_streak(&self.streak(drop), [x, self.edge - y], [self.pixel(); 2], &brightness, image);
        }
        Ok(())
    }
}

/// Radiance toward the viewer of an opaque drop in the light of a distant lamp for unit illuminance, 1/sr, red, green and blue: `p / (4 pi)`. `toward` points
/// to the lamp: right, up, toward the viewer; its length does not matter.
///
/// # Errors
/// A vector without length.
pub fn lit_radiance(toward: [f64; 3], phase_function: &DropPhaseFunction) -> Result<[f32; 3], StreakTextureError> {
    let toward = DVec3::from(toward).try_normalize().ok_or(StreakTextureError::LightDirection)?;
    // The light travels along `-toward`, and is scattered to the viewer along z.
    Ok(phase_function.phase(-toward.z as f32).map(|phase| phase / (4.0 * PI) as f32))
}

#[cfg(test)]
mod tests;
