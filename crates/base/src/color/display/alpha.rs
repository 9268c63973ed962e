//! Conventions of straight alpha.

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
