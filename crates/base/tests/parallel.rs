//! The sequential iterators give what rayon's give.

/// The same expressions with the traits of either, each in a module of its own, since methods have the same names.
macro_rules! with_iterators_of {
    ($name:ident: $($path:ident)::+) => {
        mod $name {
            use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

            use $($path)::+::{join, prelude::*};

            /// What every kind of collection gives, by value and by reference.
            pub(crate) fn sources() -> Vec<Vec<usize>> {
                let (mut array, mut vector) = ([5, 6, 7], vec![1, 2, 3, 4, 5]);
                array.par_iter_mut().for_each(|value| *value += 1);
                vector.par_iter_mut().for_each(|value| *value *= 3);
                (&mut array[..]).into_par_iter().zip(&mut vector).for_each(|(value, other)| *value += *other);
                vector.as_mut_slice().par_chunks_mut(2).enumerate().for_each(|(index, chunk)| chunk[0] += index);
                let mut extended = vec![9];
                extended.par_extend(vector.par_iter().map(|value| value + 1));
                vec![
                    array.par_iter().map(|value| *value).collect(),
                    array.into_par_iter().collect(),
                    vector.par_chunks(2).map(|chunk| chunk.iter().sum()).collect(),
                    vector.into_par_iter().collect(),
                    (3..8).into_par_iter().collect(),
                    (3..=8_usize).into_par_iter().collect(),
                    extended,
                ]
            }

            /// What the methods that return an iterator give.
            pub(crate) fn adapters() -> Vec<Vec<usize>> {
                let values = || (0..1000_usize).into_par_iter();
                let reversed: Vec<usize> = (0..1000).rev().collect();
                vec![
                    values().with_min_len(64).with_max_len(128).map(|value| value * value).collect(),
                    values().zip(&reversed[..990]).map(|(a, b)| a * b).collect(),
                    values().step_by(7).enumerate().map(|(index, value)| index * value).collect(),
                    values().filter(|value| value % 3 == 0).collect(),
                    values().filter_map(|value| (value % 3 == 0).then_some(value + 1)).collect(),
                    values().flat_map_iter(|value| 0..value % 5).collect(),
                    values()
                        .zip(0..999)
                        .zip(&[3; 1000])
                        .zip(vec![4; 1000])
                        .enumerate()
                        .map(|(index, (((a, b), c), d))| index * (a + b + c + d))
                        .collect(),
                ]
            }

            /// What the methods that consume an iterator give.
            pub(crate) fn consumers() -> Vec<Vec<usize>> {
                let values = || (0..1000_usize).into_par_iter();
                let (odd, halves): (Vec<bool>, Vec<usize>) = values().map(|value| (value % 2 == 1, value / 2)).unzip();
                let mut target = vec![1; 10];
                values().map(|value| value + 2).collect_into_vec(&mut target);
                let fails_from = |first: usize| move |value| if value < first { Ok(value) } else { Err("too large") };
                let all: Result<Vec<usize>, &str> = values().map(fails_from(1000)).collect();
                let none: Result<Vec<usize>, &str> = values().map(fails_from(500)).collect();
                let count = AtomicUsize::new(0);
                let add = |value: usize| {
                    count.fetch_add(value, Relaxed);
                };
                values().for_each(&add);
                values().for_each_init(|| 3, |scratch, value| add(*scratch + value));
                values().for_each_with(5, |scratch, value| add(*scratch + value));
                let tried = values().try_for_each(|value| fails_from(1000)(value).map(&add));
                vec![
                    vec![values().reduce_with(usize::max).unwrap_or(0), values().sum(), count.into_inner()],
                    odd.into_iter().map(usize::from).collect(),
                    halves,
                    target,
                    all.unwrap(),
                    vec![usize::from(none.is_err()), usize::from(tried.is_ok())],
                    vec![usize::from(values().try_for_each(|value| fails_from(999)(value).map(drop)).is_err())],
                    vec![join(|| 1, || 2)].into_iter().flat_map(|(first, second)| [first, second]).collect(),
                ]
            }
        }
    };
}

with_iterators_of!(sequential: bansho_base::host::parallel::sequential);
with_iterators_of!(pool: rayon);

#[test]
fn sequential_iterators_give_what_rayons_give() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    assert_eq!(sequential::sources(), pool.install(pool::sources));
    assert_eq!(sequential::adapters(), pool.install(pool::adapters));
    assert_eq!(sequential::consumers(), pool.install(pool::consumers));
}

#[test]
fn sequential_work_stays_on_the_calling_thread_in_order() {
    use bansho_base::host::parallel::sequential::{current_num_threads, join, prelude::*};

    let caller = std::thread::current().id();
    let visited = std::sync::Mutex::new(Vec::new());
    let visit = |value: usize| {
        assert_eq!(std::thread::current().id(), caller);
        visited.lock().unwrap().push(value);
    };
    (0..5).into_par_iter().with_max_len(1).for_each(visit);
    join(|| visit(5), || visit(6));
    assert_eq!(visited.into_inner().unwrap(), [0, 1, 2, 3, 4, 5, 6]);
    assert_eq!(current_num_threads(), 1);
}

#[cfg(feature = "rayon")]
#[test]
fn the_feature_uses_the_pool_that_the_caller_installed() {
    use bansho_base::host::parallel::{current_num_threads, prelude::*};

    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).thread_name(|_| "caller's".into()).build().unwrap();
    pool.install(|| {
        assert_eq!(current_num_threads(), 3);
        (0..100).into_par_iter().with_max_len(1).for_each(|_: usize| {
            assert_eq!(std::thread::current().name(), Some("caller's"));
        });
    });
}

#[cfg(not(feature = "rayon"))]
#[test]
fn without_the_feature_work_ignores_pools() {
    use bansho_base::host::parallel::{current_num_threads, join};

    let caller = std::thread::current().id();
    assert_eq!(current_num_threads(), 1);
    join(|| assert_eq!(std::thread::current().id(), caller), || assert_eq!(std::thread::current().id(), caller));
}
