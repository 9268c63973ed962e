//! Light that a flame casts on other objects: its own colored field, integrated on a coarse grid at each time.

use bansho_base::{
    math::{
        DVec3,
        simd::{LANES, Lanes, Real, ramp},
    },
    phenomenon::{
        strip::Shutter,
        surroundings::{Emitter, Light},
    },
};
use fearless_simd::{Simd, prelude::*};

use super::{
    projection::SheetCoordinates,
    shade::{SheetState, flame::shade},
};
use crate::sheet::{
    animate::warp::{WarpState, WindLean},
    model::{FlameInstance, FlameSheet},
    parameters::SheetMethod,
};

/// Rows of the grid, which has sixteen columns.
pub(crate) const ROWS: usize = 32;

/// Luminous intensity of each row of the grid, from the base up, cd (ACEScg).
pub(crate) type RowIntensities = [[f32; 3]; ROWS];

impl FlameSheet {
    /// Luminous intensity of the rows of a flame's sheet at `t`: luminance times area, summed over cells.
    ///
    /// Wind is ignored. The intensity is isotropic, as the sheet represents a flame that looks the same from all sides.
    pub(crate) fn row_intensities(&self, flame: &FlameInstance, t: f64) -> RowIntensities {
        let no_wind = WindLean { across: 0.0, toward: 0.0 };
        let time = self.flame_time(flame, t);
        let warp = WarpState::new(&self.parameters, self.shape(), &flame.waves, &self.clock, time, no_wind)
            .with_height(self.height_fraction(t));
        if self.parameters.method == SheetMethod::SootField {
            return self.soot_row_intensities(flame, warp, t);
        }
        let texture = flame.texture_source.texture(warp.scroll);
        let eddies = flame.eddies.as_ref().map(|eddies| eddies.after(warp.scroll));
        let state = SheetState { warp, texture, eddies, pixel: [2.0 / LANES as f32, 1.0 / ROWS as f32] };
        let size = self.sheet_size(flame);
        let cell_area = size.x * size.y / (LANES * ROWS) as f64;
        let scale = (cell_area * self.luminance_at(t)) as f32;
        fearless_simd::dispatch!(bansho_base::math::simd::level(), simd => row_intensities(simd, self, &state, scale))
    }

    /// Parts of an exposure in each of which the light of a flame whose path has this length hardly moves or flickers.
    pub(crate) fn light_parts(&self, flame: &FlameInstance, path: f64, shutter: Shutter) -> usize {
        shutter.light_parts(path, 0.15 * self.sheet_size(flame).x)
    }

    /// Length of the path of a flame's base during an exposure, m.
    pub(crate) fn path(&self, flame: &FlameInstance, shutter: Shutter) -> f64 {
        let bases = shutter.path_times().map(|t| self.base(flame, t));
        bases.windows(2).map(|pair| (pair[1] - pair[0]).length()).sum()
    }

    /// Point lights that represent a flame at `t`.
    pub(crate) fn point_lights(&self, flame: &FlameInstance, t: f64) -> Vec<Light> {
        if self.is_out(t) {
            return Vec::new();
        }
        let (base, size) = (self.base(flame, t), self.sheet_size(flame));
        let row_intensities = self.row_intensities(flame, t);
        let count = self.parameters.light.count.max(1) as usize;
        let scale = self.parameters.light.scale as f32;
        let mut lights = Vec::with_capacity(count);
        for index in 0..count {
            let segment = equal_energy_segment(&row_intensities, index, count);
            let intensity = segment.intensity.map(|value| value * scale);
            if intensity.iter().any(|value| *value > 0.0) {
                let position = base + DVec3::Y * (segment.height * size.y);
                lights.push(Light { emitter: Emitter::Point { position, radius: 0.15 * size.x }, intensity });
            }
        }
        lights
    }
}

/// Shades a grid over the sheet and sums its rows.
#[inline(always)]
fn row_intensities<S: Simd>(simd: S, sheet: &FlameSheet, state: &SheetState, scale: f32) -> RowIntensities {
    let x = ramp(simd, 0.5 / LANES as f32, 1.0 / LANES as f32);
    let mut row_intensities = [[0.0; 3]; ROWS];
    for (index, row) in row_intensities.iter_mut().enumerate() {
        let y = Lanes::splat(simd, (index as f32 + 0.5) / ROWS as f32);
        let batch = SheetCoordinates { x, y, depth: y.broadcast(1.0) };
        if let Some(shade) = shade(sheet.shape(), sheet.ramp(), state, &batch) {
            for k in 0..3 {
                row[k] = shade.light[k].as_slice().iter().sum::<f32>() * scale;
            }
        }
    }
    row_intensities
}

/// Light of a range of heights of the flame.
struct LightSegment {
    /// Luminous intensity, cd (ACEScg).
    intensity: [f32; 3],
    /// Height of its center of energy, in sheet heights.
    height: f64,
}

/// Segment `index` of `count` segments of equal energy: their centers move smoothly as the flame flickers.
fn equal_energy_segment(row_intensities: &RowIntensities, index: usize, count: usize) -> LightSegment {
    /// Height of a segment without energy.
    const DARK_HEIGHT: f64 = 0.3;
    let energies = row_intensities.map(|row| f64::from(row.iter().sum::<f32>().max(0.0)));
    let total: f64 = energies.iter().sum();
    let (from, to) = (total * index as f64 / count as f64, total * (index + 1) as f64 / count as f64);
    let (mut cumulative, mut intensity, mut height_moment) = (0.0, [0.0_f32; 3], 0.0);
    for (row_index, (row, energy)) in row_intensities.iter().zip(energies).enumerate() {
        let next_cumulative = cumulative + energy;
        let overlap = (next_cumulative.min(to) - cumulative.max(from)).max(0.0);
        if overlap > 0.0 {
            let fraction = overlap / energy;
            for k in 0..3 {
                intensity[k] += row[k] * fraction as f32;
            }
            height_moment += overlap * (row_index as f64 + 0.5) / ROWS as f64;
        }
        cumulative = next_cumulative;
    }
    let energy = to - from;
    LightSegment { intensity, height: if energy > 0.0 { height_moment / energy } else { DARK_HEIGHT } }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_have_equal_energy_and_add_up() {
        let mut row_intensities = [[0.0; 3]; ROWS];
        for (i, row) in row_intensities.iter_mut().enumerate().take(10) {
            *row = [3.0, 2.0, 1.0 + i as f32];
        }
        let segments: Vec<_> = (0..3).map(|index| equal_energy_segment(&row_intensities, index, 3)).collect();
        let energy = |segment: &LightSegment| segment.intensity.iter().sum::<f32>();
        assert!((energy(&segments[0]) - energy(&segments[2])).abs() < 1e-3);
        let red: f32 = segments.iter().map(|segment| segment.intensity[0]).sum();
        assert!((red - 30.0).abs() < 1e-4);
        assert!(segments[0].height < segments[1].height && segments[1].height < segments[2].height);
    }
}
