//! The paper to the letter: `method = "textures"`.
//!
//! A [`TextureSet`] is the paper's preprocess (section 4): for each rain rate R_i and diameter D_j a texture T(R_i, D_j) of 512 x 512 pixels in 8 bits, with the
//! streaks of a cubic meter in 1/30 s. A frame (section 5) cuts the air around the camera into voxels of 1 m, each with a billboard for each diameter.
//! Billboards fall with v(D); one that has fallen into the ground returns to the top. Each turns about the vertical toward the camera, is lit at its corners
//! by directional, point and spot lights, and shows the texture of the rate nearest to R. All are drawn in order of depth.
//!
//! What the paper does not state: light is `E / (4 pi)`, that of a drop which scatters isotropically; textures are filtered with mipmaps, bilinearly, as OpenGL
//! does; a billboard whose brightest pixel would be less than 1/128 of an 8-bit code counts as unlit.
//!
//! What the paper leaves out is left out here: wind, sky light, airlight, lenses that defocus, and streaks that slant as the camera moves.

mod quads;

use bansho_base::{image::Image, math};
pub(crate) use quads::TexturedBillboards;

use crate::{
    RainParameters,
    billboards::texture::{StreakCube, StreakTextureError},
    drops::{
        size_distribution::{DropSizeDistribution, SizeBin},
        terminal_velocity::{FallAir, TerminalVelocity},
    },
};

#[cfg(test)]
mod tests;

/// Exposure of the textures: a frame of the paper's 30 per second, s.
pub(crate) const EXPOSURE: f64 = 1.0 / 30.0;

/// The textures T(R_i, D_j).
#[derive(Debug)]
pub struct TextureSet {
    rates: Vec<f64>,
    /// By rate, then by diameter.
    textures: Vec<Vec<StreakTexture>>,
    /// Opacity of the largest code.
    scale: f32,
}

/// One texture: codes from 0 to 255, and mipmaps of half the size each.
#[derive(Debug)]
pub(crate) struct StreakTexture {
    codes: Vec<u8>,
    size: usize,
    /// Means of codes, times 256.
    mipmaps: Vec<Vec<u16>>,
    largest: u8,
    /// Drops that it shows.
    drop_count: usize,
}

impl TextureSet {
    /// Draws the textures of some rain.
    ///
    /// # Errors
    /// Diameters or rates that do not occur in rain.
    pub fn new(parameters: &RainParameters, seed: u64) -> Result<Self, StreakTextureError> {
        let terminal_velocity = TerminalVelocity { law: parameters.terminal_velocity, air: FallAir::default() };
        let cube = StreakCube {
            exposure: EXPOSURE,
            terminal_velocity,
            opacity: parameters.opacity,
            drop_count: parameters.texture_drop_count,
            ..StreakCube::default()
        };
        let bins = SizeBin::around(&parameters.diameters_mm);
        let draw = |sizes: &DropSizeDistribution, bin: &SizeBin| {
            let drops = cube.drops(sizes, bin, seed, 0)?;
            Ok((cube.draw(&drops)?, drops.len()))
        };
        let pictures: Vec<Vec<(Image<1>, usize)>> = parameters
            .texture_rates_mm_per_h
            .iter()
            .map(|rate| {
                let sizes = DropSizeDistribution::marshall_palmer(*rate);
                bins.iter().map(|bin| draw(&sizes, bin)).collect()
            })
            .collect::<Result<_, StreakTextureError>>()?;
        let values = pictures.iter().flatten().flat_map(|(picture, _)| picture.pixels().as_flattened());
        let scale = values.copied().fold(f32::MIN_POSITIVE, f32::max);
        let textures = pictures
            .iter()
            .map(|row| row.iter().map(|(picture, drops)| StreakTexture::new(picture, scale, *drops)).collect());
        Ok(Self { rates: parameters.texture_rates_mm_per_h.clone(), textures: textures.collect(), scale })
    }

