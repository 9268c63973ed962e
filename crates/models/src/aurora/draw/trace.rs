//! The light of one fall along its meridian, row by row, and how it is added to columns.
//!
//! A fall has some fifty collisions on some hundreds of rows. So it is kept which rows have any: only those are added to columns, and only
//! those are cleared.

use fearless_simd::{Simd, prelude::*};

use crate::{
    aurora::light::PerEmitter,
    lanes::{FourLanes, HalfLanes, LANES, Lanes, Real, nearest_whole, ramp},
};

/// Collisions that are worked on at once.
pub(super) const BATCH: usize = LANES;
/// Rows that are added to a column at once.
pub(super) const QUAD: usize = 4;

/// Light of [`QUAD`] rows, in one line of the cache.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Quad(pub(super) [f32; 4 * QUAD]);

/// Photons of the collisions of one fall by row of the chart, and beyond them rows for points that are outside.
pub(super) struct Trace {
    light: Vec<PerEmitter<f32>>,
    /// Whether each row and the one below may have some: 0 or 1.
    touched: Vec<[u8; QUAD]>,
    /// The fours of rows that have some, and how many they are.
    quads: Vec<u32>,
    count: usize,
}

impl Trace {
    pub(super) fn new(rows: usize) -> Self {
        let rows = (rows + 2 * BATCH).next_multiple_of(QUAD) + QUAD;
        let quads = rows / QUAD;
        Self { light: vec![[0.0; 4]; rows], touched: vec![[0; QUAD]; quads], quads: vec![0; quads + 1], count: 0 }
    }

    /// The fours of rows that have light, from the uppermost on.
    #[inline(always)]
    pub(super) fn quads(&self) -> &[u32] {
        &self.quads[..self.count]
    }

    #[inline(always)]
    pub(super) fn clear(&mut self) {
        let rows = self.light.as_chunks_mut::<QUAD>().0;
        for quad in &self.quads[..self.count] {
            rows[*quad as usize] = [[0.0; 4]; QUAD];
        }
        self.count = 0;
    }

    /// Adds the light of the first `count` points.
    #[inline(always)]
    pub(super) fn add<S: Simd>(
        &mut self,
        simd: S,
        points: &Points,
        (lights, count): (&[u16; BATCH], usize),
        photons: &[PerEmitter<f32>],
    ) {
        if count == BATCH {
            for lane in 0..BATCH {
                self.add_point(simd, points, lane, photons.get(lights[lane] as usize));
            }
        } else {
            for lane in 0..count.min(BATCH) {
                self.add_point(simd, points, lane, photons.get(lights[lane] as usize));
            }
        }
    }

    #[inline(always)]
    fn add_point<S: Simd>(&mut self, simd: S, points: &Points, lane: usize, photons: Option<&PerEmitter<f32>>) {
        let row = points.rows[lane] as usize;
        let touched = self.touched.as_flattened_mut().get_mut(row);
        let both = self.light.get_mut(row..row + 2);
        let (Some(both), Some(touched), Some(photons)) = (both, touched, photons) else { return };
        *touched = 1;
        let (both, photons) = (both.as_flattened_mut(), FourLanes::simd_from(simd, *photons));
        let weights = FourLanes::splat(simd, points.upper[lane]).combine(FourLanes::splat(simd, points.lower[lane]));
        photons.combine(photons).fused(weights, HalfLanes::from_slice(simd, both)).store_slice(both);
    }

    /// Finds what rows have light, within those that may have some.
    #[inline(always)]
    pub(super) fn finish<S: Simd>(&mut self, lit: &Lit<S>) {
        let [first, end] = lit.rows().map(|row| row.div_ceil(QUAD));
        let first = first.saturating_sub(1).min(end);
        let mut count = 0;
        // The last row before reaches into the first here.
        let mut before = 0;
        // Without a branch, which nobody could foresee.
        for (quad, touched) in (first as u32..).zip(&mut self.touched[first..end]) {
            self.quads[count] = quad;
            count += usize::from(u32::from_le_bytes(*touched) | before != 0);
            before = u32::from(touched[QUAD - 1]);
            *touched = [0; QUAD];
        }
        self.count = count;
    }

    /// Adds it with weights to a column.
    #[inline(always)]
    pub(super) fn add_to<S: Simd>(&self, column: &mut [Quad], weights: FourLanes<S>) {
        let simd = weights.simd;
        let rows = self.light.as_chunks::<QUAD>().0;
        let two = weights.combine(weights);
        let four = two.combine(two);
        for quad in self.quads() {
            let quad = *quad as usize;
            let (Some(own), Some(light)) = (rows.get(quad), column.get_mut(quad)) else { continue };
            let own = Lanes::from_slice(simd, own.as_flattened());
            own.fused(four, Lanes::from_slice(simd, &light.0)).store_slice(&mut light.0);
        }
    }
}

/// Rows of a batch of collisions, and the weights there and in the row below. Those outside have no weight and a row
/// each below the chart, for sums in one row would wait for each other.
pub(super) struct Points {
    rows: [u32; BATCH],
    upper: [f32; BATCH],
    lower: [f32; BATCH],
}

/// The least and the greatest row of each lane.
pub(super) struct Lit<S: Simd> {
    least: Lanes<S>,
    greatest: Lanes<S>,
}

impl<S: Simd> Lit<S> {
    #[inline(always)]
    pub(super) fn new(simd: S) -> Self {
        Self { least: Lanes::splat(simd, f32::INFINITY), greatest: Lanes::splat(simd, -1.0) }
    }

    /// The first row that may hold something, and the one after the last.
    #[inline(always)]
    fn rows(&self) -> [usize; 2] {
        let (mut least, mut greatest) = (f32::INFINITY, -1.0_f32);
        for lane in 0..BATCH {
            least = least.min(self.least[lane]);
            greatest = greatest.max(self.greatest[lane]);
        }
        if greatest < least { [0; 2] } else { [least as usize, greatest as usize + 2] }
    }
}

impl Points {
    /// Points at rows above `last`, or outside.
    #[inline(always)]
    pub(super) fn new<S: Simd>(rows: Lanes<S>, shown: Lanes<S>, last: f32, lit: &mut Lit<S>) -> Self {
        let (zero, end, outside) = (rows.like(0.0), rows.like(last), ramp(rows.simd, last + 1.0, 2.0));
        let whole = rows.floor();
        let (least, greatest) = (rows.like(f32::INFINITY), rows.like(-1.0));
        lit.least = lit.least.least(inside(rows, end, [whole, least]));
        lit.greatest = lit.greatest.greatest(inside(rows, end, [whole, greatest]));
        let weights = inside(rows, end, [shown, zero]);
        let lower = weights * (rows - whole);
        let mut points = Self { rows: [0; BATCH], upper: [0.0; BATCH], lower: [0.0; BATCH] };
        nearest_whole(inside(rows, end, [whole, outside])).store_slice(&mut points.rows);
        (weights - lower).store_slice(&mut points.upper);
        lower.store_slice(&mut points.lower);
        points
    }
}

/// The first where rows lie from 0 to `end`, the second elsewhere.
#[inline(always)]
fn inside<S: Simd>(rows: Lanes<S>, end: Lanes<S>, [within, without]: [Lanes<S>; 2]) -> Lanes<S> {
    rows.choose(rows.like(0.0), without, rows.choose(end, within, without))
}
