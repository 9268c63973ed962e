//! What fire, rain, aurora and whatever comes next have in common for the renderer.

pub(crate) mod aov;
pub mod kind;
pub mod strip;
pub mod surroundings;

use std::{fmt, sync::Arc};

use crate::{
    geometry::point_cloud::PointCloud,
    host::observer::{Cancelled, Observer},
    image::{Figure, Image, Rect},
};
use strip::{AovDescriptor, DepthInterval, Shutter, Strip, View};
use surroundings::{OtherPhenomena, Publication, Surroundings};

/// How a stepped phenomenon moves: in steps that are fixed in seconds, whatever the frame rate, size or shutter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stepping {
    /// Length of a step, s.
    pub step: f64,
    /// How long it runs before time 0, so that it begins developed, s.
    pub preroll: f64,
    /// In a loop: for how long one run of it passes into the next, s. The preroll is then longer by half of that.
    pub crossfade: f64,
}

impl Stepping {
    /// Steps that make up the preroll.
    #[must_use]
    pub fn preroll_steps(&self) -> u64 {
        (self.preroll.max(0.0) / self.step).round() as u64
    }

    /// Time of the state after `taken` steps, s.
    #[must_use]
    pub fn time_after(&self, taken: u64) -> f64 {
        (taken as f64 - self.preroll_steps() as f64) * self.step
    }

    /// Steps after which the state is the last one not after time `t`. A millionth of a step forgives rounding.
    #[must_use]
    pub fn steps_until(&self, t: f64) -> u64 {
        ((t / self.step + 1e-6).floor() + self.preroll_steps() as f64).max(0.0) as u64
    }

    /// Steps that lead to the time at which `other` is after `taken`; none where no step does, or a loop passes otherwise into its next
    /// run.
    #[must_use]
    pub fn steps_for(&self, other: &Self, taken: u64) -> Option<u64> {
        let alike = self.step == other.step && self.crossfade == other.crossfade;
        (taken + self.preroll_steps()).checked_sub(other.preroll_steps()).filter(|_| alike)
    }
}

/// Why a snapshot cannot be restored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SnapshotError {
    /// Closed-form phenomena keep no state.
    #[error("the phenomenon keeps no state")]
    NoState,
    /// It is of another version of the state.
    #[error("the snapshot is of version {found}; this program reads {known}")]
    Version {
        /// The snapshot's.
        found: u32,
        /// This program's.
        known: u32,
    },
    /// It is shorter or longer than its contents say, or does not match its checksum.
    #[error("the snapshot is damaged")]
    Damaged,
}

/// What a user should know of how a phenomenon will look, and that stops nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct Remark {
    /// The parameter of the phenomenon's own table that it speaks of, as in `shapes.1` (counting from 0); none where it is all of it.
    pub key: Option<String>,
    /// What to know, and what would change it.
    pub message: String,
    /// Whether it only holds while nothing else shines: what is simulated may shine later than the frames that were looked at.
    pub unless_lit_later: bool,
}

impl Remark {
    /// A remark on a phenomenon as a whole.
    #[must_use]
    pub fn new(message: impl Into<String>) -> Self {
        Self { key: None, message: message.into(), unless_lit_later: false }
    }

    /// A remark on what stands at `key` in the phenomenon's own table.
    #[must_use]
    pub fn at(key: impl Into<String>, message: impl Into<String>) -> Self {
        Self { key: Some(key.into()), ..Self::new(message) }
    }
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

/// A level mirror, as wet ground and lakes are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelMirror {
    /// Its height, m.
    pub height: f64,
    /// How far above or below that height what a plate shows still is the mirror itself, m.
    pub plate_tolerance: f64,
}

impl LevelMirror {
    /// That tolerance at a depth in m where a pixel tells no less: one of `focal_pixels` to the unit of depth looks along the mirror.
    #[must_use]
    pub fn tolerance_at(&self, depth: f64, focal_pixels: f64) -> f64 {
        self.plate_tolerance.max(depth / focal_pixels)
    }
}

/// What is fixed when a phenomenon is built.
#[derive(Clone, Copy, Debug)]
pub struct PhenomenonInfo<'a> {
    /// Its name in the scene, which also names its layers.
    pub name: &'a str,
    /// The quantities it can write beside its light.
    pub aovs: &'static [AovDescriptor],
    /// How it steps; `None` for a closed form, which is drawn at any time without steps.
    pub stepping: Option<Stepping>,
    /// The level mirror that it is. It then gets a picture of everything else seen in that mirror.
    pub mirror: Option<LevelMirror>,
    /// What to do to make it stronger, as a remark says it.
    pub strengthened_by: &'static str,
}

impl<'a> PhenomenonInfo<'a> {
    /// A closed form without AOVs, which is no mirror.
    #[must_use]
    pub fn new(name: &'a str) -> Self {
        let strengthened_by = "make it larger or brighter";
        Self { name, aovs: &[], stepping: None, mirror: None, strengthened_by }
    }
}

/// One phenomenon of a scene, built once from its parameters and shared by all that looks at it: checks, remarks, exposure, shots.
///
/// What changes from step to step lives in a [`Run`]. Everything is a function of the parameters, the seed, the name and the time: never of
/// the threads, of the frames drawn before, or of the size of the picture.
pub trait Phenomenon: Send + Sync {
    /// What is fixed.
    fn info(&self) -> PhenomenonInfo<'_>;

