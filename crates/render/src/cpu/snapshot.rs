//! Snapshots of a shot: a header with version and key, each phenomenon's steps and state, a checksum behind all.

use bansho_base::phenomenon::{Phenomenon, SnapshotError};

use super::clock::Clock;
use crate::{backend::RenderError, fingerprint, plan::Plan};

const MAGIC: &[u8; 8] = b"BANSHOSS";
const VERSION: u32 = 1;
const CHECKSUM: usize = 32;

pub(super) fn write(plan: &Plan, phenomena: &[Box<dyn Phenomenon>], clocks: &[Clock]) -> Vec<u8> {
    let mut bytes = Vec::new();
    bytes.extend_from_slice(MAGIC);
    bytes.extend_from_slice(&VERSION.to_le_bytes());
    bytes.extend_from_slice(&fingerprint::of_state(plan));
    bytes.extend_from_slice(&(phenomena.len() as u64).to_le_bytes());
    for (phenomenon, clock) in phenomena.iter().zip(clocks) {
        let state = phenomenon.snapshot();
        bytes.extend_from_slice(&clock.taken.to_le_bytes());
        bytes.extend_from_slice(&(state.len() as u64).to_le_bytes());
        bytes.extend_from_slice(&state);
    }
    let checksum = *blake3::hash(&bytes).as_bytes();
    bytes.extend_from_slice(&checksum);
    bytes
}

/// Restores `phenomena`, which must be at their beginning, and gives their clocks.
pub(super) fn read(
    plan: &Plan,
    bytes: &[u8],
    phenomena: &mut [Box<dyn Phenomenon>],
) -> Result<Vec<Clock>, RenderError> {
    let damaged = || RenderError::from(SnapshotError::Damaged);
    let (contents, checksum) = bytes.len().checked_sub(CHECKSUM).map(|at| bytes.split_at(at)).ok_or_else(damaged)?;
    let mut rest = contents.strip_prefix(MAGIC).ok_or_else(damaged)?;
    let found = u32::from_le_bytes(take(&mut rest).ok_or_else(damaged)?);
    if found != VERSION {
        return Err(SnapshotError::Version { found, known: VERSION }.into());
    }
    if blake3::hash(contents).as_bytes() != checksum {
        return Err(damaged());
    }
    let key: [u8; 32] = take(&mut rest).ok_or_else(damaged)?;
    if key != fingerprint::of_state(plan) {
        return Err(RenderError::ForeignSnapshot);
    }
    if u64::from_le_bytes(take(&mut rest).ok_or_else(damaged)?) != phenomena.len() as u64 {
        return Err(damaged());
    }
    phenomena.iter_mut().map(|phenomenon| read_one(&mut rest, phenomenon.as_mut())).collect()
}

fn read_one(rest: &mut &[u8], phenomenon: &mut dyn Phenomenon) -> Result<Clock, RenderError> {
    let mut word = || take(rest).map(u64::from_le_bytes).ok_or(SnapshotError::Damaged);
    let (taken, length) = (word()?, word()?);
    let length = usize::try_from(length).ok().filter(|length| *length <= rest.len()).ok_or(SnapshotError::Damaged)?;
    let (state, behind) = rest.split_at(length);
    *rest = behind;
    if phenomenon.stepping().is_some() {
        phenomenon.restore(state)?;
    }
    Ok(Clock { taken })
}

fn take<const N: usize>(rest: &mut &[u8]) -> Option<[u8; N]> {
    let (head, behind) = rest.split_first_chunk::<N>()?;
    *rest = behind;
    Some(*head)
}
