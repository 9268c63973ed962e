//! The surfaces that a plate shows, pixel by pixel: what they reflect, where they are, and where they face.

use std::f32::consts::PI;

use bansho_base::{
    camera::Camera,
    host::parallel::prelude::*,
    image::Image,
    math::{DVec2, DVec3, simd::LANES},
};
use bansho_scene::{PlateDepth, PlateSurfaces};

use super::plate_mapping::{FilterTap, PlateMapping, depth_of_lens, filter_taps};
use crate::plan::Plan;

/// Length of the mean of several normals below which they contradict each other, and that of the depth is used.
const SHORTEST_NORMAL: f32 = 0.1;

/// The surfaces that a plate shows, as large as the picture with its overscan. Rows are padded to whole vectors.
#[derive(Clone, Debug)]
pub(crate) struct PlateSurface {
    pub(super) camera: Camera,
    /// Width and height, pixels.
    pub(super) size: [usize; 2],
    /// Values from one row to the next.
    pub(super) stride: usize,
    /// Albedo over pi, ACEScg, times the coverage of the plate; 0 where the plate shows no surface.
    pub(super) reflectance: [Vec<f32>; 3],
    /// Unit normals, world coordinates.
    pub(super) normal: [Vec<f32>; 3],
    /// Depth in the convention of the camera's lens, m; 1 where the plate shows no surface.
    pub(super) depth: Vec<f32>,
}

/// Picture and depth of a plate in the pixels of the picture, and the files of its surfaces.
pub(super) struct SurfaceInputs<'a> {
    pub(super) color: &'a Image<4>,
    pub(super) depth: &'a Image<1>,
    pub(super) plate_depth: &'a PlateDepth,
    pub(super) surfaces: &'a PlateSurfaces,
}

/// A row of the planes of a surface.
struct SurfaceRow<'a> {
    reflectance: [&'a mut [f32]; 3],
    normal: [&'a mut [f32]; 3],
    depth: &'a mut [f32],
}

impl PlateSurface {
    pub(super) fn new(plan: &Plan, camera: &Camera, inputs: &SurfaceInputs) -> Self {
        let size = [inputs.color.width(), inputs.color.height()];
        let stride = size[0].next_multiple_of(LANES);
        let plane = |value: f32| vec![value; stride * size[1]];
        let mut surface = Self {
            camera: *camera,
            size,
            stride,
            reflectance: [0.0; 3].map(plane),
            normal: [0.0, 0.0, 1.0].map(plane),
            depth: plane(1.0),
        };
        let maps = SurfaceMaps::new(plan, camera, inputs);
        let [red, green, blue] = &mut surface.reflectance;
        let [x, y, z] = &mut surface.normal;
        let color_rows = rows(red, stride).zip(rows(green, stride)).zip(rows(blue, stride));
        let normal_rows = rows(x, stride).zip(rows(y, stride)).zip(rows(z, stride));
        let planes = color_rows.zip(normal_rows).zip(rows(&mut surface.depth, stride)).enumerate();
        planes.for_each(|(row, ((((red, green), blue), ((x, y), z)), depth))| {
            maps.fill_row(row, SurfaceRow { reflectance: [red, green, blue], normal: [x, y, z], depth });
        });
        surface
    }

    /// The position of a pixel relative to the camera, m; `None` where the plate shows no surface.
    pub(super) fn position(&self, x: usize, y: usize) -> Option<DVec3> {
        let index = y * self.stride + x;
        let is_surface = self.reflectance.iter().any(|plane| plane[index] > 0.0);
        let direction = self.camera.direction(DVec2::new(x as f64 + 0.5, y as f64 + 0.5)).filter(|_| is_surface)?;
        Some(direction * f64::from(self.depth[index]))
    }

    /// The normal of a pixel.
    pub(super) fn normal_at(&self, x: usize, y: usize) -> DVec3 {
        let index = y * self.stride + x;
        DVec3::from(self.normal.each_ref().map(|plane| f64::from(plane[index])))
    }
}

fn rows(plane: &mut [f32], stride: usize) -> impl IndexedParallelIterator<Item = &mut [f32]> {
    plane.par_chunks_mut(stride.max(1))
}

/// Albedo and normals in the resolutions of their files.
struct SurfaceMaps<'a> {
    camera: &'a Camera,
    color: &'a Image<4>,
    depth: &'a Image<1>,
    albedo: ResampledMap,
    /// Normals of the file, as the camera sees them.
    normals: Option<ResampledMap>,
    /// Normals of the depth, world coordinates; `None` where none is needed.
    depth_normals: Option<ResampledMap>,
}

