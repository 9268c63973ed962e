//! Flows whose answers are known.

use bansho_base::{
    math::{self, DVec3},
    phenomenon::surroundings::Occluder,
    world::gravity::STANDARD_GRAVITY,
};

use crate::{ActiveRows, Ambient, Flow, FlowSettings, Grid};

const AIR: f32 = 1.2;

fn settings(has_floor: bool, wind: [f32; 3]) -> FlowSettings {
    FlowSettings {
        has_floor,
        smagorinsky: 0.1,
        schmidt: 0.5,
        least_density: 0.15,
        ambient: Ambient { density: AIR, velocity: wind },
    }
}

fn flow(size: [usize; 3], has_floor: bool, wind: [f32; 3]) -> Flow {
    let grid = Grid::new(size, 0.05, DVec3::new(-0.4, 0.0, -0.4));
    Flow::new(grid, settings(has_floor, wind))
}

/// A step without burning.
fn step(flow: &mut Flow, wind: [f32; 3], seconds: f32) {
    let all = ActiveRows::all(&flow.grid);
    flow.transport(&all, seconds);
    flow.accelerate(wind, seconds);
}

fn cells(grid: &Grid) -> impl Iterator<Item = ([usize; 3], usize)> + use<> {
    let grid = *grid;
    let [width, height, depth] = grid.size;
    let all = (0..height).flat_map(move |y| (0..depth).flat_map(move |z| (0..width).map(move |x| [x, y, z])));
    all.map(move |cell| (cell, grid.index(cell)))
}

/// A ball of gas with a soft edge of that density, and quantities 1 and 0.5.
fn put_ball(flow: &mut Flow, center: DVec3, radius: f64, density: f32) {
    for (cell, index) in cells(&flow.grid) {
        let edge =
            ((radius - (flow.grid.center(cell) - center).length()) / flow.grid.spacing + 0.5).clamp(0.0, 1.0) as f32;
        flow.contents.density[index] = AIR + (density - AIR) * edge;
        flow.contents.quantities[0][index] = edge;
        flow.contents.quantities[1][index] = 0.5 * edge;
    }
}

fn largest_divergence(flow: &Flow) -> f32 {
    let open = cells(&flow.grid).filter(|(_, index)| !flow.solids.contains(*index));
    open.map(|(_, index)| {
        let parts = flow
            .velocity
            .iter()
            .zip(flow.grid.strides())
            .map(|(values, stride)| values[index + stride] - values[index]);
        (parts.sum::<f32>() / flow.grid.spacing as f32 - flow.divergence[index]).abs()
    })
    .fold(0.0, f32::max)
}

fn mass_of(flow: &Flow, quantity: usize) -> f64 {
    let mass = cells(&flow.grid).map(|(_, index)| {
        f64::from(flow.contents.density[index]) * f64::from(flow.contents.quantities[quantity][index])
    });
    mass.sum()
}

#[test]
fn a_uniform_wind_blows_through_an_empty_grid_unchanged() {
    for wind in [[2.0, 0.0, -1.0], [0.0, 0.0, 0.0], [-0.5, 0.0, 3.0]] {
        for has_floor in [false, true] {
            let mut flow = flow([16, 12, 16], has_floor, wind);
            for _ in 0..40 {
                step(&mut flow, wind, 0.01);
            }
            for (_, index) in cells(&flow.grid) {
                let error = (0..3).map(|axis| (flow.velocity[axis][index] - wind[axis]).abs()).fold(0.0, f32::max);
                assert!(error < 1e-6 * (1.0 + wind[0].abs() + wind[2].abs()), "{wind:?} {has_floor}: {error}");
            }
        }
    }
}

#[test]
fn a_wind_that_rises_takes_all_air_with_it() {
    let mut flow = flow([16, 12, 16], true, [0.0; 3]);
    for number in 1..=50 {
        step(&mut flow, [0.04 * number as f32, 0.0, 0.0], 0.01);
    }
    let index = flow.grid.index([8, 6, 8]);
    assert!((flow.velocity[0][index] - 2.0).abs() < 1e-4 && flow.velocity[1][index].abs() < 1e-5);
}

#[test]
fn air_at_rest_stays_at_rest() {
    let mut flow = flow([16, 20, 16], true, [0.0; 3]);
    for _ in 0..20 {
        step(&mut flow, [0.0; 3], 0.02);
    }
    assert_eq!(flow.largest_speed(), 0.0);
    assert!(flow.contents.density.iter().all(|density| *density == AIR));
}

