//! The parameters of a table whose type is not known.

use std::any::Any;

use crate::parameters::{Parameter, Parameters, Reader, Table};

/// The parameters of a table whose type is not known. Every struct that [`parameters!`](crate::parameters!) declares has these methods.
pub trait TableParameters: Send + Sync + Any {
    /// All parameters with their values, including defaults: equal tables are equal parameters.
    fn canonical(&self) -> Table;

    /// Paths of the files that it names, for fingerprints.
    fn asset_paths(&self) -> Vec<String>;

    /// Reports every value that is out of range or not finite: see [`Parameters::check_values`].
    fn report_values(&self, reader: &mut Reader);

    /// Whether other parameters are of the same type and equal.
    fn equals(&self, other: &dyn TableParameters) -> bool;

    /// Makes keyframed values repeat after `period` seconds. Returns the path of the first whose values at the beginning and at the end differ: see
    /// [`Parameter::close_loop`].
    fn repeat_after(&mut self, period: f64) -> Option<String>;

    /// Makes keyframed values continue those of `before` at time `t` (s) and reach their own within `transition_s`: see [`Parameter::continue_from`].
    /// Returns whether it did; parameters of another type cannot be continued.
    fn continue_parameters(&mut self, before: &dyn TableParameters, t: f64, transition_s: f64) -> bool;

    /// The parameters themselves.
    fn as_any(&self) -> &dyn Any;
}

impl<P: Parameter + Parameters + PartialEq + Send + Sync + Any> TableParameters for P {
    fn canonical(&self) -> Table {
        self.to_table()
    }

    fn asset_paths(&self) -> Vec<String> {
        P::table().asset_paths(&self.to_table())
    }

    fn report_values(&self, reader: &mut Reader) {
        self.check_values(reader);
    }

    fn equals(&self, other: &dyn TableParameters) -> bool {
        other.as_any().downcast_ref::<P>().is_some_and(|other| other == self)
    }

    fn repeat_after(&mut self, period: f64) -> Option<String> {
        self.close_loop(period)
    }

    fn continue_parameters(&mut self, before: &dyn TableParameters, t: f64, transition_s: f64) -> bool {
        let before = before.as_any().downcast_ref::<P>();
        if let Some(before) = before {
            self.continue_from(before, t, transition_s);
        }
        before.is_some()
    }

    fn as_any(&self) -> &dyn Any {
        self
    }
}
