//! Handles in the viewport: positions that can be dragged, of lamps, flames and their burners.

use bansho::{
    LightParameters,
    base::{
        math::DVec3,
        parameters::{Table, Value},
    },
    scene::ValuePath,
};

use crate::{
    document::{editor_hints::editor_hints, keyframes},
    session::Session,
};

/// A draggable position.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Handle {
    /// The path of the position's parameter.
    pub(super) path: ValuePath,
    /// The origin of its parameter, m.
    pub(super) origin: DVec3,
    /// Its position at the current time, m.
    pub(super) point: DVec3,
    /// Its label.
    pub(super) name: String,
}

/// All handles at the current time; while recording, those that can be animated.
pub(super) fn handles(session: &Session) -> Vec<Handle> {
    let mut handles = positioned_handles(session);
    if session.recording {
        handles.retain(|handle| keyframes::animatable(&handle.path));
    }
    handles
}

fn positioned_handles(session: &Session) -> Vec<Handle> {
    let Some(plan) = session.plan() else { return Vec::new() };
    let time = session.transport.time_s();
    let lights = plan.scene().tables.all::<LightParameters>().enumerate().filter(|(_, light)| light.has_position());
    let mut handles: Vec<Handle> = lights
        .map(|(index, light)| Handle {
            path: ValuePath::root().key("light").index(index).key("position"),
            origin: DVec3::ZERO,
            point: DVec3::from(light.position.at(time)),
            name: format!("light {}", index + 1),
        })
        .collect();
    let root = session.document.values();
    for entry in session.document.phenomena() {
        let Some(hints) = editor_hints(entry.id.kind).position_handles else { continue };
        let own = entry.id.path().key(hints.key);
        let origin = position(root, &own, time);
        handles.push(Handle { path: own, origin: DVec3::ZERO, point: origin, name: entry.name.clone() });
        let items = hints.items;
        let list = entry.id.path().key(items);
        let count = match list.find(root).map(|node| &node.value) {
            Some(Value::List(items)) => items.len(),
            _ => 0,
        };
        // The implied item is at the position of the phenomenon. It has a handle of its own only while recording.
        let unstated = usize::from(session.recording && count == 0);
        handles.extend((0..count + unstated).map(|index| {
            let own = list.index(index).key(hints.key);
            let point = origin + position(root, &own, time);
            Handle { path: own, origin, point, name: format!("{} {items} {}", entry.name, index + 1) }
        }));
    }
    handles
}

/// The position at `path`; the origin where the scene states none.
fn position(root: &Table, path: &ValuePath, time: f64) -> DVec3 {
    keyframes::vector(root, path, time).unwrap_or_default()
}
