//! What a figure is drawn with. Coordinates are in CSS pixels (1/96 inch), from the upper left corner.

use super::figure::Rgb;

/// Something to draw on.
pub(super) trait FigureCanvas {
    /// A line through points.
    fn line(&mut self, points: &[[f64; 2]], stroke: &LineStyle);

    /// A filled rectangle, from its upper left to its lower right corner.
    fn rectangle(&mut self, corners: [[f64; 2]; 2], color: Rgb, opacity: f64);

    /// A white circle with a colored outline.
    fn marker(&mut self, center: [f64; 2], radius: f64, stroke: &LineStyle);

    /// A line of text.
    fn text(&mut self, text: &str, style: &TextStyle);
}

/// How a line is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LineStyle {
    pub(super) color: Rgb,
    pub(super) width: f64,
    /// Lengths of dashes and of the gaps between them.
    pub(super) dash: Option<[f64; 2]>,
}

/// How and where a line of text is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TextStyle {
    /// The anchor: a point of the baseline.
    pub(super) at: [f64; 2],
    pub(super) anchor: TextAnchor,
    /// Size of the font: its em.
    pub(super) size: f64,
    pub(super) bold: bool,
    /// Whether it runs upward.
    pub(super) vertical: bool,
}

/// Which point of a text is at its anchor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TextAnchor {
    Start,
    Middle,
    End,
}
