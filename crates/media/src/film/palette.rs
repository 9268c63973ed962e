//! One palette for a whole animation, from the colors of all its frames.
//!
//! Boxes of a color histogram are split along the axis of largest variance (after X. Wu, "Efficient statistical computations for optimal
//! color quantization", 1991); then the entries are refined by k-means (Lloyd). All sums start from integer counts, so that the result
//! depends neither on threads nor on the order of frames.

use rayon::prelude::*;

/// Bits kept of each channel.
const BITS: usize = 6;
/// Bins of the histogram.
const BINS: usize = 1 << (3 * BITS);
/// Codes of a channel per bin.
const BIN_WIDTH: u8 = 1 << (8 - BITS);
/// Steps of k-means.
const KMEANS_STEPS: usize = 3;
/// Perceptual weights of errors in red, green and blue.
const CHANNEL_WEIGHTS: [f32; 3] = [3.0, 4.0, 2.0];

/// Number of colors in a bin, and sums of their channels relative to the lowest codes of the bin.
#[derive(Clone, Copy, Debug, Default)]
struct Bin<N> {
    count: N,
    offset_sums: [N; 3],
}

impl Bin<u64> {
    /// Mean of the colors of a nonempty bin. The center of the bin would not suffice: night skies have colors of few bins, and would become
    /// darker or brighter as a whole.
    fn mean(&self, index: usize) -> [f32; 3] {
        std::array::from_fn(|axis| {
            (f64::from(bin_min_code(index, axis)) + self.offset_sums[axis] as f64 / self.count as f64) as f32
        })
    }
}

/// How often each color occurs in a frame.
#[derive(Clone, Debug)]
pub(crate) struct FrameHistogram(Vec<Bin<u32>>);

impl FrameHistogram {
    pub(crate) fn new() -> Self {
        Self(vec![Bin::default(); BINS])
    }

    /// Counts a color.
    pub(crate) fn count(&mut self, color: [u8; 3]) {
        let bin = &mut self.0[histogram_bin(color)];
        bin.count = bin.count.saturating_add(1);
        for (sum, code) in bin.offset_sums.iter_mut().zip(color) {
            *sum = sum.saturating_add(u32::from(code % BIN_WIDTH));
        }
    }
}

/// How often each color occurs in a film.
#[derive(Clone, Debug)]
pub(crate) struct Histogram(Vec<Bin<u64>>);

impl Histogram {
    pub(crate) fn new() -> Self {
        Self(vec![Bin::default(); BINS])
    }

    /// Adds the colors of a frame.
    pub(crate) fn add(&mut self, frame: &FrameHistogram) {
        for (sum, bin) in self.0.iter_mut().zip(&frame.0).filter(|(_, bin)| bin.count > 0) {
            sum.count += u64::from(bin.count);
            (0..3).for_each(|axis| sum.offset_sums[axis] += u64::from(bin.offset_sums[axis]));
        }
    }

    fn colors(&self) -> Vec<WeightedColor> {
        let mut colors = Vec::new();
        for (index, bin) in self.0.iter().enumerate().filter(|(_, bin)| bin.count > 0) {
            // Weighted by the square root of the count: a bright core of few pixels must not lose to the many pixels of the
            // glow around it.
            colors.push(WeightedColor { color: bin.mean(index), weight: (bin.count as f64).sqrt() as f32 });
        }
        colors
    }
}

/// The index of a color's bin: the highest bits of red, green and blue.
fn histogram_bin(color: [u8; 3]) -> usize {
    let [r, g, b] = color.map(|code| usize::from(code) >> (8 - BITS));
    (r << (2 * BITS)) | (g << BITS) | b
}

/// The lowest code of a channel in the bin with this index.
fn bin_min_code(index: usize, axis: usize) -> u8 {
    (((index >> ((2 - axis) * BITS)) & ((1 << BITS) - 1)) << (8 - BITS)) as u8
}

#[derive(Clone, Copy, Debug)]
struct WeightedColor {
    color: [f32; 3],
    weight: f32,
}

/// A box of colors that have a common palette entry while the palette is built.
struct ColorBox {
    colors: Vec<WeightedColor>,
    /// Axis of the largest weighted variance.
    axis: usize,
    /// Mean along that axis.
    mean: f32,
    /// Sum of weighted squared deviations along that axis.
    spread: f32,
}

