//! The light that a plate was taken in, as far as it shows it: what drops before it refract.

use bansho_base::{
    assets::Encoding,
    camera::{Camera, Lens},
    color,
    math::{self, DVec2},
    sky::{ElevationProfile, ElevationSample},
};

use super::plate::{Fit, to_scene};
use crate::plan::Plan;

/// Samples along a plate's longer side.
const SAMPLES: usize = 256;
/// How many times display white what a photograph shows as white may be: nobody knows how much brighter it was.
const BLOWN_OUT: f32 = 2.0;

/// The light from all elevations as the plate of the first frame shows it through the camera of time 0; 1.0 is display white. `None`
/// where there is no plate, or none that can be read.
///
/// It is taken once a shot, so that it never flickers, and from the whole plate, whatever the crop.
pub(crate) fn plate_light(plan: &Plan) -> Option<ElevationProfile> {
    let path = plan.scene.plate.image.as_ref()?;
    let picture = plan.assets.picture(&path.0, plan.scene.picture.first_frame).ok()?;
    let camera = plan.scene.camera.at(0.0, plan.size);
    let [width, height] = [picture.colour.width(), picture.colour.height()];
    let fit = Fit::new(plan, [width, height]);
    let view = plan.shown();
    let step = width.max(height).div_ceil(SAMPLES);
    let places = |side: usize| (step.min(side) / 2..side).step_by(step);
    let samples = places(height).flat_map(|y| places(width).map(move |x| [x, y])).filter_map(|[x, y]| {
        let pixel = DVec2::new(fit.in_picture(0, x), fit.in_picture(1, y));
        let [red, green, blue, _] = picture.colour.at(x, y);
        let light = to_scene(&view, picture.encoding, [red, green, blue]);
        sample(&camera, pixel, limited(picture.encoding, light))
    });
    ElevationProfile::of_samples(samples)
}

/// Light that is seen at a place in the picture, in the direction and the solid angle of its pixel.
fn sample(camera: &Camera, pixel: DVec2, radiance: [f32; 3]) -> Option<ElevationSample> {
    let direction = camera.direction(pixel)?;
    let length = direction.length();
    let weight = match camera.lens {
        Lens::Perspective => 1.0 / (length * length * length),
        Lens::Fisheye => 1.0,
        Lens::Panorama => math::cos((camera.centre.y - pixel.y) / camera.focal_pixels).max(0.0),
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
    fn white_of_a_photograph_is_at_most_one_stop_brighter_than_white() {
        let white = to_scene(&color::View::DISPLAY, Encoding::DisplaySrgb, [1.0; 3]);
        assert!(color::luminance(white) > 10.0);
        let [limited_white, light] = [Encoding::DisplaySrgb, Encoding::LinearAcescg].map(|kind| limited(kind, white));
        assert!((color::luminance(limited_white) - BLOWN_OUT).abs() < 1e-5);
        assert_eq!(light, white);
        assert_eq!(limited(Encoding::LinearAcescg, [-0.1, 0.5, 0.2]), [0.0, 0.5, 0.2]);
    }
}
