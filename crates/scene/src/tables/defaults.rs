//! What a scene has that its text does not state: the setting in which its phenomena are seen well.
//!
//! [`PhenomenonKind::setting`] says how a new scene of a kind shows it. Where all phenomena of a scene are of one kind, and nothing that the
//! text states contradicts it, that is the default:
//!
//! - its camera, where the text states neither `camera.position` nor `camera.target`, nor where the phenomena are or how large;
//! - its sky, where the text states neither a sky nor a light;
//! - its ground and lights where the text states neither sky, ground nor light;
//! - its exposure where all of its sky, ground and lights are the default, and the text states neither where the phenomena are nor how large:
//!   what is drawn elsewhere may be fainter or brighter than what the setting is exposed for.
//!
//! None of it holds with a plate or an obstacle, which say themselves where the camera stands and what is behind. Whatever the phenomena,
//! a night is balanced as a camera is set at night.

use bansho_base::parameters::{Node, Table, Value};

use crate::{PhenomenonKind, text::toml};

/// Temperature of the light that a camera is set to show as white at night, K.
const NIGHT_WHITE_K: f64 = 4000.0;

/// Which shared tables the text of a scene leaves out and its phenomena bring along. They light the scene; whether they are seen is said by
/// [`SceneOptions::implied_backdrop`](crate::SceneOptions::implied_backdrop).
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
    /// Whether there is any.
    pub fn is_any(self) -> bool {
        self.sky || self.ground || self.lights
    }
}

/// `root` with the values that its text leaves out, and which tables of it are a backdrop that nobody wrote.
pub(crate) fn complete(root: &Table, kinds: &[PhenomenonKind]) -> (Table, ImpliedBackdrop) {
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

/// The kind of all phenomena, if they are of one.
fn only_kind<'a>(root: &Table, kinds: &'a [PhenomenonKind]) -> Option<&'a PhenomenonKind> {
    let mut stated = kinds.iter().filter(|kind| root.get(kind.key).is_some());
    stated.next().filter(|_| stated.next().is_none())
}

fn imply_setting(completed: &mut Table, root: &Table, kind: &PhenomenonKind) -> ImpliedBackdrop {
    // A test holds that settings can be read.
    let setting = toml::parse(kind.scene_defaults).unwrap_or_default();
    let states = |key: &str| root.get(key).is_some();
    let sky = !states("sky") && !states("light");
    let has = |key: &str| setting.get(key).is_some();
    let whole = ImpliedBackdrop { sky: has("sky"), ground: has("ground"), lights: has("light") };
    let implied = ImpliedBackdrop {
        sky: sky && whole.sky,
        ground: sky && !states("ground") && whole.ground,
        lights: sky && !states("ground") && whole.lights,
    };
    for (key, is_implied) in [("sky", implied.sky), ("ground", implied.ground), ("light", implied.lights)] {
        if let Some(Node { value, .. }) = setting.get(key).filter(|_| is_implied) {
            completed.push(key, value.clone());
        }
    }
    if !is_placed(root, kind) {
        if let Some(exposure) = value_in(&setting, "picture", "exposure_ev100").filter(|_| implied == whole) {
            imply(completed, "picture", "exposure_ev100", exposure.clone());
        }
        imply_camera(completed, root, &setting);
    }
    implied
}

/// Whether the text states where a phenomenon is or how large.
fn is_placed(root: &Table, kind: &PhenomenonKind) -> bool {
    let Some(Value::List(items)) = root.get(kind.key).map(|node| &node.value) else { return false };
    let states = |item: &Node| match &item.value {
        Value::Table(table) => kind.placement_keys.iter().any(|key| table.get(key).is_some()),
        _ => false,
    };
    items.iter().any(states)
}

/// A perspective camera that is not told where it is stands where the phenomena are seen well.
fn imply_camera(completed: &mut Table, root: &Table, setting: &Table) {
    let told = |key: &str| value_in(root, "camera", key).is_some();
    let is_perspective = value_in(root, "camera", "lens").is_none_or(|lens| *lens == Value::Text("perspective".into()));
    if told("position") || told("target") || !is_perspective {
        return;
    }
    for key in ["position", "target", "vertical_fov_deg"] {
        let is_free = key != "vertical_fov_deg" || !told("focal_length_mm");
        if let Some(value) = value_in(setting, "camera", key).filter(|_| is_free) {
            imply(completed, "camera", key, value.clone());
        }
    }
}

/// Adds `key` to a table, which may not be there yet, unless the table states it. What is no table is left for its own fault to be found.
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
