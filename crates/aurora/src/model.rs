//! An aurora: what is computed from its parameters, once for all of its runs.

use std::sync::{Arc, OnceLock};

use bansho_base::{
    color,
    host::{assets::Assets, constructions, once::get_or_compute},
    math::random::Key,
    parameters::Parameter,
};

use super::{
    AuroraParameters,
    parameters::{check_color_matching, check_energies, check_sampling},
    shapes::{Sequence, ShapeError, ShapeErrorKind},
    simulate::{AuroraSimulation, check_neighbors},
};
use crate::{physics::emission::Emission, render::inputs::RenderTables};

/// Luminance of the bright parts of a picture relative to that of the brightest vertical column. Sheets are thin, and most
/// lines of sight pass them obliquely.
pub(super) const OBLIQUE_LUMINANCE_FACTOR: f64 = 0.75;

/// An aurora of a scene: its parameters, shapes and tables. It does not change; a run of it is an [`AuroraRun`](crate::AuroraRun).
#[derive(Debug)]
pub struct Aurora {
    pub(super) name: String,
    seed: u64,
    pub(super) parameters: AuroraParameters,
    sequence: Arc<Sequence>,
    emission: Arc<Emission>,
    /// State before the preroll, and the tables from which frames are drawn. Computed by the first run that needs them: a scene may have hundreds of
    /// auroras, and checking it constructs them all.
    initial_state: OnceLock<AuroraSimulation>,
    render_tables: OnceLock<RenderTables>,
    /// Luminance of the brightest column of all shapes, cd/m^2.
    pub(super) max_column_luminance: f64,
    /// Memory of the lists of neighbors of all particles, bytes.
    pub(super) neighbor_list_bytes: f64,
    /// The first shape, counted from 0, whose transition has sheets that cross.
    pub(super) crossing: Option<usize>,
    /// In a loop, duration of the crossfade from one run to the next, s.
    pub(super) crossfade_s: f64,
}

/// Maximum duration of the crossfade of a loop, s: in this time particles move far along their sheets.
pub(super) const MAX_CROSSFADE_S: f64 = 10.0;

/// Makes animated parameters periodic in `loop_s` seconds and extends the preroll by half the duration of the crossfade,
/// which is returned.
pub(super) fn close_loop(parameters: &mut AuroraParameters, loop_s: f64) -> Result<f64, ShapeError> {
    if let Some(key) = parameters.close_loop(loop_s) {
        return Err(ShapeError { key, kind: ShapeErrorKind::LoopJumps { seconds: loop_s } });
    }
    let crossfade_s = loop_s.min(MAX_CROSSFADE_S);
    parameters.preroll_s += 0.5 * crossfade_s;
    Ok(crossfade_s)
}

/// Maximum luminance of a vertical column at control points with these factors of flux and energy, cd/m^2: that at the lowest
/// energy and the highest flux.
pub(super) fn max_column_luminance(parameters: &AuroraParameters, emission: &Emission, factors: &[[f64; 2]]) -> f64 {
    let (flux, energy_ev) = (parameters.flux_mw_per_m2.bounds()[1], parameters.energy_ev.bounds()[0]);
    let mut max_luminance = 0.0_f64;
    for [flux_factor, energy_factor] in factors {
        let column = emission.column_color(energy_ev * energy_factor).map(|value| value as f32);
        max_luminance = max_luminance.max(flux * flux_factor * f64::from(color::luminance(column)));
    }
    max_luminance
}

impl Aurora {
    /// The aurora `name` of a scene; SVG files of its shapes are loaded from `assets`.
    ///
    /// # Errors
    /// Invalid shapes; energies outside the tables; flux or energy that differ between the start and the end of a loop.
    pub fn new(
        mut parameters: AuroraParameters,
        name: &str,
        seed: u64,
        loop_s: Option<f64>,
        assets: &dyn Assets,
    ) -> Result<Self, ShapeError> {
        constructions::count("aurora");
        let sequence = Sequence::new(&parameters.shapes, &parameters.morphing, parameters.extent_km, assets, loop_s)?;
        let crossfade_s = loop_s.map_or(Ok(0.0), |loop_s| close_loop(&mut parameters, loop_s))?;
        check_energies(&parameters)?;
        check_color_matching(&parameters)?;
        check_sampling(&parameters)?;
        let lengths = sequence.arrivals().iter().map(|time| sequence.at(*time).length());
        let neighbor_list_bytes = check_neighbors(&parameters, lengths.fold(f64::INFINITY, f64::min))?;
        let crossing = sequence.crossing();
        let factors: Vec<[f64; 2]> = sequence.factors().collect();
        let emission = parameters.rendering.emission(parameters.spectrum, parameters.sunlit_above_km);
        Ok(Self {
            name: name.to_owned(),
            seed,
            max_column_luminance: max_column_luminance(&parameters, &emission, &factors),
            emission,
            neighbor_list_bytes,
            initial_state: OnceLock::new(),
            render_tables: OnceLock::new(),
            parameters,
            sequence: Arc::new(sequence),
            crossing,
            crossfade_s,
        })
    }

    /// State of a run before its preroll.
    pub(super) fn initial_state(&self) -> &AuroraSimulation {
        get_or_compute(&self.initial_state, || {
            let (sequence, emission) = (self.sequence.clone(), self.emission.clone());
            AuroraSimulation::with_emission(self.parameters.clone(), sequence, emission, &self.name, self.seed)
        })
    }

    /// Tables from which frames are drawn.
    pub(super) fn render_tables(&self) -> &RenderTables {
        get_or_compute(&self.render_tables, || {
            let max_energy_factor = self.sequence.factors().fold(1.0, |max: f64, [_, energy]| max.max(energy));
            let key = Key::new(self.seed, &self.name);
            RenderTables::new(&self.parameters, &self.emission, max_energy_factor, key)
        })
    }

    /// Its shapes in time.
    pub(super) fn sequence(&self) -> &Sequence {
        &self.sequence
    }
}
