//! The air of a scene.

use crate::parameters::Range;

crate::parameters! {
    /// The still, dry air around all phenomena.
    pub struct Air {
        /// Temperature.
        temperature_k: f64 = 293.15, limits(Range::new(150.0, 400.0)), unit("K");
        /// Pressure.
        pressure_pa: f64 = 101_325.0, limits(Range::new(1_000.0, 1_000_000.0)), unit("Pa");
    }
}

/// Specific gas constant of dry air, J/(kg K).
pub const GAS_CONSTANT: f64 = 287.05;

impl Air {
    /// Density, kg/m^3.
    pub fn density(&self) -> f64 {
        self.density_at(self.temperature_k)
    }

    /// Density of air heated to `temperature_k` at this pressure, kg/m^3; also used for the gas of a flame, which is mostly air.
    pub fn density_at(&self, temperature_k: f64) -> f64 {
        self.pressure_pa / (GAS_CONSTANT * temperature_k)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn density_agrees_with_tables() {
        let air = Air::default();
        assert!((air.density() - 1.204).abs() < 0.001);
        assert!((air.density_at(273.15) - 1.2923).abs() < 0.001);
        assert!((air.density_at(1465.75) * 5.0 - air.density()).abs() < 1e-12);
    }
}
