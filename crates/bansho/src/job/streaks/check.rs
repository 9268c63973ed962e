//! Checks of the parameters of streak textures.

use super::Streaks;
use crate::job::error::{MAX_DROPS, StreakList, StreaksError};
use bansho_rain::{
    OpacityLaw,
    billboards::texture::{StreakQuantity, StreakTextureError},
    drops::size_distribution::{DropSizeDistribution, SizeBin},
};

/// Smallest side of a texture, pixels.
const MIN_TEXTURE_SIZE: usize = 8;

/// Checks all parameters.
///
/// # Errors
/// The first parameter that is out of range.
pub(crate) fn check(streaks: &Streaks) -> Result<(), StreaksError> {
    check_list(StreakList::RainRates, &streaks.rates)?;
    check_list(StreakList::DropDiameters, &streaks.diameters)?;
    let cube = &streaks.cube;
    // A smaller texture is of no use in a file.
    if cube.size < MIN_TEXTURE_SIZE {
        return Err(StreaksError::TextureSize(cube.size));
    }
    cube.check().map_err(|error| match error {
        StreakTextureError::OutOfRange { quantity: StreakQuantity::Exposure, value } => StreaksError::Exposure(value),
        StreakTextureError::OutOfRange { quantity: StreakQuantity::Size, .. } => StreaksError::TextureSize(cube.size),
        StreakTextureError::OutOfRange { quantity: StreakQuantity::Edge, value } => StreaksError::CubeSize(value),
        other => other.into(),
    })?;
    if !(1..=1000).contains(&streaks.variants) {
        return Err(StreaksError::Variants(streaks.variants));
    }
    if streaks.light.is_some_and(|light| !light.iter().map(|x| x * x).sum::<f64>().is_normal()) {
        return Err(StreaksError::LightDirection);
    }
    if !(0.0..=1.0).contains(&streaks.oscillation) {
        return Err(StreaksError::Oscillation(streaks.oscillation));
    }
    if streaks.oscillation > 0.0 && streaks.light.is_none() {
        return Err(StreaksError::OscillationWithoutLight);
    }
    if streaks.oscillation > 0.0 && cube.opacity == OpacityLaw::Paper {
        return Err(StreaksError::OscillationOfLines);
    }
    check_counts(streaks)
}

fn check_list(list: StreakList, values: &[f64]) -> Result<(), StreaksError> {
    let [min, max] = list.limits();
    if values.is_empty() {
        return Err(StreaksError::EmptyList(list));
    }
    for (index, &value) in values.iter().enumerate() {
        let number = index + 1;
        if !(min..=max).contains(&value) {
            return Err(StreaksError::ValueOutOfRange { list, number, value });
        }
        if let Some(&previous) = index.checked_sub(1).and_then(|before| values.get(before))
            && value <= previous
        {
            return Err(StreaksError::NotAscending { list, number, value, previous });
        }
    }
    Ok(())
}

fn check_counts(streaks: &Streaks) -> Result<(), StreaksError> {
    let bins = SizeBin::around(&streaks.diameters);
    for &rate in &streaks.rates {
        let sizes = DropSizeDistribution::marshall_palmer(rate);
        for bin in &bins {
            let drops = streaks.cube.mean_count(&sizes, bin);
            if drops > f64::from(MAX_DROPS) {
                return Err(StreaksError::TooManyDrops { rate, diameter_mm: bin.diameter_mm, drops });
            }
        }
    }
    Ok(())
}
