//! The light in which a plate was taken, estimated from the plate itself. Drops in front of a plate refract it.

use bansho_base::{
    camera::Camera,
    color,
    host::{parallel::prelude::*, plural::counted},
    math::{self, DVec2},
    world::sky::{ElevationProfile, ElevationSample},
};

use super::plate_mapping::PlateMapping;
use crate::{
    compiled::CompiledScene,
    plan::Plan,
    plate_boxes::{BRIGHTEST_LUMINANCE, BoxViewsKey, PixelView},
};

/// The light from all elevations, as the plate of the first frame shows it through the camera at time 0; 1.0 is display white. `None`
/// where there is no plate, or none that can be read.
///
/// It is computed once a shot, so that it does not flicker, and from the whole plate, whatever the crop: from the means of its boxes.
pub(crate) fn plate_light(compiled: &CompiledScene, plan: &Plan) -> Option<ElevationProfile> {
    let boxes = compiled.plate_boxes(plan.view_transform())?;
    let camera = plan.camera.at(0.0, plan.size);
    let mapping = PlateMapping::new(plan, boxes.size());
    let view_of = |index: usize| {
        let each = boxes.at(index);
        let [x, y] = [0, 1].map(|axis| mapping.picture_position(axis, each.center[axis]));
        let view = pixel_view(&camera, DVec2::new(x, y))?;
        Some(PixelView { weight: view.weight * each.pixels as f64 / boxes.pixels_in_box(), ..view })
    };
    let key = BoxViewsKey { camera, picture: plan.size, plate: boxes.size() };
    let views = compiled.box_views(key, || (0..boxes.len()).into_par_iter().map(view_of).collect());
    let mut samples = Vec::with_capacity(views.len());
    for (index, view) in views.iter().enumerate() {
        samples.extend(view.map(|view| ElevationSample {
            sine: view.sine,
            weight: view.weight,
            radiance: boxes.light_at(index),
        }));
    }
    let above = open_sky(&samples);
    ElevationProfile::from_samples(samples.into_iter().chain(above))
}

/// What to say of the plate's light: `None` if all of it is taken.
pub(crate) fn plate_light_remark(compiled: &CompiledScene, plan: &Plan) -> Option<String> {
    // A sky that the scene states lights it instead.
    let boxes = plan.scene.tables.sky(0.0).is_none().then(|| compiled.plate_boxes(plan.view_transform()))??;
    (boxes.limited > 0).then(|| {
        let pixels = counted(boxes.limited, "pixel");
        let (verb, takes) = if boxes.limited == 1 { ("is", "counts") } else { ("are", "count") };
        format!(
            "`image`: {pixels} {verb} infinite or far brighter than the rest, and {takes} in the light on drops as {BRIGHTEST_LUMINANCE} times display white or \
             the plate's own brightness; a [[light]] states the lamp, or a [sky] the sky"
        )
    })
}

/// Fraction of the upper half of a plate, the brightest, that is assumed to be sky.
const SKY_FRACTION: f64 = 0.1;
/// Elevations at which the sky above the plate is sampled.
const INFERRED_SAMPLES: usize = 96;
/// Weight of inferred samples, so small that samples of the plate decide wherever there are any.
const INFERRED_WEIGHT: f64 = 1e-6;

/// The sky above the field of view of a plate, which is assumed to be open since rain falls from it: as bright as the brightest pixels in the
/// upper half of the plate, and brighter toward the zenith as the overcast sky of CIE S 011.
fn open_sky(samples: &[ElevationSample]) -> Vec<ElevationSample> {
    let upper = brightest(&samples[..samples.len().div_ceil(2)], SKY_FRACTION);
    if upper.is_empty() {
        return Vec::new();
    }
    let count = upper.len() as f64;
    let radiance = [0, 1, 2].map(|c| upper.iter().map(|sample| f64::from(sample.radiance[c])).sum::<f64>() / count);
    let level = upper.iter().map(|sample| overcast_gradation(sample.sine)).sum::<f64>() / count;
    let highest = samples.iter().map(|sample| sample.sine).fold(-1.0, f64::max);
    let mut inferred = Vec::with_capacity(INFERRED_SAMPLES);
    for step in 0..INFERRED_SAMPLES {
        let sine = math::lerp(highest, 1.0, (step as f64 + 0.5) / INFERRED_SAMPLES as f64);
        let radiance = radiance.map(|value| (value * overcast_gradation(sine) / level) as f32);
        inferred.push(ElevationSample { sine, weight: INFERRED_WEIGHT, radiance });
    }
    inferred
}

/// The fraction of the samples that are brightest, from the brightest; of equal ones the first.
fn brightest(samples: &[ElevationSample], fraction: f64) -> Vec<&ElevationSample> {
    let luminances = samples.iter().map(|sample| color::luminance(sample.radiance));
    let mut order: Vec<(f32, usize)> = luminances.zip(0..).collect();
    let count = (samples.len() as f64 * fraction).ceil() as usize;
    let from_brightest = |a: &(f32, usize), b: &(f32, usize)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
    if count < order.len() {
        order.select_nth_unstable_by(count, from_brightest);
        order.truncate(count);
    }
    order.sort_unstable_by(from_brightest);
    order.iter().map(|&(_, index)| &samples[index]).collect()
}

