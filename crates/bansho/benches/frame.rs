//! The time of a frame without its phenomena: compositing and view transform at 1920 x 1080, of flames within 960 x 900
//! pixels in the dark: one that only emits, and two of which one absorbs; and one before a plate whose light it refracts.
//!
//! The naive version composites whole pictures in f64 pixel by pixel, and applies the view to each pixel separately.

use std::{hint::black_box, sync::Arc};

use bansho_base::{
    color::{self, encode_srgb},
    frame::Frame,
    host::{
        assets::{Encoding, MemoryAssets, Picture},
        observer::{Cancelled, Observer, Unobserved},
    },
    image::{Image, Rect},
    parameters::BuildError,
    phenomenon::{
        Deflection, Phenomenon, PhenomenonInfo, Prepared, Run,
        strip::{DepthInterval, Shutter, Strip, View},
        surroundings::{Publication, Surroundings},
    },
    tables::{BuildContext, PhenomenonTable, TableKind},
};
use bansho_render::{
    CompiledScene, Plan, PlanOptions, SceneLinear, Shot,
    display::{BitDepth, display},
};
use bansho_scene::Scene;
use criterion::{Criterion, criterion_group, criterion_main};

const SIZE: [usize; 2] = [1920, 1080];

bansho_base::parameters! {
    /// A picture that costs nothing to draw: a bright patch in the dark, as flames are.
    pub struct PatchParameters {
        /// Depth.
        depth: f64 = 2.0, unit("m");
        /// Whether it absorbs a little, too.
        absorbs: bool = false;
        /// Whether it bends light.
        bends: bool = false;
    }
}

impl PatchParameters {
    /// The table `[[patch]]`.
    pub(crate) const KIND: TableKind = TableKind::phenomenon::<Self>("patch");
}

impl PhenomenonTable for PatchParameters {
    fn kind(&self) -> TableKind {
        Self::KIND
    }

    fn build(&self, context: &BuildContext) -> Result<Arc<dyn Phenomenon>, BuildError> {
        let angles = || (0..PATCH.width * PATCH.height).map(|index| bent(index % PATCH.width, index / PATCH.width));
        let image = || Image::from_pixels(PATCH.width, PATCH.height, angles().collect());
        let angles = if self.bends { image() } else { None };
        Ok(Arc::new(Patch { name: context.name.to_owned(), parameters: self.clone(), angles }))
    }
}

struct Patch {
    name: String,
    parameters: PatchParameters,
    /// What it bends light by, if it does: made once, as the benchmark measures what is done with them.
    angles: Option<Image<2>>,
}

/// Radiance at a pixel: a soft disk over the middle half of the picture.
fn radiance(x: usize, y: usize) -> f32 {
    let (dx, dy) = (x as f32 / 480.0 - 2.0, y as f32 / 480.0 - 1.1);
    (1.0 - (dx * dx + dy * dy)).max(0.0) * 4000.0
}

impl Phenomenon for Patch {
    fn info(&self) -> PhenomenonInfo<'_> {
        PhenomenonInfo::new(&self.name)
    }
    fn luminance(&self) -> f64 {
        2000.0
    }
    fn start(self: Arc<Self>) -> Box<dyn Run> {
        Box::new(self)
    }
}

impl Run for Patch {
    fn publish(&self, _shutter: Shutter) -> Publication {
        Publication::default()
    }
    fn depth_intervals(&self, _view: &View, _surroundings: &Surroundings) -> Vec<DepthInterval> {
        vec![DepthInterval { near: self.parameters.depth, far: self.parameters.depth + 0.1 }]
    }
    fn prepare<'a>(
        &'a self,
        _view: &'a View,
        _surroundings: &'a Surroundings<'a>,
        _observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        let row = |y: usize| (0..SIZE[0]).map(|x| radiance(x, y)).collect();
        let rows: Vec<Vec<f32>> = (0..16).map(|y| row(y * 67)).collect();
        let Self { parameters: PatchParameters { absorbs, depth, .. }, angles, .. } = self;
        Ok(Box::new(PreparedPatch { rows, absorbs: *absorbs, depth: *depth, angles: angles.as_ref() }))
    }
}

/// The pixels that a patch covers.
const PATCH: Rect = Rect { x: 480, y: 100, width: 960, height: 900 };

/// Angles of some pixels, radians.
fn bent(x: usize, y: usize) -> [f32; 2] {
    [(x % 64) as f32 * 1e-4 + 1e-5, (y % 64) as f32 * -1e-4]
}

