//! Sparks in closed form: each is a function of its index and the time, so that any frame can be rendered alone.

mod streak;

use bansho_base::{
    color,
    math::{
        self, DVec2, DVec3,
        random::{Key, Purpose},
    },
    parameters::{Range, animated::Animated},
    phenomenon::strip::{DepthInterval, Shutter, View},
    world::wind::Wind,
};

pub(crate) use streak::SparkStreak;

const FRACTION: Range = Range::new(0.0, 1.0);

bansho_base::parameters! {
    /// Glowing sparks that rise from the fire.
    pub struct SparkParameters {
        /// Number per second and flame; 0 for none.
        rate: f64 = 0.0, limits(Range::new(0.0, 1_000.0)), unit("1/s");
        /// Initial speed, upward.
        speed: f64 = 2.2, limits(Range::new(0.0, 100.0)), unit("m/s");
        /// Variation of the speed between sparks, as a fraction: speeds are between `1 - speed_variation` and `1 + speed_variation` times `speed`.
        speed_variation: f64 = 0.5, limits(FRACTION);
        /// Horizontal amplitude of their swirl.
        swirl: f64 = 0.12, limits(Range::new(0.0, 100.0)), unit("m");
        /// Maximum time for which they glow.
        lifetime_s: f64 = 1.8, limits(Range::new(0.05, 20.0)), unit("s");
        /// Diameter.
        diameter: f64 = 0.004, limits(Range::new(1e-5, 1.0)), unit("m");
        /// Initial temperature; they cool to 900 K.
        temperature_k: f64 = 1750.0, limits(Range::new(900.0, 4000.0)), unit("K");
    }
}

/// Temperature at which a spark no longer glows, K.
const EXTINCTION_TEMPERATURE_K: f64 = 900.0;

/// The random properties of one spark.
struct Spark {
    /// Age, s.
    age: f64,
    /// Time for which it glows, s.
    lifetime_s: f64,
    /// Initial position relative to the base, in widths and heights of the fire.
    start: DVec3,
    /// Initial speed, m/s.
    speed: f64,
    /// Phases of its swirl, turns.
    phases: [f64; 2],
    /// Turns of its swirl per second.
    turns: f64,
}

/// The upright plane of a flame sheet, which hides the sparks behind it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SheetPlane {
    /// A point of the plane, m.
    pub(crate) point: DVec3,
    /// Its horizontal normal toward the camera.
    pub(crate) normal: DVec3,
    /// Depth at which the whole sheet is drawn, m.
    pub(crate) depth: f64,
}

impl SheetPlane {
    /// The depth at which a spark is sorted, m: on the same side of the sheet's single depth as the spark is of the plane.
    ///
    /// The depths of an upright plane change along it where the camera looks up or down, so that a spark before its upper part may have a greater depth than
    /// the sheet's middle.
    fn sorting_depth(&self, position: DVec3, depth: f64) -> f64 {
        if (position - self.point).dot(self.normal) > 0.0 {
            depth.min(self.depth.next_down())
        } else {
            depth.max(self.depth.next_up())
        }
    }
}

/// Emitter of a fire's sparks during one exposure.
pub(crate) struct SparkEmitter<'a> {
    pub(crate) parameters: &'a SparkParameters,
    pub(crate) key: Key,
    /// The fire's own time at the middle of the exposure, s; periodic in a loop.
    pub(crate) now: f64,
    pub(crate) loop_s: Option<f64>,
    /// Gas flow over the time of the scene, as a fraction of full flow: the fraction of sparks that start.
    pub(crate) flow: Option<&'a Animated<f64>>,
    /// How far the fire's own time is ahead of that of the scene, s.
    pub(crate) phase_s: f64,
    /// Center of its base, m.
    pub(crate) base: DVec3,
    /// Width and height, m.
    pub(crate) size: DVec2,
    /// Size of sparks relative to the parameter.
    pub(crate) scale: f64,
    /// Sensitivity to the wind.
    pub(crate) wind_response: f64,
    /// The sheet among whose sparks these are; `None` for other fires.
    pub(crate) sheet: Option<SheetPlane>,
}

