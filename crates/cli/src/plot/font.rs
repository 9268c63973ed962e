//! The font of PNG figures: Ubuntu Light, embedded, so that every machine draws the same.

use std::sync::LazyLock;

use ab_glyph::{Font, FontRef, GlyphId, OutlineCurve};

static FONT: LazyLock<Option<FontRef<'static>>> =
    LazyLock::new(|| FontRef::try_from_slice(epaint_default_fonts::UBUNTU_LIGHT).ok());

/// A glyph of a line of text that begins at (0, 0), in em, y downward.
pub(super) struct PlacedGlyph {
    /// Lines and Bezier curves.
    pub(super) outline: Vec<OutlineCurve>,
    /// Font units to em.
    scale: f32,
    origin: [f32; 2],
}

impl PlacedGlyph {
    /// A point of the outline, in em.
    pub(super) fn point(&self, point: ab_glyph::Point) -> [f32; 2] {
        [self.origin[0] + self.scale * point.x, self.origin[1] - self.scale * point.y]
    }
}

/// Signs that the font lacks: the sign that is drawn instead, smaller and raised.
const RAISED: [(char, char); 2] = [('⁻', '−'), ('⁺', '+')];
/// Size and height above the baseline of raised signs, em.
const RAISED_SIZE: f32 = 0.6;
const RAISED_BY: f32 = 0.28;

/// The glyphs of a line of text, and its width, em.
pub(super) fn layout(text: &str) -> (Vec<PlacedGlyph>, f64) {
    let Some(font) = &*FONT else { return (Vec::new(), 0.0) };
    let em = font.units_per_em().unwrap_or(1000.0);
    let (mut glyphs, mut x) = (Vec::new(), 0.0);
    let mut before: Option<GlyphId> = None;
    for letter in text.chars() {
        let raised = RAISED.iter().find(|(sign, _)| *sign == letter).map(|(_, drawn)| *drawn);
        let glyph = font.glyph_id(raised.unwrap_or(letter));
        let (size, up) = if raised.is_some() { (RAISED_SIZE, RAISED_BY) } else { (1.0, 0.0) };
        x += before.map_or(0.0, |before| font.kern_unscaled(before, glyph) / em);
        before = raised.is_none().then_some(glyph);
        if let Some(outline) = font.outline(glyph) {
            glyphs.push(PlacedGlyph { outline: outline.curves, scale: size / em, origin: [x, -up] });
        }
        x += size * font.h_advance_unscaled(glyph) / em;
    }
    (glyphs, f64::from(x))
}

/// Width of a line of text of a size.
pub(super) fn width(text: &str, size: f64) -> f64 {
    size * layout(text).1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_font_has_every_sign_of_the_figures() {
        let font = FONT.as_ref().unwrap();
        for letter in "aÅ°µΛλ·×−–⁰¹²³⁴⁵⁶⁷⁸⁹₀₁₂()/".chars() {
            assert!(font.glyph_id(letter).0 != 0, "{letter}");
        }
        assert!(width("10⁻³", 10.0) > width("10³", 10.0));
    }
}
