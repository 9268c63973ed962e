//! One billboard: where it stands, which part of which texture it shows, and how motion slants it.

use bansho_base::{
    image::Rect,
    math::{self, DVec2, DVec3},
    random::Purpose,
};

use crate::{
    flame_sheet::placement::{Mapping, Stand, bounds, right_facing},
    rain::{
        lattice::{CELL, Cell},
        moment::{ClassNow, Moment},
    },
};

use super::{VARIANTS, sheet::COLUMNS};

const OFFSET: Purpose = Purpose::named("rain billboard offset");
const PLACE: Purpose = Purpose::named("rain billboard place");
/// Greatest lean of streaks on a billboard, as a tangent in the cell's own measure.
const STEEPEST: f64 = 20.0;
/// By how much motion of the camera may lengthen or shorten the texture.
const STRETCH: [f64; 2] = [0.2, 5.0];
/// Least cosine of the elevation at which a billboard is seen: upright sheets vanish from straight above.
const LEAST_COS_ELEVATION: f64 = 0.3;

/// An upright square that faces the camera.
#[derive(Clone, Debug)]
pub(crate) struct Card {
    /// Which diameter.
    pub(crate) class: usize,
    /// Which of its textures.
    pub(crate) variant: u64,
    /// Diameter of its drops, mm.
    pub(crate) diameter_mm: f32,
    /// From pixels to the square: x and y from 0 to 1, up, and depth.
    pub(crate) mapping: Mapping,
    /// Where in the texture it begins, in cells.
    pub(crate) offset: [f32; 2],
    /// 1, or -1 where it is mirrored.
    pub(crate) side: f32,
    /// How far streaks lean across, in cells, for each cell up.
    pub(crate) lean: f32,
    /// Cells of texture in its height.
    pub(crate) repeats: f32,
    /// Height on it where the ground is.
    pub(crate) floor: f32,
    /// Texels that a streak leans within a pixel's height.
    pub(crate) blur: f32,
    /// Opacity beside the texture's.
    pub(crate) strength: f32,
    /// Distance of its middle, m.
    pub(crate) distance: f32,
    /// Depth of its middle, m.
    pub(crate) depth: f32,
    /// First and last row of the picture that it may touch.
    pub(crate) rows: [f32; 2],
    /// Pixels that it may touch.
    pub(crate) rect: Rect,
    /// Share of it that lies in the picture.
    pub(crate) in_view: f64,
}

impl Card {
    /// The billboard of a cell; `None` where it does not show. `weight` is how much of it is drawn where its middle is.
    pub(super) fn new(
        moment: &Moment,
        class: &ClassNow,
        cell: Cell,
        picture: Rect,
        weight: &(dyn Fn(DVec3) -> f64 + Sync),
    ) -> Option<Self> {
        let contents = class.lattice.contents(cell);
        let [u, v, choice, mirrored] = moment.key.uniforms(contents, 0, class.purpose(OFFSET));
        let shift = moment.key.uniforms(contents, 0, class.purpose(PLACE)).map(|value| f64::from(value) - 0.5);
        // Anywhere within the cell's ground: no two stand in a row.
        let place = DVec3::from(cell.0.map(|count| count as f64 + 0.5)) + DVec3::new(shift[0], 0.0, shift[1]);
        let (middle, velocity) = moment.drop(class, place);
        let camera = moment.sight.middle();
        let offset = middle - camera.position;
        let distance = offset.length();
        let shown = weight(middle);
        let height = class.lattice.height();
        if shown <= 0.0 || moment.sheltered(middle, velocity) || middle.y + 0.5 * height < moment.ground {
            return None;
        }
        let base = middle - DVec3::Y * (0.5 * height);
        let stand = Stand::new(base, right_facing(camera, base), DVec2::new(CELL, height), 0.0);
        let mapping = Mapping::new(camera, &stand)?;
        let rect = bounds(camera, &stand, 0.0, 1.0, 1.0, [picture.width, picture.height]);
        let depth = camera.depth(middle);
        if rect.is_empty() || depth <= 0.0 {
            return None;
        }
        let slant = Slant::new(moment, class, &mapping, middle, velocity, height);
        let level = math::hypot(offset.x, offset.z) / distance;
        let pixels_up = height * camera.focal_pixels / depth;
        Some(Self {
            class: class.index,
            variant: (choice * VARIANTS as f32) as u64,
            diameter_mm: class.diameter_mm as f32,
            mapping,
            offset: [u, v],
            side: if mirrored < 0.5 { 1.0 } else { -1.0 },
            lean: slant.lean as f32,
            repeats: slant.repeats as f32,
            floor: ((moment.ground - base.y) / height).max(0.0) as f32,
            blur: (slant.lean.abs() * COLUMNS as f64 / pixels_up) as f32,
            strength: (shown * moment.gain * crossing(math::hypot(offset.x, offset.z)) / level.max(LEAST_COS_ELEVATION))
                as f32,
            distance: distance as f32,
            depth: depth as f32,
            rows: [rect.y as f32, rect.bottom() as f32 - 1.0],
            in_view: ((rect.width * rect.height) as f64 / (pixels_up * pixels_up / height)).min(1.0),
            rect,
        })
    }
}

/// How many more drops a line of sight meets in air than on the squares that stand for it: seen from a level distance d, squares that
/// all face the camera overlap less than the air they stand for, by `2 d atan(1 / (2 d))`.
fn crossing(level_distance: f64) -> f64 {
    let d = level_distance.max(0.3) / CELL;
    1.0 / (2.0 * d * math::atan(0.5 / d))
}

/// How drops move on a billboard while the shutter is open.
struct Slant {
    lean: f64,
    repeats: f64,
}

impl Slant {
    /// The picture's motion of a drop in the middle, taken back onto the square: so wind, a camera that moves or turns, and
    /// perspective all slant streaks as they do each drop.
    fn new(moment: &Moment, class: &ClassNow, mapping: &Mapping, middle: DVec3, velocity: DVec3, height: f64) -> Self {
        let fallen = class.speed * moment.sight.exposure / height;
        let way = 0.5 * velocity * moment.sight.exposure;
        let [open, camera, close] = &moment.sight.cameras;
        let places = [open.project(middle - way), camera.project(middle), close.project(middle + way)];
        let straight = Self { lean: 0.0, repeats: 1.0 };
        let [Some(from), Some(there), Some(to)] = places else { return straight };
        let half = 0.5 * (to.pixel - from.pixel);
        let on_square = |pixel: DVec2| mapping.at(pixel.x, pixel.y);
        let (Some(from), Some(to)) = (on_square(there.pixel - half), on_square(there.pixel + half)) else {
            return straight;
        };
        let (across, up) = (to[0] - from[0], to[1] - from[1]);
        if !(fallen > 1e-9 && up.abs() > 1e-9) {
            return straight;
        }
        let stretch = (up.abs() / fallen).clamp(STRETCH[0], STRETCH[1]);
        Self { lean: (across / up).clamp(-STEEPEST, STEEPEST), repeats: 1.0 / stretch }
    }
}
