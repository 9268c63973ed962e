//! Smoothing kernels in two and three dimensions.
//!
//! All are functions of q = r / d, where d is the support radius at which every kernel ends, so that no power of d overflows. Each
//! integrates to 1 over the plane (`D = 2`) or over space (`D = 3`).

use std::f64::consts::PI;

use bansho_base::math::simd::Real;

bansho_base::choice! {
    /// A smoothing kernel.
    pub enum KernelShape {
        /// Smooth at the center, where its gradient vanishes (Mueller et al. 2003).
        Poly6 = "poly6",
        /// With a cusp at the center, so that the repulsion is largest at small distances (Mueller et al. 2003, after Desbrun and Gascuel 1996).
        Spiky = "spiky",
        /// Cubic spline (Monaghan and Lattanzio 1985).
        CubicSpline = "cubic_spline",
    }
}

/// Evaluates an expression with the kernel of a shape, monomorphized for each: `with_kernel!(shape, radius, D, |kernel| ...)`.
macro_rules! with_kernel {
    ($shape:expr, $support_radius:expr, $D:ident, |$kernel:ident| $value:expr) => {{
        use $crate::kernel::{CubicSpline, KernelShape, Poly6, SmoothingKernel as _, Spiky};
        match $shape {
            KernelShape::Poly6 => {
                let $kernel = Poly6::<$D>::new($support_radius);
                $value
            }
            KernelShape::Spiky => {
                let $kernel = Spiky::<$D>::new($support_radius);
                $value
            }
            KernelShape::CubicSpline => {
                let $kernel = CubicSpline::<$D>::new($support_radius);
                $value
            }
        }
    }};
}
pub(super) use with_kernel;

impl KernelShape {
    /// W(0), the contribution of a particle of mass 1 to its own density.
    #[must_use]
    pub fn at_center<const D: usize>(self, support_radius: f32) -> f32 {
        with_kernel!(self, support_radius, D, |kernel| kernel.value(0.0))
    }
}

/// A smoothing kernel in `D` dimensions, two or three.
///
/// Distances are passed squared and must be less than the support radius; for the gradient they must also be above 0.
pub trait SmoothingKernel<const D: usize>: Copy + Send + Sync {
    /// The kernel that ends at `support_radius`.
    #[must_use]
    fn new(support_radius: f32) -> Self;

    /// Value W at a squared distance, 1 / length^D.
    #[must_use]
    fn value<R: Real>(&self, distance_squared: R) -> R;

    /// `W'(r) / r` at a squared distance. Times the offset `x_i - x_j` it is the gradient of `W(|x_i - x_j|)` with respect to
    /// `x_i`.
    #[must_use]
    fn gradient_factor<R: Real>(&self, distance_squared: R) -> R;
}

/// Constants common to all kernels: `1 / d^2`, the factor of W and the factor of `W'(r) / r`.
#[derive(Clone, Copy, Debug)]
struct KernelConstants {
    to_q_squared: f32,
    value: f32,
    gradient: f32,
}

impl KernelConstants {
    /// For a kernel `normalization / d^D * w(q)` with `W'(r) / r = derivative * normalization / d^(D + 2) * g(q)`.
    fn new(dimensions: usize, support_radius: f32, normalization: f64, derivative: f64) -> Self {
        let inverse = 1.0 / f64::from(support_radius);
        let normalization = if cfg!(feature = "broken-kernel") { 0.9 * normalization } else { normalization };
        let value = (0..dimensions).fold(normalization, |value, _| value * inverse);
        let to_q_squared = inverse * inverse;
        let gradient = (derivative * value * to_q_squared) as f32;
        Self { to_q_squared: to_q_squared as f32, value: value as f32, gradient }
    }
}

/// `plane` for `D = 2`, `space` for `D = 3`.
const fn by_dimension<const D: usize>(plane: f64, space: f64) -> f64 {
    const { assert!(D == 2 || D == 3, "kernels exist in two and three dimensions") };
    if D == 2 { plane } else { space }
}

/// `(1 - q^2)^3`: `4 / (pi d^2)` in the plane, `315 / (64 pi d^3)` in space.
///
/// Inagaki et al. (2); the aurora thesis, (2.12).
#[derive(Clone, Copy, Debug)]
pub struct Poly6<const D: usize>(KernelConstants);

impl<const D: usize> SmoothingKernel<D> for Poly6<D> {
    fn new(support_radius: f32) -> Self {
        Self(KernelConstants::new(D, support_radius, by_dimension::<D>(4.0, 315.0 / 64.0) / PI, -6.0))
    }

    #[inline(always)]
    fn value<R: Real>(&self, distance_squared: R) -> R {
        let rest = self.one_minus_q_squared(distance_squared);
        rest * rest * (rest * rest.broadcast(self.0.value))
    }

