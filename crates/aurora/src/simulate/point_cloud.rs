//! Export of the particles as a point cloud.

use bansho_base::{
    geometry::point_cloud::{PointCloud, Quantity},
    math::{self, DVec2, DVec3},
    world::sky::EARTH_RADIUS_KM,
};

use super::{AuroraParticles, AuroraSimulation};
use crate::shapes::FOOT_ALTITUDE_KM;

/// Half of the interval of the finite-difference velocity, s.
const MOMENT_S: f64 = 1e-3;

/// Particle positions at 100 km altitude, `offset_s` seconds after their step: x east, y up, z south, as for the
/// camera.
pub(crate) fn point_cloud(particles: &AuroraParticles, offset_s: f64, origin: [f64; 3]) -> PointCloud {
    let offset_s = offset_s.clamp(-AuroraSimulation::STEP_S, AuroraSimulation::STEP_S);
    let (mut positions, mut velocities) = (Vec::new(), Vec::new());
    for index in 0..particles.len() {
        positions.push(position_at(particles, index, offset_s).to_array());
        // The velocity follows the shell.
        let [before, after] = [-MOMENT_S, MOMENT_S].map(|time| position_at(particles, index, time));
        velocities.push(((after - before) / (2.0 * MOMENT_S)).as_vec3().to_array());
    }
    let quantities = [(Quantity::Energy, &particles.energies_ev), (Quantity::Power, &particles.powers_w)]
        .map(|(quantity, values)| (quantity, values.clone()));
    PointCloud::new(origin, positions.into_iter(), velocities, quantities.into())
}

/// Position of a particle on the shell `time` seconds after its step, m.
fn position_at(particles: &AuroraParticles, index: usize, time: f64) -> DVec3 {
    let [east, south] = [0, 1].map(|axis| f64::from(particles.velocities[axis][index]));
    on_shell(particles.position(index) + DVec2::new(east, south) * time)
}

/// Maps a position of the drawn plane, km, to the spherical shell at 100 km, m.
fn on_shell(position: DVec2) -> DVec3 {
    const SHELL_M: f64 = 1e3 * (EARTH_RADIUS_KM + FOOT_ALTITUDE_KM);
    let distance = position.length();
    let (sin, cos) = math::sin_cos(1e3 * distance / SHELL_M);
    let horizontal = position.normalize_or_zero() * (sin * SHELL_M);
    DVec3::new(horizontal.x, cos * SHELL_M - 1e3 * EARTH_RADIUS_KM, horizontal.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn particles_lie_on_the_shell_with_their_quantities() {
        let particles = AuroraParticles {
            positions: [vec![0.0, 647.1], vec![0.0, 0.0]],
            velocities: [vec![3.0, 1.0], vec![0.0, 0.0]],
            ids: vec![0, 1],
            energies_ev: vec![5000.0, 700.0],
            powers_w: vec![2.0, 8.0],
            ..AuroraParticles::default()
        };
        let cloud = point_cloud(&particles, 0.01, [0.0; 3]);
        // 30 m on at 3 km/s; a tenth of a radian along the shell.
        assert!((cloud.positions[0][0] - 30.0).abs() < 1e-2 && (cloud.positions[0][1] - 1e5).abs() < 1e-2);
        let [x, y, z] = point_cloud(&particles, 0.0, [0.0; 3]).positions[1].map(f64::from);
        assert!((x - 6.471e6 * 0.099_833_42).abs() < 1.0 && (y - (6.471e6 * 0.995_004_17 - 6.371e6)).abs() < 1.0);
        assert_eq!(z, 0.0);
        // East there is downward by the same angle.
        let [u, v, w] = cloud.velocities[1].map(f64::from);
        assert!((u - 995.004).abs() < 0.1 && (v + 99.83).abs() < 0.1 && w == 0.0);
        assert_eq!(cloud.quantities[&Quantity::Energy], [5000.0, 700.0]);
        assert_eq!(cloud.quantities[&Quantity::Power], [2.0, 8.0]);
    }
}
