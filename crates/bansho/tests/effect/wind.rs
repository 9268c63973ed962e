//! Live wind: nothing jumps, and it acts.

use bansho::{
    Animated, CameraParameters, Effect, FlameParticlesParameters, FlameSheetParameters, LiveEffect, RainParameters,
    WindParameters,
};

use super::{SIZE, center, game_wind, light_of, movement, torch};

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
fn a_little_more_wind_after_a_minute_moves_a_frame_no_more_than_usual() {
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

#[test]
fn a_live_wind_stays_when_the_gusts_of_the_scene_are_edited() {
    let mut live = Effect::new(torch()).size(8, 8).open().unwrap();
    live.set_wind([5.0, 0.0, 0.0], 0.4).unwrap();
    live.at(1.0).unwrap();
    live.change_scene(|scene| scene.wind.gust_length = 3.0).unwrap();
    live.at(2.0).unwrap();
    assert_eq!(live.wind(), ([5.0, 0.0, 0.0], 0.4));
}
