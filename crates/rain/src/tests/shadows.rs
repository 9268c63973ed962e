//! Shafts of shadow in rain.

use bansho_base::{
    image::Rect,
    math::{DQuat, DVec3},
    phenomenon::{
        strip::{DepthInterval, Strip},
        surroundings::{Emitter, Light, Occluder, Publication, Surroundings},
    },
};

use super::{METHODS, Method, draw_part, lamp, rain, view_at, wind};
use crate::RainParameters;

const SIZE: [usize; 2] = [160, 90];

fn drawn_part(method: Method, light: Light, shadow_casters: Vec<Occluder>, rect: Rect) -> Strip {
    let calm = wind([0.0; 3], 0.0);
    let others = Publication { lights: vec![light], shadow_casters, ..Publication::default() };
    let surroundings = Surroundings { others, ..Surroundings::from_wind(&calm) };
    let parameters = RainParameters { method, rate_mm_per_h: 30.0.into(), ..RainParameters::default() };
    let view = view_at(1.0, 1.0 / 60.0, SIZE);
    draw_part(&rain(parameters, 1), &view, &surroundings, rect, &DepthInterval::ALL)
}

fn drawn(method: Method, light: Light, shadow_casters: Vec<Occluder>) -> Strip {
    drawn_part(method, light, shadow_casters, Rect::from_size(SIZE[0], SIZE[1]))
}

/// A board of 1 m around a point, which faces along z.
fn board(center: [f64; 3], half_extents: [f64; 3]) -> Occluder {
    Occluder::Cuboid { center: center.into(), half_extents: half_extents.into(), rotation: DQuat::IDENTITY }
}

const ALONG_Z: [f64; 3] = [0.5, 0.5, 0.02];

#[test]
fn solids_that_no_light_meets_change_no_pixel() {
    let emitter =
        Emitter::Spot { position: DVec3::new(0.5, 3.0, -4.0), axis: DVec3::NEG_Y, cos_inner: 0.9, cos_outer: 0.8 };
    let spot = Light { emitter, intensity: [500.0; 3] };
    for method in METHODS {
        let [without, with] =
            [vec![], vec![board([0.5, 4.0, -4.0], ALONG_Z)]].map(|casters| drawn(method, spot, casters));
        assert_eq!(without.radiance, with.radiance, "{method:?}");
    }
}

#[test]
fn textures_of_the_paper_are_lit_without_shadows() {
    let [without, with] = [vec![], vec![board([0.5, 2.0, -3.0], ALONG_Z)]]
        .map(|casters| drawn(Method::Textures, lamp([0.5, 2.0, -4.0], 500.0), casters));
    assert!(without.radiance == with.radiance && without.radiance[0].iter().any(|value| *value > 0.0));
}

#[test]
fn shadows_are_the_same_on_any_number_of_threads_and_in_every_crop() {
    let casters = vec![board([0.2, 2.0, -3.5], ALONG_Z), board([-0.6, 1.5, -4.0], ALONG_Z)];
    let light = lamp([0.5, 2.0, -4.5], 500.0);
    for method in METHODS {
        let whole = drawn(method, light, casters.clone());
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        assert_eq!(pool.install(|| drawn(method, light, casters.clone())).radiance, whole.radiance);
        let rect = Rect { x: 37, y: 21, width: 61, height: 30 };
        let part = drawn_part(method, light, casters.clone(), rect);
        let is_same = (0..part.len()).all(|index| {
            let in_whole = (rect.y + index / rect.width) * SIZE[0] + rect.x + index % rect.width;
            part.radiance[1][index] == whole.radiance[1][in_whole]
        });
        assert!(is_same, "{method:?}");
        assert!(whole.radiance != drawn(method, light, vec![]).radiance, "{method:?}");
    }
}
