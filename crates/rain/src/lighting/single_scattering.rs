//! Rain that is not seen drop by drop: it greys what lies behind it and glows around lamps.

use std::sync::Arc;

use bansho_base::{
    image::Rect,
    math::{self, DVec2, DVec3, MulAdd},
    phenomenon::{
        strip::{DepthInterval, Strip, View},
        surroundings::{Emitter, Light},
    },
};

use super::{
    drop_lighting::Lighting,
    sky::SeenSky,
    tiles::{FINE, FINEST, Tiles, geometric, mix},
};
use crate::{drops::exposure::Moment, streaks::bin::BAND};

use fearless_simd::{Level, dispatch};

/// Nearest distance at which the light that is scattered up to there is known, m, and how much further each next one is.
const FIRST: f64 = 0.5;
const RATIO: f64 = 1.25;
/// The same where the light of lamps does not matter.
const FAR_RATIO: f64 = 2.0;
/// Angle, seen from a lamp, that one sample stands for.
const ANGLE: f64 = 0.15;
/// Optical depth behind which no light of lamps is seen: a part in 10^17 of it comes through.
const OPAQUE: f32 = 40.0;
/// A veil has no depth of its own, m.
const NOWHERE: [f32; FINE] = [f32::INFINITY; FINE];
/// Lamps are at least so large for the air around them, m.
const SMALLEST_LAMP: f64 = 0.02;

/// Extinction of the rain along every line of sight.
#[derive(Clone, Copy)]
struct Density<'a> {
    moment: &'a Moment,
    /// Of all drops, and of those that are drawn as streaks in the region, 1/m.
    extinction: [f64; 2],
}

impl Density<'_> {
    fn at(&self, distance: f64) -> f64 {
        self.extinction[0] - self.extinction[1] * f64::from(self.moment.nearness(distance as f32))
    }
}

/// Light scattered to the camera up to each distance, corner after corner.
struct Scattered(Vec<Vec<[f32; 3]>>);

impl Scattered {
    fn new(lines: &[Vec<[f32; 3]>], distances: usize) -> Self {
        Self((0..distances).map(|k| lines.iter().map(|sums| sums[k]).collect()).collect())
    }

    fn add(&mut self, other: &Self) {
        for (sum, more) in self.0.iter_mut().flatten().zip(other.0.iter().flatten()) {
            (0..3).for_each(|c| sum[c] += more[c]);
        }
    }
}

/// A lamp in the picture. Light scattered around it falls as 1/h with the distance h of the line of sight from it, and its cone has an
/// edge, which no straight line between corners of tiles can follow: near it tiles are finer, and what is left after taking out 1/h is
/// interpolated.
struct Halo {
    /// From the camera to it, m.
    offset: DVec3,
    /// Where it is in the picture.
    pixel: DVec2,
    /// The pixels near it.
    rect: Rect,
    /// Its light at the corners of the whole picture's tiles.
    scattered: Scattered,
    /// Finer tiles over the pixels near it; its light at their corners, and how near it their lines of sight pass, m.
    near: Tiles,
    sharp: Scattered,
    passes: Vec<f32>,
}

/// Pixels around a lamp for which that is done.
const HALO: f64 = 72.0;
/// Most lamps for which it is.
const MOST_HALOS: usize = 8;

/// The pixels of a picture near a lamp.
fn around(lamp: DVec2, size: [usize; 2]) -> Rect {
    let [left, top] = [lamp.x - HALO, lamp.y - HALO].map(|side| side.max(0.0) as usize);
    let [right, bottom] = [lamp.x + HALO, lamp.y + HALO].map(|side| side.max(0.0) as usize);
    let rect = Rect { x: left, y: top, width: right - left, height: bottom - top };
    rect.intersection(&Rect::of_size(size[0], size[1]))
}

/// How near a line of sight passes what is at `offset` from the camera, m.
fn passes(offset: DVec3, line: DVec3) -> f32 {
    (offset - line * offset.dot(line)).length().max(SMALLEST_LAMP) as f32
}

/// A part of a line of sight.
struct Span {
    /// Between which known distances its ends lie.
    brackets: [(usize, f32); 2],
    /// Optical depths up to its ends.
    depths: [f32; 2],
    /// How many times brighter its light is where it begins than at the camera; 0 beyond the light of lamps, and where none comes through.
    gain: f32,
}

