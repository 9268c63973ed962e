//! Adding the corrections close around lamps to the pixels of a strip.

use bansho_base::{
    host::once::get_or_compute,
    image::Rect,
    phenomenon::strip::{DepthInterval, Strip},
};
use fearless_simd::dispatch;

use super::{
    halo_corrections::{HaloCorrector, HaloRows},
    in_scattering::LampHalo,
    single_scattering::SingleScattering,
    surface_pixels::{first_pixel, surface_columns},
};

/// Where the slice before the camera begins at most, over the camera's nearest depth: slices are cut at rounded depths.
const FIRST_SLICE_MARGIN: f64 = 1.05;

impl SingleScattering<'_> {
    /// Adds the corrections near lamps to a row of tiles.
    pub(super) fn add_halos(&self, slice: &DepthInterval, rows: Rect, strip: &mut Strip) {
        let mut scratch = HaloRows::default();
        for halo in &self.lamps.halos {
            let rect = halo.rect.intersection(&rows);
            for y in rect.y..rect.bottom() {
                let row = Rect { y, height: 1, ..rect };
                if self.is_before_plate(strip) {
                    self.add_halo_before_surfaces(halo, slice, row, strip, |_| true, &mut scratch);
                    continue;
                }
                self.add_unbounded_halo(halo, slice, row, strip, &mut scratch);
                let behind = surface_columns(strip, row);
                if !behind.is_empty() {
                    let row = Rect { x: behind.start, width: behind.len(), ..row };
                    self.add_halo_before_surfaces(halo, slice, row, strip, f32::is_finite, &mut scratch);
                }
            }
        }
    }

    /// Adds the corrections of whole lines of sight to those pixels of a row behind which there is no surface: in the slice before the camera, since no slice
    /// behind it is in front of the ground everywhere.
    fn add_unbounded_halo(
        &self,
        halo: &LampHalo,
        slice: &DepthInterval,
        row: Rect,
        strip: &mut Strip,
        scratch: &mut HaloRows,
    ) {
        if slice.near > self.view.camera.near * FIRST_SLICE_MARGIN {
            return;
        }
        let (all, slice) = (halo.rect.x..halo.rect.right(), &DepthInterval::ALL);
        let corrector = HaloCorrector { halo, bounds: self.bounds(), table: &self.table, lit_end: self.end, slice };
        let corrections = get_or_compute(
            &halo.corrections[row.y - halo.rect.y],
            || dispatch!(self.level, _simd => corrector.row(row.y, all, &[], scratch)),
        );
        let corrections = &corrections[row.x - halo.rect.x..row.right() - halo.rect.x];
        add_corrections(strip, first_pixel(strip, row), corrections, |depth| !depth.is_finite());
    }

    /// Adds the corrections of a slice to those pixels of a row whose depth of the surface behind (m) is `corrected`.
    fn add_halo_before_surfaces(
        &self,
        halo: &LampHalo,
        slice: &DepthInterval,
        row: Rect,
        strip: &mut Strip,
        corrected: fn(f32) -> bool,
        scratch: &mut HaloRows,
    ) {
        let corrector = HaloCorrector { halo, bounds: self.bounds(), table: &self.table, lit_end: self.end, slice };
        let first = first_pixel(strip, row);
        let plate = strip.plate_depths(first..first + row.width);
        let columns = row.x..row.right();
        let corrections = dispatch!(self.level, _simd => corrector.row(row.y, columns, plate, scratch));
        add_corrections(strip, first, &corrections, corrected);
    }
}

/// Adds corrections to consecutive pixels of a strip, if the depth of the surface behind them (m) is `corrected`. The medium in front of them is contained in
/// the strip's transmittance too; its effect is small.
fn add_corrections(strip: &mut Strip, first: usize, corrections: &[[f32; 3]], corrected: impl Fn(f32) -> bool) {
    for (index, light) in corrections.iter().enumerate() {
        if *light != [0.0; 3] && corrected(strip.plate_depth(first + index)) {
            (0..3).for_each(|c| strip.radiance[c][first + index] += light[c]);
        }
    }
}
