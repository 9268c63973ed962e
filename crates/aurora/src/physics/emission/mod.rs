//! Emission of excited atoms and molecules: photons, lifetime, diffusion and color.
//!
//! [`emitter`] lists the excited states, their lines and their colors, and `camera` has the colors that a camera records. [`excitation`] has the photons per
//! ion pair, as measured and by the rules of the thesis; [`quenching`] the fraction of them that is radiated, their delay and their diffusion until then;
//! `resonant_scattering` the sunlight that ions scatter. [`Emission`] is the table that follows from these: photons of each emitter by electron energy and
//! altitude for a spectrum. [`extinction`](crate::physics::extinction) is the lower atmosphere. [`calibration`](super::calibration) compares all of it with
//! observations.

pub(crate) mod camera;
pub mod emitter;
pub mod excitation;
pub mod quenching;
mod resonant_scattering;

use bansho_base::math::lerp;
pub use emitter::{ColorMatching, EMITTERS, LINES, Line, LineSet, PerEmitter, SpectralEmitter};
use excitation::{mean_hard_sphere_photons, photons_per_ion_pair};
use quenching::{LifetimeAndDiffusion, RED_ALTITUDES, mean_lifetimes};
use resonant_scattering::scattered_photons_per_ion_pair;

use super::{
    atmosphere::{Atmosphere, LEVEL_SPACING, LEVELS, covers, locate_level},
    precipitation::{
        Deposition, HardSphereParameters, Spectrum,
        deposition::{AltitudeProfile, column_ion_pairs},
        electron_track::collision_count,
        energy_grid::{self, NODES, node_energy_ev},
        lateral_spread::SpreadByEnergy,
    },
};

/// Photon column emission rate of one kilorayleigh, m^-2 s^-1.
pub const PHOTONS_PER_KILORAYLEIGH: f64 = 1e13;

/// Emission by altitude and energy per unit energy flux; it is linear in the flux.
#[derive(Clone, Debug)]
pub struct Emission {
    deposition: Deposition,
    lines: LineSet,
    /// Spread of tracks about their field line; computed on first use.
    spread: SpreadByEnergy,
    /// Counted photons of each emitter per ion pair, by level.
    photons: Vec<PerEmitter<f64>>,
    columns: Vec<ColumnEmission>,
    /// Mean lifetime of the red light for each of its altitudes, by node, s.
    red_lifetimes: Vec<[f64; RED_ALTITUDES]>,
}

/// Column-integrated quantities by emitter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColumnEmission {
    /// Column brightness, kR per mW m^-2, in counted photons.
    pub kilorayleigh: PerEmitter<f64>,
    /// Emission-weighted mean lifetime, s.
    pub lifetime: PerEmitter<f64>,
    /// Lateral spread of the light: standard deviation per direction, km, at the median altitude of the emission (it
    /// increases with altitude, so this is its median).
    pub spread_km: PerEmitter<f64>,
}

impl Emission {
    /// The table for a spectrum; takes a few milliseconds.
    #[must_use]
    pub fn new(air: &Atmosphere, spectrum: Spectrum) -> Self {
        let photons = air.levels().iter().map(photons_per_ion_pair).collect();
        let spread = SpreadByEnergy::of_fang_2010();
        Self::from_photons(air, Deposition::new(air, spectrum), LineSet::Observed, spread, photons)
    }

    /// The same table where the sun shines above an altitude: N2+ scatters its light there.
    #[must_use]
    pub fn sunlit_above(self, air: &Atmosphere, altitude_km: f64) -> Self {
        let Self { deposition, lines, spread, mut photons, .. } = self;
        for (level, (photons, air)) in photons.iter_mut().zip(air.levels()).enumerate() {
            photons[SpectralEmitter::NitrogenIon.index()] += scattered_photons_per_ion_pair(level, air, altitude_km);
        }
        Self::from_photons(air, deposition, lines, spread, photons)
    }

    /// The table for the thesis's hard-sphere tracks and its rules of emission.
    #[must_use]
    pub(crate) fn from_hard_spheres(air: &Atmosphere, spectrum: Spectrum, spheres: &HardSphereParameters) -> Self {
        let (radius, quenching_radius) = (spheres.collision_radius(), spheres.quenching_radius());
        let photons = air.levels().iter().map(|air| mean_hard_sphere_photons(air, quenching_radius)).collect();
        let deposition = Deposition::from_hard_spheres(air, spectrum, radius);
        Self::from_photons(air, deposition, LineSet::Thesis, SpreadByEnergy::of_hard_spheres(radius), photons)
    }

