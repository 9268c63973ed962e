//! The equations one by one, compared with results computed by hand.

use bansho_base::math::random::Key;

use super::*;
use crate::{
    FieldCharge, RelocationParameters,
    shapes::{ControlPointIds, FRAME_S, Sheet},
    simulate::{
        AuroraParticles,
        field::{relative_residual, sheet_charge::scatter, sheet_field::FieldBuilder},
        forces::Integrator,
        relocation::Relocation,
        sheets::{
            arc_length::ArcLengthMap,
            refined_shape::{FoldModel, RefinedShape},
        },
    },
};

const KEY: Key = Key::new(1, "rules");

fn sheet(points: &[[f64; 2]]) -> Sheet {
    Sheet {
        points: points.iter().map(|point| DVec2::from(*point)).collect(),
        flux: vec![1.0; points.len()],
        energy: vec![1.0; points.len()],
    }
}

fn refined(parameters: &AuroraParameters, sheets: &[&[[f64; 2]]], reach: f64) -> RefinedShape {
    let shape = Shape { sheets: sheets.iter().map(|points| sheet(points)).collect() };
    RefinedShape::new(&shape, &[], &ArcLengthMap::alone(&shape), &FoldModel::new(parameters, KEY), 0.0, reach)
}

#[test]
fn scatter_is_even_where_segments_overlap() {
    let parameters = AuroraParameters { thickness_km: bansho_base::parameters::Auto::Set(40.0), ..small() };
    // Two sheets 20 km apart that reach 20 km to each side: 60 km by 200 km, nothing counted twice.
    let refined = refined(&parameters, &[&[[-100.0, 0.0], [100.0, 0.0]], &[[-100.0, 20.0], [100.0, 20.0]]], 60.0);
    let positions = scatter(&refined, 20.0, 40_000, KEY, 0);
    // A quarter is nearer to the other sheet.
    let difference = positions.len() as f64 / 40_000.0 - 0.75;
    bansho_base::assert_measured!("figure 2.8: difference from three quarters", difference, 0.0, 0.01);
    let rows = |from: f64, to: f64| positions.iter().filter(|c| (from..to).contains(&c.position.y)).count() as f64;
    assert!((rows(0.0, 20.0) / rows(-20.0, 0.0) - 1.0).abs() < 0.03);
    assert!(positions.iter().all(|c| refined.distance(c.position).is_some_and(|distance| distance <= 20.0 + 1e-9)));
}

#[test]
fn the_coordinate_runs_evenly_along_points_that_lie_unevenly() {
    let parameters =
        AuroraParameters { folds: crate::FoldParameters { amplitude_km: 0.0, ..small().folds }, ..small() };
    let points = [[-50.0, 0.0], [-48.0, 0.0], [10.0, 0.0], [10.0, 0.0], [20.0, 0.0]];
    let refined = refined(&parameters, &[&points], 20.0);
    for last in [1, 7, 64] {
        let arc_coordinates = refined.arc_coordinates(0, last);
        assert_eq!(arc_coordinates.len(), last + 1);
        for (node, along) in arc_coordinates.iter().enumerate() {
            let even = 70.0 * node as f64 / last as f64;
            assert!((along - even).abs() < 0.3, "{along} km for {even} at {node} of {last}");
        }
    }
}

#[test]
fn points_that_have_changed_places_make_no_loop() {
    // The middle of an S as it forms: two of its points are still in the wrong order.
    let middle =
        [[30.0, -1.5], [20.0, -1.0], [10.0, 0.0], [-0.3, 0.7], [0.3, 0.9], [-10.0, 1.5], [-20.0, 2.0], [-30.0, 3.0]];
    let length = refined(&small(), &[&middle], 20.0).sheet_lengths()[0];
    let straight = DVec2::from(middle[0]).distance(middle[7].into());
    assert!(length < 1.02 * straight, "{length} for {straight}");
}

