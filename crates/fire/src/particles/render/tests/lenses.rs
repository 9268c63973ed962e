//! The light of the gas does not depend on the lens, on the direction, or on how large the gas is in the picture.

use bansho_base::math::DMat3;

use super::*;

/// Sums over the pixels of a picture, times their solid angles: light in cd/m^2 sr, and alpha in sr.
#[derive(Clone, Copy, Debug)]
struct Collected {
    light: f64,
    alpha: f64,
}

/// The picture of a view as one strip.
fn picture(particles: &GasParticles, rendering: &GasRenderingParameters, view: &View, aovs: usize) -> Strip {
    let mut strip = Strip::default();
    strip.reset(Rect::from_size(view.size[0], view.size[1]), None, aovs);
    prepared(particles, rendering, view, |prepared| prepared.draw(&DepthInterval::ALL, &mut strip));
    strip
}

fn collected(particles: &GasParticles, rendering: &GasRenderingParameters, view: &View) -> Collected {
    let strip = picture(particles, rendering, view, 0);
    let mut sum = Collected { light: 0.0, alpha: 0.0 };
    for index in 0..strip.len() {
        let [x, y] = [index % view.size[0], index / view.size[0]].map(|side| side as f64 + 0.5);
        let solid_angle = view.camera.pixel_solid_angle(DVec2::new(x, y));
        let rgb = [0, 1, 2].map(|c| strip.radiance[c][index]);
        sum.light += solid_angle * f64::from(color::luminance(rgb));
        sum.alpha += solid_angle * (1.0 - f64::from(strip.transmittance(index)[0]));
    }
    sum
}

/// The view of a camera at the origin that looks along -z.
fn view_of(lens: Lens, size: [usize; 2]) -> View {
    let camera = CameraParameters {
        lens,
        position: Animated::from([0.0, 0.0, 0.0]),
        target: Animated::from([0.0, 0.0, -10.0]),
        vertical_fov_deg: Animated::from(150.0),
        fisheye_fov_deg: 360.0,
        ..CameraParameters::default()
    };
    View::new(camera, Shutter { open: 1.0, close: 1.0 }, 1.04, size, 0)
}

/// A cloud of gas of 0.3 m around a point 4 m away, upward from the optical axis by an angle.
fn cloud_at(degrees: f64, azimuth_degrees: f64, soot: f32) -> GasParticles {
    let turn = DMat3::from_rotation_z(azimuth_degrees.to_radians()) * DMat3::from_rotation_x(degrees.to_radians());
    cloud((0..60).map(|id| {
        let [x, y, z, _] =
            Key::new(3, "small cloud").uniforms(id, 0, Purpose::named("place")).map(|u| 0.3 * (f64::from(u) - 0.5));
        let position = turn * DVec3::new(x, y, -DISTANCE + z);
        Particle { support_radius: 0.12, ..ball(id, position.as_vec3().to_array(), 1800.0, soot) }
    }))
}

/// Light of thin gas without self-absorption, lx: intensity over the square of the distance.
fn expected_light(particles: &GasParticles, soot: f32) -> f64 {
    let intensity = black(1800.0) * 0.001 * soot_absorption(f64::from(soot), &smooth());
    let [x, y, z] = particles.positions();
    let squared = |i: usize| DVec3::new(f64::from(x[i]), f64::from(y[i]), f64::from(z[i])).length_squared();
    (0..particles.len()).map(|index| intensity / squared(index)).sum()
}

#[test]
fn the_light_of_gas_is_the_same_in_every_direction_of_every_lens() {
    let cases = [
        (Lens::Perspective, [900, 900], vec![0.0, 15.0, 30.0, 45.0, 60.0, 70.0]),
        (Lens::Panorama, [512, 256], vec![0.0, 30.0, 50.0, 60.0, 75.0, 84.0, 88.0, 89.9, 90.0, 91.0]),
        (Lens::Fisheye, [400, 400], vec![0.0, 45.0, 90.0, 135.0, 160.0, 175.0]),
    ];
    for (lens, size, angles) in cases {
        let view = view_of(lens, size);
        for (degrees, azimuth) in angles.into_iter().flat_map(|angle| [0.0, 37.0].map(|azimuth| (angle, azimuth))) {
            // The directions of a panorama's latitudes are upward only.
            let azimuth = if lens == Lens::Panorama { 0.0 } else { azimuth };
            for soot in [1e-9, 3e-6] {
                let particles = cloud_at(degrees, azimuth, soot);
                let seen = collected(&particles, &smooth(), &view);
                let straight_on =
                    collected(&cloud_at(0.0, 0.0, soot), &smooth(), &view_of(Lens::Perspective, [900, 900]));
                let ratio = seen.light / straight_on.light;
                assert!((0.96..1.04).contains(&ratio), "{lens:?}, {degrees} degrees, soot {soot}: light {ratio}");
                let ratio = seen.alpha / straight_on.alpha;
                assert!((0.96..1.04).contains(&ratio), "{lens:?}, {degrees} degrees, soot {soot}: alpha {ratio}");
                if soot < 1e-8 {
                    let ratio = seen.light / expected_light(&particles, soot);
                    assert!((ratio - 1.0).abs() < 0.03, "{lens:?}, {degrees} degrees: {ratio} of the closed form");
                }
            }
        }
    }
}

