//! Frames in buffers of the caller.

use bansho::{
    AlphaConvention, AlphaMode, BitDepth, BufferLengthError, ChannelError, ColorSpace, DisplayImage, Frame, Rect, View,
    base::{
        color::{WhiteBalance, acescg_from_srgb, srgb_from_acescg},
        frame::DisplayPixels,
    },
    display, f16, nonzero_rect, write_channel32f, write_depth32f, write_rgba8, write_rgba16f, write_rgba32f,
};

use crate::light::{self, COUNT};

/// A flame in a picture that is empty around it: light and coverage that differ from pixel to pixel within `content`.
fn flame(width: usize, height: usize, content: Rect) -> Frame {
    let pixel = |x: usize, y: usize| {
        if !(content.x..content.right()).contains(&x) || !(content.y..content.bottom()).contains(&y) {
            return [0.0; 4];
        }
        let [u, v] = [(x * 37 % 101) as f32 / 101.0, (y * 53 % 97) as f32 / 97.0];
        let [r, g, b] = acescg_from_srgb([1.5 * u, 0.7 * u * v, 0.2 * v]);
        [r, g, b, 0.9 * u * u]
    };
    let mut frame = light::of_pixels(width, height, false, pixel);
    frame.content = content;
    frame
}

/// Sizes on both sides of where other threads help, and contents that touch no edge, some and all of them, and none at all.
fn flames() -> impl Iterator<Item = Frame> {
    [[61, 43], [300, 270]].into_iter().flat_map(|[width, height]| {
        let inside = Rect { x: 7, y: 5, width: width - 20, height: height - 9 };
        let corner = Rect { x: 0, y: 0, width: 3, height: 1 };
        let all = Rect::from_size(width, height);
        [inside, corner, all, Rect::default()].map(|content| flame(width, height, content))
    })
}

fn value_count(frame: &Frame) -> usize {
    frame.beauty.pixels().len() * 4
}

fn rgba16f(frame: &Frame) -> Vec<[f32; 4]> {
    let mut pixels = vec![f16::NAN; value_count(frame)];
    write_rgba16f(frame, &mut pixels).unwrap();
    pixels.as_chunks().0.iter().map(|pixel: &[f16; 4]| pixel.map(f16::to_f32)).collect()
}

fn rgba8(frame: &Frame, view: &View, alpha: AlphaMode) -> Vec<[u8; 4]> {
    let mut pixels = vec![99; value_count(frame)];
    write_rgba8(frame, view, alpha, &mut pixels).unwrap();
    pixels.as_chunks().0.to_vec()
}

fn eight_bits(shown: DisplayImage) -> Vec<[u8; 4]> {
    let DisplayPixels::Eight(pixels) = shown.pixels else { panic!("8 bits were asked for") };
    pixels
}

#[test]
fn halves_are_linear_srgb_inside_the_content_and_zero_around_it() {
    for (mut frame, kelvin) in flames().zip([None, Some(4000.0)].into_iter().cycle()) {
        frame.header.white_balance_k = kelvin;
        let balance = kelvin.map(|kelvin| WhiteBalance::from_black_body(f64::from(kelvin)));
        for ([r, g, b, alpha], half) in frame.beauty.pixels().iter().zip(rgba16f(&frame)) {
            let light = balance.map_or([*r, *g, *b], |balance| balance.apply([*r, *g, *b]));
            let [r, g, b] = srgb_from_acescg(light).map(|v| v.max(0.0));
            for (exact, half) in [r, g, b, *alpha].into_iter().zip(half) {
                // Half a unit in the last of 11 bits.
                assert!((exact - half).abs() <= exact / 2048.0 + 1e-6, "{exact} {half} {kelvin:?}");
            }
        }
    }
}

