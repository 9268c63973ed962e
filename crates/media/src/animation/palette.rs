//! One palette for a whole animation, from the colours of all its frames.
//!
//! Boxes of a colour histogram are split where their spread is greatest (after X. Wu, "Efficient statistical computations
//! for optimal color quantization", 1991), then moved to the means of the colours nearest to them (Lloyd). Everything
//! begins from integer counts, so that neither threads nor the order of frames can change the outcome.

use rayon::prelude::*;

/// Bits kept of each channel.
const BITS: usize = 6;
/// Bins of the histogram.
const BINS: usize = 1 << (3 * BITS);
/// Rounds of moving colours to the means of their neighbourhoods.
const ROUNDS: usize = 3;
/// How much the eye minds an error in red, green and blue.
const WEIGHTS: [f32; 3] = [3.0, 4.0, 2.0];

/// How often each colour occurs.
#[derive(Clone, Debug)]
pub(crate) struct Histogram(Vec<u64>);

impl Histogram {
    pub(crate) fn new() -> Self {
        Self(vec![0; BINS])
    }

    /// Counts a colour.
    pub(crate) fn count(&mut self, colour: [u8; 3]) {
        self.0[bin(colour)] += 1;
    }

    /// Adds the counts of another histogram.
    pub(crate) fn merge(&mut self, other: &Self) {
        self.0.iter_mut().zip(&other.0).for_each(|(sum, count)| *sum += count);
    }

    fn colours(&self) -> Vec<Weighted> {
        let occupied = self.0.iter().enumerate().filter(|(_, count)| **count > 0);
        // By the root of their number: a bright core of few pixels must not lose to the many of the glow around it.
        occupied.map(|(bin, &count)| Weighted { colour: centre(bin), weight: (count as f64).sqrt() as f32 }).collect()
    }
}

fn bin([r, g, b]: [u8; 3]) -> usize {
    let part = |channel: u8| usize::from(channel) >> (8 - BITS);
    (part(r) << (2 * BITS)) | (part(g) << BITS) | part(b)
}

/// The colour in the middle of a bin; black and full are kept exactly.
fn centre(bin: usize) -> [f32; 3] {
    [2, 1, 0].map(|channel| {
        let level = (bin >> (channel * BITS)) & ((1 << BITS) - 1);
        level as f32 * (255.0 / ((1 << BITS) - 1) as f32)
    })
}

#[derive(Clone, Copy, Debug)]
struct Weighted {
    colour: [f32; 3],
    weight: f32,
}

/// Colours that share a palette entry while the palette is built.
struct Cell {
    colours: Vec<Weighted>,
    /// Axis of the greatest spread, mean along it, and spread times weight.
    axis: usize,
    mean: f32,
    spread: f32,
}

impl Cell {
    fn new(colours: Vec<Weighted>) -> Self {
        let total: f32 = colours.iter().map(|entry| entry.weight).sum();
        let along = |axis: usize| {
            let sum: f32 = colours.iter().map(|entry| entry.weight * entry.colour[axis]).sum();
            let mean = sum / total.max(f32::MIN_POSITIVE);
            let square = |entry: &Weighted| entry.weight * (entry.colour[axis] - mean) * (entry.colour[axis] - mean);
            (axis, mean, WEIGHTS[axis] * colours.iter().map(square).sum::<f32>())
        };
        let [a, b, c] = [0, 1, 2].map(along);
        let (axis, mean, spread) = [b, c].into_iter().fold(a, |best, next| if next.2 > best.2 { next } else { best });
        Self { colours, axis, mean, spread }
    }

    fn split(self) -> [Self; 2] {
        let (axis, mean) = (self.axis, self.mean);
        let (low, high) = self.colours.into_iter().partition(|entry| entry.colour[axis] <= mean);
        [Self::new(low), Self::new(high)]
    }

    fn centroid(&self) -> [f32; 3] {
        mean(&self.colours).unwrap_or([0.0; 3])
    }
}

