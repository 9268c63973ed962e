//! What the paper draws: sprites of poly6 itself, and squares that show the density.

use super::*;

#[test]
fn the_papers_sprites_add_up_and_fall_off_as_poly6() {
    let view = view(camera());
    let rendering =
        GasRenderingParameters { sprite: SpriteStyle::Poly6, opacity: 0.1, ..GasRenderingParameters::default() };
    let one = drawn(&cloud([ball(0, [0.0; 3], 1800.0, 0.0)]), &rendering, &view, 0, None);
    let two =
        drawn(&cloud([ball(0, [0.0; 3], 1800.0, 0.0), ball(1, [0.0; 3], 1800.0, 0.0)]), &rendering, &view, 0, None);
    let brighter = luminance(&two, 80, 60) / luminance(&one, 80, 60);
    bansho_base::assert_measured!("section 5.2: two sprites over one", brighter, 2.0, 1e-4);
    let scale = view.camera.focal_pixels / DISTANCE;
    let s = 1.0 - (14.5 / scale / 0.3) * (14.5 / scale / 0.3);
    let ratio = luminance(&one, 94, 60) / luminance(&one, 80, 60);
    assert!((ratio - s * s * s).abs() < 0.04, "{ratio} for {}", s * s * s);
    assert!((luminance(&one, 80, 60) / black(1800.0) - 0.1).abs() < 0.005);
}

#[test]
fn the_papers_sprites_hide_as_much_as_their_gas_is_dense() {
    let rendering =
        GasRenderingParameters { sprite: SpriteStyle::Poly6, opacity: 0.3, ..GasRenderingParameters::default() };
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
fn the_papers_haze_is_the_gradient_of_poly6_for_every_particle_alike() {
    let view = view(camera());
    let scale = view.camera.focal_pixels / DISTANCE;
    let rendering = GasRenderingParameters {
        sprite: SpriteStyle::Poly6,
        heat_haze_model: HeatHazeModel::Poly6,
        heat_haze_gain: 5.0,
        ..GasRenderingParameters::default()
    };
    // Of a liter of air at 1500 K: 0.2354 kg/m^3, whatever the density of the gas is now.
    let volume = 0.0002 / (1.2041 * 293.15 / 1500.0);
    let weight = 5.0 * (refractivity(293.15) - refractivity(1500.0)) * volume * LINE_PEAK / 0.09;
    let deflections = |density: f32| {
        let particles = cloud([Particle { density, ..ball(0, [0.0; 3], 1500.0, 0.0) }]);
        prepared(&particles, &rendering, &view, |prepared| {
            let bend = prepared.deflection().unwrap();
            (70..91).map(|x| f64::from(bend.angle.at(x - bend.rect.x, 60 - bend.rect.y)[0])).collect::<Vec<_>>()
        })
    };
    let dense = deflections(0.2);
    let mut largest = 0.0_f64;
    for (x, got) in (70..91).zip(&dense) {
        let b = (f64::from(x) + 0.5 - 80.0) / scale;
        let s = 1.0 - b * b / 0.09;
        // Outward: minus the derivative of (1 - b^2/d^2)^3.
        let expected = weight * 6.0 * b / 0.09 * s * s;
        let peak = weight * 6.0 * 0.64 * 0.2_f64.sqrt() / 0.3;
        largest = largest.max((got - expected).abs() / peak);
    }
    bansho_base::assert_measured!("section 5.3: difference, of the maximum", largest, 0.0, 0.05);
    assert_eq!(dense, deflections(0.02));
}

#[test]
fn squares_are_redder_where_gas_is_denser() {
    let view = view(camera());
    let rendering = GasRenderingParameters { sprite: SpriteStyle::Squares, ..GasRenderingParameters::default() };
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
