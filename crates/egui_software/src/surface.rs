//! What was painted, brought to the window.

use std::{num::NonZeroU32, sync::Arc};

use softbuffer::{Context, Rect, SoftBufferError, Surface};
use winit::{event_loop::OwnedDisplayHandle, window::Window};

use super::{Area, Painter};

/// A window's pixels as the system has them.
pub(super) struct Screen {
    surface: Surface<OwnedDisplayHandle, Arc<Window>>,
    /// Pixels, once there are any.
    size: [u32; 2],
    /// What was changed the last time: a system that shows two pictures in turn lacks it in the one that comes next.
    before: Vec<Area>,
}

impl Screen {
    /// # Errors
    /// The system takes no pixels for this window.
    pub(super) fn new(display: OwnedDisplayHandle, window: Arc<Window>) -> Result<Self, SoftBufferError> {
        let surface = Surface::new(&Context::new(display)?, window)?;
        Ok(Self { surface, size: [0; 2], before: Vec::new() })
    }

    /// Shows what `painter` has of `changed` in a window of `size` pixels; all of it where the system does not have the rest any more.
    ///
    /// # Errors
    /// The system takes no pixels.
    pub(super) fn show(&mut self, painter: &Painter, changed: &[Area], size: [u32; 2]) -> Result<(), SoftBufferError> {
        let [Some(width), Some(height)] = size.map(NonZeroU32::new) else { return Ok(()) };
        let resized = self.size != size;
        if resized {
            self.surface.resize(width, height)?;
            self.size = size;
        }
        let mut buffer = self.surface.buffer_mut()?;
        let whole = [Area { left: 0, top: 0, right: width.get() as i32, bottom: height.get() as i32 }];
        let age = if resized { 0 } else { buffer.age() };
        let (damaged, missed) = match age {
            1 => (changed, &[][..]),
            2 => (changed, &self.before[..]),
            _ => (&whole[..], &[][..]),
        };
        for area in missed.iter().chain(damaged) {
            painter.copy(*area, &mut buffer, width.get() as usize);
        }
        let damaged = damaged.to_vec();
        buffer.present_with_damage(&damaged.iter().filter_map(damage).collect::<Vec<_>>())?;
        self.before = damaged;
        Ok(())
    }

    /// The system has lost what it was given.
    pub(super) fn forget(&mut self) {
        self.size = [0; 2];
    }

    /// Waits until the system has shown what it was given.
    pub(super) fn settle(&mut self) {
        // Before a size is known there is nothing to wait for. What fails here fails where something is shown next, which tells it.
        if self.size != [0; 2] {
            let _ = self.surface.buffer_mut();
        }
    }
}

fn damage(area: &Area) -> Option<Rect> {
    let side = |from: i32, to: i32| NonZeroU32::new(u32::try_from(to - from).ok()?);
    Some(Rect {
        x: u32::try_from(area.left).ok()?,
        y: u32::try_from(area.top).ok()?,
        width: side(area.left, area.right)?,
        height: side(area.top, area.bottom)?,
    })
}
