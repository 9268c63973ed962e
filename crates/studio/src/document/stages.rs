//! How a flame sheet comes to be, stage by stage: plans of small pictures that show it alone, in the middle.

use std::sync::Arc;

use bansho::{
    Assets, CompiledScene, KINDS, Plan, PlanOptions, SceneOptions,
    base::{
        camera::CameraParameters,
        color::ev100_of_white_luminance,
        parameters::{Auto, Parameters, Reader, Table, Value},
        phenomenon::kind::Describe,
    },
    fire::sheet::{FlameSheetParameters, Stage},
    scene::{
        Instance, PlateParameters, Scene, ValuePath,
        operation::{self, Operation},
        parse_values,
    },
};

use super::PlannedScene;

/// Size of a stage's picture, pixels.
const SIZE: [usize; 2] = [112, 112];

/// Vertical field of view, degrees: narrow, for a flat square is shown.
const FIELD: f64 = 20.0;

/// Height of the picture, as a share of the sheet's.
const AROUND: f64 = 1.08;

/// What the stages are called in a scene, in their order; the finished flame is none of them.
pub fn names() -> impl Iterator<Item = &'static str> {
    Stage::CHOICES.iter().map(|choice| choice.name).filter(|name| *name != Stage::Flame.name())
}

/// Plans of the stages of flame sheet `index` of the scene `text`; `None` where it is faulty or has no such sheet.
pub fn plans(name: &str, text: &str, assets: &Arc<dyn Assets>, index: usize) -> Option<Vec<PlannedScene>> {
    let root = parse_values(text).ok()?;
    names().map(|stage| plan(name, [text, stage], &root, assets, index)).collect()
}

fn plan(
    name: &str,
    [text, stage]: [&str; 2],
    root: &Table,
    assets: &Arc<dyn Assets>,
    index: usize,
) -> Option<PlannedScene> {
    let place = ValuePath::root().key(FlameSheetParameters::KEY).index(index);
    let Value::Table(table) = &place.find(root)?.value else { return None };
    let sheet = FlameSheetParameters::read_table(table, &mut Reader::new(), &[]);
    let stated = |key: &str| place.key(key).find(root).is_some();
    let mut operations = vec![
        Operation::Set { path: place.key("stage"), value: Value::Text(stage.to_owned()) },
        Operation::Set { path: place.key("position"), value: Value::numbers([0.0; 3]) },
    ];
    operations.extend(stated("instances").then(|| Operation::Remove { path: place.key("instances") }));
    let scene = Scene::parse(name, &operation::apply(text, &operations).ok()?, KINDS).ok()?;
    let mut sheets = scene.instances.iter().filter(|instance| instance.kind.key == FlameSheetParameters::KEY);
    let alone = Instance { enabled: true, ..sheets.nth(index)?.clone() };
    let mut picture = scene.picture.clone();
    // Grays are shares of the full luminance.
    let full = sheet.color.luminance.bounds()[1].max(f64::MIN_POSITIVE);
    let colored = stage == Stage::Colored.name();
    picture.exposure_ev100 = if colored { Auto::Auto } else { Auto::Set(ev100_of_white_luminance(full)) };
    let scene = Scene {
        picture,
        camera: camera(sheet.width, sheet.height),
        plate: PlateParameters::default(),
        sky: None,
        ground: None,
        lights: Vec::new(),
        obstacles: Vec::new(),
        instances: vec![alone],
        ..scene
    };
    let options = PlanOptions { size: Some(SIZE), ..PlanOptions::default() };
    let scene = scene.with_options(&SceneOptions::default()).ok()?;
    let compiled = Arc::new(CompiledScene::build(Arc::new(scene), assets.clone(), None).ok()?);
    let plan = Arc::new(Plan::new(&compiled, &options).ok()?);
    Some(PlannedScene { compiled, plan })
}

/// A camera before a sheet at the origin that sees all of it.
fn camera(width: f64, height: f64) -> CameraParameters {
    let [across, up] = SIZE.map(|side| side as f64);
    let seen = AROUND * height.max(width * up / across);
    let away = 0.5 * seen / bansho::base::math::tan(0.5 * FIELD.to_radians());
    CameraParameters {
        position: [0.0, 0.5 * height, away].into(),
        target: [0.0, 0.5 * height, 0.0].into(),
        vertical_fov_deg: FIELD.into(),
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
        let plans = plans("scene", text, &assets, 1).unwrap();
        assert_eq!(names().collect::<Vec<_>>(), ["texture", "thresholded", "sharpened", "colored"]);
        assert_eq!(plans.len(), 4);
        for PlannedScene { plan, .. } in &plans {
            let names: Vec<&str> = plan.scene().instances.iter().map(|instance| instance.name.as_str()).collect();
            assert_eq!((names, plan.size()), (vec!["second"], SIZE));
            assert_eq!(plan.scene().camera.target.at(0.0), [0.0, 1.5, 0.0]);
        }
        assert!(super::plans("scene", text, &assets, 2).is_none());
        assert!(super::plans("scene", "bansho = 2\n[[flame_shet]]\n", &assets, 0).is_none());
    }
}
