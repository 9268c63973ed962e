//! Small films of scenes, and measurements of them.

use std::{ops::Range, path::PathBuf, sync::Arc};

use bansho::{
    BitDepth, CompiledScene, DisplayImage, Plan, PlanOptions, SceneOptions, Shot, Unobserved, View,
    base::{
        frame::{DisplayPixels, Frame},
        host::assets::PictureLayers,
    },
    media::{
        assets::{FileAssets, decode_picture},
        limits::MemoryLimit,
    },
};

fn scenes() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../scenes")
}

/// The text of a shipped scene.
pub(crate) fn scene_text(scene: &str) -> String {
    std::fs::read_to_string(scenes().join(format!("{scene}.toml"))).unwrap_or_else(|error| panic!("{scene}: {error}"))
}

fn planned(text: &str, size: [usize; 2], options: &SceneOptions) -> (Arc<CompiledScene>, Arc<Plan>) {
    let assets = Arc::new(FileAssets::new(scenes()));
    let scene = bansho::parse_scene("scene", text).unwrap_or_else(|error| panic!("{error}"));
    let scene = scene.with_options(options).unwrap_or_else(|error| panic!("{error}"));
    let compiled = CompiledScene::build(Arc::new(scene), assets, None).unwrap_or_else(|errors| panic!("{errors}"));
    let compiled = Arc::new(compiled);
    let plan = Plan::new(&compiled, &PlanOptions { size: Some(size), ..PlanOptions::default() }).unwrap();
    (compiled, Arc::new(plan))
}

/// The fingerprint of all that the pixels of a frame depend on.
pub(crate) fn fingerprint(text: &str, size: [usize; 2], frame: i64) -> [u8; 32] {
    let (_, plan) = planned(text, size, &SceneOptions::default());
    plan.frame_fingerprint(frame, &FileAssets::new(scenes()))
}

/// The results of `look` for each of those frames.
fn look_at<T>(
    text: &str,
    size: [usize; 2],
    frames: &[i64],
    options: &SceneOptions,
    look: impl Fn(&Frame) -> T,
) -> Vec<T> {
    let (compiled, plan) = planned(text, size, options);
    let mut shot = Shot::open(compiled, plan);
    frames.iter().map(|number| look(&bansho::draw(&mut shot, *number, &Unobserved).unwrap())).collect()
}

fn draw(text: &str, size: [usize; 2], frames: &[i64], options: &SceneOptions, depth: BitDepth) -> Vec<DisplayImage> {
    look_at(text, size, frames, options, |frame| {
        // In this view, what a display can show is shown as it is: means of its light are those of the scene.
        bansho::display(frame, &View::NEUTRAL, depth, bansho::AlphaConvention::Linear)
    })
}

/// Mean luminance of the scene's light in each of those frames, before it is shown: 1.0 is display white.
pub(crate) fn mean_luminances(text: &str, size: [usize; 2], frames: &[i64]) -> Vec<f64> {
    let pixels = (size[0] * size[1]) as f64;
    block_luminances(text, size, 1, frames).into_iter().map(|pictures| pictures.iter().sum::<f64>() / pixels).collect()
}

/// Mean luminance of the scene's light in blocks of `side` pixels, row by row, in each of those frames, before it is shown: 1.0 is display
/// white.
pub(crate) fn block_luminances(text: &str, size: [usize; 2], side: usize, frames: &[i64]) -> Vec<Vec<f64>> {
    let [columns, rows] = size.map(|pixels| pixels.div_ceil(side));
    look_at(text, size, frames, &SceneOptions::default(), |frame| {
        let mut blocks = vec![0.0; columns * rows];
        for (index, [red, green, blue, _]) in frame.beauty.pixels().iter().enumerate() {
            let block = index / size[0] / side * columns + index % size[0] / side;
            blocks[block] += f64::from(bansho::base::color::luminance([*red, *green, *blue])) / (side * side) as f64;
        }
        blocks
    })
}

/// Codes over black, from 0 to 1, still sRGB-encoded.
fn encoded(image: &DisplayImage) -> Vec<[f32; 3]> {
    match &image.pixels {
        DisplayPixels::Eight(pixels) => pixels.iter().map(|p| over_black(p.map(|v| f32::from(v) / 255.0))).collect(),
        DisplayPixels::Sixteen(pixels) => {
            pixels.iter().map(|p| over_black(p.map(|v| f32::from(v) / 65_535.0))).collect()
        }
    }
}

/// Straight alpha over black in linear light.
fn over_black([red, green, blue, alpha]: [f32; 4]) -> [f32; 3] {
    use bansho::base::color::{decode_srgb, encode_srgb};
    if alpha >= 1.0 {
        return [red, green, blue];
    }
    [red, green, blue].map(|value| encode_srgb(decode_srgb(value) * alpha))
}