impl Span {
    /// Light scattered within it, at a corner.
    fn lit(&self, scattered: &Scattered, corner: usize) -> [f32; 3] {
        if self.gain == 0.0 {
            return [0.0; 3];
        }
        let [near, far] =
            self.brackets.map(|(k, share)| mix(scattered.0[k][corner], scattered.0[k + 1][corner], share));
        std::array::from_fn(|c| (far[c] - near[c]).max(0.0) * self.gain)
    }
}

/// Single scattering along the lines of sight of one frame.
pub(crate) struct Veil<'a> {
    level: Level,
    view: &'a View,
    /// The sky as it is seen from the corners of its finer tiles, at which light is known.
    seen: Arc<SeenSky>,
    /// Ascending from 0, m.
    distances: Vec<f64>,
    /// Optical depth up to each distance.
    depths: Vec<f32>,
    /// Light of all lamps and fires scattered to the camera, if there are any.
    scattered: Option<Scattered>,
    /// Lamps in the picture.
    halos: Vec<Halo>,
    /// How far the light of lamps is known, and the veil before a plate reaches, m.
    end: f64,
    ground: f64,
}

impl<'a> Veil<'a> {
    /// The veil of drops with extinctions `[all, drawn as streaks]` up to the first of `ends` (m), and to the second where there is
    /// no plate; `None` where there is none.
    pub(crate) fn new(
        moment: &Moment,
        lighting: &Lighting,
        seen: Arc<SeenSky>,
        view: &'a View,
        extinction: [f64; 2],
        [end, farthest]: [f64; 2],
    ) -> Option<Self> {
        if end <= 0.0 || extinction[0] <= 0.0 {
            return None;
        }
        let density = Density { moment, extinction };
        let mut distances = geometric(FIRST.min(end), end, RATIO);
        distances.insert(0, 0.0);
        let last = distances.len() - 1;
        distances[last] = end;
        while distances[distances.len() - 1] < farthest {
            distances.push((FAR_RATIO * distances[distances.len() - 1]).min(farthest));
        }
        let mut depths = vec![0.0];
        for pair in distances.windows(2) {
            let depth = f64::from(depths[depths.len() - 1]);
            depths.push((depth + (pair[1] - pair[0]) * 0.5 * (density.at(pair[0]) + density.at(pair[1]))) as f32);
        }
        let eye = moment.sight.middle().position;
        let march = March { lighting, density, eye, distances: &distances, depths: &depths, end };
        let tiles = &seen.fine.0;
        let (shown, others) = march.divide(view);
        let halos: Vec<Halo> = shown.into_iter().map(|(light, pixel)| march.halo(&light, pixel, tiles, view)).collect();
        let scattered = (!lighting.lights.is_empty()).then(|| {
            let lines = tiles.map(|_, line| march.line(line, &others));
            let mut scattered = Scattered::new(&lines, distances.len());
            halos.iter().for_each(|halo| scattered.add(&halo.scattered));
            scattered
        });
        Some(Self { level: Level::new(), view, seen, distances, depths, scattered, halos, end, ground: moment.ground })
    }

    /// At whose corners light is known.
    fn tiles(&self) -> &Tiles {
        &self.seen.fine.0
    }

    /// Which distances a distance lies between, and how far from the first to the second.
    fn bracket(&self, distance: f64) -> (usize, f32) {
        let last = self.distances.len() - 1;
        let next = self.distances.partition_point(|known| *known <= distance).clamp(1, last);
        let (near, far) = (self.distances[next - 1], self.distances[next]);
        (next - 1, ((distance - near) / (far - near)).clamp(0.0, 1.0) as f32)
    }

    /// What lies between two distances.
    fn span(&self, [near, far]: [f64; 2]) -> Span {
        let brackets = [near, far.max(near)].map(|distance| self.bracket(distance));
        let depths = brackets.map(|(k, share)| self.depths[k] + (self.depths[k + 1] - self.depths[k]) * share);
        // What lies behind so much rain is not seen, and its gain would soon be infinite.
        let is_lit = near < self.end && depths[0] < OPAQUE;
        let gain = if is_lit { math::approximations::exp(depths[0]) } else { 0.0 };
        Span { brackets, depths, gain }
    }

