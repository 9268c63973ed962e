//! Light of the thin sheet in which gas burns, between two values of the mixture fraction.
//!
//! A sheet may be thinner than a step of a ray. Soot is a function of the mixture fraction Z alone, and Z is nearly linear along a step, so that the mean of the
//! soot over the step is the mean of that function over the interval of Z that the step crosses: the difference of its integral at both ends over that of Z
//! (pre-integrated transfer functions, Engel, Kraus and Ertl 2001). Motion while the shutter is open widens the interval.

use super::super::fuel::soot_profile;

/// Entries of the table.
const ENTRIES: usize = 512;
/// Last value of Z over Zs in the table; beyond it there is no soot.
pub(crate) const LAST_SOOT: f32 = 4.0;
/// Half of the width of the zone that shines blue, in Zs.
const BLUE_WIDTH: f32 = 0.12;

/// Integrals over the mixture fraction.
#[derive(Debug)]
pub(crate) struct SheetTable {
    /// Integrals from 0, over Z in units of Zs: of the profile of soot, and of soot times Z.
    integrals: Vec<[f32; 2]>,
    per_stoichiometric: f32,
}

impl SheetTable {
    pub(crate) fn new(stoichiometric: f32) -> Self {
        let step = LAST_SOOT / (ENTRIES - 1) as f32;
        let mut sums = [0.0_f64; 2];
        let mut integrals = Vec::with_capacity(ENTRIES);
        for entry in 0..ENTRIES {
            integrals.push(sums.map(|sum| sum as f32));
            // Simpson's rule over an interval.
            let start = entry as f32 * step;
            for (offset, weight) in [(0.0, 1.0), (0.5, 4.0), (1.0, 1.0)] {
                let place = start + offset * step;
                let soot = f64::from(step) / 6.0 * weight * f64::from(soot_profile(place));
                sums[0] += soot;
                sums[1] += soot * f64::from(place);
            }
        }
        Self { integrals, per_stoichiometric: 1.0 / stoichiometric }
    }

    /// Mean of the profile of soot over an interval of Z with that middle and half width, and the Z at which the soot is in the mean.
    #[inline(always)]
    pub(crate) fn mean_soot(&self, middle: f32, half_width: f32) -> [f32; 2] {
        let (relative, half_width) = (middle * self.per_stoichiometric, half_width * self.per_stoichiometric);
        if half_width < 0.02 {
            return [soot_profile(relative), middle];
        }
        let (first, last) = (self.integral(relative - half_width), self.integral(relative + half_width));
        let soot = last[0] - first[0];
        // Less is rounding.
        if soot <= 1e-5 {
            return [0.0, middle];
        }
        [soot / (2.0 * half_width), (last[1] - first[1]) / (soot * self.per_stoichiometric)]
    }

    #[inline(always)]
    fn integral(&self, relative: f32) -> [f32; 2] {
        let place = relative.clamp(0.0, LAST_SOOT) * ((ENTRIES - 1) as f32 / LAST_SOOT);
        let below = (place as usize).min(ENTRIES - 2);
        let fraction = place - below as f32;
        let (near, next) = (self.integrals[below], self.integrals[below + 1]);
        [near[0] + fraction * (next[0] - near[0]), near[1] + fraction * (next[1] - near[1])]
    }

    /// Share of the blue zone that is crossed between two values of Z: 1 in all for a step from air into fuel.
    #[inline(always)]
    pub(crate) fn blue_between(&self, first: f32, last: f32) -> f32 {
        let place =
            |mixture: f32| ((mixture * self.per_stoichiometric - 1.0) * (0.5 / BLUE_WIDTH) + 0.5).clamp(0.0, 1.0);
        (place(last) - place(first)).abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_over_intervals_are_those_of_many_samples() {
        let table = SheetTable::new(0.06);
        for (middle, half_width) in [(0.09, 0.03), (0.06, 0.06), (0.2, 0.2), (0.1, 0.001), (0.5, 0.01)] {
            let samples = || (0..2000).map(|i| middle + half_width * ((i as f32 + 0.5) / 1000.0 - 1.0));
            let mean = samples().map(|z| soot_profile(z / 0.06)).sum::<f32>() / 2000.0;
            let place = samples().map(|z| z * soot_profile(z / 0.06)).sum::<f32>() / (2000.0 * mean);
            let [soot, at] = table.mean_soot(middle, half_width);
            assert!((soot - mean).abs() < 2e-3, "{middle} {half_width}");
            assert!(mean < 1e-3 || (at - place).abs() < 2e-3 * 0.06, "{middle} {half_width}: {at} {place}");
        }
        assert_eq!(table.blue_between(0.0, 1.0), 1.0);
        assert_eq!(table.blue_between(0.0, 0.03), 0.0);
        assert!((table.blue_between(0.0, 0.06) - 0.5).abs() < 1e-3);
    }
}
