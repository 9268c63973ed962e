//! Which pixels are painted, and when.

use egui::{Color32, Mesh, Rect, pos2, vec2};

use super::*;

const GREY: Color32 = Color32::from_rgba_premultiplied(100, 100, 100, 100);

/// GREY once over black.
const ONCE: u32 = 0x0064_6464;

/// A mesh of triangles with random corners, which covers the window without overlaps.
fn triangle_mesh(seed: u64, grid: f32) -> Vec<[f32; 2]> {
    let mut random = random(seed);
    let [across, down] = [10, 6];
    let mut corners = Vec::new();
    for y in 0..=down {
        for x in 0..=across {
            let inside = |at: i32, last: i32| f32::from(u8::from(at > 0 && at < last));
            let position = |at: i32, last: i32, side: f32, moved: f32| {
                let moved = 0.4 * (moved - 0.5) * inside(at, last);
                ((at as f32 + moved) / last as f32 * side * grid).round() / grid
            };
            let corner = [position(x, across, SIZE[0] as f32, random()), position(y, down, SIZE[1] as f32, random())];
            corners.push(corner);
        }
    }
    let corner = |x: i32, y: i32| corners[(y * (across + 1) + x) as usize];
    let mut all = Vec::new();
    for y in 0..down {
        for x in 0..across {
            let [a, b, c, d] = [corner(x, y), corner(x + 1, y), corner(x, y + 1), corner(x + 1, y + 1)];
            // With either orientation.
            all.extend(if random() < 0.5 { [a, b, c, b, c, d] } else { [a, d, c, a, b, d] });
        }
    }
    all
}

#[test]
fn triangles_that_share_edges_paint_every_pixel_once() {
    // Also with corners at pixel centers and on pixel borders.
    for (seed, grid) in [(1, 256.0), (2, 256.0), (3, 2.0), (4, 1.0), (5, 10_000.0)] {
        let (pixels, _) = painted(&mut painter(), [triangles(GREY, &triangle_mesh(seed, grid))]);
        assert!(pixels.iter().all(|pixel| *pixel == ONCE), "corners on 1/{grid} of pixels");
    }
}

#[test]
fn rectangles_equal_their_two_triangles() {
    let mut random = random(7);
    for _ in 0..60 {
        let mut side = |max: f32| (random() * (max + 20.0) - 10.0) * 256.0;
        let corners = [[side(150.0), side(70.0)], [side(150.0), side(70.0)]].map(|at| at.map(|at| at.round() / 256.0));
        let rect = Rect::from_two_pos(corners[0].into(), corners[1].into());
        let whole = rectangle(rect, GREY);
        let halves = [0, 3].map(|first| Mesh { indices: whole.indices[first..first + 3].to_vec(), ..whole.clone() });
        let (one, _) = painted(&mut painter(), [whole]);
        let (two, _) = painted(&mut painter(), halves);
        assert_eq!(one, two, "{rect:?}");
        let centers = |from: f32, to: f32, side: u32| {
            (0..side).filter(|pixel| (from..to).contains(&(*pixel as f32 + 0.5))).count()
        };
        let expected = centers(rect.min.x, rect.max.x, SIZE[0]) * centers(rect.min.y, rect.max.y, SIZE[1]);
        assert_eq!(one.iter().filter(|pixel| **pixel == ONCE).count(), expected, "{rect:?}");
    }
}

#[test]
fn colors_are_linear_between_corners() {
    let corners = [([0.0, 0.0], Color32::BLACK), ([200.0, 0.0], Color32::from_rgb(200, 0, 0))];
    let low = ([0.0, 100.0], Color32::from_rgb(0, 100, 0));
    let mut mesh = triangles(GREY, &[corners[0].0, corners[1].0, low.0]);
    for (vertex, color) in mesh.vertices.iter_mut().zip([corners[0].1, corners[1].1, low.1]) {
        vertex.color = color;
    }
    let (pixels, _) = painted(&mut painter(), [mesh]);
    for (x, y) in [(0, 0), (99, 20), (20, 60), (130, 30)] {
        // The value at the pixel's center; halves are rounded up.
        assert_eq!(pixel(&pixels, x, y), (x + 1) << 16 | (y + 1) << 8, "({x}, {y})");
    }
    assert_eq!(pixel(&pixels, 149, 60), 0, "outside of the triangle");
}

