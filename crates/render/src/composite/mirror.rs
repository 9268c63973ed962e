//! The plate and the sky as they are seen in a level mirror.
//!
//! What a plate shows of its scene stands where its depth says. The mirrored line of sight of a pixel, followed through the plate's own
//! picture, ends where it meets what stands there (reflections in screen space: McGuire & Mara 2014). What the plate does not show
//! is the sky's.

use bansho_base::{
    camera::{Camera, Lens},
    host::observer::{self, Cancelled, Observer},
    image::Image,
    math::{DVec2, DVec3},
    phenomenon::{LevelMirror, strip::View, surroundings::Backdrop},
    world::sky::Sky,
};

use super::plate::PlateFrame;
use rayon::prelude::*;

/// Pixels of the picture from one place on a line of sight to the next.
const STRIDE: f64 = 1.0;
/// Fewest and most places on a line of sight.
const PLACES: [f64; 2] = [16.0, 4096.0];
/// Share of its depth by which a surface may come nearer from one place to the next; what comes nearer by more stands before the line of
/// sight, which goes on behind it.
const JUMP: f64 = 0.03;
/// What is infinitely far, m.
const FAR: f64 = 1e6;
/// Pixels of the picture, along each side, in one of the backdrop.
const COARSE: usize = 8;

/// What a phenomenon's mirror shows.
pub(crate) struct Mirror {
    /// Radiance and alpha of the whole picture.
    pub(crate) seen: Image<4>,
    /// Plate and sky without the phenomena, small; only where there is a plate.
    pub(crate) backdrop: Option<Backdrop>,
}

/// The plate seen in a level mirror by `camera`: absolute radiance with coverage, and depth as the camera behind the mirror
/// measures it. Nothing where there is no plate or the mirror shows what the plate does not.
///
/// # Errors
/// The observer asked to stop.
pub(crate) fn mirrored(
    plate: &PlateFrame,
    camera: &Camera,
    mirror: LevelMirror,
    exposure: f32,
    observer: &dyn Observer,
) -> Result<PlateFrame, Cancelled> {
    let Some(color) = &plate.color else { return Ok(PlateFrame::default()) };
    let march = March { color, depth: plate.depth.as_ref(), camera, mirror, exposure };
    let (width, rows) = (color.width(), color.height());
    let mut seen = Image::filled(width, rows, [0.0; 4]);
    let mut depth = Image::filled(width, rows, [f32::INFINITY]);
    let lines = seen.pixels_mut().par_chunks_mut(width.max(1)).zip(depth.pixels_mut().par_chunks_mut(width.max(1)));
    lines.enumerate().try_for_each(|(y, (seen, depth))| {
        observer::check(observer)?;
        for (x, (seen, depth)) in seen.iter_mut().zip(depth).enumerate() {
            let pixel = DVec2::new(x as f64, y as f64) + 0.5;
            if let Some((color, far)) = march.seen(pixel) {
                (*seen, depth[0]) = (color, far);
            }
        }
        Ok(())
    })?;
    Ok(PlateFrame { color: Some(seen), depth: plate.depth.is_some().then_some(depth) })
}

/// Puts the sky, which a plate stands for in the picture itself, behind what is seen by the camera of a mirrored `view`; `scale` is the
/// view's pixels in one of `image`.
pub(crate) fn lay_sky(image: &mut Image<4>, view: &View, sky: &Sky, scale: usize) {
    let width = image.width().max(1);
    image.pixels_mut().par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.iter_mut().enumerate() {
            let place = (DVec2::new(x as f64, y as f64) + 0.5) * scale as f64;
            let left = 1.0 - pixel[3];
            let Some(direction) = view.camera.direction(place).filter(|_| left > 0.0) else { continue };
            let direction = DVec3::new(direction.x, direction.y.abs(), direction.z).normalize();
            let light = sky.radiance(direction);
            (0..3).for_each(|c| pixel[c] += left * light[c]);
            pixel[3] = 1.0;
        }
    });
}