struct PreparedPatch<'a> {
    rows: Vec<Vec<f32>>,
    absorbs: bool,
    depth: f64,
    angles: Option<&'a Image<2>>,
}

impl Prepared for PreparedPatch<'_> {
    fn bounds(&self, _slice: &DepthInterval) -> Rect {
        PATCH
    }
    fn deflection(&self) -> Option<Deflection<'_>> {
        self.angles.map(|angle| Deflection { depth: self.depth, rect: PATCH, angle })
    }
    fn draw(&self, _slice: &DepthInterval, strip: &mut Strip) {
        let width = strip.rect.width;
        for row in 0..strip.rect.height {
            let source = &self.rows[(strip.rect.y + row) / 68 % 16][strip.rect.x..];
            for (c, share) in [1.0_f32, 0.4, 0.1].into_iter().enumerate() {
                let plane = &mut strip.radiance[c][row * width..][..width];
                plane.iter_mut().zip(source).for_each(|(to, from)| *to = share * from);
            }
        }
        if self.absorbs {
            strip.transmittance_planes_mut().iter_mut().for_each(|plane| plane.fill(0.9));
        }
    }
}

/// A plate's pixel.
fn plate(x: usize, y: usize) -> [f32; 4] {
    [(x % 97) as f32 / 97.0, (y % 89) as f32 / 89.0, ((x + y) % 83) as f32 / 83.0, 1.0]
}

struct Planned {
    compiled: Arc<CompiledScene>,
    plan: Arc<Plan>,
}

impl Planned {
    fn open(&self) -> Shot {
        Shot::open(self.compiled.clone(), self.plan.clone())
    }
}

fn plan(text: &str) -> Planned {
    let mut assets = MemoryAssets::default();
    let pixels = (0..SIZE[0] * SIZE[1]).map(|index| plate(index % SIZE[0], index / SIZE[0])).collect();
    let color = Image::from_pixels(SIZE[0], SIZE[1], pixels).expect("as many pixels as the size says");
    assets.insert_picture("plate.png", Picture::opaque(color, Encoding::DisplaySrgb));
    let assets = Arc::new(assets);
    let text = format!("bansho = 2\n[picture]\nsize = [1920, 1080]\n{text}");
    let kinds: Vec<_> = bansho::KINDS.iter().copied().chain([PatchParameters::KIND]).collect();
    let scene = Scene::parse("bench.toml", &text, &kinds).expect("a valid scene");
    let compiled = Arc::new(CompiledScene::build(Arc::new(scene), assets, None).expect("a valid scene"));
    let plan = Arc::new(Plan::new(&compiled, &PlanOptions::default()).expect("a valid plan"));
    Planned { compiled, plan }
}

fn frame(shot: &mut Shot) -> Frame {
    shot.draw(&SceneLinear, &Unobserved).expect("nobody cancels")
}

/// Draws a frame, uses it and recycles it, as a job does.
fn frame_used<T>(shot: &mut Shot, with: impl Fn(&Frame) -> T) -> T {
    let frame = frame(shot);
    let used = with(&frame);
    shot.recycle(frame);
    used
}

/// Composites two layers and shows the picture, all in f64 and one pixel at a time.
fn naive(exposure: f64) -> Vec<[u8; 4]> {
    let pixel = |index: usize| {
        let (x, y) = (index % SIZE[0], index / SIZE[0]);
        let mut color = [0.0_f64; 3];
        let mut transmittance = [1.0_f64; 3];
        for absorbed in [0.9, 1.0] {
            for (c, share) in [1.0, 0.4, 0.1].into_iter().enumerate() {
                color[c] += transmittance[c] * f64::from(radiance(x, y / 68 * 67)) * share;
                transmittance[c] *= absorbed;
            }
        }
        let alpha = 1.0 - transmittance.iter().sum::<f64>() / 3.0;
        let light = color::View::DISPLAY.to_display(color.map(|value| (value * exposure) as f32));
        let alpha = light.iter().fold(alpha as f32, |alpha, value| alpha.max(*value));
        let code = |value: f32| (encode_srgb(if alpha > 0.0 { value / alpha } else { 0.0 }) * 255.0).round() as u8;
        [code(light[0]), code(light[1]), code(light[2]), (alpha * 255.0).round() as u8]
    };
    (0..SIZE[0] * SIZE[1]).map(pixel).collect()
}

