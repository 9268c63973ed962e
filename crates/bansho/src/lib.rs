//! Fire, rain and aurora for pictures, as a library.
//!
//! An [`Effect`] is made of plain structs of parameters. Opened, it follows the time of the program and writes its pictures into the program's buffers,
//! and the program may change the wind, the camera and the parameters at any time:
//!
//! ```
//! use bansho::{Effect, FlameSheetParameters, f16};
//!
//! let mut torch = Effect::new(FlameSheetParameters::default()).size(64, 64).open()?;
//! let mut texture = vec![f16::ZERO; 64 * 64 * 4];
//! for frame in 0..3 {
//!     torch.set_wind([0.5, 0.0, 0.1 * f64::from(frame)], 0.8)?; // m/s, turbulence intensity
//!     torch.advance(1.0 / 60.0)?.write_rgba16f(&mut texture)?; // premultiplied linear sRGB
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! An aurora as an image, with the stars behind it:
//!
//! ```
//! use bansho::{AlphaConvention, AlphaMode, AuroraParameters, Effect, View};
//!
//! let mut aurora = Effect::new(AuroraParameters::default()).backdrop(true).size(64, 36).open()?;
//! let mut pixels = vec![0; 64 * 36 * 4];
//! aurora.at(2.0)?.write_rgba8(&View::DISPLAY, AlphaMode::Straight(AlphaConvention::Encoded), &mut pixels)?;
//! assert!(pixels.iter().any(|code| *code > 100)); // sRGB codes and straight alpha, as PNG has them, row after row from the top
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # From a scene file to frames
//!
//! A scene is text in TOML or made by a [`SceneBuilder`]. A [`CompiledScene`] builds its phenomena once, a [`Plan`] fixes size, exposure and
//! loop of the shot, and the [`Shot`] draws frames to memory. The library does not print, read the clock, or create threads: work runs in the
//! caller's rayon pool, or on the caller's thread alone, and reports to the caller's [`Observer`].
//!
//! ```
//! use std::sync::Arc;
//! use bansho::{MemoryAssets, Plan, PlanOptions, Shot, Unobserved, compile_scene};
//!
//! let text = "bansho = 2\n[picture]\nsize = [64, 36]\n";
//! let compiled = compile_scene("fire", text, Arc::new(MemoryAssets::default()))?;
//! let plan = Plan::new(&compiled, &PlanOptions::default())?;
//! let mut shot = Shot::open(compiled, Arc::new(plan));
//! let frame = bansho::draw(&mut shot, 0, &Unobserved)?;
//! assert_eq!((frame.beauty.width(), frame.beauty.height()), (64, 36));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # What is where
//!
//! | looked for | found in |
//! | --- | --- |
//! | parameters of a phenomenon | [`FlameSheetParameters`], [`FlameParticlesParameters`], [`FlameVolumeParameters`], [`RainParameters`], [`AuroraParameters`]; their tables in [`fire`], [`rain`], [`aurora`] |
//! | camera, wind, air, sky, ground, lamps, obstacles, fog | [`CameraParameters`], [`WindParameters`], [`Air`], [`SkyParameters`], [`GroundParameters`], [`LightParameters`], [`ObstacleParameters`], [`FogParameters`] |
//! | values that change over time | [`Animated`] |
//! | pixels, depth, AOVs | [`Picture`]; for whole frames [`write_rgba16f`] and similar functions |
//! | light for other objects, particles, drops | [`LiveEffect::lights`], [`LiveEffect::particles`] |
//! | statistics of pictures of flames | [`flame_statistics`] |
//! | streak textures of any drop | [`rain::billboards::texture::StreakCube`] |
//! | smoothed-particle hydrodynamics alone | [`sph`] |
//! | a phenomenon of your own | [`base::phenomenon`] |
//!
//! # Data
//!
//! A shot also gives what is in a frame as data: [`Shot::particles`] the gas of particle flames, the electrons of auroras and the drops of rain,
//! [`Shot::lights`] the lights of flames and auroras. Positions are in m, y up; velocities in m/s. Each further attribute of a particle is a
//! [`Quantity`](base::geometry::point_cloud::Quantity), whose [`name`](base::geometry::point_cloud::Quantity::name) is also that in PLY files:
//!
//! | name | unit | of | what |
//! |---|---|---|---|
//! | `temperature` | K | `flame_particles` | of the gas |
//! | `density` | kg/m^3 | `flame_particles` | of the gas |
//! | `energy` | eV | `aurora` | of each electron that a particle represents |
//! | `power` | W | `aurora` | that the particle deposits in the atmosphere |
//! | `diameter_mm` | mm | `rain` | of the drop |
//! | `opacity` | 1 | `rain` | of the streak of the drop, on its axis |
//!
//! ```
//! # #[cfg(all(feature = "fire", feature = "rain"))] {
//! use std::sync::Arc;
//! use bansho::{MemoryAssets, Plan, PlanOptions, Shot, Unobserved, base::geometry::point_cloud::Quantity, compile_scene};
//!
//! let text = "bansho = 2\n[picture]\nsize = [64, 36]\n[[flame_particles]]\nparticles = 60\npreroll_s = 0.2\n[[rain]]\n";
//! let compiled = compile_scene("data", text, Arc::new(MemoryAssets::default()))?;
//! let plan = Plan::new(&compiled, &PlanOptions::default())?;
//! let mut shot = Shot::open(compiled, Arc::new(plan));
//! shot.advance(5, &Unobserved)?; // simulates; nothing is drawn
//!
//! let points = shot.particles();
//! assert_eq!((points.positions.len(), points.velocities.len()), (points.len(), points.len()));
//! for (quantity, values) in &points.quantities {
//!     println!("{} in {}: {} values", quantity.name(), quantity.unit(), values.len());
//! }
//! // A quantity is 0 for particles that lack it: drops have no temperature.
//! let hottest = points.quantities[&Quantity::Temperature].iter().copied().fold(0.0, f32::max);
//! assert!(hottest > 600.0);
//!
//! // The particles of one phenomenon, by its name in the scene.
//! let clouds = shot.point_clouds();
//! let (_, drops) = clouds.iter().find(|(name, _)| name == "rain").expect("it rains");
//! assert!(drops.quantities[&Quantity::DiameterMm].iter().all(|diameter| (1.0..=2.0).contains(diameter)));
//!
//! // Lights for a renderer of your own: position, linear sRGB and candela.
//! for light in shot.lights() {
//!     let (position, srgb) = (light.light.emitter.position(), light.light.srgb());
//!     println!("{}: {position:?}, {:?} times {} cd", light.phenomenon, srgb.color, srgb.intensity);
//! }
//! # }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Every drop with its path and weight: [`rain::Rain::drops`]. Textures of streaks: [`rain::billboards::texture`].
//!
//! # Features
//!
//! The feature `files` (on by default) adds the module `job`: from a scene file to pictures on disk, like the program `bansho render`. It enables
//! `rayon`.
//!
//! The feature `rayon` (on by default) divides work among the threads of the rayon pool whose `ThreadPool::install` calls the library; outside of
//! any, of rayon's global pool, which rayon starts when it is first used. Without this feature all work runs on the caller's thread, for programs
//! that have a job system of their own, such as games. The bytes are the same (see [`base::host::parallel`]).
//!
//! The features `fire`, `rain` and `aurora` (all on by default) enable the kinds of phenomena. A scene with a kind whose feature is disabled is
//! refused with an error that names the feature.

