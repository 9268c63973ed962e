//! The paper to the letter: `method = "textures"`.
//!
//! A [`TextureSet`] is the paper's preprocess (section 4): for each rain rate R_i and diameter D_j a texture T(R_i, D_j) of 512 x 512 pixels in 8 bits, with the
//! streaks of a cubic meter in 1/30 s. A frame (section 5) cuts the air around the camera into voxels of 1 m, each with a billboard for each diameter.
//! Billboards fall with v(D); one that has fallen into the ground returns to the top. Each turns about the vertical toward the camera, is lit at its corners
//! by directional, point and spot lights, and shows the texture of the rate nearest to R. All are drawn in order of depth.
//!
//! Where the paper is silent: light is `E / (4 pi)`, that of a drop which scatters evenly; textures are filtered with mipmaps, bilinearly, as OpenGL does; a
//! billboard whose brightest pixel would be less than 1/128 of an 8-bit code counts as unlit.
//!
//! What the paper leaves out is left out here: wind, sky light, airlight, lenses that defocus, and streaks that slant as the camera moves.

mod quads;
mod texture_set;

pub(crate) use quads::TexturedBillboards;
pub use texture_set::TextureSet;

#[cfg(test)]
mod tests;
