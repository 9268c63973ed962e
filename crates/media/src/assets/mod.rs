//! Assets from files: plates, depth, meshes, drawings, text.

mod cache;
mod completeness;
mod formats;

use std::{
    cell::RefCell,
    collections::HashMap,
    fs,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use bansho_base::{
    geometry::{mesh::Mesh, strokes::Drawing},
    host::assets::{AssetError, AssetProblem, Assets, DepthMap, NormalMap, Picture, PictureLayers},
};

use self::{
    cache::{PictureCache, PictureKey},
    formats::{DepthFormat, PlateFormat},
};
use crate::{
    exr,
    files::{
        input::{self, InputError},
        naming::{FrameTemplate, other_placeholder},
    },
    gltf::{decode_mesh, external_buffer_uris},
    jpeg,
    limits::{MEMORY_BYTES, MemoryLimit, TEXT_BYTES},
    numpy, pfm, png,
    svg::decode_drawing,
    tiff, webp,
};

/// Largest size of the cache of pictures, and of those of depths and normals, bytes. The last one is always kept.
const CACHE_BYTES: usize = 512 << 20;
const DEPTH_CACHE_BYTES: usize = 128 << 20;
const NORMAL_CACHE_BYTES: usize = 256 << 20;

/// Limits on the files that a scene names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputLimits {
    /// Bytes of memory that they may take in total while they are read and used.
    pub memory_bytes: u64,
    /// The folder in which they must be after symbolic links are resolved; `None` allows any folder.
    pub root: Option<PathBuf>,
}

impl Default for InputLimits {
    fn default() -> Self {
        Self { memory_bytes: MEMORY_BYTES, root: None }
    }
}

/// Pictures, meshes, drawings and texts in files. Paths are relative to a folder; a run of `#` in a file name is replaced by the frame
/// number, unless it is a single one and a file has that very name. Files are cached, so a change of a file is only seen after [`FileAssets::clear_cache`].
///
/// A file is rejected before memory is allocated if it is not a regular file, is outside [`InputLimits::root`], claims more than
/// [`crate::limits::SIDE`] pixels on a side or more than its bytes could contain, or would exceed [`InputLimits::memory_bytes`] together with the
/// files in use.
#[derive(Debug)]
pub struct FileAssets {
    folder: PathBuf,
    limits: InputLimits,
    cache: Mutex<AssetCache>,
}

#[derive(Debug, Default)]
struct AssetCache {
    pictures: PictureCache<Picture>,
    depths: PictureCache<DepthMap>,
    normals: PictureCache<NormalMap>,
    meshes: HashMap<PathBuf, Arc<Mesh>>,
    drawings: HashMap<PathBuf, Arc<Drawing>>,
    digests: HashMap<PathBuf, [u8; 32]>,
}

impl AssetCache {
    /// Memory of the cached assets, bytes.
    fn used(&self) -> u64 {
        let meshes = self.meshes.values().map(|mesh| mesh.memory_bytes());
        let drawings = self.drawings.values().map(|drawing| drawing.memory_bytes());
        (self.pictures.bytes() + self.depths.bytes() + self.normals.bytes()) as u64
            + meshes.chain(drawings).sum::<u64>()
    }

    /// Evicts all pictures, and the meshes and drawings without other users.
    fn evict_unused(&mut self) {
        self.pictures.clear();
        self.depths.clear();
        self.normals.clear();
        self.meshes.retain(|_, mesh| Arc::strong_count(mesh) > 1);
        self.drawings.retain(|_, drawing| Arc::strong_count(drawing) > 1);
    }
}

