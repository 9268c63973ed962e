//! Effects that programs embed: time, live changes, pixels, data, errors.

use std::sync::Arc;

use bansho::{
    Animated, CameraParameters, Effect, EffectError, FlameParticlesParameters, FlameSheetParameters, LiveEffect,
    PictureParameters, Plan, PlanOptions, RainParameters, SceneBuilder, Shot, Unobserved, WindParameters,
    compile_scene, f16,
};

const SIZE: usize = 48;

fn torch() -> FlameSheetParameters {
    FlameSheetParameters { width: 0.4, height: 0.8, ..Default::default() }
}

fn light_of(live: &mut LiveEffect, dt: f64) -> Vec<f32> {
    let picture = live.advance(dt).unwrap();
    picture.frame().beauty.pixels().iter().flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect()
}

/// Sum of the differences of two pictures, relative to the mean sum of their values.
fn movement(a: &[f32], b: &[f32]) -> f64 {
    let sum = |values: &[f32]| values.iter().map(|value| f64::from(*value)).sum::<f64>();
    let difference: f64 = a.iter().zip(b).map(|(a, b)| f64::from((a - b).abs())).sum();
    2.0 * difference / (sum(a) + sum(b))
}

fn assert_send_and_sync<T: Send + Sync>(_: &T) {}

#[test]
fn at_a_time_it_is_the_picture_of_a_render_to_the_bit() {
    let text = "bansho = 2\n[picture]\nsize = [48, 48]\nfps = 24\n[wind]\nvelocity = [1, 0, 0]\n";
    for phenomenon in [
        "[[flame_sheet]]",
        "[[flame_particles]]\nparticles = 300",
        "[[rain]]",
        "[[aurora]]\npreroll_s = 0.5\nparticles = { count = 500 }",
    ] {
        let text = format!("{text}{phenomenon}\n");
        let compiled = compile_scene("scene", &text, Arc::default_assets()).unwrap();
        let plan = Plan::new(&compiled, &PlanOptions::default()).unwrap();
        let mut live = Effect::from_scene(bansho::parse_scene("scene", &text).unwrap()).backdrop(true).open().unwrap();
        assert_send_and_sync(&live);
        let mut shot = Shot::open(compiled, Arc::new(plan));
        for number in [0, 1, 4, 9] {
            let frame = bansho::draw(&mut shot, number, &Unobserved).unwrap();
            let time = number as f64 / 24.0;
            let picture = live.at(time).unwrap();
            assert_eq!(picture.frame().beauty, frame.beauty, "{phenomenon} {number}");
            assert_eq!((picture.time_s(), picture.owed_s()), (time, 0.0));
        }
    }
}

trait DefaultAssets {
    fn default_assets() -> Self;
}

impl DefaultAssets for Arc<dyn bansho::Assets> {
    fn default_assets() -> Self {
        Arc::new(bansho::MemoryAssets::default())
    }
}

#[test]
fn an_effect_of_structs_is_the_scene_of_a_file() {
    let sheet = FlameSheetParameters { speed: 1.3.into(), ..Default::default() };
    let wind = WindParameters { velocity: [0.5, 0.0, 0.1].into(), ..Default::default() };
    let mut live = Effect::new(sheet).wind(wind).size(SIZE, SIZE).seed(7).open().unwrap();
    let text =
        "bansho = 2\npicture = { seed = 7 }\nwind = { velocity = [0.5, 0, 0.1] }\n[[flame_sheet]]\nspeed = 1.3\n";
    let mut file = Effect::from_scene(bansho::parse_scene("scene", text).unwrap()).size(SIZE, SIZE).open().unwrap();
    assert_eq!(live.at(0.7).unwrap().frame().beauty, file.at(0.7).unwrap().frame().beauty);
}

