//! The tables of a scene: what each is called, how many of it a scene may have, how it is read and what is built from it.
//!
//! Parser, schema, defaults, templates, edits, fingerprints and the studio know no table by name: they read a slice of [`TableKind`], the registry,
//! which a program passes to them.

mod paper;
mod parameters;
mod phenomenon;
mod shared;

use crate::parameters::{Parameter, Parameters, TableDescriptor};

pub use self::{
    paper::{PaperSetting, PaperSettings, PaperValues},
    parameters::TableParameters,
    phenomenon::{BuildContext, ClonePhenomenonTable, PhenomenonTable, ReadPhenomenon},
    shared::{
        BuiltTable, CloneSharedTable, DrawShared, LevelGround, ReadShared, SceneSky, SharedObject, SharedRole,
        SharedTable,
    },
};

/// How many tables of a kind a scene may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableCount {
    /// Every scene has one, `[camera]`: where the text states none, with default values.
    One,
    /// None or one, `[sky]`.
    Optional,
    /// Any number, `[[light]]`.
    List,
}

/// A kind of table, such as `[camera]` or `[[rain]]`.
#[derive(Clone, Copy)]
pub struct TableKind {
    /// Its name in scene files.
    pub key: &'static str,
    /// How many tables of it a scene may have.
    pub count: TableCount,
    /// Its parameters.
    pub table: fn() -> &'static TableDescriptor,
    /// What the table is to a scene.
    pub role: TableRole,
    /// The layer in which all tables of this kind are drawn, whose name no phenomenon may have. `None` for phenomena, each of which has a layer of its
    /// own, and for what is not drawn.
    pub layer: Option<&'static str>,
    /// The most important keys, with which a short new scene begins; dots separate tables and lists of tables (`burners.diameter`).
    pub first_keys: &'static [&'static str],
    /// Whether it is in the sky: if all phenomena of a scene are, the default camera looks up.
    pub in_the_sky: bool,
    /// Tables of a scene that show a phenomenon well (camera, sky, ...), in the syntax of scene files: for new scenes, and as defaults of scenes that
    /// contain only this kind of phenomenon. Empty if the defaults suffice.
    pub scene_defaults: &'static str,
    /// Keys that determine position or size of a phenomenon: if one is set, the camera of `scene_defaults` may not show it.
    pub placement_keys: &'static [&'static str],
    /// How it follows the paper of its method to the letter.
    pub paper: Option<&'static PaperSettings>,
    /// Memory of a phenomenon that is built and was never drawn, with its parameters, bytes.
    pub built_bytes: f64,
}

/// What a table is to a scene.
#[derive(Clone, Copy)]
pub enum TableRole {
    /// Values that every scene has, in a field of their own: picture, camera, plate, wind, air.
    Field,
    /// A table that all phenomena share, such as sky, ground, a light or an obstacle.
    Shared(SharedRole),
    /// A phenomenon, with a name and a layer of its own: how its parameters are read.
    Phenomenon(ReadPhenomenon),
}

impl TableKind {
    /// A table that a scene has as a field.
    #[must_use]
    pub const fn field(key: &'static str, count: TableCount, table: fn() -> &'static TableDescriptor) -> Self {
        Self {
            key,
            count,
            table,
            role: TableRole::Field,
            layer: None,
            first_keys: &[],
            in_the_sky: false,
            scene_defaults: "",
            placement_keys: &[],
            paper: None,
            built_bytes: 0.0,
        }
    }

    /// A kind of table that all phenomena share, with parameters of type `P`.
    #[must_use]
    pub const fn shared<P: Parameters>(key: &'static str, count: TableCount, role: SharedRole) -> Self {
        Self { role: TableRole::Shared(role), ..Self::field(key, count, P::table) }
    }

    /// A kind of phenomenon with parameters of type `P`, of which a scene may have any number.
    #[must_use]
    pub const fn phenomenon<P: PhenomenonTable + Parameters + Parameter>(key: &'static str) -> Self {
        Self {
            role: TableRole::Phenomenon(phenomenon::read::<P>),
            built_bytes: 12e3,
            ..Self::field(key, TableCount::List, P::table)
        }
    }

    /// Whether its tables are phenomena.
    #[must_use]
    pub const fn is_phenomenon(&self) -> bool {
        matches!(self.role, TableRole::Phenomenon(_))
    }

    /// What it is to the scene, if phenomena share it.
    #[must_use]
    pub const fn shared_role(&self) -> Option<&SharedRole> {
        match &self.role {
            TableRole::Shared(role) => Some(role),
            TableRole::Field | TableRole::Phenomenon(_) => None,
        }
    }

    /// The path of table `index` of this kind: `light.0`, `sky`.
    #[must_use]
    pub fn path(&self, index: usize) -> String {
        if self.is_list() { format!("{}.{index}", self.key) } else { self.key.to_owned() }
    }

    /// Whether it is a list of tables.
    #[must_use]
    pub fn is_list(&self) -> bool {
        self.count == TableCount::List
    }

    /// The line with which one of its tables begins in a scene file: `[camera]`, `[[rain]]`.
    #[must_use]
    pub fn header(&self) -> String {
        if self.is_list() { format!("[[{}]]", self.key) } else { format!("[{}]", self.key) }
    }
}

/// The kind of a registry that is called `key` in scene files.
#[must_use]
pub fn find<'a>(kinds: &'a [TableKind], key: &str) -> Option<&'a TableKind> {
    kinds.iter().find(|kind| kind.key == key)
}

/// The kinds of phenomena of a registry.
pub fn phenomena(kinds: &[TableKind]) -> impl Iterator<Item = &TableKind> + Clone {
    kinds.iter().filter(|kind| kind.is_phenomenon())
}

/// The kinds of tables of a registry that are no phenomena, and that phenomena share.
pub fn shared(kinds: &[TableKind]) -> impl Iterator<Item = &TableKind> + Clone {
    kinds.iter().filter(|kind| !kind.is_phenomenon())
}
