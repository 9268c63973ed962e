//! What a scene says of the electrons.

use bansho_base::parameters::Range;

use super::{hard_sphere::DEFAULT_RADIUS, spectrum::Spectrum};

/// Central energies that a scene may name, eV.
pub const ENERGIES_EV: Range = Range::new(100.0, 50_000.0);

bansho_base::choice! {
    /// How the energies of electrons are spread about the one that is named.
    pub enum SpectrumKind {
        /// About one energy, as in arcs.
        Gaussian = "gaussian",
        /// Of a hot plasma, as in diffuse auroras; the energy is the characteristic one, half the mean.
        Maxwellian = "maxwellian",
        /// All alike.
        Monoenergetic = "monoenergetic",
    }
}

bansho_base::choice! {
    /// Where falling electrons collide.
    pub enum FallKind {
        /// As Fang et al. (2010) have it: right in height and brightness for every energy.
        Fang = "fang",
        /// The thesis: with hard spheres, eq. (2.22).
        HardSphere = "hard_sphere",
    }
}

bansho_base::parameters! {
    /// How electrons fall into the air.
    pub struct PrecipitationParameters {
        /// How their energies are spread.
        spectrum: SpectrumKind = SpectrumKind::default();
        /// Standard deviation of a Gaussian spectrum, as a share of its central energy.
        energy_spread: f64 = 0.35, limits(Range::new(0.0, 1.0));
        /// Where they collide.
        fall: FallKind = FallKind::default();
        /// How far a collision turns an electron from the magnetic field: rms tangent of the angle, the vector omega of (2.21) and (2.24).
        wobble: f64 = 0.002, limits(Range::new(0.0, 0.5));
        /// Radius r of the spheres of (2.22), with `fall = "hard_sphere"`; the thesis gives none.
        sphere_radius_m: f64 = DEFAULT_RADIUS, limits(Range::new(1e-12, 1e-9)), unit("m");
    }
}

impl PrecipitationParameters {
    /// The spectrum that they describe.
    #[must_use]
    pub fn spectrum(&self) -> Spectrum {
        match self.spectrum {
            SpectrumKind::Gaussian => Spectrum::Gaussian { width: self.energy_spread },
            SpectrumKind::Maxwellian => Spectrum::Maxwellian,
            SpectrumKind::Monoenergetic => Spectrum::Monoenergetic,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::aurora::precipitation::{energy, spectrum::ARC};

    #[test]
    fn the_default_is_the_spectrum_that_is_calibrated() {
        assert_eq!(PrecipitationParameters::default().spectrum(), ARC);
        const { assert!(ENERGIES_EV.min >= energy::LOWEST_EV && ENERGIES_EV.max <= energy::HIGHEST_EV) };
    }
}