#[test]
fn a_panorama_of_a_camera_that_is_turned_by_half_a_turn_is_rolled_by_half() {
    let size = [512, 256];
    let view = |z: f64, shutter: Shutter| {
        let view = view_of(Lens::Panorama, size);
        let camera = CameraParameters { target: Animated::from([0.0, 0.0, z]), ..view.camera_parameters };
        View { aovs_requested: true, ..View::new(camera, shutter, 1.04, size, 0) }
    };
    let mut particles = glowing_cloud(300);
    particles.position[2].iter_mut().for_each(|z| *z -= 2.0);
    particles.velocity[0].fill(3.0);
    for (rendering, open_s) in
        [(smooth(), 0.0), (GasRenderingParameters::default(), 0.0), (GasRenderingParameters::default(), 0.02)]
    {
        let shutter = Shutter { open: 1.0 - 0.5 * open_s, close: 1.0 + 0.5 * open_s };
        let [middle, seam] = [-1.0, 1.0].map(|z| picture(&particles, &rendering, &view(z, shutter), AOVS.len()));
        let rolled = |index: usize| index / size[0] * size[0] + (index % size[0] + size[0] / 2) % size[0];
        let differs = |a: f64, b: f64, scale: f64| (a - b).abs() > 1e-3 * scale;
        let brightest = middle.radiance[1].iter().copied().fold(0.0, f32::max);
        for index in 0..middle.len() {
            let place = [index % size[0], index / size[0]];
            for c in 0..3 {
                let [a, b] = [middle.radiance[c][index], seam.radiance[c][rolled(index)]].map(f64::from);
                assert!(!differs(a, b, f64::from(brightest)), "{a} {b} of {brightest} at {place:?}");
            }
            let [a, b] = [middle.transmittance(index)[0], seam.transmittance(rolled(index))[0]].map(f64::from);
            assert!(!differs(a, b, 1.0), "transmittance {a} {b} at {place:?}");
            for (plane, aov) in AOVS.iter().enumerate() {
                let [a, b] = [(&middle, index), (&seam, rolled(index))]
                    .map(|(strip, index)| f64::from(strip.aovs[plane].resolve(index, aov.rule)));
                let scale = if aov.unit == "K" { 2000.0 } else { 1.0 + a.abs() };
                assert!(
                    !differs(a, b, scale) || middle.transmittance(index)[0] > 0.9999,
                    "{} {a} {b} at {place:?}",
                    aov.name
                );
            }
        }
    }
}

#[test]
fn small_flames_shine_as_brightly_as_large_ones_wherever_they_are_within_a_pixel() {
    let particles = glowing_cloud(400);
    let seen = |height: usize, shift: f64| {
        let camera = CameraParameters {
            position: Animated::from([0.0, 0.0, 20.0]),
            target: Animated::from([0.0, 0.0, 0.0]),
            vertical_fov_deg: Animated::from(16.0),
            shift: [shift / height as f64, 0.7 * shift / height as f64],
            ..CameraParameters::default()
        };
        let view = View::new(camera, Shutter { open: 1.0, close: 1.0 }, 1.04, [height; 2], 0);
        collected(&particles, &GasRenderingParameters::default(), &view)
    };
    // The cloud and its balls are 1.8 m high, a third of the picture.
    let large = seen(768, 0.0);
    for height in [300, 128, 64, 32, 16, 8, 4, 2] {
        for step in 0..8 {
            // Within half a pixel, so that it stays inside of the smallest picture.
            let small = seen(height, f64::from(step) / 8.0 - 0.5);
            let ratios = [small.light / large.light, small.alpha / large.alpha];
            assert!(ratios.iter().all(|ratio| (0.95..1.05).contains(ratio)), "{height} rows, step {step}: {ratios:?}");
        }
    }
}
