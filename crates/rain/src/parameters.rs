//! Parameters of rain.

use bansho_base::parameters::{Length, Range, animated::Animated};

/// The paper's six diameters, mm.
const PAPER_DIAMETERS_MM: [f64; 6] = [1.0, 1.2, 1.4, 1.6, 1.8, 2.0];

bansho_base::choice! {
    /// How near rain is drawn.
    pub enum Method {
        /// Textures of all drops of one diameter in a cubic meter, on upright billboards (Yoshida, Dobashi & Yamamoto).
        Billboards = "billboards",
        /// Every drop individually. This is the reference; heavier rain takes longer.
        Drops = "drops",
        /// The method of Yoshida, Dobashi & Yamamoto to the letter: streak textures of 512 x 512 pixels in 8 bits for fixed rain rates, on billboards around
        /// the camera that are lit at their corners. There is no wind, no sky light and no airlight. The textures repeat, and change abruptly with the rain rate.
        Textures = "textures",
    }
}

bansho_base::choice! {
    /// Law of the terminal velocities.
    pub enum VelocityLaw {
        /// Measured by Gunn and Kinzer: large drops flatten and fall at 9.2 m/s at most.
        GunnKinzer = "gunn_kinzer",
        /// The paper's equations (2) to (4) for a rigid sphere: 4 % too slow at 1 mm, 29 % too fast at 5 mm.
        RigidSphere = "rigid_sphere",
    }
}

bansho_base::choice! {
    /// Law of the opacity of streaks.
    pub enum OpacityLaw {
        /// Fraction of the exposure during which the drop covers a point.
        ExposureFraction = "exposure_fraction",
        /// 2 D / v as Yoshida, Dobashi & Yamamoto print it, with D in mm and v in m/s. It is the same for any exposure; on the axis it is 67 times the fraction
        /// of an exposure of 1/30 s.
        Paper = "paper",
    }
}

bansho_base::choice! {
    /// Number of the drops of one diameter in a texture.
    pub enum DropCountLaw {
        /// Those of its bin: n(D), which is per millimeter of diameter, integrated over the diameters halfway to the neighbors.
        Bin = "bin",
        /// n(D) itself, as section 4 of Yoshida, Dobashi & Yamamoto says. For the paper's bins of 0.2 mm these are five times as many drops.
        Density = "density",
    }
}

bansho_base::parameters! {
    /// Splashes of drops on the ground.
    pub struct SplashParameters {
        /// Fraction of the drops with a visible splash; 0 for none.
        fraction: f64 = 1.0, limits(Range::new(0.0, 1.0));
        /// Factor of the speed of the droplets of a splash.
        speed_scale: f64 = 1.0, limits(Range::new(0.1, 3.0));
        /// Distance beyond which splashes are not drawn.
        distance: f64 = 8.0, limits(Range::new(0.0, 30.0)), unit("m");
    }
}

bansho_base::parameters! {
    /// Rain: near drops as streaks, far rain as a participating medium (airlight).
    pub struct RainParameters {
        /// Rain rate R.
        rate_mm_per_h: Animated<f64> = Animated::from(10.0), limits(Range::new(0.0, 300.0)), unit("mm/h");
        /// How near rain is drawn.
        method: Method = Method::Billboards;
        /// Diameters of the drops that are drawn as streaks, ascending; each represents a bin of diameters. All other drops only contribute to the
        /// airlight.
        diameters_mm: Vec<f64> = PAPER_DIAMETERS_MM.to_vec(), limits(Length { min: 1, max: 12, item: Range::new(0.1, 8.0) }), unit("mm");
        /// Rain rates of the textures of `method = "textures"`, ascending; textures of the rate nearest to the rain rate are shown.
        texture_rates_mm_per_h: Vec<f64> = vec![1.0, 5.0, 10.0, 20.0], limits(Length { min: 1, max: 12, item: Range::new(0.1, 300.0) }), unit("mm/h");
        /// Number of the drops of one diameter in a texture. Only used by `method = "textures"`.
        texture_drop_count: DropCountLaw = DropCountLaw::Bin;
        /// Law of the terminal velocities.
        terminal_velocity: VelocityLaw = VelocityLaw::GunnKinzer;
        /// Distance from the camera up to which streaks are drawn; rain beyond it only contributes to the airlight.
        distance: f64 = 5.0, limits(Range::new(1.0, 40.0)), unit("m");
        /// Depth of the rain beyond the streaks. Over a `[ground]` without a plate it extends to the horizon. 0 for no airlight.
        airlight_distance: f64 = 100.0, limits(Range::new(0.0, 5000.0)), unit("m");
        /// Height of the ground, where drops end, in a scene without `[ground]`.
        ground_height: f64 = 0.0, unit("m");
        /// Law of the opacity of streaks.
        opacity: OpacityLaw = OpacityLaw::ExposureFraction;
        /// Factor of that opacity.
        opacity_gain: f64 = 1.0, limits(Range::new(0.0, 20.0));
        /// Amplitude of the brightness along a streak in the light of lamps and fires, relative to the mean. It causes speckle along near streaks, whose drops
        /// oscillate (Garg & Nayar 2006). 0 for drops that do not oscillate. Not used by `method = "textures"`.
        oscillation: f64 = 0.0, limits(Range::new(0.0, 1.0));
        /// Response of the drops to the wind; at 1 they drift with the air.
        wind_response: f64 = 1.0, limits(Range::new(0.0, 2.0));
        /// Whether the light of streaks is omitted where no display would show it.
        culling: bool = true;
        /// Contribution to a pixel, in 8-bit codes of display white, up to which one streak on a billboard may represent several drops. 0 draws every drop;
        /// frames with AOVs always do so. Only used by `method = "billboards"`.
        simplification_codes: f64 = 1.5, limits(Range::new(0.0, 16.0));
        /// Splashes of drops on the ground.
        splashes: SplashParameters = SplashParameters::default();
    }
    paper: texture_rates_mm_per_h, texture_drop_count, terminal_velocity, opacity, culling;
}
