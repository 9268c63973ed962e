//! The part of rayon's interface that the library uses, on the calling thread.
//!
//! Names, arguments and bounds are those of rayon 1, so that the same code compiles with either; what each method does is documented there.
//! Items are taken in order, and no method allocates more than its result.

use std::{
    array, iter,
    ops::{Range, RangeInclusive},
    slice, vec,
};

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

/// A standard iterator with the methods of a parallel one.
///
/// It is not an `Iterator` itself: `reduce` and others have the same name there and other arguments.
#[derive(Clone, Debug)]
#[must_use = "iterators are lazy"]
pub struct Sequential<I>(I);

/// As `rayon::iter::ParallelIterator`.
pub trait ParallelIterator: Sized {
    /// What it iterates over.
    type Item: Send;

    /// The iterator that does the work.
    type Iter: Iterator<Item = Self::Item>;

    /// The items, in order.
    fn into_sequential_iter(self) -> Self::Iter;

    /// Calls `op` with each item.
    fn for_each(self, op: impl Fn(Self::Item) + Sync + Send) {
        self.into_sequential_iter().for_each(op);
    }

    /// Calls `op` with each item and a scratch value, which `init` makes once.
    fn for_each_init<T>(self, init: impl Fn() -> T + Sync + Send, op: impl Fn(&mut T, Self::Item) + Sync + Send) {
        let mut scratch = init();
        self.into_sequential_iter().for_each(|item| op(&mut scratch, item));
    }

    /// Calls `op` with each item and the scratch value `scratch`.
    fn for_each_with<T: Send + Clone>(self, mut scratch: T, op: impl Fn(&mut T, Self::Item) + Sync + Send) {
        self.into_sequential_iter().for_each(|item| op(&mut scratch, item));
    }

    /// Calls `op` with each item up to the first that fails.
    ///
    /// # Errors
    /// The error of that item.
    fn try_for_each<E: Send>(self, op: impl Fn(Self::Item) -> Result<(), E> + Sync + Send) -> Result<(), E> {
        self.into_sequential_iter().try_for_each(op)
    }

    /// The result of `op` for each item.
    fn map<R: Send, F: Fn(Self::Item) -> R + Sync + Send>(self, op: F) -> Sequential<iter::Map<Self::Iter, F>> {
        Sequential(self.into_sequential_iter().map(op))
    }

    /// The items that fulfill `condition`.
    fn filter<F: Fn(&Self::Item) -> bool + Sync + Send>(self, condition: F) -> Sequential<iter::Filter<Self::Iter, F>> {
        Sequential(self.into_sequential_iter().filter(condition))
    }

    /// The results of `op` that are not `None`.
    fn filter_map<R: Send, F: Fn(Self::Item) -> Option<R> + Sync + Send>(
        self,
        op: F,
    ) -> Sequential<iter::FilterMap<Self::Iter, F>> {
        Sequential(self.into_sequential_iter().filter_map(op))
    }

    /// All items of the standard iterators that `op` returns.
    fn flat_map_iter<S: IntoIterator<Item: Send>, F: Fn(Self::Item) -> S + Sync + Send>(
        self,
        op: F,
    ) -> Sequential<iter::FlatMap<Self::Iter, S, F>> {
        Sequential(self.into_sequential_iter().flat_map(op))
    }

    /// Combines all items by `op`, beginning with the identity.
    fn reduce(
        self,
        identity: impl Fn() -> Self::Item + Sync + Send,
        op: impl Fn(Self::Item, Self::Item) -> Self::Item + Sync + Send,
    ) -> Self::Item {
        self.into_sequential_iter().fold(identity(), op)
    }

    /// The sum of all items.
    fn sum<S: Send + iter::Sum<Self::Item>>(self) -> S {
        self.into_sequential_iter().sum()
    }

    /// The items, collected.
    fn collect<C: FromIterator<Self::Item>>(self) -> C {
        self.into_sequential_iter().collect()
    }

    /// The parts of pairs, collected.
    fn unzip<A: Send, B: Send, FromA, FromB>(self) -> (FromA, FromB)
    where
        Self: ParallelIterator<Item = (A, B)>,
        FromA: Default + Send + Extend<A>,
        FromB: Default + Send + Extend<B>,
    {
        self.into_sequential_iter().unzip()
    }
}

