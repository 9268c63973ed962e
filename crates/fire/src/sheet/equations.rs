//! The paper's equations for one point, one function each, numbered as in Ohshima and Itahashi.
//!
//! Values of the user's curves are arguments, so that the same functions serve SIMD batches with curve tables and tests with numbers
//! computed by hand. No function branches on data; the only elementary function is the square root.

pub use bansho_base::math::simd::Real;

/// Rise `w_p = (1-k) sqrt(y) + k y`, eq. (9); `y` in [0, 1].
#[inline(always)]
pub fn rise<N: Real>(y: N, initial_speed: f32) -> N {
    y.broadcast(1.0 - initial_speed).fma(y.simd_sqrt(), y * y.broadcast(initial_speed))
}

/// Distance from the axis `x' = 2 |x - 1/2|`, eq. (10): 0 on the axis, 1 at the sheet's edge; also eqs. (13) and (17).
#[inline(always)]
pub fn axis_distance<N: Real>(x: N) -> N {
    (x.broadcast(2.0) * (x - x.broadcast(0.5))).simd_abs()
}

/// Position within the fringe, `(x' - A) / D` of eq. (11), clamped to [0, 1].
///
/// Where the fringe has zero width it is 0 up to `A` and 1 beyond, without a division by zero.
#[inline(always)]
pub fn fringe_position<N: Real>(distance: N, core_width: N, fringe_width: N) -> N {
    const MIN_FRINGE_WIDTH: f32 = 1e-6;
    ((distance - core_width) / fringe_width.simd_max(distance.broadcast(MIN_FRINGE_WIDTH))).simd_clamp01()
}

/// Speed profile `K = h + (1-h) F`, eq. (11), from `falloff` = F((x'-A)/D).
///
/// F(0) = 1 gives K = 1 in the core and F(1) = 0 gives K = h beyond the fringe, where the paper leaves K open.
#[inline(always)]
pub fn speed_profile<N: Real>(falloff: N, edge_speed: f32) -> N {
    falloff.broadcast(1.0 - edge_speed).fma(falloff, falloff.broadcast(edge_speed))
}

/// Slowed rise `w = w_p / K`, eq. (12). Values above 1 are outside the flame.
#[inline(always)]
pub fn slowed_rise<N: Real>(rise: N, speed: N) -> N {
    rise / speed
}

/// Fluttering edge `E = A(w) + D(w) P(w - s (t-t0))`, eq. (15).
#[inline(always)]
pub fn fluttering_edge<N: Real>(core_width: N, fringe_width: N, flutter: N) -> N {
    fringe_width.fma(flutter, core_width)
}

/// Normalized distance from the axis `u' = x'/E`, eq. (16): 0 on the axis, 1 at the fluttering edge, more outside.
#[inline(always)]
pub fn across<N: Real>(distance: N, edge: N) -> N {
    distance / edge
}

/// Texture coordinate `u = (1 + u')/2` right of the axis, `(1 - u')/2` left of it, eqs. (14) and (18).
#[inline(always)]
pub fn texture_u<N: Real>(across: N, x: N) -> N {
    let half = x.broadcast(0.5);
    x.select_lt(half, x.broadcast(-0.5), half).fma(across, half)
}

/// Threshold `L = 1 - (1 - V(w)) (1 - H(u))`, eq. (4).
#[inline(always)]
pub fn threshold<N: Real>(vertical: N, horizontal: N) -> N {
    let one = vertical.broadcast(if cfg!(feature = "broken-kernel") { 0.9 } else { 1.0 });
    (one - vertical).fma(horizontal - one, one)
}

/// Excess over the threshold, `T1 = max(0, T0 - L)`, eq. (5).
#[inline(always)]
pub fn above_threshold<N: Real>(texture: N, threshold: N) -> N {
    (texture - threshold).simd_max(texture.broadcast(0.0))
}

#[cfg(test)]
mod tests {
    use bansho_base::assert_measured;

    use super::*;

    #[test]
    fn rise_9_is_the_root_for_k_0_and_the_line_for_k_1() {
        assert_eq!((rise(0.25, 0.0), rise(0.25, 1.0), rise(0.25, 0.4)), (0.5, 0.25, 0.4));
        assert_measured!("equation (9): w at y = 0.25 for k = 0", f64::from(rise(0.25, 0.0)), 0.5, 0.0);
        assert_measured!("equation (9): w at y = 0.25 for k = 0.4", f64::from(rise(0.25, 0.4)), 0.4, 1e-7);
        assert_eq!((rise(0.0, 0.3), rise(1.0, 0.3)), (0.0, 1.0));
    }

