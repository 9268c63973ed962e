//! The tasks, their pictures and lights, without a GPU.

use std::{thread, time::Duration};

use bevy::{prelude::*, time::TimeUpdateStrategy, transform::TransformPlugin};
use bevy_bansho::{
    BanshoEffect, BanshoPlugin, Wind,
    bansho::{FlameParticlesParameters, FlameSheetParameters, f16},
};

/// A program with a camera, an effect and a clock of 60 frames a second.
fn program(effect: BanshoEffect, position: Vec3) -> (App, Entity) {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, AssetPlugin::default(), TransformPlugin, BanshoPlugin));
    app.init_asset::<Image>().init_asset::<Mesh>().init_asset::<StandardMaterial>();
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs(1) / 60));
    app.world_mut().spawn((Camera3d::default(), Transform::from_xyz(0.0, 1.0, 3.0)));
    let effect = app.world_mut().spawn((effect, Transform::from_translation(position))).id();
    (app, effect)
}

fn torch() -> BanshoEffect {
    BanshoEffect::flame(FlameSheetParameters { width: 0.4, height: 0.8, ..default() }).pixels(32, 56)
}

/// Runs until `is_done`, which must become true within a minute.
fn run(app: &mut App, mut is_done: impl FnMut(&mut World) -> bool) {
    for _ in 0..60_000 {
        app.update();
        if is_done(app.world_mut()) {
            return;
        }
        thread::sleep(Duration::from_millis(1));
    }
    panic!("nothing happens");
}

fn effect(world: &World, entity: Entity) -> &BanshoEffect {
    world.get(entity).unwrap()
}

fn light(world: &mut World) -> (PointLight, Vec3) {
    let (light, transform) = world.query::<(&PointLight, &GlobalTransform)>().single(world).unwrap();
    (*light, transform.translation())
}

#[test]
fn a_flame_follows_the_time_and_lights_its_place() {
    let position = Vec3::new(2.0, 0.5, -1.0);
    let (mut app, entity) = program(torch(), position);
    run(&mut app, |world| effect(world, entity).time_s() >= 0.5);
    let passed_s = app.world().resource::<Time>().elapsed_secs_f64();
    assert!(effect(app.world(), entity).time_s() <= passed_s);
    let (light, place) = light(app.world_mut());
    assert!(light.intensity > 100.0 && place.distance(position) < 0.8, "{light:?} {place}");
    let color = light.color.to_linear();
    assert!(color.red == 1.0 && color.green < 0.6 && color.blue < color.green, "{color:?}");
    // Without a renderer the pixels stay where they are.
    let image = effect(app.world(), entity).image().unwrap();
    let data = app.world().resource::<Assets<Image>>().get(image).unwrap().data.as_ref().unwrap();
    assert_eq!(data.len(), 32 * 56 * 8);
    assert!(data.as_chunks::<2>().0.iter().any(|bytes| f16::from_ne_bytes(*bytes) > f16::ONE));
}

#[test]
fn changes_are_made_and_errors_of_changes_leave_the_flame_burning() {
    let (mut app, entity) = program(torch(), Vec3::ZERO);
    run(&mut app, |world| effect(world, entity).is_shown());
    let mut flame = app.world_mut().get_mut::<BanshoEffect>(entity).unwrap();
    flame.change(|live| live.extinguish("no such flame"));
    let time_s = flame.time_s();
    run(&mut app, |world| effect(world, entity).time_s() > time_s + 0.5);
    assert!(!effect(app.world(), entity).has_failed() && light(app.world_mut()).0.intensity > 100.0);
    app.world_mut().get_mut::<BanshoEffect>(entity).unwrap().change(|live| live.extinguish("flame_sheet"));
    run(&mut app, |world| light(world).0.intensity == 0.0);
}

#[test]
fn an_impossible_effect_fails_without_a_panic() {
    let impossible = FlameSheetParameters { width: f64::NAN, ..default() };
    let (mut app, entity) = program(BanshoEffect::flame(impossible), Vec3::ZERO);
    run(&mut app, |world| effect(world, entity).has_failed());
    assert!(!effect(app.world(), entity).is_shown());
}

#[test]
fn wind_out_of_range_is_refused_and_the_flame_goes_on() {
    let (mut app, entity) = program(torch(), Vec3::ZERO);
    run(&mut app, |world| effect(world, entity).is_shown());
    app.insert_resource(Wind { velocity: Vec3::X * 1000.0, gust: f32::NAN });
    let time_s = effect(app.world(), entity).time_s();
    run(&mut app, |world| effect(world, entity).time_s() > time_s + 0.2);
}

#[test]
fn while_time_stands_still_the_picture_does_too() {
    let (mut app, entity) = program(torch(), Vec3::ZERO);
    run(&mut app, |world| effect(world, entity).is_shown());
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::ZERO));
    for _ in 0..50 {
        app.update();
        thread::sleep(Duration::from_millis(2));
    }
    let time_s = effect(app.world(), entity).time_s();
    let passed_s = app.world().resource::<Time>().elapsed_secs_f64();
    for _ in 0..20 {
        app.update();
    }
    assert_eq!(effect(app.world(), entity).time_s(), time_s);
    assert!(time_s <= passed_s);
}

#[test]
fn a_simulated_flame_runs_its_preroll_first_and_can_be_despawned_at_any_time() {
    let gas = FlameParticlesParameters { particles: 200, preroll_s: 1.0.into(), ..default() };
    let flame = || {
        let gas = bevy_bansho::bansho::Effect::new(gas.clone());
        BanshoEffect::billboard(gas, Rect::new(-1.0, 0.0, 1.0, 2.0)).pixels(32, 32)
    };
    let (mut app, entity) = program(flame(), Vec3::ZERO);
    run(&mut app, |world| effect(world, entity).time_s() > 0.2);
    app.world_mut().despawn(entity);
    for updates in 0..8 {
        let entity = app.world_mut().spawn(flame()).id();
        for _ in 0..updates {
            app.update();
            thread::sleep(Duration::from_millis(1));
        }
        app.world_mut().despawn(entity);
    }
    app.update();
    assert_eq!(app.world_mut().query::<&Mesh3d>().iter(app.world()).count(), 0);
}