#[test]
fn nothing_is_painted_beyond_a_clip() {
    let mut painter = painter();
    let clip = Rect::from_min_max(pos2(10.4, 20.5), pos2(90.6, 60.4));
    for mesh in [rectangle(EVERYWHERE, Color32::WHITE), triangles(Color32::WHITE, &triangle_mesh(1, 256.0))] {
        painter.paint(&[within(clip, mesh)], 1.0, SIZE);
        let pixels = pixels(&painter);
        for y in 0..SIZE[1] {
            for x in 0..SIZE[0] {
                let inside = (10..91).contains(&x) && (21..60).contains(&y);
                assert_eq!(pixel(&pixels, x, y) != 0, inside, "({x}, {y})");
            }
        }
    }
    // With two pixels per point.
    painter.paint(&[within(clip, rectangle(EVERYWHERE, Color32::WHITE))], 2.0, SIZE);
    let pixels = pixels(&painter);
    assert_eq!([pixel(&pixels, 20, 40), pixel(&pixels, 21, 41), pixel(&pixels, 20, 41)], [0, 0x00ff_ffff, 0]);
    for clip in [Rect::NOTHING, Rect::NAN, Rect::from_min_max(pos2(500.0, 0.0), pos2(600.0, 9.0))] {
        painter.paint(&[within(clip, rectangle(EVERYWHERE, Color32::WHITE))], 1.0, SIZE);
        assert!(super::pixels(&painter).iter().all(|pixel| *pixel == 0), "{clip:?}");
    }
}

#[test]
fn degenerate_triangles_paint_nothing() {
    let nowhere = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX];
    let mut meshes = vec![
        triangles(GREY, &[[5.0, 5.0], [5.0, 5.0], [5.0, 5.0]]),
        triangles(GREY, &[[5.0, 5.0], [50.0, 50.0], [20.0, 20.0]]),
        triangles(GREY, &[[5.0, 5.0], [5.0, 50.0], [5.0, 20.0], [5.0, 5.0], [5.0, 50.0], [5.0, 20.0]]),
        Mesh { indices: vec![0, 1, 99, 7, 8, 9, 1], ..triangles(GREY, &[[0.0, 0.0], [9.0, 0.0], [0.0, 9.0]]) },
        Mesh { texture_id: egui::TextureId::Managed(9), ..rectangle(EVERYWHERE, GREY) },
    ];
    meshes.extend(nowhere.map(|at| triangles(GREY, &[[at, 5.0], [at, 50.0], [at, 20.0]])));
    meshes.push(triangles(GREY, &[[f32::NAN, 5.0], [50.0, 50.0], [20.0, 60.0]]));
    let (pixels, _) = painted(&mut painter(), meshes);
    assert!(pixels.iter().all(|pixel| *pixel == 0));
}

#[test]
fn huge_triangles_cover_the_window() {
    for far in [1e4, 1e6, 1e9, f32::MAX, f32::INFINITY] {
        let (pixels, _) = painted(&mut painter(), [triangles(GREY, &[[-far, -far], [far, -far], [0.0, far]])]);
        assert!(pixels.iter().all(|pixel| *pixel == ONCE), "{far}");
        let rect = Rect::from_min_max(pos2(-far, -far), pos2(far, far));
        let (pixels, _) = painted(&mut painter(), [rectangle(rect, GREY)]);
        assert!(pixels.iter().all(|pixel| *pixel == ONCE), "{far}");
    }
    let none = painter().paint(&[within(EVERYWHERE, rectangle(EVERYWHERE, GREY))], 1.0, [0, 40]);
    assert!(none.is_empty(), "no window, no pixels");
}

#[test]
fn only_changed_tiles_are_repainted() {
    let ground = || rectangle(EVERYWHERE, Color32::from_gray(40));
    let spot = |x: f32| rectangle(Rect::from_min_size(pos2(x, 40.0), vec2(5.0, 5.0)), Color32::RED);
    let mut painter = painter();
    let (_, all) = painted(&mut painter, [ground(), spot(10.0)]);
    assert_eq!(all, [PixelRect { left: 0, top: 0, right: 150, bottom: 70 }]);
    let (_, again) = painted(&mut painter, [ground(), spot(10.0)]);
    assert!(again.is_empty(), "nothing changed");
    let (moved, where_moved) = painted(&mut painter, [ground(), spot(130.0)]);
    let tile = |left, right| PixelRect { left, top: 32, right, bottom: 64 };
    assert_eq!(where_moved, [tile(0, 64), tile(128, 150)]);
    assert_eq!([pixel(&moved, 12, 42), pixel(&moved, 132, 42)], [0x0028_2828, 0x00ff_0000]);
    let (_, below) = painted(&mut painter, [spot(130.0), ground()]);
    assert_eq!(below, [tile(128, 150)], "the ground hides the spot");
}