    /// Number of textures.
    pub fn count(&self) -> usize {
        self.textures.iter().map(Vec::len).sum()
    }

    /// Bytes of their pixels, without mipmaps.
    pub fn bytes(&self) -> usize {
        self.textures.iter().flatten().map(|texture| texture.codes.len()).sum()
    }

    /// The textures of the rate nearest to `rate` (mm/h), by diameter; none without rain.
    pub(crate) fn of_rate(&self, rate: f64) -> &[StreakTexture] {
        let distances = self.rates.iter().map(|other| (other - rate).abs());
        let nearest = distances.enumerate().min_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(index, _)| index);
        nearest.filter(|_| rate > 0.0).map_or(&[], |index| &self.textures[index])
    }

    /// Opacity of one code.
    pub(crate) fn opacity_of_code(&self) -> f32 {
        self.scale * (1.0 / 255.0)
    }
}

impl StreakTexture {
    fn new(picture: &Image<1>, scale: f32, drop_count: usize) -> Self {
        let opacities = picture.pixels().as_flattened().iter();
        let codes: Vec<u8> = opacities.map(|opacity| (opacity / scale * 255.0 + 0.5) as u8).collect();
        let mut mipmaps = Vec::new();
        let (mut finer, mut side) =
            (codes.iter().map(|code| u32::from(*code) << 8).collect::<Vec<u32>>(), picture.width());
        while side > 1 {
            let half = side / 2;
            let means = (0..half * half).map(|index| {
                let first = 2 * (index / half) * side + 2 * (index % half);
                (finer[first] + finer[first + 1] + finer[first + side] + finer[first + side + 1] + 2) / 4
            });
            let coarser: Vec<u32> = means.collect();
            mipmaps.push(coarser.iter().map(|value| *value as u16).collect());
            (finer, side) = (coarser, half);
        }
        let largest = codes.iter().copied().max().unwrap_or(0);
        Self { codes, size: picture.width(), mipmaps, largest, drop_count }
    }

    /// The largest code of its pixels.
    pub(crate) fn largest(&self) -> u8 {
        self.largest
    }

    /// Drops that it shows.
    pub(crate) fn drop_count(&self) -> usize {
        self.drop_count
    }

    /// The mipmap for a pixel that covers `texels` texels; 0 is the texture itself.
    pub(crate) fn level(&self, texels: f64) -> usize {
        (math::log2(texels.max(1.0)).round() as usize).min(self.mipmaps.len())
    }

    /// The code at a position from the lower left corner (0 to 1), bilinear within a mipmap; the texture repeats.
    #[inline(always)]
    pub(crate) fn sample(&self, level: usize, [u, v]: [f32; 2]) -> f32 {
        // Sides are powers of two.
        let side = self.size >> level;
        let (x, y) = (u * side as f32 + (side as f32 - 0.5), (1.0 - v) * side as f32 + (side as f32 - 0.5));
        let (column, row) = (x as i32 as usize, y as i32 as usize);
        let (across, down) = (x - column as i32 as f32, y - row as i32 as f32);
        let mask = side - 1;
        let (left, right) = (column & mask, (column + 1) & mask);
        let (above, below) = ((row & mask) * side, ((row + 1) & mask) * side);
        let corners = [above + left, above + right, below + left, below + right];
        let mut values = [0.0; 4];
        match level.checked_sub(1) {
            None => (0..4).for_each(|i| values[i] = f32::from(self.codes[corners[i]])),
            Some(mipmap) => {
                let codes = &self.mipmaps[mipmap];
                (0..4).for_each(|i| values[i] = f32::from(codes[corners[i]]) * (1.0 / 256.0));
            }
        }
        let upper = values[0] + (values[1] - values[0]) * across;
        let lower = values[2] + (values[3] - values[2]) * across;
        upper + (lower - upper) * down
    }
}
