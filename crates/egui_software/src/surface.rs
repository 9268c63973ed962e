//! Presents the framebuffer in the window.

use std::{num::NonZeroU32, sync::Arc};

use softbuffer::{Context, Rect, SoftBufferError, Surface};
use winit::{event_loop::OwnedDisplayHandle, window::Window};

use super::{Painter, PixelRect};

/// The window's pixel buffers (`softbuffer`).
pub(super) struct WindowSurface {
    surface: Surface<OwnedDisplayHandle, Arc<Window>>,
    /// Size of the buffers, pixels; 0 at first.
    size: [u32; 2],
    /// Damage of the previous frame: with double buffering, the next buffer does not have it yet.
    previous_damage: Vec<PixelRect>,
}

impl WindowSurface {
    /// # Errors
    /// The system offers no pixel buffer for this window.
    pub(super) fn new(display: OwnedDisplayHandle, window: Arc<Window>) -> Result<Self, SoftBufferError> {
        let surface = Surface::new(&Context::new(display)?, window)?;
        Ok(Self { surface, size: [0; 2], previous_damage: Vec::new() })
    }

    /// Copies `changed` from `painter` to a window of `size` pixels, or everything where the content of the buffer is undefined.
    ///
    /// # Errors
    /// The system does not accept the pixels.
    pub(super) fn present(
        &mut self,
        painter: &Painter,
        changed: &[PixelRect],
        size: [u32; 2],
    ) -> Result<(), SoftBufferError> {
        let [Some(width), Some(height)] = size.map(NonZeroU32::new) else { return Ok(()) };
        let resized = self.size != size;
        if resized {
            self.surface.resize(width, height)?;
            self.size = size;
        }
        let mut buffer = self.surface.buffer_mut()?;
        let whole = [PixelRect { left: 0, top: 0, right: width.get() as i32, bottom: height.get() as i32 }];
        let age = if resized { 0 } else { buffer.age() };
        let (damaged, missed) = match age {
            1 => (changed, &[][..]),
            2 => (changed, &self.previous_damage[..]),
            _ => (&whole[..], &[][..]),
        };
        for area in missed.iter().chain(damaged) {
            painter.copy(*area, &mut buffer, width.get() as usize);
        }
        let damaged = damaged.to_vec();
        buffer.present_with_damage(&damaged.iter().filter_map(damage).collect::<Vec<_>>())?;
        self.previous_damage = damaged;
        Ok(())
    }

    /// Discards the content of the buffers, after the system has lost that of the window.
    pub(super) fn invalidate(&mut self) {
        self.size = [0; 2];
    }

    /// Waits until the previous frame has been presented.
    pub(super) fn wait_until_presented(&mut self) {
        // Before a size is known there is nothing to wait for. An error here occurs again at the next frame, which reports it.
        if self.size != [0; 2] {
            let _ = self.surface.buffer_mut();
        }
    }
}

/// A rectangle that has changed, as the window system takes it; `None` for one without pixels.
fn damage(area: &PixelRect) -> Option<Rect> {
    Some(Rect {
        x: u32::try_from(area.left).ok()?,
        y: u32::try_from(area.top).ok()?,
        width: NonZeroU32::new(u32::try_from(area.right - area.left).ok()?)?,
        height: NonZeroU32::new(u32::try_from(area.bottom - area.top).ok()?)?,
    })
}
