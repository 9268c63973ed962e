//! Whether a machine may draw frames of a plan: it sees the same folder, runs the same version, and its processor gives the same bytes.

use std::{io, path::PathBuf, sync::Arc};

use bansho::{
    MemoryAssets, Observer, Plan, PlanOptions, Shot, compile_scene,
    job::JobError,
    media::files::{
        atomic,
        input::{self, InputError},
        overwrite_policy::OverwritePolicy,
        provenance::{COMMENT_LINE, PROGRAM},
    },
};

use super::{
    error::FarmError,
    plan::{FarmFolder, FarmPlan},
};

/// Largest token file that is read, bytes.
const TOKEN_BYTES: u64 = 256;
/// Largest record of a machine that is read, bytes.
const RECORD_BYTES: u64 = 1024;

/// The head of pictures that pass through the arithmetic of every kind of phenomenon, small enough to be drawn by every task.
const PICTURE: &str = "bansho = 2\n[picture]\nsize = [48, 32]\nseed = 11\n";
/// The phenomena, one picture each: an aurora would outshine the others.
const PHENOMENA: [&str; 3] = [
    "[[flame_sheet]]\n[[flame_particles]]\nparticles = 100\npreroll_s = 0.05\n",
    "[[rain]]\nrate_mm_per_h = 10\n",
    "[[aurora]]\npreroll_s = 0.05\nparticles = { count = 500 }\nfield = { cells = 31 }\n",
];

/// Hexadecimal digest of the floats of a small picture of every kind of phenomenon. Machines with the same digest are expected to draw the same bytes.
///
/// # Errors
/// The observer canceled it.
pub fn arithmetic_digest(observer: &dyn Observer) -> Result<String, FarmError> {
    let mut hasher = blake3::Hasher::new();
    for phenomenon in PHENOMENA {
        let scene = format!("{PICTURE}{phenomenon}");
        let compiled = compile_scene("arithmetic", &scene, Arc::new(MemoryAssets::default()))
            .map_err(|error| JobError::Scene(Box::new(error)))?;
        let plan = Plan::new(&compiled, &PlanOptions::default()).map_err(JobError::Plan)?;
        let frame = bansho::draw(&mut Shot::open(compiled, Arc::new(plan)), 1, observer).map_err(JobError::from)?;
        for value in frame.beauty.pixels().as_flattened() {
            hasher.update(&value.to_bits().to_le_bytes());
        }
    }
    Ok(hasher.finalize().to_hex().to_string())
}

/// Checks that the token file at `path` has the word `expected`. On a shared file system it may become visible some time after it was written.
///
/// # Errors
/// There is another token, or none.
pub fn check_token(path: PathBuf, expected: &str) -> Result<(), FarmError> {
    let found = match input::read(&path, TOKEN_BYTES) {
        Ok(bytes) => {
            // After the line that marks the file, which may be of another version.
            let text = String::from_utf8_lossy(&bytes);
            let token = text.trim_end().lines().last().unwrap_or_default();
            if token == expected {
                return Ok(());
            }
            format!("`{token}`")
        }
        Err(InputError::Io(error)) if error.kind() == io::ErrorKind::NotFound => "no file".to_owned(),
        Err(source) => return Err(FarmError::Input { path, source }),
    };
    Err(FarmError::Token { path, expected: expected.to_owned(), found })
}

/// Checks that this program is `program`, and that its arithmetic on this machine has the digest `arithmetic`.
///
/// # Errors
/// It is another version, or draws other bytes.
pub fn check_bytes(program: &str, arithmetic: &str, observer: &dyn Observer) -> Result<(), FarmError> {
    if program != PROGRAM {
        return Err(FarmError::Version { expected: program.to_owned(), found: PROGRAM.to_owned() });
    }
    if arithmetic != arithmetic_digest(observer)? {
        return Err(FarmError::Arithmetic);
    }
    Ok(())
}

/// What a task compares with its plan before it does anything.
pub struct TaskCheck<'a> {
    /// The folder of the plan.
    pub folder: &'a FarmFolder,
    /// The token that the task was submitted with.
    pub token: &'a str,
    /// The identity of this machine since it was started, such as the boot id of Linux; `None` where it is unknown.
    pub machine: Option<&'a str>,
}

