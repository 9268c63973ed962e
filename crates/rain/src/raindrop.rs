//! Every drop of one exposure as data: where it is, how it moves, and how opaque its streak is.

use std::{collections::BTreeMap, f64::consts::PI};

use bansho_base::{
    geometry::point_cloud::{PointCloud, Quantity},
    math::{DVec3, simd::LANES},
    phenomenon::{strip::View, surroundings::Surroundings},
};
use fearless_simd::dispatch;

use crate::{
    Rain,
    drops::{
        cell_drops::{CellDrops, DropBatch},
        classes::DropClassState,
        lattice::{CELL_SIZE, LatticeCell},
        shutter_state::ShutterState,
    },
    streaks::{
        coverage::Streak,
        project::{DropSelection, VisibleStreaks, map_cell_chunks, vector},
    },
};

/// A drop that is drawn as a streak of its own in one exposure.
///
/// Its [`velocity`](Self::velocity) is the time derivative of its [`position`](Self::position), gusts included. While the shutter is open it is drawn along the
/// straight line between the ends of its [`path`](Self::path), where it is at those times.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Raindrop {
    /// Its center at the middle of the exposure, m, world coordinates. Below the ground for a drop that has landed by then.
    pub position: DVec3,
    /// Its velocity at the middle of the exposure, m/s: terminal velocity, wind and gusts.
    pub velocity: DVec3,
    /// Its center when the shutter opens, and when it closes or the drop lands, m, world coordinates.
    pub path: [DVec3; 2],
    /// Diameter D, mm.
    pub diameter_mm: f64,
    /// Distance from the camera at the middle of the exposure, m.
    pub distance: f64,
    /// How much of the drop is drawn, 0 to 1: less than 1 while a changing rain rate fades it in or out, and from 0.9 to 1.1 times
    /// [`RainParameters::distance`](crate::RainParameters::distance), where streaks give way to the airlight of far rain.
    pub weight: f64,
    /// Fraction of the exposure before the drop lands, 0 to 1.
    pub exposed_fraction: f64,
    /// Factor of the opacity: `opacity_gain` times that of the law of opacity ([`OpacityLaw::factor`](crate::OpacityLaw::factor)). 1 by
    /// default.
    pub opacity_factor: f64,
    /// Opacity on the axis of its streak, away from its ends, seen from the side by a camera at rest: the fraction `2 r / (v T)` of the exposure during which
    /// the drop covers a point, at most 1, times `opacity_factor` and `weight`. At a distance b from the axis it is `sqrt(1 - (b / r)^2)` times as much
    /// ([`Streak::profile`](crate::streaks::coverage::Streak::profile)).
    pub opacity: f64,
}

impl Raindrop {
    /// Integral of the opacity over the area of its streak, m^2 on a plane through the drop perpendicular to the line of sight: the disc `pi r^2`, times
    /// `opacity_factor`, `weight` and `exposed_fraction`. It depends neither on the exposure nor on the direction of view.
    ///
    /// This is what the rasterizer spreads over the pixels of the streak. In a picture whose pixels are `s` m wide at the drop, the AOV `streak_opacity` sums
    /// to `blocked_area / s^2` over the drop; a perspective camera stretches spheres by the ratio of distance and depth.
    #[must_use]
    pub fn blocked_area(&self) -> f64 {
        let radius = 0.5e-3 * self.diameter_mm;
        PI * radius * radius * self.opacity_factor * self.weight * self.exposed_fraction
    }
}