impl FileAssets {
    /// Assets with paths relative to `folder`, within the default limits.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self::with_limits(folder, InputLimits::default())
    }

    /// As [`FileAssets::new`], within `limits`.
    pub fn with_limits(folder: impl Into<PathBuf>, limits: InputLimits) -> Self {
        Self { folder: folder.into(), limits, cache: Mutex::new(AssetCache::default()) }
    }

    /// Clears the cache, because files may have changed.
    pub fn clear_cache(&self) {
        *self.lock_cache() = AssetCache::default();
    }

    /// The file of `path` in frame `frame`.
    ///
    /// # Errors
    /// More than one run of `#` in the name, or a run of more than 20.
    pub fn resolve(&self, path: &str, frame: i64) -> Result<PathBuf, AssetError> {
        let (folder, name) = path.rsplit_once('/').map_or(("", path), |(folder, name)| (folder, name));
        if name.matches('#').count() == 1 && self.folder.join(path).is_file() {
            return Ok(self.folder.join(path));
        }
        let template = FrameTemplate::parse(name, false)
            .map_err(|_| AssetError { path: path.to_owned(), problem: AssetProblem::FrameNumber })?;
        // An absolute path begins with an empty folder.
        let folder = if path.starts_with('/') && folder.is_empty() { "/" } else { folder };
        let folder = self.folder.join(folder);
        let file = folder.join(template.name(frame));
        if frame < 0 && !file.is_file() {
            // As Bansho wrote negative numbers formerly.
            let with_full_digits = folder.join(template.name_with_full_digits(frame));
            if with_full_digits.is_file() {
                return Ok(with_full_digits);
            }
        }
        Ok(file)
    }

    fn lock_cache(&self) -> MutexGuard<'_, AssetCache> {
        // The cache is only ever replaced as a whole, so a poisoned lock is usable.
        self.cache.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn limit(&self) -> MemoryLimit {
        MemoryLimit { total: self.limits.memory_bytes, used: self.lock_cache().used() }
    }

    /// Reads within the remaining memory; if that fails, once more after eviction.
    fn within_limit<T>(&self, read: impl Fn(MemoryLimit) -> Result<T, AssetProblem>) -> Result<T, AssetProblem> {
        match read(self.limit()) {
            Err(AssetProblem::Memory { .. } | AssetProblem::FileSize { .. } | AssetProblem::NoMemory { .. }) => {
                self.lock_cache().evict_unused();
                read(self.limit())
            }
            result => result,
        }
    }

    /// The path to open. With a root folder it is the canonical path, which must be inside the root.
    fn checked_path(&self, path: &Path) -> Result<PathBuf, AssetProblem> {
        let Some(root) = &self.limits.root else { return Ok(path.to_path_buf()) };
        let canonical_root = fs::canonicalize(root).map_err(|error| AssetProblem::Unreadable(error.to_string()))?;
        // For a missing file its nearest existing ancestor is checked, so that errors reveal nothing outside the root.
        let nearest_existing = path.ancestors().find_map(|ancestor| {
            let ancestor = if ancestor.as_os_str().is_empty() { Path::new(".") } else { ancestor };
            fs::canonicalize(ancestor).ok()
        });
        let Some(checked) = nearest_existing.filter(|existing| existing.starts_with(&canonical_root)) else {
            return Err(AssetProblem::Outside { root: root.display().to_string() });
        };
        // The canonical path is opened, since a link in the given one may be changed after the check.
        Ok(fs::canonicalize(path).map_or_else(|_| path.to_path_buf(), |_| checked))
    }

    /// The bytes of a file of at most `limit` bytes.
    fn read(&self, path: &Path, limit: u64) -> Result<Vec<u8>, AssetProblem> {
        Ok(input::read(&self.checked_path(path)?, limit)?)
    }

    fn read_mesh(&self, path: &Path) -> Result<Arc<Mesh>, AssetError> {
        if let Some(mesh) = self.lock_cache().meshes.get(path) {
            return Ok(mesh.clone());
        }
        // The buffer that could not be read, which an error is about.
        let unread = RefCell::new(None);
        let read_resource = |uri: &str, limit: u64| {
            let buffer = beside(path, uri);
            let read = self.read(&buffer, limit);
            *unread.borrow_mut() = read.is_err().then_some(buffer);
            read
        };
        let mesh = self.within_limit(|limit| {
            unread.take();
            let file = self.read(path, limit.available())?;
            decode_mesh(&file, extension(path), &read_resource, limit)
        });
        let mesh = mesh.map_err(|problem| error(unread.take().as_deref().unwrap_or(path), problem));
        let mesh = Arc::new(mesh?);
        self.lock_cache().meshes.insert(path.to_path_buf(), mesh.clone());
        Ok(mesh)
    }

    fn read_text(&self, path: &Path) -> Result<String, AssetProblem> {
        let bytes = self.read(path, TEXT_BYTES)?;
        String::from_utf8(bytes).map_err(|_| AssetProblem::Damaged("it is not UTF-8".to_owned()))
    }

    fn read_drawing(&self, path: &Path) -> Result<Arc<Drawing>, AssetProblem> {
        if let Some(drawing) = self.lock_cache().drawings.get(path) {
            return Ok(drawing.clone());
        }
        let drawing = self.within_limit(|limit| {
            let drawing = decode_drawing(&self.read(path, TEXT_BYTES)?)?;
            limit.check(drawing.memory_bytes()).map(|()| drawing)
        });
        let drawing = Arc::new(drawing?);
        self.lock_cache().drawings.insert(path.to_path_buf(), drawing.clone());
        Ok(drawing)
    }

    /// All files of `path` in frame `frame`: itself, and the buffers of a glTF.
    ///
    /// # Errors
    /// As [`resolve`](Self::resolve). A glTF that cannot be read has no further files.
    pub fn files(&self, path: &str, frame: i64) -> Result<Vec<PathBuf>, AssetError> {
        let path = self.resolve(path, frame)?;
        let buffers = self.external_buffers(&path);
        Ok([vec![path], buffers].concat())
    }

    fn external_buffers(&self, path: &Path) -> Vec<PathBuf> {
        if !["gltf", "glb"].iter().any(|gltf| extension(path).eq_ignore_ascii_case(gltf)) {
            return Vec::new();
        }
        let file = self.read(path, self.limits.memory_bytes).unwrap_or_default();
        let uris = external_buffer_uris(&file, extension(path));
        uris.iter().map(|uri| beside(path, uri)).collect()
    }

    /// A digest of a file and of its external buffers.
    fn hash(&self, path: &Path) -> Result<[u8; 32], AssetError> {
        let file_digest = self.hash_file(path).map_err(|problem| numbered_error(path, problem))?;
        let buffers = self.external_buffers(path);
        if buffers.is_empty() {
            return Ok(file_digest);
        }
        let mut hasher = blake3::Hasher::new();
        hasher.update(&file_digest);
        for path in buffers {
            hasher.update(&self.hash_file(&path).map_err(|problem| error(&path, problem))?);
        }
        Ok(*hasher.finalize().as_bytes())
    }

    fn hash_file(&self, path: &Path) -> Result<[u8; 32], AssetProblem> {
        let (file, _) = input::open(&self.checked_path(path)?, self.limits.memory_bytes)?;
        let mut hasher = blake3::Hasher::new();
        hasher.update_reader(file).map_err(InputError::from)?;
        Ok(*hasher.finalize().as_bytes())
    }
}

