//! The paper's textures and billboards.

use bansho_base::{
    math::{self, DVec3},
    phenomenon::{strip::View, surroundings::Surroundings},
};

use super::{
    TextureSet,
    quads::{Quad, heights, interpolated},
};
use crate::{
    DropCountLaw, Method, OpacityLaw, RainParameters, VelocityLaw,
    streaks::coverage::paper_opacity,
    tests::{METHODS, draw, lamp, lit, opacity, rain, streaks, view_at, wind},
};

/// The paper's setting.
fn paper(rate: f64) -> RainParameters {
    RainParameters {
        terminal_velocity: VelocityLaw::RigidSphere,
        opacity: OpacityLaw::Paper,
        ..streaks(Method::Textures, rate)
    }
}

#[test]
fn the_papers_set_is_24_textures_in_6_291_456_bytes() {
    let set = TextureSet::new(&paper(20.0), 1).unwrap();
    bansho_base::assert_measured!("figure 1 & figure 4: textures", set.count() as f64, 24.0, 0.0);
    bansho_base::assert_measured!("figure 4: bytes", set.bytes() as f64, 6_291_456.0, 0.0);
    // Where two streaks cross, over: 1 - (1 - a)^2 at most of the largest drop; a single one has the paper's opacity.
    let (single, scale) = (paper_opacity(2.0, 6.575), f64::from(255.0 * set.opacity_of_code()));
    assert!(scale > single - 1e-3 && scale < 1.0 - (1.0 - single) * (1.0 - single) * 0.9, "{scale} {single}");
    for rate in [1.0, 5.0, 10.0, 20.0] {
        assert_eq!(set.of_rate(rate).len(), 6);
    }
    assert!(set.of_rate(0.0).is_empty());
    let first = |rate: f64| std::ptr::from_ref(&set.of_rate(rate)[0]);
    assert!(first(2.9) == first(1.0) && first(3.1) == first(5.0) && first(90.0) == first(20.0), "the nearest rate");
}

#[test]
fn textures_hold_the_drops_of_a_bin_or_of_the_printed_density() {
    let counts = |texture_drop_count, rate: f64| -> Vec<usize> {
        let set = TextureSet::new(&RainParameters { texture_drop_count, ..paper(rate) }, 1).unwrap();
        set.of_rate(rate).iter().map(super::StreakTexture::drop_count).collect()
    };
    let printed = |rate: f64, diameter: f64| 8000.0 * math::exp(-4.1 * math::pow(rate, -0.21) * diameter);
    for rate in [1.0, 5.0, 10.0, 20.0] {
        for (count, diameter) in counts(DropCountLaw::Density, rate).iter().zip([1.0, 1.2, 1.4, 1.6, 1.8, 2.0]) {
            assert!((*count as f64 - printed(rate, diameter)).abs() <= 1.0, "{rate} {diameter}: {count}");
        }
    }
    // n(R, 2.0 mm) at 1 mm/h is 2.2 drops; the integral over 0.2 mm is 0.44.
    assert!(counts(DropCountLaw::Density, 1.0)[5] >= 2 && counts(DropCountLaw::Bin, 1.0)[5] <= 1);
    let [bins, densities] =
        [DropCountLaw::Bin, DropCountLaw::Density].map(|law| counts(law, 20.0).iter().sum::<usize>());
    assert!((472..=478).contains(&bins) && (2350..=2360).contains(&densities), "{bins} {densities}");
}

#[test]
fn mipmaps_keep_the_mean_of_a_texture() {
    let set = TextureSet::new(&paper(20.0), 1).unwrap();
    for texture in set.of_rate(20.0) {
        let mean = |level: usize, side: usize| {
            let at = |index: usize| {
                let [x, y] = [index % side, index / side].map(|step| (step as f32 + 0.5) / side as f32);
                texture.sample(level, [x, y])
            };
            (0..side * side).map(at).sum::<f32>() / (side * side) as f32
        };
        let whole = mean(0, 512);
        for (level, side) in [(1, 256), (3, 64), (6, 8)] {
            assert!((mean(level, side) / whole - 1.0).abs() < 0.01, "{level}: {} {whole}", mean(level, side));
        }
        assert_eq!([0.3, 1.0, 2.1, 4.2, 1e9].map(|texels| texture.level(texels)), [0, 0, 1, 2, 9]);
    }
}

#[test]
fn billboards_fall_and_return_to_the_top() {
    let everywhere = f64::NEG_INFINITY..=f64::INFINITY;
    let at = |t: f64| -> Vec<f64> { heights(7, 4.0, t, everywhere.clone()).collect() };
    assert_eq!(at(0.0), [0.5, 1.5, 2.5, 3.5, 4.5, 5.5, -0.5]);
    // After 0.1 s all have fallen by 0.4 m, but for the one that was in the ground, which is near the top.
    for (before, after) in at(0.0).iter().zip(at(0.1)) {
        let expected = if *before < 0.0 { before - 0.4 + 7.0 } else { before - 0.4 };
        assert!((after - expected).abs() < 1e-12, "{before} {after}");
    }
    assert!(at(123.4).iter().all(|height| (-0.5..6.5).contains(height)));
    // Those within a range are those of all that are in it, however high the camera is above the ground.
    for t in [0.0, 0.1, 123.4] {
        let near: Vec<f64> = heights(7, 4.0, t, 1.2..=3.9).collect();
        let expected: Vec<f64> = at(t).into_iter().filter(|height| (1.2..=3.9).contains(height)).collect();
        assert_eq!(near, expected, "{t} s");
        let high: Vec<f64> = heights(1_000_000_000_000, 4.0, t, 1e9 - 2.0..=1e9 + 2.0).collect();
        assert!(high.len() == 4 || high.len() == 5, "{t} s: {high:?}");
    }
}

