//! What a scene refers to by name: pictures, meshes, drawings and text, wherever they are kept.

use std::{collections::BTreeMap, sync::Arc};

use super::memory;
use crate::{
    geometry::{
        mesh::{Mesh, MeshError},
        strokes::Drawing,
    },
    image::Image,
};

/// How the numbers of a picture are meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// sRGB-encoded values from 0 to 1, made to be looked at (PNG, JPEG).
    DisplaySrgb,
    /// Linear light in the sRGB (Rec. 709) primaries, D65: an EXR file without other chromaticities.
    LinearSrgb,
    /// Linear light in ACEScg (AP1, D60).
    LinearAcescg,
}

/// A picture that was read.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Red, green, blue, straight alpha (1 where the file has none), in `encoding`.
    pub colour: Image<4>,
    /// The file's depth channel (`Z`), if it has one; row after row.
    pub depth: Option<Vec<f32>>,
    /// What the colors mean.
    pub encoding: Encoding,
    /// Exposure value at ISO 100 with which it was taken, as far as the file records it.
    pub exposure_ev100: Option<f64>,
}

/// Why an asset cannot be had.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{path}: {problem}")]
pub struct AssetError {
    /// The asset's name, resolved as far as it could be.
    pub path: String,
    /// What is wrong.
    pub problem: AssetProblem,
}

fn of_all(others: u64) -> String {
    if others == 0 { String::new() } else { format!(", since other inputs take {}", memory::shown(others)) }
}

fn only(instead: &[&str]) -> String {
    if instead.is_empty() { String::new() } else { format!(", only {}", instead.join(", ")) }
}

/// What can be wrong with an asset.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AssetProblem {
    /// There is nothing of that name.
    #[error("no such file")]
    Missing,
    /// Its name has more than one place for the frame number, or one of too many digits.
    #[error("has no one place for the frame number; allowed: one run of up to 20 `#` in the file's name")]
    FrameNumber,
    /// It is there but cannot be read.
    #[error("cannot be read: {0}")]
    Unreadable(String),
    /// What bears its name holds no bytes with an end: a folder, a pipe, a device.
    #[error("is {found}; allowed: an ordinary file")]
    NotAFile {
        /// What it is, such as `a pipe`.
        found: &'static str,
    },
    /// It has more bytes than are read.
    #[error("has {bytes} bytes; allowed: up to {limit}")]
    FileSize {
        /// How many it has.
        bytes: u64,
        /// Most that are read.
        limit: u64,
    },
    /// It would take more memory than the inputs of a scene may.
    #[error("takes {} of memory once it is read; allowed: up to {}{}", memory::shown(*.bytes), memory::shown(*.limit), of_all(*.others))]
    Memory {
        /// Bytes that it would take while it is read, at the most.
        bytes: u64,
        /// Bytes that it may take.
        limit: u64,
        /// Bytes that other inputs of the scene take already, for which the limit is lower.
        others: u64,
    },
    /// It would take more memory than the system has.
    #[error("takes {} of memory once it is read, more than there is", memory::shown(*.bytes))]
    NoMemory {
        /// Bytes that it would take while it is read, at the most.
        bytes: u64,
    },
    /// It lies outside the folder that a scene is confined to.
    #[error("lies outside {root}, the folder that this scene is confined to; allowed: files within it")]
    Outside {
        /// The folder.
        root: String,
    },
    /// What another program said of it, which had tried.
    #[error("{0}")]
    Told(String),
    /// A drawing without strokes.
    #[error("holds no strokes{} (allowed: an SVG file with path, polyline, polygon or line elements)", only(.instead))]
    NoStrokes {
        /// Names of the elements that it draws instead.
        instead: Vec<&'static str>,
    },
    /// A drawing was asked for a stroke that it lacks.
    #[error("has no stroke of the id `{0}`")]
    NoStroke(String),
    /// Its name ends in something that is not a picture.
    #[error("is not a picture Bansho reads (allowed: .png, .jpg, .jpeg, .exr)")]
    UnknownKind,
    /// Its name ends in something that is not a mesh.
    #[error("is not a mesh Bansho reads (allowed: .glb, .gltf)")]
    UnknownMeshKind,
    /// It holds no usable mesh.
    #[error("holds no usable mesh: {0}")]
    Mesh(#[from] MeshError),
    /// Its contents are damaged or not what the name says.
    #[error("is damaged or not of the kind its name says: {0}")]
    Damaged(String),
    /// It claims to be larger than is allowed.
    #[error("claims {width} x {height} pixels; at most {limit} on a side are read")]
    TooLarge {
        /// Claimed width.
        width: u64,
        /// Claimed height.
        height: u64,
        /// Most pixels on a side.
        limit: u64,
    },
    /// It claims more pixels in all than are allowed.
    #[error("claims {width} x {height} pixels; at most {limit} in all are read")]
    TooManyPixels {
        /// Claimed width.
        width: u64,
        /// Claimed height.
        height: u64,
        /// Most pixels in all.
        limit: u64,
    },
    /// A picture was asked for a channel that it lacks.
    #[error("has no channel `{0}`")]
    NoChannel(String),
}

