//! How long a step may be.

/// Share of the time in which sound and the fastest particle cross half the support radius.
const COURANT_NUMBER: f32 = 0.4;

/// Longest stable step, s (Courant, Friedrichs and Lewy 1928; Monaghan 1992).
///
/// The speed of sound of `p = k (rho - rho_0)` is `sqrt(k)`, with k the greatest `stiffness`; speeds are relative to the gas around.
#[must_use]
pub fn max_stable_step(support_radius: f32, stiffness: f32, greatest_speed: f32) -> f32 {
    COURANT_NUMBER * 0.5 * support_radius / (stiffness.max(0.0).sqrt() + greatest_speed)
}

/// Into how many equal parts to cut `seconds` so that none is longer than `max_step`; at least 1, at most `limit`.
#[must_use]
pub fn substep_count(seconds: f32, max_step: f32, limit: u32) -> u32 {
    let steps = (seconds / max_step).ceil();
    // A comparison that also sends what is not a number to the limit.
    if steps < limit as f32 { (steps as u32).max(1) } else { limit.max(1) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_shrink_with_sound_and_speed() {
        // Half of 0.2 m at 3 + 2 m/s: 0.4 * 0.1 / 5.
        assert!((max_stable_step(0.2, 9.0, 2.0) - 0.008).abs() < 1e-9);
        assert_eq!(max_stable_step(0.2, 0.0, 0.0), f32::INFINITY);
    }

    #[test]
    fn parts_are_as_few_as_allowed() {
        assert_eq!(substep_count(0.01, 0.004, 10), 3);
        assert_eq!(substep_count(0.01, f32::INFINITY, 10), 1);
        assert_eq!(substep_count(0.01, 1e-9, 10), 10);
        assert_eq!(substep_count(0.01, f32::NAN, 10), 10);
    }
}
