use super::*;
use crate::math::{
    random::{Key, Purpose},
    simd,
};

const DETAILED: Fractal = Fractal { octaves: 6, lacunarity: 2, gain: 0.6 };

fn noise<const N: usize>(seed: u32, fractal: Fractal, periods: [u32; N]) -> Noise<N>
where
    [f32; N]: Dimension<Cells = [u32; N]>,
{
    Noise::new(seed, fractal, periods).unwrap()
}

/// Even random points over 2^16 cells a side.
fn random_point<const N: usize>(index: u64) -> [Coordinate; N] {
    let key = Key::new(17, "noise");
    let (cells, fractions) = (key.words(index, 0, Purpose(0)), key.uniforms(index, 1, Purpose(0)));
    std::array::from_fn(|axis| Coordinate { cell: (cells[axis] as i32) >> 16, fraction: fractions[axis] })
}

fn point<const N: usize>(x: [f64; N]) -> [Coordinate; N] {
    x.map(Coordinate::from_f64)
}

fn assert_moments<const N: usize>()
where
    [f32; N]: Dimension<Cells = [u32; N]>,
{
    let (single, count) = (noise::<N>(3, Fractal::SINGLE, [0; N]), 200_000);
    let (mut sum, mut squares, mut extreme) = (0.0, 0.0, 0_f64);
    for index in 0..count {
        let value = single.at(random_point(index)) as f64;
        (sum, squares, extreme) = (sum + value, squares + value * value, extreme.max(value.abs()));
    }
    let (mean, variance) = (sum / count as f64, squares / count as f64);
    assert!(extreme <= 1.0 && extreme > 0.55, "{N}: {extreme}");
    assert!(mean.abs() < 4.0 * (VARIANCE[N - 2] / count as f64).sqrt(), "{N}: {mean}");
    assert!((variance / VARIANCE[N - 2] - 1.0).abs() < 0.01, "{N}: {variance}");
}

#[test]
fn values_lie_within_one_with_mean_zero_and_the_stated_variance() {
    assert_moments::<2>();
    assert_moments::<3>();
    assert_moments::<4>();
}

#[test]
fn octaves_have_the_stated_standard_deviation() {
    for fractal in [Fractal { octaves: 3, lacunarity: 2, gain: 0.6 }, Fractal { octaves: 6, lacunarity: 2, gain: 0.8 }]
    {
        let (noise, count) = (noise::<3>(5, fractal, [0; 3]), 100_000);
        let mut squares = 0.0;
        for index in 0..count {
            let value = f64::from(noise.at(random_point(index)));
            squares += value * value;
        }
        let found = (squares / count as f64).sqrt();
        assert!((found / fractal.standard_deviation(3) - 1.0).abs() < 0.02, "{fractal:?}: {found}");
    }
    // Weights of 1/1.5 and 0.5/1.5 of equal variances.
    let two = Fractal { octaves: 2, lacunarity: 2, gain: 0.5 };
    assert!((two.standard_deviation(2) - (VARIANCE[0] * 1.25).sqrt() / 1.5).abs() < 1e-12);
}

#[test]
fn stated_variances_are_those_of_the_formula() {
    // Exact integrals of the fade's polynomial: of s^2, s^2 f and s^2 f^2.
    let s2 = 36.0 / 11.0 - 180.0 / 10.0 + 345.0 / 9.0 - 300.0 / 8.0 + 100.0 / 7.0;
    let s2f = 36.0 / 12.0 - 180.0 / 11.0 + 345.0 / 10.0 - 300.0 / 9.0 + 100.0 / 8.0;
    let s2ff = 36.0 / 13.0 - 180.0 / 12.0 + 345.0 / 11.0 - 300.0 / 10.0 + 100.0 / 9.0;
    // By f -> 1 - f the integrals of (1 - s)^2 f^2 are those of s^2 (1 - f)^2.
    let (a, b) = (2.0 * (s2 - 2.0 * s2f + s2ff), 2.0 * s2);
    for (stated, n) in VARIANCE.iter().zip([2.0_f64, 3.0, 4.0]) {
        let exact = 4.0 / n * a * (0..n as u32 - 1).map(|_| b).product::<f64>();
        assert!((stated - exact).abs() < 1e-6, "{n}: {exact}");
    }
}

#[test]
fn vector_rows_and_lanes_give_the_bytes_of_single_points() {
    let noise = noise::<3>(5, DETAILED, [0, 7, 12]);
    let along: Vec<f32> = (0..67).map(|i| i as f32 * 0.37 - 9.0).collect();
    let origin = point([1e6 + 0.3, -4.7, 1e9 + 0.25]);
    for level in simd::available_levels() {
        let mut row = vec![0.0; 67];
        noise.row(level, origin, &along, &mut row);
        for (distance, value) in along.iter().zip(&row) {
            let single = noise.at([origin[0].offset_by(*distance), origin[1], origin[2]]);
            assert_eq!(single.to_bits(), value.to_bits(), "{level:?}");
        }
    }
}

