//! Drops that hit the ground: each throws up a ring of droplets for a moment.
//!
//! In closed form like the drops themselves: the ground is divided into squares and time into turns, and each square has in each turn
//! its own impacts with their times and places.

use std::f64::consts::TAU;

use bansho_base::{
    math::{
        self, DVec3,
        random::{self, Purpose, uniform},
        simd::LANES,
    },
    world::gravity::STANDARD_GRAVITY,
};

use super::{
    project::Shower,
    project_lanes::{Flights, NOTHING},
    time_steps::{Gathering, Part},
};
use crate::{drops::exposure::ClassNow, parameters::SplashParameters};
use fearless_simd::dispatch;
use rayon::prelude::*;

/// Side of a square of ground, m.
const SQUARE: f64 = 0.5;
/// Squares whose droplets make a part.
const SQUARES_OF_PART: usize = 32;
/// Length of a turn, s; no splash lasts longer.
const TURN: f64 = 0.25;
/// Droplets of a splash: a ring, and some that fly higher.
const RING: usize = 6;
const HIGH: usize = 2;
/// Smallest drop that splashes visibly, mm.
const LEAST_MM: f64 = 1.3;
/// Beyond this distance only some splashes are drawn, each so much stronger, m.
const ALL_WITHIN: f64 = 3.0;

const COUNT: Purpose = Purpose::named("rain splashes of a square");
const IMPACT: Purpose = Purpose::named("rain splash");
const DROPLET: Purpose = Purpose::named("rain splash droplet");

/// What splashes are made from.
#[derive(Clone, Copy)]
pub(crate) struct Splashes<'a> {
    pub(crate) shower: Shower<'a>,
    pub(crate) parameters: &'a SplashParameters,
    /// Middle of the exposure, s.
    pub(crate) time: f64,
    /// Length of a loop, s.
    pub(crate) loop_s: Option<f64>,
}

/// One drop's impact.
struct Impact {
    place: DVec3,
    /// How long ago it was, s.
    age: f64,
    /// Diameter of the drop, mm.
    diameter_mm: f64,
    /// Its number within its square and turn.
    id: u64,
    step: u32,
    /// Opacity beside the droplets' own.
    strength: f64,
}