/// Composites a patch before the plate that it bends, all in f64 and one pixel at a time.
fn naive_bent(exposure: f64, focal_pixels: f64) -> Vec<[f64; 3]> {
    let pixel = |index: usize| {
        let (x, y) = (index % SIZE[0], index / SIZE[0]);
        let inside = (480..1440).contains(&x) && (100..1000).contains(&y);
        let angle = if inside { bent(x - 480, y - 100).map(f64::from) } else { [0.0; 2] };
        let place = [x as f64 + focal_pixels * angle[0], y as f64 - focal_pixels * angle[1]];
        let place = [0, 1].map(|axis| place[axis].clamp(0.0, (SIZE[axis] - 1) as f64));
        let low = [0, 1].map(|axis| (place[axis] as usize).min(SIZE[axis] - 2));
        let share = [0, 1].map(|axis| place[axis] - low[axis] as f64);
        let at = |dx: usize, dy: usize| plate(low[0] + dx, low[1] + dy).map(f64::from);
        let corners = [at(0, 0), at(1, 0), at(0, 1), at(1, 1)];
        std::array::from_fn(|c| {
            let upper = corners[0][c] + share[0] * (corners[1][c] - corners[0][c]);
            let lower = corners[2][c] + share[0] * (corners[3][c] - corners[2][c]);
            exposure * f64::from(radiance(x, y / 68 * 67)) + upper + share[1] * (lower - upper)
        })
    };
    (0..SIZE[0] * SIZE[1]).map(pixel).collect()
}

/// Two threads, each on a core of its own: unpinned they are often packed onto one.
fn pinned_pool() -> rayon::ThreadPool {
    let cores = core_affinity::get_core_ids().unwrap_or_default();
    let pin = move |index: usize| {
        if let Some(core) = cores.get(index) {
            core_affinity::set_for_current(*core);
        }
    };
    rayon::ThreadPoolBuilder::new().num_threads(2).start_handler(pin).build().expect("two threads")
}

fn benches(criterion: &mut Criterion) {
    let pool = pinned_pool();
    let one = plan("[[patch]]\n");
    let two = plan("[[patch]]\ndepth = 1\nabsorbs = true\n[[patch]]\n");
    let exposure = f64::from(two.plan.exposure_scale());
    let mut group = criterion.benchmark_group("frame_1080p");
    group.sample_size(20);
    let before = |bends: bool| plan(&format!("[plate]\nimage = \"plate.png\"\n[[patch]]\nbends = {bends}\n"));
    let [straight, bent] = [false, true].map(before);
    let scenes = [
        ("composite_one", &one),
        ("composite_two", &two),
        ("composite_before_plate", &straight),
        ("composite_before_bent_plate", &bent),
    ];
    for (name, plan) in scenes {
        let mut shot = plan.open();
        group.bench_function(name, |bencher| {
            pool.install(|| bencher.iter(|| frame_used(&mut shot, |frame| black_box(frame).content)));
        });
    }
    let mut lone = one.open();
    group.bench_function("composite_one_and_view", |bencher| {
        pool.install(|| {
            bencher.iter(|| {
                frame_used(&mut lone, |frame| {
                    black_box(display(frame, &color::View::DISPLAY, BitDepth::Eight, color::AlphaConvention::Encoded))
                })
            });
        });
    });
    let mut shot = two.open();
    let drawn = frame(&mut shot);
    group.bench_function("view", |bencher| {
        pool.install(|| {
            bencher.iter(|| {
                black_box(display(&drawn, &color::View::DISPLAY, BitDepth::Eight, color::AlphaConvention::Encoded))
            });
        });
    });
    group.bench_function("composite_two_and_view", |bencher| {
        pool.install(|| {
            bencher.iter(|| {
                frame_used(&mut shot, |frame| {
                    black_box(display(frame, &color::View::DISPLAY, BitDepth::Eight, color::AlphaConvention::Encoded))
                })
            });
        });
    });
    group.bench_function("naive", |bencher| bencher.iter(|| black_box(naive(exposure))));
    let focal_pixels = bent.plan.view(0).camera.focal_pixels;
    group.bench_function("naive_bent", |bencher| bencher.iter(|| black_box(naive_bent(exposure, focal_pixels))));
    group.finish();
}

criterion_group!(frame_benches, benches);
criterion_main!(frame_benches);
