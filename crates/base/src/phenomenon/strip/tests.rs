//! Strips laid before and behind each other.

use super::*;
use crate::{camera::Lens, math::curve::Interpolation, parameters::animated::Animated};

#[test]
fn what_is_drawn_later_lies_behind() {
    let mut strip = Strip::default();
    strip.reset(Rect::from_size(1, 1), None, 0);
    strip.add_behind(0, [1.0; 3], [0.5; 3], 2.0);
    strip.add_behind(0, [4.0; 3], [0.25; 3], 3.0);
    assert_eq!(strip.radiance[0][0], 3.0);
    assert_eq!(strip.transmittance(0), [0.125; 3]);
    assert_eq!(strip.depth[0], 2.0);
}

#[test]
fn gray_and_colored_absorption_come_to_the_same() {
    let mut gray = Strip::default();
    gray.reset(Rect::from_size(2, 1), None, 0);
    let mut colored = gray.clone();
    colored.transmittance_planes_mut();
    for strip in [&mut gray, &mut colored] {
        strip.add_row_behind(0, [&[1.0, 2.0]; 3], Some(&[0.25, 0.5]), &[1.0, 1.0]);
        strip.add_row_behind(0, [&[4.0, 4.0]; 3], None, &[2.0, 2.0]);
    }
    assert_eq!(gray.radiance, colored.radiance);
    assert_eq!(gray.radiance[2], [4.0, 4.0]);
    assert_eq!((gray.transmittance(0), gray.transmittance(1)), ([0.75; 3], [0.5; 3]));
    gray.add_behind(1, [0.0; 3], [1.0, 0.5, 0.0], 3.0);
    assert_eq!((gray.transmittance(0), gray.transmittance(1)), ([0.75; 3], [0.5, 0.25, 0.0]));
}

#[test]
fn crossfades_mix_light_and_transmittance_and_keep_what_is_nearest() {
    let mut strip = Strip::default();
    strip.reset(Rect::from_size(1, 1), Some(&|_| &[9.0]), 2);
    let mut other = strip.empty_like();
    assert_eq!((other.rect, other.plate_depth(0), other.aovs.len()), (strip.rect, 9.0, 2));
    strip.add_behind(0, [8.0; 3], [1.0; 3], 2.0);
    strip.aovs[0].add(0, 100.0, 1.0);
    strip.aovs[1].keep_nearest(0, 5.0, 2.0);
    other.add_behind(0, [0.0, 4.0, 16.0], [0.0, 0.5, 1.0], 1.0);
    other.aovs[0].add(0, 20.0, 3.0);
    other.aovs[1].keep_nearest(0, 7.0, 1.0);
    let aov = |rule| AovDescriptor { name: "", unit: "", doc: "", rule };
    strip.crossfade(other, 0.75, &[aov(AovRule::WeightedMean), aov(AovRule::Nearest)]);
    assert_eq!(strip.radiance.map(|plane| plane[0]), [6.0, 7.0, 10.0]);
    assert_eq!((strip.transmittance[0][0], strip.transmittance[1][0], strip.depth[0]), (0.75, 0.875, 1.0));
    assert_eq!(strip.aovs[0].resolve(0, AovRule::WeightedMean), (75.0 + 15.0) / 1.5);
    assert_eq!(strip.aovs[1].resolve(0, AovRule::Nearest), 7.0);
}

#[test]
fn parts_of_an_exposure_are_averaged() {
    let mut strip = Strip::default();
    strip.reset(Rect::from_size(3, 1), Some(&|_| &[9.0, 8.0, 7.0]), 0);
    let (mut first, mut second) = (Strip::default(), Strip::default());
    first.reset_within(Rect { x: 1, y: 0, width: 2, height: 1 }, &strip);
    second.reset_within(Rect { x: 0, y: 0, width: 2, height: 1 }, &strip);
    assert_eq!((first.plate_depth(0), first.plate_depth(1), second.plate_depth(0)), (8.0, 7.0, 9.0));
    first.add_row_behind(0, [&[4.0, 8.0]; 3], Some(&[0.5, 1.0]), &[2.0, 2.0]);
    second.add_behind(1, [2.0, 4.0, 6.0], [1.0, 0.5, 0.0], 1.0);
    strip.add_exposure_part(&first, 0.5, &[]);
    strip.add_exposure_part(&second, 0.5, &[]);
    assert_eq!(strip.radiance, [vec![0.0, 3.0, 4.0], vec![0.0, 4.0, 4.0], vec![0.0, 5.0, 4.0]]);
    // What is not covered for a while transmits all light meanwhile.
    assert_eq!([0, 1, 2].map(|pixel| strip.transmittance(pixel)), [[1.0; 3], [0.75, 0.5, 0.25], [0.5; 3]]);
    assert_eq!(strip.depth, [f32::INFINITY, 1.0, 2.0]);
}

#[test]
fn the_plate_hides_what_is_not_before_it() {
    let plate = [1.0_f32, 5.0];
    let mut strip = Strip::default();
    strip.reset(Rect { x: 1, y: 0, width: 1, height: 1 }, Some(&|_| &plate), 0);
    assert!(strip.visible(0, 4.9) && !strip.visible(0, 5.0));
}

