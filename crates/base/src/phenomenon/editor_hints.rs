//! What an interactive editor knows of a kind of phenomenon besides its parameters, so that no editor has to name a kind.

/// Hints for interactive editors. Without any, a phenomenon is edited by the descriptors of its parameters alone.
///
/// Keys in sub-tables are separated by dots, as in [`PhenomenonKind::first_keys`](super::kind::PhenomenonKind::first_keys).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EditorHints {
    /// Upper limits of integer parameters in a draft, which is a preview that is faster to simulate than the scene.
    pub draft_limits: &'static [DraftLimit],
    /// Positions that can be dragged in the picture.
    pub position_handles: Option<PositionHandles>,
    /// What a mesh file becomes that is dropped on the scene.
    pub mesh_import: Option<MeshImport>,
    /// Key of the choice that shows an intermediate stage. Its default is the finished phenomenon. Every other choice has a
    /// [`stage_view`](super::kind::Describe::stage_view).
    pub stage_key: Option<&'static str>,
}

impl EditorHints {
    /// No hints.
    pub const NONE: Self = Self { draft_limits: &[], position_handles: None, mesh_import: None, stage_key: None };
}

/// The upper limit of an integer parameter in a draft.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DraftLimit {
    /// Key of the parameter.
    pub key: &'static str,
    /// Its largest value in a draft.
    pub max: i64,
}

/// Positions that can be dragged: that of the phenomenon, and those of the items of a list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PositionHandles {
    /// Key of the phenomenon's position, m.
    pub key: &'static str,
    /// Key of a list of tables. Each has a position under the same key, relative to the phenomenon's position. An empty list is equivalent to
    /// a list with one item that has default values.
    pub items: Option<&'static str>,
}

/// How a mesh file is added to a phenomenon: as an item of a list of tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshImport {
    /// Key of the list.
    pub list: &'static str,
    /// Key of the item's shape.
    pub shape_key: &'static str,
    /// The choice of shape that is a mesh.
    pub shape: &'static str,
    /// Key of the item's mesh file.
    pub file_key: &'static str,
}

/// How the stage that a phenomenon's parameters select is shown alone: by a camera in front of the phenomenon, which is at the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StageView {
    /// Width and height of what is shown, m. It is centered above the phenomenon's position.
    pub size_m: [f64; 2],
    /// Luminance that is shown as white, cd/m^2; `None` for automatic exposure.
    pub white_luminance: Option<f64>,
}
