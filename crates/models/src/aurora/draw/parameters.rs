//! What a scene says of how an aurora is drawn.

use bansho_base::parameters::{Auto, Range};

use crate::aurora::light::extinction::Extinction;

bansho_base::choice! {
    /// How the falls of the electrons become light.
    pub enum Sampling {
        /// By the mean of infinitely many falls: no noise.
        Profile = "profile",
        /// By single collisions, as in the thesis (2.4).
        Collisions = "collisions",
    }
}

bansho_base::parameters! {
    /// How the light of an aurora is drawn.
    pub struct DrawingParameters {
        /// By the mean fall, or by collisions.
        sampling: Sampling = Sampling::Profile;
        /// How far the light of a particle spreads across the field (standard deviation); `"auto"` is as far as its neighbours are, and rays stay sharp.
        spread_km: Auto<f64> = Auto::Auto, limits(Range::new(0.005, 100.0)), unit("km");
        /// How far a collision turns an electron from the field: rms tangent of the angle, the vector omega of (2.21) and (2.24).
        wobble: f64 = 0.002, limits(Range::new(0.0, 0.5));
        /// The air below, which dims what is low in the sky.
        air: Extinction = Extinction::default();
    }
}
