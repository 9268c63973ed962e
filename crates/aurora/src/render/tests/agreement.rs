//! The mean of pictures of single collisions is the picture of the mean profile, for each emitter.

use bansho_base::{assert_measured, parameters::Auto};

use super::*;
use crate::{parameters::MAX_COLLISION_DEFLECTION, physics::precipitation::HardSphereParameters};

/// Sum of absolute differences over the sum, for each emitter but the red line, of which few collisions are left.
fn differences(a: &[PerEmitter<f32>], b: &[PerEmitter<f32>]) -> [f64; 3] {
    [SpectralEmitter::OxygenGreen, SpectralEmitter::NitrogenIon, SpectralEmitter::Nitrogen].map(|emitter| {
        let i = emitter.index();
        let apart: f64 = a.iter().zip(b).map(|(a, b)| f64::from((a[i] - b[i]).abs())).sum();
        apart / b.iter().map(|light| f64::from(light[i])).sum::<f64>()
    })
}

/// Standard deviation of sources without the lateral spread of their collisions, km.
const OWN_SPREAD_KM: f64 = 1.5;

/// Difference of the mean of 64 pictures of collisions from the picture of the mean profile, and that picture.
fn beside_profile(
    emission: &Emission,
    collisions: &CollisionRenderer,
    cells: &[AfterglowCell<1>],
    spread_km: f64,
) -> ([f64; 3], ColumnBuffer) {
    let (mean, expected) = mean_picture(emission, collisions, cells, spread_km, PROMPT_AND_GREEN);
    (differences(&mean, &expected.light), expected)
}

/// The mean of 64 pictures of collisions, and the picture of the mean profile, of the light in `shares`.
fn mean_picture(
    emission: &Emission,
    collisions: &CollisionRenderer,
    cells: &[AfterglowCell<1>],
    spread_km: f64,
    shares: EmitterWeights,
) -> (Vec<PerEmitter<f32>>, ColumnBuffer) {
    let (profiles, view, field) = (
        EmissionProfiles::new(emission, &AttenuationByDistance::default()),
        view(Lens::Perspective, [0.0, 60.0, -110.0], [160, 90]),
        field(77.0),
    );
    let sources = sources(cells, shares, spread_km, &field);
    // Low rows, since single points are spread over two of them.
    let chart = || Chart::new(&Coverage::of_view(&view, &field), STEP, 0.5 * STEP);
    let sorted = |columns| SortedSources::new(&sources, &chart(), columns, &field, spread_of(&sources));
    let expected = ColumnBuffer::zeros(chart()).integrate(&field, &profiles, &sorted(BLOCK_COLUMNS));
    let sorted_sources = sorted(COLLISION_BLOCK_COLUMNS);
    let mut mean = vec![[0.0; 4]; expected.light.len()];
    for step in 0..64 {
        let picture = collisions.draw(ColumnBuffer::zeros(chart()), &field, &sorted_sources, step);
        for (sum, light) in mean.iter_mut().zip(&picture.light) {
            *sum = std::array::from_fn(|i| light[i].mul_add(1.0 / 64.0, sum[i]));
        }
    }
    (mean, expected)
}

/// The same for an arc of so many particles with tracks of a seed.
fn arc_beside_profile(
    track_model: TrackModel,
    collision_deflection: f64,
    seed: u64,
    particles: usize,
) -> ([f64; 3], ColumnBuffer) {
    let drawing =
        RenderingParameters { energy_deposition: track_model, collision_deflection, ..RenderingParameters::default() };
    arc_drawn(&drawing, seed, particles)
}

/// The same for any rendering.
fn arc_drawn(drawing: &RenderingParameters, seed: u64, particles: usize) -> ([f64; 3], ColumnBuffer) {
    let (mean, expected) = arc_pictures(drawing, seed, particles, PROMPT_AND_GREEN);
    (differences(&mean, &expected.light), expected)
}

/// The mean of pictures of collisions of an arc, and the picture of the mean profile.
fn arc_pictures(
    drawing: &RenderingParameters,
    seed: u64,
    particles: usize,
    shares: EmitterWeights,
) -> (Vec<PerEmitter<f32>>, ColumnBuffer) {
    let emission = drawing.emission(SpectrumShape::Gaussian, None);
    let collisions = CollisionRenderer::new(
        &emission,
        drawing,
        &AttenuationByDistance::default(),
        nearest_node(6.0 * ENERGY_EV),
        Key::new(seed, "aurora"),
    );
    let spread_km = math::hypot(OWN_SPREAD_KM, emission.lateral_spread_km(drawing.collision_deflection, ENERGY_EV));
    mean_picture(&emission, &collisions, &arc(particles), spread_km, shares)
}

fn usual_collision_deflection() -> f64 {
    RenderingParameters::default().collision_deflection
}

#[test]
#[ignore = "statistics of half a minute or more: .ci/long runs them"]
fn the_mean_of_many_collision_pictures_is_the_profile() {
    for (seed, collision_deflection) in [
        (5, usual_collision_deflection()),
        (77, usual_collision_deflection()),
        (5, 0.02),
        (5, MAX_COLLISION_DEFLECTION),
        (77, MAX_COLLISION_DEFLECTION),
    ] {
        let (apart, _) = arc_beside_profile(TrackModel::Fang2010, collision_deflection, seed, 8000);
        assert!(apart.iter().all(|apart| *apart < 0.03), "seed {seed}, deflection {collision_deflection}: {apart:?}");
    }
}

