//! Triangle rasterization: edge functions in fixed point with 8 subpixel bits, as GPUs have, the top-left fill rule, and linear
//! interpolation of vertex attributes.

use super::{
    blend::{Rgba, multiply},
    pixel_rect::{PixelRect, SUBPIXELS},
};

/// Coordinates are clamped to this, pixels, so that edge functions do not overflow.
const MAX_COORDINATE: f32 = 1048576.0;

/// A corner of a triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Corner {
    /// Subpixels.
    pub(super) at: [i32; 2],
    /// Texture coordinate, texels.
    pub(super) texel: [f32; 2],
    pub(super) color: Rgba,
}

impl Corner {
    /// At `pixels`, which must not be NaN.
    pub(super) fn at(pixels: [f32; 2], texel: [f32; 2], color: Rgba) -> Self {
        Self { at: pixels.map(snapped), texel, color }
    }
}

/// A coordinate in pixels on the grid of subpixels.
#[inline]
fn snapped(pixels: f32) -> i32 {
    // Rounded by a cast, since `round` is a function call without SSE4.1.
    let subpixels = pixels.clamp(-MAX_COORDINATE, MAX_COORDINATE) * SUBPIXELS as f32;
    (subpixels + 0.5_f32.copysign(subpixels)) as i32
}

/// How a triangle is colored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum TriangleColoring {
    /// One color.
    Plain(Rgba),
    /// Vertex colors times one texel.
    Blended(Rgba),
    /// Vertex colors times a texture.
    Textured,
}

/// A triangle of nonzero area, its corners clockwise on the screen.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    corners: [Corner; 3],
    pub(super) color: TriangleColoring,
    /// Bounding box of its texture coordinates, texels.
    pub(super) texels: [[f32; 2]; 2],
}

/// An edge function: `step_x` x + `step_y` y + `offset` is not negative inside.
struct Edge {
    step_x: i64,
    step_y: i64,
    offset: i64,
}

impl Triangle {
    /// `None` where it covers nothing or is transparent. `texel` samples the texture where all corners have one texture coordinate.
    pub(super) fn new(mut corners: [Corner; 3], texel: impl Fn(&Corner) -> Rgba) -> Option<Self> {
        match doubled_area(&corners) {
            0 => return None,
            ..0 => corners.swap(1, 2),
            _ => {}
        }
        let [a, b, c] = corners;
        let mut texels = [a.texel; 2];
        for corner in [b, c] {
            for axis in 0..2 {
                texels[0][axis] = texels[0][axis].min(corner.texel[axis]);
                texels[1][axis] = texels[1][axis].max(corner.texel[axis]);
            }
        }
        let color = if texels[0] == texels[1] {
            let texel = texel(&a);
            if a.color == b.color && b.color == c.color {
                TriangleColoring::Plain(multiply(texel, a.color))
            } else {
                TriangleColoring::Blended(texel)
            }
        } else {
            TriangleColoring::Textured
        };
        let is_visible = color != TriangleColoring::Plain([0; 4]);
        is_visible.then_some(Self { corners, color, texels })
    }

    /// Its bounding box.
    pub(super) fn bounds(&self) -> PixelRect {
        let [a, b, c] = self.corners.map(|corner| corner.at);
        let low = [0, 1].map(|axis| a[axis].min(b[axis]).min(c[axis]));
        let high = [0, 1].map(|axis| a[axis].max(b[axis]).max(c[axis]));
        PixelRect::covering(low, high)
    }

    /// Its edge functions.
    pub(super) fn coverage(&self) -> TriangleCoverage {
        let [a, b, c] = self.corners.map(|corner| corner.at.map(i64::from));
        TriangleCoverage { edges: [edge(a, b), edge(b, c), edge(c, a)] }
    }

