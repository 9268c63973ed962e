//! Sixteen numbers at a time, as plain arrays: under `fearless_simd::dispatch!` the loops over them become vector code, alone
//! they are their own scalar twin, bit for bit.

/// Numbers in a batch.
pub(crate) const LANES: usize = 16;

/// A batch.
pub(crate) type Lanes = [f32; LANES];

/// The lesser of two numbers; unlike `f32::min` one instruction, since it need not care for NaN.
#[inline(always)]
pub(crate) fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The greater of two numbers; `b` where `a` is NaN.
#[inline(always)]
pub(crate) fn greatest(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// `x` held between `low` and `high`; `low` where it is NaN.
#[inline(always)]
pub(crate) fn hold(x: f32, low: f32, high: f32) -> f32 {
    least(greatest(x, low), high)
}

/// 3 * 2^22: adding it to a number below 2^22 in size rounds that to a whole number, which then stands in the low bits of the sum.
const ROUND: f32 = 12_582_912.0;

/// Whole part, wrapped by `mask` (a power of two less 1), and fraction in [0, 1].
///
/// A whole number may come out as the one below with fraction 1, which interpolates to the same.
#[inline(always)]
pub(crate) fn wrap_split(place: &Lanes, mask: u32) -> ([u32; LANES], Lanes) {
    let (mut whole, mut part) = ([0; LANES], [0.0; LANES]);
    for i in 0..LANES {
        let rounded = (place[i] - 0.5) + ROUND;
        whole[i] = rounded.to_bits() & mask;
        part[i] = place[i] - (rounded - ROUND);
    }
    (whole, part)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_and_fraction_make_the_number_again_and_wrap() {
        let place = [0.0, 0.25, 1.0, 1.75, 7.999, 8.0, 9.5, -0.25, -7.5, 511.3, 512.7, 3.0, 2.0, 1000.125, -1.0, 6.5];
        let (whole, part) = wrap_split(&place, 7);
        for i in 0..LANES {
            let value = whole[i] as f32 + part[i];
            assert!((0.0..=1.0).contains(&part[i]) && whole[i] < 8);
            let difference = (value - place[i]).rem_euclid(8.0);
            assert!(difference.min(8.0 - difference) < 1e-3, "{} {} {}", place[i], whole[i], part[i]);
        }
    }
}
