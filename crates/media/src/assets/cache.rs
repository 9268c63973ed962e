//! Least-recently-used cache of pictures with a budget of bytes.

use std::{path::PathBuf, sync::Arc};

use bansho_base::host::assets::Picture;

/// Pictures in the order of their last use, the latest at the end.
#[derive(Debug, Default)]
pub(crate) struct PictureCache {
    pictures: Vec<(PathBuf, Arc<Picture>)>,
}

/// Memory of a picture, bytes.
fn bytes(picture: &Picture) -> usize {
    size_of_val(picture.color.pixels()) + picture.depth.as_ref().map_or(0, |depth| size_of_val(&depth[..]))
}

impl PictureCache {
    pub(crate) fn get(&mut self, path: &PathBuf) -> Option<Arc<Picture>> {
        let index = self.pictures.iter().position(|(key, _)| key == path)?;
        let entry = self.pictures.remove(index);
        let picture = entry.1.clone();
        self.pictures.push(entry);
        Some(picture)
    }

    /// Inserts `picture` and evicts the least recently used others beyond `budget` bytes.
    pub(crate) fn insert(&mut self, path: PathBuf, picture: Arc<Picture>, budget: usize) {
        self.pictures.retain(|(key, _)| *key != path);
        self.pictures.push((path, picture));
        let mut total = self.bytes();
        while total > budget && self.pictures.len() > 1 {
            let (_, oldest) = self.pictures.remove(0);
            total -= bytes(&oldest);
        }
    }

    /// Memory of the cached pictures, bytes.
    pub(crate) fn bytes(&self) -> usize {
        self.pictures.iter().map(|(_, picture)| bytes(picture)).sum()
    }

    pub(crate) fn clear(&mut self) {
        self.pictures.clear();
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::{host::assets::Encoding, image::Image};

    use super::*;

    #[test]
    fn the_least_used_pictures_make_room() {
        let picture = || {
            Arc::new(Picture {
                color: Image::filled(4, 4, [0.0; 4]),
                depth: None,
                encoding: Encoding::LinearSrgb,
                exposure_ev100: None,
            })
        };
        let (mut cache, budget) = (PictureCache::default(), 2 * 4 * 4 * 16);
        let path = |name: &str| PathBuf::from(name);
        cache.insert(path("a"), picture(), budget);
        cache.insert(path("b"), picture(), budget);
        assert!(cache.get(&path("a")).is_some());
        cache.insert(path("c"), picture(), budget);
        assert!(cache.get(&path("b")).is_none());
        assert!(cache.get(&path("a")).is_some() && cache.get(&path("c")).is_some());
        // A picture that exceeds the budget is kept alone, since it is in use.
        cache.insert(path("d"), picture(), 1);
        assert!(cache.get(&path("d")).is_some() && cache.get(&path("a")).is_none());
    }
}