#[test]
fn the_mean_of_many_tracks_of_the_thesis_is_their_profile() {
    // Green light is quenched low down, where a track has most of its collisions; it comes from the few that are left above: more noise, and so more particles.
    for (seed, collision_deflection) in
        [(5, usual_collision_deflection()), (77, usual_collision_deflection()), (5, MAX_COLLISION_DEFLECTION)]
    {
        let (apart, _) = arc_beside_profile(TrackModel::HardSphereAtmosphere, collision_deflection, seed, 40_000);
        assert!(apart.iter().all(|apart| *apart < 0.03), "seed {seed}, deflection {collision_deflection}: {apart:?}");
    }
}

#[test]
fn single_photons_have_the_mean_of_single_collisions() {
    let spheres =
        RenderingParameters { energy_deposition: TrackModel::HardSphereAtmosphere, ..RenderingParameters::default() };
    let [(photons, expected), (collisions, _)] = [Sampling::SinglePhotons, Sampling::SingleCollisions]
        .map(|sampling| arc_pictures(&RenderingParameters { sampling, ..spheres.clone() }, 5, 12_000, SOFT));
    let apart = differences(&photons, &expected.light);
    // The means by row are noisier than those of the whole picture.
    assert!(apart.iter().all(|apart| *apart < 0.1), "{apart:?}");
    let total = |picture: &[PerEmitter<f32>], emitter: SpectralEmitter| {
        picture.iter().map(|light| f64::from(light[emitter.index()])).sum::<f64>()
    };
    let difference = |emitter| total(&photons, emitter) / total(&collisions, emitter) - 1.0;
    let [green, red, violet, deep_red] = [
        SpectralEmitter::OxygenGreen,
        SpectralEmitter::OxygenRed,
        SpectralEmitter::NitrogenIon,
        SpectralEmitter::Nitrogen,
    ]
    .map(difference);
    assert_measured!("section 2.4.2: draws: difference at 557.7 nm", green, 0.0, 0.01);
    assert_measured!("section 2.4.2: draws: difference at 630.0 nm", red, 0.0, 0.01);
    assert_measured!("section 2.4.2: draws: difference at 391.4 and 427.8 nm", violet, 0.0, 0.01);
    assert_measured!("section 2.4.2: draws: difference at 670.5 nm", deep_red, 0.0, 0.01);
}

/// A sheet with the largest energy factor that a scene may have, and the tracks of its aurora.
#[test]
fn collisions_lose_no_light_on_hard_sheets() {
    const FACTOR: f64 = 20.0;
    let sheet = SheetParameters {
        energy_factor: Curve::new(vec![[0.0, FACTOR]], Interpolation::Linear).unwrap(),
        ..SheetParameters::default()
    };
    let parameters = AuroraParameters {
        energy_ev: Animated::from(0.2 * ENERGY_EV),
        particles: ParticleParameters { count: 100, ..ParticleParameters::default() },
        shapes: vec![ShapeParameters { sheets: vec![sheet], ..ShapeParameters::default() }],
        rendering: RenderingParameters { sampling: Sampling::SingleCollisions, ..RenderingParameters::default() },
        ..AuroraParameters::default()
    };
    let run = run(parameters);
    let mut cells = arc(3000);
    cells.iter_mut().for_each(|cell| cell.energy_ev *= (0.2 * FACTOR) as f32);
    let (emission, collisions) = (run.simulation().emission(), run.render_inputs().tables.collisions.as_ref().unwrap());
    let (apart, _) = beside_profile(emission, collisions, &cells, OWN_SPREAD_KM);
    assert!(apart.iter().all(|apart| *apart < 0.03), "{apart:?}");
}

/// The row of a picture above which half of an emitter's light is, from the magnetic zenith on.
fn middle_row(picture: &ColumnBuffer, emitter: SpectralEmitter) -> usize {
    let mut rows = vec![0.0; picture.chart.rows];
    for (at, light) in picture.light.iter().enumerate() {
        rows[at % picture.chart.rows] += f64::from(light[emitter.index()]);
    }
    let whole: f64 = rows.iter().sum();
    let mut above = 0.0;
    rows.iter()
        .take_while(|row| {
            above += **row;
            above < 0.5 * whole
        })
        .count()
}

#[test]
fn green_light_is_higher_with_the_tracks_of_the_thesis() {
    let drawn = |energy_deposition, quenching_radius_pm| {
        let hard_spheres = HardSphereParameters { quenching_radius_pm, ..HardSphereParameters::default() };
        let deflection = RenderingParameters { collision_deflection: 0.0, ..RenderingParameters::default() };
        arc_drawn(&RenderingParameters { energy_deposition, hard_spheres, ..deflection }, 5, 1000).1
    };
    let measured = drawn(TrackModel::Fang2010, Auto::Auto);
    let [one_radius, molecules] =
        [Auto::Auto, Auto::Set(185.0)].map(|radius| drawn(TrackModel::HardSphereAtmosphere, radius));
    // Rows of 5 mrad: quenched by molecules, most green light is above 190 km; with one radius its middle is higher, but less so. Violet light is hardly
    // elsewhere at this energy.
    let [green, violet] = [SpectralEmitter::OxygenGreen, SpectralEmitter::NitrogenIon]
        .map(|emitter| [&measured, &one_radius, &molecules].map(|picture| middle_row(picture, emitter)));
    assert!(green[2] + 20 < green[0], "{green:?}");
    assert!(green[2] < green[1] && green[1] < green[0], "{green:?}");
    assert!(violet[1..].iter().all(|row| row.abs_diff(violet[0]) < 25), "{violet:?}");
}