/// The file that a URI in the file `path` names. Bytes such as `%20` are decoded, unless a file has the very name: some exporters do not encode.
fn beside(path: &Path, uri: &str) -> PathBuf {
    let verbatim = path.with_file_name(uri);
    match percent_decoded(uri) {
        Some(decoded) if !verbatim.is_file() => path.with_file_name(decoded),
        _ => verbatim,
    }
}

/// The URI with its percent-encoded bytes decoded (RFC 3986, 2.1); `None` if it has none, or is no text then.
fn percent_decoded(uri: &str) -> Option<String> {
    if !uri.contains('%') {
        return None;
    }
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&byte, after)) = rest.split_first() {
        let digits = after.first_chunk().map(|pair: &[u8; 2]| pair.map(|digit| char::from(digit).to_digit(16)));
        match (byte, digits) {
            (b'%', Some([Some(high), Some(low)])) => {
                bytes.push((16 * high + low) as u8);
                rest = &after[2..];
            }
            // A sign without two digits stands for itself.
            _ => {
                bytes.push(byte);
                rest = after;
            }
        }
    }
    String::from_utf8(bytes).ok()
}

fn extension(path: &Path) -> &str {
    path.extension().and_then(|extension| extension.to_str()).unwrap_or_default()
}

/// Decodes a picture from the bytes of a file with this `extension` (without the dot): PNG, JPEG, EXR, WebP or TIFF. `layers` chooses the layers of
/// an EXR.
///
/// # Errors
/// Another format, a size beyond the [`limits`](crate::limits) or beyond `limit`, no such layer, or damage. Never panics, and never allocates memory that the
/// bytes could not fill.
pub fn decode_picture(
    bytes: &[u8],
    extension: &str,
    layers: &PictureLayers,
    limit: MemoryLimit,
) -> Result<Picture, AssetProblem> {
    match formats::picture_format(bytes, extension)? {
        PlateFormat::Png => png::decode::decode(bytes, limit),
        PlateFormat::Jpeg => jpeg::decode(bytes, limit),
        PlateFormat::Exr => exr::decode::decode(bytes, layers, limit),
        PlateFormat::WebP => webp::decode(bytes, limit),
        PlateFormat::Tiff => tiff::decode(bytes, limit),
    }
}

/// Decodes a depth from the bytes of a file with this `extension` (without the dot): EXR, PNG, PFM, NPY or TIFF. `layer` chooses the layer of an EXR.
///
/// # Errors
/// As [`decode_picture`], or no depth.
pub fn decode_depth(
    bytes: &[u8],
    extension: &str,
    layer: Option<&str>,
    limit: MemoryLimit,
) -> Result<DepthMap, AssetProblem> {
    match formats::depth_format(bytes, extension)? {
        DepthFormat::Exr => exr::decode::decode_depth(bytes, layer, limit),
        DepthFormat::Png => png::decode::depth(bytes, limit),
        DepthFormat::Pfm => pfm::depth(bytes, limit),
        DepthFormat::Npy => numpy::depth(bytes, limit),
        DepthFormat::Tiff => tiff::depth(bytes, limit),
    }
}