    /// Linear interpolation of a vertex attribute.
    pub(super) fn plane(&self, of: impl Fn(&Corner) -> f32) -> AttributePlane {
        // From the snapped positions, which the edges have, too: otherwise the attribute would slip along thin triangles.
        let [a, b, c] = [0, 1, 2].map(|corner| self.corners[corner].at.map(|at| f64::from(at) / f64::from(SUBPIXELS)));
        let [at_a, at_b, at_c] = [0, 1, 2].map(|corner| f64::from(of(&self.corners[corner])));
        let (first, second) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
        let area = first[0] * second[1] - first[1] * second[0];
        let (by_first, by_second) = (at_b - at_a, at_c - at_a);
        let step_x = (by_first * second[1] - by_second * first[1]) / area;
        let step_y = (by_second * first[0] - by_first * second[0]) / area;
        AttributePlane { step_x, step_y, origin: at_a + (0.5 - a[0]) * step_x + (0.5 - a[1]) * step_y }
    }
}

/// Twice the area, square subpixels; positive where the corners go clockwise on the screen.
fn doubled_area(corners: &[Corner; 3]) -> i64 {
    let [a, b, c] = corners.map(|corner| corner.at.map(i64::from));
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// The edge function E(p) = (b - a) x (p - a), positive inside. By the top-left rule, pixel centers on an edge belong to the triangle on
/// left and top edges only, so that adjoining triangles share no pixel.
fn edge(a: [i64; 2], b: [i64; 2]) -> Edge {
    let [dx, dy] = [b[0] - a[0], b[1] - a[1]];
    let half = i64::from(SUBPIXELS / 2);
    let owns_boundary = dy < 0 || (dy == 0 && dx > 0);
    let offset = dx * (half - a[1]) - dy * (half - a[0]) - i64::from(!owns_boundary);
    Edge { step_x: -dy * i64::from(SUBPIXELS), step_y: dx * i64::from(SUBPIXELS), offset }
}

/// The pixels whose centers lie inside a triangle.
pub(super) struct TriangleCoverage {
    edges: [Edge; 3],
}

impl TriangleCoverage {
    /// The half-open range of covered pixels of row `y` within `left..right`.
    pub(super) fn span(&self, y: i32, left: i32, right: i32) -> [i32; 2] {
        let (mut from, mut to) = (i64::from(left), i64::from(right));
        for edge in &self.edges {
            let value = edge.step_y * i64::from(y) + edge.offset;
            match edge.step_x {
                0 if value < 0 => return [left, left],
                0 => {}
                step_x @ 1.. => from = from.max(-value.div_euclid(step_x)),
                step_x => to = to.min(value.div_euclid(-step_x) + 1),
            }
        }
        // A span that is not empty lies within `left..right`.
        if from < to { [from as i32, to as i32] } else { [left, left] }
    }

    /// Whether all pixels of `area` are covered.
    pub(super) fn contains_rect(&self, area: PixelRect) -> bool {
        let [x, y] = [[area.left, area.right - 1], [area.top, area.bottom - 1]].map(|ends| ends.map(i64::from));
        self.edges.iter().all(|edge| {
            // An edge function is linear, so that it is least at a corner: at one end of x and one of y.
            let least_x = (edge.step_x * x[0]).min(edge.step_x * x[1]);
            let least_y = (edge.step_y * y[0]).min(edge.step_y * y[1]);
            least_x + least_y + edge.offset >= 0
        })
    }
}

/// A vertex attribute, linear in screen space.
#[derive(Clone, Copy, Debug)]
pub(super) struct AttributePlane {
    step_x: f64,
    step_y: f64,
    /// The value at the center of pixel (0, 0).
    origin: f64,
}

impl AttributePlane {
    /// The value at the center of pixel `x` of row `y`, and its increment per pixel to the right.
    pub(super) fn row(&self, x: i32, y: i32) -> [f32; 2] {
        let start = self.origin + f64::from(x) * self.step_x + f64::from(y) * self.step_y;
        [start as f32, self.step_x as f32]
    }
}
