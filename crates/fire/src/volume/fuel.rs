//! Fuels, and the temperature and density of a mixture of fuel and air that burns in an infinitely thin sheet (Burke and Schumann 1928).

use bansho_base::world::air::Air;

bansho_base::choice! {
    /// What burns.
    pub enum Fuel {
        /// Vapors of wood.
        Wood = "wood",
        /// Methane, natural gas.
        Methane = "methane",
        /// Propane, bottled gas.
        Propane = "propane",
        /// Heptane, much like gasoline.
        Heptane = "heptane",
        /// Methanol, whose flames have hardly any soot.
        Methanol = "methanol",
        /// Ethanol, spirit.
        Ethanol = "ethanol",
        /// Acetone.
        Acetone = "acetone",
        /// Nothing burns: hot smoke.
        Smoke = "smoke",
    }
}

/// Properties of a fuel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FuelProperties {
    /// Mixture fraction at which fuel and air burn completely.
    pub stoichiometric: f64,
    /// Heat of combustion, J/kg.
    pub heat_of_combustion: f64,
    /// Adiabatic temperature of the flame, K.
    pub flame_temperature_k: f64,
    /// Temperature at which it leaves the burner, K.
    pub burner_temperature_k: f64,
    /// Fraction of the heat that leaves as radiation.
    pub radiant_fraction: f64,
    /// Largest volume fraction of soot in the flame, 1e-6.
    pub soot_ppm: f64,
    /// Mass of smoke per mass of fuel.
    pub smoke_yield: f64,
}

impl Fuel {
    /// Its properties. Radiant fractions are those of fires of half a meter (Tewarson 2002; Hamins et al. 1991), those of soot orders of magnitude in such fires.
    #[must_use]
    pub fn properties(self) -> FuelProperties {
        let [stoichiometric, megajoules, flame, burner, radiant, soot_ppm, smoke_yield] = match self {
            Self::Wood => [0.13, 14.0, 1950.0, 650.0, 0.30, 0.6, 0.005],
            Self::Methane => [0.055, 50.0, 2230.0, 293.0, 0.20, 0.2, 0.0],
            Self::Propane => [0.060, 46.4, 2270.0, 293.0, 0.30, 1.0, 0.01],
            Self::Heptane => [0.062, 44.6, 2270.0, 371.0, 0.35, 1.6, 0.037],
            Self::Methanol => [0.135, 20.0, 2150.0, 338.0, 0.20, 0.01, 0.0],
            Self::Ethanol => [0.10, 26.8, 2190.0, 351.0, 0.25, 0.3, 0.008],
            Self::Acetone => [0.095, 28.6, 2200.0, 329.0, 0.28, 0.5, 0.014],
            Self::Smoke => [1.0, 1.0, 600.0, 600.0, 0.0, 0.0, 0.2],
        };
        FuelProperties {
            stoichiometric,
            heat_of_combustion: megajoules * 1e6,
            flame_temperature_k: flame,
            burner_temperature_k: burner,
            radiant_fraction: radiant,
            soot_ppm,
            smoke_yield,
        }
    }
}

/// Temperature of a mixture of fuel and air as a function of the mixture fraction Z, the share of its mass that came from the burner:
/// `T = T_air + (T_fuel - T_air) Z + dT min(Z / Zs, (1 - Z) / (1 - Zs))`, with dT so that it is the flame's at Zs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mixture {
    pub(crate) stoichiometric: f32,
    pub(crate) air_temperature_k: f32,
    /// `T_fuel - T_air`, K.
    pub(crate) fuel_rise_k: f32,
    /// `dT / Zs` and `dT / (1 - Zs)`, K.
    pub(crate) slopes_k: [f32; 2],
    pub(crate) air_density: f32,
}

