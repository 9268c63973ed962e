//! The state of the simulation, and its serialization: a version, then little-endian numbers and length-prefixed arrays.

use bansho_base::{math::DVec2, phenomenon::SnapshotError};

use super::{
    AuroraParticles,
    afterglow::{Afterglow, AfterglowMap},
    particles::FLOAT_ARRAYS,
};
use crate::simulate::sheets::arc_length::ArcLengthMap;

const VERSION: u32 = 3;
/// Counts below this are exact in f64.
const MAX_EXACT_COUNT: u64 = 1 << 53;

/// State that a step changes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SimulationState {
    pub(super) steps: u64,
    pub(super) next_id: u64,
    /// Support radius h of the repulsion, km.
    pub(super) support_km: f64,
    /// Arc-length map of the current sheets.
    pub(super) arc_map: ArcLengthMap,
    /// Arc-length map of the target shape, and its time, s.
    pub(super) target_arc_map: ArcLengthMap,
    pub(super) target_time: f64,
    /// Number of updates of the target.
    pub(super) target_updates: u32,
    pub(super) particles: AuroraParticles,
    pub(super) afterglow: Afterglow,
}

/// Numbers in a snapshot.
trait SnapshotValue: Copy {
    const SIZE: usize;
    fn put(self, bytes: &mut Vec<u8>);
    fn get(bytes: &[u8]) -> Option<Self>;
}

