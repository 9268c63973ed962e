//! Snapshots of a shot: a header with version and fingerprint, steps and state of each phenomenon, a BLAKE3 checksum at the end.

use bansho_base::phenomenon::SnapshotError;

use crate::{
    compiled::{ActiveRun, CompiledScene},
    shot::RenderError,
};

const MAGIC: &[u8; 8] = b"BANSHOSS";
const VERSION: u32 = 1;
const CHECKSUM_BYTES: usize = 32;

pub(crate) fn write(compiled: &CompiledScene, runs: &[ActiveRun]) -> Vec<u8> {
    let mut bytes = Vec::new();
    bytes.extend_from_slice(MAGIC);
    bytes.extend_from_slice(&VERSION.to_le_bytes());
    bytes.extend_from_slice(&compiled.state_fingerprint());
    bytes.extend_from_slice(&(runs.len() as u64).to_le_bytes());
    for run in runs {
        let state = run.as_stepped().map(|stepped| stepped.snapshot()).unwrap_or_default();
        bytes.extend_from_slice(&run.steps_taken.to_le_bytes());
        bytes.extend_from_slice(&(state.len() as u64).to_le_bytes());
        bytes.extend_from_slice(&state);
    }
    let checksum = *blake3::hash(&bytes).as_bytes();
    bytes.extend_from_slice(&checksum);
    bytes
}

/// Checks that `bytes` are a whole snapshot, of whatever scene.
///
/// # Errors
/// They are damaged, or of another version.
pub fn check(bytes: &[u8]) -> Result<(), SnapshotError> {
    contents(bytes).map(drop)
}

/// What stands between the version and the checksum of a whole snapshot.
fn contents(bytes: &[u8]) -> Result<&[u8], SnapshotError> {
    let damaged = SnapshotError::Damaged;
    let split = bytes.len().checked_sub(CHECKSUM_BYTES).map(|at| bytes.split_at(at));
    let (contents, checksum) = split.ok_or(damaged)?;
    let mut rest = contents.strip_prefix(MAGIC).ok_or(damaged)?;
    let found = u32::from_le_bytes(take(&mut rest).ok_or(damaged)?);
    if found != VERSION {
        return Err(SnapshotError::Version { found, known: VERSION });
    }
    if blake3::hash(contents).as_bytes() != checksum { Err(damaged) } else { Ok(rest) }
}

/// Restores `runs`, which must be in their initial states.
pub(crate) fn read(compiled: &CompiledScene, bytes: &[u8], runs: &mut [ActiveRun]) -> Result<(), RenderError> {
    let mut rest = contents(bytes)?;
    let fingerprint: [u8; 32] = take(&mut rest).ok_or(SnapshotError::Damaged)?;
    if fingerprint != compiled.state_fingerprint() {
        return Err(RenderError::ForeignSnapshot);
    }
    if take_number(&mut rest)? != runs.len() as u64 {
        return Err(SnapshotError::Damaged.into());
    }
    runs.iter_mut().try_for_each(|run| read_run(&mut rest, run))
}

fn read_run(rest: &mut &[u8], run: &mut ActiveRun) -> Result<(), RenderError> {
    let (steps_taken, length) = (take_number(rest)?, take_number(rest)?);
    let length = usize::try_from(length).ok().filter(|length| *length <= rest.len()).ok_or(SnapshotError::Damaged)?;
    let (state, after) = rest.split_at(length);
    *rest = after;
    if let Some(stepped) = run.run.as_stepped_mut() {
        stepped.restore(state)?;
    }
    run.steps_taken = steps_taken;
    Ok(())
}

/// Takes a number of 64 bits, little-endian, off the front.
fn take_number(rest: &mut &[u8]) -> Result<u64, SnapshotError> {
    take(rest).map(u64::from_le_bytes).ok_or(SnapshotError::Damaged)
}

/// Takes the first `N` bytes off the front; `None` if there are fewer.
fn take<const N: usize>(rest: &mut &[u8]) -> Option<[u8; N]> {
    let (head, after) = rest.split_first_chunk::<N>()?;
    *rest = after;
    Some(*head)
}
