//! What phenomena know of each other: lights, extinction and occluders, but not names.

use std::sync::LazyLock;

use glam::DVec3;

use crate::{
    color::{self, XYZ_FROM_SRGB},
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

/// Color and strength of a light as game engines and glTF (`KHR_lights_punctual`) take them: the light is `color * intensity`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SrgbLight {
    /// Linear sRGB from 0 to 1, with 1 as the largest component. White for a light that is dark.
    pub color: [f32; 3],
    /// Factor of the color: candela for points and spots, lux for directional lights. The luminance of `color * intensity` is that of the light, so for a
    /// saturated color it is more than the luminous intensity.
    pub intensity: f32,
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
    /// One point light in place of several points: their summed intensity at the center of their luminous intensity, with a radius that holds the spread of
    /// them all (root mean square). `None` if no point shines; lights of other kinds are left out.
    #[must_use]
    pub fn merge_points<'a>(lights: impl IntoIterator<Item = &'a Self>) -> Option<Self> {
        let (mut intensity, mut total, mut moment, mut square) = ([0.0; 3], 0.0, DVec3::ZERO, 0.0);
        for light in lights {
            let Emitter::Point { position, radius } = light.emitter else { continue };
            let weight = f64::from(color::luminance(light.intensity)).max(0.0);
            (0..3).for_each(|c| intensity[c] += light.intensity[c]);
            total += weight;
            moment += position * weight;
            square += (position.length_squared() + radius * radius) * weight;
        }
        let position = moment / total;
        let radius = (square / total - position.length_squared()).max(0.0).sqrt();
        (total > 0.0).then_some(Self { emitter: Emitter::Point { position, radius }, intensity })
    }

    /// The light with `factor` times its intensity.
    #[must_use]
    pub fn scaled(self, factor: f32) -> Self {
        if factor == 1.0 { self } else { Self { intensity: self.intensity.map(|value| value * factor), ..self } }
    }

    /// Luminous intensity, candela; `None` for a directional light, whose illuminance is [`luminance`](color::luminance) of its intensity, in lux.
    #[must_use]
    pub fn luminous_intensity(&self) -> Option<f32> {
        self.emitter.position().map(|_| color::luminance(self.intensity))
    }

    /// Its color in linear sRGB and its strength. Components of colors outside of sRGB are clamped at 0, and the strength is raised by what that removes, so
    /// that the luminance is kept.
    ///
    /// ```
    /// use bansho_base::{color::acescg_from_srgb, math::DVec3, phenomenon::surroundings::{Emitter, Light}};
    ///
    /// let emitter = Emitter::Point { position: DVec3::ZERO, radius: 0.05 };
    /// let light = Light { emitter, intensity: acescg_from_srgb([20.0, 10.0, 4.0]) };
    /// let srgb = light.srgb();
    /// assert!((srgb.intensity - 20.0).abs() < 1e-3 && (srgb.color[1] - 0.5).abs() < 1e-4);
    /// // 0.2126 * 20 + 0.7152 * 10 + 0.0722 * 4 candela.
    /// assert!((light.luminous_intensity().unwrap() - 11.69).abs() < 1e-2);
    /// ```
    #[must_use]
    pub fn srgb(&self) -> SrgbLight {
        let srgb = color::srgb_from_acescg(self.intensity).map(|value| value.max(0.0));
        let largest = srgb.into_iter().fold(0.0, f32::max);
        if largest <= 0.0 {
            return SrgbLight { color: [1.0; 3], intensity: 0.0 };
        }
        let color = srgb.map(|value| value / largest);
        let [_, luminance, _] = XYZ_FROM_SRGB.apply(color.map(f64::from));
        SrgbLight { color, intensity: color::luminance(self.intensity).max(0.0) / luminance as f32 }
    }

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
    /// Position of a point or spot, m; `None` for a light at infinity.
    #[must_use]
    pub fn position(&self) -> Option<DVec3> {
        match *self {
            Self::Point { position, .. } | Self::Spot { position, .. } => Some(position),
            Self::Directional { .. } => None,
        }
    }

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
    /// In place of `lights` for what a plate shows, if it is a light over the sky: lights at infinity in directions that do not change, so that their shadows
    /// are computed once. Otherwise empty.
    pub sky_lights: Vec<Light>,
    /// Homogeneous extinction coefficient, 1/m.
    pub extinction: f64,
    /// Solid obstacles.
    pub occluders: Vec<Occluder>,
    /// Those of the solids that are seen, and so cast shadows.
    pub shadow_casters: Vec<Occluder>,
    /// Length of the longest path of a point of them during the exposure, m.
    pub shadow_motion: f64,
    /// Number of equal parts of the exposure, a power of two, in each of which the lights hardly move or change; 0 or 1 if they stand still. `lights` are those
    /// in its middle.
    pub light_parts: usize,
    /// Length of the longest path of a flame or lamp during the exposure, m; 0 where they stand still, though flames flicker.
    pub light_motion: f64,
}

