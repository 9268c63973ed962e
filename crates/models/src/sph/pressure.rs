//! Accelerations by pressure.

use rayon::prelude::*;

use super::{
    cells::{AT_ONCE, Cells},
    kernel::{CubicSpline, KernelShape, Poly6, SmoothingKernel, Spiky},
    sum::{Pair, PairTerm},
};
use crate::lanes::Real;

bansho_base::choice! {
    /// How the pressures of two particles make a force; both conserve momentum.
    pub enum PressureForm {
        /// `(p_i + p_j) / (2 rho_i rho_j)`: Inagaki et al. (12) with (8).
        Averaged = "averaged",
        /// `p_i / rho_i^2 + p_j / rho_j^2` (Monaghan 1992).
        Balanced = "balanced",
    }
}

/// `(a_i + a_j) b_j` times the gradient of W: one term for both forms.
struct PressureTerm<K>(K);

impl<K: SmoothingKernel<D>, const D: usize> PairTerm<D, 2, D> for PressureTerm<K> {
    const DIRECTED: bool = true;

    #[inline(always)]
    fn add<R: Real>(&self, pair: &Pair<R, D>, own: &[R; 2], other: &[R; 2], sums: &mut [R; D]) {
        let pull = (own[0] + other[0]) * other[1] * self.0.gradient_factor(pair.distance_squared);
        for c in 0..D {
            sums[c] = pair.offset[c].fused(pull, sums[c]);
        }
    }
}

/// Accelerations by pressure, from masses, densities and pressures in sorted order; buffers are kept from step to step.
#[derive(Clone, Debug)]
pub struct PressureForce {
    /// Kernel whose gradient pushes; one that is pointed at the centre keeps particles apart.
    pub kernel: KernelShape,
    /// Form of the sum.
    pub form: PressureForm,
    stress: Vec<f32>,
    weight: Vec<f32>,
}

impl PressureForce {
    /// The force by that kernel and form.
    #[must_use]
    pub fn new(kernel: KernelShape, form: PressureForm) -> Self {
        Self { kernel, form, stress: Vec::new(), weight: Vec::new() }
    }

    /// Accelerations `a_i = -sum_j m_j (p_i + p_j) / (2 rho_i rho_j) grad W`, or the other form's.
    ///
    /// Each pair is computed from both sides with the same operations on the same numbers, so that momentum is kept to rounding.
    ///
    /// # Panics
    /// If there is not one mass, density and pressure a particle.
    pub fn accelerations<const D: usize>(
        &mut self,
        cells: &Cells<D>,
        masses: &[f32],
        densities: &[f32],
        pressures: &[f32],
        accelerations: &mut [Vec<f32>; D],
    ) {
        assert!(masses.len() == densities.len() && densities.len() == pressures.len(), "one value a particle");
        let form = self.form;
        let stress = |(pressure, density): (&f32, &f32)| match form {
            PressureForm::Averaged => *pressure,
            PressureForm::Balanced => pressure / (density * density),
        };
        let weight = |(mass, density): (&f32, &f32)| match form {
            PressureForm::Averaged => mass / density,
            PressureForm::Balanced => *mass,
        };
        pressures.par_iter().zip(densities).with_min_len(AT_ONCE).map(stress).collect_into_vec(&mut self.stress);
        masses.par_iter().zip(densities).with_min_len(AT_ONCE).map(weight).collect_into_vec(&mut self.weight);
        let fields = [self.stress.as_slice(), self.weight.as_slice()];
        let (support, results) = (cells.support_radius(), accelerations.each_mut());
        match self.kernel {
            KernelShape::Poly6 => cells.sum(&PressureTerm(Poly6::<D>::new(support)), fields, results),
            KernelShape::Spiky => cells.sum(&PressureTerm(Spiky::<D>::new(support)), fields, results),
            KernelShape::CubicSpline => cells.sum(&PressureTerm(CubicSpline::<D>::new(support)), fields, results),
        }
        for component in accelerations {
            component.par_iter_mut().zip(densities).with_min_len(AT_ONCE).for_each(|(value, density)| match form {
                PressureForm::Averaged => *value *= -0.5 / density,
                PressureForm::Balanced => *value = -*value,
            });
        }
    }
}
