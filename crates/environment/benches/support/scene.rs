//! Ground to be drawn: a wet street with lamps, and a lake.

use bansho_base::{
    camera::CameraParameters,
    image::Image,
    math::DVec3,
    phenomenon::{
        strip::{Shutter, View},
        surroundings::{Emitter, Light, Reflection, Surroundings},
    },
    world::{
        sky::{Sky, SkyKind},
        wind::Wind,
    },
};
use bansho_environment::ground::{GroundKind, GroundParameters};

/// A camera that looks down at ground, from a place far from the origin.
pub(crate) fn view(size: [usize; 2]) -> View {
    let camera = CameraParameters {
        position: [1203.3, 1.5, -810.0].into(),
        target: [1202.4, 1.0, -818.0].into(),
        vertical_fov_deg: 38.0.into(),
        ..CameraParameters::default()
    };
    View::new(camera, Shutter { open: 0.7, close: 0.7 }, 0.8, size, 0)
}

/// Two headlights and two street lamps under a dusky sky.
pub(crate) fn surroundings<'a>(wind: &'a Wind, reflection: Option<&'a Reflection>) -> Surroundings<'a> {
    let sky = Sky::new(SkyKind::Overcast, 0.5, 7000.0);
    let mut surroundings = Surroundings { sky, reflection, ..Surroundings::from_wind(wind) };
    let at = |x: f64, y: f64, z: f64| DVec3::new(1202.0 + x, y, -816.0 + z);
    let spot = |x: f64| Emitter::Spot {
        position: at(x, 0.65, -6.0),
        axis: DVec3::new(0.05, -0.05, 1.0).normalize(),
        cos_inner: 0.99,
        cos_outer: 0.92,
    };
    let lamp = |x: f64| Emitter::Point { position: at(x, 4.5, -1.0), radius: 0.1 };
    for (emitter, strength) in [(spot(-0.7), 9000.0), (spot(0.7), 9000.0), (lamp(-3.0), 800.0), (lamp(4.0), 800.0)] {
        surroundings.others.lights.push(Light { emitter, intensity: [strength, 0.9 * strength, 0.7 * strength] });
    }
    surroundings
}

/// A smooth picture in the mirror.
pub(crate) fn reflection(size: [usize; 2], pixel_size: usize) -> Reflection {
    let [width, height] = size.map(|side| side.div_ceil(pixel_size));
    let first_row = height / 5;
    let pixels = (first_row..height).flat_map(|y| {
        (0..width).map(move |x| [2.0 + x as f32 / width as f32, 1.0 + y as f32 / height as f32, 0.5, 1.0])
    });
    let image = Image::from_pixels(width, height - first_row, pixels.collect()).expect("as many pixels");
    Reflection { image, pixel_size, first_row }
}

/// Wet asphalt with puddles.
pub(crate) fn street() -> GroundParameters {
    GroundParameters {
        color: [0.045, 0.046, 0.05],
        texture: 0.4,
        texture_size: 0.6,
        wetness: 0.9.into(),
        puddles: 0.3,
        ..GroundParameters::default()
    }
}

/// A lake with small waves.
pub(crate) fn lake() -> GroundParameters {
    GroundParameters { kind: GroundKind::Water, waves: 0.01, ..GroundParameters::default() }
}
