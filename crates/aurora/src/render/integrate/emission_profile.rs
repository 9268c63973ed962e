//! Emission profiles by altitude for every energy, as prefiltered single-precision tables.

use std::sync::OnceLock;

use bansho_base::math;

use crate::physics::{
    atmosphere::{HIGHEST_KM, LEVELS, LOWEST_KM, level_altitude_km},
    emission::{
        EMITTERS, Emission, PHOTONS_PER_KILORAYLEIGH, PerEmitter, SpectralEmitter,
        quenching::{RED_ALTITUDES, red_by_altitude},
    },
    extinction::AttenuationByDistance,
    precipitation::energy_grid::NODES,
};

/// Tables per node of the energy grid: the nearest is within 0.5 % of the energy, and the red column, which varies
/// fastest, within 1 %.
const TABLES_PER_NODE: usize = 8;
/// Mip levels of a table: each is filtered and sampled at twice the spacing of the previous one, starting at 1 km.
pub(super) const MIP_LEVELS: usize = 12;
/// Start of each mip level among those of one energy, and the total.
const STARTS: [usize; MIP_LEVELS + 1] = starts();
/// Profiles are cut off where this fraction of the light is left above or below.
const CUTOFF_FRACTION: f64 = 3e-4;

/// Entries of a mip level: one below the levels and zeros above, so that filtering conserves light.
const fn entries(mip_level: usize) -> usize {
    ((LEVELS - 1) >> mip_level) + 4
}

const fn starts() -> [usize; MIP_LEVELS + 1] {
    let (mut starts, mut mip_level) = ([0; MIP_LEVELS + 1], 0);
    while mip_level < MIP_LEVELS {
        starts[mip_level + 1] = starts[mip_level] + entries(mip_level);
        mip_level += 1;
    }
    starts
}

/// Emission by energy and altitude, in kR per km along the line of sight and mW/m^2; tables are computed on first use.
#[derive(Clone, Debug)]
pub(crate) struct EmissionProfiles {
    emission: Emission,
    /// Attenuation (2.27) of the light of each level.
    attenuation: Vec<f64>,
    /// Whether the components are red light by altitude instead of emitters.
    red_by_altitude: bool,
    tables: Vec<OnceLock<MipTables>>,
}

/// Mip levels of one energy, concatenated.
#[derive(Clone, Debug)]
struct MipTables {
    values: Vec<PerEmitter<f32>>,
    /// Cutoff altitudes at the top for prompt and for red light, km.
    tops_km: [f32; 2],
    /// Cutoff altitude at the bottom, km.
    bottom_km: f32,
}

/// Emission by altitude of one energy.
#[derive(Clone, Copy, Debug)]
pub(super) struct EmissionProfile<'a> {
    values: &'a [PerEmitter<f32>],
    /// Cutoff altitudes, km.
    pub(super) bottom_km: f32,
    pub(super) top_km: f32,
}

impl EmissionProfiles {
    /// The tables for a spectrum.
    pub(crate) fn new(emission: &Emission, attenuation: &AttenuationByDistance) -> Self {
        let tables = vec![OnceLock::new(); (NODES - 1) * TABLES_PER_NODE + 1];
        let attenuation = (0..LEVELS).map(|level| attenuation.of_level(level)).collect();
        Self { emission: emission.clone(), attenuation, red_by_altitude: false, tables }
    }

    /// Tables of red light by altitude instead of emitters.
    pub(crate) fn red_by_altitude(emission: &Emission, attenuation: &AttenuationByDistance) -> Self {
        Self { red_by_altitude: true, ..Self::new(emission, attenuation) }
    }

    /// The profile of an energy, given as fractional node index; `red` includes the red line's altitude range.
    #[inline(always)]
    pub(super) fn at(&self, node: f32, red: bool) -> EmissionProfile<'_> {
        let MipTables { values, tops_km: [prompt_km, red_km], bottom_km } = self.table(table_index(node));
        EmissionProfile { values, bottom_km: *bottom_km, top_km: if red { red_km.max(*prompt_km) } else { *prompt_km } }
    }

    #[inline(never)]
    fn table(&self, table_index: usize) -> &MipTables {
        // A function of its own: inlined, the construction would be compiled into every kernel that only looks a table up.
        self.tables[table_index].get_or_init(|| {
            let mut profile = self.emission.profile(table_energy_ev(table_index));
            for (light, attenuation) in profile.iter_mut().zip(&self.attenuation) {
                *light = light.map(|photons| photons * attenuation);
            }
            if self.red_by_altitude {
                MipTables::from_red_altitudes(&red_by_altitude(&profile))
            } else {
                MipTables::new(&profile)
            }
        })
    }
}