impl ColorBox {
    fn new(colors: Vec<WeightedColor>) -> Self {
        let total: f32 = colors.iter().map(|entry| entry.weight).sum();
        let mut widest = Self { colors: Vec::new(), axis: 0, mean: 0.0, spread: f32::NEG_INFINITY };
        for axis in 0..3 {
            let sum: f32 = colors.iter().map(|entry| entry.weight * entry.color[axis]).sum();
            let mean = sum / total.max(f32::MIN_POSITIVE);
            let deviations =
                colors.iter().map(|entry| entry.weight * (entry.color[axis] - mean) * (entry.color[axis] - mean));
            let spread = CHANNEL_WEIGHTS[axis] * deviations.sum::<f32>();
            // Of equal axes the first.
            if spread > widest.spread {
                widest = Self { colors: Vec::new(), axis, mean, spread };
            }
        }
        Self { colors, ..widest }
    }

    fn split(self) -> [Self; 2] {
        let (axis, mean) = (self.axis, self.mean);
        // At the mean rather than the median: one bright color beside many dark ones gets a box of its own.
        let (low, high) = self.colors.into_iter().partition(|entry| entry.color[axis] <= mean);
        [Self::new(low), Self::new(high)]
    }

    fn centroid(&self) -> [f32; 3] {
        mean(&self.colors).unwrap_or([0.0; 3])
    }
}

fn mean(colors: &[WeightedColor]) -> Option<[f32; 3]> {
    let total: f32 = colors.iter().map(|entry| entry.weight).sum();
    if total <= 0.0 {
        return None;
    }
    Some([0, 1, 2].map(|axis| colors.iter().map(|entry| entry.weight * entry.color[axis]).sum::<f32>() / total))
}

/// Up to `size` palette entries for all counted colors; at least one.
pub(crate) fn palette(histogram: &Histogram, size: usize) -> Vec<[u8; 3]> {
    let colors = histogram.colors();
    let mut boxes = vec![ColorBox::new(colors.clone())];
    while boxes.len() < size {
        let widest =
            (0..boxes.len()).fold(0, |best, next| if boxes[next].spread > boxes[best].spread { next } else { best });
        // Each box is a single color.
        if boxes[widest].spread <= 0.0 {
            break;
        }
        let halves = boxes.swap_remove(widest).split();
        boxes.extend(halves);
    }
    let mut entries: Vec<[f32; 3]> = boxes.iter().map(ColorBox::centroid).collect();
    for _ in 0..KMEANS_STEPS {
        entries = kmeans_step(&colors, &entries);
    }
    entries.into_iter().map(|color| color.map(|channel| (channel.clamp(0.0, 255.0) + 0.5) as u8)).collect()
}

fn kmeans_step(colors: &[WeightedColor], entries: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let mut groups = vec![Vec::new(); entries.len()];
    colors.iter().for_each(|entry| groups[nearest(entry.color, entries)].push(*entry));
    groups.iter().zip(entries).map(|(group, entry)| mean(group).unwrap_or(*entry)).collect()
}

/// Weighted squared difference.
fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    (0..3).map(|axis| CHANNEL_WEIGHTS[axis] * (a[axis] - b[axis]) * (a[axis] - b[axis])).sum()
}

/// Index of the nearest entry, the first of several.
fn nearest(color: [f32; 3], entries: &[[f32; 3]]) -> usize {
    let mut best = (0, f32::INFINITY);
    for (index, entry) in entries.iter().enumerate() {
        let distance = distance(color, *entry);
        if distance < best.1 {
            best = (index, distance);
        }
    }
    best.0
}

/// Two palette entries to dither between.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct EntryPair {
    near: u8,
    far: u8,
}

/// Maps colors to palette entries with ordered dithering, which is constant over time.
pub(crate) struct Ditherer {
    entries: Vec<[f32; 3]>,
    /// For the eight octants of each bin: one pair for a whole bin would show banding in dark skies.
    pairs: Vec<[EntryPair; 8]>,
}

/// Index of the octant of a color within its bin.
fn octant(color: [u8; 3]) -> usize {
    color.into_iter().fold(0, |octant, code| (octant << 1) | usize::from(code % BIN_WIDTH >= BIN_WIDTH / 2))
}

/// The center of an octant of the bin with this index.
fn octant_center(index: usize, octant: usize) -> [f32; 3] {
    let half = BIN_WIDTH / 2;
    std::array::from_fn(|axis| {
        let upper = (octant >> (2 - axis)) as u8 & 1;
        f32::from(bin_min_code(index, axis) + upper * half) + 0.5 * f32::from(half - 1)
    })
}

