//! A luminous disk that moves in steps: it falls, illuminates others, and can refract light.

use std::sync::Arc;

use bansho_base::{
    frame::MetadataEntry,
    host::observer::{Cancelled, Observer},
    image::{Image, Rect},
    math::{
        DVec3,
        random::{Key, Purpose, uniform},
    },
    parameters::{BuildError, Range},
    phenomenon::{
        Deflection, Phenomenon, PhenomenonInfo, Prepared, Run, SnapshotError, Stepped, Stepping,
        strip::{DepthInterval, Shutter, Strip, View},
        surroundings::{Emitter as LightEmitter, Light, Publication, Surroundings},
    },
    tables::{BuildContext, PhenomenonTable, TableKind},
};

bansho_base::parameters! {
    /// A luminous disc that faces the camera.
    pub struct EmitterParameters {
        /// Where it begins.
        position: [f64; 3] = [0.0, 0.0, -2.0], unit("m");
        /// How fast it begins.
        velocity: [f64; 3] = [0.0, 0.0, 0.0], unit("m/s");
        /// How it accelerates.
        acceleration: [f64; 3] = [0.0, 0.0, 0.0], unit("m/s^2");
        /// Its radius.
        radius: f64 = 0.2, limits(Range::new(0.0, 100.0)), unit("m");
        /// Its luminance.
        luminance: f64 = 100.0, limits(Range::new(0.0, 1e6)), unit("cd/m^2");
        /// How strongly a random push shakes it every step.
        shake: f64 = 0.0, limits(Range::new(0.0, 10.0)), unit("m/s");
        /// Angle to the right by which it bends all that it covers, and as far again around.
        bend: f64 = 0.0, limits(Range::new(-1.0, 1.0)), unit("rad");
        /// Time it runs before the shot.
        preroll_s: f64 = 0.0, limits(Range::new(0.0, 100.0)), unit("s");
    }
}

impl EmitterParameters {
    /// The table `[[emitter]]`.
    pub(crate) const KIND: TableKind = TableKind::phenomenon::<Self>("emitter");
}

impl PhenomenonTable for EmitterParameters {
    fn kind(&self) -> TableKind {
        Self::KIND
    }

    fn build(&self, context: &BuildContext) -> Result<Arc<dyn Phenomenon>, BuildError> {
        let crossfade_s = context.loop_s.unwrap_or(0.0);
        let preroll_s = self.preroll_s + 0.5 * crossfade_s;
        Ok(Arc::new(Emitter {
            name: context.name.to_owned(),
            key: Key::new(context.seed, context.name),
            position: DVec3::from(self.position),
            velocity: DVec3::from(self.velocity),
            steps: 0,
            parameters: Self { preroll_s, ..self.clone() },
            crossfade_s,
        }))
    }
}

const STEP: f64 = 1.0 / 240.0;
const SHAKE: Purpose = Purpose(1);
/// Instants over which the shutter is averaged.
const INSTANTS: usize = 16;

#[derive(Clone)]
struct Emitter {
    name: String,
    key: Key,
    parameters: EmitterParameters,
    crossfade_s: f64,
    position: DVec3,
    velocity: DVec3,
    steps: u32,
}

impl Emitter {
    /// Where it is at time `t`, extrapolated from the last step.
    fn at(&self, t: f64) -> DVec3 {
        self.position + self.velocity * (t - (f64::from(self.steps) * STEP - self.parameters.preroll_s))
    }
}

impl Phenomenon for Emitter {
    fn info(&self) -> PhenomenonInfo<'_> {
        let stepping = Stepping { step: STEP, preroll: self.parameters.preroll_s, crossfade: self.crossfade_s };
        PhenomenonInfo { stepping: Some(stepping), ..PhenomenonInfo::new(&self.name) }
    }

    fn luminance(&self) -> f64 {
        self.parameters.luminance
    }

    fn start(self: Arc<Self>) -> Box<dyn Run> {
        Box::new((*self).clone())
    }
}

impl Stepped for Emitter {
    fn step(&mut self, _time: f64, _surroundings: &Surroundings) {
        let words = self.key.words(0, self.steps, SHAKE);
        let push = DVec3::new(0.0, f64::from(uniform(words[0])) - 0.5, 0.0) * self.parameters.shake;
        let acceleration = DVec3::from(self.parameters.acceleration);
        self.position += (self.velocity + push) * STEP + 0.5 * acceleration * STEP * STEP;
        self.velocity += acceleration * STEP;
        self.steps += 1;
    }