/// Radiance of the CIE Standard Overcast Sky (CIE S 011, sky 16) at the sine of an elevation, relative to the horizon: `1 + 2 sin`.
fn overcast_gradation(elevation_sine: f64) -> f64 {
    1.0 + 2.0 * elevation_sine.max(0.0)
}

/// Where a pixel is seen: the sine of its elevation, and its solid angle as the weight.
fn pixel_view(camera: &Camera, pixel: DVec2) -> Option<PixelView> {
    let direction = camera.direction(pixel)?;
    // Relative to the pixel at the principal point, since the samples of the open sky are weighted in this unit.
    let weight = camera.pixel_solid_angle(pixel) * camera.focal_pixels * camera.focal_pixels;
    Some(PixelView { sine: direction.y / direction.length(), weight })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sky_above_a_plate_is_as_bright_as_the_sky_in_it_and_brighter_overhead() {
        let radiance = |value: f32| [value, value, 2.0 * value];
        let row = |sine: f64, value: f32| {
            (0..20).map(move |column| {
                let radiance = if column < 8 { radiance(0.02) } else { radiance(value) };
                ElevationSample { sine, weight: 1.0, radiance }
            })
        };
        let samples: Vec<_> = row(0.3, 0.6).chain(row(0.1, 0.6)).chain(row(-0.1, 0.1)).chain(row(-0.3, 0.1)).collect();
        let sky = open_sky(&samples);
        assert!(sky.iter().all(|each| (0.3..=1.0).contains(&each.sine) && each.weight < 1e-3));
        // The brightest of the upper half lie at sines of 0.1 and 0.3 alike: the first of them count.
        let [lowest, zenith] = [sky[0], sky[INFERRED_SAMPLES - 1]].map(|each| each.radiance);
        assert!(
            (lowest[0] - 0.6).abs() < 0.01 && (zenith[0] / lowest[0] - 3.0 / 1.6).abs() < 0.02,
            "{lowest:?} {zenith:?}"
        );
        assert!((zenith[2] / zenith[0] - 2.0).abs() < 1e-5);
        let profile = ElevationProfile::from_samples(samples.iter().copied().chain(sky)).unwrap();
        // Samples of the plate are unchanged: at its top the mean of pillars and sky.
        let seen =
            bansho_base::world::sky::Sky::measured(profile).radiance(bansho_base::math::DVec3::new(0.0, 0.29, 0.0));
        assert!(seen[0] < 0.45, "{seen:?}");
        assert_eq!(open_sky(&[]), []);
    }

    #[test]
    fn the_brightest_samples_come_first_and_equal_ones_in_their_order() {
        let values = [3.0_f32, 5.0, 1.0, 5.0, 4.0, 2.0, 5.0, 4.0, 0.0, 4.0];
        let of =
            |(index, value): (usize, &f32)| ElevationSample { sine: index as f64, weight: 1.0, radiance: [*value; 3] };
        let samples: Vec<_> = values.iter().enumerate().map(of).collect();
        for (fraction, expected) in [
            (0.0, &[][..]),
            (0.2, &[1.0, 3.0]),
            (0.45, &[1.0, 3.0, 6.0, 4.0, 7.0]),
            (1.0, &[1.0, 3.0, 6.0, 4.0, 7.0, 9.0, 0.0, 5.0, 2.0, 8.0]),
        ] {
            let order: Vec<f64> = brightest(&samples, fraction).iter().map(|sample| sample.sine).collect();
            assert_eq!(order, expected);
        }
        assert!(brightest(&[], 0.1).is_empty());
    }

    #[test]
    fn every_lens_weighs_a_plate_by_the_solid_angle_of_its_pixels() {
        use bansho_base::camera::{CameraParameters, Lens};
        for lens in [Lens::Perspective, Lens::Fisheye, Lens::Panorama] {
            let camera = CameraParameters { lens, ..CameraParameters::default() }.at(0.0, [128, 128]);
            let weight = |pixel| pixel_view(&camera, pixel).unwrap().weight;
            let ray = |x: f64, y: f64| camera.direction(DVec2::new(x, y)).unwrap().normalize();
            for [x, y] in [[64.0, 64.0], [64.0, 3.0], [32.5, 110.0]] {
                let parallelogram = (ray(x + 0.5, y) - ray(x - 0.5, y)).cross(ray(x, y + 0.5) - ray(x, y - 0.5));
                let expected = parallelogram.length() * camera.focal_pixels * camera.focal_pixels;
                let ratio = weight(DVec2::new(x, y)) / expected;
                assert!((ratio - 1.0).abs() < 1e-3, "{lens:?} at {x}, {y}: {ratio}");
            }
        }
    }
}
