//! Tests of the whole crate: agreement with sums over all pairs in double precision, independence of order and threads, conservation of momentum.

use bansho_base::{
    assert_measured,
    math::random::{Key, Purpose},
};

use super::*;

mod inert_particles;

const SHAPES: [KernelShape; 3] = [KernelShape::Poly6, KernelShape::Spiky, KernelShape::CubicSpline];

/// Random particles in a box of that half width with velocity components up to 1, about a fifth of them in a small clump.
fn cloud<const D: usize>(count: u64, half_width: f32) -> Particles<D> {
    let key = Key::new(7, "cloud");
    let mut particles = Particles::default();
    for id in 0..count {
        let uniforms = key.uniforms(id, 0, Purpose(1));
        let velocity = key.uniforms(id, 0, Purpose(2));
        let width = if id % 5 == 0 { 0.3 * half_width } else { half_width };
        let position = std::array::from_fn(|c| width * (2.0 * uniforms[c] - 1.0));
        let velocity = std::array::from_fn(|c| 2.0 * velocity[c] - 1.0);
        particles.push(position, velocity, 0.5 + uniforms[3], 1000 + id);
    }
    particles
}

/// A square or cubic lattice with `side` particles per side, spacing 1, mass 1.
fn lattice<const D: usize>(side: usize) -> Particles<D> {
    let mut particles = Particles::default();
    for index in 0..side.pow(D as u32) {
        let position = std::array::from_fn(|c| (index / side.pow(c as u32) % side) as f32);
        particles.push(position, [0.0; D], 1.0, index as u64);
    }
    particles
}

/// Densities, pressures `p = k rho` and accelerations.
fn evaluate<const D: usize>(
    particles: &Particles<D>,
    cells: &Cells<D>,
    shapes: [KernelShape; 2],
) -> (Vec<f32>, [Vec<f32>; D]) {
    let (mut density, mut acceleration) = (Vec::new(), std::array::from_fn(|_| Vec::new()));
    compute_densities(cells, shapes[0], &particles.masses, &mut density);
    let pressure: Vec<f32> = density.iter().map(|density| 3.0 * density).collect();
    let mut force = PressureForce::new(shapes[1]);
    force.compute_accelerations(cells, &particles.masses, &density, &pressure, &mut acceleration);
    (density, acceleration)
}

/// The same as [`evaluate`], summed over all pairs in double precision.
fn all_pairs<const D: usize>(
    particles: &Particles<D>,
    support: f32,
    shapes: [KernelShape; 2],
) -> (Vec<f64>, Vec<[f64; D]>) {
    let [value, slope] = shapes.map(|shape| Kernel::<D>::new(shape, support));
    let count = particles.len();
    let offset =
        |i: usize, j: usize| -> [f64; D] { particles.positions.each_ref().map(|x| f64::from(x[i]) - f64::from(x[j])) };
    let distance = |i: usize, j: usize| offset(i, j).iter().map(|x| x * x).sum::<f64>().sqrt();
    let near = |i: usize| (0..count).filter(move |j| distance(i, *j) < f64::from(support));
    let mass = |j: usize| f64::from(particles.masses[j]);
    let density: Vec<f64> =
        (0..count).map(|i| near(i).map(|j| mass(j) * f64::from(value.value(distance(i, j) as f32))).sum()).collect();
    let acceleration = |i: usize| {
        near(i).filter(|j| *j != i).fold([0.0; D], |sum, j| {
            let push = 3.0 * (density[i] + density[j]) / (2.0 * density[i] * density[j]);
            let r = distance(i, j);
            let factor = -mass(j) * push * f64::from(slope.derivative(r as f32)) / r;
            std::array::from_fn(|c| sum[c] + factor * offset(i, j)[c])
        })
    };
    (density.clone(), (0..count).map(acceleration).collect())
}