/// The wind of a game: it changes a little every frame.
fn game_wind(frame: u32) -> [f64; 3] {
    let t = f64::from(frame) / 60.0;
    [
        0.5 + 0.3 * bansho::base::math::sin(0.9 * t) + 0.02 * f64::from(frame % 3),
        0.0,
        0.2 * bansho::base::math::cos(0.7 * t),
    ]
}

#[test]
fn a_wind_that_changes_every_frame_moves_no_frame_more_than_constant_wind() {
    let wind = WindParameters { velocity: [0.5, 0.0, 0.0].into(), gust: 0.8, ..Default::default() };
    let rain = RainParameters { distance: 6.0, ..Default::default() };
    let effects = [
        ("flame", Effect::new(torch())),
        ("gas", Effect::new(FlameParticlesParameters { particles: 400, preroll_s: 0.5.into(), ..Default::default() })),
        ("rain", Effect::new(rain)),
    ];
    for (name, effect) in effects {
        let open = || effect.clone().wind(wind.clone()).size(SIZE, SIZE).open().unwrap();
        let (mut constant, mut changing) = (open(), open());
        let mut before = [light_of(&mut constant, 0.0), light_of(&mut changing, 0.0)];
        let mut movements = [Vec::new(), Vec::new()];
        let frames = if name == "flame" { 3600 } else { 240 };
        for frame in 0..frames {
            changing.set_wind(game_wind(frame), 0.8).unwrap();
            let now = [light_of(&mut constant, 1.0 / 60.0), light_of(&mut changing, 1.0 / 60.0)];
            for which in 0..2 {
                movements[which].push(movement(&before[which], &now[which]));
            }
            before = now;
        }
        for series in &mut movements {
            series.sort_by(f64::total_cmp);
        }
        for quantile in [0.5, 0.9, 0.99, 1.0] {
            let [constant, changing] =
                movements.each_ref().map(|series| series[((series.len() - 1) as f64 * quantile) as usize]);
            assert!(changing < 1.5 * constant, "{name}, quantile {quantile}: {changing} {constant}");
        }
    }
}

#[test]
fn the_issue_of_a_wind_from_half_a_meter_to_a_little_more_after_a_minute() {
    let wind = WindParameters { velocity: [0.5, 0.0, 0.0].into(), gust: 0.8, ..Default::default() };
    let mut live = Effect::new(torch()).wind(wind).size(SIZE, SIZE).open().unwrap();
    live.at(59.9).unwrap();
    let a = light_of(&mut live, 0.017);
    let b = light_of(&mut live, 0.017);
    live.set_wind([0.52, 0.0, 0.0], 0.8).unwrap();
    let c = light_of(&mut live, 0.017);
    let (without, with) = (movement(&a, &b), movement(&b, &c));
    assert!(with < 1.3 * without, "{with} {without}");
}

#[test]
fn a_live_run_is_the_run_that_knew_the_changes() {
    let close = |t: f64| t + 1.0 / 60.0;
    let speeds = [0.5, 3.0];
    let keys = vec![
        (0.0, [speeds[0], 0.0, 0.0]),
        (close(2.0), [speeds[0], 0.0, 0.0]),
        (close(2.0) + 0.25, [speeds[1], 0.0, 0.0]),
    ];
    let knew = Animated::keyed(keys, bansho::base::math::curve::Interpolation::Linear).unwrap();
    let sparks = bansho::fire::sparks::SparkParameters { rate: 0.0, ..Default::default() };
    let sheet = FlameSheetParameters { sparks, ..torch() };
    for effect in [
        Effect::new(sheet),
        Effect::new(FlameParticlesParameters { particles: 400, preroll_s: 0.5.into(), ..Default::default() }),
    ] {
        let open = |velocity: Animated<[f64; 3]>| {
            let wind = WindParameters { velocity, ..Default::default() };
            effect.clone().wind(wind).size(SIZE, SIZE).open().unwrap()
        };
        let (mut live, mut keyed) = (open([speeds[0], 0.0, 0.0].into()), open(knew.clone()));
        for time in [0.5, 2.0] {
            assert_eq!(live.at(time).unwrap().frame().beauty, keyed.at(time).unwrap().frame().beauty, "{time}");
        }
        live.set_wind([speeds[1], 0.0, 0.0], 0.3).unwrap();
        let (live, keyed) = (light_of(&mut live, 5.0 / 60.0), light_of(&mut keyed, 5.0 / 60.0));
        // Only roundings differ, which a chaotic gas amplifies; so it is compared soon after.
        assert!(movement(&live, &keyed) < 1e-3, "{}", movement(&live, &keyed));
    }
}

