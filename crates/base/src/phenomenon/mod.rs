//! The interface between phenomena (fire, rain, aurora, ...) and the renderer.

pub(crate) mod aov;
pub mod light_batch;
pub mod strip;
pub mod surroundings;

use std::{any::Any, fmt, sync::Arc};

use crate::{
    frame::MetadataEntry,
    geometry::point_cloud::PointCloud,
    host::observer::{Cancelled, Observer},
    image::{Image, Rect},
};
use strip::{AovDescriptor, DepthInterval, Shutter, Strip, View};
use surroundings::{OtherPhenomena, Publication, Surroundings};

/// Time steps of a stepped phenomenon: fixed in seconds, independent of frame rate, picture size and shutter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stepping {
    /// Length of a step, s.
    pub step: f64,
    /// Duration of the simulation before time 0, so that it starts fully developed, s.
    pub preroll: f64,
    /// In a loop: duration of the crossfade from one run to the next, s. The preroll is longer by half of that.
    pub crossfade: f64,
}

impl Stepping {
    /// Number of steps of the preroll.
    #[must_use]
    pub fn preroll_steps(&self) -> u64 {
        (self.preroll.max(0.0) / self.step).round() as u64
    }

    /// Time of the state after `taken` steps, s.
    #[must_use]
    pub fn time_after(&self, taken: u64) -> f64 {
        (taken as f64 - self.preroll_steps() as f64) * self.step
    }

    /// Number of steps to the last state not after time `t`, with a tolerance of a millionth of a step for rounding.
    #[must_use]
    pub fn steps_until(&self, t: f64) -> u64 {
        ((t / self.step + 1e-6).floor() + self.preroll_steps() as f64).max(0.0) as u64
    }

    /// Number of steps to the time at which `other` is after `taken` steps; `None` if there is no such step, or if step or crossfade differ.
    #[must_use]
    pub fn steps_for(&self, other: &Self, taken: u64) -> Option<u64> {
        let is_compatible = self.step == other.step && self.crossfade == other.crossfade;
        (taken + self.preroll_steps()).checked_sub(other.preroll_steps()).filter(|_| is_compatible)
    }
}

/// Why a snapshot cannot be restored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SnapshotError {
    /// Closed-form phenomena have no state.
    #[error("this phenomenon is not simulated, so it has no snapshot to restore")]
    NoState,
    /// The snapshot has another version.
    #[error("the snapshot is of version {found}; this program reads {known}")]
    Version {
        /// Version of the snapshot.
        found: u32,
        /// Version of this program.
        known: u32,
    },
    /// Its length is wrong, or its checksum does not match.
    #[error("the snapshot is damaged")]
    Damaged,
}

/// Memory that several phenomena share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SharedMemory {
    /// What it is: equal keys are the same memory.
    pub key: (&'static str, u64),
    /// Its size, bytes.
    pub bytes: f64,
}

/// A note for the user about how a phenomenon will look; it does not stop rendering.
#[derive(Clone, Debug, PartialEq)]
pub struct Remark {
    /// The parameter of the phenomenon's own table that it refers to, as in `shapes.1` (counting from 0); `None` for the phenomenon as a whole.
    pub key: Option<String>,
    /// The note, and what would change it.
    pub message: String,
    /// Whether it only holds while nothing else emits light: a simulated phenomenon may emit light later than in the frames that were examined.
    pub unless_lit_later: bool,
}

impl Remark {
    /// A remark about a phenomenon as a whole.
    #[must_use]
    pub fn new(message: impl Into<String>) -> Self {
        Self { key: None, message: message.into(), unless_lit_later: false }
    }

    /// A remark about the parameter `key` of the phenomenon's own table.
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

/// A horizontal mirror, such as wet ground or a lake.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelMirror {
    /// Its height, m.
    pub height: f64,
    /// Points that a plate shows within this height above or below the mirror belong to the mirror, m.
    pub plate_tolerance: f64,
    /// How rough it is.
    pub roughness: MirrorRoughness,
}

/// How rough a mirror is, which decides the resolution of the picture that is drawn for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MirrorRoughness {
    /// So rough that it reflects only the [backdrop](surroundings::Backdrop) and lights: it needs no picture.
    Rough,
    /// Puddles: sharp, unless drops fall into them.
    Puddles,
    /// Waves with an r.m.s. slope.
    Waves(f64),
}

