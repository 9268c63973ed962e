//! The state of the gas, and its time steps.

use std::sync::Arc;

use bansho_base::{
    host::parallel::prelude::*,
    math::{DVec3, random::Key},
    phenomenon::surroundings::{Occluder, Surroundings},
    world::air::Air,
};
use bansho_fluid::{ActiveRows, Ambient, Flow, FlowSettings, Grid};

use super::{
    fuel::{FuelProperties, Mixture, soot_profile},
    parameters::FlameVolumeParameters,
};
use burners::{BurnerCells, VolumeBurner};
use domain::FireSize;

pub(crate) mod burners;
pub(crate) mod domain;
pub(crate) mod snapshot;

/// Stefan and Boltzmann's constant, W/(m^2 K^4).
const STEFAN_BOLTZMANN: f32 = 5.670_374e-8;
/// Heat capacity of the gas at constant pressure, J/(kg K): that of air and combustion products between 300 and 1800 K.
const HEAT_CAPACITY: f32 = 1150.0;
/// Planck mean of the absorption coefficient of soot, for each volume fraction and temperature, 1/(m K): `3.83 C0 / C2` with C0 of 5 (Modest 2013, eq. 11.132).
const PLANCK_MEAN: f32 = 1330.0;
/// Courant number of a step: the sum over three axes.
const COURANT: f32 = 0.8;
/// Most steps of the solver between two states.
const MAX_STEPS: usize = 400;
/// Largest change of volume in one step.
const MAX_EXPANSION: f32 = 0.4;
/// Densities that gas may have, kg/m^3. Whatever a wind of absurd strength leaves in a cell besides becomes air.
const VALID_DENSITIES: std::ops::Range<f32> = 1e-3..1e3;
/// Mixture fraction below which gas is air.
const LEAST_MIXTURE: f32 = 2e-4;
/// Cells around gas into which it may flow in a step.
const MARGIN: usize = 3;
/// Time in which the factor of emission follows the fire, s.
const EMISSION_TIME_S: f32 = 0.1;
/// Most heat that counts, over that of all burners at full flow: gas that has gathered may burn at once.
const MOST_BURNING: f64 = 100.0;
/// Bounds of that factor. A flame with hardly any soot radiates less than its fraction, since the radiation of its gases is not counted.
const EMISSION_FACTORS: [f32; 2] = [0.02, 4.0];

/// What the simulation of a flame depends on and never changes; all of its runs share it.
#[derive(Debug)]
pub(crate) struct SimulationConstants {
    pub(crate) parameters: FlameVolumeParameters,
    pub(crate) fuel: FuelProperties,
    pub(crate) burners: Vec<VolumeBurner>,
    pub(crate) size: FireSize,
    /// The grid on which the flame begins, relative to its position; its own has half the spacing.
    pub(crate) coarse_grid: Grid,
    /// Time before which it is computed on the coarse grid, s.
    pub(crate) refined_from: f64,
    pub(crate) key: Key,
}

/// What a step found out.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct VolumeFigures {
    /// Heat release rate of the burners, kW.
    pub heat_release_kw: f64,
    /// Heat that burning gas releases, kW: the fuel that flows in, less what more of it is unburnt.
    pub burning_kw: f64,
    /// Radiated power, kW.
    pub radiated_kw: f64,
    /// Height of the stoichiometric surface above the lowest burner, m.
    pub height: f64,
    /// Cells in which gas is.
    pub active_cells: usize,
    /// Steps of the solver.
    pub steps: usize,
}

/// The gas of one flame.
pub(crate) struct Simulation {
    pub(crate) shared: Arc<SimulationConstants>,
    pub(crate) flow: Flow,
    pub(crate) active: ActiveRows,
    /// The air around.
    pub(crate) air: Air,
    pub(crate) mixture: Mixture,
    /// Factor of the emission of soot, so that the fire radiates the fraction of its heat that its fuel radiates.
    pub(crate) emission_factor: f32,
    /// Heat that burning gas has released of late, over that of all burners at full flow: the mean that the factor of emission follows.
    pub(crate) recent_burning: f32,
    /// Mass of fuel that has found no air, kg.
    unburnt_kg: f64,
    pub(crate) figures: VolumeFigures,
    /// Of the grid and the solids as they are.
    burner_cells: BurnerCells,
}

