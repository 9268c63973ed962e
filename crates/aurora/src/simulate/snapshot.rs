//! The state as bytes and back: a version, then numbers and lists, each list with its length before it.

use bansho_base::{math::DVec2, phenomenon::SnapshotError};

use super::{
    AuroraParticles,
    afterglow::{Afterglow, GlowMap},
    particles::NUMBERS,
    simulation::SimulationState,
};
use crate::simulate::sheets::arc_length::Along;

const VERSION: u32 = 3;
/// Counts below this are exact as times.
const COUNTED: u64 = 1 << 53;

/// Numbers that stand in a snapshot.
trait Item: Copy {
    const SIZE: usize;
    fn put(self, bytes: &mut Vec<u8>);
    fn get(bytes: &[u8]) -> Option<Self>;
}

macro_rules! items {
    ($($Type:ty),*) => {$(
        impl Item for $Type {
            const SIZE: usize = size_of::<Self>();
            fn put(self, bytes: &mut Vec<u8>) {
                bytes.extend(self.to_le_bytes());
            }
            fn get(bytes: &[u8]) -> Option<Self> {
                Some(Self::from_le_bytes(bytes.try_into().ok()?))
            }
        }
    )*};
}
items!(u8, u32, u64, f32, f64);

fn put_list<T: Item>(bytes: &mut Vec<u8>, values: &[T]) {
    (values.len() as u64).put(bytes);
    values.iter().for_each(|value| value.put(bytes));
}

/// What is left to read.
struct Source<'a>(&'a [u8]);

impl Source<'_> {
    fn take(&mut self, count: usize) -> Result<&[u8], SnapshotError> {
        let (head, rest) = self.0.split_at_checked(count).ok_or(SnapshotError::Damaged)?;
        self.0 = rest;
        Ok(head)
    }

    fn item<T: Item>(&mut self) -> Result<T, SnapshotError> {
        T::get(self.take(T::SIZE)?).ok_or(SnapshotError::Damaged)
    }

    fn list<T: Item>(&mut self) -> Result<Vec<T>, SnapshotError> {
        let count = usize::try_from(self.item::<u64>()?).map_err(|_| SnapshotError::Damaged)?;
        let bytes = self.take(count.checked_mul(T::SIZE).ok_or(SnapshotError::Damaged)?)?;
        bytes.chunks_exact(T::SIZE).map(|item| T::get(item).ok_or(SnapshotError::Damaged)).collect()
    }
}

pub(super) fn write(state: &SimulationState) -> Vec<u8> {
    let mut bytes = Vec::new();
    VERSION.put(&mut bytes);
    state.steps.put(&mut bytes);
    state.next_id.put(&mut bytes);
    state.support_km.put(&mut bytes);
    state.target_time.put(&mut bytes);
    state.renewals.put(&mut bytes);
    write_along(&mut bytes, &state.along);
    write_along(&mut bytes, &state.target_along);
    write_particles(&mut bytes, &state.particles);
    for (places, values) in [state.afterglow.green.to_lists(), state.afterglow.red.to_lists()] {
        put_list(&mut bytes, &places);
        put_list(&mut bytes, &values);
    }
    bytes
}

/// The state in `bytes`, whose afterglow has the layout of `like`.
pub(super) fn read(bytes: &[u8], like: &SimulationState) -> Result<SimulationState, SnapshotError> {
    let mut source = Source(bytes);
    let found = source.item::<u32>()?;
    if found != VERSION {
        return Err(SnapshotError::Version { found, known: VERSION });
    }
    let state = SimulationState {
        steps: source.item()?,
        next_id: source.item()?,
        support_km: source.item()?,
        target_time: source.item()?,
        renewals: source.item()?,
        along: read_along(&mut source)?,
        target_along: read_along(&mut source)?,
        particles: read_particles(&mut source)?,
        afterglow: Afterglow {
            green: read_map(&mut source, &like.afterglow.green)?,
            red: read_map(&mut source, &like.afterglow.red)?,
        },
    };
    if source.0.is_empty() && is_possible(&state) { Ok(state) } else { Err(SnapshotError::Damaged) }
}

/// Whether a state has only numbers, and counts that can go on.
fn is_possible(state: &SimulationState) -> bool {
    let finite = |along: &Along| {
        along.sheets.iter().flatten().all(|coordinate| coordinate.is_finite())
            && along.points.iter().flatten().all(|point| point.is_finite())
    };
    let numbers = state.particles.numbers();
    [state.steps, state.next_id].iter().all(|count| *count < COUNTED)
        && u64::from(state.renewals) <= state.steps
        && state.renewals < u32::MAX
        && state.support_km.is_finite()
        && state.support_km > 0.0
        && state.target_time.is_finite()
        && finite(&state.along)
        && finite(&state.target_along)
        && numbers.iter().all(|values| values.iter().all(|value| value.is_finite()))
}

fn write_along(bytes: &mut Vec<u8>, along: &Along) {
    (along.sheets.len() as u64).put(bytes);
    for ((coordinates, turned), points) in along.sheets.iter().zip(&along.turned).zip(&along.points) {
        put_list(bytes, coordinates);
        put_list(bytes, &turned.iter().map(|turned| u8::from(*turned)).collect::<Vec<_>>());
        let flat: Vec<f64> = points.iter().flat_map(|point| point.to_array()).collect();
        put_list(bytes, &flat);
    }
}

fn read_along(source: &mut Source) -> Result<Along, SnapshotError> {
    let mut along = Along::default();
    for _ in 0..source.item::<u64>()? {
        let (coordinates, turned) = (source.list::<f64>()?, source.list::<u8>()?);
        let flat = source.list::<f64>()?;
        if flat.len() != 2 * coordinates.len() || turned.len() != coordinates.len() {
            return Err(SnapshotError::Damaged);
        }
        along.turned.push(turned.iter().map(|turned| *turned != 0).collect());
        along.points.push(flat.chunks_exact(2).map(DVec2::from_slice).collect());
        along.sheets.push(coordinates);
    }
    Ok(along)
}

fn write_particles(bytes: &mut Vec<u8>, particles: &AuroraParticles) {
    put_list(bytes, &particles.ids);
    let dying: Vec<u8> = particles.dying.iter().map(|dying| u8::from(*dying)).collect();
    put_list(bytes, &dying);
    put_list(bytes, &particles.sheets);
    particles.numbers().into_iter().for_each(|values| put_list(bytes, values));
}

fn read_particles(source: &mut Source) -> Result<AuroraParticles, SnapshotError> {
    let mut particles = AuroraParticles { ids: source.list()?, ..AuroraParticles::default() };
    particles.dying = source.list::<u8>()?.iter().map(|dying| *dying != 0).collect();
    particles.sheets = source.list()?;
    for values in particles.numbers_mut() {
        *values = source.list()?;
    }
    let count = particles.ids.len();
    let lengths: [usize; NUMBERS] = particles.numbers().map(Vec::len);
    let whole = lengths.iter().all(|length| *length == count)
        && particles.dying.len() == count
        && particles.sheets.len() == count
        && particles.powers_w.iter().all(|power| *power >= 0.0 && !power.is_sign_negative());
    if whole { Ok(particles) } else { Err(SnapshotError::Damaged) }
}

fn read_map<const HEIGHTS: usize>(
    source: &mut Source,
    like: &GlowMap<HEIGHTS>,
) -> Result<GlowMap<HEIGHTS>, SnapshotError> {
    let (places, values) = (source.list::<u32>()?, source.list::<f32>()?);
    like.with_lists(&places, &values).ok_or(SnapshotError::Damaged)
}
