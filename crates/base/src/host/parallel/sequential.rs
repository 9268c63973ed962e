//! The part of rayon's interface that the library uses, on the calling thread.
//!
//! The iterators are those of the standard library, whose methods are called as rayon's are: `map`, `filter`, `zip`, `enumerate`, `for_each`,
//! `collect` and others. The traits here add what only rayon has, by the names and arguments of rayon 1. A method that takes other arguments
//! in rayon than in the standard library, such as `reduce` and `fold`, cannot be used with both. Items are taken in order, and no method
//! allocates more than its result.

use std::{iter, slice};

/// As `rayon::prelude`.
pub mod prelude {
    pub use super::{
        IndexedParallelIterator, IntoParallelIterator, IntoParallelRefIterator, IntoParallelRefMutIterator,
        ParallelExtend, ParallelIterator, ParallelSlice, ParallelSliceMut,
    };
}

/// As `rayon::current_num_threads`: 1, the caller's.
#[must_use]
pub fn current_num_threads() -> usize {
    1
}

/// As `rayon::join`: calls `first`, then `second`.
pub fn join<A: Send, B: Send>(first: impl FnOnce() -> A + Send, second: impl FnOnce() -> B + Send) -> (A, B) {
    let first = first();
    (first, second())
}

/// As `rayon::iter::ParallelIterator`.
pub trait ParallelIterator: Iterator<Item: Send> + Sized {
    /// Calls `op` with each item and a scratch value, which `init` makes once.
    fn for_each_init<T>(self, init: impl Fn() -> T + Sync + Send, op: impl Fn(&mut T, Self::Item) + Sync + Send) {
        let mut scratch = init();
        self.for_each(|item| op(&mut scratch, item));
    }

    /// Calls `op` with each item and the scratch value `scratch`.
    fn for_each_with<T: Send + Clone>(self, mut scratch: T, op: impl Fn(&mut T, Self::Item) + Sync + Send) {
        self.for_each(|item| op(&mut scratch, item));
    }

    /// Calls `op` with each item up to the first that fails. By value, as in rayon: the standard method needs an iterator that is mutable.
    ///
    /// # Errors
    /// The error of that item.
    fn try_for_each<E: Send>(mut self, op: impl Fn(Self::Item) -> Result<(), E> + Sync + Send) -> Result<(), E> {
        Iterator::try_for_each(&mut self, op)
    }

    /// All items of the standard iterators that `op` returns.
    fn flat_map_iter<S: IntoIterator<Item: Send>, F: Fn(Self::Item) -> S + Sync + Send>(
        self,
        op: F,
    ) -> iter::FlatMap<Self, S, F> {
        self.flat_map(op)
    }

    /// Combines all items by `op`; `None` if there are none.
    fn reduce_with(self, op: impl Fn(Self::Item, Self::Item) -> Self::Item + Sync + Send) -> Option<Self::Item> {
        self.reduce(op)
    }
}

impl<I: Iterator<Item: Send>> ParallelIterator for I {}

/// As `rayon::iter::IndexedParallelIterator`: the number of items is known.
pub trait IndexedParallelIterator: ParallelIterator + ExactSizeIterator {
    /// Itself: there is one task.
    #[must_use]
    fn with_min_len(self, _min: usize) -> Self {
        self
    }

    /// Itself: there is one task.
    #[must_use]
    fn with_max_len(self, _max: usize) -> Self {
        self
    }

    /// Replaces the contents of `target` by the items.
    fn collect_into_vec(self, target: &mut Vec<Self::Item>) {
        target.clear();
        target.extend(self);
    }
}

impl<I: ExactSizeIterator<Item: Send>> IndexedParallelIterator for I {}

/// As `rayon::iter::IntoParallelIterator`.
pub trait IntoParallelIterator: IntoIterator<Item: Send> + Sized {
    /// The items, by value.
    fn into_par_iter(self) -> Self::IntoIter {
        self.into_iter()
    }
}

impl<I: IntoIterator<Item: Send>> IntoParallelIterator for I {}

/// As `rayon::iter::IntoParallelRefIterator`.
pub trait IntoParallelRefIterator<'data> {
    /// The iterator.
    type Iter: Iterator;

    /// The items, by reference.
    fn par_iter(&'data self) -> Self::Iter;
}

impl<'data, I: ?Sized + 'data> IntoParallelRefIterator<'data> for I
where
    &'data I: IntoParallelIterator,
{
    type Iter = <&'data I as IntoIterator>::IntoIter;

    fn par_iter(&'data self) -> Self::Iter {
        self.into_iter()
    }
}

/// As `rayon::iter::IntoParallelRefMutIterator`.
pub trait IntoParallelRefMutIterator<'data> {
    /// The iterator.
    type Iter: Iterator;

    /// The items, by mutable reference.
    fn par_iter_mut(&'data mut self) -> Self::Iter;
}

impl<'data, I: ?Sized + 'data> IntoParallelRefMutIterator<'data> for I
where
    &'data mut I: IntoParallelIterator,
{
    type Iter = <&'data mut I as IntoIterator>::IntoIter;

    fn par_iter_mut(&'data mut self) -> Self::Iter {
        self.into_iter()
    }
}

/// As `rayon::slice::ParallelSlice`.
pub trait ParallelSlice<T> {
    /// Chunks of `size` items; the last may be shorter.
    ///
    /// # Panics
    /// If `size` is 0.
    fn par_chunks(&self, size: usize) -> slice::Chunks<'_, T>;
}

impl<T: Sync> ParallelSlice<T> for [T] {
    fn par_chunks(&self, size: usize) -> slice::Chunks<'_, T> {
        self.chunks(size)
    }
}

/// As `rayon::slice::ParallelSliceMut`.
pub trait ParallelSliceMut<T> {
    /// Mutable chunks of `size` items; the last may be shorter.
    ///
    /// # Panics
    /// If `size` is 0.
    fn par_chunks_mut(&mut self, size: usize) -> slice::ChunksMut<'_, T>;
}

impl<T: Send> ParallelSliceMut<T> for [T] {
    fn par_chunks_mut(&mut self, size: usize) -> slice::ChunksMut<'_, T> {
        self.chunks_mut(size)
    }
}

/// As `rayon::iter::ParallelExtend`.
pub trait ParallelExtend<T: Send> {
    /// Appends the items.
    fn par_extend(&mut self, items: impl IntoIterator<Item = T>);
}

impl<T: Send> ParallelExtend<T> for Vec<T> {
    fn par_extend(&mut self, items: impl IntoIterator<Item = T>) {
        self.extend(items);
    }
}