fn mean(colours: &[Weighted]) -> Option<[f32; 3]> {
    let total: f32 = colours.iter().map(|entry| entry.weight).sum();
    let along = |axis: usize| colours.iter().map(|entry| entry.weight * entry.colour[axis]).sum::<f32>() / total;
    (total > 0.0).then(|| [0, 1, 2].map(along))
}

/// Up to `size` colours that stand for all that were counted; at least one.
pub(crate) fn palette(histogram: &Histogram, size: usize) -> Vec<[u8; 3]> {
    let colours = histogram.colours();
    let mut cells = vec![Cell::new(colours.clone())];
    while cells.len() < size {
        let widest =
            (0..cells.len()).fold(0, |best, next| if cells[next].spread > cells[best].spread { next } else { best });
        if cells[widest].spread <= 0.0 {
            break;
        }
        let halves = cells.swap_remove(widest).split();
        cells.extend(halves);
    }
    let mut entries: Vec<[f32; 3]> = cells.iter().map(Cell::centroid).collect();
    for _ in 0..ROUNDS {
        entries = moved_to_means(&colours, &entries);
    }
    entries.into_iter().map(|colour| colour.map(|channel| (channel.clamp(0.0, 255.0) + 0.5) as u8)).collect()
}

fn moved_to_means(colours: &[Weighted], entries: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let mut groups = vec![Vec::new(); entries.len()];
    colours.iter().for_each(|entry| groups[nearest(entry.colour, entries)].push(*entry));
    groups.iter().zip(entries).map(|(group, entry)| mean(group).unwrap_or(*entry)).collect()
}

/// Squared difference as the eye weighs it.
fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    (0..3).map(|axis| WEIGHTS[axis] * (a[axis] - b[axis]) * (a[axis] - b[axis])).sum()
}

/// The entry nearest to `colour`, the first of several as near.
fn nearest(colour: [f32; 3], entries: &[[f32; 3]]) -> usize {
    let mut best = (0, f32::INFINITY);
    for (index, entry) in entries.iter().enumerate() {
        let distance = distance(colour, *entry);
        if distance < best.1 {
            best = (index, distance);
        }
    }
    best.0
}

/// Two entries of the palette between which a colour lies.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Pair {
    near: u8,
    far: u8,
}

/// Turns colours into palette entries, dithered by an ordered pattern that stands still from frame to frame.
pub(crate) struct Ditherer {
    entries: Vec<[f32; 3]>,
    pairs: Vec<Pair>,
}

/// How much a pair of unlike colours is worse than one of like colours with the same mean: dots must not stand out.
const DOT_PENALTY: f32 = 0.15;

impl Ditherer {
    /// Finds for every colour that was counted the pair to mix it from. `palette` has 1 to 256 entries.
    pub(crate) fn new(palette: &[[u8; 3]], histogram: &Histogram) -> Self {
        let entries: Vec<[f32; 3]> = palette.iter().take(256).map(|colour| colour.map(f32::from)).collect();
        let counts = histogram.0.par_iter().enumerate().with_min_len(1024);
        let pair_of =
            |(bin, &count): (usize, &u64)| if count > 0 { pair(centre(bin), &entries) } else { Pair::default() };
        let pairs = counts.map(pair_of).collect();
        Self { entries, pairs }
    }

    /// The entry for `colour` at column `x`, row `y`.
    #[inline]
    pub(crate) fn index(&self, colour: [u8; 3], x: usize, y: usize) -> u8 {
        let Pair { near, far } = self.pairs[bin(colour)];
        let share = share(colour.map(f32::from), self.entries[usize::from(near)], self.entries[usize::from(far)]);
        if share > BAYER[y & 7][x & 7] { far } else { near }
    }
}

/// How much of `far` must be mixed with `near` to come nearest to `colour`, from 0 to 1.
fn share(colour: [f32; 3], near: [f32; 3], far: [f32; 3]) -> f32 {
    let (mut along, mut length) = (0.0, 0.0);
    for axis in 0..3 {
        let step = far[axis] - near[axis];
        along += WEIGHTS[axis] * step * (colour[axis] - near[axis]);
        length += WEIGHTS[axis] * step * step;
    }
    if length > 0.0 { (along / length).clamp(0.0, 1.0) } else { 0.0 }
}

