//! What phenomena know of each other: lights, extinction and occluders, but not names.

use std::sync::LazyLock;

use glam::DVec3;

use crate::{
    image::Image,
    world::{air::Air, sky::Sky, wind::Wind},
};

pub use crate::world::occluder::Occluder;

/// Geometry of a light source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Emitter {
    /// A small sphere that emits in all directions.
    Point {
        /// Its middle, m.
        position: DVec3,
        /// Its radius, m; within it the illuminance is constant.
        radius: f64,
    },
    /// A light at infinity.
    Directional {
        /// Unit vector toward the light.
        toward: DVec3,
    },
    /// A point that emits within a cone.
    Spot {
        /// Its apex, m.
        position: DVec3,
        /// Unit vector along its axis.
        axis: DVec3,
        /// Cosine of the angle up to which it has its full intensity.
        cos_inner: f64,
        /// Cosine of the angle beyond which it emits nothing.
        cos_outer: f64,
    },
}

/// A light source that illuminates all phenomena.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Its geometry.
    pub emitter: Emitter,
    /// ACEScg; its luminance is in candela for points and spots, and in lux on a perpendicular plane for directional lights.
    pub intensity: [f32; 3],
}

/// Light from one source that arrives at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IncidentLight {
    /// Illuminance on a plane perpendicular to the direction of the light, lux, ACEScg.
    pub illuminance: [f32; 3],
    /// Unit vector toward the light; 0 at its position.
    pub toward: DVec3,
    /// Distance from the light, m; 0 for a light at infinity, whose illuminance is given at the receiver.
    pub distance: f64,
}

impl Light {
    /// The light that arrives at `point`.
    #[inline]
    pub fn incident_light(&self, point: DVec3) -> IncidentLight {
        let (position, radius) = match self.emitter {
            Emitter::Directional { toward } => {
                return IncidentLight { illuminance: self.intensity, toward, distance: 0.0 };
            }
            Emitter::Point { position, radius } => (position, radius),
            Emitter::Spot { position, .. } => (position, 0.0),
        };
        let offset = position - point;
        let square = offset.length_squared();
        let distance = square.sqrt();
        let toward = if distance > 0.0 { offset * (1.0 / distance) } else { DVec3::ZERO };
        let factor = self.emitter.spot_falloff(-toward) / square.max(radius * radius).max(1e-12);
        IncidentLight { illuminance: self.intensity.map(|value| value * factor as f32), toward, distance }
    }

    /// Illuminance on a plane at `point` perpendicular to the light (lux, ACEScg), and the unit vector toward the light.
    #[inline]
    pub fn illuminance(&self, point: DVec3) -> ([f32; 3], DVec3) {
        let IncidentLight { illuminance, toward, .. } = self.incident_light(point);
        (illuminance, toward)
    }
}

impl Emitter {
    /// Fraction of its intensity in a direction (unit vector): a smoothstep between the two cones of a spot, otherwise 1.
    #[inline]
    fn spot_falloff(&self, direction: DVec3) -> f64 {
        let Self::Spot { axis, cos_inner, cos_outer, .. } = *self else { return 1.0 };
        let fraction = ((direction.dot(axis) - cos_outer) / (cos_inner - cos_outer).max(1e-9)).clamp(0.0, 1.0);
        fraction * fraction * (3.0 - 2.0 * fraction)
    }
}

/// What one phenomenon publishes to the others at one time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Publication {
    /// Lights that approximate its emission.
    pub lights: Vec<Light>,
    /// Homogeneous extinction coefficient, 1/m.
    pub extinction: f64,
    /// Solid obstacles.
    pub occluders: Vec<Occluder>,
    /// Those of the solids that are seen, and so cast shadows.
    pub shadow_casters: Vec<Occluder>,
}

impl Publication {
    /// Adds the publication of another phenomenon.
    pub fn extend(&mut self, other: &Self) {
        self.lights.extend_from_slice(&other.lights);
        self.extinction += other.extinction;
        self.occluders.extend_from_slice(&other.occluders);
        self.shadow_casters.extend_from_slice(&other.shadow_casters);
    }
}

/// The other phenomena of a scene as seen by one of them, before anything is drawn. Nothing is copied, so that it is cheap for each of many
/// phenomena.
#[derive(Clone, Copy)]
pub struct OtherPhenomena<'a> {
    /// Lights and obstacles of the scene itself.
    pub scene: &'a Publication,
    /// Number of phenomena.
    pub count: usize,
    /// Returns the publication of the phenomenon with an index; called only when needed.
    pub published: &'a dyn Fn(usize) -> &'a Publication,
    /// Index of the phenomenon itself.
    pub own_index: usize,
    /// The light of the sky.
    pub sky: &'a Sky,
}

