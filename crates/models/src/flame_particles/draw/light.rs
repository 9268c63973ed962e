//! The light that the gas throws on others.

use bansho_base::{
    color,
    math::DVec3,
    surroundings::{Emitter, Light},
};

use super::{gas::Gas, look::LookParameters};

/// Heights into which the flame is cut to find where its light comes from.
const SLABS: usize = 48;

/// What one slab sends out.
#[derive(Clone, Copy, Debug, Default)]
struct Slab {
    /// Candela in every direction were nothing hidden, ACEScg.
    intensity: [f64; 3],
    /// Luminous intensity times place, and times the square of the place across.
    moment: DVec3,
    spread: f64,
    /// Sum of absorption times volume, m^2: optical depth times area.
    shade: f64,
}

impl Slab {
    fn luminous(&self) -> f64 {
        self.intensity.iter().sum::<f64>().max(0.0)
    }
}

/// Point lights that stand for the gas at time `t`: `look.light.count` parts of equal power along its height, each where its light is
/// centred, so that they move as smoothly as the gas does.
///
/// Soot of volume V with absorption k and temperature T sends `V k B(T)` in every direction; what the soot of its part hides
/// is taken off as by a slab of the same optical depth, `(1 - exp(-tau)) / tau`.
pub fn luminous(gas: &Gas, look: &LookParameters, t: f64) -> Vec<Light> {
    let count = look.light.count.max(1) as usize;
    if look.light.scale <= 0.0 || gas.particles.is_empty() {
        return Vec::new();
    }
    let slabs = slabs(gas, look, t);
    let total: f64 = slabs.iter().map(Slab::luminous).sum();
    if total.is_nan() || total <= 0.0 {
        return Vec::new();
    }
    (0..count)
        .filter_map(|part| part_light(&slabs, [part, part + 1].map(|edge| total * edge as f64 / count as f64), look))
        .collect()
}

/// The gas cut by height; a particle is shared by the two slabs around it.
fn slabs(gas: &Gas, look: &LookParameters, t: f64) -> Vec<Slab> {
    let heights = || (0..gas.particles.len()).map(|index| gas.place(index, t).y);
    let (low, high) = heights().fold((f64::MAX, f64::MIN), |(low, high), y| (low.min(y), high.max(y)));
    let step = ((high - low) / (SLABS - 1) as f64).max(1e-9);
    let table = color::black_body();
    let mut slabs = vec![Slab::default(); SLABS + 1];
    for index in 0..gas.particles.len() {
        let shade = gas.absorption(index, look) * gas.volume(index);
        if shade <= 0.0 {
            continue;
        }
        let place = gas.place(index, t);
        let radiance = table.radiance(gas.particles.temperature[index]).map(f64::from);
        let at = ((place.y - low) / step).clamp(0.0, (SLABS - 1) as f64);
        let part = at - at.floor();
        for (slab, share) in [(at as usize, 1.0 - part), (at as usize + 1, part)] {
            let slab = &mut slabs[slab];
            let intensity = radiance.map(|value| value * shade * share);
            let power: f64 = intensity.iter().sum();
            (0..3).for_each(|c| slab.intensity[c] += intensity[c]);
            slab.moment += place * power;
            slab.spread += (place.x * place.x + place.z * place.z) * power;
            slab.shade += shade * share;
        }
    }
    slabs
}

/// The light of what lies between two sums of power, counted from below.
fn part_light(slabs: &[Slab], [from, to]: [f64; 2], look: &LookParameters) -> Option<Light> {
    let mut sum = Slab::default();
    let mut below = 0.0;
    for slab in slabs {
        let above = below + slab.luminous();
        let taken = (above.min(to) - below.max(from)).max(0.0);
        if taken > 0.0 {
            let share = taken / slab.luminous();
            (0..3).for_each(|c| sum.intensity[c] += share * slab.intensity[c]);
            sum.moment += slab.moment * share;
            sum.spread += slab.spread * share;
            sum.shade += slab.shade * share;
        }
        below = above;
    }
    let power = sum.luminous();
    if power <= 0.0 {
        return None;
    }
    let position = sum.moment / power;
    let across = (sum.spread / power - position.x * position.x - position.z * position.z).max(0.0).sqrt();
    let radius = across.max(1e-3);
    // Seen from the side, the part covers about a disc of twice its deviation.
    let tau = sum.shade / (4.0 * std::f64::consts::PI * radius * radius);
    let escapes = if tau > 1e-6 { -bansho_base::math::exp_m1(-tau) / tau } else { 1.0 };
    let scale = look.light.scale * escapes;
    Some(Light {
        emitter: Emitter::Point { position, radius },
        intensity: sum.intensity.map(|value| (value * scale) as f32),
    })
}
