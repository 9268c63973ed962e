//! What a scene says of how the gas is drawn.

use bansho_base::parameters::{Auto, Range};

use crate::sparks::SparkParameters;

const SHARE: Range = Range::new(0.0, 1.0);

bansho_base::choice! {
    /// What becomes of a particle in the picture.
    pub enum SpriteStyle {
        /// What a ray sees of its ball: sums are the exact line integrals of the gas, so that light and opacity follow from its soot.
        Integral = "integral",
        /// The paper's: poly6 itself, times the colour of a black body, added; opacity from density.
        Poly6 = "poly6",
        /// The paper's figure 7: a square, the redder the denser the gas.
        Squares = "squares",
    }
}

bansho_base::parameters! {
    /// How the gas is drawn.
    pub struct LookParameters {
        /// What becomes of a particle: exact line integrals, the paper's sprites, or squares that show the density.
        sprite: SpriteStyle = SpriteStyle::Integral;
        /// How strongly soot absorbs, and so shines, beside what its volume fraction gives.
        soot_gain: f64 = 1.0, limits(Range::new(0.0, 1000.0));
        /// How unevenly gas finer than the particles burns: 0 is the smooth sum of the particles alone. The mean light stays.
        detail: f64 = 0.85, limits(SHARE);
        /// Size of that detail, in support radii.
        detail_size: f64 = 0.9, limits(Range::new(0.05, 20.0));
        /// How crisp the edges of burning gas are.
        sharpness: f64 = 0.7, limits(SHARE);
        /// Speed of gas that draws detail as it is; faster gas stretches it along its way.
        detail_speed: Auto<f64> = Auto::Auto, limits(Range::new(0.01, 1000.0)), unit("m/s");
        /// Light of the thin blue zone where fresh gas begins to burn.
        base_blue: f64 = 1.0, limits(Range::new(0.0, 1000.0));
        /// Opacity of the centre of a poly6 sprite in gas of mean density.
        opacity: f64 = 0.06, limits(SHARE);
        /// Side of the squares of `sprite = "squares"`, in support radii.
        square_size: f64 = 0.25, limits(Range::new(0.001, 10.0));
        /// Share of the light of others that soot scatters on rather than takes away: what makes smoke visible.
        smoke_albedo: f64 = 0.3, limits(SHARE);
        /// How strongly hot gas bends the light of what lies behind; 1 is physical, 0 leaves it straight.
        haze_gain: f64 = 1.0, limits(Range::new(0.0, 1000.0));
        /// Sparks.
        sparks: SparkParameters = SparkParameters::default();
        /// Light on others.
        light: GasLightParameters = GasLightParameters::default();
    }
}

bansho_base::parameters! {
    /// The light that the flame throws on others; follows what the gas radiates at each moment.
    pub struct GasLightParameters {
        /// Scale of that light; 0 for none.
        scale: f64 = 1.0, limits(Range::new(0.0, 1000.0));
        /// How many point lights stand along the flame.
        count: i64 = 3, limits(Range::new(1.0, 16.0));
    }
}