/// Penalty of pairs of different colors relative to pairs of similar colors with the same mean, so that dither dots are not conspicuous.
const DOT_PENALTY: f32 = 0.15;
/// Radius of an octant, as the root of [`distance`].
const OCTANT_RADIUS: f32 = 1.5;

impl Ditherer {
    /// Finds the dither pair for every counted color. `palette` has 1 to 256 entries.
    pub(crate) fn new(palette: &[[u8; 3]], histogram: &Histogram) -> Self {
        let entries: Vec<[f32; 3]> = palette.iter().take(256).map(|color| color.map(f32::from)).collect();
        let bins = histogram.0.par_iter().enumerate().with_min_len(1024);
        let pairs = bins.map(|(index, bin)| {
            // Most bins: a film has colors in few of them, and no other is looked up.
            if bin.count == 0 {
                return [EntryPair::default(); 8];
            }
            std::array::from_fn(|octant| pair(octant_center(index, octant), &entries))
        });
        let pairs = pairs.collect();
        Self { entries, pairs }
    }

    /// The entry for a color at column `x`, row `y`.
    #[inline]
    pub(crate) fn index(&self, color: [u8; 3], x: usize, y: usize) -> u8 {
        let EntryPair { near, far } = self.pairs[histogram_bin(color)][octant(color)];
        let far_fraction =
            far_fraction(color.map(f32::from), self.entries[usize::from(near)], self.entries[usize::from(far)]);
        if far_fraction > BAYER[y & 7][x & 7] { far } else { near }
    }
}

/// Fraction of `far` in the mix of `near` and `far` that is nearest to the color, 0 to 1.
fn far_fraction(color: [f32; 3], near: [f32; 3], far: [f32; 3]) -> f32 {
    let (mut along, mut length) = (0.0, 0.0);
    for axis in 0..3 {
        let step = far[axis] - near[axis];
        along += CHANNEL_WEIGHTS[axis] * step * (color[axis] - near[axis]);
        length += CHANNEL_WEIGHTS[axis] * step * step;
    }
    if length > 0.0 { (along / length).clamp(0.0, 1.0) } else { 0.0 }
}

/// The pair for an octant with its center at the color.
fn pair(color: [f32; 3], entries: &[[f32; 3]]) -> EntryPair {
    let near = nearest(color, entries);
    let (start, mut best) = (entries[near], (near, f32::INFINITY));
    for (far, &end) in entries.iter().enumerate().filter(|(far, _)| *far != near) {
        let t = far_fraction(color, start, end);
        let mixed = std::array::from_fn(|axis| (end[axis] - start[axis]).mul_add(t, start[axis]));
        let length = distance(start, end);
        // If the center were equal to an entry, any second entry would have the same error, even the brightest. But other colors of the
        // octant would get dots of it.
        let dots = (t + OCTANT_RADIUS / length.sqrt().max(1.0)).min(0.5);
        let error = distance(color, mixed) + DOT_PENALTY * dots * (1.0 - dots) * length;
        if error < best.1 {
            best = (far, error);
        }
    }
    EntryPair { near: near as u8, far: best.0 as u8 }
}

/// Bayer matrix of 8 x 8 thresholds.
const BAYER: [[f32; 8]; 8] = bayer();

