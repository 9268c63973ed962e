//! Rays through the gas, sixteen neighboring pixels together.

use bansho_base::{
    image::Rect,
    math::{
        DVec2, DVec3,
        simd::{LANES, LaneArray, Lanes, Real, any_positive},
    },
};
use fearless_simd::{Simd, prelude::*};

use super::{
    blocks::BlockContents,
    nodes::{MOST_FIELDS, NodeColumns, NodeRow, PACKETS, SLOTS, STRIDE_FIELDS, TILE, row_taps, row_weights},
    optics::{Exponential, GasSample, LEAST_SEEN},
    rays::{GasRays, Gathered, MOST_TIME_SAMPLES, OPAQUE, STRIDE},
};

/// Sixteen rays through neighboring pixels of a row, and what they have gathered.
#[derive(Clone, Debug)]
struct RayPacket {
    /// Distances between which they gather, m; both 0 for rays that are not drawn.
    near: LaneArray,
    far: LaneArray,
    /// Depth for each meter along the ray.
    depth_per_distance: LaneArray,
    /// Directions in cells, for motion.
    directions: [DVec3; LANES],
    transmittance: [LaneArray; MOST_TIME_SAMPLES],
    luminance: LaneArray,
    luminance_kelvin: LaneArray,
    blue: LaneArray,
    scattered: [LaneArray; 3],
    depth: LaneArray,
    optical_depth: LaneArray,
    motion: [LaneArray; 4],
    is_finished: bool,
}

/// A row of pixels of a tile.
struct TileRow {
    packets: Vec<RayPacket>,
    /// The first of its rows of nodes, counted from that of the tile, and their weights.
    first_node_row: usize,
    weights: [f32; 4],
}

/// The pixels of a tile that are drawn, and how far.
pub(crate) struct TilePart<'a> {
    /// Within a tile and a strip.
    pub(crate) rect: Rect,
    /// Nearest and farthest depth, m.
    pub(crate) depths: [f64; 2],
    /// Depth of what hides gas at a pixel of the picture, m.
    pub(crate) plate_depth: &'a dyn Fn(usize, usize) -> f32,
    /// Whether the motion of gas is wanted.
    pub(crate) has_motion: bool,
}