/// As `rayon::iter::IndexedParallelIterator`: the number of items is known.
pub trait IndexedParallelIterator: ParallelIterator<Iter: ExactSizeIterator> {
    /// Itself: there is one task.
    fn with_min_len(self, _min: usize) -> Self {
        self
    }

    /// Itself: there is one task.
    fn with_max_len(self, _max: usize) -> Self {
        self
    }

    /// Pairs of index and item.
    fn enumerate(self) -> Sequential<iter::Enumerate<Self::Iter>> {
        Sequential(self.into_sequential_iter().enumerate())
    }

    /// Pairs with the items of `other`, up to the end of the shorter.
    fn zip<Z: IntoParallelIterator<Iter: IndexedParallelIterator>>(
        self,
        other: Z,
    ) -> Sequential<iter::Zip<Self::Iter, <Z::Iter as ParallelIterator>::Iter>> {
        Sequential(self.into_sequential_iter().zip(other.into_par_iter().into_sequential_iter()))
    }

    /// The first item and each that is `step` after the one before.
    ///
    /// # Panics
    /// If `step` is 0.
    fn step_by(self, step: usize) -> Sequential<iter::StepBy<Self::Iter>> {
        Sequential(self.into_sequential_iter().step_by(step))
    }

    /// Replaces the contents of `target` by the items.
    fn collect_into_vec(self, target: &mut Vec<Self::Item>) {
        target.clear();
        target.extend(self.into_sequential_iter());
    }
}

impl<I: Iterator<Item: Send>> ParallelIterator for Sequential<I> {
    type Item = I::Item;
    type Iter = I;

    fn into_sequential_iter(self) -> I {
        self.0
    }
}

impl<I: ExactSizeIterator<Item: Send>> IndexedParallelIterator for Sequential<I> {}

/// As `rayon::iter::IntoParallelIterator`.
pub trait IntoParallelIterator {
    /// What it iterates over.
    type Item: Send;

    /// The iterator.
    type Iter: ParallelIterator<Item = Self::Item>;

    /// The items, by value.
    fn into_par_iter(self) -> Self::Iter;
}

impl<I: ParallelIterator> IntoParallelIterator for I {
    type Item = I::Item;
    type Iter = I;

    fn into_par_iter(self) -> I {
        self
    }
}

/// Collections of the standard library, whose iterators do the work.
macro_rules! into_par_iter {
    ($([$($parameters:tt)*] $type:ty => $iter:ty;)*) => { $(
        impl<$($parameters)*> IntoParallelIterator for $type {
            type Item = <$iter as Iterator>::Item;
            type Iter = Sequential<$iter>;

            fn into_par_iter(self) -> Self::Iter {
                Sequential(self.into_iter())
            }
        }
    )* };
}

