//! Drop size distributions n(D): Marshall and Palmer's exponential, and tables.

use std::f64::consts::PI;

use bansho_base::{math, math::random};

use super::terminal_velocity::TerminalVelocity;

/// Intercept N0 of Marshall and Palmer, per m^3 per mm.
const INTERCEPT: f64 = 8000.0;

/// Drop size distribution n(D): drops per m^3 of air per mm of diameter.
#[derive(Clone, Debug, PartialEq)]
pub enum DropSizeDistribution {
    /// `n = 8000 exp(-slope D)`, with the slope in 1/mm.
    Exponential {
        /// Slope Lambda, 1/mm; infinite where there is no rain.
        slope_per_mm: f64,
    },
    /// Piecewise linear between points of a table; no drops outside it.
    Table(SizeTable),
}

impl DropSizeDistribution {
    /// All diameters, mm.
    pub const ALL: [f64; 2] = [0.0, f64::INFINITY];

    /// The distribution of Marshall and Palmer (1948) at rain rate R, eq. (1): `n = 8000 exp(-4.1 R^-0.21 D)`. Without rain it is empty.
    pub fn marshall_palmer(rate_mm_per_h: f64) -> Self {
        let rate = rate_mm_per_h.max(0.0);
        let exponent = if cfg!(feature = "broken-kernel") { 0.21 } else { -0.21 };
        Self::Exponential { slope_per_mm: if rate > 0.0 { 4.1 * math::pow(rate, exponent) } else { f64::INFINITY } }
    }

    /// n(D), per m^3 per mm.
    pub fn density(&self, diameter_mm: f64) -> f64 {
        match self {
            Self::Exponential { slope_per_mm } if slope_per_mm.is_finite() => {
                INTERCEPT * math::exp(-slope_per_mm * diameter_mm)
            }
            Self::Exponential { .. } => 0.0,
            Self::Table(table) => table.density(diameter_mm),
        }
    }

    /// Moment of order k: integral of `n D^k dD` over a range of diameters (mm), mm^k per m^3.
    pub fn moment(&self, k: u32, [low, high]: [f64; 2]) -> f64 {
        match self {
            Self::Exponential { slope_per_mm } => {
                INTERCEPT * (exponential_tail(k, *slope_per_mm, low) - exponential_tail(k, *slope_per_mm, high))
            }
            Self::Table(table) => table.moment(k, [low, high]),
        }
    }

    /// Drops per m^3 with diameters in a range (mm).
    pub fn count(&self, range_mm: [f64; 2]) -> f64 {
        self.moment(0, range_mm)
    }

    /// Inverse of the cumulative distribution within a range, mm: the diameter below which the fraction `u` of its
    /// drops lies. It maps uniform random numbers to diameters.
    pub fn quantile(&self, u: f64, [low, high]: [f64; 2]) -> f64 {
        match self {
            Self::Exponential { slope_per_mm } if slope_per_mm.is_finite() => {
                let within = -math::exp_m1(-slope_per_mm * (high - low));
                (low - math::ln_1p(-u * within) / slope_per_mm).clamp(low, high)
            }
            Self::Exponential { .. } => low,
            Self::Table(table) => table.quantile(u, [low, high]),
        }
    }

    /// Liquid water content, g per m^3.
    pub fn liquid_water(&self) -> f64 {
        1e-3 * PI / 6.0 * self.moment(3, Self::ALL)
    }

    /// Median volume diameter, mm: larger drops hold half of the water; 0 without drops.
    pub fn median_volume_diameter(&self) -> f64 {
        let whole = self.moment(3, Self::ALL);
        if whole <= 0.0 {
            return 0.0;
        }
        let (mut low, mut high) = (0.0, LARGEST_MM);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            *(if self.moment(3, [0.0, middle]) < 0.5 * whole { &mut low } else { &mut high }) = middle;
        }
        high
    }

    /// The rain rate of the drops in a range of diameters, mm/h.
    ///
    /// The fit of Marshall and Palmer does not reproduce its own rate: with measured velocities it gives 14 to 18 %
    /// more.
    pub fn rain_rate(&self, terminal_velocity: &TerminalVelocity, [low, high]: [f64; 2]) -> f64 {
        /// Midpoint rule with an error of 1e-6: the velocity is a table with steps of 0.1 to 0.2 mm.
        const STEPS: usize = 2000;
        let high = high.min(LARGEST_MM);
        let step = (high - low).max(0.0) / STEPS as f64;
        let flux: f64 = (0..STEPS)
            .map(|i| {
                let range = [low + step * i as f64, low + step * (i + 1) as f64];
                self.moment(3, range) * terminal_velocity.speed(0.5 * (range[0] + range[1]))
            })
            .sum();
        // mm^3 per m^3 times m/s is 1e-9 m/s; 1 m/s is 3.6e6 mm/h.
        3.6e-3 * PI / 6.0 * flux
    }
}

