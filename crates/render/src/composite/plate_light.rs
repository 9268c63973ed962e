//! The light in which a plate was taken, estimated from the plate itself. Drops in front of a plate refract it.

use bansho_base::{
    camera::{Camera, Lens},
    color,
    host::assets::Encoding,
    math::{self, DVec2},
    world::sky::{ElevationProfile, ElevationSample},
};

use super::plate::{PlateMapping, over_black, premultiplied};
use crate::{compiled::CompiledScene, plan::Plan};

/// Samples along a plate's longer side.
const SAMPLES: usize = 256;
/// Largest luminance that is taken from a photograph, relative to display white. How much brighter a clipped pixel was is unknown.
const CLIPPED_LUMINANCE: f32 = 2.0;

/// The light from all elevations, as the plate of the first frame shows it through the camera at time 0; 1.0 is display white. `None`
/// where there is no plate, or none that can be read.
///
/// It is computed once a shot, so that it does not flicker, and from the whole plate, whatever the crop.
pub(crate) fn plate_light(compiled: &CompiledScene, plan: &Plan) -> Option<ElevationProfile> {
    let picture = compiled.plate_image()?;
    let alpha = plan.scene.plate.alpha_of(&picture);
    let camera = plan.camera.at(0.0, plan.size);
    let [width, height] = [picture.color.width(), picture.color.height()];
    let mapping = PlateMapping::new(plan, [width, height]);
    let view = plan.view_transform();
    let step = width.max(height).div_ceil(SAMPLES);
    let positions = |side: usize| (step.min(side) / 2..side).step_by(step);
    let samples: Vec<_> = positions(height)
        .flat_map(|y| positions(width).map(move |x| [x, y]))
        .filter_map(|[x, y]| {
            let pixel = DVec2::new(mapping.picture_position(0, x), mapping.picture_position(1, y));
            let [red, green, blue, _] =
                over_black(&view, picture.encoding, alpha, premultiplied(alpha, picture.color.at(x, y)));
            let light = [red, green, blue];
            sample(&camera, pixel, limited(picture.encoding, light))
        })
        .collect();
    let above = open_sky(&samples);
    ElevationProfile::from_samples(samples.into_iter().chain(above))
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
    let mut upper: Vec<&ElevationSample> = samples[..samples.len().div_ceil(2)].iter().collect();
    let seen = |sample: &&ElevationSample| color::luminance(sample.radiance);
    upper.sort_by(|a, b| seen(b).total_cmp(&seen(a)));
    upper.truncate((upper.len() as f64 * SKY_FRACTION).ceil() as usize);
    let Some(count) = std::num::NonZero::new(upper.len()) else { return Vec::new() };
    let mean =
        |of: &dyn Fn(&ElevationSample) -> f64| upper.iter().map(|each| of(each)).sum::<f64>() / count.get() as f64;
    let radiance = [0, 1, 2].map(|c| mean(&|each| f64::from(each.radiance[c])));
    let overcast = |sine: f64| 1.0 + 2.0 * sine.max(0.0);
    let level = mean(&|each| overcast(each.sine));
    let highest = samples.iter().map(|each| each.sine).fold(-1.0, f64::max);
    let at = |step: usize| {
        let sine = math::lerp(highest, 1.0, (step as f64 + 0.5) / INFERRED_SAMPLES as f64);
        let radiance = radiance.map(|value| (value * overcast(sine) / level) as f32);
        ElevationSample { sine, weight: INFERRED_WEIGHT, radiance }
    };
    (0..INFERRED_SAMPLES).map(at).collect()
}

/// The light of a pixel, with the sine of its elevation and its solid angle as the weight.
fn sample(camera: &Camera, pixel: DVec2, radiance: [f32; 3]) -> Option<ElevationSample> {
    let direction = camera.direction(pixel)?;
    let length = direction.length();
    let weight = match camera.lens {
        Lens::Perspective => 1.0 / (length * length * length),
        Lens::Fisheye => 1.0,
        Lens::Panorama => math::cos((camera.principal_point.y - pixel.y) / camera.focal_pixels).max(0.0),
    };
    Some(ElevationSample { sine: direction.y / length, weight, radiance })
}

/// Light without negative values, and for display pictures at most [`CLIPPED_LUMINANCE`].
fn limited(encoding: Encoding, light: [f32; 3]) -> [f32; 3] {
    let light = light.map(|value| value.max(0.0));
    let brightest = color::luminance(light);
    let factor = match encoding {
        Encoding::DisplaySrgb if brightest > CLIPPED_LUMINANCE => CLIPPED_LUMINANCE / brightest,
        _ => 1.0,
    };
    light.map(|value| value * factor)
}

#[cfg(test)]
mod tests {
    use super::{super::plate::to_scene, *};

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
    fn white_of_a_photograph_is_at_most_one_stop_brighter_than_white() {
        let white = to_scene(&color::View::DISPLAY, Encoding::DisplaySrgb, [1.0; 3]);
        assert!(color::luminance(white) > 10.0);
        let [limited_white, light] = [Encoding::DisplaySrgb, Encoding::LinearAcescg].map(|kind| limited(kind, white));
        assert!((color::luminance(limited_white) - CLIPPED_LUMINANCE).abs() < 1e-5);
        assert_eq!(light, white);
        assert_eq!(limited(Encoding::LinearAcescg, [-0.1, 0.5, 0.2]), [0.0, 0.5, 0.2]);
    }
}