impl<'a> OtherPhenomena<'a> {
    /// All lights but its own.
    pub fn lights(&self) -> impl Iterator<Item = &'a Light> + use<'a> {
        self.others().flat_map(|publication| &publication.lights)
    }

    /// All solids but its own.
    pub fn occluders(&self) -> impl Iterator<Item = &'a Occluder> + use<'a> {
        self.others().flat_map(|publication| &publication.occluders)
    }

    fn others(&self) -> impl Iterator<Item = &'a Publication> + use<'a> {
        let (own, published) = (self.own_index, self.published);
        let others = (0..self.count).filter(move |index| *index != own);
        std::iter::once(self.scene).chain(others.map(published))
    }
}

/// Radiance (ACEScg, cd/m^2) and alpha of a whole picture at reduced resolution.
#[derive(Clone, Debug)]
pub struct Backdrop {
    /// The pixels, from the upper left corner of the picture; the last ones may extend beyond its edges.
    pub image: Image<4>,
    /// Side of one of these pixels in pixels of the picture.
    pub pixel_size: usize,
}

/// The surroundings in which a phenomenon is drawn: wind, air, sky, and what all others published.
#[derive(Clone, Debug)]
pub struct Surroundings<'a> {
    /// The wind of the scene.
    pub wind: &'a Wind,
    /// The air of the scene.
    pub air: &'a Air,
    /// The light of the sky.
    pub sky: Sky,
    /// The picture in the phenomenon's own [mirror](crate::phenomenon::PhenomenonInfo::mirror): radiance (ACEScg, cd/m^2) and alpha of
    /// the whole picture.
    pub reflection: Option<&'a Image<4>>,
    /// With a plate: the background of all phenomena in that mirror, plate and sky.
    pub backdrop: Option<&'a Backdrop>,
    /// Lights, extinction and occluders of the other phenomena and of the scene itself.
    pub others: Publication,
}

/// Air with default temperature and pressure.
static STANDARD_AIR: LazyLock<Air> = LazyLock::new(Air::default);

impl<'a> Surroundings<'a> {
    /// Surroundings with only a wind, in default air.
    pub fn from_wind(wind: &'a Wind) -> Self {
        Self {
            wind,
            air: &STANDARD_AIR,
            sky: Sky::DARK,
            reflection: None,
            backdrop: None,
            others: Publication::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn point_lights_fall_with_the_square_of_distance_outside_their_radius() {
        let light =
            Light { emitter: Emitter::Point { position: DVec3::ZERO, radius: 0.5 }, intensity: [8.0, 4.0, 2.0] };
        assert_eq!(light.illuminance(DVec3::new(2.0, 0.0, 0.0)).0, [2.0, 1.0, 0.5]);
        assert_eq!(light.illuminance(DVec3::new(0.1, 0.0, 0.0)).0, light.illuminance(DVec3::new(0.5, 0.0, 0.0)).0);
    }

    #[test]
    fn neighbors_are_all_but_oneself() {
        let shining = |intensity: f32| {
            let emitter = Emitter::Directional { toward: DVec3::Y };
            Publication { lights: vec![Light { emitter, intensity: [intensity; 3] }], ..Publication::default() }
        };
        let (scene, published) = (shining(1.0), [shining(2.0), shining(3.0), shining(4.0)]);
        let published = |index: usize| &published[index];
        let neighbors =
            OtherPhenomena { scene: &scene, count: 3, published: &published, own_index: 1, sky: &Sky::DARK };
        let intensities: Vec<f32> = neighbors.lights().map(|light| light.intensity[0]).collect();
        assert_eq!((intensities, neighbors.occluders().count()), (vec![1.0, 2.0, 4.0], 0));
    }

    #[test]
    fn spots_are_full_inside_and_dark_outside_their_cone() {
        let light = Light {
            emitter: Emitter::Spot {
                position: DVec3::new(0.0, 2.0, 0.0),
                axis: -DVec3::Y,
                cos_inner: 0.9,
                cos_outer: 0.8,
            },
            intensity: [4.0; 3],
        };
        assert_eq!(light.illuminance(DVec3::ZERO).0, [1.0; 3]);
        assert_eq!(light.illuminance(DVec3::new(5.0, 0.0, 0.0)).0, [0.0; 3]);
    }
}