impl Simulation {
    /// Still air, on the coarse grid or on the flame's own.
    pub(crate) fn new(shared: Arc<SimulationConstants>, is_coarse: bool, air: &Air, wind: [f32; 3]) -> Self {
        let mixture = Mixture::new(&shared.fuel, air);
        let grid = if is_coarse { shared.coarse_grid } else { shared.coarse_grid.refined() };
        let flow = Flow::new(grid, flow_settings(&shared, &mixture, wind));
        let active = ActiveRows::around(&flow.grid, 0, |_| false);
        Self {
            shared,
            flow,
            active,
            air: air.clone(),
            mixture,
            emission_factor: 1.0,
            recent_burning: 0.0,
            unburnt_kg: 0.0,
            figures: VolumeFigures::default(),
            burner_cells: BurnerCells::default(),
        }
    }

    /// Whether the flame is still on the coarse grid.
    fn is_coarse(&self) -> bool {
        self.flow.grid == self.shared.coarse_grid
    }

    /// Makes the surrounding air that of a restored state.
    pub(crate) fn set_air(&mut self, air: Air, wind: [f32; 3]) {
        self.mixture = Mixture::new(&self.shared.fuel, &air);
        self.air = air;
        self.flow.set_settings(flow_settings(&self.shared, &self.mixture, wind));
    }

    /// Finds the cells of gas of a restored state.
    pub(crate) fn restore_active(&mut self) {
        let mixture = &self.flow.contents.quantities[0];
        self.active = ActiveRows::around(&self.flow.grid, MARGIN, |index| mixture[index] > LEAST_MIXTURE);
        self.flow.restore_stage();
        self.unburnt_kg = self.unburnt_kg();
    }

    /// Mass of fuel in the gas that has found no air, kg.
    fn unburnt_kg(&self) -> f64 {
        let grid = &self.flow.grid;
        let density = &self.flow.contents.density;
        let mixture = &self.flow.contents.quantities[0];
        let stoichiometric = self.mixture.stoichiometric;
        let layers = (0..grid.size[1]).into_par_iter().map(|y| {
            let cells = grid.rows(y).flat_map(|(z, row)| self.active.row(y, z).map(move |x| row + x));
            let fuel = cells.map(|index| f64::from(density[index] * (mixture[index] - stoichiometric).max(0.0)));
            fuel.sum::<f64>()
        });
        let layers: Vec<f64> = layers.collect();
        let volume = grid.spacing * grid.spacing * grid.spacing;
        layers.iter().sum::<f64>() * volume / f64::from(1.0 - stoichiometric).max(1e-6)
    }

    /// Corners of the cells with gas, m; `None` if there are none.
    pub(crate) fn active_corners(&self) -> Option<[DVec3; 2]> {
        let grid = &self.flow.grid;
        let origin = DVec3::from(self.shared.parameters.position);
        let [low, high] = self.active.bounds()?;
        let corner = |cell: [usize; 3]| grid.origin + origin + DVec3::from(cell.map(|c| c as f64 * grid.spacing));
        Some([corner(low), corner(high)])
    }

    /// Advances from `time` to the next state.
    pub(crate) fn step(&mut self, time: f64, surroundings: &Surroundings) {
        if self.is_coarse() && time >= self.shared.refined_from {
            self.flow = self.flow.refined();
            self.burner_cells.clear();
            self.restore_active();
        }
        let origin = DVec3::from(self.shared.parameters.position);
        let center = origin + 0.5 * (self.flow.grid.origin + self.flow.grid.far_corner());
        let occluders = moved(&surroundings.others.occluders, origin);
        if self.flow.set_solids(&occluders) {
            self.burner_cells.clear();
        }
        let mut remaining = self.shared.parameters.step_s;
        let mut steps = 0;
        while remaining > 1e-9 && steps < MAX_STEPS {
            let longest = f64::from(COURANT) * self.flow.grid.spacing / f64::from(self.flow.largest_speed()).max(0.05);
            let count = (remaining / longest).ceil().max(1.0);
            let seconds = remaining / count;
            let now = time + self.shared.parameters.step_s - remaining;
            let wind = surroundings.wind.at(center, now + seconds).as_vec3();
            self.solver_step(now, seconds as f32, wind.to_array());
            remaining -= seconds;
            steps += 1;
        }
        // The active cells of a state follow from its gas alone, so that a restored run goes on as this one does.
        self.activate(&[]);
        self.figures.steps = steps;
    }

    fn solver_step(&mut self, time: f64, seconds: f32, wind: [f32; 3]) {
        let sources = self.sources(time);
        self.activate(&sources);
        self.flow.transport(&self.active, seconds);
        self.add_fuel(&sources, seconds);
        self.react(seconds);
        self.measure_burning(&sources, seconds);
        let wind = if self.shared.parameters.floor { [wind[0], 0.0, wind[2]] } else { wind };
        self.flow.accelerate(wind, seconds);
    }

