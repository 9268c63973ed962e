//! Burners: where particles are spawned, and the length and velocity scales that follow from diameter and heat release rate.

use std::sync::Arc;

use bansho_base::{
    geometry::{
        mesh::{Mesh, SurfaceSampler},
        transform::Transform,
    },
    host::assets::Assets,
    math::{
        self, DVec3,
        random::{Key, Purpose, uniform, uniform_f64},
    },
    parameters::Auto,
    world::gravity::STANDARD_GRAVITY,
};

use crate::particles::{
    error::ParticleErrorKind,
    parameters::{BurnerParameters, BurnerShape, FlameParticlesParameters, GasModel},
};

/// Acceleration along the axis of a fire, m/s^2: half the square of the 6.8 in McCaffrey's `u = 6.8 sqrt(z)` (1979).
const AXIS_ACCELERATION: f64 = 23.0;
/// Speed of gas where it leaves the burner, in `sqrt(g D)`.
const BASE_FROUDE: f64 = 0.4;

/// A burner with the length and velocity scales that follow from its parameters.
#[derive(Clone, Debug)]
pub(crate) struct Burner {
    pub(crate) parameters: BurnerParameters,
    /// Rotation and scale; the position varies over time.
    placement: Transform,
    surface: BurnerSurface,
    /// Diameter D of the burning gas, m, which determines puffing frequency and eddy size.
    pub(crate) diameter: f64,
    /// Area through which gas is emitted, m^2.
    pub(crate) area_m2: f64,
    /// Mean visible flame height, m.
    pub(crate) height: f64,
    /// Exit velocity of gas, m/s.
    pub(crate) speed: f64,
    /// Acceleration of gas along the plume axis, m/s^2.
    pub(crate) acceleration: f64,
    /// Radius of a sphere around its position that encloses the burner, m.
    pub(crate) bounding_radius: f64,
    /// Corners of its axis-aligned bounding box after rotation, relative to its position, m.
    pub(crate) extent: [DVec3; 2],
}

/// Surface or volume over which particles are spawned, with its sampler.
#[derive(Clone, Debug)]
enum BurnerSurface {
    Disk,
    Ball,
    Strip,
    Box,
    Mesh(SurfaceSampler),
}

/// Position and direction at which a particle is spawned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SpawnPoint {
    pub(crate) position: DVec3,
    pub(crate) direction: DVec3,
    /// Radial position on a disk or strip and in a ball: 0 at the center, 1 at the rim; a mean value for other shapes.
    pub(crate) radial_fraction: f64,
}

impl Burner {
    pub(crate) fn new(
        parameters: &BurnerParameters,
        flame: &FlameParticlesParameters,
        assets: &dyn Assets,
    ) -> Result<Self, ParticleErrorKind> {
        let scale = if parameters.shape == BurnerShape::Mesh { parameters.scale } else { 1.0 };
        let placement = Transform::new([0.0; 3], parameters.rotation_deg, scale);
        let (surface, size) = surface(parameters, assets)?;
        let equivalent_diameter = math::sqrt(4.0 * size.area_m2 / std::f64::consts::PI);
        let height = match parameters.height {
            Auto::Set(height) => height,
            Auto::Auto => heskestad(parameters.heat_release_kw, equivalent_diameter).max(0.5 * size.diameter),
        };
        let speed = match parameters.speed {
            Auto::Set(speed) => speed.max(1e-3),
            Auto::Auto => BASE_FROUDE * math::sqrt(STANDARD_GRAVITY * size.diameter),
        };
        Ok(Self {
            parameters: parameters.clone(),
            placement,
            surface,
            diameter: size.diameter,
            area_m2: size.area_m2,
            height,
            speed,
            acceleration: match flame.gas_model {
                GasModel::Combustion => AXIS_ACCELERATION * flame.forces.buoyancy,
                GasModel::Euler => 0.0,
            },
            bounding_radius: size.bounding_radius,
            extent: match &size.mesh {
                Some(mesh) => mesh_extent(mesh, &placement),
                None => primitive_extent(parameters, &placement),
            },
        })
    }

    /// Whether it emits gas at any time.
    pub(crate) fn emits_gas(&self) -> bool {
        self.parameters.flow.bounds()[1] > 0.0
    }

    /// Position of its center at `t`, m from the flame's position.
    pub(crate) fn position(&self, t: f64) -> DVec3 {
        self.parameters.position.at(t).into()
    }

