//! `bansho calibrate`

use anyhow::ensure;
use bansho::aurora::physics::{
    atmosphere::atmosphere,
    calibration::{CalibrationCheck, calibrate},
};

use crate::output::to_stdout;

/// Prints the figures of the aurora's light, and what is demanded of them.
pub(crate) fn run() -> anyhow::Result<()> {
    let calibration = calibrate(atmosphere());
    to_stdout(&calibration.to_string())?;
    let failed = calibration.checks.iter().filter(|check| !CalibrationCheck::holds(check)).count();
    ensure!(failed == 0, "{failed} of {} demands do not hold", calibration.checks.len());
    Ok(())
}