/// Upper bound on diameters, mm, for integrals that need a finite one.
const LARGEST_MM: f64 = 20.0;

/// Integral of `D^k exp(-slope D)` from `x` to infinity.
fn exponential_tail(k: u32, slope: f64, x: f64) -> f64 {
    if !slope.is_finite() || !x.is_finite() {
        return 0.0;
    }
    // By parts: I_k = (x^k e^(-slope x) + k I_(k-1)) / slope.
    let edge = math::exp(-slope * x);
    let mut power = edge;
    (0..=k).fold(0.0, |integral, j| {
        let next = (power + j as f64 * integral) / slope;
        power *= x;
        next
    })
}

/// A tabulated distribution: points `[D in mm, n per m^3 per mm]`.
#[derive(Clone, Debug, PartialEq)]
pub struct SizeTable(Vec<[f64; 2]>);

/// An invalid table of a drop size distribution.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SizeTableError {
    /// Fewer than two points.
    #[error("a table of drop sizes needs at least two points")]
    TooShort,
    /// Diameters are negative, infinite, or not ascending.
    #[error("diameters must ascend from 0 mm; point {} has {diameter_mm} mm", index + 1)]
    Diameter {
        /// Index of the point, from 0.
        index: usize,
        /// Its diameter, mm.
        diameter_mm: f64,
    },
    /// A density is negative or infinite.
    #[error("{density} drops per m^3 and mm at {diameter_mm} mm; allowed: 0 or more")]
    Density {
        /// Diameter, mm.
        diameter_mm: f64,
        /// n(D) there.
        density: f64,
    },
}

impl SizeTable {
    /// The distribution through these points.
    ///
    /// # Errors
    /// Fewer than two points, diameters that do not ascend, or negative numbers.
    pub fn new(points: Vec<[f64; 2]>) -> Result<Self, SizeTableError> {
        if points.len() < 2 {
            return Err(SizeTableError::TooShort);
        }
        for (index, &[diameter_mm, density]) in points.iter().enumerate() {
            let rises = index == 0 || points[index - 1][0] < diameter_mm;
            if !(rises && diameter_mm >= 0.0 && diameter_mm.is_finite()) {
                return Err(SizeTableError::Diameter { index, diameter_mm });
            }
            if !(density >= 0.0 && density.is_finite()) {
                return Err(SizeTableError::Density { diameter_mm, density });
            }
        }
        Ok(Self(points))
    }

    /// The linear segments within a range of diameters.
    fn segments(&self, [low, high]: [f64; 2]) -> impl Iterator<Item = [[f64; 2]; 2]> {
        self.0.windows(2).filter_map(move |pair| {
            let [[d0, n0], [d1, n1]] = [pair[0], pair[1]];
            let (from, to) = (d0.max(low), d1.min(high));
            (from < to).then(|| [from, to].map(|d| [d, math::lerp(n0, n1, (d - d0) / (d1 - d0))]))
        })
    }

    fn density(&self, diameter_mm: f64) -> f64 {
        let upper = self.0.partition_point(|point| point[0] <= diameter_mm);
        match (upper.checked_sub(1).and_then(|lower| self.0.get(lower)), self.0.get(upper)) {
            (Some([d0, n0]), Some([d1, n1])) => math::lerp(*n0, *n1, (diameter_mm - d0) / (d1 - d0)),
            (Some([last, density]), None) if *last == diameter_mm => *density,
            _ => 0.0,
        }
    }

