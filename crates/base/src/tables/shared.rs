//! Tables that all phenomena share: sky, ground, lights, obstacles, fog.

use std::{any::Any, sync::Arc};

use crate::{
    host::assets::Assets,
    parameters::{BuildError, Parameters, Reader, Table},
    phenomenon::{
        Phenomenon,
        strip::Shutter,
        surroundings::{Light, Occluder},
    },
    world::sky::Sky,
};

use super::{BuildContext, TableKind, TableParameters};

/// Reads the parameters of a shared table; reports problems and uses defaults for invalid values.
pub type ReadShared = fn(&Table, &mut Reader) -> Arc<dyn SharedTable>;

/// Makes the one phenomenon that draws those tables of a kind that are visible.
pub type DrawShared = fn(&[BuiltTable], &BuildContext) -> Arc<dyn Phenomenon>;

/// What a kind of shared table is to a scene.
#[derive(Clone, Copy)]
pub struct SharedRole {
    /// Reads its parameters.
    pub read: ReadShared,
    /// Draws it; `None` if it is never drawn.
    pub draw: Option<DrawShared>,
    /// Its place in the order in which tables are drawn that fill the same depths, after all phenomena: near ones first, since light accumulates from near
    /// to far. Lights have 10, obstacles 20, the ground 30, the sky 40.
    pub draw_order: u8,
    /// Whether it is behind every plate, so that an opaque plate hides it.
    pub is_behind_plates: bool,
    /// Its place in the fingerprint of what simulations depend on. It must not change between versions, since `--resume` would draw all frames again: lights
    /// have 10, the sky 20, the ground 30, obstacles 40.
    pub fingerprint_order: u8,
    /// Tables that prevent that one of this kind is implied by the phenomena of a scene, besides its own kind; `None` if it is never implied. See
    /// [`TableKind::scene_defaults`].
    pub implied_unless: Option<&'static [&'static str]>,
    /// Whether it determines what a picture shows, as an obstacle does: a scene with one has no implied camera and background.
    pub determines_view: bool,
}

impl SharedRole {
    /// A table with parameters of type `P` that is not drawn, and is last in every order.
    #[must_use]
    pub const fn new<P: SharedTable + Parameters>() -> Self {
        Self {
            read: read::<P>,
            draw: None,
            draw_order: u8::MAX,
            is_behind_plates: false,
            fingerprint_order: u8::MAX,
            implied_unless: None,
            determines_view: false,
        }
    }
}

fn read<P: SharedTable + Parameters>(table: &Table, reader: &mut Reader) -> Arc<dyn SharedTable> {
    Arc::new(P::read_table(table, reader, &[]))
}

/// The parameters of a table that all phenomena share, checked or set by a program: what it is to them, without a name.
pub trait SharedTable: TableParameters + CloneSharedTable {
    /// Its kind, as the registry has it.
    fn kind(&self) -> TableKind;

    /// Values that contradict each other. `is_stated` tells of a key whether the text states it.
    fn conflicts(&self, _is_stated: &dyn Fn(&str) -> bool) -> Vec<BuildError> {
        Vec::new()
    }

    /// Makes a table that phenomena imply invisible, so that it only lights them. Returns whether that is possible; otherwise the scene does without it.
    fn hide(&mut self) -> bool {
        false
    }

    /// Whether it is drawn, if its [`SharedRole`] says how.
    fn is_visible(&self) -> bool {
        true
    }

    /// Whether it is seen where nothing else is.
    fn fills_background(&self) -> bool {
        false
    }

    /// The white balance of a camera under its light, K, if the scene states none.
    fn white_balance_k(&self) -> Option<f64> {
        None
    }

    /// The light of the sky at time `t`, if it is one.
    fn sky(&self, _t: f64) -> Option<SceneSky> {
        None
    }

    /// The level ground at time `t`, if it is one.
    fn level_ground(&self, _t: f64) -> Option<LevelGround> {
        None
    }

    /// The light at time `t`, if it is one.
    fn light(&self, _t: f64) -> Option<Light> {
        None
    }

    /// Number of equal parts of an exposure, a power of two, in each of which its light hardly moves or changes.
    fn light_parts(&self, _shutter: Shutter) -> usize {
        1
    }

    /// Extinction coefficient at time `t` of a medium that is everywhere, 1/m.
    fn extinction(&self, _t: f64) -> f64 {
        0.0
    }

    /// Builds what takes time or reads files; `None` if the parameters are enough.
    ///
    /// # Errors
    /// The parameters contradict each other, or an asset could not be loaded.
    fn build(&self, _assets: &dyn Assets) -> Result<Option<Arc<dyn SharedObject>>, BuildError> {
        Ok(None)
    }
}

/// What is built from a shared table.
pub trait SharedObject: Send + Sync {
    /// The solid at time `t`, if it is one.
    fn solid(&self, _t: f64) -> Option<Occluder> {
        None
    }

    /// The object itself.
    fn as_any(&self) -> &dyn Any;
}

/// A shared table of a scene with what is built from it.
#[derive(Clone)]
pub struct BuiltTable {
    /// Its parameters.
    pub parameters: Arc<dyn SharedTable>,
    /// What [`SharedTable::build`] returned.
    pub object: Option<Arc<dyn SharedObject>>,
}

impl BuiltTable {
    /// The parameters, if they are of type `P`.
    #[must_use]
    pub fn parameters<P: 'static>(&self) -> Option<&P> {
        self.parameters.as_any().downcast_ref()
    }

    /// The parameters of the first of `tables`, for phenomena that draw one table; the defaults if there is none of type `P`.
    #[must_use]
    pub fn first_or_default<P: Clone + Default + 'static>(tables: &[Self]) -> P {
        tables.first().and_then(Self::parameters::<P>).cloned().unwrap_or_default()
    }

    /// What was built, if it is of type `O`.
    #[must_use]
    pub fn object<O: 'static>(&self) -> Option<&O> {
        self.object.as_ref()?.as_any().downcast_ref()
    }
}

/// The sky of a scene at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneSky {
    /// Its light.
    pub sky: Sky,
    /// Whether it is seen; otherwise it only lights the scene.
    pub is_visible: bool,
}

/// The ground of a scene at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelGround {
    /// Height of the plane, m.
    pub height: f64,
    /// Luminance of its diffuse albedo.
    pub reflectance: f64,
}

/// Clones a shared table whose type is not known; every table that can be cloned has it.
pub trait CloneSharedTable {
    /// A copy that nothing else refers to.
    fn clone_table(&self) -> Box<dyn SharedTable>;
}

impl<P: SharedTable + Clone> CloneSharedTable for P {
    fn clone_table(&self) -> Box<dyn SharedTable> {
        Box::new(self.clone())
    }
}
