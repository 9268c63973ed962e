//! Splashes: drops that hit the ground throw up a crown of droplets.
//!
//! In closed form, like the drops: the ground is divided into squares and time into periods. Each square has random
//! impacts of its own in each period.

use std::f64::consts::TAU;

use bansho_base::{
    host::parallel::prelude::*,
    math::{
        self, DVec3,
        random::{self, Purpose, uniform},
        simd::LANES,
    },
    world::gravity::STANDARD_GRAVITY,
};
use fearless_simd::dispatch;

use super::{
    bin::{StreakChunk, StreakChunkBuilder},
    project::StreakProjection,
    project_lanes::DropPaths,
};
use crate::{drops::classes::DropClassState, lanes::ZERO_LANES, parameters::SplashParameters};

/// Side of a ground square, m.
const SQUARE_SIZE: f64 = 0.5;
/// Squares whose droplets make a chunk.
const SQUARES_PER_CHUNK: usize = 32;
/// Length of a period, s, and the maximum age of a splash.
const SPLASH_PERIOD: f64 = 0.25;
/// Droplets of a splash: those of the crown, and some with a higher trajectory.
const RING_DROPLETS: usize = 6;
const HIGH_DROPLETS: usize = 2;
/// Smallest drop with a visible splash, mm.
const MIN_DIAMETER_MM: f64 = 1.3;
/// Beyond this distance, m, splashes are thinned out, and the rest made more opaque in proportion.
const FULL_DENSITY_DISTANCE: f64 = 3.0;

const COUNT: Purpose = Purpose::named("rain splashes of a square");
const IMPACT: Purpose = Purpose::named("rain splash");
const DROPLET: Purpose = Purpose::named("rain splash droplet");

/// Generates the streaks of splashes.
#[derive(Clone, Copy)]
pub(crate) struct Splashes<'a> {
    pub(crate) projection: StreakProjection<'a>,
    pub(crate) parameters: &'a SplashParameters,
    /// Middle of the exposure, s.
    pub(crate) time: f64,
    /// Length of a loop, s.
    pub(crate) loop_s: Option<f64>,
}

/// The impact of one drop.
struct Impact {
    position: DVec3,
    /// Age, s.
    age: f64,
    /// Diameter of the drop, mm.
    diameter_mm: f64,
    /// Random key of its square.
    id: u64,
    step: u32,
    /// Opacity gain.
    strength: f64,
}

/// A period of time.
struct Period {
    index: i64,
    /// Fraction that has elapsed.
    phase: f64,
    /// s.
    length: f64,
}