    fn snapshot(&self) -> Vec<u8> {
        let numbers = [self.position, self.velocity].into_iter().flat_map(|v| v.to_array());
        let mut bytes: Vec<u8> = numbers.flat_map(f64::to_le_bytes).collect();
        bytes.extend(self.steps.to_le_bytes());
        bytes
    }

    fn restore(&mut self, state: &[u8]) -> Result<(), SnapshotError> {
        if state.len() != 52 {
            return Err(SnapshotError::Damaged);
        }
        let number = |index: usize| f64::from_le_bytes(state[8 * index..8 * index + 8].try_into().unwrap());
        self.position = DVec3::new(number(0), number(1), number(2));
        self.velocity = DVec3::new(number(3), number(4), number(5));
        self.steps = u32::from_le_bytes(state[48..].try_into().unwrap());
        Ok(())
    }
}

impl Run for Emitter {
    fn as_stepped(&self) -> Option<&dyn Stepped> {
        Some(self)
    }

    fn as_stepped_mut(&mut self) -> Option<&mut dyn Stepped> {
        Some(self)
    }

    fn publish(&self, shutter: Shutter) -> Publication {
        let area = std::f64::consts::PI * self.parameters.radius * self.parameters.radius;
        let emitter = LightEmitter::Point { position: self.at(shutter.middle()), radius: self.parameters.radius };
        let intensity = [(self.parameters.luminance * area) as f32; 3];
        Publication { lights: vec![Light { emitter, intensity }], ..Publication::default() }
    }

    fn depth_intervals(&self, view: &View, _surroundings: &Surroundings) -> Vec<DepthInterval> {
        let depth = view.camera.depth(self.at(view.shutter.middle()));
        vec![DepthInterval { near: depth, far: depth * (1.0 + 1e-9) }]
    }

    fn prepare<'a>(
        &'a self,
        view: &'a View,
        _surroundings: &'a Surroundings<'a>,
        _observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        let angle = Image::filled(view.size[0], view.size[1], [0.0; 2]);
        let mut prepared = PreparedEmitter { emitter: self, view, angle };
        if self.parameters.bend != 0.0 {
            prepared.fill_angles();
        }
        Ok(Box::new(prepared))
    }
}

struct PreparedEmitter<'a> {
    emitter: &'a Emitter,
    view: &'a View,
    angle: Image<2>,
}

impl PreparedEmitter<'_> {
    /// How much of the exposure the disc, grown `growth` times, covers a pixel's middle.
    fn coverage(&self, x: usize, y: usize, growth: f64) -> f64 {
        let covered = |instant: &usize| {
            let t = self.view.shutter.instant(*instant, INSTANTS);
            let Some(seen) = self.view.camera_at(t).project(self.emitter.at(t)) else { return false };
            let offset = seen.pixel - bansho_base::math::DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
            offset.length() < self.emitter.parameters.radius * growth * seen.pixels_per_meter
        };
        (0..INSTANTS).filter(covered).count() as f64 / INSTANTS as f64
    }

    fn fill_angles(&mut self) {
        let [width, height] = self.view.size;
        for index in 0..width * height {
            let share = self.coverage(index % width, index / width, 2.0);
            self.angle.pixels_mut()[index] = [(self.emitter.parameters.bend * share) as f32, 0.0];
        }
    }
}

impl Prepared for PreparedEmitter<'_> {
    fn bounds(&self, _slice: &DepthInterval) -> Rect {
        Rect::from_size(self.view.size[0], self.view.size[1])
    }

    fn metadata(&self) -> Vec<MetadataEntry> {
        let depth = self.view.camera.depth(self.emitter.at(self.view.shutter.middle()));
        vec![MetadataEntry { name: "depth", unit: "m", value: depth }]
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        let depth = self.view.camera.depth(self.emitter.at(self.view.shutter.middle()));
        if !slice.contains(depth) {
            return;
        }
        for index in 0..strip.len() {
            let (x, y) = (strip.rect.x + index % strip.rect.width, strip.rect.y + index / strip.rect.width);
            let coverage = self.coverage(x, y, 1.0);
            if coverage > 0.0 && strip.visible(index, depth as f32) {
                strip.emit(index, [(self.emitter.parameters.luminance * coverage) as f32; 3], depth as f32);
            }
        }
    }

    fn deflection(&self) -> Option<Deflection<'_>> {
        let bends = self.emitter.parameters.bend != 0.0;
        bends.then(|| Deflection {
            depth: self.view.camera.depth(self.emitter.at(self.view.shutter.middle())),
            rect: Rect::from_size(self.view.size[0], self.view.size[1]),
            angle: &self.angle,
        })
    }
}
