//! What an effect is made of, and what bad input gets.

use bansho::{
    CameraParameters, Effect, EffectError, FlameSheetParameters, PictureParameters, RainParameters, SceneBuilder,
    WindParameters, f16,
};

use super::{SIZE, light_of, torch};

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
    says(opened(Effect::new(torch()).size(0, 0)), "a picture of 0 x 0 pixels; allowed: 1 to 16384 on a side");
    says(opened(Effect::new(torch()).exposure_ev100(f64::NAN)), "picture.exposure_ev100: NaN");
    says(opened(Effect::new(torch()).shutter(-1.0)), "camera.shutter_s: -1 is out of range");
    says(
        opened(Effect::new(torch()).with("flame_sheet", torch())),
        "another phenomenon is already called \"flame_sheet\"",
    );
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
fn a_scene_can_be_built_and_shown() {
    let picture = PictureParameters { size: [32, 18], ..Default::default() };
    let scene = SceneBuilder::new().picture(&picture).phenomenon("torch", &torch()).build().unwrap();
    let mut live = Effect::from_scene(scene.clone()).open().unwrap();
    assert_eq!(live.advance(0.1).unwrap().size(), [32, 18]);
    // What is added to a scene is checked as what it is made of.
    let more = Effect::from_scene(scene.clone()).with("rain", RainParameters::default());
    assert_eq!(more.scene().unwrap().instances.len(), 2);
    for (name, parameters, says) in [
        ("torch", torch(), "another phenomenon is already called \"torch\""),
        ("a.b", torch(), "cannot be a name"),
        ("second", FlameSheetParameters { width: -1.0, ..torch() }, "second.width: -1 is out of range"),
    ] {
        let message = Effect::from_scene(scene.clone()).with(name, parameters).open().unwrap_err().to_string();
        assert!(message.contains(says), "{message}");
    }
}
