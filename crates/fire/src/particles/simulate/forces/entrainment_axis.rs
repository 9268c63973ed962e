//! Entrainment toward the plume axis: why flames narrow upward.
//!
//! Rising gas accelerates and its volume is conserved, so that the plume contracts. Where gas on the axis gains speed at the rate `du/dh`,
//! continuity moves the surrounding gas inward at `-(r/2) du/dh`. The inflow is limited to a fraction of the speed on the axis (the
//! entrainment), plus about a fifth of `sqrt(g D)` at the base. The axis is the mean position of the gas in each layer of height,
//! so it leans with the wind.

use bansho_base::{
    math::{
        self, DVec3,
        simd::{LANES, Lanes, Real, wrap_split},
    },
    world::gravity::STANDARD_GRAVITY,
};
use fearless_simd::{Simd, prelude::*};

use crate::particles::simulate::{
    burner::Burner,
    vectors::{linear, scaled},
};

/// Number of layers of height.
const LAYERS: usize = 24;
/// Maximum inflow velocity as a fraction of the speed on the axis.
const MAX_INFLOW_FRACTION: f32 = 0.2;

/// Additional inflow velocity at the base, in `sqrt(g D)`.
const INFLOW_FROUDE: f64 = 0.2;

/// The plume axis of one burner.
#[derive(Clone, Debug)]
pub(crate) struct PlumeAxis {
    base: f32,
    /// Layers per meter.
    scale: f32,
    /// Mean x and z of the gas in each layer.
    centers: [[f32; 2]; LAYERS + 1],
    speed_squared: f32,
    acceleration: f32,
    /// Inflow velocity at the base, m/s.
    inflow: f32,
    strength: f32,
    /// The burner's diameter, m. The inflow fades out between one and two of them from the axis.
    diameter: f32,
}

/// The plume axes of all burners at `t`; `burner_indices` are the burners that the particles at `positions` came from.
pub(crate) fn plume_axes(
    burners: &[Burner],
    positions: [&[f32]; 3],
    burner_indices: &[u32],
    strength: f64,
    t: f64,
) -> Vec<PlumeAxis> {
    // Height of the base and layers per meter of each burner.
    let bases: Vec<(f64, f64)> =
        burners.iter().map(|burner| (burner.position(t).y, layers_per_meter(burner))).collect();
    let mut sums = vec![[[0.0_f64; 3]; LAYERS + 1]; burners.len()];
    for (index, &number) in burner_indices.iter().enumerate() {
        let (base, scale) = bases[number as usize];
        let layer = ((f64::from(positions[1][index]) - base) * scale + 0.5).clamp(0.0, LAYERS as f64) as usize;
        let [x, z] = [positions[0][index], positions[2][index]].map(f64::from);
        let sum = &mut sums[number as usize][layer];
        *sum = [sum[0] + x, sum[1] + z, sum[2] + 1.0];
    }
    burners
        .iter()
        .zip(&sums)
        .map(|(burner, sums)| PlumeAxis::new(burner, burner.position(t), layers_per_meter(burner), sums, strength))
        .collect()
}

/// Layers per meter above a burner: all of them together reach somewhat above its flame.
fn layers_per_meter(burner: &Burner) -> f64 {
    LAYERS as f64 / (1.5 * burner.height + burner.bounding_radius)
}

impl PlumeAxis {
    fn new(burner: &Burner, base: DVec3, scale: f64, sums: &[[f64; 3]; LAYERS + 1], strength: f64) -> Self {
        let mut axis = Self {
            base: base.y as f32,
            scale: scale as f32,
            centers: [[base.x as f32, base.z as f32]; LAYERS + 1],
            speed_squared: (burner.speed * burner.speed) as f32,
            acceleration: burner.acceleration as f32,
            inflow: (INFLOW_FROUDE * math::sqrt(STANDARD_GRAVITY * burner.diameter)) as f32,
            strength: strength as f32,
            diameter: burner.diameter as f32,
        };
        axis.smooth(sums);
        axis
    }

    /// Sets the center of each layer to the mean position of the gas in it and its two neighbors; if they are empty, to the center below.
    fn smooth(&mut self, sums: &[[f64; 3]; LAYERS + 1]) {
        for layer in 0..=LAYERS {
            let [mut x, mut z, mut count] = [0.0; 3];
            for sum in &sums[layer.saturating_sub(1)..(layer + 2).min(LAYERS + 1)] {
                x += sum[0];
                z += sum[1];
                count += sum[2];
            }
            if count > 0.0 {
                self.centers[layer] = [(x / count) as f32, (z / count) as f32];
            } else if layer > 0 {
                self.centers[layer] = self.centers[layer - 1];
            }
        }
    }

    /// Position of the axis at `height` above the burner: x and z, m.
    #[inline(always)]
    pub(crate) fn at(&self, height: f32) -> [f32; 2] {
        let layer = (height * self.scale).clamp(0.0, LAYERS as f32 - 1e-3);
        let (below, fraction) = (layer as usize, layer.fract());
        [0, 1].map(|k| self.centers[below][k] + (self.centers[below + 1][k] - self.centers[below][k]) * fraction)
    }

