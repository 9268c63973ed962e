//! Checks the text of a scene: parses, builds and plans it, and locates its problems in the text.

use std::sync::Arc;

use bansho::{
    Assets, CompiledScene, GlareUse, KINDS, Plan, PlanOptions, SceneError, SceneOptions,
    base::{
        host::assets::{AssetError, AssetProblem},
        parameters::{Problem, ProblemKind, Span, Table, Value},
    },
    scene::{
        Scene, ValuePath,
        operation::{self, Operation},
        parse_values,
    },
};

use super::{descriptors, editor_hints::editor_hints};

/// The scene with the default options of `bansho render`.
fn parse(name: &str, text: &str) -> Result<Arc<Scene>, SceneError> {
    let options = SceneOptions { implied_backdrop: true, ..SceneOptions::default() };
    let scene = Scene::parse(name, text, KINDS)?.with_options(&options);
    scene.map(Arc::new).map_err(|error| error_without_span(name, text, error.to_string()))
}

/// A valid scene, built and planned.
#[derive(Clone)]
pub struct PlannedScene {
    /// The built scene.
    pub compiled: Arc<CompiledScene>,
    /// Size, frames, camera and exposure.
    pub plan: Arc<Plan>,
}

/// Builds and plans the scene `text`, which may take seconds.
///
/// # Errors
/// All problems of the text and of the assets that it names.
pub fn check(name: &str, text: &str, assets: &Arc<dyn Assets>) -> Result<PlannedScene, SceneError> {
    Checker::default().check(name, text, assets)
}

/// Checks successive revisions of a scene. Each check builds only what changed since the one before.
#[derive(Default)]
pub struct Checker {
    /// The last valid scene.
    last_scene: Option<Arc<CompiledScene>>,
    /// The last valid draft.
    last_draft: Option<Arc<CompiledScene>>,
}

/// Pictures of the studio look like those that `bansho render` writes for display.
fn plan_options() -> PlanOptions {
    PlanOptions { glare: GlareUse::Always, ..PlanOptions::default() }
}

impl Checker {
    /// Builds and plans the scene `text`.
    ///
    /// # Errors
    /// All problems of the text and of the assets that it names.
    pub fn check(&mut self, name: &str, text: &str, assets: &Arc<dyn Assets>) -> Result<PlannedScene, SceneError> {
        let compiled = build(name, text, assets, &mut self.last_scene)?;
        let plan = Plan::new(&compiled, &plan_options());
        let plan = plan.map(Arc::new).map_err(|error| error_without_span(name, text, error.to_string()))?;
        Ok(PlannedScene { compiled, plan })
    }

    /// A draft of the scene `text`: the same scene with parameters lowered to the draft limits of their kinds, so that it is faster to
    /// simulate. `None` where no parameter is above its limit.
    ///
    /// # Errors
    /// As [`check`](Self::check); the problems are those of the scene itself.
    pub fn check_draft(
        &mut self,
        name: &str,
        text: &str,
        assets: &Arc<dyn Assets>,
    ) -> Option<Result<PlannedScene, SceneError>> {
        let operations = draft_operations(&parse_values(text).ok()?);
        let draft = operation::apply(text, &operations).ok().filter(|_| !operations.is_empty())?;
        let full = self.check(name, text, assets);
        Some(full.and_then(|full| {
            let compiled = build(name, &draft, assets, &mut self.last_draft)?;
            // With the exposure of the full scene, so that fewer particles do not look brighter.
            let plan = Plan::with_exposure_and_loop_start(
                compiled.scene().clone(),
                &plan_options(),
                full.plan.exposure_ev100,
                0,
            );
            let plan = plan.map(Arc::new).map_err(|error| error_without_span(name, text, error.to_string()))?;
            Ok(PlannedScene { compiled, plan })
        }))
    }
}

/// Builds the scene `text` and reuses what it has in common with `last`, which it then replaces.
fn build(
    name: &str,
    text: &str,
    assets: &Arc<dyn Assets>,
    last: &mut Option<Arc<CompiledScene>>,
) -> Result<Arc<CompiledScene>, SceneError> {
    let scene = parse(name, text)?;
    let compiled = CompiledScene::build(scene, assets.clone(), last.as_deref());
    let compiled = Arc::new(compiled.map_err(|errors| errors.located(name, text))?);
    *last = Some(compiled.clone());
    Ok(compiled)
}

/// The result of a [`check`] in a web worker, as it is sent to the page: the exposure, or the problems.
pub type CheckReport = Result<f32, Vec<ReportedProblem>>;

