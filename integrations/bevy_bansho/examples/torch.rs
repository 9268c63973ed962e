//! A torch in the wind, which lights the ground.

use bevy::{camera::Exposure, core_pipeline::tonemapping::Tonemapping, prelude::*};
use bevy_bansho::{BanshoEffect, BanshoPlugin, Wind, bansho::FlameSheetParameters};

fn main() -> AppExit {
    App::new()
        .add_plugins((DefaultPlugins, BanshoPlugin))
        .insert_resource(ClearColor(Color::BLACK))
        .insert_resource(GlobalAmbientLight::NONE)
        .insert_resource(Wind { velocity: Vec3::new(0.5, 0.0, 0.0), gust: 0.8 })
        .add_systems(Startup, setup)
        .run()
}

pub(crate) fn setup(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let eye = Transform::from_xyz(0.0, 1.5, 2.8).looking_at(Vec3::Y * 0.75, Vec3::Y);
    commands.spawn((Camera3d::default(), Exposure { ev100: 5.0 }, Tonemapping::AcesFitted, eye));
    let flame = FlameSheetParameters { width: 0.35, height: 0.7, ..default() };
    commands.spawn((BanshoEffect::flame(flame), Transform::from_xyz(0.0, 0.9, 0.0)));

    let stone = MeshMaterial3d(materials.add(Color::linear_rgb(0.25, 0.22, 0.2)));
    commands.spawn((Mesh3d(meshes.add(Cylinder::new(0.06, 0.9))), stone.clone(), Transform::from_xyz(0.0, 0.45, 0.0)));
    commands.spawn((Mesh3d(meshes.add(Plane3d::default().mesh().size(12.0, 12.0))), stone));
}
