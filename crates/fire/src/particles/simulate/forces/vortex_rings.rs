//! Puffing: vortex rings that roll up around the base of a fire and rise with it.
//!
//! Puffing is prescribed, not emergent: air is not simulated, so the instability that sheds the rings cannot appear. Each burner
//! sheds a ring per period of the frequency measured by Cetegen and Ahmed (1993), with random variation of time and strength. Gas moves
//! inward below a ring (the neck) and outward above it (the bulge), as in their photographs. The flow has the Stokes stream function
//! `psi = C r^2 (1 - s^2/c^2)^4` within the distance c of the ring's center and vanishes beyond, so it is divergence-free.

use bansho_base::math::{
    DVec3, Vec3, cbrt,
    random::{Key, Purpose, uniform},
    simd::{Lanes, Real, any_positive},
};
use fearless_simd::Simd;

use super::entrainment_axis::PlumeAxis;
use crate::particles::{
    parameters::FlameParticlesParameters,
    simulate::{
        burner::Burner,
        vectors::{dot, scaled},
    },
};

/// Maximum number of rings that a burner sheds side by side.
const MAX_STREAMS: f64 = 6.0;
/// Maximum number of active rings of a stream.
const MAX_RINGS: i64 = 9;
/// Age at which a ring has faded out, in periods; the oldest of [`MAX_RINGS`] rings is always older.
const MAX_AGE_PERIODS: f64 = MAX_RINGS as f64 - 2.2;
/// Speed of a ring relative to the gas on the axis.
const RING_SPEED: f64 = 0.7;
/// Speed at a ring's center relative to the gas on the axis at its height.
const RING_STRENGTH: f64 = 0.6;
/// Extent c of a new ring, in burner diameters.
const RING_EXTENT: f64 = 0.85;
/// Growth of the extent per period, by entrained air.
const RING_GROWTH: f64 = 0.28;

/// A vortex ring at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct VortexRing {
    /// Its center, m from the flame's position.
    center: Vec3,
    /// Its axis: the direction of the flow at its center.
    axis: Vec3,
    /// 1 / c, 1/m.
    inverse_extent: f32,
    /// C: half the speed at its center, m/s.
    strength: f32,
}

impl VortexRing {
    /// Adds the velocity of the air at `position`, m/s.
    #[inline(always)]
    pub(crate) fn add_velocity<S: Simd>(&self, position: &[Lanes<S>; 3], sum: &mut [Lanes<S>; 3]) {
        let (center, direction) = (self.center.to_array(), self.axis.to_array());
        let (mut offset, mut axis) = (*position, *position);
        for c in 0..3 {
            offset[c] = scaled(position[c] - position[c].broadcast(center[c]), self.inverse_extent);
            axis[c] = position[c].broadcast(direction[c]);
        }
        let zero = position[0].broadcast(0.0);
        let q = position[0].broadcast(1.0) - dot(&offset, &offset);
        // Most rings reach none of the sixteen positions.
        if !any_positive(q) {
            return;
        }
        let q = q.simd_max(zero);
        let height = dot(&offset, &axis);
        let mut radial = offset;
        for c in 0..3 {
            radial[c] = axis[c].fma(zero - height, offset[c]);
        }
        // psi = C r^2 q^4 with q = 1 - s^2: u_h = (1/r) dpsi/dr = C (2 q^4 - 8 r^2 q^3), u_r = -(1/r) dpsi/dh = 8 C r h q^3.
        let cubed = scaled(q * q * q, self.strength);
        let along = cubed * dot(&radial, &radial).fma(q.broadcast(-8.0), scaled(q, 2.0));
        let outward = scaled(cubed * height, 8.0);
        for c in 0..3 {
            sum[c] = radial[c].fma(outward, axis[c].fma(along, sum[c]));
        }
    }
}

/// The rings of `burner` that are active at `t`; they follow the plume `axis`.
pub(crate) fn active_rings(
    burner: &Burner,
    flame: &FlameParticlesParameters,
    key: Key,
    burner_index: u32,
    t: f64,
    axis: &PlumeAxis,
) -> Vec<VortexRing> {
    if flame.forces.puffing == 0.0 {
        return Vec::new();
    }
    let hz = burner.puffing_hz(flame);
    let disk_area = std::f64::consts::FRAC_PI_4 * burner.diameter * burner.diameter;
    let streams = (burner.area_m2 / disk_area).round().clamp(1.0, MAX_STREAMS) as u32;
    let latest = (t * hz).floor() as i64 + 1;
    let mut rings = Vec::new();
    for stream in 0..streams {
        let shedding =
            VortexShedding { burner, key, purpose: Purpose(burner_index * 64 + stream), streams, hz, t, axis };
        rings.extend((0..MAX_RINGS).filter_map(|back| shedding.ring(latest - back, flame.forces.puffing)));
    }
    rings
}

/// Inputs of the rings of one stream.
struct VortexShedding<'a> {
    burner: &'a Burner,
    key: Key,
    purpose: Purpose,
    streams: u32,
    hz: f64,
    t: f64,
    axis: &'a PlumeAxis,
}

