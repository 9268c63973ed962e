use bansho_base::math::random::{Key, Purpose};

use super::*;
use crate::{
    VelocityLaw,
    drops::terminal_velocity::FallAir,
    tests::reference::{fields, near, rows},
};

/// A straight line from 10 drops at 1 mm to 30 at 3 mm.
fn ramp() -> DropSizeDistribution {
    DropSizeDistribution::Table(SizeTable::new(vec![[1.0, 10.0], [3.0, 30.0]]).expect("a table"))
}

#[test]
fn counts_are_those_of_the_reference() {
    for [rate, diameter, slope, density, midpoint, around, above] in
        rows::<7>(include_str!("../../../data/marshall_palmer_bins.csv"))
    {
        let sizes = DropSizeDistribution::marshall_palmer(rate);
        let DropSizeDistribution::Exponential { slope_per_mm } = sizes else { panic!("not exponential") };
        assert!(near(slope_per_mm, slope, 1e-5) && near(sizes.density(diameter), density, 1e-5));
        let [bin] = SizeBin::around(&[diameter])[..] else { panic!("one bin") };
        assert!(near(sizes.density(diameter) * bin.width_mm(), midpoint, 1e-5));
        assert!(near(bin.count(&sizes), around, 1e-5), "{rate} mm/h, {diameter} mm");
        assert!(near(sizes.count([diameter, diameter + 0.2]), above, 1e-5));
    }
    let drops = DropSizeDistribution::marshall_palmer(20.0).count([0.9, 2.1]);
    bansho_base::assert_measured!("equation (1): drops of 0.9 to 2.1 mm in 1 m^3 at 20 mm/h", drops, 475.0, 0.5);
}

#[test]
fn rain_rates_water_and_shares_are_those_of_the_reference() {
    for line in include_str!("../../../data/marshall_palmer_rain_rate.csv").lines().skip(1) {
        let [rate, law, whole, _, to_six, _, drops, water, share] = fields::<9>(line);
        let [rate, whole, to_six, drops, water, share] =
            [rate, whole, to_six, drops, water, share].map(|field| field.parse::<f64>().expect("a number"));
        let law = match law {
            "formula" => VelocityLaw::RigidSphere,
            "gunn_kinzer1949" => VelocityLaw::GunnKinzer,
            _ => continue,
        };
        let (sizes, fall) =
            (DropSizeDistribution::marshall_palmer(rate), TerminalVelocity { law, air: FallAir::default() });
        assert!(near(sizes.count(DropSizeDistribution::ALL), drops, 1e-4) && near(sizes.liquid_water(), water, 1e-4));
        assert!(near(sizes.rain_rate(&fall, DropSizeDistribution::ALL), whole, 2e-3), "{line}");
        assert!(near(sizes.rain_rate(&fall, [0.0, 6.0]), to_six, 2e-3), "{line}");
        let bins = sizes.rain_rate(&fall, [0.9, 2.1]) / sizes.rain_rate(&fall, DropSizeDistribution::ALL);
        assert!(near(bins, share, 3e-3), "{line}: {bins}");
    }
}

#[test]
fn twenty_times_the_rain_has_ten_times_the_drops_of_the_papers_bins() {
    let bins = SizeBin::around(&[1.0, 1.2, 1.4, 1.6, 1.8, 2.0]);
    let drops = |rate| bins.iter().map(|bin| bin.count(&DropSizeDistribution::marshall_palmer(rate))).sum::<f64>();
    assert!(near(drops(20.0) / drops(1.0), 10.0, 0.05), "{}", drops(20.0) / drops(1.0));
    assert!(near(drops(20.0), DropSizeDistribution::marshall_palmer(20.0).count([0.9, 2.1]), 1e-12));
}

#[test]
fn no_rain_has_no_drops() {
    for sizes in [DropSizeDistribution::marshall_palmer(0.0), DropSizeDistribution::marshall_palmer(-1.0)] {
        assert_eq!((sizes.count(DropSizeDistribution::ALL), sizes.density(1.0), sizes.density(0.0)), (0.0, 0.0, 0.0));
        assert_eq!(
            (sizes.rain_rate(&TerminalVelocity::default(), DropSizeDistribution::ALL), sizes.quantile(0.5, [1.0, 2.0])),
            (0.0, 1.0)
        );
    }
}

