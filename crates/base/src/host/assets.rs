//! Assets that a scene refers to by name: pictures, meshes, drawings and text, wherever they are stored.

use std::{collections::BTreeMap, sync::Arc};

use super::{memory, picture_pixels::PicturePixels};
use crate::{
    color::AlphaConvention,
    geometry::{
        mesh::{Mesh, MeshError},
        strokes::Drawing,
    },
    image::Image,
};

/// Color encoding of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Display-referred: sRGB-encoded values from 0 to 1 (PNG, JPEG).
    DisplaySrgb,
    /// Linear light with the sRGB (Rec. 709) primaries, D65: an EXR file that states no other chromaticities.
    LinearSrgb,
    /// Linear light in ACEScg (AP1, D60).
    LinearAcescg,
}

/// How the alpha of a picture relates to its colors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PictureAlpha {
    /// Its alpha is 1 everywhere.
    #[default]
    Opaque,
    /// Colors are not multiplied by alpha, and blend in the values of this convention (PNG, WebP, TIFF).
    Straight(AlphaConvention),
    /// Colors are multiplied by alpha, and blend in linear light (EXR).
    Associated,
}

impl PictureAlpha {
    /// The values of a pixel multiplied by its alpha, between which pixels are interpolated.
    #[inline(always)]
    #[must_use]
    pub fn premultiplied(self, [r, g, b, a]: [f32; 4]) -> [f32; 4] {
        match self {
            Self::Straight(_) => [r * a, g * a, b * a, a],
            Self::Opaque | Self::Associated => [r, g, b, a],
        }
    }
}

/// A decoded picture, as a viewer shows it: turned as its file says, in known colors.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Red, green, blue in `encoding`, and alpha (1 where the file has none).
    pub color: PicturePixels,
    /// How alpha relates to the colors.
    pub alpha: PictureAlpha,
    /// The file's depth channel (`Z`), if it has one; row after row.
    pub depth: Option<Vec<f32>>,
    /// Encoding of the colors.
    pub encoding: Encoding,
    /// Exposure value at ISO 100 with which it was taken, if the file records it.
    pub exposure_ev100: Option<f64>,
    /// What users should know about how the file was read.
    pub remarks: Vec<PictureRemark>,
}

impl Picture {
    /// An opaque picture without depth.
    pub fn opaque(color: impl Into<PicturePixels>, encoding: Encoding) -> Self {
        let (alpha, depth) = (PictureAlpha::Opaque, None);
        Self { color: color.into(), alpha, depth, encoding, exposure_ev100: None, remarks: Vec::new() }
    }
}

/// The depth of a picture, in the units of its file.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthMap {
    /// Values; for integers the codes. Not finite, or 0, where the depth is unknown or infinite.
    pub values: Image<1>,
    /// What users should know about how the file was read.
    pub remarks: Vec<PictureRemark>,
}

/// The normals of a picture, as its file has them.
#[derive(Clone, Debug, PartialEq)]
pub struct NormalMap {
    /// Components x, y and z; all 0 or not a number where the normal is unknown.
    pub values: Image<3>,
    /// What users should know about how the file was read.
    pub remarks: Vec<PictureRemark>,
}

/// Which layers of a picture are read; by default those that conventions of renderers name.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct PictureLayers {
    /// The layer of the colors.
    pub image: Option<String>,
    /// The layer or channel of the depth.
    pub depth: Option<String>,
}

/// What users should know about how a picture was read: what was used without being asked for, and what was not honored.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PictureRemark {
    /// Some of its pixels are not opaque.
    #[error("its alpha is used: where it is transparent, what is behind it is seen, or the picture is transparent ({})", blending(*.0))]
    AlphaUsed(PictureAlpha),
    /// Its color profile is damaged or of a kind that is not supported.
    #[error("its ICC profile cannot be used ({0}), so its values are interpreted as sRGB")]
    Profile(String),
    /// It states colors that are unknown or contradictory.
    #[error("{0}, so its values are interpreted as sRGB")]
    Colors(String),
    /// Its values exceed the white of a display.
    #[error("its values are {transfer}: {white} cd/m^2 is display white")]
    HighDynamicRange {
        /// Name of the transfer function.
        transfer: &'static str,
        /// Luminance of display white, cd/m^2.
        white: f32,
    },
    /// Its Exif data are damaged.
    #[error(
        "its Exif data are damaged{} ({reason}); orientation and exposure may be missing",
        at.map(|at| format!(" at byte {at} of the Exif block")).unwrap_or_default()
    )]
    Exif {
        /// Where: bytes from the beginning of their TIFF header, which Exif data count offsets from; `None` if unknown.
        at: Option<usize>,
        /// What is wrong.
        reason: String,
    },
    /// Its orientation has no meaning.
    #[error("its orientation is {0} (allowed: 1 to 8), so it is not rotated")]
    Orientation(u32),
    /// Its pixels are not square.
    #[error(
        "its pixels are {0} times as wide as high (pixelAspectRatio), but drawn as squares; resize it to square pixels"
    )]
    PixelAspect(f32),
    /// Its data are damaged in a part, which decoders fill.
    #[error("a part of its data is corrupt ({0}), so a part of the picture may be wrong")]
    Corrupt(String),
    /// It is an animation or has several pages.
    #[error("it has several pictures, of which the first is used")]
    SeveralPictures,
}

