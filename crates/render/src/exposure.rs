//! The exposure of a shot whose scene states none.

use bansho_base::{
    color::{ev100_of_white_luminance, luminance},
    math::{DVec2, DVec3},
    parameters::Auto,
    phenomenon::surroundings::Light,
};

use crate::{compiled::CompiledScene, plan::Plan};
use bansho_environment::ground::GroundParameters;
use bansho_scene::{LightParameters, Scene};

/// How many times display white the bright parts of a phenomenon are with an automatic exposure: enough for a core
/// that nears white while its edges keep their color.
const HEADROOM: f64 = 1.7;
/// How bright beside display white what lamps light is at most, but for its brightest parts: a lit street at night is not white.
const LIT_SHARE: f64 = 0.3;
/// Share of what is seen that may be brighter than that.
const BRIGHTEST_SHARE: f64 = 0.05;
/// How bright beside display white a `[sky]` over a plate is: a dull sky is nearly white in a photograph of what stands under it.
const SKY_SHARE: f64 = 0.8;
/// Exposure value of a sunlit day, for a scene in which nothing shines.
const SUNLIT_EV100: f64 = 15.0;
/// Exposure value that a plate is taken to have where nothing says better: that of a street under heavy clouds, from which rain falls.
const OVERCAST_EV100: f64 = 12.0;

/// Lines of sight along which light is measured, across and down.
const COLUMNS: usize = 32;
const ROWS: usize = 18;
/// Ground that is further away is not measured, m.
const FARTHEST_GROUND: f64 = 200.0;
/// Where in the air light is measured, m from the camera.
const IN_AIR: [f64; 3] = [1.0, 2.0, 4.0];
/// How much of the light on drops and smoke the air between them lets a line of sight show.
const AIR_SHARE: f64 = 0.1;

/// The exposure of a shot: the scene's own, or measured.
pub(crate) fn measure(compiled: &CompiledScene, plan: &Plan) -> f32 {
    match plan.scene.picture.exposure_ev100 {
        Auto::Set(ev100) => ev100 as f32,
        Auto::Auto => of_plate(compiled).unwrap_or_else(|| {
            let brightest = compiled.phenomena().map(|phenomenon| phenomenon.luminance()).fold(0.0, f64::max);
            automatic(plan, brightest)
        }) as f32,
    }
}

/// The exposure value of a plate that neither the scene nor the picture states, and the shot therefore assumes.
pub(crate) fn assumed_of_plate(compiled: &CompiledScene, plan: &Plan) -> Option<f64> {
    let is_open = plan.scene.has_plate() && plan.scene.picture.exposure_ev100 == Auto::Auto;
    (is_open && of_plate(compiled).is_none()).then(|| f64::from(plan.exposure_ev100))
}

/// Exposure value at ISO 100 with which the plate was taken, as far as the scene or the picture says so.
fn of_plate(compiled: &CompiledScene) -> Option<f64> {
    let plate = &compiled.scene().plate;
    let path = plate.image.as_ref()?;
    match plate.exposure_ev100 {
        Auto::Set(ev100) => Some(ev100),
        Auto::Auto => compiled.assets().picture(&path.0, compiled.scene().picture.first_frame).ok()?.exposure_ev100,
    }
}

/// The exposure value for phenomena whose bright parts have a luminance of `brightest` cd/m^2.
///
/// Over a plate of unknown exposure it is that of the plate as one may guess it: the one at which what shines is shown well, a `[sky]` is
/// nearly white, and otherwise that of an overcast day.
fn automatic(plan: &Plan, brightest: f64) -> f64 {
    let scene = plan.scene();
    let (other, usual) = if scene.has_plate() {
        (stated_sky(scene) / SKY_SHARE, OVERCAST_EV100)
    } else {
        (lit(plan) / LIT_SHARE, SUNLIT_EV100)
    };
    let white = (brightest / HEADROOM).max(other);
    if white > 0.0 { ev100_of_white_luminance(white) } else { usual }
}

/// Luminance overhead of the scene's own sky, cd/m^2.
fn stated_sky(scene: &Scene) -> f64 {
    scene.sky.as_ref().map_or(0.0, |sky| f64::from(luminance(sky.at(0.0).radiance(DVec3::Y))))
}

/// Luminance, cd/m^2, that the scene's own lights give to ground and air; a small share of what is seen is brighter.
///
/// In the first, the middle and the last frame, along lines of sight that are the same for every size and crop.
fn lit(plan: &Plan) -> f64 {
    let scene = plan.scene();
    if scene.lights.is_empty() {
        return 0.0;
    }
    let frames = plan.frames();
    let numbers = [frames.start, (frames.start + frames.end) / 2, frames.end - 1];
    let mut seen: Vec<f64> = numbers.iter().flat_map(|number| lit_at(plan, plan.shutter(*number).middle())).collect();
    seen.sort_by(f64::total_cmp);
    seen[((1.0 - BRIGHTEST_SHARE) * (seen.len() - 1) as f64) as usize]
}

/// The same along each line of sight at time `t`.
fn lit_at(plan: &Plan, t: f64) -> Vec<f64> {
    let scene = plan.scene();
    let lights: Vec<Light> = scene.lights.iter().map(|light: &LightParameters| light.at(t)).collect();
    let camera = scene.camera.at(t, plan.size());
    let ground = scene.ground.as_ref().filter(|_| !scene.has_plate());
    let sky = scene.sky.as_ref().map_or([0.0; 3], |sky| sky.at(t).horizontal_illuminance());
    let has_air = scene.instances.iter().any(|instance| instance.enabled);
    let along = |index: usize| {
        let [column, row] = [index % COLUMNS, index / COLUMNS].map(|step| step as f64 + 0.5);
        let pixel = DVec2::new(column / COLUMNS as f64 * camera.size[0], row / ROWS as f64 * camera.size[1]);
        let Some(line) = camera.direction(pixel).and_then(DVec3::try_normalize) else { return 0.0 };
        let met = ground.and_then(|ground| Some((ground, meets(ground, camera.position, line)?)));
        let end = met.map_or(f64::INFINITY, |(_, distance)| distance);
        let on_ground = met.map_or(0.0, |(ground, distance)| {
            let arriving =
                f64::from(luminance(sky)) + illuminance(&lights, camera.position + line * distance, Some(DVec3::Y));
            arriving * ground.reflectance(t) / std::f64::consts::PI
        });
        let places = IN_AIR.iter().filter(|distance| has_air && **distance < end);
        let in_air = places.map(|distance| illuminance(&lights, camera.position + line * *distance, None));
        on_ground + AIR_SHARE / (4.0 * std::f64::consts::PI) * in_air.fold(0.0, f64::max)
    };
    (0..COLUMNS * ROWS).map(along).collect()
}

/// How far along a line of sight the ground is met, m.
fn meets(ground: &GroundParameters, eye: DVec3, line: DVec3) -> Option<f64> {
    let distance = (eye.y - ground.height) / -line.y;
    (line.y < 0.0 && (0.0..FARTHEST_GROUND).contains(&distance)).then_some(distance)
}

/// What arrives from all lights at a point, lux: on a surface with a normal, or on one that faces each.
fn illuminance(lights: &[Light], point: DVec3, normal: Option<DVec3>) -> f64 {
    let each = lights.iter().map(|light| {
        let (arriving, toward) = light.illuminance(point);
        f64::from(luminance(arriving)) * normal.map_or(1.0, |normal| toward.dot(normal).max(0.0))
    });
    each.sum()
}
