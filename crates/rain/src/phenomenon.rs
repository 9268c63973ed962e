//! Rain as a phenomenon of a scene.

use std::{
    ops::RangeInclusive,
    sync::{Arc, LazyLock},
};

use bansho_base::{
    host::{
        constructions,
        observer::{Cancelled, Observer, check},
    },
    math::random::Key,
    parameters::parameter_error::{ParameterError, ParameterErrorKind},
    phenomenon::{
        Phenomenon, PhenomenonInfo, Prepared, Remark, Run,
        kind::{BuildContext, BuildError, Describe},
        strip::{DepthInterval, Shutter, View},
        surroundings::{Emitter, Light, OtherPhenomena, Publication, Surroundings},
    },
    world::wind::Wind,
};

use super::parameters::RainParameters;
use crate::{
    drops::{
        exposure::{DropClassState, ground_height},
        lattice::{Lattice, LatticeMotion},
        size_distribution::{DropSizeDistribution, SizeBin},
        terminal_velocity::{Air, TerminalVelocity},
    },
    lighting::{
        drop_lighting::ScatteringTable,
        drop_phase_function::DropPhaseFunction,
        extinction::{ExtinctionEfficiency, extinction},
        sky::SkyLightingCache,
    },
    render::prepared::{AOVS, PreparedRain},
};

/// How far it rains over ground that leads to the horizon, m.
const HORIZON: f64 = 2e4;

/// Rain, ready to be drawn at any time.
#[derive(Debug)]
pub struct Rain {
    name: String,
    pub(super) parameters: RainParameters,
    pub(super) key: Key,
    pub(super) optics: &'static Optics,
    pub(super) skies: SkyLightingCache,
    classes: Vec<Class>,
    pub(super) loop_s: Option<f64>,
}

/// How a drop sends light on: the same for all rain.
#[derive(Debug)]
pub(super) struct Optics {
    pub(super) lens: DropPhaseFunction,
    pub(super) scattering: ScatteringTable,
}

static OPTICS: LazyLock<Optics> = LazyLock::new(|| {
    let lens = DropPhaseFunction::new();
    Optics { scattering: ScatteringTable::new(&lens), lens }
});

/// The drops that one diameter stands for.
#[derive(Clone, Copy, Debug)]
struct Class {
    bin: SizeBin,
    /// Terminal velocity, m/s.
    speed: f64,
    /// Most drops a cubic meter in the shot.
    most: f64,
}

impl Rain {
    /// The rain `name` of a scene; in a seamless loop it repeats every `loop_s` seconds.
    ///
    /// # Errors
    /// Diameters that do not ascend, or a loop that is no length of time.
    pub fn new(parameters: RainParameters, name: &str, seed: u64, loop_s: Option<f64>) -> Result<Self, ParameterError> {
        if let Some(seconds) = loop_s.filter(|seconds| !(*seconds > 0.0 && seconds.is_finite())) {
            return Err(ParameterError { key: "loop", kind: ParameterErrorKind::LoopLength { seconds } });
        }
        if let Some(pair) = parameters.diameters_mm.windows(2).find(|pair| pair[1] <= pair[0]) {
            let kind = ParameterErrorKind::NotAscending { value: pair[0], next: pair[1] };
            return Err(ParameterError { key: "diameters_mm", kind });
        }
        constructions::count("rain");
        let velocity = TerminalVelocity { law: parameters.velocity, air: Air::default() };
        let [_, heaviest] = parameters.rate_mm_per_h.bounds();
        let sizes = DropSizeDistribution::marshall_palmer(heaviest);
        let class = |bin: SizeBin| Class { bin, speed: velocity.speed(bin.diameter_mm), most: bin.count(&sizes) };
        let classes = SizeBin::around(&parameters.diameters_mm).into_iter().map(class).collect();
        Ok(Self {
            name: name.to_owned(),
            key: Key::new(seed, name),
            optics: &OPTICS,
            skies: SkyLightingCache::default(),
            classes,
            loop_s,
            parameters,
        })
    }

    /// Its parameters.
    pub fn parameters(&self) -> &RainParameters {
        &self.parameters
    }

    /// Rain rate R at time `t`, mm/h. A loop ends with the rate that it begins with.
    pub(super) fn rate(&self, t: f64) -> f64 {
        self.parameters.rate_mm_per_h.at(self.loop_s.map_or(t, |seconds| t.rem_euclid(seconds)))
    }

    /// The drops of each diameter at time `t` between two `heights` (m) over the `ground`.
    pub(super) fn classes(
        &self,
        t: f64,
        wind: &Wind,
        ground: f64,
        heights: RangeInclusive<f64>,
    ) -> Vec<DropClassState> {
        let sizes = DropSizeDistribution::marshall_palmer(self.rate(t));
        let (response, loop_s) = (self.parameters.wind_response, self.loop_s);
        let now = |(index, class): (usize, &Class)| DropClassState {
            index,
            diameter_mm: class.bin.diameter_mm,
            speed: class.speed,
            max_density: class.most,
            fraction: if class.most > 0.0 { class.bin.count(&sizes) / class.most } else { 0.0 },
            lattice: Lattice::new(
                &LatticeMotion { speed: class.speed, wind, response, ground, loop_s },
                heights.clone(),
                t,
            ),
        };
        self.classes.iter().enumerate().map(now).collect()
    }

