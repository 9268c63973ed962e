//! The plate and the sky as seen in a horizontal mirror.
//!
//! The plate's depth positions its pixels in the scene. The reflected ray of a pixel is marched through the plate's own picture until it
//! meets a surface there (screen-space reflections: McGuire & Mara 2014). Where it leaves the plate, it shows the sky.

use std::{ops::Range, sync::Arc};

use bansho_base::{
    camera::{Camera, Lens},
    host::{
        observer::{self, Cancelled, Observer},
        parallel::prelude::*,
    },
    image::Image,
    math::{DVec2, DVec3},
    phenomenon::{
        LevelMirror,
        strip::View,
        surroundings::{Backdrop, Reflection},
    },
    world::sky::Sky,
};

mod depth_pyramid;
mod ray_march;

use super::plate::PlateFrame;
use depth_pyramid::DepthPyramid;
use ray_march::{RayMarch, Reflected};

/// Side of a pixel of the backdrop, pixels of the picture.
const BACKDROP_PIXEL: usize = 8;

/// Side of a pixel of a plate's reflection of which only the backdrop is used, pixels of the picture.
pub(crate) const BACKDROP_SAMPLE: usize = 2;

/// The reflection in the mirror of a phenomenon.
pub(crate) struct Mirror {
    /// The scene in the mirror, if the mirror needs it.
    pub(crate) picture: Option<Reflection>,
    /// Plate and sky without the phenomena, in low resolution; `None` without a plate.
    pub(crate) backdrop: Option<Backdrop>,
}

/// The plate as a camera sees it in a horizontal mirror: absolute radiance with coverage, and depth as the mirrored camera measures it.
/// Transparent where the reflected ray leaves the plate; empty without a plate.
#[derive(Default)]
pub(crate) struct MirroredPlate {
    pub(crate) frame: Arc<PlateFrame>,
    /// For each pixel the position on the plate that is reflected; not numbers where none is. Empty unless they are kept.
    sources: Vec<DVec2>,
}

impl MirroredPlate {
    /// `plate` as `camera` sees it. `pixel_size` is the side of the result's pixels in pixels of the plate. With `keeps_sources` the colors can be
    /// [replaced](Self::recolor).
    ///
    /// # Errors
    /// The observer asked to stop.
    pub(crate) fn new(
        plate: &PlateFrame,
        camera: &Camera,
        mirror: LevelMirror,
        exposure: f32,
        pixel_size: usize,
        keeps_sources: bool,
        observer: &dyn Observer,
    ) -> Result<Self, Cancelled> {
        let Some(color) = &plate.color else { return Ok(Self::default()) };
        // Reflected rays are straight only in the pictures of perspective cameras.
        let pyramid = plate.depth.as_ref().filter(|_| camera.lens == Lens::Perspective).map(DepthPyramid::new);
        let plate_size = [color.width(), color.height()];
        let march =
            RayMarch { size: plate_size, depth: plate.depth.as_ref(), pyramid: pyramid.as_ref(), camera, mirror };
        let [width, rows] = plate_size.map(|side| side.div_ceil(pixel_size));
        let mut radiance = Image::filled(width, rows, [0.0; 4]);
        let mut depth = Image::filled(width, rows, [f32::INFINITY]);
        let mut sources = vec![DVec2::NAN; if keeps_sources { width * rows } else { 0 }];
        let scale = 1.0 / exposure;
        if scale.is_finite() {
            let length = width.max(1);
            let mut rows_of_sources: Vec<&mut [DVec2]> = sources.chunks_mut(length).collect();
            // Where none are kept, no row has any.
            rows_of_sources.resize_with(rows, Default::default);
            let lines = radiance.pixels_mut().par_chunks_mut(length).zip(depth.pixels_mut().par_chunks_mut(length));
            lines.zip(rows_of_sources).enumerate().try_for_each(|(y, ((radiance, depth), sources))| {
                observer::check(observer)?;
                for (x, (radiance, depth)) in radiance.iter_mut().zip(depth).enumerate() {
                    let pixel = (DVec2::new(x as f64, y as f64) + 0.5) * pixel_size as f64;
                    if let Some(Reflected { source, depth: reflected_depth }) = march.reflected(pixel) {
                        (*radiance, depth[0]) = (radiance_at(color, source, scale), reflected_depth);
                        if let Some(kept) = sources.get_mut(x) {
                            *kept = source;
                        }
                    }
                }
                Ok(())
            })?;
        }
        let depth = plate.depth.is_some().then_some(depth);
        Ok(Self { frame: Arc::new(PlateFrame { color: Some(radiance), depth, ..PlateFrame::default() }), sources })
    }

    /// Whether its colors can be replaced.
    pub(crate) fn keeps_sources(&self) -> bool {
        !self.sources.is_empty()
    }