/// Words for how alpha blends.
fn blending(alpha: PictureAlpha) -> &'static str {
    match alpha {
        PictureAlpha::Opaque => "opaque",
        PictureAlpha::Straight(AlphaConvention::Encoded) => "straight, blended in encoded values",
        PictureAlpha::Straight(AlphaConvention::Linear) => "straight, blended in linear light",
        PictureAlpha::Associated => "associated, blended in linear light",
    }
}

/// Why an asset could not be loaded.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{path}: {problem}")]
pub struct AssetError {
    /// The asset's path, resolved as far as possible.
    pub path: String,
    /// What is wrong.
    pub problem: AssetProblem,
}

fn other_inputs_note(others: u64) -> String {
    if others == 0 { String::new() } else { format!(", since other inputs take {}", memory::format_bytes(others)) }
}

fn found_instead_note(instead: &[&str]) -> String {
    if instead.is_empty() { String::new() } else { format!(", only {}", instead.join(", ")) }
}

/// Most layers that an error lists.
const LISTED_LAYERS: usize = 24;

fn counted_names(names: &[String]) -> String {
    let listed = names.iter().take(LISTED_LAYERS).cloned().collect::<Vec<_>>().join(", ");
    match names.len().saturating_sub(LISTED_LAYERS) {
        0 => listed,
        more => format!("{listed} and {more} more"),
    }
}

/// What can be wrong with an asset.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AssetProblem {
    /// There is no such file.
    #[error("no such file")]
    Missing,
    /// There is no such file, and its name has the placeholder of another program for the frame number.
    #[error("no such file; write `{own}` for the frame number instead of `{placeholder}`")]
    OtherPlaceholder {
        /// The placeholder in its name.
        placeholder: String,
        /// The placeholder to write instead.
        own: String,
    },
    /// The file name has more than one placeholder for the frame number, or one with too many digits.
    #[error(
        "must have exactly one placeholder for the frame number; allowed: one run of up to 20 `#` in the file name"
    )]
    FrameNumber,
    /// It exists but cannot be read.
    #[error("cannot be read: {0}")]
    Unreadable(String),
    /// It is not a regular file but a folder, a pipe or a device.
    #[error("is {found}; allowed: a regular file")]
    NotAFile {
        /// What it is, such as `a pipe`.
        found: &'static str,
    },
    /// The file is too large.
    #[error("has {bytes} bytes; allowed: up to {limit}")]
    FileSize {
        /// Size of the file, bytes.
        bytes: u64,
        /// Largest size that is read, bytes.
        limit: u64,
    },
    /// It would exceed the memory limit for the inputs of a scene.
    #[error("would take {} of memory; allowed: up to {}{}", memory::format_bytes(*.bytes), memory::format_bytes(*.limit), other_inputs_note(*.others))]
    Memory {
        /// Upper bound of the memory that reading it takes, bytes.
        bytes: u64,
        /// Bytes that it may occupy.
        limit: u64,
        /// Bytes that other inputs of the scene occupy already; they lower the limit.
        others: u64,
    },
    /// It would need more memory than the system has.
    #[error("would take {} of memory, more than is available", memory::format_bytes(*.bytes))]
    NoMemory {
        /// Upper bound of the memory that reading it takes, bytes.
        bytes: u64,
    },
    /// It is outside the folder that a scene is confined to.
    #[error("lies outside {root}, the asset root of this scene; allowed: files within it")]
    Outside {
        /// The folder.
        root: String,
    },
    /// The error message of another program that tried to load it.
    #[error("{0}")]
    Reported(String),
    /// A drawing without strokes.
    #[error("contains no strokes{} (allowed: an SVG file with path, polyline, polygon or line elements)", found_instead_note(.instead))]
    NoStrokes {
        /// Names of the elements that it contains instead.
        instead: Vec<&'static str>,
    },
    /// The requested stroke is not in the drawing.
    #[error("has no stroke with the id `{0}`")]
    NoStroke(String),
    /// The extension of its name is not that of a supported picture format.
    #[error("is not a supported picture format; allowed: .png, .jpg, .jpeg, .exr, .webp, .tif, .tiff")]
    UnknownKind,
    /// The extension of its name is not that of a supported format of depth.
    #[error("is not a supported depth format; allowed: .exr, .png, .pfm, .npy, .tif, .tiff")]
    UnknownDepthKind,
    /// The extension of its name is not that of a supported format of normals.
    #[error("is not a supported format of normals; allowed: .exr")]
    UnknownNormalKind,
    /// It is of a format that is known, and not read.
    #[error("is {format}, which Bansho does not read; {advice}")]
    UnsupportedFormat {
        /// The format, with its article.
        format: &'static str,
        /// What to convert it to, and how.
        advice: &'static str,
    },
    /// The requested layer is not in the picture.
    #[error("has no layer `{layer}` of {use_of_layer}; it has {}", counted_names(.layers))]
    NoLayer {
        /// The layer.
        layer: String,
        /// What it would be used for.
        use_of_layer: &'static str,
        /// The layers that it has.
        layers: Vec<String>,
    },
    /// None of its layers is known to be what is needed.
    #[error("has no layer that is recognized as {use_of_layer}; it has {}; select one with `{key}` in [plate]", counted_names(.layers))]
    NoKnownLayer {
        /// What it would be used for.
        use_of_layer: &'static str,
        /// The key that chooses a layer.
        key: &'static str,
        /// The layers that it has.
        layers: Vec<String>,
    },
    /// The extension of its name is not that of a supported mesh format.
    #[error("is not a supported mesh format; allowed: .glb, .gltf")]
    UnknownMeshKind,
    /// It contains no usable mesh.
    #[error("contains no usable mesh: {0}")]
    Mesh(#[from] MeshError),
    /// Its contents are damaged or do not match the extension of its name.
    #[error("is damaged, or its contents do not match the extension of its name: {0}")]
    Damaged(String),
    /// Its stated width or height is too large.
    #[error("claims {width} x {height} pixels; allowed: up to {limit} per side")]
    TooLarge {
        /// Claimed width.
        width: u64,
        /// Claimed height.
        height: u64,
        /// Maximum number of pixels per side.
        limit: u64,
    },
    /// Its stated number of pixels is too large.
    #[error("claims {width} x {height} pixels; allowed: up to {limit} in total")]
    TooManyPixels {
        /// Claimed width.
        width: u64,
        /// Claimed height.
        height: u64,
        /// Maximum number of pixels.
        limit: u64,
    },
    /// The requested channel is not in the picture.
    #[error("has no channel `{0}`")]
    NoChannel(String),
}

