//! Intermediate stages of a phenomenon, where its kind has some: plans of small pictures that show each stage alone, in the middle.

use std::sync::Arc;

use bansho::{
    Assets, CompiledScene, KINDS, Plan, PlanOptions, SceneOptions,
    base::{
        camera::CameraParameters,
        color::ev100_of_white_luminance,
        math,
        parameters::{Auto, Kind, Table, Value},
    },
    scene::{
        Instance, PlateParameters, Scene, SharedTables, ValuePath,
        operation::{self, Operation},
        parse_values,
    },
};

use super::{
    PhenomenonId, PlannedScene, descriptors,
    editor_hints::{StageView, editor_hints},
};

/// Size of a stage's picture, pixels.
const SIZE: [usize; 2] = [112, 112];

/// Vertical field of view, degrees. It is narrow, since flat pictures are shown.
const VERTICAL_FOV_DEG: f64 = 20.0;

/// Height of the picture as a multiple of the height of what it shows.
const MARGIN_FACTOR: f64 = 1.08;

/// The names of the stages of `kind` in a scene, in order, without the finished phenomenon. Empty where the kind has no stages.
pub fn names(kind: &str) -> Vec<&'static str> {
    let Some(stages) = editor_hints(kind).stages else { return Vec::new() };
    let parameter = descriptors::descriptor(&ValuePath::root().key(kind).key(stages.key));
    let Some((Kind::Choice(choices), default)) = parameter.map(|own| (&own.kind, &own.default)) else {
        return Vec::new();
    };
    let names = choices.iter().map(|choice| choice.name);
    names.filter(|name| !matches!(default, Some(Value::Text(default)) if default == name)).collect()
}

/// Plans of the stages of `phenomenon` in the scene `text`; `None` where the scene has errors or no such phenomenon.
pub fn plans(name: &str, text: &str, assets: &Arc<dyn Assets>, phenomenon: PhenomenonId) -> Option<Vec<PlannedScene>> {
    let root = parse_values(text).ok()?;
    let mut plans = Vec::new();
    for stage in names(phenomenon.kind) {
        let scene = stage_scene(name, &stage_text(text, &root, phenomenon, stage)?, phenomenon)?;
        let compiled = Arc::new(CompiledScene::build(Arc::new(scene), assets.clone(), None).ok()?);
        let plan = Plan::new(&compiled, &PlanOptions { size: Some(SIZE), ..PlanOptions::default() }).ok()?;
        plans.push(PlannedScene { compiled, plan: Arc::new(plan) });
    }
    Some(plans)
}

/// The scene `text` with `phenomenon` at the origin, once, at `stage`.
fn stage_text(text: &str, root: &Table, phenomenon: PhenomenonId, stage: &str) -> Option<String> {
    let hints = editor_hints(phenomenon.kind);
    let path = phenomenon.path();
    let stage = Value::Text(stage.to_owned());
    let mut operations = vec![Operation::Set { path: path.key(hints.stages?.key), value: stage }];
    if let Some(handles) = hints.position_handles {
        operations.push(Operation::Set { path: path.key(handles.key), value: Value::numbers([0.0; 3]) });
        let items = Some(path.key(handles.items)).filter(|items| items.find(root).is_some());
        operations.extend(items.map(|path| Operation::Remove { path }));
    }
    operation::apply(text, &operations).ok()
}

/// The scene `text` with `phenomenon` alone, in front of a camera that shows all of it.
fn stage_scene(name: &str, text: &str, phenomenon: PhenomenonId) -> Option<Scene> {
    let scene = Scene::parse(name, text, KINDS).ok()?;
    let mut of_kind = scene.instances.iter().filter(|instance| instance.kind.key == phenomenon.kind);
    let alone = Instance { enabled: true, ..of_kind.nth(phenomenon.index)?.clone() };
    let view = editor_hints(phenomenon.kind).stages?.view;
    let StageView { size_m, white_luminance } = view(alone.parameters.as_ref())?;
    let mut picture = scene.picture.clone();
    picture.exposure_ev100 = white_luminance.map_or(Auto::Auto, |white| Auto::Set(ev100_of_white_luminance(white)));
    let scene = Scene {
        picture,
        camera: camera(size_m),
        plate: PlateParameters::default(),
        tables: SharedTables::default(),
        instances: vec![alone],
        ..scene
    };
    scene.with_options(&SceneOptions::default()).ok()
}

/// A camera that shows a rectangle of `width` x `height` m that stands at the origin.
fn camera([width, height]: [f64; 2]) -> CameraParameters {
    let [columns, rows] = SIZE.map(|side| side as f64);
    let visible_height = MARGIN_FACTOR * height.max(width * rows / columns);
    let distance = 0.5 * visible_height / math::tan(0.5 * VERTICAL_FOV_DEG.to_radians());
    CameraParameters {
        position: [0.0, 0.5 * height, distance].into(),
        target: [0.0, 0.5 * height, 0.0].into(),
        vertical_fov_deg: VERTICAL_FOV_DEG.into(),
        ..CameraParameters::default()
    }
}

#[cfg(test)]
mod tests {
    use bansho::MemoryAssets;

    use super::*;

    #[test]
    fn each_stage_shows_that_sheet_alone() {
        let assets: Arc<dyn Assets> = Arc::new(MemoryAssets::default());
        let text = "bansho = 2\n[[rain]]\n[[flame_sheet]]\n[[flame_sheet]]\nname = \"second\"\nenabled = false\nheight = 3.0\n";
        let sheet = |index: usize| PhenomenonId { kind: "flame_sheet", index };
        let plans = plans("scene", text, &assets, sheet(1)).unwrap();
        assert_eq!(names("flame_sheet"), ["texture", "thresholded", "sharpened", "colored"]);
        assert!(names("rain").is_empty() && names("camera").is_empty());
        assert_eq!(plans.len(), 4);
        for PlannedScene { plan, .. } in &plans {
            let names: Vec<&str> = plan.scene().instances.iter().map(|instance| instance.name.as_str()).collect();
            assert_eq!((names, plan.size()), (vec!["second"], SIZE));
            assert_eq!(plan.scene().camera.target.at(0.0), [0.0, 1.5, 0.0]);
        }
        assert!(super::plans("scene", text, &assets, sheet(2)).is_none());
        assert!(super::plans("scene", "bansho = 2\n[[flame_shet]]\n", &assets, sheet(0)).is_none());
    }
}
