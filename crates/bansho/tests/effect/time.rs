//! Time: that of the caller, steps, preroll, loops.

use std::sync::Arc;

use bansho::{
    CameraParameters, Effect, EffectError, FlameParticlesParameters, LiveEffect, Plan, PlanOptions, Shot, Unobserved,
    compile_scene,
};

use super::{SIZE, assert_send_and_sync, torch};

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
        let compiled = compile_scene("scene", &text, Arc::new(bansho::MemoryAssets::default())).unwrap();
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