/// Frames of a scene in linear display light, over black.
pub(crate) struct Film {
    width: usize,
    height: usize,
    frames: Vec<Vec<[f64; 3]>>,
}

/// Relative luminance of linear sRGB.
pub(crate) fn luminance([red, green, blue]: [f64; 3]) -> f64 {
    0.2126 * red + 0.7152 * green + 0.0722 * blue
}

impl Film {
    /// Frames of a shipped scene.
    pub(crate) fn of(scene: &str, size: [usize; 2], frames: &[i64], options: &SceneOptions) -> Self {
        Self::of_text(&scene_text(scene), size, frames, options)
    }

    /// Frames of a scene in a text.
    pub(crate) fn of_text(text: &str, size: [usize; 2], frames: &[i64], options: &SceneOptions) -> Self {
        let linear = |image: &DisplayImage| {
            let decode = |value: f32| f64::from(bansho::base::color::decode_srgb(value));
            encoded(image).into_iter().map(|pixel| pixel.map(decode)).collect()
        };
        let images = draw(text, size, frames, options, BitDepth::Sixteen);
        Self { width: size[0], height: size[1], frames: images.iter().map(linear).collect() }
    }

    pub(crate) fn pixels(&self) -> impl Iterator<Item = &[f64; 3]> {
        self.frames.iter().flatten()
    }

    pub(crate) fn len(&self) -> usize {
        self.width * self.height * self.frames.len()
    }

    pub(crate) fn row(&self, frame: usize, row: usize) -> &[[f64; 3]] {
        &self.frames[frame][row * self.width..][..self.width]
    }

    /// Mean luminance of a frame.
    pub(crate) fn mean(&self, frame: usize) -> f64 {
        self.frames[frame].iter().map(|pixel| luminance(*pixel)).sum::<f64>() / (self.width * self.height) as f64
    }

    /// Mean of a number that pixels have, over a part of the first frame.
    pub(crate) fn mean_over(&self, rows: Range<usize>, columns: Range<usize>, of: impl Fn([f64; 3]) -> f64) -> f64 {
        let pixels = rows.clone().flat_map(|row| self.row(0, row)[columns.clone()].iter());
        pixels.map(|pixel| of(*pixel)).sum::<f64>() / (rows.len() * columns.len()) as f64
    }

    /// Mean absolute difference of two frames.
    pub(crate) fn difference(&self, a: usize, b: usize) -> f64 {
        let pair = self.frames[a].iter().zip(&self.frames[b]);
        pair.map(|(a, b)| (luminance(*a) - luminance(*b)).abs()).sum::<f64>() / (self.width * self.height) as f64
    }

    /// Center of the light in the upper half of what is lit, in pixels, over all frames.
    pub(crate) fn centroid_of_upper_half(&self) -> [f64; 2] {
        let lit_row =
            |row: usize| (0..self.frames.len()).any(|f| self.row(f, row).iter().any(|p| luminance(*p) > 0.02));
        let rows: Vec<usize> = (0..self.height).filter(|row| lit_row(*row)).collect();
        let middle = (rows[0] + rows[rows.len() - 1]) / 2;
        let (mut sum, mut place) = (0.0, [0.0; 2]);
        for frame in 0..self.frames.len() {
            for row in rows[0]..middle {
                for (x, pixel) in self.row(frame, row).iter().enumerate() {
                    let light = luminance(*pixel);
                    sum += light;
                    place[0] += light * (x as f64 + 0.5);
                    place[1] += light * (row as f64 + 0.5);
                }
            }
        }
        place.map(|coordinate| coordinate / sum)
    }
}

/// Fractions of the lit pixels that are red, orange and yellow to white, by the ratio of green to red in linear light.
pub(crate) fn hues(film: &Film) -> [f64; 3] {
    let mut counts = [0.0; 3];
    for pixel in film.pixels().filter(|pixel| luminance(**pixel) > 0.01) {
        let ratio = pixel[1] / pixel[0].max(1e-6);
        counts[if ratio < 0.12 {
            0
        } else if ratio < 0.45 {
            1
        } else {
            2
        }] += 1.0;
    }
    let all: f64 = counts.iter().sum();
    counts.map(|count| count / all)
}