impl GasRays<'_> {
    /// What the rays of a part of a tile gather, row by row; `None` if there is nothing.
    #[inline(always)]
    pub(crate) fn gather_tile<S: Simd>(&self, simd: S, part: &TilePart) -> Option<Vec<Gathered>> {
        let corners = self.field.blocks.seen_corners()?;
        let tile_x = part.rect.x / TILE * TILE;
        let columns = NodeColumns::new(tile_x, self.node_pixels);
        let (first_row, _) = row_weights(part.rect.y, self.node_pixels);
        let (last_row, _) = row_weights(part.rect.bottom() - 1, self.node_pixels);
        let taps = row_taps(self.node_pixels);
        let end_row = last_row + taps as isize;
        let mut node_rows: Vec<NodeRow> = (first_row..end_row).map(|row| NodeRow::new(self, &columns, row)).collect();
        let strides = node_rows
            .iter()
            .filter_map(|row| row.strides(self, corners, part.depths))
            .reduce(|all, row| [all[0].min(row[0]), all[1].max(row[1])])?;
        let (first_stride, end_stride) = (strides[0].floor() as usize, strides[1].ceil() as usize);
        node_rows.iter_mut().for_each(|row| row.find_contents(self, first_stride..end_stride));
        // What is seen between two rows of nodes is what is seen at either of them.
        let between = if self.node_pixels == 1 { 0..1 } else { 1..3 };
        let contents = |rows: &[NodeRow], first: usize, stride: usize| {
            rows[first + between.start..first + between.end]
                .iter()
                .map(|row| row.contents(stride - first_stride))
                .max()
                .unwrap_or_default()
        };
        let first_node_rows = 0..node_rows.len() + 1 - taps;
        let is_seen = |stride: usize| {
            first_node_rows.clone().any(|first| contents(&node_rows, first, stride) > BlockContents::Nothing)
        };
        let seen: Vec<usize> = (first_stride..end_stride).filter(|stride| is_seen(*stride)).collect();
        if seen.is_empty() {
            return None;
        }
        let mut rows: Vec<TileRow> =
            (part.rect.y..part.rect.bottom()).map(|y| self.tile_row(part, tile_x, y, first_row)).collect();
        for stride in seen {
            let seen_rows: Vec<BlockContents> =
                first_node_rows.clone().map(|first| contents(&node_rows, first, stride)).collect();
            for (index, row) in node_rows.iter_mut().enumerate() {
                let users = index.saturating_sub(taps - 1)..(index + 1).min(seen_rows.len());
                let has = |contents| seen_rows[users.clone()].contains(&contents);
                let (has_sheet, has_smoke) = (has(BlockContents::Sheet), has(BlockContents::Smoke));
                if has_sheet {
                    row.look_up_sheet(simd, self, &columns, stride);
                }
                if has_sheet || has_smoke {
                    row.look_up_stride(simd, self, &columns, stride, has_smoke);
                }
            }
            for row in &mut rows {
                let nodes = &node_rows[row.first_node_row..row.first_node_row + taps];
                match seen_rows[row.first_node_row] {
                    BlockContents::Sheet => self.cross_sheets(simd, part, row, nodes, stride),
                    BlockContents::Smoke => self.cross_smoke(simd, row, nodes, stride),
                    BlockContents::Nothing => {}
                }
            }
            if rows.iter().all(|row| row.packets.iter().all(|packet| packet.is_finished)) {
                break;
            }
        }
        let x = part.rect.x - tile_x;
        let gathered = rows.iter().flat_map(|row| {
            (x..x + part.rect.width).map(|x| row.packets[x / LANES].gathered(x % LANES, self.times.count))
        });
        Some(gathered.collect())
    }

    fn tile_row(&self, part: &TilePart, tile_x: usize, y: usize, first_row: isize) -> TileRow {
        let (first_node_row, weights) = row_weights(y, self.node_pixels);
        let packets = (0..PACKETS).map(|packet| self.packet(part, tile_x + packet * LANES, y)).collect();
        TileRow { packets, first_node_row: (first_node_row - first_row) as usize, weights }
    }

    /// The rays from pixel `x` on.
    fn packet(&self, part: &TilePart, x: usize, y: usize) -> RayPacket {
        let mut packet = RayPacket::new();
        let drawn = x.max(part.rect.x)..(x + LANES).min(part.rect.right());
        packet.is_finished = drawn.is_empty();
        for pixel in drawn {
            let Some(ray) = self.ray(DVec2::new(pixel as f64 + 0.5, y as f64 + 0.5)) else { continue };
            let [near, far] = part.depths;
            let far = far.min(f64::from((part.plate_depth)(pixel, y)));
            let Some(depths) = ray.above_bottom([near, far]) else { continue };
            let lane = pixel - x;
            let [near, far] = depths.map(|depth| (depth * ray.stretch) as f32);
            (packet.near[lane], packet.far[lane]) = (near, far);
            packet.depth_per_distance[lane] = (1.0 / ray.stretch) as f32;
            packet.directions[lane] = ray.direction / ray.stretch;
        }
        packet
    }

    /// Crosses a stride from step to step.
    #[inline(always)]
    fn cross_sheets<S: Simd>(&self, simd: S, part: &TilePart, row: &mut TileRow, nodes: &[NodeRow], stride: usize) {
        let samples = self.times.count;
        let fields = 2 * samples + 1;
        let zero = Lanes::splat(simd, 0.0);
        let least_burning = zero.broadcast(LEAST_SEEN * self.optics.mixture.stoichiometric);
        for (index, packet) in row.packets.iter_mut().enumerate() {
            let Some([from, to]) = packet.overlap(simd, self.step_m(), stride * STRIDE, STRIDE) else { continue };
            if !any_positive(to - from) {
                continue;
            }
            let offset = index * LANES;
            let [red, green, blue, fading, _] = interpolated_stride(simd, nodes, &row.weights, offset);
            let fading = fading.simd_clamp01();
            let radiance = [red, green, blue];
            let mut before = [zero; MOST_FIELDS];
            interpolate_slot(simd, nodes, &row.weights, fields, 0, offset, &mut before);
            for slot in 1..SLOTS {
                let mut here = [zero; MOST_FIELDS];
                interpolate_slot(simd, nodes, &row.weights, fields, slot, offset, &mut here);
                let number = stride * STRIDE + slot;
                let Some([from, to]) = packet.overlap(simd, self.step_m(), number - 1, 1) else { continue };
                let way = Way { meters: to - from, fading, begin: from };
                for sample in 0..samples {
                    let first = GasSample {
                        mixtures: [before[sample], before[sample + 1]],
                        deficit: before[samples + 1 + sample],
                    };
                    let last =
                        GasSample { mixtures: [here[sample], here[sample + 1]], deficit: here[samples + 1 + sample] };
                    let largest = first.mixtures[0]
                        .simd_max(first.mixtures[1])
                        .simd_max(last.mixtures[0].simd_max(last.mixtures[1]));
                    if any_positive(largest - least_burning) {
                        self.cross_burning(part, packet, sample, &first, &last, &way, &radiance);
                    } else if self.optics.smoke_extinction > 0.0 {
                        let smoke = self.optics.smoke_between(&first, &last) * fading;
                        packet.add_smoke(sample, samples, smoke, &way, &radiance);
                    }
                }
                before = here;
            }
            packet.finish_if_opaque(simd, samples);
        }
    }

    /// Adds gas that may burn.
    #[inline(always)]
    fn cross_burning<S: Simd>(
        &self,
        part: &TilePart,
        packet: &mut RayPacket,
        sample: usize,
        first: &GasSample<Lanes<S>>,
        last: &GasSample<Lanes<S>>,
        way: &Way<S>,
        radiance: &[Lanes<S>; 3],
    ) {
        let simd = way.meters.simd;
        let zero = Lanes::splat(simd, 0.0);
        let one = zero.broadcast(1.0);
        let weight = zero.broadcast(1.0 / self.times.count as f32);
        let crossing = self.optics.crossing(first, last);
        let (soot, smoke) = (crossing.soot * way.fading, crossing.smoke * way.fading);
        let extinction = soot + smoke;
        let optical_depth = extinction * way.meters;
        let transmittance = packet.transmittance(simd, sample);
        let is_seen = transmittance.select_lt(zero.broadcast(OPAQUE), zero, one);
        let opacity = one - (zero - optical_depth).simd_exp();
        let absorbed = transmittance * opacity * is_seen;
        let share = extinction.simd_max(zero.broadcast(f32::MIN_POSITIVE));
        let luminance = absorbed * (soot / share) * crossing.luminance * weight;
        let scattered = absorbed * (smoke / share) * weight;
        add(&mut packet.luminance, luminance);
        add(&mut packet.luminance_kelvin, luminance * crossing.kelvin);
        for c in 0..3 {
            add(&mut packet.scattered[c], scattered * radiance[c]);
        }
        let step = zero.broadcast((1.0 / self.step_m()) as f32);
        let blue = transmittance * is_seen * crossing.blue * way.fading * (way.meters * step) * weight;
        add(&mut packet.blue, blue);
        add(&mut packet.optical_depth, optical_depth * is_seen * weight);
        packet.see(optical_depth + blue, way);
        (transmittance - absorbed).store_slice(&mut packet.transmittance[sample]);
        if part.has_motion {
            self.add_motion(packet, luminance, way);
        }
    }

    /// Adds the motion of gas that shines.
    #[inline(always)]
    fn add_motion<S: Simd>(&self, packet: &mut RayPacket, luminance: Lanes<S>, way: &Way<S>) {
        let simd = luminance.simd;
        let mut luminances = [0.0; LANES];
        let mut distances = [0.0; LANES];
        luminance.store_slice(&mut luminances);
        (way.begin + way.meters).store_slice(&mut distances);
        let origin = self.field.point_in_grid(self.camera.position);
        for lane in 0..LANES {
            if luminances[lane] > 0.0 {
                let point = origin + packet.directions[lane] * f64::from(distances[lane]);
                let velocity = self.field.velocity(simd, point.as_vec3());
                for c in 0..3 {
                    packet.motion[c][lane] += luminances[lane] * velocity[c];
                }
                packet.motion[3][lane] += luminances[lane] * distances[lane] * packet.depth_per_distance[lane];
            }
        }
    }

    /// Crosses a stride of smoke at once.
    #[inline(always)]
    fn cross_smoke<S: Simd>(&self, simd: S, row: &mut TileRow, nodes: &[NodeRow], stride: usize) {
        let samples = self.times.count;
        for (index, packet) in row.packets.iter_mut().enumerate() {
            let Some([from, to]) = packet.overlap(simd, self.step_m(), stride * STRIDE, STRIDE) else { continue };
            let way = Way { meters: to - from, fading: to.broadcast(1.0), begin: from };
            if !any_positive(way.meters) {
                continue;
            }
            let [red, green, blue, _, smoke] = interpolated_stride(simd, nodes, &row.weights, index * LANES);
            for sample in 0..samples {
                packet.add_smoke(sample, samples, smoke, &way, &[red, green, blue]);
            }
            packet.finish_if_opaque(simd, samples);
        }
    }
}

