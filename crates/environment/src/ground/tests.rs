use bansho_base::{
    camera::CameraParameters,
    color,
    host::observer::Unobserved,
    image::{Image, Rect},
    math::DVec3,
    phenomenon::{
        Phenomenon, Run,
        strip::{DepthInterval, Shutter, Strip, View},
        surroundings::{Emitter, Light, Reflection, Surroundings},
    },
    world::wind::{Wind, WindParameters},
};

use super::{Ground, GroundKind, GroundParameters, wet_reflection};

const SIZE: [usize; 2] = [64, 48];

fn view() -> View {
    let camera = CameraParameters {
        position: [0.0, 2.0, 6.0].into(),
        target: [0.0, 0.5, 0.0].into(),
        ..CameraParameters::default()
    };
    View::new(camera, Shutter { open: 0.0, close: 0.0 }, 0.0, SIZE, 0)
}

fn drawn(parameters: GroundParameters, lights: Vec<Light>, reflection: Option<&Reflection>) -> Strip {
    let ground = Ground::new(parameters, 1, None);
    let (view, wind) = (view(), Wind::new(WindParameters::default(), 1, None));
    let mut surroundings = Surroundings { reflection, ..Surroundings::from_wind(&wind) };
    surroundings.others.lights = lights;
    let mut strip = Strip::default();
    strip.reset(Rect::from_size(SIZE[0], SIZE[1]), None, 0);
    ground.prepare(&view, &surroundings, &Unobserved).unwrap().draw(&DepthInterval::ALL, &mut strip);
    strip
}

fn plain() -> GroundParameters {
    GroundParameters { texture: 0.0, color: [0.5; 3], puddles: 0.0, ..GroundParameters::default() }
}

fn lamp(height: f64) -> Light {
    Light { emitter: Emitter::Point { position: DVec3::new(0.0, height, 0.0), radius: 0.01 }, intensity: [100.0; 3] }
}

fn at(strip: &Strip, point: DVec3) -> f64 {
    let pixel = view().camera.project(point).unwrap().pixel;
    let index = pixel.y as usize * SIZE[0] + pixel.x as usize;
    f64::from(color::luminance([0, 1, 2].map(|c| strip.radiance[c][index])))
}

#[test]
fn dry_ground_under_a_lamp_has_lamberts_luminance() {
    let strip = drawn(plain(), vec![lamp(2.0)], None);
    // E = 100 cd / (2 m)^2 = 25 lx; L = 0.5 * 25 / pi.
    let expected = 0.5 * 25.0 / std::f64::consts::PI;
    assert!((at(&strip, DVec3::ZERO) / expected - 1.0).abs() < 0.02, "{}", at(&strip, DVec3::ZERO));
    assert_eq!(strip.transmittance(SIZE[0] * (SIZE[1] - 1)), [0.0; 3]);
}

#[test]
fn standing_water_is_darker_than_a_film_where_it_mirrors_nothing() {
    let ground = |puddles: f64| {
        let parameters = GroundParameters { puddles, wetness: 1.0.into(), roughness: 0.02, ..plain() };
        // Straight above, so that nothing is mirrored toward the camera.
        at(&drawn(parameters, vec![lamp(40.0)], None), DVec3::ZERO)
    };
    let [film, puddle] = [0.0, 1.0].map(ground);
    assert!((0.5..0.75).contains(&(puddle / film)), "{puddle} {film}");
}

#[test]
fn nothing_is_drawn_above_the_horizon_or_from_below() {
    let camera = CameraParameters { position: [0.0, -1.0, 6.0].into(), ..CameraParameters::default() };
    let ground = Ground::new(plain(), 1, None);
    let view = View::new(camera, Shutter { open: 0.0, close: 0.0 }, 0.0, SIZE, 0);
    let wind = Wind::new(WindParameters::default(), 1, None);
    let surroundings = Surroundings::from_wind(&wind);
    let mut strip = Strip::default();
    strip.reset(Rect::from_size(SIZE[0], SIZE[1]), None, 0);
    ground.prepare(&view, &surroundings, &Unobserved).unwrap().draw(&DepthInterval::ALL, &mut strip);
    assert!(strip.transmittance_planes().is_none());
}

