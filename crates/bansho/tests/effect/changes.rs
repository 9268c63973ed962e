//! Parameters, camera, lights and size that change while an effect runs.

use std::sync::Arc;

use bansho::{
    CameraParameters, Effect, EffectError, FlameParticlesParameters, FlameSheetParameters, LiveEffect, RainParameters,
};

use super::{SIZE, center, light_of, movement, torch};

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
        live.advance(1.5).unwrap();
        // The mean of half a second, since flames flicker.
        let relit = series(&mut live, 30).iter().sum::<f64>() / 30.0;
        assert!(relit > 0.3 * full, "{name}: {relit} of {full}");
        let lit = light_of(&mut live, 1.0 / 60.0);
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
fn a_moved_camera_sees_what_a_scene_with_that_camera_shows() {
    let camera =
        CameraParameters { position: [1.0, 0.5, 2.0].into(), target: [0.0, 0.4, 0.0].into(), ..Default::default() };
    let mut live = Effect::new(torch()).size(SIZE, SIZE).exposure_ev100(9.0).open().unwrap();
    live.set_camera(camera.clone()).unwrap();
    let mut direct = Effect::new(torch()).camera(camera).size(SIZE, SIZE).exposure_ev100(9.0).open().unwrap();
    assert_eq!(live.at(1.0).unwrap().frame().beauty, direct.at(1.0).unwrap().frame().beauty);
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
    live.change_scene(|scene| scene.tables.set_all([moved.clone()])).unwrap();
    assert_eq!(live.at(0.5).unwrap().frame().beauty, open(&moved).at(0.5).unwrap().frame().beauty);
    let wrong = live.change_scene(|scene| {
        scene.tables.change_all(|light: &mut bansho::LightParameters| light.intensity = f64::NAN.into());
    });
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
