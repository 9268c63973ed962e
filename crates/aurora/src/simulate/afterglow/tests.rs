use super::*;

fn even(seconds: f64, lifetime: f64) -> DecayFactors<1> {
    DecayFactors::new(seconds, |_| [lifetime])
}

/// Particles of 3 W and 1 W at those positions, of 1 and 5 keV.
fn particles(positions: [[f32; 2]; 2]) -> AuroraParticles {
    AuroraParticles {
        positions: [0, 1].map(|axis| positions.iter().map(|position| position[axis]).collect()),
        powers_w: vec![3.0, 1.0],
        energies_ev: vec![1000.0, 5000.0],
        ..AuroraParticles::default()
    }
}

#[test]
fn a_cell_follows_what_feeds_it_and_fades_by_e_in_a_lifetime() {
    let mut map = AfterglowMap::new(100.0, 0.5);
    let gain = particles([[10.1, -20.1], [10.2, -20.2]]);
    // Half a lifetime: 1 - exp(-1/2) of 4 W.
    map.step(&gain, &even(0.4, 0.8));
    assert!((map.powers_w()[0] - 4.0 * 0.393_469).abs() < 1e-5);
    (0..40).for_each(|_| map.step(&gain, &even(0.4, 0.8)));
    let cells: Vec<AfterglowCell<1>> = map.cells().collect();
    assert_eq!(cells.len(), 1);
    assert_eq!(cells[0].position_km, [10.25, -20.25]);
    assert!((cells[0].powers_w[0] - 4.0).abs() < 1e-4 && (cells[0].energy_ev - 2000.0).abs() < 0.1);
    let dark = AuroraParticles::default();
    map.step(&dark, &even(0.8, 0.8));
    assert!((map.powers_w()[0] - 4.0 / std::f64::consts::E).abs() < 1e-4);
    (0..20).for_each(|_| map.step(&dark, &even(0.8, 0.8)));
    assert_eq!(map.tiles.len(), 0, "dark tiles are let go");
}

#[test]
fn light_of_soft_electrons_lives_as_long_as_theirs() {
    // Two positions far apart, of 1 and 5 keV, of which one has light that lives ten times as long.
    let gain = particles([[10.1, -20.1], [-30.2, 30.2]]);
    let lifetime = |energy_ev: f64| if energy_ev < 2000.0 { 8.0 } else { 0.8 };
    let mut map = AfterglowMap::new(100.0, 0.5);
    map.step(&gain, &even(1.0, 0.0));
    map.step(&AuroraParticles::default(), &DecayFactors::new(0.8, |energy_ev| [lifetime(energy_ev)]));
    let powers: Vec<f64> = map.cells().map(|cell| f64::from(cell.powers_w[0])).collect();
    assert!((powers[0] - 3.0 * math::exp(-0.1)).abs() < 1e-5 && (powers[1] - math::exp(-1.0)).abs() < 1e-6);
    // And fills up as slowly.
    let mut map = AfterglowMap::new(100.0, 0.5);
    map.step(&gain, &DecayFactors::new(0.8, |energy_ev| [lifetime(energy_ev)]));
    let powers: Vec<f64> = map.cells().map(|cell| f64::from(cell.powers_w[0])).collect();
    assert!(
        (powers[0] - 3.0 * (1.0 - math::exp(-0.1))).abs() < 1e-5 && (powers[1] - 1.0 + math::exp(-1.0)).abs() < 1e-6
    );
}

#[test]
fn every_height_fades_by_its_own_lifetime() {
    let decay = DecayFactors::new(1.0, |_| [0.5, 10.0, 100.0]);
    let mut map = AfterglowMap::<3>::new(100.0, 0.5);
    map.step(&particles([[10.1, -20.1], [10.2, -20.2]]), &DecayFactors::instantaneous());
    (0..20).for_each(|_| map.step(&AuroraParticles::default(), &decay));
    for (power, lifetime) in map.powers_w().into_iter().zip([0.5, 10.0, 100.0]) {
        assert!((power - 4.0 * math::exp(-20.0 / lifetime)).abs() < 1e-5, "{lifetime} s: {power}");
    }
    let (positions, values) = map.to_arrays();
    assert_eq!(map.with_arrays(&positions, &values), Some(map.clone()));
    assert_eq!(map.with_arrays(&positions, &values[1..]), None);
}

