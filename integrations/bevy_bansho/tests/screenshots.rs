//! What Bevy shows, compared with what Bansho composes itself. Bevy renders without a window; a software Vulkan device is enough.
//! The examples are rendered too; their screenshots are in the folder `tmp` of the target directory, to be looked at.

use std::{
    sync::atomic::{AtomicBool, Ordering},
    thread,
    time::Duration,
};

use bevy::{
    camera::{Exposure, RenderTarget},
    core_pipeline::tonemapping::Tonemapping,
    log::LogPlugin,
    math::ops,
    prelude::*,
    render::{
        RenderPlugin,
        pipelined_rendering::PipelinedRenderingPlugin,
        render_resource::TextureFormat,
        view::{
            Msaa,
            screenshot::{Screenshot, ScreenshotCaptured},
        },
    },
    time::TimeUpdateStrategy,
    window::ExitCondition,
    winit::WinitPlugin,
};
use bevy_bansho::{
    BanshoEffect, BanshoPlugin, Wind,
    bansho::{
        AuroraParameters, CameraParameters, Effect, FlameSheetParameters, RainParameters, WindParameters,
        base::color::srgb_from_acescg,
    },
};

#[expect(dead_code, reason = "`main` opens a window")]
#[path = "../examples/aurora.rs"]
mod aurora;
#[expect(dead_code, reason = "`main` opens a window")]
#[path = "../examples/rain.rs"]
mod rain;
#[expect(dead_code, reason = "`main` opens a window")]
#[path = "../examples/torch.rs"]
mod torch;

/// Background of the comparisons, linear sRGB.
const BACKGROUND: [f32; 3] = [0.03, 0.06, 0.15];
/// Updates within which a screenshot must arrive.
const MAX_UPDATES: usize = 1000;

#[derive(Resource)]
struct Target(Handle<Image>);

#[derive(Default, Resource)]
struct Captured(Option<Image>);

/// A program without a window, whose camera renders to an image.
fn headless(size: UVec2) -> App {
    let mut app = App::new();
    let window = WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() };
    let render = RenderPlugin { synchronous_pipeline_compilation: true, ..default() };
    let plugins = DefaultPlugins.set(window).set(render).disable::<WinitPlugin>().disable::<PipelinedRenderingPlugin>();
    // There is one log for all tests.
    static HAS_LOG: AtomicBool = AtomicBool::new(false);
    let plugins = if HAS_LOG.swap(true, Ordering::Relaxed) { plugins.disable::<LogPlugin>() } else { plugins };
    app.add_plugins((plugins, BanshoPlugin)).init_resource::<Captured>();
    let image = Image::new_target_texture(size.x, size.y, TextureFormat::Rgba8UnormSrgb, None);
    let image = app.world_mut().resource_mut::<Assets<Image>>().add(image);
    app.insert_resource(Target(image));
    app.add_systems(
        PostStartup,
        |mut commands: Commands, target: Res<Target>, cameras: Query<Entity, With<Camera3d>>| {
            for camera in &cameras {
                commands.entity(camera).insert((RenderTarget::Image(target.0.clone().into()), Msaa::Off));
            }
        },
    );
    app
}

/// Runs it until the effect is at `seconds`, stops time there, and returns the time and what the camera sees.
fn run_until(app: &mut App, seconds: f64) -> (f64, Image) {
    while app.plugins_state() == bevy::app::PluginsState::Adding {
        thread::sleep(Duration::from_millis(1));
    }
    app.finish();
    app.cleanup();
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs_f64(1.0 / 60.0)));
    let mut effects = app.world_mut().query::<&BanshoEffect>();
    let mut times = Vec::new();
    loop {
        app.update();
        thread::sleep(Duration::from_millis(2));
        let effect = effects.single(app.world()).unwrap();
        assert!(!effect.has_failed(), "the error is in the log");
        times.push(effect.drawing_time());
        if effect.is_shown() && effect.time_s() >= seconds {
            break;
        }
    }
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::ZERO));
    let mut time_s = f64::NAN;
    let mut same = 0;
    while same < 20 {
        app.update();
        thread::sleep(Duration::from_millis(2));
        let now = effects.single(app.world()).unwrap().time_s();
        same = if now == time_s { same + 1 } else { 0 };
        time_s = now;
    }
    times.retain(|time| *time > Duration::ZERO);
    times.sort();
    println!("the task takes {:?} a picture (median of {} updates)", times[times.len() / 2], times.len());
    (time_s, capture(app))
}

fn capture(app: &mut App) -> Image {
    let target = app.world().resource::<Target>().0.clone();
    let keep = |event: On<ScreenshotCaptured>, mut captured: ResMut<Captured>| captured.0 = Some(event.image.clone());
    app.world_mut().spawn(Screenshot::image(target)).observe(keep);
    for _ in 0..MAX_UPDATES {
        app.update();
        if let Some(image) = app.world_mut().resource_mut::<Captured>().0.take() {
            return image;
        }
        thread::sleep(Duration::from_millis(2));
    }
    panic!("no screenshot in {MAX_UPDATES} updates");
}

