//! An open effect: its time, its pictures, its data.

use std::{collections::BTreeMap, fmt, sync::Arc};

use bansho_base::{
    camera::CameraParameters, frame::Frame, geometry::point_cloud::PointCloud, host::observer::Observer,
    tables::PhenomenonTable,
};
use bansho_render::{PhenomenonLight, SceneLinear, Shot};

use super::{EffectError, Picture, Pool};

/// Longest time step, s: more is a mistake of the caller.
pub const MAX_ADVANCE_S: f64 = 86_400.0;
/// Largest time, s. In double precision a time of this size is still exact to a nanosecond.
const MAX_TIME_S: f64 = 4e6;

/// An effect that follows a program's time. It is `Send` and `Sync`; nothing in it reads a clock.
pub struct LiveEffect {
    pub(super) shot: Shot,
    pub(super) pool: Pool,
    /// Asked during work whether to stop.
    pub(super) observer: Arc<dyn Observer>,
    max_steps: u64,
    /// The picture of the current state; `None` before it is drawn, and after a change.
    frame: Option<Frame>,
    /// Time that the last call could not simulate, s.
    owed_s: f64,
    /// In a loop of simulations: their state at the beginning of the loop.
    loop_start_state: Option<Vec<u8>>,
    /// Number of changes of parameters so far.
    pub(super) revision: u64,
    /// Parameters that the program has set, by the name of the phenomenon, before they were made to continue earlier ones.
    pub(super) targets: BTreeMap<String, Arc<dyn PhenomenonTable>>,
}

impl fmt::Debug for LiveEffect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("LiveEffect").field("time", &self.time()).field("size", &self.size()).finish_non_exhaustive()
    }
}

impl LiveEffect {
    pub(super) fn new(shot: Shot, max_steps: u64, pool: Pool, observer: Arc<dyn Observer>) -> Self {
        Self {
            shot,
            pool,
            observer,
            max_steps,
            frame: None,
            owed_s: 0.0,
            loop_start_state: None,
            revision: 0,
            targets: BTreeMap::new(),
        }
    }

    /// Sets who is asked, at each step and strip of a picture, whether to stop. A call that is stopped returns [`RenderError::Cancelled`](bansho_render::RenderError::Cancelled)
    /// within [`EffectError::Render`]; the effect is then at the time that it had reached.
    pub fn set_observer(&mut self, observer: Arc<dyn Observer>) {
        self.observer = observer;
    }

    /// Time of the current picture, at which its shutter opens, s. It begins at 0; in a loop of simulations it is the time within the loop.
    pub fn time(&self) -> f64 {
        self.shot.time()
    }

    /// Width and height of the picture, pixels.
    pub fn size(&self) -> [usize; 2] {
        self.shot.plan().size()
    }

    /// Takes up to `max_steps` steps of the preroll and returns how many are left. Only needed after
    /// [`Effect::preroll_in_pieces`](super::Effect::preroll_in_pieces).
    ///
    /// # Errors
    /// None at present: nothing is read and nothing can stop it.
    pub fn preroll(&mut self, max_steps: u64) -> Result<u64, EffectError> {
        let time = self.time();
        let (shot, observer) = (&mut self.shot, self.observer.as_ref());
        self.pool.run(|| shot.advance_to(time, max_steps, observer))?;
        Ok(self.shot.preroll_steps_left())
    }

