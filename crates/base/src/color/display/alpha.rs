//! Conventions of straight alpha.

crate::choice! {
    /// How alpha and color of a picture with straight alpha are chosen. A display format can only cover what is behind, while fire, rain and
    /// aurora mostly add light; and programs differ in what they blend.
    pub enum AlphaConvention {
        /// For programs that blend encoded values, as browsers, 8-bit image editors and video players do: such a blend over black is exact to
        /// a code, and over mid-gray it is nearest to the truth.
        Encoded = "encoded",
        /// For programs that blend linear light, as compositors and game engines do: such a blend over black is exact.
        Linear = "linear",
    }
}
