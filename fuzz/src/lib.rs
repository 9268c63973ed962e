//! What the fuzz targets share: reading a plate, drawing one small frame, looking for numbers that are not finite.

use std::{
    panic::{AssertUnwindSafe, catch_unwind, resume_unwind},
    sync::{Arc, Mutex, Once, PoisonError},
    time::{Duration, Instant},
};

use bansho::KINDS;
use bansho_base::{
    color::AlphaConvention,
    frame::Frame,
    host::{
        assets::{MemoryAssets, Picture, PictureLayers},
        observer::Observer,
    },
};
use bansho_media::{
    assets::{decode_depth, decode_normals, decode_picture},
    limits,
};
use bansho_render::{
    CompiledScene, Plan, PlanOptions, RenderError, SceneLinear, Shot,
    display::{BitDepth, display},
};
use bansho_scene::{Scene, SceneOptions};

/// Stops a frame that takes too long: a scene may rightly ask for much work, and that is no fault.
struct Deadline(Instant);

impl Observer for Deadline {
    fn cancelled(&self) -> bool {
        Instant::now() > self.0
    }
}

/// One thread, so that the same input takes the same way through the code each time; to be called before anything else.
///
/// # Panics
/// Work was given to threads before.
pub fn one_thread() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread();
        pool.build_global().expect("no pool was built before");
    });
}

/// Draws the second frame of `scene`, at most 32 pixels on a side, with layers and AOVs.
///
/// Scenes with burning gas or rain are only planned: at their limits one step or frame of them takes longer than a fuzzer waits, and
/// cannot be interrupted. The random-scene tests draw them.
///
/// # Panics
/// The frame holds a number that is not finite, or a plan of a checked scene fails.
///
/// Whether it can be built.
pub fn draw_small(mut scene: Scene, assets: MemoryAssets) -> bool {
    one_thread();
    scene.picture.overscan = scene.picture.overscan.min(4);
    let number = scene.picture.first_frame + 1;
    let size = scene.picture.size.map(|side| (side as usize).min(32));
    let options = PlanOptions { size: Some(size), layers: true, aovs: true, ..PlanOptions::default() };
    let interruptible = scene.instances.iter().all(|instance| instance.kind.key == "flame_sheet");
    let scene = Arc::new(scene.with_options(&SceneOptions::default()).expect("it is no loop"));
    let compiled = match CompiledScene::build(scene, Arc::new(assets), None) {
        Ok(compiled) => Arc::new(compiled),
        Err(errors) => {
            assert!(!errors.located("fuzz.toml", "").problems.is_empty());
            return false;
        }
    };
    let plan = Plan::new(&compiled, &options).expect("a checked scene can be planned");
    if !interruptible {
        return true;
    }
    let mut shot = Shot::open(compiled, Arc::new(plan));
    let deadline = Deadline(Instant::now() + Duration::from_secs(2));
    match shot.advance(number, &deadline).and_then(|()| shot.draw(&SceneLinear, &deadline)) {
        Err(RenderError::Cancelled(_)) => {}
        Err(error) => panic!("a checked scene cannot be drawn: {error}"),
        Ok(frame) => check(&frame),
    }
    true
}

/// # Panics
/// The frame holds a number that is not finite.
fn check(frame: &Frame) {
    let beauty = frame.beauty.pixels().iter().flatten();
    assert!(beauty.copied().all(f32::is_finite), "the beauty holds a number that is not finite");
    for channel in &frame.channels {
        assert!(
            channel.values.iter().copied().all(f32::is_finite),
            "{} holds a number that is not finite",
            channel.name
        );
    }
    if let Some(depth) = &frame.depth {
        assert!(depth.iter().all(|depth| *depth >= 0.0), "the depth is NaN or negative");
    }
    display(frame, &Default::default(), BitDepth::Eight, AlphaConvention::Encoded);
    display(frame, &Default::default(), BitDepth::Sixteen, AlphaConvention::Encoded);
}

