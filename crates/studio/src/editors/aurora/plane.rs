//! A map of the plane at 100 km altitude: north is up, the point below the zenith in the center.

use bansho::base::math::DVec2;
use eframe::egui::{Pos2, Rect, Vec2, vec2};

/// Which of the two maps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Source,
    Target,
}

/// A square map on the screen.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    pub(super) rect: Rect,
    pub(super) extent_km: f64,
}

impl Plane {
    pub(super) fn new(rect: Rect, extent_km: f64) -> Self {
        Self { rect, extent_km }
    }

    /// Points of the screen per kilometer.
    fn scale(&self) -> f64 {
        f64::from(self.rect.width()) / self.extent_km
    }

    /// `points` of the screen in kilometers.
    pub(super) fn km(&self, points: f32) -> f64 {
        f64::from(points) / self.scale()
    }

    pub(super) fn to_screen(self, point: DVec2) -> Pos2 {
        let offset = point * self.scale();
        self.rect.center() + vec2(offset.x as f32, offset.y as f32)
    }

    pub(super) fn to_plane(self, at: Pos2) -> DVec2 {
        let Vec2 { x, y } = at - self.rect.center();
        DVec2::new(f64::from(x), f64::from(y)) / self.scale()
    }

    pub(super) fn line(&self, line: &[DVec2]) -> Vec<Pos2> {
        line.iter().map(|&point| self.to_screen(point)).collect()
    }
}