/// Loads the assets of a scene. `####` in a path stands for the frame number with leading zeros.
///
/// Implementations may cache assets and may be called from several threads.
pub trait Assets: Send + Sync {
    /// The picture at `path`, for frame `frame` if it is a sequence.
    ///
    /// # Errors
    /// The asset is missing, damaged, too large or not a picture.
    fn picture(&self, path: &str, frame: i64) -> Result<Arc<Picture>, AssetError>;

    /// As [`picture`](Self::picture), with these layers of a file that has several. What knows no layers ignores them.
    ///
    /// # Errors
    /// As [`picture`](Self::picture), or the picture has no such layer.
    fn picture_layers(&self, path: &str, frame: i64, _layers: &PictureLayers) -> Result<Arc<Picture>, AssetError> {
        self.picture(path, frame)
    }

    /// The depth at `path`, for frame `frame` if it is a sequence, from the layer or channel `layer`.
    ///
    /// # Errors
    /// The asset is missing, damaged, too large or has no depth.
    fn depth(&self, path: &str, frame: i64, layer: Option<&str>) -> Result<Arc<DepthMap>, AssetError> {
        let layers = PictureLayers { image: None, depth: layer.map(str::to_owned) };
        let picture = self.picture_layers(path, frame, &layers)?;
        let (width, height) = (picture.color.width(), picture.color.height());
        let pixels = picture.depth.as_ref().map(|values| values.iter().map(|&value| [value]).collect());
        match pixels.and_then(|pixels| Image::from_pixels(width, height, pixels)) {
            Some(values) => Ok(Arc::new(DepthMap { values, remarks: picture.remarks.clone() })),
            None => Err(AssetError { path: path.to_owned(), problem: AssetProblem::NoChannel("Z".into()) }),
        }
    }

