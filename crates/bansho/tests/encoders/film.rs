//! Films by ffmpeg, within the losses of their codecs.

use std::{path::Path, process::Command};

use bansho::{
    base::{color::AlphaConvention, frame::Frame},
    render::display::BitDepth,
};

use crate::{Writing, light, numbers};

/// Side of a patch of one color: codecs work on squares of 8 and 16.
const SIDE: usize = 16;

/// Light and coverage of the patches.
const PATCHES: [[f32; 2]; 14] = [
    [0.0, 0.0],
    [1.0, 0.0],
    [0.0, 1.0],
    [0.999_999_94, 0.0],
    [1.000_000_1, 0.0],
    [7.0, 0.25],
    [f32::INFINITY, 0.0],
    [f32::NAN, 0.0],
    [f32::NAN, 1.0],
    [0.25, f32::INFINITY],
    [0.25, f32::NAN],
    [f32::MAX, f32::MAX],
    [-1.0, -1.0],
    [1.0, 1.0],
];

/// Patches beside each other; the last is cut, so that rows end within a vector.
fn frame(cut: usize, opaque: bool) -> Frame {
    let pixel = |x: usize, _: usize| {
        let [light, alpha] = PATCHES[x / SIDE];
        [light, light, light, alpha]
    };
    light::of_pixels(PATCHES.len() * SIDE - cut, SIDE, opaque, pixel)
}

/// The first frame of a film as codes of 16 bits, by ffmpeg, and its width there.
fn decoded(path: &Path, decoder: &[&str]) -> Vec<[u16; 4]> {
    let convert = "scale=in_color_matrix=bt709:flags=accurate_rnd+full_chroma_int,format=rgba64le";
    let mut command = Command::new("ffmpeg");
    command.args(["-v", "error"]).args(decoder).arg("-i").arg(path);
    let output = command.args(["-frames:v", "1", "-vf", convert, "-f", "rawvideo", "-"]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    numbers(&output.stdout).as_chunks().0.to_vec()
}

/// Writes the patches and compares the middle of each with the display picture; `alpha_off` and `color_off` are fractions of the range.
fn check(
    name: &str,
    bits: BitDepth,
    alpha: Option<AlphaConvention>,
    decoder: &[&str],
    [alpha_off, color_off]: [f64; 2],
) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    for cut in [0, 1, 3, 6] {
        let frame = frame(cut, alpha.is_none());
        let shown = Writing::new(bits, alpha).write(&path, &[frame.clone(), frame.clone()]);
        let (codes, full) = (light::codes(&shown[0]), f64::from(light::largest(bits)));
        let found = decoded(&path, decoder);
        let width = found.len() / SIDE;
        for (patch, [light, coverage]) in PATCHES.into_iter().enumerate() {
            let x = patch * SIDE + 4;
            let off = |channel: usize| {
                let [found, code] = [found[SIDE / 2 * width + x], codes[SIDE / 2 * shown[0].width + x]];
                (f64::from(found[channel]) / 65_535.0 - f64::from(code[channel]) / full).abs()
            };
            let told = format!("{name}, {bits:?}, {cut} less: light {light}, coverage {coverage}");
            assert!(off(3) <= alpha_off, "{told}: alpha is wrong by {}", off(3));
            assert!((0..3).all(|channel| off(channel) <= color_off), "{told}: {:?}", [0, 1, 2].map(off));
        }
    }
}

#[test]
#[ignore = "needs ffmpeg"]
fn film_codes_are_read_back_by_ffmpeg_as_they_were_shown() {
    for bits in [BitDepth::Eight, BitDepth::Sixteen] {
        for alpha in light::ALPHA_KINDS {
            // Alpha is kept exactly in 10 bits.
            check("a.mov", bits, alpha, &[], [0.002, 0.02]);
            check("a.mp4", bits, alpha, &[], [0.0, 0.03]);
            check("a.webm", bits, alpha, &["-c:v", "libvpx-vp9"], [0.03, 0.03]);
        }
    }
}
