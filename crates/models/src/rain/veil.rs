//! Rain that is not seen drop by drop: it greys what lies behind it and glows around lamps.

use bansho_base::{
    canvas::{DepthInterval, Strip, View},
    image::Rect,
    math::{self, DVec2, DVec3},
    surroundings::{Emitter, Light},
};

use super::{
    bands::BAND,
    light::{Lighting, distance},
    moment::Moment,
    tiles::{TILE, Tiles, geometric, mix},
};

/// Nearest distance at which the light that is scattered up to there is known, m, and how much further each next one is.
const FIRST: f64 = 0.5;
const RATIO: f64 = 1.25;
/// Angle, seen from a lamp, that one sample stands for.
const ANGLE: f64 = 0.15;
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
        self.extinction[0] - self.extinction[1] * self.moment.nearness(distance)
    }
}

/// Single scattering along the lines of sight of one frame.
pub(crate) struct Veil<'a> {
    view: &'a View,
    tiles: Tiles,
    /// Ascending from 0, m.
    distances: Vec<f64>,
    /// Optical depth up to each distance.
    depths: Vec<f32>,
    /// Light of lamps and fires scattered to the camera up to each distance, corner after corner.
    scattered: Vec<Vec<[f32; 3]>>,
    /// Light of the sky that all drops send to the camera, by corner.
    sky: Vec<[f32; 3]>,
    ground: f64,
}

impl<'a> Veil<'a> {
    /// The veil up to `end` (m) of drops with extinctions `[all, drawn as streaks]`; `None` where there is none.
    pub(crate) fn new(
        moment: &Moment,
        lighting: &Lighting,
        tiles: &Tiles,
        sky: Vec<[f32; 3]>,
        view: &'a View,
        extinction: [f64; 2],
        end: f64,
    ) -> Option<Self> {
        if end <= 0.0 || extinction[0] <= 0.0 {
            return None;
        }
        let density = Density { moment, extinction };
        let mut distances = geometric(FIRST.min(end), end, RATIO);
        distances.insert(0, 0.0);
        let last = distances.len() - 1;
        distances[last] = end;
        let mut depths = vec![0.0];
        for pair in distances.windows(2) {
            let depth = f64::from(depths[depths.len() - 1]);
            depths.push((depth + (pair[1] - pair[0]) * 0.5 * (density.at(pair[0]) + density.at(pair[1]))) as f32);
        }
        let march = March { lighting, density, eye: moment.sight.middle().position, distances: &distances, depths: &depths };
        let lines = tiles.map(|_, line| march.line(line));
        let scattered = (0..distances.len()).map(|k| lines.iter().map(|sums| sums[k]).collect()).collect();
        Some(Self { view, tiles: tiles.clone(), distances, depths, scattered, sky, ground: moment.ground })
    }

    /// Its end, m.
    fn end(&self) -> f64 {
        self.distances[self.distances.len() - 1]
    }

    /// Which distances a distance lies between, and how far from the first to the second.
    fn bracket(&self, distance: f64) -> (usize, f32) {
        let last = self.distances.len() - 1;
        let next = self.distances.partition_point(|known| *known <= distance).clamp(1, last);
        let (near, far) = (self.distances[next - 1], self.distances[next]);
        (next - 1, ((distance - near) / (far - near)).clamp(0.0, 1.0) as f32)
    }

    /// Light and transmittance between two distances at a corner column, `down` of the way from corner row `row` to the next.
    fn between(&self, column: usize, (row, down): (usize, f32), range: [f64; 2]) -> [f32; 4] {
        let index = row * self.tiles.size[0] + column;
        let below = index + self.tiles.size[0];
        let up_to = |distance: f64| {
            let (k, share) = self.bracket(distance);
            let at = |k: usize| mix(self.scattered[k][index], self.scattered[k][below], down);
            (mix(at(k), at(k + 1), share), (self.depths[k + 1] - self.depths[k]).mul_add(share, self.depths[k]))
        };
        let ((near, before), (far, after)) = (up_to(range[0]), up_to(range[1].max(range[0])));
        let through = math::f32::exp(before - after);
        let reach = math::f32::exp(before);
        let sky = mix(self.sky[index], self.sky[below], down);
        let light: [f32; 3] =
            std::array::from_fn(|c| (far[c] - near[c]).max(0.0).mul_add(reach, sky[c] * (1.0 - through)));
        [light[0], light[1], light[2], through]
    }

