//! How many particles each stretch of the sheets holds beside its share, by which some are born and some die.

use super::AuroraParticles;
use crate::simulate::{field::scatter::Scattered, sheets::refined_shape::Course};

/// Stretches that all sheets together are cut into: half as long as those that must hold half their share.
const STRETCHES: f64 = 100.0;
/// Particles that a stretch shall hold at least: fewer would come and go by chance.
const LEAST_SHARE: f64 = 32.0;

/// Stretches of the sheets about as long as each other, one sheet's after those of another.
#[derive(Clone, Debug)]
pub(super) struct Stretches {
    /// Where each sheet's begin, and the end of all.
    starts: Vec<usize>,
    all: Vec<Stretch>,
}

/// What is known of a stretch.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Stretch {
    /// Particles that it shall hold: as much of them all as it is of the sheets' length, like the power that they bring.
    pub(super) due: f64,
    /// Particles that were scattered about it: fewer than are due where another sheet lies close by.
    pub(super) scattered: f64,
    /// Particles that it holds and that stay alive, and the sum of their velocities, km/s.
    pub(super) found: f64,
    momentum: [f64; 2],
}

impl Stretches {
    /// The stretches of a shape for so many particles, and what was scattered about each.
    pub(super) fn new(course: &Course, scattered: &[Scattered], count: f64) -> Self {
        let lengths = course.sheet_lengths();
        let whole = lengths.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let number = STRETCHES.min(count / LEAST_SHARE);
        let mut stretches = Self { all: Vec::new(), starts: vec![0] };
        for share in lengths.into_iter().map(|length| length / whole) {
            let own = (number * share).round().max(1.0);
            let stretch = Stretch { due: count * share / own, ..Stretch::default() };
            stretches.all.extend(std::iter::repeat_n(stretch, own as usize));
            stretches.starts.push(stretches.all.len());
        }
        for particle in scattered {
            if let Some(index) = stretches.index(particle.sheet, particle.share) {
                stretches.all[index].scattered += 1.0;
            }
        }
        stretches
    }

    /// Finds what they hold.
    pub(super) fn fill(&mut self, particles: &AuroraParticles) {
        for index in (0..particles.len()).filter(|index| !particles.dying[*index]) {
            let Some(stretch) = self.index(particles.sheets[index], particles.shares[index]) else { continue };
            let stretch = &mut self.all[stretch];
            stretch.found += 1.0;
            for (sum, speeds) in stretch.momentum.iter_mut().zip(&particles.velocities) {
                *sum += f64::from(speeds[index]);
            }
        }
    }

    /// The stretch at a share of a sheet's length; none where there is no such sheet.
    pub(super) fn index(&self, sheet: u32, share: f32) -> Option<usize> {
        let (first, end) = (*self.starts.get(sheet as usize)?, *self.starts.get(sheet as usize + 1)?);
        let place = f64::from(share) * (end - first) as f64;
        Some(first + (place as usize).min(end - first - 1))
    }

    /// All of them, sheet by sheet.
    pub(super) fn all(&mut self) -> &mut [Stretch] {
        &mut self.all
    }

    /// Mean velocity of those in the stretch at that index and in those beside it on the sheet, km/s; rest where there is nobody.
    pub(super) fn velocity(&self, index: usize) -> [f32; 2] {
        let sheet = self.starts.partition_point(|start| *start <= index);
        let beside = index.saturating_sub(1).max(self.starts[sheet - 1])..(index + 2).min(self.starts[sheet]);
        let (mut sum, mut count) = ([0.0; 2], 0.0);
        for stretch in &self.all[beside] {
            count += stretch.found;
            sum = [0, 1].map(|axis| sum[axis] + stretch.momentum[axis]);
        }
        sum.map(|sum| if count > 0.0 { (sum / count) as f32 } else { 0.0 })
    }
}