#[test]
fn the_same_changes_at_the_same_times_give_the_same_bytes() {
    let run = || {
        let mut live = Effect::new(torch()).size(SIZE, SIZE).open().unwrap();
        let mut all = Vec::new();
        for frame in 0..120 {
            live.set_wind(game_wind(frame), 0.5).unwrap();
            if frame == 60 {
                live.extinguish("flame_sheet").unwrap();
            }
            all = light_of(&mut live, 1.0 / 60.0);
        }
        all
    };
    assert_eq!(run(), run());
}

/// Horizontal center of light of a picture, in pixels from the left.
fn center(light: &[f32]) -> f64 {
    let sum: f64 = light.iter().map(|value| f64::from(*value)).sum();
    let moment = |(index, value): (usize, &f32)| (index / 3 % SIZE) as f64 * f64::from(*value);
    light.iter().enumerate().map(moment).sum::<f64>() / sum
}

#[test]
fn five_seconds_after_a_step_the_wind_acts_as_a_constant_wind_does() {
    let camera =
        CameraParameters { position: [0.0, 0.6, 6.0].into(), target: [0.0, 0.6, 0.0].into(), ..Default::default() };
    let gas = FlameParticlesParameters { particles: 400, preroll_s: 2.0.into(), ..Default::default() };
    for (name, effect) in [("sheet", Effect::new(torch())), ("gas", Effect::new(gas))] {
        let open = |speed: f64| {
            let wind = WindParameters { velocity: [speed, 0.0, 0.0].into(), gust: 0.0, ..Default::default() };
            effect.clone().wind(wind).camera(camera.clone()).size(SIZE, SIZE).open().unwrap()
        };
        let mean_center = |live: &mut LiveEffect| {
            (0..40).map(|_| center(&light_of(live, 1.0 / 20.0))).sum::<f64>() / 40.0 - 0.5 * (SIZE - 1) as f64
        };
        let (mut calm, mut stepped, mut constant) = (open(0.5), open(0.5), open(3.0));
        stepped.at(1.0).unwrap();
        stepped.set_wind([3.0, 0.0, 0.0], 0.0).unwrap();
        stepped.at(6.0).unwrap();
        let (calm, stepped, constant) = (mean_center(&mut calm), mean_center(&mut stepped), {
            constant.at(6.0).unwrap();
            mean_center(&mut constant)
        });
        assert!(constant > 1.5 * calm && (stepped - constant).abs() < 0.1 * constant.abs(), "{name}");
    }
}

