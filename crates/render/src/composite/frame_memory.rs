//! The memory of a frame, which is reused from frame to frame and drawn strip by strip.

use bansho_base::{
    frame::Frame,
    image::{Image, Rect},
};

/// The memory of a frame.
pub(super) struct FrameMemory {
    /// Color and alpha.
    pub(super) beauty: Image<4>,
    /// Depth, m; `None` where nothing reads it.
    pub(super) depth: Option<Vec<f32>>,
    /// Pixels that still contain an earlier frame; all others are empty.
    stale: Rect,
}

/// The pixels of a strip in a frame, row by row.
pub(super) struct StripPixels<'a> {
    pub(super) beauty: &'a mut [[f32; 4]],
    /// Empty where the frame has no depth.
    pub(super) depth: &'a mut [f32],
    /// Pixels of the strip that still contain an earlier frame.
    stale: Rect,
    width: usize,
}

impl FrameMemory {
    /// Takes the memory of a recycled frame of the same size: page faults of new memory cost more than drawing a sparse frame.
    pub(super) fn new(window: Rect, has_depth: bool, recycled: Option<Frame>) -> Self {
        let (width, height) = (window.width, window.height);
        let fits = |frame: &Frame| {
            frame.beauty.width() == width && frame.beauty.height() == height && frame.depth.is_some() == has_depth
        };
        if let Some(Frame { beauty, depth, content, .. }) = recycled.filter(fits) {
            return Self { beauty, depth, stale: content };
        }
        let depth = has_depth.then(|| vec![f32::INFINITY; width * height]);
        Self { beauty: Image::filled(width, height, [0.0; 4]), depth, stale: Rect::default() }
    }

    /// Its strips of `strip_rows` rows from the top; the last one may have fewer.
    pub(super) fn strips(&mut self, strip_rows: usize) -> Vec<StripPixels<'_>> {
        let (width, stale) = (self.beauty.width(), self.stale);
        let pixels = strip_rows * width;
        let mut depth = self.depth.iter_mut().flat_map(|depth| depth.chunks_mut(pixels));
        let strip = |(index, beauty): (usize, _)| {
            let rows = Rect { x: 0, y: index * strip_rows, width, height: strip_rows };
            let stale = stale.intersection(&rows);
            let stale = Rect { y: stale.y.saturating_sub(rows.y), ..stale };
            StripPixels { beauty, depth: depth.next().unwrap_or_default(), stale, width }
        };
        self.beauty.pixels_mut().chunks_mut(pixels).enumerate().map(strip).collect()
    }
}

impl StripPixels<'_> {
    /// Clears what an earlier frame has left.
    pub(super) fn clear(&mut self) {
        for y in self.stale.y..self.stale.bottom() {
            let pixels = y * self.width + self.stale.x..y * self.width + self.stale.right();
            self.beauty[pixels.clone()].fill([0.0; 4]);
            if let Some(depth) = self.depth.get_mut(pixels) {
                depth.fill(f32::INFINITY);
            }
        }
    }
}