    fn moment(&self, k: u32, range: [f64; 2]) -> f64 {
        self.segments(range).map(|segment| segment_moment(segment, k)).sum()
    }

    fn quantile(&self, u: f64, range: [f64; 2]) -> f64 {
        let mut remaining = u * self.moment(0, range);
        for [[d0, n0], [d1, n1]] in self.segments(range) {
            let drops = 0.5 * (n0 + n1) * (d1 - d0);
            if remaining < drops {
                // Solves n0 x + slope x^2 / 2 = remaining, in the form that is stable for a slope of 0.
                let slope = (n1 - n0) / (d1 - d0);
                let root = math::sqrt((n0 * n0 + 2.0 * slope * remaining).max(0.0));
                return (d0 + 2.0 * remaining / (n0 + root).max(f64::MIN_POSITIVE)).min(d1);
            }
            remaining -= drops;
        }
        range[1].min(self.0[self.0.len() - 1][0]).max(range[0])
    }
}

/// Integral of `d^k n(d)` over a linear segment between two points `[d, n]`, in closed form.
fn segment_moment([[d0, n0], [d1, n1]]: [[f64; 2]; 2], k: u32) -> f64 {
    let slope = (n1 - n0) / (d1 - d0);
    // With n = a + slope d, the antiderivative of d^k n.
    let [start, end] = [d0, d1].map(|d| {
        (n0 - slope * d0) * integer_power(d, k + 1) / (k + 1) as f64 + slope * integer_power(d, k + 2) / (k + 2) as f64
    });
    end - start
}

/// `base^exponent`, multiplied from the left, so that its bits are the same on every system.
fn integer_power(base: f64, exponent: u32) -> f64 {
    (0..exponent).fold(1.0, |product, _| product * base)
}

/// A bin of diameters, represented by one of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SizeBin {
    /// The representative diameter, mm.
    pub diameter_mm: f64,
    /// Lower and upper bound, mm.
    pub range_mm: [f64; 2],
}

impl SizeBin {
    /// Width of a single bin, mm: that of the paper.
    pub const DEFAULT_WIDTH_MM: f64 = 0.2;

    /// Bins around ascending diameters. Bounds are halfway between neighbors; the outer bins are symmetric.
    pub fn around(diameters_mm: &[f64]) -> Vec<Self> {
        let half_gaps: Vec<f64> = diameters_mm.windows(2).map(|pair| 0.5 * (pair[1] - pair[0])).collect();
        let default_half = 0.5 * Self::DEFAULT_WIDTH_MM;
        let mut bins = Vec::with_capacity(diameters_mm.len());
        for (index, &diameter_mm) in diameters_mm.iter().enumerate() {
            let below = index.checked_sub(1).and_then(|index| half_gaps.get(index)).copied();
            let above = half_gaps.get(index).copied();
            let below_half = below.or(above).unwrap_or(default_half).min(diameter_mm);
            let above_half = above.or(below).unwrap_or(default_half);
            bins.push(Self { diameter_mm, range_mm: [diameter_mm - below_half, diameter_mm + above_half] });
        }
        bins
    }

    /// Width dD, mm.
    pub fn width_mm(&self) -> f64 {
        self.range_mm[1] - self.range_mm[0]
    }

    /// Drops per m^3 in the bin: the integral of n(D). For the paper's bins, its `n dD` at the bin's diameter is 1 to 3
    /// % less.
    pub fn count(&self, sizes: &DropSizeDistribution) -> f64 {
        sizes.count(self.range_mm)
    }
}

/// Stratified rounding of `mean` drops for volume `index` of many: the fractional part is a probability, and the sum
/// over any run of volumes is within two of its mean. The count never decreases as the mean rises. `words` are random
/// and the same for all volumes.
pub fn stratified_count(mean: f64, index: u32, words: [u32; 2]) -> u64 {
    /// Golden ratio less one: its multiples modulo 1 are a low-discrepancy sequence.
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let offset = random::uniform_f64(words[0], words[1]) + GOLDEN * f64::from(index);
    (mean.max(0.0) + (offset - offset.floor())).floor() as u64
}

#[cfg(test)]
mod tests;