    fn from_photons(
        air: &Atmosphere,
        deposition: Deposition,
        lines: LineSet,
        spread: SpreadByEnergy,
        photons: Vec<PerEmitter<f64>>,
    ) -> Self {
        let persistence: Vec<_> =
            air.levels().iter().map(|air| EMITTERS.map(|emitter| LifetimeAndDiffusion::new(emitter, air))).collect();
        let columns = (0..NODES)
            .map(|node| column(&photons, &persistence, deposition.spectrum_profile(node), node_energy_ev(node)))
            .collect();
        let red = SpectralEmitter::OxygenRed.index();
        let mut red_lifetimes = Vec::with_capacity(NODES);
        for node in 0..NODES {
            let light =
                photons.iter().zip(deposition.spectrum_profile(node)).map(|(photons, pairs)| photons[red] * pairs);
            let lifetimes = persistence.iter().map(|persistence| persistence[red].lifetime);
            red_lifetimes.push(mean_lifetimes(light.zip(lifetimes)));
        }
        Self { deposition, lines, spread, photons, columns, red_lifetimes }
    }

    /// The lines of each emitter.
    #[must_use]
    pub(crate) const fn lines(&self) -> LineSet {
        self.lines
    }

    /// RMS distance of the collisions of electrons of an energy from their field line, per direction, km, where each
    /// collision deflects by an RMS tangent of `deflection`.
    #[must_use]
    pub(crate) fn lateral_spread_km(&self, deflection: f64, energy_ev: f64) -> f64 {
        if deflection <= 0.0 { 0.0 } else { deflection * self.spread.at(energy_ev) }
    }

    /// The underlying ionization table.
    #[must_use]
    pub const fn deposition(&self) -> &Deposition {
        &self.deposition
    }

    /// Counted photons of each emitter per ion pair, by level of the atmosphere.
    #[must_use]
    pub fn photons_per_ion_pair(&self) -> &[PerEmitter<f64>] {
        &self.photons
    }

    /// Volume emission rate of each emitter, photons m^-3 s^-1 per mW m^-2, at each of the [`LEVELS`] levels, for the
    /// spectrum about an energy; linear between levels.
    #[must_use]
    pub fn profile(&self, energy_ev: f64) -> Vec<PerEmitter<f64>> {
        let (node, mixing) = energy_grid::locate(energy_ev);
        let (low, high) = (self.deposition.spectrum_profile(node), self.deposition.spectrum_profile(node + 1));
        let emission = (0..LEVELS).map(|level| {
            let pairs = lerp(low[level], high[level], mixing);
            self.photons[level].map(|photons| photons * pairs)
        });
        emission.collect()
    }

    /// Volume emission rate of each emitter, photons m^-3 s^-1 per mW m^-2, for the spectrum about an energy at one
    /// altitude; 0 outside 80-800 km.
    #[must_use]
    pub fn at(&self, energy_ev: f64, altitude_km: f64) -> PerEmitter<f64> {
        if !covers(altitude_km) {
            return [0.0; 4];
        }
        let (level, fraction) = locate_level(altitude_km);
        let (node, mixing) = energy_grid::locate(energy_ev);
        let [low, high] = [node, node + 1].map(|node| self.deposition.spectrum_profile(node));
        let [below, above] = [level, level + 1].map(|level| lerp(low[level], high[level], mixing));
        std::array::from_fn(|i| lerp(below * self.photons[level][i], above * self.photons[level + 1][i], fraction))
    }

    /// Column quantities for the spectrum about an energy, linear between energy nodes.
    #[must_use]
    pub fn column(&self, energy_ev: f64) -> ColumnEmission {
        let (node, mixing) = energy_grid::locate(energy_ev);
        let (low, high) = (&self.columns[node], &self.columns[node + 1]);
        ColumnEmission {
            kilorayleigh: std::array::from_fn(|i| lerp(low.kilorayleigh[i], high.kilorayleigh[i], mixing)),
            lifetime: std::array::from_fn(|i| lerp(low.lifetime[i], high.lifetime[i], mixing)),
            spread_km: std::array::from_fn(|i| lerp(low.spread_km[i], high.spread_km[i], mixing)),
        }
    }