#[test]
fn the_field_solves_its_equation_and_is_lowest_on_the_sheet() {
    let mut parameters = small();
    parameters.field.noise = 0.0;
    let builder = FieldBuilder::new(&parameters, KEY);
    let cell = parameters.cell_km();
    let half = parameters.half_thickness_km();
    let refined = refined(&parameters, &[&[[-200.0, 0.0], [200.0, 0.0]]], 40.0);
    let scattered = scatter(&refined, half, 200_000, KEY, 0);
    let field = builder.build(&refined, &scattered, 0.0);
    let potential = &field.potential;
    let source = builder.charge_density(&refined, &scattered, &field.counts);
    let left = relative_residual(potential, &source, builder.screening);
    bansho_base::assert_measured!("equation (2.3): residual", left, 0.0, 1e-10);
    let lowest = potential.values().iter().copied().fold(f64::INFINITY, f64::min);
    assert!(lowest < 0.0 && potential.values().iter().all(|value| *value <= 0.0));
    // Three cells south of a layer of rho = 0.25 cells per frame^2 and cell, one cell to each side: rho l sinh(1 / 3) exp(-3 / 3), l = 3 cells.
    let pull = f64::from(field.sample(0.0, (3.0 * cell) as f32).field[1]) * FRAME_S * FRAME_S / cell;
    bansho_base::assert_measured!(
        "equation (2.7): field three cells from a sheet, cells per frame^2",
        pull,
        -0.0937,
        0.0094
    );
    // And along the sheet there is next to no force, up to near its ends.
    for east in [0.0, 100.0, 180.0, 192.0_f32] {
        let along = f64::from(field.sample(east, 0.0).field[0]) * FRAME_S * FRAME_S / cell;
        assert!(along.abs() < 0.03, "{east}: {along}");
    }
}

/// A field without charges.
fn nothing(parameters: &AuroraParameters) -> crate::simulate::field::sheet_field::ElectricField {
    let refined = refined(parameters, &[&[[-200.0, 0.0], [200.0, 0.0]]], 40.0);
    FieldBuilder::new(parameters, KEY).build(&refined, &[], 0.0)
}

#[test]
fn sheets_that_do_not_pull_make_no_field() {
    let mut parameters = small();
    parameters.field.attraction = 0.0;
    let builder = FieldBuilder::new(&parameters, KEY);
    let refined = refined(&parameters, &[&[[-200.0, 0.0], [200.0, 0.0]]], 40.0);
    let scattered = scatter(&refined, parameters.half_thickness_km(), 2_000, KEY, 0);
    let field = builder.build(&refined, &scattered, 0.5);
    assert!(field.potential.values().iter().all(|value| *value == 0.0));
    let sample = field.sample(10.0, 5.0);
    assert_eq!((sample.potential, sample.field), (0.0, [0.0; 2]));
}

#[test]
fn a_free_particle_keeps_its_way_and_the_magnetic_field_turns_it() {
    let mut parameters = small();
    parameters.particles.friction_per_s = 0.0;
    parameters.particles.lorentz_weight = 1.0;
    parameters.field.gyration_deg_per_frame = 90.0;
    let field = nothing(&parameters);
    let mut particles = AuroraParticles::default();
    particles.push(0, DVec2::ZERO, [30.0, 0.0], 1.0);
    let none = [vec![0.0], vec![0.0]];
    Integrator::new(&parameters).advance(&mut particles, &field, &none);
    // A quarter turn per frame, and 30 km/s for a frame are 1 km.
    let (position, velocity) = (particles.position(0), particles.velocities.each_ref().map(|v| v[0]));
    assert!((position - DVec2::new(0.0, -1.0)).length() < 1e-5, "{position}");
    bansho_base::assert_measured!("equation (2.10): way in a frame, km", position.length(), 1.0, 1e-5);
    let turn = bansho_base::math::atan2(f64::from(velocity[1]), f64::from(velocity[0])).to_degrees();
    bansho_base::assert_measured!("equation (2.10): turn in a frame, degrees", turn, -90.0, 1e-3);
    assert!(velocity[0].abs() < 1e-4 && (velocity[1] + 30.0).abs() < 1e-4, "{velocity:?}");
    // Eq. (2.19) and (2.20) with a push of 9 km/s^2 along x and weight 0.4, without the bound on energy.
    parameters.field.gyration_deg_per_frame = 0.0;
    parameters.particles.limit_energy = false;
    let mut particles = AuroraParticles::default();
    particles.push(0, DVec2::ZERO, [0.0, 0.0], 1.0);
    Integrator::new(&parameters).advance(&mut particles, &field, &[vec![9.0], vec![0.0]]);
    bansho_base::assert_measured!("equation (2.19): way, km", particles.position(0).x, 0.002, 1e-7);
    bansho_base::assert_measured!("equation (2.20): speed, km/s", f64::from(particles.velocities[0][0]), 0.12, 1e-6);
}