fn assert_lanes<const N: usize>(periods: [u32; N])
where
    [f32; N]: Dimension<Cells = [u32; N]>,
{
    let noise = noise::<N>(6, DETAILED, periods);
    for (start, level) in (0..500).zip(simd::available_levels().cycle()) {
        let points: [[Coordinate; N]; LANES] = std::array::from_fn(|lane| random_point(start * 16 + lane as u64));
        let cells = std::array::from_fn(|axis| std::array::from_fn(|lane| points[lane][axis].cell));
        let fractions = std::array::from_fn(|axis| std::array::from_fn(|lane| points[lane][axis].fraction));
        let vector = dispatch!(level, _simd => noise.lanes(&cells, &fractions));
        assert_eq!(vector.map(f32::to_bits), points.map(|point| noise.at(point).to_bits()));
    }
}

#[test]
fn lanes_agree_in_every_dimension() {
    assert_lanes::<2>([0, 9]);
    assert_lanes::<3>([0, 0, 0]);
    assert_lanes::<4>([3, 0, 0, 11]);
}

#[test]
fn periodic_axes_repeat_exactly_and_others_do_not() {
    let noise = noise::<3>(8, DETAILED, [0, 5, 3]);
    let mut differing = 0;
    for index in 0..2000 {
        let here = random_point::<3>(index);
        let moved = |axis: usize, cells: i32| {
            let mut there = here;
            there[axis].cell += cells;
            noise.at(there)
        };
        assert_eq!(moved(1, 5), noise.at(here));
        assert_eq!(moved(1, -500), noise.at(here));
        assert_eq!(moved(2, 3 << 20), noise.at(here));
        differing += (moved(1, 4) != noise.at(here)) as u32 + (moved(0, 5) != noise.at(here)) as u32;
    }
    assert!(differing > 3990, "{differing}");
}

#[test]
fn seams_of_periods_and_of_the_32_bit_lattice_are_smooth() {
    let tiled = noise::<2>(8, DETAILED, [4, 0]);
    for i in 0..200 {
        let y = i as f64 * 0.173;
        let (before, after) = (tiled.at(point([4.0 - 1e-6, y])), tiled.at(point([0.0, y])));
        assert!((before - after).abs() < 1e-4);
        let (before, after) = (tiled.at(point([1.3, 2_147_483_648.0 - 1e-6])), tiled.at(point([1.3, 2_147_483_648.0])));
        assert!((before - after).abs() < 1e-4);
        assert_eq!(tiled.at(point([1.5, y.floor() + 4_294_967_296.0])), tiled.at(point([1.5, y.floor()])));
    }
}

#[test]
fn first_and_second_derivatives_are_continuous_across_cells() {
    let noise = noise::<2>(2, Fractal::SINGLE, [0, 0]);
    // The lattice lines lie where the first octave's shift puts them.
    let shift = noise.octaves[0].shift[0] as f64;
    let f = |x: f64, y: f64| noise.at(point([x - shift, y])) as f64;
    for i in 0..300 {
        // A fade with a jump in its second derivative would show up to 12 here.
        let (line, y, h) = ((i % 17 + 3) as f64, i as f64 * 0.37, 1.0 / 256.0);
        let slope = |x: f64| (f(x + h, y) - f(x - h, y)) / (2.0 * h);
        let bend = |x: f64| (f(x + h, y) - 2.0 * f(x, y) + f(x - h, y)) / (h * h);
        assert!((slope(line - h) - slope(line + h)).abs() < 0.03, "{line} {y}");
        assert!((bend(line - h) - bend(line + h)).abs() < 1.0, "{line} {y}: {} {}", bend(line - h), bend(line + h));
    }
}

/// Mean square of the difference of values `distance` apart in the direction (`x`, `y`).
fn structure(noise: &Noise<3>, [x, y, z]: [f64; 3], distance: f64) -> f64 {
    let length = (x * x + y * y + z * z).sqrt();
    let step = [x, y, z].map(|component| (component / length * distance) as f32);
    let count = 25_000;
    let square = |index: u64| {
        let here = random_point::<3>(index);
        let there = std::array::from_fn(|axis| here[axis].offset_by(step[axis]));
        let difference = (noise.at(there) - noise.at(here)) as f64;
        difference * difference
    };
    (0..count).map(square).sum::<f64>() / count as f64
}

#[test]
fn differences_grow_alike_in_every_direction() {
    let noise = noise::<3>(12, DETAILED, [0; 3]);
    for distance in [0.03, 0.2, 0.5] {
        let along = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|axis| structure(&noise, axis, distance));
        let across = [[1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 1.0], [-1.0, 1.0, 1.0]]
            .map(|axis| structure(&noise, axis, distance));
        let all = [along.as_slice(), &across].concat();
        let (low, high) = all.iter().fold((f64::INFINITY, 0_f64), |(low, high), &x| (low.min(x), high.max(x)));
        assert!(high / low < 1.12, "{distance}: {all:?}");
    }
}

