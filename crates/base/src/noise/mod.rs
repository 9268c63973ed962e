//! Fractal gradient noise in 2, 3 and 4 dimensions, optionally periodic along each axis.
//!
//! A coordinate is an integer cell and a fraction ([`Coordinate`]), so that large times and high octaves lose no precision. One
//! octave has mean 0 over the cells and the variance [`VARIANCE`]. It is 0 at every lattice point, so octaves are shifted against
//! each other.

mod gradient;

use fearless_simd::{Level, dispatch};

pub use gradient::Dimension;

use crate::math::{self, approximations, random::murmur3};

/// Points processed together, at every vector width.
pub const LANES: usize = 16;

/// Variance of one octave in 2, 3 and 4 dimensions, over all cells and seeds: `(4 / n) A B^(n-1)`, where with the fade s
/// `A = 2 integral of (1 - s)^2 f^2 df` and `B = 2 integral of (1 - s)^2 df`.
pub const VARIANCE: [f64; 3] = [0.093_062, 0.048_613, 0.028_568];

/// Maximum number of octaves.
pub const MAX_OCTAVES: u32 = 16;

/// A lattice coordinate: an integer cell and the fraction within it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Coordinate {
    /// Cell index, modulo 2^32.
    pub cell: i32,
    /// From 0 to 1.
    pub fraction: f32,
}

impl Coordinate {
    /// Splits `x`; cells beyond 32 bits wrap around (the lattice itself repeats after 2^32). Values that are not finite give 0.
    #[inline(always)]
    pub fn from_f64(x: f64) -> Self {
        let floor = x.floor();
        let wrapped = floor - (floor * (1.0 / 4_294_967_296.0)).floor() * 4_294_967_296.0;
        let fraction = (x - floor) as f32;
        Self { cell: wrapped as u32 as i32, fraction: if fraction <= 1.0 { fraction } else { 0.0 } }
    }

    /// Splits `x`, which must be finite with a magnitude of at most 2^31.
    #[inline(always)]
    pub fn from_f32(x: f32) -> Self {
        let floor = x.floor();
        Self { cell: floor as i32, fraction: x - floor }
    }
}

/// Parameters of the sum of octaves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fractal {
    /// Number of octaves, from 1 to [`MAX_OCTAVES`].
    pub octaves: u32,
    /// Ratio of the frequencies of consecutive octaves, from 1 to 16; an integer, so that all octaves repeat together and large
    /// coordinates stay exact.
    pub lacunarity: u32,
    /// Ratio of the amplitudes of consecutive octaves; not negative.
    pub gain: f32,
}

impl Fractal {
    /// A single octave.
    pub const SINGLE: Self = Self { octaves: 1, lacunarity: 2, gain: 0.5 };

    /// Standard deviation of the noise in `dimensions` dimensions, 2 to 4: that of independent octaves, whose amplitudes add up to 1.
    #[must_use]
    pub fn standard_deviation(&self, dimensions: usize) -> f64 {
        let [mut sum, mut squares, mut amplitude] = [0.0, 0.0, 1.0];
        for _ in 0..self.octaves {
            sum += amplitude;
            squares += amplitude * amplitude;
            amplitude *= f64::from(self.gain);
        }
        math::sqrt(VARIANCE[dimensions - 2] * squares) / sum
    }
}

impl Default for Fractal {
    /// Four octaves, each with twice the frequency and half the amplitude of the previous one.
    fn default() -> Self {
        Self { octaves: 4, ..Self::SINGLE }
    }
}

/// Why noise parameters are invalid.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoiseError {
    /// Number of octaves.
    #[error("{0} octaves; allowed: 1 to {MAX_OCTAVES}")]
    Octaves(u32),
    /// Lacunarity.
    #[error("a lacunarity of {0}; allowed: 1 to 16")]
    Lacunarity(u32),
    /// Gain.
    #[error("a gain of {0}; allowed: 0 to 16")]
    Gain(f32),
    /// A period does not fit the lattice in the finest octave.
    #[error("a period of {period} cells is too long for {octaves} octaves")]
    Period {
        /// Period in cells of the first octave.
        period: u32,
        /// Number of octaves.
        octaves: u32,
    },
}

