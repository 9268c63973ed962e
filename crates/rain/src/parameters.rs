//! What a scene says of rain.

use bansho_base::parameters::{Length, Range, animated::Animated};

use crate::drops::terminal_velocity::VelocityLaw;

/// The paper's six diameters, mm.
const PAPER_DIAMETERS_MM: [f64; 6] = [1.0, 1.2, 1.4, 1.6, 1.8, 2.0];

bansho_base::choice! {
    /// How near rain is drawn.
    pub enum Method {
        /// Textures of all drops of one diameter in a cubic meter, on upright billboards (Yoshida, Dobashi & Yamamoto).
        Billboards = "billboards",
        /// Every drop by itself: the reference, slower the more it rains.
        Drops = "drops",
    }
}

bansho_base::parameters! {
    /// What drops do where they hit the ground.
    pub struct SplashParameters {
        /// Share of the drops that are seen to splash; 0 for none.
        fraction: f64 = 1.0, limits(Range::new(0.0, 1.0));
        /// Speed of the droplets that a splash throws up, beside the usual.
        speed_scale: f64 = 1.0, limits(Range::new(0.1, 3.0));
        /// Splashes further away than this are not drawn.
        distance: f64 = 8.0, limits(Range::new(0.0, 30.0)), unit("m");
    }
}

bansho_base::parameters! {
    /// Rain: near drops as streaks, far rain as a veil.
    pub struct RainParameters {
        /// Rain rate R.
        rate_mm_per_h: Animated<f64> = Animated::from(10.0), limits(Range::new(0.0, 300.0)), unit("mm/h");
        /// How near rain is drawn.
        method: Method = Method::Billboards;
        /// Diameters that stand for all drops that are seen one by one, ascending; all others only veil.
        diameters_mm: Vec<f64> = PAPER_DIAMETERS_MM.to_vec(), limits(Length { min: 1, max: 12, item: Range::new(0.1, 8.0) }), unit("mm");
        /// Where terminal velocities come from.
        terminal_velocity: VelocityLaw = VelocityLaw::GunnKinzer;
        /// How far from the camera streaks are drawn; rain further away only veils.
        distance: f64 = 5.0, limits(Range::new(1.0, 40.0)), unit("m");
        /// How far it rains beyond, over a `[ground]` without a plate to the horizon; 0 for no veil at all.
        airlight_distance: f64 = 100.0, limits(Range::new(0.0, 5000.0)), unit("m");
        /// Height of the ground, where drops end, in a scene without `[ground]`.
        ground_height: f64 = 0.0, unit("m");
        /// Opacity beside what optics gives.
        opacity_gain: f64 = 1.0, limits(Range::new(0.0, 20.0));
        /// How much the wind carries the drops; 1 as it carries air.
        wind_response: f64 = 1.0, limits(Range::new(0.0, 2.0));
        /// Whether the light of streaks is left out where no display would show it.
        culling: bool = true;
        /// What drops do where they hit the ground.
        splashes: SplashParameters = SplashParameters::default();
    }
}
