//! Handles in the viewport: positions that can be dragged, of lamps, flames and their burners.

use bansho::{
    base::{
        math::DVec3,
        parameters::{Table, Value},
    },
    scene::{Segment, ValuePath},
};

use crate::{document::keyframes, session::Session};

/// A draggable position.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Handle {
    /// The parameter of the position.
    pub(super) place: ValuePath,
    /// The origin of its parameter, m.
    pub(super) origin: DVec3,
    /// Its position at the current time, m.
    pub(super) point: DVec3,
    /// Its label.
    pub(super) name: String,
}

/// Kinds of phenomena with a `position`, and their list of items with positions of their own. A list that is not stated implies one
/// item.
const POSITIONED_KINDS: [(&str, &str); 2] = [("flame_sheet", "instances"), ("flame_particles", "burners")];

/// Whether the list at `place` implies one default item where it is not stated.
pub(crate) fn implies_one_item(place: &ValuePath) -> bool {
    let [Segment::Key(kind), Segment::Index(_), Segment::Key(parts)] = place.segments() else { return false };
    POSITIONED_KINDS.contains(&(kind, parts))
}

/// All handles at the current time; while recording, those that can be animated.
pub(super) fn handles(session: &Session) -> Vec<Handle> {
    let mut handles = positioned_handles(session);
    if session.recording {
        handles.retain(|handle| keyframes::animatable(&handle.place));
    }
    handles
}

fn positioned_handles(session: &Session) -> Vec<Handle> {
    let Some(plan) = session.plan() else { return Vec::new() };
    let time = session.transport.time_s();
    let lights = plan.scene().lights.iter().enumerate().filter(|(_, light)| light.has_position());
    let mut handles: Vec<Handle> = lights
        .map(|(index, light)| Handle {
            place: ValuePath::root().key("light").index(index).key("position"),
            origin: DVec3::ZERO,
            point: DVec3::from(light.position.at(time)),
            name: format!("light {}", index + 1),
        })
        .collect();
    let root = session.document.values();
    for listed in session.document.phenomena() {
        let Some((_, parts)) = POSITIONED_KINDS.iter().find(|(kind, _)| *kind == listed.kind) else { continue };
        let origin = position(root, &listed.place(), time);
        let own = listed.place().key("position");
        handles.push(Handle { place: own, origin: DVec3::ZERO, point: origin, name: listed.name.clone() });
        let list = listed.place().key(parts);
        let count = match list.find(root).map(|node| &node.value) {
            Some(Value::List(items)) => items.len(),
            _ => 0,
        };
        // The implied item is at the position of the phenomenon; only while recording does it get a handle of its own.
        let unstated = usize::from(session.recording && count == 0);
        handles.extend((0..count + unstated).map(|index| Handle {
            place: list.index(index).key("position"),
            origin,
            point: origin + position(root, &list.index(index), time),
            name: format!("{} {parts} {}", listed.name, index + 1),
        }));
    }
    handles
}

/// The `position` of the table at `place`; the origin where it states none.
fn position(root: &Table, place: &ValuePath, time: f64) -> DVec3 {
    keyframes::vector(root, &place.key("position"), time).unwrap_or_default()
}
