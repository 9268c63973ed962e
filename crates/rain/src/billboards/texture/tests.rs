use std::f64::consts::PI;

use super::*;
use crate::tests::reference::near;

const PAPER_MM: [f64; 6] = [1.0, 1.2, 1.4, 1.6, 1.8, 2.0];

fn drop(diameter_mm: f64, position: [f64; 3]) -> FallingDrop {
    FallingDrop { diameter_mm, speed: TerminalVelocity::default().speed(diameter_mm), position }
}

fn sum(image: &Image<1>) -> f64 {
    image.pixels().iter().map(|&[opacity]| f64::from(opacity)).sum()
}

/// Total blocked area of a texture, m^2.
fn hidden(cube: &StreakCube, drops: &[FallingDrop]) -> f64 {
    sum(&cube.draw(drops).unwrap()) * cube.pixel() * cube.pixel()
}

#[test]
fn a_drop_hides_its_disc_at_any_resolution_and_shutter() {
    for (edge, size) in [(1.0, 512), (1.0, 64), (4.0, 37), (0.02, 512), (0.005, 300)] {
        for exposure in [1e-6, 1e-4, 1e-3, 1.0 / 30.0] {
            let cube = StreakCube { edge, size, exposure, ..StreakCube::default() };
            for diameter in [0.3, 1.0, 2.0] {
                let place = [0.37, 0.711, 0.0].map(|share| share * edge);
                let area = 0.25e-6 * PI * diameter * diameter;
                let found = hidden(&cube, &[drop(diameter, place)]);
                // A streak longer than the cube overlaps itself, and so hides less.
                let overlaps = cube.terminal_velocity.speed(diameter) * exposure + 1e-3 * diameter > edge;
                let share = found / area;
                assert!(
                    if overlaps { share < 1.0 } else { near(share, 1.0, 5e-4) },
                    "{edge} m, {size}, {exposure} s: {share}"
                );
            }
        }
    }
}

#[test]
fn the_papers_textures_hide_the_discs_of_their_drops() {
    let cube = StreakCube::default();
    for rate in [1.0, 5.0, 10.0, 20.0] {
        for bin in SizeBin::around(&PAPER_MM) {
            let drops = cube.drops(&DropSizeDistribution::marshall_palmer(rate), &bin, 1, 0).unwrap();
            let area = 0.25e-6 * PI * bin.diameter_mm * bin.diameter_mm * drops.len() as f64;
            assert!((hidden(&cube, &drops) - area).abs() <= 0.005 * area, "{rate} mm/h, {bin:?}");
        }
    }
}

#[test]
fn a_streak_within_one_column_is_worked_by_hand() {
    // 1 mm in 1/30 s on pixels of 2 mm: (pi/4) D^2 / (v T) over each meter of its way, spread over 2 mm.
    let cube = StreakCube { edge: 1.024, ..StreakCube::default() };
    let image = cube.draw(&[drop(1.0, [0.201, 0.8, 0.5])]).unwrap();
    let expected = 0.25 * PI * 1e-6 / (4.03 / 30.0) / 2e-3;
    // It begins 0.224 m below the upper edge and is 0.134 m long: rows 112 to 179.
    for row in [114, 140, 177] {
        assert!(near(f64::from(image.at(100, row)[0]), expected, 1e-6), "{} {expected}", image.at(100, row)[0]);
    }
    assert!(near(expected, 0.0029233, 1e-4));
    let rows: Vec<usize> = (0..512).filter(|&row| image.row(row).iter().any(|&[opacity]| opacity > 0.0)).collect();
    assert_eq!((rows[0], rows.len()), (111, 69));
    assert!(image.row(140).iter().enumerate().all(|(x, &[opacity])| (opacity > 0.0) == (x == 100)));
}