    /// Light and transmittance of a span at a corner column, `down` of the way from corner row `row` to the next.
    fn between(&self, column: usize, (row, down): (usize, f32), span: &Span) -> [f32; 4] {
        let (tiles, sky) = &self.seen.fine;
        let index = row * tiles.size[0] + column;
        let below = index + tiles.size[0];
        let [near, far] = span.depths;
        let through = math::approximations::exp(near - far);
        let opacities = span.depths.map(|depth| 1.0 - math::approximations::exp(-depth));
        let lit = match &self.scattered {
            Some(scattered) => mix(span.lit(scattered, index), span.lit(scattered, below), down),
            None => [0.0; 3],
        };
        let [once, endless] = [0, 1].map(|k| mix(sky[k][index], sky[k][below], down));
        // Up to opacity o rain shows `o (1 - o)` of what it scatters once, and `o^2` of what it scatters ever again: endless rain
        // is the sky.
        let again = opacities[0] + opacities[1];
        let sky: [f32; 3] = std::array::from_fn(|c| (once[c] + (endless[c] - once[c]) * again).max(0.0));
        let light: [f32; 3] = std::array::from_fn(|c| lit[c] + sky[c] * (1.0 - through));
        [light[0], light[1], light[2], through]
    }

    /// What a pixel near a lamp gets beside what is interpolated from the corners around it.
    fn halo(&self, halo: &Halo, x: usize, y: usize, slice: &DepthInterval, plate: Option<f64>) -> Option<[f32; 3]> {
        let pixel = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
        let range = self.range(pixel, slice, plate).filter(|range| range[0] < range[1])?;
        let line = self.view.camera.direction(pixel)?.normalize_or_zero();
        let place = pixel.as_vec2().to_array();
        let mut correction = [0.0_f32; 3];
        let span = self.span(range);
        let nearest = passes(halo.offset, line);
        for (corner, share) in halo.near.corners(place) {
            let factor = share * halo.passes[corner] / nearest;
            let lit = span.lit(&halo.sharp, corner);
            (0..3).for_each(|c| correction[c] += lit[c] * factor);
        }
        for (corner, share) in self.tiles().corners(place) {
            let lit = span.lit(&halo.scattered, corner);
            (0..3).for_each(|c| correction[c] -= lit[c] * share);
        }
        Some(correction)
    }

    /// Adds to the rows of a band what pixels near lamps get.
    fn add_halos(&self, slice: &DepthInterval, rows: Rect, strip: &mut Strip) {
        for halo in &self.halos {
            let rect = halo.rect.intersection(&rows);
            for y in rect.y..rect.bottom() {
                for x in rect.x..rect.right() {
                    let away = (DVec2::new(x as f64 + 0.5, y as f64 + 0.5) - halo.pixel).length() / HALO;
                    let index = (y - strip.rect.y) * strip.rect.width + x - strip.rect.x;
                    let plate = strip.has_plate().then(|| f64::from(strip.plate_depth(index)));
                    let fade = 1.0 - math::smoothstep(0.6, 1.0, away) as f32;
                    let Some(light) = self.halo(halo, x, y, slice, plate).filter(|_| fade > 0.0) else { continue };
                    // The veil before it lies in the strip's transmittance too; it takes little.
                    (0..3)
                        .for_each(|c| strip.radiance[c][index] = (strip.radiance[c][index] + fade * light[c]).max(0.0));
                }
            }
        }
    }

    /// Distances between which a place of the picture sees the veil in a slice, behind a `plate` (depth, m) nothing.
    fn range(&self, pixel: DVec2, slice: &DepthInterval, plate: Option<f64>) -> Option<[f64; 2]> {
        let hidden = plate.unwrap_or(f64::INFINITY);
        let end = if plate.is_some() { self.end } else { self.distances[self.distances.len() - 1] };
        let camera = &self.view.camera;
        let direction = camera.direction(pixel)?;
        let length = direction.length();
        let ground = (camera.position.y - self.ground) / -direction.y;
        let far = slice.far.min(hidden).min(if ground > 0.0 { ground } else { f64::INFINITY });
        // Seen in a mirror, the camera stands beneath the ground and rain begins there.
        let beneath = camera.position.y < self.ground;
        let near = if beneath { slice.near.max(ground) } else { slice.near };
        let far = if beneath { slice.far.min(hidden) } else { far };
        (!beneath || ground > 0.0).then(|| [near, far].map(|depth| (depth * length).min(end)))
    }

