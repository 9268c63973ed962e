//! The plan of the tasks of a shot, and the files of the folder that it is in.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use bansho::{
    job::frames,
    media::files::{
        atomic,
        input::{self, InputError},
        overwrite_policy::OverwritePolicy,
        provenance::{COMMENT_LINE, PROGRAM},
    },
};
use serde::{Deserialize, Serialize};

use super::{
    chunks::ChunkGrid,
    costs::ShotCosts,
    error::FarmError,
    products::{Products, shot_stem},
};

/// Value of `"format"` in the file of a plan.
const FORMAT: u32 = 2;
/// Largest file of a plan that is read, bytes: some ten million frames in as many ranges.
const PLAN_BYTES: u64 = 256 << 20;
/// Most columns and rows of tiles.
const MAX_TILES: usize = 4096;

/// Names of all scripts.
const SCRIPT_NAMES: [&str; 5] = ["check.sbatch", "snapshots.sbatch", "frames.sbatch", "finish.sbatch", "submit.sh"];

/// A file to be written to the folder of the plan.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Script {
    /// Its name: `check.sbatch`, `snapshots.sbatch`, `frames.sbatch`, `finish.sbatch` or `submit.sh`.
    pub name: String,
    /// Its text.
    pub text: String,
}

/// How a shot is cut into tasks. Chunk `c` and tile `t` of `n` tiles are task `c n + t`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FarmPlan {
    pub(crate) format: u32,
    /// The program and its version.
    pub program: String,
    /// A random word that tells this plan from all others.
    pub token: String,
    /// Digest of what the arithmetic of the planning machine gives.
    pub arithmetic: String,
    /// The folder to which relative paths of the arguments refer.
    pub folder: PathBuf,
    /// Arguments of `bansho render` that all tasks have.
    pub arguments: Vec<String>,
    /// All frames, in the syntax of frame lists.
    pub(crate) frames: String,
    /// The first frame of the scene, from which chunks are counted.
    pub first_frame: i64,
    /// Number of frames of a chunk.
    pub chunk_frames: u64,
    /// Columns and rows of tiles of a picture.
    pub tiles: [usize; 2],
    /// Whether chunks begin with snapshots.
    pub snapshots: bool,
    /// What is made at the end.
    pub products: Products,
    /// For each chunk the digest of the fingerprints of its frames, hexadecimal.
    pub digests: Vec<String>,
    /// What frames cost on the planning machine.
    pub costs: ShotCosts,
}

/// What is read first of a plan, which may be of another version.
#[derive(Deserialize)]
struct PlanFormat {
    format: u32,
}

/// What of a plan does not follow from the shot.
#[derive(Clone, Debug, Default)]
pub struct FarmPlanOptions {
    /// A random word.
    pub token: String,
    /// Digest of the arithmetic of this machine.
    pub arithmetic: String,
    /// The current folder.
    pub folder: PathBuf,
    /// Arguments of `bansho render`.
    pub arguments: Vec<String>,
    /// Columns and rows of tiles.
    pub tiles: [usize; 2],
    /// Whether chunks begin with snapshots.
    pub snapshots: bool,
    /// What is made at the end.
    pub products: Products,
    /// What frames cost.
    pub costs: ShotCosts,
}

impl FarmPlan {
    /// The plan of the tasks of `grid`, whose chunks have `digests`.
    pub fn new(
        options: FarmPlanOptions,
        grid: &ChunkGrid,
        first_frame: i64,
        chunk_frames: u64,
        digests: Vec<String>,
    ) -> Self {
        let FarmPlanOptions { token, arithmetic, folder, arguments, tiles, snapshots, products, costs } = options;
        Self {
            format: FORMAT,
            program: PROGRAM.to_owned(),
            token,
            arithmetic,
            folder,
            arguments,
            frames: frames::format_list(grid.frames()),
            first_frame,
            chunk_frames,
            tiles,
            snapshots,
            products,
            digests,
            costs,
        }
    }

    /// The chunks.
    ///
    /// # Errors
    /// The list of frames is damaged.
    pub fn grid(&self) -> Result<ChunkGrid, FarmError> {
        Ok(ChunkGrid::new(self.first_frame, self.chunk_frames, frames::parse(&self.frames)?))
    }

    /// Number of tiles of a picture.
    pub fn tile_count(&self) -> usize {
        self.tiles[0].saturating_mul(self.tiles[1]).max(1)
    }

    /// Number of tasks.
    pub fn task_count(&self) -> usize {
        self.digests.len().saturating_mul(self.tile_count())
    }
}

/// The folder of a plan, beside the frames.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FarmFolder {
    root: PathBuf,
}

impl FarmFolder {
    /// The folder at `root`.
    pub fn new(root: PathBuf) -> Self {
        Self { root }
    }

    /// The folder for the frames at `output`, such as `shot/fire.####.exr`: `shot/fire.farm`.
    pub fn beside(output: &Path) -> Self {
        Self::new(output.with_file_name(format!("{}.farm", shot_stem(output))))
    }