/// A way along the rays of a packet.
struct Way<S: Simd> {
    /// Its length, m; 0 for rays that are not there.
    meters: Lanes<S>,
    /// Factor of all extinction.
    fading: Lanes<S>,
    /// Distance at which it begins, m.
    begin: Lanes<S>,
}

impl RayPacket {
    fn new() -> Self {
        const ZEROS: LaneArray = [0.0; LANES];
        Self {
            near: ZEROS,
            far: ZEROS,
            depth_per_distance: [1.0; LANES],
            directions: [DVec3::ZERO; LANES],
            transmittance: [[1.0; LANES]; MOST_TIME_SAMPLES],
            luminance: ZEROS,
            luminance_kelvin: ZEROS,
            blue: ZEROS,
            scattered: [ZEROS; 3],
            depth: [f32::INFINITY; LANES],
            optical_depth: ZEROS,
            motion: [ZEROS; 4],
            is_finished: false,
        }
    }

    /// The distances between which the rays gather within so many steps from one on, m; `None` once they are finished.
    #[inline(always)]
    fn overlap<S: Simd>(&self, simd: S, step_m: f64, first: usize, steps: usize) -> Option<[Lanes<S>; 2]> {
        if self.is_finished {
            return None;
        }
        let [begin, end] = [first, first + steps].map(|number| (number as f64 * step_m) as f32);
        let near = Lanes::from_slice(simd, &self.near);
        let far = Lanes::from_slice(simd, &self.far);
        let from = near.simd_max(near.broadcast(begin));
        Some([from, far.simd_min(far.broadcast(end)).simd_max(from)])
    }