fn agrees_with_all_pairs<const D: usize>(count: u64, support: f32) {
    let mut particles = cloud::<D>(count, 1.0);
    let mut cells = Cells::new(support);
    particles.sort(&mut cells);
    let [mut largest_of_densities, mut largest_of_accelerations] = [0.0_f64; 2];
    for shapes in [[SHAPES[0], SHAPES[1]], [SHAPES[2], SHAPES[2]], [SHAPES[1], SHAPES[0]]] {
        let (density, acceleration) = evaluate(&particles, &cells, shapes);
        let (true_density, true_acceleration) = all_pairs(&particles, support, shapes);
        let max_acceleration = true_acceleration.iter().flatten().fold(0.0, |a: f64, b| a.max(b.abs()));
        for i in 0..particles.len() {
            let difference = (f64::from(density[i]) / true_density[i] - 1.0).abs();
            largest_of_densities = largest_of_densities.max(difference);
            for c in 0..D {
                let error = (f64::from(acceleration[c][i]) - true_acceleration[i][c]).abs();
                largest_of_accelerations = largest_of_accelerations.max(error / max_acceleration);
            }
        }
    }
    assert_measured!("equation (2.11): difference of densities", largest_of_densities, 0.0, 1e-5);
    assert_measured!("equation (2.13): difference of accelerations", largest_of_accelerations, 0.0, 1e-5);
}

#[test]
fn sums_are_those_of_all_pairs() {
    agrees_with_all_pairs::<2>(400, 0.21);
    agrees_with_all_pairs::<3>(400, 0.45);
}

/// A thin line of particles across empty space next to dense clumps: groups end where they would be too long.
#[test]
fn sparse_rows_and_clumps_are_summed_like_all_pairs() {
    let mut particles = cloud::<3>(120, 0.2);
    for i in 0..60 {
        let along = -9.0 + 0.31 * i as f32;
        particles.push([along, 0.05, -0.02], [0.0; 3], 1.0, 5000 + i);
    }
    let mut cells = Cells::new(0.4);
    particles.sort(&mut cells);
    let (density, acceleration) = evaluate(&particles, &cells, [SHAPES[0], SHAPES[1]]);
    let (true_density, true_acceleration) = all_pairs(&particles, 0.4, [SHAPES[0], SHAPES[1]]);
    let max_acceleration = true_acceleration.iter().flatten().fold(0.0, |a: f64, b| a.max(b.abs()));
    for i in 0..particles.len() {
        assert!((f64::from(density[i]) / true_density[i] - 1.0).abs() < 1e-5, "density of {i}");
        let error = (0..3).map(|c| (f64::from(acceleration[c][i]) - true_acceleration[i][c]).abs()).fold(0.0, f64::max);
        assert!(error < 1e-5 * max_acceleration, "acceleration of {i}: {error}");
    }
}

#[test]
fn crowds_are_summed_like_all_pairs() {
    agrees_with_all_pairs::<2>(700, 1.1);
}

/// Bits of all results of a step, by id.
fn bits(mut particles: Particles<3>) -> Vec<[u32; 4]> {
    let mut cells = Cells::new(0.3);
    particles.sort(&mut cells);
    let (density, acceleration) = evaluate(&particles, &cells, [SHAPES[0], SHAPES[1]]);
    let mut found: Vec<(u64, [u32; 4])> = (0..particles.len())
        .map(|i| {
            (
                particles.ids[i],
                [density[i], acceleration[0][i], acceleration[1][i], acceleration[2][i]].map(f32::to_bits),
            )
        })
        .collect();
    found.sort_unstable();
    found.into_iter().map(|entry| entry.1).collect()
}

#[test]
fn neither_threads_nor_the_order_given_change_a_bit() {
    let given = cloud::<3>(3000, 1.0);
    let mut turned = Particles::default();
    for i in (0..given.len()).map(|i| i * 1271 % given.len()) {
        let (uniforms, velocity) =
            (given.positions.each_ref().map(|x| x[i]), given.velocities.each_ref().map(|v| v[i]));
        turned.push(uniforms, velocity, given.masses[i], given.ids[i]);
    }
    let reference = bits(given.clone());
    assert_eq!(reference, bits(turned));
    for threads in 1..=3 {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert_eq!(reference, pool.install(|| bits(given.clone())), "{threads} threads");
    }
}

