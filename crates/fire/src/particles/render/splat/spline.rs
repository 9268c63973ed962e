//! Cubic B-spline interpolation of values and slopes between cells.
//!
//! B-splines do not interpolate their coefficients; a prefilter of five cells compensates for that. Unlike the exact (recursive)
//! prefilter its support is finite, so that a crop equals the same part of the whole picture.

/// Prefilter: center, neighbors at 1, neighbors at 2. Times the spectrum of the B-spline, sinc^4, it is `1 + O(w^6)`.
const SHARPEN: [f32; 3] = [181.0 / 120.0, -17.0 / 60.0, 7.0 / 240.0];

/// Applies the prefilter along one axis: `out[i]` from entry `i` of five rows.
#[inline(always)]
pub(crate) fn prefilter(out: &mut [f32], [a, b, c, d, e]: [&[f32]; 5]) {
    let count = out.len();
    let (a, b, c, d, e) = (&a[..count], &b[..count], &c[..count], &d[..count], &e[..count]);
    for i in 0..count {
        let (near, far) = (b[i] + d[i], a[i] + e[i]);
        out[i] = SHARPEN[2].mul_add(far, SHARPEN[1].mul_add(near, SHARPEN[0] * c[i]));
    }
}

/// B-spline weights of the cells at -1, 0, 1 and 2 at `t` between 0 and 1.
pub(crate) fn value(t: f32) -> [f32; 4] {
    let (s, t2, t3) = (1.0 - t, t * t, t * t * t);
    [s * s * s, 3.0 * t3 - 6.0 * t2 + 4.0, -3.0 * t3 + 3.0 * t2 + 3.0 * t + 1.0, t3].map(|weight| weight / 6.0)
}

/// Derivatives of [`value`] with respect to `t`.
pub(crate) fn slope(t: f32) -> [f32; 4] {
    let s = 1.0 - t;
    [-0.5 * s * s, (1.5 * t - 2.0) * t, (-1.5 * t + 1.0) * t + 0.5, 0.5 * t * t]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_add_up_and_slopes_cancel() {
        for i in 0..=8 {
            let t = i as f32 / 8.0;
            assert!((value(t).iter().sum::<f32>() - 1.0).abs() < 1e-6);
            assert!(slope(t).iter().sum::<f32>().abs() < 1e-6);
        }
    }
}