    /// Speed of gas at `height` on the plume axis, m/s.
    pub(crate) fn axis_speed(&self, height: f64) -> f64 {
        math::sqrt(self.speed * self.speed + 2.0 * self.acceleration * height.max(0.0))
    }

    /// Time that gas takes to rise to the flame's tip, s.
    pub(crate) fn rise_time(&self) -> f64 {
        // Equal to (axis_speed - speed) / acceleration, without dividing by a vanishing acceleration.
        2.0 * self.height / (self.speed + self.axis_speed(self.height))
    }

    /// Puffing frequency, Hz: `1.5 / sqrt(D)` (Cetegen and Ahmed 1993).
    pub(crate) fn puffing_hz(&self, flame: &FlameParticlesParameters) -> f64 {
        match flame.forces.puffing_hz {
            Auto::Set(hz) => hz,
            Auto::Auto => 1.5 / math::sqrt(self.diameter),
        }
    }

    /// Spawn point of particle `id` at `t`, uniformly distributed over the burner.
    pub(crate) fn spawn_point(&self, key: Key, id: u64, t: f64) -> SpawnPoint {
        let words = key.words(id, 0, Purpose::named("birthplace"));
        let (position, direction) = self.sample_local(words);
        let radius = 0.5 * self.parameters.diameter;
        let radial_fraction = match self.surface {
            BurnerSurface::Disk | BurnerSurface::Ball => position.length() / radius,
            BurnerSurface::Strip => position.z.abs() / radius,
            BurnerSurface::Box | BurnerSurface::Mesh(_) => std::f64::consts::FRAC_1_SQRT_2,
        };
        let placement = Transform { position: self.position(t), ..self.placement };
        SpawnPoint {
            position: placement.point_in_world(position),
            direction: placement.direction_in_world(direction),
            radial_fraction,
        }
    }

    /// Position and direction of a spawn point in the burner's local coordinates.
    fn sample_local(&self, words: [u32; 4]) -> (DVec3, DVec3) {
        let [u, v, w, _] = words.map(|word| f64::from(uniform(word)));
        let radius = 0.5 * self.parameters.diameter;
        let (sine, cosine) = math::sin_cos(std::f64::consts::TAU * v);
        match &self.surface {
            BurnerSurface::Disk => (DVec3::new(cosine, 0.0, sine) * (radius * math::sqrt(u)), DVec3::Y),
            BurnerSurface::Ball => {
                let height = 2.0 * w - 1.0;
                let across = math::sqrt((1.0 - height * height).max(0.0));
                (DVec3::new(cosine * across, height, sine * across) * (radius * math::cbrt(u)), DVec3::Y)
            }
            BurnerSurface::Strip => {
                let along = self.parameters.length * (u - 0.5);
                (DVec3::new(along, 0.0, self.parameters.diameter * (w - 0.5)), DVec3::Y)
            }
            BurnerSurface::Box => box_surface_point(self.parameters.size, [u, v, w]),
            BurnerSurface::Mesh(sampler) => {
                let sample = sampler.sample([uniform_f64(words[0], words[3]), v, w]);
                (sample.position, sample.normal)
            }
        }
    }
}

/// Mean visible flame height `L = 0.235 Q^(2/5) - 1.02 D`, m, from the heat release rate Q in kW and the diameter D in m (Heskestad
/// 1983).
pub fn heskestad(heat_release_kw: f64, diameter: f64) -> f64 {
    0.235 * math::pow(heat_release_kw, 0.4) - 1.02 * diameter
}

/// Dimensions of a burner.
struct BurnerSize {
    diameter: f64,
    area_m2: f64,
    bounding_radius: f64,
    mesh: Option<Arc<Mesh>>,
}

impl BurnerSize {
    /// The size of an analytic shape, m and m^2.
    fn new(diameter: f64, area_m2: f64, bounding_radius: f64) -> Self {
        Self { diameter, area_m2, bounding_radius, mesh: None }
    }
}

/// Corners of the bounding box of a rotated mesh.
fn mesh_extent(mesh: &Mesh, placement: &Transform) -> [DVec3; 2] {
    let corners = mesh.triangles().flatten().map(|corner| placement.point_in_world(corner));
    corners.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], corner| [low.min(corner), high.max(corner)])
}