impl Mixture {
    /// The mixture of a fuel with air.
    #[must_use]
    pub fn new(fuel: &FuelProperties, air: &Air) -> Self {
        let stoichiometric = fuel.stoichiometric;
        let fuel_rise = fuel.burner_temperature_k - air.temperature_k;
        let rise = (fuel.flame_temperature_k - air.temperature_k - fuel_rise * stoichiometric).max(0.0);
        Self {
            stoichiometric: stoichiometric as f32,
            air_temperature_k: air.temperature_k as f32,
            fuel_rise_k: fuel_rise as f32,
            slopes_k: [rise / stoichiometric, rise / (1.0 - stoichiometric).max(1e-6)].map(|slope| slope as f32),
            air_density: air.density_at(air.temperature_k) as f32,
        }
    }

    /// Temperature without loss of heat, K.
    #[must_use]
    #[inline(always)]
    pub fn adiabatic_k(&self, mixture_fraction: f32) -> f32 {
        let [lean, rich] = self.slopes_k;
        let burnt = (lean * mixture_fraction).min(rich * (1.0 - mixture_fraction));
        self.air_temperature_k + self.fuel_rise_k * mixture_fraction + burnt.max(0.0)
    }

    /// Temperature of gas that has lost heat, K; `deficit` is what it has lost, over the heat capacity, K.
    #[must_use]
    #[inline(always)]
    pub fn temperature_k(&self, mixture_fraction: f32, deficit: f32) -> f32 {
        (self.adiabatic_k(mixture_fraction) - deficit).max(self.air_temperature_k)
    }

    /// Density of gas of a temperature, kg/m^3: that of air, whose molecules are about as heavy.
    #[must_use]
    #[inline(always)]
    pub fn density(&self, temperature_k: f32) -> f32 {
        self.air_density * self.air_temperature_k / temperature_k
    }

    /// Temperature of the sheet without loss of heat, K.
    pub(crate) fn hottest_k(&self) -> f32 {
        self.adiabatic_k(self.stoichiometric)
    }
}

/// Z over Zs from which on there is soot, where there is most, and beyond which there is none.
pub(crate) const FIRST_SOOT: f32 = 1.0;
pub(crate) const MOST_SOOT: f32 = 1.6;
pub(crate) const LAST_SOOT: f32 = 3.2;

/// Volume fraction of soot relative to its largest, as a function of Z over the stoichiometric Zs: it forms on the rich side of the sheet, most at 1.6, and burns
/// up before Zs.
#[must_use]
#[inline(always)]
pub fn soot_profile(relative_mixture: f32) -> f32 {
    let rise = ((relative_mixture - FIRST_SOOT) * (1.0 / (MOST_SOOT - FIRST_SOOT))).clamp(0.0, 1.0);
    let fall = ((LAST_SOOT - relative_mixture) * (1.0 / (LAST_SOOT - MOST_SOOT))).clamp(0.0, 1.0);
    let smooth = |t: f32| t * t * (3.0 - 2.0 * t);
    smooth(rise) * smooth(fall)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sheet_is_as_hot_as_the_fuel_burns() {
        for fuel in
            [Fuel::Wood, Fuel::Methane, Fuel::Propane, Fuel::Heptane, Fuel::Methanol, Fuel::Ethanol, Fuel::Acetone]
        {
            let properties = fuel.properties();
            let mixture = Mixture::new(&properties, &Air::default());
            assert!((f64::from(mixture.hottest_k()) - properties.flame_temperature_k).abs() < 0.5, "{fuel:?}");
            assert!((f64::from(mixture.adiabatic_k(1.0)) - properties.burner_temperature_k).abs() < 0.5, "{fuel:?}");
            assert_eq!(mixture.adiabatic_k(0.0), Air::default().temperature_k as f32);
            assert!((mixture.density(mixture.air_temperature_k) - 1.2).abs() < 0.05);
            assert_eq!(mixture.temperature_k(0.01, 5000.0), mixture.air_temperature_k);
        }
    }

    #[test]
    fn soot_lines_the_rich_side_of_the_sheet() {
        assert_eq!([0.0, 0.9, 1.0, 3.2, 9.0].map(soot_profile), [0.0; 5]);
        assert_eq!(soot_profile(1.6), 1.0);
        assert!(soot_profile(1.3) > 0.3 && soot_profile(2.5) > 0.3);
    }
}