/// Index of the table for an energy, given as fractional node index.
#[inline(always)]
fn table_index(node: f32) -> usize {
    ((node * TABLES_PER_NODE as f32 + 0.5).max(0.0) as usize).min((NODES - 1) * TABLES_PER_NODE)
}

/// Emission above and below an observer within the light, each without the other. A line of sight nearly along the field looks through only one of
/// them, while a table of the whole profile, filtered over many kilometers, mixes both.
pub(super) struct ProfilesAroundObserver<'a> {
    /// The profiles of which both are parts.
    whole_profiles: &'a EmissionProfiles,
    observer_altitude_km: f64,
    /// For each table of `whole_profiles`, the mip levels of its parts above and below the observer; computed on first use.
    parts_above_and_below: Vec<OnceLock<[Vec<PerEmitter<f32>>; 2]>>,
}

impl<'a> ProfilesAroundObserver<'a> {
    /// For an observer at an altitude, km.
    pub(super) fn new(whole_profiles: &'a EmissionProfiles, observer_altitude_km: f64) -> Self {
        let parts_above_and_below = vec![OnceLock::new(); whole_profiles.tables.len()];
        Self { whole_profiles, observer_altitude_km, parts_above_and_below }
    }

    /// The profiles above and below the observer of an energy, given as fractional node index.
    #[inline(never)]
    pub(super) fn at(&self, node: f32) -> [EmissionProfile<'_>; 2] {
        let index = table_index(node);
        let MipTables { values, tops_km: [prompt_km, red_km], bottom_km } = self.whole_profiles.table(index);
        let parts =
            self.parts_above_and_below[index].get_or_init(|| [true, false].map(|is_above| self.part(values, is_above)));
        let (bottom_km, top_km) = (*bottom_km, red_km.max(*prompt_km));
        parts.each_ref().map(|values| EmissionProfile { values, bottom_km, top_km })
    }

    /// The mip levels of the part of a profile above or below the observer. A level of the atmosphere stands for half a kilometer on both sides of its
    /// altitude.
    fn part(&self, values: &[PerEmitter<f32>], is_above: bool) -> Vec<PerEmitter<f32>> {
        let mut light_of_part = Vec::with_capacity(STARTS[1]);
        for (entry, light) in values[..STARTS[1]].iter().enumerate() {
            let above = (f64::from(BOTTOM_KM) + entry as f64 - 1.0 - self.observer_altitude_km + 0.5).clamp(0.0, 1.0);
            let fraction = if is_above { above } else { 1.0 - above };
            light_of_part.push(light.map(|value| f64::from(value) * fraction));
        }
        mip_levels(light_of_part)
    }
}

impl MipTables {
    /// From the volume emission at each level.
    fn new(profile: &[PerEmitter<f64>]) -> Self {
        Self {
            values: smoothed(profile),
            tops_km: [SpectralEmitter::OxygenGreen, SpectralEmitter::OxygenRed]
                .map(|emitter| top_km(profile, emitter.index())),
            bottom_km: bottom_km(profile, &EMITTERS.map(SpectralEmitter::index)),
        }
    }

    /// The same for red light by altitude.
    fn from_red_altitudes(profile: &[PerEmitter<f64>]) -> Self {
        let top_km = top_km(profile, RED_ALTITUDES - 1);
        let altitudes: [usize; RED_ALTITUDES] = std::array::from_fn(|altitude| altitude);
        Self { values: smoothed(profile), tops_km: [top_km; 2], bottom_km: bottom_km(profile, &altitudes) }
    }
}

/// All mip levels, from the volume emission at each level.
fn smoothed(profile: &[PerEmitter<f64>]) -> Vec<PerEmitter<f32>> {
    let light = profile.iter().map(|photons| photons.map(|photons| photons * 1e3 / PHOTONS_PER_KILORAYLEIGH));
    mip_levels(std::iter::once([0.0; 4]).chain(light).collect())
}

/// All mip levels of a table, concatenated.
fn mip_levels(mut table: Vec<PerEmitter<f64>>) -> Vec<PerEmitter<f32>> {
    let mut light = Vec::with_capacity(STARTS[MIP_LEVELS]);
    for mip_level in 0..MIP_LEVELS {
        // Beyond the table there is no light.
        let padded = table.iter().copied().chain(std::iter::repeat([0.0; 4]));
        light.extend(padded.take(entries(mip_level)).map(|entry| entry.map(|value| value as f32)));
        table = downsampled(&table);
    }
    light
}

