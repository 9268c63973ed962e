//! Draws the ground into strips: its own light, and the picture in its mirror as puddles and waves show it.

use bansho_base::{
    camera::Lens,
    image::Rect,
    math::{
        DVec3,
        simd::{LANES, Lanes, Real},
    },
    phenomenon::{
        PlateRole, Prepared,
        strip::{DepthInterval, Strip},
    },
};
use fearless_simd::{dispatch, prelude::*};

use super::{
    LakeFrame,
    hits::{HORIZON, Hits},
    lake::WaveSlopes,
    lighting::array,
    parameters::GroundKind,
    row_cache::{CachedRows, GroundLightBatch},
    sample::SampledImage,
    sampled,
    shade::{PreparedGround, pixel_centers, wet_albedo_factor},
    surface::SurfaceSamples,
};

/// Which of sixteen pixels show ground in a slice.
struct Shown {
    opacity: [f32; LANES],
    /// Depth, m; infinite where no ground is shown.
    depth: [f32; LANES],
    any: bool,
}

impl PreparedGround<'_> {
    #[inline(always)]
    fn hits<S: Simd>(&self, simd: S, [x, y]: [usize; 2]) -> Hits<S> {
        Hits::new(simd, &self.view.camera, self.camera_height, x, y)
    }

    #[inline(always)]
    fn draw_rows<S: Simd>(&self, simd: S, slice: &DepthInterval, strip: &mut Strip) {
        let rect = strip.rect;
        for y in rect.y..rect.bottom() {
            if !self.row_depths.overlaps(y, slice) {
                continue;
            }
            // Batches begin at multiples of sixteen in the whole picture, whatever the strip.
            let mut x = rect.x / LANES * LANES;
            while x < rect.right() {
                self.draw_batch(simd, [x, y], slice, strip);
                x += LANES;
            }
        }
    }

    /// Draws the pixels from column `x` on in row `y`.
    #[inline(always)]
    fn draw_batch<S: Simd>(&self, simd: S, [x, y]: [usize; 2], slice: &DepthInterval, strip: &mut Strip) {
        let hits = self.hits(simd, [x, y]);
        if !hits.any() {
            return;
        }
        let rect = strip.rect;
        let inside = rect.x.max(x) - x..rect.right().min(x + LANES) - x;
        let first = (y - rect.y) * rect.width + x + inside.start - rect.x;
        let mut shown = Shown { opacity: [0.0; LANES], depth: [f32::INFINITY; LANES], any: false };
        let (coverage, depth) = (array(hits.coverage), array(hits.depth));
        for i in inside.clone() {
            if coverage[i] > 0.0 && slice.contains(f64::from(depth[i])) {
                self.show(i, first + i - inside.start, coverage[i], depth[i], strip, &mut shown);
            }
        }
        if !shown.any {
            return;
        }
        let mut light = self.light_of(simd, &hits, [x, y]);
        self.add_mirrored(simd, &hits, [x, y], &mut light);
        for c in 0..3 {
            for i in 0..LANES {
                light[c][i] = if shown.depth[i] < f32::INFINITY { light[c][i] } else { 0.0 };
            }
        }
        let [red, green, blue, _] = &light;
        let radiance = [&red[inside.clone()], &green[inside.clone()], &blue[inside.clone()]];
        strip.add_row_behind(first, radiance, Some(&shown.opacity[inside.clone()]), &shown.depth[inside]);
    }

    /// Marks the lane `i`, the pixel `index` of the strip, as shown, unless the ground is hidden there.
    #[inline(always)]
    fn show(&self, i: usize, index: usize, coverage: f32, depth: f32, strip: &Strip, shown: &mut Shown) {
        let opacity = if self.parameters.kind == GroundKind::Plate {
            if strip.has_plate() && !self.is_ground(f64::from(depth), f64::from(strip.plate_depth(index))) {
                return;
            }
            1.0 - wet_albedo_factor(self.wetness) as f32
        } else {
            if !strip.visible(index, depth) {
                return;
            }
            coverage
        };
        (shown.opacity[i], shown.depth[i], shown.any) = (opacity, depth, true);
    }

    /// Whether a plate with the depth `plate`, where the ground has another `depth`, shows ground: within the tolerance of the height, and within what
    /// a pixel resolves at grazing angles.
    fn is_ground(&self, depth: f64, plate: f64) -> bool {
        let above = self.camera_height * (1.0 - plate / depth);
        above.abs() < self.parameters.mirror().tolerance_at(plate, self.view.camera.focal_pixels)
    }

    /// The light of sixteen pixels, from an earlier frame if it is known.
    #[inline(always)]
    fn light_of<S: Simd>(&self, simd: S, hits: &Hits<S>, [x, y]: [usize; 2]) -> GroundLightBatch {
        let window = self.view.window;
        let (row, batch) = (y.wrapping_sub(window.y), x / LANES - window.x / LANES);
        match &self.cached_rows {
            CachedRows::Light(rows) => {
                if let Some(batches) = rows[row].get() {
                    return batches[batch];
                }
                // Computed before `get_or_init`, within which other threads would have to wait; two that compute the same row get the same numbers.
                let light = self.light_row(simd, y);
                rows[row].get_or_init(|| light)[batch]
            }
            CachedRows::Pattern(rows) => {
                if let Some(batches) = rows[row].get() {
                    return self.light(simd, hits, &batches[batch], [x, y]);
                }
                let samples = self.sample_row(simd, y);
                let samples = &rows[row].get_or_init(|| samples)[batch];
                self.light(simd, hits, samples, [x, y])
            }
            CachedRows::None => self.light(simd, hits, &self.samples(hits), [x, y]),
        }
    }

    /// The light of a row of the window.
    #[inline(always)]
    fn light_row<S: Simd>(&self, simd: S, y: usize) -> Vec<GroundLightBatch> {
        let window = self.view.window;
        let mut row = Vec::with_capacity(window.width / LANES + 2);
        let mut x = window.x / LANES * LANES;
        while x < window.right() {
            let hits = self.hits(simd, [x, y]);
            let mut light = [[0.0; LANES]; 4];
            if hits.any() {
                light = self.light(simd, &hits, &self.samples(&hits), [x, y]);
            }
            row.push(light);
            x += LANES;
        }
        row
    }

    /// The pattern of a row of the window.
    #[inline(always)]
    fn sample_row<S: Simd>(&self, simd: S, y: usize) -> Vec<SurfaceSamples> {
        let window = self.view.window;
        let mut row = Vec::with_capacity(window.width / LANES + 2);
        let mut x = window.x / LANES * LANES;
        while x < window.right() {
            let hits = self.hits(simd, [x, y]);
            row.push(if hits.any() { self.samples(&hits) } else { SurfaceSamples::NONE });
            x += LANES;
        }
        row
    }

    /// Adds the picture in the mirror.
    #[inline(always)]
    fn add_mirrored<S: Simd>(&self, simd: S, hits: &Hits<S>, pixel: [usize; 2], light: &mut GroundLightBatch) {
        let Some(reflection) = self.surroundings.reflection.filter(|_| self.wetness > 0.0) else { return };
        let weight = light[3];
        let mut largest = 0.0;
        for value in weight {
            largest = if value > largest { value } else { largest };
        }
        // Nothing is mirrored, as between puddles: sampling the picture is most of the work.
        if largest <= 0.0 {
            return;
        }
        let mirrored = match &self.lake {
            Some(lake) => self.mirrored_by_waves(simd, hits, lake, pixel),
            None => {
                let (xs, ys) = pixel_centers(pixel);
                sampled(reflection).at(simd, &xs, &ys)
            }
        };
        for c in 0..3 {
            for i in 0..LANES {
                light[c][i] = weight[i].fma(mirrored[c][i], light[c][i]);
            }
        }
    }

    /// The picture in the mirror as displaced by waves, and blurred by those too short to be resolved.
    #[inline(always)]
    fn mirrored_by_waves<S: Simd>(
        &self,
        simd: S,
        hits: &Hits<S>,
        lake: &LakeFrame,
        pixel: [usize; 2],
    ) -> [[f32; LANES]; 3] {
        let (xs, zs, footprint) = (array(hits.offset[0]), array(hits.offset[2]), array(hits.footprint));
        let slopes = lake.waves.slopes([&xs, &zs], &footprint);
        let (xs, ys) = pixel_centers(pixel);
        let sharp = sampled(lake.reflection);
        // The blur contains all directions of the unresolved waves, so it is sampled where the level water shows it, not displaced.
        let blurred = SampledImage { image: &lake.blurred_reflection, ..sharp }.at(simd, &xs, &ys);
        let (xs, ys) = self.reflected_pixels(simd, hits, &slopes, (xs, ys));
        let mut mirrored = sharp.at(simd, &xs, &ys);
        for c in 0..3 {
            for i in 0..LANES {
                let unresolved = slopes.unresolved[i];
                mirrored[c][i] = unresolved.fma(blurred[c][i], (1.0 - unresolved) * mirrored[c][i]);
            }
        }
        mirrored
    }

    /// The pixels of the mirrored picture that tilted waves show, for distant objects: the reflection turns by twice
    /// the tilt. Where the lens does not show them, those `straight` ahead.
    #[inline(always)]
    fn reflected_pixels<S: Simd>(
        &self,
        simd: S,
        hits: &Hits<S>,
        slopes: &WaveSlopes,
        (mut xs, mut ys): ([f32; LANES], [f32; LANES]),
    ) -> ([f32; LANES], [f32; LANES]) {
        let zero = Lanes::splat(simd, 0.0);
        let (sx, sz) = (Lanes::from_slice(simd, &slopes.resolved[0]), Lanes::from_slice(simd, &slopes.resolved[1]));
        let [vx, vy, vz] = hits.viewer;
        // Twice the component along the normal (-sx, 1, -sz), which is not of unit length, of the direction of view.
        let along = vx.fma(sx, vz.fma(sz, zero - vy)) * Lanes::splat(simd, 2.0)
            / sx.fma(sx, sz.fma(sz, Lanes::splat(simd, 1.0)));
        let x = along.fma(sx, zero - vx);
        // In the picture of the mirror up is down. A reflection that would point into the water is folded back.
        let y = zero - (zero - vy - along).simd_abs();
        let z = along.fma(sz, zero - vz);
        if self.view.camera.lens == Lens::Perspective {
            self.project_lanes(simd, [x, y, z], (&mut xs, &mut ys));
        } else {
            self.project_each([array(x), array(y), array(z)], (&mut xs, &mut ys));
        }
        (xs, ys)
    }

    /// The pixels in which a perspective camera shows infinitely distant points in directions, where it shows them.
    #[inline(always)]
    fn project_lanes<S: Simd>(
        &self,
        simd: S,
        directions: [Lanes<S>; 3],
        (xs, ys): (&mut [f32; LANES], &mut [f32; LANES]),
    ) {
        let camera = &self.view.camera;
        let axes = &camera.world_from_camera;
        let ahead = component_along(simd, directions, -axes.z_axis);
        let per_depth = Lanes::splat(simd, camera.focal_pixels as f32) / ahead;
        let [center_x, center_y] = [camera.principal_point.x as f32, camera.principal_point.y as f32];
        let across = component_along(simd, directions, axes.x_axis).fma(per_depth, Lanes::splat(simd, center_x));
        let down = component_along(simd, directions, -axes.y_axis).fma(per_depth, Lanes::splat(simd, center_y));
        // Directions beside or behind the camera keep the positions that the caller has given them.
        let nearest = Lanes::splat(simd, (camera.near / HORIZON).max(1e-9) as f32);
        ahead.select_lt(nearest, Lanes::from_slice(simd, xs), across).store_slice(xs);
        ahead.select_lt(nearest, Lanes::from_slice(simd, ys), down).store_slice(ys);
    }

    /// The same for any lens.
    fn project_each(&self, directions: [[f32; LANES]; 3], (xs, ys): (&mut [f32; LANES], &mut [f32; LANES])) {
        let camera = &self.view.camera;
        for i in 0..LANES {
            let direction = DVec3::from([0, 1, 2].map(|axis| f64::from(directions[axis][i])));
            if let Some(projection) = camera.project(camera.position + direction * HORIZON) {
                (xs[i], ys[i]) = (projection.pixel.x as f32, projection.pixel.y as f32);
            }
        }
    }
}

/// The components of sixteen vectors along an axis.
#[inline(always)]
fn component_along<S: Simd>(simd: S, [x, y, z]: [Lanes<S>; 3], axis: DVec3) -> Lanes<S> {
    let [along_x, along_y, along_z] = [axis.x as f32, axis.y as f32, axis.z as f32];
    let rest = y.fma(Lanes::splat(simd, along_y), z * Lanes::splat(simd, along_z));
    x.fma(Lanes::splat(simd, along_x), rest)
}

impl Prepared for PreparedGround<'_> {
    fn bounds(&self, slice: &DepthInterval) -> Rect {
        let (first, end) = self.row_depths.rows(slice);
        let rows = Rect { x: 0, y: first, width: self.view.size[0], height: end - first };
        rows.intersection(&Rect::from_size(self.view.size[0], self.view.size[1]))
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        dispatch!(bansho_base::math::simd::level(), simd => self.draw_rows(simd, slice, strip));
    }

    fn plate_role(&self) -> PlateRole {
        if self.parameters.kind == GroundKind::Plate { PlateRole::Part } else { PlateRole::Before }
    }
}
