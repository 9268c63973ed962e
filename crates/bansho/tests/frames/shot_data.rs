//! What a shot gives besides pictures: lights and particles of its phenomena.

use std::sync::Arc;

use bansho::{
    MemoryAssets, Plan, PlanOptions, Shot, Unobserved,
    base::{
        geometry::point_cloud::{PointCloud, Quantity},
        phenomenon::surroundings::{Emitter, Light},
    },
    compile_scene,
};

const SCENE: &str = "\
bansho = 2
[picture]
size = [64, 36]
seed = 4
[[flame_sheet]]
name = \"torch\"
position = [1.0, 0.5, 0.0]
[[flame_particles]]
name = \"fire\"
particles = 120
preroll_s = 0.5
[[rain]]
[[light]]
position = [0.0, 3.0, 0.0]
";

fn shot(text: &str) -> Shot {
    let compiled = compile_scene("data", text, Arc::new(MemoryAssets::default())).unwrap();
    let plan = Plan::new(&compiled, &PlanOptions::default()).unwrap();
    Shot::open(compiled, Arc::new(plan))
}

#[test]
fn lights_are_those_that_phenomena_publish() {
    let mut shot = shot(SCENE);
    let mut previous = Vec::new();
    for number in [3, 4] {
        shot.advance(number, &Unobserved).unwrap();
        let lights = shot.lights();
        let of = |name: &str| -> Vec<Light> {
            lights.iter().filter(|each| each.phenomenon == name).map(|each| each.light).collect()
        };
        // By default two points for a sheet, three for particles; lamps and rain are not among them.
        assert_eq!((of("torch").len(), of("fire").len(), lights.len()), (2, 3, 5));
        for light in of("torch") {
            let Emitter::Point { position, .. } = light.emitter else { panic!("{light:?}") };
            assert!((position.x - 1.0).abs() < 0.2 && position.y > 0.4, "{position}");
            assert!(light.luminous_intensity().unwrap() > 0.1 && light.srgb().color[0] == 1.0);
        }
        assert_ne!(lights, previous, "flames flicker");
        // They do not depend on what was drawn.
        shot.draw(&bansho::SceneLinear, &Unobserved).unwrap();
        assert_eq!(shot.lights(), lights);
        previous = lights;
    }
}

#[test]
fn particles_come_phenomenon_by_phenomenon_with_their_quantities() {
    let mut shot = shot(SCENE);
    shot.advance(2, &Unobserved).unwrap();
    let clouds = shot.point_clouds();
    let names: Vec<&str> = clouds.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["fire", "rain"]);
    let [(_, gas), (_, drops)] = &clouds[..] else { unreachable!() };
    let quantities = |cloud: &PointCloud| cloud.quantities.keys().copied().collect::<Vec<_>>();
    assert_eq!(quantities(gas), [Quantity::Temperature, Quantity::Density]);
    assert_eq!(quantities(drops), [Quantity::DiameterMm, Quantity::Opacity]);
    assert!(gas.len() > 20 && drops.len() > 100, "{} {}", gas.len(), drops.len());
    let all = shot.particles();
    assert_eq!(all.len(), gas.len() + drops.len());
    assert_eq!(
        quantities(&all),
        Quantity::ALL.into_iter().filter(|q| all.quantities.contains_key(q)).collect::<Vec<_>>()
    );
    assert!(all.quantities.values().all(|values| values.len() == all.len()));
    assert!(all.quantities[&Quantity::Temperature][..gas.len()].iter().all(|kelvin| *kelvin > 250.0));
    assert!(all.quantities[&Quantity::Temperature][gas.len()..].iter().all(|kelvin| *kelvin == 0.0));
    assert!(all.quantities[&Quantity::DiameterMm][gas.len()..].iter().all(|diameter| (0.9..2.1).contains(diameter)));
    assert_eq!(shot.point_clouds(), clouds);
}

#[test]
fn a_scene_without_particles_or_flames_has_none() {
    let mut shot = shot("bansho = 2\n[picture]\nsize = [16, 9]\n[[flame_sheet]]\n");
    shot.advance(0, &Unobserved).unwrap();
    assert!(shot.point_clouds().is_empty() && shot.particles().is_empty());
    let mut dark = self::shot("bansho = 2\n[picture]\nsize = [16, 9]\n[[rain]]\n[[light]]\n");
    dark.advance(0, &Unobserved).unwrap();
    assert!(dark.lights().is_empty());
}

#[test]
fn particles_far_from_the_origin_stay_apart() {
    let at = |x: f64, z: f64| {
        format!(
            "bansho = 2\n[picture]\nsize = [64, 36]\n[camera]\nposition = [{x:.1}, 1.6, {:.1}]\ntarget = [{x:.1}, 1.0, {z:.1}]\n\
             [[flame_particles]]\nposition = [{x:.1}, 0.0, {z:.1}]\nparticles = 400\npreroll_s = 0.5\n[[rain]]\nmethod = \"drops\"\n",
            z + 4.0
        )
    };
    let [near, far] = [at(0.0, 0.0), at(500_000.0, 400_300.0)].map(|text| {
        let mut shot = shot(&text);
        let clouds = [1, 2].map(|number| {
            shot.advance(number, &Unobserved).unwrap();
            shot.point_clouds().into_iter().map(|(_, cloud)| cloud).collect::<Vec<_>>()
        });
        assert_eq!(clouds[0][0].origin, clouds[1][1].origin, "one origin for the shot");
        clouds[1].clone()
    });
    assert_eq!((near[0].origin, far[0].origin), ([0.0; 3], [500_000.0, 0.0, 400_000.0]));
    // The gas is the same; drops fall elsewhere.
    for (a, b) in near[0].positions.iter().zip(&far[0].positions) {
        let moved = [b[0] - a[0], b[1] - a[1], b[2] - a[2] - 300.0];
        assert!(moved.iter().all(|meters| meters.abs() < 1e-4), "{moved:?}");
    }
    let mut columns: Vec<u32> = far[1].positions.iter().map(|position| position[0].to_bits()).collect();
    columns.sort_unstable();
    columns.dedup();
    assert!(columns.len() * 10 > far[1].len() * 9, "{} places of {} drops", columns.len(), far[1].len());
}
