//! Whether there is enough memory for the pictures of a job, checked before anything is drawn.

use std::collections::{BTreeMap, HashMap};

use bansho_base::{
    host::{memory, plural::counted, printable::printable},
    image::Rect,
    parameters::ProblemKind,
    phenomenon::{SharedMemory, strip::View},
};
use bansho_render::{
    CompiledScene, Plan, display::BitDepth, lit_plate_bytes, moment_bytes_per_thread, scratch_bytes_per_thread,
    source_window,
};

use crate::job::{
    FramesInFlight,
    error::{JobError, OptionError},
    scene_file::SceneFile,
};

/// Bytes of a pixel of a frame: color and alpha in single precision.
const FRAME_BYTES: f64 = 16.0;
/// Bytes of the depth of a pixel, which only scene-linear files and refracted light need.
const DEPTH_BYTES: f64 = 4.0;
/// Bytes of a pixel of the file of a plate: color and alpha in single precision. Files are kept for the following frames.
const PLATE_FILE_BYTES: f64 = 16.0;
/// Bytes of a pixel of the files of albedo and normals of a plate.
const SURFACE_FILE_BYTES: f64 = 16.0 + 12.0;
/// Bytes of a pixel of a mirrored plate for the position on the plate that it shows, which is kept where the plate is lit.
const MIRRORED_POSITION_BYTES: f64 = 16.0;
/// Side of the pixels in which a plate is reflected by a mirror that shows no picture, in pixels of the picture.
const BLURRED_PLATE_PIXEL: usize = 2;
/// Bytes of the frames whose pixels are in memory at once, unless a single frame is larger.
const MAX_BYTES_OF_PIXELS: usize = 1 << 27;
/// Bytes of the frames that are drawn at once, unless a single frame is larger, or their number is stated.
const MAX_BYTES_DRAWN_AT_ONCE: f64 = GIB;
/// Fewest threads for which several frames are drawn at once, unless their number is stated. With 16 threads they gained a fifth to a third, with two
/// they lost as much as they gained.
const MIN_THREADS_FOR_MANY: usize = 8;
/// Fewest frames of the job for each of those that are drawn at once: what a first frame fills caches with is computed for each.
const MIN_FRAMES_FOR_EACH: usize = 16;
/// Most frames that are drawn at once, unless their number is stated: with more of them threads share the caches of fewer.
const MAX_DRAWN_AT_ONCE: usize = 16;
/// Bytes of the process without a picture, with what the allocator keeps for later.
const PROCESS_BYTES: f64 = 1.6e7;
/// Number of pixels at which the memory of phenomena is compared with that without any.
const MANY_PIXELS: f64 = 1e6;
const GIB: f64 = (1 << 30) as f64;

/// Of how many frames of `bytes` bytes the pixels may be in memory at once. Where a frame is written from its pixels, another one is drawn meanwhile.
pub(crate) fn max_frames_with_pixels(bytes: usize, writes_pixels: bool) -> usize {
    (MAX_BYTES_OF_PIXELS / bytes.max(1)).max(1 + usize::from(writes_pixels))
}

/// What the memory of a job depends on in addition to its plan.
#[derive(Clone, Copy)]
pub(crate) struct MemoryRequest {
    /// Number of frames.
    pub(crate) frames: usize,
    /// Number of tiles of a sheet; 0 where each frame is a picture of its own.
    pub(crate) tiles: usize,
    /// Bits of display pixels; `None` where frames are written in scene-linear light.
    pub(crate) display: Option<BitDepth>,
    /// Whether the size of the picture is an option of the job, rather than the scene's.
    pub(crate) size_is_option: bool,
    /// How many frames are drawn at once.
    pub(crate) in_flight: FramesInFlight,
}

