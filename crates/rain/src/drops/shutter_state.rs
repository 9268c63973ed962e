//! The state of the rain during one exposure: number, positions and motion of the drops of each diameter.

use bansho_base::{
    math::{DVec2, DVec3, random::Key},
    phenomenon::{
        strip::{Shutter, View},
        surroundings::{Occluder, Surroundings},
    },
};

use super::{
    cell_motion::{CellState, Deviation, DeviationLanes, Deviations},
    classes::{DropClassState, DropClasses},
    gust::{GustField, GustLanes, GustState, horizontal},
    gust_cells::{GustLine, Path},
    lattice::{CELL_SIZE, LatticeCell},
};
use crate::{
    lanes::smoothstep,
    parameters::{OpacityLaw, RainParameters},
    shutter_cameras::{MAX_DROP_RADIUS, ShutterCameras},
};

/// Deviation from uniform motion during half an exposure up to which the mean wind counts as constant, m.
const STEADY_WIND_ERROR: f64 = 1e-6;
/// Width of the transition from streaks to single scattering as a fraction of the region's radius, half of it on each
/// side.
const REGION_FADE: f64 = 0.2;
/// How far beyond the region cells may be requested, m: lamps at its border have spheres of per-drop streaks around
/// them.
const LAMP_MARGIN: f64 = 8.0;

/// A drop at the middle of the exposure.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DropState {
    /// m.
    pub(crate) position: DVec3,
    /// m/s.
    pub(crate) velocity: DVec3,
    /// Horizontal offsets, when the shutter opens and when it closes, from where its velocity would take it, m; `None` for uniform motion.
    pub(crate) bends: Option<[DVec2; 2]>,
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
    pub(crate) cell: LatticeCell,
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
    /// Duration of the whole exposure, of which this may be a part, s.
    whole_exposure: f64,
    /// Horizontal mean wind, scaled by the response of the drops, m/s.
    wind: DVec3,
    /// Horizontal displacement by the mean wind from the middle of the exposure to its beginning and its end, scaled likewise, m; `None` if the mean wind
    /// does not change meanwhile.
    travel: Option<[DVec3; 2]>,
    gusts: Option<GustField>,
    /// Solids that shelter the air below them from rain.
    occluders: Vec<Occluder>,
}

impl ShutterState {
    /// The rain of these classes in the exposure of a view; its drops are random by `key`.
    pub(crate) fn new(
        parameters: &RainParameters,
        key: Key,
        classes: &DropClasses,
        view: &View,
        surroundings: &Surroundings,
    ) -> Self {
        let cameras = ShutterCameras::new(view);
        let t = view.shutter.middle();
        let (wind, response) = (surroundings.wind, parameters.wind_response);
        let radius = parameters.distance * (1.0 + REGION_FADE) + 2.0 * CELL_SIZE;
        let mean = horizontal(wind.mean(t)) * response;
        let Shutter { open, close } = view.shutter;
        let travel = [open, close].map(|end| horizontal(wind.travel(t, end)) * response);
        let is_steady = (0..2).all(|end| (travel[end] - mean * ([open, close][end] - t)).length() < STEADY_WIND_ERROR);
        let ground = ground_height(&surroundings.others.occluders).unwrap_or(parameters.ground_height);
        let (eye, reach) = (cameras.middle().position, parameters.distance * (1.0 + REGION_FADE) + LAMP_MARGIN);
        Self {
            key,
            classes: classes.states(parameters, t, surroundings, ground, eye.y - reach..=eye.y + reach),
            ground,
            distance: parameters.distance,
            gain: parameters.opacity_gain,
            opacity: parameters.opacity,
            whole_exposure: view.shutter.duration(),
            wind: mean,
            travel: (!is_steady).then_some(travel),
            gusts: GustField::new(wind, response, eye, radius, ground, view.shutter, classes.loop_s),
            occluders: surroundings.others.occluders.iter().filter(|solid| !is_ground(solid)).cloned().collect(),
            cameras,
        }
    }

