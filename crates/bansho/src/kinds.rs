//! The kinds of phenomena that scenes may hold: the one list of them, and the feature that brings each.

#[cfg(feature = "aurora")]
use bansho_aurora::AuroraParameters;
#[cfg(any(feature = "aurora", feature = "fire", feature = "rain"))]
use bansho_base::phenomenon::kind::Describe;
use bansho_base::{
    parameters::{Problem, ProblemKind},
    phenomenon::kind::PhenomenonKind,
};
#[cfg(feature = "fire")]
use bansho_fire::{particles::FlameParticlesParameters, sheet::FlameSheetParameters};
#[cfg(feature = "rain")]
use bansho_rain::RainParameters;
use bansho_scene::{Scene, SceneError};

/// Every kind of this build, in the order in which schema and book list them.
pub const KINDS: &[PhenomenonKind] = &[
    #[cfg(feature = "fire")]
    FlameSheetParameters::KIND,
    #[cfg(feature = "fire")]
    FlameParticlesParameters::KIND,
    #[cfg(feature = "rain")]
    RainParameters::KIND,
    #[cfg(feature = "aurora")]
    AuroraParameters::KIND,
];

/// Every kind that there is, and the feature of this crate that brings it.
const FEATURES: [(&str, &str); 4] =
    [("flame_sheet", "fire"), ("flame_particles", "fire"), ("rain", "rain"), ("aurora", "aurora")];

/// Reads and checks a scene of every kind of phenomenon in this build; `file` is what errors call it. [`CompiledScene::build`] then reads
/// what it names and builds what it shows.
///
/// # Errors
/// Every fault of the text, with its place, what is wrong and what is allowed. A phenomenon whose feature is disabled names that feature.
///
/// [`CompiledScene::build`]: crate::CompiledScene::build
pub fn parse_scene(file: &str, text: &str) -> Result<Scene, SceneError> {
    Scene::parse(file, text, KINDS).map_err(|mut error| {
        error.problems.iter_mut().for_each(name_feature);
        error
    })
}

/// Says which feature brings a kind, where the problem is that this build does not know it.
fn name_feature(problem: &mut Problem) {
    let ProblemKind::UnknownKey { key, .. } = &problem.kind else { return };
    let disabled = FEATURES.into_iter().find(|(kind, _)| kind == key && !KINDS.iter().any(|known| known.key == *kind));
    if let Some((key, feature)) = disabled.filter(|_| problem.path.is_empty()) {
        problem.kind = ProblemKind::FeatureDisabled { key, feature };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_has_a_feature() {
        for kind in KINDS {
            assert!(FEATURES.iter().any(|(key, _)| *key == kind.key), "{}", kind.key);
        }
    }

    #[test]
    fn a_kind_that_is_left_out_names_its_feature() {
        for (key, feature) in FEATURES {
            let result = parse_scene("scene.toml", &format!("bansho = 2\n[[{key}]]\n"));
            if KINDS.iter().any(|kind| kind.key == key) {
                assert!(result.is_ok(), "{key}");
            } else {
                let error = result.err().unwrap().to_string();
                assert!(error.contains("scene.toml:2:3: "), "{error}");
                assert!(error.contains(&format!("enable the feature `{feature}`")), "{error}");
            }
        }
    }
}
