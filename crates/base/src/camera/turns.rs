//! Sudden turns of the picture: where a camera looks along its `up`, and nothing says any more what is at the top.

use glam::{DMat3, DQuat, DVec3};

use super::{CameraParameters, look_at};
use crate::math;

/// A turn of the picture about the line of sight that nobody asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SuddenTurn {
    /// When it is fastest, s.
    pub time: f64,
    /// Index of the frame after which it happens.
    pub after_frame: usize,
    /// Angle from that frame to the next, or over several frames if it goes on, degrees.
    pub degrees: f64,
    /// A constant `up` with which the whole shot has no sudden turn, if one was found.
    pub better_up: Option<[f64; 3]>,
}

/// Angle from one frame to the next from which on a turn is sudden, degrees. Panning a horizontal camera turns nothing; passing the zenith at a distance of a
/// few degrees turns the picture within several frames.
const SUDDEN_DEG: f64 = 30.0;
/// Largest number of frames that are examined; of longer shots every n-th.
const MAX_FRAMES: usize = 100_000;
/// Largest number of turns that are listed.
const MAX_TURNS: usize = 100;

/// The sudden turns between the frames of a shot, whose exposures have their middle at `first` + i `frame_s` (s), for i below `frames`. Keyed `roll_deg` and cuts
/// are meant, and not among them.
#[must_use]
pub fn sudden_turns(camera: &CameraParameters, first: f64, frame_s: f64, frames: usize) -> Vec<SuddenTurn> {
    let is_still = [&camera.position, &camera.target, &camera.up].iter().all(|vector| vector.constant().is_some());
    if is_still || frames < 2 {
        return Vec::new();
    }
    let stride = frames.div_ceil(MAX_FRAMES);
    let step = frame_s * stride as f64;
    let mut turns: Vec<SuddenTurn> = Vec::new();
    let mut last_sudden = usize::MAX - 1;
    let mut before = orientation(camera, first);
    for index in 1..frames.div_ceil(stride) {
        let (from, to) = (first + (index - 1) as f64 * step, first + index as f64 * step);
        let after = orientation(camera, to);
        if turn_deg(&before, &after).abs() > SUDDEN_DEG {
            // Only on the way within one side of a cut.
            let held = camera.of_exposure(from, frame_s);
            let degrees = turn_deg(&orientation(&held, from), &orientation(&held, to));
            let is_continued = last_sudden + 1 == index;
            match turns.last_mut() {
                _ if degrees.abs() <= SUDDEN_DEG => {}
                // The line of sight was along `up` in the frame between.
                Some(turn) if is_continued => turn.degrees += degrees,
                _ => {
                    let time = fastest_turn(&held, from, to);
                    turns.push(SuddenTurn { time, after_frame: (index - 1) * stride, degrees, better_up: None });
                }
            }
            if degrees.abs() > SUDDEN_DEG {
                last_sudden = index;
            }
        }
        before = after;
        if turns.len() == MAX_TURNS {
            break;
        }
    }
    turns.iter_mut().for_each(|turn| turn.degrees = turn.degrees.abs());
    if let Some(turn) = turns.first_mut() {
        let from = first + turn.after_frame as f64 * frame_s;
        turn.better_up = better_up(camera, [from, from + step], first, step, frames.div_ceil(stride));
    }
    turns
}

/// Orientation without roll.
fn orientation(camera: &CameraParameters, t: f64) -> DMat3 {
    let [position, target, up] = [&camera.position, &camera.target, &camera.up].map(|vector| DVec3::from(vector.at(t)));
    look_at(position, target, up, 0.0)
}

/// Angle by which the picture turns about the line of sight from one orientation to another, beyond the shortest rotation that moves the line of sight, degrees.
fn turn_deg(before: &DMat3, after: &DMat3) -> f64 {
    let (from, to) = (before.z_axis, after.z_axis);
    if from.dot(to) < -0.9 {
        // The camera looks back: it went through its target, and no rotation is the shortest.
        return 0.0;
    }
    let carried = DQuat::from_rotation_arc(from, to) * before.x_axis;
    math::atan2(carried.dot(after.y_axis), carried.dot(after.x_axis)).to_degrees()
}

/// The time between `from` and `to` at which the picture turns fastest, by bisection.
fn fastest_turn(camera: &CameraParameters, mut from: f64, mut to: f64) -> f64 {
    for _ in 0..40 {
        let middle = 0.5 * (from + to);
        let [start, halfway, end] = [from, middle, to].map(|t| orientation(camera, t));
        if turn_deg(&start, &halfway).abs() > turn_deg(&halfway, &end).abs() {
            to = middle;
        } else {
            from = middle;
        }
    }
    0.5 * (from + to)
}