#[test]
fn sorting_keeps_every_particle_with_its_values() {
    let given = cloud::<2>(500, 3.0);
    let (mut sorted, mut cells) = (given.clone(), Cells::new(0.4));
    let mut own: Vec<f32> = given.positions[1].clone();
    sorted.sort(&mut cells);
    cells.reorder(&mut own);
    assert_eq!(own, sorted.positions[1]);
    for i in 0..sorted.len() {
        let from = (sorted.ids[i] - 1000) as usize;
        assert_eq!(sorted.positions[0][i], given.positions[0][from]);
        assert_eq!(sorted.velocities[1][i], given.velocities[1][from]);
        assert_eq!(sorted.masses[i], given.masses[from]);
    }
    let mut ids = sorted.ids.clone();
    ids.sort_unstable();
    assert_eq!(ids, given.ids);
}

#[test]
fn sorting_alone_gives_the_order_of_assigning() {
    let particles = cloud::<2>(3000, 1.0);
    let positions = particles.positions.each_ref().map(Vec::as_slice);
    let (mut assigned, mut sorted) = (Cells::new(0.1), Cells::new(0.1));
    assigned.assign(positions, &particles.ids);
    // Whatever it was used for before.
    sorted.assign(positions, &particles.ids);
    sorted.sort(positions, &particles.ids);
    let order = |cells: &Cells<2>| {
        let mut ids = particles.ids.clone();
        cells.reorder(&mut ids);
        ids
    };
    assert_eq!(order(&sorted), order(&assigned));
    assert_ne!(order(&sorted), particles.ids);
    let mut densities = Vec::new();
    compute_densities(&sorted, SHAPES[0], &particles.masses, &mut densities);
    assert!(densities.iter().all(|density| *density == 0.0), "there are no neighbors without candidates");
}

fn lattice_density<const D: usize>(side: usize, support: f32, kernel: KernelShape) -> f32 {
    let (mut particles, mut cells) = (lattice::<D>(side), Cells::new(support));
    particles.sort(&mut cells);
    let mut density = Vec::new();
    compute_densities(&cells, kernel, &particles.masses, &mut density);
    let middle = |i: &usize| particles.positions.iter().all(|x| x[*i] == (side / 2) as f32);
    density[(0..particles.len()).find(middle).unwrap()]
}

#[test]
fn a_lattice_has_density_one() {
    for support in [2.5, 2.8, 3.0, 3.7] {
        for kernel in [KernelShape::Poly6, KernelShape::CubicSpline] {
            let (plane, space) = (lattice_density::<2>(11, support, kernel), lattice_density::<3>(11, support, kernel));
            assert!((plane - 1.0).abs() < 0.01 && (space - 1.0).abs() < 0.01, "{kernel:?} {support}: {plane} {space}");
        }
    }
}

#[test]
fn a_compressed_lattice_pushes_outward_at_its_surface_and_nowhere_else() {
    let (mut particles, mut cells) = (lattice::<3>(11), Cells::new(2.5));
    particles.sort(&mut cells);
    let (_, acceleration) = evaluate(&particles, &cells, [SHAPES[0], SHAPES[1]]);
    let surface = |x: f32| x == 0.0 || x == 10.0;
    let strength = acceleration.iter().flatten().fold(0.0, |a: f32, b| a.max(b.abs()));
    for i in 0..particles.len() {
        for c in 0..3 {
            let (x, push) = (particles.positions[c][i], acceleration[c][i]);
            if surface(x) {
                assert!(push * (x - 5.0) > 0.1 * strength, "surface {i}");
            // The force depends on densities up to one support radius away, and those on particles one support radius further.
            } else if particles.positions.iter().all(|x| (4.0..=6.0).contains(&x[i])) {
                assert!(push.abs() < 1e-6 * strength, "middle {i}: {push} of {strength}");
            }
        }
    }
}

/// One step without external force; the pressure is not negative.
fn step<const D: usize>(
    particles: &mut Particles<D>,
    cells: &mut Cells<D>,
    force: &mut PressureForce,
    state: StateEquation,
) {
    let (mut density, mut acceleration) = (Vec::new(), std::array::from_fn(|_| Vec::new()));
    particles.sort(cells);
    compute_densities(cells, KernelShape::Poly6, &particles.masses, &mut density);
    let pressure: Vec<f32> = density.iter().map(|density| state.pressure(2.0, *density)).collect();
    force.compute_accelerations(cells, &particles.masses, &density, &pressure, &mut acceleration);
    particles.advance(&acceleration, 2e-3);
}

