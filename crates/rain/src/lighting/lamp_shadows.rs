//! Shadows of visible solids in the light of lamps and fires: a shadow map for each light, kept while light and solids stand still.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use bansho_base::{
    host::parallel::prelude::*,
    phenomenon::surroundings::{Emitter, Light, Occluder},
};

use super::shadow_map::ShadowMap;

/// Largest number of lights with shadows: the strongest.
const MAX_SHADOWED_LIGHTS: usize = 24;

/// The shadow maps of the lights in whose light any solid is.
#[derive(Clone, Debug, Default)]
pub(crate) struct LampShadows {
    maps: Vec<(Emitter, Arc<ShadowMap>)>,
}

impl PartialEq for LampShadows {
    /// Whether they are the same maps in memory: an unchanged map is kept from frame to frame.
    fn eq(&self, other: &Self) -> bool {
        self.maps.len() == other.maps.len()
            && self.maps.iter().zip(&other.maps).all(|((_, map), (_, other))| Arc::ptr_eq(map, other))
    }
}

impl LampShadows {
    /// The shadow map of a light; `None` if no solid shadows it.
    #[inline(always)]
    pub(crate) fn of(&self, emitter: &Emitter) -> Option<&Arc<ShadowMap>> {
        self.maps.iter().find(|(shadowed, _)| shadowed == emitter).map(|(_, map)| map)
    }
}

/// The shadow maps of the last frame.
#[derive(Debug, Default)]
pub(crate) struct LampShadowCache(Mutex<Arc<CachedMaps>>);

#[derive(Debug, Default)]
struct CachedMaps {
    casters: Vec<Occluder>,
    /// Of each light its map, or that there is no shadow.
    maps: Vec<(Emitter, Option<Arc<ShadowMap>>)>,
}

impl LampShadowCache {
    /// The shadows that visible solids cast in the light of lamps and fires.
    pub(crate) fn of_lights(&self, lights: &[Light], casters: &[Occluder]) -> LampShadows {
        if casters.is_empty() {
            return LampShadows::default();
        }
        // Traced without the lock: a thread that waits for parts of this work may take on another task that needs the lock.
        let cached = self.lock().clone();
        let known = if Occluder::are_same(&cached.casters, casters) { cached.maps.as_slice() } else { &[] };
        let emitters = shadowed_emitters(lights);
        let map_of = |emitter: &Emitter| match known.iter().find(|(known, _)| known == emitter) {
            Some((_, map)) => (*emitter, map.clone()),
            None => (*emitter, ShadowMap::new(emitter, casters).map(Arc::new)),
        };
        let maps: Vec<(Emitter, Option<Arc<ShadowMap>>)> = emitters.par_iter().map(map_of).collect();
        let shadows = maps.iter().filter_map(|(emitter, map)| Some((*emitter, map.clone()?))).collect();
        *self.lock() = Arc::new(CachedMaps { casters: casters.to_vec(), maps });
        LampShadows { maps: shadows }
    }

    fn lock(&self) -> MutexGuard<'_, Arc<CachedMaps>> {
        // Solids and maps are replaced together, so a poisoned lock is usable.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The lamps and fires that get shadow maps, each once: those at a place, the strongest if they are many.
fn shadowed_emitters(lights: &[Light]) -> Vec<Emitter> {
    let mut strengths: Vec<(Emitter, f32)> = Vec::new();
    for light in lights {
        let Some(intensity) = light.luminous_intensity().filter(|intensity| *intensity > 0.0) else { continue };
        match strengths.iter_mut().find(|(emitter, _)| *emitter == light.emitter) {
            Some((_, strength)) => *strength += intensity,
            None => strengths.push((light.emitter, intensity)),
        }
    }
    if strengths.len() > MAX_SHADOWED_LIGHTS {
        // A stable sort: of equally strong lights the first ones.
        strengths.sort_by(|(_, some), (_, other)| other.total_cmp(some));
        strengths.truncate(MAX_SHADOWED_LIGHTS);
    }
    strengths.into_iter().map(|(emitter, _)| emitter).collect()
}

#[cfg(test)]
mod tests {
    use bansho_base::{
        math::{self, DQuat, DVec3, simd::LANES},
        phenomenon::surroundings::Surroundings,
    };
    use fearless_simd::dispatch;

    use super::*;
    use crate::{
        Rain, RainParameters,
        lanes::ZERO_LANES,
        lighting::{
            drop_lighting::DropLighting,
            equiangular::{Interval, SightLineIntegrator},
            extinction::{ExtinctionProfile, RainExtinction},
        },
        tests::{lamp, view_at, wind},
    };

