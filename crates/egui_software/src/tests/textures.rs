//! Textured meshes.

use egui::{TextureFilter, TextureOptions, TextureWrapMode, pos2, vec2};

use super::*;

const PICTURE: TextureId = TextureId::Managed(5);

fn image(size: [usize; 2], seed: u64, alpha: u8) -> ColorImage {
    let mut random = random(seed);
    let mut channel = || (random() * f32::from(alpha)) as u8;
    let pixels =
        (0..size[0] * size[1]).map(|_| Color32::from_rgba_premultiplied(channel(), channel(), channel(), alpha));
    ColorImage::new(size, pixels.collect())
}

/// A rectangle with the picture.
fn shown(rect: Rect, uv: Rect, tint: Color32) -> Mesh {
    let mut mesh = Mesh::with_texture(PICTURE);
    mesh.add_rect_with_uv(rect, uv, tint);
    mesh
}

const WHOLE: Rect = Rect { min: pos2(0.0, 0.0), max: pos2(1.0, 1.0) };

fn pack_xrgb(color: Color32) -> u32 {
    let [red, green, blue, _] = color.to_array();
    u32::from_be_bytes([0, red, green, blue])
}

#[test]
fn an_unscaled_picture_is_copied() {
    let (mut painter, picture) = (painter(), image([90, 50], 1, 255));
    set(&mut painter, PICTURE, None, picture.clone());
    // Partly outside of the window, too.
    for [left, top] in [[20_i32, 10], [-13, -7], [100, 45]] {
        let rect = Rect::from_min_size(pos2(left as f32, top as f32), vec2(90.0, 50.0));
        let (pixels, _) = painted(&mut painter, [shown(rect, WHOLE, Color32::WHITE)]);
        for y in 0..SIZE[1] {
            for x in 0..SIZE[0] {
                let (column, row) = (x as i32 - left, y as i32 - top);
                let inside = (0..90).contains(&column) && (0..50).contains(&row);
                let expected = if inside { pack_xrgb(picture.pixels[(row * 90 + column) as usize]) } else { 0 };
                assert_eq!(pixel(&pixels, x, y), expected, "({x}, {y}) of one at ({left}, {top})");
            }
        }
    }
}

#[test]
fn a_scaled_picture_equals_its_two_triangles() {
    for (seed, alpha) in [(3, 255), (4, 120)] {
        let mut painter = painter();
        set(&mut painter, PICTURE, None, image([23, 17], seed, alpha));
        for tint in [Color32::WHITE, Color32::from_rgba_premultiplied(90, 120, 30, 200)] {
            let whole = shown(Rect::from_min_max(pos2(3.25, 2.5), pos2(140.0, 66.75)), WHOLE, tint);
            let halves =
                [0, 3].map(|first| Mesh { indices: whole.indices[first..first + 3].to_vec(), ..whole.clone() });
            let (one, _) = painted(&mut painter, [whole]);
            let (two, _) = painted(&mut painter, halves);
            let apart = |(a, b): (&u32, &u32)| {
                let (a, b) = (a.to_be_bytes(), b.to_be_bytes());
                (0..4).map(|c| a[c].abs_diff(b[c])).max().unwrap_or(0)
            };
            let worst = one.iter().zip(&two).map(apart).max();
            assert!(worst <= Some(1), "{worst:?} of 255 apart");
            assert!(one.iter().any(|pixel| *pixel != 0));
        }
    }
}

#[test]
fn the_middle_between_two_texels_is_their_mean() {
    let mut painter = painter();
    let texels = [0, 200].map(Color32::from_gray).to_vec();
    set(&mut painter, PICTURE, None, ColorImage::new([2, 1], texels));
    let rect = Rect::from_min_size(pos2(0.0, 0.0), vec2(8.0, 4.0));
    let (pixels, _) = painted(&mut painter, [shown(rect, WHOLE, Color32::WHITE)]);
    // Pixel centers are at 1/8, 3/8... of a texel.
    let row: Vec<u32> = (0..8).map(|x| pixel(&pixels, x, 1) & 255).collect();
    assert_eq!(row, [0, 0, 25, 75, 125, 175, 200, 200]);
}