/// Gives a scene its pictures, meshes and texts. `####` in a path stands for the frame number with leading zeros.
///
/// A loader may keep what it read; it may be called from several threads.
pub trait Assets: Send + Sync {
    /// The picture at `path`, for frame `frame` where it is a sequence.
    ///
    /// # Errors
    /// The asset is missing, damaged, too large or not a picture.
    fn picture(&self, path: &str, frame: i64) -> Result<Arc<Picture>, AssetError>;

    /// All triangles of the scene at `path`, in its own coordinates.
    ///
    /// # Errors
    /// The asset is missing, too large, damaged, or holds no triangles.
    fn mesh(&self, path: &str) -> Result<Arc<Mesh>, AssetError>;

    /// The strokes of the line drawing at `path`.
    ///
    /// # Errors
    /// The asset is missing, damaged, too large, or holds no strokes.
    fn drawing(&self, path: &str) -> Result<Arc<Drawing>, AssetError>;

    /// The text at `path`.
    ///
    /// # Errors
    /// The asset is missing or not UTF-8.
    fn text(&self, path: &str) -> Result<Arc<str>, AssetError>;

    /// Whether there is something at `path` for frame `frame`, which is not read.
    ///
    /// # Errors
    /// There is nothing, or nothing that can be read.
    fn find(&self, path: &str, frame: i64) -> Result<(), AssetError> {
        self.digest(path, frame).map(drop)
    }

    /// A digest of the bytes behind `path` for frame `frame`: two assets with one digest are the same.
    ///
    /// # Errors
    /// The asset is missing or unreadable.
    fn digest(&self, path: &str, frame: i64) -> Result<[u8; 32], AssetError>;
}

/// Assets held in memory, for programs that embed Bansho and for tests. Digests are of the given name only.
#[derive(Clone, Debug, Default)]
pub struct MemoryAssets {
    pictures: BTreeMap<String, Arc<Picture>>,
    drawings: BTreeMap<String, Arc<Drawing>>,
    meshes: BTreeMap<String, Arc<Mesh>>,
    texts: BTreeMap<String, Arc<str>>,
}

impl MemoryAssets {
    /// Keeps `picture` under `path`.
    pub fn insert_picture(&mut self, path: impl Into<String>, picture: Picture) {
        self.pictures.insert(path.into(), Arc::new(picture));
    }

    /// Keeps `mesh` under `path`.
    pub fn insert_mesh(&mut self, path: impl Into<String>, mesh: Mesh) {
        self.meshes.insert(path.into(), Arc::new(mesh));
    }

    /// Keeps `drawing` under `path`.
    pub fn insert_drawing(&mut self, path: impl Into<String>, drawing: Drawing) {
        self.drawings.insert(path.into(), Arc::new(drawing));
    }

    /// Keeps `text` under `path`.
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
        let drawn = self.pictures.contains_key(path) || self.drawings.contains_key(path);
        if !drawn && !self.meshes.contains_key(path) && !self.texts.contains_key(path) {
            return Err(missing(path));
        }
        let mut digest = [0; 32];
        for (slot, byte) in path.bytes().enumerate() {
            digest[slot % 32] ^= byte.rotate_left((slot / 32) as u32);
        }
        Ok(digest)
    }
}