    /// The folder itself.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// The plan.
    pub fn plan(&self) -> PathBuf {
        self.root.join("plan.json")
    }

    /// The file by which machines recognize the folder.
    pub fn token(&self) -> PathBuf {
        self.root.join("token")
    }

    /// The file by which machines recognize the folder of a template of Open Job Description.
    pub fn template_token(&self) -> PathBuf {
        self.root.join("template")
    }

    /// What the machine `identity` was found to be.
    pub fn machine(&self, identity: &str) -> PathBuf {
        self.root.join("machines").join(identity)
    }

    /// Snapshots of simulations.
    pub fn snapshots(&self) -> PathBuf {
        self.root.join("states")
    }

    /// Journals of tasks.
    pub fn journal(&self) -> PathBuf {
        self.root.join("journal")
    }

    /// What tasks print.
    pub fn logs(&self) -> PathBuf {
        self.root.join("log")
    }

    /// The numbers of the jobs that were submitted.
    pub fn jobs(&self) -> PathBuf {
        self.root.join("jobs")
    }

    /// Tiles number `tile` of all frames.
    pub fn tile(&self, tile: usize) -> PathBuf {
        self.root.join("tiles").join(tile.to_string())
    }

    /// Checks that what planning writes to the folder does not replace anything else: before what may take long.
    ///
    /// # Errors
    /// A file of one of its names is there that must not be replaced, or a link.
    pub fn check_files(&self, policy: &OverwritePolicy) -> Result<(), FarmError> {
        let policy = policy.clone().without_links();
        let scripts = SCRIPT_NAMES.map(|name| self.root.join(name));
        let files = [self.plan(), self.token(), self.jobs()].into_iter().chain(scripts);
        Ok(files.into_iter().try_for_each(|path| atomic::check(&path, &policy))?)
    }

    /// Writes a script into the folder.
    ///
    /// # Errors
    /// It cannot be written, or something else has its name.
    pub fn write_script(&self, script: &Script, policy: &OverwritePolicy) -> Result<(), FarmError> {
        let policy = policy.clone().without_links();
        Ok(atomic::write_bytes(&self.root.join(&script.name), script.text.as_bytes(), &policy)?)
    }

    /// Leaves the token of a template of Open Job Description.
    ///
    /// # Errors
    /// It cannot be written, or something else has its name.
    pub fn write_template_token(&self, token: &str) -> Result<(), FarmError> {
        let policy = OverwritePolicy::default().without_links();
        Ok(atomic::write_bytes(&self.template_token(), token_text(token).as_bytes(), &policy)?)
    }

    /// Reads the plan.
    ///
    /// # Errors
    /// There is none, or the file is no plan.
    pub fn read_plan(&self) -> Result<FarmPlan, FarmError> {
        let path = self.plan();
        let bytes = match input::read(&path, PLAN_BYTES) {
            Err(InputError::Io(error)) if error.kind() == io::ErrorKind::NotFound => {
                return Err(FarmError::NoPlan { path });
            }
            Err(source) => return Err(FarmError::Input { path, source }),
            Ok(bytes) => bytes,
        };
        let text = String::from_utf8_lossy(&bytes);
        if let Ok(PlanFormat { format }) = serde_json::from_str(&text)
            && format != FORMAT
        {
            let reason = format!("its format is {format}; allowed: {FORMAT}");
            return Err(FarmError::PlanFormat { path, reason });
        }
        let Some(object) = unsigned(&text) else { return Err(FarmError::PlanChanged { path }) };
        let plan: FarmPlan = serde_json::from_str(&object)
            .map_err(|error| FarmError::PlanFormat { path: path.clone(), reason: error.to_string() })?;
        if plan.tiles.iter().any(|side| !(1..=MAX_TILES).contains(side)) || plan.digests.len() != plan.grid()?.count() {
            let reason = "its numbers of tiles and chunks do not match".to_owned();
            return Err(FarmError::PlanFormat { path, reason });
        }
        Ok(plan)
    }

    /// Writes the plan and its token, and makes the folders that tasks write to.
    ///
    /// # Errors
    /// A file or folder cannot be written.
    pub fn write_plan(&self, plan: &FarmPlan, policy: &OverwritePolicy) -> Result<(), FarmError> {
        for path in [self.journal(), self.logs()] {
            fs::create_dir_all(&path).map_err(|source| FarmError::Io { path, source })?;
        }
        let text = serde_json::to_string_pretty(plan)
            .map_err(|error| FarmError::PlanFormat { path: self.plan(), reason: error.to_string() })?;
        // Both before any is written, so that either all is of this plan or nothing.
        let policy = policy.clone().without_links();
        let files = [(self.plan(), signed(&text)), (self.token(), token_text(&plan.token))];
        files.iter().try_for_each(|(path, _)| atomic::check(path, &policy))?;
        // The token last: whoever sees it sees the plan, too.
        Ok(files.iter().try_for_each(|(path, text)| atomic::write_bytes(path, text.as_bytes(), &policy))?)
    }
}

