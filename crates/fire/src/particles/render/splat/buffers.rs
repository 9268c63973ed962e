//! Memory of grids and sprites, handed from one frame to the next: fresh pages cost as much as half of what is done in them.

use std::{
    any::Any,
    fmt,
    ops::{Deref, DerefMut},
    sync::{Mutex, PoisonError},
};

/// Lists that nobody needs at the moment. A clone begins with none.
#[derive(Default)]
pub struct Memory(Mutex<Vec<Spare>>);

/// A list of some type, and how many items it has room for.
struct Spare {
    room: usize,
    list: Box<dyn Any + Send>,
}

impl Clone for Memory {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl fmt::Debug for Memory {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Memory").finish_non_exhaustive()
    }
}

impl Memory {
    /// A list with room for `count` items. It holds what it held when it was last used, or nothing.
    pub(crate) fn list<T: Send + 'static>(&self, count: usize) -> Recycled<'_, T> {
        let list = self.spare(count).unwrap_or_else(|| Vec::with_capacity(count + count / 4));
        Recycled { list, memory: self }
    }

    /// The smallest list with room enough. Where there is none, the largest goes: there are never more than were in use at once.
    fn spare<T: 'static>(&self, count: usize) -> Option<Vec<T>> {
        let mut spares = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let room = |index: &usize| spares[*index].room;
        let of_type = || (0..spares.len()).filter(|index| spares[*index].list.is::<Vec<T>>());
        let fits = of_type().filter(|index| room(index) >= count).min_by_key(room);
        let chosen = fits.or_else(|| of_type().max_by_key(room))?;
        let spare = spares.swap_remove(chosen);
        fits.and_then(|_| spare.list.downcast().ok().map(|list| *list))
    }
}

/// A list that goes back into memory when it is dropped.
pub(crate) struct Recycled<'a, T: Send + 'static> {
    list: Vec<T>,
    memory: &'a Memory,
}

impl<'a, T: Send + 'static> Recycled<'a, T> {
    pub(crate) fn memory(&self) -> &'a Memory {
        self.memory
    }
}

impl<T: Send + 'static> Drop for Recycled<'_, T> {
    fn drop(&mut self) {
        let list = std::mem::take(&mut self.list);
        let spare = Spare { room: list.capacity(), list: Box::new(list) };
        self.memory.0.lock().unwrap_or_else(PoisonError::into_inner).push(spare);
    }
}

impl<T: Send + 'static> Deref for Recycled<'_, T> {
    type Target = Vec<T>;

    fn deref(&self) -> &Vec<T> {
        &self.list
    }
}

impl<T: Send + 'static> DerefMut for Recycled<'_, T> {
    fn deref_mut(&mut self) -> &mut Vec<T> {
        &mut self.list
    }
}

impl<T: Send + fmt::Debug + 'static> fmt::Debug for Recycled<'_, T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.list.fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_dropped_is_taken_again_and_no_more_is_kept_than_was_in_use() {
        let memory = Memory::default();
        let room = |list: Recycled<f32>| list.capacity();
        let (small, large) = (memory.list::<f32>(100), memory.list::<f32>(1000));
        let places = [small.as_ptr(), large.as_ptr()];
        drop((large, small));
        let (large, small) = (memory.list::<f32>(900), memory.list::<f32>(110));
        assert_eq!(places, [small.as_ptr(), large.as_ptr()]);
        drop((small, large));
        assert!(memory.list::<u8>(7).is_empty(), "lists of other types are other lists");
        assert!(room(memory.list(5000)) >= 5000);
        let spares = memory.0.lock().unwrap();
        assert_eq!(spares.iter().filter(|spare| spare.list.is::<Vec<f32>>()).count(), 2);
    }
}
