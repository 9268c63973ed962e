//! Conventions of alpha.

crate::choice! {
    /// Convention for alpha and color of a picture with straight alpha. Such a picture can only cover its background, while fire, rain and aurora
    /// mostly add light, and programs differ in the values that they blend.
    pub enum AlphaConvention {
        /// For programs that blend encoded values, such as browsers, 8-bit image editors and video players: the blend over black is exact to
        /// one code, and over mid-gray it is closest to the exact result.
        Encoded = "encoded",
        /// For programs that blend linear light, such as compositors and game engines: the blend over black is exact.
        Linear = "linear",
    }
}

/// How the alpha of display codes relates to their color, and which values the program that shows them blends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum AlphaMode {
    /// `out = A color + (1 - A) background`, as in PNG. `A` is at least the largest component of the color, since such a pixel can only cover
    /// its background.
    Straight(AlphaConvention),
    /// `out = color + (1 - A) background`, where the color is the sRGB code of the light over black.
    ///
    /// - [`Linear`](AlphaConvention::Linear): for textures that the GPU decodes before it blends (`Rgba8UnormSrgb` of wgpu and Vulkan). `A` is the
    ///   frame's alpha, so light is added where nothing covers, over every background. Colors may exceed alpha.
    /// - [`Encoded`](AlphaConvention::Encoded): for programs that blend the codes themselves, such as `Color32` of egui, browsers and 2-D graphics
    ///   libraries. It is the pixel of `Straight(Encoded)` before its color is divided by `A`: no component exceeds alpha, and the
    ///   blend over black is exact.
    Premultiplied(AlphaConvention),
}