    /// Mean lifetime of the red light of each of its [altitudes](quenching::RED_ALTITUDES), s, weighted by emission.
    #[must_use]
    pub(crate) fn red_lifetimes(&self, energy_ev: f64) -> [f64; RED_ALTITUDES] {
        let (node, mixing) = energy_grid::locate(energy_ev);
        let (low, high) = (self.red_lifetimes[node], self.red_lifetimes[node + 1]);
        std::array::from_fn(|altitude| lerp(low[altitude], high[altitude], mixing))
    }

    /// ACEScg color of the column, luminance in cd/m^2 per mW m^-2.
    #[must_use]
    pub fn column_color(&self, energy_ev: f64) -> [f64; 3] {
        self.color_of(self.column(energy_ev).kilorayleigh)
    }

    /// Absolute ACEScg color of kilorayleighs by emitter, luminance in cd/m^2.
    #[must_use]
    pub fn color_of(&self, kilorayleigh: PerEmitter<f64>) -> [f64; 3] {
        EMITTERS.into_iter().zip(kilorayleigh).fold([0.0; 3], |sum: [f64; 3], (emitter, kilorayleigh)| {
            let color = self.lines.color_per_kilorayleigh(emitter);
            std::array::from_fn(|i| sum[i] + kilorayleigh * color[i])
        })
    }

    /// Column brightness per collision of a track, in kR of ion pairs per mW m^-2. Multiplied by
    /// [`photons_per_ion_pair`](Self::photons_per_ion_pair) of the collision's level it is the light of each emitter.
    ///
    /// # Panics
    ///
    /// If the node is not in the energy grid.
    #[must_use]
    pub(crate) fn ion_pairs_per_collision(&self, node: usize) -> f64 {
        let pairs = column_ion_pairs(self.deposition().monoenergetic_profile(node));
        pairs / collision_count(node) as f64 / PHOTONS_PER_KILORAYLEIGH
    }
}

