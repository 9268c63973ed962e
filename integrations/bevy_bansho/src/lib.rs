//! Bevy plugin for Bansho: fire on billboards that light the scene, rain over the view, aurora in the sky.
//!
//! Each effect is drawn on the CPU by a task in Bevy's [`AsyncComputeTaskPool`](bevy::tasks::AsyncComputeTaskPool), into a half-float texture with
//! premultiplied alpha. No frame of the program waits for it: the picture that is shown was started in an earlier frame, as a rule the one before.
//!
//! ```no_run
//! use bevy::prelude::*;
//! use bevy_bansho::{BanshoEffect, BanshoPlugin, bansho::FlameSheetParameters};
//!
//! fn main() {
//!     App::new().add_plugins((DefaultPlugins, BanshoPlugin)).add_systems(Startup, setup).run();
//! }
//!
//! fn setup(mut commands: Commands) {
//!     commands.spawn((Camera3d::default(), Transform::from_xyz(0.0, 1.0, 3.0)));
//!     commands.spawn(BanshoEffect::flame(FlameSheetParameters { width: 0.4, height: 0.8, ..default() }));
//! }
//! ```
//!
//! Units are those of both libraries: meters, seconds, cd/m^2, lumens, with y up. Data flow: [`BanshoEffect`] -> task with `bansho::LiveEffect` -> pixels and
//! lights -> `Image`, `Transform` and `PointLight` of two child entities.

mod effect;
mod light;
mod sky;
mod systems;
mod task;
mod view;

pub use bansho;
pub use effect::{BanshoEffect, EffectExposure};
pub use view::EffectCamera;

use bevy::{camera::CameraUpdateSystems, prelude::*, transform::TransformSystems};

/// Draws every [`BanshoEffect`]. Add it after `DefaultPlugins`.
pub struct BanshoPlugin;

impl Plugin for BanshoPlugin {
    fn build(&self, app: &mut App) {
        let all = (systems::spawn_children, systems::draw, systems::place).chain();
        app.add_systems(PostUpdate, all.after(CameraUpdateSystems).before(TransformSystems::Propagate));
    }
}

/// Wind of all effects. Effects follow changes within 0.25 s. Without this resource each effect has the wind of its own description.
#[derive(Clone, Copy, Debug, PartialEq, Resource)]
pub struct Wind {
    /// Mean velocity in world coordinates, m/s; at most 100 along each axis.
    pub velocity: Vec3,
    /// Turbulence intensity: standard deviation of the speed divided by the mean speed, 0 to 2.
    pub gust: f32,
}

impl Default for Wind {
    /// Still air.
    fn default() -> Self {
        Self { velocity: Vec3::ZERO, gust: 0.3 }
    }
}