impl<'a> EmissionProfile<'a> {
    /// The table filtered to 2^`mip_level` km. The second entry is at 80 km, the last is 0.
    #[inline(always)]
    pub(super) fn table(&self, mip_level: usize) -> &'a [PerEmitter<f32>] {
        &self.values[STARTS[mip_level]..STARTS[mip_level + 1]]
    }
}

/// Nominal energy of a table, eV.
fn table_energy_ev(table_index: usize) -> f64 {
    use crate::physics::precipitation::energy_grid::{HIGHEST_EV, LOWEST_EV};
    let log_fraction = table_index as f64 / ((NODES - 1) * TABLES_PER_NODE) as f64;
    LOWEST_EV * math::pow(HIGHEST_EV / LOWEST_EV, log_fraction)
}

/// Downsamples by two with the filter 1/4, 1/2, 1/4, which conserves the sum.
fn downsampled(table: &[PerEmitter<f64>]) -> Vec<PerEmitter<f64>> {
    let smoothed = (0..table.len() / 2 + 2).map(|number| -> PerEmitter<f64> {
        let near = [2, 1, 0].map(|before| {
            let entry = (2 * number).checked_sub(before).and_then(|entry| table.get(entry));
            entry.copied().unwrap_or_default()
        });
        std::array::from_fn(|i| 0.25 * near[0][i] + 0.5 * near[1][i] + 0.25 * near[2][i])
    });
    smoothed.collect()
}

fn top_km(profile: &[PerEmitter<f64>], emitter: usize) -> f32 {
    let levels_within_cutoff = levels_within_cutoff((0..LEVELS).rev(), profile, emitter);
    level_altitude_km(LEVELS - 1 - levels_within_cutoff.min(LEVELS - 2)).min(HIGHEST_KM) as f32
}

fn bottom_km(profile: &[PerEmitter<f64>], emitters: &[usize]) -> f32 {
    let bottoms = emitters
        .iter()
        .map(|emitter| level_altitude_km(levels_within_cutoff(0..LEVELS, profile, *emitter).saturating_sub(1)) as f32);
    bottoms.fold(f32::INFINITY, f32::min)
}

/// Number of levels, in iteration order, within the cutoff fraction.
fn levels_within_cutoff(levels: impl Iterator<Item = usize>, profile: &[PerEmitter<f64>], emitter: usize) -> usize {
    let whole: f64 = (0..LEVELS).map(|level| profile[level][emitter]).sum();
    let mut sum = 0.0;
    let levels_within = levels.take_while(|level| {
        sum += profile[*level][emitter];
        sum < CUTOFF_FRACTION * whole
    });
    levels_within.count()
}

/// Altitude of the second entry of all tables, km.
pub(super) const BOTTOM_KM: f32 = LOWEST_KM as f32;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::{atmosphere::atmosphere, precipitation::energy_grid::ARC};

    #[test]
    fn every_table_of_an_energy_holds_the_same_column() {
        let table = Emission::new(atmosphere(), ARC);
        let profiles = EmissionProfiles::new(&table, &AttenuationByDistance::default());
        for node in [20.0, 48.0, 60.25] {
            let profile = profiles.at(node, true);
            let energy = table_energy_ev((node * TABLES_PER_NODE as f32) as usize);
            let expected = table.column(energy).kilorayleigh;
            for mip_level in 0..MIP_LEVELS {
                let sum = profile.table(mip_level).iter().fold([0.0; 4], |sum: [f64; 4], light| {
                    std::array::from_fn(|i| sum[i] + f64::from(light[i]) * f64::from(1 << mip_level))
                });
                for i in 0..4 {
                    assert!((sum[i] / expected[i] - 1.0).abs() < 2e-3, "{node} {mip_level} {i}: {sum:?} {expected:?}");
                }
            }
        }
    }

    #[test]
    fn hard_electrons_stop_lower() {
        let profiles = EmissionProfiles::new(&Emission::new(atmosphere(), ARC), &AttenuationByDistance::default());
        assert!(profiles.at(64.0, false).top_km < profiles.at(32.0, false).top_km);
        assert!(profiles.at(48.0, true).top_km > 300.0);
    }
}