macro_rules! impl_snapshot_value {
    ($($Type:ty),*) => {$(
        impl SnapshotValue for $Type {
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
impl_snapshot_value!(u8, u32, u64, f32, f64);

fn put_list<T: SnapshotValue>(bytes: &mut Vec<u8>, values: &[T]) {
    (values.len() as u64).put(bytes);
    values.iter().for_each(|value| value.put(bytes));
}

/// Remaining bytes.
struct SnapshotReader<'a>(&'a [u8]);

impl SnapshotReader<'_> {
    fn take(&mut self, count: usize) -> Result<&[u8], SnapshotError> {
        let (head, rest) = self.0.split_at_checked(count).ok_or(SnapshotError::Damaged)?;
        self.0 = rest;
        Ok(head)
    }

    fn item<T: SnapshotValue>(&mut self) -> Result<T, SnapshotError> {
        T::get(self.take(T::SIZE)?).ok_or(SnapshotError::Damaged)
    }

    fn list<T: SnapshotValue>(&mut self) -> Result<Vec<T>, SnapshotError> {
        let count = usize::try_from(self.item::<u64>()?).map_err(|_| SnapshotError::Damaged)?;
        let bytes = self.take(count.checked_mul(T::SIZE).ok_or(SnapshotError::Damaged)?)?;
        bytes.chunks_exact(T::SIZE).map(|item| T::get(item).ok_or(SnapshotError::Damaged)).collect()
    }
}

impl SimulationState {
    /// The bytes of the state.
    pub(super) fn serialize(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        VERSION.put(&mut bytes);
        self.steps.put(&mut bytes);
        self.next_id.put(&mut bytes);
        self.support_km.put(&mut bytes);
        self.target_time.put(&mut bytes);
        self.target_updates.put(&mut bytes);
        write_arc_map(&mut bytes, &self.arc_map);
        write_arc_map(&mut bytes, &self.target_arc_map);
        write_particles(&mut bytes, &self.particles);
        for (tile_positions, values) in [self.afterglow.green.to_arrays(), self.afterglow.red.to_arrays()] {
            put_list(&mut bytes, &tile_positions);
            put_list(&mut bytes, &values);
        }
        bytes
    }

    /// The state of bytes from [`Self::serialize`]. Its afterglow has the same layout as that of `layout`.
    ///
    /// # Errors
    ///
    /// Bytes of another version, truncated or trailing bytes, or values that no simulation reaches.
    pub(super) fn deserialize(bytes: &[u8], layout: &Self) -> Result<Self, SnapshotError> {
        let mut reader = SnapshotReader(bytes);
        let found = reader.item::<u32>()?;
        if found != VERSION {
            return Err(SnapshotError::Version { found, known: VERSION });
        }
        let state = Self {
            steps: reader.item()?,
            next_id: reader.item()?,
            support_km: reader.item()?,
            target_time: reader.item()?,
            target_updates: reader.item()?,
            arc_map: read_arc_map(&mut reader)?,
            target_arc_map: read_arc_map(&mut reader)?,
            particles: read_particles(&mut reader)?,
            afterglow: Afterglow {
                green: read_map(&mut reader, &layout.afterglow.green)?,
                red: read_map(&mut reader, &layout.afterglow.red)?,
            },
        };
        if reader.0.is_empty() && state.is_valid() { Ok(state) } else { Err(SnapshotError::Damaged) }
    }

    /// Whether numbers are finite and counts within range.
    fn is_valid(&self) -> bool {
        let arrays = self.particles.float_arrays();
        [self.steps, self.next_id].iter().all(|count| *count < MAX_EXACT_COUNT)
            && u64::from(self.target_updates) <= self.steps
            && self.target_updates < u32::MAX
            && self.support_km.is_finite()
            && self.support_km > 0.0
            && self.target_time.is_finite()
            && is_finite(&self.arc_map)
            && is_finite(&self.target_arc_map)
            && arrays.iter().all(|values| values.iter().all(|value| value.is_finite()))
    }
}

/// Whether all coordinates and points of a map are finite.
fn is_finite(arc_map: &ArcLengthMap) -> bool {
    arc_map.coordinates.iter().flatten().all(|coordinate| coordinate.is_finite())
        && arc_map.points.iter().flatten().all(|point| point.is_finite())
}

fn write_arc_map(bytes: &mut Vec<u8>, arc_map: &ArcLengthMap) {
    (arc_map.coordinates.len() as u64).put(bytes);
    for ((coordinates, reversed), points) in arc_map.coordinates.iter().zip(&arc_map.reversed).zip(&arc_map.points) {
        put_list(bytes, coordinates);
        put_list(bytes, &reversed.iter().map(|reversed| u8::from(*reversed)).collect::<Vec<_>>());
        let flat: Vec<f64> = points.iter().flat_map(|point| point.to_array()).collect();
        put_list(bytes, &flat);
    }
}

fn read_arc_map(reader: &mut SnapshotReader) -> Result<ArcLengthMap, SnapshotError> {
    let mut arc_map = ArcLengthMap::default();
    for _ in 0..reader.item::<u64>()? {
        let (coordinates, reversed) = (reader.list::<f64>()?, reader.list::<u8>()?);
        let flat = reader.list::<f64>()?;
        if flat.len() != 2 * coordinates.len() || reversed.len() != coordinates.len() {
            return Err(SnapshotError::Damaged);
        }
        arc_map.reversed.push(reversed.iter().map(|reversed| *reversed != 0).collect());
        arc_map.points.push(flat.chunks_exact(2).map(DVec2::from_slice).collect());
        arc_map.coordinates.push(coordinates);
    }
    Ok(arc_map)
}

fn write_particles(bytes: &mut Vec<u8>, particles: &AuroraParticles) {
    put_list(bytes, &particles.ids);
    let dying: Vec<u8> = particles.dying.iter().map(|dying| u8::from(*dying)).collect();
    put_list(bytes, &dying);
    put_list(bytes, &particles.sheets);
    particles.float_arrays().into_iter().for_each(|values| put_list(bytes, values));
}

fn read_particles(reader: &mut SnapshotReader) -> Result<AuroraParticles, SnapshotError> {
    let mut particles = AuroraParticles { ids: reader.list()?, ..AuroraParticles::default() };
    particles.dying = reader.list::<u8>()?.iter().map(|dying| *dying != 0).collect();
    particles.sheets = reader.list()?;
    for values in particles.float_arrays_mut() {
        *values = reader.list()?;
    }
    let count = particles.ids.len();
    let lengths: [usize; FLOAT_ARRAYS] = particles.float_arrays().map(Vec::len);
    let whole = lengths.iter().all(|length| *length == count)
        && particles.dying.len() == count
        && particles.sheets.len() == count
        && particles.powers_w.iter().all(|power| *power >= 0.0 && !power.is_sign_negative());
    if whole { Ok(particles) } else { Err(SnapshotError::Damaged) }
}

fn read_map<const ALTITUDES: usize>(
    reader: &mut SnapshotReader,
    layout: &AfterglowMap<ALTITUDES>,
) -> Result<AfterglowMap<ALTITUDES>, SnapshotError> {
    let (tile_positions, values) = (reader.list::<u32>()?, reader.list::<f32>()?);
    layout.with_arrays(&tile_positions, &values).ok_or(SnapshotError::Damaged)
}