/// The text of a token file.
fn token_text(token: &str) -> String {
    format!("{COMMENT_LINE}{token}\n")
}

/// What stands before the digest of a plan, which is its last entry.
const DIGEST_KEY: &str = ",\n  \"digest\": \"";
/// What stands after it.
const DIGEST_END: &str = "\"\n}\n";

/// A JSON object with the digest of all that stands before it.
fn signed(object: &str) -> String {
    let start = object.trim_end().trim_end_matches('}').trim_end();
    let digest = blake3::hash(start.as_bytes()).to_hex();
    format!("{start}{DIGEST_KEY}{digest}{DIGEST_END}")
}

/// The JSON object in a text of [`signed`], without its digest. `None` if the text is another one now.
fn unsigned(text: &str) -> Option<String> {
    let (start, rest) = text.rsplit_once(DIGEST_KEY)?;
    let digest = rest.strip_suffix(DIGEST_END)?;
    (digest == blake3::hash(start.as_bytes()).to_hex().as_str()).then(|| format!("{start}\n}}\n"))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) fn plan() -> FarmPlan {
        let grid = ChunkGrid::new(0, 4, (0..10).collect());
        let options = FarmPlanOptions {
            token: "0123".into(),
            arithmetic: "ab".into(),
            folder: "/shots".into(),
            arguments: vec!["fire.toml".into(), "--size=8x8".into()],
            tiles: [1, 1],
            ..FarmPlanOptions::default()
        };
        FarmPlan::new(options, &grid, 0, 4, vec![String::new(); grid.count()])
    }

    #[test]
    fn a_plan_is_read_as_it_was_written() {
        let folder = tempfile::tempdir().unwrap();
        let farm = FarmFolder::new(folder.path().join("a.farm"));
        assert!(matches!(farm.read_plan(), Err(FarmError::NoPlan { .. })));
        farm.write_plan(&plan(), &OverwritePolicy::default()).unwrap();
        let read = farm.read_plan().unwrap();
        assert_eq!(read, plan());
        assert_eq!((read.grid().unwrap().chunk(2), read.task_count()), (&[8, 9][..], 3));
        for file in [farm.plan(), farm.token()] {
            assert!(bansho::media::files::provenance::is_bansho_file(&file), "{}", file.display());
        }
    }

    #[test]
    fn a_plan_that_was_edited_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let farm = FarmFolder::new(folder.path().to_path_buf());
        farm.write_plan(&plan(), &OverwritePolicy::default()).unwrap();
        let whole = fs::read_to_string(farm.plan()).unwrap();
        for (from, to) in [
            ("--size=8x8", "--out=/elsewhere/a.png"),
            ("\"/shots\"", "\"/\""),
            ("\"film\": null", "\"film\": \"/elsewhere/a.gif\""),
            ("\n  \"tiles\"", "\n   \"tiles\""),
            ("\"digest\": \"", "\"digest\": \"0"),
        ] {
            let edited = whole.replace(from, to);
            assert_ne!(edited, whole, "{from}");
            fs::write(farm.plan(), edited).unwrap();
            let error = farm.read_plan().unwrap_err();
            assert!(matches!(error, FarmError::PlanChanged { .. }), "{from}: {error}");
        }
        fs::write(farm.plan(), whole).unwrap();
        farm.read_plan().unwrap();
    }

    #[test]
    fn damaged_plans_and_those_of_other_formats_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let farm = FarmFolder::new(folder.path().to_path_buf());
        farm.write_plan(&plan(), &OverwritePolicy::default()).unwrap();
        let whole = fs::read_to_string(farm.plan()).unwrap();
        for bad in [&whole[..whole.len() / 2], "", "[]"] {
            fs::write(farm.plan(), bad).unwrap();
            assert!(matches!(farm.read_plan(), Err(FarmError::PlanChanged { .. })), "{bad}");
        }
        let object = unsigned(&whole).unwrap();
        for bad in [
            &whole.replace("\"format\": 2", "\"format\": 1"),
            &signed(&object.replace("\"chunk_frames\": 4", "\"chunk_frames\": 3")),
            &signed(&object.replace("chunk_frames", "pieces")),
        ] {
            fs::write(farm.plan(), bad).unwrap();
            assert!(matches!(farm.read_plan(), Err(FarmError::PlanFormat { .. })), "{bad}");
        }
    }

    #[test]
    fn the_folder_stands_beside_the_frames() {
        for (output, folder) in [
            ("shot/fire.####.exr", "shot/fire.farm"),
            ("fire_%04d.png", "fire_.farm"),
            ("out/a/a.png", "out/a/a.farm"),
            ("####.png", ".farm"),
            ("a%#b.####.png", "a#b.farm"),
            ("50%%.####.png", "50%.farm"),
        ] {
            assert_eq!(FarmFolder::beside(Path::new(output)).root(), Path::new(folder));
        }
    }
}