    /// The same as one of several equal parts of an exposure, whose streaks come to those of the whole exposure.
    pub(crate) fn into_part(self, parts: usize) -> Self {
        let whole_exposure = self.whole_exposure * parts as f64;
        Self { gain: self.gain / parts as f64, whole_exposure, ..self }
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
        self.gain * self.opacity.factor(diameter_mm, speed, self.whole_exposure)
    }

    /// The sphere of `radius` (m) around the camera.
    pub(crate) fn around_camera(&self, radius: f64) -> Sphere {
        Sphere { center: self.cameras.middle().position, radius }
    }

    /// The drops of a cell of a class.
    #[inline(always)]
    pub(crate) fn cell_state(&self, class: &DropClassState, cell: LatticeCell) -> CellState {
        let eye = self.cameras.middle().position;
        let lattice = &class.lattice;
        let origin = lattice.point_in_world(cell, DVec3::ZERO);
        let [base, right, up, back] = [
            origin - eye,
            lattice.point_in_world(cell, DVec3::X) - origin,
            lattice.point_in_world(cell, DVec3::Y) - origin,
            lattice.point_in_world(cell, DVec3::Z) - origin,
        ]
        .map(|vector| vector.as_vec3().to_array());
        let velocity = self.steady_velocity(class);
        let deviations = if self.gusts.is_some() || self.travel.is_some() {
            let opposite = lattice.point_in_world(cell, DVec3::ONE);
            Some(Deviations::new(self.deviations_at_corners([origin, opposite], velocity)))
        } else {
            None
        };
        CellState { base, axes: [right, up, back], velocity: velocity.as_vec3().to_array(), deviations }
    }

    /// Velocity of the drops of a class in the mean wind, m/s.
    fn steady_velocity(&self, class: &DropClassState) -> DVec3 {
        self.wind - DVec3::Y * class.speed
    }

    /// Displacement of drops of a steady `velocity` (m/s) by the mean wind from the middle of the exposure to its beginning and its end, and what it is more than
    /// with that velocity, m.
    #[inline(always)]
    fn steady_travel(&self, velocity: DVec3) -> [[DVec3; 2]; 2] {
        let half = 0.5 * self.cameras.exposure_time;
        let uniform = [-half, half].map(|time| velocity * time);
        let Some([open, close]) = self.travel else { return [uniform, [DVec3::ZERO; 2]] };
        let travel = [DVec3::new(open.x, uniform[0].y, open.z), DVec3::new(close.x, uniform[1].y, close.z)];
        [travel, [travel[0] - uniform[0], travel[1] - uniform[1]]]
    }

    /// How a drop deviates from uniform motion that would be at `point` at the middle of the exposure, and whose velocity in the mean wind is `velocity`.
    fn deviation(&self, point: DVec3, velocity: DVec3) -> Deviation {
        let half = 0.5 * self.cameras.exposure_time;
        let [travel, bends] = self.steady_travel(velocity);
        let bends = bends.map(|bend| DVec2::new(bend.x, bend.z));
        let mut deviation = Deviation { bends, ..Deviation::default() };
        if let Some(gusts) = &self.gusts {
            let GustState { displacements, velocity } = gusts.at(path(point, travel), velocity);
            let [open, middle, close] = displacements;
            (deviation.displacement, deviation.velocity) = (middle, velocity);
            deviation.bends[0] += open - middle + velocity * half;
            deviation.bends[1] += close - middle - velocity * half;
        }
        deviation
    }

    /// The deviations at the corners of a cell between two points, x fastest, then y.
    #[inline(always)]
    fn deviations_at_corners(&self, [low, high]: [DVec3; 2], velocity: DVec3) -> [DeviationLanes; 8] {
        let [travel, bends] = self.steady_travel(velocity);
        if let Some(gusts) = &self.gusts
            && let Some(mut corners) = gusts.at_corners(path(low, travel), path(high, travel), velocity)
        {
            // A closure passed to `map` would not be compiled for wide vectors.
            for corner in &mut corners {
                *corner = self.deviation_of_gusts(corner, bends);
            }
            return corners;
        }
        std::array::from_fn(|index| {
            let is_high = [0, 1, 2].map(|axis| index >> axis & 1 == 1);
            let corner = DVec3::from(std::array::from_fn(|axis| if is_high[axis] { high[axis] } else { low[axis] }));
            self.deviation(corner, velocity).lanes()
        })
    }

