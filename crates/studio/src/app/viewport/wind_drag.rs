//! A pointer drag that sets the wind: during the drag its vector is added to the wind, and afterwards the wind is as before.

use bansho::{
    base::{math::DVec3, parameters::Value},
    scene::{ValuePath, operation::Operation},
};

use crate::{
    document::{
        editor_hints::{WindScale, editor_hints},
        keyframes,
    },
    session::Session,
};

/// A wind drag, with the wind before it began.
#[derive(Clone, Debug)]
pub(super) struct WindDrag {
    base_velocity: [f64; 3],
    recording: bool,
    /// When it began, s.
    start_s: f64,
    /// Steps in a unit of the wind, to which it is rounded, so that files stay readable.
    steps_per_unit: f64,
}

/// The label of the undo step.
const LABEL: &str = "blow";

fn velocity_path() -> ValuePath {
    ValuePath::root().key("wind").key("velocity")
}

impl WindDrag {
    /// Begins a drag. While recording, the playback runs during the drag.
    pub(super) fn begin(session: &mut Session) -> Self {
        let base_velocity = keyframes::vector(session.document.values(), &velocity_path(), session.transport.time_s())
            .unwrap_or_default();
        let base_velocity = base_velocity.to_array();
        let wind_drag = Self {
            base_velocity,
            recording: session.recording,
            start_s: session.transport.time_s(),
            steps_per_unit: steps_per_unit(wind_scale(session)),
        };
        session.document.end_step();
        if wind_drag.recording {
            session.transport.play_to_the_end();
            wind_drag.set_keyframe(session, base_velocity);
        }
        wind_drag
    }

    /// Sets the wind to `wind`, in the unit of the scene's wind, on top of the wind before the drag.
    pub(super) fn update(&self, session: &mut Session, wind: DVec3) {
        let round = |speed: f64| (speed * self.steps_per_unit).round() / self.steps_per_unit;
        let velocity = (DVec3::from(self.base_velocity) + wind).to_array().map(round);
        if self.recording {
            // The keyframe at the start of the drag stays, and recording stops at the end of the shot.
            if session.transport.time_s() != self.start_s && session.transport.is_playing() {
                self.set_keyframe(session, velocity);
            }
        } else {
            session.edit(LABEL, &[Operation::Set { path: velocity_path(), value: Value::numbers(velocity) }]);
        }
    }

    /// Ends the drag: recorded wind returns to the wind before it; unrecorded wind is reset without an undo step.
    pub(super) fn end(self, session: &mut Session) {
        if self.recording {
            if session.transport.is_playing() {
                self.set_keyframe(session, self.base_velocity);
            }
            session.transport.set_playing(false);
            session.document.end_step();
        } else {
            session.document.discard_step(LABEL);
        }
    }

    fn set_keyframe(&self, session: &mut Session, velocity: [f64; 3]) {
        let operation = session.keyframe_operation(&velocity_path(), Value::numbers(velocity));
        session.edit(LABEL, &[operation]);
    }
}

/// The scale of the scene's wind: that of the first phenomenon for which it is not a velocity.
pub(in crate::app) fn wind_scale(session: &Session) -> WindScale {
    let scene = session.plan().map(|plan| plan.scene());
    let mut instances = scene.into_iter().flat_map(|scene| &scene.instances);
    let scale = instances.find_map(|instance| editor_hints(instance.kind.key).wind?(&*instance.parameters));
    scale.unwrap_or(WindScale::VELOCITY)
}

/// What the tool does, and how strongly.
pub(in crate::app) fn wind_hint(WindScale { strong, unit }: WindScale) -> String {
    format!(
        "Drag to set the wind to the direction and length of the drag; over the height of the viewport it is {strong} {unit}"
    )
}

/// Thousandths of a unit, and at least thousandths of a strong wind: a power of ten.
fn steps_per_unit(WindScale { strong, .. }: WindScale) -> f64 {
    let powers = std::iter::successors(Some(1e3), |steps| Some(10.0 * steps));
    powers.take(10).find(|steps| strong * steps >= 1e3).unwrap_or(1e12)
}
