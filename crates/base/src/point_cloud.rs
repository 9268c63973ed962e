//! Particles as other programs take them.

/// Particles of everything in a scene that has any, at one time. All lists are of one length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointCloud {
    /// Places, m.
    pub positions: Vec<[f32; 3]>,
    /// Velocities, m/s.
    pub velocities: Vec<[f32; 3]>,
    /// Temperatures, K.
    pub temperatures_k: Vec<f32>,
    /// Densities, kg/m^3.
    pub densities: Vec<f32>,
}

impl PointCloud {
    /// How many particles there are.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Adds the particles of another.
    pub fn extend(&mut self, other: &Self) {
        self.positions.extend_from_slice(&other.positions);
        self.velocities.extend_from_slice(&other.velocities);
        self.temperatures_k.extend_from_slice(&other.temperatures_k);
        self.densities.extend_from_slice(&other.densities);
    }
}
