//! A texture that is one table, which repeats across and up.

use std::sync::Arc;

use bansho_base::math;

use super::{COLUMNS, FlameTexture, ROWS, TextureLayer, TextureTable};
use crate::sheet::animate::clock::Clock;

/// A table and the area that it covers.
#[derive(Clone, Debug)]
pub(crate) struct PeriodicLayer {
    table: Arc<TextureTable>,
    /// Periods in u and q, in sheet widths and heights.
    period: [f64; 2],
    /// Scroll speed relative to the parameter: 1, unless a loop requires an integer number of periods.
    relative_speed: f64,
}

impl PeriodicLayer {
    /// The layer of the texels `texels[row * COLUMNS + column]`, which repeat after `period` sheet widths and heights.
    pub(crate) fn new(texels: &[f32], period: [f64; 2], clock: &Clock) -> Self {
        let relative_speed = relative_speed(period[1], clock);
        Self { table: Arc::new(TextureTable::new(texels)), period, relative_speed }
    }

    /// The texture after `scroll` sheet heights, eq. (1).
    pub(crate) fn at(&self, scroll: f64) -> FlameTexture {
        let [period_u, period_q] = self.period;
        let offset = math::reduce_phase(-self.relative_speed * scroll / period_q) * ROWS as f32;
        let layer = TextureLayer {
            columns_per_u: (COLUMNS as f64 / period_u) as f32,
            columns_per_w: 0.0,
            first_column: 0.0,
            rows_per_w: (ROWS as f64 / period_q) as f32,
            first_row: offset,
        };
        FlameTexture::Single(self.table.clone(), layer)
    }

    /// This layer with its table filtered to `level`.
    pub(crate) fn filtered(&self, level: f32) -> Self {
        Self { table: Arc::new(self.table.filtered(level)), ..*self }
    }

    /// Texels per sheet height.
    pub(crate) fn texels_up(&self) -> f64 {
        ROWS as f64 / self.period[1]
    }
}

/// Scroll speed relative to the parameter of a texture that repeats after `period_q` sheet heights: 1, unless a loop requires an integer number of periods.
pub(crate) fn relative_speed(period_q: f64, clock: &Clock) -> f64 {
    clock.waves(1.0 / period_q, 1.0) * period_q
}
