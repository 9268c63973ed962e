//! Particles go where the shapes are.

use super::*;
use crate::aurora::{RepulsionKernel, shapes::Neighbourhood};

/// Seconds after a shape is reached from which on particles are where they shall be, how often that is looked at, and for how long.
const SETTLED_S: f64 = 1.5;
const MOMENT_STEPS: u64 = 15;
const WATCHED_S: f64 = 3.5;

/// What particles must do at one moment: how many lie within L_thr of the target, how many in the gaps, and what the least stretch holds of
/// its share of the power and of the particles.
struct Moment {
    within: f64,
    in_gaps: f64,
    least: [f64; 2],
}

fn moment(simulation: &AuroraSimulation, target: &Shape) -> Moment {
    let half = simulation.parameters().half_thickness_km();
    let near = Neighbourhood::new(target, 2.0 * half);
    let particles = live(simulation);
    let distances: Vec<Option<f64>> = particles.iter().map(|(place, _)| near.distance(*place)).collect();
    let share = |count: usize| count as f64 / particles.len() as f64;
    let least = |sums: &[f64]| {
        let mean = sums.iter().sum::<f64>() / sums.len() as f64;
        sums.iter().copied().fold(f64::INFINITY, f64::min) / mean
    };
    let [powers, counts] = stretches(target, &particles);
    Moment {
        within: share(distances.iter().flatten().filter(|distance| **distance <= half).count()),
        in_gaps: share(distances.iter().filter(|distance| distance.is_none()).count()),
        least: [least(&powers), least(&counts)],
    }
}

#[test]
fn after_a_transition_particles_lie_on_the_target_and_everywhere_along_it() {
    // A turn of the spiral lies 12 km from the next: sheets of 9 km, as on the coarse grid, would be one.
    for (name, cells, shapes) in [
        ("peel", 127, becoming(Form::Peel)),
        ("s", 127, becoming(Form::SShape)),
        ("split", 127, splitting()),
        ("merge", 127, merging()),
        ("spiral", 255, becoming(Form::Spiral)),
    ] {
        let mut parameters = AuroraParameters { shapes, ..small() };
        parameters.field.cells = cells;
        // Rays brighten and darken stretches on purpose.
        parameters.rays.contrast = 0.0;
        let sequence = sequence(&parameters);
        let mut simulation = simulation(parameters);
        let arrival = sequence.arrivals()[1];
        let (mut moments, mut steps) = (0, 0_u64);
        while simulation.time() < arrival + WATCHED_S {
            simulation.step();
            steps += 1;
            let time = simulation.time();
            if time < arrival + SETTLED_S || !steps.is_multiple_of(MOMENT_STEPS) {
                continue;
            }
            moments += 1;
            let Moment { within, in_gaps, least: [power, count] } = moment(&simulation, &sequence.at(time));
            assert!(within >= 0.955, "{name}: {within} within L_thr, {time} s");
            assert!(in_gaps < 1e-3, "{name}: {in_gaps} in the gaps, {time} s");
            assert!(power >= 0.5, "{name}: a stretch has {power} of its power, {time} s");
            assert!(count >= 0.5, "{name}: a stretch has {count} of its particles, {time} s");
        }
        assert!(moments >= 3, "{name}: {moments}");
    }
}

#[test]
fn there_are_about_as_many_particles_as_are_asked_for() {
    let mut simulation = simulation(AuroraParameters { shapes: becoming(Form::Peel), ..small() });
    for _ in 0..120 {
        simulation.step();
        let share = simulation.particles().len() as f64 / 12_000.0;
        assert!((0.9..1.2).contains(&share), "{share} at {} s", simulation.time());
    }
}

/// The square is cut into blocks of a sixteenth; what changes in any of them counts.
fn greatest_jumps(shapes: Vec<ShapeParameters>) -> [f64; 2] {
    const BLOCKS: usize = 16;
    let parameters = AuroraParameters { shapes, ..small() };
    let end = sequence(&parameters).duration();
    let extent = parameters.extent_km;
    let mut simulation = simulation(parameters);
    let blocks = |simulation: &AuroraSimulation| {
        let mut blocks = vec![0.0; BLOCKS * BLOCKS];
        let particles = simulation.particles();
        for index in 0..particles.len() {
            let block =
                ((particles.place(index) / extent + 0.5) * BLOCKS as f64).clamp(DVec2::ZERO, DVec2::splat(15.9));
            blocks[block.y as usize * BLOCKS + block.x as usize] += f64::from(particles.powers_w[index]);
        }
        blocks
    };
    let (mut whole, mut local) = (0.0_f64, 0.0_f64);
    let mut before = blocks(&simulation);
    while simulation.time() < end {
        simulation.step();
        let after = blocks(&simulation);
        let sums = [&before, &after].map(|blocks| blocks.iter().sum::<f64>());
        whole = whole.max((sums[1] / sums[0] - 1.0).abs());
        let change: f64 = before.iter().zip(&after).map(|(before, after)| (after - before).abs()).sum();
        local = local.max(change / 2.0 / sums[0]);
        before = after;
    }
    [whole, local]
}

