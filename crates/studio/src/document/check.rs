//! From text to a plan, with every fault at its line.

use std::sync::Arc;

use bansho::{
    Assets, Plan, PlanError, PlanOptions, SceneError,
    base::parameters::{Problem, ProblemKind},
    parse_scene,
};

/// The plan of the scene `text`. Makes every phenomenon once, which may take a while.
///
/// # Errors
/// Every fault of the text and of the assets it names.
pub fn check(name: &str, text: &str, assets: &Arc<dyn Assets>) -> Result<Arc<Plan>, SceneError> {
    let scene = parse_scene(name, text, assets.as_ref())?;
    match Plan::new(scene, &PlanOptions::default(), assets.clone()) {
        Ok(plan) => Ok(Arc::new(plan)),
        Err(error) => {
            Err(SceneError { file: name.to_owned(), text: text.to_owned(), problems: vec![unplaced(&error)] })
        }
    }
}

/// A fault that only planning shows, which lies in no one line.
fn unplaced(error: &PlanError) -> Problem {
    Problem { span: None, path: String::new(), kind: ProblemKind::Conflict(error.to_string()) }
}
