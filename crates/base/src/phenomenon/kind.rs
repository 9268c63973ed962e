//! Kinds of phenomena: how each is read from its table in a scene, and built.

use std::{any::Any, sync::Arc};

use crate::{
    host::assets::Assets,
    parameters::{BuildError, Parameter, Parameters, ProblemKind, Reader, Table, TableDescriptor},
};

use super::{
    Phenomenon,
    editor_hints::{EditorHints, StageView},
};

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

/// The checked parameters of a phenomenon.
pub trait CheckedParameters: Send + Sync {
    /// All parameters with their values, including defaults: equal tables give equal phenomena.
    fn canonical(&self) -> Table;

    /// Paths of the assets it reads, for fingerprints.
    fn assets(&self) -> Vec<String>;

    /// See [`Describe::check_particle_budget`].
    fn check_particle_budget(&self, others: i64) -> Result<i64, BuildError>;

    /// See [`Describe::stage_view`].
    fn stage_view(&self) -> Option<StageView>;

    /// Reports every value that is out of range or not finite: see [`Parameters::check_values`].
    fn check_values(&self, reader: &mut Reader);

    /// Whether other parameters are of the same kind and equal.
    fn equals(&self, other: &dyn CheckedParameters) -> bool;

    /// The parameters themselves, of the type that implements [`Describe`].
    fn as_any(&self) -> &dyn Any;

    /// The same parameters, whose keyframed values continue those of `before` at time `t` (s) and reach their own within `transition_s`: see
    /// [`Parameter::continue_from`]. `None` if those are of another kind.
    fn continuing(
        &self,
        before: &dyn CheckedParameters,
        t: f64,
        transition_s: f64,
    ) -> Option<Arc<dyn CheckedParameters>>;

    /// See [`Describe::with_flow`].
    fn with_flow(&self, flow: f64) -> Option<Arc<dyn CheckedParameters>>;

    /// See [`Describe::with_position`].
    fn with_position(&self, position: [f64; 3]) -> Option<Arc<dyn CheckedParameters>>;

    /// Builds the phenomenon.
    ///
    /// # Errors
    /// The parameters contradict each other, or an asset could not be loaded.
    fn build(&self, context: &BuildContext) -> Result<Arc<dyn Phenomenon>, BuildError>;
}

/// One kind of phenomenon, such as `flame_sheet`.
#[derive(Clone, Copy)]
pub struct PhenomenonKind {
    /// Its table's name in scene files.
    pub key: &'static str,
    /// Its parameters.
    pub table: fn() -> &'static TableDescriptor,
    /// Reads its parameters; reports problems and uses defaults for invalid values.
    pub read: fn(&Table, &mut Reader) -> Box<dyn CheckedParameters>,
    /// Whether it is in the sky: if all phenomena of a scene are, the default camera looks up.
    pub in_the_sky: bool,
    /// Tables of a scene that show it well (camera, sky, ...), in the syntax of scene files: for new scenes, and as defaults of scenes that contain only
    /// this kind.
    pub scene_defaults: &'static str,
    /// Its own keys that determine its position or size: if one is set, the camera of `scene_defaults` may not show it.
    pub placement_keys: &'static [&'static str],
    /// The most important keys; those in sub-tables and lists of tables are separated by dots.
    pub first_keys: &'static [&'static str],
    /// What interactive editors know of it besides its parameters.
    pub editor_hints: EditorHints,
}

/// Keys that every phenomenon has besides its own.
pub(crate) const COMMON_KEYS: [&str; 2] = ["name", "enabled"];