impl Splashes<'_> {
    /// The streaks of all droplets that may show.
    pub(crate) fn parts(&self) -> Vec<Part> {
        let (moment, reach) = (self.shower.moment, self.parameters.distance);
        let eye = moment.sight.middle().position;
        let high = (eye.y - moment.ground).abs();
        if self.parameters.amount <= 0.0 || high >= reach {
            return Vec::new();
        }
        let range =
            |centre: f64| ((centre - reach) / SQUARE).floor() as i64..=((centre + reach) / SQUARE).floor() as i64;
        let squares: Vec<[i64; 2]> = range(eye.x).flat_map(|x| range(eye.z).map(move |z| [x, z])).collect();
        let middle = |[x, z]: [i64; 2]| DVec3::new((x as f64 + 0.5) * SQUARE, moment.ground, (z as f64 + 0.5) * SQUARE);
        let shows = |square: &&[i64; 2]| {
            (middle(**square) - eye).length() < reach
                && moment.sight.may_see(middle(**square), DVec3::new(0.5 * SQUARE, 0.0, 0.5 * SQUARE), 0.3)
        };
        let squares: Vec<&[i64; 2]> = squares.iter().filter(shows).collect();
        let part = |squares: &[&[i64; 2]]| {
            let mut gathering = Gathering::new(moment.sight.size());
            squares.iter().for_each(|square| self.square(**square, middle(**square), &mut gathering));
            gathering.part()
        };
        squares.par_chunks(SQUARES_OF_PART).map(part).collect()
    }

    /// Turns until now, as a number and a part; in a loop a whole number of turns fits.
    fn turn(&self) -> (i64, f64, f64) {
        let length = self.loop_s.map_or(TURN, |seconds| seconds / (seconds / TURN).floor().max(1.0));
        let turns = self.time / length;
        (turns.floor() as i64, turns - turns.floor(), length)
    }

    /// Adds the droplets over one square of ground.
    fn square(&self, [x, z]: [i64; 2], middle: DVec3, gathering: &mut Gathering) {
        let (turn, part, length) = self.turn();
        let key = self.shower.moment.key;
        let id = (x as u64 & 0xffff_ffff) << 32 | z as u64 & 0xffff_ffff;
        let away = (middle - self.shower.moment.sight.middle().position).length();
        let thinned = (away / ALL_WITHIN).max(1.0);
        let share = self.parameters.amount / (thinned * thinned);
        let fading = 1.0 - math::smoothstep(0.7, 1.0, away / self.parameters.distance);
        for back in 0..2 {
            let step =
                self.loop_s.map_or(turn - back, |seconds| (turn - back).rem_euclid((seconds / length).round() as i64));
            let step = step as u32;
            for class in self.shower.moment.classes.iter().filter(|class| class.diameter_mm >= LEAST_MM) {
                let words = key.words(id, step, class.purpose(COUNT));
                let mean = class.most * class.speed * SQUARE * SQUARE * length;
                for number in 0..random::poisson(mean, [words[0], words[1]]) {
                    let uniforms =
                        key.uniforms(id, step, Purpose(class.purpose(IMPACT).0 ^ (number as u32) << 8)).map(f64::from);
                    if uniforms[3] >= class.share * share {
                        continue;
                    }
                    let age = (part - uniforms[2] + back as f64) * length;
                    let place = middle + DVec3::new(uniforms[0] - 0.5, 0.0, uniforms[1] - 0.5) * SQUARE;
                    let strength = fading * thinned * self.shower.moment.gain;
                    let step = step.wrapping_mul(1 << 16).wrapping_add((class.index as u32) << 12 | number as u32);
                    self.add(
                        class,
                        &Impact { place, age, diameter_mm: class.diameter_mm, id, step, strength },
                        gathering,
                    );
                }
            }
        }
    }

    fn add(&self, class: &ClassNow, impact: &Impact, gathering: &mut Gathering) {
        let Shower { moment, level, .. } = self.shower;
        let fall = DVec3::Y * -class.speed;
        if !(0.0..TURN).contains(&impact.age) || moment.sheltered(impact.place, fall) {
            return;
        }
        let mut flights = Flights { from: [NOTHING; 3], to: [NOTHING; 3], diameter_mm: NOTHING, gain: NOTHING };
        for droplet in 0..RING + HIGH {
            let words = moment.key.words(impact.id, impact.step, Purpose(DROPLET.0 ^ (droplet as u32) << 24));
            self.droplet(impact, droplet, words.map(|word| f64::from(uniform(word))), &mut flights);
        }
        // Light is even over so small a place.
        let place = (impact.place + DVec3::Y * 0.01 - moment.sight.middle().position).as_vec3().to_array();
        let places = place.map(|coordinate| [coordinate; LANES]);
        dispatch!(level, _simd => {
            let streaks = flights.streaks(&moment.sight);
            self.shower.add(&streaks, &places, &flights.diameter_mm, 0.0, gathering);
        });
    }

    /// Notes one droplet's way, if it has not fallen back.
    fn droplet(&self, impact: &Impact, index: usize, random: [f64; 4], flights: &mut Flights) {
        let sight = &self.shower.moment.sight;
        let high = index >= RING;
        let turns = if high { random[0] } else { (index as f64 + 0.6 * random[0]) / RING as f64 };
        let elevation = if high { 1.2 + 0.3 * random[1] } else { 0.85 + 0.3 * random[1] };
        let speed = (if high { 1.1 } else { 0.75 }) * (0.7 + 0.6 * random[2]) * math::sqrt(0.5 * impact.diameter_mm);
        let speed = (speed * self.parameters.speed).min(0.5 * STANDARD_GRAVITY * TURN);
        let ((sin_turn, cos_turn), (sin_up, cos_up)) = (math::sin_cos(TAU * turns), math::sin_cos(elevation));
        let velocity = DVec3::new(cos_turn * cos_up, sin_up, sin_turn * cos_up) * speed;
        let half = 0.5 * sight.exposure;
        let landing = 2.0 * velocity.y / STANDARD_GRAVITY;
        let (from, to) = ((impact.age - half).max(0.0), (impact.age + half).min(landing));
        if from >= to {
            return;
        }
        let place = impact.place - sight.middle().position;
        let at = |age: f64| place + velocity * age - DVec3::Y * (0.5 * STANDARD_GRAVITY * age * age);
        let share = if half > 0.0 { (to - from) / (2.0 * half) } else { 1.0 };
        for (vectors, point) in [(&mut flights.from, at(from)), (&mut flights.to, at(to))] {
            (0..3).for_each(|axis| vectors[axis][index] = point[axis] as f32);
        }
        flights.diameter_mm[index] = (impact.diameter_mm * (0.16 + 0.14 * random[3])) as f32;
        flights.gain[index] = (impact.strength * share) as f32;
    }
}