impl Publication {
    /// Adds the publication of another phenomenon.
    pub fn extend(&mut self, other: &Self) {
        self.lights.extend_from_slice(&other.lights);
        self.sky_lights.extend_from_slice(&other.sky_lights);
        self.extinction += other.extinction;
        self.occluders.extend_from_slice(&other.occluders);
        self.shadow_casters.extend_from_slice(&other.shadow_casters);
        self.shadow_motion = self.shadow_motion.max(other.shadow_motion);
        self.light_parts = self.light_parts.max(other.light_parts);
        self.light_motion = self.light_motion.max(other.light_motion);
    }
}

/// The other phenomena of a scene as seen by one of them, before anything is drawn. Nothing is copied, so that it is cheap for each of many
/// phenomena.
#[derive(Clone, Copy)]
pub struct OtherPhenomena<'a> {
    /// Lights and obstacles of the scene itself.
    pub scene: &'a Publication,
    /// Returns what all phenomena publish; called only when needed.
    pub published: &'a dyn Fn() -> &'a PublishedByAll,
    /// Index of the phenomenon itself.
    pub own_index: usize,
    /// The light of the sky.
    pub sky: &'a Sky,
}

impl<'a> OtherPhenomena<'a> {
    /// All lights but its own.
    pub fn lights(&self) -> impl Iterator<Item = &'a Light> + use<'a> {
        let (own, published) = (self.own_index, self.published);
        let others = std::iter::once_with(published).flat_map(move |all| all.but(own, &all.with_lights));
        self.scene.lights.iter().chain(others.flat_map(|publication| &publication.lights))
    }

    /// All solids but its own.
    pub fn occluders(&self) -> impl Iterator<Item = &'a Occluder> + use<'a> {
        let (own, published) = (self.own_index, self.published);
        let others = std::iter::once_with(published).flat_map(move |all| all.but(own, &all.with_occluders));
        self.scene.occluders.iter().chain(others.flat_map(|publication| &publication.occluders))
    }
}

/// What all phenomena of a scene publish.
///
/// Each of many phenomena may ask for the lights or solids of the others. Those that publish any are listed, so that what publishes none costs nothing.
#[derive(Clone, Debug, Default)]
pub struct PublishedByAll {
    publications: Vec<Publication>,
    with_lights: Vec<usize>,
    with_occluders: Vec<usize>,
}

impl PublishedByAll {
    /// The publications of all phenomena, in their order.
    #[must_use]
    pub fn new(publications: Vec<Publication>) -> Self {
        let (mut with_lights, mut with_occluders) = (Vec::new(), Vec::new());
        for (index, publication) in publications.iter().enumerate() {
            with_lights.extend((!publication.lights.is_empty()).then_some(index));
            with_occluders.extend((!publication.occluders.is_empty()).then_some(index));
        }
        Self { publications, with_lights, with_occluders }
    }

    /// Those of `listed` except that of phenomenon `own`.
    fn but<'a>(&'a self, own: usize, listed: &'a [usize]) -> impl Iterator<Item = &'a Publication> + use<'a> {
        listed.iter().filter(move |&&index| index != own).map(|&index| &self.publications[index])
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

/// The picture in a phenomenon's own [mirror](crate::phenomenon::PhenomenonInfo::mirror): radiance (ACEScg, cd/m^2) and alpha, at full or reduced
/// resolution, of the rows of the picture in which the mirror may be seen.
#[derive(Clone, Debug)]
pub struct Reflection {
    /// The pixels, as wide as the whole picture.
    pub image: Image<4>,
    /// Side of one of these pixels in pixels of the picture.
    pub pixel_size: usize,
    /// Rows of such pixels above the first one of `image`.
    pub first_row: usize,
}

impl Reflection {
    /// A whole picture at full resolution.
    #[must_use]
    pub fn whole(image: Image<4>) -> Self {
        Self { image, pixel_size: 1, first_row: 0 }
    }
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
    /// The picture in the phenomenon's own mirror, if it needs one.
    pub reflection: Option<&'a Reflection>,
    /// With a plate: the background of all phenomena in that mirror, plate and sky.
    pub backdrop: Option<&'a Backdrop>,
    /// Whether the renderer lights what the plate shows, so that the plate's own ground must not.
    pub plate_is_lit: bool,
    /// Lights, extinction and occluders of the other phenomena and of the scene itself. Where the camera stands still, lights that move are several along
    /// their paths, each with its share of the light; else they are where they are in the middle of the exposure.
    pub others: Publication,
    /// Lights in equal parts of the exposure; none if they stand still. For what is drawn at several times, as the camera or the thing moves.
    pub light_parts: Vec<Vec<Light>>,
}

impl Surroundings<'_> {
    /// The lights at a fraction of the exposure, 0 to 1.
    #[must_use]
    pub fn lights_at(&self, fraction: f64) -> &[Light] {
        let index = (fraction * self.light_parts.len() as f64) as usize;
        match self.light_parts.get(index).or(self.light_parts.last()) {
            Some(lights) => lights,
            None => &self.others.lights,
        }
    }
}

