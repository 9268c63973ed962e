//! The registry: the kinds of tables that scenes may contain, and the features that enable phenomena.

#[cfg(feature = "aurora")]
use bansho_aurora::AuroraParameters;
use bansho_base::{
    parameters::{Problem, ProblemKind},
    tables::{self, TableKind},
};
use bansho_environment::{
    fog::FogParameters, ground::GroundParameters, lamps::LightParameters, sky::SkyParameters,
    solids::ObstacleParameters,
};
#[cfg(feature = "fire")]
use bansho_fire::{particles::FlameParticlesParameters, sheet::FlameSheetParameters, volume::FlameVolumeParameters};
#[cfg(feature = "rain")]
use bansho_rain::RainParameters;
use bansho_scene::{Scene, SceneError, kinds};

/// The registry of this build: all kinds of tables, in the order of the schema and the book. A program that has phenomena of its own passes a longer one
/// to [`Scene::parse`].
pub const KINDS: &[TableKind] = &[
    kinds::PICTURE,
    kinds::CAMERA,
    kinds::PLATE,
    kinds::WIND,
    kinds::AIR,
    SkyParameters::KIND,
    GroundParameters::KIND,
    LightParameters::KIND,
    ObstacleParameters::KIND,
    FogParameters::KIND,
    #[cfg(feature = "fire")]
    FlameSheetParameters::KIND,
    #[cfg(feature = "fire")]
    FlameParticlesParameters::KIND,
    #[cfg(feature = "fire")]
    FlameVolumeParameters::KIND,
    #[cfg(feature = "rain")]
    RainParameters::KIND,
    #[cfg(feature = "aurora")]
    AuroraParameters::KIND,
];

/// The kinds of phenomena of this build.
pub fn phenomena() -> impl Iterator<Item = &'static TableKind> + Clone {
    tables::phenomena(KINDS)
}

/// All kinds of phenomena of Bansho, also those that are disabled in this build, each with the feature of this crate that enables it.
const FEATURES: [(&str, &str); 5] = [
    ("flame_sheet", "fire"),
    ("flame_particles", "fire"),
    ("flame_volume", "fire"),
    ("rain", "rain"),
    ("aurora", "aurora"),
];

/// Parses and checks a scene with the tables of this build; `file` is its name in messages. [`CompiledScene::build`] then reads the
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
    let disabled = FEATURES.into_iter().find(|(kind, _)| kind == key && tables::find(KINDS, kind).is_none());
    if let Some((key, feature)) = disabled.filter(|_| problem.path.is_empty()) {
        problem.kind = ProblemKind::FeatureDisabled { key, feature };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_has_a_feature() {
        for kind in phenomena() {
            assert!(FEATURES.iter().any(|(key, _)| *key == kind.key), "{}", kind.key);
        }
    }

    #[test]
    fn a_disabled_kind_names_its_feature() {
        for (key, feature) in FEATURES {
            let result = parse_scene("scene.toml", &format!("bansho = 2\n[[{key}]]\n"));
            if tables::find(KINDS, key).is_some() {
                assert!(result.is_ok(), "{key}");
            } else {
                let error = result.err().unwrap().to_string();
                assert!(error.contains("scene.toml:2:3: "), "{error}");
                assert!(error.contains(&format!("enable the feature `{feature}`")), "{error}");
            }
        }
    }
}
