//! Pool of scratch buffers, reused from frame to frame: page faults of fresh memory cost up to half as much as the work done in it.

use std::{
    any::Any,
    fmt,
    ops::{Deref, DerefMut},
    sync::{Mutex, PoisonError},
};

/// Vectors of any element type that are not in use, for large buffers of various sizes. ([`bansho_base::host::scratch_pool::ScratchPool`] holds small
/// objects of one type, one per concurrent task.) A clone begins empty.
#[derive(Default)]
pub struct BufferPool(Mutex<Vec<FreeVec>>);

/// An unused vector of some type, and its capacity.
struct FreeVec {
    capacity: usize,
    list: Box<dyn Any + Send>,
}

impl Clone for BufferPool {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl fmt::Debug for BufferPool {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("BufferPool").finish_non_exhaustive()
    }
}

impl BufferPool {
    /// Takes a vector with a capacity of at least `count`. It contains what its last user left in it, or nothing.
    pub(crate) fn take<T: Send + 'static>(&self, count: usize) -> PooledVec<'_, T> {
        let list = self.find_free(count).unwrap_or_else(|| Vec::with_capacity(count + count / 4));
        PooledVec { list, pool: self }
    }

    /// The smallest unused vector with enough capacity. Where there is none the largest is dropped, so that there are never more
    /// than were in use at once.
    fn find_free<T: 'static>(&self, count: usize) -> Option<Vec<T>> {
        let mut free = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let (mut smallest_that_fits, mut largest): (Option<usize>, Option<usize>) = (None, None);
        for (index, FreeVec { capacity, list }) in free.iter().enumerate() {
            if !list.is::<Vec<T>>() {
                continue;
            }
            if *capacity >= count && smallest_that_fits.is_none_or(|best| *capacity < free[best].capacity) {
                smallest_that_fits = Some(index);
            }
            if largest.is_none_or(|best| *capacity >= free[best].capacity) {
                largest = Some(index);
            }
        }
        let unused = free.swap_remove(smallest_that_fits.or(largest)?);
        smallest_that_fits.and_then(|_| unused.list.downcast().ok().map(|list| *list))
    }
}

/// A vector that returns to the pool when it is dropped.
pub(crate) struct PooledVec<'a, T: Send + 'static> {
    list: Vec<T>,
    pool: &'a BufferPool,
}

impl<'a, T: Send + 'static> PooledVec<'a, T> {
    pub(crate) fn pool(&self) -> &'a BufferPool {
        self.pool
    }
}

impl<T: Send + 'static> Drop for PooledVec<'_, T> {
    fn drop(&mut self) {
        let list = std::mem::take(&mut self.list);
        let unused = FreeVec { capacity: list.capacity(), list: Box::new(list) };
        self.pool.0.lock().unwrap_or_else(PoisonError::into_inner).push(unused);
    }
}

impl<T: Send + 'static> Deref for PooledVec<'_, T> {
    type Target = Vec<T>;

    fn deref(&self) -> &Vec<T> {
        &self.list
    }
}

impl<T: Send + 'static> DerefMut for PooledVec<'_, T> {
    fn deref_mut(&mut self) -> &mut Vec<T> {
        &mut self.list
    }
}

impl<T: Send + fmt::Debug + 'static> fmt::Debug for PooledVec<'_, T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.list.fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_dropped_is_taken_again_and_no_more_is_kept_than_was_in_use() {
        let buffers = BufferPool::default();
        let capacity = |list: PooledVec<f32>| list.capacity();
        let (small, large) = (buffers.take::<f32>(100), buffers.take::<f32>(1000));
        let addresses = [small.as_ptr(), large.as_ptr()];
        drop((large, small));
        let (large, small) = (buffers.take::<f32>(900), buffers.take::<f32>(110));
        assert_eq!(addresses, [small.as_ptr(), large.as_ptr()]);
        drop((small, large));
        assert!(buffers.take::<u8>(7).is_empty(), "lists of other types are other lists");
        assert!(capacity(buffers.take(5000)) >= 5000);
        let free = buffers.0.lock().unwrap();
        assert_eq!(free.iter().filter(|vec| vec.list.is::<Vec<f32>>()).count(), 2);
    }
}