/// How many frames are drawn at once: one where they follow from each other, as in simulations. Otherwise as many as are stated; by default one on
/// few threads, and on many one for each as far as memory and the number of frames suggest.
pub(crate) fn frames_drawn_at_once(compiled: &CompiledScene, plan: &Plan, request: MemoryRequest) -> usize {
    if compiled.phenomena().any(|phenomenon| phenomenon.info().stepping.is_some()) {
        return 1;
    }
    let threads = rayon::current_num_threads();
    let count = match request.in_flight {
        FramesInFlight::Count(count) => count,
        // Few threads are busy with the parts of one frame, and a plate would be read for each of the frames.
        FramesInFlight::Auto if threads < MIN_THREADS_FOR_MANY || plan.scene().has_plate() => 1,
        FramesInFlight::Auto => {
            let window = source_window(plan);
            let frame = FrameBytes::new(compiled, plan, request, channel_count(compiled, plan));
            let pixels = pixel_count([window.width, window.height], 0);
            let phenomena = PhenomenaBytes::new(compiled, plan);
            let bytes = (frame.drawn() + frame.written) * pixels + phenomena.frame * pixels;
            let by_memory = (MAX_BYTES_DRAWN_AT_ONCE / bytes.max(1.0)) as usize;
            let most = threads.min(MAX_DRAWN_AT_ONCE).min(by_memory).min(request.frames / MIN_FRAMES_FOR_EACH);
            // One frame may fit where several do not.
            let fixed = fixed_picture_bytes(compiled, plan) + phenomena.fixed;
            (2..=most).rev().find(|count| memory::can_allocate(*count as f64 * bytes + fixed)).unwrap_or(1)
        }
    };
    count.min(request.frames).max(1)
}

/// The largest number of frames below `count` that there is memory for at once; `None` if there is not even for one.
fn max_in_flight(compiled: &CompiledScene, plan: &Plan, request: MemoryRequest, count: usize) -> Option<usize> {
    let fits = |count: &usize| {
        let request = MemoryRequest { in_flight: FramesInFlight::Count(*count), ..request };
        memory::can_allocate(largest_bytes(compiled, plan, request))
    };
    (1..count).take_while(fits).last()
}

impl FramesInFlight {
    /// How many of `frames` frames of light a program draws at once, each from a [`Shot`](bansho_render::Shot) of its own
    /// ([`independent`](bansho_render::Shot::independent)): as many as a [`Job`](crate::job::Job) that writes them to EXR files in the same pool. One where
    /// they follow from each other, as in simulations.
    ///
    /// # Errors
    /// [`OptionError::FramesInFlight`]: more frames are stated than there is memory for. One is always allowed.
    pub fn for_light(self, compiled: &CompiledScene, plan: &Plan, frames: usize) -> Result<usize, OptionError> {
        let request = MemoryRequest { frames, tiles: 0, display: None, size_is_option: true, in_flight: self };
        let at_once = frames_drawn_at_once(compiled, plan, request);
        let bytes = largest_bytes(compiled, plan, request);
        match self {
            Self::Count(count) if at_once > 1 && !memory::can_allocate(bytes) => {
                let max = max_in_flight(compiled, plan, request, count).unwrap_or(1);
                Err(OptionError::FramesInFlight { count, required_gib: bytes / GIB, max })
            }
            _ => Ok(at_once),
        }
    }
}

/// How many of the frames that may be drawn at once take memory: a thread that waits for parts of its frame takes on another one, and seldom more.
fn frames_in_memory(drawn_at_once: usize) -> usize {
    drawn_at_once.min(2 * rayon::current_num_threads() - 1)
}

/// Memory of a frame for each of its pixels, bytes.
struct FrameBytes {
    /// Its light, where that is kept.
    light: f64,
    /// What its glare takes.
    glare: f64,
    /// Its display pixels.
    display: f64,
    /// The samples of its file, and the file itself.
    written: f64,
}

