//! `bansho calibrate`

use anyhow::ensure;
use bansho::aurora::physics::{
    atmosphere::atmosphere,
    calibration::{CalibrationCheck, calibrate},
};

use crate::output::print;

/// Prints the calibration of the aurora's light, and checks it against observations.
pub(crate) fn run() -> anyhow::Result<()> {
    let calibration = calibrate(atmosphere());
    print(&calibration.to_string())?;
    let failed = calibration.checks.iter().filter(|check| !CalibrationCheck::holds(check)).count();
    ensure!(failed == 0, "{failed} of {} requirements are not met", calibration.checks.len());
    Ok(())
}