#[test]
fn kinetic_and_potential_energy_do_not_grow() {
    let mut parameters = small();
    parameters.particles.friction_per_s = 0.0;
    parameters.field.noise = 0.5;
    let builder = FieldBuilder::new(&parameters, KEY);
    let refined = refined(&parameters, &[&[[-200.0, 0.0], [0.0, 60.0], [200.0, 0.0]]], 40.0);
    let scattered = scatter(&refined, parameters.half_thickness_km(), 20_000, KEY, 0);
    let field = builder.build(&refined, &scattered, 1.0);
    let mut particles = AuroraParticles::default();
    for id in 0..500 {
        let [u, v, ..] = KEY.uniforms(id, 0, bansho_base::math::random::Purpose(0)).map(f64::from);
        particles.push(id, DVec2::new(u - 0.5, v - 0.5) * 400.0, [0.0; 2], 1.0);
    }
    let energies = |particles: &AuroraParticles| -> Vec<f64> {
        let energy = |i: usize| {
            let [u, w] = particles.velocities.each_ref().map(|v| f64::from(v[i]));
            let here = field.sample(particles.positions[0][i], particles.positions[1][i]);
            0.5 * (u * u + w * w) + parameters.particles.lorentz_weight * f64::from(here.potential)
        };
        (0..particles.len()).map(energy).collect()
    };
    let none = [vec![0.0; 500], vec![0.0; 500]];
    let depth = field.potential.values().iter().fold(0.0_f64, |least, value| least.min(*value)).abs();
    let mover = Integrator::new(&parameters);
    let mut largest = 0.0_f64;
    for _ in 0..60 {
        let before = energies(&particles);
        mover.advance(&mut particles, &field, &none);
        // Where it has no speed left a particle may still creep by half a t^2.
        for (before, (after, i)) in before.iter().zip(energies(&particles).into_iter().zip(0..)) {
            let resting = particles.velocities.iter().all(|v: &Vec<f32>| v[i] == 0.0);
            if !resting {
                largest = largest.max((after - before) / depth);
            }
        }
    }
    bansho_base::assert_measured!("section 2.3.3: growth of energy, of the depth", largest, 0.0, 1e-5);
}

/// A straight sheet on a grid of cells of 10 km, with `count` particles in the cell at (0, 0)...(10, 10).
fn relocated(
    count: usize,
    position: impl Fn(f64, f64) -> DVec2,
    table: RelocationParameters,
) -> (AuroraParticles, u64) {
    let mut parameters = AuroraParameters { extent_km: 600.0, ..small() };
    parameters.field.cells = 60;
    parameters.field.noise = 0.0;
    parameters.particles.count = 1_000_000;
    parameters.particles.relocation = table;
    let refined = refined(&parameters, &[&[[-200.0, 5.0], [200.0, 5.0]]], 60.0);
    let builder = FieldBuilder::new(&parameters, KEY);
    let scattered = scatter(&refined, 5.0, 20_000, KEY, 0);
    let field = builder.build(&refined, &scattered, 0.0);
    let mut particles = AuroraParticles::default();
    for id in 0..count as u64 {
        let [u, v, ..] = KEY.uniforms(id, 0, bansho_base::math::random::Purpose(7)).map(f64::from);
        particles.push(id, position(u, v), [2.0, -1.0], 1.0);
    }
    let mut next = count as u64;
    Relocation::new(&parameters, KEY).relocate(&mut particles, &field, &refined, &scattered, 0, &mut next);
    (particles, next)
}

fn in_cell(u: f64, v: f64) -> DVec2 {
    DVec2::new(10.0 * u, 10.0 * v)
}

#[test]
fn table_3_3_to_the_letter() {
    let table = || RelocationParameters { scale_counts: false, ..RelocationParameters::default() };
    // 700 in a cell: 200 too many, of which the 100 farthest from the line at z = 5 die.
    let (particles, _) = relocated(700, in_cell, table());
    let distance = |index: &usize| (particles.position(*index).y - 5.0).abs();
    let (dead, alive): (Vec<usize>, Vec<usize>) = (0..700).partition(|index| particles.dying[*index]);
    bansho_base::assert_measured!("table 3.3: of 700 particles of a cell die", dead.len() as f64, 100.0, 0.0);
    let nearest_dead = dead.iter().map(distance).fold(f64::INFINITY, f64::min);
    assert!(alive.iter().map(distance).all(|distance| distance <= nearest_dead));
    // 520: only the 20 above 500.
    assert_eq!(relocated(520, in_cell, table()).0.dying.iter().filter(|dying| **dying).count(), 20);
    // 47 where 50 should be: 3 are born there, and 10 in each other near cell, 39 of them along 400 km.
    let (particles, next) = relocated(47, in_cell, table());
    let born: Vec<DVec2> = (47..particles.len()).map(|index| particles.position(index)).collect();
    let here = born.iter().filter(|p| (0.0..10.0).contains(&p.x) && (0.0..10.0).contains(&p.y)).count();
    assert_eq!((here, born.len(), next), (3, 3 + 390, 47 + 393));
    assert!(particles.fades[47..].iter().all(|fade| *fade == 0.0));
    // New particles have the mean velocity of the surrounding cells; there are none far away.
    let east = |index: usize| particles.velocities[0][index];
    assert!((47..particles.len()).all(|i| east(i)
        == if particles.position(i).x.abs() < 10.0 || (10.0..20.0).contains(&particles.position(i).x) {
            2.0
        } else {
            0.0
        }));
}