#[test]
fn a_resolved_streak_has_the_drops_profile() {
    let cube = StreakCube { edge: 0.02, size: 400, exposure: 1e-3, ..StreakCube::default() };
    let falling = drop(2.0, [0.01, 0.015, 0.0]);
    let (image, streak) = (cube.draw(&[falling]).unwrap(), cube.streak(&falling));
    for row in (0..400).step_by(7) {
        for column in 181..219 {
            let (b, s) = ((column as f64 + 0.5) * 5e-5 - 0.01, (row as f64 + 0.5) * 5e-5 - 0.005);
            let found = f64::from(image.at(column, row)[0]);
            assert!((found - streak.opacity(b, s)).abs() < 0.01, "{b} {s}: {found} {}", streak.opacity(b, s));
        }
    }
}

#[test]
fn a_short_exposure_shows_a_round_drop() {
    let cube = StreakCube { edge: 0.004, size: 64, exposure: 1e-6, ..StreakCube::default() };
    let image = cube.draw(&[drop(2.0, [0.002, 0.002, 0.0])]).unwrap();
    for y in 0..64 {
        for x in 0..64 {
            let (dx, dy) = (x as f64 - 31.5, y as f64 - 31.5);
            let distance = (dx * dx + dy * dy).sqrt();
            let [opacity] = image.at(x, y);
            if distance < 15.0 {
                assert!(opacity > 0.99, "{x} {y}: {opacity}");
            } else if distance > 17.0 {
                assert!(opacity < 1e-9, "{x} {y}: {opacity}");
            }
        }
    }
}

#[test]
fn what_leaves_at_an_edge_enters_at_the_opposite_one() {
    let cube = StreakCube { size: 64, ..StreakCube::default() };
    let places = [[0.5, 0.5, 0.0], [0.3, 0.9, 0.0]];
    let image = cube.draw(&places.map(|place| drop(2.0, place))).unwrap();
    // By 17 columns and 40 rows, around both edges.
    let moved = places.map(|[x, y, z]| drop(2.0, [(x + 17.0 / 64.0) % 1.0, (y + 1.0 - 40.0 / 64.0) % 1.0, z]));
    let other = cube.draw(&moved).unwrap();
    for y in 0..64 {
        for x in 0..64 {
            let ([one], [two]) = (image.at(x, y), other.at((x + 17) % 64, (y + 40) % 64));
            assert!((one - two).abs() < 1e-9, "{x} {y}: {one} {two}");
        }
    }
}

#[test]
fn overlapping_streaks_are_blended() {
    let cube = StreakCube { edge: 0.1, size: 32, ..StreakCube::default() };
    let one = drop(2.0, [0.03, 0.05, 0.0]);
    let (single, double) = (cube.draw(&[one]).unwrap(), cube.draw(&[one, one]).unwrap());
    for ([a], [b]) in single.pixels().iter().zip(double.pixels()) {
        assert!((b - (1.0 - (1.0 - a) * (1.0 - a))).abs() < 1e-6);
    }
}

#[test]
fn a_stronger_rain_keeps_the_drops_of_a_weaker() {
    let cube = StreakCube::default();
    for variant in [0, 5] {
        for bin in SizeBin::around(&PAPER_MM) {
            let [weak, strong] =
                [4.0, 20.0].map(|r| cube.drops(&DropSizeDistribution::marshall_palmer(r), &bin, 3, variant).unwrap());
            assert!(strong.len() >= weak.len() && strong[..weak.len()] == weak[..]);
        }
    }
}

#[test]
fn variants_keep_the_mean_count_and_differ() {
    let (cube, sizes) = (StreakCube::default(), DropSizeDistribution::marshall_palmer(1.0));
    let [bin] = SizeBin::around(&[2.0])[..] else { panic!("one bin") };
    let counts: Vec<usize> = (0..200).map(|variant| cube.drops(&sizes, &bin, 1, variant).unwrap().len()).collect();
    let whole: usize = counts.iter().sum();
    assert!((whole as f64 - 200.0 * bin.count(&sizes)).abs() <= 2.0, "{whole}");
    assert!(counts.contains(&0) && counts.contains(&1));
    let [strong] = SizeBin::around(&[1.0])[..] else { panic!("one bin") };
    assert_ne!(cube.drops(&sizes, &strong, 1, 0).unwrap()[0], cube.drops(&sizes, &strong, 1, 1).unwrap()[0]);
    assert_ne!(cube.drops(&sizes, &strong, 1, 0).unwrap()[0], cube.drops(&sizes, &strong, 2, 0).unwrap()[0]);
}