    /// The normals at `path`, for frame `frame` if it is a sequence: the colors of the picture, as they are.
    ///
    /// # Errors
    /// The asset is missing, damaged, too large or has no normals.
    fn normals(&self, path: &str, frame: i64) -> Result<Arc<NormalMap>, AssetError> {
        let picture = self.picture(path, frame)?;
        let pixels = picture.color.iter().map(|[x, y, z, _]| [x, y, z]).collect();
        let values = Image::from_pixels(picture.color.width(), picture.color.height(), pixels);
        let missing = || AssetError { path: path.to_owned(), problem: AssetProblem::NoChannel("X".into()) };
        Ok(Arc::new(NormalMap { values: values.ok_or_else(missing)?, remarks: picture.remarks.clone() }))
    }

    /// All triangles of the scene at `path`, in its own coordinates.
    ///
    /// # Errors
    /// The asset is missing, too large, damaged, or contains no triangles.
    fn mesh(&self, path: &str) -> Result<Arc<Mesh>, AssetError>;

    /// The strokes of the line drawing at `path`.
    ///
    /// # Errors
    /// The asset is missing, damaged, too large, or contains no strokes.
    fn drawing(&self, path: &str) -> Result<Arc<Drawing>, AssetError>;

    /// The text at `path`.
    ///
    /// # Errors
    /// The asset is missing or not UTF-8.
    fn text(&self, path: &str) -> Result<Arc<str>, AssetError>;

    /// Checks that there is a readable asset at `path` for frame `frame`, without reading it.
    ///
    /// # Errors
    /// The asset is missing or unreadable.
    fn find(&self, path: &str, frame: i64) -> Result<(), AssetError> {
        self.digest(path, frame).map(drop)
    }

    /// Checks without decoding it that the picture or the depth at `path` for frame `frame` is whole, as far as its structure tells; its width and height, or
    /// `None` where only decoding tells them.
    ///
    /// # Errors
    /// The asset is missing, unreadable or damaged.
    fn check_whole(&self, path: &str, frame: i64) -> Result<Option<[usize; 2]>, AssetError> {
        self.find(path, frame).map(|()| None)
    }

    /// A digest of the contents of `path` for frame `frame`: assets with equal digests are the same.
    ///
    /// # Errors
    /// The asset is missing or unreadable.
    fn digest(&self, path: &str, frame: i64) -> Result<[u8; 32], AssetError>;
}

/// Assets in memory, for programs that embed Bansho and for tests. Digests depend on the path only.
#[derive(Clone, Debug, Default)]
pub struct MemoryAssets {
    pictures: BTreeMap<String, Arc<Picture>>,
    drawings: BTreeMap<String, Arc<Drawing>>,
    meshes: BTreeMap<String, Arc<Mesh>>,
    texts: BTreeMap<String, Arc<str>>,
}

impl MemoryAssets {
    /// Stores `picture` under `path`.
    pub fn insert_picture(&mut self, path: impl Into<String>, picture: Picture) {
        self.pictures.insert(path.into(), Arc::new(picture));
    }

    /// Stores `mesh` under `path`.
    pub fn insert_mesh(&mut self, path: impl Into<String>, mesh: Mesh) {
        self.meshes.insert(path.into(), Arc::new(mesh));
    }

    /// Stores `drawing` under `path`.
    pub fn insert_drawing(&mut self, path: impl Into<String>, drawing: Drawing) {
        self.drawings.insert(path.into(), Arc::new(drawing));
    }

    /// Stores `text` under `path`.
    pub fn insert_text(&mut self, path: impl Into<String>, text: impl Into<Arc<str>>) {
        self.texts.insert(path.into(), text.into());
    }
}

fn missing(path: &str) -> AssetError {
    AssetError { path: path.to_owned(), problem: AssetProblem::Missing }
}

impl Assets for MemoryAssets {
    fn picture(&self, path: &str, _frame: i64) -> Result<Arc<Picture>, AssetError> {
        self.pictures.get(path).cloned().ok_or_else(|| missing(path))
    }

    fn mesh(&self, path: &str) -> Result<Arc<Mesh>, AssetError> {
        self.meshes.get(path).cloned().ok_or_else(|| missing(path))
    }

    fn drawing(&self, path: &str) -> Result<Arc<Drawing>, AssetError> {
        self.drawings.get(path).cloned().ok_or_else(|| missing(path))
    }

    fn text(&self, path: &str) -> Result<Arc<str>, AssetError> {
        self.texts.get(path).cloned().ok_or_else(|| missing(path))
    }

    fn digest(&self, path: &str, _frame: i64) -> Result<[u8; 32], AssetError> {
        let is_picture = self.pictures.contains_key(path) || self.drawings.contains_key(path);
        if !is_picture && !self.meshes.contains_key(path) && !self.texts.contains_key(path) {
            return Err(missing(path));
        }
        let mut digest = [0; 32];
        for (slot, byte) in path.bytes().enumerate() {
            digest[slot % 32] ^= byte.rotate_left((slot / 32) as u32);
        }
        Ok(digest)
    }
}