impl Rain {
    /// Every drop that is drawn as a streak of its own in the exposure `view.shutter`: those whose streaks meet the window of the view, nearest cells of a
    /// cubic meter first. The order is the same with any number of threads.
    ///
    /// It is complete for `method = "drops"`: without splashes, the AOV `streak_opacity` of that method is the sum of the streaks of these drops. The other
    /// methods give the same list, since all draw the same rain; `"billboards"` draws only drops within 1 m of the camera or 1.3 m of a lamp where they are
    /// listed, and all others on billboards, and `"textures"` draws none of them where it is. Never listed are droplets of splashes, drops sheltered by a
    /// solid, and rain beyond 1.1 times [`RainParameters::distance`](crate::RainParameters::distance). Drops behind a plate are.
    ///
    /// ```
    /// use bansho_base::{
    ///     camera::CameraParameters,
    ///     phenomenon::{
    ///         strip::{Shutter, View},
    ///         surroundings::Surroundings,
    ///     },
    ///     world::wind::{Wind, WindParameters},
    /// };
    /// use bansho_rain::{Rain, RainParameters};
    ///
    /// let rain = Rain::new(RainParameters::default(), "rain", 1, None)?;
    /// let view = View::new(CameraParameters::default(), Shutter { open: 0.0, close: 1.0 / 60.0 }, 1.0 / 30.0, [320, 180], 0);
    /// let wind = Wind::new(WindParameters::default(), 1, None);
    /// let drops = rain.drops(&view, &Surroundings::from_wind(&wind));
    /// assert!(!drops.is_empty());
    /// for drop in &drops {
    ///     // A drop of 1 mm falls at 4 m/s and covers a point of its path of 67 mm for 1.5 % of 1/60 s.
    ///     assert!(drop.velocity.y < -3.0 && (0.0..0.03).contains(&drop.opacity));
    /// }
    /// # Ok::<(), bansho_base::parameters::ParameterError>(())
    /// ```
    #[must_use]
    pub fn drops(&self, view: &View, surroundings: &Surroundings) -> Vec<Raindrop> {
        let shutter_state = self.shutter_state(view, surroundings);
        let bounds = shutter_state.around_camera(1.1 * shutter_state.distance);
        let level = bansho_base::math::simd::level();
        let chunks = map_cell_chunks(&shutter_state, &[bounds], 0.5 * CELL_SIZE, |cells| {
            let mut drops = Vec::new();
            for (visible, class) in cells {
                dispatch!(level, _simd => add_cell(&shutter_state, class, visible.cell, &mut drops));
            }
            drops
        });
        chunks.concat()
    }
}

/// Adds the visible drops of a cell.
#[inline(always)]
fn add_cell(shutter_state: &ShutterState, class: &DropClassState, cell: LatticeCell, drops: &mut Vec<Raindrop>) {
    let of_cell = CellDrops::new(shutter_state, class, cell);
    for first in (0..of_cell.count()).step_by(LANES) {
        let batch = of_cell.batch(first);
        let streaks = DropSelection::All.visible_streaks(shutter_state, &batch);
        if streaks.any() {
            let visible = (0..LANES).filter(|i| streaks.is_seen(*i, &shutter_state.cameras));
            drops.extend(visible.map(|i| raindrop(shutter_state, &batch, &streaks, i)));
        }
    }
}

/// The drop of one lane.
fn raindrop(shutter_state: &ShutterState, batch: &DropBatch, streaks: &VisibleStreaks, i: usize) -> Raindrop {
    let eye = shutter_state.cameras.middle().position;
    let (offset, velocity) = (vector(&batch.positions, i), vector(&batch.velocities, i));
    let [diameter_mm, opacity_factor] = [batch.diameter_mm, batch.opacity_factor].map(f64::from);
    let weight = f64::from(streaks.weights[i]);
    let streak = Streak::new(diameter_mm, velocity.length(), shutter_state.cameras.exposure_time);
    Raindrop {
        position: eye + offset,
        velocity,
        path: [&streaks.paths.from, &streaks.paths.to].map(|ends| eye + vector(ends, i)),
        diameter_mm,
        distance: offset.length(),
        weight,
        // Visible drops have a weight and a factor above 0.
        exposed_fraction: (f64::from(streaks.paths.gain[i]) / (weight * opacity_factor)).min(1.0),
        opacity_factor,
        opacity: weight * opacity_factor * streak.profile(0.0),
    }
}

/// Drops as points for export.
pub(crate) fn point_cloud(drops: &[Raindrop], origin: [f64; 3]) -> PointCloud {
    let quantities = BTreeMap::from([
        (Quantity::DiameterMm, drops.iter().map(|drop| drop.diameter_mm as f32).collect()),
        (Quantity::Opacity, drops.iter().map(|drop| drop.opacity as f32).collect()),
    ]);
    let velocities = drops.iter().map(|drop| drop.velocity.as_vec3().to_array()).collect();
    PointCloud::new(origin, drops.iter().map(|drop| drop.position.to_array()), velocities, quantities)
}
