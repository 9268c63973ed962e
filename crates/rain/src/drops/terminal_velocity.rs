//! Terminal velocity of drops in still air: measured, and by the paper's equations (2) to (4).

use bansho_base::{
    math,
    world::{air, gravity::STANDARD_GRAVITY},
};

use crate::parameters::VelocityLaw;

/// Density of water rho_p, kg/m^3.
const WATER_DENSITY: f64 = 998.2;

/// Sutherland's formula: viscosity of air at a temperature in K, up to a constant factor.
fn sutherland(temperature_k: f64) -> f64 {
    temperature_k * math::sqrt(temperature_k) / (temperature_k + 110.4)
}

/// Properties of the air that determine the fall of drops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FallAir {
    /// Density rho_f, kg/m^3.
    pub density: f64,
    /// Dynamic viscosity mu, Pa s.
    pub viscosity: f64,
}

impl Default for FallAir {
    /// Dry air at 20 degrees Celsius and 1013.25 hPa.
    fn default() -> Self {
        Self { density: 1.204, viscosity: 1.81e-5 }
    }
}

impl FallAir {
    /// Dry air as an ideal gas, with Sutherland's formula for the viscosity, both relative to the air of the measurements: at 20 degrees
    /// Celsius and 1013.25 hPa, exactly the default.
    pub fn at(temperature_k: f64, pressure_pa: f64) -> Self {
        let (scene, measured) = (air::Air { temperature_k, pressure_pa }, air::Air::default());
        let reference = Self::default();
        Self {
            density: reference.density * (scene.density() / measured.density()),
            viscosity: reference.viscosity * (sutherland(temperature_k) / sutherland(measured.temperature_k)),
        }
    }
}

/// The paper's fixed point does not exist, or is outside the range of its drag coefficient.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoTerminalVelocity {
    /// The drag coefficient (3) jumps from 24 to 28.6 at Re = 1, and the drop would need a value between.
    #[error("equations (2) to (4) have no solution for a drop of {diameter_mm} mm: the drag jumps at Re = 1")]
    DragJump {
        /// Diameter D, mm.
        diameter_mm: f64,
    },
    /// Re is 1e4 or more, where the paper gives no drag coefficient.
    #[error("equations (2) to (4) are valid up to Re = 10000; a drop of {diameter_mm} mm falls with Re = {reynolds}")]
    TooFast {
        /// Diameter D, mm.
        diameter_mm: f64,
        /// Reynolds number Re.
        reynolds: f64,
    },
}

/// Terminal velocity of drops: a law and the air.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TerminalVelocity {
    /// Law of the velocities.
    pub law: VelocityLaw,
    /// The air.
    pub air: FallAir,
}

impl Default for TerminalVelocity {
    fn default() -> Self {
        Self { law: VelocityLaw::GunnKinzer, air: FallAir::default() }
    }
}

impl TerminalVelocity {
    /// Terminal velocity of a drop of diameter D, m/s downward; increases with D.
    ///
    /// Where the paper's equations have no solution, between 79.5 and 84 um, Stokes' law is used; above Re = 1e4, the
    /// velocity at which Re was computed last.
    pub fn speed(&self, diameter_mm: f64) -> f64 {
        match self.law {
            VelocityLaw::GunnKinzer => measured_velocity(diameter_mm) * density_correction(&self.air),
            VelocityLaw::RigidSphere => match fixed_point_velocity(diameter_mm, &self.air) {
                Ok(speed) => speed,
                Err(NoTerminalVelocity::DragJump { .. }) => stokes_velocity(diameter_mm, &self.air),
                Err(NoTerminalVelocity::TooFast { reynolds, .. }) => {
                    reynolds * self.air.viscosity / (self.air.density * 1e-3 * diameter_mm)
                }
            },
        }
    }
}

/// Measured terminal velocities, mm and m/s: R. Gunn and G. D. Kinzer, "The terminal velocity of fall for water droplets in
/// stagnant air", J. Meteor. 6 (1949), at 20 degrees Celsius and 1013 hPa.
const GUNN_KINZER: [[f64; 2]; 35] = [
    [0.078, 0.18],
    [0.1, 0.27],
    [0.2, 0.72],
    [0.3, 1.17],
    [0.4, 1.62],
    [0.5, 2.06],
    [0.6, 2.47],
    [0.7, 2.87],
    [0.8, 3.27],
    [0.9, 3.67],
    [1.0, 4.03],
    [1.2, 4.64],
    [1.4, 5.17],
    [1.6, 5.65],
    [1.8, 6.09],
    [2.0, 6.49],
    [2.2, 6.9],
    [2.4, 7.27],
    [2.6, 7.57],
    [2.8, 7.82],
    [3.0, 8.06],
    [3.2, 8.26],
    [3.4, 8.44],
    [3.6, 8.6],
    [3.8, 8.72],
    [4.0, 8.83],
    [4.2, 8.92],
    [4.4, 8.98],
    [4.6, 9.03],
    [4.8, 9.07],
    [5.0, 9.09],
    [5.2, 9.12],
    [5.4, 9.14],
    [5.6, 9.16],
    [5.8, 9.17],
];

