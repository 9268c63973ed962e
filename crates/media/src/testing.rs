//! Pictures for this crate's tests.

use bansho_base::{
    camera::CameraHeader,
    color::AlphaConvention,
    frame::{Channel, DisplayEncoding, DisplayImage, DisplayPixels, Frame, FrameHeader, Precision},
    image::{Image, Rect},
};

/// A small frame in which every value is different, with depth, a layer and an AOV.
pub(crate) fn frame(width: usize, height: usize) -> Frame {
    let count = width * height;
    let pixels = (0..count).map(|i| [i as f32, i as f32 * 0.5, -0.25 * i as f32, i as f32 / count as f32]).collect();
    Frame {
        header: header(width, height),
        beauty: Image::from_pixels(width, height, pixels).unwrap(),
        depth: Some(plane(count, 3.0).into_iter().map(|z| if z > 100.0 { f32::INFINITY } else { z }).collect()),
        channels: vec![
            Channel { name: "torch.temperature_k".to_owned(), precision: Precision::Single, values: plane(count, 1.7) },
            Channel { name: "torch.R".to_owned(), precision: Precision::Half, values: plane(count, 0.01) },
        ],
        opaque: false,
        metadata: Vec::new(),
        content: Rect::from_size(width, height),
    }
}

/// Values that rise by `scale`.
fn plane(count: usize, scale: f32) -> Vec<f32> {
    (0..count).map(|i| i as f32 * scale + 0.1).collect()
}

/// A matrix whose elements rise by 1, row by row.
fn matrix(start: f64) -> [[f64; 4]; 4] {
    std::array::from_fn(|i| std::array::from_fn(|j| start + (4 * i + j) as f64))
}

fn header(width: usize, height: usize) -> FrameHeader {
    FrameHeader {
        number: 1001,
        exposure_ev100: 7.5,
        white_balance_k: None,
        fps: [24000, 1001],
        exposure_time_s: 0.02,
        camera: CameraHeader {
            world_to_camera: matrix(0.0),
            world_to_ndc: Some(matrix(100.0)),
            vertical_fov_deg: Some(40.0),
            lens: None,
            fisheye_fov_deg: None,
        },
        fingerprint: [9; 32],
        display_size: [width, height],
        data_origin: [0, 0],
    }
}

/// A small 8-bit picture with soft alpha, different for every `frame`.
pub(crate) fn display(width: usize, height: usize, frame: usize) -> DisplayImage {
    let pixels = (0..width * height)
        .map(|i| [(i * 7 + frame * 40) as u8, (i * 3) as u8, (200 - i % 200) as u8, (i * 11 + frame) as u8]);
    DisplayImage {
        width,
        height,
        opaque: false,
        alpha: AlphaConvention::Linear,
        encoding: DisplayEncoding::Srgb,
        pixels: DisplayPixels::Eight(pixels.collect()),
    }
}
