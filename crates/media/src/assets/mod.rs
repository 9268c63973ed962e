//! Assets from files: plates, depth, meshes, drawings, text.

mod cache;
mod exif;
pub mod gltf;
mod image;
pub mod limits;
mod openexr;
mod primaries;
pub mod svg;

use std::{
    collections::HashMap,
    fs,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use bansho_base::{
    geometry::{mesh::Mesh, strokes::Drawing},
    host::assets::{AssetError, AssetProblem, Assets, Picture},
};

use self::{
    cache::PictureCache,
    limits::{MEMORY_BYTES, MemoryLimit, TEXT_BYTES},
};
use crate::files::{
    input::{self, InputError},
    naming::FrameTemplate,
};
use gltf::{decode_mesh, files_beside};
use svg::decode_drawing;

/// Default size of the picture cache, bytes.
pub const CACHE_BYTES: usize = 512 << 20;

/// Limits on the files that a scene names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputLimits {
    /// Bytes of memory that they may take together while they are read and used.
    pub memory_bytes: u64,
    /// The folder that they must lie in when symbolic links are followed; without it they may lie anywhere.
    pub root: Option<PathBuf>,
}

impl Default for InputLimits {
    fn default() -> Self {
        Self { memory_bytes: MEMORY_BYTES, root: None }
    }
}

/// Pictures, meshes, drawings and texts in files. Paths are relative to a folder; a run of `#` in a file's name stands for the frame
/// number. What was read is remembered, so a file that changes is seen after [`FileAssets::forget`].
///
/// A file is refused before memory is taken for it when it is no ordinary file, lies outside [`InputLimits::root`], claims more than
/// [`limits::SIDE`] pixels on a side or more than its bytes could hold, or would take more than [`InputLimits::memory_bytes`] together
/// with those that are in use.
#[derive(Debug)]
pub struct FileAssets {
    folder: PathBuf,
    limits: InputLimits,
    cache_bytes: usize,
    memory: Mutex<AssetCache>,
}

#[derive(Debug, Default)]
struct AssetCache {
    pictures: PictureCache,
    meshes: HashMap<PathBuf, Arc<Mesh>>,
    drawings: HashMap<PathBuf, Arc<Drawing>>,
    digests: HashMap<PathBuf, [u8; 32]>,
}

impl AssetCache {
    /// Memory of the cached assets, bytes.
    fn used(&self) -> u64 {
        let meshes = self.meshes.values().map(|mesh| mesh.memory_bytes());
        let drawings = self.drawings.values().map(|drawing| drawing.memory_bytes());
        self.pictures.bytes() as u64 + meshes.chain(drawings).sum::<u64>()
    }

    /// Evicts pictures, and meshes and drawings without other users.
    fn make_room(&mut self) {
        self.pictures.clear();
        self.meshes.retain(|_, mesh| Arc::strong_count(mesh) > 1);
        self.drawings.retain(|_, drawing| Arc::strong_count(drawing) > 1);
    }
}

