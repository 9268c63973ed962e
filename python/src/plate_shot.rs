//! Weather over single pictures: one frame of a small scene over a plate that is an array. What does not depend on the picture is kept from call to call.

use std::{path::PathBuf, sync::Arc};

use bansho::{
    ColorSpace, CompiledScene, DisplayImage, DisplayOptions, Frame, Plan, PlanOptions, RenderError, Scene, SceneLinear,
    SceneOptions,
    base::{
        color::LinearTransform,
        frame::DisplayPixels,
        host::assets::{DepthMap, Encoding, Picture},
        math::simd,
    },
};
use numpy::{PyReadonlyArray2, PyReadonlyArray3};
use pyo3::{prelude::*, types::PyDict};
use rayon::prelude::*;

use crate::{
    assets::{self, ArrayAssets},
    error, frame, scene, work,
};

/// Names of the arrays in the scene.
const IMAGE: &str = "image";
const DEPTH: &str = "depth";

/// Draws scenes over pictures of the same size, one after the other.
#[pyclass(module = "bansho._bansho", frozen)]
pub(crate) struct PlateShot {
    state: work::PoolMutex<State>,
    threads: usize,
}

/// What is kept from call to call.
struct State {
    assets: Arc<ArrayAssets>,
    shot: Option<bansho::Shot>,
}

/// A picture as Python passes it.
#[derive(FromPyObject)]
enum Pixels<'py> {
    Codes(PyReadonlyArray3<'py, u8>),
    Floats(PyReadonlyArray3<'py, f32>),
}

/// A picture that weather is drawn over.
struct Plate {
    image: Picture,
    depth: Option<DepthMap>,
}

/// A picture, or the codes of one, which are converted in the pool.
enum Source<'a> {
    Codes((assets::Shape, &'a [u8])),
    Picture(Picture),
}

impl Source<'_> {
    /// The picture, in the memory of an earlier one.
    fn picture(self, memory: Vec<[u8; 4]>) -> PyResult<Picture> {
        match self {
            Self::Codes(codes) => assets::picture_of_codes(codes, memory),
            Self::Picture(picture) => Ok(picture),
        }
    }
}

/// What is drawn: codes of a picture of codes, light of a picture of light.
enum Drawn {
    Codes(DisplayImage, Option<Frame>),
    Light(Frame),
}

enum Failure {
    Scene(bansho::SceneError),
    Plan(bansho::PlanError),
    Render(RenderError),
    Exception(PyErr),
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Scene(problems) => error::scene(&problems),
            Failure::Plan(reason) => error::plan(&reason),
            Failure::Render(reason) => error::render(&reason),
            Failure::Exception(exception) => exception,
        }
    }
}

impl State {
    /// Draws frame `number` of a scene.
    fn draw(
        &mut self,
        scene: Scene,
        text: &str,
        plate: Plate,
        [number, is_truth]: [i64; 2],
        observer: &work::Interruption,
    ) -> Result<Drawn, Failure> {
        let is_light = plate.image.encoding != Encoding::DisplaySrgb;
        self.assets.set_pictures(IMAGE, vec![plate.image]);
        self.assets.set_depths(DEPTH, plate.depth.into_iter().collect());
        let previous = self.shot.as_ref().map(|shot| shot.compiled().clone());
        let compiled = CompiledScene::build(Arc::new(scene), self.assets.clone(), previous.as_deref());
        let compiled = Arc::new(compiled.map_err(|errors| Failure::Scene(errors.located("scene", text)))?);
        let mut plan = Plan::new(&compiled, &PlanOptions::default()).map_err(Failure::Plan)?;
        (plan.fingerprint_frames, plan.depth) = (false, false);
        let plan = Arc::new(plan);
        let mut shot = match self.shot.take() {
            // Its memory and what depends on the camera alone are used again; the wind begins anew below.
            Some(mut shot) => {
                shot.replace_scene(compiled);
                shot.replace_plan(plan.clone());
                shot.restart();
                shot
            }
            None => bansho::Shot::open(compiled, plan.clone()),
        };
        let drawn = draw(&mut shot, &plan, [number, is_truth], is_light, observer);
        self.shot = Some(shot);
        drawn.map_err(Failure::Render)
    }
}

fn draw(
    shot: &mut bansho::Shot,
    plan: &Arc<Plan>,
    [number, is_truth]: [i64; 2],
    is_light: bool,
    observer: &work::Interruption,
) -> Result<Drawn, RenderError> {
    shot.advance(number, observer)?;
    if is_light && is_truth == 0 {
        return Ok(Drawn::Light(shot.draw(&SceneLinear, observer)?));
    }
    let mut with_truth = Plan::clone(plan);
    (with_truth.aovs, with_truth.layers) = (true, true);
    if is_light {
        shot.replace_plan(Arc::new(with_truth));
        return Ok(Drawn::Light(shot.draw(&SceneLinear, observer)?));
    }
    let codes = shot.draw(&DisplayOptions { view: plan.display, ..DisplayOptions::default() }, observer)?.image;
    if is_truth == 0 {
        return Ok(Drawn::Codes(codes, None));
    }
    shot.replace_plan(Arc::new(with_truth));
    Ok(Drawn::Codes(codes, Some(shot.draw(&SceneLinear, observer)?)))
}

