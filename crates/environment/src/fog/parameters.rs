//! The parameters of `[fog]`. Apart from its table, which builds the phenomenon, since the phenomenon has them too.

use bansho_base::parameters::{Range, animated::Animated};

bansho_base::parameters! {
    /// Fog, everywhere above the ground: it dims what is far, and is lit by the sky, lamps and fires. Over a plate it needs the plate's depth, since a plate
    /// without depth is infinitely far away.
    pub struct FogParameters {
        /// Meteorological visibility: the distance at which a black object has 2 % contrast against the horizon. Below 1000 it is called fog, 1000 to 5000 mist,
        /// above haze.
        visibility_m: Animated<f64> = Animated::from(500.0), limits(Range::new(1.0, 1e6)), unit("m");
    }
}
