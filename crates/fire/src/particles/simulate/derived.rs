//! Constants of the simulation that the paper does not state, derived in SI units from size and exit velocity of the burners.

use bansho_base::{
    host::{assets::Assets, memory},
    math::{self, DVec3},
    parameters::{Auto, animated::Animated},
    world::air::Air,
};

use super::burner::Burner;
use crate::particles::{
    error::{ParticleError, ParticleErrorKind},
    parameters::{BurnerParameters, FlameParticlesParameters, GasModel},
};

/// Maximum number of particles of all flames of a scene.
const MAX_PARTICLES: i64 = 20_000_000;
/// Memory of a particle, bytes, measured over a run: its state, and the buffers and neighbor lists of a step. While a small picture is drawn the peak of the
/// process grows by 830 bytes with each particle.
pub(crate) const BYTES_PER_PARTICLE: f64 = 670.0;
/// Age, in rise times, at which gas is removed even if an obstacle prevents it from rising.
const MAX_RISE_TIMES: f64 = 3.0;
/// Relative amplitude of the fuel flow's pulsation as a fire puffs.
const FLOW_PULSATION: f64 = 0.6;
/// Tolerance for burners at the edge of the domain, relative to their size: rotation rounds.
const BURNER_TOLERANCE: f64 = 1e-6;
/// Minimum residence time in steps, so that the number of particles spawned in one step is bounded.
const MIN_STEPS: f64 = 4.0;

/// Constants derived from the parameters.
///
/// Every particle represents the same volume V of gas at spawning. V follows from `particles`, the number alive at a time: a burner
/// of area A and exit velocity w spawns `A w / V` per second, and gas remains for the rise time plus the lifetime of burnt gas. The support
/// radius d is `fluid.support_radius` times `V^(1/3)`; the mass m is V times the density of air at the temperature of the gas; rho_0 is a
/// fraction of that density; k is the square of a speed of sound, a multiple of the gas's own speed.
#[derive(Clone, Debug)]
pub(crate) struct DerivedConstants {
    pub(crate) burners: Vec<Burner>,
    /// Particles per second of each burner at full flow.
    pub(crate) rates: Vec<f64>,
    /// Residence time of the gas of each burner, s.
    pub(crate) residence_times: Vec<f64>,
    /// Puffing frequency of each burner, Hz.
    pub(crate) puffing_hz: Vec<f64>,
    /// Relative amplitude of the fuel flow's pulsation.
    pub(crate) pulse: f64,
    /// Support radius d, m.
    pub(crate) support_radius: f32,
    /// Mass m, kg.
    pub(crate) mass: f32,
    /// Density of gas at the burner, kg/m^3.
    pub(crate) density: f32,
    /// Rest density rho_0, kg/m^3.
    pub(crate) rest_density: f32,
    /// k of eq. (11) per kelvin, m^2/(s^2 K).
    pub(crate) stiffness_per_kelvin: f32,
    /// Corners of the domain relative to the flame's position, m.
    pub(crate) domain: [DVec3; 2],
    /// Preroll before the shot, s.
    pub(crate) preroll: f64,
    /// Duration of the crossfade of a seamless loop, s.
    pub(crate) crossfade: f64,
    /// Maximum number of particles alive.
    pub(crate) max_particles: usize,
}