impl FileAssets {
    /// Assets in `folder` and below, or wherever a path points, within the default limits.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self::with_limits(folder, InputLimits::default())
    }

    /// As [`FileAssets::new`], within `limits`.
    pub fn with_limits(folder: impl Into<PathBuf>, limits: InputLimits) -> Self {
        Self { folder: folder.into(), limits, cache_bytes: CACHE_BYTES, memory: Mutex::new(AssetCache::default()) }
    }

    /// As [`FileAssets::new`], keeping at most `cache_bytes` of pictures, but always the last one.
    pub fn with_cache(folder: impl Into<PathBuf>, cache_bytes: usize) -> Self {
        Self { cache_bytes, ..Self::new(folder) }
    }

    /// Empties the cache, because files may have changed.
    pub fn forget(&self) {
        *self.cache() = AssetCache::default();
    }

    /// The file that `path` means for frame `frame`.
    ///
    /// # Errors
    /// More than one run of `#` in the name, or one of more than 20.
    pub fn resolve(&self, path: &str, frame: i64) -> Result<PathBuf, AssetError> {
        let (folder, name) = path.rsplit_once('/').map_or(("", path), |(folder, name)| (folder, name));
        let template = FrameTemplate::parse(name, false)
            .map_err(|_| AssetError { path: path.to_owned(), problem: AssetProblem::FrameNumber })?;
        // An absolute path begins with an empty folder.
        let folder = if path.starts_with('/') && folder.is_empty() { "/" } else { folder };
        Ok(self.folder.join(folder).join(template.name(frame)))
    }

    fn cache(&self) -> MutexGuard<'_, AssetCache> {
        // The cache is only ever replaced as a whole, so a poisoned lock is usable.
        self.memory.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn limit(&self) -> MemoryLimit {
        MemoryLimit { total: self.limits.memory_bytes, used: self.cache().used() }
    }

    /// Reads within the remaining memory, and if that fails again after eviction.
    fn within_limit<T>(&self, read: impl Fn(MemoryLimit) -> Result<T, AssetProblem>) -> Result<T, AssetProblem> {
        match read(self.limit()) {
            Err(AssetProblem::Memory { .. } | AssetProblem::FileSize { .. } | AssetProblem::NoMemory { .. }) => {
                self.cache().make_room();
                read(self.limit())
            }
            result => result,
        }
    }

    /// The path that may be opened: the canonical path if all files must be in the root folder and it is.
    fn allowed(&self, path: &Path) -> Result<PathBuf, AssetProblem> {
        let Some(root) = &self.limits.root else { return Ok(path.to_path_buf()) };
        let outside = || AssetProblem::Outside { root: root.display().to_string() };
        let within = fs::canonicalize(root).map_err(|error| AssetProblem::Unreadable(error.to_string()))?;
        // For a missing file, the check is made on its existing ancestors, so that errors reveal nothing outside of the
        // root.
        let found = path.ancestors().find_map(|part| {
            let part = if part.as_os_str().is_empty() { Path::new(".") } else { part };
            fs::canonicalize(part).ok()
        });
        let found = found.filter(|found| found.starts_with(&within)).ok_or_else(outside)?;
        Ok(fs::canonicalize(path).map_or_else(|_| path.to_path_buf(), |_| found))
    }

    /// The whole file, if it has at most `limit` bytes.
    fn read(&self, path: &Path, limit: u64) -> Result<Vec<u8>, AssetProblem> {
        Ok(input::read(&self.allowed(path)?, limit)?)
    }

    fn read_mesh(&self, path: &Path) -> Result<Arc<Mesh>, AssetProblem> {
        if let Some(mesh) = self.cache().meshes.get(path) {
            return Ok(mesh.clone());
        }
        let beside = |name: &str, left: u64| self.read(&path.with_file_name(name), left);
        let mesh = self.within_limit(|limit| {
            let file = self.read(path, limit.available())?;
            decode_mesh(&file, extension(path), &beside, limit)
        });
        let mesh = Arc::new(mesh?);
        self.cache().meshes.insert(path.to_path_buf(), mesh.clone());
        Ok(mesh)
    }

    fn read_text(&self, path: &Path) -> Result<String, AssetProblem> {
        let bytes = self.read(path, TEXT_BYTES)?;
        String::from_utf8(bytes).map_err(|_| AssetProblem::Damaged("it is not UTF-8".to_owned()))
    }

    fn read_drawing(&self, path: &Path) -> Result<Arc<Drawing>, AssetProblem> {
        if let Some(drawing) = self.cache().drawings.get(path) {
            return Ok(drawing.clone());
        }
        let drawing = self.within_limit(|limit| {
            let drawing = decode_drawing(&self.read_text(path)?)?;
            limit.check(drawing.memory_bytes()).map(|()| drawing)
        });
        let drawing = Arc::new(drawing?);
        self.cache().drawings.insert(path.to_path_buf(), drawing.clone());
        Ok(drawing)
    }

    /// All files that `path` leads to in frame `frame`: itself, and where it is a glTF those that its numbers lie in.
    ///
    /// # Errors
    /// As [`resolve`](Self::resolve). A file that cannot be read leads to no other.
    pub fn files(&self, path: &str, frame: i64) -> Result<Vec<PathBuf>, AssetError> {
        let path = self.resolve(path, frame)?;
        let beside = self.files_beside(&path);
        Ok([vec![path], beside].concat())
    }

    fn files_beside(&self, path: &Path) -> Vec<PathBuf> {
        if !["gltf", "glb"].iter().any(|mesh| extension(path).eq_ignore_ascii_case(mesh)) {
            return Vec::new();
        }
        let file = self.read(path, self.limits.memory_bytes).unwrap_or_default();
        let names = files_beside(&file, extension(path));
        names.into_iter().map(|name| path.with_file_name(name)).collect()
    }

    /// A digest of a file and of those that it names.
    fn hash(&self, path: &Path) -> Result<[u8; 32], AssetProblem> {
        let own = self.hash_file(path)?;
        let beside = self.files_beside(path);
        if beside.is_empty() {
            return Ok(own);
        }
        let mut hasher = blake3::Hasher::new();
        hasher.update(&own);
        for path in beside {
            hasher.update(&self.hash_file(&path)?);
        }
        Ok(*hasher.finalize().as_bytes())
    }

    fn hash_file(&self, path: &Path) -> Result<[u8; 32], AssetProblem> {
        let (file, _) = input::open(&self.allowed(path)?, self.limits.memory_bytes)?;
        let mut hasher = blake3::Hasher::new();
        hasher.update_reader(file).map_err(InputError::from)?;
        Ok(*hasher.finalize().as_bytes())
    }
}