#[test]
fn nothing_jumps_from_frame_to_frame_through_split_merge_and_relocation() {
    for (name, shapes) in [("split", splitting()), ("merge", merging()), ("peel", becoming(Form::Peel))] {
        let [whole, local] = greatest_jumps(shapes);
        assert!(whole < 0.02, "{name}: all light changes by {whole} in a frame");
        // What moves from block to block counts here too.
        assert!(local < 0.06, "{name}: {local} of the light changes its place in a frame");
    }
}

/// Median distance from a particle of a straight sheet to its nearest neighbour, beside that of as many strewn at random.
fn parting(kernel: RepulsionKernel) -> f64 {
    let mut parameters = AuroraParameters { shapes: vec![shape(vec![line([-200.0, 0.0], [200.0, 0.0])])], ..small() };
    parameters.particles.kernel = kernel;
    let mut simulation = simulation(parameters);
    (0..90).for_each(|_| simulation.step());
    let mut places: Vec<DVec2> = live(&simulation).into_iter().map(|(place, _)| place).collect();
    places.sort_by(|a, b| a.x.total_cmp(&b.x));
    let middle: Vec<usize> = (0..places.len()).filter(|index| places[*index].x.abs() < 100.0).collect();
    let nearest = |index: &usize| {
        // Along the sheet none of those beyond 200 in the list is nearer.
        let near = index.saturating_sub(200)..(index + 200).min(places.len());
        near.filter(|other| other != index)
            .map(|other| places[other].distance(places[*index]))
            .fold(f64::INFINITY, f64::min)
    };
    let mut distances: Vec<f64> = middle.iter().map(nearest).collect();
    distances.sort_by(f64::total_cmp);
    let rms =
        (middle.iter().map(|index| places[*index].y * places[*index].y).sum::<f64>() / middle.len() as f64).sqrt();
    // Over an even band of that rms half width.
    let area = 200.0 * 2.0 * rms * 3f64.sqrt();
    let random = (std::f64::consts::LN_2 / std::f64::consts::PI * area / middle.len() as f64).sqrt();
    distances[distances.len() / 2] / random
}

/// What the kernels differ in: not in rays as they are drawn, but in how close to each other particles come.
#[test]
fn poly6_with_spiky_parts_particles_that_the_spline_lets_be() {
    let [spline, parted] = [RepulsionKernel::Spline, RepulsionKernel::Poly6Spiky].map(parting);
    assert!(parted > 1.1 * spline, "{spline} {parted}");
}

#[test]
fn a_step_costs_what_its_particles_cost_not_what_the_drawn_shapes_are_long() {
    const RENEWALS: u32 = 3;
    let of = |rows: i32| {
        let sheet = |row: i32| line([-200.0, f64::from(30 * row - 210)], [200.0, f64::from(30 * row - 210)]);
        let mut parameters = AuroraParameters { shapes: vec![shape((0..rows).map(sheet).collect())], ..small() };
        parameters.particles.count = 30_000;
        parameters.motion.renew_frames = f64::from(RENEWALS);
        simulation(parameters)
    };
    let mut simulations = [of(1), of(15)];
    let mut least = [f64::INFINITY; 2];
    for _ in 0..6 {
        for (simulation, least) in simulations.iter_mut().zip(&mut least) {
            let start = std::time::Instant::now();
            (0..RENEWALS).for_each(|_| simulation.step());
            *least = least.min(start.elapsed().as_secs_f64());
        }
    }
    // Fifteen times the length; as many particles.
    let [counts, times] = [simulations.map(|simulation| simulation.particles().len() as f64), least];
    assert!((counts[1] / counts[0] - 1.0).abs() < 0.2, "{counts:?}");
    assert!(times[1] < 4.0 * times[0], "{times:?} s");
}