#[test]
fn pixels_outside_the_content_are_neither_read_nor_left_as_they_were() {
    let content = Rect { x: 2, y: 1, width: 4, height: 3 };
    let mut frame = flame(9, 6, Rect::from_size(9, 6));
    frame.content = content;
    let (halves, codes) =
        (rgba16f(&frame), rgba8(&frame, &View::DISPLAY, AlphaMode::Straight(AlphaConvention::Linear)));
    let mut singles = vec![7.0; value_count(&frame)];
    write_rgba32f(&frame, ColorSpace::AcesCg, &mut singles).unwrap();
    for (i, single) in singles.as_chunks::<4>().0.iter().enumerate() {
        let (x, y) = (i % 9, i / 9);
        if (content.x..content.right()).contains(&x) && (content.y..content.bottom()).contains(&y) {
            assert_eq!(*single, frame.beauty.at(x, y));
        } else {
            assert_eq!((*single, halves[i], codes[i]), ([0.0; 4], [0.0; 4], [0; 4]), "{x} {y}");
        }
    }
    assert_eq!(nonzero_rect(&frame), content);
    // Opaque black is not zero, and a rectangle that reaches outside is cut.
    frame.opaque = true;
    assert_eq!(nonzero_rect(&frame), Rect::from_size(9, 6));
    frame.opaque = false;
    frame.content = Rect { x: 5, y: 4, width: 100, height: 100 };
    assert_eq!(nonzero_rect(&frame), Rect { x: 5, y: 4, width: 4, height: 2 });
    assert_eq!(rgba16f(&frame).len(), 54);
}

#[test]
fn bytes_are_those_of_the_display_picture() {
    let extreme = [light::frame(35, false), light::frame(8, true)];
    for (mut frame, kelvin) in flames().chain(extreme).zip([None, Some(3000.0)].into_iter().cycle()) {
        frame.header.white_balance_k = kelvin;
        frame.header.data_origin = [-3, 11];
        for view in [View::DISPLAY, View::STANDARD, View::RAW] {
            for alpha in [AlphaConvention::Linear, AlphaConvention::Encoded] {
                let shown = eight_bits(display(&frame, &view, BitDepth::Eight, alpha));
                assert_eq!(rgba8(&frame, &view, AlphaMode::Straight(alpha)), shown, "{} {alpha:?}", view.name().name());
            }
        }
    }
}

#[test]
fn premultiplied_bytes_are_the_picture_over_black_and_fit_under_alpha_where_codes_are_blended() {
    let frame = flame(61, 43, Rect { x: 3, y: 2, width: 50, height: 40 });
    let mut opaque = frame.clone();
    opaque.opaque = true;
    let over_black = eight_bits(display(&opaque, &View::DISPLAY, BitDepth::Eight, AlphaConvention::Linear));
    let encoded = rgba8(&frame, &View::DISPLAY, AlphaMode::Premultiplied(AlphaConvention::Encoded));
    let linear = rgba8(&frame, &View::DISPLAY, AlphaMode::Premultiplied(AlphaConvention::Linear));
    let straight = rgba8(&frame, &View::DISPLAY, AlphaMode::Straight(AlphaConvention::Encoded));
    for (i, black) in over_black.iter().enumerate() {
        assert_eq!((&encoded[i][..3], &linear[i][..3]), (&black[..3], &black[..3]));
        assert_eq!(encoded[i][3], straight[i][3]);
        assert!(encoded[i][..3].iter().all(|color| *color <= encoded[i][3]));
        let alpha = frame.beauty.pixels()[i][3] * 255.0;
        assert!((f32::from(linear[i][3]) - alpha).abs() < 1.0, "{} {alpha}", linear[i][3]);
    }
    // Alpha of a plate is 1 in every mode.
    for mode in [AlphaMode::Premultiplied(AlphaConvention::Encoded), AlphaMode::Premultiplied(AlphaConvention::Linear)]
    {
        assert_eq!(rgba8(&opaque, &View::DISPLAY, mode), over_black);
    }
}