fn extension(path: &Path) -> &str {
    path.extension().and_then(|extension| extension.to_str()).unwrap_or_default()
}

/// Reads a picture from the bytes of a file whose name ends in `extension` (without the dot): `png`, `jpg`, `jpeg`, `exr`.
///
/// # Errors
/// Another extension, a claim beyond the [`limits`] or beyond `limit`, or damage. Never panics and never takes memory that the bytes could
/// not fill.
pub fn decode_picture(bytes: &[u8], extension: &str, limit: MemoryLimit) -> Result<Picture, AssetProblem> {
    match extension.to_ascii_lowercase().as_str() {
        "png" => image::png(bytes, limit),
        "jpg" | "jpeg" => image::jpeg(bytes, limit),
        "exr" => openexr::decode(bytes, limit),
        _ => Err(AssetProblem::UnknownKind),
    }
}

impl Assets for FileAssets {
    fn picture(&self, path: &str, frame: i64) -> Result<Arc<Picture>, AssetError> {
        let path = self.resolve(path, frame)?;
        if let Some(picture) = self.cache().pictures.get(&path) {
            return Ok(picture);
        }
        let picture = self.within_limit(|limit| {
            let file = self.read(&path, limit.available())?;
            decode_picture(&file, extension(&path), limit)
        });
        let picture = Arc::new(picture.map_err(|problem| error(&path, problem))?);
        self.cache().pictures.insert(path, picture.clone(), self.cache_bytes);
        Ok(picture)
    }

    fn mesh(&self, path: &str) -> Result<Arc<Mesh>, AssetError> {
        let path = self.folder.join(path);
        self.read_mesh(&path).map_err(|problem| error(&path, problem))
    }

    fn drawing(&self, path: &str) -> Result<Arc<Drawing>, AssetError> {
        let path = self.folder.join(path);
        self.read_drawing(&path).map_err(|problem| error(&path, problem))
    }

    fn text(&self, path: &str) -> Result<Arc<str>, AssetError> {
        let path = self.folder.join(path);
        self.read_text(&path).map(Arc::from).map_err(|problem| error(&path, problem))
    }

    fn find(&self, path: &str, frame: i64) -> Result<(), AssetError> {
        let path = self.resolve(path, frame)?;
        let found = self.allowed(&path).and_then(|path| Ok(input::find(&path)?));
        found.map_err(|problem| error(&path, problem))
    }

    fn digest(&self, path: &str, frame: i64) -> Result<[u8; 32], AssetError> {
        let path = self.resolve(path, frame)?;
        if let Some(digest) = self.cache().digests.get(&path) {
            return Ok(*digest);
        }
        let digest = self.hash(&path).map_err(|problem| error(&path, problem))?;
        self.cache().digests.insert(path, digest);
        Ok(digest)
    }
}

fn error(path: &Path, problem: AssetProblem) -> AssetError {
    AssetError { path: path.display().to_string(), problem }
}