    const EXTINCTION: RainExtinction = RainExtinction { all: 0.02, streaks: 0.0 };
    const EYE: DVec3 = DVec3::new(300.0, 1.6, -200.0);

    fn rain() -> Rain {
        Rain::new(RainParameters::default(), "rain", 1, None).unwrap()
    }

    /// Accumulated light of `lights` along a line of sight, up to distances 0.25 m apart.
    fn accumulated(rain: &Rain, lights: &[Light], casters: &[Occluder], line: DVec3) -> Vec<f32> {
        let (view, calm) = (view_at(1.0, 1.0 / 60.0, [64, 36]), wind([0.0; 3], 0.0));
        let shutter_state = rain.shutter_state(&view, &Surroundings::from_wind(&calm));
        let interval = |index: i32| {
            let start = 0.25 * f64::from(index);
            Interval { start, width: 0.25, depth: (0.02 * start) as f32, depth_slope: 0.02 }
        };
        let intervals: Vec<Interval> = (0..64).map(interval).collect();
        let integrator = SightLineIntegrator {
            scattering: &rain.optics.scattering,
            extinction: ExtinctionProfile { shutter_state: &shutter_state, extinction: EXTINCTION },
            shadows: &LampShadowCache::default().of_lights(lights, casters),
            light_extinction: 0.02,
            intervals: &intervals,
            eye: EYE,
            eye_height: 1.6,
        };
        let mut sums = vec![[0.0; 4]; intervals.len() + 1];
        dispatch!(bansho_base::math::simd::level(), _simd => integrator.accumulate(line, lights, &mut sums));
        sums.iter().map(|sum| sum[1]).collect()
    }

    #[test]
    fn behind_a_wall_a_line_of_sight_gathers_the_light_of_its_lit_part_alone() {
        // The lamp is 4 m to the right of the line, 8 m away. A thin wall halfway to the line begins 7 m away, so its shadow begins 6 m away on the line.
        let rain = rain();
        let wall = [Occluder::Cuboid {
            center: EYE + DVec3::new(2.0, 0.0, -17.0),
            half_extents: DVec3::new(0.01, 20.0, 10.0),
            rotation: DQuat::IDENTITY,
        }];
        let lights = [lamp((EYE + DVec3::new(4.0, 0.0, -8.0)).to_array(), 500.0)];
        let lit = accumulated(&rain, &lights, &[], DVec3::NEG_Z);
        let shadowed = accumulated(&rain, &lights, &wall, DVec3::NEG_Z);
        let edge = 6 * 4;
        for index in 0..lit.len() {
            if index < edge {
                assert_eq!(shadowed[index], lit[index], "{index}");
            } else if index > edge + 1 {
                assert_eq!(shadowed[index], shadowed[edge + 1], "no light in the shadow: {index}");
            }
        }
        let (gathered, whole) = (shadowed[lit.len() - 1], lit[lit.len() - 1]);
        assert!(
            (gathered / lit[edge] - 1.0).abs() < 0.01 && whole > 1.1 * lit[edge],
            "{gathered} {} {whole}",
            lit[edge]
        );
    }

    /// Light along a line of sight by many small steps, with exact shadows of balls.
    fn brute_force(rain: &Rain, light: &Light, balls: &[(DVec3, f64)], line: DVec3, end: f64) -> f64 {
        const STEPS: i32 = 40_000;
        let (lights, shadows) = ([*light], LampShadows::default());
        let lighting =
            DropLighting { scattering: &rain.optics.scattering, lights: &lights, shadows: &shadows, extinction: 0.02 };
        let (position, step) = (light.emitter.position().unwrap(), end / f64::from(STEPS));
        let mut sum = 0.0;
        for index in 0..STEPS {
            let at = step * (f64::from(index) + 0.5);
            let point = EYE + line * at;
            let is_hidden = balls.iter().any(|(center, radius)| {
                let way = point - position;
                let nearest = ((*center - position).dot(way) / way.length_squared()).clamp(0.0, 1.0);
                (*center - position - way * nearest).length() < *radius
            });
            if !is_hidden && point.y >= 0.0 {
                let radiance = f64::from(lighting.radiance(light, point, line)[1]);
                sum += radiance * EXTINCTION.all * math::exp(-0.02 * at) * step;
            }
        }
        sum
    }

