//! The plate as level ground mirrors it.

use std::sync::OnceLock;

use bansho_base::{
    camera::{Camera, Projection},
    image::Image,
    math::{DVec2, DVec3},
};

use super::plate::PlateFrame;

/// Depth of what is infinitely far, m.
const FAR: f64 = 1e6;
/// What stands lower than this over the mirror is ground, as a share of its depth: no plate's depth is exact.
const GROUND: f64 = 0.005;
/// Neighbours whose depths differ by less than this share are one surface.
const SURFACE: f64 = 0.1;

/// A plate's image in the mirror, made when it is first asked for.
#[derive(Clone, Debug, Default)]
pub(super) struct MirrorImage(OnceLock<Box<PlateFrame>>);

/// A pixel of the plate and where the mirror shows it.
#[derive(Clone, Copy)]
struct Seen {
    place: Projection,
    colour: [f32; 4],
}

impl PlateFrame {
    /// What a level mirror at `height` (m) shows of the plate to the camera that took it: all that stands above the mirror, each pixel
    /// moved to where its depth says that its image lies. What the plate itself does not show, the mirror cannot show either.
    pub(super) fn mirrored(&self, camera: &Camera, height: f64) -> &Self {
        self.mirror.0.get_or_init(|| Box::new(self.reflect(camera, height)))
    }

    fn reflect(&self, camera: &Camera, height: f64) -> Self {
        let (Some(colour), Some(depth)) = (&self.colour, &self.depth) else { return Self::default() };
        let (width, rows) = (colour.width(), colour.height());
        let mut image = Reflection {
            colour: Image::filled(width, rows, [0.0; 4]),
            depth: Image::filled(width, rows, [f32::INFINITY]),
        };
        let seen = |x: usize, y: usize| {
            let place = mirror_image(camera, height, [x, y], f64::from(depth.at(x, y)[0]))?;
            let colour = colour.at(x, y);
            (colour[3] > 0.0).then_some(Seen { place, colour })
        };
        for x in 0..width {
            let mut above: Option<Seen> = None;
            for y in 0..rows {
                let here = seen(x, y);
                match (above, here) {
                    (Some(above), Some(here)) if one_surface(&above, &here) => image.add_between(&above, &here),
                    (_, Some(here)) => image.add_between(&here, &here),
                    (_, None) => {}
                }
                above = here;
            }
        }
        Self { colour: Some(image.colour), depth: Some(image.depth), ..Self::default() }
    }
}

/// Where the mirror at `height` shows what a pixel shows at a depth, if that stands above the mirror.
fn mirror_image(camera: &Camera, height: f64, [x, y]: [usize; 2], depth: f64) -> Option<Projection> {
    let depth = depth.min(FAR);
    let point = camera.position + camera.direction(DVec2::new(x as f64, y as f64) + 0.5)? * depth;
    let above = point.y - height;
    if above <= GROUND * depth {
        return None;
    }
    camera.project(DVec3::new(point.x, height - above, point.z))
}

fn one_surface(one: &Seen, other: &Seen) -> bool {
    let (one, other) = (one.place.depth, other.place.depth);
    (one - other).abs() < SURFACE * one.min(other)
}

/// The picture in the mirror, nearest things before others.
struct Reflection {
    colour: Image<4>,
    depth: Image<1>,
}

impl Reflection {
    /// Adds the pixels between the images of two neighbours of a column, and as many beside them as leave no gap between columns.
    fn add_between(&mut self, one: &Seen, other: &Seen) {
        let (from, to) = (one.place.pixel, other.place.pixel);
        let [top, bottom] = [from.y.min(to.y) - 0.5, from.y.max(to.y) + 0.5].map(|y| y.round().max(0.0) as usize);
        for y in top..bottom.min(self.colour.height()) {
            let length = to.y - from.y;
            let share = if length == 0.0 { 0.5 } else { ((y as f64 + 0.5 - from.y) / length).clamp(0.0, 1.0) };
            let depth = (one.place.depth + (other.place.depth - one.place.depth) * share) as f32;
            let colour = std::array::from_fn(|c| {
                let [one, other] = [one.colour[c], other.colour[c]];
                one + (other - one) * share as f32
            });
            let place = from.x + (to.x - from.x) * share;
            for x in [place - 0.25, place + 0.25].map(f64::floor) {
                if x >= 0.0 && (x as usize) < self.colour.width() {
                    self.add(x as usize, y, depth, colour);
                }
            }
        }
    }

    fn add(&mut self, x: usize, y: usize, depth: f32, colour: [f32; 4]) {
        if depth <= self.depth.at(x, y)[0] {
            self.depth.row_mut(y)[x] = [depth];
            self.colour.row_mut(y)[x] = colour;
        }
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::camera::CameraParameters;

    use super::*;

    #[test]
    fn a_pillar_on_the_ground_stands_upside_down_below_its_foot() {
        // A level camera 1 m above the ground; a pillar 10 m away, from column 30 to 33, 1.5 m high; all else is far.
        let parameters = CameraParameters {
            position: [0.0, 1.0, 0.0].into(),
            target: [0.0, 1.0, -10.0].into(),
            vertical_fov_deg: 40.0.into(),
            ..CameraParameters::default()
        };
        let camera = parameters.at(0.0, [64, 64]);
        let row = |height: f64| camera.project(DVec3::new(0.0, height, -10.0)).map_or(0.0, |place| place.pixel.y);
        let (head, foot, image_of_head) = (row(1.5), row(0.0), row(-1.5));
        let mut plate = PlateFrame {
            colour: Some(Image::filled(64, 64, [0.0, 0.0, 1.0, 1.0])),
            depth: Some(Image::filled(64, 64, [f32::INFINITY])),
            ..PlateFrame::default()
        };
        for y in head.round() as usize..foot.round() as usize {
            for x in 30..34 {
                plate.colour.as_mut().unwrap().row_mut(y)[x] = [1.0, 0.0, 0.0, 1.0];
                plate.depth.as_mut().unwrap().row_mut(y)[x] = [10.0];
            }
        }
        let mirrored = plate.mirrored(&camera, 0.0);
        let (colour, depth) = (mirrored.colour.as_ref().unwrap(), mirrored.depth.as_ref().unwrap());
        let is_pillar = |y: usize| colour.at(32, y)[0] > 0.5;
        let rows: Vec<usize> = (0..64).filter(|&y| is_pillar(y)).collect();
        assert!((rows[0] as f64 - foot).abs() < 2.5 && (rows[rows.len() - 1] as f64 + 1.0 - image_of_head).abs() < 1.5);
        assert_eq!(rows.len(), rows[rows.len() - 1] - rows[0] + 1, "no gap");
        assert!(rows.iter().all(|&y| (depth.at(32, y)[0] - 10.0).abs() < 0.01));
        // Sky beside it, and nothing of the plate above the horizon.
        assert_eq!(colour.at(10, 60), [0.0, 0.0, 1.0, 1.0]);
        assert_eq!(colour.at(10, 20)[3], 0.0);
    }
}
