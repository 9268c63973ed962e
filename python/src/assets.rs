//! Pictures and depths that are arrays, by name, in front of the files of a scene's folder. Nothing touches the disk.

use std::{
    collections::BTreeMap,
    path::PathBuf,
    sync::{
        Arc, PoisonError, RwLock,
        atomic::{AtomicU64, Ordering},
    },
};

use bansho::{
    Assets, Image,
    base::{
        geometry::{mesh::Mesh, strokes::Drawing},
        host::{
            assets::{AssetError, AssetProblem, DepthMap, Encoding, NormalMap, Picture, PictureAlpha, PictureLayers},
            picture_pixels::{CodeImage, PicturePixels},
        },
    },
    media::assets::FileAssets,
};
use numpy::{PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::{error, work};

/// Numbers of arrays: no two have the same, so that a picture that was put in place of another is never taken for it.
static NEXT_NUMBER: AtomicU64 = AtomicU64::new(1);

/// An array as an asset, with its number.
#[derive(Clone)]
struct Stored<T> {
    number: u64,
    content: Arc<T>,
}

impl<T> Stored<T> {
    fn new(content: T) -> Self {
        Self { number: NEXT_NUMBER.fetch_add(1, Ordering::Relaxed), content: Arc::new(content) }
    }

    fn digest(&self) -> [u8; 32] {
        let mut digest = *b"bansho array of a program       ";
        digest[24..].copy_from_slice(&self.number.to_le_bytes());
        digest
    }
}

/// The arrays of a shot by name: one for all frames, or one for each frame from the first on.
#[derive(Default)]
struct Stores {
    pictures: BTreeMap<String, Vec<Stored<Picture>>>,
    depths: BTreeMap<String, Vec<Stored<DepthMap>>>,
}

/// Arrays by name, in front of the files of a folder.
pub(crate) struct ArrayAssets {
    stores: RwLock<Stores>,
    first_frame: i64,
    files: FileAssets,
}

impl ArrayAssets {
    /// No arrays yet, and the files of `folder`. Frames of sequences are counted from `first_frame`.
    pub(crate) fn new(folder: PathBuf, first_frame: i64) -> Self {
        Self { stores: RwLock::default(), first_frame, files: FileAssets::new(folder) }
    }

    /// Whether any array is stored.
    pub(crate) fn is_empty(&self) -> bool {
        let stores = self.stores.read().unwrap_or_else(PoisonError::into_inner);
        stores.pictures.is_empty() && stores.depths.is_empty()
    }

    /// Stores the pictures of `name` in place of all before: one, or one for each frame.
    pub(crate) fn set_pictures(&self, name: &str, pictures: Vec<Picture>) {
        let stored = pictures.into_iter().map(Stored::new).collect();
        self.stores.write().unwrap_or_else(PoisonError::into_inner).pictures.insert(name.to_owned(), stored);
    }

    /// Takes away the pictures of `name`. Returns the memory of the first, if it is of codes and nothing else refers to it.
    pub(crate) fn take_picture_memory(&self, name: &str) -> Vec<[u8; 4]> {
        let stored = self.stores.write().unwrap_or_else(PoisonError::into_inner).pictures.remove(name);
        let first = stored.and_then(|stored| Arc::into_inner(stored.into_iter().next()?.content));
        match first.map(|picture| picture.color) {
            Some(PicturePixels::Codes(codes)) => codes.into_pixels(),
            _ => Vec::new(),
        }
    }

    /// Takes away the depths of `name`. Returns the memory of the first, if nothing else refers to it.
    pub(crate) fn take_depth_memory(&self, name: &str) -> Vec<[f32; 1]> {
        let stored = self.stores.write().unwrap_or_else(PoisonError::into_inner).depths.remove(name);
        let first = stored.and_then(|stored| Arc::into_inner(stored.into_iter().next()?.content));
        first.map_or_else(Vec::new, |depth| depth.values.into_pixels())
    }

    /// Stores the depths of `name` in place of all before: one, or one for each frame.
    pub(crate) fn set_depths(&self, name: &str, depths: Vec<DepthMap>) {
        let stored = depths.into_iter().map(Stored::new).collect();
        self.stores.write().unwrap_or_else(PoisonError::into_inner).depths.insert(name.to_owned(), stored);
    }

    /// The item of frame `frame` of a name; `None` for names that are files.
    fn at_frame<T: Clone>(&self, items: Option<&Vec<T>>, path: &str, frame: i64) -> Option<Result<T, AssetError>> {
        let items = items?;
        let index = if items.len() == 1 { Some(0) } else { usize::try_from(frame - self.first_frame).ok() };
        Some(index.and_then(|index| items.get(index)).cloned().ok_or_else(|| {
            let (first, count) = (self.first_frame, items.len() as i64);
            let problem = AssetProblem::Reported(format!(
                "has no picture for frame {frame}; allowed: frames {first} to {}",
                first + count - 1
            ));
            AssetError { path: path.to_owned(), problem }
        }))
    }

    fn stored_picture(&self, path: &str, frame: i64) -> Option<Result<Stored<Picture>, AssetError>> {
        let stores = self.stores.read().unwrap_or_else(PoisonError::into_inner);
        self.at_frame(stores.pictures.get(path), path, frame)
    }

    fn stored_depth(&self, path: &str, frame: i64) -> Option<Result<Stored<DepthMap>, AssetError>> {
        let stores = self.stores.read().unwrap_or_else(PoisonError::into_inner);
        self.at_frame(stores.depths.get(path), path, frame)
    }
}

impl Assets for ArrayAssets {
    fn picture(&self, path: &str, frame: i64) -> Result<Arc<Picture>, AssetError> {
        match self.stored_picture(path, frame) {
            Some(stored) => Ok(stored?.content),
            None => self.files.picture(path, frame),
        }
    }

    fn picture_layers(&self, path: &str, frame: i64, layers: &PictureLayers) -> Result<Arc<Picture>, AssetError> {
        match self.stored_picture(path, frame) {
            Some(stored) => Ok(stored?.content),
            None => self.files.picture_layers(path, frame, layers),
        }
    }

    fn depth(&self, path: &str, frame: i64, layer: Option<&str>) -> Result<Arc<DepthMap>, AssetError> {
        match self.stored_depth(path, frame) {
            Some(stored) => Ok(stored?.content),
            None => self.files.depth(path, frame, layer),
        }
    }

    fn normals(&self, path: &str, frame: i64) -> Result<Arc<NormalMap>, AssetError> {
        let Some(stored) = self.stored_picture(path, frame) else { return self.files.normals(path, frame) };
        let color = &stored?.content.color;
        let pixels = color.iter().map(|[x, y, z, _]| [x, y, z]).collect();
        let values = Image::from_pixels(color.width(), color.height(), pixels);
        let missing = || AssetError { path: path.to_owned(), problem: AssetProblem::NoChannel("X".into()) };
        Ok(Arc::new(NormalMap { values: values.ok_or_else(missing)?, remarks: Vec::new() }))
    }

    fn mesh(&self, path: &str) -> Result<Arc<Mesh>, AssetError> {
        self.files.mesh(path)
    }

    fn drawing(&self, path: &str) -> Result<Arc<Drawing>, AssetError> {
        self.files.drawing(path)
    }

    fn text(&self, path: &str) -> Result<Arc<str>, AssetError> {
        self.files.text(path)
    }

    fn digest(&self, path: &str, frame: i64) -> Result<[u8; 32], AssetError> {
        if let Some(stored) = self.stored_picture(path, frame) {
            return Ok(stored?.digest());
        }
        match self.stored_depth(path, frame) {
            Some(stored) => Ok(stored?.digest()),
            None => self.files.digest(path, frame),
        }
    }
}

/// The shape and the codes of an array of codes.
pub(crate) fn codes_of<'a>(codes: &'a PyReadonlyArray3<u8>) -> PyResult<(Shape, &'a [u8])> {
    Ok((checked_shape(codes.shape())?, contiguous(codes.as_slice())?))
}

