//! From text to a plan, with every fault at its line.

use std::sync::Arc;

use bansho::{
    Assets, CompiledScene, KINDS, Plan, PlanOptions, SceneError, SceneOptions,
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

/// The scene as `bansho render` draws it unless it is told otherwise.
fn parse(name: &str, text: &str) -> Result<Arc<Scene>, SceneError> {
    let options = SceneOptions { implied_backdrop: true, ..SceneOptions::default() };
    let scene = Scene::parse(name, text, KINDS)?.with_options(&options);
    scene.map(Arc::new).map_err(|error| unplaced(name, text, error.to_string()))
}

/// A scene without faults: built, and planned.
#[derive(Clone)]
pub struct PlannedScene {
    /// What it shows.
    pub compiled: Arc<CompiledScene>,
    /// How it is drawn.
    pub plan: Arc<Plan>,
}

/// Builds and plans the scene `text`, which may take a while.
///
/// # Errors
/// Every fault of the text and of the assets it names.
pub fn check(name: &str, text: &str, assets: &Arc<dyn Assets>) -> Result<PlannedScene, SceneError> {
    Checker::default().check(name, text, assets)
}

/// Checks the states of a scene one after another: each builds only what it changed.
#[derive(Default)]
pub struct Checker {
    /// The last good one.
    good: Option<Arc<CompiledScene>>,
    /// The last good draft.
    draft: Option<Arc<CompiledScene>>,
}

impl Checker {
    /// Builds and plans the scene `text`.
    ///
    /// # Errors
    /// Every fault of the text and of the assets it names.
    pub fn check(&mut self, name: &str, text: &str, assets: &Arc<dyn Assets>) -> Result<PlannedScene, SceneError> {
        let compiled = build(name, text, assets, &mut self.good)?;
        let plan = Plan::new(&compiled, &PlanOptions::default());
        let plan = plan.map(Arc::new).map_err(|error| unplaced(name, text, error.to_string()))?;
        Ok(PlannedScene { compiled, plan })
    }

    /// A draft of the scene `text`, which is simulated with fewer particles; `None` where no fewer would do.
    ///
    /// # Errors
    /// As [`check`](Self::check); faults are those of the scene itself.
    pub fn check_draft(
        &mut self,
        name: &str,
        text: &str,
        assets: &Arc<dyn Assets>,
    ) -> Option<Result<PlannedScene, SceneError>> {
        let fewer = fewer_particles(&parse_values(text).ok()?);
        let draft = operation::apply(text, &fewer).ok().filter(|_| !fewer.is_empty())?;
        let whole = self.check(name, text, assets);
        let planned = |whole: PlannedScene| {
            let compiled = build(name, &draft, assets, &mut self.draft)?;
            let plan = Plan::given(compiled.scene().clone(), &PlanOptions::default(), whole.plan.exposure_ev100, 0);
            let plan = plan.map(Arc::new).map_err(|error| unplaced(name, text, error.to_string()))?;
            Ok(PlannedScene { compiled, plan })
        };
        Some(whole.and_then(planned))
    }
}

/// Builds the scene `text` with what the `last` one has in common with it, in whose stead it then is.
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

/// A fault that another [`check`] found, in words.
#[derive(Clone, Debug, PartialEq)]
pub struct ReportedProblem {
    /// The bytes of the text that it is about, if it lies anywhere.
    pub span: Option<Span>,
    /// The parameter.
    pub path: String,
    /// What is wrong.
    pub reason: String,
    /// The asset that cannot be had, if that is what is wrong.
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
    fn from(found: ReportedProblem) -> Self {
        let ReportedProblem { span, path, reason, asset } = found;
        let kind = match asset {
            Some(path) => ProblemKind::Asset(AssetError { path, problem: AssetProblem::Reported(reason) }),
            None => ProblemKind::Conflict(reason),
        };
        Self { span, path, kind }
    }
}

/// The plan of the scene `text` where another [`check`] found its exposure, or its faults. Nothing is built, so that it takes a moment.
///
/// # Errors
/// Every fault of the text, or what the other check found.
pub fn recheck(name: &str, text: &str, found: Result<f32, Vec<ReportedProblem>>) -> Result<Arc<Plan>, SceneError> {
    let scene = parse(name, text)?;
    match found {
        Ok(ev100) => {
            let plan = Plan::given(scene, &PlanOptions::default(), ev100, 0);
            plan.map(Arc::new).map_err(|error| unplaced(name, text, error.to_string()))
        }
        Err(found) => {
            let problems = found.into_iter().map(Problem::from).collect();
            Err(SceneError { file: name.to_owned(), text: text.to_owned(), problems, omitted: 0 })
        }
    }
}

/// What a draft makes do with: a kind of phenomenon, the key of its number of particles, and how many.
const DRAFT: [(&str, &[&str], i64); 2] =
    [("aurora", &["particles", "count"], 24_000), ("flame_particles", &["particles"], 4_000)];

fn fewer_particles(root: &Table) -> Vec<Operation> {
    let mut operations = Vec::new();
    for (kind, keys, most) in DRAFT {
        let Some(Value::List(all)) = root.get(kind).map(|node| &node.value) else { continue };
        for index in 0..all.len() {
            let place = keys.iter().fold(ValuePath::root().key(kind).index(index), |place, key| place.key(key));
            let stated = place.find(root).and_then(|node| node.value.as_number());
            if stated.or_else(|| usual(kind, keys)).is_some_and(|count| count > most as f64) {
                operations.push(Operation::Set { path: place, value: Value::Integer(most) });
            }
        }
    }
    operations
}

/// The default of a number of `kind`.
fn usual(kind: &str, keys: &[&str]) -> Option<f64> {
    let kind = KINDS.iter().find(|own| own.key == kind)?;
    let (last, way) = keys.split_last()?;
    let table = way.iter().try_fold((kind.table)(), |table, key| {
        let parameter = table.parameters.iter().find(|parameter| parameter.key == *key)?;
        match &parameter.kind {
            bansho::base::parameters::Kind::Table(inner) => Some(inner()),
            _ => None,
        }
    })?;
    let parameter = table.parameters.iter().find(|parameter| parameter.key == *last)?;
    parameter.default.as_ref()?.as_number()
}

/// A fault that only planning shows, which lies in no one line.
fn unplaced(name: &str, text: &str, reason: String) -> SceneError {
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
    use crate::scenes::examples::Bundle;

    fn draft(text: &str) -> Option<Result<PlannedScene, SceneError>> {
        let assets: Arc<dyn Assets> = Arc::new(MemoryAssets::default());
        Checker::default().check_draft("scene", text, &assets)
    }

    #[test]
    fn a_draft_has_fewer_particles_where_there_are_many() {
        let many = "bansho = 2\n[[aurora]]\n[[aurora]]\nparticles = { count = 500 }\n[[flame_particles]]\n";
        let fewer = fewer_particles(&parse_values(many).unwrap());
        let places: Vec<String> = fewer.iter().map(|operation| operation.path().to_string()).collect();
        assert_eq!(places, ["aurora.0.particles.count", "flame_particles.0.particles"]);
        assert!(draft("bansho = 2\n[[flame_particles]]\n").is_some_and(|plan| plan.is_ok()));
        assert!(draft("bansho = 2\n[[rain]]\n[[flame_particles]]\nparticles = 900\n").is_none());
    }

    /// The files of the examples, and how often a mesh was read: each time a flame that burns on it is made.
    #[derive(Default)]
    struct Counting {
        bundle: Bundle,
        meshes: AtomicUsize,
    }

    impl Assets for Counting {
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
    fn only_what_changed_is_made_again() {
        let burner =
            "[[flame_particles]]\nparticles = 99\nburners = [{ shape = \"mesh\", file = \"meshes/ring.glb\" }]\n";
        let counting = Arc::new(Counting::default());
        let assets: Arc<dyn Assets> = counting.clone();
        let mut checker = Checker::default();
        let mut made = |rest: &str| {
            let before = counting.meshes.load(Ordering::Relaxed);
            let text = format!("bansho = 2\n{burner}{rest}");
            let plan = checker.check("scene", &text, &assets);
            let alone = check("scene", &text, &(Arc::new(Bundle::default()) as Arc<dyn Assets>));
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
    fn faults_are_those_of_the_scene_itself() {
        let text = "bansho = 2\n[[flame_particles]]\nparticles = 9000\nno_such_key = 1\n";
        let error = draft(text).and_then(Result::err).unwrap();
        assert_eq!(error.text, text);
        assert!(error.problems[0].to_string().contains("no_such_key"));
    }

    #[test]
    fn what_another_check_found_gives_the_same_plan_without_its_work() {
        let assets: Arc<dyn Assets> = Arc::new(MemoryAssets::default());
        let text = "bansho = 2\n[picture]\nframes = 9\n[[flame_sheet]]\n";
        let first = check("scene", text, &assets).unwrap().plan;
        let again = recheck("scene", text, Ok(first.exposure_ev100)).unwrap();
        assert_eq!((again.exposure_ev100, again.frames()), (first.exposure_ev100, 0..9));
        let faulty = recheck("scene", "bansho = 2\n[[flame_shet]]\n", Err(Vec::new())).err().unwrap();
        assert!(faulty.to_string().contains("flame_shet"));
    }

    #[test]
    fn faults_that_another_check_found_are_told_in_its_words_and_made_by_nobody_again() {
        let text = "bansho = 2\n[plate]\nimage = \"gone.png\"\n[[flame_particles]]\nburners = [{ shape = \"mesh\", file = \"meshes/ring.glb\" }]\n";
        let counting = Arc::new(Counting::default());
        let assets: Arc<dyn Assets> = counting.clone();
        let error = check("scene", text, &assets).err().unwrap();
        let found: Vec<ReportedProblem> = error.problems.iter().map(ReportedProblem::from).collect();
        let made = counting.meshes.load(Ordering::Relaxed);
        let told = recheck("scene", text, Err(found)).err().unwrap();
        assert_eq!(counting.meshes.load(Ordering::Relaxed), made);
        assert_eq!(told.to_string(), error.to_string());
        assert!(told.to_string().contains("gone.png: no such file"));
        assert!(matches!(told.problems[0].kind, ProblemKind::Asset(_)), "it can be relinked");
    }
}
