//! Gas along rays through the nodes of a grid in the picture, from which the pixels between them are interpolated.
//!
//! A cell of the gas is some pixels wide, and splines through it are smooth, so that neighboring pixels look up nearly the same gas. It is looked up along rays at
//! most half a cell apart, at points that are a multiple of a step from the camera, and interpolated by the cubic convolution of Keys (1981) first along rows and
//! then along columns. The light is computed from it at each pixel, as sharp as before. Nodes are at fixed places of the whole picture.

use std::ops::Range;

use bansho_base::math::{
    DVec2, DVec3, Vec3,
    simd::{LANES, Lanes, Real},
};
use fearless_simd::{Simd, prelude::*};

use super::{
    blocks::BlockContents,
    rays::{GasRays, MOST_TIME_SAMPLES, Ray, STRIDE},
};

/// Pixels of a tile along x. Tiles are at multiples of it in the picture.
pub(crate) const TILE: usize = 64;
/// Vectors in a row of a tile.
pub(crate) const PACKETS: usize = TILE / LANES;
/// Points of a stride of a row of nodes, with its beginning.
pub(crate) const SLOTS: usize = STRIDE + 1;
/// Fields of a stride: the light on smoke, the fading of all gas, and the extinction coefficient of smoke.
pub(crate) const STRIDE_FIELDS: usize = LIGHT_FIELDS + 2;
/// Those of the light on smoke.
const LIGHT_FIELDS: usize = 3;
/// Strides with the same light on smoke, which is smooth.
const LIGHT_STRIDES: usize = 2;
/// Most fields at a point: two for each time sample, and one more.
pub(crate) const MOST_FIELDS: usize = 2 * MOST_TIME_SAMPLES + 1;
/// Most nodes from which a vector of pixels is interpolated: every second pixel is a node.
const MOST_TAPS: usize = LANES / 2 + 4;

/// Weights of the cubic convolution of Keys (1981) for four nodes at a fraction of the way from the second to the third.
#[inline(always)]
fn cubic_weights(t: f32) -> [f32; 4] {
    let rest = 1.0 - t;
    [-0.5 * t * rest * rest, 1.0 + t * t * (1.5 * t - 2.5), 1.0 + rest * rest * (1.5 * rest - 2.5), -0.5 * rest * t * t]
}

/// Rows of nodes of a pixel row: the first one, and weights. Only the first counts where every pixel is a node.
pub(crate) fn row_weights(y: usize, node_pixels: usize) -> (isize, [f32; 4]) {
    if node_pixels == 1 {
        return (y as isize, [1.0, 0.0, 0.0, 0.0]);
    }
    let fraction = (y % node_pixels) as f32 / node_pixels as f32;
    ((y / node_pixels) as isize - 1, cubic_weights(fraction))
}

/// Number of rows of nodes from which a row of pixels is interpolated.
pub(crate) fn row_taps(node_pixels: usize) -> usize {
    if node_pixels == 1 { 1 } else { 4 }
}

/// The nodes of a tile along x, and how its pixels are interpolated from them.
pub(crate) struct NodeColumns {
    columns: Range<isize>,
    /// For each vector of pixels its first node; and for each node from there on the weight in each pixel.
    first: [usize; PACKETS],
    taps: usize,
    weights: Vec<[f32; LANES]>,
}

impl NodeColumns {
    /// Those of the tile whose first pixel is `x`.
    pub(crate) fn new(x: usize, node_pixels: usize) -> Self {
        if node_pixels == 1 {
            let columns = x as isize..(x + TILE) as isize;
            return Self { columns, first: [0; PACKETS], taps: 0, weights: Vec::new() };
        }
        let node = |pixel: usize| (pixel / node_pixels) as isize;
        let columns = node(x) - 1..node(x + TILE - 1) + 3;
        let taps = MOST_TAPS.min((LANES - 1) / node_pixels + 5);
        let mut weights = vec![[0.0; LANES]; PACKETS * taps];
        let mut first = [0; PACKETS];
        for (packet, weights) in weights.chunks_mut(taps).enumerate() {
            let pixel = x + packet * LANES;
            first[packet] = (node(pixel) - 1 - columns.start) as usize;
            for lane in 0..LANES {
                let fraction = ((pixel + lane) % node_pixels) as f32 / node_pixels as f32;
                let tap = (node(pixel + lane) - node(pixel)) as usize;
                for (weights, weight) in weights[tap..tap + 4].iter_mut().zip(cubic_weights(fraction)) {
                    weights[lane] = weight;
                }
            }
        }
        Self { columns, first, taps, weights }
    }