#[test]
fn a_wet_ground_is_darker_and_mirrors_what_fresnel_says() {
    let mirror = Reflection::whole(Image::filled(SIZE[0], SIZE[1], [1000.0, 1000.0, 1000.0, 1.0]));
    let wet = GroundParameters { wetness: 1.0.into(), puddles: 1.0, ..plain() };
    let dry = at(&drawn(plain(), vec![lamp(2.0)], None), DVec3::ZERO);
    let soaked = at(&drawn(wet.clone(), vec![lamp(2.0)], None), DVec3::ZERO);
    // Without a picture of its surroundings a puddle shows none of them: soaked ground keeps 0.45, under standing water 0.6 of that.
    bansho_base::assert_measured!("future work: wetness: soaked over dry ground", soaked / dry, 0.27, 1e-3);
    let specular = at(&drawn(wet, Vec::new(), Some(&mirror)), DVec3::ZERO);
    // Seen from (0, 2, 6): the cosine to the normal is 2 / sqrt(40).
    let cos = 2.0 / bansho_base::math::sqrt(40.0);
    assert!((specular / (1000.0 * f64::from(wet_reflection::fresnel(cos as f32))) - 1.0).abs() < 0.05, "{specular}");
}

#[test]
fn a_plates_ground_is_darkened_but_not_covered() {
    let strip = drawn(GroundParameters { kind: GroundKind::Plate, wetness: 1.0.into(), ..plain() }, Vec::new(), None);
    let index = SIZE[0] * (SIZE[1] - 1);
    assert!((strip.transmittance(index)[0] - 0.45).abs() < 1e-6);
}

#[test]
fn only_dry_land_is_no_mirror() {
    let mirror = |parameters| Ground::new(parameters, 1, None).info().mirror.map(|mirror| mirror.height);
    assert_eq!(mirror(plain()), None);
    assert_eq!(mirror(GroundParameters { wetness: 0.1.into(), height: 0.5, ..plain() }), Some(0.5));
    assert_eq!(mirror(GroundParameters { kind: GroundKind::Water, ..plain() }), Some(0.0));
}

#[test]
fn a_wall_stays_dry_three_centimeters_above_the_ground() {
    let size = [640, 480];
    let camera = CameraParameters { position: [0.0, 1.6, 6.0].into(), ..CameraParameters::default() };
    let view = View::new(camera, Shutter { open: 0.0, close: 0.0 }, 0.0, size, 0);
    let wind = Wind::new(WindParameters::default(), 1, None);
    let surroundings = Surroundings::from_wind(&wind);
    // Transmittance of the ground in front of a plate that is everywhere at this height above the ground, in a row 6 m away.
    let transmittance = |above: f64, plate_tolerance: f64| {
        let wet =
            GroundParameters { kind: GroundKind::Plate, wetness: 1.0.into(), puddles: 0.0, plate_tolerance, ..plain() };
        let row = view.camera.project(DVec3::ZERO).unwrap().pixel.y as usize;
        let direction = view.camera.direction(bansho_base::math::DVec2::new(320.5, row as f64 + 0.5)).unwrap();
        let depth = vec![((1.6 - above) / -direction.y) as f32; size[0]];
        let mut strip = Strip::default();
        strip.reset(Rect { x: 0, y: row, width: size[0], height: 1 }, Some(&|_| &depth), 0);
        let ground = Ground::new(wet, 1, None);
        ground.prepare(&view, &surroundings, &Unobserved).unwrap().draw(&DepthInterval::ALL, &mut strip);
        strip.transmittance(320)[0]
    };
    assert_eq!(transmittance(0.03, 0.02), 1.0);
    assert_eq!(transmittance(-0.03, 0.02), 1.0);
    assert!((transmittance(0.0, 0.02) - 0.45).abs() < 1e-6 && (transmittance(0.01, 0.02) - 0.45).abs() < 1e-6);
    assert!((transmittance(0.03, 0.05) - 0.45).abs() < 1e-6, "depth that is only a guess");
}
