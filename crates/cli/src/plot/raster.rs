//! Figures as pixels.

use ab_glyph::OutlineCurve;
use bansho::{
    AlphaConvention, DisplayImage,
    base::frame::{DisplayEncoding, DisplayPixels},
};
use tiny_skia::{Color, FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, Rect, StrokeDash, Transform};

use super::{
    canvas::{FigureCanvas, LineStyle, TextAnchor, TextStyle},
    figure::Rgb,
    font,
};

/// Pixels per CSS pixel: 240 dots per inch.
const SCALE: f32 = 2.5;
/// Width of the line that makes light letters regular, em.
const REGULAR_EM: f32 = 0.022;
/// The same for bold letters.
const BOLD_EM: f32 = 0.055;

/// A picture that is being drawn.
pub(super) struct RasterCanvas {
    pixmap: Pixmap,
}

impl RasterCanvas {
    /// A white page; `None` if it is too large.
    pub(super) fn new([width, height]: [f64; 2]) -> Option<Self> {
        let [width, height] = [width, height].map(|side| (side as f32 * SCALE).round() as u32);
        let mut pixmap = Pixmap::new(width, height)?;
        pixmap.fill(Color::WHITE);
        Some(Self { pixmap })
    }

    /// The picture.
    pub(super) fn finish(self) -> DisplayImage {
        let (width, height) = (self.pixmap.width() as usize, self.pixmap.height() as usize);
        // Opaque, so that premultiplied is straight.
        let pixels = self.pixmap.pixels().iter().map(|pixel| [pixel.red(), pixel.green(), pixel.blue(), 255]);
        let pixels = DisplayPixels::Eight(pixels.collect());
        DisplayImage {
            width,
            height,
            opaque: true,
            alpha: AlphaConvention::default(),
            encoding: DisplayEncoding::Srgb,
            pixels,
        }
    }

    fn stroke(&mut self, path: &Path, stroke: &LineStyle, join: LineJoin) {
        let dash = stroke.dash.and_then(|lengths| StrokeDash::new(lengths.map(|length| length as f32).to_vec(), 0.0));
        let pen = tiny_skia::Stroke {
            width: stroke.width as f32,
            line_cap: LineCap::Butt,
            line_join: join,
            dash,
            ..tiny_skia::Stroke::default()
        };
        self.pixmap.stroke_path(path, &paint(stroke.color, 1.0), &pen, Transform::from_scale(SCALE, SCALE), None);
    }
}

fn paint(color: Rgb, opacity: f64) -> Paint<'static> {
    let mut paint = Paint::default();
    let [r, g, b] = color;
    paint.set_color_rgba8(r, g, b, (255.0 * opacity).round() as u8);
    paint.anti_alias = true;
    paint
}

impl FigureCanvas for RasterCanvas {
    fn line(&mut self, points: &[[f64; 2]], stroke: &LineStyle) {
        let mut path = PathBuilder::new();
        for (index, point) in points.iter().enumerate() {
            let [x, y] = point.map(|value| value as f32);
            if index == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
        }
        if let Some(path) = path.finish() {
            self.stroke(&path, stroke, LineJoin::Round);
        }
    }

    fn rectangle(&mut self, corners: [[f64; 2]; 2], color: Rgb, opacity: f64) {
        let [[left, top], [right, bottom]] = corners.map(|corner| corner.map(|value| value as f32));
        if let Some(rectangle) = Rect::from_ltrb(left, top, right, bottom) {
            let transform = Transform::from_scale(SCALE, SCALE);
            self.pixmap.fill_rect(rectangle, &paint(color, opacity), transform, None);
        }
    }

    fn marker(&mut self, [x, y]: [f64; 2], radius: f64, stroke: &LineStyle) {
        let Some(circle) = PathBuilder::from_circle(x as f32, y as f32, radius as f32) else { return };
        let transform = Transform::from_scale(SCALE, SCALE);
        self.pixmap.fill_path(&circle, &paint([255; 3], 1.0), FillRule::Winding, transform, None);
        self.stroke(&circle, stroke, LineJoin::Miter);
    }

    fn text(&mut self, text: &str, style: &TextStyle) {
        let (glyphs, width) = font::layout(text);
        let size = style.size as f32;
        let start = match style.anchor {
            TextAnchor::Start => 0.0,
            TextAnchor::Middle => -0.5 * width as f32,
            TextAnchor::End => -(width as f32),
        };
        let [x, y] = style.at.map(|value| value as f32);
        let turn = if style.vertical { Transform::from_rotate(-90.0) } else { Transform::identity() };
        let transform = Transform::from_translate(start, 0.0)
            .post_scale(size, size)
            .post_concat(turn)
            .post_translate(x, y)
            .post_scale(SCALE, SCALE);
        let mut path = PathBuilder::new();
        for glyph in &glyphs {
            let mut end = None;
            for curve in &glyph.outline {
                let (from, to) = match curve {
                    OutlineCurve::Line(from, to)
                    | OutlineCurve::Quad(from, _, to)
                    | OutlineCurve::Cubic(from, _, _, to) => (glyph.point(*from), glyph.point(*to)),
                };
                if end != Some(from) {
                    if end.is_some() {
                        path.close();
                    }
                    path.move_to(from[0], from[1]);
                }
                match curve {
                    OutlineCurve::Line(..) => path.line_to(to[0], to[1]),
                    OutlineCurve::Quad(_, control, _) => {
                        let [cx, cy] = glyph.point(*control);
                        path.quad_to(cx, cy, to[0], to[1]);
                    }
                    OutlineCurve::Cubic(_, first, second, _) => {
                        let ([ax, ay], [bx, by]) = (glyph.point(*first), glyph.point(*second));
                        path.cubic_to(ax, ay, bx, by, to[0], to[1]);
                    }
                }
                end = Some(to);
            }
            if end.is_some() {
                path.close();
            }
        }
        let Some(path) = path.finish() else { return };
        self.pixmap.fill_path(&path, &paint(INK, 1.0), FillRule::Winding, transform, None);
        let pen = tiny_skia::Stroke {
            width: if style.bold { BOLD_EM } else { REGULAR_EM },
            line_join: LineJoin::Round,
            ..tiny_skia::Stroke::default()
        };
        self.pixmap.stroke_path(&path, &paint(INK, 1.0), &pen, transform, None);
    }
}

/// Color of text.
const INK: Rgb = [0; 3];
