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

use std::{f64::consts::PI, fmt};

use bansho_base::{
    image::Image,
    math::{
        DVec3,
        random::{self, Key, Purpose},
    },
};

use crate::{
    drops::{
        size_distribution::{DropSizeDistribution, SizeBin, stratified_count},
        terminal_velocity::TerminalVelocity,
    },
    lighting::drop_phase_function::DropPhaseFunction,
    parameters::{DropCountLaw, OpacityLaw},
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
    /// Number of the drops of a bin.
    pub drop_count: DropCountLaw,
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
            drop_count: DropCountLaw::default(),
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
        /// The unit of n(D), mm.
        const UNIT_OF_DENSITY_MM: f64 = 1.0;
        let per_cubic_meter = match self.drop_count {
            DropCountLaw::Bin => bin.count(sizes),
            DropCountLaw::Density => sizes.density(bin.diameter_mm) * UNIT_OF_DENSITY_MM,
        };
        per_cubic_meter * self.edge * self.edge * self.edge
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
            draw_streak(
                &self.streak(drop),
                [x, self.edge - y],
                [self.pixel(); 2],
                &|from, to| oscillation.mean_brightness(from / speed, to / speed),
                image,
            );
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

/// A quantity that a streak texture is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum StreakQuantity {
    /// Edge of the cube.
    Edge,
    /// Pixels on a side of the texture.
    Size,
    /// Duration of the exposure.
    Exposure,
    /// Mean number of drops of a bin in the cube, which grows with the rain rate and the cube.
    MeanDropCount,
    /// Diameter of a drop or of a bin.
    DiameterMm,
    /// Speed of a drop.
    Speed,
    /// Coordinate of a drop.
    Position,
    /// Amplitude of the oscillation of drops.
    Oscillation,
}

impl StreakQuantity {
    /// The smallest and the largest value that is allowed.
    #[must_use]
    pub const fn limits(self) -> [f64; 2] {
        match self {
            Self::Edge => [1e-3, 100.0],
            Self::Size => [1.0, 4096.0],
            Self::Exposure => [1e-6, 10.0],
            Self::MeanDropCount => [0.0, 1e6],
            Self::DiameterMm => [1e-6, 40.0],
            Self::Speed => [0.0, 1000.0],
            Self::Position => [-1000.0, 1000.0],
            Self::Oscillation => [0.0, 1.0],
        }
    }

    /// Its unit; empty for a number.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Edge | Self::Position => "m",
            Self::Size => "pixels",
            Self::Exposure => "s",
            Self::DiameterMm => "mm",
            Self::Speed => "m/s",
            Self::MeanDropCount | Self::Oscillation => "",
        }
    }

    /// Checks a value; NaN is out of range.
    pub(super) fn check(self, value: f64) -> Result<(), StreakTextureError> {
        let [min, max] = self.limits();
        if (min..=max).contains(&value) {
            return Ok(());
        }
        Err(StreakTextureError::OutOfRange { quantity: self, value })
    }
}

impl fmt::Display for StreakQuantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Edge => "edge of the cube",
            Self::Size => "size of the texture",
            Self::Exposure => "exposure",
            Self::MeanDropCount => "mean number of drops",
            Self::DiameterMm => "diameter",
            Self::Speed => "speed of a drop",
            Self::Position => "position of a drop",
            Self::Oscillation => "amplitude of the oscillation",
        })
    }
}

/// Why a streak texture cannot be drawn.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StreakTextureError {
    /// A quantity is out of range, or not a number.
    #[error("{quantity}: {value} {}; allowed: {} to {}", .quantity.unit(), .quantity.limits()[0], .quantity.limits()[1])]
    OutOfRange {
        /// The quantity.
        quantity: StreakQuantity,
        /// Its value.
        value: f64,
    },
    /// The diameters of a bin do not ascend.
    #[error("a bin of diameters from {} to {} mm; allowed: ascending limits", .range_mm[0], .range_mm[1])]
    BinRange {
        /// Its ends, mm.
        range_mm: [f64; 2],
    },
    /// A texture that is drawn over has another size than the cube.
    #[error("a texture of {width} x {height} pixels; allowed: {size} x {size}, as set for the cube")]
    ImageSize {
        /// Columns of the texture.
        width: usize,
        /// Rows of the texture.
        height: usize,
        /// Size of the cube's textures.
        size: usize,
    },
    /// The vector toward the light has no direction.
    #[error("the light direction is the zero vector; allowed: a vector with at least one nonzero component")]
    LightDirection,
}

/// Quadrature lines within a row of pixels at a streak's ends, where its width varies.
const SAMPLE_LINES: usize = 4;

