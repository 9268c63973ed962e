//! The state of the rain during one exposure: number, positions and motion of the drops of each diameter.

use bansho_base::{
    math::{
        DVec2, DVec3,
        random::{Key, Purpose},
    },
    phenomenon::{
        strip::View,
        surroundings::{Occluder, Surroundings},
    },
};

use super::{
    cell::{CellState, GustInterpolant},
    gust::GustField,
    lattice::{CELL_SIZE, Cell, Lattice},
};
use crate::{
    Rain,
    lanes::smoothstep,
    opacity_law::OpacityLaw,
    shutter_cameras::{MAX_DROP_RADIUS, ShutterCameras},
};

/// Largest difference between the gust displacement of a drop and that of its cell's center, m.
const GUST_MARGIN: f64 = 0.2;
/// Width of the transition from streaks to single scattering as a fraction of the region's radius, half of it on each
/// side.
const REGION_FADE: f64 = 0.2;
/// How far beyond the region cells may be requested, m: lamps at its border have spheres of per-drop streaks around
/// them.
const LAMP_MARGIN: f64 = 8.0;

/// The drops of one diameter during an exposure.
#[derive(Clone, Debug)]
pub(crate) struct DropClassState {
    /// Index of the diameter, from the smallest.
    pub(crate) index: usize,
    /// Diameter D, mm.
    pub(crate) diameter_mm: f64,
    /// Terminal velocity v, m/s.
    pub(crate) speed: f64,
    /// Largest number of drops per cubic meter in the whole shot.
    pub(crate) max_density: f64,
    /// Fraction of these that exist now, 0 to 1.
    pub(crate) fraction: f64,
    /// The lattice of its cells.
    pub(crate) lattice: Lattice,
}

impl DropClassState {
    /// Expected number of drops in a cell now.
    pub(crate) fn count(&self) -> f64 {
        self.max_density * self.fraction * self.lattice.volume()
    }

    /// A random stream for `purpose` that no other diameter uses.
    pub(crate) fn purpose(&self, purpose: Purpose) -> Purpose {
        Purpose(purpose.0.wrapping_add(self.index as u32))
    }
}

/// A sphere.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sphere {
    pub(crate) center: DVec3,
    /// m.
    pub(crate) radius: f64,
}

/// A cell of a lattice that may be visible.
#[derive(Clone, Copy, Debug)]
pub(crate) struct VisibleCell {
    /// Its center in the world, m.
    pub(crate) center: DVec3,
    /// Distance of its center from the camera, m.
    pub(crate) distance: f64,
    pub(crate) cell: Cell,
}

/// The rain while the shutter is open.
#[derive(Clone, Debug)]
pub(crate) struct ShutterState {
    pub(crate) key: Key,
    pub(crate) cameras: ShutterCameras,
    pub(crate) classes: Vec<DropClassState>,
    /// Height of the ground, m.
    pub(crate) ground: f64,
    /// Distance to which streaks are drawn, m.
    pub(crate) distance: f64,
    /// Opacity gain: a factor on the physical opacity.
    pub(crate) gain: f64,
    /// Law of the opacity.
    opacity: OpacityLaw,
    /// Horizontal mean wind, scaled by the response of the drops, m/s.
    wind: DVec3,
    gusts: Option<GustField>,
    /// Solids that shelter the air below them from rain.
    occluders: Vec<Occluder>,
}

impl ShutterState {
    pub(crate) fn new(rain: &Rain, view: &View, surroundings: &Surroundings) -> Self {
        let parameters = &rain.parameters;
        let cameras = ShutterCameras::new(view);
        let t = view.shutter.middle();
        let (wind, response) = (surroundings.wind, parameters.wind_response);
        let radius = parameters.distance * (1.0 + REGION_FADE) + 2.0 * CELL_SIZE;
        let mean = wind.mean(t) * response;
        let ground = ground_height(&surroundings.others.occluders).unwrap_or(parameters.ground_height);
        let (eye, reach) = (cameras.middle().position, parameters.distance * (1.0 + REGION_FADE) + LAMP_MARGIN);
        Self {
            key: rain.key,
            classes: rain.classes(t, surroundings, ground, eye.y - reach..=eye.y + reach),
            ground,
            distance: parameters.distance,
            gain: parameters.opacity_gain,
            opacity: parameters.opacity,
            wind: DVec3::new(mean.x, 0.0, mean.z),
            gusts: GustField::new(wind, response, cameras.middle().position, radius, t),
            occluders: surroundings.others.occluders.iter().filter(|solid| !is_ground(solid)).cloned().collect(),
            cameras,
        }
    }

    /// The weight with which a drop at `distance` from the camera is drawn as a streak: 1 within the region, 0 beyond
    /// its transition.
    #[inline(always)]
    pub(crate) fn streak_weight(&self, distance: f32) -> f32 {
        let region = self.distance as f32;
        smoothstep(((1.0 + 0.5 * REGION_FADE as f32) * region - distance) / (REGION_FADE as f32 * region))
    }