/// Makes a [`PhenomenonKind`] from a parameter table and a constructor.
pub trait Describe: Parameter + Parameters + Clone + PartialEq + Send + Sync + 'static {
    /// The table's name in scene files.
    const KEY: &'static str;
    /// See [`PhenomenonKind::in_the_sky`].
    const IN_THE_SKY: bool = false;
    /// See [`PhenomenonKind::scene_defaults`]; empty if the defaults suffice.
    const SCENE_DEFAULTS: &'static str = "";
    /// See [`PhenomenonKind::placement_keys`].
    const PLACEMENT_KEYS: &'static [&'static str] = &[];
    /// The most important keys, with which a short new scene begins; dots separate tables and lists of tables (`burners.diameter`).
    const FIRST_KEYS: &'static [&'static str] = &[];
    /// See [`PhenomenonKind::editor_hints`].
    const EDITOR_HINTS: EditorHints = EditorHints::NONE;

    /// Checks the number of its particles together with the `others` of the scene, since the number of all phenomena together is limited by memory, and
    /// returns the total.
    ///
    /// # Errors
    /// There are more than fit.
    fn check_particle_budget(&self, others: i64) -> Result<i64, BuildError> {
        Ok(others)
    }

    /// How the stage that these parameters select is shown alone; `None` where the phenomenon has no stages. See [`EditorHints::stage_key`].
    fn stage_view(&self) -> Option<StageView> {
        None
    }

    /// Makes keyframed values continue those of `before` at time `t` (s): see [`Parameter::continue_from`].
    fn continue_live(&mut self, before: &Self, t: f64, transition_s: f64) {
        self.continue_from(before, t, transition_s);
    }

    /// The same parameters with another gas flow, as a fraction of full flow: 0 puts a flame out. `None` for what does not burn.
    fn with_flow(&self, _flow: f64) -> Option<Self> {
        None
    }

    /// The same parameters at another position, m. `None` for what has no position of its own.
    fn with_position(&self, _position: [f64; 3]) -> Option<Self> {
        None
    }

    /// Builds the phenomenon.
    ///
    /// # Errors
    /// The parameters contradict each other, or an asset could not be loaded.
    fn build(&self, context: &BuildContext) -> Result<Arc<dyn Phenomenon>, BuildError>;

    /// The kind that scene files refer to by [`KEY`](Self::KEY).
    const KIND: PhenomenonKind = PhenomenonKind {
        key: Self::KEY,
        table: <Self as Parameters>::table,
        read: read_described::<Self>,
        in_the_sky: Self::IN_THE_SKY,
        scene_defaults: Self::SCENE_DEFAULTS,
        placement_keys: Self::PLACEMENT_KEYS,
        first_keys: Self::FIRST_KEYS,
        editor_hints: Self::EDITOR_HINTS,
    };
}

fn read_described<P: Describe>(table: &Table, reader: &mut Reader) -> Box<dyn CheckedParameters> {
    Box::new(Described(P::read_table(table, reader, &COMMON_KEYS)))
}

/// Parameters that a program has set. They are not checked yet: see [`CheckedParameters::check_values`].
pub fn set_parameters<P: Describe>(parameters: P) -> Arc<dyn CheckedParameters> {
    Arc::new(Described(parameters))
}

struct Described<P>(P);

impl<P: Describe> CheckedParameters for Described<P> {
    fn canonical(&self) -> Table {
        self.0.to_table()
    }

    fn assets(&self) -> Vec<String> {
        P::table().asset_paths(&self.0.to_table())
    }

    fn check_particle_budget(&self, others: i64) -> Result<i64, BuildError> {
        self.0.check_particle_budget(others)
    }

    fn stage_view(&self) -> Option<StageView> {
        self.0.stage_view()
    }

    fn check_values(&self, reader: &mut Reader) {
        self.0.check_values(reader);
    }

    fn equals(&self, other: &dyn CheckedParameters) -> bool {
        other.as_any().downcast_ref::<P>().is_some_and(|other| *other == self.0)
    }

    fn as_any(&self) -> &dyn Any {
        &self.0
    }

    fn continuing(
        &self,
        before: &dyn CheckedParameters,
        t: f64,
        transition_s: f64,
    ) -> Option<Arc<dyn CheckedParameters>> {
        let mut parameters = self.0.clone();
        parameters.continue_live(before.as_any().downcast_ref::<P>()?, t, transition_s);
        Some(Arc::new(Self(parameters)))
    }

    fn with_flow(&self, flow: f64) -> Option<Arc<dyn CheckedParameters>> {
        Some(Arc::new(Self(self.0.with_flow(flow)?)))
    }

    fn with_position(&self, position: [f64; 3]) -> Option<Arc<dyn CheckedParameters>> {
        Some(Arc::new(Self(self.0.with_position(position)?)))
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