impl MirrorRoughness {
    /// Side of a pixel of the mirror's picture in pixels of the view, whose camera has this focal length in pixels; `None` if it needs no picture.
    ///
    /// Waves of r.m.s. slope s blur the picture with a standard deviation of `2 s f` pixels; half of that need not be resolved. Rings of drops displace
    /// the picture by more than a pixel.
    #[must_use]
    pub fn pixel_size(&self, focal_pixels: f64, is_raining: bool) -> Option<usize> {
        match *self {
            Self::Rough => None,
            Self::Puddles => Some(if is_raining { 2 } else { 1 }),
            Self::Waves(slope) => Some(match 2.0 * slope * focal_pixels {
                blur if blur >= 8.0 => 4,
                blur if blur >= 4.0 => 2,
                _ => 1,
            }),
        }
    }
}

impl LevelMirror {
    /// The tolerance at a depth in m, at least the size of a pixel there: its resolution is `focal_pixels` pixels per unit of depth.
    #[must_use]
    pub fn tolerance_at(&self, depth: f64, focal_pixels: f64) -> f64 {
        self.plate_tolerance.max(depth / focal_pixels)
    }
}

/// Static properties of a phenomenon, known once it is built.
#[derive(Clone, Copy, Debug)]
pub struct PhenomenonInfo<'a> {
    /// Its name in the scene, also used for its layers.
    pub name: &'a str,
    /// The AOVs that it can output.
    pub aovs: &'static [AovDescriptor],
    /// Its time steps; `None` for a closed form, which can be drawn at any time.
    pub stepping: Option<Stepping>,
    /// The horizontal mirror, if it is one. It then receives a picture of everything else as seen in that mirror.
    pub mirror: Option<LevelMirror>,
    /// Whether it may refract the light from behind it.
    pub refracts: bool,
    /// How to make it stronger, as worded in a remark.
    pub strengthened_by: &'static str,
    /// Number of [`Publication::sky_lights`] with which it lights plates; 0 if it does not.
    pub sky_lights: usize,
}

impl<'a> PhenomenonInfo<'a> {
    /// A closed form without AOVs that is not a mirror.
    #[must_use]
    pub fn new(name: &'a str) -> Self {
        let strengthened_by = "make it larger or brighter";
        Self { name, aovs: &[], stepping: None, mirror: None, refracts: false, strengthened_by, sky_lights: 0 }
    }
}

/// One phenomenon of a scene, built once from its parameters and shared by all of its users: checks, remarks, exposure, shots.
///
/// State that changes from step to step is in a [`Run`]. Everything is a function of the parameters, the seed, the name and the time, independent of
/// threads, of frames drawn before and of the picture size.
pub trait Phenomenon: Send + Sync {
    /// Its static properties.
    fn info(&self) -> PhenomenonInfo<'_>;

    /// Luminance of its bright parts, cd/m^2, from which `exposure_ev100 = "auto"` is determined once per shot.
    fn luminance(&self) -> f64;

    /// What that luminance is at automatic exposure, relative to display white. The default is high enough that a core is nearly white, and low enough that its
    /// edges keep their color.
    fn exposed_luminance(&self) -> f64 {
        1.7
    }

    /// Memory of the phenomenon, a run of it and a prepared frame in which it covers `pixels` pixels, bytes, to a factor of one and a half: for the check before a
    /// job. What [`shared_memory`](Self::shared_memory) tells is left out.
    fn memory_bytes(&self, _pixels: f64) -> f64 {
        0.0
    }

    /// What it holds in memory together with other phenomena when a frame of `view` is prepared; counted once for each key.
    fn shared_memory(&self, _view: &View) -> Vec<SharedMemory> {
        Vec::new()
    }

    /// The part of the window of a view in which it is drawn, about, for estimates of memory; by default all of it.
    fn picture_bounds(&self, view: &View) -> Rect {
        view.window
    }

    /// A note for the user about how it will look among the other phenomena.
    fn remark(&self, _neighbors: &OtherPhenomena) -> Option<Remark> {
        None
    }

