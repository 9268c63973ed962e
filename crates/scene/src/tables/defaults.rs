//! Defaults that depend on the other values of a scene: the camera, backdrop and exposure of its phenomena.
//!
//! [`PhenomenonKind::setting`] describes a scene that shows a phenomenon of a kind well. If all phenomena of a scene are of one kind, its
//! values are the defaults for:
//!
//! - the camera, if the text states neither `camera.position` nor `camera.target`, nor the positions or sizes of the phenomena;
//! - the sky, if the text states neither a sky nor a light;
//! - the ground and the lights, if the text states neither sky, ground nor light;
//! - the exposure, if sky, ground and lights all have these defaults, and the text does not state the positions or sizes of the phenomena:
//!   elsewhere, they may be darker or brighter than in the setting.
//!
//! A scene with a plate or an obstacle has none of these defaults, since those determine camera and background. With any phenomena, the
//! default white balance of a night sky is that of a camera at night.

use bansho_base::parameters::{Node, Table, Value};

use crate::{PhenomenonKind, text::toml};

/// White balance of a camera at night, K.
const NIGHT_WHITE_K: f64 = 4000.0;

/// Which shared tables the text of a scene omits and its phenomena imply. They always light the scene; they are visible if
/// [`SceneOptions::implied_backdrop`](crate::SceneOptions::implied_backdrop) is set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ImpliedBackdrop {
    /// `[sky]`
    pub sky: bool,
    /// `[ground]`
    pub ground: bool,
    /// `[[light]]`
    pub lights: bool,
}

impl ImpliedBackdrop {
    /// Whether anything is implied.
    pub fn is_any(self) -> bool {
        self.sky || self.ground || self.lights
    }
}

/// `root` with the defaults for the values that its text omits, and which of its tables are implied.
pub(crate) fn with_defaults(root: &Table, kinds: &[PhenomenonKind]) -> (Table, ImpliedBackdrop) {
    let mut completed = root.clone();
    let implied = match only_kind(root, kinds) {
        Some(kind) if !has_plate(root) && root.get("obstacle").is_none() => imply_setting(&mut completed, root, kind),
        _ => ImpliedBackdrop::default(),
    };
    if is_night(&completed) {
        imply(&mut completed, "picture", "white_balance_k", Value::Number(NIGHT_WHITE_K));
    }
    (completed, implied)
}

/// The kind of all phenomena, if they have the same.
fn only_kind<'a>(root: &Table, kinds: &'a [PhenomenonKind]) -> Option<&'a PhenomenonKind> {
    let mut stated = kinds.iter().filter(|kind| root.get(kind.key).is_some());
    stated.next().filter(|_| stated.next().is_none())
}

/// Adds the backdrop, the exposure and the camera of the setting where the text states nothing that contradicts them.
fn imply_setting(completed: &mut Table, root: &Table, kind: &PhenomenonKind) -> ImpliedBackdrop {
    // A test checks that all settings can be parsed.
    let setting = toml::parse(kind.scene_defaults).unwrap_or_default();
    let states = |key: &str| root.get(key).is_some();
    let no_light = !states("sky") && !states("light");
    let has = |key: &str| setting.get(key).is_some();
    let setting_backdrop = ImpliedBackdrop { sky: has("sky"), ground: has("ground"), lights: has("light") };
    let implied = ImpliedBackdrop {
        sky: no_light && setting_backdrop.sky,
        ground: no_light && !states("ground") && setting_backdrop.ground,
        lights: no_light && !states("ground") && setting_backdrop.lights,
    };
    for (key, is_implied) in [("sky", implied.sky), ("ground", implied.ground), ("light", implied.lights)] {
        if let Some(Node { value, .. }) = setting.get(key).filter(|_| is_implied) {
            completed.push(key, value.clone());
        }
    }
    if !states_placement(root, kind) {
        if let Some(exposure) = value_in(&setting, "picture", "exposure_ev100").filter(|_| implied == setting_backdrop)
        {
            imply(completed, "picture", "exposure_ev100", exposure.clone());
        }
        imply_camera(completed, root, &setting);
    }
    implied
}

/// Whether the text states the position or the size of a phenomenon.
fn states_placement(root: &Table, kind: &PhenomenonKind) -> bool {
    let Some(Value::List(items)) = root.get(kind.key).map(|node| &node.value) else { return false };
    let states = |item: &Node| match &item.value {
        Value::Table(table) => kind.placement_keys.iter().any(|key| table.get(key).is_some()),
        _ => false,
    };
    items.iter().any(states)
}

/// Completes a perspective camera without position and target by those of the setting.
fn imply_camera(completed: &mut Table, root: &Table, setting: &Table) {
    let states = |key: &str| value_in(root, "camera", key).is_some();
    let is_perspective = value_in(root, "camera", "lens").is_none_or(|lens| *lens == Value::Text("perspective".into()));
    if states("position") || states("target") || !is_perspective {
        return;
    }
    for key in ["position", "target", "vertical_fov_deg"] {
        let is_free = key != "vertical_fov_deg" || !states("focal_length_mm");
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

fn is_night(root: &Table) -> bool {
    value_in(root, "sky", "kind").is_some_and(|kind| *kind == Value::Text("night".into()))
}