impl DerivedConstants {
    pub(crate) fn new(
        parameters: &FlameParticlesParameters,
        loop_s: Option<f64>,
        assets: &dyn Assets,
    ) -> Result<Self, ParticleError> {
        check_particle_count(parameters.particles, 0)?;
        let burners = burners(parameters, assets)?;
        let domain = domain(parameters, &burners)?;
        let residence_times: Vec<f64> = burners.iter().map(|burner| residence_time(parameters, burner)).collect();
        let fluxes: Vec<f64> = burners.iter().map(|burner| burner.area_m2 * burner.speed).collect();
        let total_volume: f64 =
            fluxes.iter().zip(&residence_times).map(|(flux, residence_time)| flux * residence_time).sum();
        let volume = total_volume / parameters.particles as f64;
        let support_radius = support_radius(parameters, volume, &domain)?;
        let coolest = burners.iter().map(|burner| burner.parameters.temperature_k).fold(f64::INFINITY, f64::min);
        let density = Air::default().density_at(coolest);
        let fastest = burners.iter().map(|burner| burner.speed).fold(0.0, f64::max);
        let sound = parameters.fluid.stiffness * fastest;
        let longest_residence = residence_times.iter().copied().fold(0.0, f64::max);
        // After the longest residence time all gas has been replaced.
        let crossfade = loop_s.map_or(0.0, |seconds| longest_residence.min(seconds));
        Ok(Self {
            rates: fluxes.into_iter().map(|flux| flux / volume).collect(),
            residence_times,
            puffing_hz: burners.iter().map(|burner| burner.puffing_hz(parameters)).collect(),
            pulse: (FLOW_PULSATION * parameters.forces.puffing).min(0.9),
            support_radius: support_radius as f32,
            mass: (density * volume) as f32,
            density: density as f32,
            rest_density: (parameters.fluid.rest_density * density) as f32,
            stiffness_per_kelvin: (sound * sound / coolest) as f32,
            domain,
            preroll: preroll(parameters, longest_residence) + 0.5 * crossfade,
            crossfade,
            max_particles: 2 * parameters.particles as usize + 16,
            burners,
        })
    }

    /// Age at which a particle of burner `index` is removed even if it still burns, s.
    pub(crate) fn max_age(&self, index: usize, burnt_gas_lifetime_s: f64) -> f64 {
        MAX_RISE_TIMES * self.burners[index].rise_time() + burnt_gas_lifetime_s
    }
}

/// Residence time of gas of a burner, s: rise time plus lifetime of burnt gas. The paper's gas is burnt nowhere.
fn residence_time(parameters: &FlameParticlesParameters, burner: &Burner) -> f64 {
    let burnt_gas_lifetime = match parameters.gas_model {
        GasModel::Combustion => parameters.combustion.burnt_gas_lifetime_s,
        GasModel::Euler => 0.0,
    };
    (burner.rise_time() + burnt_gas_lifetime).max(MIN_STEPS * parameters.step_s)
}

/// Support radius d, m, of particles that represent that volume of gas at spawning.
fn support_radius(
    parameters: &FlameParticlesParameters,
    volume: f64,
    domain: &[DVec3; 2],
) -> Result<f64, ParticleError> {
    let (radius, side) = (parameters.fluid.support_radius * math::cbrt(volume), (domain[1] - domain[0]).min_element());
    if radius <= side {
        return Ok(radius);
    }
    Err(ParticleError { key: "particles".into(), kind: ParticleErrorKind::SupportBeyondDomain { radius, side } })
}

/// Preroll before the shot, s; by default twice the longest residence time.
fn preroll(parameters: &FlameParticlesParameters, longest_residence: f64) -> f64 {
    match parameters.preroll_s {
        Auto::Set(seconds) => seconds,
        Auto::Auto => (2.0 * longest_residence).min(60.0),
    }
}

/// Whether memory for `count` particles can be allocated.
fn fits_in_memory(count: i64) -> bool {
    memory::can_allocate(count as f64 * BYTES_PER_PARTICLE)
}

/// Checks whether `count` particles are allowed in addition to the `others` of all other flames.
///
/// # Errors
/// There are too many particles, or not enough memory; the error states how many are allowed.
pub fn check_particle_count(count: i64, others: i64) -> Result<(), ParticleError> {
    let remaining = (MAX_PARTICLES - others).max(0);
    if count <= remaining && fits_in_memory(count + others) {
        return Ok(());
    }
    let max_particles =
        memory::largest_fitting_count(remaining.min(count), |max_particles| fits_in_memory(max_particles + others));
    let max_particles = if count > remaining && fits_in_memory(remaining + others) { remaining } else { max_particles };
    let gib = (count as f64 + others as f64) * BYTES_PER_PARTICLE / f64::from(1 << 30);
    let kind = ParticleErrorKind::TooManyParticles { count, others, gib, limit: max_particles };
    Err(ParticleError { key: "particles".into(), kind })
}

fn burners(parameters: &FlameParticlesParameters, assets: &dyn Assets) -> Result<Vec<Burner>, ParticleError> {
    let single = [BurnerParameters::default()];
    let listed = if parameters.burners.is_empty() { &single[..] } else { &parameters.burners };
    let burners = listed.iter().enumerate().map(|(index, burner)| {
        Burner::new(burner, parameters, assets)
            .map_err(|kind| ParticleError { key: format!("burners.{index}.file"), kind })
    });
    burners.collect()
}