#[test]
fn a_pressed_lattice_moves_from_its_surface_inward_and_not_before() {
    let (mut particles, mut cells) = (lattice::<2>(25), Cells::new(2.5));
    let before = particles.positions.clone();
    let mut force = PressureForce::new(KernelShape::Spiky);
    let state = StateEquation { rest_density: 0.0, negative_pressure: false };
    // A step propagates changes by less than two support radii: after two steps the middle is unaffected.
    (0..2).for_each(|_| step(&mut particles, &mut cells, &mut force, state));
    for i in 0..particles.len() {
        let id = particles.ids[i] as usize;
        let [x, y] = before.each_ref().map(|x| x[id]);
        let speed = particles.velocities.each_ref().map(|v| v[i].abs()).into_iter().fold(0.0, f32::max);
        let surface = [x, y].iter().any(|x| *x == 0.0 || *x == 24.0);
        let middle = [x, y].iter().all(|x| (x - 12.0).abs() <= 2.0);
        assert!(!surface || speed > 1e-4, "the surface rests at {x} {y}: {speed}");
        assert!(!middle || speed < 1e-8, "the middle moves at {x} {y}: {speed}");
    }
}

#[test]
fn the_middle_of_a_lattice_under_pressure_rests_until_sound_arrives() {
    let side = 25;
    let (mut particles, mut cells) = (lattice::<2>(side), Cells::new(2.5));
    let mut force = PressureForce::new(KernelShape::Spiky);
    // Denser than at rest by a tenth: inner particles are pushed equally from all sides, those at the surface only from one.
    let state = StateEquation { rest_density: 0.9, negative_pressure: false };
    let center = 0.5 * (side - 1) as f32;
    let mut arrived = 0.0_f32;
    for steps in 1..=600 {
        step(&mut particles, &mut cells, &mut force, state);
        // Distance that sound of speed sqrt(2) has traveled, plus the support radius within which the surface acts.
        let reached = 2.0_f32.sqrt() * 2e-3 * steps as f32 + 2.5;
        for i in 0..particles.len() {
            let id = particles.ids[i] as usize;
            let depth = (center
                - [id % side, id / side].map(|x| (x as f32 - center).abs()).into_iter().fold(0.0, f32::max))
            .max(0.0);
            let speed = particles.velocities.iter().map(|v| v[i] * v[i]).sum::<f32>().sqrt();
            assert!(depth < reached + 5.0 || speed < 1e-4, "{depth} deep it moves at {speed} after {steps} steps");
            if depth == 0.0 {
                arrived = arrived.max(speed);
            }
        }
    }
    assert!(arrived > 0.02, "the surface gives way: {arrived}");
}

/// Total momentum, total of `m |v|`, and center of mass.
fn totals<const D: usize>(particles: &Particles<D>) -> ([f64; D], f64, [f64; D]) {
    let sum =
        |f: &dyn Fn(usize) -> f64| (0..particles.len()).map(|i| f64::from(particles.masses[i]) * f(i)).sum::<f64>();
    let speed = |i: usize| particles.velocities.iter().map(|v| f64::from(v[i] * v[i])).sum::<f64>().sqrt();
    let mass = sum(&|_| 1.0);
    (
        std::array::from_fn(|c| sum(&|i| f64::from(particles.velocities[c][i]))),
        sum(&speed),
        std::array::from_fn(|c| sum(&|i| f64::from(particles.positions[c][i])) / mass),
    )
}

fn keeps_momentum<const D: usize>() {
    let (mut particles, mut cells) = (cloud::<D>(500, 0.5), Cells::new(0.3));
    let mut force = PressureForce::new(KernelShape::Spiky);
    let state = StateEquation { rest_density: 0.0, negative_pressure: false };
    let mass: f64 = particles.masses.iter().map(|mass| f64::from(*mass)).sum();
    let (momentum, _, center) = totals(&particles);
    let mut worst = 0.0_f64;
    for _ in 0..1000 {
        step(&mut particles, &mut cells, &mut force, state);
        let (now, scale, _) = totals(&particles);
        (0..D).for_each(|c| worst = worst.max((now[c] - momentum[c]).abs() / scale));
    }
    assert!(worst < 1e-6, "momentum drifts by {worst}");
    let (_, scale, now) = totals(&particles);
    for c in 0..D {
        let straight = center[c] + momentum[c] / mass * 2.0;
        assert!((now[c] - straight).abs() < 1e-6 * scale / mass * 2.0 + 1e-6, "{} {straight}", now[c]);
    }
}