    /// Replaces the colors by those of `plate`, which differs in its colors alone from the one that it was made of.
    pub(crate) fn recolor(&mut self, plate: &PlateFrame, exposure: f32) {
        let Some(color) = &plate.color else { return };
        let Some(radiance) = &mut Arc::make_mut(&mut self.frame).color else { return };
        let (width, scale) = (radiance.width().max(1), 1.0 / exposure);
        let rows = radiance.pixels_mut().par_chunks_mut(width).zip(self.sources.par_chunks(width));
        rows.for_each(|(radiance, sources)| {
            for (pixel, source) in radiance.iter_mut().zip(sources) {
                if !source.is_nan() {
                    *pixel = radiance_at(color, *source, scale);
                }
            }
        });
    }
}

/// Radiance and coverage at a position on a plate; `scale` is the inverse of the exposure.
fn radiance_at(color: &Image<4>, position: DVec2, scale: f32) -> [f32; 4] {
    let [red, green, blue, coverage] = color.sample_bilinear(position);
    [scale * red, scale * green, scale * blue, coverage]
}

/// Composites the sky behind `image`, as the camera of a mirrored `view` sees it. `scale` is the side of a pixel of `image` in pixels of the
/// view, `first_row` the number of such pixels above it. (In the picture itself the plate takes the role of the sky.)
pub(crate) fn composite_sky(image: &mut Image<4>, view: &View, sky: &Sky, scale: usize, first_row: usize) {
    let width = image.width().max(1);
    image.pixels_mut().par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.iter_mut().enumerate() {
            let center = (DVec2::new(x as f64, (first_row + y) as f64) + 0.5) * scale as f64;
            let uncovered = 1.0 - pixel[3];
            let Some(direction) = view.camera.direction(center).filter(|_| uncovered > 0.0) else { continue };
            let direction = DVec3::new(direction.x, direction.y.abs(), direction.z).normalize();
            let light = sky.radiance(direction);
            (0..3).for_each(|c| pixel[c] += uncovered * light[c]);
            pixel[3] = 1.0;
        }
    });
}

/// Plate and sky in the mirror, in low resolution, for surfaces too rough to reflect more detail. The view has the resolution of the mirrored plate.
pub(crate) fn backdrop(mirrored: &PlateFrame, view: &View, sky: &Sky) -> Option<Backdrop> {
    let fine = mirrored.color.as_ref()?;
    let side = BACKDROP_PIXEL / view.pixel_size;
    let size = [fine.width(), fine.height()].map(|pixels| pixels.div_ceil(side));
    let mut coarse = Image::filled(size[0], size[1], [0.0; 4]);
    coarse.pixels_mut().par_chunks_mut(size[0].max(1)).enumerate().for_each(|(row, line)| {
        for (column, pixel) in line.iter_mut().enumerate() {
            let (xs, ys) = (fine_pixels(column, side, fine.width()), fine_pixels(row, side, fine.height()));
            let weight = 1.0 / (xs.len() * ys.len()) as f32;
            for y in ys {
                for value in &fine.row(y)[xs.clone()] {
                    (0..4).for_each(|c| pixel[c] += weight * value[c]);
                }
            }
        }
    });
    composite_sky(&mut coarse, view, sky, side, 0);
    Some(Backdrop { image: coarse, pixel_size: BACKDROP_PIXEL })
}

/// The columns or rows of a picture with `count` of them in a column or row of the backdrop, whose pixels have this side.
fn fine_pixels(index: usize, side: usize, count: usize) -> Range<usize> {
    index * side..((index + 1) * side).min(count)
}

/// Whether a pixel is below the horizon, or so little above it that the mirror may still cover it partly.
fn may_show_mirror(camera: &Camera, pixel: DVec2) -> bool {
    let direction = camera.direction(pixel);
    direction.is_some_and(|direction| -direction.y * camera.focal_pixels > -2.0 * direction.length())
}

/// The rows of the whole picture of `view` in which a horizontal mirror at `height` may be seen, with a margin for interpolation.
pub(crate) fn mirror_rows(view: &View, height: f64) -> Range<usize> {
    /// Rows above and below.
    const MARGIN: usize = 2;
    let (camera, [width, rows]) = (&view.camera, view.size);
    if camera.position.y <= height {
        return 0..0;
    }
    if camera.lens != Lens::Perspective {
        return 0..rows;
    }
    // How far a direction points below the horizon is convex along a row of a perspective picture: its maximum lies at an end.
    let mut seen = (0..rows).filter(|&y| {
        let middle = y as f64 + 0.5;
        may_show_mirror(camera, DVec2::new(0.0, middle)) || may_show_mirror(camera, DVec2::new(width as f64, middle))
    });
    let Some(first) = seen.next() else { return 0..0 };
    let last = seen.next_back().unwrap_or(first);
    first.saturating_sub(MARGIN)..(last + 1 + MARGIN).min(rows)
}