/// A picture of sRGB codes in rows, in the pool of the caller and in the memory of an earlier one; alpha is straight and blends encoded values.
pub(crate) fn picture_of_codes((shape, codes): (Shape, &[u8]), memory: Vec<[u8; 4]>) -> PyResult<Picture> {
    let color = CodeImage::from_pixels(shape.width, shape.height, pixels_of_codes(shape, codes, memory));
    picture(shape, color, Encoding::DisplaySrgb)
}

/// Pixels that a task copies or converts.
const TASK_PIXELS: usize = 1 << 13;

/// Codes with alpha, in the pool of the caller and in the memory of earlier ones.
fn pixels_of_codes(shape: Shape, codes: &[u8], memory: Vec<[u8; 4]>) -> Vec<[u8; 4]> {
    let mut pixels = resized(memory, shape.height * shape.width, [0; 4]);
    let tasks = pixels.par_chunks_mut(TASK_PIXELS).zip(codes.par_chunks(TASK_PIXELS * shape.channels));
    tasks.for_each(|(pixels, codes)| match shape.channels {
        3 => {
            for (pixel, &[r, g, b]) in pixels.iter_mut().zip(codes.as_chunks::<3>().0) {
                *pixel = [r, g, b, u8::MAX];
            }
        }
        _ => pixels.copy_from_slice(codes.as_chunks::<4>().0),
    });
    pixels
}

