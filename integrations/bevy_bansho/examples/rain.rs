//! Rain at night, in the light of a lamp.

use bevy::{camera::Exposure, core_pipeline::tonemapping::Tonemapping, prelude::*};
use bevy_bansho::{BanshoEffect, BanshoPlugin, EffectExposure, bansho};

fn main() -> AppExit {
    App::new()
        .add_plugins((DefaultPlugins, BanshoPlugin))
        .insert_resource(ClearColor(Color::BLACK))
        .insert_resource(GlobalAmbientLight::NONE)
        .add_systems(Startup, setup)
        .run()
}

pub(crate) fn setup(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    // The same lamp for the drops and for the ground: 500 cd are 6283 lm.
    let lamp = bansho::LightParameters { position: [1.0, 2.8, -4.0].into(), intensity: 500.0.into(), ..default() };
    let light = PointLight { intensity: 6283.0, color: Color::linear_rgb(1.0, 0.9, 0.75), ..default() };
    commands.spawn((light, Transform::from_xyz(1.0, 2.8, -4.0)));
    let rain = bansho::Effect::new(bansho::RainParameters { rate_mm_per_h: 30.0.into(), ..default() }).light(lamp);
    let rain = BanshoEffect::overlay(rain).exposure(EffectExposure::Camera);
    let camera = (Camera3d::default(), Exposure { ev100: 3.0 }, Tonemapping::AcesFitted);
    commands.spawn((camera, rain, Transform::from_xyz(0.0, 1.7, 0.0)));
    let ground = Mesh3d(meshes.add(Plane3d::default().mesh().size(60.0, 60.0)));
    commands.spawn((ground, MeshMaterial3d(materials.add(Color::linear_rgb(0.1, 0.1, 0.1)))));
}