#[test]
fn flames_are_lit_put_out_and_moved_without_a_jump() {
    let gas = FlameParticlesParameters { particles: 300, preroll_s: 0.5.into(), ..Default::default() };
    for (name, effect) in [("flame_sheet", Effect::new(torch())), ("flame_particles", Effect::new(gas))] {
        let camera =
            CameraParameters { position: [0.0, 0.8, 5.0].into(), target: [0.0, 0.8, 0.0].into(), ..Default::default() };
        let mut live = effect.camera(camera).size(SIZE, SIZE).open().unwrap();
        let sum = |light: &[f32]| light.iter().map(|value| f64::from(*value)).sum::<f64>();
        let series = |live: &mut LiveEffect, frames: usize| -> Vec<f64> {
            (0..frames).map(|_| sum(&light_of(live, 1.0 / 60.0))).collect()
        };
        let largest_change =
            |series: &[f64]| series.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
        let burning = series(&mut live, 120);
        let full = burning.iter().sum::<f64>() / burning.len() as f64;
        live.extinguish(name).unwrap();
        let dying = [&burning[119..], &series(&mut live, 180)].concat();
        let (usual, largest) = (largest_change(&burning) / full, largest_change(&dying) / full);
        assert!(largest < usual.max(0.35), "{name}: {largest} {usual}");
        assert!(dying[180] < 1e-3 * full, "{name}: {} of {full}", dying[180]);
        live.ignite(name).unwrap();
        live.advance(1.0).unwrap();
        let lit = light_of(&mut live, 1.0);
        assert!(sum(&lit) > 0.3 * full, "{name}: {} of {full}", sum(&lit));
        live.move_to(name, [0.7, 0.0, 0.0], 0.5).unwrap();
        let now = light_of(&mut live, 1.0 / 60.0);
        assert!((center(&now) - center(&lit)).abs() < 1.0, "{name}");
        live.advance(1.0).unwrap();
        let moved = light_of(&mut live, 1.0);
        assert!(center(&moved) > center(&lit) + 3.0, "{name}: {} {}", center(&moved), center(&lit));
    }
}

#[test]
fn a_changed_parameter_builds_that_phenomenon_alone_and_leaves_the_others() {
    let gas = FlameParticlesParameters { particles: 300, preroll_s: 0.5.into(), ..Default::default() };
    let mut live = Effect::new(gas).with("torch", torch()).size(SIZE, SIZE).open().unwrap();
    live.advance(0.5).unwrap();
    let particles = live.particles();
    let changed = FlameSheetParameters {
        color: bansho::fire::sheet::ColorParameters { luminance: 4000.0.into(), ..Default::default() },
        ..torch()
    };
    live.set_parameters("torch", changed).unwrap();
    assert_eq!(live.particles(), particles, "the gas keeps its state");
    assert_eq!(live.parameters::<FlameSheetParameters>("torch").unwrap().color.luminance.at(1e3), 4000.0);
    // A speed that changes after a minute does not replace the texture of the past.
    let mut live = Effect::new(torch()).size(SIZE, SIZE).open().unwrap();
    live.at(60.0).unwrap();
    let (a, b) = (light_of(&mut live, 1.0 / 60.0), light_of(&mut live, 1.0 / 60.0));
    live.set_parameters("flame_sheet", FlameSheetParameters { speed: 1.3.into(), ..torch() }).unwrap();
    let c = light_of(&mut live, 1.0 / 60.0);
    assert!(movement(&b, &c) < 1.3 * movement(&a, &b), "{} {}", movement(&b, &c), movement(&a, &b));
}

#[test]
fn simulations_take_at_most_their_steps_and_owe_the_rest() {
    let gas = FlameParticlesParameters { particles: 200, preroll_s: 0.2.into(), ..Default::default() };
    let mut live = Effect::new(gas.clone()).max_steps(10).size(8, 8).open().unwrap();
    let (mut asked, mut owed) = (0.0, 0.0);
    for dt in [0.016, 0.5, 0.0, 0.1, 0.033] {
        asked += dt;
        let picture = live.advance(dt + owed).unwrap();
        owed = picture.owed_s();
        assert!((picture.time_s() + owed - asked).abs() < 1e-9);
    }
    assert!(owed > 0.1, "{owed}");
    for _ in 0..10 {
        owed = live.advance(owed).unwrap().owed_s();
    }
    assert_eq!(owed, 0.0);
    // What was simulated in pieces is what is simulated at once.
    let mut at_once = Effect::new(gas).size(8, 8).open().unwrap();
    at_once.at(live.time()).unwrap();
    assert_eq!(at_once.particles(), live.particles());
}

