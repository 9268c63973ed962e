//! The light that a plate was taken in, as far as it shows it: what drops before it refract.

use bansho_base::{
    camera::{Camera, Lens},
    color,
    host::assets::Encoding,
    math::{self, DVec2},
    world::sky::{ElevationProfile, ElevationSample},
};

use super::plate::{Fit, to_scene};
use crate::context::ShotContext;

/// Samples along a plate's longer side.
const SAMPLES: usize = 256;
/// How many times display white what a photograph shows as white may be: nobody knows how much brighter it was.
const BLOWN_OUT: f32 = 2.0;

/// The light from all elevations as the plate of the first frame shows it through the camera of time 0; 1.0 is display white. `None`
/// where there is no plate, or none that can be read.
///
/// It is taken once a shot, so that it never flickers, and from the whole plate, whatever the crop.
pub(crate) fn plate_light(context: &ShotContext) -> Option<ElevationProfile> {
    let path = context.plan.scene.plate.image.as_ref()?;
    let picture = context.compiled.assets().picture(&path.0, context.plan.scene.picture.first_frame).ok()?;
    let camera = context.plan.scene.camera.at(0.0, context.plan.size);
    let [width, height] = [picture.color.width(), picture.color.height()];
    let fit = Fit::new(context, [width, height]);
    let view = context.plan.shown();
    let step = width.max(height).div_ceil(SAMPLES);
    let places = |side: usize| (step.min(side) / 2..side).step_by(step);
    let samples: Vec<_> = places(height)
        .flat_map(|y| places(width).map(move |x| [x, y]))
        .filter_map(|[x, y]| {
            let pixel = DVec2::new(fit.in_picture(0, x), fit.in_picture(1, y));
            let [red, green, blue, _] = picture.color.at(x, y);
            let light = to_scene(&view, picture.encoding, [red, green, blue]);
            sample(&camera, pixel, limited(picture.encoding, light))
        })
        .collect();
    let above = open_sky(&samples);
    ElevationProfile::from_samples(samples.into_iter().chain(above))
}

/// Share of the upper half of a plate that is taken for its sky: the brightest.
const SKY_SHARE: f64 = 0.1;
/// Steps of elevation in which the sky above the plate is given.
const STEPS: usize = 96;
/// Weight of what is only inferred beside what is seen, which decides wherever there is any.
const INFERRED: f64 = 1e-6;

/// The sky above all that a plate shows, which must be open where rain falls from it: as bright as what is brightest in the plate's upper half,
/// and brighter toward the zenith as an overcast sky is (CIE S 011).
fn open_sky(samples: &[ElevationSample]) -> Vec<ElevationSample> {
    let mut upper: Vec<&ElevationSample> = samples[..samples.len().div_ceil(2)].iter().collect();
    let seen = |sample: &&ElevationSample| color::luminance(sample.radiance);
    upper.sort_by(|a, b| seen(b).total_cmp(&seen(a)));
    upper.truncate((upper.len() as f64 * SKY_SHARE).ceil() as usize);
    let Some(count) = std::num::NonZero::new(upper.len()) else { return Vec::new() };
    let mean =
        |of: &dyn Fn(&ElevationSample) -> f64| upper.iter().map(|each| of(each)).sum::<f64>() / count.get() as f64;
    let radiance = [0, 1, 2].map(|c| mean(&|each| f64::from(each.radiance[c])));
    let overcast = |sine: f64| 1.0 + 2.0 * sine.max(0.0);
    let level = mean(&|each| overcast(each.sine));
    let highest = samples.iter().map(|each| each.sine).fold(-1.0, f64::max);
    let at = |step: usize| {
        let sine = math::lerp(highest, 1.0, (step as f64 + 0.5) / STEPS as f64);
        let radiance = radiance.map(|value| (value * overcast(sine) / level) as f32);
        ElevationSample { sine, weight: INFERRED, radiance }
    };
    (0..STEPS).map(at).collect()
}

/// Light that is seen at a place in the picture, in the direction and the solid angle of its pixel.
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

/// Light as it can have been: none below nothing, and of a picture made to be looked at none far beyond white.
fn limited(encoding: Encoding, light: [f32; 3]) -> [f32; 3] {
    let light = light.map(|value| value.max(0.0));
    let brightest = color::luminance(light);
    let factor = match encoding {
        Encoding::DisplaySrgb if brightest > BLOWN_OUT => BLOWN_OUT / brightest,
        _ => 1.0,
    };
    light.map(|value| value * factor)
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
        let [lowest, zenith] = [sky[0], sky[STEPS - 1]].map(|each| each.radiance);
        assert!(
            (lowest[0] - 0.6).abs() < 0.01 && (zenith[0] / lowest[0] - 3.0 / 1.6).abs() < 0.02,
            "{lowest:?} {zenith:?}"
        );
        assert!((zenith[2] / zenith[0] - 2.0).abs() < 1e-5);
        let profile = ElevationProfile::from_samples(samples.iter().copied().chain(sky)).unwrap();
        // What is seen stays as it is: at its top the mean of pillars and sky.
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
        assert!((color::luminance(limited_white) - BLOWN_OUT).abs() < 1e-5);
        assert_eq!(light, white);
        assert_eq!(limited(Encoding::LinearAcescg, [-0.1, 0.5, 0.2]), [0.0, 0.5, 0.2]);
    }
}
