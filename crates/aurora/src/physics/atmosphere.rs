//! The atmosphere from 80 to 800 km, from NRLMSISE-00 (Picone et al. 2002, J. Geophys. Res. 107, 1468).

use std::sync::LazyLock;

use bansho_base::math;

/// Table for a typical auroral night: a comment, a header, then altitude in km and the seven fields of [`AirLevel`].
const TABLE_TEXT: &str = include_str!("data/nrlmsise00.csv");

/// Altitude of the lowest level, km.
pub const LOWEST_KM: f64 = 80.0;
/// Altitude of the highest level, km.
pub(crate) const HIGHEST_KM: f64 = 800.0;
/// Levels of every altitude table: one per km, both ends included.
pub const LEVELS: usize = 721;
/// Distance between two levels, m.
pub const LEVEL_SPACING: f64 = 1000.0;

/// The air at one altitude.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AirLevel {
    /// Number density of N2, m^-3.
    pub n2: f64,
    /// Number density of O2, m^-3.
    pub o2: f64,
    /// Number density of O, m^-3.
    pub o: f64,
    /// Temperature, K.
    pub temperature: f64,
    /// Mass density, kg m^-3; it includes the rarer constituents (Ar, He, H, N).
    pub density: f64,
    /// Scale height k T / (m g), m.
    pub scale_height: f64,
    /// Mass of the column above, kg m^-2.
    pub column_above: f64,
}

impl AirLevel {
    const fn from_fields([n2, o2, o, temperature, density, scale_height, column_above]: [f64; 7]) -> Self {
        Self { n2, o2, o, temperature, density, scale_height, column_above }
    }

    const fn fields(&self) -> [f64; 7] {
        [self.n2, self.o2, self.o, self.temperature, self.density, self.scale_height, self.column_above]
    }

    /// Number density of N2, O2 and O together, m^-3.
    #[must_use]
    pub(crate) const fn number_density(&self) -> f64 {
        self.n2 + self.o2 + self.o
    }

    /// Interpolates every quantity logarithmically: densities fall exponentially with altitude.
    fn interpolate(&self, above: &Self, fraction: f64) -> Self {
        let (low, high) = (self.fields(), above.fields());
        Self::from_fields(std::array::from_fn(|i| math::exp(math::lerp(math::ln(low[i]), math::ln(high[i]), fraction))))
    }
}

/// The atmosphere as levels 1 km apart.
#[derive(Clone, Debug)]
pub struct Atmosphere {
    levels: Vec<AirLevel>,
}

/// The atmosphere that all auroras share, parsed on first use.
#[must_use]
pub fn atmosphere() -> &'static Atmosphere {
    static ATMOSPHERE: LazyLock<Atmosphere> = LazyLock::new(Atmosphere::new);
    &ATMOSPHERE
}

impl Atmosphere {
    fn new() -> Self {
        let rows = read_rows();
        let levels = (0..LEVELS).map(|level| {
            let altitude_km = level_altitude_km(level);
            let above = rows.partition_point(|(row_km, _)| *row_km <= altitude_km).clamp(1, rows.len() - 1);
            let ((low_km, low), (high_km, high)) = (&rows[above - 1], &rows[above]);
            low.interpolate(high, (altitude_km - low_km) / (high_km - low_km))
        });
        Self { levels: levels.collect() }
    }

    /// The [`LEVELS`] levels, from [`LOWEST_KM`] up.
    #[must_use]
    pub fn levels(&self) -> &[AirLevel] {
        &self.levels
    }

    /// The air at an altitude, clamped to 80-800 km; logarithmic interpolation between levels.
    #[must_use]
    pub fn at(&self, altitude_km: f64) -> AirLevel {
        let (level, fraction) = locate_level(altitude_km);
        self.levels[level].interpolate(&self.levels[level + 1], fraction)
    }
}

/// Altitude of a level, km.
#[must_use]
pub fn level_altitude_km(level: usize) -> f64 {
    LOWEST_KM + level as f64
}

/// The level below an altitude and the interpolation fraction toward the next; clamped to 80-800 km.
#[must_use]
pub(crate) fn locate_level(altitude_km: f64) -> (usize, f64) {
    let coordinate = (altitude_km - LOWEST_KM).clamp(0.0, (LEVELS - 1) as f64);
    let level = (coordinate as usize).min(LEVELS - 2);
    (level, coordinate - level as f64)
}

/// Whether an altitude is within the levels.
#[must_use]
pub fn covers(altitude_km: f64) -> bool {
    (LOWEST_KM..=HIGHEST_KM).contains(&altitude_km)
}

/// Altitude in km and air of each row of the table.
fn read_rows() -> Vec<(f64, AirLevel)> {
    let mut rows = Vec::new();
    for line in TABLE_TEXT.lines().skip(2) {
        // The table is compiled in and a test parses every field, so NaN cannot occur.
        let mut fields = line.split(',').map(|field| field.parse().unwrap_or(f64::NAN));
        let altitude_km = fields.next().unwrap_or(f64::NAN);
        rows.push((altitude_km, AirLevel::from_fields(std::array::from_fn(|_| fields.next().unwrap_or(f64::NAN)))));
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_whole() {
        let rows = read_rows();
        assert_eq!((rows.len(), rows[0].0, rows[rows.len() - 1].0), (241, LOWEST_KM, HIGHEST_KM));
        assert!(rows.iter().all(|(_, air)| air.fields().iter().all(|value| *value > 0.0 && value.is_finite())));
        assert!(rows.windows(2).all(|pair| pair[0].0 < pair[1].0 && pair[0].1.density > pair[1].1.density));
    }

    #[test]
    fn levels_are_the_rows_and_lie_logarithmically_between() {
        let air = atmosphere();
        assert_eq!(air.levels().len(), LEVELS);
        let close = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-6;
        assert!(close(air.at(110.0).n2, 1.48394e18) && close(air.at(250.0).o, 1.06169e15));
        assert!(close(air.at(110.5).o, (air.at(110.0).o * air.at(111.0).o).sqrt()));
        // Rows lie 5 km apart there: two fifths of the way in the logarithm.
        let (low, high) = (air.at(300.0), air.at(305.0));
        assert!(close(air.at(302.0).density, low.density * math::pow(high.density / low.density, 0.4)));
        assert!(close(air.at(20.0).n2, air.at(80.0).n2) && close(air.at(1e9).n2, air.at(800.0).n2));
    }

    #[test]
    fn density_adds_up_to_the_column_above() {
        let levels = atmosphere().levels();
        let at_300 = 220;
        let between: f64 = levels[20..at_300]
            .windows(2)
            .map(|pair| {
                LEVEL_SPACING * (pair[0].density - pair[1].density) / math::ln(pair[0].density / pair[1].density)
            })
            .sum();
        let expected = levels[20].column_above - levels[at_300 - 1].column_above;
        assert!((between / expected - 1.0).abs() < 0.01, "{between} for {expected}");
    }
}