#[test]
fn a_free_cloud_keeps_its_momentum_and_its_center_moves_straight() {
    keeps_momentum::<2>();
    keeps_momentum::<3>();
}

#[test]
fn coincident_particles_part_in_opposite_directions() {
    let mut particles = Particles::<3>::default();
    for id in [5, 9, 70] {
        let x = if id == 70 { 100.0 } else { 0.3 };
        particles.push([x, 0.2, 0.1], [0.0; 3], 1.0, id);
    }
    let mut cells = Cells::new(0.5);
    particles.sort(&mut cells);
    let (_, acceleration) = evaluate(&particles, &cells, [SHAPES[0], SHAPES[1]]);
    let strength = acceleration.iter().map(|a| a[0] * a[0]).sum::<f32>().sqrt();
    let kernel = Kernel::<3>::new(KernelShape::Spiky, 0.5);
    let density = 2.0 * Kernel::<3>::new(KernelShape::Poly6, 0.5).value(0.0);
    let expected = -3.0 / density * kernel.derivative(1e-7);
    assert!((strength / expected - 1.0).abs() < 1e-3, "{strength} {expected}");
    for c in 0..3 {
        assert_eq!(acceleration[c][0], -acceleration[c][1]);
        assert_eq!(acceleration[c][2], 0.0, "alone");
    }
}

#[test]
fn particles_may_be_anywhere() {
    let mut particles = Particles::<3>::default();
    let far = [0.0, 1.0e6, 1.0e6 + 0.25, -1e30, f32::INFINITY, f32::NAN, f32::MAX, f32::MIN, -1.0e6];
    for (id, x) in far.into_iter().enumerate() {
        particles.push([x, -x, x], [0.0; 3], 1.0, id as u64);
    }
    let mut cells = Cells::new(1.0);
    particles.sort(&mut cells);
    let mut density = Vec::new();
    compute_densities(&cells, KernelShape::Poly6, &particles.masses, &mut density);
    let alone = Kernel::<3>::new(KernelShape::Poly6, 1.0).value(0.0);
    let of = |id: u64| density[particles.ids.iter().position(|other| *other == id).unwrap()];
    assert_eq!((of(0), of(8)), (alone, alone));
    assert!(of(1) > alone && of(1) == of(2), "neighbors farther out than the farthest cell");
    for (id, x) in (0..).zip(far) {
        let index = particles.ids.iter().position(|other| *other == id).unwrap();
        assert_eq!(particles.positions[1][index].to_bits(), (-x).to_bits(), "sorting does not move particle {id}");
    }
}

#[test]
fn nothing_at_all_is_fine_too() {
    let (mut particles, mut cells) = (cloud::<3>(10, 1.0), Cells::new(0.5));
    particles.sort(&mut cells);
    let mut none = Particles::<3>::default();
    none.sort(&mut cells);
    let (density, acceleration) = evaluate(&none, &cells, [SHAPES[0], SHAPES[1]]);
    assert!(density.is_empty() && acceleration.iter().all(Vec::is_empty) && cells.is_empty());
}

/// `sum_j m_j / rho_j (v_j - v_i) x grad W`: an example of a pair term that is not built in.
struct Curl(Spiky<2>);

impl PairTerm<2, 3, 1> for Curl {
    const DIRECTED: bool = true;

    fn add<R: Real>(&self, pair: &Pair<R, 2>, own: &[R; 3], other: &[R; 3], sums: &mut [R; 1]) {
        let gradient = pair.offset.map(|x| x * self.0.gradient_factor(pair.distance_squared) * other[0]);
        let [u, v] = [other[1] - own[1], other[2] - own[2]];
        // The gradient is with respect to x_i, hence the sign.
        sums[0] = sums[0] + gradient[0] * v - gradient[1] * u;
    }
}

