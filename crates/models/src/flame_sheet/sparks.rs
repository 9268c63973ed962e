//! Sparks: each a function of its number and the time, so that any frame alone is right.

use bansho_base::{
    camera::Camera,
    canvas::{Strip, View},
    color,
    image::Rect,
    math::{self, DVec2, DVec3},
    random::{Key, Purpose},
    wind::Wind,
};

use super::{FlameSheet, flame::Flame};

/// Where a spark stops to glow, K.
const COLDEST_K: f64 = 900.0;

/// The random properties of one spark.
struct Spark {
    /// How old it is, s.
    age: f64,
    /// How long it glows, s.
    life: f64,
    /// Where it left the fire, from the base: sheet widths and heights.
    start: DVec3,
    /// Speed at first, m/s.
    speed: f64,
    /// Phases of its swirl, turns.
    phases: [f64; 2],
    /// Turns of its swirl a second.
    turns: f64,
}

/// A spark as the exposure sees it: a streak of light between two places of the picture.
#[derive(Clone, Debug)]
pub(crate) struct Streak {
    from: DVec2,
    to: DVec2,
    radius: f64,
    /// ACEScg at full coverage, cd/m^2; what the streak covers adds up to the spark's light.
    radiance: [f32; 3],
    /// Depth, m.
    pub(crate) depth: f64,
    /// Pixels it touches; may reach beyond the picture.
    low: [i64; 2],
    high: [i64; 2],
}

/// Softness of a streak's edge, pixels.
const SOFT: f64 = 0.7;

impl Streak {
    /// A streak that spreads the light `radiance` times `area` (square pixels) over what it covers.
    fn new(from: DVec2, to: DVec2, radius: f64, radiance: [f32; 3], area: f64, depth: f64) -> Option<Self> {
        /// Longer streaks are cut; a spark that crosses the lens says nothing.
        const LONGEST: f64 = 4000.0;
        let reach = DVec2::splat(radius + SOFT);
        let (low, high) = (from.min(to) - reach, from.max(to) + reach);
        if !((high - low).max_element() < LONGEST && low.abs().max_element() < 1e9) {
            return None;
        }
        let whole = |place: DVec2| [place.x.floor() as i64, place.y.floor() as i64];
        let mut streak = Self { from, to, radius, radiance, depth, low: whole(low), high: whole(high) };
        let covered = streak.covered();
        if covered <= 0.0 {
            return None;
        }
        streak.radiance = radiance.map(|value| value * (area / covered) as f32);
        Some(streak)
    }

    /// Sum of the coverage over all pixels: counted where that is quick, else the area of a capsule with soft edges.
    fn covered(&self) -> f64 {
        const QUICK: i64 = 4096;
        if (self.high[0] - self.low[0] + 1) * (self.high[1] - self.low[1] + 1) <= QUICK {
            return self.pixels().map(|(x, y)| self.coverage(x, y)).sum();
        }
        // The place of a smooth edge of half width s has the variance s^2/5 of a Beta(2, 2) distribution.
        let round = self.radius * self.radius + SOFT * SOFT / 5.0;
        2.0 * (self.to - self.from).length() * self.radius + std::f64::consts::PI * round
    }

    fn pixels(&self) -> impl Iterator<Item = (i64, i64)> + use<> {
        let (low, high) = (self.low, self.high);
        (low[1]..=high[1]).flat_map(move |y| (low[0]..=high[0]).map(move |x| (x, y)))
    }

    /// Share of a pixel that the streak covers, by the distance of its centre.
    fn coverage(&self, x: i64, y: i64) -> f64 {
        let point = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
        let along = self.to - self.from;
        let place = ((point - self.from).dot(along) / along.length_squared().max(1e-12)).clamp(0.0, 1.0);
        let distance = (point - self.from - along * place).length();
        1.0 - math::smoothstep(self.radius - SOFT, self.radius + SOFT, distance)
    }