/// A problem that a check in another process found, as text.
#[derive(Clone, Debug, PartialEq)]
pub struct ReportedProblem {
    /// The byte range in the text, if the problem has one.
    pub span: Option<Span>,
    /// The parameter.
    pub path: String,
    /// What is wrong.
    pub reason: String,
    /// The asset that cannot be loaded, if that is the problem.
    pub asset: Option<String>,
}

impl From<&Problem> for ReportedProblem {
    fn from(problem: &Problem) -> Self {
        let Problem { span, path, kind } = problem;
        let (asset, reason) = match kind {
            ProblemKind::Asset(error) => (Some(error.path.clone()), error.problem.to_string()),
            kind => (None, kind.to_string()),
        };
        Self { span: span.clone(), path: path.clone(), reason, asset }
    }
}

impl From<ReportedProblem> for Problem {
    fn from(reported: ReportedProblem) -> Self {
        let ReportedProblem { span, path, reason, asset } = reported;
        let kind = match asset {
            Some(path) => ProblemKind::Asset(AssetError { path, problem: AssetProblem::Reported(reason) }),
            None => ProblemKind::Conflict(reason),
        };
        Self { span, path, kind }
    }
}

/// The plan of the scene `text` after a check in another process. Nothing is built, so that it takes milliseconds.
///
/// # Errors
/// All problems of the text, or the reported ones.
pub fn plan_from_report(name: &str, text: &str, report: CheckReport) -> Result<Arc<Plan>, SceneError> {
    let scene = parse(name, text)?;
    match report {
        Ok(ev100) => {
            let plan = Plan::with_exposure_and_loop_start(scene, &plan_options(), ev100, 0);
            plan.map(Arc::new).map_err(|error| error_without_span(name, text, error.to_string()))
        }
        Err(problems) => {
            let problems = problems.into_iter().map(Problem::from).collect();
            Err(SceneError { file: name.to_owned(), text: text.to_owned(), problems, omitted: 0 })
        }
    }
}

/// The operations that lower the parameters of the scene `root` to the limits of a draft. Empty where none is above its limit.
fn draft_operations(root: &Table) -> Vec<Operation> {
    let mut operations = Vec::new();
    for kind in KINDS {
        let Some(Value::List(all)) = root.get(kind.key).map(|node| &node.value) else { continue };
        for index in 0..all.len() {
            for limit in editor_hints(kind.key).draft_limits {
                let path = descriptors::within(&ValuePath::root().key(kind.key).index(index), limit.key);
                if effective_number(root, &path).is_some_and(|number| number > limit.max as f64) {
                    operations.push(Operation::Set { path, value: Value::Integer(limit.max) });
                }
            }
        }
    }
    operations
}

/// The number at `path` of the scene `root`, or the parameter's default.
fn effective_number(root: &Table, path: &ValuePath) -> Option<f64> {
    let stated = path.find(root).and_then(|node| node.value.as_number());
    stated.or_else(|| descriptors::descriptor(path)?.default.as_ref()?.as_number())
}