impl FrameBytes {
    /// The memory of a frame with `channels` channels of layers and AOVs.
    fn new(compiled: &CompiledScene, plan: &Plan, request: MemoryRequest, channels: usize) -> Self {
        let refracts = refracts(compiled, plan);
        let has_glare = plan.glare > 0.0;
        let depth = if request.display.is_none() || refracts { DEPTH_BYTES } else { 0.0 };
        // Where only display pixels are kept, there is no light of a whole picture.
        let has_light = request.display.is_none() || request.tiles > 0 || refracts || has_glare;
        let light = if has_light { FRAME_BYTES + depth + 4.0 * channels as f64 } else { 0.0 };
        // The pyramid, and the light without that of the plate.
        let plate_apart = if plan.scene().has_plate() { FRAME_BYTES } else { 0.0 };
        let glare = if has_glare { FRAME_BYTES / 3.0 + plate_apart } else { 0.0 };
        // Compressed samples and the file that they are copied to, of a picture that noise fills; an EXR has half-precision colors and single-precision
        // channels.
        let [display, written] = match request.display {
            Some(BitDepth::Eight) => [4.0, 3.75 + 3.75],
            Some(BitDepth::Sixteen) => [8.0, 7.0 + 7.0],
            None => [0.0, 12.0 + 3.0 * channels as f64],
        };
        Self { light, glare, display, written: covered_part(compiled, plan) * written }
    }

    /// What a frame takes while it is drawn.
    fn drawn(&self) -> f64 {
        self.light + self.glare + self.display
    }
}

/// Memory of a job for each pixel.
struct BytesPerPixel {
    /// For each pixel that is drawn.
    drawn: f64,
    /// For each pixel of the whole picture with its overscan.
    whole: f64,
}

impl BytesPerPixel {
    /// The memory of a job whose frames have `channels` channels of layers and AOVs.
    /// Of the frames that are drawn at once, `at_once` are in memory.
    fn new(compiled: &CompiledScene, plan: &Plan, request: MemoryRequest, channels: usize, at_once: usize) -> Self {
        let at_once = at_once as f64;
        let frame = FrameBytes::new(compiled, plan, request, channels);
        // The next picture is drawn while one is written. What remains empty in it takes no memory, but a plate, a sky or rain fill it.
        let is_filled = covered_part(compiled, plan) == 1.0;
        let pictures = if is_filled && request.tiles == 0 { request.frames.min(2) as f64 } else { 1.0 };
        let written = pictures * frame.display + frame.written;
        // One frame is written while another one is drawn, in the memory of the former where it is large and its pixels are no longer needed
        // (`draw_frames`). Of a display picture the light is free once it is drawn. A sheet keeps the pixels of all, and is laid out and encoded as a whole.
        let window = plan.window();
        let light_bytes = window.width * window.height * frame.light as usize;
        let max_with_pixels = max_frames_with_pixels(light_bytes, request.display.is_none());
        let keeps_light = request.display.is_none() || request.tiles > 0;
        let with_light = if keeps_light { request.frames.min(2).min(max_with_pixels) } else { 1 };
        let encoded = request.tiles.max(1);
        let one_after_the_other = with_light as f64 * frame.light + frame.glare + encoded as f64 * written;
        let drawn = if at_once > 1.0 {
            at_once * (frame.drawn() + frame.written) + (encoded - 1) as f64 * written
        } else {
            one_after_the_other
        };
        let plate_depth = if plan.scene().plate.depth.is_some() { DEPTH_BYTES } else { 0.0 };
        let plate = if plan.scene().has_plate() { FRAME_BYTES + plate_depth } else { 0.0 };
        // Each of the frames that are drawn at once has a plate of its own, lights it, and reflects it.
        let of_plate = plate + lit_plate_bytes(compiled, plan) + reflected(compiled, plan, plate);
        Self { drawn, whole: at_once * of_plate }
    }

    fn total(&self, drawn_pixels: f64, whole_pixels: f64) -> f64 {
        self.drawn * drawn_pixels + self.whole * whole_pixels
    }
}

/// Memory of the reflection in a mirror for each pixel of the picture, bytes: the mirrored scene and, in the same resolution, a plate of `plate` bytes for
/// each of its pixels.
fn reflected(compiled: &CompiledScene, plan: &Plan, plate: f64) -> f64 {
    let Some(mirror) = compiled.phenomena().find_map(|phenomenon| phenomenon.info().mirror) else { return 0.0 };
    let view = plan.view(plan.frames().start);
    // Rain is a closed form: starting a run of it computes nothing.
    let mut closed_forms = compiled.phenomena().filter(|phenomenon| phenomenon.info().stepping.is_none());
    let plate = if plan.scene().lights_plate() { plate + MIRRORED_POSITION_BYTES } else { plate };
    let is_raining = closed_forms.any(|phenomenon| phenomenon.clone().start().publish(view.shutter).extinction > 0.0);
    match mirror.roughness.pixel_size(view.camera.focal_pixels, is_raining) {
        Some(side) => (FRAME_BYTES + plate) / (side * side) as f64,
        None => plate / (BLURRED_PLATE_PIXEL * BLURRED_PLATE_PIXEL) as f64,
    }
}