    /// A note for the user about how it will look in the picture of a view.
    fn view_remark(&self, _view: &View) -> Option<Remark> {
        None
    }

    /// Itself, for phenomena that give what they computed to their successor: see [`BuildContext::previous`](crate::tables::BuildContext::previous).
    fn as_any(&self) -> Option<&dyn Any> {
        None
    }

    /// A new run at its initial state, which for a stepped phenomenon is before the preroll. Nothing is built; any number of runs may exist at a time.
    fn start(self: Arc<Self>) -> Box<dyn Run>;
}

/// A phenomenon during a shot. A closed form can be drawn at any time, a stepped one at the time to which it was stepped.
pub trait Run: Send + Sync {
    /// What it publishes to the other phenomena for an exposure.
    fn publish(&self, shutter: Shutter) -> Publication;

    /// The depth intervals that it occupies, in any order. Slices are cut at their ends.
    fn depth_intervals(&self, view: &View, surroundings: &Surroundings) -> Vec<DepthInterval>;

    /// Number of equal parts of the exposure that are prepared one by one and drawn as their mean, because what moves in the picture would be sharp
    /// otherwise: `prepare` may show a part as it is in its middle. 1 if nothing moves by more than about a pixel, and for what `prepare` blurs itself.
    fn exposure_parts(&self, _view: &View, _surroundings: &Surroundings) -> usize {
        1
    }

    /// For what `prepare` blurs itself: number of equal parts of the exposure that are drawn apart where other things move over the same pixels, since things
    /// that cross the same pixels need not hide each other at any moment. 1 if nothing moves by more than about a pixel.
    fn parts_when_composited(&self, _view: &View, _surroundings: &Surroundings) -> usize {
        1
    }

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

    /// Prepares one of the [`parts_when_composited`](Self::parts_when_composited) as it is in the middle of `view.shutter`. There may be dozens, so each should
    /// take little time and memory; see [`Prepared::within`].
    ///
    /// # Errors
    /// The observer asked to stop.
    fn prepare_part<'a>(
        &'a self,
        view: &'a View,
        surroundings: &'a Surroundings<'a>,
        observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        self.prepare(view, surroundings, observer)
    }

    /// Its particles at the middle of the exposure `view.shutter`, for export; `None` if it never has any. What exists only around a camera, as drops of rain
    /// do, is exported as far as the view shows it; a simulation exports all of its particles.
    fn export_particles(&self, _view: &View, _surroundings: &Surroundings) -> Option<PointCloud> {
        None
    }

    /// Its state, if it is stepped.
    fn as_stepped(&self) -> Option<&dyn Stepped> {
        None
    }

    /// Its mutable state, if it is stepped.
    fn as_stepped_mut(&mut self) -> Option<&mut dyn Stepped> {
        None
    }
}

/// The run of a closed form is the phenomenon itself.
impl<P: Run + ?Sized> Run for Arc<P> {
    fn publish(&self, shutter: Shutter) -> Publication {
        (**self).publish(shutter)
    }

    fn depth_intervals(&self, view: &View, surroundings: &Surroundings) -> Vec<DepthInterval> {
        (**self).depth_intervals(view, surroundings)
    }

    fn exposure_parts(&self, view: &View, surroundings: &Surroundings) -> usize {
        (**self).exposure_parts(view, surroundings)
    }

    fn parts_when_composited(&self, view: &View, surroundings: &Surroundings) -> usize {
        (**self).parts_when_composited(view, surroundings)
    }

    fn prepare<'a>(
        &'a self,
        view: &'a View,
        surroundings: &'a Surroundings<'a>,
        observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        (**self).prepare(view, surroundings, observer)
    }

    fn prepare_part<'a>(
        &'a self,
        view: &'a View,
        surroundings: &'a Surroundings<'a>,
        observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        (**self).prepare_part(view, surroundings, observer)
    }

    fn export_particles(&self, view: &View, surroundings: &Surroundings) -> Option<PointCloud> {
        (**self).export_particles(view, surroundings)
    }

    fn as_stepped(&self) -> Option<&dyn Stepped> {
        (**self).as_stepped()
    }
}

/// The state of a simulated run, which advances in fixed steps.
pub trait Stepped: Send + Sync {
    /// Advances the state from `time` by one step.
    fn step(&mut self, time: f64, surroundings: &Surroundings);

