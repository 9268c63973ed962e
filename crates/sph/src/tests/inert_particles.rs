//! Pairs of particles between which a term is 0 are skipped without changing a bit.

use super::*;

/// The pressure force of a spiky kernel, with inert particles or without them.
struct Repulsion<const SKIP: bool>(Spiky<3>);

impl<const SKIP: bool> PairTerm<3, 1, 3> for Repulsion<SKIP> {
    const DIRECTED: bool = true;

    fn is_inert([pressure]: &[f32; 1]) -> bool {
        SKIP && *pressure == 0.0
    }

    #[inline(always)]
    fn add<R: Real>(&self, pair: &Pair<R, 3>, own: &[R; 1], other: &[R; 1], sums: &mut [R; 3]) {
        let factor = (own[0] + other[0]) * self.0.gradient_factor(pair.distance_squared);
        (0..3).for_each(|c| sums[c] = pair.offset[c].fma(factor, sums[c]));
    }
}

#[test]
fn skipping_pairs_of_inert_particles_changes_no_bit() {
    let mut particles = cloud::<3>(2_000, 1.0);
    // Coincident pairs: one without pressure, one with and one without, two with.
    for (index, id) in [(10, 9_000), (11, 9_001), (12, 9_002)] {
        let position = particles.positions.each_ref().map(|component| component[index]);
        particles.push(position, [0.0; 3], 1.0, id);
    }
    let mut cells = Cells::new(0.25);
    particles.sort(&mut cells);
    let has_pressure = |id: u64, x: f32| x > 0.5 || [1011, 1012, 9_002].contains(&id);
    let ids_and_x = particles.ids.iter().zip(&particles.positions[0]);
    let pressure: Vec<f32> =
        ids_and_x.map(|(id, x)| if *id != 1010 && has_pressure(*id, *x) { 2.0 + x } else { 0.0 }).collect();
    let without = pressure.iter().filter(|pressure| **pressure == 0.0).count();
    assert!((1_300..1_900).contains(&without), "{without}");
    let mut skipped = <[Vec<f32>; 3]>::default();
    let mut all = <[Vec<f32>; 3]>::default();
    let kernel = Spiky::new(0.25);
    cells.sum(&Repulsion::<true>(kernel), [&pressure], skipped.each_mut());
    cells.sum(&Repulsion::<false>(kernel), [&pressure], all.each_mut());
    let bits = |sums: &[Vec<f32>; 3]| sums.iter().flatten().map(|value| value.to_bits()).collect::<Vec<u32>>();
    assert_eq!(bits(&skipped), bits(&all));
    let largest = all.iter().flatten().fold(0.0_f32, |largest, value| largest.max(value.abs()));
    assert!(largest > 1e4, "coincident particles repel each other: {largest}");
}