#[test]
fn spread_drops_fill_their_bin() {
    let cube = StreakCube { spread: true, edge: 3.0, ..StreakCube::default() };
    let [bin] = SizeBin::around(&[1.0])[..] else { panic!("one bin") };
    let drops = cube.drops(&DropSizeDistribution::marshall_palmer(20.0), &bin, 1, 0).unwrap();
    let diameters = drops.iter().map(|drop| drop.diameter_mm);
    let (least, most) = diameters.fold((f64::INFINITY, 0.0_f64), |(least, most), d| (least.min(d), most.max(d)));
    assert!((0.9..0.901).contains(&least) && (1.099..1.1).contains(&most), "{least} {most}");
    let mean = drops.iter().map(|drop| drop.diameter_mm).sum::<f64>() / drops.len() as f64;
    // Of exp(-2.1856 D) over the bin: slope times width squared over 12 below its middle.
    assert!((mean - (1.0 - 2.1856 * 0.04 / 12.0)).abs() < 0.002, "{mean}");
}

#[test]
fn any_shutter_gives_opacities() {
    for exposure in [1e-6, 1e-5, 0.5, 10.0] {
        let cube = StreakCube { exposure, size: 64, ..StreakCube::default() };
        let [bin] = SizeBin::around(&[2.0])[..] else { panic!("one bin") };
        let image = cube.draw(&cube.drops(&DropSizeDistribution::marshall_palmer(300.0), &bin, 1, 0).unwrap()).unwrap();
        assert!(image.pixels().iter().all(|[opacity]| (0.0..=1.0).contains(opacity)));
        assert!(sum(&image) > 0.0);
    }
}

#[test]
fn what_is_out_of_range_is_refused_with_its_name_and_limits() {
    let cube = StreakCube { size: 16, ..StreakCube::default() };
    let falling = drop(1.0, [0.2, 0.8, 0.5]);
    let refused = |quantity: StreakQuantity, result: Result<Image<1>, StreakTextureError>, value: f64| {
        let Err(StreakTextureError::OutOfRange { quantity: found, value: kept }) = result else {
            panic!("{quantity:?} of {value} must be refused")
        };
        assert_eq!(found, quantity);
        assert!(kept == value || kept.is_nan() && value.is_nan(), "{kept} {value}");
    };
    for value in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e30] {
        refused(StreakQuantity::Edge, StreakCube { edge: value, ..cube }.draw(&[falling]), value);
        refused(StreakQuantity::Exposure, StreakCube { exposure: value, ..cube }.draw(&[falling]), value);
        refused(StreakQuantity::DiameterMm, cube.draw(&[FallingDrop { diameter_mm: value, ..falling }]), value);
    }
    for size in [0, 4097, usize::MAX] {
        refused(StreakQuantity::Size, StreakCube { size, ..cube }.draw(&[]), size as f64);
    }
    for value in [-1.0, f64::NAN, f64::INFINITY, 1e30] {
        refused(StreakQuantity::Speed, cube.draw(&[FallingDrop { speed: value, ..falling }]), value);
        let mut image = cube.draw(&[]).unwrap();
        let speckled = cube.draw_speckled_over(&[falling], value, 1, &mut image);
        refused(StreakQuantity::Oscillation, speckled.map(|()| image), value);
    }
    for value in [f64::NAN, f64::NEG_INFINITY, 1e30] {
        let position = [0.2, value, 0.5];
        refused(StreakQuantity::Position, cube.draw(&[FallingDrop { position, ..falling }]), value);
    }
    let mut other = Image::filled(8, 16, [0.0]);
    let error = StreakTextureError::ImageSize { width: 8, height: 16, size: 16 };
    assert_eq!(cube.draw_over(&[falling], &mut other), Err(error));
    assert_eq!(cube.draw_speckled_over(&[falling], 0.5, 1, &mut other), Err(error));
    let message = StreakCube { exposure: -0.5, ..cube }.draw(&[]).unwrap_err().to_string();
    assert_eq!(message, "exposure: -0.5 s; allowed: 0.000001 to 10");
    // A drop at rest is drawn, also in its light.
    let resting = FallingDrop { speed: 0.0, ..falling };
    let mut image = cube.draw(&[resting]).unwrap();
    cube.draw_speckled_over(&[resting], 1.0, 1, &mut image).unwrap();
    assert!(image.pixels().iter().all(|[value]| (0.0..=1.0).contains(value)) && sum(&image) > 0.0);
}

