//! Streaks follow the drops' own motion, the wind and the camera.

use super::{METHODS, Method, draw, opacity, rain, streaks, view_at, wind};
use crate::rain::{Rain, RainParameters};
use bansho_base::{animation::Animated, canvas::View, curve::Interpolation, surroundings::Surroundings};

const SIZE: [usize; 2] = [320, 180];

/// How many pixels to the right the picture's streaks go in `rows` rows downward: where rows so far apart are most alike.
fn slant(picture: &[f32], rows: usize) -> i32 {
    let alike = |shift: i32| -> f64 {
        let mut sum = 0.0;
        for y in 0..SIZE[1] - rows {
            for x in 40..SIZE[0] - 40 {
                let below = (y + rows) * SIZE[0] + (x as i32 + shift) as usize;
                sum += f64::from(picture[y * SIZE[0] + x] * picture[below]);
            }
        }
        sum
    };
    (-30..=30).max_by(|a, b| alike(*a).total_cmp(&alike(*b))).unwrap_or(0)
}

/// One diameter, so that all streaks have one slope.
fn one_size(method: Method) -> RainParameters {
    RainParameters { diameters_mm: vec![1.4], ..streaks(method, 100.0) }
}

#[test]
fn streaks_lean_with_the_wind_and_with_the_camera() {
    // 5.17 m/s down: in 8 rows a wind of w leans them by 8 w / 5.17.
    for (speed, expected) in [(0.0, 0), (2.6, 4), (-5.17, -8), (10.3, 16)] {
        for method in METHODS {
            let wind = wind([speed, 0.0, 0.0], 0.0);
            let surroundings = Surroundings::of_wind(&wind);
            let strip = draw(&rain(one_size(method), 1), &view_at(1.0, 1.0 / 30.0, SIZE), &surroundings);
            let found = slant(&opacity(&strip), 8);
            assert!((found - expected).abs() <= 1, "{method:?}, wind {speed}: {found} {expected}");
            // A camera that moves against the wind's way sees the same lean in still air.
            let calm = super::wind([0.0; 3], 0.0);
            let mut view = view_at(1.0, 1.0 / 30.0, SIZE);
            let moving = |start: [f64; 3]| {
                let at = |t: f64| [start[0] - speed * (t - 1.0), start[1], start[2]];
                Animated::keyed(vec![(0.0, at(0.0)), (2.0, at(2.0))], Interpolation::Linear).unwrap()
            };
            view.path.position = moving([0.0, 1.6, 0.0]);
            view.path.target = moving([0.0, 1.9, -4.0]);
            let view = View::new(view.path, view.shutter, 1.1, SIZE, 0);
            let strip = draw(&rain(one_size(method), 1), &view, &Surroundings::of_wind(&calm));
            let found = slant(&opacity(&strip), 8);
            assert!((found - expected).abs() <= 1, "{method:?}, camera {speed}: {found} {expected}");
        }
    }
}

#[test]
fn a_loop_closes_and_a_rate_rises_without_a_jump() {
    let gusty = wind([0.0; 3], 0.0);
    let surroundings = Surroundings::of_wind(&gusty);
    for method in METHODS {
        let rain = Rain::new(streaks(method, 20.0), "rain", 1, Some(2.0)).unwrap();
        let [first, last] = [0.3, 2.3].map(|t| opacity(&draw(&rain, &view_at(t, 1.0 / 60.0, SIZE), &surroundings)));
        let differs = first.iter().zip(&last).filter(|(a, b)| (*a - *b).abs() > 1e-5).count();
        assert!(differs < first.len() / 200, "{differs}");

        let rate = |rate: f64| {
            super::rain(
                RainParameters {
                    rate_mm_per_h: Animated::keyed(vec![(0.0, rate), (100.0, 60.0)], Interpolation::Step).unwrap(),
                    ..streaks(method, 20.0)
                },
                1,
            )
        };
        let at = |value: f64| opacity(&draw(&rate(value), &view_at(1.0, 1.0 / 60.0, SIZE), &surroundings));
        let change =
            |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f32>() / a.iter().sum::<f32>();
        let (now, little, much) = (at(20.0), at(20.2), at(40.0));
        let (small, large) = (change(&now, &little), change(&now, &much));
        assert!(small > 0.0 && small < 0.03 && large > 0.15, "{small} {large}");
        assert!(now.iter().zip(&much).filter(|(a, b)| **a > **b + 1e-4).count() < now.len() / 100, "no streak goes");
    }
}
