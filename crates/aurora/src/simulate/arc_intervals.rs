//! How many particles each stretch of the sheets holds beside its share, by which some are born and some die.

use super::AuroraParticles;
use crate::simulate::{field::scatter::ScatteredParticle, sheets::refined_shape::RefinedShape};

/// Stretches that all sheets together are cut into: half as long as those that must hold half their share.
const INTERVALS: f64 = 100.0;
/// Particles that a stretch shall hold at least: fewer would come and go by chance.
const MIN_INTERVAL_COUNT: f64 = 32.0;

/// Stretches of the sheets about as long as each other, one sheet's after those of another.
#[derive(Clone, Debug)]
pub(super) struct ArcIntervals {
    /// Where each sheet's begin, and the end of all.
    starts: Vec<usize>,
    all: Vec<ArcInterval>,
}

/// What is known of a stretch.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ArcInterval {
    /// Particles that it shall hold: as much of them all as it is of the sheets' length, like the power that they bring.
    pub(super) target_count: f64,
    /// Particles that were scattered about it: fewer than are due where another sheet lies close by.
    pub(super) scattered: f64,
    /// Particles that it holds and that stay alive, and the sum of their velocities, km/s.
    pub(super) count: f64,
    momentum: [f64; 2],
}

impl ArcIntervals {
    /// The stretches of a shape for so many particles, and what was scattered about each.
    pub(super) fn new(refined: &RefinedShape, scattered: &[ScatteredParticle], count: f64) -> Self {
        let lengths = refined.sheet_lengths();
        let whole = lengths.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let number = INTERVALS.min(count / MIN_INTERVAL_COUNT);
        let mut intervals = Self { all: Vec::new(), starts: vec![0] };
        for fraction in lengths.into_iter().map(|length| length / whole) {
            let own = (number * fraction).round().max(1.0);
            let interval = ArcInterval { target_count: count * fraction / own, ..ArcInterval::default() };
            intervals.all.extend(std::iter::repeat_n(interval, own as usize));
            intervals.starts.push(intervals.all.len());
        }
        for particle in scattered {
            if let Some(index) = intervals.index(particle.sheet, particle.arc_fraction) {
                intervals.all[index].scattered += 1.0;
            }
        }
        intervals
    }

    /// Finds what they hold.
    pub(super) fn fill(&mut self, particles: &AuroraParticles) {
        for index in (0..particles.len()).filter(|index| !particles.dying[*index]) {
            let Some(interval) = self.index(particles.sheets[index], particles.arc_fractions[index]) else { continue };
            let interval = &mut self.all[interval];
            interval.count += 1.0;
            for (sum, speeds) in interval.momentum.iter_mut().zip(&particles.velocities) {
                *sum += f64::from(speeds[index]);
            }
        }
    }

    /// The stretch at a share of a sheet's length; none where there is no such sheet.
    pub(super) fn index(&self, sheet: u32, fraction: f32) -> Option<usize> {
        let (first, end) = (*self.starts.get(sheet as usize)?, *self.starts.get(sheet as usize + 1)?);
        let coordinate = f64::from(fraction) * (end - first) as f64;
        Some(first + (coordinate as usize).min(end - first - 1))
    }

    /// All of them, sheet by sheet.
    pub(super) fn all(&mut self) -> &mut [ArcInterval] {
        &mut self.all
    }

    /// Mean velocity of those in the stretch at that index and in those beside it on the sheet, km/s; rest where there is nobody.
    pub(super) fn velocity(&self, index: usize) -> [f32; 2] {
        let sheet = self.starts.partition_point(|start| *start <= index);
        let beside = index.saturating_sub(1).max(self.starts[sheet - 1])..(index + 2).min(self.starts[sheet]);
        let (mut sum, mut count) = ([0.0; 2], 0.0);
        for interval in &self.all[beside] {
            count += interval.count;
            sum = [0, 1].map(|axis| sum[axis] + interval.momentum[axis]);
        }
        sum.map(|sum| if count > 0.0 { (sum / count) as f32 } else { 0.0 })
    }
}