fn save(image: &Image, name: &str) {
    let path = format!("{}/{name}.png", env!("CARGO_TARGET_TMPDIR"));
    image.clone().try_into_dynamic().unwrap().to_rgb8().save(&path).unwrap();
    println!("{path}");
}

/// Premultiplied ACEScg over the background, as display codes from 0 to 255.
fn composed(pixel: [f32; 4]) -> [f32; 3] {
    let light = srgb_from_acescg([pixel[0], pixel[1], pixel[2]]);
    std::array::from_fn(|c| {
        let value = (light[c].clamp(0.0, 1.0) + (1.0 - pixel[3]) * BACKGROUND[c]).min(1.0);
        255.0 * if value <= 0.003_130_8 { 12.92 * value } else { 1.055 * ops::powf(value, 1.0 / 2.4) - 0.055 }
    })
}

/// Largest and mean difference in codes of a screenshot from what Bansho draws. The mean is over the pixels that are not background.
fn difference(image: &Image, frame: &[[f32; 4]]) -> (f32, f32) {
    let data = image.data.as_ref().unwrap();
    assert_eq!(data.len(), 4 * frame.len());
    let (mut largest, mut sum, mut count) = (0.0_f32, 0.0, 0.0);
    for (shown, drawn) in data.as_chunks::<4>().0.iter().zip(frame) {
        let expected = composed(*drawn);
        let differences: [f32; 3] = std::array::from_fn(|c| (f32::from(shown[c]) - expected[c]).abs());
        largest = differences.into_iter().fold(largest, f32::max);
        if drawn.iter().any(|value| *value > 1e-3) {
            sum += differences.into_iter().sum::<f32>();
            count += 3.0;
        }
    }
    assert!(count > 300.0, "nothing is drawn");
    println!("largest difference {largest:.2} codes, mean {:.3} over {} pixels", sum / count, count / 3.0);
    (largest, sum / count)
}

/// A camera without any tone curve, over the background of the comparisons.
fn raw_camera(app: &mut App, fov: f32, ev100: f32, pose: Transform) -> Entity {
    let [r, g, b] = BACKGROUND;
    app.insert_resource(ClearColor(Color::linear_rgb(r, g, b)));
    let projection = Projection::from(PerspectiveProjection { fov, ..default() });
    app.world_mut().spawn((Camera3d::default(), projection, Exposure { ev100 }, Tonemapping::None, pose)).id()
}

/// The camera of an effect whose origin is at `origin`.
fn same_camera(pose: &Transform, fov: f32, origin: Vec3) -> CameraParameters {
    let position = (pose.translation - origin).as_dvec3();
    CameraParameters {
        position: position.to_array().into(),
        target: (position + pose.forward().as_dvec3()).to_array().into(),
        vertical_fov_deg: f64::from(fov).to_degrees().into(),
        ..CameraParameters::default()
    }
}

fn flame_difference(pose: Transform, origin: Vec3, fov: f32, size: UVec2, pixels: UVec2, name: &str) -> (f32, f32) {
    const EV100: f32 = 13.0;
    let sheet = FlameSheetParameters { width: 0.4, height: 0.8, ..default() };
    let mut app = headless(size);
    app.insert_resource(Wind { velocity: Vec3::new(0.5, 0.0, 0.2), gust: 0.5 });
    raw_camera(&mut app, fov, EV100, pose);
    let flame = BanshoEffect::billboard(Effect::new(sheet.clone()), Rect::new(-0.4, -0.1, 0.4, 1.1));
    app.world_mut().spawn((flame.pixels(pixels.x, pixels.y), Transform::from_translation(origin)));
    let (time_s, image) = run_until(&mut app, 0.5);
    save(&image, name);
    let wind = WindParameters { velocity: [0.5, 0.0, f64::from(0.2_f32)].into(), gust: 0.5, ..default() };
    let effect = Effect::new(sheet).wind(wind).camera(same_camera(&pose, fov, origin)).exposure_ev100(EV100.into());
    let mut live = effect.size(size.x as usize, size.y as usize).open().unwrap();
    difference(&image, live.at(time_s).unwrap().frame().beauty.pixels())
}

#[test]
#[ignore = "needs a Vulkan device"]
fn a_billboard_that_fills_the_view_is_the_picture_itself() {
    let size = UVec2::new(160, 240);
    let fov = 2.0 * ops::atan(0.2);
    let pose = Transform::from_xyz(0.0, 0.5, 3.0);
    let (largest, mean) = flame_difference(pose, Vec3::ZERO, fov, size, size, "billboard_level");
    assert!(largest <= 2.0 && mean < 0.5, "{largest} {mean}");
}

#[test]
#[ignore = "needs a Vulkan device"]
fn a_billboard_seen_from_above_is_what_bansho_draws_from_there() {
    let pose = Transform::from_xyz(0.9, 2.4, 2.6).looking_at(Vec3::new(0.4, 0.5, 0.0), Vec3::Y);
    let (origin, size) = (Vec3::new(0.3, 0.1, -0.2), UVec2::new(400, 300));
    let (largest, mean) = flame_difference(pose, origin, 0.35, size, UVec2::new(240, 360), "billboard_above");
    // Resampling of the texture; edges of tongues are one pixel wide.
    assert!(largest <= 60.0 && mean < 3.0, "{largest} {mean}");
}

