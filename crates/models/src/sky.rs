//! The sky as a backdrop: what lies behind everything where there is no plate.

use bansho_base::{
    canvas::{AovDescriptor, DepthInterval, Shutter, Strip, View},
    color,
    image::Rect,
    math::DVec2,
    observer::{Cancelled, Observer},
    phenomenon::{Phenomenon, Prepared},
    sky::{Sky, SkyParameters},
    surroundings::{Publication, Surroundings},
};

/// The sky of a scene, infinitely far and opaque.
pub struct SkyBackdrop {
    parameters: SkyParameters,
}

impl SkyBackdrop {
    /// The name of its layer.
    pub const NAME: &str = "sky";

    /// A sky with these parameters.
    pub fn new(parameters: SkyParameters) -> Self {
        Self { parameters }
    }
}

/// Behind everything that has a depth.
const FAR: DepthInterval = DepthInterval { near: 1e12, far: f64::INFINITY };

impl Phenomenon for SkyBackdrop {
    fn name(&self) -> &str {
        Self::NAME
    }

    fn aovs(&self) -> &'static [AovDescriptor] {
        &[]
    }

    fn luminance(&self) -> f64 {
        f64::from(color::luminance(self.parameters.at(0.0).radiance(bansho_base::math::DVec3::Y)))
    }

    fn publish(&self, _shutter: Shutter) -> Publication {
        Publication::default()
    }

    fn depth_intervals(&self, _view: &View, _surroundings: &Surroundings) -> Vec<DepthInterval> {
        vec![FAR]
    }

    fn prepare<'a>(
        &'a self,
        view: &'a View,
        surroundings: &'a Surroundings<'a>,
        _observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        Ok(Box::new(PreparedSky { view, sky: surroundings.sky }))
    }
}

struct PreparedSky<'a> {
    view: &'a View,
    sky: Sky,
}

impl Prepared for PreparedSky<'_> {
    fn bounds(&self, slice: &DepthInterval) -> Rect {
        if slice.overlaps(&FAR) { Rect::of_size(self.view.size[0], self.view.size[1]) } else { Rect::default() }
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        if !slice.overlaps(&FAR) {
            return;
        }
        let rect = strip.rect;
        let far = vec![f32::INFINITY; rect.width];
        for row in 0..rect.height {
            let first = row * rect.width;
            let [mut opacity, mut red, mut green, mut blue] = [0; 4].map(|_| vec![0.0; rect.width]);
            for x in 0..rect.width {
                let pixel = DVec2::new((rect.x + x) as f64, (rect.y + row) as f64) + 0.5;
                let Some(direction) = self.view.camera.direction(pixel) else { continue };
                if strip.visible(first + x, FAR.near as f32) {
                    [red[x], green[x], blue[x]] = self.sky.radiance(direction.normalize());
                    opacity[x] = 1.0;
                }
            }
            strip.add_row_behind(first, [&red, &green, &blue], Some(&opacity), &far);
        }
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::{
        animation::Animated, camera::CameraParameters, observer::Unobserved, wind::Wind, wind::WindParameters,
    };

    use super::*;

    #[test]
    fn it_fills_the_picture_behind_everything_and_hides_what_is_behind_it() {
        let parameters = SkyParameters { luminance: Animated::from(300.0), ..SkyParameters::default() };
        let backdrop = SkyBackdrop::new(parameters.clone());
        let shutter = Shutter { open: 0.0, close: 0.0 };
        let view = View::new(CameraParameters::default(), shutter, 0.0, [16, 8], 0);
        let wind = Wind::new(WindParameters::default(), 1, None);
        let surroundings = Surroundings { sky: parameters.at(0.0), ..Surroundings::of_wind(&wind) };
        let prepared = backdrop.prepare(&view, &surroundings, &Unobserved).unwrap();
        let mut strip = Strip::default();
        strip.reset(Rect::of_size(16, 8), None, 0);
        prepared.draw(&FAR, &mut strip);
        assert!(strip.radiance[1].iter().all(|value| *value > 0.0));
        assert_eq!(strip.transmittance(77), [0.0; 3]);
        assert!(prepared.bounds(&DepthInterval { near: 0.0, far: 1e6 }).is_empty());
        assert!(strip.radiance[1][0] > strip.radiance[1][16 * 7], "an overcast sky is brighter above");
    }
}
