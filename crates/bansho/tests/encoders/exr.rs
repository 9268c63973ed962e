//! OpenEXR by its own library: beauty and layers in half, depth and AOVs in float.

use bansho::{
    base::{frame::Frame, math},
    render::display::BitDepth,
};

use crate::{
    Writing, beside,
    light::{self, WIDTHS},
    numbers, python,
};

/// Magnitudes of all finite halves in ascending order, by their definition (IEEE 754 binary16).
fn halves() -> Vec<f64> {
    let half = |bits: u32| {
        let (exponent, mantissa) = (bits >> 10, f64::from(bits & 0x3ff));
        let scale = |power: i32| math::exp2(f64::from(power));
        if exponent == 0 { mantissa * scale(-24) } else { (1024.0 + mantissa) * scale(exponent as i32 - 25) }
    };
    (0..0x7c00).map(half).collect()
}

/// The bits of the nearest half, ties to the even one; the largest for what is beyond it, 0 for what is not a number.
fn nearest_half(value: f32, halves: &[f64]) -> u16 {
    if value.is_nan() {
        return 0;
    }
    let size = f64::from(value.abs()).min(65_504.0);
    let above = halves.partition_point(|half| *half < size);
    let below = above.saturating_sub(1);
    let (up, down) = (halves[above] - size, size - halves[below]);
    let even = if above % 2 == 0 { above } else { below };
    let nearest = if up == down {
        even
    } else if up < down {
        above
    } else {
        below
    };
    u16::try_from(nearest).unwrap() | if value.is_sign_negative() { 0x8000 } else { 0 }
}

/// Channels of the file and the numbers that belong there.
fn planes(frame: &Frame) -> [(&'static str, bool, Vec<f32>); 8] {
    let beauty = |component: usize| frame.beauty.pixels().iter().map(|pixel| pixel[component]).collect();
    let channel = |index: usize| frame.channels[index].values.clone();
    [
        ("R", true, beauty(0)),
        ("G", true, beauty(1)),
        ("B", true, beauty(2)),
        ("A", true, beauty(3)),
        ("Z", false, frame.depth.clone().unwrap()),
        ("torch.R", true, channel(0)),
        ("torch.motion.X", false, channel(1)),
        ("torch.temperature_k.V", false, channel(2)),
    ]
}

#[test]
#[ignore = "needs python3 with the package OpenEXR"]
fn openexr_reads_every_number_in_half_and_float_in_every_width() {
    let folder = tempfile::tempdir().unwrap();
    let frames: Vec<Frame> = WIDTHS.map(|width| light::frame(width, false)).collect();
    let path = |frame: &Frame| folder.path().join(format!("{}.exr", frame.beauty.width()));
    for frame in &frames {
        Writing::new(BitDepth::Eight, None).write(&path(frame), std::slice::from_ref(frame));
    }
    python("samples_of_exr.py", folder.path());
    let halves = halves();
    for frame in &frames {
        for (name, is_half, values) in planes(frame) {
            let bytes = beside(&path(frame), &format!(".{name}"));
            if is_half {
                let expected: Vec<u16> = values.iter().map(|value| nearest_half(*value, &halves)).collect();
                assert!(numbers(&bytes) == expected, "{name}, {} wide", frame.beauty.width());
            } else {
                let expected: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
                assert!(bytes == expected, "{name}, {} wide", frame.beauty.width());
            }
        }
    }
}