/// Lets a panic be caught where the project catches those of a decoder, and tells of one that is not.
///
/// The fuzzer's own hook would end the process at the panic itself.
fn telling_panics<T>(work: impl FnOnce() -> T) -> T {
    static LAST: Mutex<String> = Mutex::new(String::new());
    static ONCE: Once = Once::new();
    let last = || LAST.lock().unwrap_or_else(PoisonError::into_inner);
    ONCE.call_once(|| std::panic::set_hook(Box::new(move |info| *last() = info.to_string())));
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        eprintln!("{}", last());
        resume_unwind(panic)
    })
}

/// Reads `bytes` as a plate whose name ends in `extension`.
///
/// # Panics
/// The picture breaks what its reader promises, or a scene over it has a number that is not finite.
pub fn read_plate(bytes: &[u8], extension: &str) {
    one_thread();
    telling_panics(|| {
        if let Ok(picture) = decode_picture(bytes, extension, &PictureLayers::default(), limits::MemoryLimit::default())
        {
            check_plate(picture);
        }
        // The same bytes as normals, which only an EXR has.
        if let Ok(map) = decode_normals(bytes, extension, limits::MemoryLimit::default()) {
            let (width, height) = (map.values.width(), map.values.height());
            assert!(width > 0 && height > 0 && width.max(height) as u64 <= limits::SIDE, "{width} x {height}");
        }
    });
}

/// Reads `bytes` as a depth, whose format the first byte chooses.
///
/// # Panics
/// The map breaks what its reader promises.
pub fn read_depth(bytes: &[u8]) {
    one_thread();
    let Some((choice, bytes)) = bytes.split_first() else { return };
    let extension = ["npy", "pfm", "tiff", "png", "exr"][usize::from(*choice) % 5];
    telling_panics(|| {
        if let Ok(map) = decode_depth(bytes, extension, None, limits::MemoryLimit::default()) {
            let (width, height) = (map.values.width(), map.values.height());
            assert!(width > 0 && height > 0 && width.max(height) as u64 <= limits::SIDE, "{width} x {height}");
        }
    });
}

/// Reads `profile` as that of a gray TIFF of four pixels.
///
/// # Panics
/// A color is not from 0 to 1.
pub fn read_profile(profile: &[u8]) {
    one_thread();
    let pixels = [0, 60, 150, 255];
    let entry = |tag: u16, kind: u16, count: u32, value: u32| {
        [&tag.to_le_bytes()[..], &kind.to_le_bytes(), &count.to_le_bytes(), &value.to_le_bytes()].concat()
    };
    let start = 8 + 2 + 12 * 9 + 4;
    let entries = [
        entry(256, 4, 1, 2),
        entry(257, 4, 1, 2),
        entry(258, 3, 1, 8),
        entry(262, 3, 1, 1),
        entry(273, 4, 1, start),
        entry(277, 3, 1, 1),
        entry(278, 4, 1, 2),
        entry(279, 4, 1, 4),
        entry(34675, 7, profile.len() as u32, start + 4),
    ];
    let file = [&b"II*\0\x08\0\0\0\x09\0"[..], &entries.concat(), &[0; 4], &pixels, profile].concat();
    telling_panics(|| {
        if let Ok(picture) = decode_picture(&file, "tiff", &PictureLayers::default(), limits::MemoryLimit::default()) {
            assert!(picture.color.iter().flatten().all(|value| (0.0..=1.0).contains(&value)));
        }
    });
}

fn check_plate(picture: Picture) {
    let (width, height) = (picture.color.width(), picture.color.height());
    assert!(width > 0 && height > 0 && width.max(height) as u64 <= limits::SIDE, "{width} x {height}");
    if let Some(depth) = &picture.depth {
        assert_eq!(depth.len(), width * height);
    }
    if width.max(height) <= 256 {
        let mut assets = MemoryAssets::default();
        assets.insert_picture("plate", picture);
        let scene = "bansho = 2\n[picture]\nsize = [16, 9]\n[plate]\nimage = \"plate\"\n[[flame_sheet]]\n";
        let scene = Scene::parse("plate.toml", scene, KINDS).expect("a scene is valid");
        assert!(draw_small(scene, assets), "a scene with its plate is valid");
    }
}
