//! Frames in which hot air bends what lies behind it.
//!
//! The slices fall into groups, each nearer than one bending layer. Groups are drawn one by one; then, from far to
//! near, each layer bends all that lies behind it (and the plate) before the next group is laid over.

use bansho_base::{
    image::{Channel, Frame, FrameHeader, Image, Rect},
    observer::{self, Cancelled, Observer},
    phenomenon::Deflection,
};
use fearless_simd::Level;
use rayon::prelude::*;

use super::compose::{self, Composition, STRIP_ROWS, Worker};
use crate::slices::Slice;

/// Planes of the window. The first four are red, green, blue and alpha; then four for each layer, the plate's last.
struct Picture {
    planes: Vec<Vec<f32>>,
    depth: Vec<f32>,
}

/// One group as it was drawn: its own light, and what it lets through.
struct Group {
    picture: Picture,
    transmittance: [Vec<f32>; 3],
    aovs: Vec<Vec<f32>>,
}

pub(super) fn frame(
    composition: &Composition,
    header: FrameHeader,
    observer: &dyn Observer,
) -> Result<Frame, Cancelled> {
    let mut bends: Vec<Deflection> = composition.prepared.iter().filter_map(|prepared| prepared.deflection()).collect();
    bends.sort_by(|a, b| a.depth.total_cmp(&b.depth));
    let mut picture = plate(composition);
    let mut aovs = Vec::new();
    let mut slices = composition.slices;
    for index in (0..=bends.len()).rev() {
        let first = match index {
            0 => 0,
            _ => slices.partition_point(|slice| slice.interval.near <= bends[index - 1].depth),
        };
        let group = draw_group(composition, &slices[first..], observer)?;
        slices = &slices[..first];
        if let Some(bend) = bends.get(index) {
            picture = bent(composition, &picture, bend);
        }
        lay_over(&mut picture, &group);
        nearest_aovs(&mut aovs, group.aovs);
    }
    Ok(finish(composition, header, picture, aovs))
}

/// The plate alone.
fn plate(composition: &Composition) -> Picture {
    let window = composition.view.window;
    let pixels = window.width * window.height;
    let layers = if composition.outputs.layers { composition.phenomena.len() } else { 0 };
    let mut planes = vec![vec![0.0; pixels]; 4 + 4 * layers];
    let mut depth = vec![f32::INFINITY; pixels];
    for row in 0..window.height {
        let range = row * window.width..(row + 1) * window.width;
        if let Some(plate) = composition.plate_row(window.y + row) {
            for (index, pixel) in range.clone().zip(plate) {
                (0..4).for_each(|c| planes[c][index] = pixel[c]);
            }
        }
        if let Some(image) = &composition.plate.depth {
            depth[range].copy_from_slice(&image.row(window.y + row).as_flattened()[window.x..window.right()]);
        }
    }
    if composition.outputs.layers && composition.plate.colour.is_some() {
        planes.extend_from_within(..4);
    }
    Picture { planes, depth }
}

fn draw_group(composition: &Composition, slices: &[Slice], observer: &dyn Observer) -> Result<Group, Cancelled> {
    let level = Level::new();
    let strips = composition.view.window.height.div_ceil(STRIP_ROWS);
    let parts: Vec<Group> = (0..strips)
        .into_par_iter()
        .map_init(Worker::default, |worker, index| {
            observer::check(observer)?;
            composition.accumulate(level, slices, composition.strip_rect(index), worker);
            Ok(group_strip(composition, worker))
        })
        .collect::<Result<_, Cancelled>>()?;
    let mut parts = parts.into_iter();
    let mut whole = parts.next().unwrap_or_else(|| Group {
        picture: Picture { planes: Vec::new(), depth: Vec::new() },
        transmittance: Default::default(),
        aovs: Vec::new(),
    });
    for part in parts {
        append(&mut whole.picture.planes, part.picture.planes);
        whole.picture.depth.extend(part.picture.depth);
        whole.transmittance.iter_mut().zip(part.transmittance).for_each(|(all, more)| all.extend(more));
        append(&mut whole.aovs, part.aovs);
    }
    Ok(whole)
}

fn append(planes: &mut [Vec<f32>], more: Vec<Vec<f32>>) {
    planes.iter_mut().zip(more).for_each(|(plane, more)| plane.extend(more));
}

fn group_strip(composition: &Composition, worker: &Worker) -> Group {
    let accumulator = &worker.accumulator;
    let exposure = composition.outputs.exposure;
    let exposed = |plane: &Vec<f32>| plane.iter().map(|value| exposure * value).collect::<Vec<f32>>();
    let mut planes: Vec<Vec<f32>> = accumulator.colour.iter().map(exposed).collect();
    let pixels = accumulator.depth.len();
    let transmittance = accumulator.transmittance().cloned().unwrap_or_else(|| [0, 1, 2].map(|_| vec![1.0; pixels]));
    let [red, green, blue] = &transmittance;
    planes.push(red.iter().zip(green).zip(blue).map(|((r, g), b)| 1.0 - (r + g + b) / 3.0).collect());
    for layer in &accumulator.layers {
        planes.extend(layer[..3].iter().map(exposed));
        planes.push(layer[3].clone());
    }
    Group {
        picture: Picture { planes, depth: accumulator.depth.clone() },
        transmittance,
        aovs: compose::aov_planes(composition, accumulator),
    }
}

