//! Which pixels a triangle covers, and what its corners make of each: edges on the grid of 1/256 of a pixel that graphics cards have,
//! the top-left rule, and values that are linear in between.

use super::{
    blend::{Rgba, times},
    tiles::Area,
};

/// Positions are whole numbers of these a pixel.
pub(super) const SUBPIXELS: i32 = 256;

/// Nothing is farther away than this, pixels: what is, is moved there, and edge functions fit their integers.
const FARTHEST: f32 = 1048576.0;

/// A corner of a triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Corner {
    /// Subpixels.
    pub(super) at: [i32; 2],
    /// Its place in the texture, texels.
    pub(super) texel: [f32; 2],
    pub(super) colour: Rgba,
}

impl Corner {
    /// At `pixels`, which are numbers.
    pub(super) fn at(pixels: [f32; 2], texel: [f32; 2], colour: Rgba) -> Self {
        // By a cast, since rounding is a routine on processors that are not asked for what they can.
        let snapped = |at: f32| {
            let subpixels = at.clamp(-FARTHEST, FARTHEST) * SUBPIXELS as f32;
            (subpixels + 0.5_f32.copysign(subpixels)) as i32
        };
        Self { at: pixels.map(snapped), texel, colour }
    }
}

/// How a triangle is coloured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Colour {
    /// By one colour.
    Plain(Rgba),
    /// By those of its corners, and one texel.
    Blended(Rgba),
    /// By those of its corners, and a texture.
    Textured,
}

/// A triangle that is not flat, its corners clockwise on the screen.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    corners: [Corner; 3],
    pub(super) colour: Colour,
    /// Texels that it may show, lowest and highest.
    pub(super) texels: [[f32; 2]; 2],
}

/// Half a plane: places where `along` x + `offset` of their row is not negative.
struct Edge {
    along: i64,
    down: i64,
    offset: i64,
}

impl Triangle {
    /// `None` where it covers nothing or cannot be seen. Where all corners show one texel, that is asked for.
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
        let colour = if texels[0] == texels[1] {
            let texel = texel(&a);
            if a.colour == b.colour && b.colour == c.colour {
                Colour::Plain(times(texel, a.colour))
            } else {
                Colour::Blended(texel)
            }
        } else {
            Colour::Textured
        };
        let seen = colour != Colour::Plain([0; 4]);
        seen.then_some(Self { corners, colour, texels })
    }

    /// Pixels that it may cover.
    pub(super) fn bounds(&self) -> Area {
        let [a, b, c] = self.corners.map(|corner| corner.at);
        let low = [0, 1].map(|axis| a[axis].min(b[axis]).min(c[axis]));
        let high = [0, 1].map(|axis| a[axis].max(b[axis]).max(c[axis]));
        Area::between(low, high)
    }

    /// Which pixels it covers.
    pub(super) fn coverage(&self) -> Coverage {
        let [a, b, c] = self.corners.map(|corner| corner.at.map(i64::from));
        Coverage { edges: [edge(a, b), edge(b, c), edge(c, a)] }
    }

    /// A value that the corners have, wherever it covers pixels.
    pub(super) fn plane(&self, of: impl Fn(&Corner) -> f32) -> Plane {
        let place = |corner: &Corner| corner.at.map(|at| f64::from(at) / f64::from(SUBPIXELS));
        let [a, b, c] = [0, 1, 2].map(|corner| place(&self.corners[corner]));
        let [at_a, at_b, at_c] = [0, 1, 2].map(|corner| f64::from(of(&self.corners[corner])));
        let (first, second) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
        let area = first[0] * second[1] - first[1] * second[0];
        let (by_first, by_second) = (at_b - at_a, at_c - at_a);
        let across = (by_first * second[1] - by_second * first[1]) / area;
        let down = (by_second * first[0] - by_first * second[0]) / area;
        Plane { across, down, origin: at_a + (0.5 - a[0]) * across + (0.5 - a[1]) * down }
    }
}

/// Twice the area, square subpixels; positive where the corners go clockwise on the screen.
fn doubled_area(corners: &[Corner; 3]) -> i64 {
    let [a, b, c] = corners.map(|corner| corner.at.map(i64::from));
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// The edge from `a` to `b` with the triangle on its right: where E(p) = (b - a) x (p - a) is positive, and where it is 0 on edges on the
/// left or level ones at the top, so that pixels between triangles belong to one of them.
fn edge(a: [i64; 2], b: [i64; 2]) -> Edge {
    let [dx, dy] = [b[0] - a[0], b[1] - a[1]];
    let half = i64::from(SUBPIXELS / 2);
    let own = dy < 0 || (dy == 0 && dx > 0);
    let offset = dx * (half - a[1]) - dy * (half - a[0]) - i64::from(!own);
    Edge { along: -dy * i64::from(SUBPIXELS), down: dx * i64::from(SUBPIXELS), offset }
}

/// Pixels whose middles lie within.
pub(super) struct Coverage {
    edges: [Edge; 3],
}

impl Coverage {
    /// The pixels of row `y` among `left..right` that are covered: from the first to before the last.
    pub(super) fn span(&self, y: i32, left: i32, right: i32) -> [i32; 2] {
        let (mut from, mut to) = (i64::from(left), i64::from(right));
        for edge in &self.edges {
            let value = edge.down * i64::from(y) + edge.offset;
            match edge.along {
                0 if value < 0 => return [left, left],
                0 => {}
                along @ 1.. => from = from.max(-value.div_euclid(along)),
                along => to = to.min(value.div_euclid(-along) + 1),
            }
        }
        // Both lie within `left..right` again or the span is empty.
        if from < to { [from as i32, to as i32] } else { [left, left] }
    }

    /// Whether all of `area` is covered.
    pub(super) fn holds(&self, area: Area) -> bool {
        let [x, y] = [[area.left, area.right - 1], [area.top, area.bottom - 1]].map(|ends| ends.map(i64::from));
        self.edges.iter().all(|edge| {
            let least = |slope: i64, ends: [i64; 2]| (slope * ends[0]).min(slope * ends[1]);
            least(edge.along, x) + least(edge.down, y) + edge.offset >= 0
        })
    }
}

/// A value that is linear on the screen.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    across: f64,
    down: f64,
    /// At the middle of pixel (0, 0).
    origin: f64,
}

impl Plane {
    /// In the middle of pixel `x` of row `y`, and how much more each pixel farther right.
    pub(super) fn row(&self, x: i32, y: i32) -> [f32; 2] {
        let start = self.origin + f64::from(x) * self.across + f64::from(y) * self.down;
        [start as f32, self.across as f32]
    }
}
