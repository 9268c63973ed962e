//! What the paper draws: sprites of poly6 itself, and squares that show the density.

use super::*;

#[test]
fn the_papers_sprites_add_up_and_fall_off_as_poly6() {
    let view = view(camera());
    let rendering = RenderingParameters { sprite: SpriteStyle::Poly6, opacity: 0.1, ..RenderingParameters::default() };
    let one = drawn(&cloud([ball(0, [0.0; 3], 1800.0, 0.0)]), &rendering, &view, 0, None);
    let two =
        drawn(&cloud([ball(0, [0.0; 3], 1800.0, 0.0), ball(1, [0.0; 3], 1800.0, 0.0)]), &rendering, &view, 0, None);
    assert!((luminance(&two, 80, 60) / luminance(&one, 80, 60) - 2.0).abs() < 1e-4);
    let scale = view.camera.focal_pixels / DISTANCE;
    let s = 1.0 - (14.5 / scale / 0.3) * (14.5 / scale / 0.3);
    let ratio = luminance(&one, 94, 60) / luminance(&one, 80, 60);
    assert!((ratio - s * s * s).abs() < 0.04, "{ratio} for {}", s * s * s);
    assert!((luminance(&one, 80, 60) / black(1800.0) - 0.1).abs() < 0.005);
}

#[test]
fn the_papers_sprites_hide_as_much_as_their_gas_is_dense() {
    let rendering = RenderingParameters { sprite: SpriteStyle::Poly6, opacity: 0.3, ..RenderingParameters::default() };
    let thin = ball(0, [-0.5, 0.0, 0.0], 1800.0, 0.0);
    let dense = Particle { density: 3.0 * thin.density, ..ball(1, [0.5, 0.0, 0.0], 1800.0, 0.0) };
    let view = view(camera());
    let strip = drawn(&cloud([thin, dense]), &rendering, &view, 0, None);
    let scale = view.camera.focal_pixels / DISTANCE;
    // Opacity follows from the density alone, not from soot: 0.3 at the center of gas of the mean density, here of two thin balls.
    for (x, depth) in [(-0.5, 0.15), (0.5, 0.45)] {
        let index = 60 * SIZE[0] + (80.0 + x * scale) as usize;
        let opacity = 1.0 - f64::from(strip.transmittance(index)[0]);
        let expected = -math::exp_m1(-depth);
        assert!((opacity / expected - 1.0).abs() < 0.04, "{opacity} for {expected}");
    }
}

#[test]
fn squares_are_redder_where_gas_is_denser() {
    let view = view(camera());
    let rendering = RenderingParameters { sprite: SpriteStyle::Squares, ..RenderingParameters::default() };
    let dense = Particle { density: 0.4, ..ball(1, [0.5, 0.0, 0.0], 1800.0, 0.0) };
    let strip = drawn(&cloud([ball(0, [-0.5, 0.0, 0.0], 1800.0, 0.0), dense]), &rendering, &view, 0, None);
    let scale = view.camera.focal_pixels / DISTANCE;
    let at = |x: f64| {
        let index = 60 * SIZE[0] + (80.0 + x * scale) as usize;
        [0, 1, 2].map(|c| strip.radiance[c][index])
    };
    let (thin, dense) = (at(-0.5), at(0.5));
    assert!(thin[0] / thin[2] < 1.5 && dense[0] / dense[2] > 4.0, "{thin:?} {dense:?}");
    assert_eq!(at(0.0), [0.0; 3]);
}