    #[inline(always)]
    fn gradient_factor<R: Real>(&self, distance_squared: R) -> R {
        let rest = self.one_minus_q_squared(distance_squared);
        rest * rest * rest.broadcast(self.0.gradient)
    }
}

impl<const D: usize> Poly6<D> {
    /// `1 - q^2`.
    #[inline(always)]
    fn one_minus_q_squared<R: Real>(&self, distance_squared: R) -> R {
        distance_squared.fma(distance_squared.broadcast(-self.0.to_q_squared), distance_squared.broadcast(1.0))
    }
}

/// `(1 - q)^3`: `10 / (pi d^2)` in the plane, `15 / (pi d^3)` in space.
///
/// The aurora thesis, (2.15) and (2.16).
#[derive(Clone, Copy, Debug)]
pub struct Spiky<const D: usize>(KernelConstants);

impl<const D: usize> SmoothingKernel<D> for Spiky<D> {
    fn new(support_radius: f32) -> Self {
        Self(KernelConstants::new(D, support_radius, by_dimension::<D>(10.0, 15.0) / PI, -3.0))
    }

    #[inline(always)]
    fn value<R: Real>(&self, distance_squared: R) -> R {
        let rest = distance_squared.broadcast(1.0)
            - (distance_squared * distance_squared.broadcast(self.0.to_q_squared)).simd_sqrt();
        rest * rest * (rest * rest.broadcast(self.0.value))
    }

    #[inline(always)]
    fn gradient_factor<R: Real>(&self, distance_squared: R) -> R {
        let q_squared = distance_squared * distance_squared.broadcast(self.0.to_q_squared);
        let inverse_q = q_squared.simd_rsqrt();
        let rest = (-q_squared).fma(inverse_q, q_squared.broadcast(1.0));
        (rest * rest) * (inverse_q * q_squared.broadcast(self.0.gradient))
    }
}

/// `((2 - u)^3 - 4 (1 - u)^3) / 4` with u = 2 q, each power 0 where its base is negative: `40 / (7 pi d^2)` in the plane, `8 / (pi
/// d^3)` in space.
///
/// The aurora thesis, (2.17) and (2.18), whose h is half the support radius d.
#[derive(Clone, Copy, Debug)]
pub struct CubicSpline<const D: usize>(KernelConstants);

impl<const D: usize> SmoothingKernel<D> for CubicSpline<D> {
    fn new(support_radius: f32) -> Self {
        Self(KernelConstants::new(D, support_radius, by_dimension::<D>(40.0 / 7.0, 8.0) / PI, 3.0))
    }

    #[inline(always)]
    fn value<R: Real>(&self, distance_squared: R) -> R {
        let u = self.u(distance_squared);
        let outer = u.broadcast(2.0) - u;
        let inner = (u.broadcast(1.0) - u).simd_max(u.broadcast(0.0));
        let cube = outer * outer * outer;
        (inner * inner).fma(inner * inner.broadcast(-4.0), cube) * u.broadcast(0.25 * self.0.value)
    }

    #[inline(always)]
    fn gradient_factor<R: Real>(&self, distance_squared: R) -> R {
        let u = self.u(distance_squared);
        let rest = u.broadcast(2.0) - u;
        let inner = u.fma(u.broadcast(3.0), u.broadcast(-4.0));
        let outer = u.broadcast(0.0) - rest * rest / u;
        u.select_lt(u.broadcast(1.0), inner, outer) * u.broadcast(self.0.gradient)
    }
}

impl<const D: usize> CubicSpline<D> {
    /// `2 q`, the thesis's |r| / h.
    #[inline(always)]
    fn u<R: Real>(&self, distance_squared: R) -> R {
        (distance_squared * distance_squared.broadcast(4.0 * self.0.to_q_squared)).simd_sqrt()
    }
}

/// A kernel chosen at run time, for scalar evaluation.
#[derive(Clone, Copy, Debug)]
pub enum Kernel<const D: usize> {
    /// See [`Poly6`].
    Poly6(Poly6<D>),
    /// See [`Spiky`].
    Spiky(Spiky<D>),
    /// See [`CubicSpline`].
    CubicSpline(CubicSpline<D>),
}

impl<const D: usize> Kernel<D> {
    /// The kernel of that shape that ends at `support_radius`.
    #[must_use]
    pub fn new(shape: KernelShape, support_radius: f32) -> Self {
        match shape {
            KernelShape::Poly6 => Self::Poly6(Poly6::new(support_radius)),
            KernelShape::Spiky => Self::Spiky(Spiky::new(support_radius)),
            KernelShape::CubicSpline => Self::CubicSpline(CubicSpline::new(support_radius)),
        }
    }

    /// Value W at a distance below the support radius, 1 / length^D.
    #[must_use]
    pub fn value(&self, distance: f32) -> f32 {
        match self {
            Self::Poly6(kernel) => kernel.value(distance * distance),
            Self::Spiky(kernel) => kernel.value(distance * distance),
            Self::CubicSpline(kernel) => kernel.value(distance * distance),
        }
    }

