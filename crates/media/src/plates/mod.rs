//! Assets in files: plates, depth, meshes, drawings, text.

mod cache;
mod decode;
mod exposure;
pub mod limits;

use std::{
    collections::HashMap,
    fs::{self, File, Metadata},
    io::{self, Read},
    path::{Path, PathBuf},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use bansho_base::{
    assets::{AssetError, AssetProblem, Assets, Picture},
    drawing::Drawing,
    mesh::Mesh,
};

use self::cache::Cache;
use crate::{drawings::decode_drawing, exr, meshes::decode_mesh, naming::FrameTemplate};

/// Bytes of pictures that are kept for the next frame unless told otherwise.
pub const CACHE_BYTES: usize = 512 << 20;

/// Pictures, meshes, drawings and texts in files. Paths are relative to a folder; a run of `#` in a file's name stands for the frame
/// number. What was read is remembered, so a file that changes is seen after [`FileAssets::forget`].
///
/// A file is refused, before memory is taken for it, when it claims more than [`limits::SIDE`] pixels on a side or more
/// than its bytes could hold.
#[derive(Debug)]
pub struct FileAssets {
    root: PathBuf,
    cache_bytes: usize,
    memory: Mutex<Memory>,
}

#[derive(Debug, Default)]
struct Memory {
    pictures: Cache,
    digests: HashMap<PathBuf, [u8; 32]>,
}

impl FileAssets {
    /// Assets in `root` and below, or wherever an absolute path points.
    pub fn new(root: impl Into<PathBuf>) -> Self {
        Self::with_cache(root, CACHE_BYTES)
    }

    /// As [`FileAssets::new`], keeping at most `cache_bytes` of pictures, but always the last one.
    pub fn with_cache(root: impl Into<PathBuf>, cache_bytes: usize) -> Self {
        Self { root: root.into(), cache_bytes, memory: Mutex::new(Memory::default()) }
    }

    /// Forgets everything that was read, because files may have changed.
    pub fn forget(&self) {
        let mut memory = self.memory();
        memory.pictures.clear();
        memory.digests.clear();
    }

    /// The file that `path` means for frame `frame`.
    ///
    /// # Errors
    /// More than one run of `#` in the name.
    pub fn resolve(&self, path: &str, frame: i64) -> Result<PathBuf, AssetError> {
        let (folder, name) = path.rsplit_once('/').map_or(("", path), |(folder, name)| (folder, name));
        let template = FrameTemplate::parse(name, false).map_err(|_| AssetError {
            path: path.to_owned(),
            problem: AssetProblem::Unreadable("more than one place for the frame number".to_owned()),
        })?;
        // An absolute path begins with an empty folder.
        let folder = if path.starts_with('/') && folder.is_empty() { "/" } else { folder };
        Ok(self.root.join(folder).join(template.name(frame)))
    }

    fn memory(&self) -> MutexGuard<'_, Memory> {
        // The memory is only ever replaced whole, so a panic elsewhere leaves it usable.
        self.memory.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What the system says of a file.
fn system(error: io::Error) -> AssetProblem {
    match error.kind() {
        io::ErrorKind::NotFound => AssetProblem::Missing,
        _ => AssetProblem::Unreadable(error.to_string()),
    }
}

/// A folder opens like a file; a pipe or a device might never end.
fn only_files(found: Metadata) -> Result<(), AssetProblem> {
    if found.is_file() { Ok(()) } else { Err(AssetProblem::Unreadable("it is not a file".to_owned())) }
}

/// The whole file, if it is not beyond [`limits::FILE_BYTES`].
fn read(path: &Path) -> Result<Vec<u8>, AssetProblem> {
    let file = File::open(path).map_err(system)?;
    file.metadata().map_err(system).and_then(only_files)?;
    let mut bytes = Vec::new();
    file.take(limits::FILE_BYTES + 1).read_to_end(&mut bytes).map_err(system)?;
    if bytes.len() as u64 > limits::FILE_BYTES {
        return Err(AssetProblem::Unreadable(format!("it has more than {} bytes", limits::FILE_BYTES)));
    }
    Ok(bytes)
}

/// Reads a picture from the bytes of a file whose name ends in `extension` (without the dot): `png`, `jpg`, `jpeg`, `exr`.
///
/// # Errors
/// Another extension, a claim beyond the [`limits`], or damage. Never panics and never takes memory that the bytes could
/// not fill.
pub fn decode_picture(bytes: &[u8], extension: &str) -> Result<Picture, AssetProblem> {
    match extension.to_ascii_lowercase().as_str() {
        "png" => decode::png(bytes),
        "jpg" | "jpeg" => decode::jpeg(bytes),
        "exr" => exr::decode(bytes),
        _ => Err(AssetProblem::UnknownKind),
    }
}

fn error(path: &Path, problem: AssetProblem) -> AssetError {
    AssetError { path: path.display().to_string(), problem }
}

impl Assets for FileAssets {
    fn picture(&self, path: &str, frame: i64) -> Result<Arc<Picture>, AssetError> {
        let path = self.resolve(path, frame)?;
        if let Some(picture) = self.memory().pictures.get(&path) {
            return Ok(picture);
        }
        let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
        let read = || decode_picture(&read(&path)?, extension);
        let picture = Arc::new(read().map_err(|problem| error(&path, problem))?);
        self.memory().pictures.insert(path, picture.clone(), self.cache_bytes);
        Ok(picture)
    }

    fn mesh(&self, path: &str) -> Result<Arc<Mesh>, AssetError> {
        let path = self.root.join(path);
        let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
        let beside = |name: &str| read(&path.with_file_name(name));
        let mesh = read(&path).and_then(|file| decode_mesh(&file, extension, &beside));
        Ok(Arc::new(mesh.map_err(|problem| error(&path, problem))?))
    }

    fn drawing(&self, path: &str) -> Result<Arc<Drawing>, AssetError> {
        let drawing = decode_drawing(&self.text(path)?);
        Ok(Arc::new(drawing.map_err(|problem| error(&self.root.join(path), problem))?))
    }

    fn text(&self, path: &str) -> Result<Arc<str>, AssetError> {
        let path = self.root.join(path);
        let bytes = read(&path).map_err(|problem| error(&path, problem))?;
        let text =
            String::from_utf8(bytes).map_err(|_| error(&path, AssetProblem::Damaged("it is not UTF-8".to_owned())))?;
        Ok(text.into())
    }

    fn find(&self, path: &str, frame: i64) -> Result<(), AssetError> {
        let path = self.resolve(path, frame)?;
        fs::metadata(&path).map_err(system).and_then(only_files).map_err(|problem| error(&path, problem))
    }

    fn digest(&self, path: &str, frame: i64) -> Result<[u8; 32], AssetError> {
        let path = self.resolve(path, frame)?;
        if let Some(digest) = self.memory().digests.get(&path) {
            return Ok(*digest);
        }
        let bytes = read(&path).map_err(|problem| error(&path, problem))?;
        let digest = *blake3::hash(&bytes).as_bytes();
        self.memory().digests.insert(path, digest);
        Ok(digest)
    }
}