    /// The pixels of the picture that it may touch.
    pub(crate) fn bounds(&self, picture: [usize; 2]) -> Rect {
        let clip = |value: i64, side: usize| value.clamp(0, side as i64) as usize;
        let start = [clip(self.low[0], picture[0]), clip(self.low[1], picture[1])];
        let end = [clip(self.high[0] + 1, picture[0]), clip(self.high[1] + 1, picture[1])];
        if start[0] >= end[0] || start[1] >= end[1] {
            return Rect::default();
        }
        Rect { x: start[0], y: start[1], width: end[0] - start[0], height: end[1] - start[1] }
    }

    /// Adds its light to the strip, behind what the strip holds.
    pub(crate) fn draw(&self, picture: [usize; 2], strip: &mut Strip) {
        let rect = self.bounds(picture).intersection(&strip.rect);
        for y in rect.y..rect.bottom() {
            for x in rect.x..rect.right() {
                let index = (y - strip.rect.y) * strip.rect.width + x - strip.rect.x;
                let coverage = self.coverage(x as i64, y as i64) as f32;
                if coverage > 0.0 && strip.visible(index, self.depth as f32) {
                    strip.emit(index, self.radiance.map(|value| value * coverage), self.depth as f32);
                }
            }
        }
    }
}

impl FlameSheet {
    /// The sparks of a flame that the exposure sees.
    pub(crate) fn streaks(&self, flame: &Flame, view: &View, wind: &Wind) -> Vec<Streak> {
        let sparks = &self.parameters.sparks;
        if sparks.rate <= 0.0 {
            return Vec::new();
        }
        let shutter = view.shutter;
        let middle = self.clock.time(self.flame_time(flame, shutter.middle()));
        // In a loop the number of births is whole, and birth n is birth n + births again.
        let (rate, births) = match self.clock.loop_s() {
            Some(length) => {
                ((sparks.rate * length).round().max(1.0) / length, Some((sparks.rate * length).round().max(1.0) as i64))
            }
            None => (sparks.rate, None),
        };
        let (first, last) = (((middle - sparks.life_s) * rate).floor() as i64 - 1, (middle * rate).ceil() as i64);
        let same = |id: i64| births.map_or(id, |births| id.rem_euclid(births)) as u64;
        (first..=last)
            .filter_map(|id| {
                let spark = self.spark(flame.key, same(id), middle - id as f64 / rate, rate)?;
                self.streak(flame, &spark, view, wind)
            })
            .collect()
    }

    /// Spark `id`, if it glows `since_birth` seconds (less its own delay) after its turn came.
    fn spark(&self, key: Key, id: u64, since_turn: f64, rate: f64) -> Option<Spark> {
        let sparks = &self.parameters.sparks;
        let first = key.uniforms(id, 0, Purpose::named("spark start")).map(f64::from);
        let second = key.uniforms(id, 0, Purpose::named("spark flight")).map(f64::from);
        let age = since_turn - first[0] / rate;
        let life = sparks.life_s * (0.35 + 0.65 * first[1] * first[1]);
        let vary = |share: f64| 1.0 + sparks.spread * (2.0 * share - 1.0);
        (0.0..life).contains(&age).then(|| Spark {
            age,
            life,
            start: DVec3::new(0.5 * (first[2] - 0.5), 0.05 + 0.35 * first[3], 0.3 * (second[3] - 0.5)),
            speed: sparks.speed * vary(second[0]),
            phases: [second[1], second[2]],
            turns: 0.6 + 1.2 * second[3],
        })
    }

