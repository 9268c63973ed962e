//! An aurora over hills, seen toward the north.

use bevy::{core_pipeline::tonemapping::Tonemapping, prelude::*};
use bevy_bansho::{BanshoEffect, BanshoPlugin, bansho::AuroraParameters};

fn main() -> AppExit {
    App::new()
        .add_plugins((DefaultPlugins, BanshoPlugin))
        .insert_resource(ClearColor(Color::linear_rgb(0.002, 0.003, 0.006)))
        .add_systems(Startup, setup)
        .run()
}

pub(crate) fn setup(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let projection = Projection::from(PerspectiveProjection { fov: 1.2, ..default() });
    let eye = Transform::from_xyz(0.0, 1.7, 0.0).looking_to(Vec3::new(0.0, 0.55, -1.0), Vec3::Y);
    commands.spawn((Camera3d::default(), projection, Tonemapping::AcesFitted, eye));
    commands.spawn(BanshoEffect::aurora(AuroraParameters::default()));

    let black = MeshMaterial3d(materials.add(Color::BLACK));
    for (x, height) in [(-60.0, 18.0), (10.0, 12.0), (70.0, 25.0)] {
        let hill = Mesh3d(meshes.add(Cone::new(70.0, height)));
        commands.spawn((hill, black.clone(), Transform::from_xyz(x, 0.5 * height, -120.0)));
    }
}
