//! The sky as a backdrop: what lies behind everything where there is no plate.

mod skyline;
mod stars;

use std::f64::consts::TAU;

use bansho_base::{
    canvas::{AovDescriptor, DepthInterval, Shutter, Strip, View},
    color,
    image::Rect,
    math::{self, DVec2, DVec3},
    observer::{Cancelled, Observer},
    phenomenon::{Phenomenon, Prepared},
    sky::{Night, Parallel, Sky, SkyKind, SkyParameters},
    surroundings::{Publication, Surroundings},
};

use skyline::Skyline;
use stars::{Spot, Stars};

/// The sky of a scene, infinitely far and opaque, with hills before it; at night with stars.
pub struct SkyBackdrop {
    parameters: SkyParameters,
    stars: Option<Stars>,
    skyline: Option<Skyline>,
}

impl SkyBackdrop {
    /// The name of its layer.
    pub const NAME: &str = "sky";

    /// A sky with these parameters.
    pub fn new(parameters: SkyParameters, seed: u64) -> Self {
        let night = parameters.kind == SkyKind::Night;
        let stars = (night && parameters.night.stars > 0.0).then(|| Stars::new(seed));
        Self { stars, skyline: Skyline::new(&parameters, seed), parameters }
    }

    /// Where the hills stand.
    fn hills(&self) -> DepthInterval {
        let near = self.parameters.hills_distance;
        DepthInterval { near, far: near * (1.0 + 1e-4) }
    }
}

/// Behind everything that has a depth.
const FAR: DepthInterval = DepthInterval { near: 1e12, far: f64::INFINITY };
/// Light of hills and trees beside that of the sky overhead.
const HILL_SHADE: f32 = 0.04;
/// Steps of elevation from the horizon to the zenith, even in the root of its sine.
const STEPS: usize = 512;
/// Luminance of the Milky Way's middle, cd/m^2, its width in sines, and its colour's temperature, K.
const MILKY_WAY: f64 = 1.6e-4;
const MILKY_WAY_WIDTH: f64 = 0.14;
const MILKY_WAY_K: f32 = 5200.0;

impl Phenomenon for SkyBackdrop {
    fn name(&self) -> &str {
        Self::NAME
    }

    fn aovs(&self) -> &'static [AovDescriptor] {
        &[]
    }

    fn luminance(&self) -> f64 {
        f64::from(color::luminance(self.parameters.at(0.0).radiance(DVec3::Y)))
    }

    fn publish(&self, _shutter: Shutter) -> Publication {
        Publication::default()
    }

    fn depth_intervals(&self, _view: &View, _surroundings: &Surroundings) -> Vec<DepthInterval> {
        if self.skyline.is_some() { vec![self.hills(), FAR] } else { vec![FAR] }
    }

    fn prepare<'a>(
        &'a self,
        view: &'a View,
        surroundings: &'a Surroundings<'a>,
        _observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        let sky = surroundings.sky;
        let shown = sky.night().zip(self.stars.as_ref());
        let spots = shown.map(|(night, stars)| stars.spots(view, night, self.parameters.night.stars));
        let night = sky.night().map(|night| NightSky::new(night, self.parameters.night.milky_way));
        Ok(Box::new(PreparedSky {
            view,
            sky,
            night,
            spots: spots.unwrap_or_default(),
            skyline: self.skyline.as_ref(),
            hills: self.hills(),
        }))
    }
}

struct PreparedSky<'a> {
    view: &'a View,
    sky: Sky,
    night: Option<NightSky>,
    /// Stars, from the top down.
    spots: Vec<Spot>,
    skyline: Option<&'a Skyline>,
    /// Where it stands.
    hills: DepthInterval,
}

/// The night by elevation.
struct NightSky {
    night: Night,
    parallels: Vec<Parallel>,
    /// Light of the Milky Way's middle, by elevation.
    milky_way: Vec<[f32; 3]>,
    pole: [f32; 3],
}

impl NightSky {
    fn new(night: &Night, milky_way: f64) -> Self {
        let elevations = || (0..=STEPS).map(|step| math::asin(math::pow(step as f64 / STEPS as f64, 2.0)));
        let colour = color::black_body().radiance(MILKY_WAY_K);
        let scale = milky_way * MILKY_WAY / f64::from(color::luminance(colour));
        let dimmed = |elevation| (scale * night.transmittance(elevation)) as f32;
        Self {
            night: *night,
            parallels: elevations().map(|elevation| night.parallel(elevation)).collect(),
            milky_way: elevations().map(|elevation| colour.map(|value| value * dimmed(elevation))).collect(),
            pole: stars::galactic_pole().as_vec3().to_array(),
        }
    }