/// Measured terminal velocity at 20 degrees Celsius and 1013 hPa, m/s.
///
/// Linear interpolation of the table; proportional to D^2 (Stokes) below 0.078 mm; constant beyond 5.8 mm, where drops
/// break up.
pub fn measured_velocity(diameter_mm: f64) -> f64 {
    let [smallest, slowest] = GUNN_KINZER[0];
    if diameter_mm < smallest {
        let ratio = diameter_mm.max(0.0) / smallest;
        return slowest * ratio * ratio;
    }
    let upper = GUNN_KINZER.partition_point(|row| row[0] <= diameter_mm).min(GUNN_KINZER.len() - 1);
    let ([d0, v0], [d1, v1]) = (GUNN_KINZER[upper - 1], GUNN_KINZER[upper]);
    math::lerp(v0, v1, ((diameter_mm - d0) / (d1 - d0)).min(1.0))
}

/// Correction of measured velocities for the density of the air: G. B. Foote and P. S. du Toit, J. Appl. Meteor. 8
/// (1969).
fn density_correction(air: &FallAir) -> f64 {
    math::pow(FallAir::default().density / air.density, 0.4)
}

/// Drag coefficient C of a rigid sphere, eq. (3).
pub fn drag_coefficient(reynolds: f64) -> f64 {
    if reynolds < 1.0 {
        24.0 / reynolds
    } else {
        let root = 0.55 + 4.8 / math::sqrt(reynolds);
        root * root
    }
}

/// Reynolds number Re, eq. (4).
pub fn reynolds_number(speed: f64, diameter_mm: f64, air: &FallAir) -> f64 {
    speed * air.density * 1e-3 * diameter_mm / air.viscosity
}

/// Velocity at which weight and drag are in equilibrium for the drag coefficient C, eq. (2).
fn equilibrium_velocity(diameter_mm: f64, drag: f64, air: &FallAir) -> f64 {
    math::sqrt(4.0 * STANDARD_GRAVITY * 1e-3 * diameter_mm * (WATER_DENSITY - air.density) / (3.0 * air.density * drag))
}

/// Stokes' velocity: the solution for C = 24/Re.
fn stokes_velocity(diameter_mm: f64, air: &FallAir) -> f64 {
    let diameter = 1e-3 * diameter_mm;
    STANDARD_GRAVITY * diameter * diameter * (WATER_DENSITY - air.density) / (18.0 * air.viscosity)
}

