//! The plate and the sky as they are seen in a level mirror.
//!
//! What a plate shows of its scene stands where its depth says. The mirrored line of sight of a pixel, followed through the plate's own
//! picture, ends where it meets what stands there (reflections in screen space: McGuire & Mara 2014). What the plate does not show
//! is the sky's.

use bansho_base::{
    camera::{Camera, Lens},
    canvas::View,
    image::Image,
    math::{DVec2, DVec3},
    phenomenon::LevelMirror,
    sky::Sky,
};
use rayon::prelude::*;

use super::plate::PlateFrame;

/// Pixels of the picture from one place on a line of sight to the next.
const STRIDE: f64 = 2.0;
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
pub(super) struct Mirror {
    /// Radiance and alpha of the whole picture.
    pub(super) seen: Image<4>,
    /// Plate and sky without the phenomena, small; only where there is a plate.
    pub(super) backdrop: Option<Image<4>>,
}

/// The plate seen in a level mirror by `camera`: absolute radiance with coverage, and depth as the camera behind the mirror
/// measures it. Nothing where there is no plate or the mirror shows what the plate does not.
pub(super) fn mirrored(plate: &PlateFrame, camera: &Camera, mirror: LevelMirror, exposure: f32) -> PlateFrame {
    let Some(colour) = &plate.colour else { return PlateFrame::default() };
    let march = March { colour, depth: plate.depth.as_ref(), camera, mirror, exposure };
    let (width, rows) = (colour.width(), colour.height());
    let mut seen = Image::filled(width, rows, [0.0; 4]);
    let mut depth = Image::filled(width, rows, [f32::INFINITY]);
    let lines = seen.pixels_mut().par_chunks_mut(width.max(1)).zip(depth.pixels_mut().par_chunks_mut(width.max(1)));
    lines.enumerate().for_each(|(y, (seen, depth))| {
        for (x, (seen, depth)) in seen.iter_mut().zip(depth).enumerate() {
            let pixel = DVec2::new(x as f64, y as f64) + 0.5;
            if let Some((colour, far)) = march.seen(pixel) {
                (*seen, depth[0]) = (colour, far);
            }
        }
    });
    PlateFrame { colour: Some(seen), depth: plate.depth.is_some().then_some(depth) }
}