    fn len(&self) -> usize {
        self.columns.len()
    }

    /// Interpolates pixels from the values of nodes.
    #[inline(always)]
    fn interpolate<S: Simd>(&self, simd: S, values: &[f32], pixels: &mut [f32]) {
        if self.taps == 0 {
            pixels.copy_from_slice(&values[..TILE]);
            return;
        }
        for (packet, pixels) in pixels.chunks_exact_mut(LANES).enumerate() {
            let first = self.first[packet];
            let weights = &self.weights[packet * self.taps..][..self.taps];
            let mut sum = Lanes::splat(simd, 0.0);
            // Nodes behind the last one have weight 0.
            for (value, weights) in values[first..].iter().zip(weights) {
                sum = Lanes::from_slice(simd, weights).fma(sum.broadcast(*value), sum);
            }
            sum.store_slice(pixels);
        }
    }
}

/// A row of nodes of a tile, and the gas in one stride along their rays, interpolated along x.
pub(crate) struct NodeRow {
    /// Direction of the ray of each node, a unit vector in cells; 0 where the lens shows nothing.
    directions: Vec<DVec3>,
    /// Least and largest number of meters along the rays for each meter of depth.
    stretches: [f64; 2],
    /// What is seen at the beginning of each stride from the first one on.
    contents: Vec<BlockContents>,
    /// The stride whose end is known.
    known: Option<usize>,
    /// The number of strides whose light on smoke is known.
    lit: Option<usize>,
    /// Values by field and node.
    values: Vec<f32>,
    /// Values by point, field and pixel.
    pub(crate) gas: Vec<f32>,
    /// Values in the middle of the stride by field and pixel.
    pub(crate) stride: Vec<f32>,
}

impl NodeRow {
    /// The row `y` of nodes of a tile.
    pub(crate) fn new(rays: &GasRays, columns: &NodeColumns, y: isize) -> Self {
        let at = |node: isize| (node * rays.node_pixels as isize) as f64 + 0.5;
        let mut stretches = [f64::INFINITY, 0.0_f64];
        let directions = columns.columns.clone().map(|x| {
            let Some(direction) = rays.camera.direction(DVec2::new(at(x), at(y))) else { return DVec3::ZERO };
            let stretch = direction.length();
            stretches = [stretches[0].min(stretch), stretches[1].max(stretch)];
            direction / stretch
        });
        Self {
            directions: directions.collect(),
            stretches,
            contents: Vec::new(),
            known: None,
            lit: None,
            values: Vec::new(),
            gas: Vec::new(),
            stride: Vec::new(),
        }
    }

    /// Distances between which the rays are in a box (in cells) and between two depths (m), in strides; `None` if they miss it.
    pub(crate) fn strides(&self, rays: &GasRays, corners: [DVec3; 2], [near, far]: [f64; 2]) -> Option<[f64; 2]> {
        let origin = rays.field.point_in_grid(rays.camera.position);
        let spacing = rays.field.grid.spacing;
        // Rays between nodes may be a little shorter or longer.
        let range = [0.999 * near * self.stretches[0] / spacing, 1.001 * far * self.stretches[1] / spacing];
        let mut all: Option<[f64; 2]> = None;
        for direction in self.directions.iter().filter(|direction| **direction != DVec3::ZERO) {
            let ray = Ray { origin, direction: *direction, stretch: 1.0 };
            if let Some(cells) = ray.clipped(corners[0], corners[1], range) {
                let own = cells.map(|cells| cells / (STRIDE as f64 * rays.step));
                all = Some(all.map_or(own, |[first, last]| [first.min(own[0]), last.max(own[1])]));
            }
        }
        all
    }

    /// Finds what is seen from the beginning of the first of `strides` to the end of the last one.
    pub(crate) fn find_contents(&mut self, rays: &GasRays, strides: Range<usize>) {
        let origin = rays.field.point_in_grid(rays.camera.position);
        let contents = (strides.start..=strides.end).map(|stride| {
            let distance = (stride * STRIDE) as f64 * rays.step;
            let at = |direction: &DVec3| rays.field.blocks.at((origin + *direction * distance).as_vec3());
            let seen = self.directions.iter().filter(|direction| **direction != DVec3::ZERO).map(at);
            seen.max().unwrap_or_default()
        });
        self.contents = contents.collect();
    }