#[test]
fn a_billboard_faces_the_camera_and_is_lit_by_the_inverse_square() {
    let set = TextureSet::new(&paper(20.0), 1).unwrap();
    let view = view_at(1.0, 1.0 / 30.0, [64, 36]);
    let light = lamp([1.0, 2.0, -3.0], 100.0);
    for center in [DVec3::new(2.0, 1.0, -3.0), DVec3::new(-1.5, 2.5, -4.0), DVec3::new(0.3, 0.5, 2.0)] {
        let quad = Quad::new(center, 1.0, &set.of_rate(20.0)[0], &[light], &view);
        let line = center - view.camera.position;
        assert!(quad.right.y == 0.0);
        bansho_base::assert_measured!("figure 5: cosine to the line of sight", quad.right.dot(line), 0.0, 1e-12);
        let corner = center + 0.5 * (DVec3::Y - quad.right);
        let square = (corner - DVec3::new(1.0, 2.0, -3.0)).length_squared();
        let expected = 100.0 / square / (4.0 * std::f64::consts::PI);
        let found = f64::from(interpolated(&quad.radiance, [0.0, 1.0])[1]);
        assert!((found / expected - 1.0).abs() < 1e-5, "{found} {expected}");
    }
}

#[test]
fn what_is_hardly_lit_is_left_out_and_changes_no_code() {
    let calm = wind([0.0; 3], 0.0);
    let mut surroundings = Surroundings::from_wind(&calm);
    surroundings.others.lights = vec![lamp([0.0, 3.0, -3.0], 30.0)];
    let white = 100.0;
    let picture = |culling: bool| {
        let view = View { white_luminance: Some(white), ..view_at(1.0, 1.0 / 30.0, [96, 54]) };
        draw(&rain(RainParameters { culling, ..paper(20.0) }, 1), &view, &surroundings).radiance[1].clone()
    };
    let change = picture(true).iter().zip(picture(false)).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(change < white as f32 / 255.0, "{change}");
}

/// Mean opacity of a picture by rate at one time, so that nothing but the rate changes it.
fn mean_opacities(parameters: RainParameters, rates: &[f64]) -> Vec<f64> {
    let calm = wind([0.0; 3], 0.0);
    let surroundings = lit(&calm);
    let view = view_at(1.0, 1.0 / 30.0, [160, 90]);
    let mut rain = rain(parameters, 1);
    let mean = |rate: &f64| {
        rain.parameters.rate_mm_per_h = (*rate).into();
        let picture = opacity(&draw(&rain, &view, &surroundings));
        picture.iter().map(|value| f64::from(*value)).sum::<f64>() / picture.len() as f64
    };
    rates.iter().map(mean).collect()
}

/// Largest change of the mean opacity from one frame to the next, relative to that of the heaviest rain.
fn largest_step(opacities: &[f64]) -> f64 {
    let steps = opacities.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    steps.fold(0.0, f64::max) / opacities.iter().copied().fold(0.0, f64::max)
}

#[test]
fn a_rate_that_rises_and_falls_never_pops_but_with_the_papers_textures() {
    // From 1 to 50 mm/h and back in 2 s each, 30 frames a second: 0.8 mm/h a frame, up to 1/39 of what the rain of 50 mm/h hides.
    let rates: Vec<f64> = (0..=60).map(|frame| 1.0 + 49.0 * f64::from(frame) / 60.0).collect();
    for method in METHODS {
        let opacities = mean_opacities(streaks(method, 50.0), &rates);
        assert!(opacities.is_sorted(), "{method:?}: heavier rain never hides less");
        let step = largest_step(&opacities);
        assert!(step < 0.06 && opacities[60] > 8.0 * opacities[0], "{method:?}: {step}");
        if method == Method::Billboards {
            bansho_base::assert_measured!(
                "section 3: changing rate: largest step by Bansho's own method, %",
                100.0 * step,
                4.8,
                0.05
            );
        }
        let back = mean_opacities(streaks(method, 50.0), &[50.0, 20.0, rates[30]]);
        assert_eq!(back[2], opacities[30], "{method:?}: on its way back it is the same rain");
    }
    let literal = mean_opacities(paper(50.0), &rates);
    let step = largest_step(&literal);
    assert!(step > 0.15, "it jumps from texture to texture: {step}");
    let jumps = literal.windows(2).filter(|pair| pair[0] != pair[1]).count();
    assert_eq!(jumps, 3, "and is constant between them");
}