#[test]
fn bins_that_make_no_sense_have_no_drops() {
    let cube = StreakCube { spread: true, ..StreakCube::default() };
    let sizes = DropSizeDistribution::marshall_palmer(10.0);
    let drops = |cube: StreakCube, sizes: &DropSizeDistribution, bin: SizeBin| cube.drops(sizes, &bin, 1, 0);
    let good = SizeBin { diameter_mm: 1.0, range_mm: [0.9, 1.1] };
    assert!(drops(cube, &sizes, good).is_ok_and(|drops| !drops.is_empty()));
    for range_mm in [[1.1, 0.9], [-1.0, 1.1], [f64::NAN, 1.1], [0.9, f64::NAN], [0.9, f64::INFINITY]] {
        let error = drops(cube, &sizes, SizeBin { range_mm, ..good }).unwrap_err();
        assert!(matches!(error, StreakTextureError::BinRange { .. }), "{error}");
    }
    let of = |result: Result<Vec<FallingDrop>, StreakTextureError>| match result.unwrap_err() {
        StreakTextureError::OutOfRange { quantity, .. } => quantity,
        other => panic!("{other}"),
    };
    assert_eq!(of(drops(cube, &sizes, SizeBin { diameter_mm: f64::NAN, ..good })), StreakQuantity::DiameterMm);
    let huge = StreakCube { edge: 100.0, ..cube };
    assert_eq!(of(drops(huge, &sizes, good)), StreakQuantity::MeanDropCount);
    // A rate that is not a number is no rain.
    assert_eq!(drops(cube, &DropSizeDistribution::marshall_palmer(f64::NAN), good), Ok(Vec::new()));
    assert_eq!(of(drops(StreakCube { size: 0, ..cube }, &sizes, good)), StreakQuantity::Size);
}

#[test]
fn lit_textures_are_opacity_times_the_radiance_of_a_drop() {
    let cube = StreakCube { size: 32, edge: 0.1, ..StreakCube::default() };
    let falling = drop(2.0, [0.05, 0.09, 0.05]);
    let phase_function = DropPhaseFunction::new();
    let opacity = cube.draw(&[falling]).unwrap();
    let lit = cube.draw_lit(&[falling], [0.0, 0.0, -2.0], &phase_function).unwrap();
    // From behind, the lamp shines straight through the drop.
    let expected = phase_function.phase(1.0).map(|phase| phase / (4.0 * PI) as f32);
    for ([opacity], lit) in opacity.pixels().iter().zip(lit.pixels()) {
        assert_eq!(*lit, expected.map(|radiance| radiance * opacity));
    }
    assert!(lit.pixels().iter().any(|pixel| pixel[1] > 0.0));
    for toward in [[0.0; 3], [f64::NAN, 0.0, 1.0], [f64::INFINITY, 0.0, 0.0]] {
        let refused = cube.draw_lit(&[falling], toward, &phase_function);
        assert_eq!(refused, Err(StreakTextureError::LightDirection), "{toward:?}");
    }
}
