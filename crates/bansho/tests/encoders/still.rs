//! PNG, APNG and GIF by Pillow, and by the PNG specification where Pillow keeps 8 bits only.

use bansho::{
    base::{color::View, frame::DisplayImage},
    render::display::BitDepth,
};

use crate::{
    Writing, beside,
    light::{self, ALPHA_KINDS, WIDTHS},
    numbers, python,
};

const PROGRAM: &str = "samples_of_pictures.py";

/// The samples of frames as a file has them: without alpha where it is full everywhere.
fn samples(frames: &[DisplayImage]) -> Vec<u16> {
    let channels = if frames[0].opaque { 3 } else { 4 };
    frames.iter().flat_map(light::codes).flat_map(|codes| codes.into_iter().take(channels)).collect()
}

/// Every depth, kind of alpha and view.
fn writings() -> impl Iterator<Item = Writing> {
    let views = [View::STANDARD, View::DISPLAY, View::RAW];
    [BitDepth::Eight, BitDepth::Sixteen].into_iter().flat_map(move |bits| {
        let of_view = move |view| ALPHA_KINDS.map(|alpha| Writing { view, ..Writing::new(bits, alpha) });
        views.into_iter().flat_map(of_view)
    })
}

#[test]
#[ignore = "needs Pillow"]
fn pillow_reads_every_code_of_png_in_every_depth_and_width() {
    let folder = tempfile::tempdir().unwrap();
    let mut written = Vec::new();
    for (number, writing) in writings().enumerate() {
        for width in WIDTHS {
            let path = folder.path().join(format!("{number}_{width}.png"));
            let shown = writing.write(&path, &[light::frame(width, writing.alpha.is_none())]);
            written.push((path, samples(&shown)));
        }
    }
    python(PROGRAM, folder.path());
    for (path, expected) in written {
        assert!(numbers(&beside(&path, ".samples")) == expected, "{}", path.display());
    }
}

#[test]
#[ignore = "needs Pillow"]
fn pillow_reads_every_code_of_every_frame_of_apng() {
    let folder = tempfile::tempdir().unwrap();
    let mut written = Vec::new();
    for (number, writing) in writings().enumerate() {
        for width in [1, 15, 16, 17, 31, 32, 33] {
            let path = folder.path().join(format!("{number}_{width}.apng"));
            let first = light::frame(width, writing.alpha.is_none());
            let height = first.beauty.height();
            let second = light::of_pixels(width, height, first.opaque, |x, y| light::pixel(x + 2 * y + 7));
            written.push((path.clone(), samples(&writing.write(&path, &[first, second]))));
        }
    }
    python(PROGRAM, folder.path());
    for (path, expected) in written {
        assert!(numbers(&beside(&path, ".samples")) == expected, "{}", path.display());
    }
}

#[test]
#[ignore = "needs Pillow"]
fn pillow_reads_gifs_within_their_palette_and_black_and_white_exactly() {
    let folder = tempfile::tempdir().unwrap();
    let mut written = Vec::new();
    for bits in [BitDepth::Eight, BitDepth::Sixteen] {
        for (alpha, gif_transparent) in [(ALPHA_KINDS[1], false), (ALPHA_KINDS[1], true), (None, false)] {
            for width in WIDTHS {
                let writing = Writing { gif_transparent, ..Writing::new(bits, alpha) };
                let path = folder.path().join(format!("{bits:?}_{}_{gif_transparent}_{width}.gif", alpha.is_none()));
                let shown = writing.write(&path, &[light::frame(width, alpha.is_none())]);
                written.push((path, bits, gif_transparent, light::codes(&shown[0])));
            }
        }
    }
    python(PROGRAM, folder.path());
    for (path, bits, gif_transparent, expected) in written {
        let found = numbers(&beside(&path, ".samples"));
        let found = found.as_chunks::<4>().0;
        assert_eq!(found.len(), expected.len(), "{}", path.display());
        for (found, expected) in found.iter().zip(expected) {
            let eight = expected.map(|code| if bits == BitDepth::Eight { code } else { eight_bits(code) });
            check_gif(*found, eight, gif_transparent, &path.display().to_string());
        }
    }
}

/// The nearest code of 8 bits to one of 16.
fn eight_bits(code: u16) -> u16 {
    u16::try_from((u32::from(code) + 128) / 257).unwrap()
}

/// Whether `found` is what a GIF may show of a picture's codes.
fn check_gif(found: [u16; 4], codes: [u16; 4], transparent: bool, told: &str) {
    if transparent && codes[3] < 128 {
        return assert_eq!(found[3], 0, "{told}: {codes:?}");
    }
    assert_eq!(found[3], 255, "{told}: {codes:?}");
    for (found, code) in found.into_iter().zip(codes).take(3) {
        // Colors of one bin of the histogram, four codes wide, share their mean.
        let off = if [0, 255].contains(&code) { 0 } else { 4 };
        assert!(found.abs_diff(code) <= off, "{told}: {found} for {codes:?}");
    }
}