/// One set of lights for all parts of an exposure: of lights that move, each has its share of the light; those that stand still remain one.
#[must_use]
pub fn lights_of_parts(parts: &[Vec<Light>]) -> Vec<Light> {
    let share = 1.0 / parts.len().max(1) as f32;
    let mut mean: Vec<Light> = Vec::new();
    let longest = parts.iter().map(Vec::len).max().unwrap_or(0);
    for index in 0..longest {
        let first = mean.len();
        for light in parts.iter().filter_map(|lights| lights.get(index)) {
            let light = light.scaled(share);
            match mean[first..].iter_mut().find(|earlier| earlier.emitter == light.emitter) {
                Some(earlier) => (0..3).for_each(|c| earlier.intensity[c] += light.intensity[c]),
                None => mean.push(light),
            }
        }
    }
    mean
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
            plate_is_lit: false,
            others: Publication::default(),
            light_parts: Vec::new(),
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
    fn lights_of_all_parts_have_their_shares() {
        let at = |x: f64, intensity: f32| Light {
            emitter: Emitter::Point { position: DVec3::new(x, 0.0, 0.0), radius: 0.1 },
            intensity: [intensity; 3],
        };
        // The first flashes, the second moves.
        let parts = [vec![at(0.0, 8.0), at(1.0, 4.0)], vec![at(0.0, 0.0), at(2.0, 4.0)]];
        assert_eq!(lights_of_parts(&parts), [at(0.0, 4.0), at(1.0, 2.0), at(2.0, 2.0)]);
        let wind = Wind::new(crate::world::wind::WindParameters::default(), 1, None);
        let surroundings = Surroundings { light_parts: parts.to_vec(), ..Surroundings::from_wind(&wind) };
        assert_eq!(
            [0.0, 0.4, 0.6, 1.0].map(|t| surroundings.lights_at(t)[1]),
            [1.0, 1.0, 2.0, 2.0].map(|x| at(x, 4.0))
        );
    }

    #[test]
    fn lights_in_srgb_keep_their_luminance() {
        let point = Emitter::Point { position: DVec3::ZERO, radius: 0.1 };
        // White, a flame, and a red and a green outside of sRGB.
        for intensity in [[3.0; 3], [40.0, 18.0, 3.0], [9.0, 0.0, 0.0], [0.0, 2.0, 0.1]] {
            let light = Light { emitter: point, intensity };
            let SrgbLight { color, intensity } = light.srgb();
            assert!(color.iter().all(|value| (0.0..=1.0).contains(value)) && color.contains(&1.0), "{color:?}");
            let luminance = color::luminance(color::acescg_from_srgb(color.map(|value| value * intensity)));
            assert!((luminance / light.luminous_intensity().unwrap() - 1.0).abs() < 1e-4, "{luminance}");
        }
        let white = Light { emitter: point, intensity: [3.0; 3] };
        assert!((white.srgb().intensity - 3.0).abs() < 1e-4 && white.srgb().color.iter().all(|c| *c > 0.999));
        let dark = Light { emitter: point, intensity: [0.0; 3] };
        assert_eq!(dark.srgb(), SrgbLight { color: [1.0; 3], intensity: 0.0 });
        let sun = Light { emitter: Emitter::Directional { toward: DVec3::Y }, intensity: [3.0; 3] };
        assert_eq!((sun.luminous_intensity(), sun.emitter.position()), (None, None));
    }

    #[test]
    fn several_points_are_one_at_their_center_of_intensity() {
        let point = |height: f64, radius: f64, strength: f32| Light {
            emitter: Emitter::Point { position: DVec3::new(1.0, height, 0.0), radius },
            intensity: [strength; 3],
        };
        let sun = Light { emitter: Emitter::Directional { toward: DVec3::Y }, intensity: [3.0; 3] };
        let merged = Light::merge_points(&[point(0.0, 0.1, 3.0), sun, point(4.0, 0.1, 1.0)]).unwrap();
        let Emitter::Point { position, radius } = merged.emitter else { panic!("{merged:?}") };
        assert!((position - DVec3::new(1.0, 1.0, 0.0)).length() < 1e-6 && merged.intensity == [4.0; 3]);
        // 3/4 of 1 m^2, 1/4 of 9 m^2, and the radius itself.
        assert!((radius - 3.01_f64.sqrt()).abs() < 1e-6, "{radius}");
        let single = Light::merge_points(&[point(2.0, 0.5, 3.0)]).unwrap();
        let Emitter::Point { position, radius } = single.emitter else { panic!("{single:?}") };
        assert!((position.y - 2.0).abs() < 1e-12 && (radius - 0.5).abs() < 1e-9);
        assert_eq!(Light::merge_points(&[sun, point(0.0, 0.1, 0.0)]), None);
    }

    #[test]
    fn neighbors_are_all_but_oneself() {
        let shining = |intensity: f32| {
            let emitter = Emitter::Directional { toward: DVec3::Y };
            Publication { lights: vec![Light { emitter, intensity: [intensity; 3] }], ..Publication::default() }
        };
        let dark = Publication::default();
        let (scene, all) = (shining(1.0), PublishedByAll::new(vec![shining(2.0), shining(3.0), dark, shining(4.0)]));
        let published = || &all;
        let neighbors = OtherPhenomena { scene: &scene, published: &published, own_index: 1, sky: &Sky::DARK };
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
