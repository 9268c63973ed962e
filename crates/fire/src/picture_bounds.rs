//! Where in a picture something in a box appears, for estimates of memory.

use bansho_base::{
    image::Rect,
    math::{DVec2, DVec3},
    phenomenon::strip::View,
};

/// A rectangle of the window of `view` that contains the boxes with these lowest and highest corners, m, about: with a fisheye or panorama their edges are
/// curved. The whole window where a corner is not in front of the camera.
pub(crate) fn of_boxes(view: &View, boxes: impl IntoIterator<Item = [DVec3; 2]>) -> Rect {
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for [lowest, highest] in boxes {
        for corner in 0..8 {
            let point = [0, 1, 2].map(|axis| if corner >> axis & 1 == 1 { highest[axis] } else { lowest[axis] });
            let Some(projection) = view.camera.project_beyond_circle(point.into()) else { return view.window };
            (low, high) = (low.min(projection.pixel), high.max(projection.pixel));
        }
    }
    if low.cmpgt(high).any() {
        return Rect::default();
    }
    let [x, y] = low.to_array().map(|side| side.max(0.0) as usize);
    let [right, bottom] = high.to_array().map(|side| side.max(0.0).ceil() as usize);
    let within = Rect { x, y, width: right.saturating_sub(x), height: bottom.saturating_sub(y) };
    within.intersection(&view.window)
}

#[cfg(test)]
mod tests {
    use bansho_base::{camera::CameraParameters, parameters::animated::Animated, phenomenon::strip::Shutter};

    use super::*;

    /// A view along -z from 2 m, with a field of 90 degrees: 100 pixels at a distance of 1 m are 1 m.
    fn view() -> View {
        let camera = CameraParameters {
            position: Animated::from([0.0, 0.0, 2.0]),
            target: Animated::from([0.0, 0.0, 0.0]),
            vertical_fov_deg: Animated::from(90.0),
            ..CameraParameters::default()
        };
        View::new(camera, Shutter { open: 0.0, close: 0.01 }, 0.05, [400, 200], 0)
    }

    #[test]
    fn a_box_is_where_its_nearest_side_is_seen() {
        // From -0.5 m to 0.5 m, 1 m before the camera.
        let near = [DVec3::new(-0.5, -0.5, 0.0), DVec3::new(0.5, 0.25, 1.0)];
        let expected = Rect { x: 150, y: 75, width: 100, height: 75 };
        assert_eq!(of_boxes(&view(), [near]), expected);
        // Beside the picture, and behind the camera.
        let beside = [DVec3::new(7.0, 0.0, 0.0), DVec3::new(8.0, 0.5, 0.5)];
        assert!(of_boxes(&view(), [beside]).is_empty());
        assert!(of_boxes(&view(), []).is_empty());
        let behind = [DVec3::new(-0.5, 0.0, 0.0), DVec3::new(0.5, 0.5, 3.0)];
        assert_eq!(of_boxes(&view(), [near, behind]), Rect::from_size(400, 200));
    }
}
