//! Opacity of the streak that a falling drop leaves in one exposure.
//!
//! The paper's opacity comes from S. Starik and M. Werman, "Simulation of rain in videos" (2002), and K. Garg and S. K.
//! Nayar, "Vision and rain" (2007): the fraction of the exposure during which the drop covers a point.

use std::f64::consts::PI;

use bansho_base::math;

use crate::parameters::OpacityLaw;

/// The paper's opacity of a streak, `2 D / v`, at most 1.
///
/// The paper gives no units. D in mm is its unit in (1), and v in m/s that of (2); 0.5 at 1 mm is also what 8 bits can hold. In meters it would be 0.0005, less
/// than an 8-bit code.
pub fn paper_opacity(diameter_mm: f64, speed: f64) -> f64 {
    (2.0 * diameter_mm / speed.max(f64::MIN_POSITIVE)).min(1.0)
}

impl OpacityLaw {
    /// Factor of the opacity of the streak of a drop by this law, relative to the fraction of the exposure. The paper's streaks are opaque alike over their
    /// width D, so the factor is that of the whole blocked area.
    pub fn factor(self, diameter_mm: f64, speed: f64, exposure: f64) -> f64 {
        match self {
            Self::ExposureFraction => 1.0,
            Self::Paper => {
                let streak = Streak::new(diameter_mm, speed, exposure);
                2.0 * streak.radius * streak.length * paper_opacity(diameter_mm, speed) / streak.blocked_area()
            }
        }
    }
}

/// The streak of a spherical drop that moves in a straight line at constant speed during the exposure.
///
/// `b` is the distance from its axis; `s` is the position along it, from the drop's center when the shutter opens (0)
/// to its center when it closes (`length`). All in m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Streak {
    /// Radius of the drop r, m.
    pub radius: f64,
    /// Distance that it moves, `v T`, m; more than 0.
    pub length: f64,
}

impl Streak {
    /// The streak of a drop of diameter D that falls with `speed` (m/s) through an exposure (s).
    pub fn new(diameter_mm: f64, speed: f64, exposure: f64) -> Self {
        // The minimum length avoids a division by zero for a drop at rest, which covers the same points for the whole
        // exposure.
        Self { radius: 0.5e-3 * diameter_mm, length: (speed * exposure).max(1e-12) }
    }

    /// Half the drop's chord at distance `b` from the axis, m.
    fn half_chord(&self, b: f64) -> f64 {
        math::sqrt((self.radius * self.radius - b * b).max(0.0))
    }

    /// Opacity at a point: the fraction of the exposure during which the drop covers it. 1 where the drop moves less
    /// than its chord.
    pub fn opacity(&self, b: f64, s: f64) -> f64 {
        let chord = self.half_chord(b);
        (s.clamp(-chord, chord) + (self.length - s).clamp(-chord, chord)) / self.length
    }

    /// Opacity at distance `b` from the axis, away from the ends: `2 sqrt(r^2 - b^2) / (v T)`, at most 1.
    pub fn profile(&self, b: f64) -> f64 {
        (2.0 * self.half_chord(b) / self.length).min(1.0)
    }

    /// Mean opacity across the streak, `(pi/4) D / (v T)`, if it is longer than wide.
    pub fn mean_opacity(&self) -> f64 {
        0.5 * PI * self.radius / self.length
    }

    /// Integral of the opacity over the streak: `pi D^2 / 4`, m^2, for any exposure.
    pub fn blocked_area(&self) -> f64 {
        PI * self.radius * self.radius
    }

    /// Fraction of the blocked area at distances from the axis below `b`: a cumulative distribution.
    pub(crate) fn area_fraction_across(&self, b: f64) -> f64 {
        let u = (b / self.radius).clamp(-1.0, 1.0);
        0.5 + (math::asin(u) + u * math::sqrt(1.0 - u * u)) / PI
    }

    /// Fraction of the blocked area before `s` along the path: a cumulative distribution.
    pub(crate) fn area_fraction_along(&self, s: f64) -> f64 {
        // The disc at any one time has the fraction `area_fraction_across(s - s_drop)` before s; this is its mean over
        // the path.
        let fraction = self.radius / self.length
            * (disc_integral(s / self.radius) - disc_integral((s - self.length) / self.radius));
        fraction.clamp(0.0, 1.0)
    }

    /// Integral of [`opacity`](Self::opacity) over the width from the streak's edge to `b`, at `s`; m.
    pub(crate) fn opacity_integral_to(&self, b: f64, s: f64) -> f64 {
        (self.clamped_until(b, s) + self.clamped_until(b, self.length - s)) / self.length
    }

    /// Whether the opacity at `s` equals the profile: away from the ends.
    pub fn is_within(&self, s: f64) -> bool {
        s >= self.radius && self.length - s >= self.radius
    }