#[test]
fn textures_are_wrapped() {
    let row = |wrap_mode: TextureWrapMode| {
        let mut painter = painter();
        let texels = [10, 20, 30].map(Color32::from_gray).to_vec();
        let options = TextureOptions { wrap_mode, ..TextureOptions::NEAREST };
        assert_eq!(options.magnification, TextureFilter::Nearest);
        set_with(&mut painter, PICTURE, None, ColorImage::new([3, 1], texels), options);
        let uv = Rect::from_min_max(pos2(-1.0, 0.0), pos2(2.0, 1.0));
        let rect = Rect::from_min_size(pos2(0.0, 0.0), vec2(9.0, 1.0));
        let (pixels, _) = painted(&mut painter, [shown(rect, uv, Color32::WHITE)]);
        (0..9).map(|x| pixel(&pixels, x, 0) & 255).collect::<Vec<_>>()
    };
    assert_eq!(row(TextureWrapMode::ClampToEdge), [10, 10, 10, 10, 20, 30, 30, 30, 30]);
    assert_eq!(row(TextureWrapMode::Repeat), [10, 20, 30, 10, 20, 30, 10, 20, 30]);
    assert_eq!(row(TextureWrapMode::MirroredRepeat), [30, 20, 10, 10, 20, 30, 30, 20, 10]);
}

#[test]
fn only_tiles_of_changed_texels_are_repainted() {
    let (mut painter, picture) = (painter(), image([150, 70], 1, 255));
    let mesh = || [shown(Rect::from_min_size(Pos2::ZERO, vec2(150.0, 70.0)), WHOLE, Color32::WHITE)];
    set(&mut painter, PICTURE, None, picture.clone());
    painted(&mut painter, mesh());
    // The same picture again.
    set(&mut painter, PICTURE, None, picture.clone());
    assert!(painted(&mut painter, mesh()).1.is_empty());
    // A picture with one changed texel.
    let mut other = picture.clone();
    other.pixels[150 * 40 + 20] = Color32::RED;
    set(&mut painter, PICTURE, None, other.clone());
    let (pixels, changed) = painted(&mut painter, mesh());
    assert_eq!(changed, [PixelRect { left: 0, top: 32, right: 64, bottom: 64 }]);
    assert_eq!(pixel(&pixels, 20, 40), 0x00ff_0000);
    // A region that exceeds the texture.
    set(&mut painter, PICTURE, Some([140, 66]), ColorImage::filled([30, 30], Color32::GREEN));
    let (pixels, changed) = painted(&mut painter, mesh());
    assert_eq!(changed, [PixelRect { left: 128, top: 64, right: 150, bottom: 70 }]);
    for (x, y) in [(139, 66), (140, 65)] {
        assert_eq!(pixel(&pixels, x, y), pack_xrgb(picture.pixels[(y * 150 + x) as usize]));
    }
    assert_eq!([pixel(&pixels, 140, 66), pixel(&pixels, 149, 69)], [0x0000_ff00; 2]);
    // Regions outside of the texture, or of no texture, change nothing.
    set(&mut painter, PICTURE, Some([150, 0]), ColorImage::filled([3, 3], Color32::GREEN));
    set(&mut painter, TextureId::Managed(77), Some([0, 0]), ColorImage::filled([3, 3], Color32::GREEN));
    assert!(painted(&mut painter, mesh()).1.is_empty());
}

#[test]
fn a_freed_texture_is_not_painted() {
    let mut painter = painter();
    set(&mut painter, PICTURE, None, image([150, 70], 1, 255));
    let mesh = || [shown(Rect::from_min_size(Pos2::ZERO, vec2(150.0, 70.0)), WHOLE, Color32::WHITE)];
    assert!(painted(&mut painter, mesh()).0.iter().any(|pixel| *pixel != 0));
    let mut delta = TexturesDelta::default();
    delta.free(PICTURE);
    painter.free_textures(&mut delta);
    assert!(painted(&mut painter, mesh()).0.iter().all(|pixel| *pixel == 0));
}