    /// Distances between which a place of the picture sees the veil in a slice, behind `hidden` (depth, m) nothing.
    fn range(&self, pixel: DVec2, slice: &DepthInterval, hidden: f64) -> Option<[f64; 2]> {
        let camera = &self.view.camera;
        let direction = camera.direction(pixel)?;
        let length = direction.length();
        let ground = (camera.position.y - self.ground) / -direction.y;
        let far = slice.far.min(hidden).min(if ground > 0.0 { ground } else { f64::INFINITY });
        // Seen in a mirror, the camera stands beneath the ground and rain begins there.
        let beneath = camera.position.y < self.ground;
        let near = if beneath { slice.near.max(ground) } else { slice.near };
        let far = if beneath { slice.far.min(hidden) } else { far };
        (!beneath || ground > 0.0).then(|| [near, far].map(|depth| (depth * length).min(self.end())))
    }

    /// Draws the rows of a band that lie in `rows`, behind what the strip holds.
    pub(crate) fn draw(&self, slice: &DepthInterval, band: usize, rows: Rect, strip: &mut Strip) {
        if strip.has_plate() {
            return self.draw_before_plate(slice, rows, strip);
        }
        let columns = rows.x / TILE..rows.right().div_ceil(TILE) + 1;
        let edge = |y: f64| -> Vec<[f32; 4]> {
            let place = self.tiles.row_at(y as f32);
            let corner = |column: usize| {
                let range = self.range(DVec2::new((column * TILE) as f64, y), slice, f64::INFINITY);
                range.map_or([0.0, 0.0, 0.0, 1.0], |range| self.between(column, place, range))
            };
            columns.clone().map(corner).collect()
        };
        let edges = [edge((band * BAND) as f64), edge(((band + 1) * BAND) as f64)];
        for y in rows.y..rows.bottom() {
            let down = ((y - band * BAND) as f32 + 0.5) / BAND as f32;
            let start = (y - strip.rect.y) * strip.rect.width;
            for x in rows.x..rows.right() {
                let across = ((x % TILE) as f32 + 0.5) / TILE as f32;
                let column = x / TILE - columns.start;
                let value: [f32; 4] = std::array::from_fn(|c| {
                    let at = |edge: &[[f32; 4]]| (edge[column + 1][c] - edge[column][c]).mul_add(across, edge[column][c]);
                    let (top, bottom) = (at(&edges[0]), at(&edges[1]));
                    (bottom - top).mul_add(down, top)
                });
                put(strip, start + x - strip.rect.x, value);
            }
        }
    }

    /// A plate may end the veil anywhere, so every pixel finds its own.
    fn draw_before_plate(&self, slice: &DepthInterval, rows: Rect, strip: &mut Strip) {
        for y in rows.y..rows.bottom() {
            let place = self.tiles.row_at(y as f32 + 0.5);
            for x in rows.x..rows.right() {
                let index = (y - strip.rect.y) * strip.rect.width + x - strip.rect.x;
                let pixel = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                let Some(range) = self.range(pixel, slice, f64::from(strip.plate_depth(index))) else { continue };
                if range[1] <= range[0] {
                    continue;
                }
                let column = x / TILE;
                let across = ((x % TILE) as f32 + 0.5) / TILE as f32;
                let (left, right) = (self.between(column, place, range), self.between(column + 1, place, range));
                put(strip, index, std::array::from_fn(|c| (right[c] - left[c]).mul_add(across, left[c])));
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
}

impl March<'_> {
    /// Light scattered to the camera up to each distance.
    fn line(&self, line: DVec3) -> Vec<[f32; 3]> {
        let mut sums = vec![[0.0; 3]; self.distances.len()];
        if line == DVec3::ZERO {
            return sums;
        }
        for light in self.lighting.lights {
            let mut sum = [0.0_f32; 3];
            for k in 0..self.distances.len() - 1 {
                let part = self.segment(light, line, k);
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
        let (illuminance, toward) = light.illuminance(point);
        if illuminance == [0.0; 3] || density <= 0.0 || point.y < self.density.moment.ground {
            return [0.0; 3];
        }
        let share = ((at - self.distances[k]) / (self.distances[k + 1] - self.distances[k])) as f32;
        let depth = (self.depths[k + 1] - self.depths[k]).mul_add(share, self.depths[k]);
        let through = math::f32::exp(-depth - (self.lighting.extinction * distance(light, point)) as f32);
        let phase = self.lighting.lens.phase(toward.dot(line) as f32);
        let scale = through * (density * length) as f32 * (0.25 / std::f32::consts::PI);
        std::array::from_fn(|c| illuminance[c] * phase[c] * scale)
    }
}