impl<'a> SurfaceMaps<'a> {
    fn new(plan: &Plan, camera: &'a Camera, inputs: &SurfaceInputs<'a>) -> Self {
        let SurfaceInputs { color, depth, plate_depth, surfaces } = *inputs;
        let normals = surfaces.normals.as_ref().map(|map| {
            let mut values = map.values.clone();
            // What is unknown has no weight.
            values.pixels_mut().iter_mut().filter(|normal| !is_known(**normal)).for_each(|normal| *normal = [0.0; 3]);
            values
        });
        let needs_depth = normals.as_ref().is_none_or(|map| map.pixels().contains(&[0.0; 3]));
        let depth_normals = needs_depth.then(|| depth_normals(plan, camera, plate_depth));
        Self {
            camera,
            color,
            depth,
            albedo: ResampledMap::new(plan, linear_albedo(surfaces)),
            normals: normals.map(|map| ResampledMap::new(plan, map)),
            depth_normals: depth_normals.map(|map| ResampledMap::new(plan, map)),
        }
    }

    fn fill_row(&self, y: usize, row: SurfaceRow) {
        let albedo_taps = self.albedo.rows(y);
        let normals = self.normals.as_ref().map(|map| (map, map.rows(y)));
        let depth_normals = self.depth_normals.as_ref().map(|map| (map, map.rows(y)));
        for x in 0..self.color.width() {
            let ([.., coverage], [depth]) = (self.color.at(x, y), self.depth.at(x, y));
            let direction = self.camera.direction(DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
            let Some(direction) = direction.filter(|_| coverage > 0.0 && depth > 0.0 && depth < f32::INFINITY) else {
                continue;
            };
            let mut normal = (-direction.normalize()).as_vec3().to_array();
            if let Some(seen) = normals.as_ref().and_then(|(map, taps)| unit(map.at(x, taps))) {
                let seen = DVec3::from(seen.map(f64::from));
                normal = (self.camera.world_from_camera * seen).as_vec3().to_array();
            } else if let Some(of_depth) = depth_normals.as_ref().and_then(|(map, taps)| unit(map.at(x, taps))) {
                normal = of_depth;
            }
            let albedo = self.albedo.at(x, &albedo_taps);
            for c in 0..3 {
                (row.reflectance[c][x], row.normal[c][x]) = (albedo[c] * coverage / PI, normal[c]);
            }
            row.depth[x] = depth;
        }
    }
}

fn is_known(normal: [f32; 3]) -> bool {
    normal.iter().all(|component| component.is_finite())
}

/// A normal of unit length; `None` if it is unknown.
fn unit(normal: [f32; 3]) -> Option<[f32; 3]> {
    let length = normal.iter().map(|component| component * component).sum::<f32>().sqrt();
    (length > SHORTEST_NORMAL).then(|| normal.map(|component| component / length))
}

/// A map that is resampled to the picture, as the image of the plate is.
struct ResampledMap {
    map: Image<3>,
    mapping: PlateMapping,
    columns: Vec<Vec<FilterTap>>,
}

impl ResampledMap {
    fn new(plan: &Plan, map: Image<3>) -> Self {
        let mapping = PlateMapping::new(plan, [map.width(), map.height()]);
        let columns = (0..mapping.picture_size()[0]).map(|x| filter_taps(&mapping, 0, x)).collect();
        Self { map, mapping, columns }
    }

    /// The weights of the map's rows in row `y` of the picture.
    fn rows(&self, y: usize) -> Vec<FilterTap> {
        filter_taps(&self.mapping, 1, y)
    }

