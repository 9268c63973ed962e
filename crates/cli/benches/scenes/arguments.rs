//! The arguments of the benchmark.

use std::{
    fs,
    path::{Path, PathBuf},
};

/// What is measured, and what becomes of it.
pub(crate) struct Arguments {
    /// Names of the scenes; all if empty.
    scenes: Vec<String>,
    /// Frames that are measured after the first, for a still camera and for a moving one.
    pub(crate) frames: i64,
    pub(crate) size: [usize; 2],
    /// Side of the picture of a fisheye lens.
    pub(crate) dome_size: usize,
    pub(crate) threads: usize,
    json: Option<PathBuf>,
    pub(crate) check: Option<PathBuf>,
    pub(crate) record: Option<PathBuf>,
}

impl Arguments {
    /// `None` where the arguments are those of criterion, or where `cargo test` only wants to see it start.
    pub(crate) fn parse(arguments: impl Iterator<Item = String>) -> Result<Option<Self>, String> {
        let mut parsed = Self {
            scenes: Vec::new(),
            frames: 5,
            size: [1280, 720],
            dome_size: 1024,
            threads: 1,
            json: None,
            check: None,
            record: None,
        };
        let (mut arguments, mut is_bench) = (arguments, false);
        while let Some(argument) = arguments.next() {
            let mut value = || arguments.next().ok_or_else(|| format!("{argument} needs a value"));
            match argument.as_str() {
                "--noplot" | "--test" | "--list" => return Ok(None),
                // Given by `cargo bench`.
                "--bench" => is_bench = true,
                "--frames" => parsed.frames = number(&value()?)?,
                "--size" => {
                    let value = value()?;
                    let (width, height) = value.split_once('x').ok_or("--size is WIDTHxHEIGHT")?;
                    parsed.size = [number(width)?, number(height)?];
                }
                "--dome-size" => parsed.dome_size = number(&value()?)?,
                "--threads" => parsed.threads = number(&value()?)?,
                "--json" => parsed.json = Some(in_workspace(&value()?)),
                "--check" => parsed.check = Some(in_workspace(&value()?)),
                "--record" => parsed.record = Some(in_workspace(&value()?)),
                option if option.starts_with('-') => return Err(format!("no such option: {option}")),
                scene => parsed.scenes.push(scene.to_owned()),
            }
        }
        Ok(is_bench.then_some(parsed))
    }

    /// The files of the scenes in alphabetical order.
    pub(crate) fn scene_files(&self) -> Result<Vec<PathBuf>, String> {
        let folder = in_workspace("scenes");
        let entries = fs::read_dir(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
        let mut files: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
        files.retain(|file| file.extension().is_some_and(|extension| extension == "toml"));
        let name = |file: &PathBuf| file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        if let Some(unknown) = self.scenes.iter().find(|scene| !files.iter().any(|file| name(file) == **scene)) {
            return Err(format!("no such scene: {unknown}"));
        }
        files.retain(|file| self.scenes.is_empty() || self.scenes.contains(&name(file)));
        files.sort();
        Ok(files)
    }

    /// Where the numbers go.
    pub(crate) fn json_file(&self) -> PathBuf {
        let target = || std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| in_workspace("target"), PathBuf::from);
        self.json.clone().unwrap_or_else(|| target().join("scenes.json"))
    }
}

fn number<N: std::str::FromStr>(text: &str) -> Result<N, String> {
    text.parse().map_err(|_| format!("not a possible number: {text}"))
}

/// A path relative to the workspace, where the caller of `cargo bench` is; benchmarks themselves run in the folder of their crate.
fn in_workspace(path: &str) -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join(path)
}
