//! Figures as SVG 1.1. Text stays text: it can be searched, and edited in any drawing program.

use std::fmt::Write;

use bansho::media::files::provenance;

use super::{
    canvas::{FigureCanvas, LineStyle, TextAnchor, TextStyle},
    figure::Rgb,
};

/// A document that is being written.
pub(super) struct SvgCanvas {
    text: String,
}

impl SvgCanvas {
    /// A white page.
    pub(super) fn new(title: &str, [width, height]: [f64; 2]) -> Self {
        let mut text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
             font-family=\"Ubuntu, 'Helvetica Neue', Arial, sans-serif\">\n<!-- {} -->\n",
            provenance::COMMENT_TAG
        );
        let _ = writeln!(text, "<title>{}</title>", escaped(title));
        text += "<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n";
        Self { text }
    }

    /// The whole document.
    pub(super) fn finish(mut self) -> String {
        self.text += "</svg>\n";
        self.text
    }
}

impl FigureCanvas for SvgCanvas {
    fn line(&mut self, points: &[[f64; 2]], stroke: &LineStyle) {
        let points: Vec<String> = points.iter().map(|&[x, y]| format!("{},{}", length(x), length(y))).collect();
        let _ = writeln!(
            self.text,
            "<polyline fill=\"none\" {} stroke-linejoin=\"round\" points=\"{}\"/>",
            outline(stroke),
            points.join(" ")
        );
    }

    fn rectangle(&mut self, [[left, top], [right, bottom]]: [[f64; 2]; 2], color: Rgb, opacity: f64) {
        let _ = writeln!(
            self.text,
            "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"{}\" fill-opacity=\"{}\"/>",
            length(left),
            length(top),
            length(right - left),
            length(bottom - top),
            hexadecimal(color),
            length(opacity)
        );
    }

    fn marker(&mut self, [x, y]: [f64; 2], radius: f64, stroke: &LineStyle) {
        let _ = writeln!(
            self.text,
            "<circle cx=\"{}\" cy=\"{}\" r=\"{}\" fill=\"#ffffff\" {}/>",
            length(x),
            length(y),
            length(radius),
            outline(stroke)
        );
    }

    fn text(&mut self, text: &str, style: &TextStyle) {
        let [x, y] = style.at.map(length);
        let anchor = match style.anchor {
            TextAnchor::Start => "start",
            TextAnchor::Middle => "middle",
            TextAnchor::End => "end",
        };
        let weight = if style.bold { " font-weight=\"bold\"" } else { "" };
        let turned = if style.vertical { format!(" transform=\"rotate(-90 {x} {y})\"") } else { String::new() };
        let _ = writeln!(
            self.text,
            "<text x=\"{x}\" y=\"{y}\" font-size=\"{}\" text-anchor=\"{anchor}\"{weight}{turned}>{}</text>",
            length(style.size),
            escaped(text)
        );
    }
}

/// A length to a hundredth of a pixel.
fn length(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

fn hexadecimal([r, g, b]: Rgb) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn outline(stroke: &LineStyle) -> String {
    let dash = stroke.dash.map_or_else(String::new, |[on, off]| format!(" stroke-dasharray=\"{on} {off}\""));
    format!("stroke=\"{}\" stroke-width=\"{}\"{dash}", hexadecimal(stroke.color), length(stroke.width))
}

/// Text without markup; control characters, which XML does not allow, are left out.
fn escaped(text: &str) -> String {
    let text: String = text.chars().filter(|letter| !letter.is_control()).collect();
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
