//! Where gas that was spawned at different points meets, detail has no seam.

use super::*;

/// A wall of gas in front of the camera. The spawn points of the gas in its right half are displaced by `apart`.
fn wall(apart: [f32; 3]) -> GasParticles {
    let mut particles = cloud((0..6000).map(|id| {
        let [x, y, z, _] = Key::new(8, "wall").uniforms(id, 0, Purpose::named("place")).map(|u| u - 0.5);
        ball(id, [2.4 * x, 1.8 * y, 0.2 * z], 1750.0, 1.5e-7)
    }));
    particles.support_radius.fill(0.15);
    for index in 0..particles.len() {
        if particles.position[0][index] > 0.0 {
            (0..3).for_each(|axis| particles.spawn_point[axis][index] += apart[axis]);
        }
    }
    particles
}

/// Mean and greatest change of luminance from pixel to pixel near the middle column, beside the mean luminance.
fn roughness(particles: &GasParticles) -> [f64; 2] {
    let view = view(camera());
    let strip = drawn(particles, &GasRenderingParameters::default(), &view, 0, None);
    let (mut light, mut changes, mut greatest, mut count) = (0.0, 0.0, 0.0_f64, 0.0);
    for (x, y) in (20..100).flat_map(|y| (74..86).map(move |x| (x, y))) {
        let here = luminance(&strip, x, y);
        for other in [luminance(&strip, x + 1, y), luminance(&strip, x, y + 1)] {
            changes += 0.5 * (other - here).abs();
            greatest = greatest.max((other - here).abs());
        }
        light += here;
        count += 1.0;
    }
    [changes / light, greatest * count / light]
}

#[test]
fn where_streams_of_gas_meet_there_are_no_lines() {
    let [mean, greatest] = roughness(&wall([0.0; 3]));
    assert!(mean > 0.01, "there is detail to be seen: {mean}");
    for apart in [[3.0, 0.0, 0.0], [1.0, 4.0, -2.0], [0.0, 9.0, 0.0]] {
        let [seam_mean, seam_greatest] = roughness(&wall(apart));
        assert!(
            seam_mean < 1.1 * mean && seam_greatest < 1.2 * greatest,
            "{seam_mean} {seam_greatest} for {mean} {greatest}"
        );
    }
}