#[test]
fn the_preroll_can_be_done_in_pieces() {
    let gas = FlameParticlesParameters { particles: 200, preroll_s: 1.0.into(), ..Default::default() };
    let mut pieces = Effect::new(gas.clone()).preroll_in_pieces().size(8, 8).open().unwrap();
    assert!(matches!(pieces.advance(0.1), Err(EffectError::Preroll { .. })));
    let mut calls = 0;
    while pieces.preroll(7).unwrap() > 0 {
        calls += 1;
    }
    assert!(calls > 3);
    let mut at_once = Effect::new(gas).size(8, 8).open().unwrap();
    assert_eq!(pieces.advance(0.3).unwrap().frame().beauty, at_once.advance(0.3).unwrap().frame().beauty);
    // A restart is an opening.
    pieces.restart().unwrap();
    assert_eq!(pieces.time(), 0.0);
    let again = pieces.at(at_once.time()).unwrap().frame().beauty.clone();
    assert_eq!(again, at_once.picture().unwrap().frame().beauty);
    at_once.reseed(9).unwrap();
    assert_eq!(at_once.particles(), pieces.particles(), "the state stays");
    at_once.advance(1.0).unwrap();
    pieces.advance(1.0).unwrap();
    assert_ne!(at_once.picture().unwrap().frame().beauty, pieces.picture().unwrap().frame().beauty);
}

#[test]
fn closed_forms_go_backward_and_simulations_say_that_they_cannot() {
    let mut live = Effect::new(torch()).size(SIZE, SIZE).open().unwrap();
    let early = live.at(3.0).unwrap().frame().beauty.clone();
    live.at(50.0).unwrap();
    assert_eq!(live.at(3.0).unwrap().frame().beauty, early);
    assert_eq!(live.advance(-1.0).unwrap().time_s(), 2.0);
    let gas = FlameParticlesParameters { particles: 200, preroll_s: 0.2.into(), ..Default::default() };
    let mut live = Effect::new(gas).size(8, 8).open().unwrap();
    live.at(1.0).unwrap();
    assert!(matches!(live.at(0.5), Err(EffectError::Backward { .. })));
    let error = live.advance(-0.1).map(|_| ()).unwrap_err();
    assert_eq!(error.to_string(), "dt: -0.1 s is out of range; allowed: 0 to 86400 s");
}

