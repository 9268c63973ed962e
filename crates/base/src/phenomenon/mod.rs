//! What fire, rain, aurora and whatever comes next have in common for the renderer.

pub(crate) mod aov;
pub mod strip;
pub mod surroundings;

use crate::{
    geometry::point_cloud::PointCloud,
    host::observer::{Cancelled, Observer},
    image::{Figure, Image, Rect},
};
use strip::{AovDescriptor, DepthInterval, Shutter, Strip, View};
use surroundings::{Neighbours, Publication, Surroundings};

/// How a stepped phenomenon moves: in steps that are fixed in seconds, whatever the frame rate, size or shutter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stepping {
    /// Length of a step, s.
    pub step: f64,
    /// How long it runs before time 0, so that it begins developed, s.
    pub preroll: f64,
    /// In a loop: for how long one run of it passes into the next, s. The preroll is then longer by half of that.
    pub dissolve: f64,
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
        let alike = self.step == other.step && self.dissolve == other.dissolve;
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
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Remark {
    /// It only shows the light of others, and there is none.
    #[error("nothing lights it, so it is drawn black; a [[light]], a [sky] or a fire would")]
    Unlit,
    /// Sheets of an aurora meet on their way from shape to shape.
    #[error(
        "its sheets pass through each other on the way to shape {shape}; another shape between, `link`, or sheets in \
         another order would keep them apart"
    )]
    Crossing {
        /// The shape on whose way they first do, counted from 1.
        shape: usize,
    },
    /// A burner that lies within an obstacle.
    #[error("its burner {burner} lies within an obstacle, from which its gas cannot come out")]
    Buried {
        /// Which of its burners, counted from 1.
        burner: usize,
    },
    /// Nothing is ever given off.
    #[error("none of its burners gives gas; a `flow` above 0 would")]
    Unfed,
    /// A plate that does not say with which exposure it was taken.
    #[error(
        "with which exposure it was taken is not known; EV {ev100:.1} (at ISO 100) is assumed, so that its white is {white:.0} cd/m^2; \
         `exposure_ev100` in [plate] states it"
    )]
    PlateExposureAssumed {
        /// What is assumed.
        ev100: f64,
        /// Luminance of display white at it, cd/m^2.
        white: f64,
    },
    /// Something that changes the plate hardly.
    #[error(
        "it changes the picture by {percent:.1} %, which is hardly seen; to show it, {advice}, or lower `exposure_ev100` in [plate]"
    )]
    Faint {
        /// Mean change of the picture, beside its mean.
        percent: f64,
        /// What else would show it.
        advice: &'static str,
    },
}

impl Remark {
    /// The parameter of the phenomenon's own table that it speaks of, as in `shapes.1` (counting from 0); none where it is all of it.
    #[must_use]
    pub fn key(&self) -> Option<String> {
        match self {
            Self::Unlit | Self::Unfed | Self::PlateExposureAssumed { .. } | Self::Faint { .. } => None,
            Self::Buried { burner } => Some(format!("burners.{}", burner.saturating_sub(1))),
            Self::Crossing { shape } => Some(format!("shapes.{}", shape.saturating_sub(1))),
        }
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

/// One phenomenon of a scene, ready to be drawn at any time (closed form) or stepped there.
///
/// Everything is a function of the parameters, the seed, the name and the time: never of the threads, of the frames
/// drawn before, or of the size of the picture.
pub trait Phenomenon: Send + Sync {
    /// Its name in the scene, which also names its layers.
    fn name(&self) -> &str;

    /// The quantities it can write beside its light.
    fn aovs(&self) -> &'static [AovDescriptor];

    /// Luminance of its bright parts, cd/m^2, from which `exposure_ev100 = "auto"` is chosen once a shot.
    fn luminance(&self) -> f64;

    /// How it steps; `None` for a closed form, which is drawn at any time without steps.
    fn stepping(&self) -> Option<Stepping> {
        None
    }

    /// Steps from `time` to one step later. Closed forms do nothing.
    fn step(&mut self, _time: f64, _surroundings: &Surroundings) {}

    /// Time of the state that an exposure is drawn from: it is stepped until then. What happens after that while the shutter is open,
    /// it finds out itself.
    fn drawn_from(&self, shutter: Shutter) -> f64 {
        shutter.middle()
    }

    /// Its state; empty for a closed form.
    fn snapshot(&self) -> Vec<u8> {
        Vec::new()
    }

    /// Returns to a state that [`snapshot`](Self::snapshot) gave.
    ///
    /// # Errors
    /// The bytes are not such a state; the phenomenon is then unchanged.
    fn restore(&mut self, _state: &[u8]) -> Result<(), SnapshotError> {
        Err(SnapshotError::NoState)
    }

    /// Its particles at time `t`, while the shutter is open; `None` where it has none.
    fn particles(&self, _t: f64) -> Option<PointCloud> {
        None
    }

    /// What the others see of it while the shutter is open.
    fn publish(&self, shutter: Shutter) -> Publication;

    /// What a user should know of how it will look among others.
    fn remark(&self, _neighbours: &Neighbours) -> Option<Remark> {
        None
    }

    /// What to do to make it stronger, as a remark says it.
    fn strengthened_by(&self) -> &'static str {
        "make it larger or brighter"
    }

    /// The level mirror that it is. It then gets a picture of everything else seen in that mirror.
    fn mirror(&self) -> Option<LevelMirror> {
        None
    }

    /// The stretches of depth that it fills, in any order. Slices are cut at their ends.
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
        let stepping = Stepping { step: 0.1, preroll: 0.98, dissolve: 0.0 };
        assert_eq!(stepping.preroll_steps(), 10);
        assert_eq!((stepping.time_after(0), stepping.time_after(13)), (-1.0, 3.0 * 0.1));
        // 0.3 / 0.1 is a little less than 3 in floating point; before the preroll nothing has been stepped.
        assert_eq!([-9.0, -0.25, 0.0, 0.3, 0.39].map(|t| stepping.steps_until(t)), [0, 7, 10, 13, 13]);
        assert_eq!(Stepping { preroll: -5.0, ..stepping }.preroll_steps(), 0);
    }
}