use std::sync::Arc;

pub mod effect;
pub mod flame_statistics;
#[cfg(feature = "files")]
pub mod job;
mod kinds;
mod scene_builder;

#[cfg(feature = "aurora")]
#[doc(inline)]
pub use bansho_aurora as aurora;
#[doc(inline)]
pub use bansho_base as base;
#[doc(inline)]
pub use bansho_environment as environment;
#[cfg(feature = "fire")]
#[doc(inline)]
pub use bansho_fire as fire;
#[cfg(feature = "files")]
#[doc(inline)]
pub use bansho_media as media;
#[cfg(feature = "rain")]
#[doc(inline)]
pub use bansho_rain as rain;
#[doc(inline)]
pub use bansho_render as render;
#[doc(inline)]
pub use bansho_scene as scene;
#[cfg(any(feature = "aurora", feature = "fire"))]
#[doc(inline)]
pub use bansho_sph as sph;

#[cfg(feature = "aurora")]
#[doc(inline)]
pub use bansho_aurora::AuroraParameters;
#[doc(inline)]
pub use bansho_base::{
    camera::CameraParameters,
    color::{AlphaConvention, AlphaMode, ColorSpace, View, ViewName},
    frame::{DisplayImage, Frame},
    geometry::point_cloud::PointCloud,
    host::{
        assets::{Assets, MemoryAssets},
        observer::{Cancelled, Observer, Stage, StagePart, Unobserved},
    },
    image::{Image, Rect},
    parameters::animated::Animated,
    phenomenon::surroundings::{Emitter, Light, SrgbLight},
    world::{air::Air, wind::WindParameters},
};
#[doc(inline)]
pub use bansho_environment::{
    fog::FogParameters, ground::GroundParameters, lamps::LightParameters, sky::SkyParameters,
    solids::ObstacleParameters,
};
#[cfg(feature = "fire")]
#[doc(inline)]
pub use bansho_fire::{
    particles::FlameParticlesParameters, sheet::FlameSheetParameters, volume::FlameVolumeParameters,
};
#[cfg(feature = "rain")]
#[doc(inline)]
pub use bansho_rain::RainParameters;
#[doc(inline)]
pub use bansho_render::{
    BufferLengthError, BuildErrors, ChannelError, CompiledScene, GlareUse, PhenomenonLight, Plan, PlanError,
    PlanOptions, RenderError, SceneLinear, Shot, Target,
    display::{BitDepth, DisplayFrame, DisplayOptions, display},
    f16, nonzero_rect, write_channel32f, write_depth32f, write_rgba8, write_rgba16f, write_rgba32f,
};
#[doc(inline)]
pub use bansho_scene::{
    LoopError, ParameterProblems, PictureParameters, PlateParameters, Scene, SceneError, SceneOptions,
};
#[doc(inline)]
pub use effect::{Effect, EffectError, LiveEffect, Picture};
pub use kinds::{KINDS, parse_scene, phenomena};
pub use scene_builder::SceneBuilder;

/// Parses a scene and builds its phenomena.
///
/// # Errors
/// All problems of the text and of the assets that it names, each with its position, what is wrong and what is allowed.
pub fn compile_scene(file: &str, text: &str, assets: Arc<dyn Assets>) -> Result<Arc<CompiledScene>, SceneError> {
    let scene = Arc::new(parse_scene(file, text)?);
    CompiledScene::build(scene, assets, None).map(Arc::new).map_err(|errors| errors.located(file, text))
}

/// Advances `shot` to frame `number` and draws it as scene-linear light. [`Shot::draw`] also draws display codes.
///
/// # Errors
/// The observer canceled the work, or a picture that the scene names cannot be read.
pub fn draw(shot: &mut Shot, number: i64, observer: &dyn Observer) -> Result<Frame, RenderError> {
    shot.advance(number, observer)?;
    shot.draw(&SceneLinear, observer)
}
