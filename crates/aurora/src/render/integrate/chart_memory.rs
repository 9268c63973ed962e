//! Memory of charts, which the frames of a shot reuse: for a dome it is hundreds of megabytes, and for the system to map it anew takes longer than to
//! integrate the light.

use std::sync::{Mutex, PoisonError};

use bansho_base::host::parallel::prelude::*;

use super::columns::ColumnBuffer;
use crate::{physics::emission::PerEmitter, render::project::chart::Chart};

/// The memory of charts that are no longer used, all of it without light.
#[derive(Debug, Default)]
pub(crate) struct ChartMemory(Mutex<Vec<Vec<PerEmitter<f32>>>>);

impl ChartMemory {
    /// Number of charts whose memory is kept: a picture's and its mirror's.
    const CAPACITY: usize = 2;

    /// A buffer without light.
    pub(crate) fn zeros(&self, chart: Chart) -> ColumnBuffer {
        let cells = chart.columns * chart.rows;
        let recycled = {
            let mut free = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            let fits = free.iter().enumerate().filter(|(_, memory)| memory.capacity() >= cells);
            let smallest = fits.min_by_key(|(_, memory)| memory.capacity()).map(|(index, _)| index);
            smallest.map(|index| free.swap_remove(index))
        };
        match recycled {
            None => ColumnBuffer::zeros(chart),
            Some(mut light) => {
                light.resize(cells, [0.0; 4]);
                ColumnBuffer { light, valid_rows: vec![[u32::MAX, 0]; chart.columns], chart }
            }
        }
    }

    /// Takes the memory of a chart whose light is no longer used, which stays empty. Its light is outside of its valid rows nowhere.
    pub(crate) fn recycle(&self, buffer: &mut ColumnBuffer) {
        let rows = buffer.chart.rows;
        let mut light = std::mem::take(&mut buffer.light);
        light.par_chunks_mut(rows).zip(&buffer.valid_rows).for_each(|(column, [first, end])| {
            column[(*first).min(*end) as usize..*end as usize].fill([0.0; 4]);
        });
        let mut free = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        free.insert(0, light);
        free.truncate(Self::CAPACITY);
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::{
        camera::CameraParameters,
        phenomenon::strip::{Shutter, View},
    };

    use super::*;
    use crate::render::project::{chart::Coverage, field_lines::FieldLines};

    #[test]
    fn memory_is_reused_by_charts_that_fit_and_comes_without_light() {
        let mut camera = CameraParameters::default();
        camera.look_up();
        let view = View::new(camera, Shutter { open: 0.0, close: 0.0 }, 0.0, [64, 48], 0);
        let coverage = Coverage::of_view(&view, &FieldLines::new(77.0, 0.0, view.camera.position));
        let chart = |scale: f64| Chart::new(&coverage, scale * coverage.pixel, scale * coverage.pixel);
        let memory = ChartMemory::default();
        let mut buffer = memory.zeros(chart(1.0));
        let rows = buffer.chart.rows;
        buffer.light[rows + 3..rows + 7].fill([1.0; 4]);
        buffer.valid_rows[1] = [3, 7];
        let address = buffer.light.as_ptr();
        memory.recycle(&mut buffer);
        let smaller = memory.zeros(chart(2.0));
        assert_eq!(smaller.light.as_ptr(), address);
        assert_eq!(smaller.light.len(), smaller.chart.columns * smaller.chart.rows);
        assert!(smaller.light.iter().flatten().all(|value| *value == 0.0));
        assert!(smaller.valid_rows.iter().all(|rows| *rows == [u32::MAX, 0]));
        // In use, so that the next chart gets memory of its own.
        assert_ne!(memory.zeros(chart(2.0)).light.as_ptr(), address);
    }
}
