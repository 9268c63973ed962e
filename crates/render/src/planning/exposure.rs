//! The exposure of a shot whose scene states none.

use bansho_base::{
    color::{ev100_of_white_luminance, luminance},
    math::{DVec2, DVec3},
    parameters::Auto,
    phenomenon::surroundings::Light,
    tables::LevelGround,
};

use crate::{compiled::CompiledScene, plan::Plan};
use bansho_scene::Scene;

/// Luminance of surfaces and air that lamps light, relative to display white, below which all but [`BRIGHTEST_FRACTION`] of it must stay: a
/// lit street at night is not white.
const LIT_LEVEL: f64 = 0.3;
/// Fraction of the lines of sight that may be brighter than [`LIT_LEVEL`].
const BRIGHTEST_FRACTION: f64 = 0.05;
/// Luminance of a `[sky]` over a plate, relative to display white: an overcast sky is nearly white in a photograph of what is below it.
const SKY_LEVEL: f64 = 0.8;
/// Exposure value of a sunlit day, for a scene without any light.
const SUNLIT_EV100: f64 = 15.0;
/// Exposure value that is assumed for a plate when nothing else is known: that of a street under heavy clouds, from which rain falls.
const OVERCAST_EV100: f64 = 12.0;

/// Columns and rows of the lines of sight along which light is measured.
const COLUMNS: usize = 32;
const ROWS: usize = 18;
/// Ground beyond this distance is not measured, m.
const MAX_GROUND_DISTANCE: f64 = 200.0;
/// Distances from the camera at which the light in the air is measured, m.
const AIR_DISTANCES: [f64; 3] = [1.0, 2.0, 4.0];
/// Fraction of the light that reaches drops and smoke which a line of sight through the air between them shows.
const AIR_FRACTION: f64 = 0.1;

/// The exposure of a shot: the scene's own, else the plate's, else one chosen from the luminances in the scene.
pub(crate) fn choose(compiled: &CompiledScene, plan: &Plan) -> f32 {
    match plan.scene.picture.exposure_ev100 {
        Auto::Set(ev100) => ev100 as f32,
        Auto::Auto => of_plate(compiled).unwrap_or_else(|| {
            let whites = compiled.phenomena().map(|phenomenon| phenomenon.luminance() / phenomenon.exposed_luminance());
            automatic(plan, whites.fold(0.0, f64::max))
        }) as f32,
    }
}

/// The exposure value that is assumed for a plate, where neither the scene nor the picture states one.
pub(crate) fn assumed_of_plate(compiled: &CompiledScene, plan: &Plan) -> Option<f64> {
    let is_open = plan.scene.has_plate() && plan.scene.picture.exposure_ev100 == Auto::Auto;
    (is_open && of_plate(compiled).is_none()).then(|| f64::from(plan.exposure_ev100))
}

/// Exposure value at ISO 100 with which the plate was taken, if the scene or the picture states it.
fn of_plate(compiled: &CompiledScene) -> Option<f64> {
    let plate = &compiled.scene().plate;
    match plate.exposure_ev100 {
        Auto::Set(ev100) => plate.image.as_ref().map(|_| ev100),
        Auto::Auto => compiled.plate_image()?.exposure_ev100,
    }
}

/// The exposure value for phenomena that need a luminance of `white_of_phenomena` as display white, cd/m^2.
///
/// Over a plate of unknown exposure, it is a guess at the plate's exposure: the one that suits what shines and makes a `[sky]` nearly white;
/// without either, that of an overcast day.
fn automatic(plan: &Plan, white_of_phenomena: f64) -> f64 {
    let scene = plan.scene();
    let (other_white, default_ev100) = if scene.has_plate() {
        (stated_sky(scene) / SKY_LEVEL, OVERCAST_EV100)
    } else {
        (lit_luminance(plan) / LIT_LEVEL, SUNLIT_EV100)
    };
    let white = white_of_phenomena.max(other_white);
    if white > 0.0 { ev100_of_white_luminance(white) } else { default_ev100 }
}

