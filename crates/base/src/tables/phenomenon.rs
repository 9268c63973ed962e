//! Tables that are phenomena.

use std::sync::Arc;

use crate::{
    host::assets::Assets,
    parameters::{BuildError, Parameters, ProblemKind, Reader, Table},
    phenomenon::Phenomenon,
};

use super::{TableKind, TableParameters};

/// Reads the parameters of a phenomenon; reports problems and uses defaults for invalid values.
pub type ReadPhenomenon = fn(&Table, &mut Reader) -> Arc<dyn PhenomenonTable>;

/// What a phenomenon is built with, besides its own parameters.
#[derive(Clone, Copy)]
pub struct BuildContext<'a> {
    /// Its name in the scene.
    pub name: &'a str,
    /// Seed of all random numbers of the shot.
    pub seed: u64,
    /// Length of a seamless loop, s.
    pub loop_s: Option<f64>,
    /// Loader of assets.
    pub assets: &'a dyn Assets,
    /// The phenomenon of the same name before its parameters were changed; tables that do not depend on the changes can be reused.
    pub previous: Option<&'a dyn Phenomenon>,
}

/// A table whose parameters describe a phenomenon, checked or set by a program.
pub trait PhenomenonTable: TableParameters + ClonePhenomenonTable {
    /// Its kind, as the registry has it.
    fn kind(&self) -> TableKind;

    /// Builds the phenomenon. Keyframed values of a loop repeat already.
    ///
    /// # Errors
    /// The parameters contradict each other, or an asset could not be loaded.
    fn build(&self, context: &BuildContext) -> Result<Arc<dyn Phenomenon>, BuildError>;

    /// Checks the number of its particles together with the `others` of the scene, since the number of all phenomena together is limited by memory, and
    /// returns the total.
    ///
    /// # Errors
    /// There are more than fit.
    fn check_particle_budget(&self, others: i64) -> Result<i64, BuildError> {
        Ok(others)
    }

    /// As [`continue_parameters`](TableParameters::continue_parameters), where some values have a time of their own.
    fn continue_live(&mut self, before: &dyn TableParameters, t: f64, transition_s: f64) -> bool {
        self.continue_parameters(before, t, transition_s)
    }

    /// The same parameters with another value of a quantity that programs change while a shot runs, such as the gas flow of a flame. The crate of a kind
    /// documents its quantities. `None` for a quantity that it does not have, or for a value with another number of components.
    fn with_quantity(&self, _quantity: &str, _value: &[f64]) -> Option<Arc<dyn PhenomenonTable>> {
        None
    }
}

/// Clones the table of a phenomenon whose type is not known; every table that can be cloned has it.
pub trait ClonePhenomenonTable {
    /// A copy that nothing else refers to.
    fn clone_table(&self) -> Box<dyn PhenomenonTable>;
}

impl<P: PhenomenonTable + Clone> ClonePhenomenonTable for P {
    fn clone_table(&self) -> Box<dyn PhenomenonTable> {
        Box::new(self.clone())
    }
}

impl dyn PhenomenonTable {
    /// Builds the phenomenon. In a loop, keyframed values are made to repeat first.
    ///
    /// # Errors
    /// A value differs between the beginning and the end of the loop, the parameters contradict each other, or an asset could not be loaded.
    pub fn build_in_loop(&self, context: &BuildContext) -> Result<Arc<dyn Phenomenon>, BuildError> {
        let Some(seconds) = context.loop_s else { return self.build(context) };
        let mut repeating = self.clone_table();
        match repeating.repeat_after(seconds) {
            Some(key) => Err(BuildError { key, kind: ProblemKind::LoopJumps { seconds } }),
            None => repeating.build(context),
        }
    }

    /// The same parameters, whose keyframed values continue those of `before` at time `t` (s) and reach their own within `transition_s`. `None` if those
    /// are of another kind.
    pub fn continuing(
        &self,
        before: &dyn PhenomenonTable,
        t: f64,
        transition_s: f64,
    ) -> Option<Arc<dyn PhenomenonTable>> {
        let mut parameters = self.clone_table();
        parameters.continue_live(before, t, transition_s).then(|| Arc::from(parameters))
    }
}

/// Keys that every phenomenon has besides its own.
const COMMON_KEYS: [&str; 2] = ["name", "enabled"];

pub(super) fn read<P: PhenomenonTable + Parameters>(table: &Table, reader: &mut Reader) -> Arc<dyn PhenomenonTable> {
    Arc::new(P::read_table(table, reader, &COMMON_KEYS))
}