/// Noise in `N` dimensions with values in [-1, 1].
#[derive(Clone, Debug, PartialEq)]
pub struct Noise<const N: usize> {
    octaves: Vec<Octave<N>>,
    /// Period of each axis in cells of the first octave, 0 if it does not repeat.
    periods: [u32; N],
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Octave<const N: usize> {
    seed: u32,
    /// Frequency relative to the previous octave.
    ratio: u32,
    /// Shift in cells, below 1, so that the zeros of the octaves do not coincide.
    shift: [f32; N],
    periods: [u32; N],
    amplitude: f32,
}

impl<const N: usize> Noise<N>
where
    [f32; N]: Dimension<Cells = [u32; N]>,
{
    /// Noise for `seed`. `periods` are the periods of the axes in cells of the first octave, 0 for an axis that does not repeat.
    /// Amplitudes are divided by their sum.
    ///
    /// # Errors
    /// Octaves, lacunarity or gain outside their bounds; a period with more than 2^31 cells in the finest octave.
    pub fn new(seed: u32, fractal: Fractal, periods: [u32; N]) -> Result<Self, NoiseError> {
        check(&fractal, &periods)?;
        let amplitudes: Vec<f32> =
            std::iter::successors(Some(1.0), |a| Some(a * fractal.gain)).take(fractal.octaves as usize).collect();
        let sum: f32 = amplitudes.iter().sum();
        let octaves = amplitudes.into_iter().enumerate().map(|(index, amplitude)| Octave {
            seed: murmur3(&(index as u32).to_le_bytes(), seed),
            ratio: if index == 0 { 1 } else { fractal.lacunarity },
            // With multiples of 1/256 the sum of shift and fraction is exact enough never to skip a cell.
            shift: std::array::from_fn(|axis| (murmur3(&[index as u8, axis as u8, 1], seed) >> 24) as f32 / 256.0),
            periods: periods.map(|period| if period == 0 { 0 } else { period * fractal.lacunarity.pow(index as u32) }),
            amplitude: amplitude / sum,
        });
        Ok(Self { octaves: octaves.collect(), periods })
    }

    /// Value at one point. In loops use [`row`](Self::row) or [`lanes`](Self::lanes), which give the same bits and are many times faster.
    pub fn at(&self, point: [Coordinate; N]) -> f32 {
        let mut cells = std::array::from_fn(|axis| reduce(point[axis].cell, self.periods[axis]));
        let mut fractions = point.map(|coordinate| coordinate.fraction);
        self.octaves.iter().fold(0.0, |sum, octave| sum + octave.refine_and_evaluate(&mut cells, &mut fractions))
    }

    /// Values at 16 points, given as one array per axis. Call it inside `fearless_simd::dispatch!`, from functions that are `#[inline(always)]`.
    #[inline(always)]
    pub fn lanes(&self, cells: &[[i32; LANES]; N], fractions: &[[f32; LANES]; N]) -> [f32; LANES] {
        let mut cells: [[u32; LANES]; N] =
            std::array::from_fn(|axis| cells[axis].map(|cell| reduce(cell, self.periods[axis])));
        let mut fractions = *fractions;
        let mut sums = [0.0; LANES];
        for octave in &self.octaves {
            for lane in 0..LANES {
                let mut cell = std::array::from_fn(|axis| cells[axis][lane]);
                let mut fraction = std::array::from_fn(|axis| fractions[axis][lane]);
                sums[lane] += octave.refine_and_evaluate(&mut cell, &mut fraction);
                for axis in 0..N {
                    cells[axis][lane] = cell[axis];
                    fractions[axis][lane] = fraction[axis];
                }
            }
        }
        sums
    }

    /// Values along the first axis: `out[i]` is the noise at `origin` with `along[i]` added to its first coordinate
    /// (finite, not beyond 2^30). Works on the shorter of the two.
    pub fn row(&self, level: Level, origin: [Coordinate; N], along: &[f32], out: &mut [f32]) {
        dispatch!(level, _simd => self.row_lanes(origin, along, out));
    }

    #[inline(always)]
    fn row_lanes(&self, origin: [Coordinate; N], along: &[f32], out: &mut [f32]) {
        for (along, out) in along.chunks(LANES).zip(out.chunks_mut(LANES)) {
            let mut padded = [0.0; LANES];
            padded[..along.len()].copy_from_slice(along);
            let mut cells = origin.map(|coordinate| [coordinate.cell; LANES]);
            let mut fractions = origin.map(|coordinate| [coordinate.fraction; LANES]);
            for lane in 0..LANES {
                let x = origin[0].offset_by(padded[lane]);
                cells[0][lane] = x.cell;
                fractions[0][lane] = x.fraction;
            }
            let count = along.len().min(out.len());
            out[..count].copy_from_slice(&self.lanes(&cells, &fractions)[..count]);
        }
    }
}

impl Coordinate {
    /// This coordinate moved by `distance`, which must be finite with a magnitude of at most 2^30.
    #[inline(always)]
    pub fn offset_by(self, distance: f32) -> Self {
        let whole = distance.floor();
        let fraction = self.fraction + (distance - whole);
        let carry = fraction.floor();
        // Multiples of 2^16 cells and the remainder: each is small enough for [`approximations::round_to_i32`].
        let far = (whole * (1.0 / 65_536.0)).floor();
        let near = whole - far * 65_536.0;
        let cells = (approximations::round_to_i32(far) << 16)
            .wrapping_add(approximations::round_to_i32(near))
            .wrapping_add(approximations::round_to_i32(carry));
        Self { cell: self.cell.wrapping_add(cells), fraction: fraction - carry }
    }
}

impl<const N: usize> Octave<N>
where
    [f32; N]: Dimension<Cells = [u32; N]>,
{
    /// Transforms a point from the previous octave to this one and returns the contribution of this octave to the sum.
    #[inline(always)]
    fn refine_and_evaluate(&self, cells: &mut [u32; N], fractions: &mut [f32; N]) -> f32 {
        let mut upper = [0; N];
        for axis in 0..N {
            let moved = fractions[axis] * self.ratio as f32 + self.shift[axis];
            let whole = moved.floor();
            let cell = cells[axis].wrapping_mul(self.ratio).wrapping_add(approximations::round_to_i32(whole) as u32);
            // The cell exceeds the period at most once, since the point was reduced before the first octave. Without a period nothing changes.
            let period = self.periods[axis];
            cells[axis] = cell.wrapping_sub(if cell >= period { period } else { 0 });
            fractions[axis] = moved - whole;
            let next = cells[axis].wrapping_add(1);
            upper[axis] = if next == period { 0 } else { next };
        }
        self.amplitude * fractions.gradient_noise(*cells, upper, self.seed)
    }
}

/// `cell` modulo `period`, not negative; a period of 0 means 2^32, the period of the lattice itself.
#[inline(always)]
fn reduce(cell: i32, period: u32) -> u32 {
    if period == 0 {
        return cell as u32;
    }
    // f64 represents both exactly, and a quotient that is not an integer is farther from the next integer than the rounding error of one division.
    let quotient = (cell as f64 / period as f64).floor();
    (cell as u32).wrapping_sub((quotient as i32 as u32).wrapping_mul(period))
}

fn check(fractal: &Fractal, periods: &[u32]) -> Result<(), NoiseError> {
    let Fractal { octaves, lacunarity, gain } = *fractal;
    if !(1..=MAX_OCTAVES).contains(&octaves) {
        return Err(NoiseError::Octaves(octaves));
    }
    if !(1..=16).contains(&lacunarity) {
        return Err(NoiseError::Lacunarity(lacunarity));
    }
    if !(0.0..=16.0).contains(&gain) {
        return Err(NoiseError::Gain(gain));
    }
    // The cells of the finest octave within a period are counted by 32 bits, with a sign.
    let finest = (lacunarity as u64).checked_pow(octaves - 1);
    for period in periods.iter().copied().filter(|&period| period > 0) {
        let cells = finest.and_then(|finest| finest.checked_mul(period as u64));
        if cells.is_none_or(|cells| cells > 1 << 31) {
            return Err(NoiseError::Period { period, octaves });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