/// Corners of the bounding box of a rotated burner of an analytic shape.
fn primitive_extent(parameters: &BurnerParameters, placement: &Transform) -> [DVec3; 2] {
    let BurnerParameters { diameter, length, size, .. } = *parameters;
    let radius = 0.5 * diameter;
    let [right, up, back] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| placement.direction_in_world(axis));
    let half = match parameters.shape {
        BurnerShape::Point | BurnerShape::Mesh => DVec3::splat(radius),
        BurnerShape::Disk => {
            let [x, z] = [right * radius, back * radius];
            DVec3::from([0, 1, 2].map(|c| math::sqrt(x[c] * x[c] + z[c] * z[c])))
        }
        BurnerShape::Line => (right * (0.5 * length)).abs() + (back * radius).abs(),
        BurnerShape::Box => {
            let [x, y, z] = size.map(|side| 0.5 * side);
            (right * x).abs() + (up * y).abs() + (back * z).abs()
        }
    };
    [-half, half]
}

/// The surface of a burner and its size.
fn surface(
    parameters: &BurnerParameters,
    assets: &dyn Assets,
) -> Result<(BurnerSurface, BurnerSize), ParticleErrorKind> {
    let BurnerParameters { diameter, length, size: [x, y, z], scale, .. } = *parameters;
    let disk_area = 0.25 * std::f64::consts::PI * diameter * diameter;
    Ok(match parameters.shape {
        BurnerShape::Disk => (BurnerSurface::Disk, BurnerSize::new(diameter, disk_area, 0.5 * diameter)),
        BurnerShape::Point => (BurnerSurface::Ball, BurnerSize::new(diameter, disk_area, 0.5 * diameter)),
        BurnerShape::Line => {
            (BurnerSurface::Strip, BurnerSize::new(diameter, diameter * length, 0.5 * (diameter + length)))
        }
        BurnerShape::Box => {
            let surface = 2.0 * (x * y + y * z + z * x);
            (BurnerSurface::Box, BurnerSize::new(x.min(z), surface, 0.5 * DVec3::new(x, y, z).length()))
        }
        BurnerShape::Mesh => {
            let file = parameters.file.as_ref().ok_or(ParticleErrorKind::NoFile)?;
            let mesh = assets.mesh(&file.0)?;
            let [min, max] = mesh.bounds();
            let sides = (max - min) * scale;
            let sampler = mesh.sampler();
            let area_m2 = sampler.area() * scale * scale;
            let across = sides.x.min(sides.z).max(0.2 * sides.max_element());
            let bounding_radius = min.abs().max(max.abs()).length() * scale;
            (
                BurnerSurface::Mesh(sampler),
                BurnerSize { mesh: Some(mesh), ..BurnerSize::new(across, area_m2, bounding_radius) },
            )
        }
    })
}

/// Point on the surface of a box and the normal there, for three uniform numbers; the points are uniformly distributed by area.
fn box_surface_point(sides: [f64; 3], [face, u, v]: [f64; 3]) -> (DVec3, DVec3) {
    let faces = [0, 1, 2].map(|axis| sides[(axis + 1) % 3] * sides[(axis + 2) % 3]);
    let mut target_area = face * 2.0 * faces.iter().sum::<f64>();
    let (mut axis, mut side) = (2, 1.0);
    for face in 0..6 {
        if target_area < faces[face / 2] {
            (axis, side) = (face / 2, if face % 2 == 0 { -1.0 } else { 1.0 });
            break;
        }
        target_area -= faces[face / 2];
    }
    let (mut position, mut direction) = (DVec3::ZERO, DVec3::ZERO);
    position[axis] = 0.5 * side * sides[axis];
    position[(axis + 1) % 3] = (u - 0.5) * sides[(axis + 1) % 3];
    position[(axis + 2) % 3] = (v - 0.5) * sides[(axis + 2) % 3];
    direction[axis] = side;
    (position, direction)
}

#[cfg(test)]
mod tests {
    use bansho_base::host::assets::MemoryAssets;

    use super::*;

    fn burner(parameters: BurnerParameters) -> Burner {
        Burner::new(&parameters, &FlameParticlesParameters::default(), &MemoryAssets::default()).unwrap()
    }

