//! The kinds of phenomena that scenes may contain, and the features that enable them.

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

/// All kinds of this build, in the order of the schema and the book.
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

/// All kinds of Bansho, also those that are disabled in this build, each with the feature of this crate that enables it.
const FEATURES: [(&str, &str); 4] =
    [("flame_sheet", "fire"), ("flame_particles", "fire"), ("rain", "rain"), ("aurora", "aurora")];

/// Parses and checks a scene with the kinds of phenomena of this build; `file` is its name in messages. [`CompiledScene::build`] then reads the
/// files that it names and builds its phenomena.
///
/// # Errors
/// All problems of the text, each with its position, what is wrong and what is allowed. For a phenomenon whose feature is disabled, the error
/// names that feature.
///
/// [`CompiledScene::build`]: crate::CompiledScene::build
pub fn parse_scene(file: &str, text: &str) -> Result<Scene, SceneError> {
    Scene::parse(file, text, KINDS).map_err(|mut error| {
        error.problems.iter_mut().for_each(name_feature);
        error
    })
}

/// If the problem is an unknown key that is a disabled kind, replaces it by one that names the feature.
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
    fn a_disabled_kind_names_its_feature() {
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
