//! Kinds of phenomena: how each is read from its table of a scene, and built.

use std::{error::Error, sync::Arc};

use crate::{
    host::assets::Assets,
    parameters::{ModelError, Parameter, Parameters, ProblemKind, Reader, Table, TableDescriptor},
};

use super::Phenomenon;

/// What a phenomenon is built with, beside its own parameters.
#[derive(Clone, Copy)]
pub struct BuildContext<'a> {
    /// Its name in the scene.
    pub name: &'a str,
    /// Seed of everything random in the shot.
    pub seed: u64,
    /// Length of a seamless loop, s.
    pub loop_s: Option<f64>,
    /// Where pictures and texts come from.
    pub assets: &'a dyn Assets,
}

/// A fault that only building shows.
#[derive(Clone, Debug, PartialEq)]
pub struct BuildError {
    /// The parameter at fault, with dots where it lies deeper.
    pub key: String,
    /// What is wrong.
    pub kind: ProblemKind,
}

impl BuildError {
    /// A phenomenon's own fault, at the parameter that it names.
    pub fn new(key: impl Into<String>, fault: impl Error + Send + Sync + 'static) -> Self {
        Self { key: key.into(), kind: ModelError::new(fault).into() }
    }
}

/// A phenomenon's checked parameters.
pub trait CheckedParameters: Send + Sync {
    /// Every parameter with its value, defaults too: equal tables make equal phenomena.
    fn canonical(&self) -> Table;

    /// Paths of the assets it reads, for fingerprints.
    fn assets(&self) -> Vec<String>;

    /// See [`Describe::check_particle_budget`].
    fn check_particle_budget(&self, others: i64) -> Result<i64, BuildError>;

    /// Builds the phenomenon.
    ///
    /// # Errors
    /// Parameters that do not go together, or an asset that cannot be had.
    fn build(&self, context: &BuildContext) -> Result<Arc<dyn Phenomenon>, BuildError>;
}

/// One kind of phenomenon, such as `flame_sheet`.
#[derive(Clone, Copy)]
pub struct PhenomenonKind {
    /// Its table's name in scene files.
    pub key: &'static str,
    /// Its parameters.
    pub table: fn() -> &'static TableDescriptor,
    /// Reads its parameters; reports faults and falls back to defaults there.
    pub read: fn(&Table, &mut Reader) -> Box<dyn CheckedParameters>,
    /// Whether it is in the sky: where all is, a camera that is told nothing looks up.
    pub in_the_sky: bool,
    /// What a new scene of it states so that it is seen well, as a scene file says it; the default of a scene of it alone.
    pub setting: &'static str,
    /// Its own keys that say where it is or how large, so that the setting's camera may not fit.
    pub placement_keys: &'static [&'static str],
    /// Keys that one changes first, in tables and lists of tables within it with dots.
    pub first_keys: &'static [&'static str],
}

/// Keys that every phenomenon has beside its own.
pub const COMMON_KEYS: [&str; 2] = ["name", "enabled"];

/// Makes a [`PhenomenonKind`] from a parameter table and a constructor.
pub trait Describe: Parameter + Parameters + Clone + Send + Sync + 'static {
    /// The table's name in scene files.
    const KEY: &'static str;
    /// See [`PhenomenonKind::in_the_sky`].
    const IN_THE_SKY: bool = false;
    /// What a new scene of it states so that it is seen well, as a scene file says it; nothing where all defaults do.
    const SETTING: &'static str = "";
    /// See [`PhenomenonKind::placement_keys`].
    const PLACEMENT_KEYS: &'static [&'static str] = &[];
    /// Keys that one changes first, with which a short new scene begins; dots lead into tables and lists of tables (`burners.diameter`).
    const FIRST_KEYS: &'static [&'static str] = &[];

    /// How many particles live in memory with the `others` of the scene, of which all phenomena together may have so many.
    ///
    /// # Errors
    /// More than fit.
    fn check_particle_budget(&self, others: i64) -> Result<i64, BuildError> {
        Ok(others)
    }

    /// Builds the phenomenon.
    ///
    /// # Errors
    /// Parameters that do not go together, or an asset that cannot be had.
    fn build(&self, context: &BuildContext) -> Result<Arc<dyn Phenomenon>, BuildError>;

    /// The kind that scene files call by [`KEY`](Self::KEY).
    const KIND: PhenomenonKind = PhenomenonKind {
        key: Self::KEY,
        table: <Self as Parameters>::table,
        read: read_described::<Self>,
        in_the_sky: Self::IN_THE_SKY,
        setting: Self::SETTING,
        placement_keys: Self::PLACEMENT_KEYS,
        first_keys: Self::FIRST_KEYS,
    };
}

fn read_described<P: Describe>(table: &Table, reader: &mut Reader) -> Box<dyn CheckedParameters> {
    Box::new(Described(P::read_table(table, reader, &COMMON_KEYS)))
}

struct Described<P>(P);

impl<P: Describe> CheckedParameters for Described<P> {
    fn canonical(&self) -> Table {
        self.0.to_table()
    }

    fn assets(&self) -> Vec<String> {
        crate::parameters::assets(&self.0.to_table(), P::table())
    }

    fn check_particle_budget(&self, others: i64) -> Result<i64, BuildError> {
        self.0.check_particle_budget(others)
    }

    fn build(&self, context: &BuildContext) -> Result<Arc<dyn Phenomenon>, BuildError> {
        let Some(seconds) = context.loop_s else { return self.0.build(context) };
        let mut repeating = self.0.clone();
        match repeating.close_loop(seconds) {
            Some(key) => Err(BuildError { key, kind: ProblemKind::LoopJumps { seconds } }),
            None => repeating.build(context),
        }
    }
}