    /// What is seen in a stride, counted from the first one.
    pub(crate) fn contents(&self, stride: usize) -> BlockContents {
        self.contents[stride].max(self.contents[stride + 1])
    }

    /// Looks the gas up at all points of a stride.
    #[inline(always)]
    pub(crate) fn look_up_sheet<S: Simd>(&mut self, simd: S, rays: &GasRays, columns: &NodeColumns, stride: usize) {
        let fields = 2 * rays.times.count + 1;
        let slot_len = fields * TILE;
        self.gas.resize(SLOTS * slot_len, 0.0);
        let first = if self.known == Some(stride) {
            self.gas.copy_within(STRIDE * slot_len.., 0);
            1
        } else {
            0
        };
        let origin = rays.field.point_in_grid(rays.camera.position);
        let nodes = columns.len();
        self.values.resize(fields * nodes, 0.0);
        let values = &mut self.values[..fields * nodes];
        for slot in first..SLOTS {
            let distance = (stride * STRIDE + slot) as f64 * rays.step;
            for (node, direction) in self.directions.iter().enumerate() {
                let point = (origin + *direction * distance).as_vec3();
                let samples = rays.gas_samples(simd, point, rays.field.blocks.at(point) == BlockContents::Sheet);
                values[node] = samples[0].mixtures[0];
                for (sample, gas) in samples[..rays.times.count].iter().enumerate() {
                    values[(1 + sample) * nodes + node] = gas.mixtures[1];
                    values[(1 + rays.times.count + sample) * nodes + node] = gas.deficit;
                }
            }
            for field in 0..fields {
                let pixels = &mut self.gas[slot * slot_len + field * TILE..][..TILE];
                columns.interpolate(simd, &values[field * nodes..(field + 1) * nodes], pixels);
            }
        }
        self.known = Some(stride + 1);
    }

    /// Looks up what is the same for a whole stride, and smoke in its middle if it is crossed at once.
    #[inline(always)]
    pub(crate) fn look_up_stride<S: Simd>(
        &mut self,
        simd: S,
        rays: &GasRays,
        columns: &NodeColumns,
        stride: usize,
        has_smoke: bool,
    ) {
        self.stride.resize(STRIDE_FIELDS * TILE, 0.0);
        let nodes = columns.len();
        let mut values = [0.0; STRIDE_FIELDS * TILE];
        // Lights are those in the middle of strides whose number is a multiple, so that slices do not change them.
        let lit = stride / LIGHT_STRIDES;
        if rays.smoke_light.is_some() && self.lit != Some(lit) {
            for (node, point) in self.points(rays, (lit as f64 + 0.5) * LIGHT_STRIDES as f64).enumerate() {
                for (field, value) in rays.smoke_radiance(simd, point).into_iter().enumerate() {
                    values[field * nodes + node] = value;
                }
            }
            self.interpolate(simd, columns, &values, 0..LIGHT_FIELDS);
            self.lit = Some(lit);
        }
        for (node, point) in self.points(rays, stride as f64 + 0.5).enumerate() {
            let fading = rays.field.fading(point);
            values[LIGHT_FIELDS * nodes + node] = fading;
            if has_smoke {
                values[(LIGHT_FIELDS + 1) * nodes + node] = rays.smoke(simd, point) * fading;
            }
        }
        self.interpolate(simd, columns, &values, LIGHT_FIELDS..STRIDE_FIELDS);
    }

    /// The points of all nodes at a distance in strides, in cells.
    #[inline(always)]
    fn points(&self, rays: &GasRays, strides: f64) -> impl Iterator<Item = Vec3> {
        let origin = rays.field.point_in_grid(rays.camera.position);
        let distance = strides * STRIDE as f64 * rays.step;
        self.directions.iter().map(move |direction| (origin + *direction * distance).as_vec3())
    }

    /// Interpolates fields of a stride from the values of nodes.
    #[inline(always)]
    fn interpolate<S: Simd>(&mut self, simd: S, columns: &NodeColumns, values: &[f32], fields: Range<usize>) {
        let nodes = columns.len();
        for field in fields {
            let pixels = &mut self.stride[field * TILE..][..TILE];
            columns.interpolate(simd, &values[field * nodes..(field + 1) * nodes], pixels);
        }
    }
}
