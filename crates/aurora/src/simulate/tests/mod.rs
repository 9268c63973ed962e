//! Behavior of the aurora's particles.

mod arrivals;
mod contract;
mod literal;
mod rules;
mod shapes;

use bansho_base::{host::assets::MemoryAssets, math::DVec2, parameters::Auto};

use super::AuroraSimulation;
use crate::{
    AuroraParameters, FieldParameters, FoldParameters, ParticleParameters, SwirlParameters,
    shapes::{Form, MergeParameters, Sequence, Shape, ShapeParameters, SheetParameters, SplitParameters},
};

/// Few particles on a coarse grid, without folds and swirls.
fn small() -> AuroraParameters {
    AuroraParameters {
        field: FieldParameters { cells: 127, ..FieldParameters::default() },
        particles: ParticleParameters { count: 12_000, ..ParticleParameters::default() },
        folds: FoldParameters { amplitude_km: 0.0, ..FoldParameters::default() },
        swirls: SwirlParameters { displacement_km: 0.0, ..SwirlParameters::default() },
        ..AuroraParameters::default()
    }
}

fn sequence(parameters: &AuroraParameters) -> Sequence {
    Sequence::new(&parameters.shapes, &parameters.morphing, parameters.extent_km, &MemoryAssets::default(), None)
        .unwrap()
}

fn simulation(parameters: AuroraParameters) -> AuroraSimulation {
    let sequence = sequence(&parameters);
    AuroraSimulation::new(parameters, sequence, "aurora", 5)
}

fn shape(sheets: Vec<SheetParameters>) -> ShapeParameters {
    ShapeParameters { sheets, hold_s: 3.0, ..ShapeParameters::default() }
}

/// A form with uniform flux.
fn form(form: Form) -> SheetParameters {
    SheetParameters { form: Some(form), end_taper: 0.0, ..SheetParameters::default() }
}

fn line(from: [f64; 2], to: [f64; 2]) -> SheetParameters {
    SheetParameters { points: Some(vec![from, to]), end_taper: 0.0, ..SheetParameters::default() }
}

/// From an arc to a form.
fn becoming(other: Form) -> Vec<ShapeParameters> {
    vec![shape(vec![form(Form::Arc)]), shape(vec![form(other)])]
}

fn halves() -> Vec<SheetParameters> {
    let half = |east: f64, south: f64| SheetParameters {
        position_km: [east, south],
        length_km: Auto::Set(180.0),
        ..form(Form::Arc)
    };
    vec![half(-140.0, -40.0), half(130.0, 40.0)]
}

fn splitting() -> Vec<ShapeParameters> {
    let split = vec![SplitParameters::default()];
    vec![shape(vec![form(Form::Arc)]), ShapeParameters { split, ..shape(halves()) }]
}

fn merging() -> Vec<ShapeParameters> {
    let merge = vec![MergeParameters::default()];
    vec![shape(halves()), ShapeParameters { merge, ..shape(vec![form(Form::Arc)]) }]
}

/// Particles that are not fading out.
fn live(simulation: &AuroraSimulation) -> Vec<(DVec2, f64)> {
    let particles = simulation.particles();
    let live = (0..particles.len()).filter(|index| !particles.dying[*index]);
    live.map(|index| (particles.position(index), f64::from(particles.powers_w[index]))).collect()
}

/// Sums of power over intervals of the shape, each a 50th of its length, by the nearest of many points on it; and counts.
fn intervals(shape: &Shape, particles: &[(DVec2, f64)]) -> [Vec<f64>; 2] {
    const INTERVALS: usize = 50;
    const POINTS: usize = 10 * INTERVALS;
    let segments = crate::shapes::SheetSampler::new(shape);
    let points: Vec<DVec2> =
        (0..POINTS).filter_map(|i| Some(segments.sample((i as f64 + 0.5) / POINTS as f64)?.point)).collect();
    let mut sums = [vec![0.0; INTERVALS], vec![0.0; INTERVALS]];
    for (position, power) in particles {
        let distance = |index: &usize| points[*index].distance_squared(*position);
        let nearest = (0..POINTS).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap();
        sums[0][nearest / 10] += power;
        sums[1][nearest / 10] += 1.0;
    }
    sums
}
