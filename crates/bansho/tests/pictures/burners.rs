//! Burners that need a file: gas from the surface of a glTF mesh.

use std::sync::Arc;

use bansho::{
    base::{
        host::assets::MemoryAssets,
        parameters::{AssetPath, Auto},
        phenomenon::{Phenomenon, Stepped, surroundings::Surroundings},
        world::{
            air::Air,
            wind::{Wind, WindParameters},
        },
    },
    fire::particles::{BurnerParameters, BurnerShape, FlameParticles, FlameParticlesParameters, FlameParticlesRun},
    media::{gltf::decode_mesh, limits::MemoryLimit},
};

/// Middles of three right triangles on the ground, 10 m apart, and their legs: areas of 4.5, 0.5 and 0.125 m^2.
const TRIANGLES: [(f32, f32); 3] = [(0.0, 3.0), (10.0, 1.0), (20.0, 0.5)];

/// A binary glTF of the triangles, facing up.
fn glb() -> Vec<u8> {
    let corners = TRIANGLES.iter().flat_map(|(x, leg)| [[*x, 0.0, 0.0], [*x, 0.0, *leg], [x + leg, 0.0, 0.0]]);
    let positions: Vec<u8> = corners.flatten().flat_map(f32::to_le_bytes).collect();
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":9,"type":"VEC3","min":[0,0,0],"max":[21,0,3]}}],
        "bufferViews":[{{"buffer":0,"byteLength":{0}}}],"buffers":[{{"byteLength":{0}}}]}}"#,
        positions.len()
    );
    let json = format!("{json:<width$}", width = json.len().next_multiple_of(4));
    let mut file = b"glTF\x02\0\0\0".to_vec();
    file.extend(((28 + json.len() + positions.len()) as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", json.as_bytes()), (b"BIN\0", &positions)] {
        file.extend((chunk.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(chunk);
    }
    file
}

#[test]
fn gas_comes_evenly_from_the_whole_surface_of_a_gltf_mesh() {
    let mut assets = MemoryAssets::default();
    let mesh = decode_mesh(
        &glb(),
        "glb",
        &|_, _| Err(bansho::base::host::assets::AssetProblem::Missing),
        MemoryLimit::default(),
    )
    .unwrap();
    assets.insert_mesh("mesh.glb", mesh);
    let burner = BurnerParameters {
        shape: BurnerShape::Mesh,
        file: Some(AssetPath("mesh.glb".into())),
        speed: Auto::Set(0.2),
        ..Default::default()
    };
    let parameters = FlameParticlesParameters { burners: vec![burner], particles: 60_000, ..Default::default() };
    let flame = FlameParticles::new(parameters, "mesh", 1, None, &assets).unwrap();
    let (wind, air) = (Wind::new(WindParameters::default(), 1, None), Air::default());
    let around = Surroundings { air: &air, ..Surroundings::from_wind(&wind) };
    let stepping = flame.info().stepping.unwrap();
    let mut run = FlameParticlesRun::new(Arc::new(flame));
    (0..6).for_each(|taken| run.step(stepping.time_after(taken), &around));
    let [x, y, z] = run.particles().positions();
    assert!(x.len() > 1500, "{}", x.len());
    let area = |leg: f32| 0.5 * f64::from(leg) * f64::from(leg);
    let whole: f64 = TRIANGLES.iter().map(|(_, leg)| area(*leg)).sum();
    for (start, leg) in TRIANGLES {
        // A twentieth of a second carries gas some centimeters.
        let on_it: Vec<usize> = (0..x.len()).filter(|index| (x[*index] - start).abs() < 5.0).collect();
        let expected = x.len() as f64 * area(leg) / whole;
        let off = (on_it.len() as f64 - expected).abs();
        assert!(off < 4.0 * expected.sqrt() + 1.0, "{} on {} m^2, expected {expected}", on_it.len(), area(leg));
        // The middle of the triangle is a third of the way along both legs.
        let mean = |values: &[f32], from: f32| {
            on_it.iter().map(|index| f64::from(values[*index] - from)).sum::<f64>() / on_it.len() as f64
        };
        let allowed = 0.02 + f64::from(leg) / (on_it.len() as f64).sqrt();
        for middle in [mean(x, start), mean(z, 0.0)] {
            assert!((middle - f64::from(leg) / 3.0).abs() < allowed, "{middle} of {leg} m");
        }
        assert!(mean(y, 0.0) > 0.0, "it rises");
    }
}
