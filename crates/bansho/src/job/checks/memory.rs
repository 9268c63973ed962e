//! Whether there is memory for the pictures of a job, found out before anything is drawn.

use bansho_base::{host::memory, parameters::ProblemKind};
use bansho_render::{CompiledScene, Plan, display::BitDepth};

use crate::job::{
    error::{Conflict, JobError},
    scene_file::SceneFile,
};

/// Smaller pictures than this many pixels are not asked about.
const FEW_PIXELS: f64 = 4e6;
/// Bytes of a pixel of a frame: color, alpha and depth as they are drawn.
const FRAME_BYTES: f64 = 20.0;

/// What a job asks of memory, beside its plan.
#[derive(Clone, Copy)]
pub(crate) struct MemoryRequest {
    /// How many frames.
    pub(crate) frames: usize,
    /// How many of them are kept for a sheet.
    pub(crate) tiles: usize,
    /// Bits of display pixels; none where frames are written as they are.
    pub(crate) display: Option<BitDepth>,
    /// Whether the job asked for the size of the picture, rather than the scene.
    pub(crate) own_size: bool,
}

/// Bytes that a job takes, by what they grow with.
struct Need {
    /// A pixel that is drawn.
    drawn: f64,
    /// A pixel of the whole picture with its overscan.
    whole: f64,
}

impl Need {
    fn new(compiled: &CompiledScene, plan: &Plan, request: MemoryRequest) -> (Self, usize) {
        let infos: Vec<_> = compiled.phenomena().map(|phenomenon| phenomenon.info()).collect();
        let scene = plan.scene();
        let layers = if plan.layers { 4 * (infos.len() + usize::from(scene.has_plate())) } else { 0 };
        let aovs: usize = infos.iter().filter(|_| plan.aovs).map(|info| info.aovs.len()).sum();
        let channels = layers + aovs;
        let frame = FRAME_BYTES + 4.0 * channels as f64;
        // A display picture, the samples of the file and the file itself; an EXR holds half colors and single channels.
        let written = match request.display {
            Some(BitDepth::Eight) => 3.0 * 4.0,
            Some(BitDepth::Sixteen) => 3.0 * 8.0,
            None => 12.0 + 3.0 * channels as f64,
        };
        // Two are being written while a third is drawn; a sheet keeps the pixels of each, and is laid out and encoded as a whole.
        let (drawn, encoded) = (request.frames.min(3) as f64, request.frames.min(2).max(request.tiles) as f64);
        let drawn = drawn * frame + encoded * written;
        let plate = if scene.has_plate() { FRAME_BYTES } else { 0.0 };
        // What a mirror shows, what of it is blurred, and the plate in it.
        let mirror = if infos.iter().any(|info| info.mirror.is_some()) { 2.0 * FRAME_BYTES + plate } else { 0.0 };
        (Self { drawn, whole: plate + mirror }, channels)
    }

    fn bytes(&self, drawn: f64, whole: f64) -> f64 {
        self.drawn * drawn + self.whole * whole
    }
}

/// Whether the system would give the memory that the pictures of a plan take.
///
/// # Errors
/// It would not, with the size that it would give it for: at its place in the scene, or as what was asked for.
pub(crate) fn check(
    scene: &SceneFile,
    compiled: &CompiledScene,
    plan: &Plan,
    request: MemoryRequest,
) -> Result<(), JobError> {
    let (window, size, overscan) = (plan.window(), plan.size(), plan.overscan() as i64);
    let pixels = |[width, height]: [usize; 2], overscan: i64| {
        (width as f64 + 2.0 * overscan as f64) * (height as f64 + 2.0 * overscan as f64)
    };
    let drawn = pixels([window.width, window.height], 0);
    let whole = pixels(size, overscan);
    if drawn.max(whole) * (request.tiles.max(1) as f64) < FEW_PIXELS {
        return Ok(());
    }
    let (need, channels) = Need::new(compiled, plan, request);
    let bytes = need.bytes(drawn, whole);
    if memory::can_allocate(bytes) {
        return Ok(());
    }
    let would = format!("would take {:.1} GiB", bytes / f64::from(1 << 30));
    // The overscan is too much only where the picture itself would fit.
    let bare = pixels(size, 0);
    if overscan > 0 && drawn > bare && memory::can_allocate(need.bytes(bare, bare)) {
        let fits = |overscan| {
            let pixels = pixels(size, overscan);
            memory::can_allocate(need.bytes(pixels, pixels))
        };
        let most = memory::largest_fitting_count(overscan, fits);
        let message =
            format!("{} x {} pixels with this overscan {would}; allowed: up to {most}", window.width, window.height);
        return Err(scene.fault("picture.overscan", ProblemKind::Conflict(message)));
    }
    let share = memory::largest_fitting_count(1000, |share| memory::can_allocate(0.001 * share as f64 * bytes));
    let most = [window.width, window.height].map(|side| (side as f64 * (0.001 * share as f64).sqrt()).floor() as usize);
    let conflict = Conflict::Memory { size: [window.width, window.height], channels, would, most };
    if request.own_size || channels > 0 {
        return Err(conflict.into());
    }
    Err(scene.fault("picture.size", ProblemKind::Conflict(conflict.to_string())))
}
