//! Parameters of a light.

use bansho_base::{
    color::luminance,
    math::{self, DVec3},
    parameters::{Range, animated::Animated},
    phenomenon::{
        strip::Shutter,
        surroundings::{Emitter, Light},
    },
};

bansho_base::choice! {
    /// Kind of light.
    pub enum LightKind {
        /// Emits from a point in all directions.
        Point = "point",
        /// Emits from infinitely far away.
        Directional = "directional",
        /// Emits from a point within a cone.
        Spot = "spot",
    }
}

bansho_base::parameters! {
    /// A lamp, the moon or the sun. A scene with only rain that states neither sky, ground nor light is lit by three street lamps.
    pub struct LightParameters {
        /// Kind of light.
        kind: LightKind = LightKind::Point;
        /// Position (point and spot).
        position: Animated<[f64; 3]> = Animated::from([0.0, 3.0, 0.0]), unit("m");
        /// Direction of the emitted light (directional and spot).
        direction: Animated<[f64; 3]> = Animated::from([0.0, -1.0, 0.0]);
        /// Linear sRGB color; its luminance is scaled to `intensity`.
        color: [f64; 3] = [1.0, 0.9, 0.75], limits(Range::new(0.0, 1.0));
        /// Luminous intensity (candela) of points and spots, illuminance (lux) of directional lights.
        intensity: Animated<f64> = Animated::from(100.0), limits(Range::new(0.0, 1e9)), unit("cd or lx");
        /// Radius of the sphere that emits the light (point and spot).
        radius: f64 = 0.05, limits(Range::new(1e-4, 100.0)), unit("m");
        /// Whether the sphere itself is visible.
        visible: bool = false;
        /// Angle from the axis up to which a spot has full intensity; at most `outer_cone_deg`.
        inner_cone_deg: f64 = 15.0, limits(Range::new(0.0, 89.0)), unit("degrees");
        /// Angle from the axis beyond which a spot has no intensity.
        outer_cone_deg: f64 = 30.0, limits(Range::new(0.1, 90.0)), unit("degrees");
    }
}

/// How many steps it is along a path of a sphere, each so short that it shines on its surroundings in nearly the same way.
fn steps_of_path(from: DVec3, to: DVec3, radius: f64) -> f64 {
    /// Length of a step of a small sphere, m.
    const STEP_M: f64 = 0.05;
    (to - from).length() / STEP_M.max(0.5 * radius)
}

/// How many steps it is from one light to another that shine on their surroundings in nearly the same way.
fn steps_between(from: &Light, to: &Light) -> f64 {
    /// Angle of a step, radians, and its change of intensity relative to the larger one.
    const STEP_RADIANS: f64 = 0.01;
    const STEP_INTENSITY: f64 = 0.05;
    let [before, after] = [from, to].map(|light| f64::from(luminance(light.intensity)));
    let change = (after - before).abs() / before.max(after).max(f64::MIN_POSITIVE) / STEP_INTENSITY;
    let moved = match (from.emitter, to.emitter) {
        (Emitter::Point { position, radius }, Emitter::Point { position: end, .. }) => {
            steps_of_path(position, end, radius)
        }
        (Emitter::Spot { position, axis, .. }, Emitter::Spot { position: end, axis: turned, .. }) => {
            steps_of_path(position, end, 0.0) + (turned - axis).length() / STEP_RADIANS
        }
        (Emitter::Directional { toward }, Emitter::Directional { toward: turned }) => {
            (turned - toward).length() / STEP_RADIANS
        }
        _ => 0.0,
    };
    moved + change
}

impl LightParameters {
    /// Whether it has a direction.
    pub fn is_directed(&self) -> bool {
        self.kind != LightKind::Point
    }

    /// Whether the vector of its direction is not zero at any key.
    pub fn has_valid_direction(&self) -> bool {
        self.direction.values().into_iter().all(|direction| DVec3::from(direction).try_normalize().is_some())
    }

    /// Whether it has a position.
    pub fn has_position(&self) -> bool {
        self.kind != LightKind::Directional
    }

    /// The light at time `t`.
    pub fn at(&self, t: f64) -> Light {
        let position = DVec3::from(self.position.at(t));
        let direction = DVec3::from(self.direction.at(t)).try_normalize().unwrap_or(-DVec3::Y);
        let emitter = match self.kind {
            LightKind::Point => Emitter::Point { position, radius: self.radius },
            LightKind::Directional => Emitter::Directional { toward: -direction },
            LightKind::Spot => Emitter::Spot {
                position,
                axis: direction,
                cos_inner: math::cos(self.inner_cone_deg.min(self.outer_cone_deg).to_radians()),
                cos_outer: math::cos(self.outer_cone_deg.to_radians()),
            },
        };
        let color = bansho_base::color::acescg_from_srgb(self.color.map(|value| value as f32));
        let luminance = bansho_base::color::luminance(color).max(1e-6);
        let scale = self.intensity.at(t) as f32 / luminance;
        Light { emitter, intensity: color.map(|value| value * scale) }
    }

    /// Number of equal parts of an exposure, a power of two, in each of which it hardly moves or changes.
    pub fn parts_of_exposure(&self, shutter: Shutter) -> usize {
        /// Times at which a light is taken, a power of two.
        const SAMPLES: usize = 16;
        let is_constant = self.position.constant().is_some() && self.direction.constant().is_some();
        if shutter.duration() <= 0.0 || (is_constant && self.intensity.constant().is_some()) {
            return 1;
        }
        let samples: [Light; SAMPLES] = std::array::from_fn(|index| self.at(shutter.instant(index, SAMPLES)));
        let steps: f64 = samples.windows(2).map(|pair| steps_between(&pair[0], &pair[1])).sum();
        (steps.ceil().clamp(1.0, SAMPLES as f64) as usize).next_power_of_two()
    }
}