#[pymethods]
impl PlateShot {
    #[new]
    fn new(threads: Option<i64>) -> PyResult<Self> {
        let assets = Arc::new(ArrayAssets::new(PathBuf::new(), 0));
        Ok(Self { state: work::PoolMutex::new(State { assets, shot: None }), threads: work::thread_count(threads)? })
    }

    /// Draws frame `number` of the scene `text`, whose plate is `image` with `depth`. Codes (sRGB) become codes, floats (`encoding`) linear sRGB. With `truth`
    /// a dictionary of channels comes with it.
    fn draw<'py>(
        &self,
        py: Python<'py>,
        text: &str,
        image: Pixels<'py>,
        encoding: &str,
        depth: Option<PyReadonlyArray2<'py, f32>>,
        number: i64,
        truth: bool,
    ) -> PyResult<(Bound<'py, PyAny>, Option<Bound<'py, PyDict>>)> {
        let scene = scene::parse(text, "scene")?;
        let scene = scene.with_options(&SceneOptions::default()).map_err(|looping| error::looping(&looping))?;
        let encoding = assets::parse_encoding(encoding)?;
        let image = match &image {
            Pixels::Codes(codes) => Source::Codes(assets::codes_of(codes)?),
            Pixels::Floats(values) => Source::Picture(assets::picture_of_floats(values, encoding)?),
        };
        let depth = depth.as_ref().map(assets::depths_of).transpose()?;
        let frame = [number, i64::from(truth)];
        let drawn = self.state.run(py, self.threads, |state, observer| {
            // The last plate is not drawn again.
            let (pixels, depths) = (state.assets.take_picture_memory(IMAGE), state.assets.take_depth_memory(DEPTH));
            let image = image.picture(pixels).map_err(Failure::Exception)?;
            let depth = depth.map(|depth| assets::depth_map(depth, depths)).transpose().map_err(Failure::Exception)?;
            let drawn = state.draw(scene, text, Plate { image, depth }, frame, observer)?;
            Ok::<Converted, Failure>(Converted::of(drawn))
        })??;
        drawn.into_python(py)
    }
}

/// What is drawn, in the layout of the arrays.
struct Converted {
    size: [usize; 2],
    codes: Option<Vec<[u8; 3]>>,
    light: Option<Vec<[f32; 4]>>,
    truth: Option<Frame>,
}

impl Converted {
    fn of(drawn: Drawn) -> Self {
        match drawn {
            Drawn::Codes(image, truth) => {
                let codes = match image.pixels {
                    DisplayPixels::Eight(codes) => without_alpha(&codes, |code| code),
                    // Eight bits are asked for.
                    DisplayPixels::Sixteen(codes) => without_alpha(&codes, |code| (code >> 8) as u8),
                };
                Self { size: [image.height, image.width], codes: Some(codes), light: None, truth }
            }
            Drawn::Light(frame) => {
                let mut light = vec![[0.0; 4]; frame.beauty.pixels().len()];
                let transform = LinearTransform::new(ColorSpace::LinearSrgb, None);
                transform.rgba32f_row(simd::level(), frame.beauty.pixels(), &mut light);
                let size = [frame.beauty.height(), frame.beauty.width()];
                Self { size, codes: None, light: Some(light), truth: Some(frame) }
            }
        }
    }

    fn into_python(self, py: Python<'_>) -> PyResult<(Bound<'_, PyAny>, Option<Bound<'_, PyDict>>)> {
        let [height, width] = self.size;
        let truth = self.truth.map(|frame| frame::frame_dictionary(py, frame)).transpose()?;
        let picture = match (self.codes, self.light) {
            (Some(codes), _) => frame::array3(py, [height, width, 3], codes.into_flattened())?.into_any(),
            (None, light) => {
                frame::array3(py, [height, width, 4], light.unwrap_or_default().into_flattened())?.into_any()
            }
        };
        Ok((picture, truth))
    }
}

/// Red, green and blue of codes, as codes of 8 bits.
fn without_alpha<T: Copy + Sync>(codes: &[[T; 4]], code_of: impl Fn(T) -> u8 + Sync) -> Vec<[u8; 3]> {
    /// Pixels that a task copies.
    const TASK_PIXELS: usize = 1 << 13;
    let mut opaque = vec![[0; 3]; codes.len()];
    opaque.par_chunks_mut(TASK_PIXELS).zip(codes.par_chunks(TASK_PIXELS)).for_each(|(opaque, codes)| {
        for (pixel, &[r, g, b, _]) in opaque.iter_mut().zip(codes) {
            *pixel = [code_of(r), code_of(g), code_of(b)];
        }
    });
    opaque
}