    #[test]
    fn table_1_a_small_k_starts_slowly_and_accelerates_much() {
        // Gas rises by dw/dt = s = 1, so that its speed is dy/dt = 1 / (dw/dy). By hand, for k = 0: y = t^2, so 2 t; for k = 1: y = t, so 1.
        let height = |k: f32, w: f64| {
            let (mut low, mut high) = (0.0_f64, 1.0_f64);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if f64::from(rise(middle as f32, k)) < w { low = middle } else { high = middle }
            }
            0.5 * (low + high)
        };
        let speed = |k, w| (height(k, w + 0.02) - height(k, w - 0.02)) / 0.04;
        assert!((speed(0.0, 0.5) - 1.0).abs() < 1e-3 && (speed(1.0, 0.5) - 1.0).abs() < 1e-3);
        let starts = [0.0, 0.25, 0.5, 0.75, 1.0].map(|k| speed(k, 0.05));
        let accelerations = [0.0, 0.25, 0.5, 0.75, 1.0].map(|k| (speed(k, 0.95) - speed(k, 0.05)) / 0.9);
        assert!(starts.windows(2).all(|pair| pair[0] + 0.005 < pair[1]), "{starts:?}");
        assert!(accelerations.windows(2).all(|pair| pair[0] > pair[1] + 0.005), "{accelerations:?}");
        assert_measured!("table 1: initial speed for k = 0", starts[0], 0.1, 1e-3);
        assert_measured!("table 1: acceleration for k = 0", accelerations[0], 2.0, 1e-2);
    }

    #[test]
    fn axis_distance_10_is_0_on_the_axis_and_1_at_both_edges() {
        assert_eq!([0.0, 0.25, 0.5, 0.875, 1.0].map(axis_distance), [1.0, 0.5, 0.0, 0.75, 1.0]);
        assert_measured!("equation (10): x' at x = 0.875", f64::from(axis_distance(0.875)), 0.75, 0.0);
    }

    #[test]
    fn speed_profile_11_falls_from_1_in_the_core_to_h_beyond_the_fringe() {
        // A = 1/2, D = 1/4, F(s) = 1 - s, h = 1/5.
        let speed = |distance| speed_profile(1.0 - fringe_position(distance, 0.5, 0.25), 0.2);
        assert_eq!((speed(0.3), speed(0.5)), (1.0, 1.0));
        assert!((speed(0.625) - 0.6).abs() < 1e-6);
        assert_measured!("equation (11): K in the middle of the fringe", f64::from(speed(0.625)), 0.6, 1e-6);
        assert!((speed(0.75) - 0.2).abs() < 1e-6 && (speed(1.0) - 0.2).abs() < 1e-6);
    }

    #[test]
    fn a_fringe_without_width_divides_by_nothing() {
        assert_eq!([0.4, 0.5, 0.6].map(|distance| fringe_position(distance, 0.5, 0.0)), [0.0, 0.0, 1.0]);
    }

    #[test]
    fn slowed_rise_12_leaves_the_flame_where_the_edge_is_too_slow() {
        assert_eq!((slowed_rise(0.4, 1.0), slowed_rise(0.4, 0.5), slowed_rise(0.4, 0.25)), (0.4, 0.8, 1.6));
        assert_measured!("equation (12): w / K at half speed", f64::from(slowed_rise(0.4, 0.5)), 0.8, 1e-7);
    }

    #[test]
    fn fluttering_edge_15_swings_within_the_fringe() {
        assert_eq!([0.0, 0.5, 1.0].map(|flutter| fluttering_edge(0.5, 0.25, flutter)), [0.5, 0.625, 0.75]);
        assert_measured!("equation (15): E for P = 0.5", f64::from(fluttering_edge(0.5, 0.25, 0.5)), 0.625, 0.0);
    }

    #[test]
    fn across_13_to_18_spans_the_texture_from_edge_to_edge() {
        // E = 3/4 on both sides: x = 7/8 is the right edge, x = 1/8 the left one.
        let u = |x| texture_u(across(axis_distance(x), 0.75), x);
        assert_eq!([0.125, 0.3125, 0.5, 0.6875, 0.875].map(u), [0.0, 0.25, 0.5, 0.75, 1.0]);
        assert_measured!("equation (13): u at the right edge", f64::from(u(0.875)), 1.0, 0.0);
        assert_measured!("equation (14): u at half the right edge", f64::from(u(0.6875)), 0.75, 0.0);
        assert_measured!("equation (17): u at the left edge", f64::from(u(0.125)), 0.0, 0.0);
        assert_measured!("equation (18): u at half the left edge", f64::from(u(0.3125)), 0.25, 0.0);
        assert!(across(axis_distance(0.95), 0.75) > 1.0);
    }

    #[test]
    fn threshold_4_joins_both_ways_and_5_cuts_what_is_below() {
        assert_eq!((threshold(0.5, 0.5), threshold(0.0, 0.25), threshold(1.0, 0.0)), (0.75, 0.25, 1.0));
        assert_measured!("equation (4): L at V = H = 0.5", f64::from(threshold(0.5, 0.5)), 0.75, 0.0);
        assert_measured!("equation (5): 0.875 above 0.75", f64::from(above_threshold(0.875, 0.75)), 0.125, 0.0);
        assert_eq!((above_threshold(0.875, 0.75), above_threshold(0.5, 0.75)), (0.125, 0.0));
    }
}
