//! Culling: whether light about a field line can be visible within the rows of a chart.

use std::f64::consts::PI;

use bansho_base::math::{self, MulAdd};

use super::{
    chart::Chart,
    field_lines::{EARTH_RADIUS_KM, FieldLines},
};
use crate::physics::atmosphere::{HIGHEST_KM, LOWEST_KM};

/// Margin in rows.
const MARGIN_ROWS: f64 = 2.0;

/// Visible rows of a chart, tested against field lines.
pub(crate) struct VisibleRowTest {
    /// Squared distance of the observer from the Earth's center minus the squared Earth radius, and its components
    /// along and across the field, km.
    squared: f32,
    along: f32,
    across: [f32; 2],
    /// Length of the component across the field.
    lean: f32,
    /// Sine and cosine of the first and the last colatitude.
    first: [f32; 2],
    last: [f32; 2],
}

impl VisibleRowTest {
    pub(crate) fn new(chart: &Chart, field: &FieldLines) -> Self {
        // Only the outward component depends on the longitude.
        let [[squared, first, along], [_, second, _]] =
            [[1.0, 0.0], [0.0, 1.0]].map(|unit| field.meridian(unit).coefficients_f32());
        let [first_row, last_row] = [-MARGIN_ROWS, chart.rows as f64 + MARGIN_ROWS].map(|row| {
            let (sine, cosine) = math::sin_cos((chart.colatitude(0) + row * chart.row_step).clamp(0.0, PI));
            [sine as f32, cosine as f32]
        });
        Self {
            squared,
            along,
            across: [first, second],
            lean: first.fma(first, second * second).sqrt(),
            first: first_row,
            last: last_row,
        }
    }

    /// Conservative test for light within `margin_km` of a field line, given by its position across the field and its
    /// distance from the observer's own, km.
    #[inline(always)]
    pub(crate) fn may_contain(&self, [x, y]: [f32; 2], distance: f32, margin_km: f32) -> bool {
        let outward = x.fma(self.across[0], y * self.across[1]);
        let excess = distance.fma(distance, 2.0_f32.fma(outward, self.squared));
        let change = margin_km * 2.0_f32.fma(distance + self.lean, margin_km);
        let highest = self.position_at_altitude(HIGHEST_KM as f32, excess - change);
        let lowest = self.position_at_altitude(LOWEST_KM as f32, excess + change);
        // Sine of the angle by which its lowest light is below the first row, at the edge of the margin where its colatitude is largest: the outer
        // edge if it is above the observer, else the inner one, which may lie on the observer's own line. Likewise for the last row.
        let [sine, cosine] = self.first;
        let edge = if lowest > 0.0 { distance + margin_km } else { distance - margin_km };
        let above = edge > 0.0 && edge.fma(cosine, -lowest * sine) < 0.0;
        let [sine, cosine] = self.last;
        let edge = if highest > 0.0 { distance - margin_km } else { distance + margin_km };
        let below = edge > 0.0 && edge.fma(cosine, -highest * sine) > 0.0;
        !above && !below
    }

    /// Coordinate along a field line at an altitude, as
    /// [`FieldLine::position_at_altitude`](super::field_lines::FieldLine::position_at_altitude), from the squared
    /// distance at coordinate 0 minus the squared Earth radius.
    #[inline(always)]
    fn position_at_altitude(&self, altitude_km: f32, excess: f32) -> f32 {
        const DIAMETER: f32 = 2.0 * EARTH_RADIUS_KM as f32;
        let squared = self.along.fma(self.along, altitude_km.fma(DIAMETER + altitude_km, -excess));
        (if squared > 0.0 { squared } else { 0.0 }).sqrt() - self.along
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::{
        camera::CameraParameters,
        math::DVec3,
        phenomenon::strip::{Shutter, View},
    };

    use super::*;
    use crate::render::project::chart::Coverage;

    /// Whether the line at a position is seen between the first and the last row, by its altitudes one after the other.
    fn is_seen(chart: &Chart, field: &FieldLines, [x, y]: [f32; 2]) -> bool {
        let distance = math::hypot(f64::from(x), f64::from(y));
        let line = field.meridian([f64::from(x) / distance, f64::from(y) / distance]).line(distance);
        let rows = (0..=720).map(|step| {
            let colatitude = math::atan2(distance, line.position_at_altitude(80.0 + f64::from(step)));
            (colatitude - chart.colatitude(0)) / chart.row_step
        });
        rows.into_iter().any(|row| row > -0.5 && row < chart.rows as f64 - 0.5)
    }

    #[test]
    fn lines_are_left_out_only_where_they_are_not_seen() {
        let views = [
            (77.0, 0.0, [0.0, 25.0, -60.0]),
            (60.0, 0.0, [0.0, 60.0, 60.0]),
            (90.0, 0.0, [40.0, 5.0, -10.0]),
            (77.0, 60.0, [0.0, 70.0, -60.0]),
            (77.0, 200.0, [0.0, 100.0, -60.0]),
            (60.0, 400.0, [40.0, 100.0, -400.0]),
        ];
        for (dip_deg, altitude_km, target) in views {
            let position = DVec3::new(2e3, 1.7 + 1e3 * altitude_km, -5e3);
            let field = FieldLines::new(dip_deg, 0.0, position);
            let camera = CameraParameters {
                position: position.to_array().into(),
                target: target.map(|km| 1e3 * km).into(),
                ..CameraParameters::default()
            };
            let view = View::new(camera, Shutter { open: 0.0, close: 0.0 }, 0.0, [128, 72], 0);
            let coverage = Coverage::of_view(&view, &field);
            let chart = Chart::new(&coverage, coverage.pixel, coverage.pixel);
            let shown = VisibleRowTest::new(&chart, &field);
            let (mut seen, mut kept, mut all) = (0, 0, 0);
            for east in -40..=40 {
                for south in -40..=40 {
                    let across = [12.0 * east as f32 + 1.0, 12.0 * south as f32 + 1.0];
                    let distance = math::hypot(f64::from(across[0]), f64::from(across[1])) as f32;
                    let (is_seen, is_kept) =
                        (is_seen(&chart, &field, across), shown.may_contain(across, distance, 3.0));
                    assert!(is_kept || !is_seen, "dip {dip_deg} from {altitude_km} km: {across:?}");
                    (seen, kept, all) = (seen + usize::from(is_seen), kept + usize::from(is_kept), all + 1);
                }
            }
            // Few too many.
            assert!(
                kept < seen + all / 20 && seen < all,
                "dip {dip_deg} from {altitude_km} km: {seen} seen, {kept} kept of {all}"
            );
        }
    }
}