    /// `W'(r)` at a distance r above 0 and below the support radius.
    #[must_use]
    pub fn derivative(&self, distance: f32) -> f32 {
        let factor = match self {
            Self::Poly6(kernel) => kernel.gradient_factor(distance * distance),
            Self::Spiky(kernel) => kernel.gradient_factor(distance * distance),
            Self::CubicSpline(kernel) => kernel.gradient_factor(distance * distance),
        };
        factor * distance
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::assert_measured;

    use super::*;

    const SHAPES: [KernelShape; 3] = [KernelShape::Poly6, KernelShape::Spiky, KernelShape::CubicSpline];

    /// Integral over the plane or over space, by shells.
    fn integral<const D: usize>(shape: KernelShape, support: f32) -> f64 {
        let kernel = Kernel::<D>::new(shape, support);
        let steps = 4000;
        let width = f64::from(support) / f64::from(steps);
        let shell = |i: i32| {
            let r = (f64::from(i) + 0.5) * width;
            let area = if D == 2 { 2.0 * PI * r } else { 4.0 * PI * r * r };
            area * f64::from(kernel.value(r as f32)) * width
        };
        (0..steps).map(shell).sum()
    }

    #[test]
    fn every_kernel_integrates_to_one_at_any_support_radius() {
        for shape in SHAPES {
            for support in [1e-5, 0.03, 1.0, 2.5e4] {
                let (plane, space) = (integral::<2>(shape, support), integral::<3>(shape, support));
                println!("{shape:?} {support}");
                assert_measured!(
                    "equation (2.12) & equation (2.15) & equation (2.17): integral over the plane",
                    plane,
                    1.0,
                    1e-5
                );
                assert!((space - 1.0).abs() < 1e-5, "{shape:?} {support} {space}");
            }
        }
    }

    fn derivatives_match_finite_differences<const D: usize>() {
        let mut largest = 0.0_f64;
        for shape in SHAPES {
            let kernel = Kernel::<D>::new(shape, 2.0);
            for i in 1..40 {
                let r = 0.05 * i as f32;
                let step = 2e-3;
                let subtract = (kernel.value(r + step) - kernel.value(r - step)) / (2.0 * step);
                let derivative = kernel.derivative(r);
                largest = largest.max(f64::from(derivative - subtract).abs());
            }
        }
        assert_measured!("equation (2.16) & equation (2.18): difference of slopes", largest, 0.0, 2e-3);
    }

    #[test]
    fn slopes_match_finite_differences() {
        derivatives_match_finite_differences::<2>();
        derivatives_match_finite_differences::<3>();
    }

    #[test]
    fn kernels_fall_to_nothing_at_the_support_radius() {
        for shape in SHAPES {
            let kernel = Kernel::<2>::new(shape, 0.5);
            let values: Vec<f32> = (0..100).map(|i| kernel.value(0.005 * i as f32)).collect();
            assert!(values.windows(2).all(|pair| pair[1] < pair[0]), "{shape:?}");
            assert!(kernel.value(0.499_99) < 1e-4 * values[0] && kernel.derivative(0.499_99).abs() < 0.01 * values[0]);
        }
    }

    /// Worked by hand from the papers' own forms.
    #[test]
    fn values_are_those_of_the_papers() {
        let close = |a: f32, b: f64| assert!((f64::from(a) / b - 1.0).abs() < 1e-5, "{a} {b}");
        // Inagaki et al. (2): 315 / (64 pi d^9) (d^2 - r^2)^3 at d = 2, r = 1.
        close(Kernel::<3>::new(KernelShape::Poly6, 2.0).value(1.0), 315.0 / (64.0 * PI * 512.0) * 27.0);
        // Thesis (2.12) and (2.16) at h = 2, r = 1.
        close(Kernel::<2>::new(KernelShape::Poly6, 2.0).value(1.0), 4.0 / (PI * 256.0) * 27.0);
        close(Kernel::<2>::new(KernelShape::Spiky, 2.0).derivative(1.0), -30.0 / (PI * 32.0));
        // Thesis (2.17) and (2.18) at h = 1: r = 1/2 within, r = 3/2 without.
        let spline = Kernel::<2>::new(KernelShape::CubicSpline, 2.0);
        close(spline.value(0.5), 10.0 / (7.0 * PI) * (1.0 - 0.375 + 0.093_75));
        close(spline.value(1.5), 10.0 / (7.0 * PI) * 0.031_25);
        close(spline.derivative(0.5), 45.0 / (14.0 * PI) * (0.5 - 4.0 / 3.0) * 0.5);
        close(spline.derivative(1.5), -45.0 / (14.0 * PI) / 3.0 * 0.25);
    }
}