    #[test]
    fn shafts_of_shadow_are_those_of_a_brute_force_integration() {
        let rain = rain();
        let position = EYE + DVec3::new(1.0, 1.2, -6.0);
        let axis = DVec3::new(-0.6, -0.2, 1.0).normalize();
        // A ball as large as a head, and one as thin as a post.
        let balls = [(position + axis * 1.5, 0.15), (position + DVec3::new(-1.0, -0.4, 0.2), 0.05)];
        let casters = balls.map(|(center, radius)| Occluder::Sphere { center, radius });
        let lights = [
            lamp(position.to_array(), 500.0),
            Light { emitter: Emitter::Spot { position, axis, cos_inner: 0.9, cos_outer: 0.8 }, intensity: [500.0; 3] },
        ];
        let mut shadowed = 0;
        for light in lights {
            for index in 0..60 {
                let line = DVec3::new(0.02 * f64::from(index) - 0.6, 0.15, -1.0).normalize();
                let found = f64::from(accumulated(&rain, &[light], &casters, line)[64]);
                let expected = brute_force(&rain, &light, &balls, line, 16.0);
                let unshadowed = brute_force(&rain, &light, &[], line, 16.0);
                assert!(
                    (found - expected).abs() < 0.02 * unshadowed + 1e-6,
                    "{:?} {index}: {found} {expected} {unshadowed}",
                    light.emitter
                );
                shadowed += usize::from(expected < 0.93 * unshadowed);
            }
        }
        assert!(shadowed > 10, "{shadowed}");
    }

    #[test]
    fn drops_in_a_shadow_are_dark_and_others_as_bright_as_ever() {
        let rain = rain();
        let light = lamp((EYE + DVec3::new(0.0, 1.0, -5.0)).to_array(), 100.0);
        let (lights, cache) = ([light], LampShadowCache::default());
        let ball = [Occluder::Sphere { center: EYE + DVec3::new(0.0, 0.0, -5.0), radius: 0.3 }];
        let radiances = |casters: &[Occluder]| {
            let shadows = cache.of_lights(&lights, casters);
            let lighting = DropLighting {
                scattering: &rain.optics.scattering,
                lights: &lights,
                shadows: &shadows,
                extinction: 0.0,
            };
            // A row of drops 2 m below the lamp.
            let mut positions = ZERO_LANES;
            for (i, x) in positions.iter_mut().enumerate() {
                *x = 0.2 * i as f32 - 1.5;
            }
            let positions = [positions, [-1.0; LANES], [-5.0; LANES]];
            let mut radiance = [[0.0; 3]; LANES];
            lighting.add(&lighting.prepare_lights(EYE)[0], &positions, &[1.0; LANES], &mut radiance);
            (positions[0], radiance)
        };
        let (xs, lit) = radiances(&[]);
        let (_, shadowed) = radiances(&ball);
        // The tangent from the lamp, 1 m above the middle of the ball, whose sine is 0.3, meets the row at 2 tan 17.46 degrees.
        let edge = 0.629;
        for i in 0..LANES {
            if xs[i].abs() < edge - 0.03 {
                assert_eq!(shadowed[i], [0.0; 3], "{}", xs[i]);
            } else if xs[i].abs() > edge + 0.03 {
                assert_eq!(shadowed[i], lit[i], "{}", xs[i]);
            }
        }
        assert!(xs.iter().filter(|x| x.abs() < edge - 0.03).count() >= 6);
    }

    #[test]
    fn maps_are_kept_until_a_light_or_a_solid_moves() {
        let cache = LampShadowCache::default();
        let ball = |x: f64| [Occluder::Sphere { center: DVec3::new(x, 0.0, 0.0), radius: 0.3 }];
        let lights = |x: f64, intensity: f32| [lamp([x, 2.0, 0.0], intensity), lamp([3.0, 1.0, 0.0], 5.0)];
        let first = cache.of_lights(&lights(0.0, 10.0), &ball(0.0));
        // A light that flickers keeps its shadow.
        assert!(first == cache.of_lights(&lights(0.0, 70.0), &ball(0.0)) && first.maps.len() == 2);
        assert!(first != cache.of_lights(&lights(0.5, 10.0), &ball(0.0)));
        let moved = cache.of_lights(&lights(0.0, 10.0), &ball(0.1));
        assert!(moved != first && moved == cache.of_lights(&lights(0.0, 10.0), &ball(0.1)));
        assert!(cache.of_lights(&lights(0.0, 10.0), &[]) == LampShadows::default());
    }

    #[test]
    fn of_many_lights_the_strongest_have_shadows() {
        let lights: Vec<Light> = (0..40).map(|index| lamp([f64::from(index), 0.0, 0.0], (index % 7) as f32)).collect();
        let emitters = shadowed_emitters(&lights);
        assert!(emitters.len() == MAX_SHADOWED_LIGHTS && emitters.contains(&lights[6].emitter));
        assert!(!emitters.contains(&lights[1].emitter) && !emitters.contains(&lights[0].emitter));
    }
}
