//! Rays one at a time, each of which looks all gas up by itself: the naive way, for benchmarks, and for tests of the one that is used.

use bansho_base::math::{DVec2, DVec3};
use fearless_simd::Simd;

use super::{
    blocks::BlockContents,
    optics::{Exponential, GasSample},
    rays::{GasRays, Gathered, MOST_TIME_SAMPLES, OPAQUE, Ray, STRIDE},
};

/// A ray and what it has gathered.
struct SingleRay {
    /// In cells; its direction has length 1.
    origin: DVec3,
    direction: DVec3,
    /// Distances between which it gathers, m.
    range: [f32; 2],
    depth_per_distance: f32,
    transmittance: [f32; MOST_TIME_SAMPLES],
    gathered: Gathered,
}

impl GasRays<'_> {
    /// What the ray through a place in the picture gathers between two depths, m.
    #[inline(always)]
    pub(crate) fn gather_single<S: Simd>(&self, simd: S, pixel: DVec2, depths: [f64; 2]) -> Option<Gathered> {
        let seen = self.field.blocks.seen_corners()?;
        let ray = self.ray(pixel)?;
        let range = ray.above_bottom(depths)?;
        let mut single = SingleRay {
            origin: ray.origin,
            direction: ray.direction.normalize(),
            range: range.map(|depth| (depth * ray.stretch) as f32),
            depth_per_distance: (1.0 / ray.stretch) as f32,
            transmittance: [1.0; MOST_TIME_SAMPLES],
            gathered: Gathered { depth: f32::INFINITY, ..Gathered::default() },
        };
        let unit = Ray { direction: single.direction, ..ray };
        let seen = unit.clipped(seen[0], seen[1], [0.0, f64::INFINITY])?;
        let [first, end] = seen.map(|cells| cells / (STRIDE as f64 * self.step));
        let contents = |stride: usize| self.field.blocks.at(self.point(&single, stride * STRIDE, 0.0));
        let strides: Vec<(usize, BlockContents)> = (first.floor() as usize..end.ceil() as usize)
            .map(|stride| (stride, contents(stride).max(contents(stride + 1))))
            .collect();
        for (stride, contents) in strides {
            match contents {
                BlockContents::Sheet => self.cross_single_sheets(simd, &mut single, stride),
                BlockContents::Smoke => self.cross_single_smoke(simd, &mut single, stride),
                BlockContents::Nothing => {}
            }
        }
        let samples = self.times.count;
        let transmittance = single.transmittance[..samples].iter().sum::<f32>() / samples as f32;
        single.gathered.opacity = 1.0 - transmittance;
        single.gathered.is_visible().then_some(single.gathered)
    }

    fn point(&self, ray: &SingleRay, number: usize, fraction: f64) -> bansho_base::math::Vec3 {
        (ray.origin + ray.direction * ((number as f64 + fraction) * self.step)).as_vec3()
    }

    #[inline(always)]
    fn cross_single_sheets<S: Simd>(&self, simd: S, ray: &mut SingleRay, stride: usize) {
        let samples = self.times.count;
        let look_up = |ray: &SingleRay, number: usize| {
            let point = self.point(ray, number, 0.0);
            self.gas_samples(simd, point, self.field.blocks.at(point) == BlockContents::Sheet)
        };
        let middle = self.point(ray, stride * STRIDE, 0.5 * STRIDE as f64);
        let (radiance, fading) = (self.smoke_radiance(simd, middle), self.field.fading(middle));
        let mut before = look_up(ray, stride * STRIDE);
        for number in stride * STRIDE + 1..=(stride + 1) * STRIDE {
            let here = look_up(ray, number);
            let [from, to] = self.overlap(ray, number - 1, 1);
            if to > from {
                for sample in 0..samples {
                    let (first, last): (&GasSample<f32>, &GasSample<f32>) = (&before[sample], &here[sample]);
                    let crossing = self.optics.crossing(first, last);
                    let (soot, smoke) = (crossing.soot * fading, crossing.smoke * fading);
                    let depth = (soot + smoke) * (to - from);
                    let seen = ray.absorb(sample, samples, depth, from) / (soot + smoke).max(f32::MIN_POSITIVE);
                    let luminance = seen * soot * crossing.luminance;
                    ray.gathered.luminance += luminance;
                    ray.gathered.luminance_kelvin += luminance * crossing.kelvin;
                    for (sum, radiance) in ray.gathered.scattered.iter_mut().zip(radiance) {
                        *sum += seen * smoke * radiance;
                    }
                    let share = (to - from) / (self.step_m() as f32 * samples as f32);
                    ray.gathered.blue += ray.transmittance[sample] * crossing.blue * fading * share;
                }
            }
            before = here;
        }
    }

    #[inline(always)]
    fn cross_single_smoke<S: Simd>(&self, simd: S, ray: &mut SingleRay, stride: usize) {
        let [from, to] = self.overlap(ray, stride * STRIDE, STRIDE);
        if to <= from {
            return;
        }
        let middle = self.point(ray, stride * STRIDE, 0.5 * STRIDE as f64);
        let radiance = self.smoke_radiance(simd, middle);
        let smoke = self.smoke(simd, middle) * self.field.fading(middle);
        for sample in 0..self.times.count {
            let seen = ray.absorb(sample, self.times.count, smoke * (to - from), from);
            for (sum, radiance) in ray.gathered.scattered.iter_mut().zip(radiance) {
                *sum += seen * radiance;
            }
        }
    }

    /// Distances between which a ray gathers within so many steps from one on, m.
    fn overlap(&self, ray: &SingleRay, first: usize, steps: usize) -> [f32; 2] {
        let [begin, end] = [first, first + steps].map(|number| (number as f64 * self.step_m()) as f32);
        [ray.range[0].max(begin), ray.range[1].min(end)]
    }
}

impl SingleRay {
    /// Absorbs light over an optical depth; the share of all light that is absorbed there in a time sample.
    #[inline(always)]
    fn absorb(&mut self, sample: usize, samples: usize, optical_depth: f32, distance: f32) -> f32 {
        let transmittance = &mut self.transmittance[sample];
        if *transmittance < OPAQUE || optical_depth <= 0.0 {
            return 0.0;
        }
        let absorbed = *transmittance * (1.0 - (-optical_depth).simd_exp());
        *transmittance -= absorbed;
        self.gathered.optical_depth += optical_depth / samples as f32;
        self.gathered.depth = self.gathered.depth.min(distance * self.depth_per_distance);
        absorbed / samples as f32
    }
}