    /// Time of the state from which an exposure is drawn: the run is stepped until then. Motion after that time while the shutter is open is
    /// computed by the run itself.
    fn time_for(&self, shutter: Shutter) -> f64 {
        shutter.middle()
    }

    /// Announces the exposure to whose time the run is stepped next, so that it keeps the earlier states from which it is drawn too.
    fn begin_exposure(&mut self, _shutter: Shutter) {}

    /// Whether all states from which an exposure is drawn are still to come, or are kept. Where not, the run starts again from its beginning: an
    /// exposure is the same whichever was drawn before, and from whichever snapshot the run went on.
    fn keeps_states_for(&self, _shutter: Shutter) -> bool {
        true
    }

    /// Serializes the state.
    fn snapshot(&self) -> Vec<u8>;

    /// Restores a state from [`snapshot`](Self::snapshot).
    ///
    /// # Errors
    /// The bytes are not a valid snapshot; the state is then unchanged.
    fn restore(&mut self, state: &[u8]) -> Result<(), SnapshotError>;
}

/// One frame of a phenomenon, prepared for drawing.
pub trait Prepared: Send + Sync {
    /// Bounding rectangle of the pixels that it can affect within a depth slice.
    fn bounds(&self, slice: &DepthInterval) -> Rect;

    /// Bounding rectangle of the pixels in which it is not the same during the whole exposure, of what is drawn in [parts](Run::exposure_parts).
    fn moving_bounds(&self) -> Rect {
        self.bounds(&DepthInterval::ALL)
    }

    /// It for the pixels of `rect` only, where parts of an exposure would take much memory as whole pictures: computed when these pixels are drawn. `None`
    /// if it is prepared for all pixels.
    fn within(&self, _rect: Rect) -> Option<Box<dyn Prepared + '_>> {
        None
    }

    /// Draws the contents of `slice` into `strip`, front to back, with motion blur over the exposure.
    ///
    /// The value of a pixel must not depend on the strip in which it is drawn.
    fn draw(&self, slice: &DepthInterval, strip: &mut Strip);

    /// Metadata of this frame, entries with unique names.
    fn metadata(&self) -> Vec<MetadataEntry> {
        Vec::new()
    }

    /// Whether it may refract light anywhere in the picture, including outside the window for which it was prepared.
    fn may_refract(&self) -> bool {
        self.deflection().is_some()
    }

    /// Its opaque surfaces. All other phenomena are hidden behind them exactly, as they are behind a plate. It draws them itself, as if they covered whole
    /// pixels.
    fn opaque_surfaces(&self) -> Option<&OpaqueSurfaces> {
        None
    }

    /// How it refracts the light from behind it.
    fn deflection(&self) -> Option<Deflection<'_>> {
        None
    }

    /// What it is to a plate.
    fn plate_role(&self) -> PlateRole {
        PlateRole::Before
    }
}

/// What a phenomenon is to a plate, which matters where the plate is transparent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PlateRole {
    /// It is before the plate, unless the plate's depth hides it; what the depth hides is seen through the plate's transparency.
    #[default]
    Before,
    /// It changes what the plate shows, as a film of water on the plate's own ground does: where the plate is transparent, so is it.
    Part,
    /// It is behind every plate, as the sky is, and seen only through the plate's transparency.
    Behind,
}

/// Opaque surfaces in a part of the picture that contains all of them, or in [the pixels](Prepared::within) for which they were computed.
#[derive(Clone, Debug)]
pub struct OpaqueSurfaces {
    /// The pixels of `depth` and `coverage`.
    pub rect: Rect,
    /// Depth beyond which they hide everything, m; infinite where there are none.
    pub depth: Image<1>,
    /// Fraction of a pixel that they cover. The rest of it shows the scene without them.
    pub coverage: Image<1>,
}

/// A field of small angles by which light from behind is deflected.
#[derive(Clone, Copy, Debug)]
pub struct Deflection<'a> {
    /// Depth of the deflection, m: slices that begin behind it are displaced.
    pub depth: f64,
    /// The pixels covered by the field.
    pub rect: Rect,
    /// Angles to the right and upward, radians.
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