#[test]
fn bad_input_is_an_error_that_names_the_field_and_leaves_everything_as_it_was() {
    let says = |result: Result<(), EffectError>, text: &str| {
        let message = result.unwrap_err().to_string();
        assert!(message.contains(text), "{message} does not contain {text}");
    };
    let opened = |effect: Effect| effect.open().map(|_| ());
    says(
        opened(Effect::new(FlameSheetParameters { width: f64::NAN, ..torch() })),
        "flame_sheet.0.width: NaN is out of range; allowed: 0.001 to 1000 m",
    );
    says(
        opened(Effect::new(FlameSheetParameters { height: -1.0, ..torch() })),
        "flame_sheet.0.height: -1 is out of range",
    );
    says(
        opened(Effect::new(torch()).size(0, 0)),
        "0 x 0 pixels: this size is not possible; allowed: 1 to 16384 on a side",
    );
    says(opened(Effect::new(torch()).exposure_ev100(f64::NAN)), "picture.exposure_ev100: NaN");
    says(opened(Effect::new(torch()).shutter(-1.0)), "camera.shutter_s: -1 is out of range");
    says(opened(Effect::new(torch()).with("flame_sheet", torch())), "the name \"flame_sheet\" is taken");
    says(opened(Effect::new(torch()).looping(f64::INFINITY)), "loop of inf s");

    let mut live = Effect::new(torch()).size(SIZE, SIZE).open().unwrap();
    live.set_wind([1.0, 0.0, 0.0], 0.3).unwrap();
    let mut same = Effect::new(torch()).size(SIZE, SIZE).open().unwrap();
    same.set_wind([1.0, 0.0, 0.0], 0.3).unwrap();
    says(live.set_wind([f64::NAN, 0.0, 0.0], 0.3), "wind.velocity: NaN is out of range; allowed: -100 to 100 m/s");
    says(live.set_wind([1.0, 0.0, 0.0], 3.0), "wind.gust: 3 is out of range; allowed: 0 to 2");
    says(live.set_parameters("torch", torch()), "no phenomenon `torch`; allowed: flame_sheet");
    says(
        live.set_parameters("flame_sheet", RainParameters::default()),
        "`flame_sheet` is a flame_sheet; its parameters cannot be those of a rain",
    );
    says(
        live.set_parameters("flame_sheet", FlameSheetParameters { width: f64::NAN, ..torch() }),
        "flame_sheet.width: NaN",
    );
    says(live.move_to("flame_sheet", [0.0, f64::INFINITY, 0.0], 1.0), "position: inf is out of range");
    says(live.set_flow("flame_sheet", 1.5), "flow: 1.5 is out of range; allowed: 0 to 1");
    says(live.set_exposure_ev100(1e9), "exposure_ev100");
    let camera = CameraParameters { near: f64::NAN, ..Default::default() };
    says(live.set_camera(camera), "camera.near: NaN");
    for dt in [f64::NAN, 1e9, f64::INFINITY] {
        says(live.advance(dt).map(|_| ()), "dt: ");
    }
    says(live.at(f64::NAN).map(|_| ()), "time: NaN s is out of range");
    let mut short = vec![f16::ZERO; 7];
    let error = live.picture().unwrap().write_rgba16f(&mut short).unwrap_err().to_string();
    assert!(error.contains('7') && error.contains(&(SIZE * SIZE * 4).to_string()), "{error}");
    assert_eq!(light_of(&mut live, 1.0), light_of(&mut same, 1.0), "nothing has changed");

    let mut looping = Effect::new(torch()).looping(2.0).size(8, 8).open().unwrap();
    says(looping.set_wind([1.0, 0.0, 0.0], 0.3), "seamless loop");
    let mut rain = Effect::new(RainParameters::default()).size(8, 8).open().unwrap();
    says(rain.extinguish("rain"), "`rain` is a rain, which has no gas flow to change");
}

#[test]
fn a_moved_camera_sees_what_a_scene_with_that_camera_shows() {
    let camera =
        CameraParameters { position: [1.0, 0.5, 2.0].into(), target: [0.0, 0.4, 0.0].into(), ..Default::default() };
    let mut live = Effect::new(torch()).size(SIZE, SIZE).exposure_ev100(9.0).open().unwrap();
    live.set_camera(camera.clone()).unwrap();
    let mut direct = Effect::new(torch()).camera(camera).size(SIZE, SIZE).exposure_ev100(9.0).open().unwrap();
    assert_eq!(live.at(1.0).unwrap().frame().beauty, direct.at(1.0).unwrap().frame().beauty);
}

#[test]
fn a_scene_can_be_built_and_shown() {
    let picture = PictureParameters { size: [32, 18], ..Default::default() };
    let scene = SceneBuilder::new().picture(&picture).phenomenon("torch", &torch()).build().unwrap();
    let mut live = Effect::from_scene(scene.clone()).open().unwrap();
    assert_eq!(live.advance(0.1).unwrap().size(), [32, 18]);
    // What is added to a scene is checked as what it is made of.
    let more = Effect::from_scene(scene.clone()).with("rain", RainParameters::default());
    assert_eq!(more.scene().unwrap().instances.len(), 2);
    for (name, parameters, says) in [
        ("torch", torch(), "the name \"torch\" is taken"),
        ("a.b", torch(), "cannot be a name"),
        ("second", FlameSheetParameters { width: -1.0, ..torch() }, "second.width: -1 is out of range"),
    ] {
        let message = Effect::from_scene(scene.clone()).with(name, parameters).open().unwrap_err().to_string();
        assert!(message.contains(says), "{message}");
    }
}

