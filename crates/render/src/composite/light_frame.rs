//! Frames of scene-linear light, which are drawn strip by strip into memory that is reused from frame to frame.

use bansho_base::{
    frame::{Frame, FrameHeader},
    host::observer::Cancelled,
    image::{Image, Rect},
};

use super::{
    background::LightFrame,
    composition::{Composition, STRIP_ROWS},
    strips::{StripLight, StripPixels, draw_strips},
};

/// Draws and composites the whole window as scene-linear light, in the memory of an earlier frame.
pub(crate) fn draw_frame(
    composition: &Composition,
    header: FrameHeader,
    recycled: Option<Frame>,
) -> Result<LightFrame, Cancelled> {
    let window = composition.view.window;
    let mut memory = FrameMemory::new(window, composition.outputs.depth, recycled);
    if composition.outputs.plate_apart {
        memory.drawn = Some(Image::filled(window.width, window.height, [0.0; 4]));
    }
    let channels = draw_strips(composition, memory.strips(STRIP_ROWS))?;
    let frame = Frame {
        header,
        beauty: memory.beauty,
        depth: memory.depth,
        channels,
        opaque: composition.is_opaque(),
        content: composition.content(),
        metadata: Vec::new(),
    };
    Ok(LightFrame { frame, drawn: memory.drawn })
}

/// The memory of a frame.
struct FrameMemory {
    /// Color and alpha.
    beauty: Image<4>,
    /// Depth, m; `None` where nothing reads it.
    depth: Option<Vec<f32>>,
    /// Color without that of the plate; `None` where it is not kept apart.
    drawn: Option<Image<4>>,
    /// Pixels that still contain an earlier frame; all others are empty.
    stale: Rect,
}

/// The light of a strip in a frame, row by row.
struct FrameStrip<'a> {
    beauty: &'a mut [[f32; 4]],
    /// Empty where the frame has no depth.
    depth: &'a mut [f32],
    /// Empty where the light of the plate is not kept apart.
    drawn: &'a mut [[f32; 4]],
    /// Pixels of the strip that still contain an earlier frame.
    stale: Rect,
    width: usize,
}

impl FrameMemory {
    /// Takes the memory of a recycled frame of the same size: page faults of new memory cost more than drawing a sparse frame.
    fn new(window: Rect, has_depth: bool, recycled: Option<Frame>) -> Self {
        let (width, height) = (window.width, window.height);
        if let Some(Frame { beauty, depth, content, .. }) = recycled
            && [beauty.width(), beauty.height()] == [width, height]
            && depth.is_some() == has_depth
        {
            return Self { beauty, depth, drawn: None, stale: content };
        }
        let depth = has_depth.then(|| vec![f32::INFINITY; width * height]);
        Self { beauty: Image::filled(width, height, [0.0; 4]), depth, drawn: None, stale: Rect::default() }
    }

    /// Its strips of `strip_rows` rows from the top; the last one may have fewer.
    fn strips(&mut self, strip_rows: usize) -> Vec<FrameStrip<'_>> {
        let (width, stale) = (self.beauty.width(), self.stale);
        let pixels = strip_rows * width;
        let mut depth = self.depth.iter_mut().flat_map(|depth| depth.chunks_mut(pixels));
        let mut drawn = self.drawn.iter_mut().flat_map(|drawn| drawn.pixels_mut().chunks_mut(pixels));
        // In one allocation: live effects count them.
        let mut strips = Vec::with_capacity(self.beauty.height().div_ceil(strip_rows));
        for (index, beauty) in self.beauty.pixels_mut().chunks_mut(pixels).enumerate() {
            let rows = Rect { x: 0, y: index * strip_rows, width, height: strip_rows };
            let stale = stale.intersection(&rows);
            let stale = Rect { y: stale.y.saturating_sub(rows.y), ..stale };
            let (depth, drawn) = (depth.next().unwrap_or_default(), drawn.next().unwrap_or_default());
            strips.push(FrameStrip { beauty, depth, drawn, stale, width });
        }
        strips
    }
}

impl StripPixels for FrameStrip<'_> {
    fn light<'a>(&'a mut self, strip: Rect, _drawn: Rect, _buffer: &'a mut Vec<[f32; 4]>) -> StripLight<'a> {
        self.clear();
        StripLight { rect: strip, beauty: self.beauty, depth: self.depth, drawn: self.drawn }
    }

    fn convert(&mut self, _strip: Rect, _drawn: Rect, _buffer: &[[f32; 4]]) {}
}

impl FrameStrip<'_> {
    /// Clears what an earlier frame has left.
    fn clear(&mut self) {
        for y in self.stale.y..self.stale.bottom() {
            let pixels = y * self.width + self.stale.x..y * self.width + self.stale.right();
            self.beauty[pixels.clone()].fill([0.0; 4]);
            if let Some(depth) = self.depth.get_mut(pixels) {
                depth.fill(f32::INFINITY);
            }
        }
    }
}
