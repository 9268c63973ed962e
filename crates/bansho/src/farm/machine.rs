//! Whether a machine may draw frames of a plan: it sees the same folder, runs the same version, and its processor gives the same bytes.

use std::{io, sync::Arc};

use bansho_base::host::{assets::MemoryAssets, observer::Observer};
use bansho_media::files::{
    input::{self, InputError},
    provenance::PROGRAM,
};
use bansho_render::{Plan, PlanOptions, Shot};

use super::{
    error::FarmError,
    plan::{FarmFolder, FarmPlan},
};
use crate::{compile_scene, job::JobError};

/// Largest token file that is read, bytes.
const TOKEN_BYTES: u64 = 256;

/// A picture that passes through the arithmetic of every kind of phenomenon, small enough to be drawn by every task.
const PICTURE: &str = "bansho = 2\n[picture]\nsize = [48, 32]\nseed = 11\n";
#[cfg(feature = "fire")]
const FIRE: &str = "[[flame_sheet]]\n[[flame_particles]]\nparticles = 100\npreroll_s = 0.05\n";
#[cfg(not(feature = "fire"))]
const FIRE: &str = "";
#[cfg(feature = "rain")]
const RAIN: &str = "[[rain]]\nrate_mm_per_h = 10\n";
#[cfg(not(feature = "rain"))]
const RAIN: &str = "";
#[cfg(feature = "aurora")]
const AURORA: &str = "[[aurora]]\npreroll_s = 0.05\nparticles = { count = 500 }\nfield = { cells = 31 }\n";
#[cfg(not(feature = "aurora"))]
const AURORA: &str = "";

/// Hexadecimal digest of the floats of a small picture of every kind of phenomenon. Machines with the same digest are expected to draw the same bytes.
///
/// # Errors
/// The observer canceled it.
pub fn arithmetic_digest(observer: &dyn Observer) -> Result<String, FarmError> {
    let mut hasher = blake3::Hasher::new();
    // One after the other: an aurora outshines the others.
    for kind in [FIRE, RAIN, AURORA].iter().filter(|kind| !kind.is_empty()) {
        let scene = format!("{PICTURE}{kind}");
        let compiled = compile_scene("arithmetic", &scene, Arc::new(MemoryAssets::default()))
            .map_err(|error| JobError::Scene(Box::new(error)))?;
        let plan = Plan::new(&compiled, &PlanOptions::default()).map_err(JobError::Plan)?;
        let frame = crate::draw(&mut Shot::open(compiled, Arc::new(plan)), 1, observer).map_err(JobError::from)?;
        for value in frame.beauty.pixels().as_flattened() {
            hasher.update(&value.to_bits().to_le_bytes());
        }
    }
    Ok(hasher.finalize().to_hex().to_string())
}

/// What a task compares with its plan before it does anything.
pub struct TaskCheck<'a> {
    /// The folder of the plan.
    pub folder: &'a FarmFolder,
    /// The token that the task was submitted with.
    pub token: &'a str,
}

impl TaskCheck<'_> {
    /// Whether the token that this machine sees is that of the plan. On a shared file system it may become visible some time after it was written.
    ///
    /// # Errors
    /// There is another token, or none.
    pub fn token(&self) -> Result<(), FarmError> {
        let path = self.folder.token();
        let found = match input::read(&path, TOKEN_BYTES) {
            Ok(bytes) if bytes.trim_ascii_end() == self.token.as_bytes() => return Ok(()),
            Ok(bytes) => format!("`{}`", String::from_utf8_lossy(bytes.trim_ascii_end())),
            Err(InputError::Io(error)) if error.kind() == io::ErrorKind::NotFound => "no file".to_owned(),
            Err(source) => return Err(FarmError::Input { path, source }),
        };
        Err(FarmError::Token { path, expected: self.token.to_owned(), found })
    }

    /// The plan, if this program and this processor may work on it.
    ///
    /// # Errors
    /// The plan cannot be read, was replaced, or was made by another version or on a machine with other arithmetic.
    pub fn plan(&self, observer: &dyn Observer) -> Result<FarmPlan, FarmError> {
        let plan = self.folder.read_plan()?;
        if plan.token != self.token {
            return Err(FarmError::PlanReplaced);
        }
        if plan.program != PROGRAM {
            return Err(FarmError::Version { expected: plan.program, found: PROGRAM.to_owned() });
        }
        if plan.arithmetic != arithmetic_digest(observer)? {
            return Err(FarmError::Arithmetic);
        }
        Ok(plan)
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::{
        host::observer::Unobserved,
        math::simd::{VectorLevel, set_vector_level},
    };

    use super::*;
    use crate::farm::plan::tests::plan;

    #[test]
    fn the_digest_does_not_depend_on_the_width_of_vectors() {
        let digest = arithmetic_digest(&Unobserved).unwrap();
        for level in VectorLevel::available() {
            set_vector_level(Some(level)).unwrap();
            assert_eq!(arithmetic_digest(&Unobserved).unwrap(), digest, "{level}");
        }
        set_vector_level(None).unwrap();
    }

    #[test]
    fn machines_that_would_mix_frames_are_refused() {
        let root = tempfile::tempdir().unwrap();
        let folder = FarmFolder::new(root.path().to_path_buf());
        let check = TaskCheck { folder: &folder, token: "0123" };
        assert!(matches!(check.token(), Err(FarmError::Token { found, .. }) if found == "no file"));
        let arithmetic = arithmetic_digest(&Unobserved).unwrap();
        let good = FarmPlan { arithmetic, ..plan() };
        folder.write_plan(&good).unwrap();
        check.token().unwrap();
        assert_eq!(check.plan(&Unobserved).unwrap(), good);
        let other = TaskCheck { folder: &folder, token: "4567" };
        assert!(matches!(other.token(), Err(FarmError::Token { found, .. }) if found == "`0123`"));
        assert!(matches!(other.plan(&Unobserved), Err(FarmError::PlanReplaced)));
        folder.write_plan(&FarmPlan { program: "Bansho 0.0.1".into(), ..good.clone() }).unwrap();
        assert!(matches!(check.plan(&Unobserved), Err(FarmError::Version { .. })));
        folder.write_plan(&FarmPlan { arithmetic: "00".into(), ..good }).unwrap();
        assert!(matches!(check.plan(&Unobserved), Err(FarmError::Arithmetic)));
    }
}