/// Memory of a job, bytes: what its pictures take, its phenomena, the file of its plate, and the process. Within a quarter of the measured peak for frames
/// that take longer to draw than to write.
pub(crate) fn estimated_bytes(compiled: &CompiledScene, plan: &Plan, request: MemoryRequest) -> f64 {
    let at_once = frames_in_memory(frames_drawn_at_once(compiled, plan, request));
    bytes_with_frames(compiled, plan, request, at_once)
}

/// The same if every frame that may be drawn at once is in memory: what must be available.
fn largest_bytes(compiled: &CompiledScene, plan: &Plan, request: MemoryRequest) -> f64 {
    bytes_with_frames(compiled, plan, request, frames_drawn_at_once(compiled, plan, request))
}

/// Memory of a job, bytes, if `at_once` of the frames that are drawn at once are in memory.
fn bytes_with_frames(compiled: &CompiledScene, plan: &Plan, request: MemoryRequest, at_once: usize) -> f64 {
    let window = source_window(plan);
    let (drawn, whole) =
        (pixel_count([window.width, window.height], 0), pixel_count(plan.size(), plan.overscan() as i64));
    let per_pixel = BytesPerPixel::new(compiled, plan, request, channel_count(compiled, plan), at_once);
    let phenomena = PhenomenaBytes::new(compiled, plan);
    per_pixel.total(drawn, whole)
        + at_once as f64 * phenomena.frame * drawn
        + phenomena.fixed
        + fixed_picture_bytes(compiled, plan)
}

/// Memory of the file of a plate, of the strips and of the moments of exposures, and of the process, bytes.
fn fixed_picture_bytes(compiled: &CompiledScene, plan: &Plan) -> f64 {
    let layers = if plan.layers { compiled.phenomena().count() } else { 0 };
    let view = plan.view(plan.frames().start);
    let of_thread = moment_bytes_per_thread(&view, layers) + scratch_bytes_per_thread(&view);
    plate_file_bytes(compiled) + rayon::current_num_threads() as f64 * of_thread + PROCESS_BYTES
}

/// Memory of all phenomena, bytes.
struct PhenomenaBytes {
    /// What frames that are drawn at once have in common. What several phenomena share counts once.
    fixed: f64,
    /// For each pixel that is drawn of each of these frames.
    frame: f64,
}

impl PhenomenaBytes {
    fn new(compiled: &CompiledScene, plan: &Plan) -> Self {
        let view = plan.view(plan.frames().start);
        let (mut fixed, mut frame, mut shared) = (0.0, 0.0, BTreeMap::new());
        for phenomenon in compiled.phenomena() {
            let without_pixels = phenomenon.memory_bytes(0.0);
            // Memory of phenomena is proportional to the pixels that they cover.
            let of_pixels = phenomenon.memory_bytes(MANY_PIXELS) - without_pixels;
            fixed += without_pixels;
            frame += of_pixels / MANY_PIXELS * part_of_window(&view, phenomenon.picture_bounds(&view));
            shared.extend(phenomenon.shared_memory(&view).into_iter().map(|SharedMemory { key, bytes }| (key, bytes)));
        }
        Self { fixed: fixed + shared.values().sum::<f64>(), frame }
    }
}

/// The part of the window of a view that `rect` covers.
fn part_of_window(view: &View, rect: Rect) -> f64 {
    let [covered, window] = [rect, view.window].map(|rect| (rect.width * rect.height) as f64);
    covered / window.max(1.0)
}

/// The part of a picture that is not empty: 1 where a plate, a sky, a ground or rain fills it, less where flames burn in the dark.
fn covered_part(compiled: &CompiledScene, plan: &Plan) -> f64 {
    if plan.scene().has_plate() {
        return 1.0;
    }
    let view = plan.view(plan.frames().start);
    let bounds = compiled.phenomena().map(|phenomenon| phenomenon.picture_bounds(&view));
    part_of_window(&view, bounds.fold(Rect::default(), |all, rect| all.union(&rect)))
}