    /// The deviation by gusts, and by the bends of the mean wind, m.
    #[inline(always)]
    fn deviation_of_gusts(
        &self,
        &[open_x, open_z, close_x, close_z, x, z, velocity_x, velocity_z]: &GustLanes,
        [open, close]: [DVec3; 2],
    ) -> DeviationLanes {
        let half = 0.5 * self.cameras.exposure_time as f32;
        let [open, close] = [open.as_vec3(), close.as_vec3()];
        [
            x,
            z,
            velocity_x,
            velocity_z,
            open_x - x + velocity_x * half + open.x,
            open_z - z + velocity_z * half + open.z,
            close_x - x - velocity_x * half + close.x,
            close_z - z - velocity_z * half + close.z,
        ]
    }

    /// A drop at a point of a cell, given as fractions of its edges.
    pub(crate) fn drop_state(&self, class: &DropClassState, cell: LatticeCell, within: DVec3) -> DropState {
        let (position, velocity) = (class.lattice.point_in_world(cell, within), self.steady_velocity(class));
        self.deviated_drop(position, velocity, self.steady_travel(velocity), |field, path| {
            field.at_point(path, velocity)
        })
    }

    /// The drop that without gusts is at a `position` and has a `velocity` (m/s), in the gusts that `at` finds along its path.
    fn deviated_drop(
        &self,
        position: DVec3,
        velocity: DVec3,
        [travel, bends]: [[DVec3; 2]; 2],
        at: impl FnOnce(&GustField, Path) -> Option<GustLanes>,
    ) -> DropState {
        if self.gusts.is_none() && self.travel.is_none() {
            return DropState { position, velocity, bends: None };
        }
        let gusts = self.gusts.as_ref().and_then(|field| at(field, path(position, travel)));
        let lanes = match gusts {
            Some(gusts) => self.deviation_of_gusts(&gusts, bends),
            None => self.deviation(position, velocity).lanes(),
        };
        let [x, z, velocity_x, velocity_z, open_x, open_z, close_x, close_z] = lanes.map(f64::from);
        DropState {
            position: position + DVec3::new(x, 0.0, z),
            velocity: velocity + DVec3::new(velocity_x, 0.0, velocity_z),
            bends: Some([DVec2::new(open_x, open_z), DVec2::new(close_x, close_z)]),
        }
    }

    /// The drops at the centers of the cells `[x, row]` of a class from one z to another.
    fn drop_line(&self, class: &DropClassState, [x, row]: [i64; 2], ends: [i64; 2]) -> DropLine {
        let velocity = self.steady_velocity(class);
        let [travel, bends] = self.steady_travel(velocity);
        let [from, to] =
            ends.map(|z| path(class.lattice.point_in_world(LatticeCell([x, row, z]), DVec3::splat(0.5)), travel));
        let gusts = self.gusts.as_ref().and_then(|gusts| gusts.along_z(from, to, velocity));
        DropLine { velocity, travel, bends, gusts }
    }

    /// The drop at the center of a cell of a line.
    fn drop_of_line(&self, class: &DropClassState, cell: LatticeCell, line: &DropLine) -> DropState {
        let position = class.lattice.point_in_world(cell, DVec3::splat(0.5));
        self.deviated_drop(position, line.velocity, [line.travel, line.bends], |field, path| {
            field.at_line(line.gusts.as_ref()?, path)
        })
    }