    /// Lets `dt` seconds pass and draws the picture. Simulations take at most [`max_steps`](super::Effect::max_steps) steps; the time that they could not
    /// simulate is [owed](Picture::owed_s), and the effect is at the time that they reached: pass what is owed with the next `dt` to catch up,
    /// or drop it.
    ///
    /// # Errors
    /// `dt` is not a number from 0 to [`MAX_ADVANCE_S`] (for effects without simulations from minus that), the preroll is not complete, or a picture
    /// of the plate cannot be read.
    pub fn advance(&mut self, dt: f64) -> Result<Picture<'_>, EffectError> {
        self.check_step(dt)?;
        let max_steps = self.max_steps;
        self.go_to(self.time() + dt, max_steps)?;
        self.picture()
    }

    /// As [`advance`](Self::advance), without drawing: for what is not seen, but whose [lights](Self::lights) are. Returns the time that is owed, s.
    ///
    /// # Errors
    /// As for [`advance`](Self::advance).
    pub fn advance_undrawn(&mut self, dt: f64) -> Result<f64, EffectError> {
        self.check_step(dt)?;
        let max_steps = self.max_steps;
        self.go_to(self.time() + dt, max_steps)?;
        Ok(self.owed_s)
    }

    /// Whether a time step is possible.
    fn check_step(&self, dt: f64) -> Result<(), EffectError> {
        let min = if self.is_simulated() { 0.0 } else { -MAX_ADVANCE_S };
        if (min..=MAX_ADVANCE_S).contains(&dt) {
            return Ok(());
        }
        Err(EffectError::Time { name: "dt", value: dt, min, max: MAX_ADVANCE_S })
    }

    /// Goes to `seconds` and draws the picture: that of `bansho render` at that time, to the bit, if nothing was changed live. Effects without simulations
    /// can go backward. Simulations take as many steps as it needs.
    ///
    /// # Errors
    /// The time is not a number within 46 days, is before the time that simulations have reached, the preroll is not complete, or a picture of
    /// the plate cannot be read.
    pub fn at(&mut self, seconds: f64) -> Result<Picture<'_>, EffectError> {
        self.go_to(seconds, u64::MAX)?;
        self.picture()
    }

    fn go_to(&mut self, time: f64, max_steps: u64) -> Result<(), EffectError> {
        if !(-MAX_TIME_S..=MAX_TIME_S).contains(&time) {
            return Err(EffectError::Time { name: "time", value: time, min: -MAX_TIME_S, max: MAX_TIME_S });
        }
        let steps = self.shot.preroll_steps_left();
        if steps > 0 {
            return Err(EffectError::Preroll { steps });
        }
        let loop_s = self.shot.plan().loop_s().filter(|_| self.is_simulated());
        let time = loop_s.map_or(time, |seconds| time.rem_euclid(seconds));
        if loop_s.is_some() {
            self.begin_loop_period(time)?;
        } else if self.is_simulated() && time < self.time() {
            return Err(EffectError::Backward { time, reached: self.time() });
        }
        if time == self.time() && self.owed_s == 0.0 && self.frame.is_some() {
            // The picture of this time is there already.
            return Ok(());
        }
        self.recycle();
        let (shot, observer) = (&mut self.shot, self.observer.as_ref());
        self.owed_s = self.pool.run(|| shot.advance_to(time, max_steps, observer))?;
        Ok(())
    }

    /// In a loop of simulations: begins the next period if `time` is before the time that was reached, from the state at the beginning of the loop.
    fn begin_loop_period(&mut self, time: f64) -> Result<(), EffectError> {
        if time >= self.time() {
            if self.loop_start_state.is_none() && self.time() == 0.0 {
                self.loop_start_state = Some(self.shot.snapshot());
            }
            return Ok(());
        }
        // After a change of parameters the state at the beginning is another.
        let is_restored = self.loop_start_state.take().filter(|state| self.shot.restore(state).is_ok());
        match is_restored {
            Some(state) => self.loop_start_state = Some(state),
            None => {
                let (shot, observer) = (&mut self.shot, self.observer.as_ref());
                self.pool.run(|| {
                    shot.restart();
                    shot.advance_to(0.0, u64::MAX, observer)
                })?;
                self.loop_start_state = Some(self.shot.snapshot());
            }
        }
        let (shot, observer) = (&mut self.shot, self.observer.as_ref());
        self.pool.run(|| shot.advance_to(0.0, u64::MAX, observer))?;
        Ok(())
    }

    /// The picture of the current state. It is drawn once, and again after changes.
    ///
    /// # Errors
    /// The preroll is not complete, or a picture of the plate cannot be read.
    pub fn picture(&mut self) -> Result<Picture<'_>, EffectError> {
        let steps = self.shot.preroll_steps_left();
        if steps > 0 {
            return Err(EffectError::Preroll { steps });
        }
        let frame = match self.frame.take() {
            Some(frame) => frame,
            None => {
                let (shot, observer) = (&mut self.shot, self.observer.as_ref());
                self.pool.run(|| shot.draw(&SceneLinear, observer))?
            }
        };
        let (time_s, owed_s) = (self.shot.time(), self.owed_s);
        Ok(Picture { frame: self.frame.insert(frame), time_s, owed_s, pool: &self.pool })
    }

    /// Gives the memory of the last picture to the next one.
    pub(super) fn recycle(&mut self) {
        if let Some(frame) = self.frame.take() {
            self.shot.recycle(frame);
        }
    }

    /// The current camera.
    pub fn camera(&self) -> &CameraParameters {
        &self.shot.plan().camera
    }

    /// The exposure value at ISO 100.
    pub fn exposure_ev100(&self) -> f64 {
        f64::from(self.shot.plan().exposure_ev100)
    }

    /// The mean wind at the current time, m/s, and its turbulence intensity.
    pub fn wind(&self) -> ([f64; 3], f64) {
        let wind = self.shot.wind();
        (wind.mean(self.time()).to_array(), wind.gust(self.time()))
    }

    /// Whether anything in it is simulated in steps. Everything else is computed for any time directly.
    pub fn is_simulated(&self) -> bool {
        self.shot.compiled().is_stepped()
    }

    /// Begins again at time 0 with the same random numbers, as opening it with the current parameters would: simulations run their preroll, and what was set
    /// live holds from the beginning, without the transitions of the past. The live wind is forgotten; set it again.
    ///
    /// # Errors
    /// Assets that cannot be read any more.
    pub fn restart(&mut self) -> Result<(), EffectError> {
        self.apply_targets_from_time_0()?;
        self.recycle();
        let (shot, observer) = (&mut self.shot, self.observer.as_ref());
        self.pool.run(|| {
            shot.restart();
            let start = shot.plan().time(shot.plan().frames().start);
            shot.advance_to(start, u64::MAX, observer)
        })?;
        self.owed_s = 0.0;
        Ok(())
    }

    /// The particles of its phenomena with their attributes, at the middle of the current exposure: see [`Shot::particles`].
    pub fn particles(&self) -> PointCloud {
        self.pool.run(|| self.shot.particles())
    }

    /// Time that the last call was asked for but simulations did not reach within their steps, s.
    pub fn owed_s(&self) -> f64 {
        self.owed_s
    }

    /// The lights with which its phenomena light others, at the middle of the current exposure: a few point lights along each flame, the light of an aurora.
    /// [`Light::merge_points`](crate::Light::merge_points) makes one of several points. Intensities are physical, not exposed. See [`Shot::lights`].
    pub fn lights(&self) -> Vec<PhenomenonLight> {
        self.pool.run(|| self.shot.lights())
    }

    /// The shot that is drawn, for what this interface does not offer.
    pub fn shot(&self) -> &Shot {
        &self.shot
    }
}
