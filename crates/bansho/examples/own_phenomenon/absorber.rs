//! A slab of fog before the camera: Beer's law, and light scattered toward the camera.
//!
//! The smallest complete phenomenon. Its parts, in the order of their use:
//!
//! 1. **Parameters** ([`AbsorberParameters`]): the table of keys with defaults, limits and units. Reading, checking, error messages, the
//!    schema and `--set` derive from it.
//! 2. **[`TableKind`]** and **[`PhenomenonTable`]**: the key of the table in scene files, and [`PhenomenonTable::build`], which makes the phenomenon and
//!    reports parameters that contradict each other, each by its key.
//! 3. **[`Phenomenon`]**: built once, immutable and shared. It states its name and AOVs and the luminance for automatic exposure, and starts
//!    runs. Here nothing changes over time, so a run is the phenomenon itself. A simulated phenomenon returns a state of its own, which also
//!    implements `Stepped`.
//! 4. **[`Run`]**: what it publishes to other phenomena ([`Publication`]: lights, extinction, obstacles), its depth intervals, and `prepare` for a
//!    frame.
//! 5. **[`Prepared`]**: draws strips of pixels, in any order, on any thread. The value of a pixel must not depend on its strip.
//!
//! Random numbers come from `base::math::random::Key`, which is made from seed and name, and not from a mutable state: the same scene then
//! gives the same bytes with any number of threads.

use std::sync::Arc;

use bansho::base::{
    host::observer::{Cancelled, Observer},
    image::Rect,
    math::{self, DVec2},
    parameters::{BuildError, ProblemKind, Range},
    phenomenon::{
        Phenomenon, PhenomenonInfo, Prepared, Run,
        strip::{AovDescriptor, AovRule, DepthInterval, Shutter, Strip, View},
        surroundings::{Publication, Surroundings},
    },
    tables::{BuildContext, PhenomenonTable, TableKind},
};

bansho::base::parameters! {
    /// A slab of fog across the whole picture.
    pub struct AbsorberParameters {
        /// Distance of its front.
        near: f64 = 1.0, limits(Range::new(0.01, 1000.0)), unit("m");
        /// Distance of its back.
        far: f64 = 3.0, limits(Range::new(0.02, 1000.0)), unit("m");
        /// Extinction of red, green and blue.
        extinction: [f64; 3] = [0.5, 0.5, 0.5], limits(Range::new(0.0, 100.0)), unit("1/m");
        /// Fraction of the incident light that is scattered toward the camera, for each unit of optical depth.
        scatter: f64 = 0.0, limits(Range::new(0.0, 1.0));
    }
}

impl AbsorberParameters {
    /// The table `[[absorber]]`.
    pub(crate) const KIND: TableKind = TableKind::phenomenon::<Self>("absorber");
}

impl PhenomenonTable for AbsorberParameters {
    fn kind(&self) -> TableKind {
        Self::KIND
    }

    fn build(&self, context: &BuildContext) -> Result<Arc<dyn Phenomenon>, BuildError> {
        if self.far <= self.near {
            let kind = ProblemKind::Conflict("must lie behind `near`".into());
            return Err(BuildError { key: "far".into(), kind });
        }
        Ok(Arc::new(Absorber { name: context.name.to_owned(), parameters: self.clone() }))
    }
}

struct Absorber {
    name: String,
    parameters: AbsorberParameters,
}

const AOVS: [AovDescriptor; 1] = [AovDescriptor {
    name: "optical_depth",
    unit: "",
    doc: "Green optical depth; 0 where there is none.",
    rule: AovRule::Sum,
}];

impl Phenomenon for Absorber {
    fn info(&self) -> PhenomenonInfo<'_> {
        PhenomenonInfo { aovs: &AOVS, ..PhenomenonInfo::new(&self.name) }
    }

    fn luminance(&self) -> f64 {
        0.0
    }

    fn start(self: Arc<Self>) -> Box<dyn Run> {
        Box::new(self)
    }
}

impl Run for Absorber {
    fn publish(&self, _shutter: Shutter) -> Publication {
        Publication { extinction: self.parameters.extinction[1], ..Publication::default() }
    }

    fn depth_intervals(&self, _view: &View, _surroundings: &Surroundings) -> Vec<DepthInterval> {
        vec![DepthInterval { near: self.parameters.near, far: self.parameters.far }]
    }

    fn prepare<'a>(
        &'a self,
        view: &'a View,
        surroundings: &'a Surroundings<'a>,
        _observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        Ok(Box::new(PreparedAbsorber { absorber: self, view, surroundings }))
    }
}

struct PreparedAbsorber<'a> {
    absorber: &'a Absorber,
    view: &'a View,
    surroundings: &'a Surroundings<'a>,
}

impl Prepared for PreparedAbsorber<'_> {
    fn bounds(&self, _slice: &DepthInterval) -> Rect {
        Rect::from_size(self.view.size[0], self.view.size[1])
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        let AbsorberParameters { near, far, extinction, scatter } = &self.absorber.parameters;
        let near = near.max(slice.near);
        let camera = &self.view.camera;
        for index in 0..strip.len() {
            let (x, y) = (strip.rect.x + index % strip.rect.width, strip.rect.y + index / strip.rect.width);
            let Some(direction) = camera.direction(DVec2::new(x as f64 + 0.5, y as f64 + 0.5)) else { continue };
            let far = far.min(slice.far).min(f64::from(strip.plate_depth(index)));
            let thickness = (far - near).max(0.0);
            let middle = camera.position + direction * (near + 0.5 * thickness);
            let mut light = [0.0; 3];
            for source in &self.surroundings.others.lights {
                let (illuminance, _) = source.illuminance(middle);
                (0..3).for_each(|c| {
                    light[c] += illuminance[c] * (scatter * extinction[c] * thickness) as f32;
                });
            }
            let transmittance = extinction.map(|extinction| math::exp(-extinction * thickness) as f32);
            strip.add_behind(index, light, transmittance, near as f32);
            if let Some(plane) = strip.aovs.first_mut() {
                plane.add(index, (extinction[1] * thickness) as f32, 1.0);
            }
        }
    }
}