/// A constant `up` without sudden turns, along the horizontal direction in which the line of sight moves from one time to another. Of the two, the one with which
/// more of the shot, and first its beginning, has the same picture as before.
fn better_up(camera: &CameraParameters, turn: [f64; 2], first: f64, step: f64, count: usize) -> Option<[f64; 3]> {
    let [before, after] = turn.map(|t| orientation(camera, t).z_axis);
    let across = DVec3::new(after.x - before.x, 0.0, after.z - before.z).try_normalize()?;
    let rounded = (across * 100.0).round() / 100.0;
    let candidates = [rounded, -rounded].map(|up| {
        let changed = CameraParameters { up: (up + DVec3::ZERO).to_array().into(), ..camera.clone() };
        let mut score = 0.0;
        let mut last: Option<DMat3> = None;
        for index in 0..count {
            let t = first + index as f64 * step;
            let own = orientation(&changed, t);
            if last.is_some_and(|last| turn_deg(&last, &own).abs() > SUDDEN_DEG) {
                return None;
            }
            let is_same = own.y_axis.dot(orientation(camera, t).y_axis) > 0.99;
            score += f64::from(u8::from(is_same)) * (2.0 - index as f64 / count as f64);
            last = Some(own);
        }
        Some((score, up + DVec3::ZERO))
    });
    let best = candidates.into_iter().flatten().reduce(|best, other| if other.0 > best.0 { other } else { best });
    best.map(|(_, up)| up.to_array())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{camera::Lens, math::curve::Interpolation, parameters::animated::Animated};

    fn moving(keys: [(f64, [f64; 3]); 2]) -> Animated<[f64; 3]> {
        Animated::keyed(keys.to_vec(), Interpolation::Linear).unwrap()
    }

    /// A dome that tilts from straight up to 45 degrees in the north.
    fn dome() -> CameraParameters {
        CameraParameters {
            position: [0.0; 3].into(),
            target: moving([(0.0, [0.0, 60.0, 0.0]), (2.0, [0.0, 60.0, -60.0])]),
            lens: Lens::Fisheye,
            ..CameraParameters::default()
        }
    }

    /// A camera that flies over its target, which it passes at 1 s.
    fn drone() -> CameraParameters {
        CameraParameters {
            position: moving([(0.0, [-3.0, 10.0, 4.0]), (2.0, [3.0, 10.0, -4.0])]),
            target: [0.0; 3].into(),
            ..CameraParameters::default()
        }
    }

    #[test]
    fn a_dome_that_leaves_the_zenith_and_a_flight_over_the_target_turn_the_picture() {
        let turns = sudden_turns(&dome(), 0.0, 1.0 / 30.0, 61);
        assert_eq!((turns.len(), turns[0].after_frame, turns[0].better_up), (1, 0, Some([0.0, 0.0, 1.0])));
        assert!((turns[0].degrees - 180.0).abs() < 1e-6 && turns[0].time < 0.004, "{turns:?}");
        for first in [0.0, 0.007] {
            let turns = sudden_turns(&drone(), first, 1.0 / 24.0, 48);
            assert_eq!(turns.len(), 1);
            assert!((turns[0].time - 1.0).abs() < 5e-3 && turns[0].degrees > 170.0, "{turns:?}");
            assert_eq!(turns[0].better_up, Some([0.6, 0.0, -0.8]), "what was at the top at the beginning stays there");
        }
    }

    #[test]
    fn the_up_that_is_proposed_turns_continuously() {
        for camera in [dome(), drone()] {
            let better = sudden_turns(&camera, 0.0, 1.0 / 30.0, 61)[0].better_up.unwrap();
            let steady = CameraParameters { up: better.into(), ..camera };
            assert_eq!(sudden_turns(&steady, 0.0, 1.0 / 30.0, 61), []);
            for index in 0..600 {
                let [before, after] =
                    [index, index + 1].map(|i| steady.at(f64::from(i) / 300.0, [64, 64]).world_from_camera);
                let moved = (0..3).map(|axis| (before.col(axis) - after.col(axis)).length()).fold(0.0, f64::max);
                assert!(moved < 0.01, "{index}: {moved}");
            }
        }
    }

    #[test]
    fn pans_rolls_and_cuts_are_no_sudden_turns() {
        let pan = CameraParameters {
            target: moving([(0.0, [-50.0, 3.0, 0.0]), (0.5, [50.0, -3.0, 0.0])]),
            roll_deg: Animated::keyed(vec![(0.0, 0.0), (0.1, 360.0)], Interpolation::Linear).unwrap(),
            ..CameraParameters::default()
        };
        assert_eq!(sudden_turns(&pan, 0.0, 1.0 / 30.0, 30), []);
        let places = vec![(0.0, [0.0, 9.0, 0.1]), (1.0, [0.0, 9.0, -0.1])];
        let cut = Animated::keyed(places, Interpolation::Step).unwrap();
        let cut = CameraParameters { position: cut, target: [0.0; 3].into(), ..CameraParameters::default() };
        assert_eq!(sudden_turns(&cut, 0.0, 1.0 / 30.0, 60), []);
    }
}
