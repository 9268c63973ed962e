//! The systems: child entities, drawing, placing.

use bevy::{
    asset::RenderAssetUsages,
    camera::{Exposure, visibility::NoFrustumCulling},
    ecs::system::SystemParam,
    image::ImageSampler,
    light::{NotShadowCaster, NotShadowReceiver},
    prelude::*,
    render::render_resource::{Extent3d, Face, TextureDimension, TextureFormat},
};

use crate::{
    BanshoEffect, EffectExposure, Wind,
    effect::{EffectChildren, Placement, Shown},
    light::PlacedLight,
    sky,
    task::{Drawn, Request},
    view::{Placed, View, ViewCamera},
};

/// Added to the distance by which Bevy sorts transparent meshes, so that skies are behind all others.
const BEHIND: f32 = -1e4;
/// Largest speed of an entity that counts as a wind in its flame, m/s; faster ones are jumps.
const MAX_SPEED: f32 = 30.0;
/// Bytes of a pixel, four half floats.
const PIXEL_BYTES: usize = 8;

/// Gives new effects their child entities.
pub(crate) fn spawn_children(
    mut commands: Commands,
    mut effects: Query<(Entity, &mut BanshoEffect), Added<BanshoEffect>>,
    mut images: ResMut<Assets<Image>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
    mut meshes: ResMut<Assets<Mesh>>,
) {
    for (entity, mut effect) in &mut effects {
        let image = images.add(empty_image(effect.pixels));
        let mesh = match effect.placement {
            Placement::Billboard(_) | Placement::Overlay => meshes.add(Rectangle::new(1.0, 1.0)),
            Placement::Sky => meshes.add(sky::sphere()),
        };
        let material = materials.add(material(image.clone(), effect.placement));
        let surface = (Mesh3d(mesh), MeshMaterial3d(material), NotShadowCaster, NotShadowReceiver, NoFrustumCulling);
        let surface = commands.spawn((surface, Visibility::Hidden, ChildOf(entity))).id();
        let dark = |light| PointLight { intensity: 0.0, ..light };
        let light = effect.point_light.map(|light| commands.spawn((dark(light), ChildOf(entity))).id());
        effect.children = Some(EffectChildren { surface, light, image });
    }
}

fn empty_image(pixels: UVec2) -> Image {
    let size = Extent3d { width: pixels.x, height: pixels.y, depth_or_array_layers: 1 };
    let data = vec![0; pixels.x as usize * pixels.y as usize * PIXEL_BYTES];
    // Each picture is moved to the render world, not copied.
    let usages = RenderAssetUsages::RENDER_WORLD;
    let mut image = Image::new(size, TextureDimension::D2, data, TextureFormat::Rgba16Float, usages);
    image.sampler = ImageSampler::linear();
    image
}

fn material(image: Handle<Image>, placement: Placement) -> StandardMaterial {
    StandardMaterial {
        base_color_texture: Some(image),
        alpha_mode: AlphaMode::Premultiplied,
        unlit: true,
        // Fog would be added to the transparent pixels too.
        fog_enabled: false,
        cull_mode: Some(Face::Back),
        depth_bias: if placement == Placement::Sky { BEHIND } else { 0.0 },
        ..default()
    }
}

/// What views are made of.
#[derive(SystemParam)]
pub(crate) struct Surroundings<'w, 's> {
    time: Res<'w, Time>,
    wind: Option<Res<'w, Wind>>,
    view_camera: ViewCamera<'w, 's>,
    own_cameras: Query<'w, 's, (&'static Projection, Option<&'static Exposure>)>,
    transforms: TransformHelper<'w, 's>,
}

/// Takes finished pictures, begins the next ones, and determines where the children of all effects belong.
pub(crate) fn draw(
    surroundings: Surroundings,
    mut effects: Query<(Entity, &mut BanshoEffect)>,
    mut images: ResMut<Assets<Image>>,
) {
    for (entity, mut effect) in &mut effects {
        // Where something is missing, such as a camera, it will be there in a later frame.
        let Ok(own) = surroundings.transforms.compute_global_transform(entity) else { continue };
        let wind = surroundings.wind_at(&mut effect, own.translation());
        let Some((view, origin, ev100)) = surroundings.view(entity, &effect, &own) else { continue };
        let exposure_ev100 = (effect.exposure == EffectExposure::Camera).then_some(ev100);
        let request = Request { view, pixels: effect.pixels, exposure_ev100, wind };
        if let Some(drawn) = effect.task.update(surroundings.time.delta_secs_f64(), request) {
            show(&mut effect, drawn, &mut images);
        }
        effect.placed = effect.shown.map(|shown| shown.placed(origin, &own));
    }
}