    /// Radiance from a direction above the horizon, a unit vector.
    fn radiance(&self, direction: DVec3) -> [f32; 3] {
        let step = ((direction.y.clamp(0.0, 1.0) as f32).sqrt() * STEPS as f32 + 0.5) as usize;
        let even = self.parallels[step].radiance(self.night.toward(direction) as f32);
        let [x, y, z] = direction.as_vec3().to_array();
        let height = self.pole[0] * x + self.pole[1] * y + self.pole[2] * z;
        let across = height * (1.0 / MILKY_WAY_WIDTH) as f32;
        // A band with soft edges; what lies far from it gives a little.
        let share = 1.0 / (1.0 + across * across * across * across);
        std::array::from_fn(|c| self.milky_way[step][c].mul_add(share, even[c]))
    }
}

impl PreparedSky<'_> {
    fn radiance(&self, direction: DVec3) -> [f32; 3] {
        match &self.night {
            Some(night) if direction.y >= 0.0 => night.radiance(direction),
            _ => self.sky.radiance(direction),
        }
    }

    fn draw_sky(&self, strip: &mut Strip) {
        let rect = strip.rect;
        let far = vec![f32::INFINITY; rect.width];
        for row in 0..rect.height {
            let first = row * rect.width;
            let [mut opacity, mut red, mut green, mut blue] = [0; 4].map(|_| vec![0.0; rect.width]);
            for x in 0..rect.width {
                let pixel = DVec2::new((rect.x + x) as f64, (rect.y + row) as f64) + 0.5;
                let Some(direction) = self.view.camera.direction(pixel) else { continue };
                if strip.visible(first + x, FAR.near as f32) {
                    [red[x], green[x], blue[x]] = self.radiance(direction.normalize());
                    opacity[x] = 1.0;
                }
            }
            self.add_stars(rect, row, [&mut red, &mut green, &mut blue], &opacity);
            strip.add_row_behind(first, [&red, &green, &blue], Some(&opacity), &far);
        }
    }

    /// Adds the stars of one row where the sky is seen.
    fn add_stars(&self, rect: Rect, row: usize, planes: [&mut [f32]; 3], opacity: &[f32]) {
        let y = rect.y + row;
        let from = self.spots.partition_point(|spot| spot.pixel.y < y as f64 - 12.0);
        let near = self.spots[from..].iter().take_while(|spot| spot.pixel.y < y as f64 + 12.0);
        for spot in near {
            let low = (spot.pixel.x - spot.reach).floor().max(rect.x as f64) as usize;
            let high = (spot.pixel.x + spot.reach).ceil().clamp(0.0, rect.right() as f64) as usize;
            for x in low..high {
                if let Some(light) = spot.at(x, y) {
                    for c in 0..3 {
                        planes[c][x - rect.x] = light[c].mul_add(opacity[x - rect.x], planes[c][x - rect.x]);
                    }
                }
            }
        }
    }

    /// Hills and trees, black before the sky.
    fn draw_hills(&self, skyline: &Skyline, strip: &mut Strip) {
        let rect = strip.rect;
        let shade = self.sky.radiance(DVec3::Y).map(|value| value * HILL_SHADE);
        let sharpness = self.view.camera.focal_pixels as f32;
        for index in 0..strip.len() {
            let pixel = DVec2::new((rect.x + index % rect.width) as f64, (rect.y + index / rect.width) as f64) + 0.5;
            let Some(direction) = self.view.camera.direction(pixel).map(DVec3::normalize) else { continue };
            let sine = direction.y as f32;
            if sine > skyline.highest + 1.0 / sharpness || !strip.visible(index, self.hills.near as f32) {
                continue;
            }
            let hidden = skyline.sine(math::atan2(direction.x, -direction.z) / TAU);
            let cover = ((hidden - sine) * sharpness + 0.5).clamp(0.0, 1.0);
            if cover > 0.0 {
                strip.add_behind(index, shade.map(|value| value * cover), [1.0 - cover; 3], self.hills.near as f32);
            }
        }
    }
}

impl Prepared for PreparedSky<'_> {
    fn bounds(&self, slice: &DepthInterval) -> Rect {
        let hills = self.skyline.is_some() && slice.overlaps(&self.hills);
        if hills || slice.overlaps(&FAR) {
            Rect::of_size(self.view.size[0], self.view.size[1])
        } else {
            Rect::default()
        }
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        if let Some(skyline) = self.skyline.filter(|_| slice.contains(self.hills.near)) {
            self.draw_hills(skyline, strip);
        }
        if slice.overlaps(&FAR) {
            self.draw_sky(strip);
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
        let backdrop = SkyBackdrop::new(parameters.clone(), 1);
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