/// Lays a group before the picture. The plate's layer, which no group has, is only dimmed.
fn lay_over(picture: &mut Picture, group: &Group) {
    let [red, green, blue] = &group.transmittance;
    picture.planes.par_iter_mut().enumerate().for_each(|(number, plane)| {
        for (index, value) in plane.iter_mut().enumerate() {
            let through = match number % 4 {
                3 => (red[index] + green[index] + blue[index]) / 3.0,
                c => group.transmittance[c][index],
            };
            let added = group.picture.planes.get(number).map_or(0.0, |own| own[index]);
            *value = through.mul_add(*value, added);
        }
    });
    picture.depth.iter_mut().zip(&group.picture.depth).for_each(|(depth, own)| *depth = depth.min(*own));
}

/// Everything in `picture` as it is seen through the bending layer: looked up where the bent ray arrives.
fn bent(composition: &Composition, picture: &Picture, bend: &Deflection) -> Picture {
    let window = composition.view.window;
    let focal = composition.view.camera.focal_pixels as f32;
    let look = |index: usize| {
        let (x, y) = (index % window.width, index / window.width);
        let angle = angle_at(bend, window.x + x, window.y + y)?;
        let depth = picture.depth[index];
        let lever = if depth.is_finite() { (1.0 - bend.depth as f32 / depth).max(0.0) } else { 1.0 };
        Some([x as f32 + focal * lever * angle[0], y as f32 - focal * lever * angle[1]])
    };
    let pixels = window.width * window.height;
    let places: Vec<Option<[f32; 2]>> = (0..pixels).into_par_iter().map(look).collect();
    let warp = |plane: &Vec<f32>| -> Vec<f32> {
        let at = |(place, value): (&Option<[f32; 2]>, &f32)| match place {
            None => *value,
            Some(place) => bilinear(plane, window.width, window.height, *place),
        };
        places.iter().zip(plane).map(at).collect()
    };
    Picture { planes: picture.planes.par_iter().map(warp).collect(), depth: picture.depth.clone() }
}

/// The angle at a pixel of the whole picture; `None` where the light goes straight.
fn angle_at(bend: &Deflection, x: usize, y: usize) -> Option<[f32; 2]> {
    let inside = x >= bend.rect.x && y >= bend.rect.y && x < bend.rect.right() && y < bend.rect.bottom();
    let angle = inside.then(|| bend.angle.at(x - bend.rect.x, y - bend.rect.y))?;
    (angle != [0.0, 0.0]).then_some(angle)
}

fn bilinear(plane: &[f32], width: usize, height: usize, place: [f32; 2]) -> f32 {
    let split = |place: f32, side: usize| {
        let place = place.clamp(0.0, (side - 1) as f32);
        let cell = (place as usize).min(side.saturating_sub(2));
        (cell, (cell + 1).min(side - 1), place - cell as f32)
    };
    let (left, right, fx) = split(place[0], width);
    let (top, bottom, fy) = split(place[1], height);
    let row = |y: usize| {
        let (a, b) = (plane[y * width + left], plane[y * width + right]);
        fx.mul_add(b - a, a)
    };
    let (upper, lower) = (row(top), row(bottom));
    fy.mul_add(lower - upper, upper)
}

/// AOVs are not bent. Of a phenomenon that reaches into several groups, the nearest group with a value counts.
fn nearest_aovs(known: &mut Vec<Vec<f32>>, nearer: Vec<Vec<f32>>) {
    if known.is_empty() {
        *known = nearer;
        return;
    }
    for (value, nearer) in known.iter_mut().flatten().zip(nearer.into_iter().flatten()) {
        if nearer != 0.0 {
            *value = nearer;
        }
    }
}

fn finish(composition: &Composition, header: FrameHeader, picture: Picture, aovs: Vec<Vec<f32>>) -> Frame {
    let window = composition.view.window;
    let mut beauty = Image::filled(window.width, window.height, [0.0; 4]);
    for (index, pixel) in beauty.pixels_mut().iter_mut().enumerate() {
        *pixel = [0, 1, 2, 3].map(|c| picture.planes[c][index]);
    }
    let mut layers = picture.planes;
    layers.drain(..4);
    layers.extend(aovs);
    let channels: Vec<Channel> = compose::channels(composition, vec![layers]);
    let opaque = composition.plate.colour.is_some() && composition.view.overscan == 0;
    Frame {
        header,
        beauty,
        depth: Some(picture.depth),
        channels,
        opaque,
        figures: Vec::new(),
        content: Rect::of_size(window.width, window.height),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bilinear_look_up_is_exact_on_pixels_and_linear_between() {
        let plane = [0.0, 1.0, 2.0, 10.0, 11.0, 12.0];
        assert_eq!(bilinear(&plane, 3, 2, [2.0, 1.0]), 12.0);
        assert_eq!(bilinear(&plane, 3, 2, [0.5, 0.5]), 5.5);
        assert_eq!(bilinear(&plane, 3, 2, [-4.0, 9.0]), 10.0);
        assert_eq!(bilinear(&[7.0], 1, 1, [0.3, 0.9]), 7.0);
    }
}