    #[inline(always)]
    fn transmittance<S: Simd>(&self, simd: S, sample: usize) -> Lanes<S> {
        Lanes::from_slice(simd, &self.transmittance[sample])
    }

    /// Adds smoke of an extinction coefficient (1/m) to a time sample.
    #[inline(always)]
    fn add_smoke<S: Simd>(
        &mut self,
        sample: usize,
        samples: usize,
        smoke: Lanes<S>,
        way: &Way<S>,
        radiance: &[Lanes<S>; 3],
    ) {
        let simd = smoke.simd;
        let (zero, one) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
        let weight = zero.broadcast(1.0 / samples as f32);
        let optical_depth = smoke * way.meters;
        let transmittance = self.transmittance(simd, sample);
        let is_seen = transmittance.select_lt(zero.broadcast(OPAQUE), zero, one);
        let absorbed = transmittance * (one - (zero - optical_depth).simd_exp()) * is_seen;
        for c in 0..3 {
            add(&mut self.scattered[c], absorbed * weight * radiance[c]);
        }
        add(&mut self.optical_depth, optical_depth * is_seen * weight);
        self.see(optical_depth, way);
        (transmittance - absorbed).store_slice(&mut self.transmittance[sample]);
    }

    /// Records the depth of the first gas.
    #[inline(always)]
    fn see<S: Simd>(&mut self, amount: Lanes<S>, way: &Way<S>) {
        let zero = amount.broadcast(0.0);
        let depth = way.begin * Lanes::from_slice(amount.simd, &self.depth_per_distance);
        let depth = zero.select_lt(amount, depth, zero.broadcast(f32::INFINITY));
        Lanes::from_slice(amount.simd, &self.depth).simd_min(depth).store_slice(&mut self.depth);
    }