/// Memory of the files of a plate, bytes, which does not depend on the size of the picture.
fn plate_file_bytes(compiled: &CompiledScene) -> f64 {
    let bytes = plate_file_bytes_per_pixel(compiled);
    compiled.plate_image().map_or(0.0, |picture| bytes * picture.color.count() as f64)
}

fn plate_file_bytes_per_pixel(compiled: &CompiledScene) -> f64 {
    PLATE_FILE_BYTES + if compiled.scene().lights_plate() { SURFACE_FILE_BYTES } else { 0.0 }
}

/// Whether a phenomenon may refract the light of what is behind it.
fn refracts(compiled: &CompiledScene, plan: &Plan) -> bool {
    let has_background = plan.scene().has_plate() || compiled.phenomena().count() > 1;
    has_background && compiled.phenomena().any(|phenomenon| phenomenon.info().refracts)
}

/// Number of channels of the layers and AOVs of a plan.
fn channel_count(compiled: &CompiledScene, plan: &Plan) -> usize {
    let infos: Vec<_> = compiled.phenomena().map(|phenomenon| phenomenon.info()).collect();
    let layers = if plan.layers { 4 * (infos.len() + usize::from(plan.scene().has_plate())) } else { 0 };
    let aovs: usize = infos.iter().filter(|_| plan.aovs).map(|info| info.aovs.len()).sum();
    layers + aovs
}

fn pixel_count([width, height]: [usize; 2], overscan: i64) -> f64 {
    (width as f64 + 2.0 * overscan as f64) * (height as f64 + 2.0 * overscan as f64)
}

/// Checks that the system can allocate the memory for the pictures of a plan.
///
/// # Errors
/// It cannot. The error states the size that would fit, at the scene's key, or as an error of the options if these set the size.
pub(crate) fn check(
    scene: &SceneFile,
    compiled: &CompiledScene,
    plan: &Plan,
    request: MemoryRequest,
) -> Result<(), JobError> {
    let (window, overscan) = (plan.window(), plan.overscan() as i64);
    let drawn = pixel_count([window.width, window.height], 0);
    let channels = channel_count(compiled, plan);
    let at_once = frames_drawn_at_once(compiled, plan, request);
    let per_pixel = BytesPerPixel::new(compiled, plan, request, channels, at_once);
    let bytes = largest_bytes(compiled, plan, request);
    if memory::can_allocate(bytes) {
        return Ok(());
    }
    check_without_pixels(scene, compiled, plan)?;
    if let FramesInFlight::Count(count @ 2..) = request.in_flight
        && let Some(max) = max_in_flight(compiled, plan, request, count)
    {
        return Err(OptionError::FramesInFlight { count, required_gib: bytes / GIB, max }.into());
    }
    // The overscan is the problem only if the picture without it would fit.
    let without_overscan = pixel_count(plan.size(), 0);
    if overscan > 0
        && drawn > without_overscan
        && memory::can_allocate(per_pixel.total(without_overscan, without_overscan))
    {
        let max = memory::largest_fitting_count(overscan, |overscan| {
            let pixels = pixel_count(plan.size(), overscan);
            memory::can_allocate(per_pixel.total(pixels, pixels))
        });
        let (width, height, gib) = (window.width, window.height, bytes / GIB);
        let message =
            format!("{width} x {height} pixels with this overscan would take {gib:.1} GiB; allowed: up to {max}");
        return Err(scene.error_at("picture.overscan", ProblemKind::Conflict(message)));
    }
    let fixed = fixed_bytes(compiled, plan);
    let thousandths = memory::largest_fitting_count(1000, |thousandths| {
        memory::can_allocate(fixed + 0.001 * thousandths as f64 * (bytes - fixed))
    });
    let scale = (0.001 * thousandths as f64).sqrt();
    let size = [window.width, window.height];
    let max_size = size.map(|side| (side as f64 * scale).floor() as usize);
    let error = OptionError::OutOfMemory { size, channels, required_gib: bytes / GIB, max_size };
    if request.size_is_option || channels > 0 {
        return Err(error.into());
    }
    Err(scene.error_at("picture.size", ProblemKind::Conflict(error.to_string())))
}

