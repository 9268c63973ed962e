//! Defaults that depend on the other values of a scene: the camera, backdrop and exposure of its phenomena.
//!
//! [`TableKind::scene_defaults`] describes a scene that shows a phenomenon of a kind well. If all phenomena of a scene are of one
//! kind, its values are the defaults for:
//!
//! - the camera, if the text states neither `camera.position` nor `camera.target`, nor the positions or sizes of the phenomena;
//! - shared tables that can be implied, if the text states neither that table nor one that prevents it ([`SharedRole::implied_unless`]): the sky, if it states
//!   neither a sky nor a light; the ground and the lights, if it states neither sky, ground nor light;
//! - the exposure, if all these tables are implied, and the text does not state the positions or sizes of the phenomena: elsewhere, they may be darker or
//!   brighter than in the scene that the kind describes.
//!
//! A scene with a plate or an obstacle has none of these defaults, since those determine camera and background ([`SharedRole::determines_view`]).
//!
//! [`SharedRole::implied_unless`]: bansho_base::tables::SharedRole::implied_unless
//! [`SharedRole::determines_view`]: bansho_base::tables::SharedRole::determines_view

use bansho_base::{
    parameters::{Node, Table, Value},
    tables::{self, TableKind},
};

use crate::text::toml;

/// `root` with the defaults for the values that its text omits, and which of its tables are implied.
pub(crate) fn with_defaults(root: &Table, kinds: &[TableKind]) -> (Table, Vec<&'static str>) {
    let mut completed = root.clone();
    let states_view = kinds
        .iter()
        .any(|kind| kind.shared_role().is_some_and(|role| role.determines_view) && root.get(kind.key).is_some());
    let implied = match only_kind(root, kinds) {
        Some(kind) if !has_plate(root) && !states_view => imply_setting(&mut completed, root, kind, kinds),
        _ => Vec::new(),
    };
    (completed, implied)
}

/// The kind of all phenomena, if they have the same.
fn only_kind<'a>(root: &Table, kinds: &'a [TableKind]) -> Option<&'a TableKind> {
    let mut stated = tables::phenomena(kinds).filter(|kind| root.get(kind.key).is_some());
    stated.next().filter(|_| stated.next().is_none())
}

/// Adds the shared tables, the exposure and the camera of the scene defaults where the text states nothing that contradicts them. Returns the keys of the
/// shared tables.
fn imply_setting(completed: &mut Table, root: &Table, kind: &TableKind, kinds: &[TableKind]) -> Vec<&'static str> {
    // A test checks that all settings can be parsed.
    let setting = toml::parse(kind.scene_defaults).unwrap_or_default();
    let (mut implied, mut in_setting) = (Vec::new(), 0);
    for shared in kinds {
        let Some(unless) = shared.shared_role().and_then(|role| role.implied_unless) else { continue };
        let Some(Node { value, .. }) = setting.get(shared.key) else { continue };
        in_setting += 1;
        if root.get(shared.key).is_none() && !unless.iter().any(|key| root.get(key).is_some()) {
            completed.push(shared.key, value.clone());
            implied.push(shared.key);
        }
    }
    if !states_placement(root, kind) {
        if let Some(exposure) = value_in(&setting, "picture", "exposure_ev100").filter(|_| implied.len() == in_setting)
        {
            imply(completed, "picture", "exposure_ev100", exposure.clone());
        }
        imply_camera(completed, root, &setting);
    }
    implied
}

/// Whether the text states the position or the size of a phenomenon.
fn states_placement(root: &Table, kind: &TableKind) -> bool {
    let Some(Value::List(items)) = root.get(kind.key).map(|node| &node.value) else { return false };
    items.iter().any(|item| match &item.value {
        Value::Table(table) => kind.placement_keys.iter().any(|key| table.get(key).is_some()),
        _ => false,
    })
}

/// Completes a perspective camera without position and target by those of the scene defaults.
fn imply_camera(completed: &mut Table, root: &Table, setting: &Table) {
    let is_placed = ["position", "target"].iter().any(|key| value_in(root, "camera", key).is_some());
    let is_perspective = value_in(root, "camera", "lens").is_none_or(|lens| *lens == Value::Text("perspective".into()));
    if is_placed || !is_perspective {
        return;
    }
    for key in ["position", "target", "vertical_fov_deg"] {
        // A focal length states the field of view.
        let is_free = key != "vertical_fov_deg" || value_in(root, "camera", "focal_length_mm").is_none();
        if let Some(value) = value_in(setting, "camera", key).filter(|_| is_free) {
            imply(completed, "camera", key, value.clone());
        }
    }
}

/// Adds `key` to a table unless the table states it. The table is created if it does not exist. A value that is not a table is unchanged, and
/// reported when it is read.
fn imply(root: &mut Table, table: &str, key: &str, value: Value) {
    if root.get(table).is_none() {
        root.push(table, Value::Table(Table::default()));
    }
    let entry = root.entries.iter_mut().find(|entry| entry.key == table);
    if let Some(Value::Table(table)) = entry.map(|entry| &mut entry.node.value)
        && table.get(key).is_none()
    {
        table.push(key, value);
    }
}

/// The value of a key of a table.
fn value_in<'a>(root: &'a Table, table: &str, key: &str) -> Option<&'a Value> {
    match &root.get(table)?.value {
        Value::Table(table) => Some(&table.get(key)?.value),
        _ => None,
    }
}

fn has_plate(root: &Table) -> bool {
    value_in(root, "plate", "image").is_some()
}