/// Plate and sky in the mirror, small: for what mirrors too roughly to show more.
pub(crate) fn backdrop(mirrored: &PlateFrame, view: &View, sky: &Sky) -> Option<Backdrop> {
    let fine = mirrored.color.as_ref()?;
    let size = [fine.width(), fine.height()].map(|side| side.div_ceil(COARSE));
    let mut coarse = Image::filled(size[0], size[1], [0.0; 4]);
    coarse.pixels_mut().par_chunks_mut(size[0].max(1)).enumerate().for_each(|(row, line)| {
        for (column, pixel) in line.iter_mut().enumerate() {
            let (xs, ys) = (span(column, fine.width()), span(row, fine.height()));
            let share = 1.0 / (xs.len() * ys.len()) as f32;
            for y in ys {
                for value in &fine.row(y)[xs.clone()] {
                    (0..4).for_each(|c| pixel[c] += share * value[c]);
                }
            }
        }
    });
    lay_sky(&mut coarse, view, sky, COARSE);
    Some(Backdrop { image: coarse, pixel_size: COARSE })
}

/// Fine pixels in a coarse one.
fn span(index: usize, end: usize) -> std::ops::Range<usize> {
    index * COARSE..((index + 1) * COARSE).min(end)
}

/// A plate whose mirrored lines of sight are followed.
struct March<'a> {
    color: &'a Image<4>,
    depth: Option<&'a Image<1>>,
    camera: &'a Camera,
    mirror: LevelMirror,
    exposure: f32,
}

/// A mirrored line of sight: it leaves the mirror and goes to infinity as its parameter goes from 0 to 1, evenly in the picture of a
/// perspective camera.
struct Sight {
    from: DVec3,
    toward: DVec3,
    scale: f64,
    trace: Option<Trace>,
}

/// A line of sight in the picture of a perspective camera: straight, and as deep as at its start divided by what is left of the parameter.
struct Trace {
    from: DVec2,
    along: DVec2,
    depth: f64,
}

impl Sight {
    /// Way along `toward` at parameter `t`.
    fn way(&self, t: f64) -> f64 {
        self.scale * t / (1.0 - t)
    }

    fn at(&self, t: f64) -> DVec3 {
        self.from + self.toward * self.way(t)
    }
}

/// A place on a line of sight, and what the plate shows there.
#[derive(Clone, Copy)]
struct Stop {
    t: f64,
    pixel: DVec2,
    depth: f64,
    /// Depth of the plate.
    plate: f64,
}