    /// Integral of `clamp(s, -chord, chord)` from the streak's edge to `b`, m^2.
    fn clamped_until(&self, b: f64, s: f64) -> f64 {
        // Within +-w the half chord exceeds |s| and the integrand is s; outside it is the half chord.
        let w = self.half_chord(s);
        let b = b.clamp(-self.radius, self.radius);
        let area = 0.5 * self.blocked_area();
        // Integrals of the half chord from the streak's edge: before the middle part, up to `b` behind it, and up to its end.
        let [before, behind, end] = [b.min(-w), b.max(w), w].map(|b| area * self.area_fraction_across(b));
        let outside = before + (behind - end);
        let inside = s.abs() * (b.clamp(-w, w) + w);
        if s < 0.0 { -(outside + inside) } else { outside + inside }
    }
}

/// Integral from -1 to `x` of the fraction of a unit disc's area before a line.
fn disc_integral(x: f64) -> f64 {
    if x <= -1.0 {
        return 0.0;
    }
    if x >= 1.0 {
        return x;
    }
    let chord = math::sqrt(1.0 - x * x);
    0.5 * x + (x * math::asin(x) + chord - chord * chord * chord / 3.0) / PI
}

#[cfg(test)]
mod tests {
    use bansho_base::assert_measured;

    use super::*;
    use crate::{
        VelocityLaw,
        billboards::texture::StreakCube,
        drops::terminal_velocity::TerminalVelocity,
        tests::reference::{fields, near},
    };

    /// Streaks of the reference table with its exposure share and its mean over the streak's box, which take a square drop.
    fn references() -> Vec<(Streak, f64, f64)> {
        let row = |line: &str| {
            let [diameter, _, speed, exposure, _, fraction, length, aspect, mean] =
                fields::<9>(line).map(|field| field.parse::<f64>().unwrap_or(f64::NAN));
            let streak = Streak::new(diameter, speed, exposure);
            assert!(near(streak.length, 1e-3 * length, 1e-3), "{line}");
            assert!(near(streak.length + 2.0 * streak.radius, aspect * 2.0 * streak.radius, 1e-3), "{line}");
            (streak, fraction, mean)
        };
        include_str!("../../data/streak_opacity.csv").lines().skip(1).map(row).collect()
    }

    #[test]
    fn opacities_are_the_reference_shares_of_exposure() {
        for (streak, fraction, mean) in references() {
            assert!(near(streak.profile(0.0), fraction, 1e-3), "{streak:?}");
            assert!(near(streak.opacity(0.0, 0.5 * streak.length), fraction, 1e-3));
            // A disc fills pi/4 of the square that the table takes.
            assert!(near(streak.mean_opacity(), 0.25 * PI * fraction, 1e-3));
            let area = 2.0 * streak.radius * (streak.length + 2.0 * streak.radius);
            assert!(near(streak.blocked_area() / area, 0.25 * PI * mean, 1e-3));
        }
    }

    #[test]
    fn the_papers_opacity_is_sixty_seven_times_the_fraction_of_a_thirtieth() {
        for (diameter, speed, expected) in [(1.0, 4.03, 0.4963), (1.4, 5.17, 0.5416), (2.0, 6.49, 0.6163)] {
            assert!(near(paper_opacity(diameter, speed), expected, 1e-3), "{diameter} mm");
            // 2 D / v with D in mm over D / (v T) with D in m is 2000 T.
            let ratio = paper_opacity(diameter, speed) / Streak::new(diameter, speed, 1.0 / 30.0).profile(0.0);
            assert!(near(ratio, 2000.0 / 30.0, 1e-9), "{diameter} mm: {ratio}");
            // Averaged across the streak, a disc is pi/4 of its width.
            let factor = OpacityLaw::Paper.factor(diameter, speed, 1.0 / 30.0);
            assert!(near(factor, 2000.0 / 30.0 * 4.0 / PI, 1e-9), "{diameter} mm: {factor}");
            assert_measured!("section 4: opacity: over the fraction of 1/30 s", ratio, 66.7, 0.05);
        }
        let law = TerminalVelocity { law: VelocityLaw::RigidSphere, ..TerminalVelocity::default() };
        let [thin, thick] = [1.0, 2.0].map(|diameter| paper_opacity(diameter, law.speed(diameter)));
        assert_measured!("section 4: opacity: at 1 mm by the rigid sphere", thin, 0.516, 5e-4);
        assert_measured!("opacity at 2 mm by the rigid sphere", thick, 0.61, 0.005);
        // Summed over the width of the streak: a line of the paper is a pixel of the texture wide, whatever D.
        let pixel = StreakCube::default().pixel();
        let summed = |diameter: f64| {
            let speed = law.speed(diameter);
            let physical = Streak::new(diameter, speed, 1.0 / 30.0).mean_opacity() * 1e-3 * diameter;
            paper_opacity(diameter, speed) * pixel / physical
        };
        assert_measured!("width of a line, mm", 1e3 * pixel, 1.95, 0.005);
        assert_measured!("opacity summed over the width, of a physical streak of 1 mm", summed(1.0), 166.0, 0.5);
        assert_measured!("opacity summed over the width, of a physical streak of 2 mm", summed(2.0), 83.0, 0.5);
        // A fast exposure changes the fraction, not the paper's number.
        assert!(near(OpacityLaw::Paper.factor(1.0, 4.03, 1e-3), 2.0 * 4.0 / PI, 1e-9));
        assert_eq!((paper_opacity(3.0, 1.0), OpacityLaw::ExposureFraction.factor(1.0, 4.03, 0.01)), (1.0, 1.0));
    }