    /// Cells of a class with drops that may be visible within a sphere. Drops are drawn up to `half_width` (m) from the cell's center in x and z.
    pub(crate) fn visible_cells(&self, class: &DropClassState, bounds: Sphere, half_width: f64) -> Vec<VisibleCell> {
        let extents = class.lattice.half_extents(half_width);
        // The drops that gusts carry into the sphere, and the centers of their cells.
        let sphere = [bounds.center - bounds.radius, bounds.center + bounds.radius];
        let [low, high] = self.gusts.as_ref().map_or(sphere, |gusts| gusts.source_bounds(sphere));
        let [low, high] = [low - extents, high + extents];
        let travel =
            0.5 * (class.speed + self.cameras.velocity().length()) * self.cameras.exposure_time + MAX_DROP_RADIUS;
        let mut cells = Vec::new();
        let lines = self.cell_lines(class, extents, travel);
        let rows = [low.y.max(self.ground - CELL_SIZE), high.y].map(|y| class.lattice.row(y));
        for row in rows[0]..=rows[1] {
            let [first, last] = [low, high].map(|corner| class.lattice.column(row, DVec2::new(corner.x, corner.z)));
            for x in first[0]..=last[0] {
                let [from, to] = lines.visible_part(class, [x, row], [first[1], last[1]]);
                if from <= to {
                    let line = self.drop_line(class, [x, row], [from, to]);
                    for z in from..=to {
                        cells.extend(self.visible_cell(
                            class,
                            LatticeCell([x, row, z]),
                            &line,
                            bounds,
                            extents,
                            travel,
                        ));
                    }
                }
            }
        }
        cells
    }

    /// A cell of a line, if its drops may be visible within a sphere. They are drawn within `extents` of its center (m), and move up to `travel` (m) relative
    /// to the camera beside what the wind adds.
    fn visible_cell(
        &self,
        class: &DropClassState,
        cell: LatticeCell,
        line: &DropLine,
        Sphere { center, radius }: Sphere,
        extents: DVec3,
        travel: f64,
    ) -> Option<VisibleCell> {
        let DropState { position: point, velocity, bends } = self.drop_of_line(class, cell, line);
        // Drops are displaced by other gusts than the center of their cell.
        let margin = self.gusts.as_ref().map_or(DVec3::ZERO, |gusts| {
            let undisplaced = class.lattice.point_in_world(cell, DVec3::splat(0.5));
            gusts.difference_around(undisplaced, extents.max_element())
        });
        let half = extents + margin;
        let nearest = ((point - center).abs() - half).max(DVec3::ZERO).length();
        let bend = bends.map_or(0.0, |[open, close]| open.length().max(close.length()));
        let wind_travel = 0.5 * horizontal(velocity).length() * self.cameras.exposure_time + bend;
        let is_visible = nearest < radius && self.cameras.may_be_visible(point, half, travel + wind_travel);
        let distance = (point - self.cameras.middle().position).length();
        is_visible.then_some(VisibleCell { center: point, distance, cell })
    }

    /// Lines of cells of a class whose drops move up to `travel` (m) relative to the camera beside what the wind adds.
    fn cell_lines(&self, class: &DropClassState, half: DVec3, travel: f64) -> CellLines<'_> {
        let half_s = 0.5 * self.cameras.exposure_time;
        let [min, max] = self.gusts.as_ref().map_or([DVec3::ZERO; 2], GustField::extremes);
        let by_gusts =
            self.gusts.as_ref().map_or(0.0, |gusts| gusts.largest_travel(self.steady_velocity(class), half_s));
        let by_wind =
            self.travel.map_or(self.wind.length() * half_s, |[open, close]| open.length().max(close.length()));
        CellLines {
            cameras: &self.cameras,
            displacement: 0.5 * (min + max),
            half: half + 0.5 * (max - min),
            travel: travel + by_wind + by_gusts,
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

/// The drops at the centers of a line of cells along z.
struct DropLine {
    /// Velocity in the mean wind, m/s.
    velocity: DVec3,
    /// [Travel and bends](ShutterState::steady_travel) by the mean wind, m.
    travel: [DVec3; 2],
    bends: [DVec3; 2],
    /// `None` without gusts.
    gusts: Option<GustLine>,
}

/// Where a drop that is at `point` at the middle of the exposure is when the shutter opens, at the middle and when it closes, by its `travel`, m.
#[inline(always)]
fn path(point: DVec3, [open, close]: [DVec3; 2]) -> Path {
    [point + open, point, point + close]
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
        let start = class.lattice.point_in_world(LatticeCell([x, row, 0]), DVec3::splat(0.5)) + self.displacement;
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
    let levels = occluders.iter().filter_map(|occluder| match occluder {
        Occluder::HalfSpace { point, normal } if normal.y > 0.999 => Some(point.y),
        _ => None,
    });
    levels.max_by(f64::total_cmp)
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
