//! A drag of the hand that blows: while it lasts the wind is what the hand says, and then what it was.

use bansho::{
    base::{math::DVec3, parameters::Value},
    render::scene::{Place, operation::Operation},
};

use super::pointer::rounded;
use crate::{app::widgets::keyframes, session::Session};

/// The wind before a drag began.
#[derive(Clone, Debug)]
pub(super) struct Blowing {
    calm: [f64; 3],
    recorded: bool,
    /// When it began, s.
    began: f64,
}

/// The name of the step in the history.
const LABEL: &str = "blow";

fn place() -> Place {
    Place::root().key("wind").key("velocity")
}

impl Blowing {
    /// Begins a drag. Where keyframes are recorded, time passes while it lasts.
    pub(super) fn begin(session: &mut Session) -> Self {
        let calm =
            keyframes::vector(session.document.values(), &place(), session.transport.time_s()).unwrap_or_default();
        let calm = calm.to_array();
        let blowing = Self { calm, recorded: session.recording, began: session.transport.time_s() };
        session.document.seal();
        if blowing.recorded {
            session.transport.play_to_the_end();
            blowing.key(session, calm);
        }
        blowing
    }

    /// The hand says `wind`, m/s, on top of what blows anyway.
    pub(super) fn blow(&self, session: &mut Session, wind: DVec3) {
        let velocity = rounded(DVec3::from(self.calm) + wind);
        if self.recorded {
            // The key of the calm before the drag stays, and so does what was recorded when the shot ends.
            if session.transport.time_s() != self.began && session.transport.is_playing() {
                self.key(session, velocity);
            }
        } else {
            session.edit(LABEL, &[Operation::Set { place: place(), value: Value::numbers(velocity) }]);
        }
    }

    /// The hand lets go: recorded wind calms down again, unrecorded wind never was.
    pub(super) fn end(self, session: &mut Session) {
        if self.recorded {
            if session.transport.is_playing() {
                self.key(session, self.calm);
            }
            session.transport.set_playing(false);
            session.document.seal();
        } else {
            session.document.abandon(LABEL);
        }
    }

    fn key(&self, session: &mut Session, velocity: [f64; 3]) {
        let key = session.keyframe(&place(), Value::numbers(velocity));
        session.edit(LABEL, &[key]);
    }
}