#[test]
#[ignore = "needs a Vulkan device"]
fn rain_over_the_view_is_the_picture_of_its_camera() {
    let (size, fov) = (UVec2::new(320, 180), 0.8);
    let pose = Transform::from_xyz(1.0, 1.7, 3.0).looking_at(Vec3::new(0.0, 1.5, 0.0), Vec3::Y);
    let effect = || Effect::new(RainParameters::default()).exposure_ev100(4.0);
    let mut app = headless(size);
    let camera = raw_camera(&mut app, fov, 9.7, pose);
    app.world_mut().entity_mut(camera).insert(BanshoEffect::overlay(effect()).pixels(size.x, size.y));
    let (time_s, image) = run_until(&mut app, 0.2);
    save(&image, "rain_overlay");
    let effect = effect().camera(same_camera(&pose, fov, Vec3::ZERO));
    let mut live = effect.size(size.x as usize, size.y as usize).open().unwrap();
    let (largest, mean) = difference(&image, live.at(time_s).unwrap().frame().beauty.pixels());
    assert!(largest <= 4.0 && mean < 0.5, "{largest} {mean}");
}

#[test]
#[ignore = "needs a Vulkan device"]
fn a_sky_is_where_bansho_draws_it() {
    let (size, fov) = (UVec2::new(240, 180), 1.2);
    let pose = Transform::from_xyz(0.0, 1.7, 0.0).looking_to(Vec3::new(0.3, 0.7, -1.0), Vec3::Y);
    let mut parameters = AuroraParameters { preroll_s: 1.0, ..default() };
    parameters.particles.count = 3000;
    let mut app = headless(size);
    raw_camera(&mut app, fov, 9.7, pose);
    let effect = || Effect::new(parameters.clone()).exposure_ev100(-4.0);
    app.world_mut().spawn(BanshoEffect::sky(effect()).pixels(1024, 512));
    let (time_s, image) = run_until(&mut app, 0.2);
    save(&image, "sky");
    let effect = effect().camera(same_camera(&pose, fov, Vec3::ZERO));
    let mut live = effect.size(size.x as usize, size.y as usize).open().unwrap();
    let (_, mean) = difference(&image, live.at(time_s).unwrap().frame().beauty.pixels());
    // The panorama has coarser pixels.
    assert!(mean < 3.0, "{mean}");
}

/// An example without its window.
fn example(name: &str, size: UVec2, seconds: f64, setup: fn(&mut App)) -> Image {
    let mut app = headless(size);
    app.insert_resource(GlobalAmbientLight::NONE).insert_resource(ClearColor(Color::linear_rgb(0.002, 0.003, 0.006)));
    setup(&mut app);
    let (_, image) = run_until(&mut app, seconds);
    save(&image, name);
    image
}

/// Largest code of a part of a picture, in fractions of its width and height from the top left.
fn brightest(image: &Image, part: Rect) -> u8 {
    let size = image.size().as_vec2();
    let pixels = image.data.as_ref().unwrap().as_chunks::<4>().0.iter().zip(0_u32..);
    let is_inside = |i: u32| part.contains(Vec2::new((i % image.width()) as f32, (i / image.width()) as f32) / size);
    pixels.filter(|(_, i)| is_inside(*i)).flat_map(|(pixel, _)| pixel[..3].to_vec()).max().unwrap()
}

#[test]
#[ignore = "needs a Vulkan device"]
fn the_torch_lights_the_ground() {
    let image = example("torch", UVec2::new(640, 480), 1.0, |app| {
        app.insert_resource(Wind { velocity: Vec3::X * 0.5, gust: 0.8 }).add_systems(Startup, torch::setup);
    });
    let [flame, near, far] = [[0.45, 0.1, 0.6, 0.45], [0.3, 0.8, 0.45, 0.9], [0.0, 0.5, 0.05, 0.6]]
        .map(|[x0, y0, x1, y1]| brightest(&image, Rect::new(x0, y0, x1, y1)));
    println!("flame {flame}, ground near {near}, far {far}");
    assert!(flame > 240 && near > 60 && far < near / 2, "{flame} {near} {far}");
}

#[test]
#[ignore = "needs a Vulkan device"]
fn rain_and_aurora_are_in_the_view() {
    let size = UVec2::new(640, 360);
    let rain = example("rain", size, 0.1, |app| {
        app.add_systems(Startup, rain::setup);
    });
    let aurora = example("aurora", size, 0.1, |app| {
        app.add_systems(Startup, aurora::setup);
    });
    let above = Rect::new(0.0, 0.0, 1.0, 0.4);
    assert!(brightest(&rain, above) > 60 && brightest(&aurora, above) > 60);
    // Hills hide the sky.
    assert!(brightest(&aurora, Rect::new(0.2, 0.88, 0.8, 0.92)) < 10);
}