#[test]
fn octaves_leave_no_trace_of_the_lattice() {
    // Variance by the position inside a cell: alone an octave falls to 0 at its corners; shifted octaves together must not.
    let noise = noise::<2>(12, Fractal { octaves: 5, lacunarity: 2, gain: 0.7 }, [0; 2]);
    let variance = |x: f32, y: f32| {
        let square = |index: u64| {
            let [a, b] = random_point::<2>(index);
            let value = noise.at([Coordinate { fraction: x, ..a }, Coordinate { fraction: y, ..b }]) as f64;
            value * value
        };
        (0..4000).map(square).sum::<f64>() / 4000.0
    };
    let all: Vec<f64> = (0..64).map(|i| variance((i % 8) as f32 / 8.0, (i / 8) as f32 / 8.0)).collect();
    let mean = all.iter().sum::<f64>() / 64.0;
    assert!(all.iter().all(|&variance| variance > 0.3 * mean && variance < 2.0 * mean), "{mean} {all:?}");
}

#[test]
fn seeds_and_cells_are_uncorrelated() {
    let noises = [1, 2].map(|seed| noise::<2>(seed, Fractal::SINGLE, [0; 2]));
    let count = 100_000;
    let (mut seeds, mut cells) = (0.0, 0.0);
    for index in 0..count {
        let here = random_point::<2>(index);
        let there = [Coordinate { cell: here[0].cell + 2, ..here[0] }, here[1]];
        let value = noises[0].at(here) as f64;
        seeds += value * noises[1].at(here) as f64;
        cells += value * noises[0].at(there) as f64;
    }
    let limit = 4.0 * VARIANCE[0] * (count as f64).sqrt() * 1.6;
    assert!(seeds.abs() < limit && cells.abs() < limit, "{seeds} {cells} {limit}");
}

#[test]
fn coordinates_split_and_advance_without_loss() {
    assert_eq!(Coordinate::from_f64(-0.25), Coordinate { cell: -1, fraction: 0.75 });
    assert_eq!(Coordinate::from_f64(4_294_967_296.0 + 2.5), Coordinate { cell: 2, fraction: 0.5 });
    assert_eq!(Coordinate::from_f64(3_000_000_000.5), Coordinate { cell: 3_000_000_000_u32 as i32, fraction: 0.5 });
    assert_eq!(Coordinate::from_f64(f64::NAN), Coordinate { cell: 0, fraction: 0.0 });
    assert_eq!(Coordinate::from_f64(f64::INFINITY).fraction, 0.0);
    assert_eq!(Coordinate::from_f32(-1.5), Coordinate { cell: -2, fraction: 0.5 });
    assert_eq!(Coordinate::from_f32(2.75).offset_by(-3.5), Coordinate { cell: -1, fraction: 0.25 });
    for distance in [-1_073_741_824.0_f32, -70_000.5, -65_536.0, 65_535.5, 123_456.75, 999_999_936.0] {
        let cell = 2 + distance.floor() as i32 + i32::from(0.75 + distance - distance.floor() >= 1.0);
        assert_eq!(Coordinate::from_f32(2.75).offset_by(distance).cell, cell, "{distance}");
    }
    assert_eq!(
        [reduce(-1, 5), reduce(7, 5), reduce(-10, 5), reduce(i32::MIN, 3), reduce(-1, 0)],
        [4, 2, 0, 1, u32::MAX]
    );
    assert_eq!([reduce(i32::MAX, 1 << 31), reduce(-1, 1 << 31)], [i32::MAX as u32, (1 << 31) - 1]);
}

#[test]
fn faulty_parameters_are_named() {
    let error = |fractal: Fractal, period: u32| Noise::<2>::new(0, fractal, [period, 0]).unwrap_err();
    assert_eq!(error(Fractal { octaves: 0, ..DETAILED }, 0), NoiseError::Octaves(0));
    assert_eq!(error(Fractal { lacunarity: 17, ..DETAILED }, 0), NoiseError::Lacunarity(17));
    assert_eq!(error(Fractal { gain: -1.0, ..DETAILED }, 0), NoiseError::Gain(-1.0));
    assert_eq!(error(DETAILED, 1 << 27), NoiseError::Period { period: 1 << 27, octaves: 6 });
    assert!(Noise::<2>::new(0, Fractal { octaves: 16, lacunarity: 16, gain: 1.0 }, [0, 0]).is_ok());
    assert!(matches!(error(Fractal { gain: f32::NAN, ..DETAILED }, 0), NoiseError::Gain(_)));
}