    /// Factor of the opacity of drops of a diameter that fall with `speed` (m/s): the gain, and the law.
    pub(crate) fn opacity_factor(&self, diameter_mm: f64, speed: f64) -> f64 {
        self.gain * self.opacity.factor(diameter_mm, speed, self.cameras.exposure_time)
    }

    /// The sphere of `radius` (m) around the camera.
    pub(crate) fn around_camera(&self, radius: f64) -> Sphere {
        Sphere { center: self.cameras.middle().position, radius }
    }

    /// The drops of a cell of a class.
    pub(crate) fn cell_state(&self, class: &DropClassState, cell: Cell) -> CellState {
        let eye = self.cameras.middle().position;
        let corner = |step: [f64; 3]| class.lattice.point_in_world(cell, DVec3::from(step));
        let origin = corner([0.0; 3]);
        let [base, right, up, back] = [
            origin - eye,
            corner([1.0, 0.0, 0.0]) - origin,
            corner([0.0, 1.0, 0.0]) - origin,
            corner([0.0, 0.0, 1.0]) - origin,
        ]
        .map(|vector| vector.as_vec3().to_array());
        let velocity = (self.wind - DVec3::Y * class.speed).as_vec3().to_array();
        let gusts = self.gusts.as_ref().map(|gusts| {
            GustInterpolant::new(std::array::from_fn(|index| {
                gusts.at(corner([index & 1, index >> 1 & 1, index >> 2].map(|step| step as f64)))
            }))
        });
        CellState { base, axes: [right, up, back], velocity, gusts }
    }

    /// Position of a point of a cell (given as fractions of its edges) at the middle of the exposure, and its velocity,
    /// m/s.
    pub(crate) fn drop_state(&self, class: &DropClassState, cell: Cell, within: DVec3) -> (DVec3, DVec3) {
        let steady = class.lattice.point_in_world(cell, within);
        let velocity = self.wind - DVec3::Y * class.speed;
        match &self.gusts {
            None => (steady, velocity),
            Some(gusts) => {
                let [displacement, gust] = gusts.at(steady);
                (steady + displacement, velocity + gust)
            }
        }
    }

    /// Cells of a class with drops that may be visible within a sphere. Drops are drawn up to `half_width` (m) from the cell's center in x and z.
    pub(crate) fn visible_cells(
        &self,
        class: &DropClassState,
        Sphere { center, radius }: Sphere,
        half_width: f64,
    ) -> Vec<VisibleCell> {
        let eye = self.cameras.middle().position;
        let margin = self.gusts.as_ref().map_or(0.0, |_| GUST_MARGIN);
        let half = class.lattice.half_extents(half_width) + margin;
        let reach = radius + half.max_element();
        let bounds = [center - reach, center + reach];
        let [low, high] = self.gusts.as_ref().map_or(bounds, |gusts| gusts.source_bounds(bounds));
        let travel = 0.5 * (class.speed + self.cameras.velocity().length()) * self.cameras.exposure_time
            + margin
            + MAX_DROP_RADIUS;
        let mut cells = Vec::new();
        let mut add = |cell| {
            let (point, velocity) = self.drop_state(class, cell, DVec3::splat(0.5));
            let nearest = ((point - center).abs() - half).max(DVec3::ZERO).length();
            let wind_travel = 0.5 * DVec3::new(velocity.x, 0.0, velocity.z).length() * self.cameras.exposure_time;
            if nearest < radius && self.cameras.may_be_visible(point, half, travel + wind_travel) {
                cells.push(VisibleCell { center: point, distance: (point - eye).length(), cell });
            }
        };
        let lines = self.cell_lines(half, travel);
        let rows = [low.y.max(self.ground - CELL_SIZE), high.y].map(|y| class.lattice.row(y));
        for row in rows[0]..=rows[1] {
            let [first, last] = [low, high].map(|corner| class.lattice.column(row, DVec2::new(corner.x, corner.z)));
            for x in first[0]..=last[0] {
                let [from, to] = lines.visible_part(class, [x, row], [first[1], last[1]]);
                (from..=to).for_each(|z| add(Cell([x, row, z])));
            }
        }
        cells
    }

    /// Lines of cells whose drops move up to `travel` (m) relative to the camera beside what the wind adds.
    fn cell_lines(&self, half: DVec3, travel: f64) -> CellLines<'_> {
        let ([min, max], gust_speed) = self.gusts.as_ref().map_or(([DVec3::ZERO; 2], 0.0), |gusts| gusts.extremes());
        let wind_travel = 0.5 * (self.wind.length() + gust_speed) * self.cameras.exposure_time;
        CellLines {
            cameras: &self.cameras,
            displacement: 0.5 * (min + max),
            half: half + 0.5 * (max - min),
            travel: travel + wind_travel,
        }
    }

    /// Whether any solid may block rain.
    pub(crate) fn has_occluders(&self) -> bool {
        !self.occluders.is_empty()
    }

    /// Whether a solid blocks the rain that arrives at `point` with `velocity`.
    pub(crate) fn is_sheltered(&self, point: DVec3, velocity: DVec3) -> bool {
        self.occluders.iter().any(|occluder| ray_hits_occluder(occluder, point, -velocity.normalize_or_zero()))
    }
}