/// A sphere of density rho_g in air accelerates at `2 (rho_a - rho_g) / (2 rho_g + rho_a) g`, since it sets half of its volume of air in motion (Milne-Thomson
/// 1968). The edge of the ball is one cell of fourteen wide, and what is light is faster in its middle: 13.6, 13.2 and 13.2 for 12.3 m/s^2 with balls of 7, 10
/// and 14 cells.
#[test]
fn a_hot_bubble_begins_to_rise_with_the_added_mass_of_a_sphere() {
    for (density, tolerance) in [(0.2_f32, 0.12), (0.6, 0.04)] {
        let grid = Grid::new([64, 64, 64], 0.02, DVec3::splat(-0.64));
        let mut flow = Flow::new(grid, settings(false, [0.0; 3]));
        put_ball(&mut flow, DVec3::ZERO, 0.14, density);
        // Without motion of the gas, iterations of the pressure alone: the part that is lagged converges.
        let mut speed = 0.0;
        let seconds = 1e-5;
        for _ in 0..60 {
            flow.velocity.iter_mut().for_each(|component| component.fill(0.0));
            flow.accelerate([0.0; 3], seconds);
            speed = f64::from(flow.velocity[1][grid.index([32, 32, 32])]);
        }
        let [gas, air] = [density, AIR].map(f64::from);
        let expected = 2.0 * (air - gas) / (2.0 * gas + air) * STANDARD_GRAVITY;
        let measured = speed / f64::from(seconds);
        assert!((measured / expected - 1.0).abs() < tolerance, "{density}: {measured} instead of {expected} m/s^2");
    }
}

#[test]
fn what_is_carried_is_conserved_and_stays_within_its_range() {
    let mut flow = flow([32, 32, 32], true, [0.0; 3]);
    put_ball(&mut flow, DVec3::new(0.4, 0.6, 0.4), 0.25, 0.3);
    let (before, half) = (mass_of(&flow, 0), mass_of(&flow, 1));
    for _ in 0..60 {
        let seconds = (0.5 * flow.grid.spacing as f32 / flow.largest_speed().max(0.5)).min(0.02);
        step(&mut flow, [0.0; 3], seconds);
    }
    let worst = largest_divergence(&flow) * flow.grid.spacing as f32 / flow.largest_speed();
    assert!(worst < 1e-5, "divergence {worst} of speed over cell");
    assert!(flow.largest_speed() > 1.0, "the ball rises at {} m/s", flow.largest_speed());
    assert!((mass_of(&flow, 0) / before - 1.0).abs() < 1e-5 && (mass_of(&flow, 1) / half - 1.0).abs() < 1e-5);
    for (_, index) in cells(&flow.grid) {
        let [first, second] = [0, 1].map(|quantity| flow.contents.quantities[quantity][index]);
        assert!((-1e-6..=1.0 + 1e-6).contains(&first) && (second - 0.5 * first).abs() < 1e-5, "{first} {second}");
    }
}

#[test]
fn what_is_symmetric_stays_symmetric() {
    let grid = Grid::new([32, 24, 32], 0.05, DVec3::new(-0.8, 0.0, -0.8));
    let mut flow = Flow::new(grid, settings(true, [0.0; 3]));
    put_ball(&mut flow, DVec3::new(0.0, 0.4, 0.0), 0.2, 0.3);
    for _ in 0..20 {
        step(&mut flow, [0.0; 3], 0.01);
    }
    for ([x, y, z], index) in cells(&grid) {
        let mirrored = grid.index([31 - x, y, z]);
        let turned = grid.index([z, y, x]);
        let density = &flow.contents.density;
        assert!((density[index] - density[mirrored]).abs() < 2e-4, "{x} {y} {z}");
        assert!((density[index] - density[turned]).abs() < 2e-4, "{x} {y} {z}");
    }
}