    /// The cells into which fuel flows, with the mass that enters each, kg/s.
    fn sources(&mut self, time: f64) -> Vec<(usize, f32)> {
        let SimulationConstants { burners, fuel, key, parameters, .. } = &*self.shared;
        let mut sources = Vec::new();
        let mut heat = 0.0;
        for (number, burner) in burners.iter().enumerate() {
            let flow = burner.parameters.flow.at(time).max(0.0);
            if flow > 0.0 {
                let kilowatts = burner.heat_release_kw * flow;
                let mass = (kilowatts * 1e3 / fuel.heat_of_combustion) as f32;
                heat += kilowatts;
                let unevenness = parameters.gas.unevenness;
                let shares = self.burner_cells.shares(number, burner, &self.flow, *key, time, unevenness);
                sources.extend(shares.into_iter().map(|(index, share)| (index, mass * share)));
            }
        }
        self.figures.heat_release_kw = heat;
        sources
    }

    /// Finds the cells in which gas is, and those around them into which it may flow.
    fn activate(&mut self, sources: &[(usize, f32)]) {
        let mut with_sources = Vec::new();
        // Cells of burners count as full of gas before any has flowed.
        let mixture = &self.flow.contents.quantities[0];
        if sources.iter().any(|(index, _)| mixture[*index] <= LEAST_MIXTURE) {
            with_sources = vec![false; self.flow.grid.len()];
            sources.iter().for_each(|(index, _)| with_sources[*index] = true);
        }
        let next = ActiveRows::around(&self.flow.grid, MARGIN, |index| {
            mixture[index] > LEAST_MIXTURE || with_sources.get(index).is_some_and(|is_source| *is_source)
        });
        self.flow.empty(&self.active, &next);
        self.active = next;
        self.figures.active_cells = self.active.cells();
    }

    fn add_fuel(&mut self, sources: &[(usize, f32)], seconds: f32) {
        let volume = (self.flow.grid.spacing * self.flow.grid.spacing * self.flow.grid.spacing) as f32;
        let contents = &mut self.flow.contents;
        for (index, mass) in sources {
            let added = mass * seconds / volume;
            let before = contents.density[*index];
            let after = before + added;
            contents.density[*index] = after;
            contents.quantities[0][*index] = (before * contents.quantities[0][*index] + added) / after;
            contents.quantities[1][*index] *= before / after;
        }
    }

    /// Burns, radiates, and states how fast every cell expands: so that its density becomes that of gas of its temperature.
    fn react(&mut self, seconds: f32) {
        let constants = ReactionConstants {
            mixture: self.mixture,
            emission: self.emission_factor
                * 4.0
                * STEFAN_BOLTZMANN
                * PLANCK_MEAN
                * (self.shared.fuel.soot_ppm * 1e-6) as f32
                / HEAT_CAPACITY,
            seconds,
        };
        let grid = self.flow.grid;
        let [_, plane, _] = grid.strides();
        let Flow { contents, divergence, solids, .. } = &mut self.flow;
        let [mixture, deficit] = &mut contents.quantities;
        let (active, solids) = (&self.active, &*solids);
        let layers = contents
            .density
            .par_chunks_mut(plane)
            .zip(mixture.par_chunks_mut(plane))
            .zip(deficit.par_chunks_mut(plane))
            .zip(divergence.par_chunks_mut(plane));
        let sums: Vec<LayerSums> = layers
            .enumerate()
            .map(|(padded_y, (((density, mixture), deficit), divergence))| {
                divergence.fill(0.0);
                let mut sums = LayerSums::default();
                let Some(y) = padded_y.checked_sub(bansho_fluid::GHOST_LAYERS).filter(|y| *y < grid.size[1]) else {
                    return sums;
                };
                for (z, row) in grid.rows(y) {
                    for x in active.row(y, z) {
                        let at = row + x - padded_y * plane;
                        let is_gas = VALID_DENSITIES.contains(&density[at])
                            && mixture[at].is_finite()
                            && deficit[at].is_finite();
                        if solids.contains(row + x) || !is_gas {
                            (density[at], mixture[at], deficit[at]) = (constants.mixture.air_density, 0.0, 0.0);
                            continue;
                        }
                        let cell = constants.react(density[at], &mut mixture[at], &mut deficit[at]);
                        divergence[at] = cell.divergence;
                        sums.radiated += f64::from(cell.radiated);
                        sums.burns |= mixture[at] > constants.mixture.stoichiometric;
                    }
                }
                sums
            })
            .collect();
        let volume = grid.spacing * grid.spacing * grid.spacing;
        let radiated: f64 = sums.iter().map(|layer| layer.radiated).sum::<f64>() * volume;
        self.figures.radiated_kw = radiated * 1e-3;
        let top =
            sums.iter().rposition(|layer| layer.burns).map_or(0, |padded_y| padded_y + 1 - bansho_fluid::GHOST_LAYERS);
        let lowest = self.shared.burners.iter().map(|burner| burner.extent()[0].y).fold(f64::INFINITY, f64::min);
        self.figures.height = (grid.origin.y + top as f64 * grid.spacing - lowest).max(0.0);
    }