/// Puts the sky, which a plate stands for in the picture itself, behind what is seen by the camera of a mirrored `view`; `scale` is the
/// view's pixels in one of `image`.
pub(super) fn lay_sky(image: &mut Image<4>, view: &View, sky: &Sky, scale: usize) {
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
pub(super) fn backdrop(mirrored: &PlateFrame, view: &View, sky: &Sky) -> Option<Image<4>> {
    let fine = mirrored.colour.as_ref()?;
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
    Some(coarse)
}

/// Fine pixels in a coarse one.
fn span(index: usize, end: usize) -> std::ops::Range<usize> {
    index * COARSE..((index + 1) * COARSE).min(end)
}

/// A plate whose mirrored lines of sight are followed.
struct March<'a> {
    colour: &'a Image<4>,
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
            return self.radiance(pixel).map(|colour| (colour, standing as f32));
        }
        let toward = DVec3::new(down.x, -down.y, down.z);
        let sight = Sight { from: self.camera.position + down * ground, toward, scale: self.scale(ground, toward) };
        match self.first_met(pixel, &sight) {
            Some((place, way)) => Some((self.radiance(place)?, (ground + way) as f32)),
            None => self.beyond(&sight).map(|colour| (colour, f32::INFINITY)),
        }
    }

    /// The scale of a line of sight from `depth` on that makes it even in the picture.
    fn scale(&self, depth: f64, toward: DVec3) -> f64 {
        let along = -(self.camera.orientation.transpose() * toward).z;
        if self.camera.lens == Lens::Perspective && along > 1e-3 { depth / along } else { depth }
    }

    /// Where a line of sight from the mirror at `start` first meets what stands in the plate: its pixel, and the way there.
    fn first_met(&self, start: DVec2, sight: &Sight) -> Option<(DVec2, f64)> {
        self.depth?;
        let end = self.camera.project(sight.from + sight.toward * FAR);
        let length = end.map_or(PLACES[1] * 0.25, |end| (end.pixel - start).length());
        let count = (length / STRIDE).ceil().clamp(PLACES[0], PLACES[1]);
        let mut before = self.stop(sight, 0.0)?;
        // Where it was last seen before it went behind what stands nearer.
        let mut lost: Option<Stop> = None;
        for step in 1..count as usize {
            let Some(stop) = self.stop(sight, step as f64 / count) else { break };
            if stop.depth > stop.plate && self.stands(stop.pixel, stop.plate) {
                if lost.is_none() && stop.plate > before.depth * (1.0 - JUMP) {
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
        let place = self.camera.project(sight.at(t))?;
        let inside = place.pixel.x >= 0.0
            && place.pixel.y >= 0.0
            && place.pixel.x < self.colour.width() as f64
            && place.pixel.y < self.colour.height() as f64;
        inside.then(|| Stop { t, pixel: place.pixel, depth: place.depth, plate: self.plate_depth(place.pixel) })
    }

    /// Between two places, where the line of sight is as deep as the plate.
    fn crossing(&self, sight: &Sight, before: &Stop, after: &Stop) -> (DVec2, f64) {
        let [ahead, past] = [before, after].map(|stop| stop.plate - stop.depth);
        let even = ahead.is_finite() && ahead > 0.0 && ahead - past > 0.0;
        let part = if even { ahead / (ahead - past) } else { 1.0 };
        let t = before.t + part * (after.t - before.t);
        (before.pixel + (after.pixel - before.pixel) * part, sight.way(t))
    }

    /// The plate's colour infinitely far along a line of sight that met nothing.
    fn beyond(&self, sight: &Sight) -> Option<[f32; 4]> {
        let end = self.camera.project(sight.from + sight.toward * FAR)?.pixel;
        let inside =
            end.x >= 0.0 && end.y >= 0.0 && end.x < self.colour.width() as f64 && end.y < self.colour.height() as f64;
        (inside && !self.plate_depth(end).is_finite()).then(|| self.radiance(end))?
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
        let [red, green, blue, coverage] = self.colour.between(pixel);
        let scale = 1.0 / self.exposure;
        scale.is_finite().then_some([scale * red, scale * green, scale * blue, coverage])
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::{
        camera::CameraParameters,
        canvas::Shutter,
        sky::{SkyKind, SkyParameters},
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

    /// A plate whose colours are the places that it shows, exposed.
    fn plate(view: &View) -> PlateFrame {
        let mut colour = Image::filled(SIZE[0], SIZE[1], [0.0, 0.0, 0.0, 1.0]);
        let mut depth = Image::filled(SIZE[0], SIZE[1], [f32::INFINITY]);
        for y in 0..SIZE[1] {
            for x in 0..SIZE[0] {
                let direction = view.camera.direction(DVec2::new(x as f64 + 0.5, y as f64 + 0.5)).unwrap();
                if let Some((way, _)) = met(view.camera.position, direction) {
                    let place = (view.camera.position + direction * way).as_vec3() * EXPOSURE;
                    colour.row_mut(y)[x] = [place.x, place.y, place.z, 1.0];
                    depth.row_mut(y)[x] = [way as f32];
                }
            }
        }
        PlateFrame { colour: Some(colour), depth: Some(depth) }
    }

    #[test]
    fn a_wall_and_a_pillar_are_mirrored_at_the_right_place() {
        for roll in [0.0, 4.0] {
            let view = view(roll, 32.0);
            let camera = &view.camera;
            let seen = mirrored(&plate(&view), camera, WET, EXPOSURE);
            let (colour, depth) = (seen.colour.unwrap(), seen.depth.unwrap());
            let behind = camera.mirrored(0.0);
            let (mut right, mut wrong) = (0, 0);
            for (index, (colour, depth)) in colour.pixels().iter().zip(depth.pixels()).enumerate() {
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
                let shown = DVec3::new(f64::from(colour[0]), f64::from(colour[1]), f64::from(colour[2]));
                let error = (place - shown).abs().max_element();
                let near = error < 0.15 && (f64::from(depth[0]) - behind.depth(place)).abs() < 0.15;
                if near { right += 1 } else { wrong += 1 }
            }
            // The pillar's outlines, where pixels of the plate are of both.
            assert!(right > 10_000 && wrong < right / 50, "roll {roll}: {right} right, {wrong} wrong");
        }
    }

    #[test]
    fn the_sky_is_mirrored_above_the_wall_and_where_the_plate_ends() {
        let view = view(0.0, 60.0);
        let plate = plate(&view);
        let mut seen = mirrored(&plate, &view.camera, WET, EXPOSURE).colour.unwrap();
        let parameters = SkyParameters { kind: SkyKind::Uniform, luminance: 300.0.into(), ..SkyParameters::default() };
        let sky = parameters.at(0.0);
        lay_sky(&mut seen, &view.mirrored(0.0), &sky, 1);
        // The lowest row looks 31 degrees down, and by the mirror over the wall and out of the picture.
        let lowest = seen.at(SIZE[0] / 2, SIZE[1] - 1);
        assert_eq!(lowest[..3], sky.radiance(DVec3::Y));
        let backdrop = backdrop(&mirrored(&plate, &view.camera, WET, EXPOSURE), &view.mirrored(0.0), &sky).unwrap();
        assert_eq!([backdrop.width(), backdrop.height()], [40, 23]);
        assert!(backdrop.pixels().iter().all(|pixel| (pixel[3] - 1.0).abs() < 1e-5));
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
            f64::from(mirrored(&plate, camera, wet, EXPOSURE).colour.unwrap().at(x, y)[2])
        };
        assert!((seen(0.1) - WALL).abs() < 0.2, "{} m south is not the wall", seen(0.1));
        assert!(seen(0.02) > WALL + 1.0, "{} m south is the wall", seen(0.02));
    }

    #[test]
    fn without_a_plate_nothing_is_mirrored() {
        let seen = mirrored(&PlateFrame::default(), &view(0.0, 60.0).camera, WET, EXPOSURE);
        assert!(seen.colour.is_none() && seen.depth.is_none());
    }
}
