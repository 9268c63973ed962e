//! Rain over the view of a camera that turns.

use bevy::{camera::Exposure, core_pipeline::tonemapping::Tonemapping, prelude::*};
use bevy_bansho::{BanshoEffect, BanshoPlugin, bansho::RainParameters};

fn main() -> AppExit {
    App::new()
        .add_plugins((DefaultPlugins, BanshoPlugin))
        .insert_resource(ClearColor(Color::linear_rgb(0.005, 0.007, 0.01)))
        .add_systems(Startup, setup)
        .add_systems(Update, |time: Res<Time>, mut eye: Single<&mut Transform, With<Camera3d>>| {
            eye.rotate_y(0.1 * time.delta_secs());
        })
        .run()
}

pub(crate) fn setup(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let camera = (Camera3d::default(), Exposure { ev100: 4.0 }, Tonemapping::AcesFitted);
    let rain = BanshoEffect::rain(RainParameters { rate_mm_per_h: 20.0.into(), ..default() });
    commands.spawn((camera, rain, Transform::from_xyz(0.0, 1.7, 0.0)));
    commands.spawn((PointLight { intensity: 3000.0, ..default() }, Transform::from_xyz(1.5, 3.5, -6.0)));
    let asphalt = MeshMaterial3d(materials.add(Color::linear_rgb(0.1, 0.1, 0.1)));
    commands.spawn((Mesh3d(meshes.add(Plane3d::default().mesh().size(60.0, 60.0))), asphalt));
}