    /// Luminance of its bright parts, cd/m^2, from which `exposure_ev100 = "auto"` is chosen once a shot.
    fn luminance(&self) -> f64;

    /// What a user should know of how it will look among others.
    fn remark(&self, _neighbors: &OtherPhenomena) -> Option<Remark> {
        None
    }

    /// A run of it, at its beginning: before the preroll of what is stepped. Takes no construction; any number of runs may live at once.
    fn start(self: Arc<Self>) -> Box<dyn Run>;
}

/// A phenomenon in the course of a shot: drawn at any time where it is a closed form, at the time that it was stepped to where it is not.
pub trait Run: Send + Sync {
    /// What the others see of it while the shutter is open.
    fn publish(&self, shutter: Shutter) -> Publication;

    /// The intervals of depth that it fills, in any order. Slices are cut at their ends.
    fn depth_intervals(&self, view: &View, surroundings: &Surroundings) -> Vec<DepthInterval>;

    /// Prepares one frame, so that strips of it can be drawn in any order by any thread.
    ///
    /// # Errors
    /// The observer asked to stop.
    fn prepare<'a>(
        &'a self,
        view: &'a View,
        surroundings: &'a Surroundings<'a>,
        observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled>;

    /// Its particles at time `t`, while the shutter is open, for exports; `None` where it has none.
    fn export(&self, _t: f64) -> Option<PointCloud> {
        None
    }

    /// Its state, where it is stepped.
    fn as_stepped(&self) -> Option<&dyn Stepped> {
        None
    }

    /// Its state to step, where it is stepped.
    fn as_stepped_mut(&mut self) -> Option<&mut dyn Stepped> {
        None
    }
}

/// Runs of a closed form are the phenomenon itself.
impl<P: Run + ?Sized> Run for Arc<P> {
    fn publish(&self, shutter: Shutter) -> Publication {
        (**self).publish(shutter)
    }

    fn depth_intervals(&self, view: &View, surroundings: &Surroundings) -> Vec<DepthInterval> {
        (**self).depth_intervals(view, surroundings)
    }

    fn prepare<'a>(
        &'a self,
        view: &'a View,
        surroundings: &'a Surroundings<'a>,
        observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        (**self).prepare(view, surroundings, observer)
    }

    fn export(&self, t: f64) -> Option<PointCloud> {
        (**self).export(t)
    }

    fn as_stepped(&self) -> Option<&dyn Stepped> {
        (**self).as_stepped()
    }
}

/// What a run that is simulated adds: a state that moves in fixed steps.
pub trait Stepped: Send + Sync {
    /// Steps from `time` to one step later.
    fn step(&mut self, time: f64, surroundings: &Surroundings);

    /// Time of the state that an exposure is drawn from: it is stepped until then. What happens after that while the shutter is open,
    /// it finds out itself.
    fn time_for(&self, shutter: Shutter) -> f64 {
        shutter.middle()
    }

    /// Its state.
    fn snapshot(&self) -> Vec<u8>;

    /// Returns to a state that [`snapshot`](Self::snapshot) gave.
    ///
    /// # Errors
    /// The bytes are not such a state; it is then unchanged.
    fn restore(&mut self, state: &[u8]) -> Result<(), SnapshotError>;
}

/// One frame of a phenomenon, ready to draw.
pub trait Prepared: Send + Sync {
    /// The pixels that it can touch within a slice of depth.
    fn bounds(&self, slice: &DepthInterval) -> Rect;

    /// Draws what lies in `slice` into `strip`, nearest first, blurred over the shutter.
    ///
    /// Must give each pixel the same value whatever strip it comes in.
    fn draw(&self, slice: &DepthInterval, strip: &mut Strip);

    /// Numbers that this frame is known by, each name once.
    fn figures(&self) -> Vec<Figure> {
        Vec::new()
    }

    /// Whether it may bend light anywhere in the picture, also where the window that it was prepared for does not show it.
    fn may_bend(&self) -> bool {
        self.deflection().is_some()
    }

    /// How it bends the light of what lies behind it.
    fn deflection(&self) -> Option<Deflection<'_>> {
        None
    }
}

/// A field of small angles that displaces what lies behind it.
#[derive(Clone, Copy, Debug)]
pub struct Deflection<'a> {
    /// Depth at which the light is bent, m: what begins behind it is bent.
    pub depth: f64,
    /// The pixels that the field covers.
    pub rect: Rect,
    /// Angle to the right and upward, radians.
    pub angle: &'a Image<2>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_count_from_the_beginning_of_the_preroll() {
        let stepping = Stepping { step: 0.1, preroll: 0.98, crossfade: 0.0 };
        assert_eq!(stepping.preroll_steps(), 10);
        assert_eq!((stepping.time_after(0), stepping.time_after(13)), (-1.0, 3.0 * 0.1));
        // 0.3 / 0.1 is a little less than 3 in floating point; before the preroll nothing has been stepped.
        assert_eq!([-9.0, -0.25, 0.0, 0.3, 0.39].map(|t| stepping.steps_until(t)), [0, 7, 10, 13, 13]);
        assert_eq!(Stepping { preroll: -5.0, ..stepping }.preroll_steps(), 0);
    }
}