    fn at(&self, x: usize, rows: &[FilterTap]) -> [f32; 3] {
        let mut sum = [0.0; 3];
        for row in rows {
            for column in &self.columns[x] {
                let value = self.map.at(column.pixel, row.pixel);
                (0..3).for_each(|c| sum[c] += row.weight * column.weight * value[c]);
            }
        }
        sum
    }
}

fn linear_albedo(surfaces: &PlateSurfaces) -> Image<3> {
    let [width, height] = surfaces.albedo_size();
    let mut image = Image::filled(width, height, [0.0; 3]);
    image.pixels_mut().par_chunks_mut(width.max(1)).enumerate().for_each(|(y, row)| {
        row.iter_mut().enumerate().for_each(|(x, pixel)| *pixel = surfaces.albedo(x, y));
    });
    image
}

/// Unit normals of what a depth shows, world coordinates, in the resolution of the depth; 0 where it shows nothing.
fn depth_normals(plan: &Plan, camera: &Camera, depth: &PlateDepth) -> Image<3> {
    let points = DepthPoints::new(plan, camera, depth);
    let mut image = Image::filled(depth.size[0], depth.size[1], [0.0; 3]);
    image.pixels_mut().par_chunks_mut(depth.size[0].max(1)).enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.iter_mut().enumerate() {
            *pixel = points.normal(x, y).map_or([0.0; 3], |normal| normal.as_vec3().to_array());
        }
    });
    image
}

/// What a depth shows, relative to the camera, m.
struct DepthPoints {
    size: [usize; 2],
    /// Not numbers where it shows nothing.
    points: Vec<[f32; 3]>,
}

impl DepthPoints {
    fn new(plan: &Plan, camera: &Camera, depth: &PlateDepth) -> Self {
        let mapping = PlateMapping::new(plan, depth.size);
        let overscan = plan.overscan() as f64;
        let width = depth.size[0].max(1);
        let mut points = vec![[f32::NAN; 3]; depth.size[0] * depth.size[1]];
        points.par_chunks_mut(width).zip(depth.values().par_chunks(width)).enumerate().for_each(
            |(y, (row, values))| {
                for (x, (point, value)) in row.iter_mut().zip(values).enumerate() {
                    let meters = depth.scale.meters_of(*value);
                    let place = DVec2::new(mapping.picture_position(0, x), mapping.picture_position(1, y)) + overscan;
                    if let Some(direction) = camera.direction(place).filter(|_| meters.is_finite()) {
                        let seen = direction * depth_of_lens(camera, depth.scale.kind, meters, place);
                        *point = seen.as_vec3().to_array();
                    }
                }
            },
        );
        Self { size: depth.size, points }
    }

    /// `None` outside the depth, and where it shows nothing.
    fn at(&self, x: Option<usize>, y: Option<usize>) -> Option<DVec3> {
        let (x, y) = (x.filter(|x| *x < self.size[0])?, y.filter(|y| *y < self.size[1])?);
        let point = DVec3::from(self.points[y * self.size[0] + x].map(f64::from));
        (!point.is_nan()).then_some(point)
    }

    /// The normal of the plane through a point and its nearest neighbors in both directions.
    fn normal(&self, x: usize, y: usize) -> Option<DVec3> {
        let here = self.at(Some(x), Some(y))?;
        let right = difference(self.at(x.checked_sub(1), Some(y)), here, self.at(Some(x + 1), Some(y)))?;
        let down = difference(self.at(Some(x), y.checked_sub(1)), here, self.at(Some(x), Some(y + 1)))?;
        let normal = down.cross(right).try_normalize()?;
        // It faces the camera, since it is seen.
        Some(if normal.dot(here) > 0.0 { -normal } else { normal })
    }
}

/// The smaller of the differences to the neighbors, so that none reaches across an edge.
fn difference(before: Option<DVec3>, here: DVec3, after: Option<DVec3>) -> Option<DVec3> {
    match (before.map(|before| here - before), after.map(|after| after - here)) {
        (Some(before), Some(after)) if before.length_squared() < after.length_squared() => Some(before),
        (before, after) => after.or(before),
    }
}