/// Lines of cells along z, to find which of them may be visible without a look at each.
struct CellLines<'a> {
    cameras: &'a ShutterCameras,
    /// Middle of all displacements by gusts, m.
    displacement: DVec3,
    /// Half extents of a cell's drops and of the displacements, m.
    half: DVec3,
    /// How far drops move relative to the camera, m.
    travel: f64,
}

impl CellLines<'_> {
    /// The range of cells along z that may be visible, within a range, for `[x, row]`. Reversed if there are none.
    fn visible_part(&self, class: &DropClassState, [x, row]: [i64; 2], [first, last]: [i64; 2]) -> [i64; 2] {
        let start = class.lattice.point_in_world(Cell([x, row, 0]), DVec3::splat(0.5)) + self.displacement;
        let [from, to] = self.cameras.visible_part([start, DVec3::Z * CELL_SIZE], self.half, self.travel);
        // One more on each side, for rounding.
        [first.max((from - 1.0).floor() as i64), last.min((to + 1.0).ceil() as i64)]
    }
}

/// Whether a solid is a half space, which is ground and shelters nothing.
fn is_ground(solid: &Occluder) -> bool {
    matches!(solid, Occluder::HalfSpace { .. })
}

/// Height of the highest horizontal ground plane among the solids, m.
pub(crate) fn ground_height(occluders: &[Occluder]) -> Option<f64> {
    let level = |occluder: &Occluder| match occluder {
        Occluder::HalfSpace { point, normal } if normal.y > 0.999 => Some(point.y),
        _ => None,
    };
    occluders.iter().filter_map(level).max_by(f64::total_cmp)
}

/// Steps of sphere tracing after which a grazing ray counts as a miss.
const MAX_TRACE_STEPS: usize = 64;
/// Maximum height of a sheltering solid, m.
const MAX_OCCLUDER_HEIGHT: f64 = 200.0;

/// Sphere tracing from `point` toward `up`: whether the ray meets the solid.
fn ray_hits_occluder(occluder: &Occluder, point: DVec3, up: DVec3) -> bool {
    if occluder.bounding_sphere().is_some_and(|sphere| ray_misses_sphere(sphere, point, up)) {
        return false;
    }
    let mut travel = 0.0;
    for _ in 0..MAX_TRACE_STEPS {
        let distance = occluder.signed_distance(point + up * travel);
        if distance < 1e-3 {
            return true;
        }
        travel += distance;
        if travel > MAX_OCCLUDER_HEIGHT {
            break;
        }
    }
    false
}

/// Whether a ray stays outside of a sphere, with a margin for what sphere tracing counts as a hit.
fn ray_misses_sphere((center, radius): (DVec3, f64), point: DVec3, up: DVec3) -> bool {
    const MARGIN: f64 = 2e-3;
    let offset = center - point;
    let nearest = offset - up * offset.dot(up).max(0.0);
    nearest.length_squared() > (radius + MARGIN) * (radius + MARGIN)
}

#[cfg(test)]
mod tests {
    use bansho_base::math::DQuat;

    use super::*;

    #[test]
    fn roofs_shelter_what_is_beneath_them_and_slanted_rain_comes_in() {
        let occluder = Occluder::Cuboid {
            center: DVec3::new(0.0, 3.1, 0.0),
            half_extents: DVec3::new(1.0, 0.1, 1.0),
            rotation: DQuat::IDENTITY,
        };
        let slanted = DVec3::new(1.0, 1.0, 0.0).normalize();
        assert!(
            ray_hits_occluder(&occluder, DVec3::ZERO, DVec3::Y)
                && !ray_hits_occluder(&occluder, DVec3::new(2.0, 0.0, 0.0), DVec3::Y)
        );
        assert!(
            !ray_hits_occluder(&occluder, DVec3::ZERO, slanted)
                && ray_hits_occluder(&occluder, DVec3::new(-3.0, 0.0, 0.0), slanted)
        );
        assert!(!ray_hits_occluder(&occluder, DVec3::new(0.0, 4.0, 0.0), DVec3::Y));
        let ball = Occluder::Sphere { center: DVec3::new(0.0, 2.0, 0.0), radius: 0.5 };
        assert!(
            ray_hits_occluder(&ball, DVec3::ZERO, DVec3::Y)
                && !ray_hits_occluder(&ball, DVec3::new(0.6, 0.0, 0.0), DVec3::Y)
        );
        let ground = Occluder::HalfSpace { point: DVec3::ZERO, normal: DVec3::Y };
        assert!(is_ground(&ground) && !is_ground(&occluder) && !is_ground(&ball));
    }
}