/// Corners of the domain: as given, or with a margin of three flame heights around the burners.
fn domain(parameters: &FlameParticlesParameters, burners: &[Burner]) -> Result<[DVec3; 2], ParticleError> {
    if let (Auto::Set(min), Auto::Set(max)) = (parameters.domain_min, parameters.domain_max)
        && DVec3::from(min).cmpge(DVec3::from(max)).any()
    {
        return Err(ParticleError { key: "domain_max".into(), kind: ParticleErrorKind::EmptyDomain { min, max } });
    }
    for (index, burner) in burners.iter().enumerate() {
        let corners = burner.parameters.position.bounds().map(DVec3::from);
        let extents = [corners[0] + burner.extent[0], corners[1] + burner.extent[1]];
        for position in corners.into_iter().chain(extents) {
            check_within_domain(parameters, position, BURNER_TOLERANCE * burner.bounding_radius).map_err(
                |(corner, kind)| {
                    // The error names the position only if the scene sets it, otherwise the corner.
                    let is_position_set = burner.parameters.position != Animated::from([0.0; 3]);
                    ParticleError {
                        key: if is_position_set { format!("burners.{index}.position") } else { corner.into() },
                        kind,
                    }
                },
            )?;
        }
    }
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for burner in burners {
        let margin = burner.bounding_radius + 3.0 * burner.height;
        // The bounding box of the burner's position over time.
        let [first, last] = burner.parameters.position.bounds().map(DVec3::from);
        (low, high) = (low.min(first - margin), high.max(last + margin));
    }
    if let Auto::Set(corner) = parameters.domain_min {
        low = DVec3::from(corner);
    }
    if let Auto::Set(corner) = parameters.domain_max {
        high = DVec3::from(corner);
    }
    Ok([low, high])
}

/// Checks whether a point of a burner lies within the given corners of the domain, with a `tolerance`, m. The error is returned with the key of the
/// corner that the point is beyond.
fn check_within_domain(
    parameters: &FlameParticlesParameters,
    position: DVec3,
    tolerance: f64,
) -> Result<(), (&'static str, ParticleErrorKind)> {
    let FlameParticlesParameters { domain_min, domain_max, .. } = parameters;
    let (corner, limit) = match (domain_min, domain_max) {
        (Auto::Set(min), _) if (position + tolerance).cmplt(DVec3::from(*min)).any() => ("domain_min", *min),
        (_, Auto::Set(max)) if (position - tolerance).cmpgt(DVec3::from(*max)).any() => ("domain_max", *max),
        _ => return Ok(()),
    };
    Err((corner, ParticleErrorKind::OutsideDomain { position: position.into(), corner, limit }))
}

#[cfg(test)]
mod tests {
    use bansho_base::{geometry::mesh::Mesh, host::assets::MemoryAssets, parameters::AssetPath};

    use super::*;
    use crate::particles::parameters::BurnerShape;

    fn constants(parameters: &FlameParticlesParameters) -> Result<DerivedConstants, ParticleError> {
        DerivedConstants::new(parameters, None, &MemoryAssets::default())
    }

    #[test]
    fn rates_hold_the_number_of_particles_and_volumes_meet_at_the_burner() {
        let small = BurnerParameters { diameter: 0.1, heat_release_kw: 10.0, ..Default::default() };
        let parameters = FlameParticlesParameters {
            burners: vec![small, BurnerParameters::default()],
            ..FlameParticlesParameters::default()
        };
        let constants = constants(&parameters).unwrap();
        let residence_time = |burner: &Burner| burner.rise_time() + parameters.combustion.burnt_gas_lifetime_s;
        let living: f64 =
            constants.burners.iter().zip(&constants.rates).map(|(burner, rate)| rate * residence_time(burner)).sum();
        assert!((living - parameters.particles as f64).abs() < 1.0);
        let spacing = f64::from(constants.support_radius) / parameters.fluid.support_radius;
        let layer = constants.rates[1] / (constants.burners[1].area_m2 * constants.burners[1].speed);
        assert!((spacing * spacing * spacing * layer - 1.0).abs() < 1e-5);
    }