/// `count` values, in the memory of others if there were as many, which then stay; else each is `value`.
fn resized<T: Clone>(memory: Vec<T>, count: usize, value: T) -> Vec<T> {
    // Memory that is new and zero is not written.
    if memory.len() == count { memory } else { vec![value; count] }
}

/// A picture of floats, height x width x 3 or 4. Alpha of linear light is associated, else straight.
pub(crate) fn picture_of_floats(values: &PyReadonlyArray3<f32>, encoding: Encoding) -> PyResult<Picture> {
    let (shape, values) = (checked_shape(values.shape())?, contiguous(values.as_slice())?);
    if let Some(unusable) = values.iter().find(|value| !value.is_finite()) {
        return Err(error::value(format!("an image with the value {unusable}; allowed: finite numbers")));
    }
    let pixels = match shape.channels {
        3 => values.as_chunks::<3>().0.iter().map(|&[r, g, b]| [r, g, b, 1.0]).collect(),
        _ => values.as_chunks::<4>().0.to_vec(),
    };
    picture(shape, Image::from_pixels(shape.width, shape.height, pixels), encoding)
}

/// A picture of pixels, of which there are as many as the shape says.
fn picture(shape: Shape, color: Option<impl Into<PicturePixels>>, encoding: Encoding) -> PyResult<Picture> {
    let color = color.ok_or_else(|| error::value("an image without pixels".to_owned()))?;
    let mut picture = Picture::opaque(color, encoding);
    if shape.channels == 4 {
        picture.alpha = match encoding {
            Encoding::DisplaySrgb => PictureAlpha::Straight(bansho::AlphaConvention::Encoded),
            Encoding::LinearSrgb | Encoding::LinearAcescg => PictureAlpha::Associated,
        };
    }
    Ok(picture)
}

/// The size (width, height) and the values of an array of depths.
pub(crate) fn depths_of<'a>(depth: &'a PyReadonlyArray2<f32>) -> PyResult<([usize; 2], &'a [f32])> {
    let shape = depth.shape();
    Ok(([shape[1], shape[0]], contiguous(depth.as_slice())?))
}

/// A depth in rows, in the pool of the caller and in the memory of an earlier one. Infinity and 0 are infinitely far away.
pub(crate) fn depth_map(([width, height], values): ([usize; 2], &[f32]), memory: Vec<[f32; 1]>) -> PyResult<DepthMap> {
    let mut depths = resized(memory, values.len(), [0.0]);
    let tasks = depths.par_chunks_mut(TASK_PIXELS).zip(values.par_chunks(TASK_PIXELS));
    let is_usable = tasks.map(|(depths, values)| {
        depths.as_flattened_mut().copy_from_slice(values);
        // All of them, without a branch.
        values.iter().fold(true, |all, value| all & (*value >= 0.0))
    });
    if !is_usable.reduce(|| true, |one, other| one & other)
        && let Some(unusable) = values.iter().find(|value| value.is_nan() || **value < 0.0)
    {
        let allowed = "0 or more, and infinity or 0 where the depth is unknown or infinite";
        return Err(error::value(format!("a depth with the value {unusable}; allowed: {allowed}")));
    }
    let image = Image::from_pixels(width, height, depths);
    let values = image.filter(|image| !image.pixels().is_empty());
    let values = values.ok_or_else(|| error::value("a depth without pixels".to_owned()))?;
    Ok(DepthMap { values, remarks: Vec::new() })
}