    fn spawn_points(burner: &Burner) -> impl Iterator<Item = SpawnPoint> + '_ {
        (0..4000).map(|id| burner.spawn_point(Key::new(1, "burner"), id, 0.0))
    }

    #[test]
    fn heskestad_worked_by_hand() {
        // 1000^(2/5) = 15.8489.
        assert!((heskestad(1000.0, 1.0) - (0.235 * 15.848_93 - 1.02)).abs() < 1e-5);
    }

    #[test]
    fn gas_rises_as_mccaffrey_measured() {
        let burner = burner(BurnerParameters { speed: Auto::Set(0.0), ..Default::default() });
        assert!((burner.axis_speed(1.0) - 6.8).abs() < 0.05);
        let (t, h) = (burner.rise_time(), burner.height);
        assert!((0.5 * 23.0 * t * t - h).abs() < 0.01 * h);
    }

    #[test]
    fn discs_are_even_and_turn_with_the_burner() {
        let parameters = BurnerParameters { diameter: 2.0, rotation_deg: [90.0, 0.0, 0.0], ..Default::default() };
        let burner = burner(parameters);
        let inner = spawn_points(&burner).filter(|spawn_point| spawn_point.position.length() < 0.5).count();
        assert!((900..1100).contains(&inner), "a quarter of the area holds {inner} of 4000");
        assert!(
            spawn_points(&burner)
                .all(|spawn_point| spawn_point.position.z.abs() < 1e-9 || spawn_point.position.y.abs() < 1e-9)
        );
        assert!(spawn_points(&burner).all(|spawn_point| (spawn_point.direction - DVec3::Z).length() < 1e-9));
    }

    #[test]
    fn boxes_are_even_over_their_faces() {
        let burner = burner(BurnerParameters { shape: BurnerShape::Box, size: [2.0, 1.0, 1.0], ..Default::default() });
        let ends = spawn_points(&burner).filter(|spawn_point| spawn_point.direction.x.abs() > 0.5).count();
        assert!((700..900).contains(&ends), "a fifth of the area holds {ends} of 4000");
        for spawn_point in spawn_points(&burner) {
            assert!(
                (spawn_point.position.dot(spawn_point.direction)
                    - if spawn_point.direction.x.abs() > 0.5 { 1.0 } else { 0.5 })
                .abs()
                    < 1e-9
            );
        }
    }

    #[test]
    fn all_places_lie_within_the_extent_and_fill_it() {
        for (number, shape) in
            [BurnerShape::Point, BurnerShape::Disk, BurnerShape::Line, BurnerShape::Box].into_iter().enumerate()
        {
            let rotation_deg = [20.0 * number as f64, 65.0, -40.0];
            let parameters = BurnerParameters { shape, diameter: 0.3, length: 2.0, rotation_deg, ..Default::default() };
            let burner = burner(parameters);
            let [low, high] = burner.extent;
            let primitive_extent =
                |[low, high]: [DVec3; 2], spawn_point: DVec3| [low.min(spawn_point), high.max(spawn_point)];
            let all = spawn_points(&burner).map(|spawn_point| spawn_point.position);
            let [low_corner, high_corner] = all.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], primitive_extent);
            assert!(
                (low_corner - low).cmpgt(DVec3::splat(-1e-5)).all()
                    && (high - high_corner).cmpgt(DVec3::splat(-1e-5)).all()
            );
            let empty = (low_corner - low).max(high - high_corner).max_element();
            assert!(empty < 0.06 * burner.bounding_radius, "{shape:?}: {empty} m are empty");
        }
    }

    #[test]
    fn points_lines_and_meshes_stay_within_their_bounds() {
        let line =
            burner(BurnerParameters { shape: BurnerShape::Line, length: 3.0, diameter: 0.2, ..Default::default() });
        assert!(
            spawn_points(&line)
                .all(|spawn_point| spawn_point.position.x.abs() <= 1.5 && spawn_point.position.z.abs() <= 0.1)
        );
        let point = burner(BurnerParameters { shape: BurnerShape::Point, diameter: 0.1, ..Default::default() });
        assert!(spawn_points(&point).all(|spawn_point| spawn_point.position.length() <= 0.05));
        let missing = BurnerParameters { shape: BurnerShape::Mesh, ..Default::default() };
        let fault = Burner::new(&missing, &FlameParticlesParameters::default(), &MemoryAssets::default());
        assert_eq!(fault.unwrap_err(), ParticleErrorKind::NoFile);
    }
}
