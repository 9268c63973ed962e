//! A long exposure is the mean of short ones, and drops move as they say.

use bansho_base::{
    camera::CameraParameters,
    math::{DVec3, curve::Interpolation},
    parameters::animated::Animated,
    phenomenon::{
        strip::{Shutter, View},
        surroundings::Surroundings,
    },
};

use super::{METHODS, Method, draw, lit, rain, streaks, view_at, wind};
use crate::RainParameters;

const SIZE: [usize; 2] = [128, 72];
/// Short exposures that make up a long one.
const SHORT: usize = 20;

/// A camera whose target and position move linearly from one to another in a second.
fn moving(position: [[f64; 3]; 2], target: [[f64; 3]; 2]) -> CameraParameters {
    let keyed = |[from, to]: [[f64; 3]; 2]| {
        Animated::keyed(vec![(0.0, from), (1.0, to)], Interpolation::Linear).expect("the keys ascend")
    };
    CameraParameters { position: keyed(position), target: keyed(target), ..CameraParameters::default() }
}

/// Green light of a picture.
fn light(
    parameters: &RainParameters,
    camera: &CameraParameters,
    shutter: Shutter,
    surroundings: &Surroundings,
) -> Vec<f64> {
    let view = View::new(camera.clone(), shutter, shutter.close + 0.1, SIZE, 0);
    let strip = draw(&rain(parameters.clone(), 3), &view, surroundings);
    strip.radiance[1].iter().map(|value| f64::from(*value)).collect()
}

/// Root mean square of the difference of a long exposure and the mean of short ones, over that of the long one.
fn difference(
    parameters: &RainParameters,
    camera: &CameraParameters,
    shutter: Shutter,
    surroundings: &Surroundings,
) -> f64 {
    let long = light(parameters, camera, shutter, surroundings);
    let mut mean = vec![0.0; long.len()];
    let time = |step: usize| shutter.open + shutter.duration() * step as f64 / SHORT as f64;
    for step in 0..SHORT {
        let part = Shutter { open: time(step), close: time(step + 1) };
        let short = light(parameters, camera, part, surroundings);
        mean.iter_mut().zip(short).for_each(|(mean, value)| *mean += value / SHORT as f64);
    }
    let square = |values: &mut dyn Iterator<Item = f64>| values.map(|value| value * value).sum::<f64>();
    let error = square(&mut long.iter().zip(&mean).map(|(a, b)| a - b));
    (error / square(&mut long.iter().copied())).sqrt()
}

#[test]
fn a_long_exposure_is_the_mean_of_twenty_short_ones() {
    let [calm, gusty] = [wind([0.0; 3], 0.0), wind([3.0, 0.0, 1.0], 0.4)];
    let (here, ahead) = ([0.0, 1.6, 0.0], [0.0, 1.9, -4.0]);
    let still = moving([here; 2], [ahead; 2]);
    let pan = moving([here; 2], [[-4.0, 1.9, -4.0], [4.0, 1.9, -4.0]]);
    let drive = moving([[0.0, 1.6, 8.0], [0.0, 1.6, -8.0]], [[0.0, 1.9, -8.0], [0.0, 1.9, -24.0]]);
    for method in METHODS {
        for (name, wind, camera, exposure) in [
            ("a camera that stands still", &calm, &still, 0.32),
            ("gusts", &gusty, &still, 0.32),
            ("a pan of 90 degrees a second", &calm, &pan, 0.1),
            ("a drive at 16 m/s", &calm, &drive, 0.1),
        ] {
            let parameters = RainParameters { splashes: RainParameters::default().splashes, ..streaks(method, 40.0) };
            let shutter = Shutter { open: 0.4, close: 0.4 + exposure };
            let found = difference(&parameters, camera, shutter, &lit(wind));
            assert!(found < 0.05, "{method:?}, {name}: {found}");
        }
    }
}

#[test]
fn in_gusts_drops_are_a_frame_later_where_their_velocity_takes_them() {
    let dt = 1.0 / 500.0;
    for (velocity, gust) in
        [([4.0, 0.0, 0.0], 0.0), ([4.0, 0.0, 0.0], 0.4), ([2.0, 0.0, 1.0], 0.3), ([10.0, 0.0, 0.0], 0.5)]
    {
        let windy = wind(velocity, gust);
        let surroundings = Surroundings::from_wind(&windy);
        let rain = rain(streaks(Method::Drops, 30.0), 3);
        let [now, next] = [1.0, 1.0 + dt].map(|t| rain.drops(&view_at(t, 1e-3, [320, 180]), &surroundings));
        let (mut found, mut fastest) = (0, 0.0_f64);
        for drop in &now {
            let expected = drop.position + drop.velocity * dt;
            let is_same = |other: &&crate::Raindrop| {
                other.diameter_mm == drop.diameter_mm && (other.position - expected).length() < 1e-4
            };
            found += usize::from(next.iter().any(|other| is_same(&other)));
            fastest = fastest.max((drop.velocity * DVec3::new(1.0, 0.0, 1.0) - DVec3::from(velocity)).length());
        }
        // Those at the edges of the picture leave it.
        assert!(found * 100 > now.len() * 97 && now.len() > 100, "gust {gust}: {found} of {}", now.len());
        assert!(gust == 0.0 || fastest > 0.5, "{fastest}");
    }
}

#[test]
fn a_long_path_ends_where_the_drop_then_is() {
    let gusty = wind([4.0, 0.0, 0.0], 0.4);
    let surroundings = Surroundings::from_wind(&gusty);
    let rain = rain(RainParameters { distance: 3.0, ..streaks(Method::Drops, 30.0) }, 3);
    let mut view = view_at(1.0, 0.3, [320, 180]);
    view.camera_parameters.position = Animated::from([0.0, 20.0, 0.0]);
    view.camera_parameters.target = Animated::from([0.0, 20.0, -4.0]);
    let wide = CameraParameters { vertical_fov_deg: Animated::from(120.0), ..view.camera_parameters };
    let at = |open: f64, close: f64| {
        rain.drops(&View::new(wide.clone(), Shutter { open, close }, 2.0, [320, 180], 0), &surroundings)
    };
    let (long, opened, closed) = (at(1.0, 1.3), at(1.0, 1.0), at(1.3, 1.3));
    let nearest = |list: &[crate::Raindrop], point: DVec3| {
        list.iter().map(|drop| (drop.position - point).length()).fold(f64::INFINITY, f64::min)
    };
    let visible = |drop: &&crate::Raindrop| {
        let is_seen = |point: &DVec3| {
            let offset = *point - DVec3::Y * 20.0;
            offset.z < -1.0 && offset.x.abs() < 1.2 && offset.y.abs() < 1.2 && offset.length() < 3.0
        };
        drop.path.iter().all(is_seen)
    };
    let mut count = 0;
    for drop in long.iter().filter(visible) {
        let errors = [nearest(&opened, drop.path[0]), nearest(&closed, drop.path[1])];
        assert!(errors.iter().all(|error| *error < 1e-3), "{drop:?}: {errors:?}");
        count += 1;
    }
    assert!(count > 4, "{count}");
}