fn pair(colour: [f32; 3], entries: &[[f32; 3]]) -> Pair {
    let near = nearest(colour, entries);
    let (start, mut best) = (entries[near], (near, f32::INFINITY));
    for (far, &end) in entries.iter().enumerate().filter(|(far, _)| *far != near) {
        let t = share(colour, start, end);
        let mixed = std::array::from_fn(|axis| (end[axis] - start[axis]).mul_add(t, start[axis]));
        let error = distance(colour, mixed) + DOT_PENALTY * t * (1.0 - t) * distance(start, end);
        if error < best.1 {
            best = (far, error);
        }
    }
    Pair { near: near as u8, far: best.0 as u8 }
}

/// Bayer's matrix of 8 x 8: each threshold once, spread as evenly as can be.
const BAYER: [[f32; 8]; 8] = bayer();

const fn bayer() -> [[f32; 8]; 8] {
    let mut matrix = [[0.0; 8]; 8];
    let mut place = 0;
    while place < 64 {
        let (x, y) = (place % 8, place / 8);
        let (mut rank, mut bit) = (0, 0);
        while bit < 3 {
            // The bits of x xor y and of y, interleaved and reversed.
            rank = (rank << 2) | ((((x ^ y) >> bit) & 1) << 1) | ((y >> bit) & 1);
            bit += 1;
        }
        matrix[y][x] = (rank as f32 + 0.5) / 64.0;
        place += 1;
    }
    matrix
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counted(colours: &[([u8; 3], usize)]) -> Histogram {
        let mut histogram = Histogram::new();
        for (colour, times) in colours {
            (0..*times).for_each(|_| histogram.count(*colour));
        }
        histogram
    }

    #[test]
    fn few_colours_are_kept_exactly_however_rare() {
        let histogram = counted(&[([0, 0, 0], 100_000), ([255, 255, 255], 1), ([255, 0, 0], 3)]);
        let mut palette = palette(&histogram, 256);
        palette.sort();
        assert_eq!(palette, [[0, 0, 0], [255, 0, 0], [255, 255, 255]]);
    }

    #[test]
    fn a_ramp_of_fire_is_covered_within_two_codes() {
        let fire = |heat: usize| [heat.min(255) as u8, (heat * heat / 300).min(255) as u8, (heat / 5) as u8];
        let histogram = counted(&(0..256).map(|heat| (fire(heat), 10)).collect::<Vec<_>>());
        let palette: Vec<[f32; 3]> = palette(&histogram, 255).into_iter().map(|colour| colour.map(f32::from)).collect();
        for heat in 0..256 {
            let colour = fire(heat).map(f32::from);
            let found = palette[nearest(colour, &palette)];
            assert!((0..3).all(|axis| (found[axis] - colour[axis]).abs() <= 4.5), "{colour:?} {found:?}");
        }
    }

    #[test]
    fn dither_keeps_the_mean_and_stands_still() {
        let levels = [0_u8, 16, 64, 100, 128, 200, 250];
        let histogram = counted(&levels.map(|level| ([level; 3], 1)));
        let ditherer = Ditherer::new(&[[0, 0, 0], [255, 255, 255]], &histogram);
        for level in levels {
            let at = |x: usize, y: usize| u32::from(ditherer.index([level; 3], x, y));
            let on: u32 = (0..64).map(|place| at(place % 8, place / 8)).sum();
            assert!((on as f32 / 64.0 - f32::from(level) / 255.0).abs() <= 1.0 / 64.0, "{level}: {on}");
            assert_eq!(at(3, 5), at(11, 13));
        }
        assert_eq!(ditherer.index([0; 3], 0, 0), 0);
    }

    #[test]
    fn the_dither_matrix_holds_each_threshold_once() {
        let mut ranks: Vec<usize> = BAYER.as_flattened().iter().map(|value| (value * 64.0) as usize).collect();
        ranks.sort();
        assert!(ranks.into_iter().eq(0..64));
    }

    #[test]
    fn an_empty_histogram_still_has_a_palette() {
        assert_eq!(palette(&Histogram::new(), 256), [[0, 0, 0]]);
    }
}
