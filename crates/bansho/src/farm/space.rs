//! Whether the frames of a shot fit on the disk, as far as it tells how much is free.

use std::path::Path;

use super::{chunks::ShotCosts, error::FarmError};

/// Factor from the size of the frames that were measured to that of all: some are harder to compress.
const HEADROOM: f64 = 1.2;

/// Bytes that frames and snapshots will take.
pub fn required_bytes(costs: &ShotCosts, frames: u64, snapshots: u64) -> u64 {
    let bytes = costs.frame_bytes as f64 * frames as f64 + costs.snapshot_bytes as f64 * snapshots as f64;
    (HEADROOM * bytes) as u64
}

/// A number of bytes in words.
fn in_words(bytes: u64) -> String {
    const UNITS: [(&str, f64); 4] = [("TB", 1e12), ("GB", 1e9), ("MB", 1e6), ("kB", 1e3)];
    let bytes = bytes as f64;
    let unit = UNITS.into_iter().find(|(_, size)| bytes >= *size);
    unit.map_or_else(|| format!("{bytes} bytes"), |(unit, size)| format!("{:.1} {unit}", bytes / size))
}

/// Checks that `required` bytes fit where `available` bytes are free. Nothing is checked where that is unknown.
///
/// # Errors
/// They do not fit.
pub fn check(folder: &Path, required: u64, available: Option<u64>) -> Result<(), FarmError> {
    match available {
        Some(available) if available < required => Err(FarmError::Space {
            path: folder.to_path_buf(),
            required: in_words(required),
            available: in_words(available),
        }),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_show_that_does_not_fit_is_refused_in_words() {
        let costs = ShotCosts { frame_bytes: 50_000_000, snapshot_bytes: 5_000_000, ..ShotCosts::default() };
        let required = required_bytes(&costs, 108_000, 100);
        assert_eq!(required, 6_480_600_000_000);
        check(Path::new("a"), required, Some(required)).unwrap();
        check(Path::new("a"), required, None).unwrap();
        let error = check(Path::new("a"), required, Some(900_000_000)).unwrap_err().to_string();
        assert_eq!(error, "a: the frames will take about 6.5 TB, and 900.0 MB are free");
        assert_eq!(in_words(999), "999 bytes");
    }
}