#[test]
fn strays_die() {
    let table = RelocationParameters { births_below: 0.0, ..RelocationParameters::default() };
    let (particles, _) = relocated(100, |u, v| DVec2::new(200.0 * u - 100.0, 20.0 + 100.0 * v), table);
    assert!(particles.dying.iter().all(|dying| *dying));
}

#[test]
fn the_coordinate_stays_with_the_sheet_when_it_splits() {
    let whole = Shape { sheets: vec![sheet(&[[0.0, 0.0], [10.0, 0.0], [20.0, 0.0], [30.0, 0.0]])] };
    let along = ArcLengthMap::alone(&whole);
    assert_eq!(along.coordinates, [[0.0, 10.0, 20.0, 30.0]]);
    let parts = Shape {
        sheets: vec![sheet(&[[0.0, 0.0], [10.0, 0.0], [14.0, 0.0]]), sheet(&[[16.0, 0.0], [20.0, 0.0], [30.0, 0.0]])],
    };
    let numbers = [vec![0, 1, 4], vec![5, 2, 3]];
    let mut split = along.transfer(&parts, &ControlPointIds::alone(&numbers));
    assert_eq!(split.coordinates, [[0.0, 10.0, 14.0], [16.0, 20.0, 30.0]]);
    // The second half moves away and shrinks to half its length; its coordinate moves with it and then follows its length.
    let far = Shape { sheets: vec![parts.sheets[0].clone(), sheet(&[[90.0, 9.0], [92.0, 9.0], [97.0, 9.0]])] };
    split = split.transfer(&far, &ControlPointIds::alone(&numbers));
    assert_eq!(split.coordinates[1], [16.0, 20.0, 30.0]);
    (0..1000).for_each(|_| split.relax(0.1));
    let length = split.coordinates[1][2] - split.coordinates[1][0];
    assert!((length - 7.0).abs() < 1e-6 && (split.coordinates[1].iter().sum::<f64>() - 66.0).abs() < 1e-6);
    // When joined again, the discontinuity keeps its position, and neither half is compressed into it.
    let joined = Shape { sheets: vec![sheet(&[[0.0, 0.0], [10.0, 0.0], [90.0, 9.0], [97.0, 9.0]])] };
    let mut again = split.transfer(&joined, &ControlPointIds::alone(&[vec![0, 1, 5, 3]]));
    (0..100).for_each(|_| again.relax(0.1));
    assert!((again.coordinates[0][1] - again.coordinates[0][0] - 10.0).abs() < 1e-6);
    assert!((again.coordinates[0][3] - again.coordinates[0][2] - 7.0).abs() < 1e-3);
}

#[test]
fn power_is_flux_times_area_and_follows_the_drawn_flux() {
    let mut parameters = AuroraParameters { shapes: vec![shape(vec![line([-200.0, 0.0], [200.0, 0.0])])], ..small() };
    parameters.shapes[0].sheets[0].flux_factor = bansho_base::math::curve::Curve::new(
        vec![[0.0, 0.0], [1.0, 2.0]],
        bansho_base::math::curve::Interpolation::Linear,
    )
    .unwrap();
    parameters.flux_mw_per_m2 = 10.0.into();
    // Rays would make one half brighter than the other.
    parameters.rays.contrast = 0.0;
    let mut simulation = simulation(parameters);
    (0..40).for_each(|_| simulation.step());
    // 10 mW/m^2 on 400 km times the thickness, and the mean of the curve is 1.
    let expected = 10.0 * 1e3 * 400.0 * 2.0 * simulation.parameters().half_thickness_km();
    let power = simulation.particles().power_w();
    assert!((power / expected - 1.0).abs() < 0.01, "{power} {expected}");
    let particles = simulation.particles();
    let east: f64 = (0..particles.len())
        .filter(|index| particles.position(*index).x > 0.0)
        .map(|index| f64::from(particles.powers_w[index]))
        .sum();
    assert!((east / expected - 0.75).abs() < 0.02, "{}", east / expected);
    // A steady aurora glows with its own power.
    let green = simulation.afterglow().green.powers_w()[0];
    assert!((green / power - 1.0).abs() < 0.02, "{green} {power}");
}