fn column(
    photons: &[PerEmitter<f64>],
    persistence: &[PerEmitter<LifetimeAndDiffusion>],
    pairs: &AltitudeProfile,
    energy_ev: f64,
) -> ColumnEmission {
    let columns = EMITTERS.map(|emitter| {
        let light: [f64; LEVELS] = std::array::from_fn(|level| photons[level][emitter.index()] * pairs[level]);
        let whole: f64 = light.iter().sum();
        let mut below = 0.0;
        let half = light.iter().take_while(|light| {
            below += **light;
            below < 0.5 * whole
        });
        let at_half = &persistence[half.count().min(LEVELS - 1)][emitter.index()];
        let levels = light.iter().zip(persistence);
        let lifetimes: f64 = levels.map(|(light, persistence)| light * persistence[emitter.index()].lifetime).sum();
        let kilorayleigh = whole * LEVEL_SPACING / PHOTONS_PER_KILORAYLEIGH;
        [kilorayleigh, lifetimes / whole, at_half.spread(energy_ev) * 1e-3]
    });
    ColumnEmission {
        kilorayleigh: columns.map(|[kilorayleigh, ..]| kilorayleigh),
        lifetime: columns.map(|[_, lifetime, _]| lifetime),
        spread_km: columns.map(|[.., spread]| spread),
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::parameters::Auto;

    use super::*;
    use crate::physics::{
        atmosphere::{atmosphere, level_altitude_km},
        precipitation::energy_grid::ARC,
    };

    #[test]
    fn profile_point_and_column_are_one_table() {
        let table = Emission::new(atmosphere(), ARC);
        for energy_ev in [500.0, 4321.0, 1e4] {
            let profile = table.profile(energy_ev);
            let mut sums = [0.0; 4];
            for (level, emission) in profile.iter().enumerate() {
                let point = table.at(energy_ev, level_altitude_km(level));
                assert!((0..4).all(|i| (point[i] - emission[i]).abs() <= 1e-12 * emission[i]));
                sums = std::array::from_fn(|i| sums[i] + emission[i] * LEVEL_SPACING / PHOTONS_PER_KILORAYLEIGH);
            }
            let kilorayleigh = table.column(energy_ev).kilorayleigh;
            assert!((0..4).all(|i| (kilorayleigh[i] / sums[i] - 1.0).abs() < 1e-9), "{kilorayleigh:?} {sums:?}");
        }
        assert_eq!(table.at(1e4, 900.0), [0.0; 4]);
    }

    #[test]
    fn light_between_levels_is_linear() {
        let table = Emission::new(atmosphere(), ARC);
        let [low, middle, high] = [105.0, 105.5, 106.0].map(|altitude_km| table.at(5000.0, altitude_km));
        assert!((0..4).all(|i| (middle[i] / (0.5 * (low[i] + high[i])) - 1.0).abs() < 1e-12));
    }

    #[test]
    fn red_lingers_and_spreads_where_green_does_not() {
        let column = Emission::new(atmosphere(), ARC).column(3000.0);
        let [green, red, ion, nitrogen] = column.lifetime;
        assert!((0.6..0.75).contains(&green) && (20.0..110.0).contains(&red) && ion < 1e-6 && nitrogen < 1e-5);
        let [green, red, ion, _] = column.spread_km;
        assert!((3.0..30.0).contains(&red) && green < 1.0 && ion < 0.05, "{:?}", column.spread_km);
    }

    #[test]
    fn hard_spheres_shine_where_nature_does_not() {
        let of_radius = |quenching_radius_pm| {
            let radii = HardSphereParameters { quenching_radius_pm, ..HardSphereParameters::default() };
            Emission::from_hard_spheres(atmosphere(), ARC, &radii)
        };
        let (measured, spheres) = (Emission::new(atmosphere(), ARC), of_radius(Auto::Auto));
        let peak_km = |table: &Emission, energy_ev: f64, emitter: SpectralEmitter| {
            let profile = table.profile(energy_ev);
            let light = |level: &usize| profile[*level][emitter.index()];
            level_altitude_km((0..LEVELS).max_by(|a, b| light(a).total_cmp(&light(b))).unwrap_or(0))
        };
        // (2.25) with the one radius of the thesis moves green light up by some km; with that of a molecule it leaves a third at 190 km. Electrons of
        // 1 keV come far too low, as violet light shows.
        let molecules = of_radius(Auto::Set(185.0));
        let green = [&measured, &spheres, &molecules].map(|table| peak_km(table, 5000.0, SpectralEmitter::OxygenGreen));
        assert!(green[0] < 115.0 && (110.0..125.0).contains(&green[1]) && green[2] > 180.0, "{green:?}");
        let violet = [&measured, &spheres].map(|table| peak_km(table, 1000.0, SpectralEmitter::NitrogenIon));
        assert!(violet[0] > 148.0 && violet[1] < 140.0, "{violet:?}");
        let column = spheres.column(5000.0);
        assert!(column.kilorayleigh.iter().chain(&column.lifetime).all(|value| *value > 0.0 && value.is_finite()));
    }

    /// Red and blue beside green, linear on a screen, of the light from one altitude.
    fn beside_green(energy_ev: f64, altitude_km: f64) -> [f64; 2] {
        let table = Emission::new(atmosphere(), ARC);
        let [r, g, b] = bansho_base::color::SRGB_FROM_ACESCG.apply(table.color_of(table.at(energy_ev, altitude_km)));
        [r / g, b / g]
    }

    #[test]
    fn the_lower_edge_of_a_hard_aurora_turns_rosy() {
        // O(1S) is struck before it radiates down there, and little O is left to make it; N2 goes on shining.
        let (edge, body) = (beside_green(30_000.0, 84.0), beside_green(30_000.0, 105.0));
        assert!(edge[0] > 1.3 && edge[0] > 1.6 * body[0], "red {} and {}", edge[0], body[0]);
        assert!(edge[1] > 0.7 && edge[1] > 1.6 * body[1], "blue {} and {}", edge[1], body[1]);
        assert!(body[0] < 1.0 && body[1] < 0.6, "the body is green: {body:?}");
        // Where there is still enough of it to be seen: 4 to 6 km below the peak.
        let seen = beside_green(20_000.0, 92.0);
        assert!(seen[0] > 1.1 && seen[1] > 0.8, "pink: {seen:?}");
    }

    #[test]
    fn an_aurora_is_green_seen_whole() {
        let [r, g, b] = Emission::new(atmosphere(), ARC).column_color(5000.0);
        assert!(g > r.max(b) && g > 1e-4, "{r} {g} {b}");
    }
}
