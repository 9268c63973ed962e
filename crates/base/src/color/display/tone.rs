//! The tone curve of the views `neutral` and `standard`: maps unbounded scene brightness to display brightness from 0 to 1.

use crate::math::MulAdd;

/// Identity up to a knee; above it a shoulder that continues the identity with the same slope and reaches exactly 1 at a finite white point.
///
/// With `x = (m - knee) / (1 - knee)` and `X` the same for the white point, the shoulder is the extended Reinhard curve
/// `knee + (1 - knee) x (1 + x / X^2) / (1 + x)` (Reinhard et al. 2002, eq. 4). Besides the value each function returns the
/// *compression* `c = (1 - knee) x^2 / (1 + x)`, 0 below the knee and close to `m` far above it, which controls the desaturation toward white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToneCurve {
    knee: f32,
    /// `1 - knee`.
    span: f32,
    /// `1 / span`.
    inverse_span: f32,
    /// `1 / X^2`.
    curvature: f32,
    /// Factor of the compression, usually `span`.
    compression_scale: f32,
}

impl ToneCurve {
    /// The curve with identity below `knee` (0 to 1) and display white at `white` (above 1).
    #[must_use]
    pub const fn with_shoulder(knee: f32, white: f32) -> Self {
        let span = 1.0 - knee;
        let end = (white - knee) / span;
        Self { knee, span, inverse_span: 1.0 / span, curvature: 1.0 / (end * end), compression_scale: span }
    }

    /// Identity up to 1, then 1.
    #[must_use]
    pub const fn clip() -> Self {
        Self { knee: 1.0, span: 0.0, inverse_span: 1.0, curvature: 0.0, compression_scale: 1.0 }
    }

    /// Display value and compression of the scene value `m >= 0`.
    #[inline(always)]
    #[must_use]
    pub fn apply(&self, m: f32) -> (f32, f32) {
        let over = (m - self.knee) * self.inverse_span;
        let x = if over > 0.0 { over } else { 0.0 };
        let reciprocal = 1.0 / (1.0 + x);
        let rise = x * x.fma(self.curvature, 1.0) * reciprocal;
        let n = self.span.fma(rise, self.below_knee(m));
        (if n < 1.0 { n } else { 1.0 }, self.compression(x, reciprocal))
    }

    /// Scene value and compression for the display value `n` from 0 to 1.
    #[inline(always)]
    #[must_use]
    pub fn invert(&self, n: f32) -> (f32, f32) {
        let over = (n - self.knee) * self.inverse_span;
        let y = if over > 0.0 { over } else { 0.0 };
        // Solves x^2 / X^2 + (1 - y) x - y = 0 in the form without cancellation.
        let rest = 1.0 - y;
        let root = rest.fma(rest, 4.0 * y * self.curvature).sqrt();
        let x = 2.0 * y / (rest + root);
        (self.span.fma(x, self.below_knee(n)), self.compression(x, 1.0 / (1.0 + x)))
    }

    #[inline(always)]
    fn below_knee(&self, value: f32) -> f32 {
        if value < self.knee { value } else { self.knee }
    }

    #[inline(always)]
    fn compression(&self, x: f32, reciprocal: f32) -> f32 {
        self.compression_scale * (x * x) * reciprocal
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CURVE: ToneCurve = ToneCurve::with_shoulder(0.6, 16.0);

    #[test]
    fn hand_worked_values() {
        assert_eq!(CURVE.apply(0.5), (0.5, 0.0));
        assert_eq!(CURVE.apply(0.6), (0.6, 0.0));
        // m = 1: x = 1, X = 38.5: 0.6 + 0.4 (1 + 1/1482.25) / 2 = 0.800135; c = 0.4 / 2.
        let (n, c) = CURVE.apply(1.0);
        assert!((n - 0.800_135).abs() < 1e-6 && (c - 0.2).abs() < 1e-6, "{n} {c}");
        assert!((CURVE.apply(16.0).0 - 1.0).abs() < 1e-6);
        assert_eq!(CURVE.apply(1e9).0, 1.0);
        assert_eq!((ToneCurve::clip().apply(0.9).0, ToneCurve::clip().apply(3.0).0), (0.9, 1.0));
    }

    #[test]
    fn rises_without_steps_or_corners() {
        let step = 1e-3;
        let (mut before, mut slope_before) = (0.0, 1.0);
        for i in 1..15_900 {
            let n = CURVE.apply(i as f32 * step).0;
            let slope = (n - before) / step;
            assert!(slope > 0.0 && slope <= 1.001, "{i}");
            assert!((slope - slope_before).abs() < 6e-3, "corner at {i}: {slope_before} to {slope}");
            (before, slope_before) = (n, slope);
        }
    }

    #[test]
    fn inverse_is_exact() {
        for curve in [CURVE, ToneCurve::clip()] {
            for i in 0..=1000 {
                let n = i as f32 / 1000.0;
                let (m, c) = curve.invert(n);
                let (back, compression) = curve.apply(m);
                assert!((back - n).abs() < 1e-6, "{n} -> {m} -> {back}");
                assert!((compression - c).abs() < 1e-4 * (1.0 + c), "{n}");
            }
        }
        assert!((CURVE.invert(1.0).0 - 16.0).abs() < 1e-3);
    }
}