#[test]
fn weighted_means_ignore_the_order_of_samples() {
    let mut strip = Strip::default();
    strip.reset(Rect::from_size(1, 1), None, 1);
    strip.aovs[0].add(0, 1000.0, 1.0);
    strip.aovs[0].add(0, 2000.0, 3.0);
    assert_eq!(strip.aovs[0].resolve(0, AovRule::WeightedMean), 1750.0);
}

#[test]
fn a_dome_that_rolls_needs_several_instants() {
    let path = |roll: f64| {
        let keys = vec![(0.0, 0.0), (1.0, roll)];
        CameraParameters {
            lens: Lens::Fisheye,
            position: Animated::from([0.0; 3]),
            target: Animated::from([0.0, 1.0, 0.0]),
            roll_deg: Animated::keyed(keys, Interpolation::Linear).unwrap(),
            ..CameraParameters::default()
        }
    };
    let view = |roll: f64| View::new(path(roll), Shutter { open: 0.0, close: 0.1 }, 0.0, [512, 512], 0);
    // Half a degree on a circle of 256 pixels: 0.96 of the radius, 2.1 pixels by the angle in the sky.
    let rolling = view(5.0);
    assert!((rolling.motion_pixels() - 1.4).abs() < 0.1, "{}", rolling.motion_pixels());
    assert_eq!((view(0.0).cameras().len(), rolling.cameras().len()), (1, 2));
    assert_eq!(view(900.0).cameras().len(), 16);
}

#[test]
fn a_picture_in_a_mirror_is_not_measured() {
    let mut view = View::new(CameraParameters::default(), Shutter { open: 0.0, close: 0.0 }, 0.0, [8, 8], 0);
    view.aovs_requested = true;
    assert!(!view.mirrored(0.0).aovs_requested);
}

#[test]
fn a_camera_that_shakes_moves_although_it_ends_where_it_began() {
    let keys = vec![(0.0, 0.0), (0.025, 2.0), (0.075, -2.0), (0.1, 0.0)];
    let shaken = CameraParameters {
        roll_deg: Animated::keyed(keys, Interpolation::Linear).unwrap(),
        ..CameraParameters::default()
    };
    let view = View::new(shaken, Shutter { open: 0.0, close: 0.1 }, 0.0, [512, 512], 0);
    assert!(view.motion_pixels() > 10.0, "{}", view.motion_pixels());
    assert!(!view.path_cameras().is_still());
}

#[test]
fn the_path_of_a_point_is_that_of_its_image() {
    let keys = vec![(0.0, [-1.0, 1.0, 0.0]), (0.1, [1.0, 1.0, 0.0])];
    let camera = CameraParameters {
        position: Animated::from([0.0, 1.0, 10.0]),
        target: Animated::from([0.0, 1.0, 0.0]),
        ..CameraParameters::default()
    };
    let panned = CameraParameters { target: Animated::keyed(keys, Interpolation::Linear).unwrap(), ..camera.clone() };
    let path = |camera: &CameraParameters, end: f64| {
        let view = View::new(camera.clone(), Shutter { open: 0.0, close: 0.1 }, 0.0, [512, 512], 0);
        let pixels = view.path_cameras().path_pixels(|t| DVec3::new(end * (t - 0.05) / 0.1, 1.0, 0.0));
        pixels / view.camera.focal_pixels
    };
    // Radians: twice the arc tangent of a tenth.
    assert!((path(&camera, 2.0) - 0.1993).abs() < 1e-3, "{}", path(&camera, 2.0));
    assert!((path(&panned, 0.0) - 0.1993).abs() < 1e-3, "{}", path(&panned, 0.0));
    assert!(path(&panned, 2.0) < 1e-3, "what the camera follows stands still: {}", path(&panned, 2.0));
    assert_eq!([parts_of_motion(0.0, 1.0, 8), parts_of_motion(2.1, 1.0, 8), parts_of_motion(99.0, 1.0, 8)], [1, 3, 8]);
}

#[test]
fn selected_pixels_are_those_of_the_second_strip() {
    let mut strips = [Strip::default(), Strip::default()];
    for strip in &mut strips {
        strip.reset(Rect { x: 4, y: 2, width: 2, height: 2 }, None, 0);
    }
    let [first, second] = &mut strips;
    first.add_behind(1, [1.0; 3], [0.5; 3], 3.0);
    second.add_behind(3, [2.0, 3.0, 4.0], [0.1, 0.2, 0.3], 5.0);
    let mut selected = Strip::default();
    selected.select(first, second, |x, y| (x, y) == (5, 3));
    assert_eq!(selected.rect, first.rect);
    assert_eq!(selected.radiance[1], [0.0, 1.0, 0.0, 3.0]);
    assert_eq!([1, 2, 3].map(|index| selected.transmittance(index)), [[0.5; 3], [1.0; 3], [0.1, 0.2, 0.3]]);
    assert_eq!(selected.depth, [f32::INFINITY, 3.0, f32::INFINITY, 5.0]);
    selected.select(second, first, |_, _| false);
    assert_eq!(selected.transmittance(3), [0.1, 0.2, 0.3], "{selected:?}");
}

#[test]
fn long_exposures_may_have_more_parts() {
    let parts = |duration: f64| Shutter { open: 1.0, close: 1.0 + duration }.max_parts();
    assert_eq!([0.0, 1.0 / 48.0, 1.0 / 24.0, 1.0 / 16.0, 8.0].map(parts), [32, 32, 32, 128, 128]);
}
