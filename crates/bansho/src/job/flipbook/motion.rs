//! The motion sheet of a flipbook: how the pixels of a frame move to the next one.

use bansho_base::{color, frame::Frame, image::Image};

/// The motion of all pixels of a frame.
pub(crate) struct MotionField {
    /// Pixels to the right and down until the next frame.
    pub(crate) pixels: Image<2>,
    /// Whether a phenomenon of the frame has a motion AOV.
    pub(crate) has_aov: bool,
}

impl MotionField {
    pub(crate) fn of_frame(frame: &Frame) -> Self {
        let aovs = motion_aovs(frame);
        let (width, height) = (frame.beauty.width(), frame.beauty.height());
        let pixels = (0..width * height).map(|index| weighted_mean(&aovs, index)).collect();
        let pixels = Image::from_pixels(width, height, pixels);
        Self { pixels: pixels.unwrap_or_else(|| Image::filled(width, height, [0.0; 2])), has_aov: !aovs.is_empty() }
    }
}

/// The motion AOV of one phenomenon, and its layer.
struct MotionAov<'a> {
    motion: [&'a [f32]; 2],
    layer: [&'a [f32]; 4],
}

/// The motion AOVs of all phenomena of a frame that have one and a layer.
fn motion_aovs(frame: &Frame) -> Vec<MotionAov<'_>> {
    let mut aovs = Vec::new();
    for name in frame.channels.iter().filter_map(|channel| channel.name.strip_suffix(".motion.X")) {
        let motion = ["motion.X", "motion.Y"].map(|axis| plane(frame, name, axis));
        let layer = ["R", "G", "B", "A"].map(|channel| plane(frame, name, channel));
        if let ([Some(x), Some(y)], [Some(r), Some(g), Some(b), Some(a)]) = (motion, layer) {
            aovs.push(MotionAov { motion: [x, y], layer: [r, g, b, a] });
        }
    }
    aovs
}

/// The values of a channel of a phenomenon, row by row.
fn plane<'a>(frame: &'a Frame, phenomenon: &str, channel: &str) -> Option<&'a [f32]> {
    let name = format!("{phenomenon}.{channel}");
    Some(frame.channels.iter().find(|channel| channel.name == name)?.values.as_slice())
}

/// The mean motion at a pixel. The weight of a phenomenon is the sum of its luminance and its alpha.
fn weighted_mean(aovs: &[MotionAov], index: usize) -> [f32; 2] {
    let mut sum = [0.0; 2];
    let mut weights = 0.0;
    for MotionAov { motion, layer: [r, g, b, a] } in aovs {
        let weight = color::luminance([r[index], g[index], b[index]]).max(0.0) + a[index].max(0.0);
        weights += weight;
        (0..2).for_each(|axis| sum[axis] += weight * motion[axis][index]);
    }
    if weights > 0.0 { sum.map(|sum| sum / weights) } else { [0.0; 2] }
}

/// The largest motion along either axis in any frame, pixels; 1 if nothing moves.
pub(crate) fn scale<'a>(frames: impl Iterator<Item = &'a Image<2>>) -> f32 {
    let components = frames.flat_map(|frame| frame.pixels().as_flattened());
    let largest = components.fold(0.0_f32, |largest, value| largest.max(value.abs()));
    if largest > 0.0 { largest } else { 1.0 }
}

/// Code of zero motion.
pub(crate) const ZERO_CODE: u16 = 1 << 15;
/// Codes between zero and the largest motion.
const MAX_CODE_OFFSET: u16 = ZERO_CODE - 1;

/// Motion in 16 bits: red to the right, green down, [`ZERO_CODE`] for none.
pub(crate) fn encode(motion: [f32; 2], scale: f32) -> [u16; 4] {
    let [right, down] = motion.map(|value| {
        let steps = (value / scale).clamp(-1.0, 1.0) * f32::from(MAX_CODE_OFFSET);
        (i32::from(ZERO_CODE) + steps.round() as i32) as u16
    });
    [right, down, 0, u16::MAX]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zero_motion_is_the_middle_code_and_the_largest_an_end() {
        assert_eq!(encode([0.0, 0.0], 3.0), [32_768, 32_768, 0, 65_535]);
        assert_eq!(encode([3.0, -3.0], 3.0), [65_535, 1, 0, 65_535]);
        assert_eq!(encode([1.5, -9.0], 3.0), [49_152, 1, 0, 65_535]);
    }

    #[test]
    fn motion_is_weighted_by_luminance_and_alpha() {
        let (still, moving, none, one) = ([0.0], [4.0], [0.0], [1.0]);
        let smoke = MotionAov { motion: [&moving, &still], layer: [&none, &none, &none, &one] };
        let dark = MotionAov { motion: [&still, &moving], layer: [&none, &none, &none, &none] };
        assert_eq!(weighted_mean(&[smoke, dark], 0), [4.0, 0.0]);
        let flame = || MotionAov { motion: [&still, &moving], layer: [&one, &one, &one, &none] };
        let smoke = MotionAov { motion: [&moving, &still], layer: [&none, &none, &none, &one] };
        let mixed = weighted_mean(&[smoke, flame()], 0);
        assert!((mixed[0] - 2.0).abs() < 1e-5 && (mixed[1] - 2.0).abs() < 1e-5, "{mixed:?}");
        assert_eq!(weighted_mean(&[], 0), [0.0; 2]);
    }
}
