//! Parameters of the sky.

use bansho_base::{
    math::{self, DVec3},
    parameters::{Range, animated::Animated},
    world::sky::{Night, Sky, SkyKind, TownGlow, twilight_luminance},
};

bansho_base::choice! {
    /// Form of the hills.
    pub enum HillForm {
        /// One range of low, rounded hills.
        Rounded = "rounded",
        /// Three ranges of mountains with sharp peaks, one behind another; by night the far ones are lighter, from the air before them.
        Mountains = "mountains",
    }
}

bansho_base::parameters! {
    /// The sky behind everything. It lights the scene. In pictures with a plate, the plate is visible instead, and the sky through its alpha. A scene that states neither a
    /// sky nor a light has a default sky if all its phenomena are of one kind that needs it: night for auroras, dusk for rain. A default sky is visible
    /// unless the picture is transparent; a stated sky is always opaque.
    pub struct SkyParameters {
        /// Distribution of its luminance.
        kind: SkyKind = SkyKind::Overcast;
        /// Luminance overhead: 500 to 5000 on a rainy day, 1 at late dusk.
        luminance: Animated<f64> = Animated::from(2000.0), limits(Range::new(0.0, 1e6)), unit("cd/m^2");
        /// Color, as the temperature of a black body. Ignored at night, when each light source has its own color.
        temperature_k: f64 = 7000.0, limits(Range::new(1000.0, 10_000.0)), unit("K");
        /// Whether it is visible; otherwise it only lights the scene.
        visible: bool = true;
        /// Elevation of the hills all around, in front of the sky; 0 for none.
        hills_deg: f64 = 0.0, limits(Range::new(0.0, 30.0)), unit("degrees");
        /// Form of the hills.
        hills_form: HillForm = HillForm::Rounded;
        /// Height of the trees on them; 0 for none.
        trees_deg: f64 = 0.0, limits(Range::new(0.0, 30.0)), unit("degrees");
        /// Distance of the hills and trees, and of the nearest range of mountains; the others are at 2.4 and 5 times that.
        hills_distance: f64 = 8000.0, limits(Range::new(1.0, 1e5)), unit("m");
        /// The sky at night.
        night: NightParameters = NightParameters::default();
    }
}

const BRIGHTNESS_RANGE: Range = Range::new(0.0, 100.0);

bansho_base::parameters! {
    /// The night sky, for `kind = "night"`. Its brightness is absolute, so the `luminance` of the sky is ignored.
    pub struct NightParameters {
        /// Elevation of the sun: below -18 there is no twilight, below -6 the brightest stars appear.
        sun_elevation_deg: Animated<f64> = Animated::from(-30.0), limits(Range::new(-90.0, 0.0)), unit("degrees");
        /// Azimuth of the sun, from north toward east.
        sun_azimuth_deg: f64 = 0.0, limits(Range::new(-360.0, 360.0)), unit("degrees");
        /// Brightness of the airglow relative to a typical night.
        airglow: f64 = 1.0, limits(BRIGHTNESS_RANGE);
        /// Brightness of the stars relative to the real sky; 0 for none.
        stars: f64 = 1.0, limits(BRIGHTNESS_RANGE);
        /// Brightness of the Milky Way relative to the real one.
        milky_way: f64 = 1.0, limits(BRIGHTNESS_RANGE);
        /// Atmospheric extinction overhead, magnitudes.
        extinction: f64 = 0.22, limits(Range::new(0.0, 5.0)), unit("mag");
        /// A town whose light glows in the air.
        town: TownParameters = TownParameters::default();
    }
}

bansho_base::parameters! {
    /// A town whose light glows in clear air above the horizon, as bright as Walker's law (1977) has it.
    pub struct TownParameters {
        /// Number of people; 0 for no town.
        population: f64 = 0.0, limits(Range::new(0.0, 1e8));
        /// Azimuth, from north toward east.
        azimuth_deg: f64 = 0.0, limits(Range::new(-360.0, 360.0)), unit("degrees");
        /// Distance.
        distance_km: f64 = 20.0, limits(Range::new(1.0, 150.0)), unit("km");
        /// Color of its lamps, as the temperature of a black body: 2000 for sodium lamps, 2700 to 4000 for others.
        temperature_k: f64 = 2700.0, limits(Range::new(1000.0, 10_000.0)), unit("K");
    }
}

impl SkyParameters {
    /// The sky at time `t`.
    pub fn at(&self, t: f64) -> Sky {
        if self.kind == SkyKind::Night {
            return Sky::from_night(self.night.at(t));
        }
        Sky::new(self.kind, self.luminance.at(t), self.temperature_k)
    }
}

impl NightParameters {
    /// The night sky at time `t`.
    fn at(&self, t: f64) -> Night {
        let (east, north) = math::sin_cos(self.sun_azimuth_deg.to_radians());
        Night {
            airglow: self.airglow,
            twilight: twilight_luminance(self.sun_elevation_deg.at(t)),
            sunward: DVec3::new(east, 0.0, -north),
            extinction: self.extinction,
            town: TownGlow::of_population(
                self.town.population,
                self.town.azimuth_deg,
                self.town.distance_km,
                self.town.temperature_k,
            ),
        }
    }
}
