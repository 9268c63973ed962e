//! What an exposure can see: the camera when the shutter opens, half way and when it closes.

use bansho_base::{
    camera::{Camera, Lens},
    canvas::View,
    math::{DVec3, sqrt},
};

/// An exposure's cameras.
#[derive(Clone, Debug)]
pub(crate) struct Sight {
    /// When the shutter opens, half way, and when it closes.
    pub(crate) cameras: [Camera; 3],
    /// How long the shutter is open, s.
    pub(crate) exposure: f64,
    /// Part of the picture that is drawn, pixels: left, top, right, bottom.
    window: [f64; 4],
}

impl Sight {
    pub(crate) fn new(view: &View) -> Self {
        let shutter = view.shutter;
        let window = view.window;
        Self {
            cameras: [view.camera_at(shutter.open), view.camera, view.camera_at(shutter.close)],
            exposure: shutter.duration(),
            window: [window.x, window.y, window.right(), window.bottom()].map(|side| side as f64),
        }
    }

    /// The camera half way.
    pub(crate) fn middle(&self) -> &Camera {
        &self.cameras[1]
    }

    /// Velocity of the camera's place while the shutter is open, m/s.
    pub(crate) fn velocity(&self) -> DVec3 {
        let way = self.cameras[2].position - self.cameras[0].position;
        if self.exposure > 0.0 { way / self.exposure } else { DVec3::ZERO }
    }

    /// Whether anything within `radius` of `point` may be seen at any time of the exposure.
    pub(crate) fn may_see(&self, point: DVec3, radius: f64) -> bool {
        self.cameras.iter().any(|camera| self.within(camera, point, radius))
    }

    fn within(&self, camera: &Camera, point: DVec3, radius: f64) -> bool {
        if camera.lens != Lens::Perspective {
            return true;
        }
        let local = camera.to_camera(point);
        let depth = -local.z;
        if depth < -radius {
            return false;
        }
        let [left, top, right, bottom] = self.window;
        let tangent = |pixels: f64| pixels / camera.focal_pixels;
        // Distance from a plane through the camera's place that holds an edge of the window; positive is outside.
        let outside = |coordinate: f64, edge: f64| (coordinate - edge * depth) / sqrt(1.0 + edge * edge) > radius;
        let (x, y) = (local.x, -local.y);
        !(outside(x, tangent(right - camera.centre.x))
            || outside(-x, -tangent(left - camera.centre.x))
            || outside(y, tangent(bottom - camera.centre.y))
            || outside(-y, -tangent(top - camera.centre.y)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bansho_base::{
        camera::CameraParameters,
        canvas::Shutter,
        math::DVec2,
        random::{Key, Purpose},
    };

    #[test]
    fn whatever_projects_into_the_picture_may_be_seen() {
        let view = View::new(CameraParameters::default(), Shutter { open: 0.0, close: 0.02 }, 0.03, [320, 180], 4);
        let sight = Sight::new(&view);
        let (mut seen, mut hidden) = (0, 0);
        for i in 0..4000 {
            let u = Key::new(1, "sight").uniforms(i, 0, Purpose::named("point")).map(f64::from);
            let point = DVec3::new(20.0 * u[0] - 10.0, 20.0 * u[1] - 10.0, 20.0 * u[2] - 10.0);
            let inside = |pixel: DVec2| {
                (0.0..view.size[0] as f64).contains(&pixel.x) && (0.0..view.size[1] as f64).contains(&pixel.y)
            };
            let projects = view.camera.project(point).is_some_and(|place| inside(place.pixel));
            assert!(!projects || sight.may_see(point, 0.0));
            seen += usize::from(projects);
            hidden += usize::from(!sight.may_see(point, 0.5));
        }
        assert!(seen > 50 && hidden > 3000, "{seen} {hidden}");
    }
}
