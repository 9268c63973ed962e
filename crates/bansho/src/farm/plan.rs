//! The plan of the tasks of a shot, and the files of the folder that it is in.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use bansho_media::files::{
    atomic,
    input::{self, InputError},
    provenance::PROGRAM,
};
use serde::{Deserialize, Serialize};

use super::{
    chunks::{ChunkGrid, ShotCosts},
    error::FarmError,
    products::Products,
};
use crate::job::frames;

/// Value of `"format"` in the file of a plan.
const FORMAT: u32 = 1;
/// Largest file of a plan that is read, bytes: some ten million frames in as many ranges.
const PLAN_BYTES: u64 = 256 << 20;
/// Most columns and rows of tiles.
const MAX_TILES: usize = 4096;

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

/// What of a plan does not follow from the shot.
#[derive(Clone, Debug, Default)]
pub struct PlanOptions {
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
        options: PlanOptions,
        grid: &ChunkGrid,
        first_frame: i64,
        chunk_frames: u64,
        digests: Vec<String>,
    ) -> Self {
        let PlanOptions { token, arithmetic, folder, arguments, tiles, snapshots, products, costs } = options;
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
        let name = output.file_name().unwrap_or_default().to_string_lossy();
        let stem: String = name.chars().take_while(|c| !matches!(c, '.' | '#' | '%')).collect();
        Self::new(output.with_file_name(format!("{stem}.farm")))
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
        let plan: FarmPlan = serde_json::from_slice(&bytes)
            .map_err(|error| FarmError::PlanFormat { path: path.clone(), reason: error.to_string() })?;
        if plan.format != FORMAT {
            let reason = format!("its format is {}; allowed: {FORMAT}", plan.format);
            return Err(FarmError::PlanFormat { path, reason });
        }
        if plan.tiles.iter().any(|side| !(1..=MAX_TILES).contains(side)) || plan.digests.len() != plan.grid()?.count() {
            let reason = "its numbers of tiles and chunks do not fit".to_owned();
            return Err(FarmError::PlanFormat { path, reason });
        }
        Ok(plan)
    }

    /// Writes the plan and its token, and makes the folders that tasks write to.
    ///
    /// # Errors
    /// A file or folder cannot be written.
    pub fn write_plan(&self, plan: &FarmPlan) -> Result<(), FarmError> {
        for path in [self.journal(), self.logs()] {
            fs::create_dir_all(&path).map_err(|source| FarmError::Io { path, source })?;
        }
        let text = serde_json::to_string_pretty(plan)
            .map_err(|error| FarmError::PlanFormat { path: self.plan(), reason: error.to_string() })?;
        atomic::write_bytes(&self.plan(), format!("{text}\n").as_bytes())?;
        // Last: whoever sees the token sees the plan, too.
        Ok(atomic::write_bytes(&self.token(), format!("{}\n", plan.token).as_bytes())?)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) fn plan() -> FarmPlan {
        let grid = ChunkGrid::new(0, 4, (0..10).collect());
        let options = PlanOptions {
            token: "0123".into(),
            arithmetic: "ab".into(),
            folder: "/shots".into(),
            arguments: vec!["fire.toml".into(), "--size=8x8".into()],
            tiles: [1, 1],
            ..PlanOptions::default()
        };
        FarmPlan::new(options, &grid, 0, 4, vec![String::new(); grid.count()])
    }

    #[test]
    fn a_plan_is_read_as_it_was_written() {
        let folder = tempfile::tempdir().unwrap();
        let farm = FarmFolder::new(folder.path().join("a.farm"));
        assert!(matches!(farm.read_plan(), Err(FarmError::NoPlan { .. })));
        farm.write_plan(&plan()).unwrap();
        let read = farm.read_plan().unwrap();
        assert_eq!(read, plan());
        assert_eq!((read.grid().unwrap().chunk(2), read.task_count()), (&[8, 9][..], 3));
        assert!(bansho_media::files::provenance::is_bansho_file(&farm.plan()));
    }

    #[test]
    fn damaged_plans_and_those_of_other_formats_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let farm = FarmFolder::new(folder.path().to_path_buf());
        farm.write_plan(&plan()).unwrap();
        let whole = fs::read_to_string(farm.plan()).unwrap();
        for bad in [
            &whole[..whole.len() / 2],
            "",
            "[]",
            &whole.replace("\"format\": 1", "\"format\": 2"),
            &whole.replace("\"chunk_frames\": 4", "\"chunk_frames\": 3"),
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
        ] {
            assert_eq!(FarmFolder::beside(Path::new(output)).root(), Path::new(folder));
        }
    }
}
