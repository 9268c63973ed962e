//! A table of a program that all phenomena share: it needs no more than its kind in the registry.

use std::sync::Arc;

use bansho::{
    CompiledScene, KINDS, MemoryAssets, Plan, PlanOptions, Shot, Unobserved,
    base::{
        math::DVec3,
        parameters::{BuildError, ProblemKind, Range, animated::Animated},
        phenomenon::surroundings::{Emitter, Light},
        tables::{SharedRole, SharedTable, TableCount, TableKind},
    },
    scene::{Scene, SceneOptions, edit, template},
};

bansho::base::parameters! {
    /// A light at the top of a pole.
    pub struct BeaconParameters {
        /// Height of the pole.
        height: f64 = 3.0, limits(Range::new(0.0, 100.0)), unit("m");
        /// Intensity of its light.
        intensity: Animated<f64> = Animated::from(500.0), limits(Range::new(0.0, 1e9)), unit("cd");
    }
}

const BEACON: TableKind =
    TableKind::shared::<BeaconParameters>("beacon", TableCount::Optional, SharedRole::new::<BeaconParameters>());

impl SharedTable for BeaconParameters {
    fn kind(&self) -> TableKind {
        BEACON
    }

    fn conflicts(&self, is_stated: &dyn Fn(&str) -> bool) -> Vec<BuildError> {
        let is_buried = self.height == 0.0 && is_stated("intensity");
        let kind = ProblemKind::Conflict("is of a beacon without a pole; allowed: a `height` above 0".into());
        is_buried.then(|| BuildError { key: "intensity".into(), kind }).into_iter().collect()
    }

    fn light(&self, t: f64) -> Option<Light> {
        let emitter = Emitter::Point { position: DVec3::new(0.0, self.height, -2.0), radius: 0.05 };
        Some(Light { emitter, intensity: [self.intensity.at(t) as f32; 3] })
    }
}

fn kinds() -> Vec<TableKind> {
    KINDS.iter().copied().chain([BEACON]).collect()
}

fn parse(text: &str) -> Result<Scene, String> {
    Scene::parse("scene.toml", &format!("bansho = 2\n{text}"), &kinds()).map_err(|error| error.to_string())
}

fn compiled(text: &str) -> Arc<CompiledScene> {
    let scene = Arc::new(parse(text).unwrap());
    Arc::new(CompiledScene::build(scene, Arc::new(MemoryAssets::default()), None).unwrap())
}

#[test]
fn faults_of_a_programs_table_have_positions() {
    let fault = |text: &str| parse(text).err().unwrap();
    assert!(fault("[beacon]\nheight = 200\n").contains("scene.toml:3:10: beacon.height: 200 is out of range"));
    assert!(fault("[beacon]\nheigth = 2\n").contains("did you mean `height`?"));
    assert!(fault("[[beacon]]\n").contains("expected a table [beacon]"));
    assert!(
        fault("[beacon]\nheight = 0\nintensity = 2\n").contains("scene.toml:4:13: beacon.intensity: is of a beacon")
    );
    assert!(fault("[[rain]]\nintensity = 2\n[becon]\n").contains("did you mean `beacon`?"));
    let unregistered = Scene::parse("scene.toml", "bansho = 2\n[beacon]\n", KINDS).err().unwrap().to_string();
    assert!(unregistered.contains("unknown key `beacon`"), "{unregistered}");
}

#[test]
fn a_programs_table_is_changed_like_any_other_and_must_close_loops() {
    let text = edit::set("bansho = 2\n[[rain]]\n", "beacon.height=5", &kinds()).unwrap();
    let scene = Scene::parse("scene.toml", &text, &kinds()).unwrap();
    assert_eq!(scene.tables.get::<BeaconParameters>().map(|beacon| beacon.height), Some(5.0));
    assert!(!template::short(&KINDS[KINDS.len() - 1], &kinds()).contains("beacon"), "it is optional");
    let jumping = parse("[beacon]\nintensity = { keys = [[0, 1], [1, 2]] }\n").unwrap();
    let options = SceneOptions { loop_s: Some(1.0), ..SceneOptions::default() };
    let error = jumping.with_options(&options).err().unwrap().to_string();
    assert!(error.contains("beacon.intensity differs between its beginning and its end"), "{error}");
}

#[test]
fn a_programs_table_lights_phenomena_and_is_in_fingerprints() {
    let rain = "[picture]\nsize = [32, 18]\nexposure_ev100 = 0\n[sky]\nluminance = 0.0\n[[rain]]\n";
    let luminance = |text: &str| {
        let compiled = compiled(text);
        let plan = Arc::new(Plan::new(&compiled, &PlanOptions::default()).unwrap());
        let frame = bansho::draw(&mut Shot::open(compiled, plan), 0, &Unobserved).unwrap();
        frame.beauty.pixels().iter().map(|pixel| pixel[1]).sum::<f32>()
    };
    let (dark, lit) = (luminance(rain), luminance(&format!("{rain}[beacon]\n")));
    assert!(lit > 10.0 * dark + 1e-3, "{dark} without the beacon, {lit} with it");
    let state = |text: &str| compiled(text).state_fingerprint();
    let heights = [3.0, 4.0].map(|height| state(&format!("{rain}[beacon]\nheight = {height}\n")));
    assert!(heights[0] != heights[1] && !heights.contains(&state(rain)));
}