impl VortexShedding<'_> {
    /// The ring shed in period `period`, if it is active.
    fn ring(&self, period: i64, puffing: f64) -> Option<VortexRing> {
        let words = self.key.words(period as u64, 1, self.purpose);
        let [timing, strength, tilt_x, tilt_z] = words.map(|word| f64::from(uniform(word)));
        let phase = f64::from(self.purpose.0 % 64) * 0.618;
        let age = self.t - (period as f64 + phase.fract() + 0.25 * (timing - 0.5)) / self.hz;
        let burner = self.burner;
        let height = RING_SPEED * (burner.speed + 0.5 * burner.acceleration * age) * age;
        if age <= 0.0 || height > 1.6 * burner.height + burner.diameter {
            return None;
        }
        let age_periods = age * self.hz;
        let extent = RING_EXTENT
            * burner.diameter
            * (1.0 + RING_GROWTH * age_periods)
            * cbrt(height / burner.diameter).clamp(0.6, 1.2);
        // A ring rolls up within a period and fades as it leaves the flame.
        let roll_up = age_periods / (age_periods + 0.35);
        let fade =
            (1.6 - height / burner.height).clamp(0.0, 0.6) / 0.6 * (MAX_AGE_PERIODS - age_periods).clamp(0.0, 1.0);
        let speed = burner.axis_speed(height) * RING_STRENGTH * (0.75 + 0.5 * strength) * roll_up * fade * puffing;
        let [above, base] = [height, 0.0].map(|height| self.axis.at(height as f32).map(f64::from));
        let lean = DVec3::new(above[0] - base[0], height, above[1] - base[1]);
        let axis = DVec3::new(0.5 * (tilt_x - 0.5), 1.0, 0.5 * (tilt_z - 0.5)).normalize();
        Some(VortexRing {
            center: (self.shedding_position(period, [tilt_x, tilt_z]) + lean).as_vec3(),
            axis: axis.as_vec3(),
            inverse_extent: (1.0 / extent) as f32,
            strength: (0.5 * speed) as f32,
        })
    }

    /// Position at which a ring is shed: near the center of a burner with one stream, otherwise a random point of the burner.
    fn shedding_position(&self, period: i64, [x, z]: [f64; 2]) -> DVec3 {
        let burner = self.burner;
        if self.streams == 1 {
            let offset = DVec3::new(z - 0.5, 0.0, x - 0.5) * (0.4 * burner.diameter);
            return burner.position(self.t) + offset;
        }
        burner.spawn_point(self.key, period as u64 ^ u64::from(self.purpose.0) << 48, self.t).position
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::host::assets::MemoryAssets;
    use fearless_simd::prelude::*;

    use super::*;
    use crate::particles::{parameters::BurnerParameters, simulate::forces::entrainment_axis::plume_axes};

    fn velocity(ring: &VortexRing, position: Vec3) -> Vec3 {
        bansho_base::dispatch_baseline!(simd => {
            let mut sum = [Lanes::splat(simd, 0.0); 3];
            ring.add_velocity(&position.to_array().map(|x| Lanes::splat(simd, x)), &mut sum);
            Vec3::from(sum.map(|values| values.as_slice()[5]))
        })
    }

    fn ring() -> VortexRing {
        VortexRing { center: Vec3::new(0.1, 0.5, 0.0), axis: Vec3::Y, inverse_extent: 2.5, strength: 1.5 }
    }

    #[test]
    fn a_ring_has_no_divergence() {
        let ring = ring();
        for position in [Vec3::new(0.15, 0.6, 0.1), Vec3::new(0.3, 0.45, -0.1), Vec3::new(0.0, 0.3, 0.05)] {
            let h = 2e-3;
            let slope = |axis: Vec3| {
                (velocity(&ring, position + axis * h) - velocity(&ring, position - axis * h)).dot(axis) / (2.0 * h)
            };
            let divergence = slope(Vec3::X) + slope(Vec3::Y) + slope(Vec3::Z);
            assert!(divergence.abs() < 0.01 * slope(Vec3::Y).abs().max(1.0), "{divergence}");
        }
    }

    #[test]
    fn rings_come_and_go_without_a_jump_however_many_there_are() {
        // A frequency at which rings are removed by their count, long before they rise above the flame.
        let mut flame = FlameParticlesParameters::default();
        flame.forces.puffing_hz = bansho_base::parameters::Auto::Set(40.0);
        let burner = Burner::new(&BurnerParameters::default(), &flame, &MemoryAssets::default()).unwrap();
        let axis = plume_axes(std::slice::from_ref(&burner), [&[]; 3], &[], 0.0, 0.0).remove(0);
        let total = |t: f64| {
            let active_rings = active_rings(&burner, &flame, Key::new(4, "rings"), 0, t, &axis);
            (active_rings.iter().map(|ring| f64::from(ring.strength)).sum::<f64>(), active_rings.len())
        };
        let (mut before, mut most) = (total(1.0).0, 0);
        for step in 1..4000 {
            let (now, count) = total(1.0 + 1e-4 * f64::from(step));
            assert!((now - before).abs() < 0.01 * before, "from {before} to {now}");
            (before, most) = (now, most.max(count));
        }
        assert!(most as i64 >= MAX_RINGS - 2, "{most} rings");
    }

    #[test]
    fn a_ring_draws_in_below_and_pushes_out_above() {
        let ring = ring();
        assert!((velocity(&ring, ring.center) - Vec3::Y * 3.0).length() < 1e-6);
        assert!(velocity(&ring, ring.center + Vec3::new(0.15, -0.15, 0.0)).x < -0.1);
        assert!(velocity(&ring, ring.center + Vec3::new(0.15, 0.15, 0.0)).x > 0.1);
        assert!(velocity(&ring, ring.center + Vec3::new(0.3, 0.0, 0.0)).y < -0.05, "it rolls");
        assert_eq!(velocity(&ring, ring.center + Vec3::X * 0.5), Vec3::ZERO);
    }
}
