//! Least-recently-used cache of pictures with a budget of bytes.

use std::{path::PathBuf, sync::Arc};

use bansho_base::host::assets::{DepthMap, NormalMap, Picture, PictureLayers};

/// A file, and the layers of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct PictureKey {
    pub(crate) path: PathBuf,
    pub(crate) layers: PictureLayers,
}

/// Something that takes memory.
pub(crate) trait MemoryBytes {
    /// Its memory, bytes.
    fn memory_bytes(&self) -> usize;
}

impl MemoryBytes for Picture {
    fn memory_bytes(&self) -> usize {
        self.color.memory_bytes() + self.depth.as_ref().map_or(0, |depth| size_of_val(&depth[..]))
    }
}

impl MemoryBytes for DepthMap {
    fn memory_bytes(&self) -> usize {
        size_of_val(self.values.pixels())
    }
}

impl MemoryBytes for NormalMap {
    fn memory_bytes(&self) -> usize {
        size_of_val(self.values.pixels())
    }
}

/// Pictures, depths or normals in the order of their last use, the latest at the end.
#[derive(Debug)]
pub(crate) struct PictureCache<T> {
    entries: Vec<(PictureKey, Arc<T>)>,
}

impl<T> Default for PictureCache<T> {
    fn default() -> Self {
        Self { entries: Vec::new() }
    }
}

impl<T: MemoryBytes> PictureCache<T> {
    pub(crate) fn get(&mut self, key: &PictureKey) -> Option<Arc<T>> {
        let index = self.entries.iter().position(|(cached, _)| cached == key)?;
        let entry = self.entries.remove(index);
        let picture = entry.1.clone();
        self.entries.push(entry);
        Some(picture)
    }

    /// Inserts `picture` and evicts the least recently used others beyond `budget` bytes.
    pub(crate) fn insert(&mut self, key: PictureKey, picture: Arc<T>, budget: usize) {
        self.entries.retain(|(cached, _)| *cached != key);
        self.entries.push((key, picture));
        let mut total = self.bytes();
        while total > budget && self.entries.len() > 1 {
            let (_, oldest) = self.entries.remove(0);
            total -= oldest.memory_bytes();
        }
    }

    /// Memory of the cached pictures, bytes.
    pub(crate) fn bytes(&self) -> usize {
        self.entries.iter().map(|(_, picture)| picture.memory_bytes()).sum()
    }

    pub(crate) fn clear(&mut self) {
        self.entries.clear();
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::{host::assets::Encoding, image::Image};

    use super::*;

    #[test]
    fn the_least_used_pictures_make_room() {
        let picture = || Arc::new(Picture::opaque(Image::filled(4, 4, [0.0; 4]), Encoding::LinearSrgb));
        let (mut cache, budget) = (PictureCache::default(), 2 * 4 * 4 * 16);
        let key = |name: &str| PictureKey { path: PathBuf::from(name), layers: PictureLayers::default() };
        cache.insert(key("a"), picture(), budget);
        cache.insert(key("b"), picture(), budget);
        assert!(cache.get(&key("a")).is_some());
        cache.insert(key("c"), picture(), budget);
        assert!(cache.get(&key("b")).is_none());
        assert!(cache.get(&key("a")).is_some() && cache.get(&key("c")).is_some());
        let other_layer = PictureLayers { image: Some("diffuse".to_owned()), depth: None };
        assert!(cache.get(&PictureKey { layers: other_layer, ..key("a") }).is_none());
        // A picture that exceeds the budget is kept alone, since it is in use.
        cache.insert(key("d"), picture(), 1);
        assert!(cache.get(&key("d")).is_some() && cache.get(&key("a")).is_none());
    }
}
