//! What the studio knows of a kind of phenomenon besides its parameters. This is the one list of the studio that names kinds, besides the editors that are
//! made for one kind; without an entry, a phenomenon is edited by the descriptors of its parameters alone.
//!
//! Keys in sub-tables are separated by dots.

use bansho::{
    AuroraParameters, FlameParticlesParameters, FlameSheetParameters,
    base::tables::PhenomenonTable,
    fire::{
        particles::{GasModel, WindForce},
        sheet::SheetStage,
    },
};

/// Hints for the studio.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EditorHints {
    /// Upper limits of integer parameters in a draft, which is a preview that is faster to simulate than the scene.
    pub(crate) draft_limits: &'static [DraftLimit],
    /// Positions that can be dragged in the picture.
    pub(crate) position_handles: Option<PositionHandles>,
    /// What a mesh file becomes that is dropped on the scene.
    pub(crate) mesh_import: Option<MeshImport>,
    /// Its intermediate stages.
    pub(crate) stages: Option<Stages>,
    /// The scale of the wind for these parameters; `None` for a velocity, m/s.
    pub(crate) wind: Option<fn(&dyn PhenomenonTable) -> Option<WindScale>>,
}

/// A wind that bends a phenomenon strongly, but does not flatten it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct WindScale {
    /// Magnitude of `wind.velocity`.
    pub(crate) strong: f64,
    /// Its unit.
    pub(crate) unit: &'static str,
}

impl WindScale {
    /// Wind is the velocity of air.
    pub(crate) const VELOCITY: Self = Self { strong: 8.0, unit: "m/s" };
}

/// The upper limit of an integer parameter in a draft.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DraftLimit {
    /// Key of the parameter.
    pub(crate) key: &'static str,
    /// Its largest value in a draft.
    pub(crate) max: i64,
}

/// Positions that can be dragged: that of the phenomenon, and those of the items of a list.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PositionHandles {
    /// Key of the phenomenon's position, m.
    pub(crate) key: &'static str,
    /// Key of a list of tables. Each has a position under the same key, relative to the phenomenon's position. An empty list is equivalent to
    /// a list with one item that has default values.
    pub(crate) items: &'static str,
}

/// How a mesh file is added to a phenomenon: as an item of a list of tables.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeshImport {
    /// Key of the list.
    pub(crate) list: &'static str,
    /// Key of the item's shape.
    pub(crate) shape_key: &'static str,
    /// The choice of shape that is a mesh.
    pub(crate) shape: &'static str,
    /// Key of the item's mesh file.
    pub(crate) file_key: &'static str,
}

/// Intermediate stages of a phenomenon that can be shown alone.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stages {
    /// Key of the choice that shows a stage. Its default is the finished phenomenon.
    pub(crate) key: &'static str,
    /// How the stage that the parameters select is shown; `None` for parameters of another kind.
    pub(crate) view: fn(&dyn PhenomenonTable) -> Option<StageView>,
}

/// How a stage is shown alone: by a camera in front of the phenomenon, which is at the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StageView {
    /// Width and height of what is shown, m. It is centered above the phenomenon's position.
    pub(crate) size_m: [f64; 2],
    /// Luminance that is shown as white, cd/m^2; `None` for automatic exposure.
    pub(crate) white_luminance: Option<f64>,
}

const NONE: EditorHints =
    EditorHints { draft_limits: &[], position_handles: None, mesh_import: None, stages: None, wind: None };

const FLAME_SHEET: EditorHints = EditorHints {
    position_handles: Some(PositionHandles { key: "position", items: "instances" }),
    stages: Some(Stages { key: "stage", view: flame_sheet_stage }),
    ..NONE
};

const FLAME_PARTICLES: EditorHints = EditorHints {
    draft_limits: &[DraftLimit { key: "particles", max: 4_000 }],
    position_handles: Some(PositionHandles { key: "position", items: "burners" }),
    mesh_import: Some(MeshImport { list: "burners", shape_key: "shape", shape: "mesh", file_key: "file" }),
    wind: Some(flame_particles_wind),
    ..NONE
};

const AURORA: EditorHints = EditorHints { draft_limits: &[DraftLimit { key: "particles.count", max: 24_000 }], ..NONE };

/// The hints for the kind that is called `kind` in scene files.
pub(crate) fn editor_hints(kind: &str) -> &'static EditorHints {
    if kind == FlameSheetParameters::KIND.key {
        &FLAME_SHEET
    } else if kind == FlameParticlesParameters::KIND.key {
        &FLAME_PARTICLES
    } else if kind == AuroraParameters::KIND.key {
        &AURORA
    } else {
        &NONE
    }
}

fn flame_sheet_stage(parameters: &dyn PhenomenonTable) -> Option<StageView> {
    let sheet: &FlameSheetParameters = parameters.as_any().downcast_ref()?;
    // Before colors are assigned, gray levels are fractions of the highest luminance.
    let highest = sheet.color.luminance.bounds()[1].max(f64::MIN_POSITIVE);
    let is_gray = !matches!(sheet.stage, SheetStage::Colored | SheetStage::Flame);
    Some(StageView { size_m: [sheet.width, sheet.height], white_luminance: is_gray.then_some(highest) })
}

/// Inagaki et al. take the drag of the pointer as a force per volume.
fn flame_particles_wind(parameters: &dyn PhenomenonTable) -> Option<WindScale> {
    /// Half as much again as in the scenes of the paper's figures 9 and 10, N/m^3.
    const STRONG_FORCE: f64 = 0.1;
    let flame: &FlameParticlesParameters = parameters.as_any().downcast_ref()?;
    let is_force = flame.gas_model == GasModel::Euler || flame.forces.wind_model == WindForce::BodyForce;
    // The force is the wind times the response.
    (is_force && flame.forces.wind_response > 0.0)
        .then(|| WindScale { strong: STRONG_FORCE / flame.forces.wind_response, unit: "N/m^3" })
}

#[cfg(test)]
mod tests {
    use bansho::{
        base::parameters::{Choice, Kind},
        phenomena,
        scene::ValuePath,
    };

    use super::*;
    use crate::document::descriptors::{descriptor, within};

    #[test]
    fn editor_hints_name_parameters() {
        for kind in phenomena() {
            let hints = editor_hints(kind.key);
            let find = |key: &str| descriptor(&within(&ValuePath::root().key(kind.key), key));
            for limit in hints.draft_limits {
                assert!(find(limit.key).is_some_and(|own| matches!(own.kind, Kind::Integer { .. })), "{}", limit.key);
            }
            if let Some(PositionHandles { key, items }) = hints.position_handles {
                assert!(find(key).is_some() && find(&format!("{items}.{key}")).is_some(), "{key} of {items}");
            }
            if let Some(import) = hints.mesh_import {
                let shape = find(&format!("{}.{}", import.list, import.shape_key)).map(|own| &own.kind);
                let is_choice = |choices: &[Choice]| choices.iter().any(|choice| choice.name == import.shape);
                assert!(matches!(shape, Some(Kind::Choice(choices)) if is_choice(choices)), "{}", import.shape);
                assert!(find(&format!("{}.{}", import.list, import.file_key)).is_some(), "{}", import.file_key);
            }
            if let Some(Stages { key, .. }) = hints.stages {
                assert!(find(key).is_some_and(|own| matches!(own.kind, Kind::Choice(_))), "{key}");
            }
        }
    }
}