impl TaskCheck<'_> {
    /// Whether the token that this machine sees is that of the plan.
    ///
    /// # Errors
    /// There is another token, or none.
    pub fn token(&self) -> Result<(), FarmError> {
        check_token(self.folder.token(), self.token)
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
        if !self.is_recorded(&plan) {
            check_bytes(&plan.program, &plan.arithmetic, observer)?;
            self.record(&plan);
        }
        Ok(plan)
    }

    /// The file that tells what this machine was found to be. A name that is not that of a plain file is none.
    fn record_path(&self) -> Option<PathBuf> {
        let machine = self.machine?;
        let is_plain = !machine.is_empty() && machine.chars().all(|c| c.is_ascii_alphanumeric() || c == '-');
        is_plain.then(|| self.folder.machine(machine))
    }

    fn record_of(plan: &FarmPlan) -> String {
        format!("{COMMENT_LINE}{} {} {}\n", plan.token, plan.arithmetic, plan.program)
    }

    /// Whether a task of this plan has already found that this machine may work on it. The picture takes more time than all else before the first frame.
    fn is_recorded(&self, plan: &FarmPlan) -> bool {
        // Whatever the record says, this program draws no frames of another version.
        let Some(path) = self.record_path().filter(|_| plan.program == PROGRAM) else { return false };
        input::read(&path, RECORD_BYTES).is_ok_and(|record| record == Self::record_of(plan).as_bytes())
    }

    fn record(&self, plan: &FarmPlan) {
        if let Some(path) = self.record_path() {
            // Without it, as on a full disk, the next task draws the picture once more.
            let policy = OverwritePolicy::default().without_links();
            let _ = atomic::write_bytes(&path, Self::record_of(plan).as_bytes(), &policy);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};

    use bansho::{
        Stage, Unobserved,
        base::math::simd::{VectorLevel, set_vector_level},
    };

    use super::*;
    use crate::plan::tests::plan;

    /// Notes whether any stage of drawing began.
    #[derive(Default)]
    struct DrawingObserver(AtomicBool);

    impl Observer for DrawingObserver {
        fn begin(&self, _stage: Stage) {
            self.0.store(true, Ordering::Relaxed);
        }
    }

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
        let check = TaskCheck { folder: &folder, token: "0123", machine: None };
        assert!(matches!(check.token(), Err(FarmError::Token { found, .. }) if found == "no file"));
        let arithmetic = arithmetic_digest(&Unobserved).unwrap();
        let good = FarmPlan { arithmetic, ..plan() };
        folder.write_plan(&good, &OverwritePolicy::default()).unwrap();
        check.token().unwrap();
        assert_eq!(check.plan(&Unobserved).unwrap(), good);
        let other = TaskCheck { token: "4567", ..check };
        assert!(matches!(other.token(), Err(FarmError::Token { found, .. }) if found == "`0123`"));
        assert!(matches!(other.plan(&Unobserved), Err(FarmError::PlanReplaced)));
        folder
            .write_plan(&FarmPlan { program: "Bansho 0.0.1".into(), ..good.clone() }, &OverwritePolicy::default())
            .unwrap();
        assert!(matches!(check.plan(&Unobserved), Err(FarmError::Version { .. })));
        folder.write_plan(&FarmPlan { arithmetic: "00".into(), ..good }, &OverwritePolicy::default()).unwrap();
        assert!(matches!(check.plan(&Unobserved), Err(FarmError::Arithmetic)));
    }

    #[test]
    fn a_machine_draws_the_picture_once_for_a_plan() {
        let root = tempfile::tempdir().unwrap();
        let folder = FarmFolder::new(root.path().to_path_buf());
        let good = FarmPlan { arithmetic: arithmetic_digest(&Unobserved).unwrap(), ..plan() };
        folder.write_plan(&good, &OverwritePolicy::default()).unwrap();
        let draws = |token: &str, machine: Option<&str>| {
            let observer = DrawingObserver::default();
            TaskCheck { folder: &folder, token, machine }.plan(&observer).unwrap();
            observer.0.into_inner()
        };
        assert!(draws("0123", Some("a-1")));
        assert!(!draws("0123", Some("a-1")));
        assert!(draws("0123", Some("b-2")), "another machine");
        assert!(draws("0123", None) && draws("0123", None), "one that is not known");
        assert!(draws("0123", Some("../x")) && !root.path().join("x").exists());
        folder.write_plan(&FarmPlan { token: "4567".into(), ..good.clone() }, &OverwritePolicy::default()).unwrap();
        assert!(draws("4567", Some("a-1")), "another plan");
        folder.write_plan(&FarmPlan { arithmetic: "00".into(), ..good.clone() }, &OverwritePolicy::default()).unwrap();
        let check = TaskCheck { folder: &folder, token: "0123", machine: Some("b-2") };
        assert!(matches!(check.plan(&Unobserved), Err(FarmError::Arithmetic)));
        folder.write_plan(&FarmPlan { program: "Bansho 0.0.1".into(), ..good }, &OverwritePolicy::default()).unwrap();
        assert!(matches!(check.plan(&Unobserved), Err(FarmError::Version { .. })));
    }
}