into_par_iter! {
    [] Range<usize> => Range<usize>;
    [] RangeInclusive<usize> => RangeInclusive<usize>;
    [T: Send] Vec<T> => vec::IntoIter<T>;
    ['data, T: Sync] &'data Vec<T> => slice::Iter<'data, T>;
    ['data, T: Send] &'data mut Vec<T> => slice::IterMut<'data, T>;
    ['data, T: Sync] &'data [T] => slice::Iter<'data, T>;
    ['data, T: Send] &'data mut [T] => slice::IterMut<'data, T>;
    [T: Send, const N: usize] [T; N] => array::IntoIter<T, N>;
    ['data, T: Sync, const N: usize] &'data [T; N] => slice::Iter<'data, T>;
    ['data, T: Send, const N: usize] &'data mut [T; N] => slice::IterMut<'data, T>;
}

/// Several collections, item by item, up to the end of the shortest.
macro_rules! zip_tuple {
    ($tuple:ident: $($type:ident $field:tt)+) => {
        #[doc = "The iterator of a tuple of collections."]
        #[derive(Clone, Debug)]
        #[must_use = "iterators are lazy"]
        pub struct $tuple<$($type),+>($($type),+);

        impl<$($type: Iterator),+> Iterator for $tuple<$($type),+> {
            type Item = ($($type::Item,)+);

            fn next(&mut self) -> Option<Self::Item> {
                Some(($(self.$field.next()?,)+))
            }

            fn size_hint(&self) -> (usize, Option<usize>) {
                let hints = [$(self.$field.size_hint()),+];
                let min = hints.iter().map(|(min, _)| *min).min().unwrap_or(0);
                (min, hints.iter().filter_map(|(_, max)| *max).min())
            }
        }

        impl<$($type: ExactSizeIterator),+> ExactSizeIterator for $tuple<$($type),+> {}

        impl<$($type: IntoParallelIterator<Iter: IndexedParallelIterator>),+> IntoParallelIterator for ($($type,)+) {
            type Item = ($($type::Item,)+);
            type Iter = Sequential<$tuple<$(<$type::Iter as ParallelIterator>::Iter),+>>;

            fn into_par_iter(self) -> Self::Iter {
                Sequential($tuple($(self.$field.into_par_iter().into_sequential_iter()),+))
            }
        }
    };
}

zip_tuple!(Zip7: A 0 B 1 C 2 D 3 E 4 F 5 G 6);

/// As `rayon::iter::IntoParallelRefIterator`.
pub trait IntoParallelRefIterator<'data> {
    /// What it iterates over.
    type Item: Send + 'data;

    /// The iterator.
    type Iter: ParallelIterator<Item = Self::Item>;

    /// The items, by reference.
    fn par_iter(&'data self) -> Self::Iter;
}

impl<'data, I: ?Sized + 'data> IntoParallelRefIterator<'data> for I
where
    &'data I: IntoParallelIterator,
{
    type Item = <&'data I as IntoParallelIterator>::Item;
    type Iter = <&'data I as IntoParallelIterator>::Iter;

    fn par_iter(&'data self) -> Self::Iter {
        self.into_par_iter()
    }
}

/// As `rayon::iter::IntoParallelRefMutIterator`.
pub trait IntoParallelRefMutIterator<'data> {
    /// What it iterates over.
    type Item: Send + 'data;

    /// The iterator.
    type Iter: ParallelIterator<Item = Self::Item>;

    /// The items, by mutable reference.
    fn par_iter_mut(&'data mut self) -> Self::Iter;
}

impl<'data, I: ?Sized + 'data> IntoParallelRefMutIterator<'data> for I
where
    &'data mut I: IntoParallelIterator,
{
    type Item = <&'data mut I as IntoParallelIterator>::Item;
    type Iter = <&'data mut I as IntoParallelIterator>::Iter;

    fn par_iter_mut(&'data mut self) -> Self::Iter {
        self.into_par_iter()
    }
}

/// As `rayon::slice::ParallelSlice`.
pub trait ParallelSlice<T> {
    /// Chunks of `size` items; the last may be shorter.
    ///
    /// # Panics
    /// If `size` is 0.
    fn par_chunks(&self, size: usize) -> Sequential<slice::Chunks<'_, T>>;
}

impl<T: Sync> ParallelSlice<T> for [T] {
    fn par_chunks(&self, size: usize) -> Sequential<slice::Chunks<'_, T>> {
        Sequential(self.chunks(size))
    }
}

/// As `rayon::slice::ParallelSliceMut`.
pub trait ParallelSliceMut<T> {
    /// Mutable chunks of `size` items; the last may be shorter.
    ///
    /// # Panics
    /// If `size` is 0.
    fn par_chunks_mut(&mut self, size: usize) -> Sequential<slice::ChunksMut<'_, T>>;
}

impl<T: Send> ParallelSliceMut<T> for [T] {
    fn par_chunks_mut(&mut self, size: usize) -> Sequential<slice::ChunksMut<'_, T>> {
        Sequential(self.chunks_mut(size))
    }
}

/// As `rayon::iter::ParallelExtend`.
pub trait ParallelExtend<T: Send> {
    /// Appends the items.
    fn par_extend<I: IntoParallelIterator<Item = T>>(&mut self, items: I);
}

impl<T: Send> ParallelExtend<T> for Vec<T> {
    fn par_extend<I: IntoParallelIterator<Item = T>>(&mut self, items: I) {
        self.extend(items.into_par_iter().into_sequential_iter());
    }
}
