//! What cannot be drawn as streak textures.

use bansho_base::host::plural::counted;

use super::Streaks;
use bansho_rain::drops::{
    size_distribution::{DropSizeDistribution, SizeBin},
    terminal_velocity::NoTerminalVelocity,
};

/// Which list a fault is in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ListKind {
    /// Rain rates.
    #[error("rain rates")]
    Rates,
    /// Drop diameters.
    #[error("drop diameters")]
    Diameters,
}

impl ListKind {
    /// Least and most of a value.
    fn limits(self) -> [f64; 2] {
        match self {
            Self::Rates => [0.0, 500.0],
            Self::Diameters => [0.05, 8.0],
        }
    }

    fn unit(self) -> &'static str {
        match self {
            Self::Rates => "mm/h",
            Self::Diameters => "mm",
        }
    }
}

/// Why streak textures cannot be made as asked for.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StreaksError {
    /// A list without values.
    #[error("{0}: the list is empty")]
    Empty(ListKind),
    /// A rate or diameter that no rain has.
    #[error("{list}: value {place} is {value}; allowed: {} to {} {}", list.limits()[0], list.limits()[1], list.unit())]
    Value {
        /// The list.
        list: ListKind,
        /// Which value, from 1.
        place: usize,
        /// The value.
        value: f64,
    },
    /// A list that does not ascend.
    #[error("{list}: value {place} is {value} after {before}; the list must ascend")]
    Order {
        /// The list.
        list: ListKind,
        /// Which value, from 1.
        place: usize,
        /// The value.
        value: f64,
        /// The one before it.
        before: f64,
    },
    /// An exposure of no time, or a very long one.
    #[error("an exposure of {0} s; allowed: 0.000001 to 10 s")]
    Exposure(f64),
    /// A texture too small or too large.
    #[error("textures of {} a side; allowed: 8 to 4096", counted(*.0, "pixel"))]
    Size(usize),
    /// A cube too small or too large.
    #[error("a cube of {0} m; allowed: 0.001 to 100 m")]
    Edge(f64),
    /// No variant, or very many.
    #[error("{0} variants; allowed: 1 to 1000")]
    Variants(u32),
    /// A light from nowhere.
    #[error("the vector toward the light must have a length")]
    Light,
    /// More drops than an index can list.
    #[error(
        "a texture at {rate} mm/h and {diameter_mm} mm would hold {drops:.0} drops; allowed: up to {MOST_DROPS}, so choose a smaller cube"
    )]
    Drops {
        /// Rain rate, mm/h.
        rate: f64,
        /// Diameter, mm.
        diameter_mm: f64,
        /// How many on average.
        drops: f64,
    },
    /// The paper's formula has no velocity for a diameter.
    #[error("{0}; measured velocities know all diameters")]
    Velocity(NoTerminalVelocity),
}

/// Most drops of one texture.
const MOST_DROPS: u32 = 1_000_000;

/// The first fault.
pub(crate) fn check(streaks: &Streaks) -> Result<(), StreaksError> {
    check_list(ListKind::Rates, &streaks.rates)?;
    check_list(ListKind::Diameters, &streaks.diameters)?;
    let cube = &streaks.cube;
    if !(1e-6..=10.0).contains(&cube.exposure) {
        return Err(StreaksError::Exposure(cube.exposure));
    }
    if !(8..=4096).contains(&cube.size) {
        return Err(StreaksError::Size(cube.size));
    }
    if !(1e-3..=100.0).contains(&cube.edge) {
        return Err(StreaksError::Edge(cube.edge));
    }
    if !(1..=1000).contains(&streaks.variants) {
        return Err(StreaksError::Variants(streaks.variants));
    }
    if streaks.light.is_some_and(|light| !light.iter().map(|x| x * x).sum::<f64>().is_normal()) {
        return Err(StreaksError::Light);
    }
    check_counts(streaks)
}

fn check_list(list: ListKind, values: &[f64]) -> Result<(), StreaksError> {
    let [least, most] = list.limits();
    if values.is_empty() {
        return Err(StreaksError::Empty(list));
    }
    for (index, &value) in values.iter().enumerate() {
        let place = index + 1;
        if !(least..=most).contains(&value) {
            return Err(StreaksError::Value { list, place, value });
        }
        if let Some(&before) = index.checked_sub(1).and_then(|before| values.get(before))
            && value <= before
        {
            return Err(StreaksError::Order { list, place, value, before });
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
            if drops > f64::from(MOST_DROPS) {
                return Err(StreaksError::Drops { rate, diameter_mm: bin.diameter_mm, drops });
            }
        }
    }
    Ok(())
}