#[test]
fn when_electrons_stop_each_map_fades_with_its_own_lifetime() {
    use bansho_base::{math, math::curve::Interpolation, parameters::animated::Animated};
    for time_lapse in [1.0, 2.0] {
        let shapes = vec![shape(vec![line([-200.0, 0.0], [200.0, 0.0])])];
        let mut parameters = AuroraParameters { shapes, time_lapse, ..small() };
        let stop = vec![(0.0, 20.0), (0.05, 0.0)];
        parameters.flux_mw_per_m2 = Animated::keyed(stop, Interpolation::Linear).unwrap();
        let mut simulation = simulation(parameters);
        let go_to = |simulation: &mut AuroraSimulation, time: f64| {
            while simulation.time() < time - 1e-6 {
                simulation.step();
            }
            [simulation.afterglow().green.powers_w()[0], simulation.afterglow().red.powers_w()[2]]
        };
        let before = go_to(&mut simulation, 0.0);
        assert!((before[1] / before[0] - 1.0).abs() < 0.1, "both are fed alike: {before:?}");
        // By then the particles have lost their power.
        let [early, late] = [2.0, 3.0].map(|time| go_to(&mut simulation, time));
        assert!(simulation.particles().power_w() < 1e-6 * before[0]);
        // Red light at high altitudes.
        let lifetimes =
            [simulation.emission().column(5000.0).lifetime[0], simulation.emission().red_lifetimes(5000.0)[2]];
        // 0.75 s and 134 s where nothing quenches.
        assert!((0.3..0.75).contains(&lifetimes[0]) && (70.0..134.0).contains(&lifetimes[1]), "{lifetimes:?}");
        for map in 0..2 {
            let (kept, expected) = (late[map] / early[map], math::exp(-time_lapse / lifetimes[map]));
            assert!((kept / expected - 1.0).abs() < 0.01, "{map}: {kept} of the light is kept, not {expected}");
        }
    }
}

/// Eq. (2.2) literally: the charge of a cell is its count.
#[test]
fn an_even_charge_is_the_count() {
    let of = |charge: FieldCharge| {
        let mut parameters = AuroraParameters { shapes: vec![shape(vec![form(Form::Spiral)])], ..small() };
        (parameters.field.charge, parameters.field.noise) = (charge, 0.0);
        let simulation = simulation(parameters);
        let (counts, potential) = (simulation.scatter_counts(), simulation.potential());
        // The charge again, from the potential by the five-point Laplacian and the screening length of three cells.
        let [columns, rows] = counts.size();
        let mut ratios = Vec::new();
        for (column, row) in
            (1..columns - 1).flat_map(|column| (1..rows - 1).map(move |row| (column as isize, row as isize)))
        {
            let at = |x: isize, y: isize| potential.at(column + x, row + y);
            let laplacian = at(1, 0) + at(-1, 0) + at(0, 1) + at(0, -1) - 4.0 * at(0, 0);
            if counts.at(column, row) > 0.0 {
                ratios.push((laplacian - at(0, 0) / 9.0) / counts.at(column, row));
            }
        }
        let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
        ratios.iter().map(|ratio| (ratio / mean - 1.0).abs()).fold(0.0, f64::max)
    };
    let (even, conductor) = (of(FieldCharge::Uniform), of(FieldCharge::Conductor));
    assert!(conductor > 0.1, "{conductor}");
    bansho_base::assert_measured!("equation (2.2): difference from the count", even, 0.0, 1e-6);
}

#[test]
fn the_number_of_births_is_bounded() {
    let mut parameters = AuroraParameters { shapes: vec![shape(vec![form(Form::Arc)])], ..small() };
    parameters.particles.relocation =
        RelocationParameters { births_below: 1e6, max_births: 1e6, ..parameters.particles.relocation };
    let mut simulation = simulation(parameters);
    for _ in 0..8 {
        simulation.step();
        assert!(simulation.particles().len() <= 4 * 12_000, "{}", simulation.particles().len());
    }
    assert!(simulation.particles().len() > 12_000);
}