impl Splashes<'_> {
    /// The streaks of all droplets that may be visible.
    pub(crate) fn chunks(&self) -> Vec<StreakChunk> {
        let (shutter_state, reach) = (self.projection.shutter_state, self.parameters.distance);
        let eye = shutter_state.cameras.middle().position;
        let eye_height = (eye.y - shutter_state.ground).abs();
        if self.parameters.fraction <= 0.0 || eye_height >= reach {
            return Vec::new();
        }
        let [columns, layers] = [eye.x, eye.z].map(|center| {
            ((center - reach) / SQUARE_SIZE).floor() as i64..=((center + reach) / SQUARE_SIZE).floor() as i64
        });
        let half_square = DVec3::new(0.5 * SQUARE_SIZE, 0.0, 0.5 * SQUARE_SIZE);
        let mut visible_squares = Vec::new();
        for square in columns.flat_map(|x| layers.clone().map(move |z| [x, z])) {
            let middle = self.middle(square);
            if (middle - eye).length() < reach && shutter_state.cameras.may_be_visible(middle, half_square, 0.3) {
                visible_squares.push(square);
            }
        }
        visible_squares
            .par_chunks(SQUARES_PER_CHUNK)
            .map(|squares| {
                let mut builder = StreakChunkBuilder::new(&shutter_state.cameras);
                squares.iter().for_each(|square| self.square(*square, self.middle(*square), &mut builder));
                builder.build()
            })
            .collect()
    }

    /// The middle of a ground square, m.
    fn middle(&self, [x, z]: [i64; 2]) -> DVec3 {
        let ground = self.projection.shutter_state.ground;
        DVec3::new((x as f64 + 0.5) * SQUARE_SIZE, ground, (z as f64 + 0.5) * SQUARE_SIZE)
    }

    /// The current period. A loop contains a whole number of periods.
    fn period(&self) -> Period {
        let length = self.loop_s.map_or(SPLASH_PERIOD, |seconds| seconds / (seconds / SPLASH_PERIOD).floor().max(1.0));
        let turns = self.time / length;
        Period { index: turns.floor() as i64, phase: turns - turns.floor(), length }
    }

    /// Adds the droplets above one ground square.
    fn square(&self, [x, z]: [i64; 2], middle: DVec3, builder: &mut StreakChunkBuilder) {
        let Period { index: period, phase, length } = self.period();
        let key = self.projection.shutter_state.key;
        let id = (x as u64 & 0xffff_ffff) << 32 | z as u64 & 0xffff_ffff;
        let distance = (middle - self.projection.shutter_state.cameras.middle().position).length();
        let thinning = (distance / FULL_DENSITY_DISTANCE).max(1.0);
        let probability = self.parameters.fraction / (thinning * thinning);
        let fade = 1.0 - math::smoothstep(0.7, 1.0, distance / self.parameters.distance);
        for back in 0..2 {
            let step = self
                .loop_s
                .map_or(period - back, |seconds| (period - back).rem_euclid((seconds / length).round() as i64));
            let step = step as u32;
            for class in
                self.projection.shutter_state.classes.iter().filter(|class| class.diameter_mm >= MIN_DIAMETER_MM)
            {
                let words = key.words(id, step, class.purpose(COUNT));
                let mean = class.max_density * class.speed * SQUARE_SIZE * SQUARE_SIZE * length;
                for number in 0..random::poisson(mean, [words[0], words[1]]) {
                    let uniforms =
                        key.uniforms(id, step, Purpose(class.purpose(IMPACT).0 ^ (number as u32) << 8)).map(f64::from);
                    if uniforms[3] >= class.fraction * probability {
                        continue;
                    }
                    let age = (phase - uniforms[2] + back as f64) * length;
                    let position = middle + DVec3::new(uniforms[0] - 0.5, 0.0, uniforms[1] - 0.5) * SQUARE_SIZE;
                    let strength = fade * thinning * self.projection.shutter_state.gain;
                    let step = step.wrapping_mul(1 << 16).wrapping_add((class.index as u32) << 12 | number as u32);
                    self.add(
                        class,
                        &Impact { position, age, diameter_mm: class.diameter_mm, id, step, strength },
                        builder,
                    );
                }
            }
        }
    }

    fn add(&self, class: &DropClassState, impact: &Impact, builder: &mut StreakChunkBuilder) {
        let StreakProjection { shutter_state, level, .. } = self.projection;
        let fall = DVec3::Y * -class.speed;
        if !(0.0..SPLASH_PERIOD).contains(&impact.age) || shutter_state.is_sheltered(impact.position, fall) {
            return;
        }
        let mut paths =
            DropPaths { from: [ZERO_LANES; 3], to: [ZERO_LANES; 3], diameter_mm: ZERO_LANES, gain: ZERO_LANES };
        for droplet in 0..RING_DROPLETS + HIGH_DROPLETS {
            let words = shutter_state.key.words(impact.id, impact.step, Purpose(DROPLET.0 ^ (droplet as u32) << 24));
            self.droplet(impact, droplet, words.map(|word| f64::from(uniform(word))), &mut paths);
        }
        // One position for all droplets of a splash: the light hardly varies within it.
        let position =
            (impact.position + DVec3::Y * 0.01 - shutter_state.cameras.middle().position).as_vec3().to_array();
        let positions = position.map(|coordinate| [coordinate; LANES]);
        dispatch!(level, _simd => {
            let streaks = paths.streaks(&shutter_state.cameras);
            self.projection.add_paths(&paths, &streaks, &positions, 0.0, builder);
        });
    }

    /// Sets the path of one droplet, if it is in the air during the exposure: a ballistic trajectory.
    fn droplet(&self, impact: &Impact, index: usize, random: [f64; 4], paths: &mut DropPaths) {
        let cameras = &self.projection.shutter_state.cameras;
        let high = index >= RING_DROPLETS;
        let turns = if high { random[0] } else { (index as f64 + 0.6 * random[0]) / RING_DROPLETS as f64 };
        let elevation = if high { 1.2 + 0.3 * random[1] } else { 0.85 + 0.3 * random[1] };
        let speed = (if high { 1.1 } else { 0.75 }) * (0.7 + 0.6 * random[2]) * math::sqrt(0.5 * impact.diameter_mm);
        let speed = (speed * self.parameters.speed_scale).min(0.5 * STANDARD_GRAVITY * SPLASH_PERIOD);
        let ((sin_turn, cos_turn), (sin_up, cos_up)) = (math::sin_cos(TAU * turns), math::sin_cos(elevation));
        let velocity = DVec3::new(cos_turn * cos_up, sin_up, sin_turn * cos_up) * speed;
        let half = 0.5 * cameras.exposure_time;
        let landing = 2.0 * velocity.y / STANDARD_GRAVITY;
        let (from, to) = ((impact.age - half).max(0.0), (impact.age + half).min(landing));
        if from >= to {
            return;
        }
        let position = impact.position - cameras.middle().position;
        let exposed_fraction = if half > 0.0 { (to - from) / (2.0 * half) } else { 1.0 };
        for (vectors, age) in [(&mut paths.from, from), (&mut paths.to, to)] {
            let point = position + velocity * age - DVec3::Y * (0.5 * STANDARD_GRAVITY * age * age);
            (0..3).for_each(|axis| vectors[axis][index] = point[axis] as f32);
        }
        paths.diameter_mm[index] = (impact.diameter_mm * (0.16 + 0.14 * random[3])) as f32;
        paths.gain[index] = (impact.strength * exposed_fraction) as f32;
    }
}
