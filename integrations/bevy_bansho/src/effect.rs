//! The component: an effect, and where it is shown.

use std::time::Duration;

use bansho::{
    AuroraParameters, CameraParameters, Effect, EffectError, FlameSheetParameters, LiveEffect, RainParameters,
    base::camera::Lens,
};
use bevy::prelude::*;

use crate::{
    light::PlacedLight,
    task::EffectTask,
    view::{Placed, View},
};

/// Exposure value with which the picture of an effect is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EffectExposure {
    /// That of Bevy's camera (`Exposure`), so that the picture agrees with the light that Bevy's surfaces reflect.
    Camera,
    /// That of the effect: [`Effect::exposure_ev100`], or one that suits its luminance when it is opened.
    Effect,
}

/// Where an effect is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Placement {
    /// On a quad that faces the camera. The rectangle is the part that is shown of the plane through the entity's position, m.
    Billboard(Rect),
    /// Over the whole view of the camera that the component belongs to.
    Overlay,
    /// All around, behind everything else.
    Sky,
}

/// An effect in the scene: a flame at the entity's position, rain over the view of a camera, or an aurora in the sky.
///
/// The plugin adds child entities: a mesh with the picture, and for flames a [`PointLight`].
#[derive(Component)]
#[require(Transform, Visibility)]
pub struct BanshoEffect {
    pub(crate) placement: Placement,
    pub(crate) pixels: UVec2,
    pub(crate) exposure: EffectExposure,
    pub(crate) point_light: Option<PointLight>,
    pub(crate) task: EffectTask,
    pub(crate) children: Option<EffectChildren>,
    /// `None` before the first picture.
    pub(crate) shown: Option<Shown>,
    /// Where the children belong in this frame.
    pub(crate) placed: Option<Placed>,
    /// Position of the entity in the frame before, m.
    pub(crate) last_position: Option<Vec3>,
    pub(crate) time_s: f64,
    pub(crate) drawing_time: Duration,
}

/// The picture that is shown.
#[derive(Clone, Copy)]
pub(crate) struct Shown {
    /// The view for which it was drawn.
    pub(crate) view: View,
    /// The light of the effect, if it shines.
    pub(crate) light: Option<PlacedLight>,
}

/// Child entities of an effect.
#[derive(Clone)]
pub(crate) struct EffectChildren {
    /// The mesh with the picture.
    pub(crate) surface: Entity,
    /// The light, if it has one.
    pub(crate) light: Option<Entity>,
    /// The picture.
    pub(crate) image: Handle<Image>,
}

impl BanshoEffect {
    /// An effect whose origin is at the position of the entity, for example a flame. The picture shows the rectangle `meters` of an upright plane through that
    /// position, which turns toward the camera; x is to the right and y up. It is 256 pixels high unless [set](Self::pixels). Rotation and scale
    /// of the entity have no influence.
    pub fn billboard(effect: Effect, meters: Rect) -> Self {
        let height = 256.0;
        let width = (height * meters.width() / meters.height()).clamp(16.0, 1024.0).round();
        let light = Some(PointLight::default());
        Self { point_light: light, ..Self::new(effect, Placement::Billboard(meters), [width as u32, height as u32]) }
    }

    /// A flame on a sheet. Its billboard has room to lean and for the first sparks; smoke needs a larger one, see [`billboard`](Self::billboard).
    pub fn flame(parameters: FlameSheetParameters) -> Self {
        let (width, height) = (parameters.width as f32, parameters.height as f32);
        let meters = Rect::new(-width, -0.15 * height, width, 1.6 * height);
        Self::billboard(Effect::new(parameters), meters)
    }

    /// An effect over the whole view of a camera, for example rain. Nothing of the scene is in front of it. The component must be on the entity of a perspective camera. The picture is 640 x 360
    /// pixels unless [set](Self::pixels); it should have the aspect ratio of the view, of which it otherwise shows more.
    pub fn overlay(effect: Effect) -> Self {
        Self { exposure: EffectExposure::Effect, ..Self::new(effect, Placement::Overlay, [640, 360]) }
    }

    /// Rain over the whole view of a camera, see [`overlay`](Self::overlay). The drops are lit by an overcast night sky and street lamps, which are not drawn;
    /// for other light make an [`Effect`] with `sky` and `light`.
    pub fn rain(parameters: RainParameters) -> Self {
        Self::overlay(Effect::new(parameters))
    }

    /// An effect all around, for example an aurora, as seen from the origin. It adds to the clear color or the [`Skybox`](bevy::light::Skybox). The picture is a
    /// panorama of 1024 x 512 pixels unless [set](Self::pixels). North is at -z.
    pub fn sky(effect: Effect) -> Self {
        let mut camera = CameraParameters { lens: Lens::Panorama, ..CameraParameters::default() };
        camera.look_up();
        Self { exposure: EffectExposure::Effect, ..Self::new(effect.camera(camera), Placement::Sky, [1024, 512]) }
    }

    /// An aurora in the sky, see [`sky`](Self::sky).
    pub fn aurora(parameters: AuroraParameters) -> Self {
        Self::sky(Effect::new(parameters))
    }

    fn new(effect: Effect, placement: Placement, pixels: [u32; 2]) -> Self {
        Self {
            placement,
            pixels: UVec2::from(pixels),
            exposure: EffectExposure::Camera,
            point_light: None,
            task: EffectTask::new(effect),
            children: None,
            shown: None,
            placed: None,
            last_position: None,
            time_s: 0.0,
            drawing_time: Duration::ZERO,
        }
    }

    /// Width and height of the picture, pixels. It cannot change after the component was added to an entity.
    #[must_use]
    pub fn pixels(self, width: u32, height: u32) -> Self {
        Self { pixels: UVec2::new(width, height).max(UVec2::ONE), ..self }
    }

    /// Exposure of the picture. By default billboards have that of the camera, since they also light the scene; rain and skies have their own.
    #[must_use]
    pub fn exposure(self, exposure: EffectExposure) -> Self {
        Self { exposure, ..self }
    }

    /// The light of a billboard: `None` for none, otherwise the settings of its shadows. Color, intensity, radius and range are those of the flame at every
    /// time.
    #[must_use]
    pub fn point_light(self, point_light: Option<PointLight>) -> Self {
        Self { point_light, ..self }
    }

    /// Changes the effect before its next picture, for example `effect.change(|live| live.extinguish("flame_sheet"))`. Changes are made in the order of
    /// these calls. An error is logged and changes nothing.
    pub fn change(&mut self, change: impl FnOnce(&mut LiveEffect) -> Result<(), EffectError> + Send + Sync + 'static) {
        self.task.push_change(Box::new(change));
    }

    /// Time of the picture that is shown, s since the effect was opened.
    pub fn time_s(&self) -> f64 {
        self.time_s
    }

    /// How long the task took for the picture that is shown.
    pub fn drawing_time(&self) -> Duration {
        self.drawing_time
    }

    /// The picture, premultiplied linear sRGB in half floats; `None` before the plugin has seen the component.
    pub fn image(&self) -> Option<&Handle<Image>> {
        self.children.as_ref().map(|children| &children.image)
    }

    /// Whether the effect could not be opened or drawn. The error was logged.
    pub fn has_failed(&self) -> bool {
        self.task.has_failed()
    }

    /// Whether a picture is shown.
    pub fn is_shown(&self) -> bool {
        self.shown.is_some()
    }
}