    /// Finds how much heat the gas releases, which goes on after a burst of gas has ended.
    fn measure_burning(&mut self, sources: &[(usize, f32)], seconds: f32) {
        let flowed = sources.iter().map(|(_, mass)| f64::from(*mass)).sum::<f64>() * f64::from(seconds);
        let unburnt = self.unburnt_kg();
        let burnt = (self.unburnt_kg + flowed - unburnt).max(0.0);
        self.unburnt_kg = unburnt;
        let power = burnt * self.shared.fuel.heat_of_combustion / f64::from(seconds);
        self.figures.burning_kw = power * 1e-3;
        let rate = (seconds / EMISSION_TIME_S).min(1.0);
        let share = (power * 1e-3 / self.shared.size.heat_release_kw.max(1e-9)).min(MOST_BURNING);
        self.recent_burning += rate * (share as f32 - self.recent_burning);
        self.follow_radiant_fraction(seconds);
    }

    /// Changes the factor of emission toward the one with which the fire radiates its fraction.
    fn follow_radiant_fraction(&mut self, seconds: f32) {
        let radiated = self.figures.radiated_kw * 1e3;
        let wanted =
            self.shared.fuel.radiant_fraction * f64::from(self.recent_burning) * self.shared.size.heat_release_kw * 1e3;
        if radiated > 0.0 && wanted > 0.0 {
            let ideal = self.emission_factor * (wanted / radiated) as f32;
            let rate = (seconds / EMISSION_TIME_S).min(1.0);
            let factor = self.emission_factor
                + rate * (ideal.clamp(EMISSION_FACTORS[0], EMISSION_FACTORS[1]) - self.emission_factor);
            self.emission_factor = factor.clamp(EMISSION_FACTORS[0], EMISSION_FACTORS[1]);
        }
    }
}

#[derive(Clone, Copy, Default)]
struct LayerSums {
    radiated: f64,
    burns: bool,
}

struct ReactionConstants {
    mixture: Mixture,
    /// Rate at which soot of the largest fraction loses heat, over `T (T^4 - T_air^4)`, kg/(m^3 s K^4).
    emission: f32,
    seconds: f32,
}

struct ReactedCell {
    divergence: f32,
    /// W/m^3.
    radiated: f32,
}

impl ReactionConstants {
    #[inline(always)]
    fn react(&self, density: f32, mixture: &mut f32, deficit: &mut f32) -> ReactedCell {
        let fraction = mixture.clamp(0.0, 1.0);
        *mixture = fraction;
        let adiabatic = self.mixture.adiabatic_k(fraction);
        let air = self.mixture.air_temperature_k;
        let mut temperature = (adiabatic - *deficit).max(air);
        let soot = soot_profile(fraction / self.mixture.stoichiometric);
        let mut radiated = 0.0;
        if soot > 0.0 {
            let square = temperature * temperature;
            let excess = square * square - air * air * (air * air);
            let rate = self.emission * soot * temperature * excess / density;
            // At most a fifth of the rise in a step.
            let cooled = (rate * self.seconds).min(0.2 * (temperature - air));
            radiated = cooled * density * HEAT_CAPACITY / self.seconds;
            *deficit += cooled;
            temperature -= cooled;
        }
        // Fuel may be colder than the air.
        *deficit = deficit.clamp(0.0, (adiabatic - air).max(0.0));
        let expansion = density / self.mixture.density(temperature) - 1.0;
        ReactedCell { divergence: expansion.clamp(-MAX_EXPANSION, MAX_EXPANSION) / self.seconds, radiated }
    }
}

fn flow_settings(shared: &SimulationConstants, mixture: &Mixture, wind: [f32; 3]) -> FlowSettings {
    FlowSettings {
        has_floor: shared.parameters.floor,
        smagorinsky: shared.parameters.gas.smagorinsky as f32,
        schmidt: 0.5,
        least_density: 0.9 * mixture.density(mixture.hottest_k().max(mixture.air_temperature_k)),
        ambient: Ambient { density: mixture.air_density, velocity: wind },
    }
}

/// Solids relative to the flame's position.
fn moved(occluders: &[Occluder], origin: DVec3) -> Vec<Occluder> {
    occluders.iter().map(|occluder| occluder.translated(-origin)).collect()
}