/// Decodes normals from the bytes of a file with this `extension` (without the dot): EXR.
///
/// # Errors
/// As [`decode_picture`], or no normals.
pub fn decode_normals(bytes: &[u8], extension: &str, limit: MemoryLimit) -> Result<NormalMap, AssetProblem> {
    match formats::picture_format(bytes, extension) {
        Ok(PlateFormat::Exr) => exr::decode::decode_normals(bytes, limit),
        Err(problem @ AssetProblem::UnsupportedFormat { .. }) => Err(problem),
        _ => Err(AssetProblem::UnknownNormalKind),
    }
}

impl Assets for FileAssets {
    fn picture(&self, path: &str, frame: i64) -> Result<Arc<Picture>, AssetError> {
        self.picture_layers(path, frame, &PictureLayers::default())
    }

    fn picture_layers(&self, path: &str, frame: i64, layers: &PictureLayers) -> Result<Arc<Picture>, AssetError> {
        let key = PictureKey { path: self.resolve(path, frame)?, layers: layers.clone() };
        if let Some(picture) = self.lock_cache().pictures.get(&key) {
            return Ok(picture);
        }
        let picture = self.within_limit(|limit| {
            let file = self.read(&key.path, limit.available())?;
            decode_picture(&file, extension(&key.path), layers, limit)
        });
        let picture = Arc::new(picture.map_err(|problem| numbered_error(&key.path, problem))?);
        self.lock_cache().pictures.insert(key, picture.clone(), CACHE_BYTES);
        Ok(picture)
    }

    fn depth(&self, path: &str, frame: i64, layer: Option<&str>) -> Result<Arc<DepthMap>, AssetError> {
        let layers = PictureLayers { image: None, depth: layer.map(str::to_owned) };
        let key = PictureKey { path: self.resolve(path, frame)?, layers };
        if let Some(depth) = self.lock_cache().depths.get(&key) {
            return Ok(depth);
        }
        let depth = self.within_limit(|limit| {
            let file = self.read(&key.path, limit.available())?;
            decode_depth(&file, extension(&key.path), layer, limit)
        });
        let depth = Arc::new(depth.map_err(|problem| numbered_error(&key.path, problem))?);
        self.lock_cache().depths.insert(key, depth.clone(), DEPTH_CACHE_BYTES);
        Ok(depth)
    }

    fn normals(&self, path: &str, frame: i64) -> Result<Arc<NormalMap>, AssetError> {
        let key = PictureKey { path: self.resolve(path, frame)?, layers: PictureLayers::default() };
        if let Some(normals) = self.lock_cache().normals.get(&key) {
            return Ok(normals);
        }
        let normals = self.within_limit(|limit| {
            let file = self.read(&key.path, limit.available())?;
            decode_normals(&file, extension(&key.path), limit)
        });
        let normals = Arc::new(normals.map_err(|problem| numbered_error(&key.path, problem))?);
        self.lock_cache().normals.insert(key, normals.clone(), NORMAL_CACHE_BYTES);
        Ok(normals)
    }

    fn mesh(&self, path: &str) -> Result<Arc<Mesh>, AssetError> {
        let path = self.folder.join(path);
        self.read_mesh(&path)
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
        let checked = self.checked_path(&path).and_then(|path| Ok(input::find(&path)?));
        checked.map_err(|problem| numbered_error(&path, problem))
    }

    fn check_whole(&self, path: &str, frame: i64) -> Result<Option<[usize; 2]>, AssetError> {
        let resolved = self.resolve(path, frame)?;
        let checked = self.checked_path(&resolved).and_then(|path| {
            let (mut file, length) = input::open(&path, self.limits.memory_bytes)?;
            completeness::check(&mut file, length, extension(&path))
        });
        checked.map_err(|problem| numbered_error(&resolved, problem))
    }

    fn digest(&self, path: &str, frame: i64) -> Result<[u8; 32], AssetError> {
        let path = self.resolve(path, frame)?;
        if let Some(digest) = self.lock_cache().digests.get(&path) {
            return Ok(*digest);
        }
        let digest = self.hash(&path)?;
        self.lock_cache().digests.insert(path, digest);
        Ok(digest)
    }
}

/// The error of a picture, of which a sequence may be meant in another program's way.
fn numbered_error(path: &Path, problem: AssetProblem) -> AssetError {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    match (problem, other_placeholder(name)) {
        (AssetProblem::Missing, Some((placeholder, digits))) => {
            error(path, AssetProblem::OtherPlaceholder { placeholder: placeholder.to_owned(), own: "#".repeat(digits) })
        }
        (problem, _) => error(path, problem),
    }
}

fn error(path: &Path, problem: AssetProblem) -> AssetError {
    AssetError { path: path.display().to_string(), problem }
}