/// Memory that does not depend on the size of the picture, bytes.
fn fixed_bytes(compiled: &CompiledScene, plan: &Plan) -> f64 {
    PhenomenaBytes::new(compiled, plan).fixed + fixed_picture_bytes(compiled, plan)
}

/// Checks that the phenomena fit into memory whatever the size of the picture.
///
/// # Errors
/// They do not. The error names the kind of phenomenon that takes most.
fn check_without_pixels(scene: &SceneFile, compiled: &CompiledScene, plan: &Plan) -> Result<(), JobError> {
    let fixed = fixed_bytes(compiled, plan);
    if memory::can_allocate(fixed) {
        return Ok(());
    }
    let plate = plate_file_bytes(compiled);
    if plate > 0.5 * fixed {
        let bytes_per_pixel = plate_file_bytes_per_pixel(compiled);
        let megapixels = (1e-6 * plate / bytes_per_pixel).ceil() as i64;
        let max = memory::largest_fitting_count(megapixels, |megapixels| {
            memory::can_allocate(fixed - plate + 1e6 * bytes_per_pixel * megapixels as f64)
        });
        let file = plan.scene().plate.image.as_ref().map_or("", |image| &image.0);
        let message = format!(
            "{}: its {megapixels} megapixels would take {:.1} GiB; allowed: up to {max} megapixels",
            printable(file),
            fixed / GIB
        );
        return Err(scene.error_at("plate.image", ProblemKind::Conflict(message)));
    }
    let view = plan.view(plan.frames().start);
    let mut kinds: BTreeMap<&str, (usize, f64)> = BTreeMap::new();
    let kind_of: HashMap<&str, &str> =
        plan.scene().instances.iter().map(|instance| (instance.name.as_str(), instance.kind.key)).collect();
    for phenomenon in compiled.phenomena() {
        let Some(kind) = kind_of.get(phenomenon.info().name) else { continue };
        let shared: f64 = phenomenon.shared_memory(&view).iter().map(|shared| shared.bytes).sum();
        let (count, bytes) = kinds.entry(kind).or_default();
        *count += 1;
        *bytes += phenomenon.memory_bytes(0.0) + shared;
    }
    let most = kinds.into_iter().max_by(|(_, a), (_, b)| a.1.total_cmp(&b.1));
    let Some((kind, (count, bytes))) = most else { return Ok(()) };
    let fits =
        |count_that_fits: i64| memory::can_allocate(fixed - bytes + bytes * count_that_fits as f64 / count as f64);
    let message = format!(
        "the phenomena of this scene would take {:.1} GiB, most of it {}, whatever the size of the picture; allowed: up to {} of these, or \
         fewer particles",
        fixed / GIB,
        counted(count, &format!("[[{kind}]]")),
        memory::largest_fitting_count(count as i64, fits)
    );
    Err(scene.error_at(kind, ProblemKind::Conflict(message)))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use bansho_base::{
        host::assets::{Encoding, MemoryAssets, Picture},
        image::Image,
    };
    use bansho_render::PlanOptions;

    use super::*;

    /// The estimate for one 8-bit frame of a plate of some pixels.
    fn of_plate(picture: &str, pixels: [usize; 2]) -> f64 {
        of_plates(picture, pixels, 1, 1)
    }

    /// The estimate for 8-bit frames of a plate of some pixels, of which several are drawn at once.
    fn of_plates(picture: &str, pixels: [usize; 2], frames: usize, in_flight: usize) -> f64 {
        let mut assets = MemoryAssets::default();
        let image = Image::filled(pixels[0], pixels[1], [0.5, 0.5, 0.5, 1.0]);
        assets.insert_picture("plate.png", Picture::opaque(image, Encoding::DisplaySrgb));
        let text = format!("bansho = 2\n[picture]\nsize = {picture}\n[plate]\nimage = \"plate.png\"\n");
        let compiled = crate::compile_scene("test", &text, Arc::new(assets)).unwrap();
        let plan = Plan::new(&compiled, &PlanOptions::default()).unwrap();
        let request = MemoryRequest {
            frames,
            tiles: 0,
            display: Some(BitDepth::Eight),
            size_is_option: false,
            in_flight: FramesInFlight::Count(in_flight),
        };
        estimated_bytes(&compiled, &plan, request)
    }

    #[test]
    fn plates_take_memory_for_the_pixels_of_their_files_and_of_the_picture() {
        let small = of_plate("[100, 100]", [100, 100]);
        let large_file = of_plate("[100, 100]", [1100, 1000]) - small;
        assert!((large_file / 1.09e6 - PLATE_FILE_BYTES).abs() < 0.01, "{large_file}");
        // The strips of a picture that is wider by 1000 pixels: of each thread 14 planes of 8 rows.
        let strips = (rayon::current_num_threads() * 14 * 4 * 8 * 1000) as f64;
        let large_picture = of_plate("[1100, 1000]", [100, 100]) - small - strips;
        assert!((large_picture / 1.09e6 - (FRAME_BYTES + 4.0 + 7.5)).abs() < 0.01, "{large_picture}");
    }

    #[test]
    fn every_frame_in_flight_has_a_plate_and_pictures_as_far_as_threads_draw_them() {
        const PIXELS: f64 = 1.1e6;
        let estimate = |in_flight| of_plates("[1100, 1000]", [100, 100], 99, in_flight);
        let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let [three, four, nine] = pool(8).install(|| [3, 4, 9].map(estimate));
        let of_frame = (four - three) / PIXELS;
        assert!((of_frame - (FRAME_BYTES + 4.0 + 7.5)).abs() < 0.01, "{of_frame}");
        assert!(((nine - four) / PIXELS - 5.0 * of_frame).abs() < 0.01, "{nine}");
        // Each of two threads draws a frame and, while it waits, one of them another.
        let [three, nine] = pool(2).install(|| [3, 9].map(estimate));
        assert!((three - nine).abs() < 1.0, "{three} {nine}");
    }

    #[test]
    fn frames_of_light_in_flight_are_as_many_as_of_a_job_and_refused_where_they_do_not_fit() {
        let of_size = |size: &str, frames: usize, in_flight: FramesInFlight| {
            let text = format!("bansho = 2\n[picture]\nsize = {size}\nframes = 9999\n");
            let compiled = crate::compile_scene("test", &text, Arc::new(MemoryAssets::default())).unwrap();
            let plan = Plan::new(&compiled, &PlanOptions::default()).unwrap();
            in_flight.for_light(&compiled, &plan, frames)
        };
        let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let small =
            |threads, frames, in_flight| pool(threads).install(|| of_size("[64, 36]", frames, in_flight)).unwrap();
        assert_eq!(small(7, 9999, FramesInFlight::Auto), 1);
        assert_eq!(small(8, 9999, FramesInFlight::Auto), 8);
        assert_eq!(small(8, 32, FramesInFlight::Auto), 2);
        assert_eq!(small(2, 9999, FramesInFlight::Count(5)), 5);
        assert_eq!(small(2, 3, FramesInFlight::Count(5)), 3);
        // No address space holds as many frames.
        let refused = of_size("[16384, 16384]", usize::MAX, FramesInFlight::Count(1 << 40));
        let Err(OptionError::FramesInFlight { count, max, .. }) = refused else { panic!("{refused:?}") };
        assert!(count == 1 << 40 && (1..10_000).contains(&max), "{max}");
    }

    #[test]
    fn large_frames_are_in_memory_once_or_twice_where_they_are_written_from_their_pixels() {
        let frame = |width: usize, height: usize| width * height * FRAME_BYTES as usize;
        assert_eq!([false, true].map(|writes| max_frames_with_pixels(frame(4096, 4096), writes)), [1, 2]);
        assert_eq!([false, true].map(|writes| max_frames_with_pixels(frame(1280, 720), writes)), [9, 9]);
        assert_eq!(max_frames_with_pixels(0, false), MAX_BYTES_OF_PIXELS);
    }
}