    /// A flame on a triangle of 0.5 m^2, offset by `far` from the mesh's origin, in a domain of 2 m in each direction.
    fn on_a_mesh_beside_its_origin(far: f32, rotation_deg: [f64; 3]) -> Result<DerivedConstants, ParticleError> {
        let corners = vec![[far, 0.0, 0.0], [far, 0.0, 1.0], [far + 1.0, 0.0, 0.0]];
        let mut assets = MemoryAssets::default();
        assets.insert_mesh("far.gltf", Mesh::new(corners, vec![[0, 1, 2]]).unwrap());
        let file = Some(AssetPath("far.gltf".into()));
        let burner = BurnerParameters { shape: BurnerShape::Mesh, file, rotation_deg, ..Default::default() };
        let [domain_min, domain_max] = [-2.0, 2.0].map(|corner| Auto::Set([corner; 3]));
        let parameters =
            FlameParticlesParameters { burners: vec![burner], domain_min, domain_max, ..Default::default() };
        DerivedConstants::new(&parameters, None, &assets)
    }

    #[test]
    fn a_mesh_that_lies_outside_the_domain_is_a_burner_outside_it() {
        assert!(on_a_mesh_beside_its_origin(0.5, [0.0; 3]).is_ok());
        // A corner outside is enough: particles spawned there would be removed at once.
        assert_eq!(on_a_mesh_beside_its_origin(1.5, [0.0; 3]).unwrap_err().key, "domain_max");
        // Turned by 180 degrees about the vertical axis it lies on the other side.
        for (far, turn, key) in [(50.0, 0.0, "domain_max"), (50.0, 180.0, "domain_min")] {
            let fault = on_a_mesh_beside_its_origin(far, [0.0, turn, 0.0]).unwrap_err();
            assert_eq!(fault.key, key);
            assert!(
                matches!(fault.kind, ParticleErrorKind::OutsideDomain { position, .. } if position[0].abs() >= 50.0)
            );
        }
    }

    #[test]
    fn parameters_that_do_not_go_together_are_named() {
        let default = FlameParticlesParameters::default;
        let fault = |parameters| constants(&parameters).unwrap_err();
        let far = BurnerParameters { position: [0.0, 90.0, 0.0].into(), ..Default::default() };
        let outside = FlameParticlesParameters {
            burners: vec![BurnerParameters::default(), far],
            domain_max: Auto::Set([5.0; 3]),
            ..default()
        };
        assert_eq!(fault(outside).key, "burners.1.position");
        let long = BurnerParameters { shape: BurnerShape::Line, length: 3.0, ..Default::default() };
        let partly = FlameParticlesParameters { burners: vec![long], domain_max: Auto::Set([1.0; 3]), ..default() };
        assert_eq!(fault(partly).key, "domain_max");
        // The corner is what the user wrote, if no position is.
        let beyond_default = FlameParticlesParameters { domain_min: Auto::Set([1.0; 3]), ..default() };
        assert_eq!(fault(beyond_default).key, "domain_min");
        let corners = [Auto::Set([-40.0; 3]), Auto::Set([-50.0; 3])];
        let empty = FlameParticlesParameters { domain_min: corners[0], domain_max: corners[1], ..default() };
        assert_eq!(fault(empty).key, "domain_max");
        let thin = [Auto::Set([-0.01; 3]), Auto::Set([0.01; 3])];
        let narrow = vec![BurnerParameters { diameter: 0.015, ..Default::default() }];
        let [domain_min, domain_max] = thin;
        let wide = FlameParticlesParameters { particles: 5, burners: narrow, domain_min, domain_max, ..default() };
        assert!(matches!(fault(wide).kind, ParticleErrorKind::SupportBeyondDomain { .. }));
        let many = fault(FlameParticlesParameters { particles: 900_000_000, ..default() });
        let expected = "particles: 900000000 particles would take 562 GiB; allowed: up to ";
        let max_particles: Option<i64> =
            many.to_string().strip_prefix(expected).and_then(|max_particles| max_particles.parse().ok());
        // A small machine takes fewer.
        assert!(
            max_particles.is_some_and(|max_particles| (1_000_000..=MAX_PARTICLES).contains(&max_particles)),
            "{many}"
        );
    }
}