#[test]
fn gas_flows_around_a_ball_and_not_into_it() {
    let wind = [1.0, 0.0, 0.0];
    let grid = Grid::new([32, 32, 32], 0.05, DVec3::splat(-0.8));
    let mut flow = Flow::new(grid, settings(false, wind));
    flow.set_solids(&[Occluder::Sphere { center: DVec3::ZERO, radius: 0.3 }]);
    let volume = flow.solids.cells() as f64 * math::pow(0.05, 3.0);
    assert!((volume / (4.0 / 3.0 * std::f64::consts::PI * 0.027) - 1.0).abs() < 0.05, "{volume}");
    for _ in 0..20 {
        step(&mut flow, wind, 0.01);
    }
    let speed = |cell: [usize; 3]| flow.velocity[0][grid.index(cell)];
    assert_eq!(speed([16, 16, 16]), 0.0);
    // Potential flow beside a ball of radius R: 1 + (R / r)^3 / 2.
    let expected = 1.0 + 0.5 * (0.3_f32 / 0.425) * (0.3 / 0.425) * (0.3 / 0.425);
    assert!((speed([16, 24, 16]) / expected - 1.0).abs() < 0.04, "{} {expected}", speed([16, 24, 16]));
    assert!(speed([8, 16, 16]).abs() < 0.8, "{}", speed([8, 16, 16]));
    let worst = largest_divergence(&flow) * 0.05;
    assert!(worst < 0.02, "{worst}");
}

/// Two walls a cell thick with a gap between them: the solution of the empty box, from which the iteration begins, knows nothing of such walls.
#[test]
fn no_gas_is_lost_between_thin_walls() {
    let wind = [1.0, 0.0, 0.5];
    let grid = Grid::new([32, 24, 32], 0.05, DVec3::new(-0.8, 0.0, -0.8));
    let mut flow = Flow::new(grid, settings(true, wind));
    let walls = [-0.175, 0.125].map(|x| Occluder::Cuboid {
        center: DVec3::new(x, 0.35, 0.0),
        half_extents: DVec3::new(0.03, 0.35, 0.4),
        rotation: bansho_base::math::DQuat::IDENTITY,
    });
    flow.set_solids(&walls);
    for _ in 0..20 {
        step(&mut flow, wind, 0.01);
    }
    assert!(flow.solids.cells() > 400);
    let worst = largest_divergence(&flow) * 0.05;
    assert!(worst < 0.02, "{worst}");
    let between = flow.velocity[0][grid.index([15, 4, 16])];
    assert!(between.abs() < 0.1, "{between}");
}

#[test]
fn threads_do_not_change_a_bit() {
    let results: Vec<Vec<u32>> = [1, 3]
        .into_iter()
        .map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let mut flow = flow([32, 20, 18], true, [0.5, 0.0, 0.0]);
                flow.set_solids(&[Occluder::Sphere { center: DVec3::new(0.4, 0.3, 0.0), radius: 0.1 }]);
                put_ball(&mut flow, DVec3::new(0.4, 0.5, 0.2), 0.15, 0.3);
                for _ in 0..6 {
                    step(&mut flow, [0.5, 0.0, 0.0], 0.01);
                }
                flow.contents.density.iter().chain(&flow.velocity[1]).map(|value| value.to_bits()).collect()
            })
        })
        .collect();
    assert!(results[0] == results[1]);
}

#[test]
fn a_flow_on_a_finer_grid_is_the_same_gas() {
    let mut coarse = flow([16, 16, 16], true, [1.0, 0.0, 0.0]);
    for (cell, index) in cells(&coarse.grid) {
        let center = coarse.grid.center(cell);
        coarse.contents.quantities[0][index] = (0.2 + 0.3 * center.x + 0.1 * center.y - 0.2 * center.z) as f32;
        coarse.velocity[1][index] = cell[1] as f32;
    }
    let fine = coarse.refined();
    assert_eq!(fine.grid.size, [32; 3]);
    // What is linear is interpolated exactly, away from the sides.
    for ([x, y, z], index) in cells(&fine.grid).filter(|(cell, _)| cell.iter().all(|c| (2..29).contains(c))) {
        let center = fine.grid.center([x, y, z]);
        let expected = 0.2 + 0.3 * center.x + 0.1 * center.y - 0.2 * center.z;
        assert!((f64::from(fine.contents.quantities[0][index]) - expected).abs() < 1e-5);
        assert!((fine.velocity[1][index] - 0.5 * y as f32).abs() < 1e-5 && fine.velocity[0][index] == 1.0);
    }
    let mut fine = fine;
    step(&mut fine, [1.0, 0.0, 0.0], 0.005);
    assert!(largest_divergence(&fine) * 0.025 < 1e-3);
}