impl SparkEmitter<'_> {
    /// Streaks of the sparks that are visible in the exposure.
    pub(crate) fn streaks(&self, view: &View, wind: &Wind) -> Vec<SparkStreak> {
        let sparks = self.parameters;
        if sparks.rate <= 0.0 {
            return Vec::new();
        }
        // In a loop the number of sparks is an integer, and spark n + sparks_per_loop is spark n again.
        let (rate, sparks_per_loop) = match self.loop_s {
            Some(length) => {
                ((sparks.rate * length).round().max(1.0) / length, Some((sparks.rate * length).round().max(1.0) as i64))
            }
            None => (sparks.rate, None),
        };
        // Those that start or go out while the shutter is open are seen for a part of the exposure.
        let half = 0.5 * view.shutter.duration();
        let (first, last) = (
            ((self.now - half - sparks.lifetime_s) * rate).floor() as i64 - 1,
            ((self.now + half) * rate).ceil() as i64,
        );
        let mut streaks = Vec::new();
        for id in first..=last {
            let index_in_loop = sparks_per_loop.map_or(id, |sparks_per_loop| id.rem_euclid(sparks_per_loop)) as u64;
            if let Some(spark) = self.spark(index_in_loop, self.now - id as f64 / rate, rate, half) {
                self.add_streaks_of(&spark, view, wind, &mut streaks);
            }
        }
        streaks
    }

    /// The interval of depth of the sparks that are visible in the exposure; `None` without any.
    pub(crate) fn depths(&self, view: &View, wind: &Wind) -> Option<DepthInterval> {
        let depths = self.streaks(view, wind).into_iter().map(|streak| streak.sorting_depth);
        let intervals = depths.map(|depth| DepthInterval { near: depth, far: depth.next_up() });
        intervals.reduce(|all, one| DepthInterval { near: all.near.min(one.near), far: all.far.max(one.far) })
    }

    /// Spark `id`, if it glows at most `half_exposure_s` before or after the time that is `seconds_since_due` seconds after that of its index; it starts after
    /// a random delay of up to one interval.
    fn spark(&self, id: u64, seconds_since_due: f64, rate: f64, half_exposure_s: f64) -> Option<Spark> {
        let sparks = self.parameters;
        let first = self.key.uniforms(id, 0, Purpose::named("spark start")).map(f64::from);
        let second = self.key.uniforms(id, 0, Purpose::named("spark flight")).map(f64::from);
        let age = seconds_since_due - first[0] / rate;
        let lifetime_s = sparks.lifetime_s * (0.35 + 0.65 * first[1] * first[1]);
        let glows =
            (0.0..lifetime_s).contains(&age) || (age + half_exposure_s > 0.0 && age - half_exposure_s < lifetime_s);
        let starts = glows && self.starts(id, self.now - age);
        starts.then(|| Spark {
            age,
            lifetime_s,
            start: DVec3::new(0.5 * (first[2] - 0.5), 0.05 + 0.35 * first[3], 0.3 * (second[3] - 0.5)),
            speed: sparks.speed * (1.0 + sparks.speed_variation * (2.0 * second[0] - 1.0)),
            phases: [second[1], second[2]],
            turns: 0.6 + 1.2 * second[3],
        })
    }

    /// The part of an exposure in which a spark glows.
    fn glow(&self, spark: &Spark, shutter: Shutter) -> Shutter {
        let start = shutter.middle() - spark.age;
        let (open, close) = (shutter.open.max(start), shutter.close.min(start + spark.lifetime_s));
        Shutter { open, close: close.max(open) }
    }

    /// Whether spark `id` starts, which is due at time `t`.
    fn starts(&self, id: u64, t: f64) -> bool {
        let Some(flow) = self.flow.filter(|flow| flow.constant() != Some(1.0)) else { return true };
        let t = t - self.phase_s;
        let t = self.loop_s.map_or(t, |length| t - (t / length).floor() * length);
        f64::from(self.key.uniforms(id, 0, Purpose::named("spark flow"))[0]) < flow.at(t)
    }

    /// Displacement of a spark at `age` in still air, m: it decelerates by drag and swirls in a growing spiral.
    fn displacement(&self, spark: &Spark, age: f64) -> DVec3 {
        const DRAG: f64 = 1.3;
        let lifetime_s = self.parameters.lifetime_s;
        let rise = spark.speed * lifetime_s * -math::exp_m1(-DRAG * age / lifetime_s) / DRAG;
        let swirl = self.parameters.swirl * age / (age + 0.4 * lifetime_s);
        let [across, toward] = spark.phases.map(|phase| swirl * wander(phase, spark.turns, age));
        DVec3::new(across, rise, toward)
    }

    /// Displacement by the wind since a spark started `age` seconds before `t`, m.
    fn drift(&self, wind: &Wind, origin: DVec3, t: f64, age: f64) -> DVec3 {
        const STEPS: usize = 4;
        let step = age / STEPS as f64;
        let instants = (0..STEPS).map(|i| t - age + step * (i as f64 + 0.5));
        let mean: DVec3 = if wind.is_planned() {
            instants.map(|t| wind.at(origin, t)).sum::<DVec3>() / STEPS as f64
        } else {
            // A sudden change would be felt by all sparks at once whenever one of the instants passes it, so the mean wind is integrated exactly.
            let gusts = instants.map(|t| wind.at(origin, t) - wind.mean(t)).sum::<DVec3>() / STEPS as f64;
            if age > 0.0 { wind.travel(t - age, t) / age + gusts } else { DVec3::ZERO }
        };
        // A spark is heavy: its velocity relaxes to that of the wind with a time constant of 0.33 s.
        mean * self.wind_response * (age + 0.33 * math::exp_m1(-age / 0.33))
    }

    /// Appends the streaks that a spark draws: several where it crosses the seam of a panorama or the antipode of a fisheye.
    fn add_streaks_of(&self, spark: &Spark, view: &View, wind: &Wind, streaks: &mut Vec<SparkStreak>) {
        let t = view.shutter.middle();
        let size = self.size;
        let origin = self.base + DVec3::new(spark.start.x * size.x, spark.start.y * size.y, spark.start.z * size.x);
        let glow = self.glow(spark, view.shutter);
        let mut ends = [(DVec3::ZERO, 0.0, None); 2];
        for (end, at) in ends.iter_mut().zip([glow.open, glow.close]) {
            let camera = view.camera_at(at);
            let age = (spark.age + at - t).clamp(0.0, spark.lifetime_s);
            let position = origin + self.displacement(spark, age) + self.drift(wind, origin, at, age);
            let distance_squared = (position - camera.position).length_squared();
            *end = (position, distance_squared, camera.project_beyond_circle(position));
        }
        let [(from, opened_square, Some(opened)), (to, closed_square, Some(closed))] = ends else { return };
        let depth = 0.5 * (opened.depth + closed.depth);
        let sorting_depth = self.sheet.map_or(depth, |sheet| sheet.sorting_depth(0.5 * (from + to), depth));
        let is_whole = glow == view.shutter;
        let age = if is_whole { spark.age } else { (spark.age + glow.middle() - t).clamp(0.0, spark.lifetime_s) };
        let share = if is_whole { 1.0 } else { glow.duration() / view.shutter.duration() };
        let cooled_fraction = math::pow(age / spark.lifetime_s, 0.8);
        let hottest = self.parameters.temperature_k;
        let temperature = math::lerp(hottest, EXTINCTION_TEMPERATURE_K.min(hottest), cooled_fraction);
        let radius = 0.5 * self.parameters.diameter * self.scale;
        // The mean solid angle of the sphere over the exposure.
        let solid_angle = std::f64::consts::PI * radius * radius * 0.5 * (1.0 / opened_square + 1.0 / closed_square);
        SparkStreak::images(
            &view.camera,
            [opened.pixel, closed.pixel],
            radius * 0.5 * (opened.pixels_per_meter + closed.pixels_per_meter),
            color::black_body().radiance(temperature as f32),
            solid_angle * share,
            [depth, sorting_depth],
            streaks,
        );
    }
}

/// Sideways motion of a swirl, 0 at age 0 and within about 3: two sines, of which the second is weaker and 2.7 times as fast. `phase` is in turns, `turns` in
/// turns per second.
fn wander(phase: f64, turns: f64, age: f64) -> f64 {
    sine_of_turns(phase, turns, age) + 0.45 * sine_of_turns(1.7 * phase, 2.7 * turns, age)
        - sine_of_turns(phase, 0.0, age)
        - 0.45 * sine_of_turns(1.7 * phase, 0.0, age)
}

fn sine_of_turns(phase: f64, turns: f64, age: f64) -> f64 {
    math::sin(std::f64::consts::TAU * (phase + turns * age))
}
