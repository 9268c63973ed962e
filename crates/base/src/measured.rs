//! Numbers that the book states and tests measure.

/// Asserts in a test that `found` is the number that the book states, within an absolute tolerance, and prints it: `cargo test -- --nocapture` lists the
/// numbers of the book as they are. All are `f64`.
///
/// ```
/// bansho_base::assert_measured!("a quarter turn, rad", bansho_base::math::atan2(1.0, 0.0), 1.571, 0.0005);
/// ```
#[macro_export]
macro_rules! assert_measured {
    ($what:expr, $found:expr, $stated:expr, $tolerance:expr $(,)?) => {{
        let (what, found, stated, tolerance): (_, f64, f64, f64) = ($what, $found, $stated, $tolerance);
        std::println!("measured: {what}: {found} (stated: {stated}, within {tolerance})");
        std::assert!((found - stated).abs() <= tolerance, "{what}: {found}, stated as {stated}, within {tolerance}");
    }};
}