#[cfg(test)]
mod tests {
    use bansho_base::{
        camera::CameraParameters,
        host::observer::Unobserved,
        math::random::{Key, Purpose},
        phenomenon::{MirrorRoughness, strip::Shutter},
        world::sky::SkyKind,
    };

    use super::*;

    const SIZE: [usize; 2] = [320, 180];
    const EXPOSURE: f32 = 0.5;
    const WET: LevelMirror = LevelMirror { height: 0.0, plate_tolerance: 0.02, roughness: MirrorRoughness::Puddles };
    /// A wall across the view, and a pillar before it, m.
    const WALL: f64 = -6.0;
    const WALL_TOP: f64 = 3.0;
    const PILLAR: f64 = -1.0;

    fn mirrored(plate: &PlateFrame, camera: &Camera, mirror: LevelMirror, pixel_size: usize) -> PlateFrame {
        let mirrored = MirroredPlate::new(plate, camera, mirror, EXPOSURE, pixel_size, false, &Unobserved).unwrap();
        Arc::unwrap_or_clone(mirrored.frame)
    }

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

    /// Where a ray first meets the pillar, the wall or (unless it starts there) the ground: distance, and whether it is not the ground.
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

    /// A plate whose colors are the exposed positions of what it shows.
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
        PlateFrame { color: Some(color), depth: Some(depth), ..PlateFrame::default() }
    }

    #[test]
    fn a_wall_and_a_pillar_are_mirrored_at_the_right_place() {
        // Errors are at the outlines of the pillar, and in wide views at the top of the wall, where a pixel of the plate covers both.
        for (roll, vertical_fov_deg, limit) in
            [(0.0, 32.0, 0.005), (4.0, 32.0, 0.01), (0.0, 60.0, 0.03), (4.0, 60.0, 0.035), (0.0, 90.0, 0.05)]
        {
            let view = view(roll, vertical_fov_deg);
            let camera = &view.camera;
            let seen = mirrored(&plate(&view), camera, WET, 1);
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
            let fraction = f64::from(wrong) / f64::from(right);
            assert!(fraction < limit, "{vertical_fov_deg} degrees, roll {roll}: {fraction}");
        }
    }

    /// A plate of blocks at random depths, some infinitely far and some unknown.
    fn blocks(view: &View) -> PlateFrame {
        let random = Key::new(3, "blocks");
        let mut plate = plate(view);
        for (index, depth) in plate.depth.as_mut().unwrap().pixels_mut().iter_mut().enumerate() {
            let block = index / SIZE[0] / 9 * SIZE[0] + index % SIZE[0] / 7;
            let [kind, near, ..] = random.uniforms(block as u64, 0, Purpose::named("depth"));
            depth[0] = match kind {
                0.0..0.1 => depth[0] * near,
                0.1..0.15 => f32::INFINITY,
                0.15..0.2 => f32::NAN,
                _ => depth[0],
            };
        }
        plate
    }

    #[test]
    fn skipped_tiles_change_no_reflection() {
        for (roll, vertical_fov_deg) in [(0.0, 32.0), (4.0, 60.0), (90.0, 60.0), (-130.0, 90.0), (180.0, 20.0)] {
            let view = view(roll, vertical_fov_deg);
            for plate in [plate(&view), blocks(&view)] {
                let depth = plate.depth.as_ref();
                let pyramid = DepthPyramid::new(depth.unwrap());
                let march = |pyramid| RayMarch { size: SIZE, depth, pyramid, camera: &view.camera, mirror: WET };
                let (every_sample, tiles) = (march(None), march(Some(&pyramid)));
                let mut reflections = 0;
                for index in 0..SIZE[0] * SIZE[1] {
                    let pixel = DVec2::new((index % SIZE[0]) as f64, (index / SIZE[0]) as f64) + 0.5;
                    let expected = every_sample.reflected(pixel);
                    reflections += usize::from(expected.is_some());
                    let found = tiles.reflected(pixel);
                    assert_eq!(format!("{found:?}"), format!("{expected:?}"), "{roll} {vertical_fov_deg} {pixel}");
                }
                assert!(reflections > 2_000, "{reflections}");
            }
        }
    }

    #[test]
    fn replaced_colors_are_those_of_a_new_reflection() {
        let view = view(0.0, 60.0);
        let (plain, mut lit) = (plate(&view), plate(&view));
        for (index, pixel) in lit.color.as_mut().unwrap().pixels_mut().iter_mut().enumerate() {
            pixel[1] += 0.001 * index as f32;
        }
        let new =
            |plate: &PlateFrame| MirroredPlate::new(plate, &view.camera, WET, EXPOSURE, 2, true, &Unobserved).unwrap();
        let (mut mirrored, expected) = (new(&plain), new(&lit));
        assert!(mirrored.frame.color != expected.frame.color);
        mirrored.recolor(&lit, EXPOSURE);
        assert!(mirrored.frame.color == expected.frame.color && mirrored.frame.depth == expected.frame.depth);
    }

    #[test]
    fn the_sky_is_mirrored_above_the_wall_and_where_the_plate_ends() {
        let view = view(0.0, 60.0);
        let plate = plate(&view);
        let mirrored = mirrored(&plate, &view.camera, WET, 1);
        let mut seen = mirrored.color.clone().unwrap();
        let sky = Sky::new(SkyKind::Uniform, 300.0, 7000.0);
        composite_sky(&mut seen, &view.mirrored(0.0), &sky, 1, 0);
        // The lowest row looks 31 degrees down, and by the mirror over the wall and out of the picture.
        let lowest = seen.at(SIZE[0] / 2, SIZE[1] - 1);
        assert_eq!(lowest[..3], sky.radiance(DVec3::Y));
        let backdrop = backdrop(&mirrored, &view.mirrored(0.0), &sky).unwrap().image;
        assert_eq!([backdrop.width(), backdrop.height()], [40, 23]);
        assert!(backdrop.pixels().iter().all(|pixel| (pixel[3] - 1.0).abs() < 1e-5));
    }

    /// z of what each row of the mirrored plate shows, in a column beside the pillar, for the rows of the ground from the foot of the wall down.
    fn souths(plate: &PlateFrame, camera: &Camera, mirror: LevelMirror, rows: usize) -> Vec<f64> {
        let column = 0.3 * SIZE[0] as f64 + 0.5;
        let is_ground = |row: &usize| {
            let direction = camera.direction(DVec2::new(column, *row as f64 + 0.5)).unwrap();
            matches!(met(camera.position, direction), Some((_, false)))
        };
        let foot = (0..SIZE[1]).find(is_ground).unwrap();
        let seen = mirrored(plate, camera, mirror, 1).color.unwrap();
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
            f64::from(mirrored(&plate, camera, wet, 1).color.unwrap().at(x, y)[2])
        };
        assert!((seen(0.1) - WALL).abs() < 0.2, "{} m south is not the wall", seen(0.1));
        assert!(seen(0.02) > WALL + 1.0, "{} m south is the wall", seen(0.02));
    }

    #[test]
    fn a_mirror_in_larger_pixels_shows_the_centers_of_those() {
        let view = view(0.0, 60.0);
        let plate = plate(&view);
        let coarse = mirrored(&plate, &view.camera, WET, 2);
        let (fine, coarse) = (mirrored(&plate, &view.camera, WET, 1).color.unwrap(), coarse.color.unwrap());
        assert_eq!([coarse.width(), coarse.height()], [SIZE[0] / 2, SIZE[1] / 2]);
        let differs = |&(x, y): &(usize, usize)| {
            let mean = [0, 1, 2].map(|c| {
                let four = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| fine.at(2 * x + i, 2 * y + j)[c]);
                four.iter().sum::<f32>() / 4.0
            });
            (0..3).any(|c| (mean[c] - coarse.at(x, y)[c]).abs() > 0.2)
        };
        let pixels = (0..SIZE[0] / 2).flat_map(|x| (0..SIZE[1] / 2).map(move |y| (x, y)));
        let different = pixels.filter(differs).count();
        assert!(different < SIZE[0] * SIZE[1] / 4 / 20, "{different}");
    }

    #[test]
    fn a_mirror_is_seen_in_the_rows_below_the_horizon() {
        for roll in [0.0, 7.0, 100.0] {
            let view = view(roll, 50.0).with_pixel_size(2);
            let rows = mirror_rows(&view, 0.0);
            for y in 0..view.size[1] {
                let below = (0..view.size[0]).any(|x| {
                    let direction = view.camera.direction(DVec2::new(x as f64, y as f64) + 0.5).unwrap();
                    -direction.y / direction.length() * view.camera.focal_pixels > -0.5
                });
                assert!(!below || rows.contains(&y), "{roll} {y} {rows:?}");
            }
            assert!(roll != 0.0 || rows.len() < view.size[1] / 2 + 20, "{rows:?}");
            assert_eq!(mirror_rows(&view, 5.0), 0..0, "from below");
        }
    }

    #[test]
    fn without_a_plate_nothing_is_mirrored() {
        let seen = mirrored(&PlateFrame::default(), &view(0.0, 60.0).camera, WET, 1);
        assert!(seen.color.is_none() && seen.depth.is_none());
    }
}