/// Terminal velocity by the paper's iteration of (2)-(4), converged to one part in 1e12, m/s; 0 for no drop.
///
/// # Errors
/// There is no such velocity, or it is outside the range of (3).
pub fn fixed_point_velocity(diameter_mm: f64, air: &FallAir) -> Result<f64, NoTerminalVelocity> {
    /// Steps for the slowest convergence: far below Re = 1 each step halves the error.
    const STEPS: usize = 200;
    if diameter_mm.is_nan() || diameter_mm <= 0.0 {
        return Ok(0.0);
    }
    let mut speed = 1.0;
    for _ in 0..STEPS {
        let next = equilibrium_velocity(diameter_mm, drag_coefficient(reynolds_number(speed, diameter_mm, air)), air);
        let converged = (next - speed).abs() <= 1e-12 * next;
        speed = next;
        if converged {
            let reynolds = reynolds_number(speed, diameter_mm, air);
            let is_in_range = reynolds < 1e4;
            return if is_in_range { Ok(speed) } else { Err(NoTerminalVelocity::TooFast { diameter_mm, reynolds }) };
        }
    }
    Err(NoTerminalVelocity::DragJump { diameter_mm })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::reference::{near, rows};

    #[test]
    fn air_is_as_much_more_viscous_when_warm_as_in_tables() {
        // 17.16 and 18.46 uPa s at 273.15 and 300 K.
        assert!((sutherland(300.0) / sutherland(273.15) / (18.46 / 17.16) - 1.0).abs() < 1e-3);
    }

    #[test]
    fn measured_velocities_are_those_of_gunn_and_kinzer() {
        for [diameter, speed, ..] in rows::<8>(include_str!("../../data/raindrop_gunn_kinzer.csv")) {
            assert!(near(TerminalVelocity::default().speed(diameter), speed, 1e-12), "{diameter} mm");
        }
        for [diameter, _, _, _, _, _, _, speed, ..] in rows::<13>(include_str!("../../data/raindrop_velocity.csv")) {
            assert!(near(measured_velocity(diameter), speed, 1e-3), "{diameter} mm");
        }
        assert_eq!((measured_velocity(0.0), measured_velocity(0.039), measured_velocity(20.0)), (0.0, 0.045, 9.17));
    }

    #[test]
    fn the_formula_gives_the_reference_velocities() {
        let air = FallAir::default();
        let mut largest = [0.0_f64; 3];
        for [diameter, speed, re, c, ..] in rows::<13>(include_str!("../../data/raindrop_velocity.csv")) {
            let found = fixed_point_velocity(diameter, &air).expect("converges");
            let number = reynolds_number(found, diameter, &air);
            let differences = [found / speed - 1.0, drag_coefficient(number) / c - 1.0, number / re - 1.0];
            largest = std::array::from_fn(|index| largest[index].max(differences[index].abs()));
        }
        bansho_base::assert_measured!("equation (2): difference of velocities", largest[0], 0.0, 1e-4);
        bansho_base::assert_measured!("equation (3): difference of drag coefficients", largest[1], 0.0, 1e-4);
        bansho_base::assert_measured!("equation (4): difference of Reynolds numbers", largest[2], 0.0, 1e-4);
        bansho_base::assert_measured!(
            "equation (3): drag coefficient below Re = 1",
            drag_coefficient(1.0 - 1e-9),
            24.0,
            1e-3
        );
        bansho_base::assert_measured!(
            "equation (3): drag coefficient above Re = 1",
            drag_coefficient(1.0 + 1e-9),
            28.6,
            0.05
        );
    }

    #[test]
    fn a_solution_satisfies_all_three_equations() {
        let air = FallAir::at(273.15, 90_000.0);
        for diameter in [0.02, 0.05, 0.2, 1.0, 3.0, 6.0] {
            let speed = fixed_point_velocity(diameter, &air).expect("converges");
            assert!(near(
                equilibrium_velocity(diameter, drag_coefficient(reynolds_number(speed, diameter, &air)), &air),
                speed,
                1e-11
            ));
        }
        assert!(near(fixed_point_velocity(0.05, &air).expect("converges"), stokes_velocity(0.05, &air), 1e-11));
    }

    #[test]
    fn the_formula_says_where_it_has_no_solution() {
        let air = FallAir::default();
        let (mut first, mut last) = (f64::INFINITY, 0.0_f64);
        for micrometer in (700..900).map(|tenth| tenth as f64 * 0.1) {
            match fixed_point_velocity(1e-3 * micrometer, &air) {
                Ok(_) => {}
                Err(NoTerminalVelocity::DragJump { .. }) => {
                    (first, last) = (first.min(micrometer), last.max(micrometer));
                }
                Err(other) => panic!("{other}"),
            }
        }
        assert!((79.0..80.0).contains(&first) && (83.0..85.0).contains(&last), "{first} to {last} um");
        assert!(
            matches!(fixed_point_velocity(12.0, &air), Err(NoTerminalVelocity::TooFast { reynolds, .. }) if reynolds > 1e4)
        );
    }

    #[test]
    fn velocities_rise_with_diameter_under_both_laws() {
        for law in [VelocityLaw::GunnKinzer, VelocityLaw::RigidSphere] {
            let velocity = TerminalVelocity { law, air: FallAir::default() };
            let speeds: Vec<f64> = (0..=800).map(|i| velocity.speed(0.01 * i as f64)).collect();
            assert!(speeds.is_sorted_by(|a, b| a <= b || (a - b) / a < 0.2), "{law:?}");
            assert!(speeds.iter().all(|speed| (0.0..20.0).contains(speed)));
        }
    }

    #[test]
    fn thin_air_lets_drops_fall_faster() {
        // Half the density: 2^0.4 = 1.3195.
        let air = FallAir { density: 0.602, ..FallAir::default() };
        let velocity = TerminalVelocity { law: VelocityLaw::GunnKinzer, air };
        assert!(near(velocity.speed(2.0), 6.49 * 1.3195, 1e-4));
        assert_eq!(FallAir::at(293.15, 101_325.0), FallAir::default());
        // U.S. Standard Atmosphere (1976) at 2 km: 275.15 K, 795 hPa, 1.0066 kg/m^3, 1.7260e-5 Pa s.
        assert!(near(FallAir::at(275.15, 79_501.4).density, 1.0066, 1e-3));
        assert!(near(FallAir::at(275.15, 79_501.4).viscosity, 1.726e-5, 5e-3));
    }
}