#[test]
fn small_faint_cells_fill_up_whatever_the_lifetime() {
    // Cells of 25 m2 on which 0.01 mW/m^2 fall: 2.5e-4 W each.
    let faint = AuroraParticles { powers_w: vec![2e-4, 0.5e-4], ..particles([[1.001, 1.001], [1.002, 1.002]]) };
    for lifetime in [0.8, 110.0] {
        let mut map = AfterglowMap::new(10.0, 0.005);
        (0..(8.0 * lifetime * 30.0) as usize).for_each(|_| map.step(&faint, &even(1.0 / 30.0, lifetime)));
        assert!((map.powers_w()[0] / 2.5e-4 - 1.0).abs() < 0.01, "{lifetime} s: {} W", map.powers_w()[0]);
    }
}

#[test]
fn a_map_is_shared_out_among_the_particles_in_its_cells() {
    let mut map = AfterglowMap::new(100.0, 0.5);
    let gain = particles([[10.1, -20.1], [10.2, -20.2]]);
    map.step(&gain, &even(1.0, 0.0));
    assert_eq!(map.distribute_to_particles(&gain, 0.01, 1), (vec![3.0, 1.0], vec![]));
    // One has left its cell for a dark one, the other is still where all of the light is.
    let moved = particles([[-40.0, 40.0], [10.2, -20.2]]);
    assert_eq!(map.distribute_to_particles(&moved, 0.01, 1), (vec![0.0, 4.0], vec![]));
    // Both have left: the cell itself shines, unless that is too faint.
    let gone = particles([[-40.0, 40.0], [-40.0, 40.0]]);
    let (fractions, cells) = map.distribute_to_particles(&gone, 0.01, 1);
    assert_eq!((fractions, cells.len(), cells[0].powers_w[0]), (vec![0.0; 2], 1, 4.0));
    assert_eq!(map.distribute_to_particles(&gone, 1.5, 1).1, []);
    assert_eq!((map.bright_blocks(0.01, 1).len(), map.bright_blocks(1.5, 1)), (1, vec![]));
}

#[test]
fn a_block_has_the_light_of_its_cells_where_its_middle_is() {
    let mut map = AfterglowMap::new(100.0, 0.5);
    // Two cells apart from west to east, the wanted one of 3 W and another of 1 W.
    let gain = particles([[10.1, -20.1], [11.1, -20.1]]);
    map.step(&gain, &even(1.0, 0.0));
    let [apart, together] = [2, 4].map(|block| map.bright_blocks(0.01, block));
    assert_eq!(apart.iter().map(|cell| cell.powers_w[0]).collect::<Vec<_>>(), [3.0, 1.0]);
    assert_eq!(together.len(), 1);
    let AfterglowCell { cell_index: number, position_km, powers_w, energy_ev } = together[0];
    assert_eq!((position_km, powers_w, energy_ev), ([10.5, -20.25], [4.0], 2000.0));
    // Row 56, column 120 of 200, whichever of its cells are lit.
    assert_eq!(number, 56 * 200 + 120);
    map.step(&particles([[10.6, -20.1], [11.1, -20.1]]), &even(1.0, 0.0));
    assert_eq!(map.bright_blocks(0.01, 4)[0].cell_index, number);
    map.step(&gain, &even(1.0, 0.0));
    let cells: f32 = map.cells().map(|cell| cell.powers_w[0]).sum();
    assert_eq!(cells, 4.0);
    // Blocks are wide where the light is spread far.
    assert_eq!([0.1, 1.0, 2.0, 1e3].map(|spread| map.block(spread)), [1, 2, 4, 8]);
}

#[test]
fn tiles_come_and_go_without_losing_their_place() {
    let mut map = AfterglowMap::new(100.0, 0.5);
    map.step(&particles([[-49.9, -49.9], [49.9, 49.9]]), &even(1.0, 0.0));
    // The first tile goes, the second takes its number, a third comes.
    map.step(&particles([[49.9, 49.9], [0.1, 0.1]]), &even(1.0, 0.0));
    let mut cells: Vec<_> = map.cells().map(|cell| (cell.position_km[0], cell.powers_w[0])).collect();
    cells.sort_by(|a, b| a.0.total_cmp(&b.0));
    assert_eq!(cells, [(0.25, 1.0), (49.75, 3.0)]);
    let (positions, values) = map.to_arrays();
    assert_eq!(map.with_arrays(&positions, &values), Some(map.clone()));
    assert_eq!(map.with_arrays(&positions[..1], &values), None);
    assert_eq!(map.with_arrays(&[positions[0], positions[0]], &values), None);
    assert_eq!(map.with_arrays(&[u32::MAX, positions[1]], &values), None);
}