/// Height, width and channels of an array of pixels.
#[derive(Clone, Copy)]
pub(crate) struct Shape {
    height: usize,
    width: usize,
    channels: usize,
}

fn checked_shape(shape: &[usize]) -> PyResult<Shape> {
    match *shape {
        [height, width, channels @ (3 | 4)] if height > 0 && width > 0 => Ok(Shape { height, width, channels }),
        _ => {
            Err(error::value(format!("an image of shape {shape:?}; allowed: (height, width, 3) or (height, width, 4)")))
        }
    }
}

fn contiguous<T, E>(slice: Result<&[T], E>) -> PyResult<&[T]> {
    slice.map_err(|_| error::value("an array with gaps between its rows; allowed: numpy.ascontiguousarray".to_owned()))
}

/// Arrays by name, as Python passes them to a shot.
#[pyclass(module = "bansho._bansho", frozen)]
pub(crate) struct Arrays {
    assets: Arc<ArrayAssets>,
}

impl Arrays {
    pub(crate) fn assets(&self) -> Arc<ArrayAssets> {
        self.assets.clone()
    }
}

#[pymethods]
impl Arrays {
    #[new]
    fn new(folder: PathBuf, first_frame: i64) -> Self {
        Self { assets: Arc::new(ArrayAssets::new(folder, first_frame)) }
    }

    /// Pictures of sRGB codes.
    fn set_codes(&self, py: Python<'_>, name: &str, frames: Vec<PyReadonlyArray3<u8>>) -> PyResult<()> {
        let frames = frames.iter().map(codes_of).collect::<PyResult<Vec<_>>>()?;
        let pictures = work::run(py, 1, |_| {
            frames.into_iter().map(|codes| picture_of_codes(codes, Vec::new())).collect::<PyResult<_>>()
        })??;
        self.assets.set_pictures(name, pictures);
        Ok(())
    }

    /// Pictures of floats: "srgb" (encoded), "linear_srgb" or "acescg".
    fn set_floats(&self, name: &str, frames: Vec<PyReadonlyArray3<f32>>, encoding: &str) -> PyResult<()> {
        let encoding = parse_encoding(encoding)?;
        let pictures = frames.iter().map(|frame| picture_of_floats(frame, encoding)).collect::<PyResult<_>>()?;
        self.assets.set_pictures(name, pictures);
        Ok(())
    }

    /// Whether there are none.
    fn is_empty(&self) -> bool {
        self.assets.is_empty()
    }

    /// Depths.
    fn set_depths(&self, py: Python<'_>, name: &str, frames: Vec<PyReadonlyArray2<f32>>) -> PyResult<()> {
        let frames = frames.iter().map(depths_of).collect::<PyResult<Vec<_>>>()?;
        let depths = work::run(py, 1, |_| {
            frames.into_iter().map(|depth| depth_map(depth, Vec::new())).collect::<PyResult<_>>()
        })??;
        self.assets.set_depths(name, depths);
        Ok(())
    }
}

/// The encoding of a name.
pub(crate) fn parse_encoding(name: &str) -> PyResult<Encoding> {
    match name {
        "srgb" => Ok(Encoding::DisplaySrgb),
        "linear_srgb" => Ok(Encoding::LinearSrgb),
        "acescg" => Ok(Encoding::LinearAcescg),
        _ => Err(error::value(format!("the encoding {name:?}; allowed: \"srgb\", \"linear_srgb\", \"acescg\""))),
    }
}
