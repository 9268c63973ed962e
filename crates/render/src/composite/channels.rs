//! The channels of a frame besides its color: layers of the phenomena and of the plate, and AOVs.

use bansho_base::{
    frame::{Channel, Precision},
    math::MulAdd,
    phenomenon::strip::AovRule,
};
use bansho_scene::PLATE_LAYER;

use super::{
    accumulate::Accumulator,
    background::{Background, BentPixels},
    composition::{Composition, StripScratch},
};

/// The planes of this strip for every layer and AOV, in the order of [`channels`].
pub(super) fn channel_planes(composition: &Composition, scratch: &mut StripScratch) -> Vec<Vec<f32>> {
    let mut planes = layer_planes(composition, scratch);
    let layers = planes.len();
    planes.extend(aov_planes(composition, &scratch.accumulator));
    let rules = composition.runs.iter().flat_map(|run| run.info().aovs).map(|aov| aov.rule);
    let drawn = composition.background.channels.get(layers..).unwrap_or_default();
    for ((plane, drawn), rule) in planes[layers..].iter_mut().zip(drawn).zip(rules) {
        let values = composition.background.plane(
            &drawn.values,
            scratch.accumulator.rect,
            &BentPixels::default(),
            composition.view.size[0],
        );
        plane.iter_mut().zip(values).for_each(|(own, farther)| *own = combine_aov(*own, farther, rule));
    }
    planes
}

/// Combines the AOV of a phenomenon that extends over several groups of slices: the sum, or the value of the nearest group that has one.
fn combine_aov(own: f32, farther: f32, rule: AovRule) -> f32 {
    match rule {
        AovRule::Sum => own + farther,
        AovRule::WeightedMean | AovRule::Nearest if own == 0.0 => farther,
        AovRule::WeightedMean | AovRule::Nearest => own,
    }
}

/// Layers of the phenomena and of the plate: those of this strip, and those of the background times its transmittance.
fn layer_planes(composition: &Composition, scratch: &mut StripScratch) -> Vec<Vec<f32>> {
    let (exposure, background) = (composition.outputs.exposure, &composition.background);
    let accumulator = &scratch.accumulator;
    let mut planes = Vec::new();
    for layer in &accumulator.layers {
        planes.extend(layer[..3].iter().map(|plane| plane.iter().map(|value| exposure * value).collect::<Vec<f32>>()));
        planes.push(layer[3].clone());
    }
    if composition.outputs.layers && composition.plate.color.is_some() {
        match background.channels {
            [] => planes.extend(plate_layer(composition, scratch)),
            _ => planes.extend([0; 4].map(|_| vec![0.0; accumulator.depth.len()])),
        }
    }
    let accumulator = &scratch.accumulator;
    for (channel, (plane, drawn)) in planes.iter_mut().zip(background.channels).enumerate() {
        let values = background.plane(&drawn.values, accumulator.rect, &scratch.bent, composition.view.size[0]);
        for (index, (own, value)) in plane.iter_mut().zip(values).enumerate() {
            let through = accumulator.transmittance_at(index);
            let weight = through.get(channel % 4).copied().unwrap_or((through[0] + through[1] + through[2]) / 3.0);
            *own = weight.fma(value, *own);
        }
    }
    planes
}

fn aov_planes(composition: &Composition, accumulator: &Accumulator) -> Vec<Vec<f32>> {
    let mut planes = Vec::new();
    for (run, aovs) in composition.runs.iter().zip(&accumulator.aovs) {
        for (descriptor, plane) in run.info().aovs.iter().zip(aovs) {
            let pixels = accumulator.rect.width * accumulator.rect.height;
            planes.push((0..pixels).map(|index| plane.resolve(index, descriptor.rule)).collect());
        }
    }
    planes
}

fn plate_layer(composition: &Composition, scratch: &mut StripScratch) -> [Vec<f32>; 4] {
    let StripScratch { accumulator, bent, row: buffer, .. } = scratch;
    let rect = accumulator.rect;
    let mut layer: [Vec<f32>; 4] = Default::default();
    let Some(image) = composition.background.color else { return layer };
    for row in 0..rect.height {
        let plate = Background::row(image, rect, row, bent, buffer);
        for (x, plate) in plate.iter().enumerate() {
            let through = accumulator.transmittance_at(row * rect.width + x);
            for c in 0..3 {
                layer[c].push(through[c] * plate[c]);
            }
            layer[3].push(plate[3] * (through[0] + through[1] + through[2]) / 3.0);
        }
    }
    layer
}

/// Concatenates the planes of all strips into named channels.
pub(super) fn channels(composition: &Composition, strips: Vec<Vec<Vec<f32>>>) -> Vec<Channel> {
    let mut channels = channel_names(composition);
    for strip in strips {
        for (channel, plane) in channels.iter_mut().zip(strip) {
            channel.values.extend(plane);
        }
    }
    channels
}

/// The channels without values.
fn channel_names(composition: &Composition) -> Vec<Channel> {
    let mut channels = Vec::new();
    if composition.outputs.layers {
        let plate = composition.plate.color.is_some().then_some(PLATE_LAYER);
        let names = composition.runs.iter().map(|run| run.info().name).chain(plate);
        for name in names {
            for suffix in ["R", "G", "B", "A"] {
                let name = format!("{name}.{suffix}");
                channels.push(Channel { name, precision: Precision::Half, values: Vec::new() });
            }
        }
    }
    if composition.outputs.aovs {
        for run in composition.runs {
            let info = run.info();
            for aov in info.aovs {
                let name = format!("{}.{}", info.name, aov.name);
                channels.push(Channel { name, precision: Precision::Single, values: Vec::new() });
            }
        }
    }
    channels
}