/// Draws a streak over an image, with wrap-around. The drop's center is at `start` when the shutter opens, m from the
/// left and upper edges, and falls. A pixel is `pixel` wide and high, m. `weight` scales the opacity between two positions along the streak, m.
pub(crate) fn draw_streak(
    streak: &Streak,
    [axis, start]: [f64; 2],
    pixel: [f64; 2],
    weight: &dyn Fn(f64, f64) -> f64,
    image: &mut Image<1>,
) {
    let [width, height] = pixel;
    let first_column = ((axis - streak.radius) / width).floor();
    let columns = ((axis + streak.radius) / width).floor() - first_column + 1.0;
    let across = PixelColumns { streak, left: first_column * width - axis, pixel, columns: columns as usize };
    let mut opacities = vec![0.0; across.columns];
    let within = across.line(0.5 * streak.length);
    let first_row = ((start - streak.radius) / height).floor() as i64;
    let last_row = ((start + streak.length + streak.radius) / height).floor() as i64;
    for row in first_row..=last_row {
        let from = row as f64 * height - start;
        let whole = streak.is_within(from) && streak.is_within(from + height);
        let opacities = if whole { &within } else { across.end_row(from, &mut opacities) };
        let y = row.rem_euclid(image.height() as i64) as usize;
        blend(image.row_mut(y), first_column as i64, weight(from, from + height), opacities);
    }
}

/// Draws the paper's line over an image, with wrap-around: one pixel wide, alike in opacity from `start` downward over `length`, m.
pub(crate) fn draw_line([x, start]: [f64; 2], length: f64, opacity: f64, pixel: f64, image: &mut Image<1>) {
    let column = (x / pixel).floor() as i64;
    let (first, last) = ((start / pixel).floor() as i64, ((start + length) / pixel).floor() as i64);
    for row in first..=last {
        let top = row as f64 * pixel;
        let covered = ((top + pixel).min(start + length) - top.max(start)) / pixel;
        let y = row.rem_euclid(image.height() as i64) as usize;
        blend(image.row_mut(y), column, covered.clamp(0.0, 1.0), &[opacity]);
    }
}

/// Composites opacities over a row, with wrap-around.
fn blend(row: &mut [[f32; 1]], first_column: i64, weight: f64, opacities: &[f64]) {
    let width = row.len();
    let mut x = first_column.rem_euclid(width as i64) as usize;
    for &opacity in opacities {
        let [under] = &mut row[x];
        *under += (weight * opacity) as f32 * (1.0 - *under);
        x = if x + 1 == width { 0 } else { x + 1 };
    }
}

/// The columns of pixels that a streak covers.
struct PixelColumns<'a> {
    streak: &'a Streak,
    /// Left edge of the first pixel relative to the axis, m.
    left: f64,
    pixel: [f64; 2],
    columns: usize,
}

impl PixelColumns<'_> {
    /// Mean opacity of each pixel on the line at `s`.
    fn line(&self, s: f64) -> Vec<f64> {
        let mut opacities = vec![0.0; self.columns];
        self.add_line(s, 1.0, &mut opacities);
        opacities
    }

    fn add_line(&self, s: f64, weight: f64, opacities: &mut [f64]) {
        let mut before = 0.0;
        for (index, opacity) in opacities.iter_mut().enumerate() {
            let until = self.streak.opacity_integral_to(self.left + (index + 1) as f64 * self.pixel[0], s);
            *opacity += weight * (until - before) / self.pixel[0];
            before = until;
        }
    }

    /// Mean opacity of each pixel of a row that begins at `from` and contains an end of the streak. The distribution
    /// comes from quadrature, the sum is exact.
    fn end_row<'b>(&self, from: f64, opacities: &'b mut [f64]) -> &'b [f64] {
        let (streak, [width, height]) = (self.streak, self.pixel);
        let (top, bottom) = (from.max(-streak.radius), (from + height).min(streak.length + streak.radius));
        opacities.fill(0.0);
        let step = (bottom - top) / SAMPLE_LINES as f64;
        (0..SAMPLE_LINES).for_each(|line| self.add_line(top + step * (line as f64 + 0.5), 1.0, opacities));
        let area =
            streak.blocked_area() * (streak.area_fraction_along(from + height) - streak.area_fraction_along(from));
        let sum: f64 = opacities.iter().sum();
        let scale = if sum > 0.0 { area / (sum * width * height) } else { 0.0 };
        // Near the rim of a resolved drop, rounding may exceed the range of an opacity.
        opacities.iter_mut().for_each(|opacity| *opacity = (*opacity * scale).clamp(0.0, 1.0));
        opacities
    }
}

#[cfg(test)]
mod tests;
