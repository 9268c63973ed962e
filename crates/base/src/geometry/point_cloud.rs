//! Particles for export to other programs.

use std::collections::BTreeMap;

/// A quantity of a particle besides its position and velocity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Quantity {
    /// Temperature of a gas, K.
    Temperature,
    /// Density of a gas, kg/m^3.
    Density,
    /// Energy of each electron that the particle represents, eV.
    Energy,
    /// Power that the particle deposits in the atmosphere, W.
    Power,
    /// Diameter of a drop, mm.
    DiameterMm,
    /// Opacity on the axis of the streak of a drop, 0 to 1.
    Opacity,
}

impl Quantity {
    /// All quantities, in the order in which files list them.
    pub const ALL: [Self; 6] =
        [Self::Temperature, Self::Density, Self::Energy, Self::Power, Self::DiameterMm, Self::Opacity];

    /// Its name in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Temperature => "temperature",
            Self::Density => "density",
            Self::Energy => "energy",
            Self::Power => "power",
            Self::DiameterMm => "diameter_mm",
            Self::Opacity => "opacity",
        }
    }

    /// Its unit; `1` for a dimensionless number.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Temperature => "K",
            Self::Density => "kg/m^3",
            Self::Energy => "eV",
            Self::Power => "W",
            Self::DiameterMm => "mm",
            Self::Opacity => "1",
        }
    }
}

/// The particles of all phenomena of a scene at one time. All arrays have the same length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointCloud {
    /// Positions, m.
    pub positions: Vec<[f32; 3]>,
    /// Velocities, m/s.
    pub velocities: Vec<[f32; 3]>,
    /// Further quantities; 0 for particles that lack one.
    pub quantities: BTreeMap<Quantity, Vec<f32>>,
}

impl PointCloud {
    /// Number of particles.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Appends the particles of another cloud.
    pub fn extend(&mut self, other: &Self) {
        let before = self.len();
        self.positions.extend_from_slice(&other.positions);
        self.velocities.extend_from_slice(&other.velocities);
        for (quantity, values) in &other.quantities {
            let own = self.quantities.entry(*quantity).or_default();
            own.resize(before, 0.0);
            own.extend_from_slice(values);
        }
        let count = self.len();
        self.quantities.values_mut().for_each(|values| values.resize(count, 0.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_known_of_a_particle_is_0() {
        let one = |quantity: Quantity, value: f32| PointCloud {
            positions: vec![[value; 3]],
            velocities: vec![[0.0; 3]],
            quantities: [(quantity, vec![value])].into(),
        };
        let mut all = one(Quantity::Density, 1.0);
        all.extend(&one(Quantity::Energy, 2.0));
        all.extend(&one(Quantity::Density, 3.0));
        assert_eq!(all.positions, [[1.0; 3], [2.0; 3], [3.0; 3]]);
        assert_eq!(all.quantities[&Quantity::Density], [1.0, 0.0, 3.0]);
        assert_eq!(all.quantities[&Quantity::Energy], [0.0, 2.0, 0.0]);
    }
}
