//! The parts of a long exposure, in each of which a streak is a straight line of even width and light.
//!
//! That is what a drop looks like in a frame of a film, but not where the shutter is open long enough for the drop to pass a lamp, or where the camera
//! turns meanwhile. So an exposure over 1/24 s, or one of a camera that moves fast, is cut into at most 16 equal parts, each with its own camera,
//! positions and light. The gain of their drops is divided by the number of parts
//! ([`ShutterState::into_part`](crate::drops::shutter_state::ShutterState::into_part)), so that the streaks of all parts, drawn as those of one frame,
//! are what the whole exposure shows.
//!
//! No paper has this. The limits were found by comparing pictures with the mean of many short exposures (`docs/src/methods/rain.md`, "Long exposures").

use bansho_base::{
    camera::Camera,
    math,
    phenomenon::strip::{Shutter, View},
};

/// Longest exposure that is drawn at once, s: a frame of a film. A drop falls up to 0.4 m in it.
const MAX_WHOLE_S: f64 = 1.0 / 24.0;
/// Longest part of a longer one, s. The light of a lamp changes along the path of a drop near it.
const MAX_PART_S: f64 = 1.0 / 48.0;
/// Largest turn of the camera within a part, radians: 2 degrees. In a roll by 6 degrees, whose streaks bend most at the corners of the picture, the whole
/// exposure then differs from the mean of short ones by 4 %; with a single part it would be 8 %.
const MAX_TURN: f64 = 0.035;
/// Largest distance that the camera moves in an exposure that is drawn at once, and within a part of another, m.
const MAX_WHOLE_TRAVEL: f64 = 1.0;
const MAX_TRAVEL: f64 = 0.1;
/// Largest change of the focal length within a part, relative.
const MAX_ZOOM: f64 = 0.1;
/// Most parts of an exposure.
const MAX_PARTS: usize = 16;

/// The views of the parts of an exposure; the view itself if it is short and its camera hardly moves.
pub(crate) fn streak_parts(view: &View) -> Vec<View> {
    let Shutter { open, close } = view.shutter;
    let count = part_count(view);
    if count == 1 {
        return vec![view.clone()];
    }
    let times: Vec<f64> = (0..=count).map(|step| open + (close - open) * (step as f64 / count as f64)).collect();
    let parts = times.windows(2).map(|ends| {
        let shutter = Shutter { open: ends[0], close: ends[1] };
        View { camera: view.camera_at(shutter.middle()), shutter, ..view.clone() }
    });
    parts.collect()
}

/// Number of equal parts of the exposure of a view.
fn part_count(view: &View) -> usize {
    let Shutter { open, close } = view.shutter;
    let times = (0..=MAX_PARTS).map(|step| open + (close - open) * (step as f64 / MAX_PARTS as f64));
    let cameras: Vec<Camera> = times.map(|t| view.camera_at(t)).collect();
    let (mut travel, mut turn, mut zoom) = (0.0, 0.0, 0.0);
    for pair in cameras.windows(2) {
        travel += (pair[0].position - pair[1].position).length();
        turn += turn_between(&pair[0], &pair[1]);
        zoom += math::ln(pair[0].focal_pixels / pair[1].focal_pixels).abs();
    }
    let (duration, turn, zoom) = (close - open, turn / MAX_TURN, zoom / MAX_ZOOM);
    // Rounding must not cut an exposure of exactly the longest duration.
    if [duration / MAX_WHOLE_S - 1e-6, travel / MAX_WHOLE_TRAVEL, turn, zoom].into_iter().all(|ratio| ratio <= 1.0) {
        return 1;
    }
    let parts = [duration / MAX_PART_S - 1e-6, travel / MAX_TRAVEL, turn, zoom];
    parts.into_iter().fold(1.0, f64::max).ceil().min(MAX_PARTS as f64) as usize
}

/// Angle between the orientations of two cameras, if it is small, radians.
fn turn_between(a: &Camera, b: &Camera) -> f64 {
    // The columns of a rotation by a small angle w about an axis n change by w n x column, whose squares sum to 2 w^2.
    let difference = a.world_from_camera - b.world_from_camera;
    math::sqrt(0.5 * (0..3).map(|column| difference.col(column).length_squared()).sum::<f64>())
}

#[cfg(test)]
mod tests {
    use bansho_base::{camera::CameraParameters, math::curve::Interpolation, parameters::animated::Animated};

    use super::*;

    fn count(exposure: f64, position: [f64; 3], turned: [f64; 3]) -> usize {
        let moving = |start: [f64; 3], end: [f64; 3]| {
            Animated::keyed(vec![(0.0, start), (1.0, end)], Interpolation::Linear).unwrap()
        };
        let camera = CameraParameters {
            position: moving([0.0; 3], position),
            target: moving([0.0, 0.0, -100.0], turned),
            ..CameraParameters::default()
        };
        let view = View::new(camera, Shutter { open: 0.0, close: exposure }, 0.1, [64, 36], 0);
        let parts = streak_parts(&view);
        for pair in parts.windows(2) {
            assert!((pair[0].shutter.close - pair[1].shutter.open).abs() < 1e-12);
        }
        let last = &parts[parts.len() - 1];
        assert!(parts[0].shutter.open == 0.0 && (last.shutter.close - exposure).abs() < 1e-12);
        assert!(parts.iter().all(|part| part.camera == view.camera_at(part.shutter.middle())));
        parts.len()
    }

    #[test]
    fn only_exposures_that_are_long_or_seen_by_a_fast_camera_have_parts() {
        let (still, ahead) = ([0.0; 3], [0.0, 0.0, -100.0]);
        assert_eq!([0.0, 1.0 / 60.0, 1.0 / 24.0].map(|exposure| count(exposure, still, ahead)), [1; 3]);
        assert_eq!([0.05, 0.32, 10.0].map(|exposure| count(exposure, still, ahead)), [3, 16, 16]);
        // 45 degrees a second: 0.94 degrees in 1/48 s. A car at 20 m/s moves 0.42 m.
        assert_eq!((count(1.0 / 48.0, still, [100.0, 0.0, 0.0]), count(1.0 / 48.0, [0.0, 0.0, -20.0], ahead)), (1, 1));
        // The line to the target passes at 20 m: 92 degrees in 1/24 s.
        assert!(count(1.0 / 24.0, [0.0, 0.0, -2400.0], [20.0, 0.0, -100.0]) == 16);
    }
}