/// A problem that was found while planning and has no position in the text.
fn error_without_span(name: &str, text: &str, reason: String) -> SceneError {
    let problem = Problem { span: None, path: String::new(), kind: ProblemKind::Conflict(reason) };
    SceneError { file: name.to_owned(), text: text.to_owned(), problems: vec![problem], omitted: 0 }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use bansho::{
        MemoryAssets,
        base::{
            geometry::{mesh::Mesh, strokes::Drawing},
            host::assets::Picture,
        },
    };

    use super::*;
    use crate::scenes::examples::BundledAssets;

    fn draft(text: &str) -> Option<Result<PlannedScene, SceneError>> {
        let assets: Arc<dyn Assets> = Arc::new(MemoryAssets::default());
        Checker::default().check_draft("scene", text, &assets)
    }

    #[test]
    fn a_draft_has_fewer_particles_where_there_are_many() {
        let many = "bansho = 2\n[[aurora]]\n[[aurora]]\nparticles = { count = 500 }\n[[flame_particles]]\n";
        let operations = draft_operations(&parse_values(many).unwrap());
        let mut paths: Vec<String> = operations.iter().map(|operation| operation.path().to_string()).collect();
        paths.sort();
        assert_eq!(paths, ["aurora.0.particles.count", "flame_particles.0.particles"]);
        assert!(draft("bansho = 2\n[[flame_particles]]\n").is_some_and(|plan| plan.is_ok()));
        assert!(draft("bansho = 2\n[[rain]]\n[[flame_particles]]\nparticles = 900\n").is_none());
    }

    /// The files of the examples. It counts how often a mesh was read, which is once for each construction of a flame that burns on it.
    #[derive(Default)]
    struct CountingAssets {
        bundle: BundledAssets,
        meshes: AtomicUsize,
    }

    impl Assets for CountingAssets {
        fn picture(&self, path: &str, frame: i64) -> Result<Arc<Picture>, AssetError> {
            self.bundle.picture(path, frame)
        }
        fn mesh(&self, path: &str) -> Result<Arc<Mesh>, AssetError> {
            self.meshes.fetch_add(1, Ordering::Relaxed);
            self.bundle.mesh(path)
        }
        fn drawing(&self, path: &str) -> Result<Arc<Drawing>, AssetError> {
            self.bundle.drawing(path)
        }
        fn text(&self, path: &str) -> Result<Arc<str>, AssetError> {
            self.bundle.text(path)
        }
        fn digest(&self, path: &str, frame: i64) -> Result<[u8; 32], AssetError> {
            self.bundle.digest(path, frame)
        }
    }

    #[test]
    fn only_what_changed_is_rebuilt() {
        let burner =
            "[[flame_particles]]\nparticles = 99\nburners = [{ shape = \"mesh\", file = \"meshes/ring.glb\" }]\n";
        let counting = Arc::new(CountingAssets::default());
        let assets: Arc<dyn Assets> = counting.clone();
        let mut checker = Checker::default();
        let mut made = |rest: &str| {
            let before = counting.meshes.load(Ordering::Relaxed);
            let text = format!("bansho = 2\n{burner}{rest}");
            let plan = checker.check("scene", &text, &assets);
            let alone = check("scene", &text, &(Arc::new(BundledAssets::default()) as Arc<dyn Assets>));
            assert_eq!(plan.map(|own| own.plan.exposure_ev100).ok(), alone.map(|own| own.plan.exposure_ev100).ok());
            counting.meshes.load(Ordering::Relaxed) - before
        };
        assert_eq!(made(""), 1);
        assert_eq!(made("[wind]\nvelocity = [1.0, 0.0, 0.0]\n"), 0);
        assert_eq!(made("rendering = { heat_haze_gain = 2.0 }\n"), 1);
        assert_eq!(made("no_such_key = 1\n"), 0);
        assert_eq!(made("rendering = { heat_haze_gain = 2.0 }\n[[rain]]\n"), 0);
        assert_eq!(made("rendering = { heat_haze_gain = 2.0 }\n[picture]\nseed = 4\n"), 1);
    }

    #[test]
    fn problems_of_a_draft_are_those_of_the_scene() {
        let text = "bansho = 2\n[[flame_particles]]\nparticles = 9000\nno_such_key = 1\n";
        let error = draft(text).and_then(Result::err).unwrap();
        assert_eq!(error.text, text);
        assert!(error.problems[0].to_string().contains("no_such_key"));
    }

    #[test]
    fn a_report_gives_the_same_plan_as_the_check() {
        let assets: Arc<dyn Assets> = Arc::new(MemoryAssets::default());
        let text = "bansho = 2\n[picture]\nframes = 9\n[[flame_sheet]]\n";
        let first = check("scene", text, &assets).unwrap().plan;
        let again = plan_from_report("scene", text, Ok(first.exposure_ev100)).unwrap();
        assert_eq!((again.exposure_ev100, again.frames()), (first.exposure_ev100, 0..9));
        let faulty = plan_from_report("scene", "bansho = 2\n[[flame_shet]]\n", Err(Vec::new())).err().unwrap();
        assert!(faulty.to_string().contains("flame_shet"));
    }

    #[test]
    fn reported_problems_keep_their_messages_and_nothing_is_rebuilt() {
        let text = "bansho = 2\n[plate]\nimage = \"gone.png\"\n[[flame_particles]]\nburners = [{ shape = \"mesh\", file = \"meshes/ring.glb\" }]\n";
        let counting = Arc::new(CountingAssets::default());
        let assets: Arc<dyn Assets> = counting.clone();
        let error = check("scene", text, &assets).err().unwrap();
        let reported: Vec<ReportedProblem> = error.problems.iter().map(ReportedProblem::from).collect();
        let made = counting.meshes.load(Ordering::Relaxed);
        let again = plan_from_report("scene", text, Err(reported)).err().unwrap();
        assert_eq!(counting.meshes.load(Ordering::Relaxed), made);
        assert_eq!(again.to_string(), error.to_string());
        assert!(again.to_string().contains("gone.png: no such file"));
        assert!(matches!(again.problems[0].kind, ProblemKind::Asset(_)), "it can be relinked");
    }
}