#[test]
fn half_the_water_is_below_the_median_volume_diameter() {
    // Known of exponential distributions: 3.672 / slope.
    let sizes = DropSizeDistribution::marshall_palmer(5.0);
    assert!(near(sizes.median_volume_diameter(), 3.672 / 2.92415, 1e-3));
    assert_eq!(DropSizeDistribution::marshall_palmer(0.0).median_volume_diameter(), 0.0);
}

#[test]
fn moments_of_a_table_are_exact() {
    // Worked by hand: n = 10 D from 1 to 3 mm. Integral n: 40; n D: 10 (27 - 1)/3; n D^2: 10 (81 - 1)/4.
    let sizes = ramp();
    assert!(near(sizes.count(DropSizeDistribution::ALL), 40.0, 1e-12));
    assert!(near(sizes.moment(1, DropSizeDistribution::ALL), 260.0 / 3.0, 1e-12));
    assert!(near(sizes.moment(2, [0.0, 9.0]), 200.0, 1e-12));
    // From 2 to 3 mm: 5 (9 - 4).
    assert!(near(sizes.count([2.0, 3.0]), 25.0, 1e-12));
    assert_eq!([0.5, 1.0, 2.0, 3.0, 3.1].map(|d| sizes.density(d)), [0.0, 10.0, 20.0, 30.0, 0.0]);
}

#[test]
fn quantiles_invert_counts() {
    for sizes in [DropSizeDistribution::marshall_palmer(10.0), ramp()] {
        for range in [[0.5, 6.0], [1.1, 1.3], DropSizeDistribution::ALL] {
            for u in [0.0, 0.1, 0.5, 0.9, 0.999] {
                let diameter = sizes.quantile(u, range);
                let share = sizes.count([range[0], diameter]) / sizes.count(range);
                assert!((share - u).abs() < 1e-9, "{sizes:?} {range:?}: {share} for {u}");
            }
        }
    }
}

#[test]
fn tables_that_make_no_sense_are_refused() {
    assert_eq!(SizeTable::new(vec![[1.0, 1.0]]), Err(SizeTableError::TooShort));
    let falling = SizeTable::new(vec![[2.0, 1.0], [2.0, 1.0]]);
    assert_eq!(falling, Err(SizeTableError::Diameter { index: 1, diameter_mm: 2.0 }));
    assert!(matches!(SizeTable::new(vec![[-1.0, 1.0], [2.0, 1.0]]), Err(SizeTableError::Diameter { index: 0, .. })));
    let negative = SizeTable::new(vec![[1.0, 1.0], [2.0, -1.0]]);
    assert_eq!(negative, Err(SizeTableError::Density { diameter_mm: 2.0, density: -1.0 }));
}

#[test]
fn bins_meet_between_their_neighbors() {
    let bins = SizeBin::around(&[1.0, 1.2, 2.0]);
    let ranges: Vec<[f64; 2]> = bins.iter().map(|bin| bin.range_mm).collect();
    for (found, expected) in ranges.iter().zip([[0.9, 1.1], [1.1, 1.6], [1.6, 2.4]]) {
        assert!(near(found[0], expected[0], 1e-12) && near(found[1], expected[1], 1e-12), "{found:?}");
    }
    // No drop is smaller than none.
    assert_eq!(SizeBin::around(&[0.05])[0].range_mm, [0.0, 0.15000000000000002]);
    assert!(SizeBin::around(&[]).is_empty());
}

#[test]
fn the_fractional_part_of_a_count_is_a_chance() {
    let key = Key::new(1, "rain");
    let words = |i: u64| key.words(i, 0, Purpose::named("count"));
    let counts: Vec<u64> = (0..20_000).map(|i| stratified_count(2.3, 0, [words(i)[0], words(i)[1]])).collect();
    assert!(counts.iter().all(|count| (2..=3).contains(count)));
    let mean = counts.iter().sum::<u64>() as f64 / counts.len() as f64;
    // Four standard errors of a chance of 0.3.
    assert!((mean - 2.3).abs() < 4.0 * 0.46 / 141.0, "{mean}");
    // Ten volumes together hold 4.5 to within two, wherever they begin.
    for first in [0, 7, 1000] {
        let whole: u64 = (first..first + 10).map(|index| stratified_count(0.45, index, [77, 5])).sum();
        assert!((3..=6).contains(&whole), "{whole}");
    }
    let rising: Vec<u64> = (0..200).map(|i| stratified_count(0.05 * i as f64, 3, [9, 9])).collect();
    assert!(rising.is_sorted());
    assert_eq!(stratified_count(f64::NAN, 0, [1, 1]), 0);
}
