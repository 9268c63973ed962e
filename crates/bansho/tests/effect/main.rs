//! Effects that programs embed: time, live changes, pixels, data, errors.

mod changes;
mod description;
mod time;
mod wind;

use bansho::{FlameSheetParameters, LiveEffect};

const SIZE: usize = 48;

fn torch() -> FlameSheetParameters {
    FlameSheetParameters { width: 0.4, height: 0.8, ..Default::default() }
}

fn light_of(live: &mut LiveEffect, dt: f64) -> Vec<f32> {
    let picture = live.advance(dt).unwrap();
    picture.frame().beauty.pixels().iter().flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect()
}

/// Sum of the differences of two pictures, relative to the mean sum of their values.
fn movement(a: &[f32], b: &[f32]) -> f64 {
    let sum = |values: &[f32]| values.iter().map(|value| f64::from(*value)).sum::<f64>();
    let difference: f64 = a.iter().zip(b).map(|(a, b)| f64::from((a - b).abs())).sum();
    2.0 * difference / (sum(a) + sum(b))
}

fn assert_send_and_sync<T: Send + Sync>(_: &T) {}

/// The wind of a game: it changes a little every frame.
fn game_wind(frame: u32) -> [f64; 3] {
    let t = f64::from(frame) / 60.0;
    [
        0.5 + 0.3 * bansho::base::math::sin(0.9 * t) + 0.02 * f64::from(frame % 3),
        0.0,
        0.2 * bansho::base::math::cos(0.7 * t),
    ]
}

/// Horizontal center of light of a picture, in pixels from the left.
fn center(light: &[f32]) -> f64 {
    let sum: f64 = light.iter().map(|value| f64::from(*value)).sum();
    let moment = |(index, value): (usize, &f32)| (index / 3 % SIZE) as f64 * f64::from(*value);
    light.iter().enumerate().map(moment).sum::<f64>() / sum
}