#[test]
fn singles_come_back_from_every_space() {
    let frame = flame(61, 43, Rect { x: 3, y: 2, width: 50, height: 40 });
    for space in [ColorSpace::LinearSrgb, ColorSpace::LinearRec2020, ColorSpace::AcesCg, ColorSpace::Aces2065_1] {
        let mut pixels = vec![f32::NAN; value_count(&frame)];
        write_rgba32f(&frame, space, &mut pixels).unwrap();
        let to_acescg = space.from_acescg().inverse();
        for (pixel, written) in frame.beauty.pixels().iter().zip(pixels.as_chunks::<4>().0) {
            let [r, g, b, alpha] = *written;
            assert_eq!(alpha, pixel[3]);
            let back = to_acescg.apply([r, g, b].map(f64::from));
            assert!(
                back.iter().zip(pixel).all(|(a, b)| (a - f64::from(*b)).abs() < 1e-6),
                "{space:?} {pixel:?} {back:?}"
            );
        }
    }
}

#[test]
fn extreme_light_stays_finite() {
    let frame = light::frame(35, false);
    assert_eq!(frame.beauty.pixels().len(), 35 * COUNT);
    for pixel in rgba16f(&frame) {
        assert!(
            pixel[..3].iter().all(|v| (0.0..=65_504.0).contains(v)) && (0.0..=1.0).contains(&pixel[3]),
            "{pixel:?}"
        );
    }
}

#[test]
fn depth_and_channels_are_written_by_name() {
    let mut frame = flame(20, 10, Rect { x: 3, y: 2, width: 5, height: 4 });
    let depth: Vec<f32> = (0..200).map(|i| if i % 7 == 0 { i as f32 } else { f32::INFINITY }).collect();
    frame.depth = Some(depth.clone());
    let mut values = vec![-1.0; 200];
    write_depth32f(&frame, &mut values).unwrap();
    assert_eq!(values, depth);
    frame.depth = None;
    write_depth32f(&frame, &mut values).unwrap();
    assert_eq!(values, [f32::INFINITY; 200]);

    write_channel32f(&frame, "torch.temperature_k", &mut values).unwrap();
    assert_eq!(values, frame.channels[2].values);
    let error = write_channel32f(&frame, "torch.temperature", &mut values).unwrap_err();
    let ChannelError::UnknownChannel { available, .. } = &error else { panic!("{error}") };
    assert_eq!(available, &["torch.R", "torch.motion.X", "torch.temperature_k"]);
    let message = error.to_string();
    assert!(message.contains("`torch.temperature`") && message.contains("torch.motion.X"), "{message}");
    frame.channels.clear();
    assert!(write_channel32f(&frame, "torch.R", &mut values).unwrap_err().to_string().contains("none"));
}

#[test]
fn a_buffer_of_another_length_is_refused_and_not_touched() {
    let frame = flame(6, 4, Rect::from_size(6, 4));
    let expected = BufferLengthError { expected: 96, found: 95, width: 6, height: 4, channels: 4, element: "f16" };
    let mut halves = [f16::ONE; 95];
    assert_eq!(write_rgba16f(&frame, &mut halves), Err(expected));
    assert_eq!(halves, [f16::ONE; 95]);
    let message = expected.to_string();
    assert!(["95", "f16", "6 x 4", "4 channels", "96", "top"].iter().all(|part| message.contains(part)), "{message}");

    let error = |result: Result<(), BufferLengthError>| {
        let error = result.unwrap_err();
        (error.expected, error.found, error.element)
    };
    let alpha = AlphaMode::Straight(AlphaConvention::Linear);
    assert_eq!(error(write_rgba8(&frame, &View::DISPLAY, alpha, &mut [0; 97])), (96, 97, "u8"));
    assert_eq!(error(write_rgba32f(&frame, ColorSpace::AcesCg, &mut [])), (96, 0, "f32"));
    assert_eq!(error(write_depth32f(&frame, &mut [0.0; 96])), (24, 96, "f32"));
    assert!(matches!(
        write_channel32f(&frame, "torch.R", &mut [0.0; 25]),
        Err(ChannelError::BufferLength(BufferLengthError { expected: 24, found: 25, channels: 1, .. }))
    ));
    // A frame without pixels needs an empty buffer.
    let empty = flame(0, 0, Rect::default());
    assert_eq!(write_rgba16f(&empty, &mut []), Ok(()));
}