/// Fraction of the length of gradients, along rows and columns, that is in bands: more than 8 pixels of one 8-bit code where 16 bits move by a
/// quarter of a code.
pub(crate) fn wide_bands(text: &str, size: [usize; 2], frame: i64) -> f64 {
    let codes = |depth| encoded(&draw(text, size, &[frame], &SceneOptions::default(), depth)[0]);
    let (coarse, fine) = (codes(BitDepth::Eight), codes(BitDepth::Sixteen));
    let row = |y: usize| (0..size[0]).map(move |x| y * size[0] + x).collect();
    let column = |x: usize| (0..size[1]).map(move |y| y * size[0] + x).collect();
    let lines = (0..size[1]).map(row).chain((0..size[0]).map(column));
    let lengths = lines.flat_map(|line: Vec<usize>| {
        [0, 1, 2].map(|channel| {
            let [coarse, fine] =
                [&coarse, &fine].map(|codes| line.iter().map(|at| codes[*at][channel]).collect::<Vec<f32>>());
            bands_of_line(&coarse, &fine)
        })
    });
    let [banded, gradient] = lengths.fold([0, 0], |sum, line| [sum[0] + line[0], sum[1] + line[1]]);
    banded as f64 / gradient.max(1) as f64
}

/// Number of pixels of a line that are in bands, and of those in gradients.
fn bands_of_line(coarse: &[f32], fine: &[f32]) -> [usize; 2] {
    let (mut banded, mut gradient, mut start) = (0, 0, 0);
    for at in 1..=coarse.len() {
        if at < coarse.len() && coarse[at] == coarse[start] {
            continue;
        }
        let change = (fine[at - 1] - fine[start]).abs() * 255.0;
        if coarse[start] > 0.0 && coarse[start] < 1.0 {
            gradient += at - start;
            banded += if at - start > 8 && change > 0.25 { at - start } else { 0 };
        }
        start = at;
    }
    [banded, gradient]
}

/// Compares a frame with its golden picture and returns the differences. Writes the golden picture instead if `BANSHO_BLESS` is set.
pub(crate) fn golden(scene: &str, size: [usize; 2], frame: i64) -> Option<String> {
    // A bonfire of 100,000 particles would take longer than all other pictures together, and so would an aurora's of 120,000 that has to be
    // stepped far.
    let mut text = scene_text(scene).replace("particles = 125000", "particles = 8000");
    let mut name = scene.to_owned();
    if frame >= 100 {
        text = text.replace("count = 120_000", "count = 12_000");
        name = format!("{scene}_{frame}");
    }
    // As users see it, in the view of the scene.
    let view = bansho::parse_scene(scene, &text).unwrap_or_else(|error| panic!("{error}")).picture.view;
    let look = |frame: &Frame| bansho::display(frame, &view.into(), BitDepth::Eight, bansho::AlphaConvention::Linear);
    let image = &look_at(&text, size, &[frame], &SceneOptions::default(), look)[0];
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("tests/golden/{name}.png"));
    if std::env::var_os("BANSHO_BLESS").is_some() {
        write_png(&path, image);
        return None;
    }
    let bytes = std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let known = decode_picture(&bytes, "png", &PictureLayers::default(), MemoryLimit::default()).unwrap();
    let known: Vec<[f32; 3]> = known.color.iter().map(over_black).collect();
    let drawn = encoded(image);
    let (mean, worst) = blurred_difference(&known, &drawn, size);
    if known.len() == drawn.len() && mean < 0.5 && worst < 10.0 {
        return None;
    }
    let now = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.png"));
    write_png(&now, image);
    Some(format!("{name}: differs by {mean} codes in the mean and {worst} at most; it is now {}", now.display()))
}

/// Mean and greatest difference in 8-bit codes, of means over 4 x 4 pixels: what an eye sees, and no dither.
fn blurred_difference(a: &[[f32; 3]], b: &[[f32; 3]], size: [usize; 2]) -> (f64, f64) {
    let (mut sum, mut worst, mut count) = (0.0, 0.0_f64, 0.0);
    for y in (0..size[1] - 3).step_by(4) {
        for x in (0..size[0] - 3).step_by(4) {
            for c in 0..3 {
                let cell = |image: &[[f32; 3]]| -> f64 {
                    let at = |i: usize| f64::from(image[(y + i / 4) * size[0] + x + i % 4][c]);
                    (0..16).map(at).sum::<f64>() * 255.0 / 16.0
                };
                let difference = (cell(a) - cell(b)).abs();
                sum += difference;
                worst = worst.max(difference);
                count += 1.0;
            }
        }
    }
    (sum / count, worst)
}

fn write_png(path: &std::path::Path, image: &DisplayImage) {
    let bytes = bansho::media::png::encode(image, &[0; 32], bansho::media::png::PngEffort::Small, path).unwrap();
    std::fs::write(path, bytes).unwrap();
}