    /// Draws the rows of a band that lie in `rows`, behind what the strip holds.
    pub(crate) fn draw(&self, slice: &DepthInterval, band: usize, rows: Rect, strip: &mut Strip) {
        if strip.has_plate() {
            self.draw_before_plate(slice, rows, strip);
        } else {
            dispatch!(self.level, _simd => self.draw_open(slice, band, rows, strip));
        }
        self.add_halos(slice, rows, strip);
    }

    /// Nothing but the ground ends the veil: it is found at the corners of tiles.
    #[inline(always)]
    fn draw_open(&self, slice: &DepthInterval, band: usize, rows: Rect, strip: &mut Strip) {
        let side = self.tiles().side;
        let columns = rows.x / side..rows.right().div_ceil(side) + 1;
        let edge = |y: f64| -> Vec<[f32; 4]> {
            let place = self.tiles().row_at(y as f32);
            let corner = |column: usize| {
                let range = self.range(DVec2::new((column * side) as f64, y), slice, None);
                range.map_or([0.0, 0.0, 0.0, 1.0], |range| self.between(column, place, &self.span(range)))
            };
            columns.clone().map(corner).collect()
        };
        let edges = [edge((band * BAND) as f64), edge(((band + 1) * BAND) as f64)];
        for y in rows.y..rows.bottom() {
            let down = ((y - band * BAND) as f32 + 0.5) / BAND as f32;
            let corner = |column: usize, c: usize| {
                let (top, bottom) = (edges[0][column][c], edges[1][column][c]);
                (bottom - top).fma(down, top)
            };
            let start = (y - strip.rect.y) * strip.rect.width;
            for column in 0..edges[0].len() - 1 {
                let left = (columns.start + column) * side;
                let shown = left.max(rows.x)..(left + side).min(rows.right());
                let mut values = [[0.0_f32; FINE]; 4];
                for (c, values) in values.iter_mut().enumerate() {
                    let (from, to) = (corner(column, c), corner(column + 1, c));
                    for (x, value) in values.iter_mut().enumerate() {
                        *value = (to - from).fma((x as f32 + 0.5) * (1.0 / FINE as f32), from);
                    }
                }
                values[3].iter_mut().for_each(|through| *through = 1.0 - *through);
                let [red, green, blue, opacity] =
                    values.each_ref().map(|row| &row[shown.start - left..shown.end - left]);
                let first = start + shown.start - strip.rect.x;
                strip.add_row_behind(first, [red, green, blue], Some(opacity), &NOWHERE[..shown.len()]);
            }
        }
    }

    /// A plate may end the veil anywhere, so every pixel finds its own.
    fn draw_before_plate(&self, slice: &DepthInterval, rows: Rect, strip: &mut Strip) {
        for y in rows.y..rows.bottom() {
            let place = self.tiles().row_at(y as f32 + 0.5);
            for x in rows.x..rows.right() {
                let index = (y - strip.rect.y) * strip.rect.width + x - strip.rect.x;
                let pixel = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                let Some(range) = self.range(pixel, slice, Some(f64::from(strip.plate_depth(index)))) else { continue };
                if range[1] <= range[0] {
                    continue;
                }
                let side = self.tiles().side;
                let column = x / side;
                let across = ((x % side) as f32 + 0.5) / side as f32;
                let span = self.span(range);
                let [left, right] = [column, column + 1].map(|column| self.between(column, place, &span));
                put(strip, index, std::array::from_fn(|c| (right[c] - left[c]).fma(across, left[c])));
            }
        }
    }
}

#[inline(always)]
fn put(strip: &mut Strip, index: usize, [red, green, blue, through]: [f32; 4]) {
    strip.add_row_behind(index, [&[red], &[green], &[blue]], Some(&[1.0 - through]), &[f32::INFINITY]);
}

/// Single scattering of lamps along a line of sight.
struct March<'a> {
    lighting: &'a Lighting<'a>,
    density: Density<'a>,
    eye: DVec3,
    distances: &'a [f64],
    depths: &'a [f32],
    /// Light from beyond it is left out, m.
    end: f64,
}