#[test]
fn size_lights_and_time_change_without_a_new_effect() {
    let mut live = Effect::new(torch()).size(SIZE, SIZE).open().unwrap();
    let drawn = live.at(2.0).unwrap().frame().beauty.clone();
    assert_eq!(live.advance(0.0).unwrap().frame().beauty, drawn);
    live.set_wind([0.0, 0.0, 0.0], 0.3).unwrap();
    assert_eq!((live.wind(), live.camera().shutter_s), (([0.0; 3], 0.3), None));
    live.set_size(SIZE / 2, SIZE).unwrap();
    assert_eq!(live.picture().unwrap().size(), [SIZE / 2, SIZE]);
    assert!(matches!(live.set_size(0, 5), Err(EffectError::Plan(_))));
    live.set_size(SIZE, SIZE).unwrap();
    assert_eq!(live.picture().unwrap().frame().beauty, drawn, "a wind that is what it was changes nothing");
    // The light of what is not drawn goes on.
    let intensity = |live: &LiveEffect| live.lights().iter().map(|light| light.light.intensity[0]).sum::<f32>();
    let before = intensity(&live);
    assert_eq!(live.advance_undrawn(0.4).unwrap(), 0.0);
    assert!(intensity(&live) != before && intensity(&live) > 0.2 * before);
    assert_eq!(live.time(), 2.4);

    // A lamp that moves lights the drops anew.
    let lamp =
        bansho::LightParameters { position: [0.5, 2.5, -4.0].into(), intensity: 500.0.into(), ..Default::default() };
    let open = |lamp: &bansho::LightParameters| {
        Effect::new(RainParameters::default()).light(lamp.clone()).exposure_ev100(2.0).size(SIZE, SIZE).open().unwrap()
    };
    let moved = bansho::LightParameters { position: [-0.5, 2.5, -4.0].into(), ..lamp.clone() };
    let mut live = open(&lamp);
    live.change_scene(|scene| scene.lights = vec![moved.clone()]).unwrap();
    assert_eq!(live.at(0.5).unwrap().frame().beauty, open(&moved).at(0.5).unwrap().frame().beauty);
    let wrong = live.change_scene(|scene| scene.lights[0].intensity = f64::NAN.into());
    assert!(wrong.unwrap_err().to_string().contains("light.0.intensity: NaN"));
}

#[test]
fn what_is_set_live_holds_from_the_beginning_after_a_restart_and_new_simulations_catch_up() {
    let mut live = Effect::new(torch()).size(SIZE, SIZE).open().unwrap();
    live.at(5.0).unwrap();
    live.extinguish("flame_sheet").unwrap();
    let started = live.shot().compiled().clone();
    for _ in 0..5 {
        live.advance(0.01).unwrap();
        live.extinguish("flame_sheet").unwrap();
    }
    assert!(Arc::ptr_eq(live.shot().compiled(), &started), "what is set already is not set again");
    assert_eq!(live.parameters::<FlameSheetParameters>("flame_sheet").unwrap().flow.constant(), Some(0.0));
    live.restart().unwrap();
    let frame = live.advance(1.0).unwrap().frame();
    assert!(frame.beauty.pixels().iter().all(|pixel| *pixel == [0.0; 4]));

    let gas = FlameParticlesParameters { particles: 200, preroll_s: 0.2.into(), ..Default::default() };
    let mut live = Effect::new(gas.clone()).max_steps(5).size(8, 8).open().unwrap();
    live.at(0.5).unwrap();
    // Steps of another length have no use for the state.
    live.set_parameters("flame_particles", FlameParticlesParameters { step_s: 0.01, ..gas.clone() }).unwrap();
    assert_eq!(live.advance(0.01).unwrap().time_s(), 0.51);
    assert!(live.particles().positions.len() > 50);
    live.change_scene(|scene| scene.instances.push(bansho::scene::Instance::new("second", gas.clone()))).unwrap();
    assert_eq!(live.advance(0.01).unwrap().time_s(), 0.52);
    // What is not there any more is not set again.
    live.extinguish("second").unwrap();
    live.change_scene(|scene| scene.instances.truncate(1)).unwrap();
    live.restart().unwrap();
    assert!(matches!(live.ignite("second"), Err(EffectError::UnknownName { .. })));
    live.extinguish("flame_particles").unwrap();
    live.change_scene(|scene| scene.instances.clear()).unwrap();
    live.restart().unwrap();
}

