//! What phenomena know of each other: light, absorption and obstacles, but never names.

use std::sync::LazyLock;

use glam::DVec3;

use crate::{
    image::Image,
    world::{air::Air, sky::Sky, wind::Wind},
};

pub use crate::world::occluder::Occluder;

/// How a light sends its light out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Emitter {
    /// From a small sphere in all directions.
    Point {
        /// Its middle, m.
        position: DVec3,
        /// Its radius, m; nearer than this the light no longer grows.
        radius: f64,
    },
    /// From infinitely far away.
    Directional {
        /// Unit vector toward the light.
        toward: DVec3,
    },
    /// From a point within a cone.
    Spot {
        /// Its apex, m.
        position: DVec3,
        /// Unit vector along its axis.
        axis: DVec3,
        /// Cosine of the angle up to which it is full.
        cos_inner: f64,
        /// Cosine of the angle beyond which it is dark.
        cos_outer: f64,
    },
}

/// A light as every phenomenon sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Where it comes from.
    pub emitter: Emitter,
    /// ACEScg, its luminance in candela for points and spots, in lux on a facing plane for directional lights.
    pub intensity: [f32; 3],
}

/// What arrives from a light at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IncidentLight {
    /// Illuminance on a plane that faces the light, lux, ACEScg.
    pub illuminance: [f32; 3],
    /// Unit vector toward the light; 0 where it stands.
    pub toward: DVec3,
    /// Way from the light, m; 0 for one that is infinitely far, whose light is given where it arrives.
    pub distance: f64,
}

impl Light {
    /// What arrives at `point`.
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

    /// Illuminance on a plane at `point` that faces the light (lux, ACEScg), and the unit vector toward it.
    #[inline]
    pub fn illuminance(&self, point: DVec3) -> ([f32; 3], DVec3) {
        let IncidentLight { illuminance, toward, .. } = self.incident_light(point);
        (illuminance, toward)
    }
}

impl Emitter {
    /// Share of its intensity that it sends in a direction (unit vector): all, but for a cone.
    #[inline]
    fn spot_falloff(&self, direction: DVec3) -> f64 {
        let Self::Spot { axis, cos_inner, cos_outer, .. } = *self else { return 1.0 };
        let cone = ((direction.dot(axis) - cos_outer) / (cos_inner - cos_outer).max(1e-9)).clamp(0.0, 1.0);
        cone * cone * (3.0 - 2.0 * cone)
    }
}

/// What one phenomenon publishes to the others at one time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Publication {
    /// Lights that stand for its emission.
    pub lights: Vec<Light>,
    /// How much light it takes away everywhere, 1/m.
    pub extinction: f64,
    /// Solids it puts in the way.
    pub occluders: Vec<Occluder>,
}

impl Publication {
    /// Adds what another phenomenon publishes.
    pub fn extend(&mut self, other: &Self) {
        self.lights.extend_from_slice(&other.lights);
        self.extinction += other.extinction;
        self.occluders.extend_from_slice(&other.occluders);
    }
}

/// What one phenomenon of a scene is among, to look at before anything is drawn: nothing is copied, so that of many phenomena each can be
/// asked.
#[derive(Clone, Copy)]
pub struct OtherPhenomena<'a> {
    /// The scene's own lights and obstacles.
    pub scene: &'a Publication,
    /// How many phenomena there are.
    pub count: usize,
    /// What the phenomenon of a number publishes; only asked for where it matters.
    pub published: &'a dyn Fn(usize) -> &'a Publication,
    /// Its own number.
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

/// Radiance (ACEScg, cd/m^2) and alpha of a whole picture in fewer pixels.
#[derive(Clone, Debug)]
pub struct Backdrop {
    /// The pixels, from the picture's upper left corner on; the last ones may reach over its edges.
    pub image: Image<4>,
    /// Pixels of the picture in one of these, along each side.
    pub side: usize,
}

/// What a phenomenon is drawn among: wind and sky, and what all others published.
#[derive(Clone, Debug)]
pub struct Surroundings<'a> {
    /// The one wind of the scene.
    pub wind: &'a Wind,
    /// The one air of the scene.
    pub air: &'a Air,
    /// The light of the sky.
    pub sky: Sky,
    /// What is seen in the phenomenon's own [mirror](crate::phenomenon::PhenomenonInfo::mirror): radiance (ACEScg, cd/m^2) and alpha of
    /// the whole picture.
    pub reflection: Option<&'a Image<4>>,
    /// Where there is a plate: what stands behind all phenomena in that mirror, plate and sky.
    pub backdrop: Option<&'a Backdrop>,
    /// Everybody else's lights, extinction and occluders, and the scene's own.
    pub others: Publication,
}

/// Air of the usual temperature and pressure.
static STANDARD_AIR: LazyLock<Air> = LazyLock::new(Air::default);

impl<'a> Surroundings<'a> {
    /// Nothing but a wind in ordinary air.
    pub fn of_wind(wind: &'a Wind) -> Self {
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
    fn neighbours_are_all_but_oneself() {
        let shining = |intensity: f32| {
            let emitter = Emitter::Directional { toward: DVec3::Y };
            Publication { lights: vec![Light { emitter, intensity: [intensity; 3] }], ..Publication::default() }
        };
        let (scene, published) = (shining(1.0), [shining(2.0), shining(3.0), shining(4.0)]);
        let published = |index: usize| &published[index];
        let neighbours =
            OtherPhenomena { scene: &scene, count: 3, published: &published, own_index: 1, sky: &Sky::DARK };
        let intensities: Vec<f32> = neighbours.lights().map(|light| light.intensity[0]).collect();
        assert_eq!((intensities, neighbours.occluders().count()), (vec![1.0, 2.0, 4.0], 0));
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