impl March<'_> {
    /// Lamps in and around the picture with their places, and all other lights.
    fn divide(&self, view: &View) -> (Vec<(Light, DVec2)>, Vec<Light>) {
        let (mut shown, mut others) = (Vec::new(), Vec::new());
        for light in self.lighting.lights {
            let place = match light.emitter {
                Emitter::Point { position, .. } | Emitter::Spot { position, .. } => view.camera.project(position),
                Emitter::Directional { .. } => None,
            };
            let near = |pixel: DVec2| (0..2).all(|axis| (-HALO..view.size[axis] as f64 + HALO).contains(&pixel[axis]));
            match place.map(|place| place.pixel).filter(|pixel| near(*pixel)) {
                Some(pixel) if shown.len() < MOST_HALOS => shown.push((*light, pixel)),
                _ => others.push(*light),
            }
        }
        (shown, others)
    }

    fn halo(&self, light: &Light, pixel: DVec2, tiles: &Tiles, view: &View) -> Halo {
        let offset = match light.emitter {
            Emitter::Point { position, .. } | Emitter::Spot { position, .. } => position - self.eye,
            Emitter::Directional { toward } => toward,
        };
        let rect = around(pixel, view.size);
        let near = Tiles::over(view, FINEST, rect);
        let [scattered, sharp] = [tiles, &near].map(|tiles| {
            let lines = tiles.map(|_, line| self.line(line, std::slice::from_ref(light)));
            Scattered::new(&lines, self.distances.len())
        });
        let passes = near.lines.iter().map(|line| passes(offset, *line)).collect();
        Halo { offset, pixel, rect, scattered, near, sharp, passes }
    }

    /// Light of some lamps scattered to the camera up to each distance.
    fn line(&self, line: DVec3, lights: &[Light]) -> Vec<[f32; 3]> {
        let mut sums = vec![[0.0; 3]; self.distances.len()];
        if line == DVec3::ZERO {
            return sums;
        }
        for light in lights {
            let mut sum = [0.0_f32; 3];
            for k in 0..self.distances.len() - 1 {
                let lit = self.distances[k] < self.end;
                let part = if lit { self.segment(light, line, k) } else { [0.0; 3] };
                for c in 0..3 {
                    sum[c] += part[c];
                    sums[k + 1][c] += sum[c];
                }
            }
        }
        sums
    }

    /// Light of one lamp scattered between two distances: `integral of beta E p / (4 pi) e^-tau ds`.
    fn segment(&self, light: &Light, line: DVec3, k: usize) -> [f32; 3] {
        let [from, to] = [self.distances[k], self.distances[k + 1]];
        let position = match light.emitter {
            Emitter::Directional { .. } => return self.sample(light, line, 0.5 * (from + to), to - from, k),
            Emitter::Point { position, .. } | Emitter::Spot { position, .. } => position,
        };
        // Evenly spaced in the angle seen from the lamp: there ds / r^2 is the angle's step over the nearest distance h, so the
        // peak near the lamp costs nothing (Kulla & Fajardo 2012).
        let nearest = (position - self.eye).dot(line);
        let h = (position - self.eye - line * nearest).length().max(SMALLEST_LAMP);
        let [first, last] = [from, to].map(|s| math::atan((s - nearest) / h));
        let samples = ((last - first) / ANGLE).ceil().max(1.0);
        let step = (last - first) / samples;
        (0..samples as usize).fold([0.0; 3], |sum: [f32; 3], index| {
            let offset = h * math::tan(first + step * (index as f64 + 0.5));
            let length = step * (h * h + offset * offset) / h;
            let part = self.sample(light, line, nearest + offset, length, k);
            std::array::from_fn(|c| sum[c] + part[c])
        })
    }

    /// Light scattered on `length` of the line around a distance.
    fn sample(&self, light: &Light, line: DVec3, at: f64, length: f64, k: usize) -> [f32; 3] {
        let point = self.eye + line * at;
        let density = self.density.at(at);
        if density <= 0.0 || point.y < self.density.moment.ground {
            return [0.0; 3];
        }
        let radiance = self.lighting.radiance(light, point, line);
        let share = ((at - self.distances[k]) / (self.distances[k + 1] - self.distances[k])) as f32;
        let depth = self.depths[k] + (self.depths[k + 1] - self.depths[k]) * share;
        let scale = math::approximations::exp(-depth) * (density * length) as f32;
        radiance.map(|value| value * scale)
    }
}