    /// No streak is further from the camera, m.
    pub(super) fn streaks_end(&self) -> f64 {
        (1.2 * self.parameters.distance).max(self.parameters.splashes.distance + 1.0)
    }

    /// How far from the camera there is any rain before a plate, m.
    pub(super) fn near_reach(&self) -> f64 {
        1.2 * self.parameters.distance + self.parameters.veil_distance
    }

    /// How far from the camera there is any rain, m: over ground that leads to the horizon as far as it.
    pub(super) fn reach(&self, surroundings: &Surroundings) -> f64 {
        let horizon = self.parameters.veil_distance > 0.0 && ground_height(&surroundings.others.occluders).is_some();
        if horizon { HORIZON.max(self.near_reach()) } else { self.near_reach() }
    }

    /// Extinction of all drops, and of those alone that are drawn as streaks, at time `t`, Q = 1, 1/m.
    pub(super) fn extinctions(&self, t: f64) -> [f64; 2] {
        let sizes = DropSizeDistribution::marshall_palmer(self.rate(t));
        let gain = self.parameters.opacity_gain;
        let disc = |class: &Class| 0.25e-6 * std::f64::consts::PI * class.bin.diameter_mm * class.bin.diameter_mm;
        let drawn: f64 = self.classes.iter().map(|class| class.bin.count(&sizes) * disc(class)).sum();
        let all = extinction(&sizes, ExtinctionEfficiency::Geometric, DropSizeDistribution::ALL);
        [gain * all.max(drawn), gain * drawn]
    }
}

impl Describe for RainParameters {
    const KEY: &'static str = "rain";
    const FIRST_KEYS: &'static [&'static str] = &["rate_mm_per_h", "distance", "veil_distance", "splashes.amount"];
    // Lamps at dusk along a wet street: drops only show the light of others.
    const SETTING: &'static str = "\
        camera = { position = [0.4, 1.3, 4.2], target = [0.0, 1.25, 0.0], vertical_fov_deg = 34.0 }\n\
        sky = { luminance = 0.12, temperature_k = 10000.0 }\n\
        ground = { wetness = 0.9, puddles = 0.4 }\n\
        light = [\
        { visible = true, position = [-1.3, 2.3, -1.5], intensity = 120.0, colour = [1.0, 0.68, 0.36] }, \
        { visible = true, position = [2.4, 2.3, -9.0], intensity = 120.0, colour = [1.0, 0.68, 0.36] }, \
        { visible = true, position = [-4.6, 2.3, -17.0], intensity = 120.0, colour = [1.0, 0.68, 0.36] }]\n";

    fn build(&self, context: &BuildContext) -> Result<Arc<dyn Phenomenon>, BuildError> {
        match Rain::new(self.clone(), context.name, context.seed, context.loop_s) {
            Ok(rain) => Ok(Arc::new(rain)),
            Err(fault) => Err(BuildError::new(fault.key, fault.kind)),
        }
    }
}

impl Phenomenon for Rain {
    fn info(&self) -> PhenomenonInfo<'_> {
        let strengthened_by = "raise `rate_mm_per_h` or `opacity_gain`, add a [[light]] of more candela";
        PhenomenonInfo { aovs: AOVS, strengthened_by, ..PhenomenonInfo::new(&self.name) }
    }

    /// Rain sends no light of its own.
    fn luminance(&self) -> f64 {
        0.0
    }

    fn remark(&self, neighbors: &OtherPhenomena) -> Option<Remark> {
        let dark = |light: &Light| light.intensity.iter().all(|value| *value <= 0.0);
        let unlit = neighbors.sky.is_dark() && neighbors.lights().all(dark);
        let message = "nothing lights it, so it is drawn black; a [[light]], a [sky] or a fire would";
        unlit.then(|| Remark { unless_lit_later: true, ..Remark::new(message) })
    }

    fn start(self: Arc<Self>) -> Box<dyn Run> {
        Box::new(self)
    }
}

impl Run for Rain {
    fn publish(&self, shutter: Shutter) -> Publication {
        Publication { extinction: self.extinctions(shutter.middle())[0], ..Publication::default() }
    }

    /// Rain fills all depths; it is cut where lights stand, so that a fire has streaks before, within and behind it.
    fn depth_intervals(&self, view: &View, surroundings: &Surroundings) -> Vec<DepthInterval> {
        const MOST: usize = 8;
        const CLOSEST: f64 = 0.05;
        let (near, far) = (view.camera.near, self.reach(surroundings));
        let depth = |light: &Light| match light.emitter {
            Emitter::Directional { .. } => None,
            Emitter::Point { position, .. } | Emitter::Spot { position, .. } => Some(view.camera.depth(position)),
        };
        let lights = surroundings.others.lights.iter().filter_map(depth);
        let mut edges: Vec<f64> = lights.filter(|depth| *depth > near && *depth < far).take(MOST).collect();
        edges.extend([near, far]);
        edges.sort_by(f64::total_cmp);
        edges.dedup_by(|next, last| *next - *last < CLOSEST);
        edges.windows(2).map(|pair| DepthInterval { near: pair[0], far: pair[1] }).collect()
    }

    fn prepare<'a>(
        &'a self,
        view: &'a View,
        surroundings: &'a Surroundings<'a>,
        observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        check(observer)?;
        Ok(Box::new(PreparedRain::new(self, view, surroundings)))
    }
}
