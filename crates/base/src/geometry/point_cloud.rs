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

/// Side of the cells to whose corners the origins of point clouds are rounded, m.
const ORIGIN_CELL: f64 = 1000.0;
/// Distance from the origin of the world up to which that is the origin of point clouds, m: single precision resolves a tenth of a millimeter there.
const NEAR_ORIGIN: f64 = 2000.0;

/// The origin for point clouds of a scene whose camera begins at `eye`, m: that of the world, unless `eye` is more than 2 km away from it along an axis.
/// Components are whole kilometers.
#[must_use]
pub fn local_origin(eye: [f64; 3]) -> [f64; 3] {
    let is_far = eye.iter().any(|component| component.abs() > NEAR_ORIGIN);
    eye.map(|component| if is_far { (component / ORIGIN_CELL).round() * ORIGIN_CELL } else { 0.0 })
}

/// The particles of all phenomena of a scene at one time. All arrays have the same length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointCloud {
    /// Where the positions count from in the world, m; see [`local_origin`]. Single precision would step by centimeters far from the world's own origin.
    pub origin: [f64; 3],
    /// Positions relative to the origin, m.
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

    /// A cloud around `origin` with particles at these positions of the world, m, and these velocities, m/s.
    pub fn new(
        origin: [f64; 3],
        positions: impl Iterator<Item = [f64; 3]>,
        velocities: Vec<[f32; 3]>,
        quantities: BTreeMap<Quantity, Vec<f32>>,
    ) -> Self {
        let positions =
            positions.map(|position| std::array::from_fn(|axis| (position[axis] - origin[axis]) as f32)).collect();
        Self { origin, positions, velocities, quantities }
    }

    /// The position of particle `index` in the world, m.
    #[must_use]
    pub fn position(&self, index: usize) -> [f64; 3] {
        std::array::from_fn(|axis| self.origin[axis] + f64::from(self.positions[index][axis]))
    }

    /// Appends the particles of another cloud. An empty cloud takes over its origin.
    pub fn extend(&mut self, other: &Self) {
        let before = self.len();
        if before == 0 {
            self.origin = other.origin;
        }
        let shift: [f32; 3] = std::array::from_fn(|axis| (other.origin[axis] - self.origin[axis]) as f32);
        let positions = other.positions.iter();
        match other.origin == self.origin {
            true => self.positions.extend_from_slice(&other.positions),
            false => self
                .positions
                .extend(positions.map(|position| std::array::from_fn::<_, 3, _>(|axis| position[axis] + shift[axis]))),
        }
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
            origin: [0.0; 3],
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

    #[test]
    fn particles_far_from_the_origin_stay_apart() {
        assert_eq!(local_origin([0.0, 1.6, 1999.0]), [0.0; 3]);
        let origin = local_origin([500_003.4, 1.6, -400_600.0]);
        assert_eq!(origin, [500_000.0, 0.0, -401_000.0]);
        let places = (0..1000).map(|i| [500_000.0 + 1e-3 * f64::from(i), 1.5, -400_000.0]);
        let cloud = PointCloud::new(origin, places.clone(), vec![[0.0; 3]; 1000], BTreeMap::new());
        for (index, place) in places.enumerate() {
            let error = (0..3).map(|axis| (cloud.position(index)[axis] - place[axis]).abs()).fold(0.0, f64::max);
            assert!(error < 1e-4, "particle {index} is {error} m off");
        }
        let mut all = PointCloud::default();
        all.extend(&cloud);
        assert_eq!(all, cloud);
        let near =
            PointCloud::new([0.0; 3], [[500_000.0, 1.5, -400_000.0]].into_iter(), vec![[0.0; 3]], BTreeMap::new());
        all.extend(&near);
        assert_eq!((all.len(), all.position(1000)), (1001, [500_000.0, 1.5, -400_000.0]));
    }
}