impl March<'_> {
    /// What is seen in the mirror at a pixel: radiance, coverage, and depth from behind the mirror.
    fn seen(&self, pixel: DVec2) -> Option<([f32; 4], f32)> {
        let down = self.camera.direction(pixel)?;
        let drop = self.camera.position.y - self.mirror.height;
        if down.y >= 0.0 || drop <= 0.0 {
            return None;
        }
        let ground = drop / -down.y;
        let standing = self.plate_depth(pixel);
        if ground > FAR || (standing < ground && self.stands(pixel, standing)) {
            // The mirror is hidden by what stands before it: nobody sees this, but blurred it is the best guess of what lies beside.
            return self.radiance(pixel).map(|color| (color, standing as f32));
        }
        let toward = DVec3::new(down.x, -down.y, down.z);
        let sight = self.sight(self.camera.position + down * ground, ground, toward);
        match self.first_met(pixel, &sight) {
            Some((place, way)) => Some((self.radiance(place)?, (ground + way) as f32)),
            None => self.beyond(&sight).map(|color| (color, f32::INFINITY)),
        }
    }

    /// The line of sight that leaves the mirror at `from`, `depth` away.
    fn sight(&self, from: DVec3, depth: f64, toward: DVec3) -> Sight {
        let along = -(self.camera.world_from_camera.transpose() * toward).z;
        if self.camera.lens != Lens::Perspective || along <= 1e-3 {
            return Sight { from, toward, scale: depth, trace: None };
        }
        let mut sight = Sight { from, toward, scale: depth / along, trace: None };
        let places = [0.0, 0.5].map(|t| self.camera.project(sight.at(t)));
        if let [Some(start), Some(middle)] = places {
            sight.trace =
                Some(Trace { from: start.pixel, along: 2.0 * (middle.pixel - start.pixel), depth: start.depth });
        }
        sight
    }

    /// Where a line of sight from the mirror at `start` first meets what stands in the plate: its pixel, and the way there.
    fn first_met(&self, start: DVec2, sight: &Sight) -> Option<(DVec2, f64)> {
        self.depth?;
        let end = || self.camera.project(sight.from + sight.toward * FAR);
        let length = match &sight.trace {
            Some(trace) => trace.along.length(),
            None => end().map_or(PLACES[1] * 0.25, |end| (end.pixel - start).length()),
        };
        let count = (length / STRIDE).ceil().clamp(PLACES[0], PLACES[1]);
        let mut before = self.stop(sight, 0.0)?;
        // Where it was last seen before it went behind what stands nearer.
        let mut lost: Option<Stop> = None;
        for step in 1..count as usize {
            let Some(stop) = self.stop(sight, step as f64 / count) else { break };
            if stop.depth > stop.plate && self.stands(stop.pixel, stop.plate) {
                // The mirror itself may stand a little before or behind the plate's own depth of it.
                if lost.is_none() && stop.plate > before.depth.min(before.plate) * (1.0 - JUMP) {
                    return Some(self.crossing(sight, &before, &stop));
                }
                // It met what is farther while it was behind what is nearer.
                if lost.is_some() && stop.plate > before.plate * (1.0 + JUMP) {
                    return Some((stop.pixel, sight.way(stop.t)));
                }
                lost = lost.or(Some(before));
            } else {
                lost = None;
            }
            before = stop;
        }
        // What it does not come out from behind of hides what it meets: what was seen beside that is the best guess.
        lost.map(|stop| (stop.pixel, sight.way(stop.t)))
    }

    /// The place on a line of sight at `t`; none outside the picture.
    fn stop(&self, sight: &Sight, t: f64) -> Option<Stop> {
        let (pixel, depth) = match &sight.trace {
            Some(trace) => (trace.from + trace.along * t, trace.depth / (1.0 - t)),
            None => {
                let place = self.camera.project(sight.at(t))?;
                (place.pixel, place.depth)
            }
        };
        self.is_inside(pixel).then(|| Stop { t, pixel, depth, plate: self.plate_depth(pixel) })
    }

    fn is_inside(&self, pixel: DVec2) -> bool {
        let (width, height) = (self.color.width() as f64, self.color.height() as f64);
        pixel.x >= 0.0 && pixel.y >= 0.0 && pixel.x < width && pixel.y < height
    }

    /// Between two places, where the line of sight is as deep as the plate.
    fn crossing(&self, sight: &Sight, before: &Stop, after: &Stop) -> (DVec2, f64) {
        let [ahead, past] = [before, after].map(|stop| stop.plate - stop.depth);
        let even = ahead.is_finite() && ahead > 0.0 && ahead - past > 0.0;
        // Where it leaves the mirror the plate is the mirror itself, and what lies between them is rounding.
        let part = if even && before.t > 0.0 { ahead / (ahead - past) } else { 1.0 };
        let t = before.t + part * (after.t - before.t);
        (before.pixel + (after.pixel - before.pixel) * part, sight.way(t))
    }

    /// The plate's color infinitely far along a line of sight that met nothing.
    fn beyond(&self, sight: &Sight) -> Option<[f32; 4]> {
        let end = self.camera.project(sight.from + sight.toward * FAR)?.pixel;
        (self.is_inside(end) && !self.plate_depth(end).is_finite()).then(|| self.radiance(end))?
    }

    /// Whether what the plate shows at a pixel, at this depth, stands above the mirror.
    fn stands(&self, pixel: DVec2, depth: f64) -> bool {
        let Some(direction) = self.camera.direction(pixel).filter(|_| depth.is_finite()) else { return false };
        let above = self.camera.position.y + direction.y * depth - self.mirror.height;
        above > self.mirror.tolerance_at(depth, self.camera.focal_pixels)
    }

    /// The plate's depth at a pixel: never mixed between pixels.
    fn plate_depth(&self, pixel: DVec2) -> f64 {
        let Some(depth) = self.depth else { return f64::INFINITY };
        let (x, y) = (pixel.x as usize, pixel.y as usize);
        f64::from(depth.at(x.min(depth.width() - 1), y.min(depth.height() - 1))[0])
    }

    /// The plate's radiance and coverage at a pixel.
    fn radiance(&self, pixel: DVec2) -> Option<[f32; 4]> {
        let [red, green, blue, coverage] = self.color.sample_bilinear(pixel);
        let scale = 1.0 / self.exposure;
        scale.is_finite().then_some([scale * red, scale * green, scale * blue, coverage])
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::{
        camera::CameraParameters,
        host::observer::Unobserved,
        phenomenon::strip::Shutter,
        world::sky::{SkyKind, SkyParameters},
    };

    use super::*;

    const SIZE: [usize; 2] = [320, 180];
    const EXPOSURE: f32 = 0.5;
    const WET: LevelMirror = LevelMirror { height: 0.0, plate_tolerance: 0.02 };
    /// A wall across the view, and a pillar before it, m.
    const WALL: f64 = -6.0;
    const WALL_TOP: f64 = 3.0;
    const PILLAR: f64 = -1.0;

    fn view(roll: f64, vertical_fov_deg: f64) -> View {
        let camera = CameraParameters {
            position: [0.0, 1.6, 4.0].into(),
            target: [0.0, 1.4, -6.0].into(),
            vertical_fov_deg: vertical_fov_deg.into(),
            roll_deg: roll.into(),
            ..CameraParameters::default()
        };
        View::new(camera, Shutter { open: 0.0, close: 0.0 }, 0.0, SIZE, 0)
    }

    /// Where a ray first meets pillar, wall or, unless it comes from there, ground: way, and whether it is not the ground.
    fn met(from: DVec3, toward: DVec3) -> Option<(f64, bool)> {
        let plane = |z: f64, inside: fn(DVec3) -> bool| {
            let way = (z - from.z) / toward.z;
            (way > 1e-6 && inside(from + toward * way)).then_some((way, true))
        };
        let pillar = plane(PILLAR, |p| (p.x - 0.6).abs() < 0.15 && (0.0..2.5).contains(&p.y));
        let wall = plane(WALL, |p| (0.0..WALL_TOP).contains(&p.y));
        let ground = (toward.y < 0.0 && from.y > 1e-9).then(|| (-from.y / toward.y, false));
        [pillar, wall, ground].into_iter().flatten().min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// A plate whose colors are the places that it shows, exposed.
    fn plate(view: &View) -> PlateFrame {
        let mut color = Image::filled(SIZE[0], SIZE[1], [0.0, 0.0, 0.0, 1.0]);
        let mut depth = Image::filled(SIZE[0], SIZE[1], [f32::INFINITY]);
        for y in 0..SIZE[1] {
            for x in 0..SIZE[0] {
                let direction = view.camera.direction(DVec2::new(x as f64 + 0.5, y as f64 + 0.5)).unwrap();
                if let Some((way, _)) = met(view.camera.position, direction) {
                    let place = (view.camera.position + direction * way).as_vec3() * EXPOSURE;
                    color.row_mut(y)[x] = [place.x, place.y, place.z, 1.0];
                    depth.row_mut(y)[x] = [way as f32];
                }
            }
        }
        PlateFrame { color: Some(color), depth: Some(depth) }
    }

    #[test]
    fn a_wall_and_a_pillar_are_mirrored_at_the_right_place() {
        // Wrong are outlines of the pillar, and in wide views the wall's top, where pixels of the plate are of both.
        for (roll, vertical_fov_deg, most) in
            [(0.0, 32.0, 0.005), (4.0, 32.0, 0.01), (0.0, 60.0, 0.03), (4.0, 60.0, 0.035), (0.0, 90.0, 0.05)]
        {
            let view = view(roll, vertical_fov_deg);
            let camera = &view.camera;
            let seen = mirrored(&plate(&view), camera, WET, EXPOSURE, &Unobserved).unwrap();
            let (color, depth) = (seen.color.unwrap(), seen.depth.unwrap());
            let behind = camera.mirrored(0.0);
            let (mut right, mut wrong) = (0, 0);
            for (index, (color, depth)) in color.pixels().iter().zip(depth.pixels()).enumerate() {
                let pixel = DVec2::new((index % SIZE[0]) as f64, (index / SIZE[0]) as f64) + 0.5;
                let direction = camera.direction(pixel).unwrap();
                let Some((way, false)) = met(camera.position, direction) else { continue };
                let from = camera.position + direction * way;
                let from = DVec3::new(from.x, 0.0, from.z);
                let toward = DVec3::new(direction.x, -direction.y, direction.z);
                let Some((way, _)) = met(from, toward) else { continue };
                let place = from + toward * way;
                if !camera.project(place).is_some_and(|place| place.pixel.x > 0.0 && place.pixel.x < SIZE[0] as f64) {
                    continue;
                }
                let shown = DVec3::new(f64::from(color[0]), f64::from(color[1]), f64::from(color[2]));
                let error = (place - shown).abs().max_element();
                let near = error < 0.15 && (f64::from(depth[0]) - behind.depth(place)).abs() < 0.15;
                if near { right += 1 } else { wrong += 1 }
            }
            assert!(right > 7_000, "{right}");
            let share = f64::from(wrong) / f64::from(right);
            assert!(share < most, "{vertical_fov_deg} degrees, roll {roll}: {share}");
        }
    }

    #[test]
    fn the_sky_is_mirrored_above_the_wall_and_where_the_plate_ends() {
        let view = view(0.0, 60.0);
        let plate = plate(&view);
        let mirrored = mirrored(&plate, &view.camera, WET, EXPOSURE, &Unobserved).unwrap();
        let mut seen = mirrored.color.clone().unwrap();
        let parameters = SkyParameters { kind: SkyKind::Uniform, luminance: 300.0.into(), ..SkyParameters::default() };
        let sky = parameters.at(0.0);
        lay_sky(&mut seen, &view.mirrored(0.0), &sky, 1);
        // The lowest row looks 31 degrees down, and by the mirror over the wall and out of the picture.
        let lowest = seen.at(SIZE[0] / 2, SIZE[1] - 1);
        assert_eq!(lowest[..3], sky.radiance(DVec3::Y));
        let backdrop = backdrop(&mirrored, &view.mirrored(0.0), &sky).unwrap().image;
        assert_eq!([backdrop.width(), backdrop.height()], [40, 23]);
        assert!(backdrop.pixels().iter().all(|pixel| (pixel[3] - 1.0).abs() < 1e-5));
    }

    /// South of what each row of the mirrored plate shows at a column beside the pillar, for rows of the ground from the wall's foot down.
    fn souths(plate: &PlateFrame, camera: &Camera, mirror: LevelMirror, rows: usize) -> Vec<f64> {
        let column = 0.3 * SIZE[0] as f64 + 0.5;
        let is_ground = |row: &usize| {
            let direction = camera.direction(DVec2::new(column, *row as f64 + 0.5)).unwrap();
            matches!(met(camera.position, direction), Some((_, false)))
        };
        let foot = (0..SIZE[1]).find(is_ground).unwrap();
        let seen = mirrored(plate, camera, mirror, EXPOSURE, &Unobserved).unwrap().color.unwrap();
        (foot..foot + rows).map(|row| f64::from(seen.at(column as usize, row)[2])).collect()
    }

    #[test]
    fn the_foot_of_a_wall_mirrors_the_wall() {
        for (fov, tolerance, rows) in
            [(32.0, 0.02, 12), (32.0, 0.1, 12), (60.0, 0.02, 8), (90.0, 0.02, 6), (90.0, 0.1, 6)]
        {
            let view = view(0.0, fov);
            let wet = LevelMirror { plate_tolerance: tolerance, ..WET };
            let souths = souths(&plate(&view), &view.camera, wet, rows);
            assert!(souths.iter().all(|south| (south - WALL).abs() < 0.02), "{fov} degrees, {tolerance} m: {souths:?}");
        }
    }

    /// A floor whose depth is a guess, 6 cm too near in height, mirrors the wall where that is tolerated.
    #[test]
    fn a_guessed_depth_of_the_ground_is_tolerated() {
        let view = view(0.0, 32.0);
        let (mut plate, camera) = (plate(&view), &view.camera);
        let below = DVec2::new(0.4 * SIZE[0] as f64, SIZE[1] as f64 - 0.5);
        let (x, y) = (below.x as usize, below.y as usize);
        for row in y / 2..SIZE[1] {
            for depth in plate.depth.as_mut().unwrap().row_mut(row) {
                let direction = camera.direction(DVec2::new(below.x, row as f64 + 0.5)).unwrap();
                let ground = camera.position.y / -direction.y;
                depth[0] = if depth[0] > 0.9 * ground as f32 { depth[0] * (1.0 - 0.06 / 1.6) } else { depth[0] };
            }
        }
        let seen = |plate_tolerance: f64| {
            let wet = LevelMirror { plate_tolerance, ..WET };
            f64::from(mirrored(&plate, camera, wet, EXPOSURE, &Unobserved).unwrap().color.unwrap().at(x, y)[2])
        };
        assert!((seen(0.1) - WALL).abs() < 0.2, "{} m south is not the wall", seen(0.1));
        assert!(seen(0.02) > WALL + 1.0, "{} m south is the wall", seen(0.02));
    }

    #[test]
    fn without_a_plate_nothing_is_mirrored() {
        let seen = mirrored(&PlateFrame::default(), &view(0.0, 60.0).camera, WET, EXPOSURE, &Unobserved).unwrap();
        assert!(seen.color.is_none() && seen.depth.is_none());
    }
}