const fn bayer() -> [[f32; 8]; 8] {
    let mut matrix = [[0.0; 8]; 8];
    let mut index = 0;
    while index < 64 {
        let (x, y) = (index % 8, index / 8);
        let (mut rank, mut bit) = (0, 0);
        while bit < 3 {
            // The bits of x xor y and of y, interleaved and reversed.
            rank = (rank << 2) | ((((x ^ y) >> bit) & 1) << 1) | ((y >> bit) & 1);
            bit += 1;
        }
        matrix[y][x] = (rank as f32 + 0.5) / 64.0;
        index += 1;
    }
    matrix
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counted(colors: &[([u8; 3], usize)]) -> Histogram {
        let (mut frame, mut histogram) = (FrameHistogram::new(), Histogram::new());
        for (color, times) in colors {
            (0..*times).for_each(|_| frame.count(*color));
        }
        histogram.add(&frame);
        histogram
    }

    /// A pseudorandom number from 0 to 1 (H. Mueller's integer hash).
    fn noise(number: usize) -> f32 {
        let mut bits = number as u32;
        for _ in 0..2 {
            bits = (bits ^ (bits >> 16)).wrapping_mul(0x045d_9f3b);
        }
        (bits ^ (bits >> 16)) as f32 / 4_294_967_296.0
    }

    /// A night sky, dithered to 8 bits, with a faint glow, a bright band and stars.
    fn night_sky([width, height]: [usize; 2]) -> Vec<[u8; 3]> {
        let bell = |x: f32| 1.0 / ((1.0 + x * x) * (1.0 + x * x));
        let pixel = |index: usize| {
            let (u, v) = ((index % width) as f32 / width as f32, (index / width) as f32 / height as f32);
            let faint = 26.0 * bell((u - 0.3) / 0.4) * bell((v - 0.55) / 0.4);
            let band = 225.0 * bell((v - 0.35) / 0.06) * bell((u - 0.72) / 0.2);
            let star = if noise(index + 1_000_000) > 0.9997 { 180.0 * noise(index + 2_000_000) } else { 0.0 };
            let sky = [2.0 + 6.0 * v, 4.0 + 9.0 * v, 10.0 + 18.0 * v];
            let light = [0.25 * (faint + band), faint + band, 0.5 * (faint + band)];
            std::array::from_fn(|axis| (sky[axis] + light[axis] + star + noise(index + 1)) as u8)
        };
        (0..width * height).map(pixel).collect()
    }

    #[test]
    fn dark_skies_are_dithered_without_bright_specks() {
        let size = [320, 180];
        let sky = night_sky(size);
        let histogram = counted(&sky.iter().map(|&color| (color, 1)).collect::<Vec<_>>());
        let entries = palette(&histogram, 256);
        let ditherer = Ditherer::new(&entries, &histogram);
        let luminance = |color: [u8; 3]| {
            let [r, g, b] = color.map(f32::from);
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        let (mut worst, mut dark) = (0.0_f32, 0);
        // Mean errors of squares of 8 by 8 pixels, in which every threshold comes once.
        let mut squares = vec![0.0_f32; (size[0] / 8) * size[1].div_ceil(8)];
        for (index, &color) in sky.iter().enumerate().filter(|(_, color)| luminance(**color) < 60.0) {
            let (x, y) = (index % size[0], index / size[0]);
            let error = luminance(entries[usize::from(ditherer.index(color, x, y))]) - luminance(color);
            squares[(y / 8) * (size[0] / 8) + x / 8] += error / 64.0;
            (worst, dark) = (worst.max(error.abs()), dark + 1);
        }
        let mean = squares.iter().map(|error| error.abs()).sum::<f32>() / squares.len() as f32;
        assert!(dark > 40_000 && worst < 5.0 && mean < 0.3, "off by up to {worst}, {mean} in a square's mean");
    }

    #[test]
    fn few_colors_are_kept_exactly_however_rare() {
        let histogram = counted(&[([0, 0, 0], 100_000), ([255, 255, 255], 1), ([255, 0, 0], 3)]);
        let mut palette = palette(&histogram, 256);
        palette.sort();
        assert_eq!(palette, [[0, 0, 0], [255, 0, 0], [255, 255, 255]]);
    }

    #[test]
    fn a_ramp_of_fire_is_covered_within_two_codes() {
        let fire = |heat: usize| [heat.min(255) as u8, (heat * heat / 300).min(255) as u8, (heat / 5) as u8];
        let histogram = counted(&(0..256).map(|heat| (fire(heat), 10)).collect::<Vec<_>>());
        let palette: Vec<[f32; 3]> = palette(&histogram, 255).into_iter().map(|color| color.map(f32::from)).collect();
        for heat in 0..256 {
            let color = fire(heat).map(f32::from);
            let found = palette[nearest(color, &palette)];
            assert!((0..3).all(|axis| (found[axis] - color[axis]).abs() <= 4.5), "{color:?} {found:?}");
        }
    }

    #[test]
    fn dither_keeps_the_mean_and_stands_still() {
        let levels = [0_u8, 16, 64, 100, 128, 200, 250];
        let histogram = counted(&levels.map(|level| ([level; 3], 1)));
        let ditherer = Ditherer::new(&[[0, 0, 0], [255, 255, 255]], &histogram);
        for level in levels {
            let at = |x: usize, y: usize| u32::from(ditherer.index([level; 3], x, y));
            let on: u32 = (0..64).map(|index| at(index % 8, index / 8)).sum();
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