    /// Where a spark of `age` is from where it left, in still air, m: it slows as it cools and swirls ever wider.
    fn flight(&self, spark: &Spark, age: f64) -> DVec3 {
        const DRAG: f64 = 1.3;
        let life = self.parameters.sparks.life_s;
        let rise = spark.speed * life * -math::exp_m1(-DRAG * age / life) / DRAG;
        let swirl = self.parameters.sparks.swirl * age / (age + 0.4 * life);
        let angle = |phase: f64, turns: f64| std::f64::consts::TAU * (phase + turns * age);
        let wander = |phase: f64| {
            math::sin(angle(phase, spark.turns)) + 0.45 * math::sin(angle(1.7 * phase, 2.7 * spark.turns))
                - math::sin(angle(phase, 0.0))
                - 0.45 * math::sin(angle(1.7 * phase, 0.0))
        };
        DVec3::new(swirl * wander(spark.phases[0]), rise, swirl * wander(spark.phases[1]))
    }

    /// How far the wind carried a spark at the end of its first `age` seconds, m.
    fn drift(&self, wind: &Wind, origin: DVec3, t: f64, age: f64) -> DVec3 {
        const STEPS: usize = 4;
        let step = age / STEPS as f64;
        let mean: DVec3 =
            (0..STEPS).map(|i| wind.at(origin, t - age + step * (i as f64 + 0.5))).sum::<DVec3>() / STEPS as f64;
        // Heavy beside gas, it takes a third of a second to follow.
        mean * self.parameters.wind_response * (age + 0.33 * math::exp_m1(-age / 0.33))
    }

    fn streak(&self, flame: &Flame, spark: &Spark, view: &View, wind: &Wind) -> Option<Streak> {
        let t = view.shutter.middle();
        let (base, size) = (self.base(flame, t), self.sheet_size(flame));
        let origin = base + DVec3::new(spark.start.x * size.x, spark.start.y * size.y, spark.start.z * size.x);
        let seen = |at: f64, camera: &Camera| {
            let age = (spark.age + at - t).clamp(0.0, spark.life);
            camera.project(origin + self.flight(spark, age) + self.drift(wind, origin, at, age))
        };
        let opened = seen(view.shutter.open, &view.camera_at(view.shutter.open))?;
        let closed = seen(view.shutter.close, &view.camera_at(view.shutter.close))?;
        let cooled = math::pow(spark.age / spark.life, 0.8);
        let hottest = self.parameters.sparks.temperature_k;
        let temperature = math::lerp(hottest, COLDEST_K.min(hottest), cooled);
        let radius = 0.5 * self.parameters.sparks.size * flame.place.scale * opened.pixels_per_metre;
        let area = std::f64::consts::PI * radius * radius;
        let radiance = color::black_body().radiance(temperature as f32);
        Streak::new(opened.pixel, closed.pixel, radius.max(0.6), radiance, area, 0.5 * (opened.depth + closed.depth))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_streak_keeps_the_sparks_light_however_small_or_long_it_is() {
        for (to, radius) in
            [(DVec2::new(20.3, 20.9), 0.6), (DVec2::new(48.0, 31.5), 0.6), (DVec2::new(25.0, 40.0), 4.0)]
        {
            let streak = Streak::new(DVec2::new(20.3, 20.9), to, radius, [3.0, 2.0, 1.0], 0.37, 2.0).unwrap();
            let mut strip = Strip::default();
            strip.reset(Rect::of_size(64, 64), None, 0);
            streak.draw([64, 64], &mut strip);
            let sum: f32 = strip.radiance[0].iter().sum();
            assert!((sum - 3.0 * 0.37).abs() < 1e-4, "{sum}");
        }
    }

    #[test]
    fn the_area_of_large_streaks_is_what_counting_their_pixels_gives() {
        for (to, radius) in
            [(DVec2::new(300.0, 200.5), 3.0), (DVec2::new(20.0, 400.0), 1.5), (DVec2::new(20.0, 30.0), 80.0)]
        {
            let streak = Streak::new(DVec2::new(20.3, 20.9), to, radius, [1.0; 3], 1.0, 2.0).unwrap();
            let counted: f64 = streak.pixels().map(|(x, y)| streak.coverage(x, y)).sum();
            assert!((streak.covered() / counted - 1.0).abs() < 2e-3, "{} {counted}", streak.covered());
        }
    }
}