    /// Velocity of gas at `position` toward the axis, m/s.
    #[inline(always)]
    pub(crate) fn velocity<S: Simd>(&self, simd: S, position: &[Lanes<S>; 3]) -> [Lanes<S>; 3] {
        let zero = Lanes::splat(simd, 0.0);
        let height = (position[1] - Lanes::splat(simd, self.base)).simd_max(zero);
        let [x, z] = self.centers_at(simd, height);
        let offset = [position[0] - x, position[2] - z];
        let distance = offset[0].fma(offset[0], offset[1] * offset[1]).simd_sqrt();
        let speed_squared = linear(height, 2.0 * self.acceleration, self.speed_squared);
        let speed = speed_squared.simd_sqrt().simd_max(Lanes::splat(simd, 1e-6));
        // A large burner has several plumes: the inflow toward one axis vanishes at a distance of two diameters.
        let attenuation = (Lanes::splat(simd, 2.0) - scaled(distance, 1.0 / self.diameter)).simd_clamp01();
        let max_inflow = linear(speed, MAX_INFLOW_FRACTION, self.inflow);
        let inflow = (scaled(distance, 0.5 * self.acceleration) / speed).simd_min(max_inflow);
        let inward = scaled(inflow * attenuation, self.strength);
        let scale = (zero - inward) / distance.simd_max(Lanes::splat(simd, f32::MIN_POSITIVE));
        [offset[0] * scale, zero, offset[1] * scale]
    }

    /// Position of the axis at heights above the burner: x and z, m.
    #[inline(always)]
    fn centers_at<S: Simd>(&self, simd: S, height: Lanes<S>) -> [Lanes<S>; 2] {
        let position = (height * height.broadcast(self.scale)).simd_min(height.broadcast(LAYERS as f32 - 1e-3));
        let (layer, fraction) = wrap_split(position, 31);
        let mut layers = [0; LANES];
        layer.store_slice(&mut layers);
        let mut centers = [fraction; 2];
        for k in 0..2 {
            let (mut below, mut above) = ([0.0; LANES], [0.0; LANES]);
            for lane in 0..LANES {
                let layer = (layers[lane] as usize).min(LAYERS - 1);
                (below[lane], above[lane]) = (self.centers[layer][k], self.centers[layer + 1][k]);
            }
            let (below, above) = (Lanes::from_slice(simd, &below), Lanes::from_slice(simd, &above));
            centers[k] = fraction.fma(above - below, below);
        }
        centers
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::{host::assets::MemoryAssets, math::Vec3};

    use super::*;
    use crate::particles::parameters::{BurnerParameters, FlameParticlesParameters};

    fn velocity(axis: &PlumeAxis, position: Vec3) -> Vec3 {
        bansho_base::dispatch_baseline!(simd => {
            let velocity = axis.velocity(simd, &position.to_array().map(|x| Lanes::splat(simd, x)));
            Vec3::from(velocity.map(|values| values.as_slice()[3]))
        })
    }

    fn axis(strength: f64) -> PlumeAxis {
        let parameters = BurnerParameters { height: bansho_base::parameters::Auto::Set(1.0), ..Default::default() };
        let burner = Burner::new(&parameters, &FlameParticlesParameters::default(), &MemoryAssets::default()).unwrap();
        // A column that leans toward +x: x = y / 2.
        let y: Vec<f32> = (0..200).map(|i| i as f32 / 150.0).collect();
        let x: Vec<f32> = y.iter().map(|y| 0.5 * y).collect();
        plume_axes(&[burner], [&x, &y, &[0.0; 200]], &[0; 200], strength, 0.0).remove(0)
    }

    #[test]
    fn gas_draws_toward_the_axis_that_leans_with_it() {
        let axis = axis(1.0);
        assert!(velocity(&axis, Vec3::new(0.5, 0.8, 0.0)).x < -0.05);
        assert!(velocity(&axis, Vec3::new(0.3, 0.8, 0.0)).x > 0.05);
        assert!(velocity(&axis, Vec3::new(0.4, 0.8, 0.1)).z < -0.05);
        assert_eq!(velocity(&axis, Vec3::new(0.4, 0.8, 9.0)), Vec3::ZERO);
    }

    #[test]
    fn one_height_and_sixteen_find_the_same_middle() {
        let axis = axis(1.0);
        for start in 0..40 {
            let heights: [f32; LANES] = std::array::from_fn(|lane| 0.003 * (start * LANES + lane) as f32);
            let together = bansho_base::dispatch_baseline!(simd => {
                axis.centers_at(simd, Lanes::from_slice(simd, &heights)).map(|values| values.as_slice().to_vec())
            });
            for (lane, height) in heights.into_iter().enumerate() {
                let alone = axis.at(height);
                assert!((0..2).all(|k| (together[k][lane] - alone[k]).abs() < 1e-6), "at {height}: {alone:?}");
            }
        }
    }

    #[test]
    fn none_of_it_leaves_gas_alone() {
        assert_eq!(velocity(&axis(0.0), Vec3::new(0.5, 0.8, 0.0)).length(), 0.0);
    }
}