#[test]
fn a_loop_of_simulations_repeats() {
    let gas = FlameParticlesParameters { particles: 200, preroll_s: 0.2.into(), ..Default::default() };
    let mut live = Effect::new(gas).looping(1.0).size(16, 16).open().unwrap();
    let times = [0.2, 0.7, 0.95];
    let turn =
        |live: &mut LiveEffect, start: f64| times.map(|time| live.at(start + time).unwrap().frame().beauty.clone());
    let first = turn(&mut live, 0.0);
    assert_eq!(turn(&mut live, 1.0), first);
    assert_eq!(turn(&mut live, 2.0), first);
    assert_ne!(first[0], first[1]);
    live.set_flow("flame_particles", 0.5).unwrap();
    assert_ne!(turn(&mut live, 3.0), first);
    assert!(matches!(live.change_scene(|scene| scene.loop_s = Some(0.0)), Err(EffectError::FixedLoop)));
}

#[test]
fn a_shorter_exposure_does_not_stop_a_simulation() {
    let gas = FlameParticlesParameters { particles: 200, preroll_s: 0.2.into(), ..Default::default() };
    let mut live = Effect::new(gas).size(8, 8).open().unwrap();
    live.at(1.0).unwrap();
    live.set_camera(CameraParameters { shutter_s: Some(0.0), ..live.camera().clone() }).unwrap();
    for _ in 0..5 {
        live.advance(1.0 / 144.0).unwrap();
    }
    assert!((live.time() - 1.0 - 5.0 / 144.0).abs() < 1e-9);
}

#[test]
fn a_flame_that_is_ahead_of_its_time_does_not_jump_when_its_speed_changes() {
    for phase_s in [10.0, -10.0] {
        let sheet = |speed: f64| FlameSheetParameters { phase_s, speed: speed.into(), ..torch() };
        let mut live = Effect::new(sheet(1.1)).size(SIZE, SIZE).open().unwrap();
        live.at(15.0).unwrap();
        let frames: Vec<Vec<f32>> = (0..20).map(|_| light_of(&mut live, 1.0 / 60.0)).collect();
        let usual = frames.windows(2).map(|pair| movement(&pair[0], &pair[1])).fold(0.0, f64::max);
        live.set_parameters("flame_sheet", sheet(1.4)).unwrap();
        let jump = movement(&frames[19], &light_of(&mut live, 1.0 / 60.0));
        assert!(jump < 1.5 * usual && jump < 0.5, "{jump} {usual}");
    }
}

#[test]
fn a_live_wind_goes_on_after_other_random_numbers() {
    let camera =
        CameraParameters { position: [0.0, 0.6, 6.0].into(), target: [0.0, 0.6, 0.0].into(), ..Default::default() };
    let open = || Effect::new(torch()).camera(camera.clone()).size(SIZE, SIZE).open().unwrap();
    let (mut live, mut calm) = (open(), open());
    live.set_wind([4.0, 0.0, 0.0], 0.0).unwrap();
    live.at(2.0).unwrap();
    calm.at(2.0).unwrap();
    live.reseed(5).unwrap();
    calm.reseed(5).unwrap();
    let (live, calm) = (light_of(&mut live, 1.0), light_of(&mut calm, 1.0));
    assert!(center(&live) > center(&calm) + 0.5, "{} {}", center(&live), center(&calm));
}