    #[test]
    fn a_millimeter_in_a_thirtieth_blocks_seven_thousandths() {
        let streak = Streak::new(1.0, 4.03, 1.0 / 30.0);
        assert!(near(streak.profile(0.0), 1e-3 / 0.134333, 1e-5));
        assert!(near(streak.mean_opacity(), 0.0058466, 1e-4));
        // At half the radius the chord is sqrt(3)/2 of the diameter.
        assert!(near(streak.profile(0.25e-3), 0.0074442 * 0.866025, 1e-4));
    }

    /// Opacity summed over a fine lattice, m^2.
    fn summed(streak: &Streak) -> f64 {
        const STEPS: usize = 400;
        let (width, long) = (2.0 * streak.radius, streak.length + 2.0 * streak.radius);
        let at = |i: usize| (i as f64 + 0.5) / STEPS as f64;
        let row = |j: usize| -> f64 {
            let s = at(j) * long - streak.radius;
            (0..STEPS).map(|i| streak.opacity(at(i) * width - streak.radius, s)).sum()
        };
        (0..STEPS).map(row).sum::<f64>() * width * long / (STEPS * STEPS) as f64
    }

    #[test]
    fn the_blocked_area_is_the_drops_disc_whatever_the_shutter() {
        for exposure in [1e-5, 1e-4, 2.5e-4, 1e-3, 1.0 / 30.0, 1.0] {
            let streak = Streak::new(2.0, 6.49, exposure);
            assert!(near(summed(&streak), PI * 1e-6, 2e-3), "{exposure} s: {}", summed(&streak));
            assert!(streak.opacity(0.0, 0.5 * streak.length) <= 1.0);
        }
        // A drop that hangs still is seen as a drop.
        let still = Streak::new(2.0, 0.0, 1.0);
        assert_eq!((still.profile(0.9e-3), still.opacity(0.0, 0.0)), (1.0, 1.0));
        assert!(near(still.area_fraction_along(0.0), 0.5, 1e-3));
    }

    #[test]
    fn integrals_agree_with_sums_of_opacity() {
        for length in [0.3e-3, 1.5e-3, 20e-3] {
            let streak = Streak { radius: 1e-3, length };
            for s in [-0.8e-3, -0.2e-3, 0.1e-3, 0.4 * length, 0.95 * length, length + 0.5e-3] {
                for b in [-0.9e-3, -0.3e-3, 0.0, 0.55e-3, 1e-3, 3e-3] {
                    let steps = 4000;
                    let step = (b + 1e-3) / steps as f64;
                    let sum: f64 = (0..steps).map(|i| streak.opacity(-1e-3 + step * (i as f64 + 0.5), s)).sum();
                    let found = streak.opacity_integral_to(b, s);
                    assert!((found - sum * step).abs() < 1e-7, "{length} {s} {b}: {found} {}", sum * step);
                }
            }
        }
    }

    #[test]
    fn shares_run_from_nothing_to_all() {
        let streak = Streak { radius: 1e-3, length: 5e-3 };
        assert_eq!(
            (streak.area_fraction_across(-2e-3), streak.area_fraction_across(0.0), streak.area_fraction_across(1e-3)),
            (0.0, 0.5, 1.0)
        );
        assert_eq!((streak.area_fraction_along(-1e-3), streak.area_fraction_along(6e-3)), (0.0, 1.0));
        assert!(near(streak.area_fraction_along(2.5e-3), 0.5, 1e-12));
        // Within, each length holds its share of 1/length: 1 mm of 5.
        assert!(near(streak.area_fraction_along(3e-3) - streak.area_fraction_along(2e-3), 0.2, 1e-12));
        assert!(streak.is_within(1e-3) && !streak.is_within(0.9e-3) && !streak.is_within(4.1e-3));
    }
}