#[test]
fn curl_of_a_rigid_rotation_is_twice_its_rate() {
    let (mut particles, mut cells) = (lattice::<2>(15), Cells::new(4.0));
    particles.sort(&mut cells);
    let volume = vec![1.0; particles.len()];
    let [x, y] = &particles.positions;
    let u: Vec<f32> = y.iter().map(|y| -0.75 * (y - 7.0)).collect();
    let v: Vec<f32> = x.iter().map(|x| 0.75 * (x - 7.0)).collect();
    let mut curl = Vec::new();
    cells.sum(&Curl(Spiky::new(4.0)), [&volume, &u, &v], [&mut curl]);
    let middle = (0..particles.len()).find(|i| x[*i] == 7.0 && y[*i] == 7.0).unwrap();
    assert!((curl[middle] / 1.5 - 1.0).abs() < 0.02, "{}", curl[middle]);
}

#[test]
fn sums_change_nothing_of_the_sums_after_them() {
    let (mut particles, mut cells) = (cloud::<3>(700, 1.0), Cells::new(0.25));
    // Two coincident particles, which repel each other.
    for c in 0..3 {
        particles.positions[c][5] = particles.positions[c][400];
    }
    particles.sort(&mut cells);
    let (density, pressure) = (vec![1.0; 700], vec![2.0; 700]);
    let accelerations = |cells: &Cells<3>| -> [Vec<f32>; 3] {
        let mut results = std::array::from_fn(|_| Vec::new());
        let mut force = PressureForce::new(SHAPES[1]);
        force.compute_accelerations(cells, &particles.masses, &density, &pressure, &mut results);
        results
    };
    let before = accelerations(&cells);
    compute_densities(&cells, SHAPES[0], &particles.masses, &mut Vec::new());
    assert!(before == accelerations(&cells) && before[0].iter().any(|a| a.abs() > 1.0));
}

#[test]
fn only_what_is_kept_stays() {
    let mut particles = cloud::<2>(4, 1.0);
    let masses = particles.masses.clone();
    particles.retain(&[true, false, false, true]);
    assert_eq!((particles.len(), particles.ids.as_slice()), (2, [1000, 1003].as_slice()));
    assert_eq!(particles.masses, [masses[0], masses[3]]);
}

#[test]
fn radii_and_particles_that_make_no_sense_are_named() {
    for value in [0.0, -0.1, f32::NAN, f32::INFINITY] {
        let Err(SphError::SupportRadius { value: found }) = Cells::<3>::try_new(value) else {
            panic!("a radius of {value} must be refused")
        };
        assert!(found == value || found.is_nan());
    }
    assert_eq!(Cells::<2>::try_new(0.25).map(|cells| cells.support_radius()), Ok(0.25));
    let good = cloud::<3>(20, 1.0);
    assert_eq!(good.check(), Ok(()));
    let with = |change: fn(&mut Particles<3>)| {
        let mut particles = good.clone();
        change(&mut particles);
        particles.check().unwrap_err().to_string()
    };
    assert_eq!(
        with(|p| p.velocities[2][3] = f32::INFINITY),
        "`velocities[2]` has the value inf at index 3; allowed: finite numbers"
    );
    assert_eq!(
        with(|p| p.positions[0][5] = f32::NAN),
        "`positions[0]` has the value NaN at index 5; allowed: finite numbers"
    );
    for mass in [0.0, -1.0, f32::NAN] {
        let mut particles = good.clone();
        particles.masses[7] = mass;
        let error = particles.check().unwrap_err();
        assert!(matches!(error, SphError::Value { array: ParticleArray::Mass, index: 7, .. }), "{error}");
    }
    assert_eq!(with(|p| p.masses.truncate(4)), "`masses` has 4 values for 20 ids; allowed: one for each");
    assert_eq!(with(|p| p.positions[1].push(0.0)), "`positions[1]` has 21 values for 20 ids; allowed: one for each");
}

#[test]
#[should_panic(expected = "one mass and density per particle")]
fn mixing_weights_need_a_density_for_each_mass() {
    mixing_weights(&[1.0, 1.0], &[1.0], &mut Vec::new());
}