/// Luminance of the scene's own sky at the zenith, cd/m^2.
fn stated_sky(scene: &Scene) -> f64 {
    scene.tables.sky(0.0).map_or(0.0, |stated| f64::from(luminance(stated.sky.radiance(DVec3::Y))))
}

/// Luminance, cd/m^2, of ground and air that the scene's own lights light: the quantile that [`BRIGHTEST_FRACTION`] of the lines of sight
/// exceed.
///
/// Measured in the first, the middle and the last frame, along lines of sight that are the same for every size and crop.
fn lit_luminance(plan: &Plan) -> f64 {
    let scene = plan.scene();
    if scene.tables.lights(0.0).next().is_none() {
        return 0.0;
    }
    let frames = plan.frames();
    let numbers = [frames.start, (frames.start + frames.end) / 2, frames.end - 1];
    let mut seen: Vec<f64> =
        numbers.iter().flat_map(|number| lit_luminances(plan, plan.shutter(*number).middle())).collect();
    seen.sort_by(f64::total_cmp);
    seen[((1.0 - BRIGHTEST_FRACTION) * (seen.len() - 1) as f64) as usize]
}

/// Luminance along each line of sight at time `t`, cd/m^2.
fn lit_luminances(plan: &Plan, t: f64) -> Vec<f64> {
    let scene = plan.scene();
    let lights: Vec<Light> = scene.tables.lights(t).collect();
    let camera = scene.camera.at(t, plan.size());
    let ground = scene.tables.level_ground(t).filter(|_| !scene.has_plate());
    let sky = scene.tables.sky(t).map_or([0.0; 3], |stated| stated.sky.horizontal_illuminance());
    let has_air = scene.instances.iter().any(|instance| instance.enabled);
    let mut luminances = Vec::with_capacity(COLUMNS * ROWS);
    for index in 0..COLUMNS * ROWS {
        let [column, row] = [index % COLUMNS, index / COLUMNS].map(|step| step as f64 + 0.5);
        let pixel = DVec2::new(column / COLUMNS as f64 * camera.size[0], row / ROWS as f64 * camera.size[1]);
        let Some(line) = camera.direction(pixel).and_then(DVec3::try_normalize) else {
            luminances.push(0.0);
            continue;
        };
        let mut end = f64::INFINITY;
        let mut on_ground = 0.0;
        if let Some(ground) = &ground
            && let Some(distance) = ground_distance(ground, camera.position, line)
        {
            end = distance;
            let arriving =
                f64::from(luminance(sky)) + illuminance(&lights, camera.position + line * distance, Some(DVec3::Y));
            // Lambertian.
            on_ground = arriving * ground.reflectance / std::f64::consts::PI;
        }
        let distances = AIR_DISTANCES.iter().filter(|distance| has_air && **distance < end);
        let in_air = distances.map(|distance| illuminance(&lights, camera.position + line * *distance, None));
        luminances.push(on_ground + AIR_FRACTION / (4.0 * std::f64::consts::PI) * in_air.fold(0.0, f64::max));
    }
    luminances
}

/// Distance along a line of sight at which it meets the ground, m.
fn ground_distance(ground: &LevelGround, eye: DVec3, line: DVec3) -> Option<f64> {
    let distance = (eye.y - ground.height) / -line.y;
    (line.y < 0.0 && (0.0..MAX_GROUND_DISTANCE).contains(&distance)).then_some(distance)
}

/// Illuminance by all lights at a point, lux: on a surface with this normal, or without one on a surface that faces each light.
fn illuminance(lights: &[Light], point: DVec3, normal: Option<DVec3>) -> f64 {
    let each = lights.iter().map(|light| {
        let (arriving, toward) = light.illuminance(point);
        f64::from(luminance(arriving)) * normal.map_or(1.0, |normal| toward.dot(normal).max(0.0))
    });
    each.sum()
}