    #[inline(always)]
    fn finish_if_opaque<S: Simd>(&mut self, simd: S, samples: usize) {
        let mut largest = Lanes::splat(simd, 0.0);
        for sample in 0..samples {
            largest = largest.simd_max(self.transmittance(simd, sample));
        }
        self.is_finished = !any_positive(largest - largest.broadcast(OPAQUE));
    }

    fn gathered(&self, lane: usize, samples: usize) -> Gathered {
        let transmittance = self.transmittance[..samples].iter().map(|values| values[lane]).sum::<f32>();
        Gathered {
            luminance: self.luminance[lane],
            luminance_kelvin: self.luminance_kelvin[lane],
            blue: self.blue[lane],
            scattered: self.scattered.map(|values| values[lane]),
            opacity: 1.0 - transmittance * (1.0 / samples as f32),
            depth: self.depth[lane],
            optical_depth: self.optical_depth[lane],
            motion: self.motion.map(|values| values[lane]),
        }
    }
}

#[inline(always)]
fn add<S: Simd>(sums: &mut LaneArray, values: Lanes<S>) {
    (Lanes::from_slice(values.simd, sums) + values).store_slice(sums);
}

/// The fields of gas at a point of a stride, interpolated between rows of nodes.
#[inline(always)]
fn interpolate_slot<S: Simd>(
    simd: S,
    nodes: &[NodeRow],
    weights: &[f32; 4],
    fields: usize,
    slot: usize,
    offset: usize,
    values: &mut [Lanes<S>; MOST_FIELDS],
) {
    for (field, value) in values[..fields].iter_mut().enumerate() {
        let place = (slot * fields + field) * TILE + offset;
        let mut sum = Lanes::splat(simd, 0.0);
        for (row, weight) in nodes.iter().zip(weights) {
            sum = Lanes::from_slice(simd, &row.gas[place..place + LANES]).fma(sum.broadcast(*weight), sum);
        }
        *value = sum;
    }
}

/// Smoke in the middle of a stride, interpolated between rows of nodes.
#[inline(always)]
fn interpolated_stride<S: Simd>(
    simd: S,
    nodes: &[NodeRow],
    weights: &[f32; 4],
    offset: usize,
) -> [Lanes<S>; STRIDE_FIELDS] {
    let mut values = [Lanes::splat(simd, 0.0); STRIDE_FIELDS];
    for (field, value) in values.iter_mut().enumerate() {
        let place = field * TILE + offset;
        for (row, weight) in nodes.iter().zip(weights) {
            *value = Lanes::from_slice(simd, &row.stride[place..place + LANES]).fma(value.broadcast(*weight), *value);
        }
        // Interpolation may give less than nothing.
        *value = value.simd_max(value.broadcast(0.0));
    }
    values
}