impl Surroundings<'_, '_> {
    /// The wind in the coordinates of an effect, which may move: a torch that is carried leans back.
    fn wind_at(&self, effect: &mut BanshoEffect, position: Vec3) -> Option<Wind> {
        let last_position = effect.last_position.replace(position).unwrap_or(position);
        let wind = self.wind.as_deref()?;
        let velocity = (position - last_position) / self.time.delta_secs();
        // A jump, or no time passed.
        let is_motion = effect.placement != Placement::Overlay && velocity.length() < MAX_SPEED;
        Some(Wind { velocity: wind.velocity - if is_motion { velocity } else { Vec3::ZERO }, ..*wind })
    }

    /// The view of an effect, the transform that its surface is relative to, and the exposure value of its camera.
    fn view(
        &self,
        entity: Entity,
        effect: &BanshoEffect,
        own: &GlobalTransform,
    ) -> Option<(View, GlobalTransform, f32)> {
        if effect.placement == Placement::Overlay {
            let Ok((Projection::Perspective(projection), exposure)) = self.own_cameras.get(entity) else {
                error_once!("an overlay must be on the entity of a perspective camera");
                return None;
            };
            let view = View::overlay(own, projection, effect.pixels.x as f32 / effect.pixels.y as f32);
            return Some((view, *own, exposure.copied().unwrap_or_default().ev100));
        }
        let (camera, ev100) = self.view_camera.get()?;
        let eye = self.transforms.compute_global_transform(camera).ok()?.translation();
        let (view, origin) = match effect.placement {
            Placement::Billboard(meters) => (View::billboard(meters, eye - own.translation()), own.translation()),
            Placement::Overlay | Placement::Sky => (View::sky(), eye),
        };
        Some((view, GlobalTransform::from_translation(origin), ev100))
    }
}

/// Shows a finished picture.
fn show(effect: &mut BanshoEffect, drawn: Drawn, images: &mut Assets<Image>) {
    let handle = effect.image().cloned();
    if let Some(mut image) = handle.and_then(|handle| images.get_mut(&handle)) {
        image.data = Some(drawn.pixels);
    }
    effect.shown = Some(Shown { view: drawn.view, light: PlacedLight::merged(&drawn.lights) });
    (effect.time_s, effect.drawing_time) = (drawn.time_s, drawn.drawing_time);
}

impl Shown {
    /// Where the children of the entity `own` belong, if the surface is relative to `origin`.
    fn placed(&self, origin: GlobalTransform, own: &GlobalTransform) -> Placed {
        let surface = origin.mul_transform(self.view.surface).reparented_to(own);
        let to_own = own.affine().inverse();
        let light = self.light.map(|light| PlacedLight {
            position: to_own.transform_point3(own.translation() + light.position),
            ..light
        });
        Placed { surface, light }
    }
}

/// Moves the children of effects to where they belong.
pub(crate) fn place(
    effects: Query<&BanshoEffect>,
    mut surfaces: Query<(&mut Transform, &mut Visibility), (With<Mesh3d>, Without<PointLight>)>,
    mut lights: Query<(&mut Transform, &mut PointLight), Without<Mesh3d>>,
) {
    for effect in &effects {
        let (Some(placed), Some(children)) = (&effect.placed, &effect.children) else { continue };
        if let Ok((mut transform, mut visibility)) = surfaces.get_mut(children.surface) {
            transform.set_if_neq(placed.surface);
            visibility.set_if_neq(Visibility::Inherited);
        }
        let Some(Ok((mut transform, mut light))) = children.light.map(|light| lights.get_mut(light)) else { continue };
        match &placed.light {
            Some(placed) => {
                transform.translation = placed.position;
                placed.set(&mut light);
            }
            None => light.intensity = 0.0,
        }
    }
}
