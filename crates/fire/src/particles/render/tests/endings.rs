//! How gas ends: nothing that is seen is removed.

use bansho_base::math::Vec3;

use super::*;

const ENDING: FadeOut = FadeOut { seconds: 0.1, domain: [Vec3::splat(-1.0), Vec3::ONE] };

/// Optical depth in the middle of a lone ball of smoke that lives for a second, and by how much it bends the light beside.
fn seen(particle: Particle) -> [f64; 2] {
    let (buffers, wind, air) = (BufferPool::default(), Wind::new(WindParameters::default(), 1, None), Air::default());
    let surroundings = Surroundings { air: &air, ..Surroundings::from_wind(&wind) };
    let particles = cloud([particle]);
    let gas = Gas { fade_out: ENDING, ..gas(&particles, &buffers) };
    let (view, rendering) = (view(camera()), smooth());
    let prepared = PreparedGas::new(gas, &rendering, &view, &surroundings, &Unobserved).unwrap();
    let mut strip = Strip::default();
    strip.reset(Rect::from_size(SIZE[0], SIZE[1]), None, AOVS.len());
    prepared.draw(&DepthInterval::ALL, &mut strip);
    let bend = prepared
        .deflection()
        .map_or(0.0, |bend| bend.angle.pixels().iter().map(|angle| f64::from(angle[0].abs())).fold(0.0, f64::max));
    [aov(&strip, "optical_depth", 80, 60), bend]
}

#[test]
fn smoke_and_haze_fade_before_the_gas_is_removed() {
    let smoke = |age: f32| seen(Particle { age, ..ball(0, [0.0; 3], 600.0, 1e-6) });
    let whole = smoke(0.5);
    assert!(whole[0] > 0.1 && whole[1] > 0.0);
    for (age, left) in [(0.89, 1.0), (0.95, 0.5), (0.99, 0.1), (1.0, 0.0)] {
        let seen = smoke(age);
        for kind in 0..2 {
            assert!((seen[kind] / whole[kind] - left).abs() < 1e-3, "at {age}: {seen:?} of {whole:?}");
        }
    }
}

#[test]
fn gas_fades_toward_the_side_of_the_domain_through_which_it_leaves() {
    let at = |x: f32, velocity: f32| {
        let smoke = Particle { velocity: [velocity, 0.0, 0.0], ..ball(0, [0.0; 3], 600.0, 1e-6) };
        f64::from(ENDING.remaining_fraction(Vec3::X * x, Vec3::from(smoke.velocity), 1.0))
    };
    // Two meters a second leave 0.1 s at 0.8 m.
    for (x, velocity, left) in
        [(0.79, 2.0, 1.0), (0.9, 2.0, 0.5), (1.0, 2.0, 0.0), (0.9, -2.0, 1.0), (-0.9, -2.0, 0.5), (0.9, 0.0, 1.0)]
    {
        let ratio = at(x, velocity);
        assert!((ratio - left).abs() < 1e-5, "{ratio} for {left} at {x} with {velocity}");
    }
}
